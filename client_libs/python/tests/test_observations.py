"""Tests of streams of observations and of fused layers."""

from __future__ import annotations

import dataclasses
import pathlib
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
import shapely
from server import Server

from hypermap_client import (
    CellPatch,
    Client,
    CorrectedPose,
    DepthView,
    Detection,
    FailedPrecondition,
    GridGeometry,
    HeightRange,
    InvalidArgument,
    LayerKind,
    LayerSpec,
    NotFound,
    ObjectEventKind,
    Observation,
    ObservationOutcome,
    Pose,
    SensorPose,
)

START = datetime.now(timezone.utc) - timedelta(minutes=1)
# Rotation from the optical frame of the camera (x right, y down, z forward) to the map. The camera
# looks along the x axis of the map.
MAP_FROM_CAMERA = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def observation(sequence: int, robot: str = "rob", x: float = 2.0) -> Observation:
    """An observation from the origin of a chair with sides of half a metre at (x, 0)."""
    side = np.linspace(-0.24, 0.24, 25)
    points = np.stack(np.meshgrid(x + side, side), axis=-1).reshape(-1, 2)
    chair = Detection(
        scores={"chair": 0.9},
        hull=shapely.MultiPoint(points).convex_hull,
        cells=CellPatch.from_points(points, 0.05),
        height=HeightRange(0.0, 0.8),
        num_points=len(points),
        range_m=x,
    )
    cone = shapely.Polygon([(0, 0), (4, -2), (4, 2)])
    return Observation(
        robot=robot,
        sequence=sequence,
        stamp=START + timedelta(seconds=sequence),
        pose=SensorPose(MAP_FROM_CAMERA, np.array([0.0, 0.0, 1.2]), np.diag([1e-4, 1e-4, 1e-5])),
        detections=(chair,),
        view_hull=cone,
        free_space=cone,
    )


@pytest.fixture
def fused(client: Client, site: str) -> str:
    make_layers(client, site)
    return site


def make_layers(client: Client, name: str) -> None:
    client.create_layer(name, LayerSpec(name="found", kind=LayerKind.SEMANTIC))
    client.create_layer(
        name, LayerSpec(name="seen", kind=LayerKind.EXPLORATION, grid=GridGeometry(0.5))
    )


def test_repeated_observations_make_an_object(client: Client, fused: str) -> None:
    with client.observe(fused, "found", robot="rob", exploration_layer="seen") as stream:
        assert stream.opened.strategy == "evidence"
        assert stream.opened.known == ()
        answers = stream.submit(observation(i) for i in range(40))
    assert [(a.robot, a.sequence) for a in answers] == [("rob", i) for i in range(40)]
    assert {a.outcome for a in answers} == {ObservationOutcome.ACCEPTED}
    assert all(a.revision > 0 and not a.message for a in answers)
    (chair,) = client.query_value(fused, "chair", layers="found").objects
    assert chair.existence > 0.5
    truth = shapely.box(1.75, -0.25, 2.25, 0.25)
    overlap = chair.polygon.intersection(truth).area / chair.polygon.union(truth).area
    assert overlap > 0.7
    explored = client.query_value(fused, "explored").layers
    assert sum(answer.cells.num_cells for answer in explored if answer.cells) > 10

    history = client.explain_object(fused, "found", chair.id)
    assert history.events[0].kind == ObjectEventKind.FOUNDED
    assert (history.events[0].robot, history.events[0].stamp) == ("rob", START)
    assert len(history.events) == 40 and history.events[-1].existence > 0.5


def test_what_was_seen_relative_to_the_view_lies_where_the_view_is(
    client: Client, fused: str
) -> None:
    view = Pose(10.0, 5.0, np.pi / 2)
    with client.observe(fused, "found") as stream:
        stream.submit(dataclasses.replace(observation(i), frame_from_view=view) for i in range(40))
    (chair,) = client.query_value(fused, "chair", layers="found").objects
    assert chair.polygon.centroid.distance(shapely.Point(10.0, 7.0)) < 0.05


def test_c2_the_skew_of_a_robots_clock_is_told(client: Client, fused: str) -> None:
    ahead = datetime.now(timezone.utc) + timedelta(minutes=9, seconds=58)
    with client.observe(fused, "found") as stream:
        (rogue,) = stream.submit([dataclasses.replace(observation(1, "rogue"), stamp=ahead)])
        (honest,) = stream.submit([observation(1)])
        (again,) = stream.submit([observation(1)])
    assert rogue.outcome == honest.outcome == ObservationOutcome.ACCEPTED
    assert rogue.clock_skew_s is not None and 0 < rogue.clock_skew_s < 599
    assert honest.clock_skew_s is not None and honest.clock_skew_s < 0
    assert again.clock_skew_s is None


def test_each_observation_counts_once(client: Client, fused: str) -> None:
    with client.observe(fused, "found", robot="rob") as stream:
        stream.submit([observation(1), observation(2), observation(5)])
        (again, other, invalid) = stream.submit(
            [observation(1), observation(2, x=3.0), observation(7, robot="")]
        )
    assert again.outcome == ObservationOutcome.DUPLICATE
    assert other.outcome == ObservationOutcome.CONFLICT and other.message
    assert invalid.outcome == ObservationOutcome.INVALID and "robot" in invalid.message
    with client.observe(fused, "found", robot="rob") as stream:
        assert stream.opened.known == (range(1, 3), range(5, 6))
        assert stream.opened.knows(2) and not stream.opened.knows(3)
        (single,) = stream.submit(observation(3))
        assert single.outcome == ObservationOutcome.ACCEPTED
        with pytest.raises(ValueError, match="the same robot and sequence"):
            stream.submit([observation(8), observation(9), observation(8)])


def test_a_stream_resumes_after_a_server_restart(data_dir: pathlib.Path) -> None:
    with Server(data_dir) as server, Client(server.address) as client:
        client.create_map("site")
        make_layers(client, "site")
        with client.observe("site", "found", robot="rob", timeout=60) as stream:
            stream.submit(observation(1))
            server.kill()
            with Server(data_dir, listen=server.address):
                answers = stream.submit([observation(1), observation(2)])
                assert [a.outcome for a in answers] == [
                    ObservationOutcome.DUPLICATE,
                    ObservationOutcome.ACCEPTED,
                ]
                assert stream.opened.known == (range(1, 2),)


def test_an_observation_with_depth_is_accepted(client: Client, fused: str) -> None:
    depth = DepthView(
        np.full((3, 4), 2000, np.uint16), np.ones((3, 4), np.uint8), fx=4, fy=4, cx=1.5, cy=1
    )
    seen = observation(1)
    with client.observe(fused, "found") as stream:
        (answer,) = stream.submit(
            Observation(seen.robot, 1, seen.stamp, seen.pose, seen.detections, depth=depth)
        )
    assert answer.outcome == ObservationOutcome.ACCEPTED, answer.message


def test_retracting_a_source_removes_its_observations(client: Client, fused: str) -> None:
    with client.observe(fused, "found", exploration_layer="seen") as stream:
        stream.submit([observation(i) for i in range(10)])
        stream.submit([observation(i, robot="liar", x=3.0) for i in range(10)])
    assert len(client.query_value(fused, "chair").objects) == 2
    with pytest.raises(NotFound):
        client.retract_source(fused, "found", "liar", to_time=START)
    revision = client.retract_source(fused, "found", "liar", from_time=START)
    (chair,) = client.query_value(fused, "chair", min_revision=revision).objects
    assert chair.centroid.distance(shapely.Point(2, 0)) < 0.1


def test_corrected_poses_move_what_was_seen(client: Client, fused: str) -> None:
    with client.observe(fused, "found", exploration_layer="seen") as stream:
        stream.submit([observation(i) for i in range(10)])
    turned = Pose(5.0, 1.0, np.pi / 2)
    ends = [CorrectedPose(START + timedelta(seconds=s / 2), turned) for s in range(20)]
    with pytest.raises(NotFound):
        client.correct_poses(fused, "found", "other", ends)
    with pytest.raises(InvalidArgument, match=r"poses\[1\]"):
        client.correct_poses(fused, "found", "rob", ends[::-1])
    revision = client.correct_poses(fused, "found", "rob", ends)
    (chair,) = client.query_value(fused, "chair", min_revision=revision).objects
    assert chair.centroid.distance(shapely.Point(5, 3)) < 0.1
    assert client.query_point(fused, (5, 3))["seen"].value == 1
    assert client.query_point(fused, (2, 0))["seen"].value != 1


def test_smoothing_tells_what_it_has_moved(client: Client, fused: str) -> None:
    with client.observe(fused, "found") as stream:
        stream.submit([observation(i) for i in range(10)])
    revision = client.get_map(fused).revision
    smoothing = client.smooth_poses(fused, "found")
    # The observations have no depth by which they could be matched.
    assert (smoothing.revision, smoothing.matched, smoothing.moved) == (revision, 0, 0)
    assert (smoothing.rms_shift_m, smoothing.occupancy_layer) == (0.0, "")
    with pytest.raises(NotFound):
        client.smooth_poses(fused, "nothing")
    with pytest.raises(InvalidArgument, match="occupancy_layer"):
        client.smooth_poses(fused, "found", occupancy_layer="seen")


def test_rebuilding_a_layer_changes_its_strategy(client: Client, fused: str) -> None:
    with client.observe(fused, "found") as stream:
        stream.submit([observation(i) for i in range(10)])
    before = client.get_map(fused).revision
    assert client.rebuild_layer(fused, "found", strategy="paper") > before
    with client.observe(fused, "found") as stream:
        assert stream.opened.strategy == "paper"
    with pytest.raises(FailedPrecondition), client.observe(fused, "found", strategy="evidence"):
        pass
    with pytest.raises(FailedPrecondition), client.observe(fused, "seen"):
        pass
    with pytest.raises(NotFound), client.observe(fused, "nothing"):
        pass

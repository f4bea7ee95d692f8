"""Tests of explorations, with a robot in one room."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
import shapely

from hypermap_client import (
    Client,
    EndReason,
    ExplorationState,
    FailedPrecondition,
    FillPolygon,
    GoalOutcome,
    GridGeometry,
    LayerKind,
    LayerSpec,
    NotFound,
    Pose,
    WriteCells,
)

ROOM = shapely.box(0.0, 0.0, 6.0, 4.0)


@pytest.fixture
def room(client: Client, site: str) -> str:
    client.create_layer(
        site, LayerSpec(name="floor", kind=LayerKind.OCCUPANCY, grid=GridGeometry(0.1))
    )
    client.apply_edits(site, WriteCells("floor", np.zeros((40, 60))))
    return site


def start(client: Client, room: str) -> int:
    answer = client.start_exploration(
        room, ROOM, occupancy_layer="floor", exploration_layer="seen", robot_radius_m=0.2
    )
    assert answer.exploration.state == ExplorationState.ACTIVE
    assert answer.exploration.area.equals(ROOM) and answer.progress is None
    return answer.exploration.id


def test_the_life_cycle_of_an_exploration(client: Client, room: str) -> None:
    exploration_id = start(client, room)
    client.apply_edits(room, FillPolygon("seen", shapely.box(0, 0, 1, 4), 1.0))
    frontiers = client.list_frontiers(room, with_cells=True)
    assert frontiers.exploration_id == exploration_id
    (frontier,) = frontiers.frontiers
    assert frontier.num_cells == len(frontier.cells.geoms) == 40
    assert 1.0 < frontier.centroid.x < 1.2 and ROOM.covers(frontier.viewpoint)

    claim = client.claim_goal(room, "rob", Pose(0.5, 2.0, 0.0), lease=timedelta(minutes=2))
    assert claim.exploration_id == exploration_id and claim.goal.robot == "rob"
    assert ROOM.covers(claim.goal.position) and claim.goal.gain_cells > 4
    left = claim.goal.expire_time - datetime.now(timezone.utc)
    assert timedelta(seconds=30) < left < timedelta(minutes=3)
    renewed = client.renew_goal(room, "rob", claim.goal.id, lease=timedelta(minutes=9))
    assert renewed.expire_time > claim.goal.expire_time
    assert client.get_exploration(room).exploration.goals == (renewed,)

    client.apply_edits(room, FillPolygon("seen", ROOM, 1.0))
    client.release_goal(room, "rob", claim.goal.id, GoalOutcome.REACHED)
    with pytest.raises(NotFound):
        client.renew_goal(room, "rob", claim.goal.id)
    done = client.claim_goal(room, "rob", Pose(3.0, 2.0, 0.0))
    assert (done.state, done.end_reason) == (ExplorationState.ENDED, EndReason.DONE)
    assert done.goal is None
    answer = client.get_exploration(room, exploration_id)
    assert (answer.progress.explored_cells, answer.progress.fraction) == (2400, 1.0)
    assert answer.progress.cell_area_m2 == pytest.approx(0.01)
    assert answer.exploration.end_time >= answer.exploration.start_time


def test_a_goal_reported_as_unreachable_is_listed(client: Client, room: str) -> None:
    start(client, room)
    claim = client.claim_goal(room, "rob", Pose(3.0, 2.0, 0.0))
    client.release_goal(room, "rob", claim.goal.id, GoalOutcome.UNREACHABLE)
    (place,) = client.get_exploration(room).exploration.unreachable_places
    assert place.robot == "rob" and place.position.equals(claim.goal.position)


def test_stopping_an_exploration_twice_changes_nothing(client: Client, room: str) -> None:
    first, second = start(client, room), start(client, room)
    stopped = client.stop_exploration(room, first).exploration
    assert (stopped.state, stopped.end_reason) == (ExplorationState.ENDED, EndReason.STOPPED)
    assert client.stop_exploration(room, first).exploration == stopped
    listed = client.list_explorations(room).explorations
    assert [e.id for e in listed] == [second, first]
    assert [e.end_reason for e in listed] == [EndReason.NONE, EndReason.STOPPED]


def test_an_area_without_floor_is_refused(client: Client, room: str) -> None:
    with pytest.raises(FailedPrecondition):
        client.start_exploration(
            room,
            shapely.box(50, 50, 60, 60),
            occupancy_layer="floor",
            exploration_layer="seen",
        )
    with pytest.raises(NotFound):
        client.get_exploration(room)

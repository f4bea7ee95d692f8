"""Tests of the presence of robots."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import numpy as np
import pytest

from hypermap_client import Client, InvalidArgument, NotFound, Pose


def test_robots_are_listed_in_the_frame_of_the_map(client: Client, site: str) -> None:
    client.set_transform(site, "map", "dock", Pose(10.0, 0.0, 0.0))
    before = datetime.now(timezone.utc)
    answer = client.report_robot(
        site,
        "r2",
        Pose(1.0, 2.0, 0.5),
        frame_id="dock",
        covariance=np.diag([0.04, 0.01, 0.001]),
        map_revision=0,
        battery=0.75,
        state="driving",
        fields={"task": "12"},
    )
    assert answer.accepted and answer.incarnation != 0
    client.report_robot(site, "r1", Pose(3.0, 4.0, 0.0), frame_id="nowhere")

    robots = client.robots(site)
    assert (robots.frame_id, robots.revision) == ("map", answer.revision)
    lost, found = robots.robots
    assert (lost.name, lost.frame_id, lost.in_map_frame) == ("r1", "nowhere", False)
    assert lost.covariance is None and lost.battery is None and lost.map_revision is None
    assert (found.name, found.frame_id, found.in_map_frame) == ("r2", "map", True)
    assert found.pose == Pose(11.0, 2.0, 0.5) and found.online
    assert np.array_equal(found.covariance, np.diag([0.04, 0.01, 0.001]))
    assert (found.battery, found.state, found.map_revision) == (0.75, "driving", 0)
    assert found.fields == {"task": "12"}
    assert before - timedelta(seconds=1) < found.stamp < datetime.now(timezone.utc)
    assert found.seen_time <= robots.time


def test_an_older_report_is_ignored(client: Client, site: str) -> None:
    now = datetime.now(timezone.utc)
    assert client.report_robot(site, "r1", Pose(1.0, 0.0, 0.0), stamp=now).accepted
    older = now - timedelta(seconds=1)
    assert not client.report_robot(site, "r1", Pose(2.0, 0.0, 0.0), stamp=older).accepted
    assert client.robots(site).robots[0].pose.x == 1.0


def test_a_watch_tells_all_robots_and_then_changes(client: Client, site: str) -> None:
    client.report_robot(site, "r1", Pose(1.0, 0.0, 0.0))
    watch = client.watch_robots(site, timeout=60.0)
    first = next(watch)
    assert first.reset and not first.more and first.forgotten == ()
    assert [robot.name for robot in first.robots] == ["r1"]
    client.report_robot(site, "r1", Pose(2.0, 0.0, 0.0))
    (robot,) = next(changes for changes in watch if changes.robots).robots
    assert robot.pose.x == 2.0


def test_wrong_reports_and_unknown_maps_are_refused(client: Client, site: str) -> None:
    with pytest.raises(InvalidArgument, match="robot must have 1 to 128 bytes"):
        client.report_robot(site, "", Pose())
    with pytest.raises(NotFound):
        client.robots("nowhere")
    with pytest.raises(NotFound):
        next(client.watch_robots("nowhere"))

"""Where the robots of a map are, and how they are doing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from .geometry import Pose


@dataclass(frozen=True, slots=True, eq=False)
class Robot:
    """A robot of a map, as the server last heard of it.

    pose: in metres and radians, in frame `frame_id`.
    in_map_frame: whether that is the map's own frame. Otherwise the frame of the report is not
        connected to it, and the pose is as the robot reported it.
    online: whether the robot has reported in the last --robot_online_seconds of the server.
    seen_time: time at which the report came, by the clock of the server, in UTC.
    stamp: time at which the pose was measured, by the clock of the robot, in UTC.
    covariance: of (x, y, yaw), array of shape (3, 3) in metres and radians; None if not known.
    map_revision: newest revision of the map that the robot holds; None if it tells none.
    map_incarnation: the incarnation of the map to which map_revision belongs; 0 if not told.
    battery: charge from 0 to 1; None if not known.
    state: what the robot is doing, in its own words.
    fields: anything else that it tells.
    """

    name: str
    pose: Pose
    frame_id: str
    in_map_frame: bool
    online: bool
    seen_time: datetime
    stamp: datetime
    covariance: NDArray[np.float64] | None
    map_revision: int | None
    map_incarnation: int
    battery: float | None
    state: str
    fields: Mapping[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class RobotList:
    """The robots of a map, sorted by name.

    revision: the revision whose transforms were used for the poses.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    frame_id: the map's own frame.
    time: time of the answer by the clock of the server, in UTC; `time - robot.seen_time` is how
        long ago a robot was seen.
    """

    revision: int
    incarnation: int
    frame_id: str
    time: datetime
    robots: tuple[Robot, ...]


@dataclass(frozen=True, slots=True, eq=False)
class RobotChanges:
    """What a watch of robots tells.

    revision, incarnation, frame_id, time: as in RobotList.
    reset: whether this and the changes that follow, up to the first without `more`, are all robots;
        robots that were told before must be forgotten.
    more: whether more changes of this state follow.
    robots: robots that are new or have changed. Without robots and forgotten ones, nothing has
        changed.
    forgotten: names of robots that the server has forgotten; others than were told may be among
        them.
    """

    revision: int
    incarnation: int
    frame_id: str
    time: datetime
    reset: bool
    more: bool
    robots: tuple[Robot, ...]
    forgotten: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ReportAnswer:
    """The answer to a report of a robot.

    revision: newest revision of the map, with which the robot can compare its own.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    accepted: False if the server has a report of the robot with a later stamp, and ignored this
        one.
    """

    revision: int
    incarnation: int
    accepted: bool

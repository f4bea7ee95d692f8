"""Calls for the presence of robots."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Mapping
from datetime import datetime, timezone

from numpy.typing import ArrayLike

from .. import _rpc as rpc
from .._proto import robot_service_pb2 as pb
from .._wire.geometry import encode_pose
from .._wire.robots import decode_changes, decode_robots, encode_covariance
from .._wire.time import encode_time
from ..geometry import Pose
from ..robots import ReportAnswer, RobotChanges, RobotList
from .connection import Connection


class Robots(Connection):
    """Calls for the presence of robots. Reports are no revisions of the map."""

    async def report_robot(
        self,
        map_name: str,
        robot: str,
        pose: Pose,
        *,
        frame_id: str = "",
        stamp: datetime | None = None,
        covariance: ArrayLike | None = None,
        map_revision: int | None = None,
        map_incarnation: int = 0,
        battery: float | None = None,
        state: str = "",
        fields: Mapping[str, str] | None = None,
        timeout: float | None = None,
    ) -> ReportAnswer:
        """Reports where a robot is; to be called about every second.

        robot: name of the robot, 1 to 128 bytes.
        pose: pose of the robot in `frame_id`, which need not be connected to the map's frame.
        stamp: time at which the pose was measured, with a time zone; None for now.
        covariance: of (x, y, yaw), array of shape (3, 3) in metres and radians; None if not known.
        map_revision: newest revision of the map that the robot holds; None if it tells none.
        map_incarnation: the incarnation of the map to which map_revision belongs.
        battery: charge from 0 to 1; None if not known.
        state: what the robot is doing, for people: at most 256 bytes.
        fields: anything else, for people: at most 32 fields, of 4,096 bytes together.

        Raises PermissionDenied if the caller may not act as this robot, and ResourceExhausted if
        too many robots of the map are online.
        """
        report = pb.RobotReport(
            robot=robot,
            frame_id=frame_id,
            pose=encode_pose(pose),
            covariance=encode_covariance(covariance),
            map_revision=map_revision,
            map_incarnation=map_incarnation,
            battery=battery,
            state=state,
            fields=fields,
        )
        encode_time(stamp or datetime.now(timezone.utc), report.stamp)
        request = pb.ReportRequest(map=map_name, report=report)
        answer = await self._call(rpc.REPORT, request, timeout)
        accepted = answer.outcome == pb.REPORT_OUTCOME_ACCEPTED
        return ReportAnswer(answer.revision, answer.incarnation, accepted)

    async def robots(self, map_name: str, *, timeout: float | None = None) -> RobotList:
        """Lists the robots that have reported, with their poses in the map's own frame."""
        request = pb.ListRobotsRequest(map=map_name)
        return decode_robots(await self._call(rpc.LIST_ROBOTS, request, timeout))

    async def watch_robots(
        self, map_name: str, *, timeout: float = math.inf
    ) -> AsyncIterator[RobotChanges]:
        """Watches the robots of a map. Yields all robots, and then what changes.

        timeout: time in seconds for the whole watch.

        Raises Unavailable when the server stops or the map is deleted or replaced; another watch
        begins with all robots again.
        """
        request = pb.WatchRobotsRequest(map=map_name)
        async for message in self._stream(rpc.WATCH_ROBOTS, request, timeout):
            yield decode_changes(message)

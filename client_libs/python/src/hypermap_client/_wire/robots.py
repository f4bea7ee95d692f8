"""Conversion of robots and their reports."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._proto import robot_service_pb2 as pb
from ..robots import Robot, RobotChanges, RobotList
from .geometry import decode_pose
from .time import decode_time


def encode_covariance(covariance: ArrayLike | None) -> list[float]:
    if covariance is None:
        return []
    numbers: list[float] = np.asarray(covariance, np.float64).ravel().tolist()
    return numbers


def decode_robot(message: pb.RobotPresence) -> Robot:
    report = message.report
    return Robot(
        name=report.robot,
        pose=decode_pose(report.pose),
        frame_id=report.frame_id,
        in_map_frame=message.in_map_frame,
        online=message.online,
        seen_time=decode_time(message.seen_time),
        stamp=decode_time(report.stamp),
        covariance=np.reshape(report.covariance, (3, 3)) if report.covariance else None,
        map_revision=report.map_revision if report.HasField("map_revision") else None,
        map_incarnation=report.map_incarnation,
        battery=report.battery if report.HasField("battery") else None,
        state=report.state,
        fields=dict(report.fields),
    )


def decode_robots(message: pb.ListRobotsResponse) -> RobotList:
    return RobotList(
        message.revision,
        message.incarnation,
        message.frame_id,
        decode_time(message.time),
        tuple(map(decode_robot, message.robots)),
    )


def decode_changes(message: pb.WatchRobotsResponse) -> RobotChanges:
    return RobotChanges(
        message.revision,
        message.incarnation,
        message.frame_id,
        decode_time(message.time),
        message.reset,
        message.more,
        tuple(map(decode_robot, message.robots)),
        tuple(message.forgotten),
    )

"""Conversion of points, polygons, poses and transforms."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from .._proto import geometry_pb2 as pb
from ..geometry import AreaLike, PointLike, Pose, Transform, polygon_of, xy_of


def encode_point(point: PointLike) -> pb.Point:
    x, y = xy_of(point)
    return pb.Point(x=x, y=y)


def decode_point(message: pb.Point) -> shapely.Point:
    return shapely.Point(message.x, message.y)


def encode_ring(ring: shapely.LinearRing) -> pb.Ring:
    # Shapely repeats the first vertex at the end; messages do not.
    vertices = shapely.get_coordinates(ring)[:-1].tolist()
    return pb.Ring(points=[pb.Point(x=x, y=y) for x, y in vertices])


def encode_polygon(area: AreaLike) -> pb.Polygon:
    polygon = polygon_of(area)
    return pb.Polygon(
        outer=encode_ring(polygon.exterior), holes=[encode_ring(hole) for hole in polygon.interiors]
    )


def decode_ring(message: pb.Ring) -> NDArray[np.float64]:
    """The vertices of a ring as an array of shape (N, 2), without the first one repeated."""
    coordinates = np.empty((len(message.points), 2))
    for i, point in enumerate(message.points):
        coordinates[i] = point.x, point.y
    return coordinates


def decode_polygon(message: pb.Polygon) -> shapely.Polygon:
    """The polygon of a message; an empty polygon if the message has no vertices."""
    if not message.outer.points:
        return shapely.Polygon()
    return shapely.Polygon(decode_ring(message.outer), [decode_ring(h) for h in message.holes])


def encode_pose(pose: Pose) -> pb.Pose:
    return pb.Pose(x=pose.x, y=pose.y, yaw=pose.yaw)


def decode_pose(message: pb.Pose) -> Pose:
    return Pose(message.x, message.y, message.yaw)


def encode_transform(transform: Transform) -> pb.Transform:
    return pb.Transform(
        parent_frame_id=transform.parent_frame_id,
        child_frame_id=transform.child_frame_id,
        parent_from_child=encode_pose(transform.parent_from_child),
    )


def decode_transform(message: pb.Transform) -> Transform:
    return Transform(
        message.parent_frame_id, message.child_frame_id, decode_pose(message.parent_from_child)
    )

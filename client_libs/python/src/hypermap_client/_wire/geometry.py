"""Conversion of points, polygons, shapes, poses and transforms."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from .._proto import geometry_pb2 as pb
from ..errors import Internal
from ..geometry import AreaLike, PointLike, Pose, Shape, Transform, polygon_of, xy_of


def encode_point(point: PointLike) -> pb.Point:
    x, y = xy_of(point)
    return pb.Point(x=x, y=y)


def decode_point(message: pb.Point) -> shapely.Point:
    return shapely.Point(message.x, message.y)


def encode_ring(ring: shapely.LinearRing) -> pb.Ring:
    # Shapely repeats the first vertex at the end; messages do not.
    xs, ys = shapely.get_coordinates(ring)[:-1].T.tolist()
    return pb.Ring(xs=xs, ys=ys)


def encode_polygon(area: AreaLike) -> pb.Polygon:
    polygon = polygon_of(area)
    return pb.Polygon(
        outer=encode_ring(polygon.exterior), holes=[encode_ring(hole) for hole in polygon.interiors]
    )


def encode_shape(shape: Shape) -> pb.Shape:
    if isinstance(shape, shapely.Polygon):
        return pb.Shape(polygon=encode_polygon(shape))
    if isinstance(shape, shapely.LineString):
        xs, ys = shapely.get_coordinates(shape).T.tolist()
        return pb.Shape(line_string=pb.LineString(xs=xs, ys=ys))
    return pb.Shape(point=encode_point(shape))


def decode_vertices(message: pb.Ring | pb.LineString) -> NDArray[np.float64]:
    """The vertices of a message as an array of shape (N, 2)."""
    return np.array((message.xs, message.ys), np.float64).T


def decode_polygon(message: pb.Polygon) -> shapely.Polygon:
    """The polygon of a message; an empty polygon if the message has no vertices."""
    if not message.outer.xs:
        return shapely.Polygon()
    return shapely.Polygon(
        decode_vertices(message.outer), [decode_vertices(hole) for hole in message.holes]
    )


def decode_shape(message: pb.Shape) -> Shape:
    """The shape of a message. Raises Internal for a kind of shape that the client does not know."""
    kind = message.WhichOneof("shape")
    if kind == "polygon":
        return decode_polygon(message.polygon)
    if kind == "line_string":
        return shapely.LineString(decode_vertices(message.line_string))
    if kind == "point":
        return decode_point(message.point)
    raise Internal("the response has a shape of an unknown kind")


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

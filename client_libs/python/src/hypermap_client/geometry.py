"""Points, areas, shapes, poses and transforms in the plane.

Lengths are in metres. Angles are in radians, counter-clockwise from the x axis to the y axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

# A point: x and y in metres.
PointLike: TypeAlias = shapely.Point | Sequence[float] | NDArray[np.float64]
# Several points: an array of shape (N, 2) in metres, or geometries, whose vertices are the points.
PointsLike: TypeAlias = ArrayLike | Sequence[shapely.Geometry]
# A polygon, or the vertices of its outer ring as an array of shape (N, 2) in metres. The ring may
# repeat its first vertex at the end, and may be clockwise or counter-clockwise.
AreaLike: TypeAlias = shapely.Polygon | Sequence[Sequence[float]] | NDArray[np.float64]
# The shape of an object. It is a closed set: boundaries and end points belong to it. A LinearRing
# counts as a LineString, without the area that it encloses.
Shape: TypeAlias = shapely.Polygon | shapely.LineString | shapely.Point


class ShapeKind(IntEnum):
    """The kind of a shape."""

    POLYGON = 1
    """A shapely.Polygon, which may have holes."""
    LINE_STRING = 2
    """A shapely.LineString."""
    POINT = 3
    """A shapely.Point."""


@dataclass(frozen=True, slots=True)
class Pose:
    """A rigid transform of the plane: a rotation by `yaw` radians, then a translation by (x, y).

    x, y: metres. yaw: radians.

    The pose of a child frame in its parent frame is the transform `parent_from_child`, which maps
    coordinates in the child to coordinates in the parent.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def matrix(self) -> NDArray[np.float64]:
        """The transform as a homogeneous matrix of shape (3, 3)."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[cos, -sin, self.x], [sin, cos, self.y], [0.0, 0.0, 1.0]])

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Transforms points (array of shape (…, 2)) from the child frame to the parent frame."""
        matrix = self.matrix()
        points = np.asarray(points, dtype=np.float64)
        moved: NDArray[np.float64] = points @ matrix[:2, :2].T + matrix[:2, 2]
        return moved

    def inverse(self) -> Pose:
        """The inverse transform: the pose of the parent frame in the child frame."""
        cos, sin = float(np.cos(self.yaw)), float(np.sin(self.yaw))
        return Pose(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, -self.yaw)


@dataclass(frozen=True, slots=True)
class Transform:
    """An edge of the tree of frames: the pose of a child frame in its parent frame."""

    parent_frame_id: str
    child_frame_id: str
    parent_from_child: Pose


def xy_of(point: PointLike) -> tuple[float, float]:
    """The coordinates of a point. Raises ValueError unless there are exactly two."""
    if isinstance(point, shapely.Point):
        if point.is_empty:
            raise ValueError("the point is empty")
        return point.x, point.y
    if len(point) != 2:
        raise ValueError(f"a point needs x and y, not {len(point)} numbers")
    return float(point[0]), float(point[1])


def points_of(points: PointsLike) -> NDArray[np.float64]:
    """Points as an array of shape (N, 2). Raises ValueError for an array of another shape."""
    array = np.asarray(points)
    if array.dtype == object:
        array = shapely.get_coordinates(array)
    array = array.astype(np.float64, copy=False)
    if array.size == 0:
        return array.reshape(0, 2)
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"points need shape (N, 2), not {array.shape}")
    return array


def polygon_of(area: AreaLike) -> shapely.Polygon:
    """An area as a polygon. The server checks that it does not intersect itself.

    Raises TypeError for other geometries and ValueError for fewer than three vertices.
    """
    if isinstance(area, shapely.Polygon):
        return area
    if isinstance(area, shapely.Geometry):
        raise TypeError(f"an area must be a Polygon, not a {type(area).__name__}")
    return shapely.Polygon(points_of(area))


def check_shape(shape: object) -> None:
    """Checks that a value is a Shape and not empty.

    Raises ValueError for an empty geometry and for one of several parts, TypeError for other types.
    """
    if isinstance(shape, shapely.geometry.base.BaseMultipartGeometry):
        raise ValueError(
            f"a {shape.geom_type} is not one shape: make an object for each of its parts, which "
            "shapely.get_parts(shape) or GeoDataFrame.explode() return"
        )
    if not isinstance(shape, (shapely.Polygon, shapely.LineString, shapely.Point)):
        raise TypeError(
            f"a shape must be a Polygon, LineString or Point, not a {type(shape).__name__}"
        )
    if shape.is_empty:
        raise ValueError(f"the shape is an empty {shape.geom_type}")

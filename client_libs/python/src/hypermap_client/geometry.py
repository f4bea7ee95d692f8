"""Places in the plane: metres and radians, x right, y up, angles counter-clockwise.

Points and polygons are Shapely's. Coordinates are in the frame that the call names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

# x and y, in metres.
PointLike: TypeAlias = shapely.Point | Sequence[float] | NDArray[np.float64]
# N×2, or geometries whose vertices they are.
PointsLike: TypeAlias = ArrayLike | Sequence[shapely.Geometry]
# A polygon, or the vertices of its outer ring: N×2, closed or open, either way round.
AreaLike: TypeAlias = shapely.Polygon | Sequence[Sequence[float]] | NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pose:
    """A rigid pose: a rotation by `yaw` radians, then a translation by (x, y) metres.

    As a transform parent_from_child it takes coordinates in the child to those in the parent.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def matrix(self) -> NDArray[np.float64]:
        """As a homogeneous 3×3 matrix."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[cos, -sin, self.x], [sin, cos, self.y], [0.0, 0.0, 1.0]])

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Points of the child (…×2) in the parent."""
        matrix = self.matrix()
        points = np.asarray(points, dtype=np.float64)
        moved: NDArray[np.float64] = points @ matrix[:2, :2].T + matrix[:2, 2]
        return moved

    def inverse(self) -> Pose:
        """The pose of the parent in the child."""
        cos, sin = float(np.cos(self.yaw)), float(np.sin(self.yaw))
        return Pose(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, -self.yaw)


@dataclass(frozen=True, slots=True)
class Transform:
    """A frame's place in the tree of frames: the pose of the child in the parent."""

    parent_frame_id: str
    child_frame_id: str
    parent_from_child: Pose


def xy_of(point: PointLike) -> tuple[float, float]:
    """The coordinates of a point. ValueError when it has not two of them."""
    if isinstance(point, shapely.Point):
        if point.is_empty:
            raise ValueError("an empty point has no place")
        return point.x, point.y
    if len(point) != 2:
        raise ValueError(f"a point has x and y, not {len(point)} numbers")
    return float(point[0]), float(point[1])


def points_of(points: PointsLike) -> NDArray[np.float64]:
    """Points as an array N×2. ValueError for another shape."""
    array = np.asarray(points)
    if array.dtype == object:
        array = shapely.get_coordinates(array)
    array = array.astype(np.float64, copy=False)
    if array.size == 0:
        return array.reshape(0, 2)
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"points are N×2, not {'×'.join(map(str, array.shape))}")
    return array


def polygon_of(area: AreaLike) -> shapely.Polygon:
    """An area as a polygon.

    TypeError for another geometry, ValueError for fewer than three vertices; whether it crosses
    itself is for the server to say.
    """
    if isinstance(area, shapely.Polygon):
        return area
    if isinstance(area, shapely.Geometry):
        raise TypeError(f"an area is a Polygon, not a {type(area).__name__}")
    return shapely.Polygon(points_of(area))

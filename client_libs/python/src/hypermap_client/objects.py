"""Objects of semantic layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TypeAlias

import shapely

from .geometry import Shape, check_shape

# The value of an attribute of an object.
AttributeValue: TypeAlias = bool | int | float | str


@dataclass(frozen=True, slots=True)
class HeightRange:
    """A range of heights above the ground plane in metres, low_m <= high_m."""

    low_m: float
    high_m: float


@dataclass(frozen=True, slots=True)
class MapObject:
    """An object of a semantic layer: a labelled shape with attributes.

    label: class of the object; not empty.
    shape: what the object covers: a Polygon, LineString or Point of Shapely, in metres, in the
        frame of the call. In answers the outer ring of a polygon is counter-clockwise.
    id: unique in the map and never reused. 0 in a PutObject adds a new object.
    classes: confidences in [0, 1] of alternative classes; they need not sum to 1.
    existence: probability in [0, 1] that the object exists.
    height: None if unknown.
    tags: free words; the query value "tag:WORD" finds objects by them.
    version: the revision that put the object in its present form; set in answers only.
    expire_time: time in UTC at which the server removes the object, None for never; set in answers
        only.

    Raises ValueError for a geometry that is empty or has several parts, and TypeError for other
    types of shapes.
    """

    label: str
    shape: Shape
    id: int = field(default=0, kw_only=True)
    classes: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    existence: float = field(default=1.0, kw_only=True)
    height: HeightRange | None = field(default=None, kw_only=True)
    tags: tuple[str, ...] = field(default=(), kw_only=True)
    attributes: Mapping[str, AttributeValue] = field(default_factory=dict, kw_only=True)
    version: int = field(default=0, kw_only=True)
    expire_time: datetime | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        check_shape(self.shape)

    @property
    def polygon(self) -> shapely.Polygon:
        """The shape of an object that is a polygon. Raises TypeError for other kinds of shape."""
        if not isinstance(self.shape, shapely.Polygon):
            raise TypeError(
                f"object {self.id} ({self.label!r}) is a {self.shape.geom_type}, not a polygon; "
                "use its `shape`"
            )
        return self.shape

    @property
    def centroid(self) -> shapely.Point:
        """The centroid of the area of a polygon or of the length of a line; a point itself."""
        return self.shape.centroid

"""Labelled things on semantic layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TypeAlias

import shapely

AttributeValue: TypeAlias = bool | int | float | str


@dataclass(frozen=True, slots=True)
class HeightRange:
    """Heights above the plane in metres, low_m <= high_m."""

    low_m: float
    high_m: float


@dataclass(frozen=True, slots=True)
class MapObject:
    """A labelled thing.

    label: the class it is taken for.
    polygon: its footprint, in the frame of the call; in answers the outer ring runs
        counter-clockwise.
    id: unique in its map, never used again; 0 in a request: the map gives one.
    classes: class alternatives with confidences in [0, 1], which need not sum to 1.
    existence: the probability in [0, 1] that it is there.
    version, expire_time: answers only: the revision that put it as it is, and when it leaves the
        map by itself (None: never).
    """

    label: str
    polygon: shapely.Polygon
    id: int = field(default=0, kw_only=True)
    classes: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    existence: float = field(default=1.0, kw_only=True)
    height: HeightRange | None = field(default=None, kw_only=True)
    tags: tuple[str, ...] = field(default=(), kw_only=True)
    attributes: Mapping[str, AttributeValue] = field(default_factory=dict, kw_only=True)
    version: int = field(default=0, kw_only=True)
    expire_time: datetime | None = field(default=None, kw_only=True)

    @property
    def centroid(self) -> shapely.Point:
        """The polygon's centre of area."""
        return self.polygon.centroid

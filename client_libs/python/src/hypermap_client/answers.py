"""Answers to the questions of a hypermap. Geometry is in the frame of the question."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from .grids import CellRuns, Grid, GridGeometry
from .layers import LayerKind
from .objects import MapObject

if TYPE_CHECKING:
    import geopandas

_Named = TypeVar("_Named", "LayerContent", "PointsContent", "LayerAnswer")


class AnswerStatus(IntEnum):
    """How a layer answers. One layer's status never spoils another's answer."""

    VALUE = 1
    """An answer: the value of a cell, or the list of objects, which may be empty."""
    UNKNOWN = 2
    """A grid: inside of the extent, nothing is known."""
    OUTSIDE = 3
    """A grid: outside of the extent."""
    NO_TRANSFORM = 4
    """The layer's frame is not connected to the caller's."""
    UNSUPPORTED_VALUE = 5
    """The layer can't take the value that was asked for."""


@dataclass(frozen=True, slots=True)
class LayerContent:
    """What one layer has at a point.

    value: a grid's, when status is VALUE.
    objects: a semantic layer's, by id.
    """

    layer: str
    kind: LayerKind
    status: AnswerStatus
    value: float | None = None
    objects: tuple[MapObject, ...] = ()


@dataclass(frozen=True, slots=True)
class PointAnswer:
    """What is at a point. `layers` in the order asked; all layers by name."""

    map: str
    revision: int
    frame_id: str
    point: shapely.Point
    layers: tuple[LayerContent, ...]

    def __getitem__(self, layer: str) -> LayerContent:
        return _by_layer(self.layers, layer)

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """A row for each object of the semantic layers. Needs GeoPandas."""
        from .tables import objects_table  # noqa: PLC0415  (GeoPandas is an extra)

        return objects_table([(c.layer, o) for c in self.layers for o in c.objects])


@dataclass(frozen=True, slots=True, eq=False)
class PointsContent:
    """What one layer has at the N points of a batch, in columns.

    Of a grid: statuses (N, of AnswerStatus) and values (N, NaN where there is none). Of a semantic
    layer, by point and then id: entry j is of an object that covers point points[j] of the batch;
    points, object_ids, labels (of str) and existences are of one length.
    """

    layer: str
    kind: LayerKind
    status: AnswerStatus
    statuses: NDArray[np.uint8]
    values: NDArray[np.float64]
    points: NDArray[np.int64]
    object_ids: NDArray[np.int64]
    labels: NDArray[np.object_]
    existences: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class PointsAnswer:
    """What is at the points of a batch, read at one revision."""

    revision: int
    layers: tuple[PointsContent, ...]

    def __getitem__(self, layer: str) -> PointsContent:
        return _by_layer(self.layers, layer)


@dataclass(frozen=True, slots=True, eq=False)
class LayerAnswer:
    """One layer's answer to a question about an area or a value.

    objects: a semantic layer's, by id.
    cells: a grid's, by row and column; None when it has none to tell.
    """

    layer: str
    kind: LayerKind
    status: AnswerStatus
    objects: tuple[MapObject, ...] = ()
    cells: CellRuns | None = None

    def to_grid(self) -> Grid:
        """The cells as an array. ValueError when there are none."""
        if self.cells is None:
            raise ValueError(f"layer {self.layer!r} has no cells in this answer")
        return self.cells.to_grid()

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """A row for each object, or for each run of cells. Needs GeoPandas."""
        from .tables import objects_table  # noqa: PLC0415  (GeoPandas is an extra)

        if self.cells is not None:
            return self.cells.to_geodataframe()
        return objects_table([(self.layer, o) for o in self.objects])


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What is in an area, or where a value is: all layers at one revision.

    frame_id: as asked; empty: the map's own.
    """

    map: str
    revision: int
    frame_id: str
    layers: tuple[LayerAnswer, ...]

    def __getitem__(self, layer: str) -> LayerAnswer:
        return _by_layer(self.layers, layer)

    @property
    def objects(self) -> tuple[MapObject, ...]:
        """The objects of all semantic layers."""
        return tuple(o for answer in self.layers for o in answer.objects)

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """A row for each object of the semantic layers. Needs GeoPandas.

        Cells: `answer["floor"].to_geodataframe()`.
        """
        from .tables import objects_table  # noqa: PLC0415  (GeoPandas is an extra)

        return objects_table([(a.layer, o) for a in self.layers for o in a.objects])


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a grid with its value (NaN: unknown)."""

    row: int
    col: int
    value: float
    grid: GridGeometry = field(repr=False)

    @property
    def polygon(self) -> shapely.Polygon:
        """Its square, in the frame of the answer."""
        corners = ((0, 0), (0, 1), (1, 1), (1, 0))
        return shapely.Polygon(
            self.grid.corners(
                [self.row + r for r, _ in corners], [self.col + c for _, c in corners]
            )
        )

    @property
    def centre(self) -> shapely.Point:
        """Its centre, in the frame of the answer."""
        return shapely.Point(self.grid.centres(self.row, self.col))


@dataclass(frozen=True, slots=True)
class NearestMatch:
    """A place that has the value asked for: an object, or a cell.

    distance_m: to the nearest point of the object's polygon (0 inside), or to the cell's centre.
    """

    layer: str
    kind: LayerKind
    distance_m: float
    object: MapObject | None = None
    cell: Cell | None = None


@dataclass(frozen=True, slots=True)
class LayerRefusal:
    """A layer that can't answer, and why."""

    layer: str
    status: AnswerStatus


@dataclass(frozen=True, slots=True)
class NearestAnswer:
    """The nearest places that have a value, nearest first, over all layers together."""

    map: str
    revision: int
    frame_id: str
    matches: tuple[NearestMatch, ...]
    refusals: tuple[LayerRefusal, ...]

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """A row for each match, nearest first. Needs GeoPandas."""
        from .tables import matches_table  # noqa: PLC0415  (GeoPandas is an extra)

        return matches_table(self.matches)


def _by_layer(layers: tuple[_Named, ...], name: str) -> _Named:
    for layer in layers:
        if layer.layer == name:
            return layer
    raise KeyError(name)

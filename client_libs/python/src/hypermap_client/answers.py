"""Answers to the questions of a hypermap. Geometry is in the frame of the question."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from ._geodataframe import make_geodataframe
from ._object_table import OBJECT_COLUMNS, columns_of_rows, object_row, object_table
from .grids import Cell, CellRuns, Grid
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
        return object_table([(c.layer, o) for c in self.layers for o in c.objects])


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
        if self.cells is not None:
            return self.cells.to_geodataframe()
        return object_table([(self.layer, o) for o in self.objects])


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
        return object_table([(a.layer, o) for a in self.layers for o in a.objects])


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
        rows: list[dict[str, Any]] = []
        geometry: list[shapely.Polygon] = []
        for match in self.matches:
            row: dict[str, Any] = {"layer": match.layer}
            if match.object is not None:
                row = object_row(match.layer, match.object)
                geometry.append(match.object.polygon)
            elif match.cell is not None:
                row.update(row=match.cell.row, col=match.cell.col, value=match.cell.value)
                geometry.append(match.cell.polygon)
            row["distance_m"] = match.distance_m
            rows.append(row)
        names = ("distance_m", *OBJECT_COLUMNS, "row", "col", "value")
        return make_geodataframe(columns_of_rows(rows, names), geometry)


def _by_layer(layers: tuple[_Named, ...], name: str) -> _Named:
    for layer in layers:
        if layer.layer == name:
            return layer
    raise KeyError(name)

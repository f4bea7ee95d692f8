"""Answers to queries. Their geometry is in the frame that the query names, in metres."""

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


class Consistency(IntEnum):
    """Which revisions an answer shows at least, if several servers share the maps."""

    LOCAL = 1
    """Those that the server has got so far."""
    LINEARIZABLE = 2
    """Every revision that any server had acknowledged to any client before the call."""


class AnswerStatus(IntEnum):
    """Tells whether a layer can answer a query. It does not affect the answers of other layers."""

    VALUE = 1
    """The layer answers with the value of a cell, or with a list of objects, possibly empty."""
    UNKNOWN = 2
    """The point is inside the extent of the grid, but its cell has no value."""
    OUTSIDE = 3
    """The point is outside the extent of the grid."""
    NO_TRANSFORM = 4
    """No transform connects the layer's frame to the frame of the query."""
    UNSUPPORTED_VALUE = 5
    """The layer does not support the value of the query, such as a class label on a grid."""
    DAMAGED = 6
    """The stored content of the layer is damaged, and can't be read."""


@dataclass(frozen=True, slots=True)
class LayerContent:
    """The content of one layer at a point.

    value: value of the cell of a grid layer; None unless status is VALUE.
    objects: objects of a semantic layer that contain the point, or are at most `tolerance_m` of the
        query from it, sorted by id.
    """

    layer: str
    kind: LayerKind
    status: AnswerStatus
    value: float | None = None
    objects: tuple[MapObject, ...] = ()


@dataclass(frozen=True, slots=True)
class PointAnswer:
    """The content of several layers at a point, read at one revision.

    frame_id: frame of `point` and of all geometry in the answer.
    layers: in the order of the query, or sorted by name if it asked for all layers.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.

    Indexing with the name of a layer returns its content and raises KeyError if there is none.
    """

    map: str
    revision: int
    frame_id: str
    point: shapely.Point
    layers: tuple[LayerContent, ...]
    incarnation: int = 0

    def __getitem__(self, layer: str) -> LayerContent:
        return _by_layer(self.layers, layer)

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """Makes a table with a row for each object of the semantic layers.

        Raises ImportError if GeoPandas is not installed.
        """
        return object_table([(c.layer, o) for c in self.layers for o in c.objects])


@dataclass(frozen=True, slots=True, eq=False)
class PointsContent:
    """The content of one layer at the N points of a batch, as columns.

    status: VALUE, or the reason why the layer cannot answer; all columns are empty then.

    A grid layer fills two columns of length N, with one entry per point:

    statuses: numbers of AnswerStatus.
    values: values of the cells, NaN where there is none.

    A semantic layer fills four columns of equal length, with one entry for each pair of a point
    and an object that it meets, sorted by point and then by object id:

    points: indices of the points in the batch.
    object_ids: ids of the objects.
    labels: labels of the objects, as str.
    existences: probabilities in [0, 1] that the objects exist.
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
    """The content of several layers at the points of a batch, read at one revision.

    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.

    Indexing with the name of a layer returns its content and raises KeyError if there is none.
    """

    revision: int
    layers: tuple[PointsContent, ...]
    incarnation: int = 0

    def __getitem__(self, layer: str) -> PointsContent:
        return _by_layer(self.layers, layer)


@dataclass(frozen=True, slots=True, eq=False)
class LayerAnswer:
    """The answer of one layer to a query for an area or a value.

    objects: objects of a semantic layer, sorted by id.
    cells: cells of a grid layer, sorted by row and column; None if the answer has no cells.
    """

    layer: str
    kind: LayerKind
    status: AnswerStatus
    objects: tuple[MapObject, ...] = ()
    cells: CellRuns | None = None

    def to_grid(self) -> Grid:
        """The cells as an array over their bounding box.

        Raises ValueError if there are no cells, or if the box is too large (see CellRuns.to_grid).
        """
        if self.cells is None:
            raise ValueError(f"layer {self.layer!r} has no cells in this answer")
        return self.cells.to_grid()

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """Makes a table with a row for each object, or for each run of cells.

        Raises ImportError if GeoPandas is not installed.
        """
        if self.cells is not None:
            return self.cells.to_geodataframe()
        return object_table([(self.layer, o) for o in self.objects])


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The answers of several layers to a query for an area or a value, read at one revision.

    frame_id: frame of all geometry in the answer, as the query gave it; empty for the map's own.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.

    Indexing with the name of a layer returns its answer and raises KeyError if there is none.
    """

    map: str
    revision: int
    frame_id: str
    layers: tuple[LayerAnswer, ...]
    incarnation: int = 0

    def __getitem__(self, layer: str) -> LayerAnswer:
        return _by_layer(self.layers, layer)

    @property
    def objects(self) -> tuple[MapObject, ...]:
        """The objects of all semantic layers, layer after layer."""
        return tuple(o for answer in self.layers for o in answer.objects)

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """Makes a table with a row for each object of the semantic layers.

        It has no cells; `answer["floor"].to_geodataframe()` makes a table of those of layer
        "floor". Raises ImportError if GeoPandas is not installed.
        """
        return object_table([(a.layer, o) for a in self.layers for o in a.objects])


@dataclass(frozen=True, slots=True)
class NearestMatch:
    """An object or a cell with the value of a nearest query.

    distance_m: distance in metres to the nearest point of the object's shape (0 inside it), or to
        the centre of the cell.
    object: the match on a semantic layer, else None.
    cell: the match on a grid layer, else None.
    """

    layer: str
    kind: LayerKind
    distance_m: float
    object: MapObject | None = None
    cell: Cell | None = None


@dataclass(frozen=True, slots=True)
class LayerRefusal:
    """A layer that could not answer a nearest query, with the reason."""

    layer: str
    status: AnswerStatus


@dataclass(frozen=True, slots=True)
class NearestAnswer:
    """The objects and cells nearest to a point that have a value, over all queried layers.

    frame_id: frame of all geometry in the answer.
    matches: sorted by distance, nearest first.
    refusals: layers that could not answer.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    map: str
    revision: int
    frame_id: str
    matches: tuple[NearestMatch, ...]
    refusals: tuple[LayerRefusal, ...]
    incarnation: int = 0

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """Makes a table with a row for each match, nearest first.

        Columns of objects are empty for cells, and the other way round. Raises ImportError if
        GeoPandas is not installed.
        """
        rows: list[dict[str, Any]] = []
        geometry: list[shapely.Geometry] = []
        for match in self.matches:
            row: dict[str, Any] = {"layer": match.layer}
            if match.object is not None:
                row = object_row(match.layer, match.object)
                geometry.append(match.object.shape)
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

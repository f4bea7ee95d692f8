"""Cells of grids, as runs and as arrays.

A grid has square cells and no fixed extent. Rows count along the y axis of its origin and columns
along the x axis; both may be negative. Arrays have the lowest row first, as
`imshow(..., origin="lower")` expects.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from ._geodataframe import make_geodataframe
from .geometry import PointLike, Pose, xy_of

if TYPE_CHECKING:
    import geopandas


@dataclass(frozen=True, slots=True)
class GridGeometry:
    """Size and position of the cells of a grid.

    resolution_m: length of the side of a cell in metres, > 0.
    origin: pose of the lower left corner of cell (row 0, column 0). It is in the frame of the query
        for answers, and in the frame of the layer for layers.
    """

    resolution_m: float
    origin: Pose = field(default_factory=Pose)

    def cell_at(self, point: PointLike) -> tuple[int, int]:
        """Row and column of the cell that contains a point (metres).

        Cells are half-open: their lower and left borders belong to them.
        """
        x, y = self.origin.inverse().apply(xy_of(point)) / self.resolution_m
        return int(np.floor(y)), int(np.floor(x))

    def corners(self, rows: ArrayLike, cols: ArrayLike) -> NDArray[np.float64]:
        """The lower left corners of cells, in metres.

        `rows` and `cols` are broadcast against each other, and may be fractions. The array has
        their shape with a last axis of length 2 (x, y).
        """
        cols, rows = np.broadcast_arrays(np.asarray(cols, float), np.asarray(rows, float))
        return self.origin.apply(np.stack([cols, rows], axis=-1) * self.resolution_m)

    def centres(self, rows: ArrayLike, cols: ArrayLike) -> NDArray[np.float64]:
        """The centres of cells, in metres, with the shapes of `corners`."""
        return self.corners(np.asarray(rows, float) + 0.5, np.asarray(cols, float) + 0.5)


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a grid and its value, which is NaN for an unknown cell."""

    row: int
    col: int
    value: float
    grid: GridGeometry = field(repr=False)

    @property
    def polygon(self) -> shapely.Polygon:
        """The square of the cell, in the frame of the answer, in metres."""
        corners = ((0, 0), (0, 1), (1, 1), (1, 0))
        return shapely.Polygon(
            self.grid.corners(
                [self.row + r for r, _ in corners], [self.col + c for _, c in corners]
            )
        )

    @property
    def centre(self) -> shapely.Point:
        """The centre of the cell, in the frame of the answer, in metres."""
        return shapely.Point(self.grid.centres(self.row, self.col))


@dataclass(frozen=True, slots=True)
class CellBox:
    """The cells with row_begin <= row < row_end and col_begin <= column < col_end."""

    row_begin: int
    row_end: int
    col_begin: int
    col_end: int

    @property
    def shape(self) -> tuple[int, int]:
        """The number of rows and of columns."""
        return self.row_end - self.row_begin, self.col_end - self.col_begin


class CellRule(IntEnum):
    """The rule by which a polygon selects cells."""

    CENTRE = 1
    """The polygon selects cells whose centre it covers."""
    COVERED = 2
    """The polygon selects cells whose closed square it covers completely."""
    TOUCHED = 3
    """The polygon selects cells whose closed square shares a point with it."""


@dataclass(frozen=True, slots=True, eq=False)
class CellRuns:
    """Run-length encoded cells, sorted by row and column.

    Run i has the cells of row rows[i] with col_begins[i] <= column < col_ends[i]; all of them have
    the value values[i], which is NaN for unknown cells. The four arrays have equal length, which is
    `len()` of the runs.
    """

    grid: GridGeometry
    rows: NDArray[np.int32]
    col_begins: NDArray[np.int32]
    col_ends: NDArray[np.int32]
    values: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def num_cells(self) -> int:
        """The number of cells of all runs."""
        return int(np.sum(self.col_ends.astype(np.int64) - self.col_begins))

    @property
    def box(self) -> CellBox:
        """The bounding box of the cells; CellBox(0, 0, 0, 0) if there are none."""
        if len(self) == 0:
            return CellBox(0, 0, 0, 0)
        return CellBox(
            int(self.rows.min()),
            int(self.rows.max()) + 1,
            int(self.col_begins.min()),
            int(self.col_ends.max()),
        )

    def cells(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """Rows, columns and values of the single cells, three arrays of length num_cells."""
        lengths = self.col_ends.astype(np.int64) - self.col_begins
        ends = np.cumsum(lengths)
        in_run = np.arange(self.num_cells) - np.repeat(ends - lengths, lengths)
        rows = np.repeat(self.rows.astype(np.int64), lengths)
        return rows, np.repeat(self.col_begins, lengths) + in_run, np.repeat(self.values, lengths)

    def to_grid(self, box: CellBox | None = None, max_cells: int = 100_000_000) -> Grid:
        """The cells as an array over `box`, or over their bounding box if it is None.

        Cells outside of the box are dropped. Raises ValueError if the box has more than `max_cells`
        cells, which a few cells that lie far apart are enough for.
        """
        box = box or self.box
        if box.shape[0] * box.shape[1] > max_cells:
            raise ValueError(
                f"an array of {box.shape[0]}×{box.shape[1]} cells exceeds max_cells={max_cells}; "
                "use the runs or a smaller box"
            )
        values = np.full(box.shape, np.nan)
        selected = np.zeros(box.shape, dtype=bool)
        rows, cols, cell_values = self.cells()
        inside = (
            (rows >= box.row_begin)
            & (rows < box.row_end)
            & (cols >= box.col_begin)
            & (cols < box.col_end)
        )
        index = rows[inside] - box.row_begin, cols[inside] - box.col_begin
        values[index] = cell_values[inside]
        selected[index] = True
        return Grid(self.grid, box.row_begin, box.col_begin, values, selected)

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """Makes a table with a row for each run: row, col_begin, col_end, value, a rectangle.

        Raises ImportError if GeoPandas is not installed.
        """
        next_rows = self.rows.astype(np.int64) + 1
        corners = np.stack(
            [
                self.grid.corners(self.rows, self.col_begins),
                self.grid.corners(self.rows, self.col_ends),
                self.grid.corners(next_rows, self.col_ends),
                self.grid.corners(next_rows, self.col_begins),
            ],
            axis=1,
        )
        columns = {
            "row": self.rows,
            "col_begin": self.col_begins,
            "col_end": self.col_ends,
            "value": self.values,
        }
        return make_geodataframe(columns, shapely.polygons(corners))


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """A box of cells as arrays of shape (rows, columns) with the lowest row first.

    grid: size and position of the cells, in the frame of the answer.
    row_begin, col_begin: row and column of the cell of values[0, 0].
    values: values of the cells; NaN for unknown cells and for cells that the query did not select.
    selected: True for cells that the query selected.
    """

    grid: GridGeometry
    row_begin: int
    col_begin: int
    values: NDArray[np.float64]
    selected: NDArray[np.bool_]

    @property
    def box(self) -> CellBox:
        """The box of the cells of the arrays."""
        rows, cols = self.values.shape
        return CellBox(self.row_begin, self.row_begin + rows, self.col_begin, self.col_begin + cols)

    @property
    def origin(self) -> Pose:
        """Pose of the lower left corner of the cell of values[0, 0], in the frame of the answer."""
        x, y = self.grid.corners(self.row_begin, self.col_begin)
        return Pose(float(x), float(y), self.grid.origin.yaw)

    def value_at(self, point: PointLike) -> float:
        """The value at a point (metres); NaN for unknown cells and outside of the array."""
        row, col = self.grid.cell_at(point)
        row, col = row - self.row_begin, col - self.col_begin
        rows, cols = self.values.shape
        return float(self.values[row, col]) if 0 <= row < rows and 0 <= col < cols else np.nan

    def mesh(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """x and y of the corners of all cells in metres, as Matplotlib's pcolormesh expects them.

        Both arrays have shape (rows + 1, columns + 1).
        """
        box = self.box
        rows = np.arange(box.row_begin, box.row_end + 1)
        cols = np.arange(box.col_begin, box.col_end + 1)
        corners = self.grid.corners(rows[:, None], cols[None, :])
        return corners[..., 0], corners[..., 1]

"""Cells of grids, as runs and as arrays.

A grid has square cells and no fixed extent: rows count along the y axis of its origin, columns
along the x axis, both may be negative. Arrays have the lowest row first (imshow: origin="lower").
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
    """Where the cells of a grid lie.

    resolution_m: the side of a cell, > 0.
    origin: pose of the lower left corner of cell (row 0, column 0), in the frame of the answer or
        of the layer.
    """

    resolution_m: float
    origin: Pose = field(default_factory=Pose)

    def cell_at(self, point: PointLike) -> tuple[int, int]:
        """(row, column) of the cell at a point; its lower and left borders belong to it."""
        x, y = self.origin.inverse().apply(xy_of(point)) / self.resolution_m
        return int(np.floor(y)), int(np.floor(x))

    def corners(self, rows: ArrayLike, cols: ArrayLike) -> NDArray[np.float64]:
        """The lower left corners of cells, …×2 metres. Half rows and columns: their centres."""
        cols, rows = np.broadcast_arrays(np.asarray(cols, float), np.asarray(rows, float))
        return self.origin.apply(np.stack([cols, rows], axis=-1) * self.resolution_m)

    def centres(self, rows: ArrayLike, cols: ArrayLike) -> NDArray[np.float64]:
        """The centres of cells, …×2 metres."""
        return self.corners(np.asarray(rows, float) + 0.5, np.asarray(cols, float) + 0.5)


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
class CellBox:
    """Cells with row_begin <= row < row_end and col_begin <= column < col_end."""

    row_begin: int
    row_end: int
    col_begin: int
    col_end: int

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.row_end - self.row_begin, self.col_end - self.col_begin


class CellRule(IntEnum):
    """Which cells a polygon selects."""

    CENTRE = 1
    """Those whose centre it covers."""
    COVERED = 2
    """Those whose whole square it covers."""
    TOUCHED = 3
    """Those whose square shares a point with it."""


@dataclass(frozen=True, slots=True, eq=False)
class CellRuns:
    """Cells as runs of one row that share a value, by row and column.

    Run i is the cells col_begins[i] <= column < col_ends[i] of row rows[i], each with values[i];
    NaN is unknown. All four are arrays of length N.
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
        """How many cells the runs have together."""
        return int(np.sum(self.col_ends.astype(np.int64) - self.col_begins))

    @property
    def box(self) -> CellBox:
        """The smallest box with all the cells; an empty one when there are none."""
        if len(self) == 0:
            return CellBox(0, 0, 0, 0)
        return CellBox(
            int(self.rows.min()),
            int(self.rows.max()) + 1,
            int(self.col_begins.min()),
            int(self.col_ends.max()),
        )

    def cells(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """Cell after cell: rows, columns and values, three arrays of length num_cells."""
        lengths = self.col_ends.astype(np.int64) - self.col_begins
        ends = np.cumsum(lengths)
        in_run = np.arange(self.num_cells) - np.repeat(ends - lengths, lengths)
        rows = np.repeat(self.rows.astype(np.int64), lengths)
        return rows, np.repeat(self.col_begins, lengths) + in_run, np.repeat(self.values, lengths)

    def to_grid(self, box: CellBox | None = None, max_cells: int = 100_000_000) -> Grid:
        """As an array over `box`, absent: the smallest one that has all the cells.

        ValueError for a box of more than `max_cells`: cells may lie far apart.
        """
        box = box or self.box
        if box.shape[0] * box.shape[1] > max_cells:
            raise ValueError(
                f"an array of {box.shape[0]}×{box.shape[1]} cells is more than "
                f"max_cells={max_cells}; take the runs, or a smaller box"
            )
        values = np.full(box.shape, np.nan)
        selected = np.zeros(box.shape, dtype=bool)
        rows, cols, of_cells = self.cells()
        inside = (
            (rows >= box.row_begin)
            & (rows < box.row_end)
            & (cols >= box.col_begin)
            & (cols < box.col_end)
        )
        where = rows[inside] - box.row_begin, cols[inside] - box.col_begin
        values[where] = of_cells[inside]
        selected[where] = True
        return Grid(self.grid, box.row_begin, box.col_begin, values, selected)

    def to_geodataframe(self) -> geopandas.GeoDataFrame:
        """A rectangle for each run, with row, col_begin, col_end and value. Needs GeoPandas."""
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
    """A box of cells as arrays, rows×columns, the lowest row first.

    grid: where the cells lie, in the frame of the answer.
    row_begin, col_begin: the row and column of values[0, 0].
    values: NaN where nothing is known, and where the answer does not speak of the cell.
    selected: True where the answer speaks of the cell.
    """

    grid: GridGeometry
    row_begin: int
    col_begin: int
    values: NDArray[np.float64]
    selected: NDArray[np.bool_]

    @property
    def box(self) -> CellBox:
        """The cells that the arrays have."""
        rows, cols = self.values.shape
        return CellBox(self.row_begin, self.row_begin + rows, self.col_begin, self.col_begin + cols)

    @property
    def origin(self) -> Pose:
        """Pose of the lower left corner of values[0, 0], in the frame of the answer."""
        x, y = self.grid.corners(self.row_begin, self.col_begin)
        return Pose(float(x), float(y), self.grid.origin.yaw)

    def value_at(self, point: PointLike) -> float:
        """The value at a point; NaN when it is not known or outside of the array."""
        row, col = self.grid.cell_at(point)
        row, col = row - self.row_begin, col - self.col_begin
        rows, cols = self.values.shape
        return float(self.values[row, col]) if 0 <= row < rows and 0 <= col < cols else np.nan

    def mesh(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """x and y of the cells' corners, (rows + 1)×(columns + 1) each, as for pcolormesh."""
        box = self.box
        rows = np.arange(box.row_begin, box.row_end + 1)
        cols = np.arange(box.col_begin, box.col_end + 1)
        corners = self.grid.corners(rows[:, None], cols[None, :])
        return corners[..., 0], corners[..., 1]

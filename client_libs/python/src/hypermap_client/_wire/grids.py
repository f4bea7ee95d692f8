"""Conversion of the geometry and the cells of grids."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._proto import layer_pb2 as layer
from .._proto import query_service_pb2 as query
from ..grids import Cell, CellRuns, GridGeometry
from .geometry import decode_pose, encode_pose


def encode_grid(grid: GridGeometry) -> layer.GridGeometry:
    return layer.GridGeometry(origin=encode_pose(grid.origin), resolution_m=grid.resolution_m)


def decode_grid(message: layer.GridGeometry) -> GridGeometry:
    return GridGeometry(message.resolution_m, decode_pose(message.origin))


def decode_runs(messages: Sequence[query.CellRuns]) -> CellRuns:
    """Concatenates the runs of at least one message, all of the same grid."""
    return CellRuns(
        decode_grid(messages[0].grid),
        np.concatenate([np.array(m.rows, np.int32) for m in messages]),
        np.concatenate([np.array(m.col_begins, np.int32) for m in messages]),
        np.concatenate([np.array(m.col_ends, np.int32) for m in messages]),
        np.concatenate([np.array(m.values, np.float64) for m in messages]),
    )


def decode_cell(message: query.CellRuns) -> Cell:
    return Cell(
        message.rows[0], message.col_begins[0], message.values[0], decode_grid(message.grid)
    )

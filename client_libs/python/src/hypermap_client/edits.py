"""Changes of the content of layers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry import AreaLike
from .grids import CellRule
from .objects import MapObject


@dataclass(frozen=True, slots=True)
class PutObject:
    """Adds an object (id 0) or replaces the one with its id.

    frame_id: the frame of the polygon; empty: the layer's own.
    if_version: the version that the object must have, or the whole batch is Aborted.
    time_to_live: the object leaves the map when so much time has passed since the edit was carried
        out, unless it is put again before. None: it stays.
    """

    layer: str
    object: MapObject
    frame_id: str = ""
    if_version: int | None = None
    time_to_live: timedelta | None = None


@dataclass(frozen=True, slots=True)
class DeleteObject:
    """Removes an object; `if_version` as of PutObject."""

    layer: str
    id: int
    if_version: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class WriteCells:
    """Sets all cells of a box.

    values: rows×columns, the lowest row first; NaN is unknown.
    row_begin, col_begin: the row and column of values[0, 0].
    """

    layer: str
    values: NDArray[np.float64]
    row_begin: int = 0
    col_begin: int = 0

    def __init__(
        self, layer: str, values: ArrayLike, row_begin: int = 0, col_begin: int = 0
    ) -> None:
        """ValueError when the values are no two-dimensional array."""
        array = np.array(values, dtype=np.float64)
        if array.ndim != 2 or array.size == 0:
            raise ValueError(f"cells are rows×columns, not of shape {array.shape}")
        object.__setattr__(self, "layer", layer)
        object.__setattr__(self, "values", array)
        object.__setattr__(self, "row_begin", row_begin)
        object.__setattr__(self, "col_begin", col_begin)


@dataclass(frozen=True, slots=True)
class FillPolygon:
    """Sets the cells that a polygon selects to a value; None: unknown.

    frame_id: the frame of the area; empty: the layer's own.
    """

    layer: str
    area: AreaLike
    value: float | None
    frame_id: str = ""
    rule: CellRule = CellRule.CENTRE


@dataclass(frozen=True, slots=True)
class SetAliases:
    """Gives a semantic layer other words for its labels.

    Each alias gets these labels in place of those it had, or is taken out when it has none here.
    Other aliases of the layer stay.
    """

    layer: str
    aliases: Mapping[str, Sequence[str]]


Edit: TypeAlias = PutObject | DeleteObject | WriteCells | FillPolygon | SetAliases


@dataclass(frozen=True, slots=True)
class EditAnswer:
    """What a batch made. `object_ids`: one for each edit, of the object that was put, else 0."""

    map: str
    revision: int
    object_ids: tuple[int, ...]

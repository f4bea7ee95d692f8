"""Edits: the changes of layers, of their content and of frames that a client can request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry import AreaLike, Pose
from .grids import CellRule
from .layers import LayerSpec
from .objects import MapObject


@dataclass(frozen=True, slots=True)
class PutObject:
    """Adds an object, or replaces the object with the same id.

    object: id 0 adds a new object, to which the server gives an id.
    frame_id: frame of the shape; empty for the layer's own frame.
    if_version: the version that the object must have, else the whole batch fails with Aborted.
    time_to_live: time after the commit at which the server removes the object, unless it is put
        again before; must be positive. None keeps the object.
    """

    layer: str
    object: MapObject
    frame_id: str = ""
    if_version: int | None = None
    time_to_live: timedelta | None = None


@dataclass(frozen=True, slots=True)
class DeleteObject:
    """Removes an object.

    if_version: the version that the object must have, else the whole batch fails with Aborted.
    """

    layer: str
    id: int
    if_version: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class WriteCells:
    """Sets all cells of a box of a grid layer.

    values: array of shape (rows, columns) with the lowest row first; NaN makes a cell unknown.
        The layer's properties tell the range of its values.
    row_begin, col_begin: row and column of the cell of values[0, 0]; may be negative.

    Raises ValueError if `values` is empty or not two-dimensional.
    """

    layer: str
    values: NDArray[np.float64]
    row_begin: int = 0
    col_begin: int = 0

    def __init__(
        self, layer: str, values: ArrayLike, row_begin: int = 0, col_begin: int = 0
    ) -> None:
        array = np.array(values, dtype=np.float64)
        if array.ndim != 2 or array.size == 0:
            raise ValueError(f"values must be a non-empty 2-D array, not of shape {array.shape}")
        object.__setattr__(self, "layer", layer)
        object.__setattr__(self, "values", array)
        object.__setattr__(self, "row_begin", row_begin)
        object.__setattr__(self, "col_begin", col_begin)


@dataclass(frozen=True, slots=True)
class FillPolygon:
    """Sets the cells of a grid layer that a polygon selects.

    value: the new value; None makes the cells unknown.
    frame_id: frame of the area; empty for the layer's own frame.
    rule: which cells the polygon selects.
    """

    layer: str
    area: AreaLike
    value: float | None
    frame_id: str = ""
    rule: CellRule = CellRule.CENTRE


@dataclass(frozen=True, slots=True)
class SetAliases:
    """Sets or removes aliases of a semantic layer.

    An alias is a word that queries can use in place of several labels.

    aliases: labels by alias. They replace the earlier labels of that alias; an alias without labels
        is removed. Aliases that are not mentioned are kept.
    """

    layer: str
    aliases: Mapping[str, Sequence[str]]


@dataclass(frozen=True, slots=True)
class CreateLayer:
    """Creates an empty layer. Later edits of the same batch can write to it.

    layer: its parameters. The Layer of an existing layer makes one with the same parameters.
    """

    layer: LayerSpec


@dataclass(frozen=True, slots=True)
class DeleteLayer:
    """Deletes a layer with its content."""

    layer: str


@dataclass(frozen=True, slots=True)
class SetTransform:
    """Sets the pose of a frame in its parent frame.

    parent_from_child: maps coordinates in the child to coordinates in the parent. It replaces an
        earlier transform of the child.
    """

    parent_frame_id: str
    child_frame_id: str
    parent_from_child: Pose


# One change of a map.
Edit: TypeAlias = (
    PutObject
    | DeleteObject
    | WriteCells
    | FillPolygon
    | SetAliases
    | CreateLayer
    | DeleteLayer
    | SetTransform
)


@dataclass(frozen=True, slots=True)
class EditAnswer:
    """The result of a batch of edits.

    revision: the revision that the batch made.
    object_ids: one entry per edit: the id of the object for PutObject, 0 for other edits.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    map: str
    revision: int
    object_ids: tuple[int, ...]
    incarnation: int = 0

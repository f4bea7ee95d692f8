"""Layers: their kinds, the parameters to create one, and the metadata of an existing one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from .geometry import ShapeKind
from .grids import CellBox, CellRule, GridGeometry


class LayerKind(IntEnum):
    """The kind of content of a layer.

    A kind of a newer server that this client does not know becomes an enumerator named KIND_ and
    its number. The properties of a layer describe its content, so that most programs do not need
    its kind.
    """

    OCCUPANCY = 1
    """A grid of probabilities of occupation in [0, 1]."""
    EXPLORATION = 2
    """A grid of 0 (unexplored) and 1 (explored)."""
    SEMANTIC = 3
    """A set of labelled shapes: polygons, line strings and points."""
    SCALAR = 4
    """A grid of measured numbers."""

    @classmethod
    def _missing_(cls, value: object) -> LayerKind | None:
        if not isinstance(value, int) or value <= 0:
            return None
        kind = int.__new__(cls, value)
        kind._name_, kind._value_ = f"KIND_{value}", value
        return kind

    def __reduce_ex__(self, protocol: object) -> tuple[type[LayerKind], tuple[int]]:
        # Python 3.11 would look for the name of a pickled enumerator, which an unknown kind lacks.
        return LayerKind, (self.value,)


@dataclass(frozen=True, slots=True)
class OccupancyThresholds:
    """Thresholds of an occupancy layer.

    A cell of probability p is free if p < free_below, and occupied if p > occupied_above. None
    selects the server's default, 0.196 and 0.65.
    """

    free_below: float | None = None
    occupied_above: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LayerSpec:
    """The parameters of a layer to create.

    name: unique in its map; at most 63 letters, digits, '_', '-' and '.'.
    frame_id: frame of the layer's coordinates; empty for the map's own.
    grid: size and position of the cells in `frame_id`; required for grid layers.
    thresholds: for occupancy layers.
    unit: unit of the values of a scalar layer, free text.
    aliases: for semantic layers: labels by alias. A query for the alias finds all these labels.
    explored_rule: for exploration layers: which cells the free space of an observation marks as
        explored; None for the server's default, CellRule.CENTRE.
    shape_kinds: for semantic layers: the kinds of shape that objects may have; none for all kinds.
    """

    name: str
    kind: LayerKind
    frame_id: str = ""
    grid: GridGeometry | None = None
    thresholds: OccupancyThresholds = field(default_factory=OccupancyThresholds)
    unit: str = ""
    aliases: Mapping[str, Sequence[str]] = field(default_factory=dict)
    explored_rule: CellRule | None = None
    shape_kinds: Sequence[ShapeKind] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class LayerProperties:
    """A description of the content of a layer that does not depend on its kind.

    has_cells: whether the layer is a grid, which answers with values and cells.
    has_shapes: whether the layer has objects.
    unit: unit of the values of the cells; empty for none.
    value_range: the lowest and the highest value that a cell can have; None for any number.
    words: values by which cells can be queried, such as "free" and "occupied".
    is_binary: whether the cells have one of two values, and none between them.
    words_of_values: those of the words that stand for exactly one value, with the value, such as
        ("explored", 1.0).
    """

    has_cells: bool = False
    has_shapes: bool = False
    unit: str = ""
    value_range: tuple[float, float] | None = None
    words: tuple[str, ...] = ()
    is_binary: bool = False
    words_of_values: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer(LayerSpec):
    """An existing layer: its parameters and the size of its content.

    size: number of objects of a semantic layer, or of cells in the extent of a grid layer.
    extent: bounding box of all cells that were ever written; None for a grid layer without cells
        and for semantic layers.
    version: the newest revision that changed the layer or its content.
    properties: description of its content.
    problem: the reason why the stored content cannot be read; empty if it can. Such a layer answers
        queries with the status DAMAGED.
    """

    size: int = 0
    extent: CellBox | None = None
    version: int = 0
    properties: LayerProperties = field(default_factory=LayerProperties)
    problem: str = ""

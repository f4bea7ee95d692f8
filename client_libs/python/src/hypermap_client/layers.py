"""Layers: their kinds, the parameters to create one, and the metadata of an existing one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from .grids import CellBox, CellRule, GridGeometry


class LayerKind(IntEnum):
    """The kind of content of a layer."""

    OCCUPANCY = 1
    """A grid of probabilities of occupation in [0, 1]."""
    EXPLORATION = 2
    """A grid of 0 (unexplored) and 1 (explored)."""
    SEMANTIC = 3
    """A set of labelled polygons."""
    SCALAR = 4
    """A grid of measured numbers."""


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
    """

    name: str
    kind: LayerKind
    frame_id: str = ""
    grid: GridGeometry | None = None
    thresholds: OccupancyThresholds = field(default_factory=OccupancyThresholds)
    unit: str = ""
    aliases: Mapping[str, Sequence[str]] = field(default_factory=dict)
    explored_rule: CellRule | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer(LayerSpec):
    """An existing layer: its parameters and the size of its content.

    size: number of objects of a semantic layer, or of cells in the extent of a grid layer.
    extent: bounding box of all cells that were ever written; None for a grid layer without cells
        and for semantic layers.
    version: the newest revision that changed the layer or its content.
    """

    size: int = 0
    extent: CellBox | None = None
    version: int = 0

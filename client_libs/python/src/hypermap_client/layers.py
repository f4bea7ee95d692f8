"""Maps and their layers, apart from their content."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from .grids import CellBox, CellRule, GridGeometry


class LayerKind(IntEnum):
    """What a layer has at a place."""

    OCCUPANCY = 1
    """Cells with a probability of occupation in [0, 1]."""
    EXPLORATION = 2
    """Cells with 0 (unexplored) or 1 (explored)."""
    SEMANTIC = 3
    """Labelled polygons."""
    SCALAR = 4
    """Cells with a measured number."""


@dataclass(frozen=True, slots=True)
class OccupancyThresholds:
    """What an occupancy layer calls free (p < free_below) and occupied (p > occupied_above).

    None: the server's default, 0.196 and 0.65.
    """

    free_below: float | None = None
    occupied_above: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LayerSpec:
    """A layer to create.

    name: unique in its map; letters, digits, '_', '-', '.'; at most 63 characters.
    frame_id: the frame of the layer's coordinates; empty: the map's own.
    grid: of a grid kind, required: where its cells lie in `frame_id`.
    thresholds: of an occupancy layer.
    unit: of a scalar layer, free text.
    aliases: of a semantic layer: other words that its labels may be asked for by, each with the
        labels that it stands for.
    explored_rule: of an exploration layer: which cells an observation's free space marks.
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
    """A layer that is there.

    size: objects of a semantic layer, or cells in the extent of a grid.
    extent: the box of all cells ever written; None while there are none, and for semantic layers.
    version: the newest revision that changed the layer or its content.
    """

    size: int = 0
    extent: CellBox | None = None
    version: int = 0

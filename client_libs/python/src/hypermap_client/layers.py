"""Maps and their layers, apart from their content."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import IntEnum

from .geometry import Transform
from .grids import CellBox, GridGeometry


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


class CellRule(IntEnum):
    """Which cells a polygon selects."""

    CENTRE = 1
    """Those whose centre it covers."""
    COVERED = 2
    """Those whose whole square it covers."""
    TOUCHED = 3
    """Those whose square shares a point with it."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class MapEntry:
    """A map apart from its content.

    frame_id: the map's own frame, what an empty frame id means.
    problem: not empty when the server can't open the map: why. Only the name is set then.
    """

    name: str
    frame_id: str = ""
    revision: int = 0
    create_time: datetime | None = None
    layer_count: int = 0
    problem: str = ""


@dataclass(frozen=True, slots=True)
class LayerList:
    """The layers of a map by name, at a revision."""

    map: str
    revision: int
    layers: tuple[Layer, ...]

    def __getitem__(self, name: str) -> Layer:
        for layer in self.layers:
            if layer.name == name:
                return layer
        raise KeyError(name)


@dataclass(frozen=True, slots=True)
class TransformList:
    """The frames of a map by child, at a revision; `frame_id` is the map's own."""

    map: str
    revision: int
    frame_id: str
    transforms: tuple[Transform, ...]


class FileFormat(IntEnum):
    """What maps are exchanged as."""

    HMAP = 1
    """The original Hypermap's zip file."""
    NAV2 = 2
    """ROS map_server YAML with a PGM or PNG image: two files."""
    GEOJSON = 3
    """GeoJSON in local planar metres."""


@dataclass(frozen=True, slots=True)
class NamedFile:
    """A file by its base name, with all of its bytes."""

    name: str
    data: bytes = field(repr=False)


@dataclass(frozen=True, slots=True)
class ImportAnswer:
    """What an import made.

    layers: those that were made or written.
    repairs: how the server understood what was not as the format has it, a line each.
    """

    map: str
    revision: int
    layers: tuple[str, ...]
    repairs: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ExportAnswer:
    """Files of a map at a revision. `omissions`: a line for each thing that they can't carry."""

    map: str
    revision: int
    files: tuple[NamedFile, ...]
    omissions: tuple[str, ...]

    def save(self, folder: str | os.PathLike[str]) -> tuple[pathlib.Path, ...]:
        """Writes the files into a folder, and answers their paths."""
        # A name with folders in it would lead elsewhere.
        paths = tuple(pathlib.Path(folder, pathlib.Path(file.name).name) for file in self.files)
        for path, file in zip(paths, self.files, strict=True):
            path.write_bytes(file.data)
        return paths

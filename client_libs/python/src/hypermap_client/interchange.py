"""Interchange files, and the answers to importing and exporting them."""

from __future__ import annotations

import os
import pathlib
from dataclasses import dataclass, field
from enum import IntEnum


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

"""Interchange files, and the answers to importing and exporting them."""

from __future__ import annotations

import os
import pathlib
from dataclasses import dataclass, field
from enum import IntEnum


class FileFormat(IntEnum):
    """File formats for the import and export of maps."""

    HMAP = 1
    """The zip file of the original Hypermap."""
    NAV2 = 2
    """A YAML file of the ROS map_server and its PGM or PNG image, two files."""
    GEOJSON = 3
    """GeoJSON with coordinates in metres in a local planar frame."""


@dataclass(frozen=True, slots=True)
class NamedFile:
    """A file in memory.

    name: file name without a folder; its suffix tells the format.
    """

    name: str
    data: bytes = field(repr=False)


@dataclass(frozen=True, slots=True)
class ImportAnswer:
    """The result of an import.

    revision: the revision that the import made.
    layers: names of the layers that were created or written.
    repairs: one line for each deviation from the file format, with the server's interpretation.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    map: str
    revision: int
    layers: tuple[str, ...]
    repairs: tuple[str, ...]
    incarnation: int = 0


@dataclass(frozen=True, slots=True)
class ExportAnswer:
    """Files with the content of a map at a revision.

    omissions: one line for each part of the map that the file format cannot represent.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    map: str
    revision: int
    files: tuple[NamedFile, ...]
    omissions: tuple[str, ...]
    incarnation: int = 0

    def save(self, folder: str | os.PathLike[str]) -> tuple[pathlib.Path, ...]:
        """Writes the files into an existing folder and returns their paths.

        Raises OSError if a file cannot be written.
        """
        # Only the base name is used: the server must not choose another folder.
        paths = tuple(pathlib.Path(folder, pathlib.Path(file.name).name) for file in self.files)
        for path, file in zip(paths, self.files, strict=True):
            path.write_bytes(file.data)
        return paths

"""Reads files for upload and writes downloaded files."""

from __future__ import annotations

import os
import pathlib
import tempfile
from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import TypeAlias

from .interchange import FileFormat, NamedFile

# A path of a file on disk.
Path: TypeAlias = str | os.PathLike[str]
# A file on disk or in memory.
FileLike: TypeAlias = Path | NamedFile

_FORMATS = {
    ".hmap": FileFormat.HMAP,
    ".yaml": FileFormat.NAV2,
    ".yml": FileFormat.NAV2,
    ".geojson": FileFormat.GEOJSON,
    ".json": FileFormat.GEOJSON,
}


def read_files(files: FileLike | Iterable[FileLike]) -> list[NamedFile]:
    """Reads one or several files into memory. Raises OSError if one cannot be read."""
    if isinstance(files, (str, os.PathLike, NamedFile)):
        files = [files]
    return [_read(file) for file in files]


def _read(file: FileLike) -> NamedFile:
    if isinstance(file, NamedFile):
        return file
    path = pathlib.Path(file)
    return NamedFile(path.name, path.read_bytes())


def format_of(files: Iterable[NamedFile]) -> FileFormat:
    """The format of files by the suffix of their names. Raises ValueError if none is known."""
    names = [file.name for file in files]
    for name in names:
        if found := _FORMATS.get(pathlib.PurePath(name).suffix.lower()):
            return found
    raise ValueError(
        f"cannot tell the format of {names} by their suffix; pass format=FileFormat..."
    )


class FileChunks:
    """The content of a file in chunks. Each iteration opens the file and reads it anew.

    The constructor raises OSError if the file cannot be opened.
    """

    def __init__(self, path: Path, chunk_bytes: int) -> None:
        self._path = pathlib.Path(path)
        self._chunk_bytes = chunk_bytes
        self._path.open("rb").close()

    def __iter__(self) -> Iterator[bytes]:
        with self._path.open("rb") as file:
            while data := file.read(self._chunk_bytes):
                yield data


class AtomicFile:
    """A file that appears at its path when it is complete, replacing an earlier file.

    A context manager: it writes to a temporary file in the same folder, and at the end of the
    `with` block renames it to the path. An exception in the block removes the temporary file and
    leaves the earlier file in place.
    """

    def __init__(self, path: Path) -> None:
        self._path = pathlib.Path(path)
        self._size = 0

    def __enter__(self) -> AtomicFile:
        folder = self._path.parent
        self._file = tempfile.NamedTemporaryFile(dir=folder, prefix=".", delete=False)
        return self

    def write(self, data: bytes) -> None:
        self._size += self._file.write(data)

    @property
    def size(self) -> int:
        """The number of bytes written so far."""
        return self._size

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._file.close()
        if error is None:
            os.replace(self._file.name, self._path)
        else:
            os.unlink(self._file.name)

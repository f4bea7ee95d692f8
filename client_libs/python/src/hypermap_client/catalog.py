"""Maps, the lists of their layers and frames, and checks of their files."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum

from .geometry import Transform
from .layers import Layer


class MapState(IntEnum):
    """What a server does with a map at the moment."""

    SERVING = 1
    """It answers queries and takes changes."""
    DAMAGED = 2
    """Some of the stored content cannot be read. All else is answered and can be changed."""
    READ_ONLY = 3
    """Changes cannot be stored, as on a full disk. Queries are answered."""
    CLOSED = 4
    """The map cannot be opened, or its files were taken away."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapEntry:
    """Metadata of a map.

    frame_id: the map's own frame, which calls use when their frame id is empty.
    revision: the newest revision.
    incarnation: a random number that tells one history of the map from another. Revisions can be
        compared, and a watch or a page of revisions can be continued, only within one incarnation.
        A map gets a new one when it is created, also under an old name, when it is restored or
        replaced, and when acknowledged commits are missing after a restart of the server.
    create_time: time of creation in UTC.
    state: what the server does with the map at the moment.
    problem: the reason why the state is not SERVING. Of a closed map only the name is known
        besides.
    """

    name: str
    frame_id: str = ""
    revision: int = 0
    create_time: datetime | None = None
    layer_count: int = 0
    problem: str = ""
    incarnation: int = 0
    state: MapState = MapState.SERVING


@dataclass(frozen=True, slots=True)
class LayerList:
    """The layers of a map at a revision, sorted by name.

    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.

    Indexing with the name of a layer returns it and raises KeyError if there is none.
    """

    map: str
    revision: int
    layers: tuple[Layer, ...]
    incarnation: int = 0

    def __getitem__(self, name: str) -> Layer:
        for layer in self.layers:
            if layer.name == name:
                return layer
        raise KeyError(name)


@dataclass(frozen=True, slots=True)
class TransformList:
    """The transforms between the frames of a map at a revision, sorted by child frame.

    frame_id: the map's own frame.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    map: str
    revision: int
    frame_id: str
    transforms: tuple[Transform, ...]
    incarnation: int = 0


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem that a check of a stored map has found.

    table: the table or index; empty for the file as a whole.
    row: the row, such as "id 7"; empty for no single row.
    problem: description of the problem.
    can_be_rebuilt: whether `hypermap check --repair` can make it again from the rest of the map,
        without loss.
    """

    table: str
    row: str
    problem: str
    can_be_rebuilt: bool


@dataclass(frozen=True, slots=True)
class CheckReport:
    """The result of a check of a stored map.

    revision: the revision that was checked.
    findings: the problems, at most 10,000; none for an intact map.
    more: number of further findings.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    map: str
    revision: int
    findings: tuple[Finding, ...]
    more: int = 0
    incarnation: int = 0

    @property
    def is_intact(self) -> bool:
        """Whether the check found no problem."""
        return not self.findings


@dataclass(frozen=True, slots=True)
class MapDigest:
    """Digests of what a server shows of a map at a revision.

    layers: by name, 64 hexadecimal digits of SHA-256; empty if the layer can't be read.
    frames: the digest of the transforms between frames.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    map: str
    revision: int
    layers: dict[str, str]
    frames: str
    incarnation: int = 0

"""What changed in a map: revisions, differences, and the events of a watch."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum

from .geometry import Transform
from .grids import CellRuns
from .layers import Layer
from .objects import MapObject


class ChangeKind(IntEnum):
    """What happened."""

    PUT = 1
    """An object is new, or is not as it was."""
    REMOVE = 2
    """An object was removed."""
    ENTER = 3
    """Of a watch: an object that was there before is selected now."""
    LEAVE = 4
    """Of a watch: an object that is still there is not selected any more."""
    CELLS = 5
    """Cells were written."""
    LAYER_CREATED = 6
    """A layer was created, empty."""
    LAYER_DELETED = 7
    """A layer was deleted with all that it held."""
    LAYER_CHANGED = 8
    """A layer's aliases or the extent of its grid are not as they were."""
    TRANSFORM = 9
    """A frame was placed."""


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One thing that is not as it was. What does not belong to its kind is None or 0.

    object: PUT, ENTER: as it is now.
    object_before: of a difference, PUT and REMOVE: as it was; None when new.
    cells: CELLS: those that are not as they were, with their value now.
    cells_before: of a difference: the same cells with their value before.
    layer_now: LAYER_CREATED, LAYER_CHANGED.
    """

    kind: ChangeKind
    layer: str
    object_id: int = 0
    object: MapObject | None = None
    object_before: MapObject | None = None
    cells: CellRuns | None = None
    cells_before: CellRuns | None = None
    layer_now: Layer | None = None
    transform: Transform | None = None


@dataclass(frozen=True, slots=True, eq=False)
class WatchEvent:
    """A revision, whole.

    time, author: when it was made and by whom; not of a snapshot and of progress.
    changes: empty when nothing of what came up to this revision was selected (progress).
    snapshot: the changes are all that the filter selects at the revision (PUT and CELLS).
    reset: of a snapshot: what was told before does not hold any more.
    """

    revision: int
    time: datetime | None
    author: str
    changes: tuple[Change, ...]
    snapshot: bool = False
    reset: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """What is not at to_revision as it was at from_revision, each thing once."""

    from_revision: int
    to_revision: int
    changes: tuple[Change, ...]


@dataclass(frozen=True, slots=True)
class Revision:
    """A commit. `time` is rounded up to a microsecond, so that the map as of it has the commit."""

    revision: int
    time: datetime
    author: str
    num_changes: int


@dataclass(frozen=True, slots=True)
class RevisionList:
    """Kept revisions of a map. `oldest` is the oldest that can be asked for."""

    map: str
    newest: int
    oldest: int
    revisions: tuple[Revision, ...]

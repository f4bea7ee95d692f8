"""Changes of a map: events of a watch, differences between revisions, lists of revisions."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum

from .geometry import Transform
from .grids import CellRuns
from .layers import Layer
from .objects import MapObject


class ChangeKind(IntEnum):
    """The kind of a change. ENTER and LEAVE occur in watches only."""

    PUT = 1
    """An object was added or replaced."""
    REMOVE = 2
    """An object was removed."""
    ENTER = 3
    """An existing object now matches the filter of the watch and did not before."""
    LEAVE = 4
    """An object no longer matches the filter of the watch, but still exists."""
    CELLS = 5
    """Cells were written."""
    LAYER_CREATED = 6
    """An empty layer was created."""
    LAYER_DELETED = 7
    """A layer was deleted with its content."""
    LAYER_CHANGED = 8
    """The aliases of a layer or the extent of its grid changed."""
    TRANSFORM = 9
    """The transform of a frame was set."""


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """A change of one object, of cells of one layer, of a layer or of a transform.

    Fields that do not apply to the kind of the change are None, 0 or empty.

    object_id: id of the object, for PUT, REMOVE, ENTER and LEAVE.
    object: the object after the change, for PUT and ENTER.
    object_before: the object before the change, for PUT and REMOVE; None for a new object.
        Differences only.
    cells: the changed cells with their new values, for CELLS.
    cells_before: the same cells with their values before the change, for CELLS. Differences only.
    layer_now: the layer after the change, for LAYER_CREATED and LAYER_CHANGED.
    transform: the new transform, for TRANSFORM.
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
    """All changes of one revision that match the filter of a watch.

    revision: the watch can be resumed after this revision.
    time: time of the commit, in UTC; None for snapshots and progress events.
    author: author of the commit; empty for snapshots and progress events.
    changes: empty for a progress event, which reports that no change up to this revision matched.
    snapshot: whether the changes are the whole selected content at this revision, as PUT and CELLS.
    reset: whether this snapshot replaces everything that earlier events reported.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry. It changes
        only with a snapshot that has `reset` set.
    """

    revision: int
    time: datetime | None
    author: str
    changes: tuple[Change, ...]
    snapshot: bool = False
    reset: bool = False
    incarnation: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """The changes between two revisions.

    Each object, cell, layer and transform that differs is reported once, however often it changed.

    incarnation: the incarnation of the map to which the revisions belong, see MapEntry.
    """

    from_revision: int
    to_revision: int
    changes: tuple[Change, ...]
    incarnation: int = 0


@dataclass(frozen=True, slots=True)
class Revision:
    """A commit to a map.

    time: time of the commit in UTC, rounded up to a microsecond. A query as of this time sees the
        commit.
    """

    revision: int
    time: datetime
    author: str
    num_changes: int


@dataclass(frozen=True, slots=True)
class RevisionList:
    """A page of the revisions that the server keeps of a map.

    newest: the newest revision of the map.
    oldest: the oldest revision that can be queried; older ones are compacted.
    incarnation: the incarnation of the map to which the revisions belong, see MapEntry. The next
        page belongs to the same history only if it is requested with this number.
    """

    map: str
    newest: int
    oldest: int
    revisions: tuple[Revision, ...]
    incarnation: int = 0

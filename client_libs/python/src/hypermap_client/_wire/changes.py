"""Conversion of changes, watch events and revisions."""

from __future__ import annotations

from .._proto import watch_service_pb2 as pb
from ..changes import Change, ChangeKind, Revision, RevisionList, WatchEvent
from .enums import decode_enum
from .geometry import decode_transform
from .grids import decode_runs
from .layers import decode_layer
from .objects import decode_object
from .time import decode_commit_time


def decode_change(message: pb.Change) -> Change:
    has = message.HasField
    return Change(
        decode_enum(ChangeKind, message.kind),
        message.layer,
        message.object_id,
        object=decode_object(message.object) if has("object") else None,
        object_before=decode_object(message.object_before) if has("object_before") else None,
        cells=decode_runs([message.cells]) if has("cells") else None,
        cells_before=decode_runs([message.cells_before]) if has("cells_before") else None,
        layer_now=decode_layer(message.layer_now) if has("layer_now") else None,
        transform=decode_transform(message.transform) if has("transform") else None,
    )


class WatchEventBuilder:
    """Assembles the event of one revision from the messages of a watch."""

    def __init__(self) -> None:
        self._last = pb.WatchResponse()
        self._author = ""
        self._changes: list[Change] = []
        self._snapshot = False
        self._reset = False

    def add(self, message: pb.WatchResponse) -> bool:
        """Adds a message and returns whether the revision is complete."""
        self._changes.extend(map(decode_change, message.changes))
        self._author = message.author or self._author
        self._snapshot |= message.snapshot
        self._reset |= message.reset
        self._last = message
        return not message.more

    def build(self, reset: bool) -> WatchEvent:
        """The event. `reset` marks a snapshot as one that replaces the state of earlier events."""
        last = self._last
        return WatchEvent(
            last.revision,
            decode_commit_time(last.time) if last.HasField("time") else None,
            self._author,
            tuple(self._changes),
            self._snapshot,
            self._reset or (self._snapshot and reset),
            last.incarnation,
        )


def decode_revisions(message: pb.ListRevisionsResponse) -> RevisionList:
    return RevisionList(
        message.map,
        message.newest_revision,
        message.oldest_revision,
        tuple(
            Revision(r.revision, decode_commit_time(r.time), r.author, r.num_changes)
            for r in message.revisions
        ),
        message.incarnation,
    )

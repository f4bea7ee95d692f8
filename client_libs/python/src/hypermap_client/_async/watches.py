"""Calls for watches, differences between revisions, and lists of revisions."""

from __future__ import annotations

import math
from collections.abc import Iterable

from .. import _rpc as rpc
from .._proto import watch_service_pb2 as pb
from .._requests import Layers, make_scope, names_of
from .._wire.changes import decode_change, decode_revisions
from .._wire.geometry import encode_polygon
from ..changes import Difference, RevisionList
from ..geometry import AreaLike
from .connection import Connection
from .watch import AsyncWatch


class Watches(Connection):
    """Calls for watches, differences between revisions, and lists of revisions."""

    def watch(
        self,
        map_name: str,
        *,
        layers: Layers = (),
        frame_id: str = "",
        area: AreaLike | None = None,
        classes: Iterable[str] = (),
        start_revision: int | None = None,
        incarnation: int = 0,
        snapshot_when_compacted: bool = True,
        coalesce: bool = True,
        retry_for: float = math.inf,
        idle_timeout: float | None = 60.0,
        timeout: float = math.inf,
    ) -> AsyncWatch:
        """Watches a map. Returns an iterator of events, each with all changes of one revision.

        layers: none for all layers, including those created later.
        area: polygon in `frame_id`, in metres, that selects the objects that intersect it and the
            cells whose centre it covers; None for everywhere.
        classes: labels or aliases that select objects; none for all. Cells are not filtered by it.
        start_revision: report the changes after this revision; None to start with a snapshot of the
            newest revision.
        incarnation: the incarnation to which start_revision belongs, see WatchEvent; 0 for any.
        snapshot_when_compacted: whether a snapshot with `reset` set replaces changes that the
            server has compacted, and the whole state if the map has another incarnation by now. If
            False, the watch raises OutOfRange or Aborted instead.
        coalesce: allow the server to send several events of a busy map in one message, some
            milliseconds later. It can then serve more watches. The events are the same.
        retry_for: time in seconds for which a watch is resumed after it has broken while the server
            is Unavailable. The first connection is retried for the client's retry_for.
        idle_timeout: time in seconds without a message after which the connection counts as broken.
            It must exceed the server's --watch_progress (default 10 s). None for no limit.
        timeout: time in seconds for the whole watch.

        A watch that resumes sends the incarnation of its last event, so that it never continues in
        another history of the map.

        The iterator raises NotFound for an unknown map or frame, OutOfRange for a start_revision
        that does not exist yet, ResourceExhausted if the server has too many watches, and Aborted
        if the map has another incarnation than the given one and there is no start_revision.
        """
        request = pb.WatchRequest(
            scope=make_scope(map_name, layers, frame_id, incarnation),
            area=None if area is None else encode_polygon(area),
            classes=names_of(classes),
            start_revision=start_revision,
            coalesce=coalesce,
        )
        return AsyncWatch(
            self._channel,
            request,
            seen=self._seen,
            retry_first_for=self._retry_for,
            retry_for=retry_for,
            snapshot_when_compacted=snapshot_when_compacted,
            idle_timeout=idle_timeout,
            timeout=timeout,
        )

    async def list_changes(
        self,
        map_name: str,
        from_revision: int,
        to_revision: int | None = None,
        *,
        layers: Layers = (),
        frame_id: str = "",
        incarnation: int = 0,
        timeout: float | None = None,
    ) -> Difference:
        """Returns the changes between two revisions, for each object and cell at most one.

        from_revision: the earlier state.
        to_revision: the later state; None for the newest revision.

        Raises OutOfRange if a revision is compacted or does not exist yet, and Aborted if the map
        has another incarnation than the given one.
        """
        request = pb.ListChangesRequest(
            scope=make_scope(map_name, layers, frame_id, incarnation),
            from_revision=from_revision,
            to_revision=to_revision,
        )
        parts = await self._collect(rpc.LIST_CHANGES, request, timeout)
        to = parts[-1].to_revision if parts else from_revision
        changes = tuple(decode_change(change) for part in parts for change in part.changes)
        return Difference(from_revision, to, changes, parts[-1].incarnation if parts else 0)

    async def list_revisions(
        self,
        map_name: str,
        *,
        after_revision: int = 0,
        before_revision: int = 0,
        page_size: int = 0,
        newest_first: bool = False,
        incarnation: int = 0,
        timeout: float | None = None,
    ) -> RevisionList:
        """Lists a page of the revisions that the server keeps.

        after_revision, before_revision: exclusive limits; 0 for no limit.
        page_size: maximal number of revisions; 0 for 1000.
        newest_first: whether the page has the newest revisions within the limits, in descending
            order, instead of the oldest in ascending order.
        incarnation: that of the page before, for a further page.

        Raises Aborted if the map has another incarnation than the given one.
        """
        request = pb.ListRevisionsRequest(
            map=map_name,
            after_revision=after_revision,
            before_revision=before_revision,
            page_size=page_size,
            newest_first=newest_first,
            incarnation=incarnation,
        )
        return decode_revisions(await self._call(rpc.LIST_REVISIONS, request, timeout))

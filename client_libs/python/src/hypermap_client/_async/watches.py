"""Changes of a map: watches, differences, revisions."""

from __future__ import annotations

import math
from collections.abc import Iterable

from .. import _rpc as rpc
from .._proto import watch_service_pb2 as pb
from .._requests import Layers, names_of
from .._wire.changes import decode_change, decode_revisions
from .._wire.geometry import encode_polygon
from ..changes import Difference, RevisionList
from ..geometry import AreaLike
from .connection import Connection
from .watch import AsyncWatch


class Watches(Connection):
    """What changed, and what changes."""

    def watch(
        self,
        map_name: str,
        *,
        layers: Layers = (),
        frame_id: str = "",
        area: AreaLike | None = None,
        classes: Iterable[str] = (),
        start_revision: int | None = None,
        snapshot_when_compacted: bool = True,
        coalesce: bool = True,
        retry_for: float = math.inf,
        idle_timeout: float | None = 60.0,
        timeout: float = math.inf,
    ) -> AsyncWatch:
        """Follows a map: an iterator of events, each a whole revision.

        layers: none: all, also those that are still to come.
        area: objects that intersect it, cells whose centre it covers; None: everywhere.
        classes: objects with one of these labels or aliases of them; none: all. Cells are not
            filtered by it.
        start_revision: tell the changes after it; None: a snapshot first.
        snapshot_when_compacted: when the changes to go on with are not kept any more, a snapshot
            takes their place, with `reset` set; False: the watch ends with OutOfRange.
        coalesce: changes of a busy map may come some milliseconds later, several in a message; the
            server can then tell many more. Events are the same.
        retry_for: how long a watch that had begun is tried again while no server answers.
        idle_timeout: a connection on which nothing came for so many seconds is taken for broken.
            Longer than the server's --watch_progress (10 s). None: never.
        timeout: of the whole watch, in seconds.
        """
        request = pb.WatchRequest(
            map=map_name,
            layers=names_of(layers),
            frame_id=frame_id,
            area=None if area is None else encode_polygon(area),
            classes=names_of(classes),
            start_revision=start_revision,
            coalesce=coalesce,
        )
        return AsyncWatch(
            self._channel,
            request,
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
        timeout: float | None = None,
    ) -> Difference:
        """What is not at `to_revision` (None: the newest) as it was at `from_revision`.

        OutOfRange for a revision that is not kept.
        """
        request = pb.ListChangesRequest(
            map=map_name,
            layers=names_of(layers),
            frame_id=frame_id,
            from_revision=from_revision,
            to_revision=to_revision,
        )
        parts = await self._collect(rpc.LIST_CHANGES, request, timeout)
        to = parts[-1].to_revision if parts else from_revision
        changes = tuple(decode_change(change) for part in parts for change in part.changes)
        return Difference(from_revision, to, changes)

    async def list_revisions(
        self,
        map_name: str,
        *,
        after_revision: int = 0,
        before_revision: int = 0,
        page_size: int = 0,
        newest_first: bool = False,
        timeout: float | None = None,
    ) -> RevisionList:
        """The kept revisions between two (exclusive; 0: no limit), a page of them.

        page_size: at most so many; 0: 1000.
        """
        request = pb.ListRevisionsRequest(
            map=map_name,
            after_revision=after_revision,
            before_revision=before_revision,
            page_size=page_size,
            newest_first=newest_first,
        )
        return decode_revisions(await self._call(rpc.LIST_REVISIONS, request, timeout))

"""Watches: iterators over the changes of a map that survive broken connections."""

from __future__ import annotations

import math
import time
from collections import deque
from types import TracebackType

from .. import _rpc as rpc
from .._io import aio
from .._proto import watch_service_pb2 as pb
from .._retries import Backoff, time_left
from .._seen import SeenRevisions
from .._wire.changes import WatchEventBuilder
from ..changes import WatchEvent
from ..errors import (
    Aborted,
    Cancelled,
    HypermapError,
    Internal,
    OutOfRange,
    ResourceExhausted,
    Unavailable,
)


class AsyncWatch:
    """The events of a watch, made by Client.watch.

    Each event has all changes of one revision. Every revision is reported once, in order. A watch
    that breaks is resumed after the last complete revision of the same incarnation of the map. If
    the map is another one by then, the watch begins anew with a snapshot that has `reset` set.
    Iteration stops when the watch or its client is closed; a `with` block closes the watch.
    """

    def __init__(
        self,
        channel: aio.Channel,
        request: pb.WatchRequest,
        *,
        seen: SeenRevisions,
        retry_first_for: float,
        retry_for: float,
        snapshot_when_compacted: bool,
        idle_timeout: float | None,
        timeout: float,
    ) -> None:
        self._channel = channel
        self._request = request
        self._seen = seen
        self._retry_first_for = retry_first_for
        self._retry_for = retry_for
        self._snapshot_when_compacted = snapshot_when_compacted
        self._idle_timeout = idle_timeout
        self._deadline = time.monotonic() + timeout
        self._messages: deque[pb.WatchResponse] = deque()
        self._builder = WatchEventBuilder()
        self._backoff = Backoff()
        self._num_untried = len(channel.servers) - 1
        self._broken_since: float | None = None
        self._last_revision: int | None = None
        self._last_incarnation = 0  # 0 before the first event
        self._started = False  # whether a message has ever arrived
        self._reset_next_snapshot = False
        self._closed = False
        self._open()

    @property
    def revision(self) -> int | None:
        """The revision of the last event, to resume from; None before the first event."""
        return self._last_revision

    @property
    def incarnation(self) -> int:
        """The incarnation of the map at the last event, to resume from; 0 before the first."""
        return self._last_incarnation

    def close(self) -> None:
        """Ends the watch; any thread may call it. Does nothing if the watch has ended."""
        self._closed = True
        self._stream.cancel()

    async def __anext__(self) -> WatchEvent:
        """Waits for the next event: changes that match the filter, or progress."""
        while not self._ended:
            try:
                message = await self._read()
                if self._builder.add(message):
                    return self._finish_event()
            except HypermapError as error:
                if not self._ended:
                    await self._recover(error)
        raise StopAsyncIteration

    def __aiter__(self) -> AsyncWatch:
        return self

    async def __aenter__(self) -> AsyncWatch:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def _ended(self) -> bool:
        return self._closed or self._channel.closed

    def _open(self) -> None:
        self._stream = self._channel.download(
            rpc.WATCH, self._request, time_left(self._deadline), self._idle_timeout
        )
        if self._closed:  # Another thread has called close() in the meantime.
            self._stream.cancel()

    async def _read(self) -> pb.WatchResponse:
        if not self._messages:
            message = await self._stream.read()
            if message is None:
                raise Unavailable("the server ended the watch")
            self._messages.extend(message.coalesced or [message])
            self._started = True
            self._broken_since = None
            self._backoff.reset()
        return self._messages.popleft()

    def _finish_event(self) -> WatchEvent:
        event = self._builder.build(reset=self._reset_next_snapshot)
        self._builder = WatchEventBuilder()
        self._check_incarnation(event)
        self._check_order(event)
        self._last_revision = self._request.start_revision = event.revision
        self._last_incarnation = self._request.scope.incarnation = event.incarnation
        self._seen.note(self._request.scope.map, event.incarnation, event.revision)
        if event.snapshot:
            self._reset_next_snapshot = False
        return event

    def _check_incarnation(self, event: WatchEvent) -> None:
        """Raises Aborted if the event continues another history of the map than the requested."""
        wanted = self._request.scope.incarnation
        if wanted not in (0, event.incarnation) and not event.reset:
            message = f"the map has another incarnation: {event.incarnation}, not {wanted}"
            raise Aborted(message)

    def _check_order(self, event: WatchEvent) -> None:
        """Raises Internal for changes of a revision that was reported before."""
        if self._last_revision is None or event.snapshot:
            return
        step = event.revision - self._last_revision
        if step < 0 or (step == 0 and event.changes):
            raise Internal(f"the server sent revision {event.revision} after {self._last_revision}")

    async def _recover(self, error: HypermapError) -> None:
        """Resumes the watch after an error, or ends it and raises the error."""
        self._builder = WatchEventBuilder()
        self._messages.clear()
        self._stream.cancel()
        if (
            isinstance(error, (OutOfRange, Aborted))
            and self._snapshot_when_compacted
            and self._request.HasField("start_revision")
        ):
            self._request.ClearField("start_revision")
            self._request.scope.incarnation = 0
            self._reset_next_snapshot = True
        elif not self._is_resumable(error):
            self.close()
            raise error
        elif not isinstance(error, ResourceExhausted):  # Too slow a reader, wherever it reads.
            self._stream.leave_server()
        now = time.monotonic()
        self._broken_since = now if self._broken_since is None else self._broken_since
        pause = self._backoff.next()
        if now + pause >= min(self._retry_until(self._broken_since), self._deadline):
            self.close()
            raise error
        await aio.sleep(pause)
        if not self._ended:
            self._open()

    def _retry_until(self, broken_since: float) -> float:
        """The time before which a broken watch may be opened again.

        Before the first message, each server is tried at least once.
        """
        if self._started:
            return broken_since + self._retry_for
        if self._num_untried == 0:
            return broken_since + self._retry_first_for
        self._num_untried -= 1
        return math.inf

    def _is_resumable(self, error: HypermapError) -> bool:
        if not self._started:
            return isinstance(error, Unavailable)
        # A server that shuts down cancels its watches, and it ends a watch that is read too slowly
        # with ResourceExhausted.
        return isinstance(error, (Unavailable, Cancelled, ResourceExhausted))

"""Following the changes of a map."""

from __future__ import annotations

import time
from collections import deque
from types import TracebackType

from .. import _rpc as rpc
from .._io import aio
from .._proto import watch_service_pb2 as pb
from .._retries import Backoff, time_left
from .._wire.changes import PartsOfEvent
from ..changes import WatchEvent
from ..errors import Cancelled, HypermapError, Internal, OutOfRange, ResourceExhausted, Unavailable


class AsyncWatch:
    """The events of a watch, from Client.watch. Each revision once, in order and whole.

    A watch that breaks goes on by itself after the last revision that was told whole. Leaving its
    `with` block ends it, as do `close` and the end of the client.
    """

    def __init__(
        self,
        channel: aio.Channel,
        request: pb.WatchRequest,
        *,
        retry_first_for: float,
        retry_for: float,
        snapshot_when_compacted: bool,
        idle_timeout: float | None,
        timeout: float,
    ) -> None:
        self._channel = channel
        self._request = request
        self._retry_first_for = retry_first_for
        self._retry_for = retry_for
        self._snapshot_when_compacted = snapshot_when_compacted
        self._idle_timeout = idle_timeout
        self._deadline = time.monotonic() + timeout
        self._messages: deque[pb.WatchResponse] = deque()
        self._parts = PartsOfEvent()
        self._backoff = Backoff()
        self._broken_since: float | None = None
        self._told: int | None = None
        self._begun = False
        self._starts_anew = False
        self._closed = False
        self._open()

    @property
    def revision(self) -> int | None:
        """The last revision that was told whole, to resume from; None before there is one."""
        return self._told

    def close(self) -> None:
        """Ends the watch; any thread may do so. Again is a no-op."""
        self._closed = True
        self._stream.cancel()

    async def __anext__(self) -> WatchEvent:
        """The next revision of which something is selected, or progress; waits for it."""
        while not self._ended:
            try:
                message = await self._read()
                if self._parts.take(message):
                    return self._event()
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
        if self._closed:  # meanwhile
            self._stream.cancel()

    async def _read(self) -> pb.WatchResponse:
        if not self._messages:
            message = await self._stream.read()
            if message is None:
                raise Unavailable("the server ended the watch")
            self._messages.extend(message.coalesced or [message])
            self._begun = True
            self._broken_since = None
            self._backoff.reset()
        return self._messages.popleft()

    def _event(self) -> WatchEvent:
        event = self._parts.event(reset=self._starts_anew)
        self._parts = PartsOfEvent()
        self._check_order(event)
        self._told = self._request.start_revision = event.revision
        if event.snapshot:
            self._starts_anew = False
        return event

    def _check_order(self, event: WatchEvent) -> None:
        """Internal for an event that tells again what was told."""
        if self._told is None or event.snapshot:
            return
        behind = event.revision - self._told
        if behind < 0 or (behind == 0 and event.changes):
            raise Internal(
                f"the server's answer: revision {event.revision} was told after {self._told}"
            )

    async def _recover(self, error: HypermapError) -> None:
        """After a break: opens the next call, or ends the watch and raises `error`."""
        self._parts = PartsOfEvent()
        self._messages.clear()
        self._stream.cancel()
        if (
            isinstance(error, OutOfRange)
            and self._snapshot_when_compacted
            and self._request.HasField("start_revision")
        ):
            self._request.ClearField("start_revision")
            self._starts_anew = True
        elif not self._may_go_on(error):
            self.close()
            raise error
        now = time.monotonic()
        self._broken_since = now if self._broken_since is None else self._broken_since
        retry_for = self._retry_for if self._begun else self._retry_first_for
        pause = self._backoff.next()
        if now + pause >= min(self._broken_since + retry_for, self._deadline):
            self.close()
            raise error
        await aio.sleep(pause)
        if not self._ended:
            self._open()

    def _may_go_on(self, error: HypermapError) -> bool:
        if not self._begun:
            return isinstance(error, Unavailable)
        # A server that stops cancels its watches; one that finds this reader too slow says
        # ResourceExhausted.
        return isinstance(error, (Unavailable, Cancelled, ResourceExhausted))

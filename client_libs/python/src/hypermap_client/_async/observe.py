"""Streams of observations."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from types import TracebackType

from .. import _rpc as rpc
from .._io import aio
from .._proto import ingest_service_pb2 as pb
from .._proto import observation_pb2 as observation
from .._retries import Retries, time_left
from .._wire.observations import decode_acknowledgement, decode_opened, encode_observation
from ..errors import HypermapError, Internal, Unavailable
from ..observations import Acknowledgement, Observation, OpenedLayer

# In a request. The server's limit is of bytes (--max_message_bytes); a depth view has some 100 kB.
OBSERVATIONS_AT_ONCE = 16


class AsyncObserveStream:
    """A stream of observations to a layer, from Client.observe. For one task or thread at a time.

    Use it in a `with` block, which opens and ends it.
    """

    opened: OpenedLayer
    """How the layer is fused, and which sequences of the stream's robot it has."""

    def __init__(
        self,
        channel: aio.Channel,
        opening: pb.ObserveOpening,
        *,
        retry_for: float,
        idle_timeout: float | None,
        timeout: float,
    ) -> None:
        self._channel = channel
        self._opening = opening
        self._retry_for = retry_for
        self._idle_timeout = idle_timeout
        self._deadline = time.monotonic() + timeout
        self._stream: aio.Stream[pb.ObserveRequest, pb.ObserveResponse] | None = None

    async def submit(
        self, observations: Observation | Iterable[Observation]
    ) -> tuple[Acknowledgement, ...]:
        """Sends observations and waits until each is acknowledged; in the order given.

        Accepted means on disk, fused and visible. What is wrong with one observation is told in
        its acknowledgement. When the stream breaks it is opened again, and what was not
        acknowledged is sent again: the server counts each (robot, sequence) once.
        """
        if isinstance(observations, Observation):
            observations = [observations]
        todo = list(map(encode_observation, observations))
        if len({(o.robot, o.sequence) for o in todo}) < len(todo):
            raise ValueError("two observations of a submission have one robot and sequence")
        done: dict[tuple[str, int], Acknowledgement] = {}
        for begin in range(0, len(todo), OBSERVATIONS_AT_ONCE):
            await self._deliver(todo[begin : begin + OBSERVATIONS_AT_ONCE], done)
        return tuple(done[o.robot, o.sequence] for o in todo)

    async def close(self) -> None:
        """Ends the stream. Again is a no-op."""
        if self._stream is not None:
            self._stream.cancel()
            self._stream = None

    async def __aenter__(self) -> AsyncObserveStream:
        await self._deliver([], {})
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.close()

    async def _deliver(
        self,
        observations: list[observation.Observation],
        done: dict[tuple[str, int], Acknowledgement],
    ) -> None:
        retries = Retries(self._retry_for, math.inf)
        while True:
            try:
                stream = self._stream or await self._open()
                left = [o for o in observations if (o.robot, o.sequence) not in done]
                if left:
                    await stream.write(pb.ObserveRequest(observations=left))
                await self._await(stream, {(o.robot, o.sequence) for o in left}, done)
                return
            except HypermapError as error:
                await self.close()
                pause = retries.pause(error)
            await aio.sleep(pause)

    async def _open(self) -> aio.Stream[pb.ObserveRequest, pb.ObserveResponse]:
        stream: aio.Stream[pb.ObserveRequest, pb.ObserveResponse] = self._channel.duplex(
            rpc.OBSERVE, time_left(self._deadline), self._idle_timeout
        )
        self._stream = stream
        await stream.write(pb.ObserveRequest(opening=self._opening))
        answer = await stream.read()
        if answer is None or not answer.HasField("opened"):
            raise Internal("the server's answer: the first message does not open the stream")
        self.opened = decode_opened(answer.opened)
        return stream

    async def _await(
        self,
        stream: aio.Stream[pb.ObserveRequest, pb.ObserveResponse],
        waiting: set[tuple[str, int]],
        done: dict[tuple[str, int], Acknowledgement],
    ) -> None:
        while waiting:
            answer = await stream.read()
            if answer is None:
                raise Unavailable("the server ended the stream")
            for acknowledgement in map(decode_acknowledgement, answer.acknowledgements):
                key = acknowledgement.robot, acknowledgement.sequence
                done[key] = acknowledgement
                waiting.discard(key)

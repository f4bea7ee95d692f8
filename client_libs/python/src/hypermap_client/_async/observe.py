"""Streams of observations to a fused layer."""

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
from .._seen import SeenRevisions
from .._wire.observations import decode_acknowledgement, decode_opened, encode_observation
from ..errors import HypermapError, Internal, Unavailable
from ..observations import Acknowledgement, Observation, OpenedLayer

# Number of observations in a request. The server limits the bytes of a request
# (--max_message_bytes); an observation with a depth image has about 100 kB.
OBSERVATIONS_PER_REQUEST = 16


class AsyncObserveStream:
    """A stream of observations to a layer, made by Client.observe.

    Use it in a `with` block, which opens and closes it. One task or thread may use it at a time.
    """

    opened: OpenedLayer
    """The configuration of the layer, and the sequences of the stream's robot that it has.

    Set when the `with` block is entered, and again when the stream is reopened. Its `incarnation`
    differs then if the map has been replaced in the meantime; the new map does not have the
    observations that the old one acknowledged.
    """

    def __init__(
        self,
        channel: aio.Channel,
        opening: pb.ObserveOpening,
        *,
        seen: SeenRevisions,
        retry_for: float,
        idle_timeout: float | None,
        timeout: float,
    ) -> None:
        self._channel = channel
        self._opening = opening
        self._seen = seen
        self._retry_for = retry_for
        self._idle_timeout = idle_timeout
        self._deadline = time.monotonic() + timeout
        self._stream: aio.Stream[pb.ObserveRequest, pb.ObserveResponse] | None = None

    async def submit(
        self, observations: Observation | Iterable[Observation]
    ) -> tuple[Acknowledgement, ...]:
        """Sends observations, and waits until the server has acknowledged all of them.

        Returns one acknowledgement per observation, in the same order. An accepted observation is
        on disk, fused and visible. An observation that is not accepted does not raise an error; its
        acknowledgement has the reason.

        If the stream breaks, it is opened again and observations without acknowledgement are sent
        again; the server counts each pair of robot and sequence once.

        Raises ValueError if two observations have the same robot and sequence.
        """
        if isinstance(observations, Observation):
            observations = [observations]
        messages = list(map(encode_observation, observations))
        if len({(o.robot, o.sequence) for o in messages}) < len(messages):
            raise ValueError("two observations have the same robot and sequence")
        acknowledged: dict[tuple[str, int], Acknowledgement] = {}
        for begin in range(0, len(messages), OBSERVATIONS_PER_REQUEST):
            await self._deliver(messages[begin : begin + OBSERVATIONS_PER_REQUEST], acknowledged)
        return tuple(acknowledged[o.robot, o.sequence] for o in messages)

    async def close(self) -> None:
        """Closes the stream. Does nothing if it is closed already."""
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
        acknowledged: dict[tuple[str, int], Acknowledgement],
    ) -> None:
        """Sends the observations until all are in `acknowledged`. Opens the stream if necessary."""
        retries = Retries(self._retry_for, math.inf, len(self._channel.servers) - 1)
        while True:
            try:
                stream = self._stream or await self._open()
                pending = [o for o in observations if (o.robot, o.sequence) not in acknowledged]
                if pending:
                    await stream.write(pb.ObserveRequest(observations=pending))
                keys = {(o.robot, o.sequence) for o in pending}
                await self._read_acknowledgements(stream, keys, acknowledged)
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
        response = await stream.read()
        if response is None or not response.HasField("opened"):
            raise Internal("the first response of the stream does not open it")
        self.opened = decode_opened(response.opened)
        return stream

    async def _read_acknowledgements(
        self,
        stream: aio.Stream[pb.ObserveRequest, pb.ObserveResponse],
        pending: set[tuple[str, int]],
        acknowledged: dict[tuple[str, int], Acknowledgement],
    ) -> None:
        """Moves the keys (robot, sequence) from `pending` to `acknowledged` as responses arrive."""
        while pending:
            response = await stream.read()
            if response is None:
                stream.leave_server()
                raise Unavailable("the server ended the stream")
            for acknowledgement in map(decode_acknowledgement, response.acknowledgements):
                key = acknowledgement.robot, acknowledgement.sequence
                acknowledged[key] = acknowledgement
                self._seen.note(
                    self._opening.map, self.opened.incarnation, acknowledgement.revision
                )
                pending.discard(key)

"""A stream of frames to an ingest worker."""

from __future__ import annotations

import bisect
import math
import time
from collections.abc import Callable

from .. import _rpc as rpc
from .._io import blocking
from .._proto import frame_service_pb2 as pb
from .._retries import Retries
from ..errors import HypermapError, Internal, Unavailable

# Seconds to wait for an acknowledgement before the connection counts as broken.
IDLE_TIMEOUT_S = 60.0


class FrameSender:
    """Sends frames to a FrameService, and waits until all are acknowledged.

    A frame is kept until it is acknowledged. If the stream breaks, it is opened again and frames
    without acknowledgement are sent again, which count once. At most as many frames as the worker
    queues wait for acknowledgements.
    """

    def __init__(
        self,
        target: str,
        opening: pb.FrameOpening,
        on_acknowledged: Callable[[pb.FrameAcknowledgement], None],
        *,
        retry_for: float = 30.0,
    ) -> None:
        """Connects to HOST:PORT.

        on_acknowledged: called once for each frame.
        retry_for: seconds to retry while the worker is unavailable, from its last answer on.

        Raises HypermapError at once if the worker cannot be reached or refuses the opening.
        """
        self._channel = blocking.Channel(target, None, None)
        self._opening = opening
        self._on_acknowledged = on_acknowledged
        self._retry_for = retry_for
        self._stream: blocking.Stream[pb.StreamFramesRequest, pb.StreamFramesResponse] | None = None
        self._opened = pb.FramesOpened()
        self._pending: dict[int, pb.RobotFrame] = {}
        self._open()

    def is_known(self, sequence: int) -> bool:
        """Whether the layer has the frame already."""
        known = self._opened.known
        at = bisect.bisect(known, sequence, key=lambda sequences: sequences.first)
        return at > 0 and sequence <= known[at - 1].last

    def send(self, frame: pb.RobotFrame) -> None:
        """Sends a frame, after waiting until the worker has room for it.

        Raises HypermapError if the stream has broken and cannot be opened again.
        """
        self._settle(max(self._opened.queue - 1, 0))
        self._pending[frame.sequence] = frame
        self._write(frame)

    def finish(self) -> None:
        """Waits until all frames are acknowledged. Raises HypermapError as `send`."""
        self._settle(0)

    def close(self) -> None:
        """Ends the stream."""
        self._drop_stream()
        self._channel.close()

    def _settle(self, limit: int) -> None:
        """Makes sure that a stream is open and at most `limit` frames are not acknowledged."""
        retries = Retries(self._retry_for, math.inf)
        while self._stream is None or len(self._pending) > limit:
            try:
                if self._stream is None:
                    self._open()
                else:
                    self._read()
                retries = Retries(self._retry_for, math.inf)
            except HypermapError as error:
                self._drop_stream()
                time.sleep(retries.pause(error))

    def _open(self) -> None:
        self._stream = self._channel.duplex(rpc.STREAM_FRAMES, None, IDLE_TIMEOUT_S)
        self._stream.write(pb.StreamFramesRequest(opening=self._opening))
        response = self._stream.read()
        if response is None or not response.HasField("opened"):
            raise Internal("the first response of the stream does not open it")
        self._opened = response.opened
        for frame in self._pending.values():
            self._write(frame)

    def _write(self, frame: pb.RobotFrame) -> None:
        assert self._stream is not None
        self._stream.write(pb.StreamFramesRequest(frame=frame))

    def _read(self) -> None:
        assert self._stream is not None
        response = self._stream.read()
        if response is None:
            raise Unavailable("the worker ended the stream")
        for acknowledgement in response.acknowledgements:
            if self._pending.pop(acknowledgement.sequence, None) is not None:
                self._on_acknowledged(acknowledgement)

    def _drop_stream(self) -> None:
        if self._stream is not None:
            self._stream.cancel()
            self._stream = None

"""Calls that block their thread."""

from __future__ import annotations

import math
import queue
import threading
import time
import weakref
from collections.abc import Iterable, Iterator
from typing import Any, Generic

import grpc

from .._rpc import A, Q, Rpc
from ..credentials import Tls, Token
from ..errors import Cancelled, Unavailable, error_of
from .options import call_metadata, channel_credentials, channel_options

sleep = time.sleep


class Channel:
    """A connection, made at the first call and again when it broke. For any threads."""

    def __init__(self, target: str, tls: Tls | None, token: Token | None) -> None:
        self.closed = False
        self._token = token
        options = channel_options(tls)
        if tls is None:
            self._channel = grpc.insecure_channel(target, options=options)
        else:
            self._channel = grpc.secure_channel(target, channel_credentials(tls), options=options)

    def close(self) -> None:
        self.closed = True
        self._channel.close()

    def unary(self, rpc: Rpc[Q, A], request: Q, timeout: float | None) -> A:
        """A call with one request and one answer."""
        call = self._channel.unary_unary(
            rpc.path, rpc.request.SerializeToString, rpc.answer.FromString
        )
        try:
            answer: A = call(request, timeout=timeout, metadata=call_metadata(self._token))
        except grpc.RpcError as failure:
            raise error_of(failure) from None
        return answer

    def upload(self, rpc: Rpc[Q, A], requests: Iterable[Q], timeout: float | None) -> A:
        """A call with a stream of requests and one answer."""
        call = self._channel.stream_unary(
            rpc.path, rpc.request.SerializeToString, rpc.answer.FromString
        )
        try:
            answer: A = call(iter(requests), timeout=timeout, metadata=call_metadata(self._token))
        except grpc.RpcError as failure:
            raise error_of(failure) from None
        return answer

    def download(
        self, rpc: Rpc[Q, A], request: Q, timeout: float | None, idle_timeout: float | None = None
    ) -> Stream[Q, A]:
        """A call with one request and a stream of answers."""
        call = self._channel.unary_stream(
            rpc.path, rpc.request.SerializeToString, rpc.answer.FromString
        )
        metadata = call_metadata(self._token)
        return Stream(call(request, timeout=timeout, metadata=metadata), None, idle_timeout)

    def duplex(
        self, rpc: Rpc[Q, A], timeout: float | None, idle_timeout: float | None = None
    ) -> Stream[Q, A]:
        """A call with streams both ways."""
        call = self._channel.stream_stream(
            rpc.path, rpc.request.SerializeToString, rpc.answer.FromString
        )
        requests: _Requests[Q] = _Requests()
        metadata = call_metadata(self._token)
        return Stream(call(requests, timeout=timeout, metadata=metadata), requests, idle_timeout)


class _Requests(Generic[Q]):
    """What is written, for the thread of gRPC that sends it."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Q | None] = queue.SimpleQueue()

    def put(self, request: Q | None) -> None:
        self._queue.put(request)

    def __iter__(self) -> Iterator[Q]:
        return self

    def __next__(self) -> Q:
        request = self._queue.get()
        if request is None:
            raise StopIteration
        return request


class Stream(Generic[Q, A]):
    """A call with a stream of answers. One thread reads; any thread may cancel."""

    def __init__(
        self, call: Any, requests: _Requests[Q] | None, idle_timeout: float | None
    ) -> None:
        self._call = call
        self._requests = requests
        self._idle_timeout = idle_timeout
        self._listen_until = math.inf  # when a reader, if there is one, gives the call up
        self._silent = False
        self._ended = threading.Event()
        if idle_timeout is not None:
            threading.Thread(
                target=_break_silence,
                args=[weakref.ref(self), self._ended, idle_timeout],
                daemon=True,
            ).start()

    def read(self) -> A | None:
        """The next answer, None after the last.

        Unavailable when nothing came for `idle_timeout` seconds: the connection may be dead
        without a sign.
        """
        if self._idle_timeout is not None:
            self._listen_until = time.monotonic() + self._idle_timeout
        try:
            answer: A = next(self._call)
        except StopIteration:
            self._end()
            return None
        except grpc.RpcError as failure:
            self._end()
            error = error_of(failure)
            if self._silent and isinstance(error, Cancelled):
                raise Unavailable(f"nothing came for {self._idle_timeout} s") from None
            raise error from None
        finally:
            self._listen_until = math.inf
        return answer

    def write(self, request: Q) -> None:
        """Sends a request. What goes wrong is told by `read`."""
        assert self._requests is not None
        self._requests.put(request)

    def cancel(self) -> None:
        """Ends the call; `read` raises Cancelled. Again is a no-op."""
        self._call.cancel()
        self._end()

    def _end(self) -> None:
        self._ended.set()
        if self._requests is not None:
            self._requests.put(None)  # or gRPC's thread would wait for ever

    def break_off_when_silent(self) -> None:
        """Cancels the call when its reader has waited for too long."""
        if time.monotonic() > self._listen_until:
            self._silent = True
            self._call.cancel()

    def __del__(self) -> None:
        self.cancel()


def _break_silence(
    stream_of: weakref.ref[Stream[Any, Any]], ended: threading.Event, idle_timeout: float
) -> None:
    """Looks after a stream until it has ended or nobody has it any more."""
    while not ended.wait(idle_timeout / 4) and (stream := stream_of()) is not None:
        stream.break_off_when_silent()
        del stream

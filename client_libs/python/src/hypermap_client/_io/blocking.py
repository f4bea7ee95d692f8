"""gRPC channels and streams that block the calling thread."""

from __future__ import annotations

import functools
import math
import queue
import threading
import time
import weakref
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Generic

import grpc

from .._rpc import RequestT, ResponseT, Rpc
from ..credentials import Tls, Token
from ..errors import Cancelled, HypermapError, Unavailable, error_of
from .options import call_metadata, channel_credentials, channel_options
from .servers import Servers, targets_of
from .uploads import Upload

sleep = time.sleep


class Channel:
    """The gRPC channels to servers that share their maps, or to the only server.

    A channel connects at its first call, and reconnects after failures. It may be used by several
    threads.
    """

    def __init__(self, targets: str, tls: Tls | None, token: Token | None) -> None:
        self.closed = False
        self._token = token
        each = targets_of(targets)
        options = channel_options(tls, is_only=len(each) == 1)
        self.servers = Servers(
            [
                grpc.insecure_channel(target, options=options)
                if tls is None
                else grpc.secure_channel(target, channel_credentials(tls), options=options)
                for target in each
            ]
        )

    def close(self) -> None:
        self.closed = True
        for channel in self.servers:
            channel.close()

    def unary(
        self, rpc: Rpc[RequestT, ResponseT], request: RequestT, timeout: float | None
    ) -> ResponseT:
        """Makes a call with one request and one response."""
        channel = self.servers.current
        call = channel.unary_unary(rpc.path, rpc.request.SerializeToString, rpc.response.FromString)
        try:
            response: ResponseT = call(
                request, timeout=timeout, metadata=call_metadata(self._token)
            )
        except grpc.RpcError as failure:
            raise self._error_of(failure, channel) from None
        return response

    def upload(
        self, rpc: Rpc[RequestT, ResponseT], requests: Iterable[RequestT], timeout: float | None
    ) -> ResponseT:
        """Makes a call with a stream of requests and one response.

        Raises the error of the iteration over the requests, if there is one.
        """
        channel = self.servers.current
        call = channel.stream_unary(
            rpc.path, rpc.request.SerializeToString, rpc.response.FromString
        )
        upload = Upload(requests)
        try:
            response: ResponseT = call(upload, timeout=timeout, metadata=call_metadata(self._token))
        except grpc.RpcError as failure:
            if upload.error is not None:
                raise upload.error from None
            raise self._error_of(failure, channel) from None
        return response

    def download(
        self,
        rpc: Rpc[RequestT, ResponseT],
        request: RequestT,
        timeout: float | None,
        idle_timeout: float | None = None,
    ) -> Stream[RequestT, ResponseT]:
        """Starts a call with one request and a stream of responses."""
        channel = self.servers.current
        call = channel.unary_stream(
            rpc.path, rpc.request.SerializeToString, rpc.response.FromString
        )
        metadata = call_metadata(self._token)
        started = call(request, timeout=timeout, metadata=metadata)
        leave = functools.partial(self.servers.leave, channel)
        return Stream(started, None, leave, idle_timeout)

    def duplex(
        self,
        rpc: Rpc[RequestT, ResponseT],
        timeout: float | None,
        idle_timeout: float | None = None,
    ) -> Stream[RequestT, ResponseT]:
        """Starts a call with a stream of requests and a stream of responses."""
        channel = self.servers.current
        call = channel.stream_stream(
            rpc.path, rpc.request.SerializeToString, rpc.response.FromString
        )
        requests: _RequestQueue[RequestT] = _RequestQueue()
        metadata = call_metadata(self._token)
        started = call(requests, timeout=timeout, metadata=metadata)
        leave = functools.partial(self.servers.leave, channel)
        return Stream(started, requests, leave, idle_timeout)

    def _error_of(self, failure: grpc.RpcError, channel: grpc.Channel) -> HypermapError:
        error = error_of(failure)
        if isinstance(error, Unavailable):
            self.servers.leave(channel)
        return error


class _RequestQueue(Generic[RequestT]):
    """A queue of written requests, from which a thread of gRPC sends. None ends it."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[RequestT | None] = queue.SimpleQueue()

    def put(self, request: RequestT | None) -> None:
        self._queue.put(request)

    def __iter__(self) -> Iterator[RequestT]:
        return self

    def __next__(self) -> RequestT:
        request = self._queue.get()
        if request is None:
            raise StopIteration
        return request


class Stream(Generic[RequestT, ResponseT]):
    """A call with a stream of responses. One thread reads; any thread may cancel."""

    def __init__(
        self,
        call: Any,
        requests: _RequestQueue[RequestT] | None,
        leave_server: Callable[[], None],
        idle_timeout: float | None,
    ) -> None:
        self.leave_server = leave_server
        """Call if another server may do better, unless `read` has raised Unavailable."""
        self._call = call
        self._requests = requests
        self._idle_timeout = idle_timeout
        self._idle_deadline = math.inf  # monotonic time; math.inf while no thread reads
        self._timed_out_idle = False
        self._ended = threading.Event()
        if idle_timeout is not None:
            threading.Thread(
                target=_monitor_idle_time,
                args=[weakref.ref(self), self._ended, idle_timeout],
                daemon=True,
            ).start()

    def read(self) -> ResponseT | None:
        """Reads the next response; returns None after the last one.

        Raises Unavailable if no response arrives for `idle_timeout` seconds, because a broken
        connection is not always reported.
        """
        if self._idle_timeout is not None:
            self._idle_deadline = time.monotonic() + self._idle_timeout
        try:
            response: ResponseT = next(self._call)
        except StopIteration:
            self._end()
            return None
        except grpc.RpcError as failure:
            self._end()
            error = error_of(failure)
            if self._timed_out_idle and isinstance(error, Cancelled):
                error = Unavailable(f"no message arrived for {self._idle_timeout} s")
            if isinstance(error, Unavailable):
                self.leave_server()
            raise error from None
        finally:
            self._idle_deadline = math.inf
        return response

    def write(self, request: RequestT) -> None:
        """Sends a request. Errors are raised by `read`."""
        assert self._requests is not None
        self._requests.put(request)

    def cancel(self) -> None:
        """Cancels the call; `read` then raises Cancelled. Does nothing if the call has ended."""
        self._call.cancel()
        self._end()

    def _end(self) -> None:
        self._ended.set()
        if self._requests is not None:
            self._requests.put(None)  # Otherwise gRPC's thread would wait for requests forever.

    def cancel_if_idle(self) -> None:
        """Cancels the call if a read has waited for longer than the idle timeout."""
        if time.monotonic() > self._idle_deadline:
            self._timed_out_idle = True
            self._call.cancel()

    def __del__(self) -> None:
        self.cancel()


def _monitor_idle_time(
    stream_ref: weakref.ref[Stream[Any, Any]], ended: threading.Event, idle_timeout: float
) -> None:
    """Cancels a stream whose reads take too long, until it has ended or is garbage-collected."""
    while not ended.wait(idle_timeout / 4) and (stream := stream_ref()) is not None:
        stream.cancel_if_idle()
        del stream

"""gRPC channels and streams for asyncio."""

from __future__ import annotations

import asyncio
import functools
import weakref
from collections.abc import Callable, Iterable
from typing import Any, Generic

import grpc
import grpc.aio

from .._rpc import RequestT, ResponseT, Rpc
from ..credentials import Tls, Token
from ..errors import Cancelled, HypermapError, Internal, Unavailable, error_of
from .options import call_metadata, channel_credentials, channel_options
from .servers import Servers, targets_of
from .uploads import Upload

sleep = asyncio.sleep


class Channel:
    """The gRPC channels to servers that share their maps, or to the only server.

    A channel connects at its first call, and reconnects after failures. It must be used in one
    event loop.
    """

    def __init__(self, targets: str, tls: Tls | None, token: Token | None) -> None:
        self.closed = False
        self._token = token
        self._streams: weakref.WeakSet[Stream[Any, Any]] = weakref.WeakSet()
        each = targets_of(targets)
        options = channel_options(tls, is_only=len(each) == 1)
        self.servers = Servers(
            [
                grpc.aio.insecure_channel(target, options=options)
                if tls is None
                else grpc.aio.secure_channel(target, channel_credentials(tls), options=options)
                for target in each
            ]
        )

    async def close(self) -> None:
        self.closed = True
        # Streams are cancelled first. If the channel ended them, their reads would raise
        # CancelledError as if the reading task had been cancelled.
        for stream in list(self._streams):
            stream.cancel()
        for channel in self.servers:
            await channel.close()

    async def unary(
        self, rpc: Rpc[RequestT, ResponseT], request: RequestT, timeout: float | None
    ) -> ResponseT:
        """Makes a call with one request and one response."""
        channel = self.servers.current
        call = channel.unary_unary(rpc.path, rpc.request.SerializeToString, rpc.response.FromString)
        try:
            response: ResponseT = await call(
                request, timeout=timeout, metadata=call_metadata(self._token)
            )
        except grpc.RpcError as failure:
            raise self._error_of(failure, channel) from None
        return response

    async def upload(
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
            response: ResponseT = await call(
                upload, timeout=timeout, metadata=call_metadata(self._token)
            )
        except (grpc.RpcError, asyncio.CancelledError) as failure:
            if upload.error is not None:
                raise upload.error from None
            if isinstance(failure, grpc.RpcError):
                raise self._error_of(failure, channel) from None
            raise
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
        return self._stream(started, channel, idle_timeout)

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
        started = call(timeout=timeout, metadata=call_metadata(self._token))
        return self._stream(started, channel, idle_timeout)

    def _stream(
        self, call: Any, channel: grpc.aio.Channel, idle_timeout: float | None
    ) -> Stream[RequestT, ResponseT]:
        leave = functools.partial(self.servers.leave, channel)
        stream: Stream[RequestT, ResponseT] = Stream(call, leave, idle_timeout)
        self._streams.add(stream)
        return stream

    def _error_of(self, failure: grpc.RpcError, channel: grpc.aio.Channel) -> HypermapError:
        error = error_of(failure)
        if isinstance(error, Unavailable):
            self.servers.leave(channel)
        return error


class Stream(Generic[RequestT, ResponseT]):
    """A call with a stream of responses. One task reads; any task of the event loop may cancel."""

    def __init__(
        self, call: Any, leave_server: Callable[[], None], idle_timeout: float | None
    ) -> None:
        self.leave_server = leave_server
        """Call if another server may do better, unless `read` has raised Unavailable."""
        self._call = call
        self._idle_timeout = idle_timeout
        self._cancelled = False
        self._write_failed = False

    async def read(self) -> ResponseT | None:
        """Reads the next response; returns None after the last one.

        Raises Unavailable if no response arrives for `idle_timeout` seconds, because a broken
        connection is not always reported.
        """
        try:
            response = await asyncio.wait_for(self._call.read(), self._idle_timeout)
        except grpc.RpcError as failure:
            error = error_of(failure)
            if self._write_failed and isinstance(error, Internal):
                # After a failed write, grpc.aio reports INTERNAL instead of the status of the call.
                error = Unavailable("the connection broke")
            if isinstance(error, Unavailable):
                self.leave_server()
            raise error from None
        except asyncio.TimeoutError:
            self.cancel()
            self.leave_server()
            raise Unavailable(f"no message arrived for {self._idle_timeout} s") from None
        except asyncio.CancelledError:
            if self._cancelled:  # The call was cancelled, not the task.
                raise Cancelled("the call was cancelled") from None
            raise
        return None if response is grpc.aio.EOF else response

    async def write(self, request: RequestT) -> None:
        """Sends a request. Errors are raised by `read`."""
        try:
            await self._call.write(request)
        except (grpc.RpcError, asyncio.InvalidStateError):
            self._write_failed = True

    def cancel(self) -> None:
        """Cancels the call; `read` then raises Cancelled. Does nothing if the call has ended."""
        self._cancelled = True
        self._call.cancel()

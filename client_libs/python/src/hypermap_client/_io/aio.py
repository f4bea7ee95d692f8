"""Calls for asyncio."""

from __future__ import annotations

import asyncio
import weakref
from collections.abc import Iterable
from typing import Any, Generic

import grpc
import grpc.aio

from .._rpc import A, Q, Rpc
from ..credentials import Tls, Token
from ..errors import Cancelled, Internal, Unavailable, error_of
from .options import call_metadata, channel_credentials, channel_options

sleep = asyncio.sleep


class Channel:
    """A connection, made at the first call and again when it broke. For one event loop."""

    def __init__(self, target: str, tls: Tls | None, token: Token | None) -> None:
        self.closed = False
        self._token = token
        self._streams: weakref.WeakSet[Stream[Any, Any]] = weakref.WeakSet()
        options = channel_options(tls)
        if tls is None:
            self._channel = grpc.aio.insecure_channel(target, options=options)
        else:
            self._channel = grpc.aio.secure_channel(
                target, channel_credentials(tls), options=options
            )

    async def close(self) -> None:
        self.closed = True
        # gRPC would end them as if their tasks had been cancelled.
        for stream in list(self._streams):
            stream.cancel()
        await self._channel.close()

    async def unary(self, rpc: Rpc[Q, A], request: Q, timeout: float | None) -> A:
        """A call with one request and one answer."""
        call = self._channel.unary_unary(
            rpc.path, rpc.request.SerializeToString, rpc.answer.FromString
        )
        try:
            answer: A = await call(request, timeout=timeout, metadata=call_metadata(self._token))
        except grpc.RpcError as failure:
            raise error_of(failure) from None
        return answer

    async def upload(self, rpc: Rpc[Q, A], requests: Iterable[Q], timeout: float | None) -> A:
        """A call with a stream of requests and one answer."""
        call = self._channel.stream_unary(
            rpc.path, rpc.request.SerializeToString, rpc.answer.FromString
        )
        try:
            answer: A = await call(
                iter(requests), timeout=timeout, metadata=call_metadata(self._token)
            )
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
        return self._stream(call(request, timeout=timeout, metadata=metadata), idle_timeout)

    def duplex(
        self, rpc: Rpc[Q, A], timeout: float | None, idle_timeout: float | None = None
    ) -> Stream[Q, A]:
        """A call with streams both ways."""
        call = self._channel.stream_stream(
            rpc.path, rpc.request.SerializeToString, rpc.answer.FromString
        )
        metadata = call_metadata(self._token)
        return self._stream(call(timeout=timeout, metadata=metadata), idle_timeout)

    def _stream(self, call: Any, idle_timeout: float | None) -> Stream[Q, A]:
        stream: Stream[Q, A] = Stream(call, idle_timeout)
        self._streams.add(stream)
        return stream


class Stream(Generic[Q, A]):
    """A call with a stream of answers. One task reads; any task of the loop may cancel."""

    def __init__(self, call: Any, idle_timeout: float | None) -> None:
        self._call = call
        self._idle_timeout = idle_timeout
        self._cancelled = False
        self._write_failed = False

    async def read(self) -> A | None:
        """The next answer, None after the last.

        Unavailable when nothing came for `idle_timeout` seconds: the connection may be dead
        without a sign.
        """
        try:
            answer = await asyncio.wait_for(self._call.read(), self._idle_timeout)
        except grpc.RpcError as failure:
            error = error_of(failure)
            if self._write_failed and isinstance(error, Internal):
                # grpc.aio puts this in place of the status; the next try will tell more.
                raise Unavailable("the connection broke") from None
            raise error from None
        except asyncio.TimeoutError:
            self.cancel()
            raise Unavailable(f"nothing came for {self._idle_timeout} s") from None
        except asyncio.CancelledError:
            if self._cancelled:  # the call, not the task
                raise Cancelled("the call was cancelled") from None
            raise
        return None if answer is grpc.aio.EOF else answer

    async def write(self, request: Q) -> None:
        """Sends a request. What goes wrong is told by `read`."""
        try:
            await self._call.write(request)
        except (grpc.RpcError, asyncio.InvalidStateError):
            self._write_failed = True

    def cancel(self) -> None:
        """Ends the call; `read` raises Cancelled. Again is a no-op."""
        self._cancelled = True
        self._call.cancel()

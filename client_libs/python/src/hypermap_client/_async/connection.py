"""The connection of a client: its channels, and calls with timeouts and retries."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator, Callable, Iterable
from typing import Any

from .._io import aio
from .._io.servers import targets_of
from .._proto import scope_pb2 as scope
from .._requests import AsOf, make_as_of
from .._retries import Retries
from .._rpc import RequestT, ResponseT, Rpc
from .._seen import SeenRevisions, check_not_outdated, map_of
from ..answers import Consistency
from ..credentials import Tls, Token, check_token_is_safe, token_from_file
from ..errors import HypermapError, Unavailable


class Connection:
    """A connection to one of several servers, or to the only one.

    It connects at the first call. After a failure it reconnects, or goes to the next server.
    """

    def __init__(
        self,
        target: str,
        *,
        tls: Tls | None = None,
        token: Token | None = None,
        token_file: str | os.PathLike[str] | None = None,
        timeout: float = 60.0,
        retry_for: float = 30.0,
        allow_insecure_token: bool = False,
    ) -> None:
        if token_file is not None:
            if token is not None:
                raise ValueError("token and token_file must not be given together")
            token = token_from_file(token_file)
        if token is not None:
            for each in targets_of(target):
                check_token_is_safe(each, tls, allow_insecure_token)
        self._timeout = timeout
        self._retry_for = retry_for
        self._channel = aio.Channel(target, tls, token)
        self._seen = SeenRevisions()

    async def close(self) -> None:
        """Closes the connection and cancels its calls. Does nothing if it is closed already."""
        await self._channel.close()

    async def _call(
        self, rpc: Rpc[RequestT, ResponseT], request: RequestT, timeout: float | None
    ) -> ResponseT:
        """Makes a call with one request and one response."""
        seen = self._seen.newest(map_of(request))

        async def attempt(
            rpc: Rpc[RequestT, ResponseT], request: RequestT, timeout: float | None
        ) -> ResponseT:
            channel = self._channel.servers.current
            response: ResponseT = await self._channel.unary(rpc, request, timeout)
            try:
                check_not_outdated(seen, request, response)
            except Unavailable:
                self._channel.servers.leave(channel)
                raise
            return response

        response: ResponseT = await self._retry(attempt, rpc, request, timeout)
        self._seen.note_answers(request, [response])
        return response

    async def _upload(
        self, rpc: Rpc[RequestT, ResponseT], requests: Iterable[RequestT], timeout: float | None
    ) -> ResponseT:
        """Makes a call with several requests and one response.

        requests: a retry iterates over them again from the beginning.
        """
        response: ResponseT = await self._retry(self._channel.upload, rpc, requests, timeout)
        self._seen.note_answers(response, [response])  # the answer names the map, too
        return response

    async def _collect(
        self, rpc: Rpc[RequestT, ResponseT], request: RequestT, timeout: float | None
    ) -> list[ResponseT]:
        """Makes a call with one request, and collects its stream of responses.

        A stream that breaks is read again from the beginning.
        """
        responses: list[ResponseT] = await self._retry(self._read_all, rpc, request, timeout)
        self._seen.note_answers(request, responses)
        return responses

    async def _read_all(
        self, rpc: Rpc[RequestT, ResponseT], request: RequestT, timeout: float | None
    ) -> list[ResponseT]:
        stream = self._channel.download(rpc, request, timeout)
        responses = []
        try:
            while (response := await stream.read()) is not None:
                responses.append(response)
        finally:
            stream.cancel()
        return responses

    async def _stream(
        self, rpc: Rpc[RequestT, ResponseT], request: RequestT, timeout: float | None
    ) -> AsyncIterator[ResponseT]:
        """Makes a call with one request, and yields its responses as they arrive.

        The call is retried until the first response has arrived, but not afterwards.
        """
        retries = self._retries(timeout)
        started = False
        while True:
            stream = self._channel.download(rpc, request, retries.timeout())
            try:
                while (response := await stream.read()) is not None:
                    started = True
                    yield response
                return
            except HypermapError as error:
                if started:
                    raise
                pause = retries.pause(error)
            finally:
                stream.cancel()
            await aio.sleep(pause)

    async def _retry(
        self,
        call: Callable[..., Any],
        rpc: Rpc[RequestT, ResponseT],
        payload: Any,
        timeout: float | None,
    ) -> Any:
        """Makes a call, and retries it while the server is Unavailable."""
        retries = self._retries(timeout)
        while True:
            try:
                return await call(rpc, payload, retries.timeout())
            except HypermapError as error:
                pause = retries.pause(error)
            await aio.sleep(pause)

    def _retries(self, timeout: float | None) -> Retries:
        whole = self._timeout if timeout is None else timeout
        return Retries(self._retry_for, whole, len(self._channel.servers) - 1)

    def _as_of(
        self, map_name: str, as_of: AsOf, min_revision: int, consistency: Consistency
    ) -> scope.AsOf:
        """The revision at which a query of the map reads, as a message; see make_as_of."""
        message = make_as_of(as_of, min_revision, consistency)
        self._seen.add_to(message, map_name)
        return message

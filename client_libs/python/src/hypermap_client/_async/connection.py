"""What all calls of a client share."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from typing import Any

from .._io import aio
from .._retries import Retries
from .._rpc import A, Q, Rpc
from ..credentials import Tls, Token, check_token_is_safe
from ..errors import HypermapError


class Connection:
    """A connection to a server, made at the first call and again when it broke."""

    def __init__(
        self,
        target: str,
        *,
        tls: Tls | None = None,
        token: Token | None = None,
        timeout: float = 60.0,
        retry_for: float = 30.0,
        allow_insecure_token: bool = False,
    ) -> None:
        if token is not None:
            check_token_is_safe(target, tls, allow_insecure_token)
        self._timeout = timeout
        self._retry_for = retry_for
        self._channel = aio.Channel(target, tls, token)

    async def close(self) -> None:
        """Ends the connection and all calls over it. Again is a no-op."""
        await self._channel.close()

    async def _call(self, rpc: Rpc[Q, A], request: Q, timeout: float | None) -> A:
        """One request, one answer."""
        answer: A = await self._retry(self._channel.unary, rpc, request, timeout)
        return answer

    async def _upload(self, rpc: Rpc[Q, A], requests: list[Q], timeout: float | None) -> A:
        """Several requests, one answer."""
        answer: A = await self._retry(self._channel.upload, rpc, requests, timeout)
        return answer

    async def _collect(self, rpc: Rpc[Q, A], request: Q, timeout: float | None) -> list[A]:
        """One request, all parts of its answer; of a later try when the first breaks off."""
        answers: list[A] = await self._retry(self._read_all, rpc, request, timeout)
        return answers

    async def _read_all(self, rpc: Rpc[Q, A], request: Q, timeout: float | None) -> list[A]:
        stream = self._channel.download(rpc, request, timeout)
        answers = []
        try:
            while (answer := await stream.read()) is not None:
                answers.append(answer)
        finally:
            stream.cancel()
        return answers

    async def _parts(self, rpc: Rpc[Q, A], request: Q, timeout: float | None) -> AsyncIterator[A]:
        """One request, part after part of its answer; tried again before the first has come."""
        retries = self._retries(timeout)
        begun = False
        while True:
            stream = self._channel.download(rpc, request, retries.timeout())
            try:
                while (answer := await stream.read()) is not None:
                    begun = True
                    yield answer
                return
            except HypermapError as error:
                if begun:
                    raise
                pause = retries.pause(error)
            finally:
                stream.cancel()
            await aio.sleep(pause)

    async def _retry(
        self, call: Callable[..., Any], rpc: Rpc[Q, A], payload: Any, timeout: float | None
    ) -> Any:
        """Tries `call` again while the server is Unavailable."""
        retries = self._retries(timeout)
        while True:
            try:
                return await call(rpc, payload, retries.timeout())
            except HypermapError as error:
                pause = retries.pause(error)
            await aio.sleep(pause)

    def _retries(self, timeout: float | None) -> Retries:
        return Retries(self._retry_for, self._timeout if timeout is None else timeout)

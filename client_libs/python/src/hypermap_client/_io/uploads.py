"""The requests of an upload, as gRPC takes them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Generic

from .._rpc import RequestT


class Upload(Generic[RequestT]):
    """An iterator over requests that keeps the error which ends it early, such as OSError.

    gRPC cancels a call whose requests raise an error, and reports the cancellation only.
    """

    def __init__(self, requests: Iterable[RequestT]) -> None:
        self._requests = iter(requests)
        self.error: Exception | None = None

    def __iter__(self) -> Iterator[RequestT]:
        return self

    def __next__(self) -> RequestT:
        try:
            return next(self._requests)
        except StopIteration:
            raise
        except Exception as error:
            self.error = error
            raise

"""The servers that a client may ask."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from typing import Generic, TypeVar

ChannelT = TypeVar("ChannelT")


class Servers(Generic[ChannelT]):
    """The gRPC channels of servers that share their maps, so that each can answer each call.

    All calls go to one of them, at the beginning the first, until it fails; then to the next, in a
    circle. gRPC's own list of addresses would not do: it takes no host names, and stays with a
    server that is connected but Unavailable. Any thread may use it.
    """

    def __init__(self, channels: Sequence[ChannelT]) -> None:
        self._channels = channels
        self._current = 0
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._channels)

    def __iter__(self) -> Iterator[ChannelT]:
        return iter(self._channels)

    @property
    def current(self) -> ChannelT:
        """The channel for the next call."""
        return self._channels[self._current]

    def leave(self, channel: ChannelT) -> None:
        """Makes the next server the current one, after a call that `channel` could not answer.

        Of calls that fail together, the first moves on.
        """
        with self._lock:
            if self._channels[self._current] is channel:
                self._current = (self._current + 1) % len(self._channels)


def targets_of(targets: str) -> list[str]:
    """The addresses in a list with commas between them."""
    return [target.strip() for target in targets.split(",") if target.strip()] or [""]

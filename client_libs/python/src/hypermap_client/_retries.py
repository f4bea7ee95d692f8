"""Retries with exponential backoff."""

from __future__ import annotations

import math
import random
import time

from .errors import HypermapError, ResourceExhausted, Unavailable

# Seconds to wait before the first retry, and at most before later ones. Half of the wait is random.
INITIAL_BACKOFF_S = 0.05
MAX_BACKOFF_S = 2.0


class Backoff:
    """Exponential backoff with jitter, so that many clients do not retry at the same time."""

    def __init__(self) -> None:
        self._wait_s = INITIAL_BACKOFF_S

    def next(self) -> float:
        """The time to wait before the next try, in seconds."""
        wait_s = self._wait_s
        self._wait_s = min(2 * wait_s, MAX_BACKOFF_S)
        return wait_s * random.uniform(0.5, 1.0)

    def reset(self) -> None:
        """Starts again with the shortest wait, after a success."""
        self._wait_s = INITIAL_BACKOFF_S


def time_left(deadline: float) -> float | None:
    """Seconds until a deadline of the monotonic clock, at least 0; None for math.inf."""
    return None if math.isinf(deadline) else max(deadline - time.monotonic(), 0.0)


class Retries:
    """Decides whether and when a call is retried.

    A call is retried while the server is Unavailable or asks for a later try (ResourceExhausted
    with `retry_after_s`), for `retry_for` seconds from now, and until `num_others` further servers
    have been tried. `timeout` is the time in seconds that all tries may take together, math.inf for
    no limit.
    """

    def __init__(self, retry_for: float, timeout: float, num_others: int = 0) -> None:
        now = time.monotonic()
        self._deadline = now + timeout
        self._until = min(now + retry_for, self._deadline)
        self._num_untried = num_others
        self._backoff = Backoff()

    def timeout(self) -> float | None:
        """The time left for the next try, in seconds; None for no limit."""
        return time_left(self._deadline)

    def pause(self, error: HypermapError) -> float:
        """The time to wait, in seconds, before the call that failed with `error` is retried.

        Raises `error` if a retry would not help, or if the time for retries would be over.
        """
        until = self._until
        if isinstance(error, ResourceExhausted) and error.retry_after_s is not None:
            pause_s = error.retry_after_s
        elif isinstance(error, Unavailable):
            pause_s = self._backoff.next()
            if self._num_untried > 0:
                self._num_untried -= 1
                until = self._deadline
        else:
            raise error
        if time.monotonic() + pause_s >= until:
            raise error
        return pause_s

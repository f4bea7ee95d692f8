"""How long to wait before something that failed is tried again."""

from __future__ import annotations

import math
import random
import time

from .errors import HypermapError, Unavailable

SHORTEST_S = 0.05
LONGEST_S = 2.0


class Backoff:
    """Waits that double, each taken at random from its upper half: clients do not come in step."""

    def __init__(self) -> None:
        self._wait_s = SHORTEST_S

    def next(self) -> float:
        """The next wait, in seconds."""
        longest_s = self._wait_s
        self._wait_s = min(2 * longest_s, LONGEST_S)
        return longest_s * random.uniform(0.5, 1.0)

    def reset(self) -> None:
        """After a success: begin anew."""
        self._wait_s = SHORTEST_S


def time_left(deadline: float) -> float | None:
    """Seconds until a time of the monotonic clock, at least 0; None: it is never (math.inf)."""
    return None if math.isinf(deadline) else max(deadline - time.monotonic(), 0.0)


class Retries:
    """The tries of one call: while the server is Unavailable, for `retry_for` and no longer than
    `timeout` seconds from now (math.inf: without end).
    """

    def __init__(self, retry_for: float, timeout: float) -> None:
        now = time.monotonic()
        self._deadline = now + timeout
        self._until = min(now + retry_for, self._deadline)
        self._backoff = Backoff()

    def timeout(self) -> float | None:
        """What is left for the next try, in seconds; None: no limit."""
        return time_left(self._deadline)

    def pause(self, error: HypermapError) -> float:
        """After a try that ended with `error`: seconds to wait before the next; raises it instead
        when it is no use or too late to try again.
        """
        if not isinstance(error, Unavailable):
            raise error
        pause_s = self._backoff.next()
        if time.monotonic() + pause_s >= self._until:
            raise error
        return pause_s

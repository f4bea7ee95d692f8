"""The revisions of maps that a client has seen."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import Any

from ._proto import scope_pb2 as pb
from .errors import Unavailable


class SeenRevisions:
    """Remembers for each map the newest revision that an answer or a watch has named.

    A client sees its own changes, and never goes back in time, whichever of several servers it
    asks: queries carry the revision, and no server answers them with less; other answers with less
    are not taken. Any thread may use it.
    """

    def __init__(self) -> None:
        self._maps: dict[str, tuple[int, int]] = {}  # incarnation and revision
        self._lock = threading.Lock()

    def note(self, map_name: str, incarnation: int, revision: int) -> None:
        """Notes a revision. Another incarnation begins anew, even with a smaller revision."""
        if incarnation == 0:
            return
        with self._lock:
            known, newest = self._maps.get(map_name, (0, 0))
            if known != incarnation or newest < revision:
                self._maps[map_name] = incarnation, revision

    def note_answers(self, request: Any, answers: Iterable[Any]) -> None:
        """Notes the revisions that answers to a request name, if they name any."""
        for answer in answers:
            if newest := _newest_in(answer):
                self.note(map_of(request), *newest)

    def newest(self, map_name: str) -> tuple[int, int]:
        """The incarnation and the newest revision of a map; zeros if none was seen."""
        with self._lock:
            return self._maps.get(map_name, (0, 0))

    def add_to(self, as_of: pb.AsOf, map_name: str) -> None:
        """Sets the revision in the as_of of a query of the map."""
        as_of.seen_incarnation, as_of.seen_revision = self.newest(map_name)


def check_not_outdated(seen: tuple[int, int], request: Any, answer: Any) -> None:
    """Raises Unavailable if an answer is of an earlier revision than was seen before the call.

    Only for questions without as_of. A mutation that is repeated gets its old answer.
    """
    newest = _newest_in(answer)
    if newest is None or hasattr(request, "request_id") or hasattr(request, "as_of"):
        return
    if newest[0] == seen[0] and newest[1] < seen[1]:
        raise Unavailable(f"the server has the map at revision {newest[1]}, not yet {seen[1]}")


def map_of(request: Any) -> str:
    """The name of the map that a request is about; empty if it is about none."""
    named = request.scope.map if hasattr(request, "scope") else getattr(request, "map", "")
    name: str = named if isinstance(named, str) else named.name  # of a message of type Map
    return name


def _newest_in(answer: Any) -> tuple[int, int] | None:
    """The incarnation, and the newest revision at which an answer was read; None if it has none."""
    if hasattr(answer, "newest_revision"):
        return answer.incarnation, answer.newest_revision
    if hasattr(answer, "revision") and hasattr(answer, "incarnation"):
        return answer.incarnation, answer.revision
    if hasattr(answer, "map") and hasattr(answer.map, "revision"):
        return answer.map.incarnation, answer.map.revision
    return None

"""The client."""

from __future__ import annotations

from types import TracebackType

from .edits import Edits
from .explorations import Explorations
from .ingest import Ingest
from .queries import Queries
from .watches import Watches


class AsyncClient(Queries, Edits, Watches, Ingest, Explorations):
    """A client of one server.

    target: HOST:PORT.
    tls: None: not encrypted.
    token: sent as `authorization: Bearer …` with every call; a function is asked for it each time.
        ValueError without TLS to another machine, unless allow_insecure_token.
    timeout: seconds that a call may take with all its tries, where it has no timeout of its own;
        math.inf: no limit.
    retry_for: seconds for which a call is tried again, after growing pauses, while the server is
        Unavailable. A mutation is carried out once all the same, by its request id.

    Options that many methods share:

    layers: which to ask, one name or several; none: all. Each layer answers for itself, see
        AnswerStatus.
    frame_id: the frame of all coordinates of the question and of the answer; empty: the map's own.
    as_of: a revision, or a time (aware): the answer is what it would have been then.
    min_revision: the answer waits until the map has that revision (0: it does not wait).
    request_id: the server carries out each id once and repeats its answer; empty: a new one, which
        the tries of the call share.
    timeout: seconds; None: the client's.

    Errors are HypermapError, by the server's status code and with its message. Client blocks and
    may be used by any threads; AsyncClient is for asyncio, made and used in one event loop. Both
    have the same methods. A `with` block ends the connection.
    """

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.close()

"""The client: all calls of a server."""

from __future__ import annotations

from types import TracebackType

from .access import Access
from .edits import Edits
from .explorations import Explorations
from .ingest import Ingest
from .queries import Queries
from .registration import Registration
from .robots import Robots
from .watches import Watches


class AsyncClient(Queries, Registration, Edits, Watches, Ingest, Explorations, Robots, Access):
    """A client of a server, or of several that share their maps.

    Client blocks the calling thread and may be shared by threads. AsyncClient has the same methods
    for asyncio, and must be created and used in one event loop. A `with` block closes the
    connection.

    Constructor arguments:

    target: address of the server, HOST:PORT, or several with commas between. The first is asked
        until it is Unavailable, then the next, and so on in a circle.
    tls: None for an unencrypted connection. Renewed certificates need a new client.
    token: bearer token, sent in the metadata `authorization` of every call. A function is called
        for each call. ValueError is raised for a token without TLS, unless the target is on this
        machine or allow_insecure_token is set.
    token_file: file with the token, in place of `token`. It is read for each call, so that a token
        can be renewed; a call raises Unauthenticated if it cannot be read.
    timeout: time in seconds that a call may take with all its retries, for calls without a timeout
        of their own; math.inf for no limit.
    retry_for: time in seconds for which calls are retried, with exponential backoff, while the
        server is Unavailable, or when it asks for a later try (ResourceExhausted). A mutation has a
        request id, so it is carried out once nevertheless.

    Options that many methods share:

    layers: name of one layer, or names of several; none for all layers. Each layer answers
        independently, see AnswerStatus.
    frame_id: frame of all coordinates of the query and of its answer; empty for the map's own.
    as_of: revision, or time with a time zone, at which the map is queried; None for the newest
        revision.
    min_revision: the server waits until the map has this revision before it answers; 0 for no wait.
    consistency: LINEARIZABLE to see every change that any of the servers that share the maps had
        acknowledged before the call.
    incarnation: the incarnation that the caller expects the map to be, see MapEntry; 0 for any. The
        call raises Aborted if the map is another one by now. Give it with revisions, versions and
        ids from earlier answers: they mean something else in another incarnation.
    request_id: the server carries out a mutation once per id, and repeats its answer. Empty for a
        new id, which all retries of the call share.
    timeout: time in seconds for the call; None for the timeout of the client.

    Every failed call raises the subclass of HypermapError for its gRPC status code, with the
    message of the server. Methods document the most important ones.
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

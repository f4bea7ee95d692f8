"""Errors of calls: one class per gRPC status code, with the message of the server.

Arguments that cannot be sent (an array of the wrong shape, a time without a time zone) raise
ValueError or TypeError before the call.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from typing import Any, ClassVar

import grpc


class HypermapError(Exception):
    """A failed call.

    `str()` returns the message of the server, `code` the gRPC status code, and `request_id` the
    name of the call in the server's log, if the server told it.
    """

    code: ClassVar[grpc.StatusCode] = grpc.StatusCode.UNKNOWN
    request_id: str | None = None

    @property
    def message(self) -> str:
        """The message of the server."""
        return str(self)


class Cancelled(HypermapError):
    """The call was cancelled by the caller, or by a server that shuts down."""

    code = grpc.StatusCode.CANCELLED


class InvalidArgument(HypermapError):
    """A field of the request is invalid; the message names the field."""

    code = grpc.StatusCode.INVALID_ARGUMENT


class DeadlineExceeded(HypermapError):
    """The timeout expired.

    The server may have carried out a mutation nevertheless. It is safe to send it again with the
    same request id.
    """

    code = grpc.StatusCode.DEADLINE_EXCEEDED


class NotFound(HypermapError):
    """A map, layer, frame, object, exploration or goal does not exist; the message names it."""

    code = grpc.StatusCode.NOT_FOUND


class AlreadyExists(HypermapError):
    """A map or layer of that name exists already."""

    code = grpc.StatusCode.ALREADY_EXISTS


class PermissionDenied(HypermapError):
    """The caller is not allowed to make this call."""

    code = grpc.StatusCode.PERMISSION_DENIED


class ResourceExhausted(HypermapError):
    """A limit of the server was exceeded (the message names its flag), or its disk is full.

    If the server has too much to do for the moment, `retry_after_s` is the time in seconds after
    which the same call may succeed. The client has then retried it for `retry_for` seconds.
    """

    code = grpc.StatusCode.RESOURCE_EXHAUSTED
    retry_after_s: float | None = None


class FailedPrecondition(HypermapError):
    """The call is not possible in the present state of the map.

    Examples: the map cannot be opened, the layer is of another kind, the exploration has ended.
    """

    code = grpc.StatusCode.FAILED_PRECONDITION


class Aborted(HypermapError):
    """An object or layer does not have the required version, or the map another incarnation.

    Nothing was changed.
    """

    code = grpc.StatusCode.ABORTED


class OutOfRange(HypermapError):
    """A revision has been compacted (the message names the oldest), or does not exist yet."""

    code = grpc.StatusCode.OUT_OF_RANGE


class Unimplemented(HypermapError):
    """The server does not implement the call; its version differs from the client's."""

    code = grpc.StatusCode.UNIMPLEMENTED


class Internal(HypermapError):
    """The server failed internally, or sent a response that the client cannot interpret."""

    code = grpc.StatusCode.INTERNAL


class Unavailable(HypermapError):
    """The server cannot be reached or shuts down.

    The client raises it after it has retried the call for `retry_for` seconds.
    """

    code = grpc.StatusCode.UNAVAILABLE


class DataLoss(HypermapError):
    """A file of the server is corrupt."""

    code = grpc.StatusCode.DATA_LOSS


class Unauthenticated(HypermapError):
    """The token or the client certificate is missing or invalid."""

    code = grpc.StatusCode.UNAUTHENTICATED


_BY_CODE: dict[grpc.StatusCode, type[HypermapError]] = {
    error.code: error for error in HypermapError.__subclasses__()
}


def error_of(failure: grpc.RpcError) -> HypermapError:
    """The HypermapError with the status code and the details of a gRPC error."""
    code = failure.code()
    error = _BY_CODE.get(code, HypermapError)(failure.details() or code.name)
    metadata = failure.trailing_metadata()
    error.request_id = _find(metadata, "x-request-id")
    if isinstance(error, ResourceExhausted):
        error.retry_after_s = _retry_after_s(_find(metadata, "grpc-retry-pushback-ms"))
    return error


def _find(metadata: Iterable[Any] | None, key: str) -> str | None:
    """The value of a key of metadata."""
    for name, value in metadata or ():
        if name == key and isinstance(value, str):
            return value
    return None


def _retry_after_s(pushback_ms: str | None) -> float | None:
    """The wait that the server asks for in trailing metadata (gRFC A6), in seconds."""
    # Negative: the call must not be retried. So gRPC also tells what is no number.
    with contextlib.suppress(ValueError):
        if pushback_ms is not None and int(pushback_ms) >= 0:
            return int(pushback_ms) / 1000
    return None

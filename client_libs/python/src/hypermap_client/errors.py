"""What can go wrong: one class for each status code of gRPC, with the server's own message.

Wrong arguments that never reach the server (an array of the wrong shape, a time without a zone) are
ValueError or TypeError.
"""

from __future__ import annotations

from typing import ClassVar

import grpc


class HypermapError(Exception):
    """A call that failed. `str()` of it is the server's message."""

    code: ClassVar[grpc.StatusCode] = grpc.StatusCode.UNKNOWN

    @property
    def message(self) -> str:
        """What the server said."""
        return str(self)


class Cancelled(HypermapError):
    """The call was cancelled, by the caller or by a server that stops."""

    code = grpc.StatusCode.CANCELLED


class InvalidArgument(HypermapError):
    """A field of the request is wrong; the message names it."""

    code = grpc.StatusCode.INVALID_ARGUMENT


class DeadlineExceeded(HypermapError):
    """The timeout passed. A mutation may have been carried out: send it again with its id."""

    code = grpc.StatusCode.DEADLINE_EXCEEDED


class NotFound(HypermapError):
    """No such map, layer, frame, object, exploration or goal; the message names it."""

    code = grpc.StatusCode.NOT_FOUND


class AlreadyExists(HypermapError):
    """A map or layer of that name is there."""

    code = grpc.StatusCode.ALREADY_EXISTS


class PermissionDenied(HypermapError):
    """The caller may not do that."""

    code = grpc.StatusCode.PERMISSION_DENIED


class ResourceExhausted(HypermapError):
    """Past a limit of the server (the message names its flag), or the disk is full."""

    code = grpc.StatusCode.RESOURCE_EXHAUSTED


class FailedPrecondition(HypermapError):
    """The map can't be opened, the layer is of another kind, the exploration has ended."""

    code = grpc.StatusCode.FAILED_PRECONDITION


class Aborted(HypermapError):
    """An object or layer has another version than the edits want. Nothing was changed."""

    code = grpc.StatusCode.ABORTED


class OutOfRange(HypermapError):
    """A revision that is not kept any more (the message names the oldest), or is yet to come."""

    code = grpc.StatusCode.OUT_OF_RANGE


class Unimplemented(HypermapError):
    """The server does not know the call: it is of another version."""

    code = grpc.StatusCode.UNIMPLEMENTED


class Internal(HypermapError):
    """An answer that can't be understood, or a fault of the server."""

    code = grpc.StatusCode.INTERNAL


class Unavailable(HypermapError):
    """The server is not reached, or stops; tried again for `retry_for` before it is raised."""

    code = grpc.StatusCode.UNAVAILABLE


class DataLoss(HypermapError):
    """A file of the server is damaged."""

    code = grpc.StatusCode.DATA_LOSS


class Unauthenticated(HypermapError):
    """The token or the certificate is missing or wrong."""

    code = grpc.StatusCode.UNAUTHENTICATED


_BY_CODE: dict[grpc.StatusCode, type[HypermapError]] = {
    error.code: error for error in HypermapError.__subclasses__()
}


def error_of(failure: grpc.RpcError) -> HypermapError:
    """The error for a call that gRPC says has failed."""
    code = failure.code()
    return _BY_CODE.get(code, HypermapError)(failure.details() or code.name)

"""Conversion of the identity of the caller."""

from __future__ import annotations

from .._proto import access_service_pb2 as pb
from ..access import Caller, Role
from .enums import decode_enum
from .time import decode_time


def decode_caller(message: pb.GetCallerResponse) -> Caller:
    if not message.has_identities:
        return Caller()
    return Caller(
        identity=message.identity,
        role=decode_enum(Role, message.role),
        maps=tuple(message.maps),
        robots=tuple(message.robots),
        expires=decode_time(message.expires) if message.HasField("expires") else None,
    )

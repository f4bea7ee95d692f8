"""Arguments that many requests share: map, layers and frame, revisions, request ids."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from datetime import datetime
from typing import TypeAlias

from ._proto import scope_pb2 as pb
from ._wire.time import encode_time
from .answers import Consistency

# The name of one layer, or names of several. No names select all layers.
Layers: TypeAlias = str | Iterable[str]
# The revision to read: its number, or a time, which selects the newest revision committed by then.
# None selects the newest revision.
AsOf: TypeAlias = int | datetime | None


def new_request_id() -> str:
    """A random id for a mutation: 128 bits as 32 hexadecimal digits.

    The server carries out a mutation once, however often it is sent with the same id.
    """
    return secrets.token_hex(16)


def names_of(layers: Layers) -> list[str]:
    """One or several names as a list."""
    return [layers] if isinstance(layers, str) else list(layers)


def make_scope(map_name: str, layers: Layers, frame_id: str, incarnation: int = 0) -> pb.Scope:
    """The message for the map, the layers and the frame that a query is about.

    incarnation: the one that the map must be; 0 for any.
    """
    return pb.Scope(
        map=map_name, layers=names_of(layers), frame_id=frame_id, incarnation=incarnation
    )


def make_as_of(
    as_of: AsOf, min_revision: int, consistency: Consistency = Consistency.LOCAL
) -> pb.AsOf:
    """The message for the revision or time at which a query reads.

    min_revision: the revision for which the answer waits; 0 for no wait.
    consistency: the other revisions for which it waits.

    Raises ValueError for a time without a time zone.
    """
    message = pb.AsOf(min_revision=min_revision)
    if consistency == Consistency.LINEARIZABLE:
        message.consistency = pb.CONSISTENCY_LINEARIZABLE
    if isinstance(as_of, datetime):
        encode_time(as_of, message.at_time)
    elif as_of is not None:
        message.at_revision = as_of
    return message

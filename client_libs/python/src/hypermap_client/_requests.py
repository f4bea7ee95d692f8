"""Arguments that many requests share: layers, revisions in the past, request ids."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from datetime import datetime
from typing import TypeAlias

from ._proto import query_service_pb2 as query
from ._wire.time import encode_time

# The name of one layer, or names of several. No names select all layers.
Layers: TypeAlias = str | Iterable[str]
# The revision to read: its number, or a time, which selects the newest revision committed by then.
# None selects the newest revision.
AsOf: TypeAlias = int | datetime | None

_Query: TypeAlias = (
    query.QueryPointRequest
    | query.QueryAreaRequest
    | query.QueryValueRequest
    | query.QueryNearestRequest
    | query.QueryPointsOpening
)


def new_request_id() -> str:
    """A random id for a mutation: 128 bits as 32 hexadecimal digits.

    The server carries out a mutation once, however often it is sent with the same id.
    """
    return secrets.token_hex(16)


def names_of(layers: Layers) -> list[str]:
    """One or several names as a list."""
    return [layers] if isinstance(layers, str) else list(layers)


def set_as_of(request: _Query, as_of: AsOf) -> None:
    """Sets the revision or time of a query. Raises ValueError for a time without a time zone."""
    if isinstance(as_of, datetime):
        encode_time(as_of, request.at_time)
    elif as_of is not None:
        request.at_revision = as_of

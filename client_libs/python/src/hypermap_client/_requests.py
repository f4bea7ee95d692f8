"""What requests have in common."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from datetime import datetime
from typing import TypeAlias

from ._proto import query_service_pb2 as query
from ._wire.time import encode_time

# Layers by name, one or several; none: all layers.
Layers: TypeAlias = str | Iterable[str]
# The map as it was: a revision, or the newest one that was made at a time or before. None: now.
AsOf: TypeAlias = int | datetime | None

_Question: TypeAlias = (
    query.QueryPointRequest
    | query.QueryAreaRequest
    | query.QueryValueRequest
    | query.QueryNearestRequest
    | query.QueryPointsOpening
)


def new_request_id() -> str:
    """128 random bits as 32 hex digits: an id for a mutation that may have to be sent again."""
    return secrets.token_hex(16)


def names_of(layers: Layers) -> list[str]:
    """The names as a list."""
    return [layers] if isinstance(layers, str) else list(layers)


def set_as_of(request: _Question, as_of: AsOf) -> None:
    """ValueError for a time without a zone."""
    if isinstance(as_of, datetime):
        encode_time(as_of, request.at_time)
    elif as_of is not None:
        request.at_revision = as_of

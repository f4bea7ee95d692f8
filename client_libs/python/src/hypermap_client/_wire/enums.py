"""Enumerations of messages to and from those of the client."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, TypeVar

from ..errors import Internal

E = TypeVar("E", bound=IntEnum)


def encode_enum(value: IntEnum) -> Any:
    """A value of a request. The stubs of messages know their own enumerations only."""
    return int(value)


def decode_enum(kind: type[E], value: int) -> E:
    """A value of an answer. Internal for one that this version of the client does not know."""
    try:
        return kind(value)
    except ValueError:
        raise Internal(f"the server's answer: {value} is no {kind.__name__}") from None

"""Conversion of enumerations."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, TypeVar

from ..errors import Internal

E = TypeVar("E", bound=IntEnum)


def encode_enum(value: IntEnum) -> Any:
    """The number of an enumerator, as Any: message stubs accept their own enumerations only."""
    return int(value)


def decode_enum(kind: type[E], value: int) -> E:
    """The enumerator of a number in a response.

    Raises Internal for a number that this version of the client does not know.
    """
    try:
        return kind(value)
    except ValueError:
        raise Internal(f"the response has an unknown {kind.__name__}: {value}") from None

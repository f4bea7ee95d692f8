"""Conversion of times and durations.

Values of the client are in UTC and have microseconds; messages have nanoseconds.
"""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

from google.protobuf.duration_pb2 import Duration
from google.protobuf.timestamp_pb2 import Timestamp

_MICROSECOND = timedelta(microseconds=1)
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


def encode_time(time: datetime, message: Timestamp) -> None:
    """Sets a timestamp. Raises ValueError for a time without a time zone."""
    if time.utcoffset() is None:
        raise ValueError(f"{time!r} has no time zone; use datetime.now(timezone.utc)")
    microseconds = (time - _EPOCH) // _MICROSECOND
    message.seconds, rest = divmod(microseconds, 1_000_000)
    message.nanos = rest * 1000


def decode_time(message: Timestamp) -> datetime:
    """The time of a timestamp in UTC, rounded down to a microsecond."""
    return _EPOCH + timedelta(seconds=message.seconds, microseconds=message.nanos // 1000)


def decode_commit_time(message: Timestamp) -> datetime:
    """The time of a commit in UTC, rounded up to a microsecond.

    A query as of the returned time sees the commit.
    """
    return _EPOCH + timedelta(seconds=message.seconds, microseconds=-(-message.nanos // 1000))


def encode_duration(duration: timedelta, message: Duration) -> None:
    """Sets a duration message, with microsecond resolution."""
    microseconds = duration // _MICROSECOND
    seconds = abs(microseconds) // 1_000_000
    nanos = abs(microseconds) % 1_000_000 * 1000
    sign = -1 if microseconds < 0 else 1
    message.seconds, message.nanos = sign * seconds, sign * nanos

"""Pairs the messages of two topics by their stamps."""

from __future__ import annotations

from typing import Any


class Synchronizer:
    """Pairs messages as ApproximateTimeSynchronizer of ROS's message_filters does.

    The algorithm is that of `message_filters/__init__.py` in github.com/ros2/message_filters, for
    two topics. A message that arrives is paired at once with the message of the other topic that
    is nearest in time, if it is within the slop and still waits. Otherwise it waits in the queue of
    its topic; the oldest leaves a full queue. Unlike there, a difference of exactly the slop is
    within it, so that a slop of 0 pairs equal stamps.
    """

    def __init__(self, queue: int, slop_ns: int) -> None:
        self._size = queue
        self._slop_ns = slop_ns
        self._queues: tuple[dict[int, Any], dict[int, Any]] = ({}, {})
        self._unpaired = [0, 0]

    def add(self, topic: int, stamp_ns: int, message: Any) -> tuple[Any, Any] | None:
        """Adds a message of topic 0 or 1. Returns its pair, in the order of the topics."""
        mine, others = self._queues[topic], self._queues[1 - topic]
        nearest = min(others, key=lambda stamp: abs(stamp - stamp_ns), default=None)
        if nearest is not None and abs(nearest - stamp_ns) <= self._slop_ns:
            partner = others.pop(nearest)
            return (message, partner) if topic == 0 else (partner, message)
        self._unpaired[topic] += stamp_ns in mine
        mine[stamp_ns] = message
        if len(mine) > self._size:
            del mine[min(mine)]
            self._unpaired[topic] += 1
        return None

    def unpaired(self, topic: int) -> int:
        """Number of messages of a topic that found no partner so far, with those that wait."""
        return self._unpaired[topic] + len(self._queues[topic])

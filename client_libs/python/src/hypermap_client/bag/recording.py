"""Reads ROS 1 bags and rosbag2 recordings (SQLite3 and MCAP). Only this module imports rosbags."""

from __future__ import annotations

import pathlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any

from .problems import BagError, InterruptedRunError

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys.store import Typestore

# Messages of vision_msgs 4 (Humble and later), for recordings that do not contain definitions.
VISION_MSGS = {
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y",
    "vision_msgs/msg/Pose2D": "vision_msgs/Point2D position\nfloat64 theta",
    "vision_msgs/msg/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score",
    "vision_msgs/msg/ObjectHypothesisWithPose": (
        "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose"
    ),
    "vision_msgs/msg/Detection2D": (
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
        "vision_msgs/BoundingBox2D bbox\nstring id"
    ),
    "vision_msgs/msg/Detection2DArray": (
        "std_msgs/Header header\nvision_msgs/Detection2D[] detections"
    ),
}


def default_types() -> Typestore:
    """The message types of ROS 2 Humble with `VISION_MSGS`."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: PLC0415

    types = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in VISION_MSGS.items():
        types.register(get_types_from_msg(text, name))
    return types


class Recording:
    """One or several recordings of one format, as if they were one. Use it in a `with` block.

    Messages are decoded by the definitions that the recording contains. Only SQLite3 recordings of
    Humble and earlier have none; they are decoded by those of Humble.

    is_interrupted: tells whether reading should end.
    """

    def __init__(self, paths: Sequence[pathlib.Path], is_interrupted: Callable[[], bool]) -> None:
        self._paths = paths
        self._is_interrupted = is_interrupted
        self._reader: AnyReader | None = None
        self._types: dict[str, str] = {}

    def __enter__(self) -> Recording:
        try:
            from rosbags.highlevel import AnyReader  # noqa: PLC0415
        except ImportError:
            raise BagError(
                "the package rosbags is missing: pip install 'hypermap-client[bag]'"
            ) from None
        for path in self._paths:
            if not path.exists():
                raise BagError(f"{path}: no such file or folder")
        try:
            self._reader = AnyReader(self._paths, default_typestore=default_types())
            self._reader.open()
        except Exception as error:  # What rosbags raises for damaged files is not documented.
            raise BagError(f"{self._names()}: {error}") from error
        self._types = {c.topic: c.msgtype for c in self._reader.connections}
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._reader is not None:
            self._reader.close()
            self._reader = None

    def has(self, topic: str) -> bool:
        """Whether there is a topic of this name."""
        return topic in self._types

    def check_topic(self, topic: str, types: Collection[str]) -> str:
        """Returns the type of a topic, such as `sensor_msgs/msg/Image`.

        Raises BagError if the topic is not in the recording or has none of the given types.
        """
        if topic not in self._types:
            present = ", ".join(f"{name} ({kind})" for name, kind in sorted(self._types.items()))
            raise BagError(f"topic {topic} is not in the bag, which has {present or 'no topics'}")
        kind = self._types[topic]
        if kind not in types:
            raise BagError(f"topic {topic} is of type {kind}; needed is {' or '.join(types)}")
        return kind

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, Any]]:
        """Yields (topic, message) of some topics, in the order in which they were recorded.

        Raises BagError if a message cannot be read, and InterruptedRunError if reading should end.
        """
        for topic, message in self._read(topics):
            if self._is_interrupted():
                raise InterruptedRunError
            yield topic, message

    def _read(self, topics: Collection[str]) -> Iterator[tuple[str, Any]]:
        assert self._reader is not None
        connections = [c for c in self._reader.connections if c.topic in topics]
        if not connections:
            return  # rosbags would read all.
        try:
            for connection, _, data in self._reader.messages(connections):
                yield connection.topic, self._reader.deserialize(data, connection.msgtype)
        except Exception as error:  # What rosbags raises for damaged files is not documented.
            raise BagError(f"{self._names()}: {error}") from error

    def _names(self) -> str:
        return ", ".join(map(str, self._paths))


def stamp_ns(message: Any) -> int:
    """The time in the header of a message, in nanoseconds since 1970."""
    stamp = message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def read_labels(path: pathlib.Path) -> Mapping[str, str]:
    """Reads a YAML file that maps values of masks, or ids of classes, to labels.

    Raises BagError if it is no such file.
    """
    from ruamel.yaml import YAML  # noqa: PLC0415  A dependency of rosbags.
    from ruamel.yaml.error import YAMLError  # noqa: PLC0415

    try:
        labels = YAML(typ="safe").load(path)
    except (OSError, UnicodeDecodeError, YAMLError) as error:
        raise BagError(f"{path}: {error}") from error
    if not isinstance(labels, dict) or not all(isinstance(v, str) for v in labels.values()):
        raise BagError(f"{path}: not a YAML mapping of values to labels, such as `56: chair`")
    return {str(value): label for value, label in labels.items()}

"""Conversion of objects and their attributes."""

from __future__ import annotations

import numpy as np

from .._proto import object_pb2 as pb
from ..objects import AttributeValue, HeightRange, MapObject
from .geometry import decode_shape, encode_shape
from .time import decode_time


def encode_attribute(value: AttributeValue) -> pb.AttributeValue:
    """Encodes a bool, int, float or str, also of NumPy. Raises TypeError for other types."""
    # bool is a subclass of int in Python, so it is tested first.
    if isinstance(value, (bool, np.bool_)):
        return pb.AttributeValue(bool_value=bool(value))
    if isinstance(value, (int, np.integer)):
        return pb.AttributeValue(int_value=int(value))
    if isinstance(value, (float, np.floating)):
        return pb.AttributeValue(double_value=float(value))
    if isinstance(value, str):
        return pb.AttributeValue(string_value=value)
    raise TypeError(f"an attribute must be bool, int, float or str, not {type(value).__name__}")


def decode_attribute(message: pb.AttributeValue) -> AttributeValue:
    kind = message.WhichOneof("value")
    value: AttributeValue = getattr(message, kind) if kind else ""
    return value


def encode_height(height: HeightRange) -> pb.HeightRange:
    return pb.HeightRange(low_m=height.low_m, high_m=height.high_m)


def encode_object(o: MapObject) -> pb.Object:
    return pb.Object(
        id=o.id,
        label=o.label,
        classes=dict(o.classes),
        existence=o.existence,
        shape=encode_shape(o.shape),
        height=encode_height(o.height) if o.height else None,
        tags=o.tags,
        attributes={name: encode_attribute(value) for name, value in o.attributes.items()},
    )


def decode_object(message: pb.Object) -> MapObject:
    return MapObject(
        message.label,
        decode_shape(message.shape),
        id=message.id,
        classes=dict(message.classes),
        existence=message.existence,
        height=HeightRange(message.height.low_m, message.height.high_m)
        if message.HasField("height")
        else None,
        tags=tuple(message.tags),
        attributes={name: decode_attribute(v) for name, v in message.attributes.items()},
        version=message.version,
        expire_time=decode_time(message.expire_time) if message.HasField("expire_time") else None,
    )

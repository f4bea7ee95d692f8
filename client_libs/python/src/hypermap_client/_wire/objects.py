"""Objects and edits."""

from __future__ import annotations

import numpy as np

from .._proto import edit_pb2 as edit_pb
from .._proto import layer_pb2 as layer_pb
from .._proto import object_pb2 as pb
from ..edits import DeleteObject, Edit, FillPolygon, PutObject, SetAliases, WriteCells
from ..objects import AttributeValue, HeightRange, MapObject
from . import encode_enum
from .geometry import decode_polygon, encode_polygon
from .layers import encode_aliases
from .time import decode_time, encode_duration


def encode_attribute(value: AttributeValue) -> pb.AttributeValue:
    """TypeError for another type. A bool is an int to Python, not to the map."""
    if isinstance(value, (bool, np.bool_)):
        return pb.AttributeValue(bool_value=bool(value))
    if isinstance(value, (int, np.integer)):
        return pb.AttributeValue(int_value=int(value))
    if isinstance(value, (float, np.floating)):
        return pb.AttributeValue(double_value=float(value))
    if isinstance(value, str):
        return pb.AttributeValue(string_value=value)
    raise TypeError(f"an attribute is a bool, int, float or str, not a {type(value).__name__}")


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
        polygon=encode_polygon(o.polygon),
        height=encode_height(o.height) if o.height else None,
        tags=o.tags,
        attributes={name: encode_attribute(value) for name, value in o.attributes.items()},
    )


def decode_object(message: pb.Object) -> MapObject:
    return MapObject(
        message.label,
        decode_polygon(message.polygon),
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


def encode_edit(edit: Edit) -> edit_pb.Edit:
    """TypeError for what is no edit."""
    if isinstance(edit, PutObject):
        return edit_pb.Edit(put_object=_encode_put(edit))
    if isinstance(edit, DeleteObject):
        return edit_pb.Edit(
            delete_object=edit_pb.DeleteObject(
                layer=edit.layer, id=edit.id, if_version=edit.if_version
            )
        )
    if isinstance(edit, WriteCells):
        return edit_pb.Edit(write_cells=_encode_cells(edit))
    if isinstance(edit, FillPolygon):
        return edit_pb.Edit(
            fill_polygon=edit_pb.FillPolygon(
                layer=edit.layer,
                area=encode_polygon(edit.area),
                frame_id=edit.frame_id,
                rule=encode_enum(edit.rule),
                value=edit.value,
            )
        )
    if isinstance(edit, SetAliases):
        return edit_pb.Edit(
            set_aliases=edit_pb.SetAliases(layer=edit.layer, aliases=encode_aliases(edit.aliases))
        )
    raise TypeError(f"{type(edit).__name__} is no edit")


def _encode_put(edit: PutObject) -> edit_pb.PutObject:
    message = edit_pb.PutObject(
        layer=edit.layer,
        object=encode_object(edit.object),
        frame_id=edit.frame_id,
        if_version=edit.if_version,
    )
    if edit.time_to_live is not None:
        encode_duration(edit.time_to_live, message.time_to_live)
    return message


def _encode_cells(edit: WriteCells) -> edit_pb.WriteCells:
    rows, cols = edit.values.shape
    box = layer_pb.CellBox(
        row_begin=edit.row_begin,
        row_end=edit.row_begin + rows,
        col_begin=edit.col_begin,
        col_end=edit.col_begin + cols,
    )
    return edit_pb.WriteCells(layer=edit.layer, box=box, values=edit.values.ravel().tolist())

"""Conversion of edits."""

from __future__ import annotations

from functools import singledispatch

from .._proto import edit_pb2 as pb
from .._proto import layer_pb2 as layer
from ..edits import (
    CreateLayer,
    DeleteLayer,
    DeleteObject,
    Edit,
    FillPolygon,
    PutObject,
    SetAliases,
    SetTransform,
    WriteCells,
)
from ..geometry import Transform
from .enums import encode_enum
from .geometry import encode_polygon, encode_transform
from .layers import encode_aliases, encode_layer
from .objects import encode_object
from .time import encode_duration


@singledispatch
def encode_edit(edit: Edit) -> pb.Edit:
    """Encodes an edit. Raises TypeError for other types."""
    raise TypeError(f"not an edit: {type(edit).__name__}")


@encode_edit.register
def _(edit: PutObject) -> pb.Edit:
    message = pb.PutObject(
        layer=edit.layer,
        object=encode_object(edit.object),
        frame_id=edit.frame_id,
        if_version=edit.if_version,
    )
    if edit.time_to_live is not None:
        encode_duration(edit.time_to_live, message.time_to_live)
    return pb.Edit(put_object=message)


@encode_edit.register
def _(edit: DeleteObject) -> pb.Edit:
    return pb.Edit(
        delete_object=pb.DeleteObject(layer=edit.layer, id=edit.id, if_version=edit.if_version)
    )


@encode_edit.register
def _(edit: WriteCells) -> pb.Edit:
    rows, cols = edit.values.shape
    box = layer.CellBox(
        row_begin=edit.row_begin,
        row_end=edit.row_begin + rows,
        col_begin=edit.col_begin,
        col_end=edit.col_begin + cols,
    )
    values = edit.values.ravel().tolist()
    return pb.Edit(write_cells=pb.WriteCells(layer=edit.layer, box=box, values=values))


@encode_edit.register
def _(edit: FillPolygon) -> pb.Edit:
    message = pb.FillPolygon(
        layer=edit.layer,
        area=encode_polygon(edit.area),
        frame_id=edit.frame_id,
        rule=encode_enum(edit.rule),
        value=edit.value,
    )
    return pb.Edit(fill_polygon=message)


@encode_edit.register
def _(edit: SetAliases) -> pb.Edit:
    aliases = encode_aliases(edit.aliases)
    return pb.Edit(set_aliases=pb.SetAliases(layer=edit.layer, aliases=aliases))


@encode_edit.register
def _(edit: CreateLayer) -> pb.Edit:
    return pb.Edit(create_layer=pb.CreateLayer(layer=encode_layer(edit.layer)))


@encode_edit.register
def _(edit: DeleteLayer) -> pb.Edit:
    return pb.Edit(delete_layer=pb.DeleteLayer(layer=edit.layer))


@encode_edit.register
def _(edit: SetTransform) -> pb.Edit:
    transform = Transform(edit.parent_frame_id, edit.child_frame_id, edit.parent_from_child)
    return pb.Edit(set_transform=pb.SetTransform(transform=encode_transform(transform)))

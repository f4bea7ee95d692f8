"""Conversion of edits."""

from __future__ import annotations

from .._proto import edit_pb2 as pb
from .._proto import layer_pb2 as layer
from ..edits import DeleteObject, Edit, FillPolygon, PutObject, SetAliases, WriteCells
from .enums import encode_enum
from .geometry import encode_polygon
from .layers import encode_aliases
from .objects import encode_object
from .time import encode_duration


def encode_edit(edit: Edit) -> pb.Edit:
    """Encodes an edit. Raises TypeError for other types."""
    if isinstance(edit, PutObject):
        return pb.Edit(put_object=_encode_put(edit))
    if isinstance(edit, DeleteObject):
        return pb.Edit(
            delete_object=pb.DeleteObject(layer=edit.layer, id=edit.id, if_version=edit.if_version)
        )
    if isinstance(edit, WriteCells):
        return pb.Edit(write_cells=_encode_cells(edit))
    if isinstance(edit, FillPolygon):
        return pb.Edit(
            fill_polygon=pb.FillPolygon(
                layer=edit.layer,
                area=encode_polygon(edit.area),
                frame_id=edit.frame_id,
                rule=encode_enum(edit.rule),
                value=edit.value,
            )
        )
    if isinstance(edit, SetAliases):
        return pb.Edit(
            set_aliases=pb.SetAliases(layer=edit.layer, aliases=encode_aliases(edit.aliases))
        )
    raise TypeError(f"not an edit: {type(edit).__name__}")


def _encode_put(edit: PutObject) -> pb.PutObject:
    message = pb.PutObject(
        layer=edit.layer,
        object=encode_object(edit.object),
        frame_id=edit.frame_id,
        if_version=edit.if_version,
    )
    if edit.time_to_live is not None:
        encode_duration(edit.time_to_live, message.time_to_live)
    return message


def _encode_cells(edit: WriteCells) -> pb.WriteCells:
    rows, cols = edit.values.shape
    box = layer.CellBox(
        row_begin=edit.row_begin,
        row_end=edit.row_begin + rows,
        col_begin=edit.col_begin,
        col_end=edit.col_begin + cols,
    )
    return pb.WriteCells(layer=edit.layer, box=box, values=edit.values.ravel().tolist())

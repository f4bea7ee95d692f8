"""Conversion of the parameters and the metadata of layers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .._proto import layer_pb2 as pb
from ..geometry import ShapeKind
from ..grids import CellBox, CellRule
from ..layers import Layer, LayerKind, LayerProperties, LayerSpec, OccupancyThresholds
from .enums import decode_enum, encode_enum
from .grids import decode_grid, encode_grid


def encode_aliases(aliases: Mapping[str, Sequence[str]]) -> list[pb.ValueAlias]:
    """Encodes labels by alias.

    Raises TypeError for a string in place of a list of labels, because its letters would become
    labels.
    """
    for alias, labels in aliases.items():
        if isinstance(labels, str):
            raise TypeError(f"the labels of alias {alias!r} must be a list, not a string")
    return [pb.ValueAlias(alias=alias, labels=labels) for alias, labels in aliases.items()]


def encode_layer(spec: LayerSpec) -> pb.Layer:
    message = pb.Layer(
        name=spec.name,
        kind=encode_enum(spec.kind),
        frame_id=spec.frame_id,
        unit=spec.unit,
        aliases=encode_aliases(spec.aliases),
        shape_kinds=map(encode_enum, spec.shape_kinds),
    )
    if spec.grid is not None:
        message.grid.CopyFrom(encode_grid(spec.grid))
    if spec.thresholds.free_below is not None:
        message.thresholds.free_below = spec.thresholds.free_below
    if spec.thresholds.occupied_above is not None:
        message.thresholds.occupied_above = spec.thresholds.occupied_above
    if spec.explored_rule is not None:
        message.explored_rule = encode_enum(spec.explored_rule)
    return message


def decode_properties(message: pb.LayerProperties) -> LayerProperties:
    values = message.value_range
    return LayerProperties(
        has_cells=message.has_cells,
        has_shapes=message.has_shapes,
        unit=message.unit,
        value_range=(values.min, values.max) if message.HasField("value_range") else None,
        words=tuple(message.words),
        is_binary=message.is_binary,
        words_of_values=tuple((named.word, named.value) for named in message.words_of_values),
    )


def decode_layer(message: pb.Layer) -> Layer:
    thresholds, extent = message.thresholds, message.extent
    return Layer(
        name=message.name,
        kind=decode_enum(LayerKind, message.kind),
        frame_id=message.frame_id,
        grid=decode_grid(message.grid) if message.HasField("grid") else None,
        thresholds=OccupancyThresholds(
            thresholds.free_below if thresholds.HasField("free_below") else None,
            thresholds.occupied_above if thresholds.HasField("occupied_above") else None,
        ),
        unit=message.unit,
        aliases={alias.alias: tuple(alias.labels) for alias in message.aliases},
        explored_rule=decode_enum(CellRule, message.explored_rule)
        if message.explored_rule
        else None,
        shape_kinds=tuple(decode_enum(ShapeKind, kind) for kind in message.shape_kinds),
        size=message.size,
        extent=CellBox(extent.row_begin, extent.row_end, extent.col_begin, extent.col_end)
        if message.HasField("extent")
        else None,
        version=message.version,
        problem=message.problem,
        properties=decode_properties(message.properties),
    )

"""Conversion of the answers to queries."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .._proto import query_service_pb2 as pb
from ..answers import (
    Answer,
    AnswerStatus,
    LayerAnswer,
    LayerContent,
    LayerRefusal,
    NearestAnswer,
    NearestMatch,
    PointAnswer,
    PointsAnswer,
    PointsContent,
)
from ..layers import LayerKind
from ..objects import MapObject
from .enums import decode_enum
from .geometry import decode_point
from .grids import decode_cell, decode_runs
from .objects import decode_object


def decode_point_answer(message: pb.QueryPointResponse) -> PointAnswer:
    return PointAnswer(
        message.map,
        message.revision,
        message.frame_id,
        decode_point(message.point),
        tuple(
            LayerContent(
                content.layer,
                decode_enum(LayerKind, content.kind),
                decode_enum(AnswerStatus, content.status),
                content.value if content.HasField("value") else None,
                tuple(map(decode_object, content.objects)),
            )
            for content in message.layers
        ),
        message.incarnation,
    )


class LayerAnswerBuilder:
    """Assembles the answer of one layer from the parts of a response stream."""

    def __init__(self, first: pb.LayerPart) -> None:
        self.layer = first.layer
        self._kind = decode_enum(LayerKind, first.kind)
        self._status = decode_enum(AnswerStatus, first.status)
        self._objects: list[MapObject] = []
        self._runs: list[pb.CellRuns] = []

    def add(self, part: pb.LayerPart) -> None:
        self._objects.extend(map(decode_object, part.objects))
        if part.HasField("cells"):
            self._runs.append(part.cells)

    def build(self) -> LayerAnswer:
        return LayerAnswer(
            self.layer,
            self._kind,
            self._status,
            tuple(self._objects),
            decode_runs(self._runs) if self._runs else None,
        )


def decode_answer(
    map_name: str,
    frame_id: str,
    messages: Iterable[pb.QueryAreaResponse] | Iterable[pb.QueryValueResponse],
) -> Answer:
    """Assembles an answer from a response stream, which sends its parts layer after layer."""
    revision = incarnation = 0
    builders: list[LayerAnswerBuilder] = []
    for message in messages:
        revision = message.revision
        incarnation = message.incarnation
        if not message.HasField("part"):
            continue
        if not builders or builders[-1].layer != message.part.layer:
            builders.append(LayerAnswerBuilder(message.part))
        builders[-1].add(message.part)
    layers = tuple(builder.build() for builder in builders)
    return Answer(map_name, revision, frame_id, layers, incarnation)


def decode_nearest_answer(message: pb.QueryNearestResponse) -> NearestAnswer:
    return NearestAnswer(
        message.map,
        message.revision,
        message.frame_id,
        tuple(
            NearestMatch(
                match.layer,
                decode_enum(LayerKind, match.kind),
                match.distance_m,
                decode_object(match.object) if match.HasField("object") else None,
                decode_cell(match.cells) if match.HasField("cells") else None,
            )
            for match in message.matches
        ),
        tuple(
            LayerRefusal(refusal.layer, decode_enum(AnswerStatus, refusal.status))
            for refusal in message.refusals
        ),
        message.incarnation,
    )


def decode_points_answer(message: pb.QueryPointsResponse, labels: list[str]) -> PointsAnswer:
    """Decodes the answer to one batch of points.

    labels: the labels that the stream has defined so far, by number; new ones are appended.
    """
    labels.extend(message.new_labels)
    label_array = np.array(labels, dtype=object)
    return PointsAnswer(
        message.revision,
        tuple(
            PointsContent(
                content.layer,
                decode_enum(LayerKind, content.kind),
                decode_enum(AnswerStatus, content.status),
                np.array(content.statuses, np.uint8),
                np.array(content.values, np.float64),
                np.array(content.points, np.int64),
                np.array(content.object_ids, np.int64),
                label_array[np.array(content.labels, np.intp)],
                np.array(content.existences, np.float32),
            )
            for content in message.layers
        ),
        message.incarnation,
    )

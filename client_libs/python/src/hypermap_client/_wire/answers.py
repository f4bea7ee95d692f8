"""Answers to questions."""

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
    )


class PartsOfLayer:
    """What has come of one layer's answer."""

    def __init__(self, first: pb.LayerPart) -> None:
        self.layer = first.layer
        self._kind = decode_enum(LayerKind, first.kind)
        self._status = decode_enum(AnswerStatus, first.status)
        self._objects: list[MapObject] = []
        self._runs: list[pb.CellRuns] = []

    def take(self, part: pb.LayerPart) -> None:
        self._objects.extend(map(decode_object, part.objects))
        if part.HasField("cells"):
            self._runs.append(part.cells)

    def answer(self) -> LayerAnswer:
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
    """All parts of an answer. They come layer after layer."""
    revision = 0
    layers: list[PartsOfLayer] = []
    for message in messages:
        revision = message.revision
        if not message.HasField("part"):
            continue
        if not layers or layers[-1].layer != message.part.layer:
            layers.append(PartsOfLayer(message.part))
        layers[-1].take(message.part)
    return Answer(map_name, revision, frame_id, tuple(parts.answer() for parts in layers))


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
    )


def decode_points_answer(message: pb.QueryPointsResponse, labels: list[str]) -> PointsAnswer:
    """`labels`: the labels told in the stream so far; gets the new ones."""
    labels.extend(message.new_labels)
    of_number = np.array(labels, dtype=object)
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
                of_number[np.array(content.labels, np.intp)],
                np.array(content.existences, np.float32),
            )
            for content in message.layers
        ),
    )

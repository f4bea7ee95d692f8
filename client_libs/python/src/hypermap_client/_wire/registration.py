"""Conversion of estimated transforms."""

from __future__ import annotations

import numpy as np

from .._proto import query_service_pb2 as pb
from ..registration import (
    AgreeingPair,
    Ambiguity,
    PointPair,
    ReadSide,
    ScoredTransform,
    TransformEstimate,
)
from .enums import decode_enum
from .geometry import decode_pose, encode_point


def encode_point_pair(pair: PointPair) -> pb.PointPair:
    # The server takes 0 for its default.
    if pair.sigma_m == 0:
        raise ValueError("sigma_m must be positive")
    return pb.PointPair(
        name=pair.name,
        source=encode_point(pair.source),
        target=encode_point(pair.target),
        sigma_m=pair.sigma_m,
    )


def decode_transform_estimate(message: pb.EstimateTransformResponse) -> TransformEstimate:
    return TransformEstimate(
        _decode_side(message.source),
        _decode_side(message.target),
        _decode_scored(message.best),
        np.reshape(message.covariance, (3, 3)) if message.covariance else None,
        message.inlier_share,
        _decode_scored(message.runner_up) if message.HasField("runner_up") else None,
        decode_enum(Ambiguity, message.ambiguity),
        tuple(AgreeingPair(p.source, p.target, p.residual_m) for p in message.agreeing),
    )


def _decode_side(message: pb.EstimateTransformInput) -> ReadSide:
    return ReadSide(
        message.map, message.layer, message.frame_id, message.revision, message.incarnation
    )


def _decode_scored(message: pb.ScoredTransform) -> ScoredTransform:
    return ScoredTransform(decode_pose(message.target_from_source), message.score)

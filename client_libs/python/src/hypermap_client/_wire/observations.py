"""Conversion of observations, acknowledgements and object histories."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._proto import ingest_service_pb2 as ingest
from .._proto import observation_pb2 as pb
from ..observations import (
    Acknowledgement,
    CellPatch,
    CorrectedPose,
    DepthView,
    Detection,
    ObjectEvent,
    ObjectEventKind,
    ObjectHistory,
    Observation,
    ObservationOutcome,
    OpenedLayer,
    SensorPose,
)
from .enums import decode_enum
from .geometry import encode_polygon, encode_pose
from .objects import encode_height
from .time import decode_time, encode_time


def encode_spans(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Encodes cells (shape (N, 2), row and column) as spans of adjacent cells of one row.

    The result has three numbers per span: the differences of its row and of its first column to
    those of the span before, and its length. See CellPatch.spans in observation.proto.
    """
    cells = np.unique(np.asarray(cells, np.int64).reshape(-1, 2), axis=0)
    if len(cells) == 0:
        return np.empty(0, np.int64)
    rows, cols = cells[:, 0], cells[:, 1]
    first = np.flatnonzero(np.r_[True, (np.diff(rows) != 0) | (np.diff(cols) != 1)])
    lengths = np.diff(np.r_[first, len(cells)])
    return np.column_stack(
        [np.diff(rows[first], prepend=0), np.diff(cols[first], prepend=0), lengths]
    ).ravel()


def encode_patch(patch: CellPatch) -> pb.CellPatch:
    return pb.CellPatch(
        origin=encode_pose(patch.origin),
        resolution_m=patch.resolution_m,
        spans=encode_spans(patch.cells).tolist(),
    )


def encode_detection(detection: Detection) -> pb.Detection:
    return pb.Detection(
        scores=[pb.ClassScore(label=k, score=v) for k, v in detection.scores.items()],
        hull=encode_polygon(detection.hull),
        cells=encode_patch(detection.cells),
        height=encode_height(detection.height),
        num_points=detection.num_points,
        range_m=detection.range_m,
        truncation=detection.truncation,
        weight=detection.weight,
    )


def encode_depth(depth: DepthView) -> pb.DepthView:
    """Encodes a depth image. Raises ValueError unless depth and owner are 2-D of equal shape."""
    if depth.depth_mm.ndim != 2 or depth.depth_mm.shape != depth.owner.shape:
        raise ValueError("depth_mm and owner must be two-dimensional arrays of the same shape")
    rows, columns = depth.depth_mm.shape
    return pb.DepthView(
        columns=columns,
        rows=rows,
        fx=depth.fx,
        fy=depth.fy,
        cx=depth.cx,
        cy=depth.cy,
        depth_mm=np.ascontiguousarray(depth.depth_mm, "<u2").tobytes(),
        owner=np.ascontiguousarray(depth.owner, np.uint8).tobytes(),
    )


def encode_sensor_pose(pose: SensorPose) -> pb.SensorPose:
    return pb.SensorPose(
        rotation=np.ravel(pose.rotation).tolist(),
        translation=np.ravel(pose.translation).tolist(),
        covariance=() if pose.covariance is None else np.ravel(pose.covariance).tolist(),
    )


def encode_corrected_pose(pose: CorrectedPose) -> pb.CorrectedPose:
    message = pb.CorrectedPose(
        pose=encode_pose(pose.pose),
        covariance=() if pose.covariance is None else np.ravel(pose.covariance).tolist(),
    )
    encode_time(pose.stamp, message.stamp)
    return message


def encode_observation(observation: Observation) -> pb.Observation:
    message = pb.Observation(
        robot=observation.robot,
        sequence=observation.sequence,
        frame_id=observation.frame_id,
        detections=map(encode_detection, observation.detections),
    )
    camera = encode_sensor_pose(observation.pose)
    if observation.frame_from_view is None:
        message.pose.CopyFrom(camera)
    else:
        message.view.camera.CopyFrom(camera)
        message.view.frame_from_view.CopyFrom(encode_pose(observation.frame_from_view))
    encode_time(observation.stamp, message.stamp)
    if observation.view_hull is not None:
        message.view_hull.CopyFrom(encode_polygon(observation.view_hull))
    if observation.free_space is not None:
        message.free_space.CopyFrom(encode_polygon(observation.free_space))
    if observation.depth is not None:
        message.depth.CopyFrom(encode_depth(observation.depth))
    return message


def decode_opened(message: ingest.ObserveOpened) -> OpenedLayer:
    return OpenedLayer(
        message.strategy,
        message.parameters,
        message.exploration_layer,
        tuple(range(known.first, known.last + 1) for known in message.known),
        message.incarnation,
    )


def decode_acknowledgement(message: ingest.ObservationAcknowledgement) -> Acknowledgement:
    return Acknowledgement(
        message.robot,
        message.sequence,
        decode_enum(ObservationOutcome, message.outcome),
        message.revision,
        message.message,
        message.clock_skew_s if message.HasField("clock_skew_s") else None,
    )


def decode_history(message: ingest.ExplainObjectResponse) -> ObjectHistory:
    return ObjectHistory(
        message.map,
        message.revision,
        message.object_id,
        message.strategy,
        message.parameters,
        message.track,
        tuple(
            ObjectEvent(
                decode_enum(ObjectEventKind, event.kind),
                event.robot,
                event.sequence,
                decode_time(event.stamp),
                event.detection,
                event.score,
                event.existence if event.HasField("existence") else None,
                event.track,
            )
            for event in message.events
        ),
        message.incarnation,
        decode_time(message.forgotten_until) if message.HasField("forgotten_until") else None,
    )

"""Conversion of the metadata of maps and of checks."""

from __future__ import annotations

from .._proto import catalog_service_pb2 as pb
from ..catalog import CheckReport, Finding, MapDigest, MapEntry, MapState
from .time import decode_time


def decode_map(message: pb.Map) -> MapEntry:
    return MapEntry(
        name=message.name,
        frame_id=message.frame_id,
        revision=message.revision,
        create_time=decode_time(message.create_time) if message.HasField("create_time") else None,
        layer_count=message.layer_count,
        problem=message.problem,
        incarnation=message.incarnation,
        state=_decode_state(message),
    )


def _decode_state(message: pb.Map) -> MapState:
    if message.state:
        return MapState(message.state)
    # Older servers tell a problem of closed maps only.
    return MapState.CLOSED if message.problem else MapState.SERVING


def decode_check_report(message: pb.CheckMapResponse) -> CheckReport:
    findings = tuple(
        Finding(found.table, found.row, found.problem, found.can_be_rebuilt)
        for found in message.findings
    )
    return CheckReport(message.map, message.revision, findings, message.more, message.incarnation)


def decode_digest(message: pb.DigestMapResponse) -> MapDigest:
    layers = {layer.layer: layer.digest for layer in message.layers}
    return MapDigest(
        message.map, message.revision, layers, message.frames_digest, message.incarnation
    )

"""Interchange files as streams of messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .._proto import catalog_service_pb2 as pb
from ..interchange import ExportAnswer, NamedFile

PIECE_BYTES = 1 << 20


def import_requests(
    header: pb.ImportHeader, files: Iterable[NamedFile]
) -> Iterator[pb.ImportMapRequest]:
    """The header, then the files in pieces."""
    yield pb.ImportMapRequest(header=header)
    for file in files:
        for begin in range(0, max(len(file.data), 1), PIECE_BYTES):
            piece = file.data[begin : begin + PIECE_BYTES]
            yield pb.ImportMapRequest(chunk=pb.FileChunk(file_name=file.name, data=piece))


def collect_export(messages: Iterable[pb.ExportMapResponse]) -> ExportAnswer:
    """The files of an answer, of their pieces."""
    header = pb.ExportHeader()
    pieces: dict[str, list[bytes]] = {}
    for message in messages:
        if message.HasField("header"):
            header = message.header
        else:
            pieces.setdefault(message.chunk.file_name, []).append(message.chunk.data)
    files = tuple(NamedFile(name, b"".join(parts)) for name, parts in pieces.items())
    return ExportAnswer(header.map, header.revision, files, tuple(header.omissions))

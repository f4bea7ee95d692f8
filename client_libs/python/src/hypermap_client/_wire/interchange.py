"""Conversion of interchange files and backups to and from streams of messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .._proto import catalog_service_pb2 as pb
from ..interchange import ExportAnswer, NamedFile

# Size of the chunks in which files are uploaded.
CHUNK_BYTES = 1 << 20


class RestoreRequests:
    """The header, then the chunks of a backup. Each iteration begins anew, for a retry."""

    def __init__(self, header: pb.RestoreHeader, chunks: Iterable[bytes]) -> None:
        self._header = header
        self._chunks = chunks

    def __iter__(self) -> Iterator[pb.RestoreMapRequest]:
        yield pb.RestoreMapRequest(header=self._header)
        for data in self._chunks:
            yield pb.RestoreMapRequest(data=data)


def import_requests(
    header: pb.ImportHeader, files: Iterable[NamedFile]
) -> Iterator[pb.ImportMapRequest]:
    """The header, then the content of the files in chunks. An empty file has one empty chunk."""
    yield pb.ImportMapRequest(header=header)
    for file in files:
        for begin in range(0, max(len(file.data), 1), CHUNK_BYTES):
            data = file.data[begin : begin + CHUNK_BYTES]
            yield pb.ImportMapRequest(chunk=pb.FileChunk(file_name=file.name, data=data))


def collect_export(messages: Iterable[pb.ExportMapResponse]) -> ExportAnswer:
    """Assembles the exported files from a response stream of a header and chunks."""
    header = pb.ExportHeader()
    chunks: dict[str, list[bytes]] = {}
    for message in messages:
        if message.HasField("header"):
            header = message.header
        else:
            chunks.setdefault(message.chunk.file_name, []).append(message.chunk.data)
    files = tuple(NamedFile(name, b"".join(data)) for name, data in chunks.items())
    omissions = tuple(header.omissions)
    return ExportAnswer(header.map, header.revision, files, omissions, header.incarnation)

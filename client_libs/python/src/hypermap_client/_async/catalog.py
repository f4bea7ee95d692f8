"""Calls for maps, layers, transforms, interchange files, backups and checks."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterable
from typing import Literal

from .. import _rpc as rpc
from .._files import AtomicFile, FileChunks, FileLike, Path, format_of, read_files
from .._proto import catalog_service_pb2 as pb
from .._requests import Layers, names_of, new_request_id
from .._wire.catalog import decode_check_report, decode_digest, decode_map
from .._wire.enums import encode_enum
from .._wire.geometry import decode_transform, encode_transform
from .._wire.interchange import CHUNK_BYTES, RestoreRequests, collect_export, import_requests
from .._wire.layers import decode_layer, encode_layer
from ..catalog import CheckReport, LayerList, MapDigest, MapEntry, TransformList
from ..geometry import Pose, Transform
from ..interchange import ExportAnswer, FileFormat, ImportAnswer
from ..layers import Layer, LayerSpec
from .connection import Connection


class Catalog(Connection):
    """Calls for maps, layers, transforms, interchange files, backups and checks."""

    async def create_map(
        self,
        map_name: str,
        *,
        frame_id: str = "",
        request_id: str = "",
        timeout: float | None = None,
    ) -> MapEntry:
        """Creates an empty map.

        map_name: at most 63 letters, digits, '_', '-' and '.'.
        frame_id: the map's own frame; empty for "map".

        Raises AlreadyExists if there is a map of that name.
        """
        request = pb.CreateMapRequest(
            map=map_name, frame_id=frame_id, request_id=request_id or new_request_id()
        )
        return decode_map((await self._call(rpc.CREATE_MAP, request, timeout)).map)

    async def get_map(self, map_name: str, *, timeout: float | None = None) -> MapEntry:
        """Returns the metadata of a map.

        Raises NotFound if there is no such map, and DataLoss or FailedPrecondition if the server
        cannot open it.
        """
        request = pb.GetMapRequest(map=map_name)
        return decode_map((await self._call(rpc.GET_MAP, request, timeout)).map)

    async def list_maps(self, *, timeout: float | None = None) -> tuple[MapEntry, ...]:
        """Lists the maps of the server, sorted by name.

        A map that the server cannot open is listed with the reason in `problem`.
        """
        answer = await self._call(rpc.LIST_MAPS, pb.ListMapsRequest(), timeout)
        return tuple(map(decode_map, answer.maps))

    async def delete_map(
        self,
        map_name: str,
        *,
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> None:
        """Deletes a map with its layers and its history. This cannot be undone.

        Raises NotFound if there is no such map, and Aborted if it has another incarnation than the
        given one; it is kept then.
        """
        request = pb.DeleteMapRequest(
            map=map_name, request_id=request_id or new_request_id(), incarnation=incarnation
        )
        await self._call(rpc.DELETE_MAP, request, timeout)

    async def create_layer(
        self,
        map_name: str,
        layer: LayerSpec,
        *,
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> Layer:
        """Creates an empty layer. CreateLayer does so in a batch of edits.

        Raises AlreadyExists if the map has a layer of that name, InvalidArgument if a parameter of
        the layer is invalid, and Aborted if the map has another incarnation than the given one.
        """
        request = pb.CreateLayerRequest(
            map=map_name,
            layer=encode_layer(layer),
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
        )
        return decode_layer((await self._call(rpc.CREATE_LAYER, request, timeout)).layer)

    async def get_layer(self, map_name: str, layer: str, *, timeout: float | None = None) -> Layer:
        """Returns the metadata of a layer. Raises NotFound if there is no such map or layer."""
        request = pb.GetLayerRequest(map=map_name, layer=layer)
        return decode_layer((await self._call(rpc.GET_LAYER, request, timeout)).layer)

    async def list_layers(self, map_name: str, *, timeout: float | None = None) -> LayerList:
        """Lists the layers of a map, sorted by name."""
        request = pb.ListLayersRequest(map=map_name)
        answer = await self._call(rpc.LIST_LAYERS, request, timeout)
        layers = tuple(map(decode_layer, answer.layers))
        return LayerList(answer.map, answer.revision, layers, answer.incarnation)

    async def delete_layer(
        self,
        map_name: str,
        layer: str,
        *,
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> int:
        """Deletes a layer with its content, and returns the revision of the deletion.

        DeleteLayer does so in a batch of edits.

        Raises Aborted if the map has another incarnation than the given one.
        """
        request = pb.DeleteLayerRequest(
            map=map_name,
            layer=layer,
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
        )
        return (await self._call(rpc.DELETE_LAYER, request, timeout)).revision

    async def set_transform(
        self,
        map_name: str,
        parent_frame_id: str,
        child_frame_id: str,
        parent_from_child: Pose,
        *,
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> int:
        """Sets the pose of a frame in its parent frame, and returns the revision of the change.

        SetTransform does so in a batch of edits.

        parent_from_child: maps coordinates in the child to coordinates in the parent. It replaces
            an earlier transform of the child.

        Raises InvalidArgument if the transforms would form a cycle, and Aborted if the map has
        another incarnation than the given one.
        """
        transform = Transform(parent_frame_id, child_frame_id, parent_from_child)
        request = pb.SetTransformRequest(
            map=map_name,
            transform=encode_transform(transform),
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
        )
        return (await self._call(rpc.SET_TRANSFORM, request, timeout)).revision

    async def list_transforms(
        self, map_name: str, *, timeout: float | None = None
    ) -> TransformList:
        """Lists the transforms between the frames of a map, sorted by child frame."""
        request = pb.ListTransformsRequest(map=map_name)
        answer = await self._call(rpc.LIST_TRANSFORMS, request, timeout)
        return TransformList(
            answer.map,
            answer.revision,
            answer.frame_id,
            tuple(map(decode_transform, answer.transforms)),
            answer.incarnation,
        )

    async def import_map(
        self,
        map_name: str,
        files: FileLike | Iterable[FileLike],
        *,
        format: FileFormat | None = None,
        layer: str = "",
        frame_id: str = "",
        create_map: bool = True,
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> ImportAnswer:
        """Imports interchange files into a map as one revision, or nothing of them.

        files: paths, or NamedFile for content in memory. NAV2 needs two, the YAML and its image.
        format: None to tell it by the suffix of the file names.
        layer: the layer to write. Required for GEOJSON, which creates a semantic layer if there is
            none. NAV2 creates it, "occupancy" if empty. HMAP ignores it and creates the layers of
            the file.
        frame_id: frame of the layer that NAV2 creates; empty for the map's own.
        create_map: whether to create the map if it does not exist; NotFound otherwise.

        Raises OSError if a file cannot be read, ValueError if the format is unknown,
        InvalidArgument if the content of a file is invalid, and Aborted if the map has another
        incarnation than the given one.
        """
        named = read_files(files)
        header = pb.ImportHeader(
            map=map_name,
            format=encode_enum(format_of(named) if format is None else format),
            layer=layer,
            frame_id=frame_id,
            create_map=create_map,
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
        )
        requests = list(import_requests(header, named))
        answer = await self._upload(rpc.IMPORT_MAP, requests, timeout)
        return ImportAnswer(
            answer.map,
            answer.revision,
            tuple(answer.layers),
            tuple(answer.repairs),
            answer.incarnation,
        )

    async def export_map(
        self,
        map_name: str,
        format: FileFormat,
        *,
        layers: Layers = (),
        image_format: Literal["pgm", "png"] = "pgm",
        timeout: float | None = None,
    ) -> ExportAnswer:
        """Exports a map, or some of its layers, as interchange files.

        layers: none for all layers that the format can represent. NAV2 needs exactly one, unless
            the map has just one occupancy layer.
        image_format: format of the image of NAV2.
        """
        request = pb.ExportMapRequest(
            map=map_name,
            format=encode_enum(format),
            layers=names_of(layers),
            image_format=image_format,
        )
        return collect_export(await self._collect(rpc.EXPORT_MAP, request, timeout))

    async def backup_map(self, map_name: str, path: Path, *, timeout: float | None = None) -> int:
        """Writes a consistent copy of the stored map, a GeoPackage, and returns its size in bytes.

        The map stays in use. A file at `path` is replaced when the copy is complete, and kept if
        the call fails. Raises OSError if the file cannot be written.
        """
        with AtomicFile(path) as file:
            async for data in self.iter_backup(map_name, timeout=timeout):
                file.write(data)
        return file.size

    async def iter_backup(
        self, map_name: str, *, timeout: float | None = None
    ) -> AsyncIterator[bytes]:
        """Yields the bytes of a backup of the map in chunks, see `backup_map`."""
        request = pb.BackupMapRequest(map=map_name)
        async for message in self._stream(rpc.BACKUP_MAP, request, timeout):
            yield message.data

    async def check_map(self, map_name: str, *, timeout: float | None = None) -> CheckReport:
        """Checks the stored map as a whole: its pages, indexes, content, history and evidence.

        The map stays in use, and nothing is changed. Problems are in the report; they raise no
        error. The check reads the whole file of the map, so that a big map needs a longer timeout.
        """
        request = pb.CheckMapRequest(map=map_name)
        return decode_check_report(await self._call(rpc.CHECK_MAP, request, timeout))

    async def digest_map(self, map_name: str, *, timeout: float | None = None) -> MapDigest:
        """Returns digests of what the server shows of a map at its newest revision.

        Those of the same revision and incarnation are the same at each server.
        """
        request = pb.DigestMapRequest(map=map_name)
        return decode_digest(await self._call(rpc.DIGEST_MAP, request, timeout))

    async def restore_map(
        self,
        map_name: str,
        path: Path,
        *,
        replace: bool = False,
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> MapEntry:
        """Makes a backup a map, which is another incarnation, and returns it.

        The server checks the file before it changes anything.

        map_name: the name that the map gets, whatever its name was in the backup.
        path: the file that `backup_map` has written.
        replace: whether a map of that name is deleted; AlreadyExists otherwise.
        incarnation: the incarnation of the map that is to be replaced; 0 for any.

        Raises OSError if the file cannot be read, FailedPrecondition if it is not a map, DataLoss
        with the first problem if it is damaged, and Aborted if the map that is to be replaced has
        another incarnation than the given one, or does not exist.
        """
        chunks = FileChunks(path, CHUNK_BYTES)
        header = pb.RestoreHeader(
            map=map_name,
            replace=replace,
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
        )
        requests = RestoreRequests(header, chunks)
        return decode_map((await self._upload(rpc.RESTORE_MAP, requests, timeout)).map)

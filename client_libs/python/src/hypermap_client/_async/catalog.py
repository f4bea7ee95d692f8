"""Maps, layers, frames and files."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterable
from typing import Literal

from .. import _rpc as rpc
from .._files import FileLike, NewFile, Path, format_of, read_files
from .._proto import catalog_service_pb2 as pb
from .._requests import Layers, names_of, new_request_id
from .._wire.catalog import decode_map
from .._wire.enums import encode_enum
from .._wire.geometry import decode_transform, encode_transform
from .._wire.interchange import collect_export, import_requests
from .._wire.layers import decode_layer, encode_layer
from ..catalog import LayerList, MapEntry, TransformList
from ..geometry import Pose, Transform
from ..interchange import ExportAnswer, FileFormat, ImportAnswer
from ..layers import Layer, LayerSpec
from .connection import Connection


class Catalog(Connection):
    """The maps of a site."""

    async def create_map(
        self,
        map_name: str,
        *,
        frame_id: str = "",
        request_id: str = "",
        timeout: float | None = None,
    ) -> MapEntry:
        """Makes an empty map; `frame_id` is its own frame, "map" where empty.

        AlreadyExists when there is a map of that name.
        """
        request = pb.CreateMapRequest(
            map=map_name, frame_id=frame_id, request_id=request_id or new_request_id()
        )
        return decode_map((await self._call(rpc.CREATE_MAP, request, timeout)).map)

    async def get_map(self, map_name: str, *, timeout: float | None = None) -> MapEntry:
        """A map apart from its content.

        NotFound; DataLoss or FailedPrecondition when it is there but can't be opened.
        """
        request = pb.GetMapRequest(map=map_name)
        return decode_map((await self._call(rpc.GET_MAP, request, timeout)).map)

    async def list_maps(self, *, timeout: float | None = None) -> tuple[MapEntry, ...]:
        """All maps by name, those that can't be opened with their problem."""
        answer = await self._call(rpc.LIST_MAPS, pb.ListMapsRequest(), timeout)
        return tuple(map(decode_map, answer.maps))

    async def delete_map(
        self, map_name: str, *, request_id: str = "", timeout: float | None = None
    ) -> None:
        """Removes a map and all its layers for good."""
        request = pb.DeleteMapRequest(map=map_name, request_id=request_id or new_request_id())
        await self._call(rpc.DELETE_MAP, request, timeout)

    async def create_layer(
        self,
        map_name: str,
        layer: LayerSpec,
        *,
        request_id: str = "",
        timeout: float | None = None,
    ) -> Layer:
        """Adds an empty layer. AlreadyExists when the map has one of that name."""
        request = pb.CreateLayerRequest(
            map=map_name, layer=encode_layer(layer), request_id=request_id or new_request_id()
        )
        return decode_layer((await self._call(rpc.CREATE_LAYER, request, timeout)).layer)

    async def get_layer(self, map_name: str, layer: str, *, timeout: float | None = None) -> Layer:
        """A layer apart from its content."""
        request = pb.GetLayerRequest(map=map_name, layer=layer)
        return decode_layer((await self._call(rpc.GET_LAYER, request, timeout)).layer)

    async def list_layers(self, map_name: str, *, timeout: float | None = None) -> LayerList:
        """The layers of a map, by name."""
        request = pb.ListLayersRequest(map=map_name)
        answer = await self._call(rpc.LIST_LAYERS, request, timeout)
        return LayerList(answer.map, answer.revision, tuple(map(decode_layer, answer.layers)))

    async def delete_layer(
        self, map_name: str, layer: str, *, request_id: str = "", timeout: float | None = None
    ) -> int:
        """Removes a layer with its content; the revision that did."""
        request = pb.DeleteLayerRequest(
            map=map_name, layer=layer, request_id=request_id or new_request_id()
        )
        return (await self._call(rpc.DELETE_LAYER, request, timeout)).revision

    async def set_transform(
        self,
        map_name: str,
        parent_frame_id: str,
        child_frame_id: str,
        parent_from_child: Pose,
        *,
        request_id: str = "",
        timeout: float | None = None,
    ) -> int:
        """Places a frame in the tree by its pose in the parent; the revision that did.

        InvalidArgument when that would close a circle.
        """
        transform = Transform(parent_frame_id, child_frame_id, parent_from_child)
        request = pb.SetTransformRequest(
            map=map_name,
            transform=encode_transform(transform),
            request_id=request_id or new_request_id(),
        )
        return (await self._call(rpc.SET_TRANSFORM, request, timeout)).revision

    async def list_transforms(
        self, map_name: str, *, timeout: float | None = None
    ) -> TransformList:
        """The frames of a map, by child."""
        request = pb.ListTransformsRequest(map=map_name)
        answer = await self._call(rpc.LIST_TRANSFORMS, request, timeout)
        return TransformList(
            answer.map,
            answer.revision,
            answer.frame_id,
            tuple(map(decode_transform, answer.transforms)),
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
        request_id: str = "",
        timeout: float | None = None,
    ) -> ImportAnswer:
        """Reads an interchange file into a map, as one revision or not at all.

        files: paths, or NamedFile for bytes; nav2 wants two, the YAML and its image.
        format: None: by the names of the files.
        layer: the layer to write: wanted for GeoJSON (made where it is missing), "occupancy" where
            empty for nav2 (must not exist), not used for .hmap.
        frame_id: for nav2: the frame of the layer; empty: the map's own.
        create_map: whether to make the map where there is none.
        """
        named = read_files(files)
        header = pb.ImportHeader(
            map=map_name,
            format=encode_enum(format_of(named) if format is None else format),
            layer=layer,
            frame_id=frame_id,
            create_map=create_map,
            request_id=request_id or new_request_id(),
        )
        requests = list(import_requests(header, named))
        answer = await self._upload(rpc.IMPORT_MAP, requests, timeout)
        return ImportAnswer(
            answer.map, answer.revision, tuple(answer.layers), tuple(answer.repairs)
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
        """A map, or some of its layers, as interchange files.

        layers: none: all that the format can carry; nav2 wants one unless the map has just one
            occupancy layer.
        image_format: for nav2.
        """
        request = pb.ExportMapRequest(
            map=map_name,
            format=encode_enum(format),
            layers=names_of(layers),
            image_format=image_format,
        )
        return collect_export(await self._collect(rpc.EXPORT_MAP, request, timeout))

    async def backup_map(self, map_name: str, path: Path, *, timeout: float | None = None) -> int:
        """Writes the map as it is stored, a GeoPackage, to a file, and answers its size in bytes.

        The copy is consistent while the map stays in use. What was at `path` is replaced when the
        copy is whole. OSError when it can't be written.
        """
        with NewFile(path) as file:
            async for piece in self.iter_backup(map_name, timeout=timeout):
                file.write(piece)
        return file.size

    async def iter_backup(
        self, map_name: str, *, timeout: float | None = None
    ) -> AsyncIterator[bytes]:
        """The bytes of `backup_map`, piece after piece."""
        request = pb.BackupMapRequest(map=map_name)
        async for part in self._parts(rpc.BACKUP_MAP, request, timeout):
            yield part.data

"""The three questions of a hypermap, the same for every layer."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Iterable

import shapely

from .. import _rpc as rpc
from .._io import aio
from .._proto import query_service_pb2 as pb
from .._requests import AsOf, Layers, names_of, set_as_of
from .._wire.answers import (
    decode_answer,
    decode_nearest_answer,
    decode_point_answer,
    decode_points_answer,
)
from .._wire.geometry import encode_point, encode_polygon
from ..answers import Answer, NearestAnswer, PointAnswer, PointsAnswer
from ..errors import HypermapError, Internal
from ..geometry import AreaLike, PointLike, PointsLike, points_of
from ..grids import Grid
from .catalog import Catalog


class Queries(Catalog):
    """Questions. The options that they share are documented with the client."""

    async def query_point(
        self,
        map_name: str,
        point: PointLike,
        *,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        timeout: float | None = None,
    ) -> PointAnswer:
        """What is at this point (metres, in `frame_id`)? Each layer's value or objects.

        NotFound: no such map, layer or frame; InvalidArgument: coordinates that are not finite;
        OutOfRange: `as_of` is not kept any more, or is yet to come.
        """
        request = pb.QueryPointRequest(
            map=map_name,
            layers=names_of(layers),
            frame_id=frame_id,
            point=encode_point(point),
            min_revision=min_revision,
        )
        set_as_of(request, as_of)
        return decode_point_answer(await self._call(rpc.QUERY_POINT, request, timeout))

    async def query_points(
        self,
        map_name: str,
        points: PointsLike,
        *,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        timeout: float | None = None,
    ) -> PointsAnswer:
        """What is at these points (N×2, N >= 1)? One batch, read at one revision.

        ResourceExhausted for more than the server's --max_points (65,536): see stream_points.
        """
        opening = _opening(map_name, layers, frame_id, as_of, min_revision)
        batch = _batch(points)
        retries = self._retries(timeout)
        while True:
            stream = self._channel.duplex(rpc.QUERY_POINTS, retries.timeout())
            try:
                await stream.write(pb.QueryPointsRequest(opening=opening))
                return await _answer(stream, batch, [])
            except HypermapError as error:
                pause = retries.pause(error)
            finally:
                stream.cancel()
            await aio.sleep(pause)

    async def stream_points(
        self,
        map_name: str,
        batches: Iterable[PointsLike],
        *,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        timeout: float = math.inf,
    ) -> AsyncIterator[PointsAnswer]:
        """What is at the points of each batch (N×2)? An answer for each, in order.

        Each batch is read at the newest revision of its time, unless `as_of` says which. `timeout`
        is of the whole stream, which is not tried again when it breaks.
        """
        opening = _opening(map_name, layers, frame_id, as_of, min_revision)
        stream = self._channel.duplex(rpc.QUERY_POINTS, None if math.isinf(timeout) else timeout)
        labels: list[str] = []
        try:
            await stream.write(pb.QueryPointsRequest(opening=opening))
            for points in batches:
                yield await _answer(stream, _batch(points), labels)
        finally:
            stream.cancel()

    async def query_area(
        self,
        map_name: str,
        area: AreaLike,
        *,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        timeout: float | None = None,
    ) -> Answer:
        """What is in this area? Objects that intersect it, cells whose centre it covers.

        area: a polygon, or its outer ring as N×2, in metres in `frame_id`; InvalidArgument when it
            crosses itself. The answer is of one revision. Further errors as of query_point.
        """
        request = pb.QueryAreaRequest(
            map=map_name,
            layers=names_of(layers),
            frame_id=frame_id,
            area=encode_polygon(area),
            min_revision=min_revision,
        )
        set_as_of(request, as_of)
        parts = await self._collect(rpc.QUERY_AREA, request, timeout)
        return decode_answer(map_name, frame_id, parts)

    async def query_value(
        self,
        map_name: str,
        value: str,
        *,
        area: AreaLike | None = None,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        timeout: float | None = None,
    ) -> Answer:
        """Where is this value, everywhere or in an area?

        value: free, occupied, unknown, explored, unexplored; >0.65, <=0.2, =1, 0.2..0.5; a class
            label or an alias of some; tag:WORD. Case does not matter. A layer that can't take it
            answers UNSUPPORTED_VALUE; InvalidArgument for a comparison with no number.
        Objects are whole, also where only a part of them is in the area. Errors as of query_area.
        """
        request = pb.QueryValueRequest(
            map=map_name,
            layers=names_of(layers),
            frame_id=frame_id,
            value=value,
            area=None if area is None else encode_polygon(area),
            min_revision=min_revision,
        )
        set_as_of(request, as_of)
        parts = await self._collect(rpc.QUERY_VALUE, request, timeout)
        return decode_answer(map_name, frame_id, parts)

    async def query_nearest(
        self,
        map_name: str,
        point: PointLike,
        value: str,
        k: int = 1,
        *,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        timeout: float | None = None,
    ) -> NearestAnswer:
        """The k places nearest to a point that have a value, over all the layers together.

        Nearest first; distances in metres, to the object's polygon (0 inside) or to the cell's
        centre. ResourceExhausted: k is more than the server's --max_nearest (1,000).
        """
        request = pb.QueryNearestRequest(
            map=map_name,
            layers=names_of(layers),
            frame_id=frame_id,
            point=encode_point(point),
            value=value,
            k=k,
            min_revision=min_revision,
        )
        set_as_of(request, as_of)
        return decode_nearest_answer(await self._call(rpc.QUERY_NEAREST, request, timeout))

    async def read_grid(
        self,
        map_name: str,
        layer: str,
        *,
        as_of: AsOf = None,
        min_revision: int = 0,
        timeout: float | None = None,
    ) -> Grid:
        """All of a grid layer as an array, in the layer's own frame.

        An earlier revision fills the extent that the layer has now. ValueError for a layer that is
        no grid, or has no cells yet.
        """
        found = await self.get_layer(map_name, layer, timeout=timeout)
        if found.grid is None or found.extent is None:
            raise ValueError(f"layer {layer!r} has no cells")
        box = found.extent
        rows = [box.row_begin, box.row_begin, box.row_end, box.row_end]
        cols = [box.col_begin, box.col_end, box.col_end, box.col_begin]
        answer = await self.query_area(
            map_name,
            shapely.Polygon(found.grid.corners(rows, cols)),
            layers=layer,
            frame_id=found.frame_id,
            as_of=as_of,
            min_revision=min_revision,
            timeout=timeout,
        )
        cells = answer[layer].cells
        if cells is None:
            raise ValueError(f"layer {layer!r} had no cells then")
        return cells.to_grid(box)


def _opening(
    map_name: str, layers: Layers, frame_id: str, as_of: AsOf, min_revision: int
) -> pb.QueryPointsOpening:
    opening = pb.QueryPointsOpening(
        map=map_name, layers=names_of(layers), frame_id=frame_id, min_revision=min_revision
    )
    set_as_of(opening, as_of)
    return opening


def _batch(points: PointsLike) -> pb.QueryPointsRequest:
    array = points_of(points)
    if len(array) == 0:
        raise ValueError("a batch has at least one point")
    return pb.QueryPointsRequest(xs=array[:, 0].tolist(), ys=array[:, 1].tolist())


async def _answer(
    stream: aio.Stream[pb.QueryPointsRequest, pb.QueryPointsResponse],
    batch: pb.QueryPointsRequest,
    labels: list[str],
) -> PointsAnswer:
    await stream.write(batch)
    message = await stream.read()
    if message is None:
        raise Internal("the server's answer: the stream ended before the batch was answered")
    return decode_points_answer(message, labels)

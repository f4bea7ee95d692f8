"""Queries for a point, an area, a value and the nearest places with a value."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Iterable

import shapely

from .. import _rpc as rpc
from .._io import aio
from .._proto import catalog_service_pb2 as catalog
from .._proto import query_service_pb2 as pb
from .._requests import AsOf, Layers, make_scope
from .._wire.answers import (
    decode_answer,
    decode_nearest_answer,
    decode_point_answer,
    decode_points_answer,
)
from .._wire.geometry import encode_point, encode_polygon
from .._wire.layers import decode_layer
from ..answers import Answer, Consistency, NearestAnswer, PointAnswer, PointsAnswer
from ..errors import HypermapError, Internal
from ..geometry import AreaLike, PointLike, PointsLike, points_of
from ..grids import Grid
from .catalog import Catalog


class Queries(Catalog):
    """Queries. The options that they share are documented with the client."""

    async def query_point(
        self,
        map_name: str,
        point: PointLike,
        *,
        tolerance_m: float = 0.0,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        consistency: Consistency = Consistency.LOCAL,
        incarnation: int = 0,
        timeout: float | None = None,
    ) -> PointAnswer:
        """Returns what each layer has at a point: the value of a cell, or objects.

        point: x and y in metres, in `frame_id`. Points on the boundary of an object belong to it.
        tolerance_m: objects up to this distance from the point are returned too, in metres, >= 0.
            With 0, a line string or a point is found only where the query meets it exactly. Grids
            answer with the cell that contains the point, whatever the tolerance.

        Raises NotFound for an unknown map, layer or frame, InvalidArgument for coordinates that are
        not finite or a negative tolerance, OutOfRange if the revision of `as_of` is compacted or
        does not exist yet, Aborted if the map has another incarnation than the given one, and
        DeadlineExceeded if the map does not reach `min_revision` in time.
        """
        request = pb.QueryPointRequest(
            scope=make_scope(map_name, layers, frame_id, incarnation),
            as_of=self._as_of(map_name, as_of, min_revision, consistency),
            point=encode_point(point),
            tolerance_m=tolerance_m,
        )
        return decode_point_answer(await self._call(rpc.QUERY_POINT, request, timeout))

    async def query_points(
        self,
        map_name: str,
        points: PointsLike,
        *,
        tolerance_m: float = 0.0,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        consistency: Consistency = Consistency.LOCAL,
        incarnation: int = 0,
        timeout: float | None = None,
    ) -> PointsAnswer:
        """Returns what each layer has at many points, read at one revision.

        points: array of shape (N, 2) in metres, in `frame_id`, with N >= 1.
        tolerance_m: as in query_point.

        Raises ValueError for points of another shape, and ResourceExhausted for more points than
        the server's --max_points (default 65,536); stream_points takes several batches. Other
        errors are those of query_point.
        """
        opening = pb.QueryPointsOpening(
            scope=make_scope(map_name, layers, frame_id, incarnation),
            as_of=self._as_of(map_name, as_of, min_revision, consistency),
            tolerance_m=tolerance_m,
        )
        batch = _batch(points)
        retries = self._retries(timeout)
        while True:
            stream = self._channel.duplex(rpc.QUERY_POINTS, retries.timeout())
            try:
                await stream.write(pb.QueryPointsRequest(opening=opening))
                return await self._answer_batch(stream, opening, batch, [])
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
        tolerance_m: float = 0.0,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        consistency: Consistency = Consistency.LOCAL,
        incarnation: int = 0,
        timeout: float = math.inf,
    ) -> AsyncIterator[PointsAnswer]:
        """Yields what each layer has at the points of each batch, in the order of the batches.

        batches: arrays of shape (N, 2) in metres, in `frame_id`, with N >= 1. The next batch is
            taken when the answer to the one before has been yielded.
        tolerance_m: as in query_point.
        as_of: None to read each batch at the newest revision at its time.
        timeout: time in seconds for the whole stream.

        The stream is not retried. Errors are those of query_points.
        """
        opening = pb.QueryPointsOpening(
            scope=make_scope(map_name, layers, frame_id, incarnation),
            as_of=self._as_of(map_name, as_of, min_revision, consistency),
            tolerance_m=tolerance_m,
        )
        stream = self._channel.duplex(rpc.QUERY_POINTS, None if math.isinf(timeout) else timeout)
        labels: list[str] = []
        try:
            await stream.write(pb.QueryPointsRequest(opening=opening))
            for points in batches:
                yield await self._answer_batch(stream, opening, _batch(points), labels)
        finally:
            stream.cancel()

    async def _answer_batch(
        self,
        stream: aio.Stream[pb.QueryPointsRequest, pb.QueryPointsResponse],
        opening: pb.QueryPointsOpening,
        batch: pb.QueryPointsRequest,
        labels: list[str],
    ) -> PointsAnswer:
        await stream.write(batch)
        message = await stream.read()
        if message is None:
            raise Internal("the stream ended before the batch was answered")
        self._seen.note_answers(opening, [message])
        return decode_points_answer(message, labels)

    async def query_area(
        self,
        map_name: str,
        area: AreaLike,
        *,
        layers: Layers = (),
        frame_id: str = "",
        as_of: AsOf = None,
        min_revision: int = 0,
        consistency: Consistency = Consistency.LOCAL,
        incarnation: int = 0,
        timeout: float | None = None,
    ) -> Answer:
        """Returns the objects that intersect an area, and the cells whose centre it covers.

        area: a polygon, or its outer ring as an array of shape (N, 2), in metres in `frame_id`.

        The answer is read at one revision. Raises InvalidArgument if the area intersects itself;
        other errors are those of query_point.
        """
        request = pb.QueryAreaRequest(
            scope=make_scope(map_name, layers, frame_id, incarnation),
            as_of=self._as_of(map_name, as_of, min_revision, consistency),
            area=encode_polygon(area),
        )
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
        consistency: Consistency = Consistency.LOCAL,
        incarnation: int = 0,
        timeout: float | None = None,
    ) -> Answer:
        """Returns the objects and cells that have a value, in the whole map or in an area.

        value: `free`, `occupied`, `unknown`, `explored` or `unexplored`; a comparison such as
            `>0.65`, `<=0.2`, `=1` or `0.2..0.5`; a class label or an alias of labels; `tag:WORD`.
            Upper and lower case are the same. A layer that does not support the value answers
            UNSUPPORTED_VALUE.
        area: as in query_area; None for the whole map. Objects that are partly in the area are
            returned completely.

        Raises InvalidArgument for a comparison without a number; other errors are those of
        query_area.
        """
        request = pb.QueryValueRequest(
            scope=make_scope(map_name, layers, frame_id, incarnation),
            as_of=self._as_of(map_name, as_of, min_revision, consistency),
            value=value,
            area=None if area is None else encode_polygon(area),
        )
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
        consistency: Consistency = Consistency.LOCAL,
        incarnation: int = 0,
        timeout: float | None = None,
    ) -> NearestAnswer:
        """Returns the k objects and cells nearest to a point that have a value, over all layers.

        point: x and y in metres, in `frame_id`.
        value: as in query_value.
        k: maximal number of matches, >= 1.

        Matches are sorted by distance. It is measured in metres to the shape of an object (0
        inside it), or to the centre of a cell. Raises ResourceExhausted if k exceeds the server's
        --max_nearest (default 1,000); other errors are those of query_point.
        """
        request = pb.QueryNearestRequest(
            scope=make_scope(map_name, layers, frame_id, incarnation),
            as_of=self._as_of(map_name, as_of, min_revision, consistency),
            point=encode_point(point),
            value=value,
            k=k,
        )
        return decode_nearest_answer(await self._call(rpc.QUERY_NEAREST, request, timeout))

    async def read_grid(
        self,
        map_name: str,
        layer: str,
        *,
        as_of: AsOf = None,
        min_revision: int = 0,
        consistency: Consistency = Consistency.LOCAL,
        incarnation: int = 0,
        timeout: float | None = None,
    ) -> Grid:
        """Returns a whole grid layer as an array, in the layer's own frame.

        as_of: cells of an earlier revision are returned in an array over the present extent.

        Raises ValueError if the layer has no cells: it is not a grid, or nothing was written to it.
        Other errors are those of query_area; Aborted also if the map is replaced during the call.
        """
        request = catalog.GetLayerRequest(map=map_name, layer=layer)
        response = await self._call(rpc.GET_LAYER, request, timeout)
        found = decode_layer(response.layer)
        if not found.properties.has_cells or found.grid is None:
            raise ValueError(f"layer {layer!r} is not a grid and has no cells")
        if found.extent is None:
            raise ValueError(f"layer {layer!r} has no cells yet")
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
            consistency=consistency,
            # The extent describes the cells of this incarnation only.
            incarnation=incarnation or response.incarnation,
            timeout=timeout,
        )
        cells = answer[layer].cells
        if cells is None:
            raise ValueError(f"layer {layer!r} has no cells at this revision")
        return cells.to_grid(box)


def _batch(points: PointsLike) -> pb.QueryPointsRequest:
    array = points_of(points)
    if len(array) == 0:
        raise ValueError("a batch needs at least one point")
    return pb.QueryPointsRequest(xs=array[:, 0].tolist(), ys=array[:, 1].tolist())

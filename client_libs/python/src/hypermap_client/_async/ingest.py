"""Observations of robots, fused to the objects of a layer."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from datetime import datetime

from .. import _rpc as rpc
from .._proto import ingest_service_pb2 as pb
from .._requests import new_request_id
from .._wire.observations import decode_history
from .._wire.time import encode_time
from ..observations import ObjectHistory
from .connection import Connection
from .observe import AsyncObserveStream


class Ingest(Connection):
    """Observations, and what fusion made of them."""

    def observe(
        self,
        map_name: str,
        layer: str,
        *,
        robot: str = "",
        exploration_layer: str = "",
        strategy: str = "",
        parameters: Mapping[str, float] | None = None,
        idle_timeout: float | None = 60.0,
        timeout: float = math.inf,
    ) -> AsyncObserveStream:
        """A stream of observations to a semantic layer, which becomes a fused one.

        robot: whose known sequences the opened stream tells.
        exploration_layer: where free space is marked as explored; empty: the one that the layer
            has, if any.
        strategy: "evidence" or "paper"; empty: what the layer has, "evidence" for a new one.
        parameters: of the strategy; None: what the layer has, the defaults for a new one.
        idle_timeout: a connection on which nothing came for so many seconds while an
            acknowledgement is awaited is taken for broken. None: never.
        timeout: of the whole stream, in seconds.

        FailedPrecondition for a layer of another kind, or one that is fused in another way.
        """
        opening = pb.ObserveOpening(
            map=map_name,
            layer=layer,
            exploration_layer=exploration_layer,
            strategy=strategy,
            parameters=_json(parameters),
            robot=robot,
        )
        return AsyncObserveStream(
            self._channel,
            opening,
            retry_for=self._retry_for,
            idle_timeout=idle_timeout,
            timeout=timeout,
        )

    async def rebuild_layer(
        self,
        map_name: str,
        layer: str,
        *,
        strategy: str = "",
        parameters: Mapping[str, float] | None = None,
        request_id: str = "",
        timeout: float | None = None,
    ) -> int:
        """Fuses all observations of a layer again; the revision that shows the result.

        strategy: empty: the one that the layer has. parameters: None: the strategy's defaults.
        """
        request = pb.RebuildLayerRequest(
            map=map_name,
            layer=layer,
            strategy=strategy,
            parameters=_json(parameters),
            request_id=request_id or new_request_id(),
        )
        return (await self._call(rpc.REBUILD_LAYER, request, timeout)).revision

    async def retract_source(
        self,
        map_name: str,
        layer: str,
        robot: str,
        *,
        from_time: datetime | None = None,
        to_time: datetime | None = None,
        request_id: str = "",
        timeout: float | None = None,
    ) -> int:
        """Takes a robot's observations back, as if never made; the revision that did.

        Those with from_time <= stamp < to_time; None: from the beginning, to the end. NotFound
        when there are none.
        """
        request = pb.RetractSourceRequest(
            map=map_name, layer=layer, robot=robot, request_id=request_id or new_request_id()
        )
        if from_time is not None:
            encode_time(from_time, getattr(request, "from"))
        if to_time is not None:
            encode_time(to_time, request.to)
        return (await self._call(rpc.RETRACT_SOURCE, request, timeout)).revision

    async def explain_object(
        self, map_name: str, layer: str, object_id: int, *, timeout: float | None = None
    ) -> ObjectHistory:
        """Which observations made an object of a fused layer.

        NotFound when fusion did not make it.
        """
        request = pb.ExplainObjectRequest(map=map_name, layer=layer, object_id=object_id)
        return decode_history(await self._call(rpc.EXPLAIN_OBJECT, request, timeout))


def _json(parameters: Mapping[str, float] | None) -> str:
    return "" if parameters is None else json.dumps(dict(parameters))

"""Calls for observations and the layers that are fused from them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from datetime import datetime

from .. import _rpc as rpc
from .._proto import ingest_service_pb2 as pb
from .._requests import new_request_id
from .._wire.observations import decode_history, encode_corrected_pose
from .._wire.time import encode_time
from ..observations import CorrectedPose, ObjectHistory, Smoothing
from .connection import Connection
from .observe import AsyncObserveStream


class Ingest(Connection):
    """Calls for observations and the layers that are fused from them."""

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
        """Opens a stream of observations to a semantic layer, and makes it a fused layer.

        Use it in a `with` block; the call is made when the block is entered.

        robot: the robot whose known sequences are reported in `opened.known`; empty for none.
        exploration_layer: layer on which free space is marked as explored; empty for the present
            one of the fused layer, if any.
        strategy: "evidence" or "paper"; empty for the present strategy of the layer, "evidence" for
            a layer that is not fused yet.
        parameters: parameters of the strategy; None for the present ones of the layer, or the
            defaults for a layer that is not fused yet.
        idle_timeout: time in seconds to wait for an acknowledgement before the connection counts as
            broken and is opened again; None for no limit.
        timeout: time in seconds for the whole stream.

        Entering the block raises NotFound if there is no such map or layer, and FailedPrecondition
        for a layer of another kind or with another strategy or other parameters.
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
            seen=self._seen,
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
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> int:
        """Fuses all observations of a layer again, and returns the revision with the result.

        strategy: "evidence" or "paper"; empty for the present strategy of the layer.
        parameters: parameters of the strategy; None for its defaults.

        Raises Aborted if the map has another incarnation than the given one.
        """
        request = pb.RebuildLayerRequest(
            map=map_name,
            layer=layer,
            strategy=strategy,
            parameters=_json(parameters),
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
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
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> int:
        """Removes observations of a robot from a fused layer; returns the revision of the change.

        The layer and its exploration layer are then as if these observations had not been made.

        from_time, to_time: observations with from_time <= stamp < to_time are removed; None for no
            limit. Times need a time zone.

        Raises NotFound if there are no such observations, and Aborted if the map has another
        incarnation than the given one.
        """
        request = pb.RetractSourceRequest(
            map=map_name,
            layer=layer,
            robot=robot,
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
        )
        if from_time is not None:
            encode_time(from_time, getattr(request, "from"))
        if to_time is not None:
            encode_time(to_time, request.to)
        return (await self._call(rpc.RETRACT_SOURCE, request, timeout)).revision

    async def correct_poses(
        self,
        map_name: str,
        layer: str,
        robot: str,
        poses: Iterable[CorrectedPose],
        *,
        frame_id: str = "",
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> int:
        """Gives a robot's observations better poses; returns the revision of the change.

        An observation gets the pose of its stamp; between poses that are at most half a second
        apart, the interpolated one. It is moved on the plane, and the layer is fused again.

        poses: at most 100,000, ascending by stamp.
        frame_id: frame of the poses; empty for the map's own.

        Raises NotFound if no observation is corrected, FailedPrecondition if some are no longer
        kept, and Aborted if the map has another incarnation than the given one.
        """
        request = pb.CorrectPosesRequest(
            map=map_name,
            layer=layer,
            robot=robot,
            frame_id=frame_id,
            poses=map(encode_corrected_pose, poses),
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
        )
        return (await self._call(rpc.CORRECT_POSES, request, timeout)).revision

    async def smooth_poses(
        self,
        map_name: str,
        layer: str,
        *,
        occupancy_layer: str = "",
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> Smoothing:
        """Computes better poses for a layer's observations from what they have in common.

        Frames that see the same surfaces are matched to each other, and to the walls of an
        occupancy grid; the layer is fused again with the result. A second call changes nothing.

        occupancy_layer: an occupancy grid of the map; empty for its only one, if it has one.

        Raises NotFound if there is no such map or layer, FailedPrecondition if the layer is not
        fused, and Aborted if the map has another incarnation than the given one.
        """
        request = pb.SmoothPosesRequest(
            map=map_name,
            layer=layer,
            occupancy_layer=occupancy_layer,
            request_id=request_id or new_request_id(),
            incarnation=incarnation,
        )
        response = await self._call(rpc.SMOOTH_POSES, request, timeout)
        return Smoothing(
            revision=response.revision,
            matched=response.matched,
            moved=response.moved,
            rms_shift_m=response.rms_shift_m,
            occupancy_layer=response.occupancy_layer,
        )

    async def explain_object(
        self, map_name: str, layer: str, object_id: int, *, timeout: float | None = None
    ) -> ObjectHistory:
        """Returns the observations and edits that an object of a fused layer results from.

        Raises NotFound if the object was not made by fusion.
        """
        request = pb.ExplainObjectRequest(map=map_name, layer=layer, object_id=object_id)
        return decode_history(await self._call(rpc.EXPLAIN_OBJECT, request, timeout))


def _json(parameters: Mapping[str, float] | None) -> str:
    return "" if parameters is None else json.dumps(dict(parameters))

"""Estimates of the transform between two maps."""

from __future__ import annotations

from collections.abc import Iterable

from .. import _rpc as rpc
from .._proto import query_service_pb2 as pb
from .._requests import make_scope
from .._wire.registration import decode_transform_estimate, encode_point_pair
from ..registration import PointPair, TransformEstimate, TransformSide
from .connection import Connection


class Registration(Connection):
    """Estimates of transforms."""

    async def estimate_transform(
        self, source: TransformSide, target: TransformSide, *, timeout: float | None = None
    ) -> TransformEstimate:
        """Estimates the transform that lays a layer over another one of the same kind.

        source: the layer that is laid over the other, an occupancy grid or objects.
        target: the layer over which it is laid, of the same map or of another.

        Needs no first guess, and changes nothing: set_transform applies the answer. Do not use an
        answer that is ambiguous without a further look. Raises FailedPrecondition if the layers
        can't be compared, or have nothing to compare, ResourceExhausted if they are too large, and
        PermissionDenied without access to both maps. Other errors are those of query_point.
        """
        request = self._sides(source, target)
        return await self._estimate(request, timeout)

    async def estimate_transform_from_pairs(
        self,
        source: TransformSide,
        target: TransformSide,
        pairs: Iterable[PointPair],
        *,
        timeout: float | None = None,
    ) -> TransformEstimate:
        """Estimates the transform that lays points over points.

        source, target: the maps with the frames of the points; they name no layers.
        pairs: 2 to 1,000, of which some may be wrong.

        Raises ValueError for a sigma_m of 0, FailedPrecondition for fewer than two pairs, and
        ResourceExhausted for more than 1,000. Other errors are those of estimate_transform.
        """
        request = self._sides(source, target)
        request.pairs.extend(map(encode_point_pair, pairs))
        return await self._estimate(request, timeout)

    def _sides(self, source: TransformSide, target: TransformSide) -> pb.EstimateTransformRequest:
        return pb.EstimateTransformRequest(source=self._side(source), target=self._side(target))

    def _side(self, side: TransformSide) -> pb.EstimateTransformSide:
        return pb.EstimateTransformSide(
            scope=make_scope(
                side.map, [side.layer] if side.layer else [], side.frame_id, side.incarnation
            ),
            as_of=self._as_of(side.map, side.as_of, side.min_revision, side.consistency),
        )

    async def _estimate(
        self, request: pb.EstimateTransformRequest, timeout: float | None
    ) -> TransformEstimate:
        response = await self._call(rpc.ESTIMATE_TRANSFORM, request, timeout)
        for side in (response.source, response.target):
            self._seen.note(side.map, side.incarnation, side.revision)
        return decode_transform_estimate(response)

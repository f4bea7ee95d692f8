"""Tests of estimates of the transform between two maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely
from scripted_server import scripted_server

from hypermap_client import (
    Ambiguity,
    AsyncClient,
    Client,
    Consistency,
    FailedPrecondition,
    InvalidArgument,
    LayerKind,
    LayerSpec,
    MapObject,
    NotFound,
    PointPair,
    Pose,
    PutObject,
    ResourceExhausted,
    TransformSide,
    _rpc,
)
from hypermap_client._proto import query_service_pb2 as query

# Places at which no transform but the true one fits.
PLACES = np.array([(0, 0), (4, 1), (5, 7), (-3, 2), (1, -6)], float)
TRUE = Pose(-12.0, 30.0, -1.1)


def fill(client: Client, name: str, places: Any) -> None:
    """Puts a chair at each place."""
    client.create_layer(name, LayerSpec(name="chairs", kind=LayerKind.SEMANTIC))
    boxes = [shapely.box(x - 0.2, y - 0.2, x + 0.2, y + 0.2) for x, y in places]
    client.apply_edits(name, [PutObject("chairs", MapObject("chair", box)) for box in boxes])


@pytest.fixture
def other(client: Client, site: str) -> str:
    """The name of a map with the chairs of `site`, as seen from another origin."""
    name = f"{site}-other"
    client.create_map(name)
    fill(client, site, PLACES)
    fill(client, name, TRUE.apply(PLACES))
    return name


def assert_true(pose: Pose) -> None:
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((TRUE.x, TRUE.y, TRUE.yaw), abs=1e-6)


def test_objects_are_laid_over_each_other(client: Client, site: str, other: str) -> None:
    answer = client.estimate_transform(
        TransformSide(site, "chairs"), TransformSide(other, "chairs")
    )
    assert_true(answer.target_from_source)
    assert answer.ambiguity == Ambiguity.NONE
    assert answer.best.score > 0.9 and answer.inlier_share == 1.0
    assert answer.covariance is not None and answer.covariance.shape == (3, 3)
    np.testing.assert_allclose(answer.covariance, answer.covariance.T)
    assert len(answer.agreeing) == 5 and answer.agreeing[0].residual_m < 1e-6
    assert (answer.source.map, answer.source.layer, answer.source.frame_id) == (
        site, "chairs", "map",
    )  # fmt: skip
    assert answer.source.revision == client.get_map(site).revision
    assert answer.target.incarnation == client.get_map(other).incarnation
    # It can be applied as it is.
    client.set_transform(other, answer.target.frame_id, "theirs", answer.target_from_source)
    assert_true(client.list_transforms(other).transforms[0].parent_from_child)


def test_past_revisions_are_compared(client: Client, site: str, other: str) -> None:
    before = client.get_map(site).revision
    client.delete_layer(site, "chairs")
    with pytest.raises(NotFound, match="chairs"):
        client.estimate_transform(TransformSide(site, "chairs"), TransformSide(other, "chairs"))
    answer = client.estimate_transform(
        TransformSide(site, "chairs", as_of=before), TransformSide(other, "chairs")
    )
    assert_true(answer.target_from_source)
    assert answer.source.revision == before


def test_pairs_are_laid_over_each_other_but_wrong_ones(
    client: Client, site: str, other: str
) -> None:
    pairs = [PointPair(tuple(p), tuple(q)) for p, q in zip(PLACES, TRUE.apply(PLACES), strict=True)]
    pairs[2] = PointPair(shapely.Point(5, 7), shapely.Point(0, 0), name="wrong")
    answer = client.estimate_transform_from_pairs(TransformSide(site), TransformSide(other), pairs)
    assert_true(answer.target_from_source)
    assert answer.inlier_share == pytest.approx(0.8)
    assert [pair.source for pair in answer.agreeing] == [0, 1, 3, 4]
    assert answer.source.layer == ""


def test_without_agreement_there_is_no_covariance(client: Client, site: str) -> None:
    side = TransformSide(site)
    answer = client.estimate_transform_from_pairs(
        side, side, [PointPair((0, 0), (0, 0)), PointPair((1, 0), (100, 0))]
    )
    assert answer.ambiguity == Ambiguity.LITTLE_AGREEMENT
    assert answer.covariance is None and answer.runner_up is None and answer.best.score == 0


def test_wrong_arguments(client: Client, site: str, other: str) -> None:
    side = TransformSide(site)
    good = PointPair((0, 0), (1, 1))
    with pytest.raises(ValueError, match="sigma_m"):
        client.estimate_transform_from_pairs(side, side, [good, PointPair((0, 0), (1, 1), 0)])
    with pytest.raises(InvalidArgument, match=r"pairs\[1\] \(\"door\"\).sigma_m"):
        client.estimate_transform_from_pairs(
            side, side, [good, PointPair((0, 0), (1, 1), -1, "door")]
        )
    with pytest.raises(FailedPrecondition, match="two pairs"):
        client.estimate_transform_from_pairs(side, side, [good])
    with pytest.raises(ResourceExhausted, match="pairs"):
        client.estimate_transform_from_pairs(side, side, [good] * 1001)
    with pytest.raises(InvalidArgument, match="must name one layer"):
        client.estimate_transform(side, side)
    client.create_layer(other, LayerSpec(name="empty", kind=LayerKind.SEMANTIC))
    with pytest.raises(FailedPrecondition, match="no object of the source"):
        client.estimate_transform(TransformSide(site, "chairs"), TransformSide(other, "empty"))


async def test_asyncio(client: Client, async_client: AsyncClient, site: str, other: str) -> None:
    answer = await async_client.estimate_transform(
        TransformSide(site, "chairs"), TransformSide(other, "chairs")
    )
    assert_true(answer.target_from_source)


def test_requests_have_both_sides_and_what_was_seen_of_them() -> None:
    requests: list[query.EstimateTransformRequest] = []
    response = query.EstimateTransformResponse(ambiguity=query.TRANSFORM_AMBIGUITY_RUNNER_UP)
    response.source.map, response.source.revision, response.source.incarnation = "attic", 3, 8
    response.target.map, response.target.revision, response.target.incarnation = "office", 12, 9
    response.runner_up.score = 0.5

    def answer(request: Any, _metadata: dict[str, str]) -> Any:
        requests.append(request)
        return response

    with (
        scripted_server({_rpc.ESTIMATE_TRANSFORM: answer}) as address,
        Client(address) as client,
    ):
        sides = (
            TransformSide("attic", "floor", "dock", as_of=2, incarnation=8),
            TransformSide("office", "plan", min_revision=5, consistency=Consistency.LINEARIZABLE),
        )
        found = client.estimate_transform(*sides)
        client.estimate_transform(*sides)
    assert found.runner_up is not None and found.runner_up.score == 0.5
    source, target = requests[0].source, requests[0].target
    assert (source.scope.map, list(source.scope.layers), source.scope.frame_id) == (
        "attic", ["floor"], "dock",
    )  # fmt: skip
    assert (source.scope.incarnation, source.as_of.at_revision) == (8, 2)
    assert (target.as_of.min_revision, target.as_of.consistency) == (5, 2)
    assert requests[0].source.as_of.seen_revision == 0
    again = requests[1]
    assert (again.source.as_of.seen_revision, again.source.as_of.seen_incarnation) == (3, 8)
    assert (again.target.as_of.seen_revision, again.target.as_of.seen_incarnation) == (12, 9)

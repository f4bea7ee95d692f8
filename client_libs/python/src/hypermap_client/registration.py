"""The transform between two maps: what is compared, and what an estimate tells."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ._requests import AsOf
from .answers import Consistency
from .geometry import PointLike, Pose


class Ambiguity(IntEnum):
    """Why an estimate must not be used without a further look."""

    NONE = 1
    """It is not ambiguous."""
    LITTLE_AGREEMENT = 2
    """Too little of the smaller side agrees, or too much contradicts."""
    RUNNER_UP = 3
    """Another transform, which is not near the best one, is about as good."""
    FREE_DIRECTION = 4
    """Nothing holds the transform in some direction, as along a corridor."""


@dataclass(frozen=True, slots=True)
class TransformSide:
    """One of the two maps that are laid over each other.

    layer: an occupancy or semantic layer; empty for an estimate from pairs of points.
    frame_id: frame of which the transform is wanted; empty for the map's own.
    as_of, min_revision, consistency, incarnation: as in queries, see AsyncClient.
    """

    map: str
    layer: str = ""
    frame_id: str = ""
    as_of: AsOf = None
    min_revision: int = 0
    consistency: Consistency = Consistency.LOCAL
    incarnation: int = 0


@dataclass(frozen=True, slots=True)
class PointPair:
    """The same place on both sides, in metres in their frames.

    sigma_m: standard deviation of the distance between them along each axis, in metres, > 0.
    name: of the place, for errors.
    """

    source: PointLike
    target: PointLike
    sigma_m: float = 0.05
    name: str = ""


@dataclass(frozen=True, slots=True)
class ReadSide:
    """What was read of a map for an estimate.

    layer: empty for an estimate from pairs of points.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    map: str
    layer: str
    frame_id: str
    revision: int
    incarnation: int


@dataclass(frozen=True, slots=True)
class ScoredTransform:
    """A transform, and how well the two sides agree under it.

    target_from_source: maps coordinates of the source to coordinates of the target.
    score: what agrees less what contradicts, as a share of the smaller side; at most 1.
    """

    target_from_source: Pose
    score: float


@dataclass(frozen=True, slots=True)
class AgreeingPair:
    """A pair of points, or two objects, that agree with the transform.

    source, target: index of the pair, or ids of the objects.
    residual_m: distance between the target's place and that of the transformed source's, in metres.
    """

    source: int
    target: int
    residual_m: float


@dataclass(frozen=True, slots=True, eq=False)
class TransformEstimate:
    """The transform that lays the source over the target, and how far it can be trusted.

    best: the identity with score 0 if nothing agrees under any transform.
    covariance: of (x, y, yaw) of the best transform, array of shape (3, 3) in metres and radians;
        None if it is infinite, because nothing holds the yaw or nothing agrees.
    inlier_share: share, from 0 to 1, of what can be compared that agrees.
    runner_up: the best transform that is not near the best one; None if there is none.
    ambiguity: NONE, or the reason why the estimate must not be used without a further look.
    agreeing: pairs or objects that agree, sorted by `source`; empty for occupancy layers.
    """

    source: ReadSide
    target: ReadSide
    best: ScoredTransform
    covariance: NDArray[np.float64] | None
    inlier_share: float
    runner_up: ScoredTransform | None
    ambiguity: Ambiguity
    agreeing: tuple[AgreeingPair, ...] = ()

    @property
    def target_from_source(self) -> Pose:
        """The best transform. It maps coordinates of the source to coordinates of the target."""
        return self.best.target_from_source

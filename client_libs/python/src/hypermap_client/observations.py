"""What robots see, and what a server makes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import IntEnum

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from .geometry import Pose, points_of
from .objects import HeightRange


@dataclass(frozen=True, slots=True, eq=False)
class CellPatch:
    """A set of square cells on the plane.

    cells: N×2, row and column of each; rows count along the origin's y axis.
    resolution_m: the side of a cell, > 0.
    origin: pose of the lower left corner of cell (0, 0), in the observation's frame.
    """

    cells: NDArray[np.int64]
    resolution_m: float
    origin: Pose = field(default_factory=Pose)

    @classmethod
    def from_points(cls, points: ArrayLike, resolution_m: float) -> CellPatch:
        """The cells that points (N×2, metres, in the observation's frame) fall on."""
        cols_and_rows = np.floor(points_of(points) / resolution_m).astype(np.int64)
        return cls(np.unique(cols_and_rows[:, ::-1], axis=0), resolution_m)


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """One instance that the detector found, as points on the map.

    scores: how sure the detector is, in (0, 1], by label; at least one.
    hull: convex hull of the points, on the plane.
    cells: the cells of the plane that points fell on.
    height: of the points, above the plane.
    range_m: mean distance of the points from the camera.
    truncation: share in [0, 1] of the mask's border where the thing may go on unseen.
    weight: what the detection is worth as evidence of position and shape, in (0, 1].
    """

    scores: Mapping[str, float]
    hull: shapely.Polygon
    cells: CellPatch
    height: HeightRange
    num_points: int
    range_m: float
    truncation: float = 0.0
    weight: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class DepthView:
    """A frame's depth, thinned to every n-th pixel.

    Pixel (u, v) looks along ((u - cx) / fx, (v - cy) / fy, 1) in the camera's optical frame (x
    right, y down, z forward).

    depth_mm: rows×columns, the top row first: distance along the optical axis in millimetres, 0 =
        no return.
    owner: rows×columns: whose mask the pixel lies in: 0 = none, i + 1 = detections[i], 255 =
        several.
    """

    depth_mm: NDArray[np.uint16]
    owner: NDArray[np.uint8]
    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True, slots=True, eq=False)
class SensorPose:
    """Where the camera was; the third axis of the observation's frame points up from the plane.

    rotation: 3×3, from the camera's optical frame to the observation's.
    translation: 3, metres.
    covariance: of (x, y, yaw), 3×3, metres and radians; None: exact.
    """

    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]
    covariance: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """What a robot saw in one frame.

    robot, sequence: who saw it, and a number that this robot gives to no other frame of the layer;
        together they name the observation, which counts once, however often it is sent.
    stamp: when it was seen, by the robot's clock.
    frame_id: the frame of all coordinates; empty: the map's own.
    view_hull: convex hull of all that was seen, on the plane; None: empty.
    free_space: what was seen to be free of obstacles, on the plane; None: empty.
    """

    robot: str
    sequence: int
    stamp: datetime
    pose: SensorPose
    detections: tuple[Detection, ...] = ()
    frame_id: str = ""
    view_hull: shapely.Polygon | None = None
    free_space: shapely.Polygon | None = None
    depth: DepthView | None = None


@dataclass(frozen=True, slots=True)
class OpenedLayer:
    """How a layer is fused.

    known: the sequences of the stream's robot that the layer has and that need not be sent again,
        ascending, as ranges without their ends.
    """

    strategy: str
    parameters: str
    exploration_layer: str
    known: tuple[range, ...]

    def knows(self, sequence: int) -> bool:
        """Whether the layer has this sequence of the stream's robot."""
        return any(sequence in sequences for sequences in self.known)


class ObservationOutcome(IntEnum):
    """What became of an observation. Only ACCEPTED changes anything."""

    ACCEPTED = 1
    """On disk, fused and visible from the revision that is told."""
    DUPLICATE = 2
    """The layer has it already, with this content."""
    REFUSED_LATE = 3
    """Too far behind the layer's newest."""
    INVALID = 4
    """No valid observation; the message names the field."""
    CONFLICT = 5
    """The layer has another one with this robot and sequence."""


@dataclass(frozen=True, slots=True)
class Acknowledgement:
    """What became of an observation, and why it was not accepted."""

    robot: str
    sequence: int
    outcome: ObservationOutcome
    revision: int
    message: str = ""


class ObjectEventKind(IntEnum):
    """How an object came to be as it is."""

    FOUNDED = 1
    """A detection founded it."""
    SEEN = 2
    """A detection was taken for it."""
    MISSED = 3
    """It should have been seen, and was not."""
    MERGED = 4
    """Another thing became part of it."""
    PINNED = 5
    """An operator put it."""
    REMOVED = 6
    """An operator removed it."""


@dataclass(frozen=True, slots=True)
class ObjectEvent:
    """One thing that happened to an object of a fused layer.

    robot, sequence, stamp: the observation; for what an operator did, the newest one at that time
        (no robot: none).
    detection, score: of FOUNDED and SEEN: its index, and its agreement with the object in [0, 1].
    existence: the probability that it exists, afterwards; None when the strategy does not tell.
    track: of MERGED: what became part of it.
    """

    kind: ObjectEventKind
    robot: str
    sequence: int
    stamp: datetime
    detection: int
    score: float
    existence: float | None
    track: str


@dataclass(frozen=True, slots=True)
class ObjectHistory:
    """Which observations made an object, in their order."""

    map: str
    revision: int
    object_id: int
    strategy: str
    parameters: str
    track: str
    events: tuple[ObjectEvent, ...]

"""Observations of robots, their acknowledgements, and the history of fused objects."""

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
    """A set of square cells on the ground plane.

    cells: array of shape (N, 2) with row and column of each cell. Rows count along the y axis of
        the origin and columns along its x axis.
    resolution_m: length of the side of a cell in metres, > 0.
    origin: pose of the lower left corner of cell (0, 0), in the observation's frame.
    """

    cells: NDArray[np.int64]
    resolution_m: float
    origin: Pose = field(default_factory=Pose)

    @classmethod
    def from_points(cls, points: ArrayLike, resolution_m: float) -> CellPatch:
        """The cells that contain points (shape (N, 2), metres, in the observation's frame).

        Raises ValueError for points of another shape.
        """
        cols_and_rows = np.floor(points_of(points) / resolution_m).astype(np.int64)
        return cls(np.unique(cols_and_rows[:, ::-1], axis=0), resolution_m)


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """One instance found by the detector, with its depth points projected to the ground plane.

    scores: confidences of the detector in (0, 1], by label; at least one.
    hull: convex hull of the points on the plane.
    cells: cells of the plane that contain points.
    height: range of heights of the points above the plane.
    num_points: number of points.
    range_m: mean distance of the points from the camera in metres.
    truncation: fraction in [0, 1] of the mask's border beyond which the object may continue
        unseen, at the border of the image or behind something nearer.
    weight: weight of the detection as evidence of position and shape, in (0, 1].
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
    """A depth image, subsampled to every n-th pixel.

    The ray of pixel (u, v) has the direction ((u - cx) / fx, (v - cy) / fy, 1) in the camera's
    optical frame (x right, y down, z forward).

    depth_mm: array of shape (rows, columns) with the top row first: distance along the optical axis
        in millimetres, 0 for no return.
    owner: array of the same shape: the detection whose mask contains the pixel, as 0 for none,
        i + 1 for detections[i], 255 for several.
    fx, fy, cx, cy: focal lengths and principal point of the subsampled image, in its pixels.
    """

    depth_mm: NDArray[np.uint16]
    owner: NDArray[np.uint8]
    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True, slots=True, eq=False)
class SensorPose:
    """Pose of the camera in the observation's frame, whose z axis points up from the plane.

    rotation: matrix of shape (3, 3) from the camera's optical frame to the observation's frame,
        orthonormal to 1e-6.
    translation: position of the camera, shape (3,), in metres.
    covariance: covariance of (x, y, yaw), shape (3, 3), in metres and radians; None for an exact
        pose.
    """

    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]
    covariance: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class CorrectedPose:
    """Where a robot's camera was at a time, as it was found out later.

    stamp: time by the robot's clock; needs a time zone.
    pose: position of the point below the camera, and direction of its optical axis on the plane; of
        the upper edge of its image if it looks straight up or down.
    covariance: covariance of (x, y, yaw), shape (3, 3), in metres and radians; None for an exact
        pose.
    """

    stamp: datetime
    pose: Pose
    covariance: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True)
class Smoothing:
    """What smoothing has done to the poses of a layer's observations.

    revision: shows the new poses; the newest one if nothing was moved.
    matched: number of the observations whose surfaces were looked at.
    moved: number of the observations that are shown elsewhere now.
    rms_shift_m: of those, the root mean square distance between the poses that robots told and the
        new ones, in metres.
    occupancy_layer: the grid whose walls were used; empty if none was.
    """

    revision: int
    matched: int
    moved: int
    rms_shift_m: float
    occupancy_layer: str


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """The detections and the free space of one camera frame of a robot.

    robot, sequence: the robot, and a number that it uses for no other frame of the layer. Together
        they identify the observation; the server counts it once, however often it is sent.
    stamp: time of the camera frame by the robot's clock; needs a time zone.
    pose: pose of the camera.
    frame_id: frame of all coordinates; empty for the map's own.
    view_hull: convex hull of the visible area on the plane; None for an empty area.
    free_space: area of the plane that was seen to be free of obstacles; None for an empty area.
    depth: None if depth is not sent.
    frame_from_view: None if all coordinates are in frame_id. Otherwise pose, view_hull, free_space,
        and hulls and origins of cells in detections are in the frame of the view, and this is its
        pose in frame_id. Its origin is on the plane below the camera, its x axis the horizontal
        part of the optical axis. Such observations are corrected exactly (Client.correct_poses).
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
    frame_from_view: Pose | None = None


@dataclass(frozen=True, slots=True)
class OpenedLayer:
    """The configuration of a fused layer, as the server reports it when a stream opens.

    strategy: name of the fusion strategy.
    parameters: parameters of the strategy as a JSON object.
    exploration_layer: layer on which free space is marked as explored; empty for none.
    known: sequences of the stream's robot that the layer has, as ascending half-open ranges. They
        need not be sent again.
    incarnation: the incarnation of the map to which the acknowledged revisions belong, see
        MapEntry.
    """

    strategy: str
    parameters: str
    exploration_layer: str
    known: tuple[range, ...]
    incarnation: int = 0

    def knows(self, sequence: int) -> bool:
        """Whether the layer has the observation of the stream's robot with this sequence."""
        return any(sequence in sequences for sequences in self.known)


class ObservationOutcome(IntEnum):
    """The server's decision about an observation. Only ACCEPTED changes the map."""

    ACCEPTED = 1
    """The observation is on disk, fused, and visible from the acknowledged revision on."""
    DUPLICATE = 2
    """The layer has the same observation already."""
    REFUSED_LATE = 3
    """The stamp is more than the server's --max_lateness older than the robot's newest one."""
    INVALID = 4
    """A field of the observation is invalid; the message names it."""
    CONFLICT = 5
    """The layer has a different observation with the same robot and sequence."""


@dataclass(frozen=True, slots=True)
class Acknowledgement:
    """The server's acknowledgement of an observation.

    revision: the revision that contains the observation, or the newest one if it was not accepted.
    message: the reason why it was not accepted, else empty.
    clock_skew_s: estimate of the seconds by which the robot's clock is ahead of the server's; None
        for an observation that is not valid, or that was sent before.
    """

    robot: str
    sequence: int
    outcome: ObservationOutcome
    revision: int
    message: str = ""
    clock_skew_s: float | None = None


class ObjectEventKind(IntEnum):
    """The kind of an event in the history of a fused object."""

    FOUNDED = 1
    """A detection created the object."""
    SEEN = 2
    """A detection was associated with the object."""
    MISSED = 3
    """The object was in view, but was not detected."""
    MERGED = 4
    """Another object was merged into it."""
    PINNED = 5
    """An operator added or replaced the object."""
    REMOVED = 6
    """An operator removed the object."""


@dataclass(frozen=True, slots=True)
class ObjectEvent:
    """An event in the history of an object of a fused layer.

    robot, sequence, stamp: the observation that caused the event. For PINNED and REMOVED it is the
        newest observation at the time of the edit; the robot is empty if there was none.
    detection: index of the detection in its observation, for FOUNDED and SEEN.
    score: agreement of the detection with the object in [0, 1], for FOUNDED and SEEN.
    existence: probability in [0, 1] that the object exists after the event; None if the strategy
        does not estimate it.
    track: the track that was merged into the object, for MERGED.
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
    """The events that made an object of a fused layer, in the order of the observations.

    revision: the newest revision when the server started to compute the history.
    strategy, parameters: fusion strategy of the layer, and its parameters as a JSON object.
    track: identifier of the object within fusion.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    forgotten_until: observations up to this stamp are no longer kept by the server
        (--observation_age), so that events does not contain theirs. None if all are kept.
    """

    map: str
    revision: int
    object_id: int
    strategy: str
    parameters: str
    track: str
    events: tuple[ObjectEvent, ...]
    incarnation: int = 0
    forgotten_until: datetime | None = None

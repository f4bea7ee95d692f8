"""Poses over time, and the tree of frames that ROS's topics /tf and /tf_static describe."""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .problems import BagError, SkippedFrameError

FloatArray = npt.NDArray[np.float64]

# A quaternion's length may differ from 1 by this much, because it was rounded.
MAX_LENGTH_ERROR = 0.01
# For this long before the first sample and after the last one, that sample counts.
MAX_BEYOND_NS = 20_000_000


@dataclass(frozen=True)
class Pose:
    """A rigid transform: `a_from_b` has b's origin, in metres, and orientation in frame a.

    `rotation` is a quaternion (x, y, z, w) of length 1.
    """

    translation: FloatArray
    rotation: FloatArray

    def __matmul__(self, other: Pose) -> Pose:
        """Composes two transforms: a_from_c = a_from_b @ b_from_c."""
        return Pose(
            self.translation + rotate(self.rotation, other.translation),
            _multiply(self.rotation, other.rotation),
        )

    def inverse(self) -> Pose:
        """The transform in the other direction."""
        rotation = self.rotation * np.array([-1.0, -1.0, -1.0, 1.0])
        return Pose(-rotate(rotation, self.translation), rotation)


IDENTITY = Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def make_pose(translation: Sequence[float], rotation: Sequence[float]) -> Pose | None:
    """The pose of (x, y, z) in metres and (qx, qy, qz, qw).

    None if a number is not finite, or the quaternion's length is not 1; it may be rounded.
    """
    numbers = np.array([*translation, *rotation], float)
    length = float(np.linalg.norm(numbers[3:]))
    if not np.isfinite(numbers).all() or abs(length - 1.0) > MAX_LENGTH_ERROR:
        return None
    return Pose(numbers[:3], numbers[3:] / length)


def decode_pose(translation: Any, rotation: Any) -> Pose | None:
    """Converts a Point or Vector3 and a Quaternion of geometry_msgs, as `make_pose`."""
    return make_pose(
        (translation.x, translation.y, translation.z),
        (rotation.x, rotation.y, rotation.z, rotation.w),
    )


def rotate(rotation: FloatArray, vector: FloatArray) -> FloatArray:
    """Rotates a vector by a quaternion."""
    axis, w = rotation[:3], rotation[3]
    twice: FloatArray = 2.0 * np.cross(axis, vector)
    turned: FloatArray = vector + w * twice + np.cross(axis, twice)
    return turned


def _multiply(p: FloatArray, q: FloatArray) -> FloatArray:
    """The product of two quaternions."""
    axis = p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3])
    return np.append(axis, p[3] * q[3] - np.dot(p[:3], q[:3]))


def slerp(p: FloatArray, q: FloatArray, share: float) -> FloatArray:
    """Interpolates between two quaternions, the shorter way round (Shoemake 1985)."""
    cosine = float(np.dot(p, q))
    if cosine < 0.0:
        q, cosine = -q, -cosine
    angle = math.acos(min(cosine, 1.0))
    if angle < 1e-9:
        return p
    weights = math.sin((1.0 - share) * angle), math.sin(share * angle)
    turned: FloatArray = (weights[0] * p + weights[1] * q) / math.sin(angle)
    return turned


@dataclass(frozen=True)
class Sample:
    """A pose, and the covariance of its (x, y, yaw) in metres and radians, if it is known."""

    pose: Pose
    covariance: FloatArray | None = None


class Track:
    """A pose over time. Samples may be added in any order; each takes 64 bytes, or 136.

    Either all samples of a track have a covariance or none.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._stamps = array("q")
        # For each sample the translation, the rotation and the covariance, if there is one.
        self._numbers = array("d")
        self._sorted: tuple[npt.NDArray[np.int64], FloatArray] | None = None

    def add(self, stamp_ns: int, sample: Sample) -> None:
        """Adds a sample. It replaces one with the same stamp."""
        self._stamps.append(stamp_ns)
        self._numbers.extend(sample.pose.translation)
        self._numbers.extend(sample.pose.rotation)
        if sample.covariance is not None:
            self._numbers.extend(sample.covariance.ravel())
        self._sorted = None

    def at(self, stamp_ns: int, max_gap_ns: int) -> Sample:
        """The pose at a time: translation linear, rotation by slerp, covariance linear.

        Raises SkippedFrameError if the time is before the first or after the last sample by more
        than `MAX_BEYOND_NS`, or between two that are more than `max_gap_ns` apart.
        """
        self._sorted = self._sorted or self._sort()
        stamps, rows = self._sorted
        after = int(np.searchsorted(stamps, stamp_ns))
        if after < len(stamps) and stamps[after] == stamp_ns:
            return _sample(rows[after])
        if after in (0, len(stamps)):
            nearest = 0 if after == 0 else -1
            if not len(stamps) or abs(stamps[nearest] - stamp_ns) > MAX_BEYOND_NS:
                raise SkippedFrameError(f"outside of the time of {self._name}")
            return _sample(rows[nearest])
        begin, end = stamps[after - 1], stamps[after]
        if end - begin > max_gap_ns:
            raise SkippedFrameError(f"gap in {self._name}")
        share = float((stamp_ns - begin) / (end - begin))
        row = rows[after - 1] + share * (rows[after] - rows[after - 1])
        row[3:7] = slerp(rows[after - 1][3:7], rows[after][3:7], share)
        return _sample(row)

    def _sort(self) -> tuple[npt.NDArray[np.int64], FloatArray]:
        """The samples in the order of their stamps, the last one of each stamp."""
        stamps = np.array(self._stamps)
        rows = np.array(self._numbers).reshape(len(stamps), -1) if len(stamps) else np.empty((0, 7))
        order = np.argsort(stamps, kind="stable")
        is_last = np.diff(stamps[order], append=np.iinfo(np.int64).max) != 0
        return stamps[order][is_last], rows[order][is_last]


def _sample(row: FloatArray) -> Sample:
    covariance = row[7:].reshape(3, 3) if len(row) > 7 else None
    return Sample(Pose(row[:3], row[3:7]), covariance)


class FrameTree:
    """The frames that /tf and /tf_static place, each in its parent."""

    def __init__(self, max_gap_ns: int) -> None:
        self._max_gap_ns = max_gap_ns
        self._parents: dict[str, str] = {}
        self._static: dict[str, Sample] = {}
        self._moving: dict[str, Track] = {}
        self.invalid = 0
        """Number of transforms that were left out because they are no rigid transforms."""

    def add(self, message: Any, stamp_ns: int, *, static: bool) -> None:
        """Adds a TransformStamped. Raises BagError if its frame has another parent already."""
        # ROS 1 wrote names with a leading slash.
        parent = message.header.frame_id.lstrip("/")
        child = message.child_frame_id.lstrip("/")
        pose = decode_pose(message.transform.translation, message.transform.rotation)
        if pose is None:
            self.invalid += 1
            return
        if (known := self._parents.setdefault(child, parent)) != parent:
            raise BagError(f"frame {child} has two parents, {known} and {parent}")
        if static:
            self._static[child] = Sample(pose)
        else:
            track = self._moving.setdefault(child, Track(f"the transform {parent} to {child}"))
            track.add(stamp_ns, Sample(pose))

    def at(self, target: str, source: str, stamp_ns: int) -> Pose:
        """The pose `target_from_source` at a time.

        Raises BagError if the frames are never connected, and SkippedFrameError if they are not at
        this time.
        """
        top, top_from_source = self._climb(source, target, stamp_ns)
        if top == target:
            return top_from_source
        other, other_from_target = self._climb(target, top, stamp_ns)
        if other != top:
            names = sorted({*self._parents, *self._parents.values()})
            raise BagError(
                f"no transform from {target} to {source}; the bag has the frames "
                f"{', '.join(names) or '(none)'}"
            )
        return other_from_target.inverse() @ top_from_source

    def _climb(self, frame: str, end: str, stamp_ns: int) -> tuple[str, Pose]:
        """Goes from a frame to its parents up to `end` or the root.

        Returns the last frame and its pose `last_from_frame`.
        """
        pose, visited = IDENTITY, {frame}
        while frame != end and frame in self._parents:
            pose = self._in_parent(frame, stamp_ns) @ pose
            frame = self._parents[frame]
            if frame in visited:
                raise BagError(f"the transforms to frame {frame} are a circle")
            visited.add(frame)
        return frame, pose

    def _in_parent(self, frame: str, stamp_ns: int) -> Pose:
        if frame in self._static:
            return self._static[frame].pose
        return self._moving[frame].at(stamp_ns, self._max_gap_ns).pose

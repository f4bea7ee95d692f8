"""Makes frames for the FrameService of what a bag contains."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from .._proto import frame_service_pb2 as pb
from .images import decode_camera, encode_depth
from .instances import InstanceReader
from .problems import BagError, SkippedFrameError
from .recording import Recording, stamp_ns
from .summary import Summary
from .synchronizer import Synchronizer
from .transforms import FloatArray, FrameTree, Pose, Sample, Track, decode_pose, rotate

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED_IMAGE = "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
POSE = "geometry_msgs/msg/PoseStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"

# The places of (x, y, yaw) in a covariance of (x, y, z, roll, pitch, yaw).
PLANAR = np.ix_([0, 1, 5], [0, 1, 5])


@dataclass(frozen=True)
class Topics:
    """Names of the topics of depth images, their camera, and detections or label images."""

    depth: str
    camera_info: str
    instances: str


class PoseSource(Protocol):
    """Poses of the camera in the frame of the map, read from some topics of the bag."""

    topics: tuple[str, ...]

    def check(self, recording: Recording) -> None:
        """Raises BagError if the recording lacks a topic, or one is of another type."""
        ...

    def add(self, topic: str, message: Any) -> None:
        """Takes a message of one of `topics`."""
        ...

    def at(self, stamp_ns: int, camera_frame: str) -> Sample:
        """The pose of the camera's optical frame; raises SkippedFrameError if it is not known."""
        ...

    def invalid(self) -> int:
        """Number of poses that were left out because they are no rigid transforms."""
        ...


class TransformPoses:
    """Poses of the camera by /tf and /tf_static."""

    def __init__(
        self, moving: str, static: str, map_frame: str, camera_frame: str, max_gap_ns: int
    ) -> None:
        self.topics: tuple[str, ...] = (moving, static)
        self._map_frame = map_frame
        self._camera_frame = camera_frame
        self._tree = FrameTree(max_gap_ns)

    def check(self, recording: Recording) -> None:
        """Raises BagError if both topics are missing, or one is of another type."""
        present = [topic for topic in self.topics if recording.has(topic)]
        for topic in present or self.topics[:1]:
            recording.check_topic(topic, TRANSFORMS)

    def add(self, topic: str, message: Any) -> None:
        """Takes a message of one of `topics`."""
        for transform in message.transforms:
            self._tree.add(transform, stamp_ns(transform), static=topic == self.topics[1])

    def at(self, stamp_ns: int, camera_frame: str) -> Sample:
        """The pose of the camera; the frame of the options counts, if they name one."""
        frame = self._camera_frame or camera_frame.lstrip("/")
        return Sample(self._tree.at(self._map_frame, frame, stamp_ns))

    def invalid(self) -> int:
        """Number of transforms that were left out."""
        return self._tree.invalid


class TopicPoses:
    """Poses of the camera by a topic with poses of the robot, on which it is mounted."""

    def __init__(self, topic: str, mount: Pose, map_frame: str, max_gap_ns: int) -> None:
        self.topics: tuple[str, ...] = (topic,)
        self._mount = mount
        self._map_frame = map_frame
        self._max_gap_ns = max_gap_ns
        self._track = Track(f"the poses of {topic}")
        self._invalid = 0

    def check(self, recording: Recording) -> None:
        """Raises BagError if the topic is missing or of another type."""
        recording.check_topic(self.topics[0], (POSE, POSE_WITH_COVARIANCE))

    def add(self, topic: str, message: Any) -> None:
        """Takes a PoseStamped or PoseWithCovarianceStamped."""
        frame = message.header.frame_id.lstrip("/")
        if frame not in ("", self._map_frame):
            raise BagError(f"{topic} has poses in frame {frame}, not {self._map_frame}")
        covariance = None
        pose = message.pose
        if hasattr(pose, "covariance"):
            covariance = np.asarray(pose.covariance, float).reshape(6, 6)[PLANAR]
            pose = pose.pose
        robot = decode_pose(pose.position, pose.orientation)
        if robot is None:
            self._invalid += 1
        else:
            self._track.add(stamp_ns(message), Sample(robot, covariance))

    def at(self, stamp_ns: int, camera_frame: str) -> Sample:
        """The pose of the camera, whatever its frame is called."""
        robot = self._track.at(stamp_ns, self._max_gap_ns)
        camera = robot.pose @ self._mount
        if robot.covariance is None:
            return Sample(camera)
        return Sample(camera, _moved(robot.covariance, robot.pose, self._mount))

    def invalid(self) -> int:
        """Number of poses that were left out."""
        return self._invalid


def _moved(covariance: FloatArray, robot: Pose, mount: Pose) -> FloatArray:
    """The covariance of a camera's (x, y, yaw), given that of the robot that carries it."""
    dx, dy, _ = rotate(robot.rotation, mount.translation)
    jacobian = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
    moved: FloatArray = jacobian @ covariance @ jacobian.T
    return moved


class FrameReader:
    """Reads the frames of a recording: once the camera and all poses, then the images."""

    def __init__(
        self,
        recording: Recording,
        topics: Topics,
        poses: PoseSource,
        instances: InstanceReader,
        *,
        pose_covariance: FloatArray,
        rectified: bool,
    ) -> None:
        """Reads the camera and the poses.

        pose_covariance: covariance of (x, y, yaw) of poses that have none of their own.

        Raises BagError if a topic is missing or of another type.
        """
        recording.check_topic(topics.depth, (IMAGE, COMPRESSED_IMAGE))
        recording.check_topic(topics.camera_info, (CAMERA_INFO,))
        recording.check_topic(topics.instances, instances.types)
        poses.check(recording)
        self._recording = recording
        self._topics = topics
        self._poses = poses
        self._instances = instances
        self._pose_covariance = pose_covariance
        self.camera = self._read_camera_and_poses(rectified)

    def _read_camera_and_poses(self, rectified: bool) -> pb.CameraModel:
        camera = None
        for topic, message in self._recording.messages(
            (self._topics.camera_info, *self._poses.topics)
        ):
            if topic != self._topics.camera_info:
                self._poses.add(topic, message)
                continue
            found = decode_camera(message, topic, rectified=rectified)
            if camera is not None and camera != found:
                raise BagError(f"the camera of {topic} changes; a stream of frames has one camera")
            camera = found
        if camera is None:
            raise BagError(f"topic {self._topics.camera_info} has no message")
        return camera

    def frames(
        self, synchronizer: Synchronizer, is_known: Callable[[int], bool], summary: Summary
    ) -> Iterator[pb.RobotFrame]:
        """Yields the frames in the order in which their images were paired.

        is_known: tells sequences that need not be sent.
        summary: counts what is known or cannot be used.

        Raises BagError if the recording cannot be read, or the frames of the camera and the map are
        not connected.
        """
        sources = (self._topics.depth, self._topics.instances)
        for topic, message in self._recording.messages(sources):
            index = sources.index(topic)
            summary.frames += index == 0
            pair = synchronizer.add(index, stamp_ns(message), message)
            if pair is None:
                continue
            if is_known(stamp_ns(pair[0])):
                summary.known += 1
                continue
            try:
                yield self._frame(*pair, summary)
            except SkippedFrameError as reason:
                summary.skipped_frames[str(reason)] += 1
        summary.skipped_frames["no detections within the slop"] += synchronizer.unpaired(0)
        summary.skipped_input["detections without a depth image"] += synchronizer.unpaired(1)
        summary.skipped_input["invalid pose"] += self._poses.invalid()

    def _frame(self, depth: Any, instances: Any, summary: Summary) -> pb.RobotFrame:
        stamp = stamp_ns(depth)
        # The stamp is a sequence that no other frame of the robot has, in any of its bags.
        frame = pb.RobotFrame(sequence=stamp)
        frame.stamp.FromNanoseconds(stamp)
        sample = self._poses.at(stamp, depth.header.frame_id)
        _encode_pose(sample, self._pose_covariance, frame.pose)
        encode_depth(depth, self.camera, frame)
        frame.instances.extend(
            self._instances.read(instances, self.camera, summary.skipped_instances)
        )
        summary.instances += len(frame.instances)
        return frame


def _encode_pose(sample: Sample, covariance: FloatArray, message: pb.CameraPose) -> None:
    message.x, message.y, message.z = sample.pose.translation.tolist()
    message.qx, message.qy, message.qz, message.qw = sample.pose.rotation.tolist()
    known = covariance if sample.covariance is None else sample.covariance
    message.covariance.extend(known.ravel().tolist())

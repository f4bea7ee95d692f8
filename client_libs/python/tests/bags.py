"""Writes small bags of each format with the rosbags package."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from hypermap_client.bag.recording import default_types

FORMATS = ("mcap", "sqlite3", "ros1")

# Messages of Noetic that rosbags does not know. Those of vision_msgs lack the images.
TYPES_OF_ROS1 = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "vision_msgs/msg/BoundingBox2D": (
        "geometry_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y"
    ),
    "vision_msgs/msg/ObjectHypothesisWithPose": (
        "int64 id\nfloat64 score\ngeometry_msgs/PoseWithCovariance pose"
    ),
    "vision_msgs/msg/Detection2D": (
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
        "vision_msgs/BoundingBox2D bbox"
    ),
    "vision_msgs/msg/Detection2DArray": (
        "std_msgs/Header header\nvision_msgs/Detection2D[] detections"
    ),
}


class BagWriter:
    """Writes a new bag. Use it in a `with` block. Stamps are in nanoseconds."""

    def __init__(self, path: pathlib.Path, kind: str) -> None:
        self.path = path.with_suffix(".bag") if kind == "ros1" else path
        self._ros1 = kind == "ros1"
        self._connections: dict[str, Any] = {}
        self._stamp = 0
        if self._ros1:
            self._types = get_typestore(Stores.ROS1_NOETIC)
            for name, text in TYPES_OF_ROS1.items():
                self._types.register(get_types_from_msg(text, name))
            self._writer: Any = Writer1(self.path)
        else:
            self._types = default_types()
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            self._writer = Writer2(self.path, version=9, storage_plugin=plugin)

    def __enter__(self) -> BagWriter:
        self._writer.open()
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def message(self, kind: str, **fields: Any) -> Any:
        """A message of a type such as `sensor_msgs/msg/Image`; fields of ROS 1 may be missing."""
        return self._types.types[kind](**fields)

    def header(self, stamp: int, frame: str) -> Any:
        time = self.message(
            "builtin_interfaces/msg/Time", sec=stamp // 10**9, nanosec=stamp % 10**9
        )
        extra = {"seq": 0} if self._ros1 else {}
        return self.message("std_msgs/msg/Header", stamp=time, frame_id=frame, **extra)

    def write(self, topic: str, message: Any, stamp: int) -> None:
        kind = message.__msgtype__
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=self._types
            )
        serialize = self._types.serialize_ros1 if self._ros1 else self._types.serialize_cdr
        self._writer.write(self._connections[topic], stamp, serialize(message, kind))

    def image(
        self, topic: str, stamp: int, array: np.ndarray, encoding: str, frame: str = "optical"
    ) -> None:
        data = np.ascontiguousarray(array)
        message = self.message(
            "sensor_msgs/msg/Image",
            header=self.header(stamp, frame),
            height=data.shape[0],
            width=data.shape[1],
            encoding=encoding,
            is_bigendian=0,
            step=data.strides[0],
            data=data.view(np.uint8).ravel(),
        )
        self.write(topic, message, stamp)

    def compressed_depth(self, topic: str, stamp: int, png: bytes, form: str) -> None:
        data = np.frombuffer(bytes(12) + png, np.uint8)
        message = self.message(
            "sensor_msgs/msg/CompressedImage",
            header=self.header(stamp, "optical"),
            format=form,
            data=data,
        )
        self.write(topic, message, stamp)

    def camera_info(
        self,
        topic: str,
        stamp: int,
        *,
        size: tuple[int, int],
        focal: float,
        model: str = "plumb_bob",
        distortion: tuple[float, ...] = (0, 0, 0, 0, 0),
    ) -> None:
        """A camera whose principal point is the centre of the image."""
        width, height = size
        cx, cy = (width - 1) / 2, (height - 1) / 2
        matrices = {
            "d": np.array(distortion, float),
            "k": np.array([focal, 0, cx, 0, focal, cy, 0, 0, 1], float),
            "r": np.eye(3).ravel(),
            "p": np.array([focal, 0, cx, 0, 0, focal, cy, 0, 0, 0, 1, 0], float),
        }
        if self._ros1:
            matrices = {name.upper(): matrix for name, matrix in matrices.items()}
        region = self.message(
            "sensor_msgs/msg/RegionOfInterest",
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False,
        )  # fmt: skip
        message = self.message(
            "sensor_msgs/msg/CameraInfo",
            header=self.header(stamp, "optical"),
            height=height,
            width=width,
            distortion_model=model,
            binning_x=0,
            binning_y=0,
            roi=region,
            **matrices,
        )
        self.write(topic, message, stamp)

    def vector(self, kind: str, numbers: Any) -> Any:
        x, y, z = map(float, numbers)
        return self.message(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)

    def quaternion(self, numbers: Any) -> Any:
        x, y, z, w = map(float, numbers)
        return self.message("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def pose(self, numbers: Any) -> Any:
        """A Pose of x, y, z, qx, qy, qz, qw."""
        return self.message(
            "geometry_msgs/msg/Pose",
            position=self.vector("Point", numbers[:3]),
            orientation=self.quaternion(numbers[3:]),
        )

    def transform(
        self, stamp: int, parent: str, child: str, numbers: Any, topic: str = "/tf"
    ) -> None:
        """A TFMessage with one transform; numbers are x, y, z, qx, qy, qz, qw."""
        transform = self.message(
            "geometry_msgs/msg/Transform",
            translation=self.vector("Vector3", numbers[:3]),
            rotation=self.quaternion(numbers[3:]),
        )
        stamped = self.message(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(stamp, parent),
            child_frame_id=child,
            transform=transform,
        )
        self.write(topic, self.message("tf2_msgs/msg/TFMessage", transforms=[stamped]), stamp)

    def pose_stamped(
        self, topic: str, stamp: int, numbers: Any, covariance: Any = None, frame: str = "map"
    ) -> None:
        """A PoseStamped, or a PoseWithCovarianceStamped if there is a covariance of 6×6."""
        kind, pose = "PoseStamped", self.pose(numbers)
        if covariance is not None:
            kind = "PoseWithCovarianceStamped"
            pose = self.message(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=pose,
                covariance=np.asarray(covariance, float).ravel(),
            )
        message = self.message(
            f"geometry_msgs/msg/{kind}", header=self.header(stamp, frame), pose=pose
        )
        self.write(topic, message, stamp)

    def detections(self, topic: str, stamp: int, boxes: list[dict[str, Any]]) -> None:
        """A Detection2DArray of boxes {class_id, score, x, y, width, height}, in pixels."""
        message = self.message(
            "vision_msgs/msg/Detection2DArray",
            header=self.header(stamp, "optical"),
            detections=[self._detection(stamp, box) for box in boxes],
        )
        self.write(topic, message, stamp)

    def _detection(self, stamp: int, box: dict[str, Any]) -> Any:
        anywhere = self.message(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=self.pose([0, 0, 0, 0, 0, 0, 1]),
            covariance=np.zeros(36),
        )
        x, y, theta = float(box["x"]), float(box["y"]), float(box.get("theta", 0))
        if self._ros1:
            named = {"id": box["class_id"], "score": box["score"]}
            centre = self.message("geometry_msgs/msg/Pose2D", x=x, y=y, theta=theta)
        else:
            hypothesis = self.message(
                "vision_msgs/msg/ObjectHypothesis",
                class_id=str(box["class_id"]),
                score=box["score"],
            )
            named = {"hypothesis": hypothesis}
            position = self.message("vision_msgs/msg/Point2D", x=x, y=y)
            centre = self.message("vision_msgs/msg/Pose2D", position=position, theta=theta)
        result = self.message("vision_msgs/msg/ObjectHypothesisWithPose", pose=anywhere, **named)
        bounds = self.message(
            "vision_msgs/msg/BoundingBox2D",
            center=centre,
            size_x=float(box["width"]),
            size_y=float(box["height"]),
        )
        extra = {} if self._ros1 else {"id": ""}
        return self.message(
            "vision_msgs/msg/Detection2D",
            header=self.header(stamp, "optical"),
            results=[result],
            bbox=bounds,
            **extra,
        )

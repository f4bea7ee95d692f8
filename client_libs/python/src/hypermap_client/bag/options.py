"""The command line of `hypermap-bag`."""

from __future__ import annotations

import argparse
import math
import pathlib
from collections.abc import Callable, Iterator, Sequence
from typing import NoReturn

from .. import __version__
from .transforms import Pose, make_pose

EXIT_USAGE = 2  # The command line is invalid.

# As for `hypermap-ingest replay`: the error of a localisation like AMCL's in an office.
LOCALISATION_SIGMA = "0.06,0.06,0.016"
MAX_SIGMA = 1000.0


class Parser(argparse.ArgumentParser):
    """A parser that tells errors in one line, as the other programs do."""

    def error(self, message: str) -> NoReturn:
        """Ends the program."""
        self.exit(EXIT_USAGE, f"{self.prog}: {message} (see {self.prog} --help)\n")


def parse_arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Reads the command line. Ends the program if it is invalid."""
    parser = Parser(
        prog="hypermap-bag",
        allow_abbrev=False,
        description="Sends RGB-D frames with detections from ROS bags to `hypermap-ingest serve`.",
    )
    parser.add_argument("--version", action="version", version=f"hypermap-bag {__version__}")
    parser.add_argument(
        "bags",
        nargs="+",
        type=pathlib.Path,
        metavar="BAG",
        help="ROS 1 bags, or folders of rosbag2 (SQLite3 or MCAP), in the order of time",
    )
    add_topic_options(parser)
    add_pose_options(parser)
    add_output_options(parser)
    options = parser.parse_args(arguments)
    if options.masks and not options.labels:
        parser.error("--masks needs --labels")
    if options.pose and options.mount is None:
        parser.error("--pose needs --mount")
    if options.mount is not None and not options.pose:
        parser.error("--mount needs --pose")
    return options


def add_topic_options(parser: argparse.ArgumentParser) -> None:
    """Options for images and detections."""
    group = parser.add_argument_group("images and detections")
    add = group.add_argument
    add(
        "--depth",
        required=True,
        metavar="TOPIC",
        help="sensor_msgs/Image, 16UC1 in millimetres or 32FC1 in metres, or CompressedImage of "
        "16UC1 (compressedDepth)",
    )
    add(
        "--camera-info",
        required=True,
        metavar="TOPIC",
        help="sensor_msgs/CameraInfo of the depth images",
    )
    add(
        "--rectified",
        action="store_true",
        help="the images are rectified: use matrix P and no distortion",
    )
    kinds = group.add_mutually_exclusive_group(required=True)
    kinds.add_argument(
        "--detections",
        metavar="TOPIC",
        help="vision_msgs/Detection2DArray, boxes in the depth image",
    )
    kinds.add_argument(
        "--masks",
        metavar="TOPIC",
        help="sensor_msgs/Image with a number for each pixel of the depth image: mono8, 8UC1, "
        "mono16, 16UC1 or 32SC1",
    )
    add(
        "--labels",
        type=pathlib.Path,
        metavar="FILE",
        help="YAML file with the label of each number or class id, such as `56: chair`; what it "
        "does not name is left out of masks, and keeps its class id in detections",
    )
    add(
        "--label-divisor",
        type=whole(0),
        default=0,
        metavar="N",
        help="masks have class * N + instance; 0: they have the class, and each connected region "
        "is an instance (default: 0)",
    )
    add("--score", type=score, default=0.9, help="score of masks, in (0, 1] (default: %(default)s)")
    add(
        "--slop-seconds",
        type=duration,
        default=0.02,
        metavar="S",
        help="largest difference between the stamps of a depth image and its detections "
        "(default: %(default)s)",
    )
    add(
        "--queue",
        type=whole(1),
        default=10,
        metavar="N",
        help="messages of a topic that wait for their partner (default: %(default)s)",
    )


def add_pose_options(parser: argparse.ArgumentParser) -> None:
    """Options for the poses of the camera."""
    group = parser.add_argument_group("poses, by /tf unless --pose is given")
    add = group.add_argument
    add(
        "--map-frame",
        type=frame,
        default="map",
        metavar="FRAME",
        help="ROS frame of the map (default: %(default)s)",
    )
    add(
        "--camera-frame",
        type=frame,
        default="",
        metavar="FRAME",
        help="optical frame of the depth camera (default: that of the depth images)",
    )
    add("--tf", default="/tf", metavar="TOPIC", help="tf2_msgs/TFMessage (default: /tf)")
    add("--tf-static", default="/tf_static", metavar="TOPIC", help="(default: /tf_static)")
    add(
        "--pose",
        metavar="TOPIC",
        help="geometry_msgs/PoseStamped or PoseWithCovarianceStamped of the robot in the map",
    )
    add(
        "--mount",
        type=mount,
        metavar="X,Y,Z,QX,QY,QZ,QW",
        help="pose of the camera's optical frame (x right, y down, z forward) on the robot of "
        "--pose, in metres and as a quaternion",
    )
    add(
        "--max-pose-gap",
        type=duration,
        default=0.5,
        metavar="S",
        help="largest seconds between poses to interpolate (default: %(default)s)",
    )
    add(
        "--pose-sigma",
        type=sigma,
        default=LOCALISATION_SIGMA,
        metavar="X,Y,YAW",
        help="standard deviations of poses without covariance, in m and rad (default: %(default)s)",
    )


def add_output_options(parser: argparse.ArgumentParser) -> None:
    """Options for where frames go."""
    targets = parser.add_argument_group("output").add_mutually_exclusive_group(required=True)
    targets.add_argument(
        "--ingest", metavar="HOST:PORT", help="address of `hypermap-ingest serve` to send to"
    )
    targets.add_argument(
        "--dry-run", action="store_true", help="print what would be sent, and send nothing"
    )
    group = parser.add_argument_group("names")
    group.add_argument("--robot", default="", help="name of the robot (default: that of the bag)")
    group.add_argument(
        "--frame-id",
        default="",
        metavar="FRAME",
        help="frame of the poses in Hypermap (default: the map's own)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON, one document a line")


def frame(text: str) -> str:
    """Reads the name of a frame; ROS 1 wrote a slash before it."""
    return text.lstrip("/")


def numbers(text: str) -> Iterator[float]:
    """The numbers of a list with commas."""
    return map(float, text.split(","))


def mount(text: str) -> Pose:
    """Reads X,Y,Z,QX,QY,QZ,QW."""
    values = list(numbers(text))
    pose = make_pose(values[:3], values[3:]) if len(values) == 7 else None
    if pose is None:
        raise ValueError(text)
    return pose


def sigma(text: str) -> tuple[float, float, float]:
    """Reads X,Y,YAW."""
    x, y, yaw = numbers(text)
    if not all(0.0 <= n <= MAX_SIGMA for n in (x, y, yaw)):
        raise ValueError(text)
    return x, y, yaw


def duration(text: str) -> float:
    """Reads a time in seconds."""
    seconds = float(text)
    if not (seconds >= 0.0 and math.isfinite(seconds)):
        raise ValueError(text)
    return seconds


def score(text: str) -> float:
    """Reads a score in (0, 1]."""
    value = float(text)
    if not 0.0 < value <= 1.0:
        raise ValueError(text)
    return value


def whole(least: int) -> Callable[[str], int]:
    """Returns a function that reads whole numbers from `least` on."""

    def number(text: str) -> int:
        value = int(text)
        if value < least:
            raise ValueError(text)
        return value

    return number

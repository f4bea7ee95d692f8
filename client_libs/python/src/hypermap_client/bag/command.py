"""The program `hypermap-bag`."""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import pathlib
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import NoReturn

import numpy as np

from .. import __version__
from .._proto import frame_service_pb2 as pb
from ..errors import HypermapError
from .frames import FrameReader, PoseSource, TopicPoses, Topics, TransformPoses
from .instances import Boxes, InstanceReader, LabelImages
from .problems import BagError
from .recording import Recording, read_labels
from .sending import FrameSender
from .summary import Summary
from .synchronizer import Synchronizer
from .transforms import Pose, make_pose

EXIT_ERROR = 1  # The run failed.
EXIT_USAGE = 2  # The command line is invalid.

NANOSECONDS = 1_000_000_000
# As for `hypermap-ingest replay`: the error of a localisation like AMCL's in an office.
LOCALISATION_SIGMA = "0.06,0.06,0.016"
MAX_SIGMA = 1000.0


class Parser(argparse.ArgumentParser):
    """A parser that tells errors in one line, as the other programs do."""

    def error(self, message: str) -> NoReturn:
        """Ends the program."""
        self.exit(EXIT_USAGE, f"{self.prog}: {message} (see {self.prog} --help)\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the program and returns its exit code."""
    options = parse_arguments(arguments)
    try:
        summary = run(options)
        print(summary.to_json() if options.json else summary.to_text(), flush=True)
    except BagError as error:
        return fail(str(error))
    except HypermapError as error:
        return fail(f"{error.code.name}: {error}")
    except BrokenPipeError:  # Nobody reads the output any more, as in `hypermap-bag … | head`.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_ERROR
    problem = summary.problem()
    return fail(problem) if problem else 0


def fail(message: str) -> int:
    """Prints an error in one line, and returns the exit code for it."""
    print(f"hypermap-bag: {' '.join(message.split())}", file=sys.stderr, flush=True)
    return EXIT_ERROR


def run(options: argparse.Namespace) -> Summary:
    """Sends the frames of a bag. Raises BagError or HypermapError if that fails as a whole."""
    summary = Summary(options.robot or options.bags[0].resolve().name.removesuffix(".bag"))
    begin = time.monotonic()
    instances = instance_reader(options)
    synchronizer = Synchronizer(options.queue, nanoseconds(options.slop_seconds))
    with watched_signals() as is_interrupted, Recording(options.bags) as recording:
        reader = FrameReader(
            recording,
            Topics(options.depth, options.camera_info, options.masks or options.detections),
            pose_source(options),
            instances,
            pose_covariance=np.diag(np.square(options.pose_sigma or sigma(LOCALISATION_SIGMA))),
            rectified=options.rectified,
        )
        send = print_frames if options.dry_run else send_frames
        send(options, reader, synchronizer, summary, is_interrupted)
    summary.seconds = time.monotonic() - begin
    return summary


def send_frames(
    options: argparse.Namespace,
    reader: FrameReader,
    synchronizer: Synchronizer,
    summary: Summary,
    is_interrupted: Callable[[], bool],
) -> None:
    """Sends frames, and waits until all are acknowledged."""
    opening = pb.FrameOpening(robot=summary.robot, frame_id=options.frame_id, camera=reader.camera)
    sender = FrameSender(options.ingest, opening, summary.note)
    try:
        for frame in reader.frames(synchronizer, sender.is_known, summary):
            if is_interrupted():
                summary.interrupted = True
                break
            sender.send(frame)
        sender.finish()
    finally:
        sender.close()


def print_frames(
    options: argparse.Namespace,
    reader: FrameReader,
    synchronizer: Synchronizer,
    summary: Summary,
    is_interrupted: Callable[[], bool],
) -> None:
    """Prints a line for each frame that would be sent."""
    for frame in reader.frames(synchronizer, lambda sequence: False, summary):
        if is_interrupted():
            summary.interrupted = True
            break
        summary.not_sent += 1
        print(frame_as_json(frame) if options.json else frame_as_text(frame))


def frame_as_json(frame: pb.RobotFrame) -> str:
    """The stamp, pose and instances of a frame as one line."""
    pose = frame.pose
    return json.dumps(
        {
            "sequence": frame.sequence,
            "stamp": frame.stamp.ToJsonString(),
            "position": [pose.x, pose.y, pose.z],
            "rotation": [pose.qx, pose.qy, pose.qz, pose.qw],
            "covariance": list(pose.covariance),
            "instances": [
                {
                    "scores": {score.label: score.score for score in instance.scores},
                    "pixels": sum(instance.runs.counts[1::2]),
                }
                for instance in frame.instances
            ],
        }
    )


def frame_as_text(frame: pb.RobotFrame) -> str:
    """The stamp, position and labels of a frame as one line."""
    best = (max(instance.scores, key=lambda s: s.score) for instance in frame.instances)
    labels = ", ".join(f"{score.label} {score.score:.2f}" for score in best)
    pose = frame.pose
    return (
        f"{frame.stamp.ToJsonString()} at ({pose.x:.3f}, {pose.y:.3f}, {pose.z:.3f}): "
        f"{labels or 'nothing'}"
    )


@contextlib.contextmanager
def watched_signals() -> Iterator[Callable[[], bool]]:
    """Takes SIGINT and SIGTERM. Yields a function that tells whether one has come.

    The second signal ends the program at once.
    """
    received: list[int] = []

    def note(number: int, _frame: object) -> None:
        received.append(number)
        signal.signal(number, signal.SIG_DFL)

    before = {n: signal.signal(n, note) for n in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(received)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def pose_source(options: argparse.Namespace) -> PoseSource:
    """The source of poses that the options name."""
    max_gap_ns = nanoseconds(options.max_pose_gap)
    if options.pose:
        return TopicPoses(options.pose, options.mount, options.map_frame, max_gap_ns)
    return TransformPoses(
        options.tf, options.tf_static, options.map_frame, options.camera_frame, max_gap_ns
    )


def instance_reader(options: argparse.Namespace) -> InstanceReader:
    """The reader for the topic of detections or label images."""
    labels = read_labels(options.labels) if options.labels else {}
    if options.masks:
        return LabelImages(labels, options.label_divisor, options.score)
    return Boxes(labels)


def nanoseconds(seconds: float) -> int:
    """Converts seconds."""
    return round(seconds * NANOSECONDS)


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
    add("--map-frame", default="map", metavar="FRAME", help="ROS frame of the map (default: map)")
    add(
        "--camera-frame",
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
        metavar="X,Y,YAW",
        help="standard deviations of poses without covariance, in m and rad (default: "
        + LOCALISATION_SIGMA
        + ")",
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

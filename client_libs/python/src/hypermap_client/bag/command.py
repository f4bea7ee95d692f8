"""The program `hypermap-bag`."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from .._proto import frame_service_pb2 as pb
from ..errors import HypermapError
from .frames import FrameReader, PoseSource, TopicPoses, Topics, TransformPoses
from .instances import Boxes, InstanceReader, LabelImages
from .options import parse_arguments
from .problems import BagError, InterruptedRunError
from .recording import Recording, read_labels
from .sending import FrameSender
from .summary import Summary
from .synchronizer import Synchronizer

EXIT_ERROR = 1  # The run failed.

NANOSECONDS = 1_000_000_000


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
    synchronizer = Synchronizer(options.queue, nanoseconds(options.slop_seconds))
    with watched_signals() as is_interrupted, Recording(options.bags, is_interrupted) as recording:
        try:
            reader = FrameReader(
                recording,
                Topics(options.depth, options.camera_info, options.masks or options.detections),
                pose_source(options),
                instance_reader(options),
                pose_covariance=np.diag(np.square(options.pose_sigma)),
                rectified=options.rectified,
            )
            send = print_frames if options.dry_run else send_frames
            send(options, reader, synchronizer, summary)
        except InterruptedRunError:
            summary.interrupted = True
    summary.seconds = time.monotonic() - begin
    return summary


def send_frames(
    options: argparse.Namespace, reader: FrameReader, synchronizer: Synchronizer, summary: Summary
) -> None:
    """Sends frames, and waits until all that were sent are acknowledged.

    Raises BagError or InterruptedRunError after that, if reading ended early.
    """
    opening = pb.FrameOpening(robot=summary.robot, frame_id=options.frame_id, camera=reader.camera)
    with contextlib.closing(FrameSender(options.ingest, opening, summary.note)) as sender:
        try:
            for frame in reader.frames(synchronizer, sender.is_known, summary):
                sender.send(frame)
        except (BagError, InterruptedRunError):
            sender.finish()
            raise
        sender.finish()


def print_frames(
    options: argparse.Namespace, reader: FrameReader, synchronizer: Synchronizer, summary: Summary
) -> None:
    """Prints a line for each frame that would be sent."""
    for frame in reader.frames(synchronizer, lambda sequence: False, summary):
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

"""Conversion of detections and label images to the instances of a frame."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from .._proto import frame_service_pb2 as pb
from .images import check_size, samples

Mask = npt.NDArray[np.bool_]
# Row, first column, column after the last one.
Run = tuple[int, int, int]
# The worker takes no more instances of a frame.
MAX_INSTANCES = 254


class InstanceReader(Protocol):
    """Makes instances of the messages of a topic."""

    types: ClassVar[tuple[str, ...]]
    """The types of messages that it reads."""

    def read(
        self, message: Any, camera: pb.CameraModel, skipped: Counter[str]
    ) -> list[pb.FrameInstance]:
        """The instances of a message. Those that cannot be used are counted by their reason."""
        ...


@dataclass(frozen=True)
class Boxes:
    """Reads a Detection2DArray of vision_msgs. The pixels of an instance are those in its box.

    labels: labels of class ids; a class that is not in it keeps its id as the label.
    """

    types: ClassVar[tuple[str, ...]] = ("vision_msgs/msg/Detection2DArray",)
    labels: Mapping[str, str]

    def read(
        self, message: Any, camera: pb.CameraModel, skipped: Counter[str]
    ) -> list[pb.FrameInstance]:
        """The instances of a message. Those that cannot be used are counted by their reason."""
        instances = []
        for detection in message.detections:
            scores = self._scores(detection.results)
            mask = box_mask(detection.bbox, camera)
            if not scores:
                skipped["detection without a class that has a score in (0, 1]"] += 1
            elif not mask.any():
                skipped["detection outside of the image"] += 1
            else:
                instances.append(encode_instance(scores, mask))
        return instances

    def _scores(self, results: Any) -> dict[str, float]:
        """The highest score of each label."""
        scores: dict[str, float] = {}
        for result in results:
            # Since Galactic, hypotheses have a message of their own; their ids were called `id`.
            hypothesis = getattr(result, "hypothesis", result)
            class_id = str(getattr(hypothesis, "class_id", getattr(hypothesis, "id", "")))
            label = self.labels.get(class_id, class_id)
            if label and 0.0 < hypothesis.score <= 1.0:
                scores[label] = max(scores.get(label, 0.0), float(hypothesis.score))
        return scores


@dataclass(frozen=True)
class LabelImages:
    """Reads label images: an Image with a number for each pixel.

    Numbers without a label are left out.

    labels: labels of the classes.
    divisor: 0 if the number is the class; each connected region of a class is an instance then.
        Otherwise the number is `class * divisor + instance`, as in panoptic segmentation.
    score: the score of all instances.
    """

    types: ClassVar[tuple[str, ...]] = ("sensor_msgs/msg/Image",)
    labels: Mapping[str, str]
    divisor: int
    score: float

    def read(
        self, message: Any, camera: pb.CameraModel, skipped: Counter[str]
    ) -> list[pb.FrameInstance]:
        """The instances of a message, those of a class with the largest first."""
        image = samples(message, ("mono8", "8UC1", "mono16", "16UC1", "32SC1"))
        check_size(image, camera)
        instances = []
        for value in np.unique(image):
            label = self.labels.get(str(int(value) // (self.divisor or 1)))
            if label is None:
                continue
            mask = image == value
            for instance in [mask] if self.divisor else regions(mask):
                instances.append(encode_instance({label: self.score}, instance))
        return instances


def box_mask(box: Any, camera: pb.CameraModel) -> Mask:
    """The pixels whose centre is in a BoundingBox2D.

    In a box, the centre of the top left pixel is (0.5, 0.5): boxes of detectors count from the
    image's edge.
    """
    centre = getattr(box.center, "position", box.center)  # As above, since Galactic.
    x = np.arange(camera.width) + 0.5 - centre.x
    y = np.arange(camera.height)[:, np.newaxis] + 0.5 - centre.y
    cosine, sine = np.cos(box.center.theta), np.sin(box.center.theta)
    inside: Mask = (abs(cosine * x + sine * y) <= box.size_x / 2) & (
        abs(cosine * y - sine * x) <= box.size_y / 2
    )
    return inside


def encode_instance(scores: Mapping[str, float], mask: Mask) -> pb.FrameInstance:
    """Makes the message of an instance. The mask becomes COCO's run lengths, column by column."""
    edges = np.flatnonzero(np.diff(mask.T.ravel(), prepend=False))
    counts = np.diff(edges, prepend=0, append=mask.size)
    return pb.FrameInstance(
        scores=[{"label": label, "score": score} for label, score in scores.items()],
        runs=pb.MaskRuns(counts=counts.tolist()),
    )


def regions(mask: Mask) -> list[Mask]:
    """The 8-connected regions of a mask, the largest first, at most `MAX_INSTANCES`.

    Runs of each row are joined with the runs of the row above that they touch (union-find).
    """
    runs = list(_runs(mask))
    leader = list(range(len(runs)))

    def find(i: int) -> int:
        while leader[i] != i:
            leader[i] = i = leader[leader[i]]
        return i

    above = 0  # The first run that can touch the present one.
    for i, (row, begin, end) in enumerate(runs):
        while runs[above][0] < row - 1 or (runs[above][0] == row - 1 and runs[above][2] < begin):
            above += 1
        for j in range(above, i):
            if runs[j][0] != row - 1 or runs[j][1] > end:
                break
            leader[find(j)] = find(i)

    members: dict[int, list[Run]] = {}
    for i, run in enumerate(runs):
        members.setdefault(find(i), []).append(run)
    largest = heapq.nlargest(
        MAX_INSTANCES,
        members.values(),
        key=lambda region: sum(end - begin for _, begin, end in region),
    )
    return [_fill(region, mask.shape) for region in largest]


def _num_pixels(region: list[Run]) -> int:
    return sum(end - begin for _, begin, end in region)


def _fill(region: list[Run], shape: tuple[int, ...]) -> Mask:
    mask = np.zeros(shape, np.bool_)
    for row, begin, end in region:
        mask[row, begin:end] = True
    return mask


def _runs(mask: Mask) -> Iterator[Run]:
    """Yields (row, begin, end) of each run of set pixels, row by row."""
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(np.int8)
    steps = np.diff(padded, axis=1)
    rows, begins = np.nonzero(steps == 1)
    _, ends = np.nonzero(steps == -1)
    yield from zip(rows.tolist(), begins.tolist(), ends.tolist(), strict=True)

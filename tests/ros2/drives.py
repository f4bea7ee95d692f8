"""Recorded drives in TUM's RGB-D layout as messages of ROS 2."""

import io
import json
import struct
import zlib
from dataclasses import dataclass

import numpy
import yaml

import dds_types as dds

UNITS_PER_METRE = 5000
# Numbers in label images are class * DIVISOR + instance.
DIVISOR = 256
SCORE = 0.9


@dataclass
class Frame:
    file: str
    stamp_ns: int
    pose: list                # x y z qx qy qz qw of the optical frame in the map
    metres: numpy.ndarray
    numbers: numpy.ndarray    # the label image


class Drive:
    """Frames of the drive in a folder, from the first to before `end`, every `stride`-th."""

    def __init__(self, folder, detections, end=None, stride=1):
        self._folder = folder
        coco = json.loads((folder / detections).read_text(encoding="utf-8"))
        classes = {c["id"]: i for i, c in enumerate(coco["categories"], 1)}
        # By the number of the class.
        self.labels = {classes[c["id"]]: c["name"] for c in coco["categories"]}
        self._files = {image["id"]: image["file_name"] for image in coco["images"]}
        self._masks = {}
        for annotation in coco["annotations"]:
            masks = self._masks.setdefault(self._files[annotation["image_id"]], [])
            masks.append((classes[annotation["category_id"]], annotation["segmentation"]["counts"]))
        poses = {row[0]: [float(n) for n in row[1:]] for row in self._rows("groundtruth.txt")}
        self._depth = [(row[0], row[1], poses[row[0]])
                       for row in self._rows("depth.txt")][:end:stride]
        calibration = yaml.safe_load((folder / "camera.yaml").read_text(encoding="utf-8"))
        self.width, self.height = calibration["image_width"], calibration["image_height"]
        self._matrix = [float(n) for n in calibration["camera_matrix"]["data"]]

    def _rows(self, name):
        for line in (self._folder / name).read_text(encoding="utf-8").splitlines():
            if not line.startswith("#"):
                yield line.split()

    def __len__(self):
        return len(self._depth)

    def __iter__(self):
        for seconds, file, pose in self._depth:
            whole, fraction = seconds.split(".")
            units = read_grey_png((self._folder / file).read_bytes())
            yield Frame(file, int(whole) * 10**9 + int(fraction.ljust(9, "0")), pose,
                        units.astype(numpy.float32) * numpy.float32(1 / UNITS_PER_METRE),
                        self._label_image(self._masks.get(file, [])))

    def _label_image(self, masks):
        image = numpy.zeros((self.height, self.width), numpy.uint16)
        for n, (number, counts) in enumerate(masks):
            runs = counts if isinstance(counts, list) else unpack(counts)
            values = numpy.arange(len(runs)) % 2 == 1
            mask = numpy.repeat(values, runs).reshape(image.shape, order="F")
            assert not image[mask].any(), "masks overlap, so that no label image can have both"
            image[mask] = number * DIVISOR + n
        return image

    def camera_info(self, stamp_ns):
        fx, _, cx, _, fy, cy, *_ = self._matrix
        return dds.CameraInfo(
            header(stamp_ns), self.height, self.width, "plumb_bob", [0.0] * 5, self._matrix,
            numpy.eye(3).ravel().tolist(), [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            0, 0, dds.RegionOfInterest())


def header(stamp_ns, frame="optical"):
    return dds.Header(dds.Time(*divmod(stamp_ns, 10**9)), frame)


def image(stamp_ns, array, encoding):
    data = numpy.ascontiguousarray(array)
    return dds.Image(header(stamp_ns), *data.shape, encoding, 0, data.strides[0], data.tobytes())


def transform(stamp_ns, parent, child, pose):
    """`pose` is x y z qx qy qz qw."""
    return dds.TransformStamped(
        header(stamp_ns, parent), child,
        dds.Transform(dds.Vector3(*pose[:3]), dds.Quaternion(*pose[3:])))


def boxes(numbers):
    """Yields (class, left, top, right, bottom) of each instance of a label image, in pixels from
    the image's edge."""
    for number in numpy.unique(numbers[numbers > 0]):
        pixels = numpy.argwhere(numbers == number)
        (top, left), (bottom, right) = pixels.min(axis=0), pixels.max(axis=0) + 1
        yield int(number) // DIVISOR, int(left), int(top), int(right), int(bottom)


def detections(stamp_ns, numbers):
    """The boxes of a label image. Ids of classes are their numbers."""
    found = []
    for number, left, top, right, bottom in boxes(numbers):
        anywhere = dds.PoseWithCovariance(dds.Pose(dds.Point(), dds.Quaternion()), [0.0] * 36)
        hypothesis = dds.ObjectHypothesis(str(number), SCORE)
        box = dds.BoundingBox2D(
            dds.Pose2D(dds.Point2D((left + right) / 2, (top + bottom) / 2), 0.0),
            float(right - left), float(bottom - top))
        found.append(dds.Detection2D(header(stamp_ns),
                                     [dds.ObjectHypothesisWithPose(hypothesis, anywhere)], box, ""))
    return dds.Detection2DArray(header(stamp_ns), found)


def boxes_as_coco(drive):
    """The same boxes as the text of a COCO file, with a polygon for each."""
    images, annotations = [], []
    for image_id, frame in enumerate(drive):
        images.append({"id": image_id, "file_name": frame.file})
        for number, left, top, right, bottom in boxes(frame.numbers):
            annotations.append({
                "image_id": image_id, "category_id": number, "score": SCORE,
                "segmentation": [[left, top, right, top, right, bottom, left, bottom]]})
    categories = [{"id": number, "name": label} for number, label in drive.labels.items()]
    return json.dumps({"images": images, "annotations": annotations, "categories": categories})


def read_grey_png(data):
    """Decodes a grey PNG of 16 bits whose lines have no filter, as those of the drives."""
    stream, packed = io.BytesIO(data[8:]), b""
    while head := stream.read(8):
        length, kind = struct.unpack(">I4s", head)
        body = stream.read(length)
        stream.read(4)
        if kind == b"IHDR":
            width, height, *form = struct.unpack(">IIBBBBB", body)
            assert form == [16, 0, 0, 0, 0], form
        if kind == b"IDAT":
            packed += body
    rows = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).reshape(height, 1 + 2 * width)
    assert not rows[:, 0].any(), "a line has a filter"
    return numpy.ascontiguousarray(rows[:, 1:]).view(">u2")


def unpack(counts):
    """Decodes COCO's compressed run lengths."""
    runs, value, shift = [], 0, 0
    for byte in counts.encode():
        value |= (byte - 48 & 0x1F) << shift
        shift += 5
        if not byte - 48 & 0x20:
            if byte - 48 & 0x10:
                value -= 1 << shift
            runs.append(value + runs[-2] if len(runs) > 2 else value)
            value = shift = 0
    return runs

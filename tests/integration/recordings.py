"""Generates recorded drives: a camera moves past a box on a floor. Files have TUM's RGB-D layout.

Depth images and masks are computed from the geometry, so the ground truth is known exactly.
"""

import base64
import dataclasses
import json
import pathlib
import struct
import zlib

import numpy

WIDTH, HEIGHT, FOCAL = 192, 144, 160.0
CAMERA_HEIGHT_M, PITCH_DOWN_RAD = 1.6, 0.6
# Lower left corner, upper right corner and height of the box.
BOX = ((1.5, -0.3), (2.1, 0.3), 0.5)
FIRST_STAMP_S, INTERVAL_S = 1_600_000_000, 0.2

CAMERA_YAML = f"""image_width: {WIDTH}
image_height: {HEIGHT}
camera_matrix:
  data: [{FOCAL}, 0, {(WIDTH - 1) / 2}, 0, {FOCAL}, {(HEIGHT - 1) / 2}, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  data: [0, 0, 0, 0, 0]
"""


@dataclasses.dataclass
class Frame:
    stamp: str
    position: tuple
    quaternion: tuple       # x y z w
    millimetres: numpy.ndarray
    mask: numpy.ndarray     # 1 for pixels of the box

    def counts(self):
        """Returns the mask as COCO's run lengths: column by column, beginning with zeros."""
        values = numpy.concatenate([[0], self.mask.T.ravel(), [2]])
        edges = numpy.flatnonzero(numpy.diff(values))
        return numpy.diff(numpy.concatenate([[0], edges])).tolist()


def render(index, count):
    """Renders frame `index` of `count`. The camera moves along y and looks along x, downwards."""
    y = -0.4 + 0.8 * index / max(1, count - 1)
    cos, sin = numpy.cos(PITCH_DOWN_RAD), numpy.sin(PITCH_DOWN_RAD)
    rotation = numpy.array([[0, -sin, cos], [-1, 0, 0], [0, -cos, -sin]])  # map from optical
    origin = numpy.array([0.0, y, CAMERA_HEIGHT_M])
    u, v = numpy.meshgrid(numpy.arange(WIDTH), numpy.arange(HEIGHT))
    rays = numpy.stack([(u - (WIDTH - 1) / 2) / FOCAL, (v - (HEIGHT - 1) / 2) / FOCAL,
                        numpy.ones_like(u, dtype=float)], axis=-1) @ rotation.T
    with numpy.errstate(divide="ignore", invalid="ignore"):
        floor = numpy.where(rays[..., 2] < 0, -origin[2] / rays[..., 2], numpy.inf)
        low = (numpy.array([*BOX[0], 0.0]) - origin) / rays
        high = (numpy.array([*BOX[1], BOX[2]]) - origin) / rays
    enter = numpy.nanmax(numpy.minimum(low, high), axis=-1)
    leave = numpy.nanmin(numpy.maximum(low, high), axis=-1)
    box = numpy.where((enter <= leave) & (enter > 0), enter, numpy.inf)
    depth = numpy.minimum(floor, box)
    depth = numpy.where(depth < 8.0, depth, 0.0)
    return Frame(stamp=f"{FIRST_STAMP_S + index * INTERVAL_S:.6f}",
                 position=tuple(origin), quaternion=quaternion(rotation),
                 millimetres=numpy.round(depth * 1000).astype(numpy.uint16),
                 mask=((box < floor) & (depth > 0)).astype(numpy.uint8))


def quaternion(m):
    """Converts a rotation matrix, whose trace must be > -1, to a quaternion (x, y, z, w)."""
    w = numpy.sqrt(max(1e-12, 1 + m[0, 0] + m[1, 1] + m[2, 2])) / 2
    return ((m[2, 1] - m[1, 2]) / (4 * w), (m[0, 2] - m[2, 0]) / (4 * w),
            (m[1, 0] - m[0, 1]) / (4 * w), w)


def png(samples):
    """Encodes an array of samples as a 16-bit grey PNG."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(
            ">I", zlib.crc32(kind + body))
    height, width = samples.shape
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in samples)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 0, 0,
                                                              0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class Recording:
    """A recorded drive in memory. Tests can damage its parts before `write` writes the folder."""

    def __init__(self, folder, count):
        self.folder = pathlib.Path(folder)
        self.frames = [render(i, count) for i in range(count)]
        self.depth = [png(f.millimetres * 5) for f in self.frames]
        self.stamps = [f.stamp for f in self.frames]  # of the poses
        self.poses = [(*f.position, *f.quaternion) for f in self.frames]
        self.annotations = [
            {"image_id": i, "category_id": 1, "score": 0.9,
             "segmentation": {"size": [HEIGHT, WIDTH], "counts": f.counts()}}
            for i, f in enumerate(self.frames)]

    def write(self):
        (self.folder / "depth").mkdir(parents=True)
        for frame, data in zip(self.frames, self.depth):
            (self.folder / self._file(frame)).write_bytes(data)
        self._write("depth.txt", [f"{f.stamp} {self._file(f)}" for f in self.frames])
        self._write("groundtruth.txt", [f"{stamp} {' '.join(str(n) for n in pose)}"
                                        for stamp, pose in zip(self.stamps, self.poses)])
        self._write("camera.yaml", [CAMERA_YAML])
        self._write("detections.json", [json.dumps({
            "images": [{"id": i, "file_name": self._file(f)} for i, f in enumerate(self.frames)],
            "categories": [{"id": 1, "name": "box"}],
            "annotations": self.annotations})])
        return self.folder

    @staticmethod
    def _file(frame):
        return f"depth/{frame.stamp}.png"

    def _write(self, name, lines):
        (self.folder / name).write_text("".join(line + "\n" for line in lines), encoding="utf-8")


def opening(robot, **fields):
    """Returns the first request of a stream of frames."""
    return {"opening": {"robot": robot, **fields, "camera": {
        "width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL,
        "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2}}}


def request(frame, sequence):
    """Returns the request that sends a frame in such a stream."""
    x, y, z = frame.position
    qx, qy, qz, qw = frame.quaternion
    seconds, fraction = frame.stamp.split(".")
    stamp = f"{numpy.datetime64(int(seconds), 's')}.{fraction}Z"
    return {"frame": {
        "sequence": sequence, "stamp": stamp,
        "pose": {"x": x, "y": y, "z": z, "qx": qx, "qy": qy, "qz": qz, "qw": qw},
        "millimetres": base64.b64encode(frame.millimetres.astype("<u2").tobytes()).decode(),
        "instances": [{"scores": [{"label": "box", "score": 0.9}],
                       "runs": {"counts": frame.counts()}}]}}

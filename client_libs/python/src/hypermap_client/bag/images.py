"""Conversion of ROS's images and camera calibrations to messages of the FrameService."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from .._proto import frame_service_pb2 as pb
from .problems import BagError, SkippedFrameError

# Depth in metres is sent in this unit, that of the TUM RGB-D datasets: 0.2 mm, up to 13.1 m. The
# worker uses depth up to 8 m.
DEPTH_UNITS_PER_METRE = 5000.0
# Bytes before the PNG file in an image of compressed_depth_image_transport.
COMPRESSED_DEPTH_HEADER = 12
LARGEST_UINT16 = 65535
# The first five coefficients of rational_polynomial are those of plumb_bob: k1, k2, p1, p2, k3.
DISTORTION_MODELS = ("plumb_bob", "rational_polynomial")

_SAMPLES = {
    "mono8": "u1", "8UC1": "u1", "mono16": "u2", "16UC1": "u2", "32SC1": "i4", "32FC1": "f4",
}  # fmt: skip


def decode_camera(message: Any, topic: str, *, rectified: bool) -> pb.CameraModel:
    """Converts a CameraInfo.

    rectified: whether the images are rectified, so that matrix P and no distortion applies instead
        of K and D.

    Raises BagError if the camera cannot be expressed as a pinhole camera with plumb_bob.
    """
    camera = pb.CameraModel(width=message.width, height=message.height)
    if rectified:
        p = _calibration(message, "p")
        camera.fx, camera.cx, camera.fy, camera.cy = p[0], p[2], p[5], p[6]
    else:
        k = _calibration(message, "k")
        camera.fx, camera.cx, camera.fy, camera.cy = k[0], k[2], k[4], k[5]
        camera.distortion.extend(_distortion(message, topic))
    if camera.fx <= 0 or camera.fy <= 0:
        raise BagError(f"{topic}: the camera is not calibrated: its focal length is 0")
    return camera


def _calibration(message: Any, name: str) -> list[float]:
    """The numbers k, d or p of a CameraInfo, which ROS 1 called K, D and P."""
    field = name if hasattr(message, name) else name.upper()
    return [float(number) for number in getattr(message, field)]


def _distortion(message: Any, topic: str) -> list[float]:
    coefficients = _calibration(message, "d")
    if any(coefficients[5:]) or (
        any(coefficients) and message.distortion_model not in DISTORTION_MODELS
    ):
        raise BagError(
            f"{topic}: the distortion model {message.distortion_model} with coefficients "
            f"{coefficients} is not plumb_bob; rectify the images, and use --rectified"
        )
    return coefficients[:5]


def samples(image: Any, encodings: tuple[str, ...]) -> npt.NDArray[Any]:
    """The samples of an Image of one channel, an array of (height, width).

    Raises SkippedFrameError if its encoding is not one of the given, or its data are too short.
    """
    if image.encoding not in encodings:
        raise SkippedFrameError(f"image of encoding {image.encoding}, not {'/'.join(encodings)}")
    kind = np.dtype(_SAMPLES[image.encoding]).newbyteorder(">" if image.is_bigendian else "<")
    row_bytes = image.width * kind.itemsize
    data = np.frombuffer(image.data, np.uint8)
    if image.step < row_bytes or len(data) < image.step * image.height:
        raise SkippedFrameError("image with too few bytes")
    rows = data[: image.step * image.height].reshape(image.height, image.step)[:, :row_bytes]
    return np.ascontiguousarray(rows).view(kind)


def encode_depth(image: Any, camera: pb.CameraModel, frame: pb.RobotFrame) -> None:
    """Writes a depth image to a frame.

    image: an Image of encoding 16UC1 (millimetres) or 32FC1 (metres), or a CompressedImage that
        compressed_depth_image_transport made of the former.

    Raises SkippedFrameError if it is none of them, or has not the size of the camera's images.
    """
    if hasattr(image, "format"):
        frame.png.png = _compressed_depth(image)
        return
    depth = samples(image, ("16UC1", "mono16", "32FC1"))
    check_size(depth, camera)
    is_depth = np.isfinite(depth) & (depth > 0)
    if not is_depth.any():
        raise SkippedFrameError("depth image without any depth")
    if image.encoding == "32FC1":
        units = np.rint(np.where(is_depth, depth, 0).astype(float) * DEPTH_UNITS_PER_METRE)
        frame.png.png = encode_png(np.minimum(units, LARGEST_UINT16).astype(np.uint16))
        frame.png.units_per_metre = DEPTH_UNITS_PER_METRE
    else:
        frame.millimetres = depth.astype("<u2").tobytes()


def _compressed_depth(image: Any) -> bytes:
    """The PNG file of a compressed depth image in millimetres."""
    data = bytes(image.data[COMPRESSED_DEPTH_HEADER:])
    if not image.format.startswith("16UC1;") or not data.startswith(b"\x89PNG"):
        raise SkippedFrameError(
            f"compressed image of format {image.format!r}, not a PNG of 16UC1; compressedDepth"
        )
    return data


def check_size(array: npt.NDArray[Any], camera: pb.CameraModel) -> None:
    """Raises SkippedFrameError if an image has not the size of the camera's images."""
    height, width = array.shape
    if (width, height) != (camera.width, camera.height):
        raise SkippedFrameError(
            f"image of {width}x{height} for a camera of {camera.width}x{camera.height}"
        )


def encode_png(array: npt.NDArray[np.uint16]) -> bytes:
    """Encodes an array as a grey PNG of 16 bits."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        checksum = zlib.crc32(kind + body)
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", checksum)

    height, width = array.shape
    rows = np.zeros((height, 1 + 2 * width), np.uint8)  # Each row begins with filter type 0.
    rows[:, 1:] = np.ascontiguousarray(array.astype(">u2")).view(np.uint8)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(rows.tobytes(), level=1))
        + chunk(b"IEND", b"")
    )

"""Tests of the parts of hypermap-bag that need no bag."""

from __future__ import annotations

import io
import math
import types
from typing import Any

import numpy as np
import pytest
from PIL import Image

from hypermap_client._proto import frame_service_pb2 as pb
from hypermap_client.bag.images import encode_depth, encode_png
from hypermap_client.bag.instances import MAX_INSTANCES, box_mask, encode_instance, regions
from hypermap_client.bag.problems import BagError, SkippedFrameError
from hypermap_client.bag.synchronizer import Synchronizer
from hypermap_client.bag.transforms import (
    FrameTree,
    Pose,
    Sample,
    Track,
    make_pose,
    rotate,
    slerp,
)

SECOND = 10**9


def turn(angle: float, *, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    """A translation, and a rotation about the third axis."""
    return Pose(np.array([x, y, z]), np.array([0, 0, math.sin(angle / 2), math.cos(angle / 2)]))


def matrix(pose: Pose) -> np.ndarray:
    """The pose as a matrix of 4×4, by the formula for quaternions."""
    x, y, z, w = pose.rotation
    made = np.eye(4)
    made[:3, 3] = pose.translation
    made[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return made


def stamped(parent: str, child: str, pose: Pose) -> Any:
    """A TransformStamped."""

    def named(names: str, numbers: Any) -> Any:
        return types.SimpleNamespace(**dict(zip(names, numbers, strict=True)))

    return types.SimpleNamespace(
        header=types.SimpleNamespace(frame_id=parent),
        child_frame_id=child,
        transform=types.SimpleNamespace(
            translation=named("xyz", pose.translation), rotation=named("xyzw", pose.rotation)
        ),
    )


def test_poses_compose_like_matrices() -> None:
    rng = np.random.default_rng(7)
    for _ in range(50):
        a, b = (
            make_pose(rng.normal(size=3), q / np.linalg.norm(q)) for q in rng.normal(size=(2, 4))
        )
        assert a is not None and b is not None
        assert matrix(a @ b) == pytest.approx(matrix(a) @ matrix(b), abs=1e-12)
        assert matrix(a.inverse()) == pytest.approx(np.linalg.inv(matrix(a)), abs=1e-12)
        assert rotate(a.rotation, b.translation) == pytest.approx(
            matrix(a)[:3, :3] @ b.translation, abs=1e-12
        )


@pytest.mark.parametrize(
    "numbers",
    [
        (math.nan, 0, 0, 0, 0, 0, 1),
        (math.inf, 0, 0, 0, 0, 0, 1),
        (0, 0, 0, 0, 0, 0, 0),
        (0, 0, 0, 0, 0, 0, 1.02),
        (0, 0, 0, 0, math.nan, 0, 1),
    ],
)
def test_numbers_that_are_no_pose(numbers: tuple[float, ...]) -> None:
    assert make_pose(numbers[:3], numbers[3:]) is None


def test_rounded_quaternions_get_length_1() -> None:
    pose = make_pose((0, 0, 0), (0, 0, 0, 1.005))
    assert pose is not None and pose.rotation.tolist() == [0, 0, 0, 1]


def test_slerp_turns_evenly_the_shorter_way() -> None:
    begin, end = turn(0.2).rotation, turn(1.4).rotation
    for q in (end, -end):  # Both are the same rotation.
        assert slerp(begin, q, 0.25) == pytest.approx(turn(0.5).rotation)
    assert slerp(begin, begin, 0.5) == pytest.approx(begin)


def test_a_track_interpolates_between_samples_but_not_over_gaps() -> None:
    track = Track("the poses")
    for second, x in ((3, 9.0), (1, 1.0), (2, 3.0)):
        track.add(second * SECOND, Sample(turn(0.2 * x, x=x), np.eye(3) * x))
    middle = track.at(SECOND * 5 // 4, SECOND)
    assert middle.pose.translation == pytest.approx([1.5, 0, 0])
    assert middle.pose.rotation == pytest.approx(turn(0.3).rotation)
    assert middle.covariance == pytest.approx(np.eye(3) * 1.5)
    assert track.at(SECOND, 0).pose.translation[0] == 1.0, "a stamp of a sample is in no gap"
    assert track.at(SECOND - 20_000_000, SECOND).pose.translation[0] == 1.0
    assert track.at(3 * SECOND + 20_000_000, SECOND).pose.translation[0] == 9.0
    for stamp in (SECOND - 20_000_001, 3 * SECOND + 20_000_001):
        with pytest.raises(SkippedFrameError, match="outside of the time of the poses"):
            track.at(stamp, SECOND)
    with pytest.raises(SkippedFrameError, match="gap in the poses"):
        track.at(SECOND * 5 // 4, SECOND - 1)


def test_a_tree_of_frames() -> None:
    tree = FrameTree(SECOND)
    map_from_odom, base_from_optical = turn(0.5, x=2.0), turn(-0.1, z=1.1)
    tree.add(stamped("map", "odom", map_from_odom), 0, static=True)
    tree.add(stamped("/odom", "base", turn(0.0)), 0, static=False)
    tree.add(stamped("odom", "base", turn(1.0, x=4.0)), SECOND, static=False)
    tree.add(stamped("base", "optical", base_from_optical), 0, static=True)
    tree.add(stamped("base", "lidar", turn(0.3, y=0.2)), 0, static=True)
    odom_from_base = matrix(turn(0.5, x=2.0))
    expected = matrix(map_from_odom) @ odom_from_base @ matrix(base_from_optical)
    assert matrix(tree.at("map", "optical", SECOND // 2)) == pytest.approx(expected)
    sideways = np.linalg.inv(matrix(turn(0.3, y=0.2))) @ matrix(base_from_optical)
    assert matrix(tree.at("lidar", "optical", SECOND // 2)) == pytest.approx(sideways)
    with pytest.raises(SkippedFrameError, match="outside of the time of the transform odom to"):
        tree.at("map", "optical", 2 * SECOND)


def test_frames_that_are_not_connected() -> None:
    tree = FrameTree(SECOND)
    tree.add(stamped("odom", "base", turn(0.0)), 0, static=True)
    with pytest.raises(BagError, match=r"no transform from map to base;.* base, odom"):
        tree.at("map", "base", 0)
    with pytest.raises(BagError, match="base has two parents, odom and map"):
        tree.add(stamped("map", "base", turn(0.0)), 0, static=True)
    tree.add(stamped("base", "odom", turn(0.0)), 0, static=True)
    with pytest.raises(BagError, match="circle"):
        tree.at("map", "base", 0)
    tree.add(stamped("map", "bad", Pose(np.zeros(3), np.zeros(4))), 0, static=True)
    assert tree.invalid == 1


def test_messages_are_paired_with_the_nearest_that_waits() -> None:
    synchronizer = Synchronizer(queue=10, slop_ns=5)
    assert synchronizer.add(0, 100, "depth 100") is None
    assert synchronizer.add(0, 103, "depth 103") is None
    assert synchronizer.add(1, 104, "boxes 104") == ("depth 103", "boxes 104")
    assert synchronizer.add(1, 105, "boxes 105") == ("depth 100", "boxes 105")
    assert synchronizer.add(1, 200, "boxes 200") is None
    assert synchronizer.add(0, 206, "depth 206") is None, "beyond the slop"
    assert synchronizer.add(0, 205, "depth 205") == ("depth 205", "boxes 200")
    assert (synchronizer.unpaired(0), synchronizer.unpaired(1)) == (1, 0)


def test_a_full_queue_loses_its_oldest_message() -> None:
    synchronizer = Synchronizer(queue=2, slop_ns=0)
    for stamp in (3, 1, 2, 2):
        assert synchronizer.add(0, stamp, stamp) is None
    assert synchronizer.add(1, 1, "late") is None
    assert synchronizer.add(1, 3, "three") == (3, "three")
    assert (synchronizer.unpaired(0), synchronizer.unpaired(1)) == (3, 1)


def test_a_png_has_the_samples_of_the_array() -> None:
    array = np.array([[0, 1, 255], [256, 4660, 65535]], np.uint16)
    assert np.asarray(Image.open(io.BytesIO(encode_png(array)))).tolist() == array.tolist()


def depth_image(array: np.ndarray, encoding: str, *, padding: int = 0, big: bool = False) -> Any:
    """An Image, whose rows end with `padding` bytes of noise."""
    data = np.ascontiguousarray(array.astype(array.dtype.newbyteorder(">" if big else "<")))
    rows = data.view(np.uint8).reshape(len(array), -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=99)
    return types.SimpleNamespace(
        height=array.shape[0], width=array.shape[1], encoding=encoding, is_bigendian=big,
        step=rows.shape[1], data=rows.ravel(),
    )  # fmt: skip


CAMERA = pb.CameraModel(width=3, height=2)


@pytest.mark.parametrize(("padding", "big"), [(0, False), (5, False), (0, True), (2, True)])
def test_depth_in_millimetres_is_passed_on(padding: int, big: bool) -> None:
    array = np.array([[0, 1, 255], [256, 4660, 65535]], np.uint16)
    frame = pb.RobotFrame()
    encode_depth(depth_image(array, "16UC1", padding=padding, big=big), CAMERA, frame)
    assert frame.millimetres == array.astype("<u2").tobytes()


def test_depth_in_metres_is_rounded_to_fifths_of_a_millimetre() -> None:
    array = np.array([[math.nan, math.inf, -1.0], [0.0, 1.23456, 99.0]], np.float32)
    frame = pb.RobotFrame()
    encode_depth(depth_image(array, "32FC1"), CAMERA, frame)
    samples = np.asarray(Image.open(io.BytesIO(frame.png.png)))
    assert samples.tolist() == [[0, 0, 0], [0, 6173, 65535]]
    assert frame.png.units_per_metre == 5000


def test_images_that_are_no_depth_of_the_camera() -> None:
    good = np.ones((2, 3), np.uint16)
    short = depth_image(good, "16UC1")
    short.data = short.data[:-1]
    for image, reason in (
        (depth_image(good.astype(np.uint8), "mono8"), "encoding mono8"),
        (depth_image(np.ones((3, 2), np.uint16), "16UC1"), "2x3 for a camera of 3x2"),
        (depth_image(good * 0, "16UC1"), "without any depth"),
        (depth_image(np.full((2, 3), np.inf, np.float32), "32FC1"), "without any depth"),
        (short, "too few bytes"),
        (types.SimpleNamespace(format="jpeg", data=bytes(20)), "format 'jpeg'"),
    ):
        with pytest.raises(SkippedFrameError, match=reason):
            encode_depth(image, CAMERA, pb.RobotFrame())


def flood(mask: np.ndarray) -> list[np.ndarray]:
    """The 8-connected regions of a mask by flood fill."""
    found, rest = [], mask.copy()
    while rest.any():
        region = np.zeros_like(mask)
        todo = [tuple(np.argwhere(rest)[0])]
        while todo:
            row, column = todo.pop()
            inside = 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1]
            if inside and rest[row, column]:
                rest[row, column], region[row, column] = False, True
                todo += [(row + i, column + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        found.append(region)
    return found


def test_regions_are_those_of_a_flood_fill() -> None:
    rng = np.random.default_rng(3)
    for density in (0.1, 0.3, 0.5, 0.7) * 5:
        mask = rng.random((20, 17)) < density
        got, expected = regions(mask), flood(mask)
        assert {r.tobytes() for r in got} == {r.tobytes() for r in expected}
        sizes = [np.count_nonzero(r) for r in got]
        assert sizes == sorted(sizes, reverse=True)
    assert regions(np.zeros((3, 3), bool)) == []
    speckles = np.zeros((64, 64), bool)
    speckles[::2, ::2] = True
    assert len(regions(speckles)) == MAX_INSTANCES


def test_runs_go_down_the_columns_and_begin_with_unset_pixels() -> None:
    mask = np.array([[0, 1, 1], [0, 1, 0]], bool)
    assert encode_instance({"cup": 0.5}, mask).runs.counts == [2, 3, 1]
    assert encode_instance({"cup": 0.5}, ~mask).runs.counts == [0, 2, 3, 1]


def box(x: float, y: float, width: float, height: float, theta: float = 0.0) -> Any:
    """A BoundingBox2D of vision_msgs 4."""
    centre = types.SimpleNamespace(position=types.SimpleNamespace(x=x, y=y), theta=theta)
    return types.SimpleNamespace(center=centre, size_x=width, size_y=height)


def test_boxes_cover_the_pixels_whose_centres_are_inside() -> None:
    camera = pb.CameraModel(width=5, height=4)
    mask = box_mask(box(2, 1, 2, 2), camera)  # columns 1 to 3 and rows 0 to 2, as half-open edges
    assert np.argwhere(mask).tolist() == [[0, 1], [0, 2], [1, 1], [1, 2]]
    turned = box_mask(box(2, 1, 2, 4, math.pi / 2), camera)
    assert np.argwhere(turned).tolist() == [[r, c] for r in (0, 1) for c in (0, 1, 2, 3)]
    assert not box_mask(box(9, 9, 2, 2), camera).any()

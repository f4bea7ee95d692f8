"""Tests of hypermap-bag on small bags of each format, most of them without a worker."""

from __future__ import annotations

import io
import json
import math
import pathlib
import sqlite3
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bags import FORMATS, BagWriter
from PIL import Image

from hypermap_client.bag.command import main
from hypermap_client.bag.problems import InterruptedRunError
from hypermap_client.bag.recording import Recording

SECOND = 10**9
BEGIN = 1_600_000_000 * SECOND
WIDTH, HEIGHT = 8, 6
TOPICS = ["--depth", "/depth", "--camera-info", "/camera_info"]
BOXES = [*TOPICS, "--detections", "/boxes", "--dry-run", "--json"]
CUP = {"class_id": 41, "score": 0.75, "x": 4, "y": 3, "width": 4, "height": 2}

Fill = Callable[[BagWriter], None]


@pytest.fixture(params=FORMATS)
def kind(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    return name


def write(folder: pathlib.Path, fill: Fill, kind: str = "mcap") -> pathlib.Path:
    """Writes a bag and returns its path."""
    with BagWriter(folder / "cart", kind) as bag:
        fill(bag)
    return bag.path


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> list[dict[str, Any]]:
    """Runs the program, which must succeed, and returns the JSON documents that it prints."""
    code = main([*map(str, arguments)])
    out, err = capsys.readouterr()
    assert (code, err) == (0, "")
    return [json.loads(line) for line in out.splitlines()]


def fail(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Runs the program, which must fail with one line, and returns the line."""
    assert main([*map(str, arguments)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    return line


def depth(value: int = 1000) -> np.ndarray:
    return np.full((HEIGHT, WIDTH), value, np.uint16)


def static_robot(bag: BagWriter) -> None:
    """A camera 1 m above the origin of the map."""
    bag.camera_info("/camera_info", BEGIN, size=(WIDTH, HEIGHT), focal=10)
    bag.transform(BEGIN, "map", "optical", (0, 0, 1, 0, 0, 0, 1), "/tf_static")


def moving_robot(bag: BagWriter) -> None:
    """A robot that drives 1 m/s along x, with two frames that show a cup."""
    bag.camera_info("/camera_info", BEGIN, size=(WIDTH, HEIGHT), focal=10)
    bag.transform(BEGIN, "base", "optical", (0.2, 0, 1, 0, 0, 0, 1), "/tf_static")
    for tenth in range(0, 11, 2):
        bag.transform(BEGIN + tenth * SECOND // 10, "map", "base", (tenth / 10, 0, 0, 0, 0, 0, 1))
    for tenth in (1, 3):
        stamp = BEGIN + tenth * SECOND // 10
        bag.image("/depth", stamp, depth(), "16UC1")
        bag.detections("/boxes", stamp + 5_000_000, [CUP])


def test_each_format_gives_the_same_frames(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, kind: str
) -> None:
    labels = tmp_path / "labels.yaml"
    labels.write_text("41: cup\n", encoding="utf-8")
    path = write(tmp_path, moving_robot, kind)
    first, second, summary = run(capsys, path, *BOXES, "--labels", labels)
    assert first["sequence"] == BEGIN + SECOND // 10
    assert first["stamp"] == "2020-09-13T12:26:40.100Z"
    assert first["position"] == pytest.approx([0.3, 0, 1])
    assert second["position"] == pytest.approx([0.5, 0, 1])
    assert first["instances"] == [{"scores": {"cup": 0.75}, "pixels": 8}]
    assert first["covariance"] == pytest.approx(np.diag([0.0036, 0.0036, 0.000256]).ravel())
    expected = {"robot": "cart", "frames": 2, "not_sent": 2, "skipped": 0, "instances": 2}
    assert {key: summary[key] for key in expected} == expected


def test_recordings_without_definitions_are_read_by_those_of_humble(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    path = write(tmp_path, moving_robot, "sqlite3")
    with sqlite3.connect(next(path.glob("*.db3"))) as database:  # as Humble writes them
        database.execute("UPDATE schema SET schema_version = 3")
        database.execute("DROP TABLE message_definitions")
    first, *_ = run(capsys, path, *BOXES)
    assert first["instances"][0]["scores"] == {"41": 0.75}, "no label, so the class id counts"


def test_several_bags_are_read_as_one(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, kind: str
) -> None:
    paths = []
    for i in range(2):
        folder = tmp_path / str(i)
        folder.mkdir()

        def fill(bag: BagWriter, stamp: int = BEGIN + i * SECOND) -> None:
            static_robot(bag)
            bag.image("/depth", stamp, depth(), "16UC1")
            bag.detections("/boxes", stamp, [CUP])

        paths.append(write(folder, fill, kind))
    *frames, summary = run(capsys, *paths, *BOXES, "--robot", "trolley")
    assert [frame["sequence"] for frame in frames] == [BEGIN, BEGIN + SECOND]
    assert summary["robot"] == "trolley"


def test_messages_without_partner_are_told(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    def fill(bag: BagWriter) -> None:
        static_robot(bag)
        for i in range(4):
            bag.image("/depth", BEGIN + i * SECOND, depth(), "16UC1")
            bag.detections("/boxes", BEGIN + i * SECOND + (i % 2) * 30_000_000, [])

    path = write(tmp_path, fill)
    *frames, summary = run(capsys, path, *BOXES)
    assert [frame["instances"] for frame in frames] == [[], []]
    assert summary["skipped_frames"] == {"no detections within the slop": 2}
    assert summary["skipped_input"] == {"detections without a depth image": 2}
    *frames, summary = run(capsys, path, *BOXES, "--slop-seconds", 0.03)
    assert (len(frames), summary["skipped"]) == (4, 0)


def test_frames_without_a_pose_or_depth_are_skipped(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    def fill(bag: BagWriter) -> None:
        moving_robot(bag)
        for stamp, value in ((BEGIN + 5 * SECOND, 1000), (BEGIN + SECOND, 0)):
            bag.image("/depth", stamp, depth(value), "16UC1")
            bag.detections("/boxes", stamp, [CUP])
        bag.transform(BEGIN, "map", "base", (math.nan, 0, 0, 0, 0, 0, 1))

    *frames, summary = run(capsys, write(tmp_path, fill), *BOXES)
    assert len(frames) == 2
    assert summary["skipped_frames"] == {
        "outside of the time of the transform map to base": 1,
        "depth image without any depth": 1,
    }
    assert summary["skipped_input"] == {"invalid pose": 1}


def test_detections_that_cannot_be_used_are_counted(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    def fill(bag: BagWriter) -> None:
        static_robot(bag)
        bag.image("/depth", BEGIN, depth(), "16UC1")
        wrong = [{**CUP, "score": 0.0}, {**CUP, "score": math.nan}, {**CUP, "class_id": ""}]
        bag.detections("/boxes", BEGIN, [CUP, *wrong, {**CUP, "x": 99}])

    frame, summary = run(capsys, write(tmp_path, fill), *BOXES)
    assert len(frame["instances"]) == 1
    assert summary["skipped_instances"] == {
        "detection without a class that has a score in (0, 1]": 3,
        "detection outside of the image": 1,
    }


def masks(bag: BagWriter) -> None:
    """Two cups, a cat that touches none, and a number without label."""
    static_robot(bag)
    image = np.zeros((HEIGHT, WIDTH), np.uint16)
    image[0:2, 0:3], image[4, 4:6], image[2, 5], image[5, 0] = 41, 41, 15, 77
    bag.image("/depth", BEGIN, depth(), "16UC1")
    bag.image("/masks", BEGIN, image.astype(np.uint8), "mono8")
    numbered = (image * 1000.0 + 3 * (image > 0)).astype(np.int32)
    bag.image("/panoptic", BEGIN, numbered, "32SC1")


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--masks", "/masks"], [("cat", 1), ("cup", 6), ("cup", 2)]),
        (["--masks", "/panoptic", "--label-divisor", 1000], [("cat", 1), ("cup", 8)]),
    ],
)
def test_label_images(
    capsys: pytest.CaptureFixture[str],
    tmp_path: pathlib.Path,
    options: list[object],
    expected: list[tuple[str, int]],
) -> None:
    labels = tmp_path / "labels.yaml"
    labels.write_text('{15: cat, "41": cup}', encoding="utf-8")
    frame, _ = run(
        capsys, write(tmp_path, masks), *TOPICS, *options, "--labels", labels, "--score", 0.5,
        "--dry-run", "--json",
    )  # fmt: skip
    got = [(*i["scores"].items(), i["pixels"]) for i in frame["instances"]]
    assert got == [((label, 0.5), pixels) for label, pixels in expected]


def test_poses_of_a_topic_and_a_mount(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, kind: str
) -> None:
    """The robot looks along y. An error of its yaw moves the camera, 2 m ahead of it, along -x."""
    half = math.sqrt(0.5)
    covariance = np.zeros((6, 6))
    covariance[5, 5] = 0.01

    def fill(bag: BagWriter) -> None:
        static_robot(bag)
        bag.pose_stamped("/pose", BEGIN, (3, 0, 0, 0, 0, half, half))
        bag.pose_stamped("/amcl_pose", BEGIN, (3, 0, 0, 0, 0, half, half), covariance)
        bag.pose_stamped("/odometry", BEGIN, (3, 0, 0, 0, 0, half, half), frame="odom")
        bag.image("/depth", BEGIN, depth(), "16UC1")
        bag.detections("/boxes", BEGIN, [])

    path = write(tmp_path, fill, kind)
    mounted = [*BOXES, "--mount", "2,0,1,0,0,0,1"]
    frame, _ = run(capsys, path, *mounted, "--pose", "/amcl_pose", "--pose-sigma", "1,1,1")
    assert frame["position"] == pytest.approx([3, 2, 1])
    assert frame["rotation"] == pytest.approx([0, 0, half, half])
    expected = np.array([[0.04, 0, -0.02], [0, 0, 0], [-0.02, 0, 0.01]])
    assert frame["covariance"] == pytest.approx(expected.ravel())
    frame, _ = run(capsys, path, *mounted, "--pose", "/pose", "--pose-sigma", "0.1,0.2,0.3")
    assert frame["covariance"] == pytest.approx(np.diag([0.01, 0.04, 0.09]).ravel())
    line = fail(capsys, path, *mounted, "--pose", "/odometry")
    assert "/odometry has poses in frame odom, not map" in line


def test_names_of_frames_and_topics_can_be_given(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    def fill(bag: BagWriter) -> None:
        bag.camera_info("/camera_info", BEGIN, size=(WIDTH, HEIGHT), focal=10)
        bag.transform(BEGIN, "world", "eye", (1, 2, 3, 0, 0, 0, 1), "/cart/tf_static")
        bag.image("/depth", BEGIN, depth(), "16UC1", frame="wrong")
        bag.detections("/boxes", BEGIN, [])

    frame, _ = run(
        capsys, write(tmp_path, fill), *BOXES, "--map-frame", "/world", "--camera-frame", "eye",
        "--tf", "/cart/tf", "--tf-static", "/cart/tf_static",
    )  # fmt: skip
    assert frame["position"] == [1, 2, 3]


def test_compressed_depth(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> None:
    file = io.BytesIO()
    Image.fromarray(depth()).save(file, "PNG")

    def fill(bag: BagWriter) -> None:
        static_robot(bag)
        for i, form in enumerate(("16UC1; compressedDepth png", "32FC1; compressedDepth png")):
            bag.compressed_depth("/depth", BEGIN + i * SECOND, file.getvalue(), form)
            bag.detections("/boxes", BEGIN + i * SECOND, [CUP])

    _, summary = run(capsys, write(tmp_path, fill), *BOXES)
    (reason,) = summary["skipped_frames"]
    assert "'32FC1; compressedDepth png'" in reason


@pytest.mark.parametrize(
    ("distortion", "model", "word"),
    [
        ((0.1, 0, 0, 0, 0, 0.2, 0, 0), "rational_polynomial", "rational_polynomial"),
        ((0.1, 0, 0, 0), "equidistant", "equidistant"),
    ],
)
def test_distortions_that_are_not_plumb_bob_need_rectified_images(
    capsys: pytest.CaptureFixture[str],
    tmp_path: pathlib.Path,
    distortion: tuple[float, ...],
    model: str,
    word: str,
) -> None:
    def fill(bag: BagWriter) -> None:
        bag.camera_info(
            "/camera_info", BEGIN, size=(WIDTH, HEIGHT), focal=10, model=model,
            distortion=distortion,
        )  # fmt: skip
        bag.transform(BEGIN, "map", "optical", (0, 0, 1, 0, 0, 0, 1), "/tf_static")
        bag.image("/depth", BEGIN, depth(), "16UC1")
        bag.detections("/boxes", BEGIN, [])

    path = write(tmp_path, fill)
    line = fail(capsys, path, *BOXES)
    assert word in line and "--rectified" in line
    assert len(run(capsys, path, *BOXES, "--rectified")) == 2


def test_errors_are_told_in_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    path = write(tmp_path, moving_robot)
    boxes = [*TOPICS, "--detections", "/boxes", "--dry-run"]
    for arguments, words in (
        ([tmp_path / "none", *boxes], ["none: no such file"]),
        ([path, *boxes, "--depth", "/no"], ["/no is not in the bag", "/camera_info (sensor_"]),
        ([path, *boxes, "--depth", "/tf"], ["/tf is of type tf2_msgs/msg/TFMessage", "Image"]),
        ([path, *boxes, "--camera-info", "/depth"], ["/depth is of type sensor_msgs/msg/Image"]),
        ([path, *boxes, "--detections", "/tf"], ["/tf is of type", "Detection2DArray"]),
        ([path, *boxes, "--tf", "/no", "--tf-static", "/none"], ["/no is not in the bag"]),
        ([path, *boxes, "--map-frame", "earth"], ["no transform from earth to optical", "base"]),
        ([path, *boxes, "--slop-seconds", "0"], ["no frame could be used: no detections within"]),
        ([path, *boxes, "--labels", tmp_path / "no.yaml"], ["no.yaml"]),
        ([path, *boxes, "--labels", path / "metadata.yaml"], ["metadata.yaml: not a YAML mapping"]),
    ):  # fmt: skip
        line = fail(capsys, *arguments)
        for word in ["hypermap-bag: ", *words]:
            assert word in line


def test_reading_ends_when_it_is_interrupted(tmp_path: pathlib.Path) -> None:
    with Recording([write(tmp_path, moving_robot)], lambda: True) as recording:
        with pytest.raises(InterruptedRunError):
            next(recording.messages(["/tf"]))


def test_masks_and_detections_must_be_of_their_types(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    path = write(tmp_path, moving_robot)
    labels = tmp_path / "labels.yaml"
    labels.write_text("41: cup", encoding="utf-8")
    line = fail(capsys, path, *TOPICS, "--detections", "/depth", "--dry-run")
    assert "/depth is of type sensor_msgs/msg/Image; needed is vision_msgs" in line
    line = fail(capsys, path, *TOPICS, "--masks", "/boxes", "--labels", labels, "--dry-run")
    assert "needed is sensor_msgs/msg/Image" in line


def test_a_camera_must_stay_the_same(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    def fill(bag: BagWriter) -> None:
        moving_robot(bag)
        bag.camera_info("/camera_info", BEGIN + SECOND, size=(WIDTH, HEIGHT), focal=11)

    assert "the camera of /camera_info changes" in fail(capsys, write(tmp_path, fill), *BOXES)


def test_damaged_bags(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, kind: str
) -> None:
    path = write(tmp_path, moving_robot, kind)
    (file,) = path.glob("*.[dm][bc]*") if path.is_dir() else [path]
    whole = file.read_bytes()
    for size in (0, 10, len(whole) // 2):
        file.write_bytes(whole[:size])
        line = fail(capsys, path, *BOXES)
        assert line.startswith(f"hypermap-bag: {path}: ")


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["bag"],
        ["bag", *TOPICS, "--dry-run"],
        ["bag", *TOPICS, "--detections", "/b", "--masks", "/m", "--dry-run"],
        ["bag", *TOPICS, "--detections", "/b"],
        ["bag", *TOPICS, "--detections", "/b", "--dry-run", "--ingest", "127.0.0.1:1"],
        ["bag", *TOPICS, "--masks", "/m", "--dry-run"],
        ["bag", *TOPICS, "--detections", "/b", "--dry-run", "--pose", "/p"],
        ["bag", *TOPICS, "--detections", "/b", "--dry-run", "--mount", "0,0,0,0,0,0,1"],
        ["bag", *BOXES, "--pose", "/p", "--mount", "0,0,0,1"],
        ["bag", *BOXES, "--pose", "/p", "--mount", "0,0,0,0,0,0,2"],
        ["bag", *BOXES, "--slop-seconds", "-1"],
        ["bag", *BOXES, "--slop-seconds", "nan"],
        ["bag", *BOXES, "--queue", "0"],
        ["bag", *BOXES, "--score", "1.5"],
        ["bag", *BOXES, "--pose-sigma", "1,2"],
        ["bag", *BOXES, "--dep", "/d"],
    ],
)
def test_wrong_command_lines(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    (line,) = capsys.readouterr().err.splitlines()
    assert ended.value.code == 2
    assert line.startswith("hypermap-bag: ") and line.endswith("(see hypermap-bag --help)")


def test_text_for_people(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> None:
    def fill(bag: BagWriter) -> None:
        moving_robot(bag)
        bag.image("/depth", BEGIN, depth(), "16UC1")

    options = [option for option in BOXES if option != "--json"]
    assert main([str(write(tmp_path, fill)), *options]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "2020-09-13T12:26:40.100Z at (0.300, 0.000, 1.000): 41 0.75"
    assert lines[2] == "cart: 3 frames: 2 not sent, 1 skipped"
    assert lines[4] == "skipped frames: 1 no detections within the slop"


def test_no_worker(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> None:
    path = write(tmp_path, moving_robot)
    line = fail(capsys, path, *TOPICS, "--detections", "/boxes", "--ingest", "127.0.0.1:1")
    assert line.startswith("hypermap-bag: UNAVAILABLE: ")


def test_without_rosbags_the_extra_is_named(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    line = fail(capsys, write(tmp_path, moving_robot), *BOXES)
    assert line.endswith("pip install 'hypermap-client[bag]'")

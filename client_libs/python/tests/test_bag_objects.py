"""A recorded drive gives the same objects through a bag as through `hypermap-ingest replay`."""

from __future__ import annotations

import dataclasses
import functools
import json
import os
import pathlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from bags import BagWriter
from PIL import Image
from server import BIN, DEADLINE_S, ROOT, Server

from hypermap_client import Client, MapObject
from hypermap_client.bag.transforms import IDENTITY, Pose, make_pose

DATA = pathlib.Path(os.environ.get("HYPERMAP_DATA") or ROOT.parent / "shared" / "data")
OFFICE = DATA / "rgbd" / "office_small"
WORKER = BIN / "hypermap-ingest"
PROGRAM = pathlib.Path(sys.executable).with_name("hypermap-bag")

# Every second frame of the first 80 s of the drive.
END, STRIDE = 400, 2
NUM_FRAMES = 200
SIGMA = "0.005,0.005,0.002"
UNITS_PER_METRE = 5000
# Values of masks are class * DIVISOR + instance.
DIVISOR = 256
# A camera 1.1 m above the robot's base and 0.2 m ahead, which looks ahead.
MOUNT = Pose(np.array([0.2, 0.0, 1.1]), np.array([-0.5, 0.5, -0.5, 0.5]))
# The origin of the odometry, which began 2 m from the map's origin, turned by 0.6 rad.
ODOMETRY = Pose(np.array([2.0, -1.0, 0.0]), np.array([0.0, 0.0, np.sin(0.3), np.cos(0.3)]))
pytestmark = pytest.mark.skipif(
    not OFFICE.exists() or not WORKER.exists(), reason="no recorded drive, or no worker"
)


def run(*arguments: object) -> dict[str, Any]:
    """Runs a program that must succeed, and returns the summary that it prints as JSON."""
    done = subprocess.run(
        [*map(str, arguments)], capture_output=True, text=True, check=False, timeout=DEADLINE_S
    )
    assert done.returncode == 0, done.stderr
    summary: dict[str, Any] = json.loads(done.stdout)
    return summary


class Service:
    """A process `hypermap-ingest serve` on a free port."""

    def __init__(self, server: Server, map_name: str, listen: str = "127.0.0.1:0") -> None:
        self._process = subprocess.Popen(
            [WORKER, "serve", "--listen", listen, "--map", map_name,
             "--server", server.address],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        line = self._process.stdout.readline()
        assert line.startswith("hypermap-ingest ready on "), line
        self.address = line.split()[-1]

    def __enter__(self) -> Service:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()


def rows(name: str) -> Iterator[list[str]]:
    """The lines of a file of the drive, split into words."""
    for line in (OFFICE / name).read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            yield line.split()


def nanoseconds(seconds: str) -> int:
    whole, fraction = seconds.split(".")
    return int(whole) * 10**9 + int(fraction.ljust(9, "0"))


def unpack(counts: str) -> list[int]:
    """Decodes COCO's compressed run lengths."""
    runs: list[int] = []
    value = shift = 0
    for byte in counts.encode():
        value |= (byte - 48 & 0x1F) << shift
        shift += 5
        if not byte - 48 & 0x20:
            if byte - 48 & 0x10:
                value -= 1 << shift
            runs.append(value + runs[-2] if len(runs) > 2 else value)
            value = shift = 0
    return runs


@functools.cache
def label_images() -> tuple[dict[str, np.ndarray], dict[int, str]]:
    """The masks of the drive as label images by file name, and the labels of their classes."""
    coco = json.loads((OFFICE / "detections_clean.json").read_text(encoding="utf-8"))
    numbers = {c["id"]: i for i, c in enumerate(coco["categories"], 1)}
    images = {i["id"]: np.zeros((i["height"], i["width"]), np.uint16) for i in coco["images"]}
    for n, annotation in enumerate(coco["annotations"]):
        image = images[annotation["image_id"]]
        counts = unpack(annotation["segmentation"]["counts"])
        values = np.arange(len(counts)) % 2 == 1
        mask = np.repeat(values, counts).reshape(image.shape, order="F")
        assert not image[mask].any(), "masks overlap, so that no label image can have both"
        image[mask] = numbers[annotation["category_id"]] * DIVISOR + n % DIVISOR
    files = {i["file_name"]: images[i["id"]] for i in coco["images"]}
    return files, {numbers[c["id"]]: c["name"] for c in coco["categories"]}


def boxes(image: np.ndarray) -> Iterator[dict[str, Any]]:
    """The detections of which a label image shows the exact masks."""
    _, labels = label_images()
    for value in np.unique(image[image > 0]):
        pixels = np.argwhere(image == value)
        (top, left), (bottom, right) = pixels.min(axis=0), pixels.max(axis=0)
        yield {
            "class_id": labels[value // DIVISOR], "score": 1.0,
            "x": (left + right + 1) / 2, "width": right + 1 - left,
            "y": (top + bottom + 1) / 2, "height": bottom + 1 - top,
        }  # fmt: skip


def write_drive(path: pathlib.Path, encoding: str, *, has_odometry: bool) -> None:
    """Writes the drive as an MCAP recording whose depth has the given encoding.

    has_odometry: whether the poses are a chain of four frames, as on robots, instead of exactly the
        numbers of the drive.
    """
    masks, _ = label_images()
    poses = {row[0]: [float(n) for n in row[1:]] for row in rows("groundtruth.txt")}
    mount, odometry = (MOUNT, ODOMETRY) if has_odometry else (IDENTITY, IDENTITY)
    with BagWriter(path, "mcap") as bag:
        bag.transform(0, "base", "optical", numbers(mount), "/tf_static")
        for seconds, file in [row[:2] for row in rows("depth.txt")][:END:STRIDE]:
            stamp = nanoseconds(seconds)
            units = np.asarray(Image.open(OFFICE / file)).astype(np.uint16)
            depth = units.astype(np.float32) * np.float32(1 / UNITS_PER_METRE)
            if encoding == "16UC1":
                depth = np.rint(depth * 1000).astype(np.uint16)
            pose = make_pose(poses[seconds][:3], poses[seconds][3:])
            odom_from_base = odometry.inverse() @ pose @ mount.inverse()
            bag.transform(stamp, "map", "odom", numbers(odometry))
            bag.transform(stamp, "odom", "base", numbers(odom_from_base))
            bag.camera_info("/camera_info", stamp, size=(320, 240), focal=262.5)
            bag.image("/depth", stamp, depth, encoding)
            bag.image("/masks", stamp + 3_000_000, masks[file], "16UC1")
            bag.detections("/boxes", stamp, list(boxes(masks[file])))


def numbers(pose: Pose) -> list[float]:
    return [*pose.translation.tolist(), *pose.rotation.tolist()]


def shown(server: Server, map_name: str) -> list[MapObject]:
    """The objects of a map without their ids and versions, in a fixed order."""
    with Client(server.address) as client:
        answer = client.query_area(map_name, [(-99, -99), (99, -99), (99, 99), (-99, 99)])
    objects = [dataclasses.replace(o, id=0, version=0) for o in answer["semantic"].objects]
    return sorted(objects, key=lambda o: (o.label, o.shape.centroid.x))


@pytest.fixture(scope="module")
def replayed(server: Server) -> list[MapObject]:
    """The objects that `hypermap-ingest replay` makes of the drive."""
    summary = run(
        WORKER, "replay", OFFICE, "--server", server.address, "--map", "replayed", "--json",
        "--detections", "detections_clean.json", "--pose_sigma", SIGMA, "--occupancy", "none",
        "--end", END, "--stride", STRIDE,
    )  # fmt: skip
    assert summary["accepted"] == NUM_FRAMES
    return shown(server, "replayed")


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The drive with depth in metres, and poses that are not composed."""
    path = tmp_path_factory.mktemp("bag") / "drive"
    write_drive(path, "32FC1", has_odometry=False)
    return path


@pytest.fixture(scope="module")
def masks(tmp_path_factory: pytest.TempPathFactory) -> list[object]:
    """The options for the masks of the drive."""
    labels = tmp_path_factory.mktemp("labels") / "labels.yaml"
    labels.write_text(json.dumps(label_images()[1]), encoding="utf-8")
    return ["--masks", "/masks", "--labels", labels, "--label-divisor", DIVISOR, "--score", 1]


def command(drive: pathlib.Path, instances: list[object], service: Service) -> list[object]:
    """The command that sends the drive."""
    return [
        PROGRAM, drive, "--depth", "/depth", "--camera-info", "/camera_info", *instances,
        "--pose-sigma", SIGMA, "--ingest", service.address, "--json",
    ]  # fmt: skip


def start(arguments: list[object]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def wait_for_revision(server: Server, map_name: str, revision: int) -> None:
    deadline = time.monotonic() + DEADLINE_S
    with Client(server.address) as client:
        while client.get_map(map_name).revision < revision:
            assert time.monotonic() < deadline
            time.sleep(0.02)


def distances(a: list[MapObject], b: list[MapObject]) -> list[float]:
    """The Hausdorff distances of the shapes of two lists of the same objects, in metres."""
    assert [o.label for o in a] == [o.label for o in b]
    assert [o.attributes for o in a] == [o.attributes for o in b]  # numbers of observations
    return [x.shape.hausdorff_distance(y.shape) for x, y in zip(a, b, strict=True)]


def test_a_drive_gives_exactly_the_same_objects_and_counts_once(
    server: Server, replayed: list[MapObject], drive: pathlib.Path, masks: list[object]
) -> None:
    with Service(server, "same") as service:
        summary = run(*command(drive, masks, service))
        assert (summary["frames"], summary["accepted"]) == (NUM_FRAMES, NUM_FRAMES)
        assert shown(server, "same") == replayed and len(replayed) > 30

        again = run(*command(drive, masks, service))
        assert (again["known"], again["accepted"], again["revision"]) == (NUM_FRAMES, 0, 0)
        assert shown(server, "same") == replayed


def test_a_chain_of_frames_gives_the_same_objects(
    server: Server, replayed: list[MapObject], tmp_path: pathlib.Path, masks: list[object]
) -> None:
    """Composing the transforms map, odom, base, optical rounds the last digits of the poses."""
    write_drive(tmp_path / "drive", "32FC1", has_odometry=True)
    with Service(server, "chain") as service:
        run(*command(tmp_path / "drive", masks, service))
    assert max(distances(replayed, shown(server, "chain"))) < 1e-9


def test_depth_in_millimetres_gives_the_same_objects(
    server: Server, replayed: list[MapObject], tmp_path: pathlib.Path, masks: list[object]
) -> None:
    """The drive has depth in steps of 0.2 mm, 16UC1 in steps of 1 mm.

    Corners of footprints move by up to two cells of 2.5 cm, and no object comes or goes.
    """
    write_drive(tmp_path / "drive", "16UC1", has_odometry=False)
    with Service(server, "millimetres") as service:
        run(*command(tmp_path / "drive", masks, service))
    sent = shown(server, "millimetres")
    assert max(distances(replayed, sent)) < 0.06
    for a, b in zip(replayed, sent, strict=True):
        assert b.existence == pytest.approx(a.existence, abs=1e-3)
        assert b.height.low_m == pytest.approx(a.height.low_m, abs=0.005)
        assert b.height.high_m == pytest.approx(a.height.high_m, abs=0.005)


def test_boxes_give_nearly_the_same_objects(
    server: Server, replayed: list[MapObject], drive: pathlib.Path
) -> None:
    """The worker must take away the background of boxes, which may join two things of a class."""
    with Service(server, "boxes") as service:
        run(*command(drive, ["--detections", "/boxes"], service))
    sent = shown(server, "boxes")
    assert 0.8 * len(replayed) < len(sent) < 1.2 * len(replayed)
    for a in replayed:
        assert any(a.label == b.label and a.shape.intersects(b.shape) for b in sent), a


def test_a_killed_run_is_resumed(
    server: Server, replayed: list[MapObject], drive: pathlib.Path, masks: list[object]
) -> None:
    with Service(server, "killed") as service:
        broken = start(command(drive, masks, service))
        wait_for_revision(server, "killed", 10)
        broken.kill()
        broken.communicate()
        summary = run(*command(drive, masks, service))
    assert summary["known"] > 0
    assert summary["known"] + summary["accepted"] + summary["duplicates"] == NUM_FRAMES
    assert shown(server, "killed") == replayed


def test_an_interrupted_run_waits_for_acknowledgements(
    server: Server, drive: pathlib.Path, masks: list[object]
) -> None:
    with Service(server, "interrupted") as service:
        process = start(command(drive, masks, service))
        wait_for_revision(server, "interrupted", 5)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=DEADLINE_S)
        summary = json.loads(out)
        assert (process.returncode, summary["interrupted"]) == (1, True)
        assert "interrupted" in err and len(err.splitlines()) == 1
        again = run(*command(drive, masks, service))
    assert again["known"] == summary["accepted"] < NUM_FRAMES


def test_a_run_waits_while_the_worker_restarts(
    server: Server, replayed: list[MapObject], drive: pathlib.Path, masks: list[object]
) -> None:
    with Service(server, "restarted") as service:
        process = start(command(drive, masks, service))
        wait_for_revision(server, "restarted", 10)
    with Service(server, "restarted", listen=service.address):
        out, err = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 0, err
    summary = json.loads(out)
    assert summary["accepted"] + summary["duplicates"] == NUM_FRAMES
    assert shown(server, "restarted") == replayed

"""A recorded drive gives the same objects through a bag as through `hypermap-ingest replay`."""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from bags import BagWriter
from PIL import Image
from server import BIN, DEADLINE_S, ROOT, Server

from hypermap_client import Client

DATA = pathlib.Path(os.environ.get("HYPERMAP_DATA") or ROOT.parent / "shared" / "data")
OFFICE = DATA / "rgbd" / "office_small"
WORKER = BIN / "hypermap-ingest"
PROGRAM = pathlib.Path(sys.executable).with_name("hypermap-bag")

# Every second frame of the first 80 s of the drive.
END, STRIDE = 400, 2
SIGMA = "0.005,0.005,0.002"
UNITS_PER_METRE = 5000
# Values of masks are class * DIVISOR + instance.
DIVISOR = 256
# The driven robot's camera: 1.1 m up and 0.2 m ahead, looking ahead. Optical axes: x right, y down.
MOUNT = (0.2, 0.0, 1.1, -0.5, 0.5, -0.5, 0.5)

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

    def __init__(self, server: Server, map_name: str) -> None:
        self._process = subprocess.Popen(
            [WORKER, "serve", "--listen", "127.0.0.1:0", "--map", map_name,
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


def write_drive(path: pathlib.Path, encoding: str) -> None:
    """Writes the drive as an MCAP recording whose depth has the given encoding."""
    masks, _ = label_images()
    poses = {row[0]: row[1:] for row in rows("groundtruth.txt")}
    with BagWriter(path, "mcap") as bag:
        bag.transform(0, "camera", "optical", (0, 0, 0, 0, 0, 0, 1), "/tf_static")
        for seconds, file in [row[:2] for row in rows("depth.txt")][:END:STRIDE]:
            stamp = nanoseconds(seconds)
            units = np.asarray(Image.open(OFFICE / file)).astype(np.uint16)
            depth = units.astype(np.float32) * np.float32(1 / UNITS_PER_METRE)
            if encoding == "16UC1":
                depth = np.rint(depth * 1000).astype(np.uint16)
            bag.transform(stamp, "map", "camera", poses[seconds])
            bag.camera_info("/camera_info", stamp, size=(320, 240), focal=262.5)
            bag.image("/depth", stamp, depth, encoding)
            bag.image("/masks", stamp + 3_000_000, masks[file], "16UC1")


def shown(server: Server, map_name: str) -> list[Any]:
    """The objects of a map without their ids and versions, in a fixed order."""
    with Client(server.address) as client:
        answer = client.query_area(map_name, [(-99, -99), (99, -99), (99, 99), (-99, 99)])
    return sorted(answer["semantic"].objects, key=lambda o: (o.label, o.shape.centroid.x))


@pytest.fixture(scope="module")
def replayed(server: Server) -> list[Any]:
    """The objects that `hypermap-ingest replay` makes of the drive."""
    summary = run(
        WORKER, "replay", OFFICE, "--server", server.address, "--map", "replayed", "--json",
        "--detections", "detections_clean.json", "--pose_sigma", SIGMA, "--occupancy", "none",
        "--end", END, "--stride", STRIDE,
    )  # fmt: skip
    assert summary["accepted"] == END / STRIDE
    return shown(server, "replayed")


def send_drive(
    server: Server, folder: pathlib.Path, encoding: str, map_name: str
) -> dict[str, Any]:
    write_drive(folder / "drive", encoding)
    labels = folder / "labels.yaml"
    labels.write_text(json.dumps(label_images()[1]), encoding="utf-8")
    with Service(server, map_name) as service:
        return run(
            PROGRAM, folder / "drive", "--depth", "/depth", "--camera-info", "/camera_info",
            "--masks", "/masks", "--labels", labels, "--label-divisor", DIVISOR, "--score", 1,
            "--pose-sigma", SIGMA, "--ingest", service.address, "--json",
        )  # fmt: skip


def test_depth_in_metres(server: Server, replayed: list[Any], tmp_path: pathlib.Path) -> None:
    summary = send_drive(server, tmp_path, "32FC1", "metres")
    print(summary)
    sent = shown(server, "metres")
    for a, b in zip(replayed, sent, strict=False):
        print(a, b)
    assert len(sent) == len(replayed)

"""What a robot detects comes through hypermap-ros2 and an ingest worker to the map, and gives the
objects that `hypermap-ingest replay` makes of the same drive."""

import json
import pathlib
import subprocess
import tempfile
import unittest

import dds_types as dds
import drives
import recordings
import rpc
from nodes import BEST_EFFORT, RELIABLE, Bridge, Node, await_condition
from processes import BIN, DATA, DEADLINE_S, Server, lasting_port

WORKER = BIN / "hypermap-ingest"
OFFICE = DATA / "rgbd" / "office_small"
SIGMA = "0.005,0.005,0.002"
# Frames that are published before all of them must have arrived.
BURST = 5
MASK_DELAY_NS = 3_000_000


class Service:
    """A process `hypermap-ingest serve`. The end of the `with` block kills it."""

    def __init__(self, server, map_name, listen="127.0.0.1:0"):
        self._process = subprocess.Popen(
            [WORKER, "serve", "--server", server.address, "--map", map_name, "--listen", listen],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
        line = self._process.stdout.readline()
        assert line.startswith("hypermap-ingest ready on "), line
        self.address = line.split()[-1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.communicate()


class Camera:
    """A robot's camera and its detector as a node."""

    def __init__(self, drive, qos=RELIABLE):
        self._drive = drive
        node = Node()
        self.depth = node.publisher("/depth", dds.Image, qos)
        self._info = node.publisher("/camera_info", dds.CameraInfo, qos)
        self._masks = node.publisher("/masks", dds.Image, qos)
        self._boxes = node.publisher("/boxes", dds.Detection2DArray, qos)
        self._tf = node.publisher("/tf", dds.TFMessage, qos)
        self._mount = node.publish("/tf_static", dds.TFMessage, dds.TFMessage(
            [drives.transform(0, "base", "optical", [0.0, 0, 0, 0, 0, 0, 1])]))
        self._readers = 2 if qos is RELIABLE else 1

    def await_bridge(self, is_boxes=False):
        for topic in (self.depth, self._info, self._boxes if is_boxes else self._masks, self._tf):
            topic.await_subscribers(self._readers)

    def publish(self, frame, is_boxes=False):
        """The pose comes after the images, and masks are a little later by their stamp."""
        stamp = frame.stamp_ns
        self._info.write(self._drive.camera_info(stamp))
        self.depth.write(drives.image(stamp, frame.metres, "32FC1"))
        if is_boxes:
            self._boxes.write(drives.detections(stamp, frame.numbers))
        else:
            self._masks.write(drives.image(stamp + MASK_DELAY_NS, frame.numbers, "16UC1"))
        self._tf.write(dds.TFMessage([drives.transform(stamp, "map", "base", frame.pose)]))


class DetectionsTest(unittest.TestCase):
    """A stretch of the rendered drive, or of a small one of a box where that is missing."""

    @classmethod
    def setUpClass(cls):
        if not WORKER.exists():
            raise unittest.SkipTest("built without the worker")
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.server = cls.enterClassContext(Server(cls.folder / "data"))
        cls.client = cls.enterClassContext(rpc.Client(cls.server.address))
        stretch = {"end": 120, "stride": 2} if OFFICE.exists() else {"end": 20, "stride": 1}
        if OFFICE.exists():
            folder, detections = OFFICE, "detections_clean.json"
        else:
            folder = recordings.Recording(cls.folder / "drive", 20).write()
            detections = "detections.json"
        cls.drive = drives.Drive(folder, detections, **stretch)
        cls.labels = cls.folder / "labels.yaml"
        cls.labels.write_text("".join(f"{number}: {label}\n"
                                      for number, label in cls.drive.labels.items()))
        cls.replay_flags = ["--end", str(stretch["end"]), "--stride", str(stretch["stride"])]
        cls.replayed = cls.replay(folder, detections, "replayed")
        boxes = cls.folder / "boxes.json"
        boxes.write_text(drives.boxes_as_coco(cls.drive))
        cls.replayed_boxes = cls.replay(folder, boxes, "replayed_boxes")

    @classmethod
    def replay(cls, folder, detections, map_name):
        """Replays the stretch, and returns the objects."""
        summary = json.loads(subprocess.run(
            [WORKER, "replay", folder, "--server", cls.server.address, "--map", map_name, "--json",
             "--detections", detections, "--pose_sigma", SIGMA, "--occupancy", "none",
             *cls.replay_flags],
            check=True, capture_output=True, text=True, timeout=DEADLINE_S).stdout)
        assert summary["accepted"] == len(cls.drive), summary
        return cls.shown(map_name)

    @classmethod
    def shown(cls, map_name):
        """The objects of a map without their ids, in a fixed order."""
        lines = cls.server.json_lines("query", "area", map_name, "-99,-99", "99,-99", "99,99",
                                      "-99,99")
        objects = [line["entity"] for line in lines if line.get("layer") == "semantic"]
        for entity in objects:
            del entity["id"]
        return sorted(objects, key=lambda e: json.dumps(e, sort_keys=True))

    def bridge(self, worker, *flags):
        return self.enterContext(Bridge(
            self.server.address, f"--ingest={worker}", "--camera_robot=cart", "--depth=/depth",
            "--camera_info=/camera_info", f"--pose_sigma={SIGMA}", *flags))

    def mask_flags(self):
        return ("--masks=/masks", f"--labels={self.labels}",
                f"--label_divisor={drives.DIVISOR}", "--score=1")

    def known(self, worker):
        """The number of frames of the camera that the layer has, as its worker tells."""
        with rpc.Client(worker) as client:
            opened = next(client.StreamFrames([recordings.opening("cart")])).opened
            return sum(k.last - k.first + 1 for k in opened.known)

    def await_frames(self, worker, count):
        await_condition(lambda: self.known(worker) >= count, f"not {count} frames have arrived")

    def send(self, camera, frames, worker, num_before=0, is_boxes=False):
        """Publishes frames, no faster than they arrive."""
        for i, frame in enumerate(frames, num_before + 1):
            camera.publish(frame, is_boxes)
            if i % BURST == 0:
                self.await_frames(worker, i)
        self.await_frames(worker, num_before + len(frames))

    def test_masks_give_the_objects_of_a_replay(self):
        with Service(self.server, "masks") as service:
            bridge = self.bridge(service.address, *self.mask_flags())
            camera = Camera(self.drive)
            camera.await_bridge()
            self.send(camera, list(self.drive), service.address)
            self.assertEqual(bridge.end(), 0)
        self.assertEqual(self.shown("masks"), self.replayed)
        self.assertGreaterEqual(len(self.replayed), 1)

    def test_boxes_give_the_objects_of_a_replay(self):
        with Service(self.server, "boxes") as service:
            self.bridge(service.address, "--detections=/boxes", f"--labels={self.labels}")
            camera = Camera(self.drive)
            camera.await_bridge(is_boxes=True)
            self.send(camera, list(self.drive), service.address, is_boxes=True)
        self.assertEqual(self.shown("boxes"), self.replayed_boxes)

    def test_frames_that_a_worker_has_not_acknowledged_come_after_its_restart(self):
        frames = list(self.drive)
        half = len(frames) // 2
        listen = f"127.0.0.1:{lasting_port()}"
        camera = Camera(self.drive)
        with Service(self.server, "restarted", listen):
            self.bridge(listen, *self.mask_flags())
            camera.await_bridge()
            self.send(camera, frames[:half], listen)
        for frame in frames[half:half + BURST]:
            camera.publish(frame)
        with Service(self.server, "restarted", listen):
            self.await_frames(listen, half + BURST)
            self.send(camera, frames[half + BURST:], listen, half + BURST)
        self.assertEqual(self.shown("restarted"), self.replayed)

    def test_messages_that_cannot_be_used_are_told_and_skipped(self):
        first, second, *_ = self.drive
        mask_stamp = first.stamp_ns + MASK_DELAY_NS
        with Service(self.server, "wrong") as service:
            bridge = self.bridge(service.address, *self.mask_flags())
            camera = Camera(self.drive)
            broken = Node().publisher("/depth", dds.BrokenImage)
            broken.await_subscribers(2)
            camera.await_bridge()
            broken.write(dds.BrokenImage(drives.header(mask_stamp), 1 << 31, 1 << 31))
            for array, encoding in ((first.metres[1:], "32FC1"), (first.metres, "bgr8")):
                # Nearer to the mask in time than the right image.
                camera.depth.write(drives.image(mask_stamp, array, encoding))
                camera.publish(first)
            camera.publish(second)
            self.await_frames(service.address, 1)
            for told in ("a message is skipped", "a frame is skipped"):
                self.assertIn(told, bridge.log())

    def test_publishers_may_be_best_effort(self):
        frame = next(iter(self.drive))
        with Service(self.server, "lossy") as service:
            self.bridge(service.address, *self.mask_flags())
            camera = Camera(self.drive, BEST_EFFORT)
            camera.await_bridge()

            def arrives():
                frame.stamp_ns += 10**8  # Any of them may be lost.
                camera.publish(frame)
                return self.known(service.address) > 0
            await_condition(arrives, "no frame has arrived")

    def test_options_that_do_not_belong_together_are_refused(self):
        def run(*flags):
            return subprocess.run([BIN / "hypermap-ros2", "--localhost", *flags], check=False,
                                  capture_output=True, text=True, timeout=DEADLINE_S)
        camera = ("--ingest=127.0.0.1:1", "--camera_robot=r", "--depth=/d", "--camera_info=/i")
        for flags, word in (
                ((), "--map"), (camera, "--detections or --masks"),
                (("--map=site", "--depth=/d"), "--ingest"), (camera[:3], "--camera_info"),
                ((*camera, "--masks=/m"), "--labels"),
                ((*camera, "--detections=/b", "--robot=r=/pose"), "--map"),
                ((*camera, "--detections=/b", "--labels=/none"), "/none"),
                ((*camera, "--detections=/b", "--pose_sigma=1,2"), "--pose_sigma")):
            done = run(*flags)
            self.assertNotEqual(done.returncode, 0, flags)
            self.assertIn(word, done.stderr, flags)


if __name__ == "__main__":
    unittest.main()

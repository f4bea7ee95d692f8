"""Tests of hypermap-ingest as a process. It sends recorded drives and streams of robots to a real
server."""

import base64
import json
import math
import queue
import signal
import subprocess
import sys
import threading
import time
import unittest

import grpc
import numpy
from google.protobuf import json_format
from hypermap.v1 import frame_service_pb2

import fused
import recordings
import rpc
from processes import BIN, DATA, DEADLINE_S, ROOT, SiteTest

sys.path.append(str(ROOT / "tests" / "attack"))
import http2  # pylint: disable=wrong-import-position

WORKER = BIN / "hypermap-ingest"
OFFICE = DATA / "rgbd" / "office_small"
# The frames of a test: with all 670 of them it would take too long.
OFFICE_PART = ("--end", 200)


def start(*arguments, server):
    return subprocess.Popen([WORKER, *map(str, arguments), "--server", server.address],
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


def finish(process):
    """Waits until a process has ended and returns (exit code, stdout, stderr)."""
    try:
        out, err = process.communicate(timeout=DEADLINE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        raise
    return process.returncode, out, err


def drift(pose):
    """Returns a pose (x, y, z, qx, qy, qz, qw) turned by 0.3 rad about the z axis and moved."""
    x, y, z, *q = pose
    s, c = math.sin(0.3), math.cos(0.3)
    return (c * x - s * y + 0.7, s * x + c * y - 0.4, z,
            *multiply((0.0, 0.0, math.sin(0.15), math.cos(0.15)), q))


def multiply(p, q):
    """The product of two quaternions (x, y, z, w)."""
    vector = p[3] * numpy.array(q[:3]) + q[3] * numpy.array(p[:3]) + numpy.cross(p[:3], q[:3])
    return (*vector, p[3] * q[3] - numpy.dot(p[:3], q[:3]))


@unittest.skipUnless(WORKER.exists(), "built without the worker")
class WorkerTest(SiteTest):

    def recording(self, count, name="drive"):
        return recordings.Recording(self.folder / name, count)

    def replay(self, folder, *flags, server, map_name="site"):
        """Replays a recording, which must succeed, and returns the summary that it prints."""
        process = start("replay", folder, "--map", map_name, "--json", *flags, server=server)
        code, out, err = finish(process)
        self.assertEqual(code, 0, err)
        return json.loads(out)

    def shown(self, server, map_name="site", layer="semantic"):
        """Returns the objects of a layer without their ids, in a fixed order."""
        lines = server.json_lines("query", "area", map_name, "-99,-99", "99,-99", "99,99",
                                  "-99,99")
        entities = [line["entity"] for line in lines if line.get("layer") == layer]
        for entity in entities:
            del entity["id"]
        return sorted(entities, key=lambda e: json.dumps(e, sort_keys=True))

    def wait_until(self, condition):
        deadline = time.monotonic() + DEADLINE_S
        while not condition():
            self.assertLess(time.monotonic(), deadline, "the condition did not become true in time")

    def revision(self, server, map_name="site"):
        """Returns the newest revision of a map, or 0 if there is no such map."""
        entries = server.json("maps")["maps"]
        return next((e["revision"] for e in entries if e["name"] == map_name), 0)


class Replay(WorkerTest):

    def test_a_replayed_drive_puts_its_box_on_the_map(self):
        server = self.server()
        summary = self.replay(self.recording(20).write(), server=server)
        self.assertEqual((summary["frames"], summary["accepted"], summary["skipped"]), (20, 20, 0))
        self.assertEqual((summary["instances"], summary["detections"]), (20, 20))
        self.assertEqual(summary["revision"], self.revision(server))
        (box,) = self.shown(server)
        self.assertEqual(box["label"], "box")
        (x0, y0), (x1, y1), height = recordings.BOX
        self.assertAlmostEqual(box["centroid"][0], (x0 + x1) / 2, delta=0.1)
        self.assertAlmostEqual(box["centroid"][1], (y0 + y1) / 2, delta=0.1)
        self.assertAlmostEqual(box["height"][1], height, delta=0.05)

    def test_replaying_a_drive_again_changes_nothing(self):
        server, folder = self.server(), self.recording(12).write()
        self.replay(folder, server=server)
        before, revision = self.shown(server), self.revision(server)
        summary = self.replay(folder, server=server)
        self.assertEqual((summary["known"], summary["accepted"]), (12, 0))
        self.assertEqual(self.shown(server), before)
        self.assertEqual(self.revision(server), revision)

    def test_a_killed_replay_can_be_resumed(self):
        server, folder = self.server(), self.recording(40).write()
        self.replay(folder, server=server, map_name="unbroken")
        for _ in range(2):
            begun = self.revision(server)
            process = start("replay", folder, "--map", "site", "--rate", 1, server=server)
            self.wait_until(lambda: self.revision(server) > begun + 5)
            process.kill()
            finish(process)
        summary = self.replay(folder, server=server)
        self.assertGreater(summary["known"], 0)
        self.assertGreater(summary["accepted"], 0)
        self.assertEqual(summary["known"] + summary["accepted"] + summary["duplicates"], 40)
        self.assertEqual(self.shown(server), self.shown(server, "unbroken"))

    def test_an_interrupted_worker_waits_for_acknowledgements(self):
        server, folder = self.server(), self.recording(40).write()
        process = start("replay", folder, "--map", "site", "--rate", 1, "--json", server=server)
        self.wait_until(lambda: self.revision(server) > 5)
        process.send_signal(signal.SIGINT)
        code, out, err = finish(process)
        self.assertEqual(code, 1)
        self.assertIn("interrupted", err)
        summary = json.loads(out)
        self.assertTrue(summary["interrupted"])
        self.assertTrue(0 < summary["accepted"] < 40, summary)
        again = self.replay(folder, server=server)
        self.assertEqual(again["known"], summary["accepted"])
        self.assertEqual(again["known"] + again["accepted"], 40)

    def test_the_worker_waits_while_the_server_restarts(self):
        server, folder = self.server(), self.recording(40).write()
        self.replay(folder, server=server, map_name="unbroken")
        process = start("replay", folder, "--map", "site", "--rate", 4, "--json", server=server)
        self.wait_until(lambda: self.revision(server) > 5)
        server.kill()
        server = self.server(f"--listen=127.0.0.1:{server.port}")
        code, out, err = finish(process)
        self.assertEqual(code, 0, err)
        summary = json.loads(out)
        self.assertEqual(summary["known"] + summary["accepted"] + summary["duplicates"], 40)
        self.assertEqual(self.shown(server), self.shown(server, "unbroken"))

    def test_two_robots_make_the_same_objects_as_one(self):
        server, folder = self.server(), self.recording(40).write()
        self.replay(folder, server=server, map_name="one")
        halves = [start("replay", folder, "--map", "site", "--robot", f"robot{i}", "--first", i,
                        "--stride", 2, "--json", server=server) for i in range(2)]
        for half in halves:
            code, out, err = finish(half)
            self.assertEqual(code, 0, err)
            self.assertEqual(json.loads(out)["accepted"], 20)
        self.assertEqual(self.shown(server), self.shown(server, "one"))

    def test_invalid_frames_are_counted_and_do_not_affect_others(self):
        recording = self.recording(20)
        recording.depth[2] = b"no image"
        recording.depth[3] = recordings.png(recording.frames[3].millimetres[:10])
        recording.depth[4] = recordings.png(recording.frames[4].millimetres * 0)
        recording.poses[5] = (float("nan"), *recording.poses[5][1:])
        recording.poses[6] = (*recording.poses[6][:3], 0, 0, 0, 0)
        recording.annotations[7]["segmentation"]["counts"] = [5, 99999999]
        recording.annotations[8]["category_id"] = 99
        recording.annotations[9]["segmentation"]["size"] = [9, 9]
        recording.annotations += [dict(recording.annotations[10], score=0.1)] * 10_000
        server = self.server()
        summary = self.replay(recording.write(), server=server)
        self.assertEqual(summary["accepted"], 15)
        self.assertEqual(summary["skipped_frames"], {
            "bad depth image": 2, "depth image without any depth": 1, "bad pose": 2})
        self.assertEqual(summary["skipped_input"], {
            "bad line of the trajectory": 2, "unknown category": 1})
        self.assertEqual(summary["skipped_instances"]["broken mask"], 2)
        self.assertGreaterEqual(
            summary["skipped_instances"]["detection beyond the limit of a frame"], 9_700)
        self.assertIn("box", [entity["label"] for entity in self.shown(server)])

    def correct(self, drive, server, *flags):
        """Replays a drive with its true poses and with estimated ones, and corrects the latter. What
        the two maps show must be equal, to the last bit. Returns what the correction prints."""
        for name, poses in (("true", "groundtruth.txt"), ("estimated", "estimated.txt")):
            self.replay(drive, "--poses", poses, "--robot", "drive", "--exploration", "explored",
                        *flags, server=server, map_name=name)
        client = self.enterContext(rpc.Client(server.address))
        expected = fused.shown(client, "true", ("semantic", "explored"))
        self.assertGreater(min(map(len, expected)), 0)
        self.assertNotEqual(fused.shown(client, "estimated", ("semantic", "explored")), expected)
        code, out, err = finish(start("correct", drive / "groundtruth.txt", "--map", "estimated",
                                      "--robot", "drive", server=server))
        self.assertEqual(code, 0, err)
        corrected = fused.shown(client, "estimated", ("semantic", "explored"))
        self.assertEqual(len(corrected[0]), len(expected[0]))
        self.assertTrue(corrected[0] == expected[0], "other objects")
        self.assertTrue(corrected[1] == expected[1], "other cells")
        return out

    @unittest.skipUnless(OFFICE.exists(), "the recorded drive is missing")
    def test_the_recorded_drive_is_corrected_to_the_last_bit(self):
        self.correct(OFFICE, self.server(), "--detections", "detections_noisy.json", *OFFICE_PART)

    def test_a_rendered_drive_is_corrected_to_the_last_bit(self):
        drive = self.folder / "rendered"
        subprocess.run([BIN / "render_sequence", drive, "--seed=1", "--every=12"], check=True,
                       capture_output=True)
        self.correct(drive, self.server(), "--detections", "detections_noisy.json")

    def test_poses_that_are_found_out_later_correct_the_map(self):
        server = self.server()
        recording = self.recording(20)
        # Between the stamps of the frames, so that poses are interpolated; but for the last.
        recording.stamps = [f"{float(f.stamp) - 0.07 * (f is not recording.frames[-1]):.6f}"
                            for f in recording.frames]
        truth = recording.write()
        (truth / "estimated.txt").write_text("".join(
            " ".join([stamp, *map(str, drift(pose))]) + "\n"
            for stamp, pose in zip(recording.stamps, recording.poses)), encoding="utf-8")
        poses = truth / "groundtruth.txt"
        out = self.correct(truth, server)
        self.assertIn(f"revision {self.revision(server, 'estimated')}", out)
        for arguments, word in (((poses, "--robot", "other"), "NOT_FOUND"),
                                ((truth / "depth.txt", "--robot", "drive"), "trajectory")):
            code, out, err = finish(start("correct", *arguments, "--map", "estimated",
                                          server=server))
            self.assertEqual((code, out), (1, ""))
            self.assertIn(word, err)

    def test_explored_floor_is_marked_in_the_named_layer(self):
        server = self.server()
        self.replay(self.recording(10).write(), "--exploration", "explored", server=server)
        lines = server.json_lines("query", "value", "site", "explored")
        cells = sum(end - begin for line in lines if "runs" in line
                    for _, begin, end, _ in line["runs"])
        self.assertGreater(cells * 0.05 ** 2, 1.0, "square metres")

    def test_errors_are_reported_in_one_line(self):
        server, folder = self.server(), self.recording(2).write()
        for arguments, code, word in (
                (["replay", folder], 2, "--map"),
                (["replay", folder, "--map", "m", "--fusion", "magic"], 2, "--fusion"),
                (["replay", folder, "--map", "m", "--pose_sigma", "1,2"], 2, "pose_sigma"),
                (["replay", self.folder / "none", "--map", "m"], 1, "camera.yaml"),
                (["replay", folder, "--map", "m", "--poses", "none.txt"], 1, "none.txt"),
                (["replay", folder, "--map", "m", "--occupancy", "no.yaml"], 1, "no.yaml"),
                (["replay", folder, "--map", "no map"], 1, "map")):
            got, out, err = finish(start(*arguments, server=server))
            self.assertEqual((got, out, len(err.splitlines())), (code, "", 1), err)
            self.assertIn(word, err)
        server.stop()
        got, _, err = finish(start("replay", folder, "--map", "m", server=server))
        self.assertEqual(got, 1)
        self.assertIn("UNAVAILABLE", err)

    @unittest.skipUnless(OFFICE.exists(), "the recorded drive is missing")
    def test_the_beginning_of_the_recorded_drive(self):
        server = self.server()
        for fusion in ("evidence", "paper"):
            summary = self.replay(OFFICE, "--detections", "detections_noisy.json", "--poses",
                                  "estimated.txt", "--end", 20, "--fusion", fusion, server=server,
                                  map_name=fusion)
            self.assertEqual((summary["frames"], summary["accepted"]), (20, 20))
            self.assertGreater(len(self.shown(server, fusion)), 0, fusion)


class Service:
    """A process `hypermap-ingest serve` on a free port."""

    def __init__(self, server, *flags):
        self._process = start("serve", "--listen", "127.0.0.1:0", "--map", "site", *flags,
                              server=server)
        line = self._process.stdout.readline()
        assert line.startswith("hypermap-ingest ready on "), finish(self._process)
        self.address = line.split()[-1]

    def running(self):
        return self._process.poll() is None

    def peak_memory(self):
        """Returns the most bytes of memory that the process had in RAM so far."""
        with open(f"/proc/{self._process.pid}/status", encoding="utf-8") as status:
            (line,) = (line for line in status if line.startswith("VmHWM:"))
        return int(line.split()[1]) << 10

    def stop(self):
        self._process.send_signal(signal.SIGTERM)
        return finish(self._process)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()


def send(client, requests):
    """Sends all requests. Returns the answer to the opening, and {sequence: [acknowledgement]}."""
    opened, answers = None, {}
    for response in client.StreamFrames(requests):
        if response.HasField("opened"):
            opened = response.opened
        for acknowledgement in response.acknowledgements:
            answers.setdefault(acknowledgement.sequence, []).append(acknowledgement)
    return opened, answers


def varint(number):
    """Encodes a number as protobuf does."""
    encoded = bytearray()
    while number >= 128:
        encoded.append(number & 127 | 128)
        number >>= 7
    return bytes([*encoded, number])


class Serve(WorkerTest):

    def setUp(self):
        super().setUp()
        self.hypermapd = self.server()
        self.frames = [recordings.render(i, 20) for i in range(20)]

    def service(self, *flags):
        return self.enterContext(Service(self.hypermapd, *flags))

    def client(self, service):
        return self.enterContext(rpc.Client(service.address))

    def outcomes(self, answers):
        return {sequence: [a.outcome for a in found] for sequence, found in answers.items()}

    def test_frames_of_two_robots_become_one_box(self):
        client, results = self.client(self.service()), [None, None]

        def drive(i):
            requests = [recordings.opening(f"robot{i}")] + [
                recordings.request(self.frames[n], n) for n in range(i, 20, 2)]
            results[i] = send(client, requests)

        robots = [threading.Thread(target=drive, args=(i,)) for i in range(2)]
        for robot in robots:
            robot.start()
        for robot in robots:
            robot.join()
        for i, (_, answers) in enumerate(results):
            self.assertEqual(self.outcomes(answers), {n: [1] for n in range(i, 20, 2)})
            self.assertTrue(all(a.revision > 0 for found in answers.values() for a in found))
        (box,) = self.shown(self.hypermapd)
        self.assertEqual(box["label"], "box")

    def test_repeated_frames_count_once(self):
        client = self.client(self.service())
        requests = [recordings.opening("cart")] + [
            recordings.request(frame, i) for i, frame in enumerate(self.frames[:6])]
        send(client, requests)
        before = self.shown(self.hypermapd)
        opened, answers = send(client, requests)
        self.assertEqual([(known.first, known.last) for known in opened.known], [(0, 5)])
        self.assertEqual(self.outcomes(answers), {n: [2] for n in range(6)})
        self.assertEqual(self.shown(self.hypermapd), before)

    def test_an_invalid_frame_does_not_affect_others(self):
        client = self.client(self.service())
        requests = [recordings.request(frame, i) for i, frame in enumerate(self.frames[:6])]
        requests[1]["frame"]["pose"]["qw"] = 5
        requests[2]["frame"]["pose"]["x"] = "NaN"
        requests[3]["frame"]["millimetres"] = "AAAA"
        requests[4]["frame"]["instances"].append(
            {"scores": [{"label": "box", "score": 0.5}], "runs": {"counts": [7]}})
        _, answers = send(client, [recordings.opening("cart"), *requests])
        self.assertEqual(self.outcomes(answers), {0: [1], 1: [4], 2: [4], 3: [4], 4: [1], 5: [1]})
        self.assertIn("millimetres", answers[3][0].message)
        self.assertEqual(answers[4][0].bad_instances, 1)

    def test_a_full_queue_drops_the_oldest_only_when_the_robot_says_so(self):
        client = self.client(self.service("--queue", 1))
        requests = [recordings.request(frame, i) for i, frame in enumerate(self.frames)]
        _, answers = send(client, [recordings.opening("patient"), *requests])
        self.assertEqual(self.outcomes(answers), {n: [1] for n in range(20)})
        _, answers = send(client, [recordings.opening("hasty", drop_oldest=True), *requests])
        outcomes = self.outcomes(answers)
        self.assertEqual(set(outcomes), set(range(20)), "dropped frames must be acknowledged too")
        self.assertTrue(all(found in ([1], [6]) for found in outcomes.values()), outcomes)
        self.assertEqual(outcomes[19], [1], "the newest frame must not be dropped")

    def test_an_invalid_opening_ends_the_stream(self):
        client = self.client(self.service())
        for requests in ([], [recordings.request(self.frames[0], 0)], [recordings.opening("")],
                         [{"opening": {"robot": "cart", "camera": {"width": 1 << 30}}}]):
            with self.assertRaises(grpc.RpcError) as raised:
                send(client, requests)
            self.assertEqual(raised.exception.code(), grpc.StatusCode.INVALID_ARGUMENT)

    def refused(self, client, requests):
        """Sends requests that must end the stream. Returns (status code, message)."""
        with self.assertRaises(grpc.RpcError) as raised:
            send(client, requests)
        return raised.exception.code(), raised.exception.details()

    def test_b9_frames_that_would_take_too_much_memory_are_refused(self):
        client = self.client(self.service("--memory_limit", 1 << 30))
        huge = recordings.opening("cart")
        huge["opening"]["camera"].update(width=4096, height=4096)
        code, message = self.refused(client, [huge])
        self.assertEqual(code, grpc.StatusCode.RESOURCE_EXHAUSTED)
        self.assertIn("--memory_limit", message)
        opened, _ = send(client, [recordings.opening("cart")])
        self.assertIsNotNone(opened)

    def test_b9_cameras_beyond_sense_are_refused_by_the_name_of_the_field(self):
        service = self.service()
        client = self.client(service)
        for field, value in (("width", 16384), ("height", -1), ("fx", 1e-300), ("fx", 1e-38),
                             ("fx", 1e308), ("fy", 1e-12), ("fy", "NaN"), ("cx", 1e300),
                             ("cy", "-Infinity"), ("distortion", [1e300]),
                             ("distortion", [0, "NaN"])):
            with self.subTest(field, value=value):
                opening = recordings.opening("cart")
                opening["opening"]["camera"][field] = value
                code, message = self.refused(
                    client, [opening, recordings.request(self.frames[0], 0)])
                self.assertEqual(code, grpc.StatusCode.INVALID_ARGUMENT)
                self.assertRegex(message, rf"^opening\.camera\.{field}\S* is .*must lie in")
        # Extreme numbers that a camera may have do no harm.
        for i, camera in enumerate(({"fx": 1, "fy": 1}, {"fx": 1e6}, {"cx": -1e6},
                                    {"distortion": [1e6, -1e6, 1e6, 1e6, -1e6]})):
            opening = recordings.opening(f"odd{i}")
            opening["opening"]["camera"].update(camera)
            _, answers = send(client, [opening, recordings.request(self.frames[0], 0)])
            self.assertEqual(set(answers), {0}, camera)
        self.assertTrue(service.running())
        _, answers = send(client, [recordings.opening("cart"),
                                   recordings.request(self.frames[0], 0)])
        self.assertEqual(self.outcomes(answers), {0: [1]})

    def test_b9_a_small_message_with_large_masks_is_refused_before_they_are_decoded(self):
        side, limit = 2000, 1 << 30
        service = self.service("--memory_limit", limit)
        opening = recordings.opening("cart")
        opening["opening"]["camera"].update(width=side, height=side)
        requests = [opening]
        for sequence, masks in enumerate((254, 1)):
            request = recordings.request(self.frames[0], sequence)
            del request["frame"]["millimetres"]
            depth = numpy.full((side, side), 1000, numpy.uint16)
            request["frame"]["png"] = {"png": base64.b64encode(recordings.png(depth)).decode()}
            request["frame"]["instances"] = masks * [
                {"scores": [{"label": "box", "score": 0.9}], "runs": {"counts": [0, side * side]}}]
            requests.append(request)
        _, answers = send(self.client(service), requests)
        self.assertEqual(self.outcomes(answers), {0: [4], 1: [1]})
        self.assertIn("--memory_limit", answers[0][0].message)
        self.assertLess(service.peak_memory(), limit // 2)
        self.assertEqual(service.stop()[0], 0)

    def test_b9_a_message_of_empty_instances_is_refused_before_it_is_parsed(self):
        limit, instances = 1 << 30, 8_000_000
        service = self.service("--memory_limit", limit)
        request = frame_service_pb2.StreamFramesRequest(
            frame=frame_service_pb2.RobotFrame(instances=[frame_service_pb2.FrameInstance()]))
        empty = request.frame.SerializeToString()
        body = request.SerializeToString().replace(  # its frame, with another length and content
            bytes([len(empty)]) + empty, varint(len(empty) * instances) + empty * instances)
        opening = frame_service_pb2.StreamFramesRequest()
        json_format.ParseDict(recordings.opening("cart"), opening)
        with grpc.insecure_channel(service.address, options=[
                ("grpc.max_send_message_length", -1)]) as channel:
            answers = channel.stream_stream("/hypermap.v1.FrameService/StreamFrames")(
                iter([opening.SerializeToString(), body]), timeout=DEADLINE_S)
            with self.assertRaises(grpc.RpcError) as raised:
                list(answers)
        self.assertEqual(raised.exception.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
        self.assertIn("--memory_limit", raised.exception.details())
        self.assertLess(service.peak_memory(), limit // 2)
        _, answers = send(self.client(service), [recordings.opening("cart"),
                                                 recordings.request(self.frames[0], 0)])
        self.assertEqual(self.outcomes(answers), {0: [1]})

    def test_b9_streams_of_one_address_leave_half_for_others(self):
        service = self.service("--max_streams", 4)
        opening = frame_service_pb2.StreamFramesRequest()
        json_format.ParseDict(recordings.opening("held"), opening)
        begin = http2.grpc_headers("FrameService/StreamFrames")
        with http2.Connection(service.address, source=http2.ATTACKER,
                              timeout_s=DEADLINE_S) as attacker:
            for _ in range(3):
                stream = attacker.new_stream()
                attacker.send(http2.frame(http2.HEADERS, http2.END_HEADERS, stream, begin))
                attacker.send_data(stream, http2.grpc_message(opening.SerializeToString()),
                                   end=False)
            while not attacker.ended:
                attacker.receive(DEADLINE_S)
            code, message = attacker.status(min(attacker.ended))
            self.assertEqual(code, grpc.StatusCode.RESOURCE_EXHAUSTED.value[0])
            self.assertIn("--max_streams", message)
            _, answers = send(self.client(service), [recordings.opening("cart"),
                                                     recordings.request(self.frames[0], 0)])
            self.assertEqual(self.outcomes(answers), {0: [1]})
        code, _, err = service.stop()
        self.assertEqual(code, 0)
        self.assertRegex(err, r"^streams are refused: --max_streams, 1 since the start.*\n$")

    def test_a_robot_gets_an_error_when_the_server_has_stopped(self):
        client, requests = self.client(self.service()), queue.Queue()
        requests.put(recordings.opening("cart"))
        requests.put(recordings.request(self.frames[0], 0))
        stream = client.StreamFrames(iter(requests.get, None))
        self.addCleanup(requests.put, None)
        self.assertTrue(next(stream).HasField("opened"))
        self.assertEqual(next(stream).acknowledgements[0].outcome, 1)
        self.hypermapd.kill()
        with self.assertRaises(grpc.RpcError) as raised:
            next(stream)
        self.assertEqual(raised.exception.code(), grpc.StatusCode.UNAVAILABLE)

    def test_it_stops_while_a_robot_is_connected(self):
        service = self.service()
        requests = queue.Queue()
        requests.put(recordings.opening("cart"))
        stream = self.client(service).StreamFrames(iter(requests.get, None))
        self.addCleanup(requests.put, None)
        self.assertTrue(next(stream).HasField("opened"))
        code, _, err = service.stop()
        self.assertEqual((code, err), (0, ""))


if __name__ == "__main__":
    unittest.main()

"""Observations of robots: acknowledged ones are on disk, and each counts once. The content of a
fused layer does not depend on kills, restarts and the order of arrival."""

import os
import random
import threading
import unittest

import grpc
from google.protobuf import json_format

import rpc
import sites
from fused import BEGIN_S, LABELS, make, observation, observe, opening, shown
from processes import SEED, SiteTest

ROUNDS = int(os.environ.get("HYPERMAP_TEST_ROUNDS", "6"))
ACKNOWLEDGED_BEFORE_KILL = 25


class Robot(threading.Thread):
    """Sends its frames until the stream ends, and records the acknowledgements."""

    def __init__(self, address, name, frames, count_down):
        super().__init__()
        self._address, self._name, self._frames, self._count_down = address, name, frames, count_down
        self.acknowledged = {}  # sequence -> outcome
        self.known = None  # the sequences that the server had; None before it has answered
        self.unexpected = None

    def _requests(self):
        yield opening(self._name, exploration_layer="seen")
        for frame in self._frames:
            yield {"observations": [observation(self._name, frame, frame)]}

    def run(self):
        with rpc.Client(self._address) as client:
            try:
                for response in client.Observe(self._requests()):
                    self.known = self.known or set()
                    for known in response.opened.known:
                        self.known |= set(range(known.first, known.last + 1))
                    for a in response.acknowledgements:
                        self.acknowledged[a.sequence] = a.outcome
                        self._count_down.release()
            except grpc.RpcError as error:
                if error.code() not in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.UNKNOWN,
                                        grpc.StatusCode.CANCELLED):
                    self.unexpected = error


class Ingest(SiteTest):

    def reference(self, observations):
        """Returns the content of a server that gets the observations in order, uninterrupted."""
        data_dir = self.folder / "reference"
        data_dir.mkdir()
        with rpc.Client(self.server(data_dir=data_dir).address) as client:
            make(client)
            observe(client, observations)
            return shown(client)

    def test_repeated_kills_do_not_change_the_result(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            make(client)
        frames = {"even": range(0, 600, 2), "odd": range(1, 600, 2)}
        acknowledged = {name: set() for name in frames}
        for _ in range(ROUNDS):
            count_down = threading.Semaphore(0)
            robots = {name: Robot(site.address, name, of_robot, count_down)
                      for name, of_robot in frames.items()}
            for robot in robots.values():
                robot.start()
            for _ in range(ACKNOWLEDGED_BEFORE_KILL):
                self.assertTrue(count_down.acquire(timeout=120), "no progress")
            site.kill()
            for name, robot in robots.items():
                robot.join()
                self.assertIsNone(robot.unexpected)
                if robot.known is None:  # The server was killed before it opened the stream.
                    continue
                self.assertLessEqual(acknowledged[name], robot.known, "an observation was lost")
                for sequence, outcome in robot.acknowledged.items():
                    # 1 is accepted, 2 is duplicate. An observation must be a duplicate exactly if
                    # the server knew its sequence.
                    self.assertEqual(outcome == 2, sequence in robot.known, (name, sequence))
                    self.assertIn(outcome, (1, 2))
                acknowledged[name] |= set(robot.acknowledged) | robot.known
            site = self.server()
        everything = [observation(["even", "odd"][f % 2], f, f) for f in range(120)]
        with rpc.Client(site.address) as client:
            observe(client, everything)
            for name, known in acknowledged.items():
                more = [observation(name, f, f) for f in known if f >= 120]
                outcomes = observe(client, more)
                self.assertEqual(set(outcomes.values()) - {2}, set())
                everything += more
            found = shown(client)
        self.assertTrue(found[0], "no object was made")
        # Observations that were in flight when a stream broke may have been accepted, too.
        with rpc.Client(site.address) as client:
            opened = {name: next(iter(client.Observe([opening(name)]))).opened.known
                      for name in frames}
        kept = [(f, name) for name, ranges in opened.items() for r in ranges
                for f in range(r.first, r.last + 1)]
        everything = [observation(name, f, f) for f, name in sorted(kept)]
        self.assertEqual(found, self.reference(everything))

    def test_the_order_of_arrival_and_restarts_change_nothing(self):
        everything = [observation(["even", "odd"][f % 2], f, f) for f in range(80)]
        shuffled = random.Random(SEED).sample(everything, len(everything))
        site = self.server()
        with rpc.Client(site.address) as client:
            make(client)
            self.assertEqual(set(observe(client, shuffled[:40]).values()), {1})
        self.assertEqual(site.stop(), 0)
        with rpc.Client(self.server().address) as client:
            self.assertEqual(set(observe(client, shuffled[40:]).values()), {1})
            found = shown(client)
        self.assertEqual(found, self.reference(everything), f"seed {SEED}")

    def test_lines_and_points_of_an_operator_survive_evidence_rebuilds_and_restarts(self):
        sill = {"line_string": rpc.columns([(2.1, 0.5), (2.6, 1.1), (2.3, 1.3)])}
        dock = {"point": rpc.point(-3.5, 2.25)}
        site = self.server()

        def operators(client):
            """Returns {label: (id, shape)} of the objects with labels that robots do not use."""
            answers = client.QueryArea(scope=rpc.scope("site", "things"),
                                       area=sites.square(-500, -500, 1000))
            return {o.label: (o.id, json_format.MessageToDict(
                        o.shape, preserving_proto_field_name=True))
                    for answer in answers for o in answer.part.objects if o.label not in LABELS}

        with rpc.Client(site.address) as client:
            make(client)
            observe(client, [observation("a", f, f) for f in range(20)])
            line, point = client.ApplyEdits(map="site", edits=[
                sites.put_shape(sill, "sill"), sites.put_shape(dock, "dock")]).object_ids
            put = {"sill": (line, sill), "dock": (point, dock)}
            self.assertEqual(operators(client), put)
            # These frames have the sill's place in view and show other things there.
            observe(client, [observation("a", f, f) for f in range(20, 40)])
            self.assertEqual(operators(client), put)
            site.json("rebuild", "site", "--layer", "things", "--fusion", "paper")
            site.json("rebuild", "site", "--layer", "things", "--fusion", "evidence")
            self.assertEqual({label: shape for label, (_, shape) in operators(client).items()},
                             {"sill": sill, "dock": dock})
            put = operators(client)
        site.kill()
        with rpc.Client(self.server().address) as client:
            self.assertEqual(operators(client), put)
            observe(client, [observation("a", f, f) for f in range(40, 60)])
            self.assertEqual(operators(client), put)
            client.ApplyEdits(map="site", edits=[
                {"delete_object": {"layer": "things", "id": put["dock"][0]}}])
            self.assertEqual(set(operators(client)), {"sill"})

    def test_commands_rebuild_retract_and_explain(self):
        site = self.server()
        everything = [observation(["even", "odd"][f % 2], f, f) for f in range(40)]
        with rpc.Client(site.address) as client:
            make(client)
            observe(client, everything)
            ids = sites.labels(client)
            self.assertTrue(ids)
            explained = site.json("explain", "site", min(ids), "--layer", "things")
            self.assertEqual(explained["id"], min(ids))
            kinds = [event["event"] for event in explained["events"]]
            self.assertEqual(kinds[0], "founded")
            self.assertIn("seen", kinds)
            table = site.cli("explain", "site", min(ids), "--layer", "things").stdout
            self.assertIn("founded", table)
            rebuilt = site.json("rebuild", "site", "--layer", "things", "--fusion", "paper")
            self.assertEqual(rebuilt["revision"], sites.revision(client))
            site.json("rebuild", "site", "--layer", "things", "--fusion", "evidence")
            site.json("retract", "site", "--layer", "things", "--robot", "odd",
                      "--from", BEGIN_S - 10, "--to", BEGIN_S + 86400)
            found = shown(client)
        self.assertEqual(found, self.reference([o for o in everything if o["robot"] == "even"]))
        for arguments, word in (
                (("rebuild", "site", "--layer", "things", "--fusion", "none"), "none"),
                (("rebuild", "site", "--layer", "grid"), "grid"),
                (("retract", "site", "--layer", "things", "--robot", "nobody"), "nobody"),
                (("explain", "site", 12345, "--layer", "things"), "12345")):
            self.assert_fails(site.cli(*arguments), word)
        for wrong in (("--param", "a"), ("--param", "=1"), ("--param", "a=b")):
            self.assert_fails(site.cli("rebuild", "site", "--layer", "things", *wrong),
                              "NAME=NUMBER", code=2)
        self.assert_fails(site.cli("retract", "site", "--layer", "things", "--robot", "a",
                                   "--from", "soon"), "time", code=2)

    def test_observations_later_than_max_lateness_are_rejected(self):
        site = self.server("--max_lateness=5s")
        with rpc.Client(site.address) as client:
            make(client)
            outcomes = observe(client, [observation("a", f, f) for f in (20, 15, 14)])
        self.assertEqual(outcomes, {("a", 20): 1, ("a", 15): 1, ("a", 14): 3})


if __name__ == "__main__":
    unittest.main()

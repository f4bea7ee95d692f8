"""Tests of `hypermap-ingest simulate`: simulated robots explore a small site with a real server."""

import json
import signal
import subprocess
import time
import unittest

from processes import BIN, DEADLINE_S, SiteTest

WORKER = BIN / "hypermap-ingest"
AREA = ("0,0", "8,0", "8,5", "0,5")


def box(x0, y0, x1, y1, **properties):
    ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    return {"type": "Feature", "properties": properties,
            "geometry": {"type": "Polygon", "coordinates": [ring]}}


# Two rooms that are connected by a door of 1 m.
FLOOR = [box(0, 0, 8, 5, value=0.0), box(0, 0, 8, 0.2, value=1.0), box(0, 4.8, 8, 5, value=1.0),
         box(0, 0, 0.2, 5, value=1.0), box(7.8, 0, 8, 5, value=1.0), box(4, 0, 4.2, 3.2, value=1.0),
         box(4, 4.2, 4.2, 5, value=1.0), box(6, 2, 6.5, 2.4, value=0.9)]
THINGS = [box(6, 2, 6.5, 2.4, label="suitcase", height_min=0, height_max=0.65),
          box(1, 4, 1.5, 4.5, label="chair", height_min=0, height_max=0.9)]


@unittest.skipUnless(WORKER.exists(), "built without the worker")
class Simulate(SiteTest):

    def site(self, server):
        """Creates the map `site` with the layers `floor` and `things`."""
        server.cli("map", "create", "site")
        server.cli("layer", "create", "site", "floor", "--kind", "occupancy", "--resolution", 0.05)
        server.cli("layer", "create", "site", "things", "--kind", "semantic")
        for layer, features in (("floor", FLOOR), ("things", THINGS)):
            path = self.folder / f"{layer}.geojson"
            path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
            result = server.cli("edit", "site", path, "--layer", layer)
            self.assertEqual(result.returncode, 0, result.stderr)

    def start(self, server, *flags, area=AREA, occupancy="floor"):
        return subprocess.Popen(
            [WORKER, "simulate", "--server", server.address, "--map", "site", "--occupancy",
             occupancy, "--area", *area, "--json", *map(str, flags)],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def finish(self, process):
        """Waits until the process has ended and returns (exit code, stdout, stderr)."""
        try:
            out, err = process.communicate(timeout=3 * DEADLINE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
        return process.returncode, out, err

    def report(self, process):
        """Waits for a process, which must succeed, and returns the report that it prints."""
        code, out, err = self.finish(process)
        self.assertEqual(code, 0, err)
        return json.loads(out)

    def cells(self, server, layer):
        """Returns the lines with the content of a layer, without the last one, the revision."""
        answer = server.cli("--json", "query", "area", "site", "-99,-99", "99,-99", "99,99",
                            "-99,99", "--layer", layer).stdout
        return answer.splitlines()[:-1]

    def explored(self, server):
        """Returns the number of explored cells."""
        runs = (run for line in self.cells(server, "explored") for run in json.loads(line)["runs"])
        return sum(end - begin for _, begin, end, value in runs if value == 1)

    def revision(self, server):
        return server.json("maps")["maps"][0]["revision"]

    def wait_for_revision(self, server, revision, process):
        deadline = time.monotonic() + DEADLINE_S
        while self.revision(server) < revision:
            self.assertIsNone(process.poll(), "the simulation ended too early")
            self.assertLess(time.monotonic(), deadline, "the revision was not reached in time")

    def assert_explored(self, report):
        self.assertIn(report["reason"], ("done", "only_unreachable_left"))
        self.assertGreaterEqual(report["fraction"], 0.99)
        self.assertEqual(report["conflicts"], 0)
        self.assertGreater(report["steps"], 0)

    def test_two_robots_explore_and_end_by_themselves(self):
        server = self.server()
        self.site(server)
        before = self.cells(server, "floor")
        ways, truth = self.folder / "ways.geojson", self.folder / "truth.geojson"
        report = self.report(self.start(server, "--robots", 2, "--seed", 3, "--paths", ways,
                                        "--truth", truth))
        self.assert_explored(report)
        self.assertEqual(len(report["robots"]), 2)
        self.assertGreaterEqual(report["goals"], 2)
        self.assertEqual((report["objects"], report["objects_seen"]), (2, 2))
        self.assertEqual(self.cells(server, "floor"), before)
        lines = json.loads(ways.read_text())["features"]
        self.assertEqual([line["properties"]["robot"] for line in lines], ["robot-1", "robot-2"])
        result = server.json("eval", "site", "--layer", "semantic_explored", "--truth", truth)
        self.assertEqual((result["recall"], result["precision"]), (1.0, 1.0), result)

    def test_earlier_results_are_not_part_of_the_simulated_world(self):
        server = self.server()
        self.site(server)
        first = self.report(self.start(server, "--robots", 2, "--seed", 3))
        again = self.report(self.start(server, "--robots", 2, "--seed", 3, "--layer", "again",
                                       "--explored", "explored_again"))
        self.assertEqual((first["objects"], again["objects"]), (2, 2))
        self.assertEqual((first["steps"], first["goals"]), (again["steps"], again["goals"]))

    def test_the_same_seed_gives_the_same_steps(self):
        reports = []
        for name in ("a", "b"):
            folder = self.folder / name
            folder.mkdir()
            server = self.server(data_dir=folder)
            self.site(server)
            reports.append(self.report(self.start(server, "--robots", 2, "--seed", 5,
                                                  "--detector", "noisy", "--pose", "amcl")))
        a, b = reports
        self.assertEqual((a["steps"], a["goals"], a["driven_m"], a["explored_cells"]),
                         (b["steps"], b["goals"], b["driven_m"], b["explored_cells"]))

    def test_it_continues_after_a_kill_and_restart_of_the_server(self):
        server = self.server()
        self.site(server)
        begun = self.revision(server)
        process = self.start(server, "--robots", 2, "--seed", 3)
        self.wait_for_revision(server, begun + 40, process)
        server.kill()
        server = self.server(f"--listen=127.0.0.1:{server.port}")
        self.assertIsNone(process.poll(), "the simulation ended before the server was killed")
        explored = self.explored(server)
        report = self.report(process)
        self.assert_explored(report)
        self.assertEqual(report["lost_goals"], 0)
        self.assertGreater(explored, 0)
        self.assertGreaterEqual(self.explored(server), explored)

    def test_an_interrupted_simulation_releases_its_goals(self):
        server = self.server()
        self.site(server)
        begun = self.revision(server)
        process = self.start(server, "--robots", 2, "--seed", 3)
        self.wait_for_revision(server, begun + 20, process)
        process.send_signal(signal.SIGINT)
        code, out, err = self.finish(process)
        self.assertEqual((code, out), (1, ""))
        self.assertIn("interrupted", err)
        self.assertNotIn("exploration goal", "".join(self.cells(server, "explorations")))

    def test_invalid_requests_are_refused_and_change_nothing(self):
        server = self.server()
        self.site(server)
        revision = self.revision(server)
        cases = [
            ("area", self.start(server, area=("0,0", "4,4", "4,0", "0,4"))),
            ("area", self.start(server, area=("50,50", "60,50", "60,60", "50,60"))),
            ("start", self.start(server, "--start", "20,20")),
            ("start", self.start(server, "--robots", 2, "--start", "1,1")),
            ("can't be written", self.start(server, "--paths", self.folder / "none" / "ways")),
            ("occupancy", self.start(server, occupancy="things")),
            ("absent", self.start(server, occupancy="absent")),
        ]
        for words, process in cases:
            with self.subTest(words):
                code, out, err = self.finish(process)
                self.assertEqual((code, out), (1, ""), err)
                self.assertIn(words, err)
        code, _, err = self.finish(self.start(server, "--detector", "psychic"))
        self.assertEqual(code, 2, err)
        self.assertEqual(self.revision(server), revision)


if __name__ == "__main__":
    unittest.main()

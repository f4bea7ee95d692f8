"""Old observations are forgotten, and what the fused layer shows goes on as if they were there."""

import contextlib
import sqlite3
import time
import unittest

import grpc

import rpc
import sites
from fused import make, observation, observe, opening, shown
from processes import SiteTest, cli, start_and_fail

# A pass that removes what is old begins after each revision.
FLAGS = ["--max_lateness=1s", "--observation_age=2s", "--history_revisions=10"]
ACCEPTED, DUPLICATE, REFUSED_LATE = 1, 2, 3
ROBOT_FRAMES = range(20)


class Retention(SiteTest):

    def forgetful_site(self):
        """Returns a server that has forgotten the observations of the frames ROBOT_FRAMES."""
        site = self.server(*FLAGS)
        with rpc.Client(site.address) as client:
            make(client)
            observe(client, [observation("a", f, f) for f in ROBOT_FRAMES])
        # A server that stops stores the state of the layer.
        self.assertEqual(site.stop(), 0)
        site = self.server(*FLAGS)
        with rpc.Client(site.address) as client:
            deadline = time.monotonic() + 60
            while not self.explain(client).HasField("forgotten_until"):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.2)
                client.ApplyEdits(map="site", edits=[sites.write_cells([[0.5]])])
        return site

    def explain(self, client):
        return client.ExplainObject(map="site", layer="things", object_id=min(sites.labels(client)))

    def stored_observations(self):
        with contextlib.closing(sqlite3.connect(self.data_dir / "site.gpkg")) as file:
            return file.execute("SELECT robot, sequence FROM hypermap_observations").fetchall()

    def assert_refused(self, call, **request):
        with self.assertRaises(grpc.RpcError) as raised:
            call(map="site", layer="things", **request)
        self.assertEqual(raised.exception.code(), grpc.StatusCode.FAILED_PRECONDITION)
        self.assertIn("--observation_age", raised.exception.details())

    def test_nothing_that_is_shown_changes_and_nothing_counts_twice(self):
        later = [observation("b", f, f) for f in range(30, 40)]
        reference = self.folder / "reference"
        reference.mkdir()
        with rpc.Client(self.server("--observation_age=inf", data_dir=reference).address) as client:
            make(client)
            observe(client, [observation("a", f, f) for f in ROBOT_FRAMES])
            before = shown(client)
            observe(client, later)
            after = shown(client)

        site = self.forgetful_site()
        with rpc.Client(site.address) as client:
            self.assertEqual(shown(client), before)
            again = observe(client, [observation("a", f, f) for f in ROBOT_FRAMES])
            self.assertEqual(set(again.values()), {DUPLICATE})
            early = observe(client, [observation("c", 0, 5)])
            self.assertEqual(set(early.values()), {REFUSED_LATE})
            known = next(iter(client.Observe([opening("a")]))).opened.known
            self.assertEqual([(r.first, r.last) for r in known],
                             [(ROBOT_FRAMES[0], ROBOT_FRAMES[-1])])
            self.assertEqual(shown(client), before)
            self.assertEqual(set(observe(client, later).values()), {ACCEPTED})
            self.assertEqual(shown(client), after)
        site.kill()
        site = self.server(*FLAGS)
        with rpc.Client(site.address) as client:
            self.assertEqual(shown(client), after)
        self.assertEqual(site.stop(), 0)
        self.assertEqual({robot for robot, _ in self.stored_observations()}, {"b"})
        checked = cli("check", self.data_dir / "site.gpkg")
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_what_needs_forgotten_observations_is_refused(self):
        site = self.forgetful_site()
        with rpc.Client(site.address) as client:
            observe(client, [observation("b", f, f) for f in range(30, 40)])
            before = shown(client)
            self.assert_refused(client.RetractSource, robot="a")
            self.assert_refused(client.RebuildLayer, strategy="paper")
            self.assertEqual(shown(client), before)
            client.RebuildLayer(map="site", layer="things")
            self.assertEqual(shown(client), before)
            explained = self.explain(client)
            self.assertTrue(explained.events)
            self.assertTrue(all(event.robot == "b" for event in explained.events), explained)
            table = site.cli("explain", "site", min(sites.labels(client)), "--layer", "things")
            self.assertIn("no longer kept", table.stdout)
            client.RetractSource(map="site", layer="things", robot="b")

    def test_evidence_must_be_kept_for_as_long_as_it_may_be_late(self):
        code, log = start_and_fail(self.data_dir, "--max_lateness=3s", "--observation_age=2s")
        self.assertNotEqual(code, 0)
        self.assertIn("--observation_age must not be shorter than --max_lateness", log)


if __name__ == "__main__":
    unittest.main()

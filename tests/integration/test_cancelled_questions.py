"""Questions and watches whose callers have gone cost the server no more work, as in
test_cancellation.py; also beside clients that go on. Each rpc is cancelled by a test, or listed
here with the reason why not."""

import unittest

from google.protobuf import json_format
from hypermap.v1 import query_service_pb2, watch_service_pb2

import rpc
import sites
# Its tests count, too.
import test_cancellation
from asking import Asking
from cancelled_calls import TESTS, CancellationTest, cancels, comb
from test_robots import report

# The rpcs that no test cancels, because their work is short or must not end early.
NOT_CANCELLED = {
    "GetCaller": "reads what was found when the call arrived",
    "CreateMap": "makes one small file",
    "GetMap": "reads numbers that are kept up to date",
    "ListMaps": "as GetMap, for each map of at most some thousand",
    "DeleteMap": "waits for the map's writer, then renames and removes files, to the end",
    "DigestMap": "what it has read is kept, and it ends between blocks of some thousand objects",
    "RestoreMap": "its check of the file is that of CheckMap; then it replaces a map, to the end",
    "CreateLayer": "one edit, of a request that is at most 4 MiB",
    "DeleteLayer": "one edit, whose tables SQLite drops in single statements, to the end",
    "GetLayer": "at most 10,000 labels of aliases",
    "ListLayers": "as GetLayer; the answer is at most a message",
    "SetTransform": "one edit, of a frame of at most 20,000",
    "ListTransforms": "at most 20,000 transforms",
    "ListExplorations": "reads objects of one layer; it does not look at floor",
    "RenewGoal": "writes one object; it does not look at floor",
    "ListRevisions": "a page of at most 10,000 records",
    "Report": "one report, of at most some KiB",
    "DrainServer": "one statement, whose wait has an end",
    "ListServers": "one look at the database, whose wait has an end",
    "ListRobots": "at most --max_robots reports, which are in memory",
    "StreamFrames": "served by hypermap-ingest, whose frames are those of one robot",
}


REQUESTS = {"QueryArea": query_service_pb2.QueryAreaRequest,
            "QueryValue": query_service_pb2.QueryValueRequest,
            "Watch": watch_service_pb2.WatchRequest,
            "Replicate": watch_service_pb2.ReplicateRequest}
ROBOTS = 1000


class CancelledQuestions(CancellationTest):

    def test_every_rpc_is_cancelled_by_a_test_or_has_a_reason_why_not(self):
        rpcs = {method.name for _, _, method in rpc.methods()}
        self.assertEqual(set(TESTS) | set(NOT_CANCELLED), rpcs)
        self.assertEqual(set(TESTS) & set(NOT_CANCELLED), set())
        tests = {name for case in (CancelledQuestions, test_cancellation.Cancellation)
                 for name in dir(case)}
        for name, cancelling in TESTS.items():
            self.assertLessEqual(set(cancelling), tests, name)

    def ask_area(self, name, calls, **fields):
        """Starts calls that compare all things with an area of many vertices."""
        ask = json_format.ParseDict(
            {"scope": rpc.scope("site", "things"), "area": comb(4900, 200.0), **fields},
            REQUESTS[name]())
        return [self.begin(name, ask) for _ in range(calls)]

    @cancels("QueryPoint")
    def test_a_point_with_a_large_tolerance(self):
        self.create_things(cols=300)
        ask = {"scope": rpc.scope("site"), "point": rpc.point(1, 1), "tolerance_m": 1000.0}
        self.expect_given_up("QueryPoint",
                             lambda: [self.begin("QueryPoint", **ask) for _ in range(60)])

    @cancels("QueryPoints")
    def test_many_points_near_a_large_shape(self):
        self.create_things()
        self.client.ApplyEdits(map="site", edits=[
            sites.put_shape({"polygon": comb(40_000, 200.0)})])
        n = 65_536
        # They lie above the teeth, so that each must be compared with all of these.
        batch = {"opening": {"scope": rpc.scope("site"), "tolerance_m": 1.0},
                 "xs": [200.0 * i / n for i in range(n)], "ys": [190.9] * n}
        self.expect_given_up("QueryPoints", lambda: [self.begin("QueryPoints", [batch])])

    @cancels("QueryNearest")
    def test_nearest(self):
        self.make_floor()
        ask = {"scope": rpc.scope("site", "grid"), "point": rpc.point(1, 1), "value": "occupied",
               "k": 1}
        self.expect_given_up("QueryNearest",
                             lambda: [self.begin("QueryNearest", **ask) for _ in range(500)])

    @cancels("EstimateTransform")
    def test_transform_of_a_floor_with_walls(self):
        self.make_floor(side=1000)
        walls = [sites.square(self.random.uniform(0, 49), self.random.uniform(0, 49))
                 for _ in range(400)]
        self.client.ApplyEdits(map="site", edits=[self.fill(wall, value=1) for wall in walls])
        side = {"scope": rpc.scope("site", "grid")}
        self.expect_given_up("EstimateTransform", lambda: [
            self.begin("EstimateTransform", source=side, target=side) for _ in range(2)])

    @cancels("QueryArea")
    def test_areas_with_many_vertices(self):
        self.create_things(cols=100)
        self.expect_given_up("QueryArea", lambda: self.ask_area("QueryArea", 10))

    @cancels("QueryValue")
    def test_values_in_areas_with_many_vertices(self):
        self.create_things(cols=100)
        self.expect_given_up("QueryValue", lambda: self.ask_area("QueryValue", 10, value="cup"))

    @cancels("ListChanges")
    def test_changes_of_many_objects(self):
        self.create_things(cols=300)
        self.expect_given_up("ListChanges", lambda: [
            self.begin("ListChanges", scope=rpc.scope("site"), from_revision=1)
            for _ in range(20)])

    @cancels("Watch")
    def test_watches_of_objects(self):
        self.create_things(cols=100)
        self.expect_given_up("Watch", lambda: self.ask_area("Watch", 10))

    @cancels("Replicate")
    def test_replicas_of_objects(self):
        self.create_things(cols=100)
        self.expect_given_up("Replicate", lambda: self.ask_area("Replicate", 10))

    @cancels("Watch", "Replicate")
    def test_watches_and_replicas_of_turned_cells(self):
        self.create_grid("things", yaw=0.3)
        self.client.ApplyEdits(map="site", edits=[
            self.fill(sites.square(0, 0, 50.0), layer="things")])
        for name in ("Watch", "Replicate"):
            self.expect_given_up(name, lambda: self.ask_area(name, 10))

    @cancels("WatchRobots")
    def test_watches_of_robots(self):
        for i in range(ROBOTS):
            self.client.Report(map="site", report=report(f"r{i}", i, 0, fields={"task": 3000 * "x"}))
        self.expect_given_up("WatchRobots", lambda: [
            self.begin("WatchRobots", map="site") for _ in range(200)])

    @cancels("ExplainObject")
    def test_history_of_an_object(self):
        self.make_fused_layer(4000)
        explain = {"map": "site", "layer": "things", "object_id": min(sites.labels(self.client))}
        self.expect_given_up("ExplainObject",
                             lambda: [self.begin("ExplainObject", **explain) for _ in range(20)])

    def begin_mix(self):
        """Starts calls of all classes of work, each of which takes long."""
        fills = [self.fill(comb(4000, 50.0), value=i % 2, rule="CELL_RULE_TOUCHED")
                 for i in range(20)]
        calls = [
            ("ApplyEdits", {"map": "site", "edits": fills}),
            ("RebuildLayer", {"map": "site", "layer": "seen"}),
            ("ExplainObject", {"map": "site", "layer": "seen", "object_id": self.seen}),
            ("ListChanges", {"scope": rpc.scope("site"), "from_revision": 1}),
            ("ExportMap", {"map": "site", "format": "FILE_FORMAT_HMAP"}),
            ("BackupMap", {"map": "site"})]
        self.random.shuffle(calls)
        begun = [self.begin(name, **fields) for name, fields in calls * 3]
        for name in ("QueryArea", "Watch", "Replicate"):
            begun += self.ask_area(name, 5)
        return begun + self.ask_area("QueryValue", 5, value="cup")

    def test_a_mix_beside_clients_that_go_on(self):
        sites.make(self.client, "other")
        self.create_things(cols=100)
        self.create_grid(yaw=0.3)
        self.make_fused_layer(2000, name="seen")
        self.seen = min(sites.labels(self.client, layer="seen"))

        others = []

        def begin_beside_others():
            others[:] = [Asking(self.site.address, "other") for _ in range(3)]
            for other in others:
                other.start()
                self.addCleanup(other.stop)
                self.assertTrue(other.await_answer(), other.error)
            return self.begin_mix()

        def stop_others():
            for other in others:
                self.assertTrue(other.await_answer(), other.error)
            for other in others:
                other.stop()

        self.expect_given_up("a mix", begin_beside_others, stop_others)


if __name__ == "__main__":
    unittest.main()

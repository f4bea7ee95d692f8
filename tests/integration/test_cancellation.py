"""A call whose caller has gone costs the server no more work (A4, A5).

Each test begins calls that would keep the server busy for seconds, cancels them while it works, and
measures the processor time that the server takes in the second after that. The figures are printed.
The tests of questions and watches are in test_cancelled_questions.py; there is also the list of the
rpcs that are not cancelled here.
"""

import base64
import io
import unittest
import zipfile

import grpc

import rpc
import sites
from cancelled_calls import CancellationTest, cancels, comb, star
from test_ingest import observation, opening


def stars(n):
    """Returns an .hmap with n objects whose shapes must be repaired."""
    yaml = "".join(f"- name: star\n  shape: {star(3 * i)}\n  tags: ~\n  confidence: ~\n"
                   for i in range(n))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("hmap_config.yaml", "layers:\n  - {name: semantic, frame_id: map, "
                         "load_file: true, file: semantic, class: SemanticLayer}\n")
        archive.writestr("semantic", yaml)
    return packed.getvalue()


class Cancellation(CancellationTest):

    @cancels("ImportMap")
    def test_import_with_many_shapes_to_repair(self):
        data = base64.b64encode(stars(50_000)).decode()
        requests = [{"header": {"map": "copy", "format": "FILE_FORMAT_HMAP", "create_map": True}},
                    {"chunk": {"file_name": "stars.hmap", "data": data}}]
        self.expect_given_up("ImportMap", lambda: [self.begin("ImportMap", requests)])
        with self.assertRaises(grpc.RpcError) as caught:
            self.client.GetMap(map="copy")
        self.assertEqual(caught.exception.code(), grpc.StatusCode.NOT_FOUND)

    @cancels("ApplyEdits")
    def test_edits_with_large_fills(self):
        self.create_grid(yaw=0.3)
        before = sites.revision(self.client)
        edits = [self.fill(comb(4000, 50.0), value=i % 2, rule="CELL_RULE_TOUCHED")
                 for i in range(20)]
        self.expect_given_up("ApplyEdits",
                             lambda: [self.begin("ApplyEdits", map="site", edits=edits)])
        self.assertEqual(sites.revision(self.client), before)

    @cancels("ApplyEdits")
    def test_edits_that_wait_for_the_writer(self):
        self.create_grid(yaw=0.3)
        before = sites.revision(self.client)
        edits = [self.fill(comb(4000, 50.0), rule="CELL_RULE_TOUCHED")]
        self.expect_given_up("ApplyEdits", lambda: [
            self.begin("ApplyEdits", map="site", edits=edits * 4) for _ in range(10)])
        # Batches that were applied before the cancellation may be there, but not all of them.
        self.assertLess(sites.revision(self.client), before + 30)

    @cancels("StartExploration")
    def test_start_of_a_large_exploration(self):
        self.make_floor()
        before = sites.revision(self.client)
        self.expect_given_up("StartExploration", lambda: [self.start_exploration(begin=True)])
        self.assertEqual(sites.revision(self.client), before)

    @cancels("ClaimGoal")
    def test_claim_of_a_goal(self):
        self.make_floor(side=2000)
        # Robots that see far: the lines of sight that are tested are long.
        self.start_exploration(range_m=20.0)
        claim = {"map": "site", "robot": "robot", "pose": {"x": 50.0, "y": 50.0},
                 "lease": "60s"}
        self.expect_given_up("ClaimGoal", lambda: [self.begin("ClaimGoal", **claim)])

    @cancels("ListFrontiers")
    def test_frontiers_of_narrow_stripes(self):
        self.make_floor(side=2000)
        self.start_exploration()
        self.client.ApplyEdits(map="site", edits=self.stripes("seen", step_m=0.2, side_m=100.0))
        self.expect_given_up("ListFrontiers", lambda: [
            self.begin("ListFrontiers", map="site") for _ in range(20)])

    @cancels("GetExploration", "ReleaseGoal", "StopExploration")
    def test_calls_of_an_exploration_whose_floor_has_changed(self):
        """Each would have to look at all of the floor, most of which is new."""
        self.make_floor(side=400)
        self.start_exploration(area=sites.square(0, 0, 240.0))
        claim = {"map": "site", "robot": "robot", "pose": {"x": 10.0, "y": 10.0},
                 "lease": "600s"}
        goal = {"map": "site", "robot": "robot",
                "goal_id": self.client.ClaimGoal(**claim).goal.id}
        self.client.ApplyEdits(map="site", edits=[
            self.fill(sites.square(0, 0, 240.0)),
            *self.stripes("grid", step_m=0.45, side_m=200.0)])
        before = sites.revision(self.client)
        self.expect_given_up("GetExploration", lambda: [self.begin("GetExploration", map="site")])
        self.expect_given_up("ReleaseGoal", lambda: [
            self.begin("ReleaseGoal", outcome="GOAL_OUTCOME_ABANDONED", **goal)])
        self.expect_given_up("StopExploration", lambda: [self.begin("StopExploration", map="site")])
        self.assertEqual(sites.revision(self.client), before)
        self.client.RenewGoal(lease="600s", **goal)

    @cancels("Observe")
    def test_many_observations_at_once(self):
        self.create_things()
        n, robots = 4000, ["a", "b", "c"]
        # Small requests: those that were read, at most 32, are carried out.
        streams = iter([self.observations(robot, n, first_frame=i * n, per_request=5)
                        for i, robot in enumerate(robots)])
        self.expect_given_up("Observe", lambda: [self.begin("Observe", next(streams))])
        self.assertLess(self.known(robots), len(robots) * n)

    @cancels("RebuildLayer")
    def test_rebuild_of_a_fused_layer(self):
        self.make_fused_layer(4000)
        before = sites.revision(self.client)
        rebuild = {"map": "site", "layer": "things"}
        self.expect_given_up("RebuildLayer",
                             lambda: [self.begin("RebuildLayer", **rebuild) for _ in range(20)])
        # Rebuilds that were done before the cancellation made a revision each.
        self.assertLess(sites.revision(self.client), before + 60)

    @cancels("RetractSource")
    def test_retraction_of_observations(self):
        self.make_fused_layer(4000)
        before = sites.revision(self.client)
        # Each withdraws two of them, and the layer is folded anew without these.
        stamps = [observation("a", i, i)["stamp"] for i in range(4000)]
        windows = iter([{"from": stamps[i], "to": stamps[i + 2]} for i in range(0, 3000, 50)])
        self.expect_given_up("RetractSource", lambda: [
            self.begin("RetractSource", map="site", layer="things", robot="a", **next(windows))
            for _ in range(20)])
        self.assertLess(sites.revision(self.client), before + 60)

    @cancels("CorrectPoses")
    def test_correction_of_poses(self):
        self.make_fused_layer(4000)
        before = sites.revision(self.client)
        # Each moves one of them, and what follows is folded anew.
        stamps = iter([observation("a", i, i)["stamp"] for i in range(0, 3000, 50)])
        self.expect_given_up("CorrectPoses", lambda: [
            self.begin("CorrectPoses", map="site", layer="things", robot="a",
                       poses=[{"stamp": next(stamps), "pose": {"x": 1.0}}])
            for _ in range(20)])
        self.assertLess(sites.revision(self.client), before + 60)

    @cancels("SmoothPoses")
    def test_smoothing_of_poses(self):
        self.make_fused_layer(4000)
        before = sites.revision(self.client)
        self.expect_given_up("SmoothPoses", lambda: [
            self.begin("SmoothPoses", map="site", layer="things") for _ in range(20)])
        self.assertEqual(sites.revision(self.client), before)

    @cancels("ExportMap")
    def test_export(self):
        self.make_floor()
        export = {"map": "site", "format": "FILE_FORMAT_HMAP"}
        self.expect_given_up("ExportMap",
                             lambda: [self.begin("ExportMap", **export) for _ in range(8)])

    @cancels("BackupMap")
    def test_backup(self):
        self.create_things(cols=300)
        self.expect_given_up("BackupMap",
                             lambda: [self.begin("BackupMap", map="site") for _ in range(30)])

    @cancels("CheckMap")
    def test_check(self):
        self.create_things(cols=300)
        self.expect_given_up("CheckMap",
                             lambda: [self.begin("CheckMap", map="site") for _ in range(30)])


if __name__ == "__main__":
    unittest.main()

"""A call whose caller has gone costs the server no more work (A4, A5).

Each test begins calls that would keep the server busy for seconds, cancels them while it works, and
measures the processor time that the server takes in the second after that. The figures are printed.
"""

import base64
import io
import math
import os
import random
import time
import unittest
import zipfile

import grpc

import rpc
import sites
from processes import DEADLINE_S, SEED, SiteTest
from test_ingest import observation, opening

# The calls are cancelled when the server has spent this time, plus a random one, on them.
BUSY_S = 0.1
MAX_MORE_S = 0.4
# Processor time that the server may take in the second after the cancellation.
MAX_AFTER_S = 0.3
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
GRID_SIDE = 4000  # cells


def cpu_s(pid):
    """Returns the processor time of a process so far, in seconds."""
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def comb(teeth, side):
    """Returns a Polygon of about 2 * teeth vertices in a square, whose teeth reach across it."""
    xs = [side * i / (2 * teeth) for i in range(2 * teeth)]
    return {"outer": rpc.columns([(x, side * (0.95 if i % 2 else 0.05)) for i, x in enumerate(xs)]
                                 + [(side, 0.0), (0.0, 0.0)])}


def star(x):
    """Returns WKT of a ring of 11 vertices that crosses itself 33 times."""
    points = [(x + math.cos(2 * math.pi * 4 * i / 11), math.sin(2 * math.pi * 4 * i / 11))
              for i in (*range(11), 0)]
    return "POLYGON ((" + ", ".join(f"{a:.6f} {b:.6f}" for a, b in points) + "))"


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


class Cancellation(SiteTest):

    def setUp(self):
        super().setUp()
        self.random = random.Random(SEED)
        self.site = self.server("--max_exploration_bytes=2147483648")
        self.client = self.enterContext(rpc.Client(self.site.address))
        self.client.CreateMap(map="site")

    def create_grid(self, name="grid", yaw=0.0):
        self.client.CreateLayer(map="site", layer={
            "name": name, "kind": "LAYER_KIND_OCCUPANCY",
            "grid": {"origin": {"x": 0, "y": 0, "yaw": yaw}, "resolution_m": 0.05}})

    def fill(self, area, value=0.0, **fields):
        return {"fill_polygon": {"layer": "grid", "area": area, "value": value,
                                 "rule": "CELL_RULE_CENTRE", **fields}}

    def make_floor(self, side=GRID_SIDE):
        """Makes a grid whose cells are all free."""
        self.create_grid()
        self.client.ApplyEdits(map="site", edits=[self.fill(sites.square(0, 0, 0.05 * side))])

    def await_quiet(self):
        """Waits until the server has nothing to do."""
        deadline = time.monotonic() + DEADLINE_S
        before = cpu_s(self.site.pid)
        while time.monotonic() < deadline:
            time.sleep(0.2)
            now = cpu_s(self.site.pid)
            if now - before <= 0.02:
                return
            before = now
        self.fail("the server does not come to rest")

    def expect_given_up(self, name, begin):
        """`begin` starts calls and returns them. Repeats, because the moment is a random one."""
        figures = []
        for _ in range(3):
            self.await_quiet()
            start = cpu_s(self.site.pid)
            wanted = BUSY_S + self.random.uniform(0.0, MAX_MORE_S)
            calls = begin()
            deadline = time.monotonic() + DEADLINE_S
            while cpu_s(self.site.pid) - start < wanted:
                self.assertTrue(any(call.is_active() for call in calls),
                                f"{name} is too short to be cancelled")
                self.assertLess(time.monotonic(), deadline, f"{name} does not work")
                time.sleep(0.005)
            for call in calls:
                call.cancel()
            before = cpu_s(self.site.pid)
            time.sleep(1.0)
            figures.append(cpu_s(self.site.pid) - before)
        print(f"{name}: " + ", ".join(f"{1000 * f:.0f} ms" for f in figures)
              + " of processor time in the second after the cancellation")
        self.assertLessEqual(max(figures), MAX_AFTER_S, name)
        # The server still serves.
        self.client.GetMap(map="site")

    def test_import_with_many_shapes_to_repair(self):
        data = base64.b64encode(stars(50_000)).decode()
        requests = [{"header": {"map": "copy", "format": "FILE_FORMAT_HMAP", "create_map": True}},
                    {"chunk": {"file_name": "stars.hmap", "data": data}}]
        self.expect_given_up("ImportMap", lambda: [self.client.ImportMap.begin(requests)])
        with self.assertRaises(grpc.RpcError) as caught:
            self.client.GetMap(map="copy")
        self.assertEqual(caught.exception.code(), grpc.StatusCode.NOT_FOUND)

    def test_edits_with_large_fills(self):
        self.create_grid(yaw=0.3)
        before = sites.revision(self.client)
        edits = [self.fill(comb(4000, 50.0), value=i % 2, rule="CELL_RULE_TOUCHED")
                 for i in range(20)]
        self.expect_given_up("ApplyEdits",
                             lambda: [self.client.ApplyEdits.begin(map="site", edits=edits)])
        self.assertEqual(sites.revision(self.client), before)

    def test_edits_that_wait_for_the_writer(self):
        self.create_grid(yaw=0.3)
        before = sites.revision(self.client)
        edits = [self.fill(comb(4000, 50.0), rule="CELL_RULE_TOUCHED")]
        self.expect_given_up(
            "10 ApplyEdits",
            lambda: [self.client.ApplyEdits.begin(map="site", edits=edits * 4) for _ in range(10)])
        # Those that were applied before the cancellation may be there, but not all of them.
        self.assertLess(sites.revision(self.client), before + 30)

    def test_nearest(self):
        self.make_floor()
        ask = {"scope": rpc.scope("site", "grid"), "point": rpc.point(1, 1), "value": "occupied",
               "k": 1}
        self.expect_given_up(
            "QueryNearest", lambda: [self.client.QueryNearest.begin(**ask) for _ in range(500)])

    def test_areas_with_many_vertices(self):
        self.client.CreateLayer(map="site", layer={"name": "things", "kind": "LAYER_KIND_SEMANTIC"})
        for row in range(100):
            self.client.ApplyEdits(map="site", edits=[
                sites.put("cup", 2 * col, 2 * row) for col in range(100)])
        ask = {"scope": rpc.scope("site", "things"), "area": comb(4900, 200.0)}
        self.expect_given_up(
            "QueryArea", lambda: [self.client.QueryArea.begin(**ask) for _ in range(100)])

    def start_exploration(self, begin=False, **fields):
        request = {"map": "site", "area": sites.square(0, 0, 0.05 * GRID_SIDE),
                   "occupancy_layer": "grid", "exploration_layer": "seen", "robot_radius_m": 0.25,
                   "range_m": 4.0, "min_gain_cells": 4, **fields}
        start = self.client.StartExploration
        return start.begin(**request) if begin else start(**request)

    def test_start_of_a_large_exploration(self):
        self.make_floor()
        before = sites.revision(self.client)
        self.expect_given_up("StartExploration", lambda: [self.start_exploration(begin=True)])
        self.assertEqual(sites.revision(self.client), before)

    def test_claim_of_a_goal(self):
        self.make_floor(side=2000)
        # Robots that see far: the lines of sight that are tested are long.
        self.start_exploration(range_m=20.0)
        claim = {"map": "site", "robot": "robot", "pose": {"x": 50.0, "y": 50.0},
                 "lease": "60s"}
        self.expect_given_up("ClaimGoal", lambda: [self.client.ClaimGoal.begin(**claim)])

    def test_rebuild_of_a_fused_layer(self):
        self.client.CreateLayer(map="site", layer={"name": "things", "kind": "LAYER_KIND_SEMANTIC"})
        observations = [observation("a", i, i) for i in range(4000)]
        requests = [opening()] + [{"observations": observations[i:i + 50]}
                                  for i in range(0, len(observations), 50)]
        for _ in self.client.Observe(requests):
            pass
        before = sites.revision(self.client)
        rebuild = {"map": "site", "layer": "things"}
        self.expect_given_up(
            "RebuildLayer", lambda: [self.client.RebuildLayer.begin(**rebuild) for _ in range(20)])
        # Those that were done before the cancellation made a revision each.
        self.assertLess(sites.revision(self.client), before + 60)

    def test_export(self):
        self.make_floor()
        export = {"map": "site", "format": "FILE_FORMAT_HMAP"}
        self.expect_given_up(
            "ExportMap", lambda: [self.client.ExportMap.begin(**export) for _ in range(8)])

    def test_backup(self):
        self.client.CreateLayer(map="site", layer={"name": "things", "kind": "LAYER_KIND_SEMANTIC"})
        for row in range(100):
            self.client.ApplyEdits(map="site", edits=[
                sites.put("cup", 2 * col, 2 * row) for col in range(300)])
        self.expect_given_up(
            "BackupMap", lambda: [self.client.BackupMap.begin(map="site") for _ in range(30)])


if __name__ == "__main__":
    unittest.main()

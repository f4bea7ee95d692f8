"""docs/limits.md has a row for each rpc, which tells what it holds and what its time
grows with; the flags in it exist; the content of all maps keeps its limit."""

import re
import subprocess
import unittest

import grpc

import rpc
import sites
from processes import BIN, DEADLINE_S, IS_SANITIZED, ROOT, SiteTest

# `| Rpc | holds at most | bounded by | processor time grows with; workers |`
ROW = re.compile(r"^\| ([A-Z]\w+) \|([^|\n]*)\|([^|\n]*)\|([^|\n]*)\|$", re.MULTILINE)
# Words for the classes of workers (server/rpc/worker_pools.h).
WORKERS = ("questions", "watches", "writes", "openings", "files", "uploads", "explorations",
           "estimates")
# The rpcs of FrameService, which hypermap-ingest serves.
OF_INGEST = {"StreamFrames"}
INGEST = BIN / "hypermap-ingest"


class Limits(unittest.TestCase):

    def setUp(self):
        self.rows = ROW.findall((ROOT / "docs" / "limits.md").read_text())

    def test_each_rpc_has_one_row(self):
        rpcs = {method.name for _, _, method in rpc.methods()}
        self.assertEqual(sorted(row[0] for row in self.rows), sorted(rpcs))

    def test_each_row_tells_what_is_held_what_it_costs_and_who_works(self):
        for name, holds, bounds, cost in self.rows:
            with self.subTest(name):
                for cell in (holds, bounds, cost):
                    self.assertTrue(cell.strip())
                if cost.strip().startswith("as ") or name in OF_INGEST:
                    continue  # As another rpc, or on a thread of its own.
                self.assertTrue(any(w in cost.lower() for w in WORKERS), cost)

    def test_the_flags_that_bound_them_exist(self):
        shown = subprocess.run([BIN / "hypermapd", "--helpfull"], capture_output=True, text=True,
                               timeout=DEADLINE_S, check=False)
        flags = set(re.findall(r"--(\w+) \(", shown.stdout + shown.stderr))
        self.check_flags(flags, [row for row in self.rows if row[0] not in OF_INGEST])

    @unittest.skipUnless(INGEST.exists(), "built without the worker")
    def test_the_flags_that_bound_streams_of_frames_exist(self):
        shown = subprocess.run([INGEST, "serve", "--help"], capture_output=True, text=True,
                               timeout=DEADLINE_S, check=True)
        flags = set(re.findall(r"--(\w+) ", shown.stdout))
        self.check_flags(flags, [row for row in self.rows if row[0] in OF_INGEST])

    def check_flags(self, flags, rows):
        for name, _, bounds, cost in rows:
            with self.subTest(name):
                for flag in re.findall(r"`--(\w+)`", bounds + cost):
                    self.assertIn(flag, flags)


MIB = 1 << 20
# With cells of 0.5 m, the 64 x 64 tiles of a comb, each with two values, take about 70 MiB.
COMB_M, COMB_TEETH = 4090, 64


def limit_memory(memory):
    """Returns a flag by which content may take half of `memory` bytes."""
    # Sanitizers take memory of their own.
    if IS_SANITIZED:
        return f"--max_content_bytes={memory // 2}"
    return f"--memory_limit={memory}"


def fill_comb(number, value=0.5):
    """Returns an edit that fills a comb, whose shape is small, beside those of other numbers."""
    x, gap = 4096 * number, COMB_M / (2 * COMB_TEETH + 1)
    ring = [(x, 0), (x + COMB_M, 0)]
    for tooth in range(COMB_TEETH):
        low, high = (2 * tooth + 1) * gap, (2 * tooth + 2) * gap
        ring += [(x + COMB_M, low), (x + 1, low), (x + 1, high), (x + COMB_M, high)]
    ring.append((x, COMB_M))
    area = {"outer": rpc.columns(ring)}
    return {"fill_polygon": {"layer": "grid", "area": area, "value": value}}


class Content(SiteTest):
    """Of two clients, one fills the memory that content may take."""

    def assert_refused(self, client, edit, name="site"):
        with self.assertRaises(grpc.RpcError) as raised:
            client.ApplyEdits(map=name, edits=[edit])
        self.assertEqual(raised.exception.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
        self.assertIn("--max_content_bytes", raised.exception.details())

    def assert_served(self, client, name):
        """Sends questions, and edits that are large but add nothing, on one connection."""
        for i in range(10):
            # More than a connection had to receive in 20 ms to be shut down.
            client.ApplyEdits(map=name, edits=[sites.write_cells([[i % 2, 0.5] * 100] * 200)])
            client.QueryPoint(scope=rpc.scope(name), point=rpc.point(1, 1))

    def test_small_edits_cannot_fill_memory_and_others_are_served_also_after_a_restart(self):
        with self.server(limit_memory(480 * MIB)) as server:
            with rpc.Client(server.address) as other, rpc.Client(server.address) as client:
                sites.make(other, "other")
                sites.make(client)
                self.assert_served(other, "other")
                for number in range(3):
                    client.ApplyEdits(map="site", edits=[fill_comb(number)])
                self.assert_refused(client, fill_comb(3))
                self.assertEqual(sites.revision(client), 6)
                self.assert_served(other, "other")
                # It still may write where it wrote.
                client.ApplyEdits(map="site", edits=[fill_comb(2, 0.7)])
            self.assertNotIn("shut down", server.log())
            self.assertEqual(server.stop(), 0)
        # The stored maps take more than this server may use.
        with self.server(limit_memory(240 * MIB)) as server:
            with rpc.Client(server.address) as other, rpc.Client(server.address) as client:
                self.assert_served(other, "other")
                answer = client.QueryPoint(scope=rpc.scope("site", "grid"),
                                           point=rpc.point(4096 * 2 + 0.25, 1))
                self.assertAlmostEqual(answer.layers[0].value, 0.7)
                self.assert_refused(client, fill_comb(3))
                self.assert_refused(other, sites.put("cup", 1, 1), "other")
                client.ApplyEdits(map="site", edits=[{"delete_layer": {"layer": "grid"}}])
                other.ApplyEdits(map="other", edits=[sites.put("cup", 1, 1)])
                self.assert_served(other, "other")
            self.assertNotIn("shut down", server.log())

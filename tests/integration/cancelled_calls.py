"""What tests of cancellation share: calls that are cancelled while the server works for them."""

import collections
import functools
import math
import os
import random
import time

from google.protobuf import json_format
from hypermap.v1 import edit_service_pb2

import rpc
import sites
from processes import DEADLINE_S, SEED, SiteTest
from test_ingest import observation, opening

# The calls are cancelled when the server has spent this time, plus a random one, on them.
BUSY_S = 0.1
MAX_MORE_S = 0.25
# Processor time that the server may take in the second after the cancellation.
MAX_AFTER_S = 0.3
# A server has nothing to do if none of its threads had work so many times, 10 ms apart.
QUIET_LOOKS = 20
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
GRID_SIDE = 4000  # cells
# Maximum duration of a call. Some take seconds of a processor, of which the threads for long work
# get a hundredth on a busy machine.
LONG_S = 4 * DEADLINE_S

# The rpcs that a test cancels, and the names of their tests.
TESTS = collections.defaultdict(list)


def cancels(*rpcs):
    """Marks the test of these rpcs. The test fails if it has not cancelled each of them."""
    def mark(test):
        @functools.wraps(test)
        def run(self):
            test(self)
            self.assertLessEqual(set(rpcs), self.cancelled)

        for name in rpcs:
            TESTS[name].append(test.__name__)
        return run
    return mark


def cpu_s(pid):
    """Returns the processor time of a process so far, in seconds."""
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def has_work(pid):
    """Whether a thread of a process runs, waits for a processor or for a disk."""
    for thread in os.listdir(f"/proc/{pid}/task"):
        try:
            with open(f"/proc/{pid}/task/{thread}/stat", encoding="ascii") as stat:
                if stat.read().rpartition(")")[2].split()[0] in "RD":
                    return True
        except (FileNotFoundError, ProcessLookupError):
            pass  # The thread has ended.
    return False


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


class CancellationTest(SiteTest):
    """A test case with a server and a map `site`."""

    def setUp(self):
        super().setUp()
        self.random = random.Random(SEED)
        self.site = self.server("--max_exploration_bytes=2147483648")
        self.client = self.enterContext(rpc.Client(self.site.address, LONG_S))
        self.client.CreateMap(map="site")
        # The rpcs that were cancelled.
        self.cancelled = set()

    def begin(self, name, *requests, **fields):
        """Starts a call of an rpc and returns the grpc.Call."""
        return getattr(self.client, name).begin(*requests, **fields)

    def create_things(self, name="things", cols=0, rows=100):
        """Makes a semantic layer with rows of cups, each of them a commit."""
        self.client.CreateLayer(map="site", layer={"name": name, "kind": "LAYER_KIND_SEMANTIC"})
        if not cols:
            return
        # Messages, because parsing all edits from JSON would take most of the test's time.
        row = json_format.ParseDict(
            {"map": "site", "edits": [sites.put("cup", 2 * col, 0, name) for col in range(cols)]},
            edit_service_pb2.ApplyEditsRequest())
        for _ in range(rows):
            self.client.ApplyEdits(row)
            for edit in row.edits:
                ring = edit.put_object.object.shape.polygon.outer
                ring.ys[:] = [y + 2 for y in ring.ys]

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

    def start_exploration(self, begin=False, **fields):
        request = {"map": "site", "area": sites.square(0, 0, 0.05 * GRID_SIDE),
                   "occupancy_layer": "grid", "exploration_layer": "seen", "robot_radius_m": 0.25,
                   "range_m": 4.0, "min_gain_cells": 4, **fields}
        start = self.client.StartExploration
        return start.begin(**request) if begin else start(**request)

    def stripes(self, layer, step_m, side_m):
        """Returns edits that fill 500 stripes of half a step each."""
        return [self.fill({"outer": rpc.columns([(x, 0), (x + step_m / 2, 0),
                                                 (x + step_m / 2, side_m), (x, side_m)])},
                          value=1, layer=layer)
                for x in (step_m * i for i in range(500))]

    def observations(self, robot, n, first_frame=0, per_request=50, **fields):
        """Returns the requests of a stream with n observations of a robot."""
        every = [observation(robot, i, first_frame + i) for i in range(n)]
        return [opening(**fields)] + [{"observations": every[i:i + per_request]}
                                      for i in range(0, n, per_request)]

    def make_fused_layer(self, n, name="things"):
        """Makes a layer of n observations of the robot "a"."""
        self.create_things(name)
        for _ in self.client.Observe(self.observations("a", n, layer=name)):
            pass

    def known(self, robots):
        """Returns the number of these robots' observations that the server has."""
        return sum(known.last + 1 - known.first for robot in robots
                   for answer in self.client.Observe([opening(robot)])
                   for known in answer.opened.known)

    def await_quiet(self):
        """Waits until the server has nothing to do: none of its threads has work for a while. Their
        processor time would not tell, because a thread may wait for a processor for seconds."""
        deadline = time.monotonic() + LONG_S
        quiet = 0
        while quiet < QUIET_LOOKS:
            self.assertLess(time.monotonic(), deadline, "the server does not come to rest")
            time.sleep(0.01)
            quiet = 0 if has_work(self.site.pid) else quiet + 1

    def cancel_at_work(self, name, begin):
        """`begin` starts calls and returns them. Cancels them at a random moment of the work."""
        start = cpu_s(self.site.pid)
        wanted = BUSY_S + self.random.uniform(0.0, MAX_MORE_S)
        calls = begin()
        deadline = time.monotonic() + LONG_S
        while cpu_s(self.site.pid) - start < wanted:
            self.assertTrue(any(call.is_active() for call in calls),
                            f"{name} is too short to be cancelled")
            self.assertLess(time.monotonic(), deadline, f"{name} does not work")
            time.sleep(0.005)
        for call in calls:
            call.cancel()
        # A connection sends in order, which may take a client a second on a busy machine. Once this
        # is answered, the server has been told of all cancellations.
        self.client.GetMap(map="site")

    def expect_given_up(self, name, begin, cancelled=lambda: None):
        """Cancels calls of the rpc `name`, which `begin` starts and returns, and then calls
        `cancelled`. Repeats, because the moment is a random one."""
        figures = []
        for _ in range(3):
            self.await_quiet()
            self.cancel_at_work(name, begin)
            cancelled()
            before = cpu_s(self.site.pid)
            time.sleep(1.0)
            figures.append(cpu_s(self.site.pid) - before)
        print(f"{name}: " + ", ".join(f"{1000 * f:.0f} ms" for f in figures)
              + " of processor time in the second after the cancellation")
        self.assertLessEqual(max(figures), MAX_AFTER_S, name)
        # The server still serves.
        self.client.GetMap(map="site")
        self.cancelled.add(name)

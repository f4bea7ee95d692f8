"""Servers on one database that are drained: clients notice nothing while maps change hands."""

import itertools
import json
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import grpc

import rpc
import sites
from shared_database import FleetTest, changes
from processes import DEADLINE_S, cli

MOVES = 6


class Writers:
    """Threads that add objects to the map `site` while the `with` block runs, one by each server.

    An edit that is UNAVAILABLE is sent again under its request id, as clients do. Any other error
    ends the thread, and is raised.
    """

    def __init__(self, addresses):
        self.made = {}  # label: revision
        self.durations_s = []  # of the edits
        self._addresses = addresses
        self._counts = [0] * len(addresses)  # of edits, by thread
        self._is_ended = threading.Event()

    def _run(self, thread, address):
        with rpc.Client(address) as client:
            while not self._is_ended.is_set():
                label, start = f"{thread}-{self._counts[thread]}", time.monotonic()
                self.made[label] = self._edit(client, label)
                self.durations_s.append(time.monotonic() - start)
                self._counts[thread] += 1

    @staticmethod
    def _edit(client, label):
        deadline = time.monotonic() + DEADLINE_S
        while True:
            try:
                return client.ApplyEdits(map="site", request_id=label,
                                         edits=[sites.put(label, 0, 0)]).revision
            except grpc.RpcError as error:
                if error.code() != grpc.StatusCode.UNAVAILABLE or time.monotonic() > deadline:
                    raise
                time.sleep(0.01)

    def await_edits(self, number):
        """Waits until each thread has made so many more."""
        before = list(self._counts)
        while any(now < then + number for now, then in zip(self._counts, before)):
            for thread in self._threads:
                if thread.done():
                    thread.result()
            time.sleep(0.01)

    def __enter__(self):
        self._pool = ThreadPoolExecutor(len(self._addresses))
        self._threads = [self._pool.submit(self._run, *row) for row in enumerate(self._addresses)]
        return self

    def __exit__(self, *_):
        self._is_ended.set()
        self._pool.shutdown()
        for thread in self._threads:
            thread.result()


class DrainTest(FleetTest):
    def setUp(self):
        super().setUp()
        self.fleet = self.servers(3)
        with rpc.Client(self.fleet[0].address) as client:
            sites.make(client)
        self.fleet.await_map("site", revision=3)

    def drain(self, i, *flags):
        drained = cli("--server", self.fleet.addresses, "server", "drain", f"server_{i}", *flags)
        self.assertEqual(drained.returncode, 0, drained.stderr)
        return drained

    def test_writers_and_watches_notice_nothing(self):
        watches = [self.begin(server.address, "--json", "--retry=60s", "watch", "site", "--from=3")
                   for server in self.fleet]
        with Writers([server.address for server in self.fleet]) as writers:
            for _ in range(MOVES):
                writers.await_edits(20)
                owner = self.await_some_owner()
                self.drain(owner)
                self.assertNotEqual(self.await_some_owner(), owner)
                writers.await_edits(20)
                self.drain(owner, "--undo")
        print(f"{MOVES} moves, {len(writers.made)} edits, "
              f"the longest took {max(writers.durations_s):.2f} s")
        with rpc.Client(self.fleet[0].address) as client:
            newest = max(writers.made.values())
            self.fleet.await_map("site", newest)
            self.assertEqual(sorted(sites.labels(client).values()), sorted(writers.made))
        # One revision for each edit, of which each watch was told once and in order.
        in_order = sorted((revision, label) for label, revision in writers.made.items())
        self.assertEqual([revision for revision, _ in in_order], list(range(4, newest + 1)))
        for watch in watches:
            told = itertools.islice(changes(map(json.loads, watch.stdout)), len(in_order))
            self.assertEqual([(change["revision"], change["entity"]["label"]) for change in told],
                             in_order)

    def test_a_load_loses_nothing(self):
        """Editors, watches, replicas and streams of observations."""
        load = self.begin(self.fleet.addresses, "--json", "bench", "load", "--robots=4",
                          "--observe_hz=2", "--replicas=3", "--full_replicas=2", "--watchers=3",
                          "--editors=3", "--edits_hz=10", "--warmup_seconds=1", "--seconds=20")
        self.fleet.await_map("load", revision=40)
        for _ in range(MOVES):
            owner = self.await_some_owner("load")
            self.drain(owner)
            self.drain(owner, "--undo")
        report, errors = load.communicate(timeout=DEADLINE_S)
        self.assertEqual(load.returncode, 0, report + errors)

    def test_drained_servers_are_listed_until_they_start_anew(self):
        drained = self.drain(0, "--json")
        self.assertEqual(json.loads(drained.stdout), {"server": "server_0", "draining": True})
        self.assertEqual(self.listed(), {"server_0": True, "server_1": False, "server_2": False})
        self.assertNotEqual(self.await_some_owner(), 0)
        self.fleet.kill(0)
        self.fleet.restart(0)
        self.assertEqual(self.listed(), {"server_0": False, "server_1": False, "server_2": False})

    def test_the_last_server_keeps_its_maps(self):
        for i in (1, 2):
            self.drain(i)
        self.assertEqual(self.await_some_owner(), 0)
        last = cli("--server", self.fleet.addresses, "server", "drain", "server_0", "--timeout=1s")
        self.assertEqual(last.returncode, 1)
        self.assertIn("server_0 owns 1 map, which no other server takes", last.stderr)
        with rpc.Client(self.fleet[1].address) as client:
            client.ApplyEdits(map="site", edits=[sites.put("cup", 0, 0)])

    def test_a_server_that_does_not_live_is_not_found(self):
        unknown = cli("--server", self.fleet.addresses, "server", "drain", "server_9")
        self.assert_fails(unknown, "server_9", "NOT_FOUND", code=1)

    def listed(self):
        return {server["id"]: server["draining"]
                for server in self.fleet[1].json("servers")["servers"]}

    def await_some_owner(self, map_name="site"):
        """Returns the index of the server that owns a map, which may be changing hands."""
        deadline = time.monotonic() + DEADLINE_S
        while (owner := self.fleet.owner_of(map_name)) is None:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)
        return owner

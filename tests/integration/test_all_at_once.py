"""Clients that create, delete, import, edit, export, back up, watch and observe the same two maps
at once: no call meets an internal error, and no thread and no open file of the server is left."""

import base64
import collections
import contextlib
import itertools
import os
import pathlib
import random
import re
import threading
import time
import unittest

import grpc

import rpc
import sites
from processes import DEADLINE_S, SEED, SiteTest
from test_durability import geojson_of_squares
from test_ingest import observation, opening

# Rounds after the first one, in which the pools of threads grow to their size.
ROUNDS = int(os.environ.get("HYPERMAP_TEST_ROUNDS", "2"))
THREADS = 16
# Calls of each client in a round.
ACTIONS = 20
# Handover::kMostThreads (base/admission/handover.h).
HANDOVER_THREADS = 8
MAPS = ("east", "west")
GRID = {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": 0.25}
EVERYWHERE = sites.square(-5000, -5000, 10000)

# Refusals that other clients can cause.
REFUSALS = {grpc.StatusCode.NOT_FOUND, grpc.StatusCode.ALREADY_EXISTS, grpc.StatusCode.ABORTED,
            grpc.StatusCode.FAILED_PRECONDITION, grpc.StatusCode.OUT_OF_RANGE,
            grpc.StatusCode.RESOURCE_EXHAUSTED}
# Other refusals that they can cause: the map is being deleted, or has no layers to export yet.
OTHER_REFUSALS = {grpc.StatusCode.UNAVAILABLE: "is closing",
                  grpc.StatusCode.INVALID_ARGUMENT: "edits is empty"}


def is_expected(error):
    """Whether a refusal may be the work of other clients."""
    return error.code() in REFUSALS or OTHER_REFUSALS.get(error.code(), "?") in error.details()


def upload(name, file_format, data):
    """Returns the requests of ImportMap for one file, in two pieces."""
    yield {"header": {"map": name, "format": f"FILE_FORMAT_{file_format}", "layer": "things",
                      "create_map": True}}
    half = len(data) // 2
    for piece in (data[:half], data[half:]):
        yield {"chunk": {"file_name": "file", "data": base64.b64encode(piece).decode()}}


class Worker(threading.Thread):
    """Makes random calls one after another."""

    def __init__(self, address, number, seed):
        super().__init__()
        self._address, self._random = address, random.Random(f"{seed} {number}")
        self._copy = f"copy-{number}"
        self._robot, self._frames = f"robot {seed} {number}", itertools.count()
        self.done = collections.Counter()  # name of the action -> successful ones
        self.unexpected = []

    def run(self):
        others = [self.create, self.upload_objects, self.upload_map, self.edit, self.edit,
                  self.export, self.back_up, self.watch, self.observe, self.ask]
        # Deletions are few, so that most calls find a map.
        actions = [self.delete, *others * 4]
        with rpc.Client(self._address) as client:
            for _ in range(ACTIONS):
                action, name = self._random.choice(actions), self._random.choice(MAPS)
                try:
                    action(client, name)
                    self.done[action.__name__] += 1
                except grpc.RpcError as error:
                    self._take_refusal(client, name, action, error)
                except Exception as error:  # pylint: disable=broad-except
                    self.unexpected.append((action.__name__, error))

    def _take_refusal(self, client, name, action, error):
        if not is_expected(error):
            self.unexpected.append((action.__name__, error.code(), error.details()))
        elif error.code() == grpc.StatusCode.NOT_FOUND and action != self.create:
            try:
                self.create(client, name)
            except grpc.RpcError as again:
                self._take_refusal(client, name, self.create, again)

    def create(self, client, name):
        """Creates what is missing of a map."""
        self._make(client.CreateMap, map=name)
        for layer, kind in (("things", "SEMANTIC"), ("grid", "OCCUPANCY"), ("seen", "EXPLORATION")):
            self._make(client.CreateLayer, map=name, layer={
                "name": layer, "kind": f"LAYER_KIND_{kind}",
                **({} if kind == "SEMANTIC" else {"grid": GRID})})

    @staticmethod
    def _make(method, **request):
        try:
            method(**request)
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.ALREADY_EXISTS:
                raise

    def delete(self, client, name):
        client.DeleteMap(map=name)

    def upload_objects(self, client, name):
        client.ImportMap(upload(name, "GEOJSON", geojson_of_squares(50)))

    def upload_map(self, client, name):
        """Imports the export of a map as a map of its own, and deletes that."""
        data = b"".join(answer.chunk.data for answer in client.ExportMap(
            map=name, format="FILE_FORMAT_HMAP"))
        client.ImportMap(upload(self._copy, "HMAP", data))
        client.DeleteMap(map=self._copy)

    def edit(self, client, name):
        x, y = self._random.uniform(-20, 20), self._random.uniform(-20, 20)
        client.ApplyEdits(map=name, edits=[
            sites.put("chair", x, y),
            sites.write_cells([[self._random.random()] * 20] * 20, row=int(x), col=int(y))])

    def export(self, client, name):
        file_format = self._random.choice(["HMAP", "GEOJSON", "NAV2"])
        self._read(client.ExportMap(map=name, format=f"FILE_FORMAT_{file_format}",
                                    layers=["grid"] if file_format == "NAV2" else []))

    def back_up(self, client, name):
        self._read(client.BackupMap(map=name))

    def watch(self, client, name):
        call = self._random.choice([client.Watch, client.Replicate])(scope=rpc.scope(name))
        for _ in range(self._random.randint(1, 4)):
            next(call)
        call.cancel()

    def observe(self, client, name):
        frames = [next(self._frames) for _ in range(5)]
        requests = [opening(self._robot, map=name, exploration_layer="seen"),
                    *({"observations": [observation(self._robot, frame, frame)]}
                      for frame in frames)]
        self._read(client.Observe(requests))

    def ask(self, client, name):
        revision = client.GetMap(map=name).map.revision
        as_of = rpc.at(self._random.randint(0, revision))
        self._read(client.QueryArea(scope=rpc.scope(name), area=EVERYWHERE, as_of=as_of))
        self._read(client.ListChanges(scope=rpc.scope(name),
                                      from_revision=as_of["at_revision"], to_revision=revision))

    def _read(self, stream):
        """Reads a stream to its end; one in four is cancelled after its first message."""
        cancelled = self._random.random() < 0.25
        for _ in stream:
            if cancelled:
                stream.cancel()
                return


def threads_of(pid):
    """Returns how many threads of each name a process has."""
    names = collections.Counter()
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(OSError):  # It has ended meanwhile.
            names[(task / "comm").read_text().strip()] += 1
    return names


def own_threads_of(pid):
    """Returns the same without threads that are started on demand and stay: the pools of gRPC, and
    those that give connections to gRPC, of which there is one more, up to HANDOVER_THREADS,
    whenever connections wait."""
    return collections.Counter({
        name: number for name, number in threads_of(pid).items()
        if name.startswith(("hm-", "hypermapd")) and name != "hm-handover"})


def files_of(pid):
    """Returns how many open files of each name a process has; numbers in the names do not count,
    as those of sockets."""
    names = collections.Counter()
    for link in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):  # It was closed meanwhile.
            names[re.sub(r"\d+", "N", os.readlink(link))] += 1
    return names


def wait_until_at_most(pid, count, before):
    """Waits until a process has no more threads or files of each name than `before`."""
    deadline = time.monotonic() + DEADLINE_S
    while more := count(pid) - before:
        if time.monotonic() > deadline:
            raise AssertionError(f"left over: {dict(more)}")
        time.sleep(0.05)


class AllAtOnce(SiteTest):

    def setUp(self):
        super().setUp()
        # Watches of a quiet map get a message soon, too.
        self.site = self.server("--watch_progress=100ms")

    def work(self, number):
        """Runs all clients, and deletes the maps. Returns the number of successes by action."""
        workers = [Worker(self.site.address, i, f"{SEED} {number}") for i in range(THREADS)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        self.assertEqual([error for worker in workers for error in worker.unexpected], [],
                         f"HYPERMAP_TEST_SEED={SEED}")
        self.assertTrue(self.site.running(), self.site.log())
        with rpc.Client(self.site.address) as client:
            for entry in client.ListMaps().maps:
                self.assertEqual(entry.problem, "")
                client.DeleteMap(map=entry.name)
        return sum((worker.done for worker in workers), collections.Counter())

    def test_no_call_meets_an_internal_error_and_nothing_is_left_over(self):
        files = files_of(self.site.pid)
        done = self.work(0)
        wait_until_at_most(self.site.pid, files_of, files)
        threads, own_threads = threads_of(self.site.pid), own_threads_of(self.site.pid)
        for number in range(ROUNDS):
            done += self.work(number + 1)
        wait_until_at_most(self.site.pid, files_of, files)
        wait_until_at_most(self.site.pid, own_threads_of, own_threads)
        self.assertLessEqual(threads_of(self.site.pid).total(),
                             threads.total() + 2 * os.cpu_count() + HANDOVER_THREADS)
        self.assertEqual(self.site.stop(), 0, self.site.log())
        # Each of the actions has succeeded.
        self.assertEqual(len(done), 10, done)


if __name__ == "__main__":
    unittest.main()

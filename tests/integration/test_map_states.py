"""A map degrades alone: on a full disk, with a damaged file, with too few open files or while another
process holds it, it is served as far as that goes, tells the reason, and recovers by itself."""

import fcntl
import json
import resource
import sqlite3
import time
import unittest
import urllib.request

import grpc

import rpc
import sites
from processes import DEADLINE_S, SiteTest
from test_full_disk import MAX_EDITS, NOTE, DiskTest

SERVING, DAMAGED, READ_ONLY, CLOSED = 1, 2, 3, 4  # hypermap.v1.MapState
STATE_NAMES = {SERVING: "serving", DAMAGED: "damaged", READ_ONLY: "read_only", CLOSED: "closed"}
STATUS_DAMAGED = 6  # hypermap.v1.AnswerStatus
PAGE = 4096


class MapStates:
    """What a server tells of the states of its maps."""

    def start(self, **options):
        self.site = self.server("--log_format=json", "--metrics_listen=127.0.0.1:0", **options)
        lines = [json.loads(line) for line in self.site.log().splitlines()]
        (listens,) = [line for line in lines if line["message"] == "metrics are served"]
        self.http = f"http://{listens['address']}"
        self.client = self.enterContext(rpc.Client(self.site.address))

    def get(self, path):
        with urllib.request.urlopen(self.http + path, timeout=DEADLINE_S) as answer:
            return answer.read().decode()

    def entry(self, name):
        return {entry.name: entry for entry in self.client.ListMaps().maps}[name]

    def await_state(self, state, name="site"):
        """Waits until the map is in this state, and everything that tells it says so."""
        deadline = time.monotonic() + DEADLINE_S
        while self.entry(name).state != state:
            self.assertLess(time.monotonic(), deadline, self.entry(name))
            time.sleep(0.05)
        entry = self.entry(name)
        self.assertEqual(bool(entry.problem), state != SERVING)
        for other, word in STATE_NAMES.items():
            line = f'hypermap_map_state{{map="{name}",state="{word}"}} {int(other == state)}\n'
            self.assertIn(line, self.get("/metrics"))
        self.assertIn(f'hypermap_map_up{{map="{name}"}} {int(state != CLOSED)}\n',
                      self.get("/metrics"))
        ready = self.get("/readyz")
        if state == SERVING:
            self.assertNotIn(f"map {name}:", ready)
        else:
            self.assertIn(f"map {name}: {STATE_NAMES[state]}: {entry.problem}\n", ready)
        (shown,) = [m for m in self.site.json("maps")["maps"] if m["name"] == name]
        self.assertEqual(shown["state"], STATE_NAMES[state])
        self.assertEqual(shown.get("problem", ""), entry.problem)
        answers = state != CLOSED
        edits = state in (SERVING, DAMAGED)
        for service, is_well in ((f"map/{name}", answers), (f"map/{name}/edits", edits)):
            expected = rpc.SERVING if is_well else rpc.NOT_SERVING
            while rpc.health(self.site.address, service) != expected:
                self.assertLess(time.monotonic(), deadline, service)
        return entry

    def refused(self, call, **fields):
        """Returns the code with which the call is refused."""
        with self.assertRaises(grpc.RpcError) as caught:
            answer = call(**fields)
            for _ in answer if hasattr(answer, "__next__") else ():
                pass
        return caught.exception.code()

    def edit(self, name="site", note=""):
        self.client.ApplyEdits(map=name, edits=[
            sites.put("chair", 0, 0, attributes={"note": {"string_value": note}})])


class FullDisk(MapStates, DiskTest):

    def test_map_is_read_only_until_there_is_room_again(self):
        self.start()
        sites.make(self.client)
        self.edit()
        self.await_state(SERVING)
        self.fill_disk("ballast")
        with self.assertRaises(grpc.RpcError) as caught:
            for _ in range(MAX_EDITS):
                self.edit(note=NOTE)
        self.assertEqual(caught.exception.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
        entry = self.await_state(READ_ONLY)
        self.assertIn("full", entry.problem)
        self.assertEqual(len(sites.labels(self.client)), entry.revision - 3)
        (self.disk / "ballast").unlink()
        # Nobody edits it.
        self.await_state(SERVING)
        self.edit(note=NOTE)
        self.assertEqual(self.site.stop(), 0)


class DamagedLayer(MapStates, SiteTest):

    def setUp(self):
        super().setUp()
        self.start()
        for name in ("site", "other"):
            sites.make(self.client, name)
            self.client.CreateLayer(map=name, layer={
                "name": "rooms", "kind": "LAYER_KIND_SEMANTIC"})
            self.client.ApplyEdits(map=name, edits=[
                sites.put("chair", x, 1, layer) for x in range(60) for layer in ("things", "rooms")])
        self.assertEqual(self.site.stop(), 0)
        self.path = self.data_dir / "site.gpkg"
        with sqlite3.connect(self.path) as file:
            pages = [page for (page,) in file.execute(
                "SELECT pageno FROM dbstat WHERE name = 'things' AND pagetype = 'leaf'")]
        file.close()
        self.intact = self.path.read_bytes()
        damaged = bytearray(self.intact)
        damaged[(pages[-1] - 1) * PAGE + 2000] ^= 16
        self.path.write_bytes(damaged)
        self.start()

    def test_is_named_and_all_else_goes_on(self):
        entry = self.await_state(DAMAGED)
        self.assertIn("layer things", entry.problem)
        self.await_state(SERVING, "other")
        layers = {layer.name: layer for layer in self.client.ListLayers(map="site").layers}
        self.assertEqual([name for name in layers if layers[name].problem], ["things"])
        self.assertEqual(entry.layer_count, len(layers))
        self.assertEqual(len(sites.labels(self.client, layer="rooms")), 60)
        self.client.ApplyEdits(map="site", edits=[sites.put("desk", 1, 1, "rooms")])
        self.assertEqual(len(sites.labels(self.client, layer="rooms")), 61)

    def test_is_never_served_as_if_it_were_empty(self):
        answer = self.client.QueryPoint(scope=rpc.scope("site"), point=rpc.point(0.5, 1.5))
        statuses = {layer.layer: layer.status for layer in answer.layers}
        self.assertEqual(statuses["things"], STATUS_DAMAGED)
        self.assertNotEqual(statuses["rooms"], STATUS_DAMAGED)
        (part,) = [answer.part for answer in self.client.QueryArea(
            scope=rpc.scope("site", "things"), area=sites.square(0, 0, 9))]
        self.assertEqual(part.status, STATUS_DAMAGED)
        nearest = self.client.QueryNearest(scope=rpc.scope("site"), point=rpc.point(0, 0),
                                           value="chair", k=1)
        self.assertIn(("things", STATUS_DAMAGED), [(r.layer, r.status) for r in nearest.refusals])
        lost = grpc.StatusCode.DATA_LOSS
        for call, fields in (
                (self.client.ApplyEdits, {"map": "site", "edits": [sites.put("x", 0, 0)]}),
                (self.client.DeleteLayer, {"map": "site", "layer": "things"}),
                (self.client.Watch, {"scope": rpc.scope("site", "things")}),
                (self.client.Replicate, {"scope": rpc.scope("site")}),
                (self.client.BackupMap, {"map": "site"})):
            with self.subTest(call=call):
                self.assertEqual(self.refused(call, **fields), lost)
        self.assertEqual(self.site.cli("check", "site").returncode, 1)

    def test_is_whole_again_with_the_file(self):
        self.assertEqual(self.site.stop(), 0)
        self.path.write_bytes(self.intact)
        self.start()
        self.await_state(SERVING)
        self.assertEqual(len(sites.labels(self.client)), 60)


class ClosedMap(MapStates, SiteTest):

    def setUp(self):
        super().setUp()
        self.start()
        for name in ("site", "other"):
            sites.make(self.client, name)
            self.edit(name)
        self.assertEqual(self.site.stop(), 0)

    def test_is_opened_when_the_process_that_holds_it_ends(self):
        with open(self.data_dir / ".site.gpkg.lock", "rb+") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.start()
            entry = self.await_state(CLOSED)
            self.assertIn("locked by another process", entry.problem)
            self.await_state(SERVING, "other")
            self.edit("other")
        self.await_state(SERVING)
        self.edit()
        self.assertEqual(self.refused(self.client.DeleteMap, map="nowhere"),
                         grpc.StatusCode.NOT_FOUND)

    def test_is_opened_when_its_damaged_file_is_replaced(self):
        path = self.data_dir / "site.gpkg"
        intact = path.read_bytes()
        path.write_bytes(b"x" + intact[1:])
        self.start()
        self.await_state(CLOSED)
        self.await_state(SERVING, "other")
        path.write_bytes(intact)
        self.await_state(SERVING)
        self.assertEqual(len(sites.labels(self.client)), 1)


class TooFewFiles(MapStates, SiteTest):

    def test_maps_go_on_and_recover(self):
        self.start()
        for name in ("site", "other"):
            sites.make(self.client, name)
            self.edit(name)
        pid = self.site.pid
        before = resource.prlimit(pid, resource.RLIMIT_NOFILE)
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (3, before[1]))
        self.addCleanup(resource.prlimit, pid, resource.RLIMIT_NOFILE, before)
        # A backup opens the files of the map.
        self.assertIn(self.refused(self.client.BackupMap, map="site"),
                      (grpc.StatusCode.RESOURCE_EXHAUSTED, grpc.StatusCode.UNAVAILABLE))
        self.assertIn(self.refused(self.client.CreateMap, map="third"),
                      (grpc.StatusCode.RESOURCE_EXHAUSTED, grpc.StatusCode.UNAVAILABLE))
        for name in ("site", "other"):
            self.edit(name)
            self.assertEqual(len(sites.labels(self.client, name)), 2)
        resource.prlimit(pid, resource.RLIMIT_NOFILE, before)
        list(self.client.BackupMap(map="site"))
        sites.make(self.client, "third")
        for name in ("site", "other", "third"):
            self.await_state(SERVING, name)


if __name__ == "__main__":
    unittest.main()

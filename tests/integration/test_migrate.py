"""Maps move from files to a database and back, whole, also when the moving is killed in between."""

import json
import os
import random
import signal
import subprocess
import time
import unittest

import rpc
import sites
from asking import Asking
from fused import make, observation, observe
from processes import BIN, DEADLINE_S, SEED, SiteTest, cli, real_maps

CLUSTER = os.environ.get("HYPERMAP_TEST_POSTGRES")
# Revisions of the map with a fused layer.
REVISIONS = int(os.environ.get("HYPERMAP_TEST_REVISIONS", "600"))
ASKED_REVISIONS = min(200, REVISIONS)
EVERYWHERE = sites.square(-1000, -1000, 2000)
NOT_EQUAL, IN_USE = 1, 3


@unittest.skipUnless(CLUSTER, "no PostgreSQL: run it by tests/postgres/with_cluster.sh")
class Migrate(SiteTest):

    def setUp(self):
        super().setUp()
        self.draw = random.Random(SEED)
        name = f"migrate_{os.getpid()}_{time.monotonic_ns()}"
        self.psql("postgres", f"CREATE DATABASE {name} STRATEGY FILE_COPY")
        self.database = f"{CLUSTER}/{name}"
        self.back = self.folder / "back"

    @staticmethod
    def psql(database, statement):
        subprocess.run(["psql", "-q", "-d", f"{CLUSTER}/{database}", "-c", statement], check=True,
                       timeout=DEADLINE_S, capture_output=True)

    def migrate(self, *arguments, code=0):
        """Returns {map: what the command tells of it}."""
        result = cli("--json", "migrate", *arguments)
        self.assertEqual(result.returncode, code, (result.stdout, result.stderr))
        return {m["map"]: m for m in json.loads(result.stdout)["migrated"]}

    def move(self, source, target, state="moved"):
        maps = self.migrate("--from", source, "--to", target)
        for name, told in maps.items():
            self.assertEqual((told.get("state"), told.get("differing")), (state, []), (name, told))
        return {name: told["digests"] for name, told in maps.items()}

    def make_fused(self, revisions):
        """Makes the map `site` with observations, retractions, edits and requests."""
        with rpc.Client(self.server("--history_revisions=1000000").address) as client:
            make(client)
            observe(client, [observation("a", f, f) for f in range(0, 40, 2)])
            observe(client, [observation("b", f, f) for f in range(1, 40, 2)])
            client.RetractSource(map="site", layer="things", robot="b",
                                 **{"from": "2023-11-14T22:00:05Z", "to": "2023-11-14T22:00:09Z"})
            for i in range(sites.revision(client), revisions):
                edits = [sites.write_cells([[self.draw.random(), "NaN"]], row=i % 300, col=i % 7),
                         sites.put(f"box {i}", i % 50, i // 50, layer="adrift")]
                self.last_edit = {"map": "site", "edits": edits[:1 + i % 2],
                                  "request_id": f"edit {i}"}
                client.ApplyEdits(**self.last_edit)
            return sites.revision(client)

    def answers(self, client, revision):
        """What a server tells of the whole map at a revision."""
        scope = rpc.scope("site")
        return [part.SerializeToString(deterministic=True)
                for part in client.QueryArea(scope=scope, as_of=rpc.at(revision),
                                             area=EVERYWHERE)]

    def assert_same_answers(self, one, other, newest):
        with rpc.Client(one.address) as a, rpc.Client(other.address) as b:
            self.assertEqual(a.GetMap(map="site"), b.GetMap(map="site"))
            for _ in range(ASKED_REVISIONS):
                revision = self.draw.randint(1, newest)
                self.assertEqual(self.answers(a, revision), self.answers(b, revision), revision)
            # A retry gets the answer of the first time, in both.
            for client in (a, b):
                self.assertEqual(client.ApplyEdits(**self.last_edit).revision, newest)

    @unittest.skipUnless(real_maps(), "the recorded maps are missing")
    def test_recorded_maps_come_back_as_they_were(self):
        site = self.server()
        for name, path in real_maps().items():
            site.json("import", path, "--map", name)
        self.assertEqual(site.stop(), 0)
        there = self.move(self.data_dir, self.database)
        self.assertEqual(sorted(there), sorted(real_maps()))
        self.assertEqual(self.move(self.database, self.back), there)
        # The same again finds the copies.
        self.assertEqual(self.move(self.data_dir, self.database, "there_before"), there)
        told = self.migrate("--from", self.data_dir, "--to", self.back, "--verify_only")
        self.assertEqual({n: m["digests"] for n, m in told.items()}, there)

    def test_servers_on_both_stores_answer_alike(self):
        newest = self.make_fused(REVISIONS)
        self.end_servers()
        there = self.move(self.data_dir, self.database)
        self.assertEqual(self.move(self.database, self.back), there)
        self.assertIn("evidence of things", there["site"])
        flags = ["--history_revisions=1000000"]
        files = self.server(*flags)
        database = self.server(*flags, f"--store={self.database}", data_dir=self.folder / "empty")
        self.assert_same_answers(files, database, newest)
        back = self.server(*flags, data_dir=self.back)
        with rpc.Client(files.address) as a, rpc.Client(back.address) as b:
            self.assertEqual(self.answers(a, newest), self.answers(b, newest))

    def test_a_copy_that_was_killed_goes_on(self):
        self.make_fused(REVISIONS)
        self.end_servers()
        expected = self.migrate("--from", self.data_dir, "--to", self.folder / "none",
                                "--dry_run")["site"]["digests"]
        for source, target in ((self.data_dir, self.database), (self.database, self.back)):
            kills = 0
            for delay_s in (0.2, 0.4, 0.7, 1.0, 1.5):
                process = subprocess.Popen(
                    [BIN / "hypermap", "migrate", "--from", str(source), "--to", str(target)],
                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                try:
                    process.wait(delay_s)
                except subprocess.TimeoutExpired:
                    process.send_signal(signal.SIGKILL)
                    kills += 1
                process.wait(DEADLINE_S)
            self.assertGreater(kills, 0)
            told = self.migrate("--from", source, "--to", target)["site"]
            self.assertIn(told["state"], ("moved", "there_before"))
            self.assertEqual(told["digests"], expected)

    def test_a_map_that_is_served_is_followed_and_moves_when_its_server_ends(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            make(client)
            observe(client, [observation("a", f, f) for f in range(20)])
        asking = Asking(site.address, "site")
        asking.start()
        self.assertTrue(asking.await_answer())
        told = self.migrate("--from", self.data_dir, "--to", self.database, code=IN_USE)["site"]
        self.assertEqual((told["state"], told["differing"]), ("in_use", []))
        self.assertTrue(asking.await_answer(), "the map is served meanwhile")
        asking.stop()
        # The unfinished copy is no map to a server on the database.
        other = self.server(f"--store={self.database}", data_dir=self.folder / "empty")
        with rpc.Client(other.address) as client:
            self.assertEqual(len(client.ListMaps().maps), 0)
        self.assertEqual(site.stop(), 0)
        self.assertEqual(other.stop(), 0)
        self.move(self.data_dir, self.database)

    def test_a_copy_that_was_changed_is_told(self):
        self.make_fused(60)  # more than the observations make
        self.end_servers()
        self.move(self.data_dir, self.database)
        name = self.database.rsplit("/", 1)[1]
        self.psql(name, "UPDATE hypermap.receipts SET revision = revision - 1 "
                        f"WHERE request_id = '{self.last_edit['request_id']}'")
        told = self.migrate("--from", self.data_dir, "--to", self.database, "--verify_only",
                            code=NOT_EQUAL)["site"]
        self.assertEqual((told["state"], told["differing"]), ("differs", ["receipts"]))

    def end_servers(self):
        """Stops the server on the data folder, so that it has closed its files."""
        self.assertEqual(self.site.stop(), 0)

    def server(self, *flags, **options):
        self.site = super().server(*flags, **options)
        return self.site

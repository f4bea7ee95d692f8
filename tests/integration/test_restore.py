"""Checks, repairs and restores maps with the command, beside a watcher and a replica."""

import base64
import contextlib
import json
import pathlib
import sqlite3
import time

import grpc

import rpc
import sites
from processes import DEADLINE_S, SiteTest, cli


def damage(path, sql):
    with contextlib.closing(sqlite3.connect(path)) as database, database:
        # The triggers of the index name them.
        for name in ("ST_IsEmpty", "ST_MinX", "ST_MaxX", "ST_MinY", "ST_MaxY"):
            database.create_function(name, 1, lambda _: 0)
        database.execute(sql)
        # As an edit of a layer leaves it; otherwise the checksums of pages tell the damage.
        database.execute("UPDATE hypermap_metadata SET foreign_writes = 1")


class Restore(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server("--watch_progress=100ms")
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)
        self.put("chair", 1)
        self.backup = self.folder / "site.gpkg"
        self.ok("backup", "site", "-o", self.backup)

    def put(self, label, x):
        return self.client.ApplyEdits(map="site", edits=[sites.put(label, x, 1)]).revision

    def ok(self, *arguments):
        result = self.site.cli(*arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def findings(self, *arguments, server=True, code=1):
        run = self.site.cli if server else cli
        result = run("--json", "check", *arguments)
        self.assertEqual(result.returncode, code, result.stderr)
        return [f for one in json.loads(result.stdout)["checked"] for f in one["findings"]]

    def labels(self, name="site"):
        return sorted(sites.labels(self.client, name).values())

    def incarnation(self):
        return self.client.GetMap(map="site").map.incarnation

    def test_a_backup_is_clean_and_becomes_a_map_of_any_name(self):
        self.assertEqual(self.findings(self.backup, server=False, code=0), [])
        self.assertEqual(self.findings("site", code=0), [])
        self.ok("restore", self.backup, "--map", "copy")
        self.assertEqual(self.labels("copy"), ["chair"])
        self.assert_fails(self.site.cli("restore", self.backup), "already_exists")
        self.assertEqual(self.findings("copy", code=0), [])

    def test_watches_and_replicas_begin_anew_instead_of_believing(self):
        # Both know a revision that the backup does not have.
        newest = self.put("table", 3)
        before = self.incarnation()
        calls = [call(scope=rpc.scope("site"), start_revision=newest, timeout=DEADLINE_S)
                 for call in (self.client.Watch, self.client.Replicate)]
        for call in calls:
            next(call)
        self.ok("restore", self.backup, "--replace")
        for call in calls:
            with self.assertRaises(grpc.RpcError):
                list(call)
        self.assertNotEqual(self.incarnation(), before)
        self.assertEqual(self.labels(), ["chair"])
        # The revision is reached again, by another history: a client that names the incarnation it
        # knows is told, and begins anew with a snapshot.
        self.assertEqual(self.put("couch", 5), newest)
        scope = {**rpc.scope("site"), "incarnation": str(before)}
        for call in (self.client.Watch, self.client.Replicate):
            with self.assertRaises(grpc.RpcError) as caught:
                list(call(scope=scope, start_revision=newest))
            self.assertEqual(caught.exception.code(), grpc.StatusCode.ABORTED)
            self.assertEqual(next(call(scope=rpc.scope("site"))).incarnation, self.incarnation())
        self.assertEqual(self.labels(), ["chair", "couch"])
        # The map that was replaced is in the trash.
        self.assertTrue(list((self.data_dir / "trash").rglob("site.gpkg")))

    def test_a_retry_of_a_restoration_changes_nothing(self):
        messages = [{"header": {"map": "site", "replace": True, "request_id": "r1"}},
                    {"data": base64.b64encode(self.backup.read_bytes()).decode()}]
        first = self.client.RestoreMap(messages).map
        self.put("couch", 5)
        again = self.client.RestoreMap(messages).map
        self.assertEqual(again.incarnation, first.incarnation)
        self.assertEqual(self.labels(), ["chair", "couch"])

    def test_a_damaged_backup_is_not_restored(self):
        damage(self.backup, "UPDATE things SET label = ''")
        (finding,) = self.findings(self.backup, server=False)
        self.assertEqual(finding["table"], "things")
        self.put("table", 3)
        before = self.incarnation()
        self.assert_fails(self.site.cli("restore", self.backup, "--replace"), "data_loss",
                          "things")
        self.backup.write_bytes(b"no database")
        self.assert_fails(self.site.cli("restore", self.backup, "--replace"),
                          "failed_precondition")
        self.assertEqual((self.incarnation(), self.labels()), (before, ["chair", "table"]))
        self.assertFalse(list(self.data_dir.glob(".scratch*")))

    def test_a_file_that_lost_its_index_is_repaired(self):
        damage(self.backup, "DELETE FROM rtree_things_geom")
        findings = self.findings(self.backup, server=False)
        self.assertTrue(findings)
        self.assertTrue(all(f["can_be_rebuilt"] for f in findings), findings)
        self.assertEqual(self.findings(self.backup, "--repair", server=False, code=0), [])
        self.assertTrue(pathlib.Path(f"{self.backup}.before-repair").exists())
        self.ok("restore", self.backup, "--replace")
        self.assertEqual(self.labels(), ["chair"])

    def test_the_files_of_a_server_cannot_be_checked_by_path(self):
        self.assert_fails(cli("check", self.data_dir / "site.gpkg"), "has the map open", code=2)
        self.assertEqual(self.site.stop(), 0)
        self.assertEqual(self.findings(f"{self.data_dir}/", server=False, code=0), [])

    def test_the_server_makes_backups_by_itself(self):
        self.assertEqual(self.site.stop(), 0)
        folder = self.folder / "backups"
        self.site = self.server(f"--backup_folder={folder}", "--backup_every=1s",
                                "--backup_keep=2")
        deadline = time.monotonic() + DEADLINE_S
        while len(made := sorted(folder.glob("*/site.gpkg"))) < 2:
            self.assertLess(time.monotonic(), deadline, self.site.log())
            time.sleep(0.05)
        self.assertEqual(self.site.stop(), 0)
        made = sorted(folder.glob("*/site.gpkg"))
        self.assertLessEqual(len(made), 2)
        for path in made:
            self.assertEqual(self.findings(path, server=False, code=0), [])

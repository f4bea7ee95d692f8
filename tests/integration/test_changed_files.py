"""C3, C5: files that change under a running server, and write-ahead logs that are damaged after a
kill. No edit is acknowledged that the next start would not find, and no acknowledged edit is
missing without a word."""

import os
import random
import shutil
import unittest

import grpc

import rpc
import sites
from processes import SEED, SiteTest

EDITS = 20
CUTS = int(os.environ.get("HYPERMAP_TEST_ROUNDS", "20"))


def chair(i):
    return sites.put(f"chair {i}", i, 0)


class ChangedFiles(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))
        for name in ("site", "other"):
            sites.make(self.client, name)
        self.edit("site")

    def edit(self, name):
        return self.client.ApplyEdits(map=name, edits=[chair(0)])

    def path(self, suffix=""):
        return self.data_dir / f"site.gpkg{suffix}"

    def backup(self):
        """Returns the path of a copy of the map `other`."""
        copy = self.folder / "copy.gpkg"
        self.site.json("backup", "other", "-o", copy)
        return copy

    def assert_closed(self, reason):
        """Checks that the map acknowledges nothing any more, and that everybody is told why."""
        for _ in range(3):
            with self.assertRaises(grpc.RpcError) as refused:
                self.edit("site")
            self.assertEqual(refused.exception.code(), grpc.StatusCode.DATA_LOSS)
            self.assertIn(reason, refused.exception.details())
        with self.assertRaises(grpc.RpcError) as refused:
            self.client.GetMap(map="site")
        self.assertEqual(refused.exception.code(), grpc.StatusCode.DATA_LOSS)
        maps = {m.name: m for m in self.client.ListMaps().maps}
        self.assertIn(reason, maps["site"].problem)
        self.assertEqual(maps["other"].problem, "")
        self.assertIn(reason, self.site.log())

    def assert_other_map_works(self):
        acknowledged = self.edit("other").revision
        self.assertEqual(sites.revision(self.client, "other"), acknowledged)

    def restart(self):
        self.assertEqual(self.site.stop(), 0)
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))

    def test_c3_the_file_is_removed(self):
        self.path().unlink()
        self.assert_closed("the file of the map was removed")
        self.assert_other_map_works()
        self.restart()
        self.assertEqual([m.name for m in self.client.ListMaps().maps], ["other"])

    def test_c3_the_file_is_replaced(self):
        before = self.client.GetMap(map="site").map.incarnation
        copy = self.backup()
        content = copy.read_bytes()
        os.replace(copy, self.path())
        self.assert_closed("the file of the map was replaced")
        self.assert_other_map_works()
        self.assertEqual(self.site.stop(), 0)
        # The log of the file that was replaced has not been mixed with the new one.
        self.assertEqual(self.path().read_bytes(), content)
        self.assertFalse(self.path("-wal").exists())
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))
        self.assertNotEqual(self.client.GetMap(map="site").map.incarnation, before)
        self.assertEqual(sites.labels(self.client), {})
        self.assertIn("map site", self.site.log())

    def test_c3_the_file_is_overwritten(self):
        content = self.backup().read_bytes()
        self.path().write_bytes(content + b"\0" * 4096)
        self.assert_closed("the file of the map was overwritten")
        self.assert_other_map_works()
        self.assertEqual(self.site.stop(), 0)
        self.assertEqual(self.path().read_bytes()[:len(content)], content)

    def test_c3_the_log_is_removed(self):
        acknowledged = sites.revision(self.client)
        self.path("-wal").unlink()
        self.assert_closed("the write-ahead log of the map was removed")
        self.assert_other_map_works()
        self.restart()
        self.assertEqual(sites.revision(self.client), acknowledged)

    def test_c5_a_file_that_was_away_for_a_moment_loses_nothing(self):
        before = self.client.GetMap(map="site").map
        away = self.folder / "away"
        self.path().rename(away)
        self.assert_closed("the file of the map was removed")
        away.rename(self.path())
        self.assertEqual(self.site.stop(), 0)
        self.assertEqual([p.name for p in self.data_dir.glob("site.gpkg*")], ["site.gpkg"])
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))
        after = self.client.GetMap(map="site").map
        self.assertEqual((after.incarnation, after.revision), (before.incarnation, before.revision))
        self.assertEqual(list(sites.labels(self.client).values()), ["chair 0"])

    def test_c3_watches_of_a_closed_map_end(self):
        watch = self.client.Watch(scope=rpc.scope("site"))
        next(watch)
        self.path().unlink()
        with self.assertRaises(grpc.RpcError):
            self.edit("site")
        with self.assertRaises(grpc.RpcError):
            for _ in watch:
                pass

    def test_c3_a_closed_map_can_be_deleted_and_made_anew(self):
        copy = self.backup()
        os.replace(copy, self.path())
        self.assert_closed("the file of the map was replaced")
        self.client.DeleteMap(map="site")
        sites.make(self.client)
        self.edit("site")
        self.restart()
        self.assertEqual(set(sites.labels(self.client).values()), {"chair 0"})


class DamagedLogs(SiteTest):

    def setUp(self):
        super().setUp()
        self.random = random.Random(SEED)

    def kill_after_edits(self):
        """Returns the acknowledged revision and the incarnation of a killed server's map."""
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            for i in range(EDITS):
                revision = client.ApplyEdits(map="site", edits=[chair(i)]).revision
            incarnation = client.GetMap(map="site").map.incarnation
        site.kill()
        return revision, incarnation

    def open_damaged(self, damage):
        """Opens a copy of the data folder after damage(path of the log). Returns the map, or None
        if it is refused, and the server's log."""
        data_dir = self.folder / "damaged"
        shutil.copytree(self.data_dir, data_dir)
        damage(data_dir / "site.gpkg-wal")
        site = self.server(data_dir=data_dir)
        with rpc.Client(site.address) as client:
            (entry,) = client.ListMaps().maps
            opened = None if entry.problem else client.GetMap(map="site").map
        self.assertEqual(site.stop(), 0)
        log = site.log()
        shutil.rmtree(data_dir)
        return opened, log

    def assert_never_silent(self, damages):
        acknowledged, incarnation = self.kill_after_edits()
        num_behind = 0
        for name, damage in damages:
            with self.subTest(seed=SEED, damage=name):
                opened, log = self.open_damaged(damage)
                if opened is None:
                    continue
                if opened.revision < acknowledged:
                    num_behind += 1
                    self.assertNotEqual(opened.incarnation, incarnation)
                    self.assertIn("acknowledged commits are missing", log)
                else:
                    self.assertEqual(opened.revision, acknowledged)
                    self.assertEqual(opened.incarnation, incarnation)
                    self.assertNotIn("acknowledged commits are missing", log)
        self.assertGreater(num_behind, 0)

    def test_c5_a_log_that_is_whole_loses_nothing(self):
        acknowledged, incarnation = self.kill_after_edits()
        opened, _ = self.open_damaged(lambda log: None)
        self.assertEqual((opened.revision, opened.incarnation), (acknowledged, incarnation))

    def test_c5_a_log_cut_anywhere_is_never_silent(self):
        def cut(part):
            return lambda log: os.truncate(log, int(log.stat().st_size * part))

        parts = [self.random.random() for _ in range(CUTS)]
        self.assert_never_silent([(part, cut(part)) for part in parts])

    def test_c5_a_bit_flipped_in_the_log_is_never_silent(self):
        def flip(part, bit):
            def damage(log):
                content = bytearray(log.read_bytes())
                content[int(len(content) * part)] ^= 1 << bit
                log.write_bytes(content)
            return damage

        places = [(self.random.random(), self.random.randrange(8)) for _ in range(CUTS)]
        self.assert_never_silent([(place, flip(*place)) for place in places])


if __name__ == "__main__":
    unittest.main()

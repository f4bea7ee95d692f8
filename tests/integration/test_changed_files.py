"""C3, C5: files that change under a running server, and write-ahead logs that are damaged after a
kill. No edit is acknowledged that the next start would not find, no acknowledged edit is missing
without a word, and every follower ends with the content of the server."""

import os
import pathlib
import random
import shutil
import tempfile
import unittest

import grpc
from hypermap.v1 import watch_service_pb2

import rpc
import sites
from processes import SEED, Server, SiteTest

EDITS = 20
# Number of places at which the log is cut, and of bits that are flipped in it. Each takes 0.2 s.
CUTS = int(os.environ.get("HYPERMAP_TEST_CUTS") or os.environ.get("HYPERMAP_TEST_ROUNDS") or 40)
EVERYWHERE = sites.square(-5000, -5000, 10000)

PUT, REMOVE, CELLS, DELETED = (watch_service_pb2.ChangeKind.Value(f"CHANGE_KIND_{kind}")
                               for kind in ("PUT", "REMOVE", "CELLS", "LAYER_DELETED"))


def chair(i):
    return sites.put(f"chair {i}", i, 0)


def cells_of(layer, runs):
    return {(layer, row, col): value for row, begin, end, value in runs
            for col in range(begin, end)}


def write_cells(content, cells):
    for key, value in cells.items():
        content.pop(key, None)
        if value is not None and value == value:
            content[key] = value


def query(client):
    """Returns the content of the map: its objects by (layer, id), and the values of its known cells
    by (layer, row, column)."""
    content = {}
    for answer in client.QueryArea(scope=rpc.scope("site"), area=EVERYWHERE):
        layer, runs = answer.part.layer, answer.part.cells
        content |= {(layer, o.id): o for o in answer.part.objects}
        write_cells(content, cells_of(
            layer, zip(runs.rows, runs.col_begins, runs.col_ends, runs.values)))
    return content


def labels_and_cells(content):
    """Returns content with the labels of its objects instead of the objects."""
    return {key: getattr(value, "label", value) for key, value in content.items()}


class Follower:
    """Keeps the content of the map by a stream of changes, which `call` (Watch or Replicate of a
    client) opens after a revision of an incarnation. Begins anew with a snapshot if the map is
    another incarnation."""

    def __init__(self, call, revision, incarnation, content):
        self._call = call
        self.revision, self.incarnation, self.content = revision, incarnation, dict(content)
        self._stream = call(scope={**rpc.scope("site"), "incarnation": str(incarnation)},
                            start_revision=revision)
        self._has_received = False

    def follow(self, until):
        """Applies changes up to the revision `until`, which must come."""
        try:
            self._receive(until)
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.ABORTED:
                raise
            self.content = {}
            self._stream = self._call(scope=rpc.scope("site"))
            self._receive(until)

    def close(self):
        self._stream.cancel()

    def _receive(self, until):
        while not self._has_received or self.revision != until:
            answer = next(self._stream)
            for message in answer.coalesced or [answer]:
                self._take(message)

    def _take(self, message):
        if message.reset:
            self.content = {}
        for change in message.changes:
            self._apply(change)
        if not message.more:
            self.revision, self.incarnation = message.revision, message.incarnation
            self._has_received = True

    def _apply(self, change):
        if change.kind == PUT:
            self.content[change.layer, change.object_id] = change.object
        elif change.kind == REMOVE:
            del self.content[change.layer, change.object_id]
        elif change.kind == CELLS:
            runs = change.cells
            write_cells(self.content, cells_of(
                change.layer, zip(runs.rows, runs.col_begins, runs.col_ends, runs.values)))
        elif change.kind == DELETED:
            self.content = {k: v for k, v in self.content.items() if k[0] != change.layer}


def follow_by_command(site, revision, incarnation, content, until):
    """Returns the labels and cells to which `hypermap watch`, a client in C++, leads from the
    content at a revision of an incarnation."""
    content = labels_and_cells(content)
    for line in site.json_lines("--retry", "30s", "watch", "site", "--from", revision,
                                "--incarnation", incarnation, "--or_snapshot", "--until", until):
        if line.get("reset"):
            content = {}
        elif line.get("op") == "put":
            content[line["layer"], line["id"]] = line["entity"]["label"]
        elif line.get("op") == "remove":
            del content[line["layer"], line["id"]]
        elif line.get("op") == "cells":
            write_cells(content, cells_of(line["layer"], line["runs"]))
    return content


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
        """Makes a map and kills its server. Keeps the acknowledged revision, the incarnation, and
        the content at each revision as a watch reported it."""
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            made = client.GetMap(map="site").map
            self.incarnation = made.incarnation
            self.contents = {revision: {} for revision in range(made.revision + 1)}
            follower = Follower(client.Watch, made.revision, made.incarnation, {})
            chairs = []
            for i in range(EDITS):
                edits = [chair(i), sites.write_cells([[i / EDITS, 1.0]], row=i // 2)]
                if i % 3 == 2:
                    edits += [{"delete_object": {"layer": "things", "id": chairs.pop(0)}},
                              sites.write_cells([["NaN"]], row=i // 2)]
                answer = client.ApplyEdits(map="site", edits=edits)
                chairs.append(answer.object_ids[0])
                self.acknowledged = answer.revision
                follower.follow(self.acknowledged)
                self.assertEqual(follower.content, query(client))
                self.contents[self.acknowledged] = dict(follower.content)
        site.kill()

    def check_refused(self, client):
        """Checks that a map that can't be opened gives no answers, but its reason."""
        for call in (lambda: client.GetMap(map="site"), lambda: query(client),
                     lambda: next(client.Watch(scope=rpc.scope("site"))),
                     lambda: client.ApplyEdits(map="site", edits=[chair(0)])):
            with self.assertRaises(grpc.RpcError) as refused:
                call()
            self.assertEqual(refused.exception.code(), grpc.StatusCode.DATA_LOSS)

    def check_history(self, opened, site, client):
        """Checks that the map is as it was at its revision, and that a loss is told."""
        self.assertEqual(query(client), self.contents[opened.revision])
        loss = "acknowledged commits are missing"
        if opened.revision == self.acknowledged:
            self.assertEqual(opened.incarnation, self.incarnation)
            self.assertNotIn(loss, site.log())
            return
        self.assertLess(opened.revision, self.acknowledged)
        self.assertNotEqual(opened.incarnation, self.incarnation)
        self.assertIn(loss, site.log())
        self.assertIn(f"where revision {self.acknowledged} was acknowledged", site.log())
        with self.assertRaises(grpc.RpcError) as refused:
            client.ListRevisions(map="site", incarnation=str(self.incarnation))
        self.assertEqual(refused.exception.code(), grpc.StatusCode.ABORTED)

    def check_followers(self, opened, site, client):
        """Checks that followers end with the content of the server: those that return at once, and
        those that return when other edits have the numbers of the lost revisions. Returns the last
        revision and its content."""
        def state_at(revision):
            return revision, self.incarnation, self.contents[revision]

        def assert_equal_to_server(follower):
            follower.follow(newest)
            self.assertEqual(follower.incarnation, opened.incarnation)
            self.assertEqual(follower.content, content)

        any_revision = self.random.randint(0, self.acknowledged)
        early = [Follower(client.Watch, *state_at(any_revision)),
                 Follower(client.Replicate, *state_at(self.acknowledged))]
        newest, content = opened.revision, self.contents[opened.revision]
        for follower in early:
            assert_equal_to_server(follower)
        newest = self.edit_beyond_acknowledged(client)
        content = query(client)
        late = [Follower(client.Watch, *state_at(self.acknowledged)),
                Follower(client.Replicate, *state_at(any_revision))]
        for follower in early + late:
            assert_equal_to_server(follower)
            follower.close()
        self.assertEqual(follow_by_command(site, *state_at(self.acknowledged), newest),
                         labels_and_cells(content))
        return newest, content

    def edit_beyond_acknowledged(self, client):
        """Makes edits until the map has a revision that it never had before. Returns it."""
        layer = {"name": "later", "kind": "LAYER_KIND_SEMANTIC"}
        revision = client.CreateLayer(map="site", layer=layer).revision
        while revision <= self.acknowledged:
            revision = client.ApplyEdits(
                map="site", edits=[sites.put(f"later {revision}", revision, 5, "later")]).revision
        return revision

    def check_damaged(self, damage):
        """Starts a server with a copy of the data folder after damage(path of the log). Returns the
        revision of the map, or None if it is refused."""
        with tempfile.TemporaryDirectory(dir=self.folder) as folder:
            data_dir = pathlib.Path(folder)
            shutil.copytree(self.data_dir, data_dir, dirs_exist_ok=True)
            damage(data_dir / "site.gpkg-wal")
            # Followers that have the newest revision already are told so after 0.1 s.
            with (Server(data_dir, "--watch_progress=100ms") as site,
                  rpc.Client(site.address) as client):
                (entry,) = client.ListMaps().maps
                if entry.problem:
                    self.check_refused(client)
                    return None
                opened = client.GetMap(map="site").map
                self.check_history(opened, site, client)
                newest, content = self.check_followers(opened, site, client)
                site.kill()
            # Edits that are acknowledged after the damage are kept as well.
            with Server(data_dir) as site, rpc.Client(site.address) as client:
                after = client.GetMap(map="site").map
                self.assertEqual((after.revision, after.incarnation), (newest, opened.incarnation))
                self.assertEqual(query(client), content)
            return opened.revision

    def assert_never_silent(self, damages):
        self.kill_after_edits()
        found = []
        for name, damage in damages:
            with self.subTest(seed=SEED, damage=name):
                found.append(self.check_damaged(damage))
        behind = [r for r in found if r is not None and r < self.acknowledged]
        print(f"seed {SEED}: of {len(found)} damaged logs, {found.count(self.acknowledged)} lost "
              f"nothing, {len(behind)} lost edits and told it, {found.count(None)} were refused; "
              f"{len(set(behind))} different revisions")
        self.assertGreater(len(behind), 0)

    def test_c5_a_log_that_is_whole_loses_nothing(self):
        self.kill_after_edits()
        self.assertEqual(self.check_damaged(lambda log: None), self.acknowledged)

    def test_c5_a_lost_log_of_a_damaged_file_is_not_taken_for_an_empty_map(self):
        def damage(log):
            log.unlink()
            file = log.with_name("site.gpkg")
            content = bytearray(file.read_bytes())
            content[4096:] = bytes(len(content) - 4096)
            file.write_bytes(content)

        self.kill_after_edits()
        self.assertIsNone(self.check_damaged(damage))

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

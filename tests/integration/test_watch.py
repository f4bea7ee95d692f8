"""Tests of `hypermap watch`, and of queries of past revisions with the command."""

import json
import os
import selectors
import subprocess
import time
import unittest

import rpc
import sites
from processes import BIN, DEADLINE_S, SiteTest


class Watch:
    """A process `hypermap watch`. The end of the `with` block kills it."""

    def __init__(self, server, *arguments):
        self._process = subprocess.Popen(
            [BIN / "hypermap", "--server", server.address, "--json", "watch",
             *map(str, arguments)],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self._bytes = b""

    def line(self):
        """Waits for the next line and returns its JSON document."""
        deadline = time.monotonic() + DEADLINE_S
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while b"\n" not in self._bytes:
                if not selector.select(deadline - time.monotonic()):
                    raise AssertionError(f"the watch printed no further line in {DEADLINE_S} s")
                piece = os.read(self._process.stdout.fileno(), 65536)
                if not piece:
                    raise AssertionError(f"the watch ended: {self._process.stderr.read()}")
                self._bytes += piece
        line, self._bytes = self._bytes.split(b"\n", 1)
        return json.loads(line)

    def change(self):
        """Waits for the next line with a change and returns its JSON document."""
        while "op" not in (line := self.line()):
            pass
        return line

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.communicate()


class WatchAndPastRevisions(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server("--watch_progress=100ms")
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)

    def put(self, label, x, y, **members):
        answer = self.client.ApplyEdits(map="site", edits=[sites.put(label, x, y, **members)])
        return int(answer.object_ids[0]), int(answer.revision)

    def move(self, object_id, label, x, y):
        return int(self.client.ApplyEdits(
            map="site", edits=[sites.put(label, x, y, id=object_id)]).revision)

    def watch(self, *arguments):
        return self.enterContext(Watch(self.site, "site", *arguments))

    def test_a_watch_starts_with_a_snapshot_and_then_reports_each_change(self):
        cup, before = self.put("cup", 1, 1)
        watch = self.watch("--layer", "things")
        line = watch.change()
        self.assertEqual((line["op"], line["id"], line["snapshot"]), ("put", cup, True))
        self.assertEqual(watch.line(), {"revision": before})
        chair, revision = self.put("chair", 3, 3)
        line = watch.change()
        self.assertEqual((line["revision"], line["layer"], line["op"], line["entity"]["id"]),
                         (revision, "things", "put", chair))
        self.assertEqual(line["version"], revision)
        self.client.ApplyEdits(map="site",
                               edits=[{"delete_object": {"layer": "things", "id": cup}}])
        line = watch.change()
        self.assertEqual((line["revision"], line["op"], line["id"]), (revision + 1, "remove", cup))

    def read(self, start, until, **members):
        """Returns the messages of the rpc Watch from `start` up to a revision."""
        messages = []
        call = self.client.Watch(scope=rpc.scope("site"), start_revision=start, **members)
        for message in call:
            messages.append(message)
            if (message.coalesced or [message])[-1].revision >= until:
                call.cancel()
                return messages
        raise AssertionError("the watch ended")

    def test_coalesced_messages_have_the_same_content(self):
        start = sites.revision(self.client)
        for x in range(150):
            last = self.put("cup" if x % 3 else "chair", x % 40, 1)[1]
        for members in ({}, {"classes": ["chair"]}):
            alone = self.read(start, last, **members)
            together = self.read(start, last, coalesce=True, **members)
            self.assertFalse(any(message.coalesced for message in alone))
            self.assertTrue(any(len(message.coalesced) > 1 for message in together))
            self.assertLess(len(together), len(alone))
            unpacked = [one for message in together for one in message.coalesced or [message]]
            self.assertEqual([message for message in unpacked if message.changes],
                             [message for message in alone if message.changes])

    def test_objects_enter_and_leave_the_area(self):
        cup, _ = self.put("cup", 20, 20)
        watch = self.watch("--layer", "things", "--area", "0,0", "10,0", "10,10", "0,10")
        self.assertEqual(list(watch.line()), ["revision"])
        for x, op in ((5, "enter"), (6, "put"), (20, "leave")):
            revision = self.move(cup, "cup", x, 5)
            line = watch.change()
            self.assertEqual((line["revision"], line["op"], line["id"]), (revision, op, cup))

    def test_classes_are_filtered(self):
        watch = self.watch("--class", "chair", "--layer", "things")
        self.assertEqual(list(watch.line()), ["revision"])
        self.put("cup", 1, 1)
        chair, _ = self.put("chair", 3, 3)
        self.assertEqual(watch.change()["id"], chair)

    def test_cells_are_reported_with_their_values(self):
        self.client.ApplyEdits(map="site", edits=[sites.write_cells([[0.25, 0.25]], row=2, col=2)])
        watch = self.watch("--layer", "grid", "--from", sites.revision(self.client))
        self.client.ApplyEdits(map="site", edits=[sites.write_cells([[0.25, 0.5]], row=2, col=2)])
        line = watch.change()
        self.assertEqual((line["op"], line["runs"]), ("cells", [[2, 3, 4, 0.5]]))

    def test_a_watch_ends_at_the_given_revision_and_can_resume_there(self):
        start = sites.revision(self.client)
        revisions = [self.put("cup", x, 1)[1] for x in range(4)]
        lines = self.site.json_lines("watch", "site", "--from", start, "--until", revisions[1])
        self.assertEqual([line["revision"] for line in lines if "op" in line], revisions[:2])
        lines = self.site.json_lines("watch", "site", "--from", revisions[1], "--count", 2)
        self.assertEqual([line["revision"] for line in lines if "op" in line], revisions[2:])

    def test_every_query_can_read_a_past_revision(self):
        cup, before = self.put("cup", 1, 1)
        when = self.site.json("log", "site", "--limit", 1)["revisions"][0]["time"]
        after = self.move(cup, "cup", 30, 30)
        area = ("query", "area", "site", "0,0", "10,0", "10,10", "0,10", "--layer", "things")

        def found(*at):
            lines = self.site.json_lines(*area, *at)
            return [line["entity"]["id"] for line in lines if "entity" in line], lines[-1]

        self.assertEqual(found("--at", before), ([cup], {"revision": before}))
        self.assertEqual(found("--at", when), ([cup], {"revision": before}))
        self.assertEqual(found("--at", after), ([], {"revision": after}))
        self.assertEqual(found("--min_revision", after), ([], {"revision": after}))
        for question in (("point", "site", 1.5, 1.5), ("nearest", "site", 1, 1, "--value", "cup"),
                         ("value", "site", "cup")):
            self.assertEqual(self.site.json_lines("query", *question, "--at", before)[-1]["revision"],
                             before)
        self.assert_fails(self.site.cli("query", "point", "site", 1, 1, "--at", after + 5),
                          "OUT_OF_RANGE", str(after))

    def test_the_difference_of_two_revisions(self):
        cup, before = self.put("cup", 1, 1)
        self.move(cup, "cup", 5, 5)
        chair, _ = self.put("chair", 3, 3)
        after = self.move(cup, "mug", 6, 6)
        lines = self.site.json_lines("changes", "site", "--from", before, "--to", after)
        self.assertEqual(lines[-1], {"from_revision": before, "revision": after})
        changes = {line["id"]: line for line in lines[:-1]}
        self.assertEqual(set(changes), {cup, chair})
        self.assertEqual((changes[cup]["before"]["label"], changes[cup]["entity"]["label"]),
                         ("cup", "mug"))
        self.assertNotIn("before", changes[chair])

    def test_the_log_lists_the_newest_revisions_first(self):
        self.put("cup", 1, 1)
        newest = self.put("cup", 2, 2)[1]
        log = self.site.json("log", "site", "--limit", 2)
        self.assertEqual((log["newest_revision"], [r["revision"] for r in log["revisions"]]),
                         (newest, [newest, newest - 1]))
        self.assertEqual([r["changes"] for r in log["revisions"]], [1, 1])

    def test_an_edit_can_be_conditional_and_have_a_time_to_live(self):
        cup, version = self.put("cup", 1, 1)
        path = self.folder / "edit.geojson"
        ring = [[1, 1], [2, 1], [2, 2], [1, 2], [1, 1]]
        path.write_text(json.dumps({"type": "Feature", "id": cup, "properties": {"label": "mug"},
                                    "geometry": {"type": "Polygon", "coordinates": [ring]}}))
        edit = ("edit", "site", path, "--layer", "things")
        self.assert_fails(self.site.cli(*edit, "--if_version", version + 1), "ABORTED", str(cup))
        watch = self.watch("--layer", "things", "--from", version)
        put = self.site.json(*edit, "--if_version", version, "--ttl", "300ms")
        line = watch.change()
        self.assertEqual((line["op"], line["revision"]), ("put", put["revision"]))
        self.assertIn("expires_at", line["entity"])
        line = watch.change()
        self.assertEqual((line["op"], line["id"]), ("remove", cup))


if __name__ == "__main__":
    unittest.main()

"""Acknowledged edits are on disk: the server is killed repeatedly while several clients write."""

import itertools
import os
import threading
import unittest

import grpc

import rpc
import sites
from processes import SiteTest

ROUNDS = int(os.environ.get("HYPERMAP_TEST_ROUNDS", "6"))
WRITERS = 4
# The server is killed when all writers together have this many acknowledged edits.
EDITS_BEFORE_KILL = 60


class Writer(threading.Thread):
    """Puts objects one after another, and records which of them were acknowledged."""

    def __init__(self, address, number, count_down):
        super().__init__()
        self._address, self._number, self._count_down = address, number, count_down
        self.acknowledged = {}  # label -> (revision, object id)
        self.lost = None        # the label of the edit that the kill interrupted
        self.unexpected = None

    def run(self):
        with rpc.Client(self._address) as client:
            for i in itertools.count():
                label = f"writer {self._number} edit {i}"
                try:
                    answer = client.ApplyEdits(map="site", request_id=label, edits=[
                        sites.put(label, i % 50, i // 50),
                        sites.write_cells([[i % 100 / 100]], row=self._number, col=i)])
                except grpc.RpcError as error:
                    self.lost = label
                    if error.code() not in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.UNKNOWN,
                                            grpc.StatusCode.CANCELLED):
                        self.unexpected = error
                    return
                self.acknowledged[label] = (answer.revision, answer.object_ids[0])
                self._count_down.release()


class Durability(SiteTest):

    def kill_under_load(self, site, round_number):
        """Kills the server while several writers send edits. Returns the writers."""
        count_down = threading.Semaphore(0)
        writers = [Writer(site.address, round_number * WRITERS + w, count_down)
                   for w in range(WRITERS)]
        for writer in writers:
            writer.start()
        for _ in range(EDITS_BEFORE_KILL):
            self.assertTrue(count_down.acquire(timeout=120), "no progress")
        site.kill()
        for writer in writers:
            writer.join()
            self.assertIsNone(writer.unexpected)
        return writers

    def test_acknowledged_edits_survive_a_kill(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
        acknowledged, uncertain = {}, set()
        for round_number in range(ROUNDS):
            for writer in self.kill_under_load(site, round_number):
                acknowledged |= writer.acknowledged
                uncertain.add(writer.lost)
            site = self.server()
            with rpc.Client(site.address) as client:
                found = sites.labels(client)
                for label, (_, object_id) in acknowledged.items():
                    self.assertEqual(found.get(object_id), label)
                self.assertLessEqual(set(found.values()) - set(acknowledged), uncertain)
                self.assertEqual(len(found), len(set(found.values())), "an edit was applied twice")
                self.check_receipts(client, acknowledged)
                self.assertGreaterEqual(sites.revision(client),
                                        max(r for r, _ in acknowledged.values()))
        revisions = [r for r, _ in acknowledged.values()]
        self.assertEqual(len(revisions), len(set(revisions)), "two edits have the same revision")

    def check_receipts(self, client, acknowledged):
        """Sends some acknowledged edits again. They get the same answers and change nothing."""
        before = sites.revision(client)
        for label in list(acknowledged)[-5:]:
            answer = client.ApplyEdits(map="site", request_id=label, edits=[
                sites.put(label, 0, 0), sites.write_cells([[0.5]])])
            self.assertEqual((answer.revision, answer.object_ids[0]), acknowledged[label])
        self.assertEqual(sites.revision(client), before)

    def test_an_interrupted_batch_is_applied_completely_or_not_at_all(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
        for round_number in range(ROUNDS):
            self.kill_under_load(site, round_number)
            site = self.server()
            with rpc.Client(site.address) as client:
                objects = len(sites.labels(client))
                cells = sum(end - begin for answer in client.QueryArea(
                    scope=rpc.scope("site", "grid"), area=sites.square(-5000, -5000, 10000))
                    for begin, end, value in zip(answer.part.cells.col_begins,
                                                 answer.part.cells.col_ends,
                                                 answer.part.cells.values) if value == value)
                self.assertEqual(objects, cells)

    def test_a_request_sent_again_after_a_restart_gets_the_same_answer(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            first = client.ApplyEdits(map="site", request_id="a", edits=[sites.put("cup", 1, 1)])
            again = client.ApplyEdits(map="site", request_id="a", edits=[sites.put("cup", 1, 1)])
            self.assertEqual(first, again)
        self.assertEqual(site.stop(), 0)
        with rpc.Client(self.server().address) as client:
            again = client.ApplyEdits(map="site", request_id="a", edits=[sites.put("cup", 1, 1)])
            self.assertEqual(first, again)
            self.assertEqual(sites.labels(client), {first.object_ids[0]: "cup"})

    def test_a_map_that_one_batch_creates_has_one_revision_and_survives_a_kill(self):
        site = self.server()
        place = {"parent_frame_id": "map", "child_frame_id": "dock",
                 "parent_from_child": {"x": 10, "y": 0, "yaw": 0}}
        lanes = {"name": "lanes", "kind": "LAYER_KIND_SEMANTIC", "frame_id": "dock",
                 "shape_kinds": ["SHAPE_KIND_LINE_STRING"]}
        floor = {"name": "floor", "kind": "LAYER_KIND_OCCUPANCY",
                 "grid": {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": 0.5}}
        lane = {"line_string": rpc.columns([(0, 0), (5, 0)])}
        with rpc.Client(site.address) as client:
            client.CreateMap(map="site")
            before = sites.revision(client)
            answer = client.ApplyEdits(map="site", edits=[
                {"set_transform": {"transform": place}},
                {"create_layer": {"layer": lanes}}, {"create_layer": {"layer": floor}},
                {"create_layer": {"layer": {"name": "draft", "kind": "LAYER_KIND_SEMANTIC"}}},
                sites.put_shape(lane, "lane", "lanes"),
                sites.write_cells([[0.25]], layer="floor"),
                {"delete_layer": {"layer": "draft"}}])
            self.assertEqual(answer.revision, before + 1)
        site.kill()
        with rpc.Client(self.server().address) as client:
            self.assertEqual(sites.revision(client), before + 1)
            layers = {layer.name: layer for layer in client.ListLayers(map="site").layers}
            self.assertEqual(set(layers), {"lanes", "floor"})
            self.assertTrue(layers["lanes"].properties.has_shapes)
            self.assertTrue(layers["floor"].properties.has_cells)
            # This point is (2, 0) in the frame dock.
            answer = client.QueryPoint(scope=rpc.scope("site", "lanes"), point=rpc.point(12, 0))
            self.assertEqual([o.label for o in answer.layers[0].objects], ["lane"])
            answer = client.QueryPoint(scope=rpc.scope("site", "floor"), point=rpc.point(0.1, 0.1))
            self.assertEqual(answer.layers[0].value, 0.25)

    def test_an_imported_map_survives_a_kill_right_after_the_answer(self):
        site = self.server()
        (self.folder / "desk.geojson").write_text(
            '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": '
            '{"label": "desk"}, "geometry": {"type": "Polygon", "coordinates": '
            '[[[0, 0], [1, 0], [1, 1], [0, 0]]]}}]}')
        site.json("import", self.folder / "desk.geojson", "--map", "site", "--layer", "things")
        site.kill()
        with rpc.Client(self.server().address) as client:
            self.assertEqual(list(sites.labels(client).values()), ["desk"])


if __name__ == "__main__":
    unittest.main()

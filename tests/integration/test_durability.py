"""Acknowledged edits are on disk: the server is killed repeatedly while several clients write."""

import base64
import itertools
import json
import os
import random
import tempfile
import threading
import unittest

import grpc

import rpc
import sites
from processes import SEED, SiteTest

ROUNDS = int(os.environ.get("HYPERMAP_TEST_ROUNDS", "6"))
WRITERS = 4
# The server is killed when all writers together have this many acknowledged edits.
EDITS_BEFORE_KILL = 60
IMPORTS_TO_KILL = 10
IMPORTED_SQUARES = 4000
# About the time that an import takes.
IMPORT_S = 0.3


def edits_of(number, i):
    """Returns the edits of a writer's request: an object and a cell of its own."""
    return [sites.put(f"writer {number} edit {i}", i % 50, i // 50),
            sites.write_cells([[i % 100 / 100]], row=number, col=i)]


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
                    answer = client.ApplyEdits(map="site", request_id=label,
                                               edits=edits_of(self._number, i))
                except grpc.RpcError as error:
                    self.lost = label
                    if error.code() not in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.UNKNOWN,
                                            grpc.StatusCode.CANCELLED):
                        self.unexpected = error
                    return
                self.acknowledged[label] = (answer.revision, answer.object_ids[0])
                self._count_down.release()


def geojson_of_squares(count):
    """Returns a GeoJSON file of labelled unit squares."""
    def square(i):
        x, y = 2 * (i % 100), 2 * (i // 100)
        ring = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]]
        return {"type": "Feature", "properties": {"label": f"square {i}"},
                "geometry": {"type": "Polygon", "coordinates": [ring]}}

    return json.dumps({"type": "FeatureCollection",
                       "features": [square(i) for i in range(count)]}).encode()


def import_file(client, file):
    """Imports a GeoJSON file as the map "site", which is created if there is none."""
    header = {"map": "site", "format": "FILE_FORMAT_GEOJSON", "layer": "things",
              "create_map": True, "request_id": "import"}
    return client.ImportMap([{"header": header}, {"chunk": {
        "file_name": "site.geojson", "data": base64.b64encode(file).decode()}}])


def import_until_killed(address, file):
    with rpc.Client(address) as client:
        try:
            import_file(client, file)
        except grpc.RpcError:
            pass


class Durability(SiteTest):

    def setUp(self):
        super().setUp()
        self.random = random.Random(SEED)

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
            _, number, _, i = label.split()
            answer = client.ApplyEdits(map="site", request_id=label,
                                       edits=edits_of(int(number), int(i)))
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

    def test_c6_another_request_with_a_used_id_is_refused(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", request_id="a", edits=[sites.put("cup", 1, 1)])
        self.assertEqual(site.stop(), 0)
        with rpc.Client(self.server().address) as client:
            before = sites.revision(client)
            layer = {"name": "more", "kind": "LAYER_KIND_SEMANTIC"}
            for method, fields in ((client.ApplyEdits, {"edits": [sites.put("cup", 2, 1)]}),
                                   (client.CreateLayer, {"layer": layer})):
                with self.assertRaises(grpc.RpcError) as caught:
                    method(map="site", request_id="a", **fields)
                self.assertEqual(caught.exception.code(), grpc.StatusCode.INVALID_ARGUMENT)
                self.assertIn(f'request_id "a" was used for another request, which made revision '
                              f'{before}', caught.exception.details())
            self.assertEqual(sites.revision(client), before)
            client.ApplyEdits(map="site", request_id="a", edits=[sites.put("cup", 1, 1)])
            self.assertEqual(sites.revision(client), before)

    def test_c6_a_deletion_sent_again_does_not_claim_that_the_new_map_is_gone(self):
        with rpc.Client(self.server().address) as client:
            client.CreateMap(map="site")
            client.DeleteMap(map="site", request_id="d")
            client.DeleteMap(map="site", request_id="d")
            client.CreateMap(map="site")
            with self.assertRaises(grpc.RpcError) as caught:
                client.DeleteMap(map="site", request_id="d")
            self.assertEqual(caught.exception.code(), grpc.StatusCode.FAILED_PRECONDITION)
            self.assertIn("not deleted", caught.exception.details())
            client.GetMap(map="site")

    def test_c7_an_import_that_is_killed_leaves_the_whole_map_or_none(self):
        file = geojson_of_squares(IMPORTED_SQUARES)
        outcomes = []
        for _ in range(IMPORTS_TO_KILL):
            data_dir = self.enterContext(tempfile.TemporaryDirectory(dir=self.folder))
            site = self.server(data_dir=data_dir)
            importer = threading.Thread(target=import_until_killed, args=(site.address, file))
            importer.start()
            # The moment is random, and may be before or after the import.
            importer.join(self.random.uniform(0, IMPORT_S))
            site.kill()
            importer.join()
            site = self.server(data_dir=data_dir)
            with rpc.Client(site.address) as client:
                maps = {entry.name: entry for entry in client.ListMaps().maps}
                if "site" in maps:
                    self.assertEqual(maps["site"].problem, "")
                    self.assertEqual(maps["site"].revision, 1)
                    self.assertEqual(len(sites.labels(client)), IMPORTED_SQUARES)
                outcomes.append("site" in maps)
                import_file(client, file)
                self.assertEqual(len(sites.labels(client)), IMPORTED_SQUARES)
            site.kill()
        print(f"seed {SEED}: {sum(outcomes)} of {len(outcomes)} killed imports had made the map")

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

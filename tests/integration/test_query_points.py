"""The answers of QueryPoints must equal those of QueryPoint for each point."""

import itertools
import json
import math
import random
import struct
import subprocess
import threading
import unittest

import grpc

import rpc
import sites
from processes import BIN, DEADLINE_S, QUESTIONS, SEED, SiteTest, real_maps

LABELS = ("cup", "chair", "dining table")


def float32(x):
    return struct.unpack("f", struct.pack("f", x))[0]


def content_of_point(answer):
    """Converts a QueryPointResponse to {layer: (status, value, [(id, label, existence)])}."""
    return {layer.layer: (layer.status, layer.value if layer.HasField("value") else None,
                          [(o.id, o.label, float32(o.existence)) for o in layer.objects])
            for layer in answer.layers}


class Stream:
    """A stream of QueryPoints that sends one batch at a time, without the client library."""

    def __init__(self, client, **opening):
        self._opening, self._batches = opening, []
        self._more, self._done = threading.Condition(), False
        self._labels = []
        self.answers = client.QueryPoints(self._requests())

    def _requests(self):
        yield {"opening": self._opening}
        for i in itertools.count():
            with self._more:
                self._more.wait_for(lambda: i < len(self._batches) or self._done)
                if i == len(self._batches):
                    return
                batch = self._batches[i]
            yield {"xs": [x for x, _ in batch], "ys": [y for _, y in batch]}

    def ask(self, points):
        """Sends a batch of points and returns (revision, content of each point)."""
        with self._more:
            self._batches.append(points)
            self._more.notify()
        answer = next(self.answers)
        self._labels += answer.new_labels
        return answer.revision, [self._content(answer, i) for i in range(len(points))]

    def _content(self, answer, point):
        return {layer.layer: self._layer_content(layer, point) for layer in answer.layers}

    def _layer_content(self, layer, point):
        objects = [(layer.object_ids[j], self._labels[layer.labels[j]], layer.existences[j])
                   for j, of in enumerate(layer.points) if of == point]
        if not layer.statuses:
            return layer.status, None, objects
        value = layer.values[point]
        return layer.statuses[point], None if math.isnan(value) else value, objects

    def close(self):
        with self._more:
            self._done = True
            self._more.notify()

    def end(self):
        self.close()
        return list(self.answers)


class QueryPoints(SiteTest):

    def setUp(self):
        super().setUp()
        self.random = random.Random(SEED)
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))

    def make_site(self):
        """Creates the map of sites.make with random objects and cells, and a second frame."""
        sites.make(self.client)
        self.client.SetTransform(map="site", transform={
            "parent_frame_id": "map", "child_frame_id": "dock",
            "parent_from_child": {"x": 3, "y": -1, "yaw": 0.75}})
        place = lambda: self.random.uniform(-10, 9)
        self.client.ApplyEdits(map="site", edits=[
            sites.put(self.random.choice(LABELS), place(), place(),
                      existence=self.random.uniform(0.1, 1)) for _ in range(200)])
        self.client.ApplyEdits(map="site", edits=[
            sites.put_shape({"line_string": rpc.columns([(place(), place()) for _ in range(3)])},
                            "lane") for _ in range(30)])
        self.client.ApplyEdits(map="site", edits=[
            sites.put_shape({"point": rpc.point(place(), place())}, "dock") for _ in range(30)])
        values = [[self.random.choice([0, 0.25, 0.5, 1, "NaN"]) for _ in range(20)]
                  for _ in range(20)]
        self.client.ApplyEdits(map="site", edits=[sites.write_cells(values, row=-10, col=-10)])

    def compare(self, points, **question):
        """Compares both rpcs. `question` has the fields that both requests have, such as scope."""
        stream = Stream(self.client, **question)
        for i in range(0, len(points), 64):
            batch = points[i:i + 64]
            revision, contents = stream.ask(batch)
            for (x, y), content in zip(batch, contents):
                answer = self.client.QueryPoint(point=rpc.point(x, y), **question)
                self.assertEqual(content, content_of_point(answer), (x, y, question))
                self.assertEqual(revision, answer.revision)
        self.assertEqual(stream.end(), [])

    def points_within(self, reach, count=QUESTIONS):
        return [(self.random.uniform(-reach, reach), self.random.uniform(-reach, reach))
                for _ in range(count)]

    def test_answers_are_those_of_query_point(self):
        self.make_site()
        for scope in (rpc.scope("site"), rpc.scope("site", "things"),
                      rpc.scope("site", "grid", "adrift"), rpc.scope("site", frame_id="dock"),
                      rpc.scope("site", frame_id="raft")):
            self.compare(self.points_within(12), scope=scope)

    def test_answers_with_a_tolerance_are_those_of_query_point(self):
        self.make_site()
        for tolerance in (0.01, 0.5, 3.0):
            self.compare(self.points_within(12, QUESTIONS // 2), scope=rpc.scope("site"),
                         tolerance_m=tolerance)

    def test_answers_about_past_revisions_are_those_of_query_point(self):
        self.make_site()
        revision = sites.revision(self.client)
        self.client.ApplyEdits(map="site", edits=[sites.put("cup", 0, 0) for _ in range(10)])
        for at in (revision - 1, revision):
            self.compare(self.points_within(12, QUESTIONS // 4), scope=rpc.scope("site"),
                         as_of=rpc.at(at))

    def test_answers_about_the_recorded_maps_are_those_of_query_point(self):
        if not real_maps():
            self.skipTest("the recorded maps are missing")
        for name, path in real_maps().items():
            self.site.json("import", path, "--map", name)
            self.compare(self.points_within(8), scope=rpc.scope(name))

    def test_the_command_prints_the_answers_of_query_point(self):
        self.make_site()
        points = self.points_within(12, 50)
        result = subprocess.run(
            [BIN / "hypermap", "--server", self.site.address, "--json", "query", "points", "site",
             "--stdin"],
            input="".join(f"{x!r} {y!r}\n" for x, y in points), capture_output=True, text=True,
            timeout=DEADLINE_S, check=True)
        *lines, end = [json.loads(line) for line in result.stdout.splitlines()]
        self.assertEqual(end, {"revision": sites.revision(self.client)})
        self.assertEqual(len(lines), len(points))
        for (x, y), line in zip(points, lines):
            self.assertEqual(line["point"], [x, y])
            expected = self.site.json("query", "point", "site", repr(x), repr(y))
            for got, wanted in zip(line["layers"], expected["layers"], strict=True):
                entities = [{"id": e["id"], "label": e["label"]} for e in wanted["entities"]]
                for entity in got["entities"]:
                    entity.pop("existence")
                self.assertEqual(got, {"layer": wanted["layer"], "status": wanted["status"],
                                       "value": wanted["value"], "entities": entities})

    def test_errors_name_what_is_wrong(self):
        sites.make(self.client)
        point, opening = {"xs": [1], "ys": [2]}, {"scope": rpc.scope("site")}
        for requests, code, word in (
                ([], grpc.StatusCode.INVALID_ARGUMENT, "opened"),
                ([point], grpc.StatusCode.INVALID_ARGUMENT, "opening"),
                ([{"opening": {"scope": rpc.scope("attic")}}], grpc.StatusCode.NOT_FOUND, "attic"),
                ([{"opening": opening | {"tolerance_m": -1}}],
                 grpc.StatusCode.INVALID_ARGUMENT, "tolerance_m"),
                ([{"opening": opening, "xs": [1, 2], "ys": [1]}],
                 grpc.StatusCode.INVALID_ARGUMENT, "ys"),
                ([{"opening": opening, "xs": ["NaN"], "ys": [1]}],
                 grpc.StatusCode.INVALID_ARGUMENT, "xs[0]"),
                ([{"opening": opening, "xs": [1] * 65537, "ys": [1] * 65537}],
                 grpc.StatusCode.RESOURCE_EXHAUSTED, "--max_points")):
            with self.assertRaises(grpc.RpcError) as raised:
                list(self.client.QueryPoints(iter(requests)))
            self.assertEqual(raised.exception.code(), code, word)
            self.assertIn(word, raised.exception.details())

    def test_a_server_that_stops_ends_open_streams(self):
        sites.make(self.client)
        stream = Stream(self.client, scope=rpc.scope("site"))
        stream.ask([(1, 2)])
        self.assertEqual(self.site.stop(), 0)
        with self.assertRaises(grpc.RpcError) as raised:
            next(stream.answers)
        self.assertEqual(raised.exception.code(), grpc.StatusCode.UNAVAILABLE)
        stream.close()


if __name__ == "__main__":
    unittest.main()

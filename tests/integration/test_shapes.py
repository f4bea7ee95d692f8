"""Polygons, line strings and points on one layer: import, all kinds of queries, watches, export.

The answers are compared with those of Shapely for the same objects.
"""

import dataclasses
import json
import math
import random
import re
import subprocess
import threading
import unittest

import grpc
import shapely.affinity
import shapely.geometry
import shapely.geometry.polygon
import shapely.wkt
from hypermap.v1 import watch_service_pb2

import rpc
import sites
from processes import DEADLINE_S, QUESTIONS, SEED, SiteTest, needs_files

LABELS = ("lane", "wall", "dock", "room")
REACH_M = 10.0
# Shapely's distances and the server's may differ in their last digits.
EXACT_M = 1e-9
PUT, REMOVE, ENTER, LEAVE = (
    watch_service_pb2.ChangeKind.Value(f"CHANGE_KIND_{kind}")
    for kind in ("PUT", "REMOVE", "ENTER", "LEAVE"))


@dataclasses.dataclass
class Thing:
    label: str
    geometry: object  # a Shapely geometry

    def feature(self, **members):
        return {"type": "Feature", "properties": {"label": self.label},
                "geometry": coordinates(self.geometry), **members}


def coordinates(geometry):
    """Converts a Shapely geometry to GeoJSON, with lists instead of tuples."""
    return json.loads(json.dumps(shapely.geometry.mapping(geometry)))


class Draw:
    """Draws random shapes and places. Half of all vertices lie on a lattice, so that some shapes
    touch, share vertices or have vertices on each other's edges."""

    def __init__(self, seed):
        self.random = random.Random(seed)

    def place(self, near=(0, 0), reach=REACH_M):
        x, y = (c + self.random.uniform(-reach, reach) for c in near)
        return (round(2 * x) / 2, round(2 * y) / 2) if self.random.random() < 0.5 else (x, y)

    def polygon(self):
        """Draws a valid polygon of 0.5 to 5 m, a quarter of them with a hole. The outer ring is
        counter-clockwise, as in answers of the server."""
        while True:
            centre, size = self.place(), self.random.uniform(0.5, 5)
            n = self.random.randint(3, 8)
            ring = [self.place((centre[0] + size * math.cos(2 * math.pi * i / n),
                                centre[1] + size * math.sin(2 * math.pi * i / n)), size / 4)
                    for i in range(n)]
            outer = shapely.geometry.Polygon(ring)
            if len(set(ring)) < n or not outer.is_valid or outer.area < 0.05:
                continue
            if self.random.random() < 0.25:
                hole = shapely.affinity.scale(outer, 0.4, 0.4, origin=outer.representative_point())
                if outer.contains(hole) and outer.exterior.distance(hole) > 0:
                    outer = shapely.geometry.Polygon(outer.exterior, [hole.exterior])
            return shapely.geometry.polygon.orient(outer)

    def line(self):
        """Draws a line string of 2 to 6 vertices, which may cross itself or be closed."""
        while True:
            start = self.place()
            vertices = [start] + [self.place(start, 4) for _ in range(self.random.randint(1, 5))]
            if all(a != b for a, b in zip(vertices, vertices[1:])):
                return shapely.geometry.LineString(vertices)

    def geometry(self):
        kind = self.random.choice((self.polygon, self.line,
                                   lambda: shapely.geometry.Point(self.place())))
        return kind()

    def thing(self):
        return Thing(self.random.choice(LABELS), self.geometry())

    def vertex(self, things):
        """Draws a vertex of one of the things."""
        geometry = self.random.choice(list(things.values())).geometry
        ring = geometry.exterior if geometry.geom_type == "Polygon" else geometry
        return self.random.choice(list(ring.coords))

    def question(self, things):
        """Draws a place for a query: a vertex of a thing, a point of the lattice or any point."""
        return self.vertex(things) if self.random.random() < 0.4 else self.place()


def covering(things, p):
    return {i for i, thing in things.items() if thing.geometry.covers(p)}


def intersecting(things, area, label=None):
    return {i for i, thing in things.items()
            if label in (None, thing.label) and (area is None or thing.geometry.intersects(area))}


class ShapesTest(SiteTest):
    """A test case with a server, a map `site` and random things on the layer `things`."""

    def setUp(self):
        super().setUp()
        self.draw = Draw(SEED)
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))
        self.site.json("map", "create", "site")
        self.scope = rpc.scope("site", "things")
        self.with_content = 0

    def edit(self, features, *flags, layer="things"):
        """Runs `hypermap edit` with the features, and returns what it prints."""
        path = self.folder / "edit.geojson"
        path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
        return self.site.json("edit", "site", path, "--layer", layer, *flags)

    def add_things(self, count=150):
        """Adds random things with `hypermap edit`. Returns {id: thing}."""
        things = [self.draw.thing() for _ in range(count)]
        self.edit([thing.feature() for thing in things])
        # Ids are assigned in the order of the file.
        return dict(zip(sorted(sites.labels(self.client)), things, strict=True))

    def change_things(self, things):
        """Replaces, deletes and adds things with `hypermap edit`. Returns all things afterwards."""
        after, features = dict(things), []
        for i in self.draw.random.sample(sorted(things), len(things) // 3):
            if self.draw.random.random() < 0.3:
                del after[i]
                features.append({"type": "Feature", "id": i, "properties": {}, "geometry": None})
            else:
                after[i] = self.draw.thing()
                features.append(after[i].feature(id=i))
        new = [self.draw.thing() for _ in range(10)]
        known = set(things)
        self.edit(features + [thing.feature() for thing in new])
        ids = sorted(set(sites.labels(self.client)) - known)
        return after | dict(zip(ids, new, strict=True))

    def compare(self, got, expected, *asked):
        self.with_content += bool(expected)
        self.assertEqual(got, expected, (f"HYPERMAP_TEST_SEED={SEED}", *asked))

    # Each of these makes `count` queries and compares the answers with Shapely's.

    def check_points(self, things, count, as_of, tolerance=0.0):
        """Queries places with QueryPoints, and the first 20 also with QueryPoint."""
        places = []
        while len(places) < count:
            p = shapely.geometry.Point(self.draw.question(things))
            distances = [thing.geometry.distance(p) for thing in things.values()]
            if not tolerance or all(abs(d - tolerance) > EXACT_M for d in distances):
                places.append(p)
        expected = [covering(things, p) if not tolerance else
                    {i for i, d in ((i, t.geometry.distance(p)) for i, t in things.items())
                     if d < tolerance} for p in places]
        (answer,) = self.client.QueryPoints([
            {"opening": {"scope": self.scope, "as_of": as_of, "tolerance_m": tolerance},
             **rpc.columns([(p.x, p.y) for p in places])}])
        met = [set() for _ in places]
        for of, i in zip(answer.layers[0].points, answer.layers[0].object_ids, strict=True):
            met[of].add(i)
        for p, got, right in zip(places, met, expected):
            self.compare(got, right, "QueryPoints", p.wkt, tolerance)
        for p, right in list(zip(places, expected))[:20]:
            answer = self.client.QueryPoint(scope=self.scope, as_of=as_of,
                                            point=rpc.point(p.x, p.y), tolerance_m=tolerance)
            self.compare({o.id for o in answer.layers[0].objects}, right, "QueryPoint", p.wkt,
                         tolerance)

    def check_tolerances(self, things, count, as_of):
        tolerances = [10 ** self.draw.random.uniform(-3, 0.5) for _ in range(4)] + [0.5]
        for tolerance in tolerances:
            self.check_points(things, max(count // len(tolerances), 1), as_of, tolerance)

    def check_areas(self, things, count, as_of):
        for _ in range(count):
            area = self.draw.polygon()
            answers = self.client.QueryArea(scope=self.scope, as_of=as_of, area=rpc.polygon(area))
            self.compare(ids_of(answers), intersecting(things, area), "QueryArea", area.wkt)

    def check_values(self, things, count, as_of):
        for _ in range(count):
            area, label = self.draw.polygon(), self.draw.random.choice(LABELS)
            answers = self.client.QueryValue(scope=self.scope, as_of=as_of, value=label,
                                             area=rpc.polygon(area))
            self.compare(ids_of(answers), intersecting(things, area, label), "QueryValue", label,
                         area.wkt)
        for label in LABELS:
            answers = self.client.QueryValue(scope=self.scope, as_of=as_of, value=label)
            self.compare(ids_of(answers), intersecting(things, None, label), "QueryValue", label)

    def check_nearest(self, things, count, as_of):
        for _ in range(count):
            p = shapely.geometry.Point(self.draw.question(things))
            label, k = self.draw.random.choice(LABELS), self.draw.random.randint(1, 12)
            answer = self.client.QueryNearest(scope=self.scope, as_of=as_of, value=label, k=k,
                                              point=rpc.point(p.x, p.y))
            self.check_are_nearest(
                [(match.object.id, match.distance_m) for match in answer.matches],
                {i: t.geometry.distance(p) for i, t in things.items() if t.label == label}, k,
                ("QueryNearest", label, k, p.wkt))

    def check_are_nearest(self, matches, distances, k, asked):
        """Checks the answer to a nearest query.

        matches: (id, distance) of each match in the answer.
        distances: {id: distance} of all things with the value.
        """
        self.with_content += bool(matches)
        self.assertEqual(len(matches), min(k, len(distances)), asked)
        self.assertEqual(matches, sorted(matches, key=lambda match: match[1]), asked)
        for i, distance in matches:
            self.assertAlmostEqual(distance, distances[i], delta=EXACT_M, msg=asked)
        farthest = max((d for _, d in matches), default=0)
        nearer = {i for i, d in distances.items() if d < farthest - EXACT_M}
        self.assertLessEqual(nearer, {i for i, _ in matches}, asked)

    def check(self, things, count, as_of=None):
        """Makes `count` queries of each of the five kinds."""
        as_of = as_of or {}
        self.check_points(things, count, as_of)
        self.check_tolerances(things, count, as_of)
        self.check_areas(things, count, as_of)
        self.check_values(things, count, as_of)
        self.check_nearest(things, count, as_of)


def ids_of(stream):
    return {o.id for answer in stream for o in answer.part.objects}


class Questions(ShapesTest):

    def test_queries_are_answered_as_by_shapely(self):
        things = self.add_things()
        self.assertEqual({t.geometry.geom_type for t in things.values()},
                         {"Polygon", "LineString", "Point"})
        self.check(things, QUESTIONS)
        # Queries without matches prove little.
        self.assertGreater(self.with_content, QUESTIONS)

    def test_queries_of_an_earlier_revision_are_answered_as_by_shapely(self):
        things = self.add_things(80)
        states = {sites.revision(self.client): things}
        for _ in range(3):
            things = self.change_things(things)
            states[sites.revision(self.client)] = things
        for revision, things in states.items():
            self.check(things, max(QUESTIONS // 20, 5), rpc.at(revision))
        self.check(things, max(QUESTIONS // 20, 5))

    def test_answers_have_the_exact_vertices(self):
        things = self.add_things(60)
        for answer in self.client.QueryArea(scope=self.scope, area=sites.square(-50, -50, 100)):
            for o in answer.part.objects:
                geometry = things.pop(o.id).geometry
                self.assertEqual(coordinates(rpc.geometry_of(o.shape)), coordinates(geometry))
                self.assertAlmostEqual(o.centroid.x, geometry.centroid.x, delta=EXACT_M)
                self.assertAlmostEqual(o.centroid.y, geometry.centroid.y, delta=EXACT_M)
        self.assertEqual(things, {})

    def test_the_command_finds_a_line_and_a_point_with_a_tolerance(self):
        self.edit([Thing("lane", shapely.geometry.LineString([(0, 0), (4, 0), (4, 3)])).feature(),
                   Thing("dock", shapely.geometry.Point(2, 1)).feature()])

        def entities(*tolerance):
            answer = self.site.json("query", "point", "site", 2, 0.25, *tolerance)
            (layer,) = answer["layers"]
            return layer["entities"]

        self.assertEqual(entities(), [])
        (lane,) = entities("--tolerance", 0.25)
        self.assertEqual((lane["label"], lane["line_string"]), ("lane", [[0, 0], [4, 0], [4, 3]]))
        self.assertNotIn("polygon", lane)
        lane, dock = entities("--tolerance", 0.75)
        self.assertEqual((dock["label"], dock["point"], dock["centroid"]), ("dock", [2, 1], [2, 1]))
        self.assertEqual(lane["centroid"], [(2 * 4 + 4 * 3) / 7, (0 * 4 + 1.5 * 3) / 7])


class Files(ShapesTest):

    def export(self, name):
        path = self.folder / f"{name}.geojson"
        self.site.json("export", name, "--format", "geojson", "-o", path)
        return json.loads(path.read_text())

    def test_an_exported_geojson_equals_the_imported_one(self):
        things = self.add_things()
        features = self.export("site")["features"]
        self.assertEqual(len(features), len(things))
        for feature in features:
            thing = things[feature["id"]]
            self.assertEqual((feature["properties"]["label"], feature["geometry"]),
                             (thing.label, coordinates(thing.geometry)))

    def test_importing_an_exported_geojson_gives_the_same_objects(self):
        self.add_things()
        exported = self.export("site")
        self.site.json("import", self.folder / "site.geojson", "--map", "again",
                       "--layer", "things")
        again = self.export("again")
        for document in (exported, again):
            for feature in document["features"]:
                del feature["id"]  # The ids differ between the maps.
        self.assertEqual(again, exported)

    def test_properties_of_every_kind_of_shape_are_exported(self):
        properties = {"label": "lane", "classes": {"lane": 0.75, "wall": 0.25}, "existence": 0.5,
                      "tags": ["one-way", "wet"], "height_min": 0.25, "height_max": 2.5,
                      "speed_m_s": 1.5, "open": True, "owner": "Ärztin"}
        geometries = [self.draw.polygon(), self.draw.line(), shapely.geometry.Point(1.25, -7)]
        self.edit([{"type": "Feature", "properties": properties, "geometry": coordinates(g)}
                   for g in geometries])
        features = self.export("site")["features"]
        self.assertEqual([f["properties"] for f in features], [properties] * 3)
        self.assertEqual([f["geometry"] for f in features], [coordinates(g) for g in geometries])

    @needs_files
    def test_ogr_lists_each_kind_of_a_stored_map(self):
        things = self.add_things()
        listed = subprocess.run(["ogrinfo", "-al", self.data_dir / "site.gpkg", "things"],
                                capture_output=True, text=True, timeout=DEADLINE_S, check=True)
        self.assertIn(f"Feature Count: {len(things)}", listed.stdout)
        found = re.findall(r"^  ((?:POLYGON|LINESTRING|POINT) \(.*\))$", listed.stdout,
                           re.MULTILINE)
        self.assertEqual(len(found), len(things))
        # The rows of the table are read in the order of their ids.
        for wkt, (_, thing) in zip(found, sorted(things.items())):
            geometry = shapely.wkt.loads(wkt)
            self.assertEqual(geometry.geom_type, thing.geometry.geom_type)
            self.assertTrue(geometry.equals_exact(thing.geometry, EXACT_M), (wkt, thing))

    def test_a_layer_takes_only_the_kinds_of_shape_that_it_was_made_for(self):
        self.site.json("layer", "create", "site", "lanes", "--kind", "semantic",
                       "--shapes", "line_string")
        (layer,) = self.site.json("layers", "site")["layers"]
        self.assertEqual(layer["shape_kinds"], ["line_string"])
        lane = Thing("lane", shapely.geometry.LineString([(0, 0), (1, 1)]))
        self.edit([lane.feature()], layer="lanes")
        path = self.folder / "edit.geojson"
        for geometry in (shapely.geometry.Point(1, 1), shapely.geometry.box(0, 0, 1, 1)):
            path.write_text(json.dumps(Thing("lane", geometry).feature()))
            self.assert_fails(self.site.cli("edit", "site", path, "--layer", "lanes"), "lanes",
                              "point" if geometry.geom_type == "Point" else "polygon")
        self.assertEqual(list(sites.labels(self.client, layer="lanes").values()), ["lane"])
        # The layer still has it after a restart.
        self.assertEqual(self.site.stop(), 0)
        self.site = self.server()
        self.assert_fails(self.site.cli("edit", "site", path, "--layer", "lanes"), "lanes")


class Follower(threading.Thread):
    """Follows a watch in a thread. `known` has the selected objects: {id: (label, coordinates)}."""

    def __init__(self, client, begin=None, **request):
        super().__init__()
        self.known, self.kinds = dict(begin or {}), []
        self._revision = -1  # the last revision that was received completely
        self._has_read = threading.Condition()
        self._call = client.Watch(**request)
        self.start()

    def run(self):
        try:
            for message in self._call:
                for change in message.changes:
                    self._take(change, message.snapshot)
                if not message.more:
                    with self._has_read:
                        self._revision = message.revision
                        self._has_read.notify()
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.CANCELLED:
                raise

    def _take(self, change, is_snapshot):
        if not is_snapshot:
            self.kinds.append(change.kind)
        if change.kind in (PUT, ENTER):
            self.known[change.object_id] = decoded(change.object)
        elif change.kind in (REMOVE, LEAVE):
            del self.known[change.object_id]

    def wait_for(self, revision):
        with self._has_read:
            if not self._has_read.wait_for(lambda: self._revision >= revision, DEADLINE_S):
                raise AssertionError(f"the watch did not reach {revision} in {DEADLINE_S} s")

    def close(self):
        self._call.cancel()
        self.join()


def decoded(thing):
    return thing.label, coordinates(rpc.geometry_of(thing.shape))


def selected(things, area=None):
    return {i: (t.label, coordinates(t.geometry)) for i, t in things.items()
            if area is None or t.geometry.intersects(area)}


class Changes(ShapesTest):

    def follow(self, **request):
        follower = Follower(self.client, scope=self.scope, **request)
        self.addCleanup(follower.close)
        return follower

    def test_a_watch_reports_shapes_of_every_kind(self):
        things = self.add_things(60)
        follower = self.follow()
        follower.wait_for(sites.revision(self.client))
        self.assertEqual(follower.known, selected(things))
        for _ in range(3):
            things = self.change_things(things)
        follower.wait_for(sites.revision(self.client))
        self.assertEqual(follower.known, selected(things))
        self.assertEqual(set(follower.kinds), {PUT, REMOVE})

    def test_shapes_enter_and_leave_a_watched_area(self):
        things = self.add_things(60)
        area = shapely.geometry.box(-5, -5, 5, 5)
        follower = self.follow(area=rpc.polygon(area))
        follower.wait_for(sites.revision(self.client))
        self.assertEqual(follower.known, selected(things, area))
        for _ in range(4):
            things = self.change_things(things)
        # The last change is in the area, so that the watch reports it at once.
        dock = Thing("dock", shapely.geometry.Point(1, 1))
        last = self.edit([dock.feature()])["revision"]
        (new,) = set(sites.labels(self.client)) - set(things)
        things[new] = dock
        follower.wait_for(last)
        self.assertEqual(follower.known, selected(things, area))
        self.assertEqual(set(follower.kinds), {PUT, REMOVE, ENTER, LEAVE})

    def test_a_resumed_watch_reports_missed_changes(self):
        before = self.add_things(40)
        start = sites.revision(self.client)
        after = self.change_things(before)
        follower = self.follow(start_revision=start, begin=selected(before))
        follower.wait_for(sites.revision(self.client))
        self.assertEqual(follower.known, selected(after))

    def test_the_difference_of_two_revisions_has_shapes_before_and_after(self):
        before = self.add_things(60)
        start = sites.revision(self.client)
        after = before
        for _ in range(3):
            after = self.change_things(after)
        state = selected(before)
        for answer in self.client.ListChanges(scope=self.scope, from_revision=start):
            for change in answer.changes:
                was = decoded(change.object_before) if change.HasField("object_before") else None
                self.assertEqual(was, state.pop(change.object_id, None))
                if change.kind == PUT:
                    state[change.object_id] = decoded(change.object)
        self.assertEqual(state, selected(after))


if __name__ == "__main__":
    unittest.main()

"""Invalid requests and files are rejected with an error that names the fault. They change nothing
and do not affect other requests."""

import io
import json
import os
import struct
import unittest
import zipfile
import zlib

import grpc
from hypermap.v1 import query_service_pb2

import rpc
import sites
from processes import SiteTest

INVALID = grpc.StatusCode.INVALID_ARGUMENT
NOT_FOUND = grpc.StatusCode.NOT_FOUND
EXHAUSTED = grpc.StatusCode.RESOURCE_EXHAUSTED
FAILED = grpc.StatusCode.FAILED_PRECONDITION
EXISTS = grpc.StatusCode.ALREADY_EXISTS

SQUARE = {"outer": rpc.columns(sites.SQUARE)}
TRIANGLE_TWICE = {"outer": rpc.columns([(0, 0), (1, 0), (0, 0), (1, 0)])}
TWO_POINTS = {"outer": rpc.columns([(0, 0), (1, 1)])}
CROSSING = {"outer": rpc.columns([(0, 0), (2, 2), (2, 0), (0, 2)])}
NOT_FINITE = {"outer": rpc.columns([(0, 0), (1, 0), ("NaN", 1)])}
HOLE_OUTSIDE = SQUARE | {"holes": [rpc.columns([(9, 9), (10, 9), (9, 10)])]}

# (description, polygon, word in the error message)
POLYGONS = [
    ("no outer ring", {}, "area"),
    ("two vertices", TWO_POINTS, "vert"),
    ("two distinct vertices", TRIANGLE_TWICE, "vert"),
    ("a crossing", CROSSING, "cross"),
    ("a vertex that is not finite", NOT_FINITE, "outer[2]"),
    ("a hole outside", HOLE_OUTSIDE, "hole"),
    ("more xs than ys", {"outer": {"xs": [0, 1, 1, 0], "ys": [0, 0, 1]}}, "4 xs and 3 ys"),
]
# (description, shape, field and word in the error message)
SHAPES = [
    ("no shape", {}, "shape"),
    ("a line of one vertex", {"line_string": rpc.columns([(1, 1)])}, "shape.line_string"),
    ("a line of one position", {"line_string": rpc.columns([(1, 1), (1, 1)])}, "shape.line_string"),
    ("a line with a vertex that is not finite",
     {"line_string": rpc.columns([(0, 0), (1, "NaN")])}, "shape.line_string[1]"),
    ("a line with more ys than xs", {"line_string": {"xs": [0, 1], "ys": [0, 1, 2]}},
     "shape.line_string has 2 xs and 3 ys"),
    ("a line with too large coordinates", {"line_string": rpc.columns([(0, 0), (2e9, 0)])},
     "shape.line_string"),
    ("a point that is not finite", {"point": rpc.point("Infinity", 0)}, "shape"),
    ("a point with too large coordinates", {"point": rpc.point(0, -2e9)}, "shape"),
]
KINDS = {"polygon": {"polygon": SQUARE},
         "line_string": {"line_string": rpc.columns([(0, 0), (1, 1)])},
         "point": {"point": rpc.point(1, 1)}}
NAMES = ["", ".", "..", "../site", "a/b", "a\\b", "a b", "x" * 64, "-x", ".hidden", "näme",
         "a\nb", "a'; DROP TABLE gpkg_contents; --", "con\x00trol"]


def edits(bad):
    """Returns a batch whose second edit is invalid."""
    return {"map": "site", "edits": [sites.put("good", 0, 0), bad]}


def transform(parent, child, x=0.0, yaw=0.0):
    return {"parent_frame_id": parent, "child_frame_id": child,
            "parent_from_child": {"x": x, "y": x, "yaw": yaw}}


def requests():
    """Yields (description, rpc, request, status or statuses, word in the error message)."""
    point, site = {"x": 0, "y": 0}, rpc.scope("site")
    yield "unknown map", "QueryPoint", {"scope": rpc.scope("nowhere"), "point": point}, \
        NOT_FOUND, "nowhere"
    yield "unknown layer", "QueryPoint", {"scope": rpc.scope("site", "no"), "point": point}, \
        NOT_FOUND, "no"
    yield "unknown frame", "QueryPoint", \
        {"scope": rpc.scope("site", frame_id="mars"), "point": point}, NOT_FOUND, "mars"
    yield "no point", "QueryPoint", {"scope": site}, INVALID, "point"
    yield "no map", "QueryPoint", {"point": point}, (INVALID, NOT_FOUND), "map"
    for number in ("NaN", "Infinity", "-Infinity"):
        for axis in "xy":
            bad = point | {axis: number}
            yield f"{axis} {number}", "QueryPoint", {"scope": site, "point": bad}, INVALID, "point"
            yield f"nearest {axis} {number}", "QueryNearest", \
                {"scope": site, "point": bad, "value": "chair", "k": 1}, INVALID, "point"
    for tolerance in (-0.1, "NaN", "Infinity"):
        yield f"tolerance {tolerance}", "QueryPoint", \
            {"scope": site, "point": point, "tolerance_m": tolerance}, INVALID, "tolerance_m"
    for what, polygon, word in POLYGONS:
        yield what, "QueryArea", {"scope": site, "area": polygon}, INVALID, word
        if polygon:
            yield f"value in {what}", "QueryValue", \
                {"scope": site, "value": "chair", "area": polygon}, INVALID, word
        yield f"object of {what}", "ApplyEdits", \
            edits(sites.put_shape({"polygon": polygon})), INVALID, "edits[1]"
    for what, shape, word in SHAPES:
        yield f"object of {what}", "ApplyEdits", edits(sites.put_shape(shape)), INVALID, \
            f"edits[1].put_object.object.{word}"
    for kind, shape in KINDS.items():
        layer = "docks" if kind != "point" else "lanes"
        yield f"a {kind} on {layer}", "ApplyEdits", edits(sites.put_shape(shape, layer=layer)), \
            INVALID, kind
    yield "edit without the layer to create", "ApplyEdits", edits({"create_layer": {}}), INVALID, \
        "edits[1].create_layer.layer"
    yield "edit that creates a layer twice", "ApplyEdits", \
        edits({"create_layer": {"layer": {"name": "grid", "kind": "LAYER_KIND_SEMANTIC"}}}), \
        EXISTS, "grid"
    yield "edit that deletes an unknown layer", "ApplyEdits", \
        edits({"delete_layer": {"layer": "nowhere"}}), NOT_FOUND, "nowhere"
    itself = {"parent_frame_id": "a", "child_frame_id": "a",
              "parent_from_child": {"x": 0, "y": 0, "yaw": 0}}
    yield "edit that places a frame in itself", "ApplyEdits", \
        edits({"set_transform": {"transform": itself}}), INVALID, "edits[1]"
    for value in ("", "  ", ">", ">x", "5..1", "tag:", ">nan"):
        yield f"value {value!r}", "QueryValue", {"scope": site, "value": value}, INVALID, "value"
    for k in (0, -1):
        yield f"k {k}", "QueryNearest", \
            {"scope": site, "point": point, "value": "chair", "k": k}, INVALID, "k"
    yield "k too large", "QueryNearest", \
        {"scope": site, "point": point, "value": "chair", "k": 2**31 - 1}, EXHAUSTED, "max_nearest"
    side, pair = {"scope": site}, {"source": point, "target": point}
    grid = {"scope": rpc.scope("site", "grid")}
    yield "no source", "EstimateTransform", {"target": side, "pairs": [pair, pair]}, INVALID, "source"
    yield "no target", "EstimateTransform", {"source": side, "pairs": [pair, pair]}, INVALID, "target"
    yield "nothing to compare", "EstimateTransform", {"source": side, "target": grid}, INVALID, \
        "source: scope.layers"
    yield "two layers of a side", "EstimateTransform", \
        {"source": grid, "target": {"scope": rpc.scope("site", "grid", "things")}}, INVALID, \
        "target: scope.layers"
    yield "layers and pairs", "EstimateTransform", \
        {"source": side, "target": grid, "pairs": [pair, pair]}, INVALID, "target: scope.layers"
    yield "unknown source", "EstimateTransform", \
        {"source": {"scope": rpc.scope("nowhere", "grid")}, "target": grid}, NOT_FOUND, "nowhere"
    yield "one pair", "EstimateTransform", \
        {"source": side, "target": side, "pairs": [pair]}, FAILED, "two pairs"
    yield "too many pairs", "EstimateTransform", \
        {"source": side, "target": side, "pairs": [pair] * 1001}, EXHAUSTED, "pairs"
    yield "pair without target", "EstimateTransform", \
        {"source": side, "target": side, "pairs": [pair, {"source": point}]}, INVALID, "pairs[1]"
    for number in ("NaN", "Infinity"):
        yield f"pair at {number}", "EstimateTransform", \
            {"source": side, "target": side,
             "pairs": [pair, pair | {"target": point | {"y": number}}]}, INVALID, "pairs[1].target"
    for sigma in (-0.1, "NaN", "Infinity"):
        yield f"sigma {sigma}", "EstimateTransform", \
            {"source": side, "target": side, "pairs": [pair, pair | {"sigma_m": sigma}]}, INVALID, \
            "pairs[1].sigma_m"
    yield "layers of different kinds", "EstimateTransform", \
        {"source": {"scope": rpc.scope("site", "things")}, "target": grid}, FAILED, "occupancy"
    for name in NAMES:
        yield f"map name {name!r}", "CreateMap", {"map": name}, INVALID, "map"
        if name:
            yield f"layer name {name!r}", "CreateLayer", \
                {"map": "site", "layer": {"name": name, "kind": "LAYER_KIND_SEMANTIC"}}, \
                INVALID, "name"
    yield "map that exists", "CreateMap", {"map": "site"}, EXISTS, "site"
    yield "layer that exists", "CreateLayer", \
        {"map": "site", "layer": {"name": "things", "kind": "LAYER_KIND_SEMANTIC"}}, EXISTS, "things"
    yield "no layer kind", "CreateLayer", {"map": "site", "layer": {"name": "x"}}, INVALID, "kind"
    yield "grid without geometry", "CreateLayer", \
        {"map": "site", "layer": {"name": "x", "kind": "LAYER_KIND_SCALAR"}}, INVALID, "grid"
    for resolution in (0, -1, "NaN", "Infinity"):
        grid = {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": resolution}
        yield f"resolution {resolution}", "CreateLayer", {"map": "site", "layer": {
            "name": "x", "kind": "LAYER_KIND_OCCUPANCY", "grid": grid}}, INVALID, "resolution"
    yield "frame in itself", "SetTransform", {"map": "site", "transform": {
        "parent_frame_id": "a", "child_frame_id": "a",
        "parent_from_child": {"x": 0, "y": 0, "yaw": 0}}}, INVALID, "a"
    yield "transform that is not finite", "SetTransform", {"map": "site", "transform": {
        "parent_frame_id": "map", "child_frame_id": "a",
        "parent_from_child": {"x": 0, "y": "NaN", "yaw": 0}}}, INVALID, ""
    for number in (1.001e9, -1e308):
        far = transform("map", "a", number)
        yield f"transform by {number} m", "SetTransform", {"map": "site", "transform": far}, \
            INVALID, "parent_from_child: x or y is more than 1e+09 m"
        yield f"edit that moves a frame by {number} m", "ApplyEdits", \
            edits({"set_transform": {"transform": far}}), INVALID, "edits[1]: parent_from_child"
        yield f"origin at {number} m", "CreateLayer", {"map": "site", "layer": {
            "name": "x", "kind": "LAYER_KIND_OCCUPANCY",
            "grid": {"origin": {"x": 0, "y": number, "yaw": 0}, "resolution_m": 1}}}, \
            INVALID, "layer.grid.origin: x or y is more than 1e+09 m"
    yield "frames too deep", "ApplyEdits", {"map": "site", "edits": [
        {"set_transform": {"transform": transform("map" if i == 0 else f"f{i - 1}", f"f{i}")}}
        for i in range(257)]}, EXHAUSTED, "edits[256]: parent_frame_id"
    yield "no edits", "ApplyEdits", {"map": "site"}, INVALID, "edits"
    yield "empty edit", "ApplyEdits", {"map": "site", "edits": [{}]}, INVALID, \
        "edits[0]"
    yield "no label", "ApplyEdits", {"map": "site", "edits": [sites.put("", 0, 0)]}, INVALID, \
        "label"
    yield "existence 2", "ApplyEdits", \
        {"map": "site", "edits": [sites.put("x", 0, 0, existence=2)]}, INVALID, "existence"
    yield "confidence that is NaN", "ApplyEdits", \
        {"map": "site", "edits": [sites.put("x", 0, 0, classes={"x": "NaN"})]}, INVALID, "classes"
    yield "low_m above high_m", "ApplyEdits", {"map": "site", "edits": [
        sites.put("x", 0, 0, height={"low_m": 2, "high_m": 1})]}, INVALID, "height"
    yield "edit of an unknown layer", "ApplyEdits", \
        {"map": "site", "edits": [sites.put("x", 0, 0, layer="no")]}, NOT_FOUND, "no"
    yield "object on a grid", "ApplyEdits", \
        {"map": "site", "edits": [sites.put("x", 0, 0, layer="grid")]}, \
        (INVALID, grpc.StatusCode.FAILED_PRECONDITION), "grid"
    yield "deletion of an unknown object", "ApplyEdits", \
        {"map": "site", "edits": [{"delete_object": {"layer": "things", "id": 77}}]}, NOT_FOUND, \
        "77"
    yield "probability 2", "ApplyEdits", \
        {"map": "site", "edits": [sites.write_cells([[2]])]}, INVALID, "value"
    yield "infinite probability", "ApplyEdits", \
        {"map": "site", "edits": [sites.write_cells([["Infinity"]])]}, INVALID, "value"
    box = {"row_begin": 0, "row_end": 2, "col_begin": 0, "col_end": 2}
    yield "too few cells", "ApplyEdits", {"map": "site", "edits": [
        {"write_cells": {"layer": "grid", "box": box, "values": [1]}}]}, INVALID, "values"
    far = {"row_begin": 2**31 - 2, "row_end": 2**31 - 1, "col_begin": 0, "col_end": 1}
    yield "cells at the end of the world", "ApplyEdits", {"map": "site", "edits": [
        {"write_cells": {"layer": "grid", "box": far, "values": [1]}}]}, INVALID, "box"
    yield "a fill of a continent", "ApplyEdits", {"map": "site", "edits": [{"fill_polygon": {
        "layer": "grid", "area": sites.square(0, 0, 1e6), "value": 1}}]}, (EXHAUSTED, INVALID), ""
    yield "a request id too long", "ApplyEdits", {"map": "site", "request_id": "x" * 129,
                                                  "edits": [sites.put("x", 0, 0)]}, INVALID, \
        "request_id"


class BadRequests(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server("--max_vertices=1000", "--max_question_vertices=500",
                                "--max_edits=300")
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)
        for name, kind in (("lanes", "LINE_STRING"), ("docks", "POINT")):
            self.client.CreateLayer(map="site", layer={
                "name": name, "kind": "LAYER_KIND_SEMANTIC", "shape_kinds": [f"SHAPE_KIND_{kind}"]})

    def refusal(self, method, request):
        """Sends a request, a dictionary or a message, that must fail, and returns its error."""
        with self.assertRaises(grpc.RpcError) as caught:
            call = getattr(self.client, method)
            answer = call(**request) if isinstance(request, dict) else call(request)
            for _ in answer if hasattr(answer, "cancel") else ():
                pass
        return caught.exception

    def test_errors_name_the_fault_and_nothing_changes(self):
        before = sites.revision(self.client)
        for what, method, request, codes, word in requests():
            with self.subTest(what):
                error = self.refusal(method, request)
                codes = codes if isinstance(codes, tuple) else (codes,)
                self.assertIn(error.code(), codes, error.details())
                self.assertIn(word, error.details())
        self.assertEqual(sites.revision(self.client), before)
        self.assertEqual(sites.labels(self.client), {})
        self.assertEqual([m.name for m in self.client.ListMaps().maps], ["site"])
        self.assertTrue(self.site.running())

    def test_errors_name_the_exceeded_limit(self):
        ring = [(i, i * i) for i in range(1001)]
        error = self.refusal("ApplyEdits", {"map": "site", "edits": [
            sites.put_shape({"line_string": rpc.columns(ring)})]})
        self.assertEqual((error.code(), "max_vertices" in error.details()), (EXHAUSTED, True))
        error = self.refusal("ApplyEdits", {"map": "site", "edits": [sites.put("x", 0, 0)] * 301})
        self.assertEqual((error.code(), "max_edits" in error.details()), (EXHAUSTED, True))

    def test_a4_areas_of_questions_have_a_limit_of_their_own(self):
        area = {"outer": rpc.columns([(i, i * i) for i in range(501)])}
        scope = rpc.scope("site")
        for method, request in (
                ("QueryArea", {"scope": scope}),
                ("QueryValue", {"scope": scope, "value": "x"}),
                ("Watch", {"scope": scope}),
                ("Replicate", {"scope": scope}),
                ("StartExploration", {"map": "site", "occupancy_layer": "grid",
                                      "exploration_layer": "seen"})):
            with self.subTest(method):
                error = self.refusal(method, {**request, "area": area})
                self.assertEqual(error.code(), EXHAUSTED)
                self.assertIn("area has 501 vertices, --max_question_vertices is 500",
                              error.details())
        self.client.ApplyEdits(map="site", edits=[sites.put_shape({"polygon": area})])

    def test_a4_a_huge_area_is_refused_unread(self):
        area = {"outer": rpc.columns([(i, i * i) for i in range(20_000)])}
        for method, request in (("QueryArea", {}), ("QueryValue", {"value": "x"})):
            with self.subTest(method):
                error = self.refusal(method, {"scope": rpc.scope("site"), "area": area, **request})
                self.assertEqual(error.code(), EXHAUSTED)
                self.assertIn("--max_question_vertices is 500", error.details())

    def test_an_error_about_a_long_name_reaches_the_client(self):
        error = self.refusal("QueryPoint", {"scope": rpc.scope("site", frame_id="€" * 9000),
                                            "point": rpc.point(0, 0)})
        self.assertEqual(error.code(), grpc.StatusCode.NOT_FOUND)
        self.assertIn("€€... (", error.details())

    def test_a_huge_message_is_refused(self):
        # A message, because it would take seconds to convert a dictionary.
        request = query_service_pb2.QueryValueRequest(value="x" * (200 << 20))
        request.scope.map = "site"
        error = self.refusal("QueryValue", request)
        self.assertEqual(error.code(), EXHAUSTED)
        self.assertEqual(sites.labels(self.client), {})

    def test_names_cannot_refer_to_files_outside_of_the_data_folder(self):
        for name in NAMES:
            for method in ("GetMap", "DeleteMap"):
                error = self.refusal(method, {"map": name})
                self.assertIn(error.code(), (INVALID, NOT_FOUND))
        self.assertEqual({p.name for p in self.folder.iterdir()}, {"data"})


class FarFrames(SiteTest):

    def test_what_was_accepted_in_far_frames_is_there_after_a_restart(self):
        """Puts objects by frames that are as far as allowed, one after the other, and much farther;
        asks by all of them; and compares with the answers after a restart."""
        shapes = [{"point": rpc.point(x, y)} for x in (0, -1e9, 1e9) for y in (1, -1e9, 1e9)]
        shapes += [{"line_string": rpc.columns([(0, 0), (2e-7, 3e-7)])},
                   {"polygon": sites.square(-1e9, -1e9, 1e9)}]
        # Vertices that move across each other when they are rounded.
        shapes += [{"polygon": {"outer": rpc.columns(
            [(2.75 * bit, 2.91 * bit), (1.91 * bit, 1.45 * bit), (.06 * bit, .85 * bit),
             (2.63 * bit, 1.58 * bit)])}}
            for bit in (1e-9, 2**-24, 2**-23, 2**-22)]
        frames = [("map", "half", 1e308), ("half", "far", 1e308), ("map", "near", 1e9),
                  ("near", "next", 1e9), ("next", "last", 1e9), ("map", "back", -9e8)]
        accepted = []

        def asked(client):
            """Returns all answers in all frames, and checks that their numbers are finite."""
            answers = []
            for frame in ("", *(child for _, child, _ in frames if child not in ("half", "far"))):
                scope = rpc.scope("site", frame_id=frame)
                answers += [client.QueryPoint(scope=scope, point=rpc.point(1, 1), tolerance_m=1e9)]
                answers += client.QueryArea(scope=scope, area=sites.square(-1e9, -1e9, 2e9))
                answers += client.QueryValue(scope=scope, value="thing")
                answers += [client.QueryNearest(scope=scope, point=rpc.point(1.7e308, 1.7e308),
                                                value="thing", k=100)]
            text = [str(answer) for answer in answers]
            self.assertNotRegex("".join(text), r"\b(nan|inf)\b")
            return text

        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", edits=[sites.write_cells([[0.1, 0.9]])])
            for parent, child, x in frames:
                try:
                    client.SetTransform(map="site", transform=transform(parent, child, x, 0.5))
                except grpc.RpcError as error:
                    self.assertEqual(error.code(), INVALID, error.details())
            for frame in ("", *(child for _, child, _ in frames)):
                for shape in shapes:
                    put = sites.put_shape(shape)
                    put["put_object"]["frame_id"] = frame
                    try:
                        accepted += client.ApplyEdits(map="site", edits=[put]).object_ids
                    except grpc.RpcError as error:
                        self.assertIn(error.code(), (INVALID, NOT_FOUND), error.details())
            before = asked(client)
        self.assertGreater(len(accepted), len(shapes))
        self.assertEqual(site.stop(), 0)
        with rpc.Client(self.server().address) as client:
            self.assertEqual([m.problem for m in client.ListMaps().maps], [""])
            self.assertEqual(asked(client), before)
            found = {o.id for answer in client.QueryValue(scope=rpc.scope("site"), value="thing")
                     for o in answer.part.objects}
            self.assertEqual(found, set(accepted))


def png_of(width, height, data=b""):
    """Returns a PNG whose header has this size, whatever the size of its data is."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def hmap(**members):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name.replace("__", "."), data)
    return packed.getvalue()


def bomb(size):
    """Returns a zip bomb: an archive of about `size` / 1000 bytes that unpacks to `size` bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("hmap_config.yaml", OBJECT_CONFIG)
        with archive.open("s", "w") as member:
            for _ in range(size >> 20):
                member.write(bytes(1 << 20))
    return packed.getvalue()


GRID_CONFIG = "layers:\n- {class: OccupancyGridLayer, name: g, frame_id: map, load_file: true, file: g}\n"
GRID_YAML = ("image: g.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
             "free_thresh: 0.196\n")
OBJECT_CONFIG = "layers:\n- {class: SemanticLayer, name: s, frame_id: map, load_file: true, file: s}\n"
BILLION_LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join(['*' + chr(97 + i)] * 9)}]\n" for i in range(9))


def objects(shape, name="x"):
    return hmap(hmap_config__yaml=OBJECT_CONFIG, s=f"- {{name: {name}, shape: '{shape}'}}\n")


def hostile_files():
    """Yields (file name, content, word in the error message)."""
    good = hmap(hmap_config__yaml=OBJECT_CONFIG, s="- {name: x, shape: 'POLYGON((0 0,1 0,1 1))'}")
    yield "empty.hmap", b"", ""
    yield "random.hmap", os.urandom(5000), ""
    for cut in (10, len(good) // 2, len(good) - 5):
        yield f"cut{cut}.hmap", good[:cut], ""
    yield "no_config.hmap", hmap(s="x"), "hmap_config.yaml"
    yield "no_member.hmap", hmap(hmap_config__yaml=OBJECT_CONFIG), "s"
    yield "yaml.hmap", hmap(hmap_config__yaml="layers: [{"), "hmap_config.yaml"
    yield "laughs.hmap", hmap(hmap_config__yaml=BILLION_LAUGHS), ""
    yield "deep.hmap", hmap(hmap_config__yaml="[" * 100_000), ""
    yield "tower.hmap", hmap(hmap_config__yaml="layers: " + "{a: " * 50_000), ""
    yield "bomb.hmap", bomb(1100 << 20), ""
    outside = OBJECT_CONFIG.replace("file: s", "file: ../../etc/passwd")
    yield "outside.hmap", hmap(hmap_config__yaml=outside), ""
    yield "giant.hmap", hmap(hmap_config__yaml=GRID_CONFIG, g__yaml=GRID_YAML,
                             g__png=png_of(2**31 - 1, 2**31 - 1)), "g.png"
    yield "large.hmap", hmap(hmap_config__yaml=GRID_CONFIG, g__yaml=GRID_YAML,
                             g__png=png_of(60000, 60000)), "g.png"
    yield "short.hmap", hmap(hmap_config__yaml=GRID_CONFIG, g__yaml=GRID_YAML,
                             g__png=png_of(10, 10, zlib.compress(bytes(20)))), "g.png"
    yield "resolution.hmap", hmap(hmap_config__yaml=GRID_CONFIG, g__png=png_of(
        2, 2, zlib.compress(bytes(6))), g__yaml=GRID_YAML.replace("0.05", ".nan")), "resolution"
    for i, shape in enumerate(("", "POLYGON", "POLYGON((", "POINT(1 2)", "POLYGON((0 0,1 0,nan 1))",
                               "POLYGON((0 0,1 0,1e999 1))",
                               "POLYGON((0 0,1 0,x y))", "POLYGON((0 0,1 0,1))")):
        yield f"wkt{i}.hmap", objects(shape), ""
    yield "empty.geojson", b"", ""
    yield "deep.geojson", b"[" * 100_000, ""
    yield "bow_tie.geojson", geojson([[[0, 0], [2, 2], [2, 0], [0, 2], [0, 0]]]), "cross"
    yield "text.geojson", geojson([[["a", "b"], [1, 0], [1, 1], ["a", "b"]]]), ""
    yield "infinite.geojson", \
        geojson([[[0, 0], [1, 0], [1, 1], [0, 0]]]).replace(b"1]", b"1e999]"), ""
    yield "other.geojson", b'{"type": "Topology"}', ""
    for name, kind, coordinates, word in (
            ("short_line", "LineString", [[0, 0]], "vertices"),
            ("one_place", "LineString", [[1, 1], [1, 1]], "vertices"),
            ("text_line", "LineString", [[0, 0], ["a", 1]], ""),
            ("text_point", "Point", ["a", "b"], ""),
            ("half_point", "Point", [1], ""),
            ("far_point", "Point", [1e12, 0], "")):
        yield f"{name}.geojson", geojson(coordinates, kind), word
    yield "collection.geojson", geojson([], "GeometryCollection"), "GeometryCollection"
    yield "unlabelled.geojson", \
        b'{"type":"Feature","geometry":{"type":"Point","coordinates":[0,0]}}', "label"


def geojson(coordinates, kind="Polygon"):
    return json.dumps({"type": "FeatureCollection", "features": [{
        "type": "Feature", "properties": {"label": "x"},
        "geometry": {"type": kind, "coordinates": coordinates}}]}).encode()


class HostileFiles(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()

    def test_each_is_refused_in_one_line_and_creates_no_map(self):
        for name, data, word in hostile_files():
            with self.subTest(name):
                path = self.folder / name
                path.write_bytes(data)
                layer = ["--layer", "things"] if name.endswith("geojson") else []
                self.assert_fails(self.site.cli("import", path, "--map", "site", *layer), word)
                path.unlink()
        self.assertEqual(self.site.json("maps"), {"maps": []})
        self.assertTrue(self.site.running())

    def test_hostile_nav2_files_are_refused(self):
        images = {
            "image_outside": (GRID_YAML.replace("g.png", "../../../etc/passwd"), None),
            "no_image": (GRID_YAML, None),
            "truncated": (GRID_YAML.replace("g.png", "g.pgm"), b"P5\n100 100\n255\nabc"),
            "giant": (GRID_YAML.replace("g.png", "g.pgm"), b"P5\n2147483647 2147483647\n255\n"),
            "negative": (GRID_YAML.replace("g.png", "g.pgm"), b"P5\n-1 5\n255\n"),
            "text": (GRID_YAML.replace("g.png", "g.pgm"), b"hello"),
        }
        for name, (about, image) in images.items():
            with self.subTest(name):
                folder = self.folder / name
                folder.mkdir()
                (folder / "g.yaml").write_text(about)
                if image is not None:
                    (folder / "g.pgm").write_bytes(image)
                self.assert_fails(self.site.cli("import", folder / "g.yaml", "--map", "site"))
        self.assertEqual(self.site.json("maps"), {"maps": []})

    def test_importing_folders_devices_and_missing_files_fails(self):
        for path in (self.folder, self.folder / "missing.hmap", "/dev/null"):
            self.assert_fails(self.site.cli("import", path, "--map", "site", "--format", "hmap"))


class ForeignFilesInTheDataFolder(SiteTest):

    def test_files_that_are_no_maps_are_listed_with_a_problem(self):
        (self.data_dir / "folder.gpkg").mkdir()
        (self.data_dir / "random.gpkg").write_bytes(os.urandom(100_000))
        (self.data_dir / "empty.gpkg").write_bytes(b"")
        (self.data_dir / "text.gpkg").write_text("not a map")
        (self.data_dir / "notes.txt").write_text("not a map either")
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", edits=[sites.put("chair", 1, 1)])
            self.assertEqual(list(sites.labels(client).values()), ["chair"])
            problems = {m.name: m.problem for m in client.ListMaps().maps}
            self.assertEqual(problems.pop("site"), "")
            self.assertEqual(set(problems), {"folder", "random", "empty", "text"})
            self.assertTrue(all(problems.values()), problems)
            for name in problems:
                with self.assertRaises(grpc.RpcError) as caught:
                    client.QueryPoint(scope=rpc.scope(name), point=rpc.point(0, 0))
                self.assertIn(caught.exception.code(), (grpc.StatusCode.FAILED_PRECONDITION,
                                                        grpc.StatusCode.DATA_LOSS))
                self.assertIn(name, caught.exception.details())
        self.assertEqual(site.stop(), 0)

    def test_a_damaged_map_is_listed_with_a_problem_and_other_maps_work(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            for name in ("site", "hurt"):
                sites.make(client, name)
                client.ApplyEdits(map=name, edits=[sites.put("chair", x, 1) for x in range(90)])
        self.assertEqual(site.stop(), 0)
        path = self.data_dir / "hurt.gpkg"
        data = bytearray(path.read_bytes())
        data[4096:] = os.urandom(len(data) - 4096)
        path.write_bytes(data)
        with rpc.Client(self.server().address) as client:
            self.assertEqual(len(sites.labels(client)), 90)
            with self.assertRaises(grpc.RpcError) as caught:
                sites.labels(client, "hurt")
            self.assertIn(caught.exception.code(), (grpc.StatusCode.FAILED_PRECONDITION,
                                                    grpc.StatusCode.DATA_LOSS))
            problems = {m.name: m.problem for m in client.ListMaps().maps}
            self.assertEqual((problems["site"], bool(problems["hurt"])), ("", True))

    def test_a_foreign_geopackage_is_refused_and_not_changed(self):
        from osgeo import ogr  # Imported here because the other tests do not need GDAL.
        path = self.data_dir / "foreign.gpkg"
        foreign = ogr.GetDriverByName("GPKG").CreateDataSource(str(path))
        foreign.CreateLayer("lakes")
        del foreign
        before = path.read_bytes()
        with rpc.Client(self.server().address) as client:
            (entry,) = client.ListMaps().maps
            self.assertEqual((entry.name, bool(entry.problem)), ("foreign", True))
            with self.assertRaises(grpc.RpcError) as caught:
                client.ApplyEdits(map="foreign", edits=[sites.put("x", 0, 0)])
            self.assertEqual(caught.exception.code(), grpc.StatusCode.FAILED_PRECONDITION)
        self.assertEqual(path.read_bytes(), before)


if __name__ == "__main__":
    unittest.main()

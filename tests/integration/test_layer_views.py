"""Maps in PostgreSQL as GIS programs see them: ogrinfo lists each semantic layer as a view of PostGIS,
and the view has the objects that the server answers with."""

import itertools
import json
import re
import subprocess
import time
import unittest

import grpc

import rpc
import sites
from processes import DEADLINE_S, SEED
from shared_database import FleetTest
from test_shapes import Draw

try:
    # Errors are printed, and show as features that are missing: as exceptions, some have no text.
    from osgeo import ogr
except ImportError:
    ogr = None

EVERYWHERE = sites.square(-1000, -1000, 2000)
# Names as the server allows them, and the shapes that the layers take.
MAP, OTHER_MAP = "site", "Site-2.annex"
KINDS = {"things": None, "rooms-1.OG": "polygon", "lanes": "line_string", "docks": "point"}
# As ogrinfo writes them.
TYPES = {None: "", "polygon": "Polygon", "line_string": "Line String", "point": "Point"}
ROUNDS, EDITS = 4, 30


def has_ogr():
    return ogr is not None and ogr.GetDriverByName("PostgreSQL") is not None


def features(dataset, layer):
    """Reads a layer by OGR: {id: ({field: value}, geometry as WKB)}. The id is a field of a view, and
    the number of a feature in a GeoPackage."""
    opened = ogr.Open(dataset)
    found = {}
    for feature in opened.GetLayerByName(layer):
        fields = feature.items()
        i = fields.pop("id", feature.GetFID())
        found[i] = (fields, bytes(feature.geometry().ExportToWkb(ogr.wkbNDR)))
    return found


def answered(objects):
    """What the view should have of a server's objects, as `features`."""
    return {o.id: ({"label": o.label, "existence": o.existence, "classes": dict(o.classes),
                    "tags": list(o.tags),
                    "attributes": {name: getattr(value, value.WhichOneof("value"))
                                   for name, value in o.attributes.items()},
                    "height_min": o.height.low_m if o.HasField("height") else None,
                    "height_max": o.height.high_m if o.HasField("height") else None,
                    "version": o.version,
                    "expires_at_ns": (o.expire_time.ToNanoseconds()
                                      if o.HasField("expire_time") else None)},
                   rpc.geometry_of(o.shape).wkb) for o in objects}


def decoded(found):
    """Reads the JSON in what `features` returns."""
    return {i: ({**fields, **{name: json.loads(fields[name])
                              for name in ("classes", "tags", "attributes")}}, wkb)
            for i, (fields, wkb) in found.items()}


@unittest.skipUnless(has_ogr(), "OGR or its driver of PostgreSQL is missing")
class LayerViews(FleetTest):

    def setUp(self):
        super().setUp()
        self.draw = Draw(SEED)
        self.random = self.draw.random
        self.fleet = self.servers(2)
        if not self.has_postgis():
            self.skipTest("PostGIS is missing")
        self.clients = [self.enterContext(rpc.Client(server.address)) for server in self.fleet]
        self.views = {}  # view -> (map, layer)
        self.request_ids = itertools.count()
        for name in (MAP, OTHER_MAP):
            self.change("CreateMap", map=name)
            self.fleet.await_map(name)
            for layer in KINDS:
                self.create(name, layer)
            self.change("CreateLayer", map=name, layer={
                "name": "grid", "kind": "LAYER_KIND_OCCUPANCY",
                "grid": {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": 0.5}})
            self.fleet.await_map(name, len(KINDS) + 1)

    def psql(self, statement):
        return subprocess.run(["psql", "-qAtX", "-d", self.fleet.store, "-c", statement], text=True,
                              check=True, capture_output=True, timeout=DEADLINE_S).stdout.strip()

    def has_postgis(self):
        return self.psql("SELECT 1 FROM pg_extension WHERE extname = 'postgis'") == "1"

    @property
    def client(self):
        """Either server's: calls are passed on to the owner."""
        return self.random.choice(self.clients)

    def change(self, method, **fields):
        """Calls a server until one answers: a map has no owner while it moves to another server."""
        request_id = f"request {next(self.request_ids)}"
        deadline = time.monotonic() + DEADLINE_S
        while True:
            try:
                return getattr(self.client, method)(request_id=request_id, **fields)
            except grpc.RpcError as error:
                if error.code() != grpc.StatusCode.UNAVAILABLE or time.monotonic() > deadline:
                    raise
                time.sleep(0.05)

    def create(self, map_name, layer):
        shape_kinds = [f"SHAPE_KIND_{KINDS[layer].upper()}"] if KINDS[layer] else []
        answer = self.change("CreateLayer", map=map_name, layer={
            "name": layer, "kind": "LAYER_KIND_SEMANTIC", "shape_kinds": shape_kinds})
        self.views[f"{map_name}/{layer}".replace(".", ":")] = (map_name, layer)
        return answer

    def delete(self, map_name, layer):
        answer = self.change("DeleteLayer", map=map_name, layer=layer)
        self.fleet.await_map(map_name, answer.revision)
        del self.views[f"{map_name}/{layer}"]

    def geometry(self, layer):
        while True:
            geometry = self.draw.geometry()
            if KINDS[layer] in (None, {"Polygon": "polygon", "LineString": "line_string",
                                       "Point": "point"}[geometry.geom_type]):
                return geometry

    def put(self, layer, **fields):
        number = self.random.random
        if number() < 0.5:
            fields["height"] = {"low_m": number(), "high_m": 1 + number()}
        return sites.put_shape(
            rpc.shape_of(self.geometry(layer)), self.random.choice(("cup", "Tasse \"ä\"")), layer,
            existence=number(), classes={"cup": number(), "bowl'": number()}, tags=["b", "a"],
            attributes={"n": {"int_value": 2**53 + 1}, "x": {"double_value": number()},
                        "s": {"string_value": "a\nb"}, "b": {"bool_value": True}}, **fields)

    def edit(self, map_name):
        """Adds, replaces and removes objects."""
        edits = []
        for layer in KINDS:
            there = [o.id for o in self.objects(self.clients[0], map_name, layer)]
            changed = self.random.sample(there, len(there) // 3)
            edits += [self.put(layer, id=i) for i in changed[::2]]
            edits += [{"delete_object": {"layer": layer, "id": i}} for i in changed[1::2]]
            edits += [self.put(layer) for _ in range(EDITS)]
        edits[0]["put_object"]["time_to_live"] = "86400s"
        answer = self.change("ApplyEdits", map=map_name, edits=edits)
        self.fleet.await_map(map_name, answer.revision)

    @staticmethod
    def objects(client, map_name, layer):
        return [o for part in client.QueryArea(scope=rpc.scope(map_name, layer), area=EVERYWHERE)
                for o in part.part.objects]

    def listed(self):
        """Returns what ogrinfo lists: {view: type of geometry}."""
        result = subprocess.run(["ogrinfo", "-ro", self.dataset], capture_output=True, text=True,
                                timeout=DEADLINE_S, check=True)
        return dict(re.findall(r"^\d+: (\S+)(?: \((.*)\))?$", result.stdout, re.MULTILINE))

    @property
    def dataset(self):
        host, _, database = self.fleet.store.removeprefix("postgresql://").partition("/")
        user, _, address = host.partition("@")
        address, _, port = address.partition(":")
        return (f"PG:host={address} port={port} user={user} dbname={database} "
                "schemas=hypermap_layers")

    def check(self):
        """Compares the views with the layers of the servers, and with their GeoPackages."""
        expected = {view: TYPES[KINDS[layer]] for view, (_, layer) in self.views.items()}
        deadline = time.monotonic() + DEADLINE_S
        while (listed := self.listed()) != expected and time.monotonic() < deadline:
            time.sleep(0.05)
        self.assertEqual(listed, expected)
        packages = {name: self.geopackage_of(name) for name, _ in set(self.views.values())}
        for view, (map_name, layer) in self.views.items():
            shown = features(self.dataset, view)
            for client in self.clients:
                self.assertEqual(decoded(shown), answered(self.objects(client, map_name, layer)),
                                 (f"HYPERMAP_TEST_SEED={SEED}", view))
            self.assertEqual(shown, features(packages[map_name], re.sub("[-.]", "_", layer)), view)

    def geopackage_of(self, map_name):
        path = self.folder / f"{map_name}.gpkg"
        path.unlink(missing_ok=True)
        self.fleet[0].json("backup", map_name, "-o", path)
        return str(path)

    def test_views_have_what_the_servers_answer(self):
        self.check()
        for _ in range(ROUNDS):
            for map_name in (MAP, OTHER_MAP):
                self.edit(map_name)
            self.check()

    def test_views_come_and_go_with_their_layers(self):
        self.edit(MAP)
        self.delete(MAP, "lanes")
        self.delete(MAP, "docks")
        self.fleet.await_map(MAP, self.create(MAP, "docks").revision)
        self.check()
        self.change("DeleteMap", map=OTHER_MAP)
        self.views = {view: of for view, of in self.views.items() if of[0] != OTHER_MAP}
        self.check()

    def test_a_restored_map_has_its_views(self):
        self.edit(MAP)
        copy = self.folder / "copy.gpkg"
        self.fleet[0].json("backup", MAP, "-o", copy)
        self.edit(MAP)
        self.change("DeleteLayer", map=MAP, layer="lanes")
        self.fleet[0].json("restore", copy, "--map", MAP, "--replace")
        self.fleet.await_map(MAP)
        self.check()

    def test_views_outlive_their_server(self):
        self.edit(MAP)
        self.fleet.kill(self.fleet.owner_of(MAP))
        self.assertEqual(self.listed().keys(), self.views.keys())

    def test_a_layer_with_a_reader_can_be_deleted(self):
        """As QGIS reads: with a cursor in a transaction."""
        self.edit(MAP)
        self.check()
        database = ogr.Open(self.dataset)
        reader = database.GetLayerByName(f"{MAP}/things")
        self.assertIsNotNone(reader.GetNextFeature())
        self.delete(MAP, "things")
        with self.assertRaises(grpc.RpcError) as gone:
            self.objects(self.client, MAP, "things")
        self.assertEqual(gone.exception.code(), grpc.StatusCode.NOT_FOUND)


if __name__ == "__main__":
    unittest.main()

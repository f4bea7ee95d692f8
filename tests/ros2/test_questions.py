"""The services' answers on recorded maps equal those of the server's own API."""

import pathlib
import random
import tempfile
import unittest

import dds_types as dds
import rpc
from nodes import Bridge, Node
from processes import QUESTIONS, SEED, Server, real_maps

HERE = dds.Header(dds.Time(), "")
SERVICES = ["get_int_at_point", "get_string_at_point", "get_ints_by_area", "get_strings_by_area",
            "get_locations_by_int", "get_locations_by_string", "get_semantic_by_area",
            "get_semantic_by_string"]
# The bytes and words of a cell, by the thresholds of ROS (docs/protocol.md).
FREE, OCCUPIED, UNKNOWN = (0, "Free"), (100, "Occupied"), (-1, "Unknown")


def told(value, layer):
    if value is None or value != value:
        return UNKNOWN
    limits = layer.thresholds
    return FREE if value < limits.free_below else OCCUPIED if value > limits.occupied_above else UNKNOWN


@unittest.skipUnless(real_maps(), "the recorded maps are missing")
class QuestionsTest(unittest.TestCase):
    """One map of a grid and of objects, the one with the most objects."""

    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        server = cls.enterClassContext(Server(folder / "data"))
        cls.client = cls.enterClassContext(rpc.Client(server.address))
        for name, path in real_maps().items():
            server.json("import", path, "--map", name)
        layers = {name: list(cls.client.ListLayers(map=name).layers) for name in real_maps()}
        def objects(name):
            return sum(layer.size for layer in layers[name] if not layer.HasField("grid"))
        cls.map = max((n for n in layers if any(l.HasField("grid") for l in layers[n])),
                      key=objects)
        cls.grid = next(l for l in layers[cls.map] if l.HasField("grid"))
        cls.things = next(l for l in layers[cls.map] if not l.HasField("grid"))
        cls.enterClassContext(Bridge(server.address, f"--map={cls.map}"))
        node = Node()
        cls.services = {name: node.client(f"/hypermap/{name}") for name in SERVICES}
        for service in cls.services.values():
            service.await_service()
        cls.labels = sorted({o.label for part in cls.in_area(cls.things.name, cls.everywhere())
                             for o in part.objects})

    @classmethod
    def everywhere(cls):
        return {"outer": rpc.columns([(-500, -500), (500, -500), (500, 500), (-500, 500)])}

    @classmethod
    def in_area(cls, layer, area):
        for answer in cls.client.QueryArea(scope=rpc.scope(cls.map, layer), area=area):
            yield answer.part

    def setUp(self):
        self.random = random.Random(SEED)
        extent, grid = self.grid.extent, self.grid.grid
        side = grid.resolution_m
        self.x = (grid.origin.x + extent.col_begin * side, grid.origin.x + extent.col_end * side)
        self.y = (grid.origin.y + extent.row_begin * side, grid.origin.y + extent.row_end * side)

    def points(self, count):
        for _ in range(count):
            yield self.random.uniform(*self.x), self.random.uniform(*self.y)

    def squares(self, count, side):
        # Corners that 32 bits hold exactly.
        for x, y in self.points(count):
            x, y = round(x * 16) / 16, round(y * 16) / 16
            corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
            area = dds.Polygon([dds.Point32(a, b, 0.0) for a, b in corners])
            yield {"outer": rpc.columns(corners)}, dds.PolygonStamped(HERE, area)

    def cells(self, area):
        """(x, y, value) of the cells of the grid in an area."""
        for part in self.in_area(self.grid.name, area):
            runs, side = part.cells, part.cells.grid.resolution_m
            origin = runs.grid.origin
            self.assertEqual(origin.yaw, 0)
            for row, begin, end, value in zip(runs.rows, runs.col_begins, runs.col_ends, runs.values):
                for col in range(begin, end):
                    yield (origin.x + (col + 0.5) * side, origin.y + (row + 0.5) * side, value)

    def test_points(self):
        for x, y in self.points(QUESTIONS):
            place = dds.PointStamped(HERE, dds.Point(x, y, 0.0))
            contents = {c.layer: c for c in self.client.QueryPoint(
                scope=rpc.scope(self.map), point=rpc.point(x, y)).layers}
            cell = contents[self.grid.name]
            number, word = told(cell.value if cell.HasField("value") else None, self.grid)
            ask = self.services
            self.assertEqual(ask["get_int_at_point"].call(self.grid.name, place).value, number)
            self.assertEqual(ask["get_string_at_point"].call(self.grid.name, place).name, word)
            objects = contents[self.things.name].objects
            self.assertEqual(ask["get_string_at_point"].call(self.things.name, place).name,
                             "|".join(o.label for o in objects))
            self.assertEqual(ask["get_int_at_point"].call(self.things.name, place).value,
                             objects[0].id if objects else 0)

    def test_areas_of_a_grid(self):
        for area, message in self.squares(QUESTIONS // 4, 0.5):
            expected = [(x, y, *told(value, self.grid)) for x, y, value in self.cells(area)]
            ints = self.services["get_ints_by_area"].call(self.grid.name, message)
            strings = self.services["get_strings_by_area"].call(self.grid.name, message)
            self.assertEqual(list(ints.values), [e[2] for e in expected])
            self.assertEqual(list(strings.names), [e[3] for e in expected])
            for location, (x, y, *_) in zip(ints.locations, expected, strict=True):
                self.assertAlmostEqual(location.x, x, places=9)
                self.assertAlmostEqual(location.y, y, places=9)
            occupied = self.services["get_locations_by_string"].call(self.grid.name, "Occupied", message)
            free = self.services["get_locations_by_int"].call(self.grid.name, 0, message)
            self.assertEqual(len(occupied.locations), sum(e[3] == "Occupied" for e in expected))
            self.assertEqual(len(free.locations), sum(e[2] == 0 for e in expected))

    def test_areas_of_objects(self):
        for area, message in self.squares(QUESTIONS // 2, 2.0):
            objects = [o for part in self.in_area(self.things.name, area) for o in part.objects]
            strings = self.services["get_strings_by_area"].call(self.things.name, message)
            self.assertEqual(list(strings.names), [o.label for o in objects])
            found = self.services["get_semantic_by_area"].call(message).objects
            self.assertEqual([(o.id, o.name) for o in found], [(o.id, o.label) for o in objects])

    def test_searches_for_objects(self):
        for label in self.labels:
            answers = self.client.QueryValue(scope=rpc.scope(self.map, self.things.name), value=label)
            ids = [o.id for answer in answers for o in answer.part.objects]
            locations = self.services["get_locations_by_string"].call(
                self.things.name, label, dds.PolygonStamped(HERE, dds.Polygon([]))).locations
            self.assertEqual(len(locations), len(ids))
            found = self.services["get_semantic_by_string"].call(label).objects
            self.assertEqual([o.id for o in found], ids)


if __name__ == "__main__":
    unittest.main()

"""Random questions to the services about a recorded map, with the answers of the server's own API."""

import collections
import pathlib
import random
import tempfile
import time
import zlib
from dataclasses import dataclass, field

import numpy

import dds_types as dds
import rpc
from processes import QUESTIONS, SEED, Server, real_maps

HERE = dds.Header(dds.Time(), "")
EVERYWHERE = dds.PolygonStamped(HERE, dds.Polygon([]))
SERVICES = ["/hypermap/get_int_at_point", "/hypermap/get_string_at_point", "/hypermap/get_ints_by_area",
            "/hypermap/get_strings_by_area", "/hypermap/get_locations_by_int",
            "/hypermap/get_locations_by_string", "/hypermap/get_semantic_by_area",
            "/hypermap/get_semantic_by_string", "/map_server/map", "/map_server/load_map"]
# The bytes and words of a cell, by the thresholds of ROS (docs/protocol.md).
FREE, OCCUPIED, UNKNOWN = (0, "Free"), (100, "Occupied"), (-1, "Unknown")
# Sides of areas in metres. A grid has many more cells than a floor has objects.
GRID_SIDE_M, OBJECTS_SIDE_M = 0.5, 2.0


@dataclass
class Answer:
    """What a reply says: `content`, which has to be equal, and places (x, y), which may be rounded."""
    content: object
    places: list = field(default_factory=list)


@dataclass
class Question:
    fields: tuple  # of the request
    answer: Answer


def answer_in(reply):
    """The Answer in a reply of any service, by the fields that it has."""
    if hasattr(reply, "map"):
        return Answer((getattr(reply, "result", 0), *grid_of(reply.map)))
    if hasattr(reply, "objects"):
        return Answer([(o.id, o.name, [(numpy.float32(p.x), numpy.float32(p.y)) for p in o.shape.points])
                       for o in reply.objects])
    contents = [list(getattr(reply, name)) for name in ("values", "names") if hasattr(reply, name)]
    if hasattr(reply, "locations"):
        return Answer(contents, [(p.x, p.y) for p in reply.locations])
    return Answer(reply.value if hasattr(reply, "value") else reply.name)


def grid_of(grid):
    """Size, resolution and the CRC-32 of the cells of an OccupancyGrid; ros2-client gives only the last."""
    cells = grid.data if isinstance(grid.data, int) else zlib.crc32(numpy.array(grid.data, numpy.int8))
    return grid.info.width, grid.info.height, numpy.float32(grid.info.resolution), cells


def told(value, layer):
    if value is None or value != value:
        return UNKNOWN
    limits = layer.thresholds
    return FREE if value < limits.free_below else OCCUPIED if value > limits.occupied_above else UNKNOWN


def is_grid(layer):
    return layer.HasField("grid")


class RecordedMap:
    """A server with the recorded map of a grid that has the most objects. The test case ends it."""

    def __init__(self, test):
        folder = pathlib.Path(test.enterContext(tempfile.TemporaryDirectory()))
        self.server = test.enterContext(Server(folder / "data"))
        self._client = test.enterContext(rpc.Client(self.server.address))
        self._random = random.Random(SEED)
        for name, path in real_maps().items():
            self.server.json("import", path, "--map", name)
        layers = {name: list(self._client.ListLayers(map=name).layers) for name in real_maps()}
        self.name = max((name for name, found in layers.items() if any(map(is_grid, found))),
                        key=lambda name: sum(l.size for l in layers[name] if not is_grid(l)))
        self._grid = next(l for l in layers[self.name] if is_grid(l))
        self._things = next(l for l in layers[self.name] if not is_grid(l))
        whole = {"outer": rpc.columns([(-500, -500), (500, -500), (500, 500), (-500, 500)])}
        self._labels = sorted({o.label for o in self._objects(whole)})
        self.grid = self._whole_grid(whole)

    def questions(self, service, count=QUESTIONS):
        """Random ones to a service."""
        make = getattr(self, "_" + service.rsplit("/", 1)[1])
        return (make() for _ in range(count))

    def _get_int_at_point(self):
        x, y = self._point()
        objects, cell = self._at(x, y)
        place = dds.PointStamped(HERE, dds.Point(x, y, 0.0))
        if self._asks_grid():
            return Question((self._grid.name, place), Answer(cell[0]))
        return Question((self._things.name, place), Answer(objects[0].id if objects else 0))

    def _get_string_at_point(self):
        x, y = self._point()
        objects, cell = self._at(x, y)
        place = dds.PointStamped(HERE, dds.Point(x, y, 0.0))
        if self._asks_grid():
            return Question((self._grid.name, place), Answer(cell[1]))
        return Question((self._things.name, place), Answer("|".join(o.label for o in objects)))

    def _get_ints_by_area(self):
        layer, message, items = self._items()
        return Question((layer, message), Answer([[i.number for i in items]], [i.place for i in items]))

    def _get_strings_by_area(self):
        layer, message, items = self._items()
        return Question((layer, message), Answer([[i.word for i in items]], [i.place for i in items]))

    def _get_locations_by_int(self):
        layer, message, items = self._items()
        wanted = self._random.choice([i.number for i in items] or [0])
        return Question((layer, wanted, message),
                        Answer([], [i.place for i in items if i.number == wanted]))

    def _get_locations_by_string(self):
        if self._asks_grid():
            layer, message, items = self._items_of_grid()
            wanted = self._random.choice(["Free", "Occupied", "Unknown"])
            return Question((layer, wanted, message),
                            Answer([], [i.place for i in items if i.word == wanted]))
        label = self._random.choice(self._labels)
        return Question((self._things.name, label, EVERYWHERE),
                        Answer([], [centroid_of(o) for o in self._with_label(label)]))

    def _get_semantic_by_area(self):
        area, message = self._square(OBJECTS_SIDE_M)
        return Question((message,), Answer([described(o) for o in self._objects(area)]))

    def _get_semantic_by_string(self):
        label = self._random.choice(self._labels)
        return Question((label,), Answer([described(o) for o in self._with_label(label)]))

    def _map(self):
        return Question((0,), Answer((0, *self.grid)))

    def _load_map(self):
        return Question((f"hypermap://{self.name}/{self._grid.name}",), Answer((0, *self.grid)))

    def _asks_grid(self):
        return self._random.random() < 0.5

    def _point(self):
        extent, grid = self._grid.extent, self._grid.grid
        side = grid.resolution_m
        return (self._random.uniform(grid.origin.x + extent.col_begin * side,
                                     grid.origin.x + extent.col_end * side),
                self._random.uniform(grid.origin.y + extent.row_begin * side,
                                     grid.origin.y + extent.row_end * side))

    def _square(self, side):
        """An area as messages of gRPC and of ROS, with corners that 32 bits hold exactly."""
        x, y = (round(c * 16) / 16 for c in self._point())
        corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
        area = dds.Polygon([dds.Point32(a, b, 0.0) for a, b in corners])
        return {"outer": rpc.columns(corners)}, dds.PolygonStamped(HERE, area)

    def _items(self):
        """(layer, area, what it has in the area)"""
        if self._asks_grid():
            return self._items_of_grid()
        area, message = self._square(OBJECTS_SIDE_M)
        items = [Item(o.id, o.label, centroid_of(o)) for o in self._objects(area)]
        return self._things.name, message, items

    def _items_of_grid(self):
        area, message = self._square(GRID_SIDE_M)
        return self._grid.name, message, list(self._cells(area))

    def _at(self, x, y):
        """(the objects, what is told of the cell)"""
        contents = {c.layer: c for c in self._client.QueryPoint(
            scope=rpc.scope(self.name), point=rpc.point(x, y)).layers}
        cell = contents[self._grid.name]
        value = cell.value if cell.HasField("value") else None
        return contents[self._things.name].objects, told(value, self._grid)

    def _in_area(self, layer, area):
        for answer in self._client.QueryArea(scope=rpc.scope(self.name, layer), area=area):
            yield answer.part

    def _objects(self, area):
        return [o for part in self._in_area(self._things.name, area) for o in part.objects]

    def _with_label(self, label):
        answers = self._client.QueryValue(scope=rpc.scope(self.name, self._things.name), value=label)
        return [o for answer in answers for o in answer.part.objects]

    def _runs(self, area):
        """(row, first column, end, value) of the cells of the grid in an area."""
        for part in self._in_area(self._grid.name, area):
            runs = part.cells
            yield from zip(runs.rows, runs.col_begins, runs.col_ends, runs.values)

    def _cells(self, area):
        origin, side = self._grid.grid.origin, self._grid.grid.resolution_m
        assert origin.yaw == 0
        for row, begin, end, value in self._runs(area):
            for col in range(begin, end):
                yield Item(*told(value, self._grid),
                           (origin.x + (col + 0.5) * side, origin.y + (row + 0.5) * side))

    def _whole_grid(self, area):
        extent = self._grid.extent
        cells = numpy.full((extent.row_end - extent.row_begin, extent.col_end - extent.col_begin),
                           UNKNOWN[0], numpy.int8)
        for row, begin, end, value in self._runs(area):
            cells[row - extent.row_begin, begin - extent.col_begin:end - extent.col_begin] = (
                told(value, self._grid)[0])
        height, width = cells.shape
        return width, height, numpy.float32(self._grid.grid.resolution_m), zlib.crc32(cells)


# A cell or an object.
Item = collections.namedtuple("Item", ["number", "word", "place"])


def centroid_of(message):
    centroid = rpc.geometry_of(message.shape).centroid
    return centroid.x, centroid.y


def described(message):
    outline = rpc.geometry_of(message.shape).exterior.coords[:-1]
    return message.id, message.label, [(numpy.float32(x), numpy.float32(y)) for x, y in outline]


def ask_all_services(test, recorded, client_of, title):
    """Asks QUESTIONS random questions of each service and checks the answers. `client_of(service)` has the method
    call(*fields). Prints how many were answered, and how long calls took."""
    for service in SERVICES:
        client = client_of(service)
        times_ms = []
        for question in recorded.questions(service):
            begin = time.monotonic()
            reply = client.call(*question.fields)
            times_ms.append(1000 * (time.monotonic() - begin))
            check_answer(test, answer_in(reply), question, service)
        print(f"{title}: {service}: {len(times_ms)} of {QUESTIONS} answered, "
              f"{sum(times_ms) / len(times_ms):.2f} ms a call, at most {max(times_ms):.1f}", flush=True)


def check_answer(test, answer, question, service):
    where = f"{service}{question.fields}"
    test.assertEqual(answer.content, question.answer.content, where)
    test.assertEqual(len(answer.places), len(question.answer.places), where)
    for place, expected in zip(answer.places, question.answer.places):
        test.assertAlmostEqual(place[0], expected[0], places=9, msg=where)
        test.assertAlmostEqual(place[1], expected[1], places=9, msg=where)

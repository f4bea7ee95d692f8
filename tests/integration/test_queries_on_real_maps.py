"""The answers to queries of recorded maps must equal those of Shapely and NumPy."""

import json
import pathlib
import tempfile
import unittest

import answers
import rpc
from oracle import CELL_VALUES, Oracle, Questions
from processes import QUESTIONS, SEED, Server, real_maps

# Number of queries that are made by the command, which starts a process for each.
BY_COMMAND = max(QUESTIONS // 20, 5)


@unittest.skipUnless(real_maps(), "the recorded maps are missing")
class QueriesOnRealMaps(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.site = cls.enterClassContext(Server(folder / "data"))
        cls.client = cls.enterClassContext(rpc.Client(cls.site.address))
        cls.oracles = {}
        for name, path in real_maps().items():
            cls.site.json("import", path, "--map", name)
            exported = folder / f"{name}.geojson"
            cls.site.json("export", name, "--format", "geojson", "-o", exported)
            cls.oracles[name] = Oracle(path, json.loads(exported.read_text()))

    def setUp(self):
        self.found = []
        self.asked = self.with_content = 0

    def each_map(self, count=QUESTIONS):
        """Yields (map, oracle, questions) `count` times for each map."""
        for name, oracle in self.oracles.items():
            questions = Questions(oracle, f"{SEED} {name}")
            for _ in range(count):
                yield name, oracle, questions

    def compare(self, got, expected, *asked):
        self.asked += 1
        self.with_content += any(answers.has_content(answer) for answer in expected.values())
        self.found += [(*asked, d) for d in answers.differences(got, expected)]

    def tearDown(self):
        self.assertEqual(self.found[:10], [], f"{len(self.found)} differences")
        # Queries without matches prove little. About three in ten have matches. Of only a few dozen
        # queries, all but the first may be without.
        self.assertGreater(self.with_content, 0.1 * self.asked if self.asked >= 100 else 0)
        print(f"{self.asked} questions, {self.with_content} with content ", end="", flush=True)

    def test_points(self):
        for name, oracle, questions in self.each_map():
            x, y = questions.point()
            answer = self.client.QueryPoint(scope=rpc.scope(name), point=rpc.point(x, y))
            got = {layer.layer: point_content(layer) for layer in answer.layers}
            self.compare(got, oracle.at_point(x, y), name, x, y)

    def test_areas(self):
        for name, oracle, questions in self.each_map():
            area = questions.area()
            answer = self.client.QueryArea(scope=rpc.scope(name), area=rpc.polygon(area))
            self.compare(answers.from_messages(answer, oracle.shapes), oracle.content(area),
                         name, area.wkt)

    def test_values_in_areas(self):
        for name, oracle, questions in self.each_map():
            area, value = questions.area(), questions.choice(CELL_VALUES + oracle.labels())
            answer = self.client.QueryValue(scope=rpc.scope(name), value=value,
                                            area=rpc.polygon(area))
            self.compare(answers.from_messages(answer, oracle.shapes),
                         oracle.search(value, area), name, value, area.wkt)

    def test_values_everywhere(self):
        for name, oracle in self.oracles.items():
            for value in CELL_VALUES + oracle.labels() + [l.upper() for l in oracle.labels()]:
                answer = self.client.QueryValue(scope=rpc.scope(name), value=value)
                self.compare(answers.from_messages(answer, oracle.shapes),
                             oracle.search(value, None), name, value)

    def test_points_by_command(self):
        for name, oracle, questions in self.each_map(BY_COMMAND):
            x, y = questions.point()
            answer = self.site.json("query", "point", name, x, y)
            self.assertEqual(answer["point"], [x, y])
            got = {layer["layer"]: json_content(layer) for layer in answer["layers"]}
            self.compare(got, oracle.at_point(x, y), name, x, y)

    def test_areas_by_command(self):
        for name, oracle, questions in self.each_map(BY_COMMAND):
            area = questions.area(holes=False)
            lines = self.site.json_lines("query", "area", name, *corners(area))
            self.compare(answers.from_json_lines(lines, oracle.shapes), oracle.content(area),
                         name, area.wkt)

    def test_values_in_areas_by_command(self):
        for name, oracle, questions in self.each_map(BY_COMMAND):
            area = questions.area(holes=False)
            value = questions.choice(CELL_VALUES + oracle.labels())
            lines = self.site.json_lines("query", "value", name, value, "--area", *corners(area))
            self.compare(answers.from_json_lines(lines, oracle.shapes),
                         oracle.search(value, area), name, value, area.wkt)


def corners(area):
    return [f"{x!r},{y!r}" for x, y in area.exterior.coords[:-1]]


def point_content(layer):
    """Converts a LayerContent to the form of the oracle's answers."""
    word = answers.status_word(layer.status)
    if word != "value":
        return word
    return layer.value if layer.HasField("value") else {o.id for o in layer.objects}


def json_content(layer):
    if layer["status"] != "value":
        return layer["status"]
    return layer["value"] if layer["kind"] != "semantic" else {e["id"] for e in layer["entities"]}


if __name__ == "__main__":
    unittest.main()

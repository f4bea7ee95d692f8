"""Tests of queries, compared with a brute-force search over the same objects and cells."""

from __future__ import annotations

import math
import random
from datetime import datetime, timedelta

import numpy as np
import pytest
import shapely

from hypermap_client import (
    Answer,
    AnswerStatus,
    Client,
    GridGeometry,
    InvalidArgument,
    LayerKind,
    LayerSpec,
    MapObject,
    NotFound,
    OutOfRange,
    Pose,
    PutObject,
    ResourceExhausted,
    WriteCells,
)

LABELS = ("chair", "cup", "sofa")


def random_shape(generator: np.random.Generator) -> shapely.Geometry:
    """A box, a line string of two to five vertices or a point."""
    x, y = generator.uniform(0, 20, 2)
    w, h = generator.uniform(0.2, 3, 2)
    vertices = np.add((x, y), generator.uniform(0, 3, (generator.integers(2, 6), 2)))
    shapes = (shapely.box(x, y, x + w, y + h), shapely.LineString(vertices), shapely.Point(x, y))
    return shapes[generator.integers(3)]


class Model:
    """The content of a map, 300 random shapes and a random rotated grid, as a test oracle."""

    grid = GridGeometry(0.5, Pose(2.0, -1.0, 0.3))

    def __init__(self, client: Client, name: str, seed: int) -> None:
        generator = np.random.default_rng(seed)
        self.seed = seed
        self.name = name
        self.objects = [
            MapObject(str(generator.choice(LABELS)), random_shape(generator)) for _ in range(300)
        ]
        client.create_layer(name, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
        client.create_layer(name, LayerSpec(name="heat", kind=LayerKind.SCALAR, grid=self.grid))
        puts = [PutObject("things", o) for o in self.objects]
        self.ids = client.apply_edits(name, puts).object_ids
        self.values = generator.integers(0, 5, (30, 40)).astype(float)
        self.values[generator.random((30, 40)) < 0.1] = np.nan
        edits = WriteCells("heat", self.values, row_begin=-10, col_begin=-10)
        self.revision = client.apply_edits(name, edits).revision

    def ids_where(self, test: object) -> list[int]:
        return [i for i, o in zip(self.ids, self.objects, strict=True) if test(o)]

    def value_at(self, x: float, y: float) -> tuple[AnswerStatus, float | None]:
        row, col = (i + 10 for i in self.grid.cell_at((x, y)))
        if not (0 <= row < 30 and 0 <= col < 40):
            return AnswerStatus.OUTSIDE, None
        value = self.values[row, col]
        known = not math.isnan(value)
        return (AnswerStatus.VALUE, value) if known else (AnswerStatus.UNKNOWN, None)


@pytest.fixture(scope="module")
def shared_model(server: object) -> Model:
    with Client(server.address) as client:
        client.create_map("model")
        return Model(client, "model", seed=random.randrange(1 << 32))


@pytest.fixture
def model(shared_model: Model) -> Model:
    """The model. pytest shows the printed seed of a test that fails."""
    print(f"seed of the model: {shared_model.seed}")
    return shared_model


def ids_of(answer: Answer) -> list[int]:
    return [o.id for o in answer.objects]


def random_points(n: int) -> np.ndarray:
    seed = random.randrange(1 << 32)
    print(f"seed of {n} points: {seed}")
    return np.random.default_rng(seed).uniform(-5, 25, (n, 2))


@pytest.mark.parametrize("tolerance_m", [0.0, 0.4])
def test_points_in_single_queries_and_in_batches(
    client: Client, model: Model, tolerance_m: float
) -> None:
    points = random_points(100)
    batch = client.query_points(model.name, points, tolerance_m=tolerance_m)
    assert batch.revision == model.revision
    heat, things = batch["heat"], batch["things"]
    for i, (x, y) in enumerate(points):
        one = client.query_point(model.name, (x, y), tolerance_m=tolerance_m)
        assert one.revision == model.revision and one.frame_id == "map"
        at_point = shapely.Point(x, y)
        ids = model.ids_where(lambda o, p=at_point: o.shape.distance(p) <= tolerance_m)
        assert [o.id for o in one["things"].objects] == ids
        assert (one["heat"].status, one["heat"].value) == model.value_at(x, y)

        at = things.points == i
        assert things.object_ids[at].tolist() == ids
        assert things.labels[at].tolist() == [o.label for o in one["things"].objects]
        status, value = model.value_at(x, y)
        assert heat.statuses[i] == status
        np.testing.assert_equal(heat.values[i], np.nan if value is None else value)


def test_lines_and_points_are_met_exactly_at_their_vertices(client: Client, model: Model) -> None:
    for i, o in zip(model.ids, model.objects, strict=True):
        if not isinstance(o.shape, shapely.Polygon):
            x, y = shapely.get_coordinates(o.shape)[0]
            content = client.query_point(model.name, (x, y), layers="things")["things"]
            (met,) = [found for found in content.objects if found.id == i]
            assert met.shape.equals_exact(o.shape)
            near = client.query_point(model.name, (x + 1e-6, y - 1e-6), layers="things")["things"]
            assert i not in [found.id for found in near.objects]


def test_a_stream_of_batches(client: Client, model: Model) -> None:
    batches = [random_points(n) for n in (1, 50, 7)]
    answers = list(
        client.stream_points(model.name, iter(batches), layers="things", tolerance_m=0.3)
    )
    assert len(answers) == 3
    for points, answer in zip(batches, answers, strict=True):
        alone = client.query_points(model.name, points, layers=["things"], tolerance_m=0.3)
        for column in ("points", "object_ids", "labels", "existences"):
            np.testing.assert_array_equal(
                getattr(answer["things"], column), getattr(alone["things"], column)
            )


def test_invalid_batches_are_refused(client: Client, model: Model) -> None:
    with pytest.raises(ValueError, match="shape"):
        client.query_points(model.name, [1.0, 2.0, 3.0])
    by_geometry = client.query_points(model.name, [shapely.Point(1, 2), shapely.Point(3, 4)])
    by_array = client.query_points(model.name, [(1, 2), (3, 4)])
    np.testing.assert_array_equal(by_geometry["heat"].values, by_array["heat"].values)
    with pytest.raises(ValueError, match="at least one"):
        client.query_points(model.name, np.empty((0, 2)))
    with pytest.raises(ResourceExhausted, match="max_points"):
        client.query_points(model.name, np.zeros((65_537, 2)))
    with pytest.raises(NotFound, match="nowhere"):
        next(client.stream_points("nowhere", [[(0, 0)]]))


def test_an_area(client: Client, model: Model) -> None:
    area = shapely.Polygon([(3, 2), (15, 4), (9, 14)], [[(8, 6), (10, 6), (9, 8)]])
    answer = client.query_area(model.name, area)
    assert ids_of(answer) == model.ids_where(lambda o: o.shape.intersects(area))
    rows, cols, values = answer["heat"].cells.cells()
    centres = shapely.points(model.grid.centres(*np.mgrid[-10:20, -10:30]))
    inside = shapely.covers(area, centres)
    assert {(r + 10, c + 10) for r, c in zip(rows, cols, strict=True)} == set(
        zip(*np.nonzero(inside), strict=True)
    )
    np.testing.assert_array_equal(values, model.values[rows + 10, cols + 10])
    grid = answer["heat"].to_grid()
    assert grid.selected.sum() == inside.sum()


def test_a_value_everywhere_and_in_an_area(client: Client, model: Model) -> None:
    answer = client.query_value(model.name, "CUP")
    assert ids_of(answer) == model.ids_where(lambda o: o.label == "cup")
    assert answer["heat"].status == AnswerStatus.UNSUPPORTED_VALUE
    area = shapely.box(5, 5, 9, 9)
    answer = client.query_value(model.name, "cup", area=area, layers="things")
    assert ids_of(answer) == model.ids_where(
        lambda o: o.label == "cup" and o.shape.intersects(area)
    )
    answer = client.query_value(model.name, ">=3")
    assert answer["heat"].cells.num_cells == np.sum(model.values >= 3)
    assert answer["things"].status == AnswerStatus.UNSUPPORTED_VALUE


def test_nearest(client: Client, model: Model) -> None:
    at = shapely.Point(10, 10)
    answer = client.query_nearest(model.name, at, "sofa", k=5)
    sofas = sorted(o.shape.distance(at) for o in model.objects if o.label == "sofa")
    np.testing.assert_allclose([m.distance_m for m in answer.matches], sofas[:5], atol=1e-9)
    assert [r.layer for r in answer.refusals] == ["heat"]
    (match,) = client.query_nearest(model.name, at, "=4").matches
    rows, cols = np.nonzero(model.values == 4)
    distances = np.hypot(*(model.grid.centres(rows - 10, cols - 10) - (10, 10)).T)
    assert match.distance_m == pytest.approx(distances.min())
    assert match.cell.value == 4
    assert match.cell.centre.distance(at) == pytest.approx(match.distance_m)
    assert match.cell.polygon.area == pytest.approx(0.25)


def test_a_whole_grid(client: Client, model: Model) -> None:
    grid = client.read_grid(model.name, "heat")
    np.testing.assert_array_equal(grid.values, model.values)
    assert (grid.row_begin, grid.col_begin, grid.grid) == (-10, -10, model.grid)
    with pytest.raises(ValueError, match="not a grid"):
        client.read_grid(model.name, "things")


def test_queries_as_of_earlier_revisions(client: Client, site: str) -> None:
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    chair = MapObject("chair", shapely.box(0, 0, 1, 1))
    revisions = [client.apply_edits(site, PutObject("things", chair)).revision for _ in range(5)]
    for n, revision in enumerate(revisions, 1):
        answer = client.query_value(site, "chair", as_of=revision)
        assert (answer.revision, len(answer.objects)) == (revision, n)
    # A query as of the time of a commit sees it; one as of a microsecond earlier need not.
    for entry in client.list_revisions(site).revisions:
        assert client.query_point(site, (0, 0), as_of=entry.time).revision >= entry.revision
        earlier = client.query_point(
            site, (0, 0), as_of=entry.time - timedelta(microseconds=1), layers=()
        )
        assert earlier.revision <= entry.revision
    with pytest.raises(OutOfRange, match=str(revisions[-1])):
        client.query_point(site, (0, 0), as_of=revisions[-1] + 1)
    with pytest.raises(ValueError, match="time zone"):
        client.query_point(site, (0, 0), as_of=datetime.now())


def test_connected_and_unconnected_frames(client: Client, site: str) -> None:
    client.set_transform(site, "map", "dock", Pose(10, 0, math.pi / 2))
    client.set_transform(site, "island", "tree", Pose(1, 1, 0))
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    client.apply_edits(site, PutObject("things", MapObject("chair", shapely.box(0, 0, 1, 1))))
    (found,) = client.query_point(site, (0.5, 9.5), frame_id="dock")["things"].objects
    assert found.label == "chair"
    lost = client.query_point(site, (0, 0), frame_id="tree")["things"]
    assert lost.status == AnswerStatus.NO_TRANSFORM
    with pytest.raises(NotFound, match="moon"):
        client.query_point(site, (0, 0), frame_id="moon")


def test_invalid_queries_are_refused(client: Client, model: Model) -> None:
    with pytest.raises(InvalidArgument):
        client.query_point(model.name, (math.nan, 0))
    for tolerance_m in (-0.1, math.nan, math.inf):
        with pytest.raises(InvalidArgument, match="tolerance_m"):
            client.query_point(model.name, (0, 0), tolerance_m=tolerance_m)
        with pytest.raises(InvalidArgument, match="tolerance_m"):
            client.query_points(model.name, [(0, 0)], tolerance_m=tolerance_m)
    with pytest.raises(ValueError, match="x and y"):
        client.query_point(model.name, (1, 2, 3))
    with pytest.raises(InvalidArgument, match="area"):
        client.query_area(model.name, [(0, 0), (1, 1), (1, 0), (0, 1)])
    with pytest.raises(TypeError, match="Polygon"):
        client.query_area(model.name, shapely.Point(0, 0))
    with pytest.raises(KeyError):
        client.query_point(model.name, (0, 0), layers="things")["heat"]

"""Tests of conversions to messages and back: shapes, layers, edits, requests."""

from __future__ import annotations

import copy
import pickle
import random
from datetime import datetime, timedelta, timezone
from typing import Any

import numpy as np
import pytest
import shapely
from scripted_server import scripted_server

from hypermap_client import (
    Client,
    Consistency,
    CreateLayer,
    DeleteLayer,
    GridGeometry,
    Internal,
    Layer,
    LayerKind,
    LayerProperties,
    LayerSpec,
    MapObject,
    OccupancyThresholds,
    Pose,
    SetTransform,
    ShapeKind,
    _rpc,
)
from hypermap_client._proto import catalog_service_pb2 as catalog
from hypermap_client._proto import geometry_pb2 as geometry
from hypermap_client._proto import layer_pb2
from hypermap_client._proto import query_service_pb2 as query
from hypermap_client._proto import watch_service_pb2 as watch
from hypermap_client._requests import make_as_of, make_scope
from hypermap_client._wire.edits import encode_edit
from hypermap_client._wire.geometry import (
    decode_polygon,
    decode_shape,
    encode_polygon,
    encode_shape,
)
from hypermap_client._wire.layers import decode_layer, encode_layer
from hypermap_client._wire.objects import decode_object, encode_object

DOCK = shapely.Point(3.5, -1.25)
LANE = shapely.LineString([(0, 0), (4, 0), (4, 2)])
ROOM = shapely.Polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (1, 3), (3, 3), (3, 1)]])


def test_rings_are_columns_without_the_repeated_vertex() -> None:
    message = encode_polygon(ROOM)
    assert (list(message.outer.xs), list(message.outer.ys)) == ([0, 4, 4, 0], [0, 0, 4, 4])
    (hole,) = message.holes
    assert (list(hole.xs), list(hole.ys)) == ([1, 1, 3, 3], [1, 3, 3, 1])
    assert encode_polygon([(0, 0), (1, 0), (1, 1)]).outer == geometry.Ring(
        xs=[0, 1, 1], ys=[0, 0, 1]
    )
    assert decode_polygon(geometry.Polygon()).is_empty


def test_each_kind_of_shape_has_its_message() -> None:
    assert encode_shape(ROOM).WhichOneof("shape") == "polygon"
    assert encode_shape(DOCK).point == geometry.Point(x=3.5, y=-1.25)
    assert encode_shape(LANE).line_string == geometry.LineString(xs=[0, 4, 4], ys=[0, 0, 2])
    # A closed line string keeps its last vertex, and a ring is one.
    ring = shapely.LinearRing([(0, 0), (1, 0), (1, 1)])
    assert list(encode_shape(ring).line_string.xs) == [0, 1, 1, 0]
    assert encode_shape(shapely.Point(1, 2, 3)).point == geometry.Point(x=1, y=2)


def test_random_shapes_round_trip() -> None:
    seed = random.randrange(1 << 32)
    generator = np.random.default_rng(seed)
    for _ in range(100):
        vertices = generator.uniform(-1e3, 1e3, (generator.integers(2, 40), 2))
        centre = shapely.Point(vertices[0])
        shapes = (
            centre,
            shapely.LineString(vertices),
            centre.buffer(generator.uniform(1, 9), quad_segs=int(generator.integers(1, 9))),
            centre.buffer(2.0).difference(centre.buffer(1.0)),
        )
        for shape in shapes:
            message = geometry.Shape.FromString(encode_shape(shape).SerializeToString())
            assert decode_shape(message).equals_exact(shape), f"seed {seed}"


def test_an_object_keeps_its_shape() -> None:
    for shape in (ROOM, LANE, DOCK):
        found = decode_object(encode_object(MapObject("thing", shape, id=7)))
        assert found.shape.equals_exact(shape) and found.id == 7
    assert MapObject("lane", LANE).centroid.distance(LANE.centroid) == 0
    assert MapObject("dock", DOCK).centroid == DOCK
    assert MapObject("room", ROOM).polygon is ROOM
    with pytest.raises(TypeError, match=r"object 7 \('lane'\) is a LineString.*`shape`"):
        _ = MapObject("lane", LANE, id=7).polygon


@pytest.mark.parametrize(
    "shape",
    [
        shapely.MultiPolygon([ROOM, shapely.box(9, 9, 10, 10)]),
        shapely.MultiLineString([LANE]),
        shapely.MultiPoint([(0, 0), (1, 1)]),
        shapely.GeometryCollection([ROOM, DOCK]),
    ],
    ids=lambda shape: shape.geom_type,
)
def test_geometries_of_several_parts_are_refused(shape: shapely.Geometry) -> None:
    with pytest.raises(ValueError, match=rf"{shape.geom_type} is not one shape.*explode\(\)"):
        MapObject("thing", shape)
    # The parts that the message recommends are accepted.
    assert all(MapObject("thing", part).shape is part for part in shapely.get_parts(shape))


def test_values_that_are_not_shapes_are_refused() -> None:
    for empty in (shapely.Polygon(), shapely.LineString(), shapely.Point()):
        with pytest.raises(ValueError, match=f"empty {empty.geom_type}"):
            MapObject("thing", empty)
    for other in (None, (1.0, 2.0), [(0, 0), (1, 0), (1, 1)], "POINT (0 0)"):
        with pytest.raises(TypeError, match="Polygon, LineString or Point"):
            MapObject("thing", other)


def test_an_unknown_kind_of_shape_in_a_response_is_an_internal_error() -> None:
    with pytest.raises(Internal, match="shape"):
        decode_shape(geometry.Shape())


def test_scopes() -> None:
    scope = make_scope("office", ("floor", "things"), "dock")
    assert (scope.map, list(scope.layers), scope.frame_id) == (
        "office",
        ["floor", "things"],
        "dock",
    )
    assert list(make_scope("office", "floor", "").layers) == ["floor"]
    assert not make_scope("office", (), "").layers


def test_revisions_and_times_to_query() -> None:
    newest = make_as_of(None, 0)
    assert newest.WhichOneof("as_of") is None and newest.min_revision == 0
    revision = make_as_of(0, 5)
    assert revision.WhichOneof("as_of") == "at_revision"
    assert (revision.at_revision, revision.min_revision) == (0, 5)
    assert newest.consistency == revision.consistency == 0
    assert make_as_of(None, 0, Consistency.LINEARIZABLE).consistency == Consistency.LINEARIZABLE
    noon = datetime(2024, 5, 1, 14, 0, 0, 250_000, tzinfo=timezone(timedelta(hours=2)))
    assert make_as_of(noon, 0).at_time.ToJsonString() == "2024-05-01T12:00:00.250Z"
    with pytest.raises(ValueError, match="time zone"):
        make_as_of(datetime(2024, 5, 1), 0)


def test_requests_have_their_scope() -> None:
    requests: dict[str, Any] = {}

    def answer(response: Any) -> Any:
        def take(request: Any, _metadata: dict[str, str]) -> Any:
            requests[type(request).__name__] = request
            return response

        return take

    part = query.LayerPart(layer="floor", kind=1, status=1)
    answers = {
        _rpc.QUERY_POINT: answer(query.QueryPointResponse()),
        _rpc.QUERY_AREA: answer([query.QueryAreaResponse(revision=4, part=part)]),
        _rpc.QUERY_VALUE: answer([query.QueryValueResponse(revision=4)]),
        _rpc.QUERY_NEAREST: answer(query.QueryNearestResponse()),
        _rpc.LIST_CHANGES: answer([watch.ListChangesResponse(to_revision=4)]),
        _rpc.WATCH: answer([watch.WatchResponse(revision=4)]),
    }
    scope = {"layers": "floor", "frame_id": "dock"}
    past = {"as_of": 3, "min_revision": 2, "consistency": Consistency.LINEARIZABLE}
    with scripted_server(answers) as address, Client(address) as client:
        client.query_point("office", (1, 2), tolerance_m=0.25, **scope, **past)
        assert client.query_area("office", ROOM, **scope, **past)["floor"].layer == "floor"
        client.query_value("office", "chair", **scope, **past)
        client.query_nearest("office", (1, 2), "chair", **scope, **past)
        client.list_changes("office", 1, **scope)
        with client.watch("office", **scope, start_revision=1) as events:
            assert next(events).revision == 4
    assert len(requests) == 6
    for name, request in requests.items():
        assert request.scope == make_scope("office", "floor", "dock"), name
        if name.startswith("Query"):
            assert request.as_of == make_as_of(3, 2, Consistency.LINEARIZABLE), name
    assert requests["QueryPointRequest"].tolerance_m == 0.25
    assert requests["WatchRequest"].start_revision == 1
    assert not requests["ListChangesRequest"].HasField("to_revision")


LAYER = Layer(
    name="lanes",
    kind=LayerKind.SEMANTIC,
    frame_id="hall",
    aliases={"way": ("lane", "aisle")},
    shape_kinds=(ShapeKind.LINE_STRING, ShapeKind.POINT),
    size=3,
    version=9,
    properties=LayerProperties(has_shapes=True),
)


def test_edits_of_layers_and_transforms() -> None:
    message = encode_edit(CreateLayer(LAYER)).create_layer
    assert message.layer == encode_layer(LAYER)
    # The parameters of an existing layer make another one; what the server reports is left out.
    assert message.layer.size == message.layer.version == 0
    assert not message.layer.HasField("properties")
    assert list(message.layer.shape_kinds) == [2, 3]
    assert encode_edit(DeleteLayer("lanes")).delete_layer.layer == "lanes"
    transform = encode_edit(SetTransform("map", "hall", Pose(1, 2, 0.5))).set_transform.transform
    assert (transform.parent_frame_id, transform.child_frame_id) == ("map", "hall")
    assert transform.parent_from_child == geometry.Pose(x=1, y=2, yaw=0.5)
    with pytest.raises(TypeError, match="not an edit: LayerSpec"):
        encode_edit(LayerSpec(name="lanes", kind=LayerKind.SEMANTIC))


def test_layers_and_their_properties() -> None:
    message = encode_layer(LAYER)
    message.size, message.version = 3, 9
    message.properties.has_shapes = True
    assert decode_layer(message) == LAYER

    grid = layer_pb2.Layer(name="wifi", kind=4)
    grid.properties.has_cells = True
    grid.properties.unit = "dBm"
    assert decode_layer(grid).properties == LayerProperties(has_cells=True, unit="dBm")
    # A range from 0 to 0 differs from no range.
    grid.properties.value_range.SetInParent()
    assert decode_layer(grid).properties.value_range == (0, 0)
    grid.properties.value_range.max = 1
    grid.properties.is_binary = True
    grid.properties.words.extend(["free", "occupied"])
    properties = decode_layer(grid).properties
    assert (properties.value_range, properties.is_binary) == ((0, 1), True)
    assert properties.words == ("free", "occupied")
    grid.properties.words_of_values.add(word="explored", value=1)
    assert decode_layer(grid).properties.words_of_values == (("explored", 1.0),)


def test_an_unknown_kind_of_layer_keeps_its_number() -> None:
    kind = LayerKind(99)
    assert isinstance(kind, LayerKind) and kind == 99 == int(kind)
    assert (kind.name, str(kind.name), kind == LayerKind(99)) == ("KIND_99", "KIND_99", True)
    assert len({kind, LayerKind(99), LayerKind(98)}) == 2
    assert pickle.loads(pickle.dumps(kind)) == copy.deepcopy(kind) == kind
    assert len(LayerKind) == 4 and LayerKind(4) is LayerKind.SCALAR
    for value in (0, -1, "SCALAR", None):
        with pytest.raises(ValueError, match="is not a valid LayerKind"):
            LayerKind(value)


def test_a_grid_of_an_unknown_kind_is_read_by_its_properties() -> None:
    layer = encode_layer(LayerSpec(name="slope", kind=LayerKind(99), grid=GridGeometry(0.5)))
    layer.frame_id = "map"
    layer.properties.has_cells = True
    layer.extent.row_end, layer.extent.col_end = 2, 3
    cells = query.CellRuns(
        grid=layer.grid, rows=[0, 1], col_begins=[0, 1], col_ends=[3, 2], values=[0.25, 0.5]
    )
    part = query.LayerPart(layer="slope", kind=99, status=1, cells=cells)
    areas = []

    def query_area(request: Any, _metadata: dict[str, str]) -> Any:
        areas.append(decode_polygon(request.area))
        return [query.QueryAreaResponse(revision=1, part=part)]

    answers = {
        _rpc.GET_LAYER: lambda *_: catalog.GetLayerResponse(layer=layer),
        _rpc.QUERY_AREA: query_area,
    }
    with scripted_server(answers) as address, Client(address) as client:
        assert client.get_layer("site", "slope").kind.name == "KIND_99"
        grid = client.read_grid("site", "slope")
        np.testing.assert_array_equal(grid.values, [[0.25] * 3, [np.nan, 0.5, np.nan]])
        assert areas[0].equals(shapely.box(0, 0, 1.5, 1))
        layer.ClearField("extent")
        with pytest.raises(ValueError, match="no cells yet"):
            client.read_grid("site", "slope")
        layer.properties.has_cells = False
        with pytest.raises(ValueError, match="not a grid"):
            client.read_grid("site", "slope")


def test_thresholds_of_a_layer_to_create() -> None:
    spec = LayerSpec(
        name="floor",
        kind=LayerKind.OCCUPANCY,
        grid=GridGeometry(0.05, Pose(1, 2, 0.5)),
        thresholds=OccupancyThresholds(free_below=0.1),
    )
    message = encode_edit(CreateLayer(spec)).create_layer.layer
    assert message.thresholds.HasField("free_below")
    assert not message.thresholds.HasField("occupied_above")
    assert decode_layer(message).thresholds == OccupancyThresholds(0.1, None)

"""Tests of edits."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
import shapely

from hypermap_client import (
    Aborted,
    AlreadyExists,
    CellRule,
    Client,
    CreateLayer,
    DeleteLayer,
    DeleteObject,
    FillPolygon,
    GridGeometry,
    HeightRange,
    InvalidArgument,
    LayerKind,
    LayerSpec,
    MapObject,
    NotFound,
    Pose,
    PutObject,
    SetAliases,
    SetTransform,
    ShapeKind,
    Transform,
    WriteCells,
    new_request_id,
)

CHAIR = MapObject("chair", shapely.box(0, 0, 1, 1))


@pytest.fixture
def things(client: Client, site: str) -> str:
    """A map with a semantic layer "things" and a scalar one "heat"."""
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    client.create_layer(site, LayerSpec(name="heat", kind=LayerKind.SCALAR, grid=GridGeometry(1.0)))
    return site


def test_all_fields_of_an_object_round_trip(client: Client, things: str) -> None:
    ring = shapely.Polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (1, 3), (3, 3), (3, 1)]])
    put = MapObject(
        "table",
        ring,
        classes={"table": 0.75, "desk": 0.25},
        existence=0.5,
        height=HeightRange(0.5, 0.75),
        tags=("wood", "big"),
        attributes={"legs": 4, "fixed": True, "mass_kg": 12.5, "owner": "Ada"},
    )
    answer = client.apply_edits(things, PutObject("things", put))
    (found,) = client.query_point(things, (0.5, 0.5))["things"].objects
    assert found.id == answer.object_ids[0] > 0
    assert found.version == answer.revision
    assert found.polygon.equals(ring) and len(found.polygon.interiors) == 1
    assert found.classes == put.classes and found.existence == 0.5
    assert found.height == put.height and found.tags == put.tags
    assert found.attributes == put.attributes
    assert isinstance(found.attributes["fixed"], bool)
    assert isinstance(found.attributes["mass_kg"], float)
    assert found.centroid.equals(shapely.Point(2, 2)) and found.expire_time is None
    # A point in the hole is not covered.
    assert client.query_point(things, (2, 2))["things"].objects == ()


def test_each_kind_of_shape_round_trips(client: Client, things: str) -> None:
    shapes = {
        "room": shapely.box(0, 0, 4, 3),
        "lane": shapely.LineString([(0, 1), (2, 1), (2, 0), (0, 2)]),
        "loop": shapely.LinearRing([(0, 0), (1, 0), (1, 1)]),
        "dock": shapely.Point(3.25, -1),
    }
    answer = client.apply_edits(
        things, [PutObject("things", MapObject(label, shape)) for label, shape in shapes.items()]
    )
    found = client.query_area(things, shapely.box(-9, -9, 9, 9), layers="things").objects
    assert [o.id for o in found] == list(answer.object_ids)
    for o in found:
        assert o.shape.equals(shapes[o.label])
        assert o.shape.geom_type == shapes[o.label].geom_type.replace("LinearRing", "LineString")
        assert o.centroid.equals(shapes[o.label].centroid)


def test_a_map_is_made_in_one_revision(client: Client, site: str) -> None:
    before = client.get_map(site).revision
    hall = Pose(10, 0, np.pi / 2)
    edits = [
        SetTransform("map", "hall", hall),
        CreateLayer(LayerSpec(name="floor", kind=LayerKind.OCCUPANCY, grid=GridGeometry(0.5))),
        CreateLayer(
            LayerSpec(
                name="docks",
                kind=LayerKind.SEMANTIC,
                frame_id="hall",
                shape_kinds=(ShapeKind.POINT,),
            )
        ),
        WriteCells("floor", np.zeros((4, 4))),
        PutObject("docks", MapObject("dock", shapely.Point(1, 2))),
        SetAliases("docks", {"charger": ["dock"]}),
    ]
    answer = client.apply_edits(site, edits)
    assert answer.revision == client.get_map(site).revision == before + 1
    assert [i > 0 for i in answer.object_ids] == [False] * 4 + [True, False]
    assert client.list_transforms(site).transforms == (Transform("map", "hall", hall),)
    assert client.read_grid(site, "floor").values.shape == (4, 4)
    docks = client.get_layer(site, "docks")
    assert (docks.frame_id, docks.shape_kinds) == ("hall", (ShapeKind.POINT,))
    (dock,) = client.query_value(site, "charger").objects
    assert dock.shape.distance(shapely.Point(hall.apply((1, 2)))) < 1e-9
    with pytest.raises(NotFound):
        client.query_value(site, "charger", as_of=before, layers="docks")

    # A layer is replaced by one of the same name, and moved, in one revision too.
    answer = client.apply_edits(
        site, [DeleteLayer("docks"), CreateLayer(docks), SetTransform("map", "hall", Pose())]
    )
    assert answer.revision == before + 2
    assert client.get_layer(site, "docks").size == 0
    assert client.list_transforms(site).transforms == (Transform("map", "hall", Pose()),)


def test_a_batch_with_an_invalid_edit_of_a_layer_changes_nothing(
    client: Client, things: str
) -> None:
    before = client.list_layers(things)
    new = CreateLayer(LayerSpec(name="new", kind=LayerKind.SEMANTIC))
    for error, last in (
        (AlreadyExists, CreateLayer(LayerSpec(name="things", kind=LayerKind.SEMANTIC))),
        (NotFound, DeleteLayer("nothing")),
        (InvalidArgument, SetTransform("map", "map", Pose())),
        (InvalidArgument, CreateLayer(LayerSpec(name="grid", kind=LayerKind.SCALAR))),
    ):
        with pytest.raises(error, match=r"edits\[1\]"):
            client.apply_edits(things, [new, last])
    assert client.list_layers(things) == before


def test_a_layer_takes_the_kinds_of_shape_that_it_names(client: Client, site: str) -> None:
    spec = LayerSpec(
        name="lanes",
        kind=LayerKind.SEMANTIC,
        shape_kinds=(ShapeKind.LINE_STRING, ShapeKind.POINT),
    )
    assert client.create_layer(site, spec).shape_kinds == spec.shape_kinds
    lane = MapObject("lane", shapely.LineString([(0, 0), (5, 0)]))
    client.apply_edits(
        site, [PutObject("lanes", lane), PutObject("lanes", MapObject("stop", shapely.Point(5, 0)))]
    )
    with pytest.raises(InvalidArgument, match=r"edits\[0\]"):
        client.apply_edits(site, PutObject("lanes", CHAIR))
    assert client.get_layer(site, "lanes").size == 2


def test_a_batch_is_atomic(client: Client, things: str) -> None:
    before = client.get_map(things).revision
    with pytest.raises(InvalidArgument, match=r"edits\[1\]"):
        bow = MapObject("bow", shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]))
        client.apply_edits(things, [PutObject("things", CHAIR), PutObject("things", bow)])
    assert client.get_map(things).revision == before
    answer = client.apply_edits(
        things,
        [PutObject("things", CHAIR), WriteCells("heat", [[1.0]]), PutObject("things", CHAIR)],
    )
    assert answer.revision == before + 1
    first, none, second = answer.object_ids
    assert none == 0 and first != second


def test_a_stale_version_aborts(client: Client, things: str) -> None:
    answer = client.apply_edits(things, PutObject("things", CHAIR))
    (object_id,) = answer.object_ids
    sofa = MapObject("sofa", CHAIR.polygon, id=object_id)
    client.apply_edits(things, PutObject("things", sofa, if_version=answer.revision))
    with pytest.raises(Aborted):
        client.apply_edits(things, PutObject("things", sofa, if_version=answer.revision))
    with pytest.raises(Aborted):
        client.apply_edits(things, DeleteObject("things", object_id, if_version=answer.revision))
    with pytest.raises(Aborted):
        client.apply_edits(
            things, PutObject("things", CHAIR), if_layers={"things": answer.revision}
        )
    client.apply_edits(things, DeleteObject("things", object_id))
    with pytest.raises(NotFound):
        client.apply_edits(things, DeleteObject("things", object_id))


def test_a_request_id_is_carried_out_once(client: Client, things: str) -> None:
    request_id = new_request_id()
    first = client.apply_edits(things, PutObject("things", CHAIR), request_id=request_id)
    assert client.apply_edits(things, PutObject("things", CHAIR), request_id=request_id) == first
    assert client.apply_edits(things, PutObject("things", CHAIR)) != first
    assert client.get_layer(things, "things").size == 2


def test_cells_and_fills(client: Client, things: str) -> None:
    values = np.arange(12.0).reshape(3, 4)
    client.apply_edits(things, WriteCells("heat", values, row_begin=-1, col_begin=5))
    client.apply_edits(
        things,
        [
            FillPolygon("heat", shapely.box(5.4, -0.6, 6.6, 0.6), -7.0),
            FillPolygon("heat", [(8.9, 1.9), (8.9, 1.1), (8.1, 1.5)], None, rule=CellRule.TOUCHED),
        ],
    )
    grid = client.read_grid(things, "heat")
    assert (grid.row_begin, grid.col_begin) == (-1, 5)
    # The box covers the centres of columns 5 and 6 and rows -1 and 0.
    values[0:2, 0:2] = -7.0
    values[2, 3] = np.nan
    np.testing.assert_array_equal(grid.values, values)
    assert grid.selected.all()
    assert grid.value_at((7.5, 0.5)) == 6.0
    assert np.isnan(grid.value_at((8.5, 1.5))) and np.isnan(grid.value_at((100, 0)))


def test_an_object_in_another_frame(client: Client, things: str) -> None:
    client.set_transform(things, "map", "dock", Pose(10, 0, np.pi / 2))
    client.apply_edits(things, PutObject("things", CHAIR, frame_id="dock"))
    (found,) = client.query_value(things, "chair").objects
    assert found.polygon.symmetric_difference(shapely.box(9, 0, 10, 1)).area < 1e-9
    (found,) = client.query_value(things, "chair", frame_id="dock").objects
    assert found.polygon.symmetric_difference(CHAIR.polygon).area < 1e-9


def test_aliases(client: Client, things: str) -> None:
    client.apply_edits(
        things, [PutObject("things", CHAIR), SetAliases("things", {"seat": ["chair", "sofa"]})]
    )
    assert [o.label for o in client.query_value(things, "Seat").objects] == ["chair"]
    client.apply_edits(things, SetAliases("things", {"seat": []}))
    assert client.query_value(things, "seat").objects == ()
    with pytest.raises(TypeError, match="list"):
        client.apply_edits(things, SetAliases("things", {"seat": "chair"}))


def test_an_object_expires_after_its_time_to_live(client: Client, things: str) -> None:
    client.apply_edits(things, PutObject("things", CHAIR, time_to_live=timedelta(milliseconds=1)))
    with client.watch(things, layers="things", timeout=60) as watch:
        for event in watch:
            if not any(change.object for change in event.changes):
                break
    assert client.query_value(things, "chair").objects == ()
    answer = client.apply_edits(
        things, PutObject("things", CHAIR, time_to_live=timedelta(hours=1, microseconds=5))
    )
    (found,) = client.query_value(things, "chair", min_revision=answer.revision).objects
    ahead = found.expire_time - datetime.now(timezone.utc)
    assert timedelta(minutes=50) < ahead <= timedelta(hours=1, seconds=1)


def test_invalid_edits_are_refused(client: Client, things: str) -> None:
    with pytest.raises(TypeError, match="not an edit"):
        client.apply_edits(things, ["chair"])
    with pytest.raises(TypeError, match="attribute"):
        bad = MapObject("chair", CHAIR.polygon, attributes={"at": [1]})
        client.apply_edits(things, PutObject("things", bad))
    with pytest.raises(ValueError, match="2-D"):
        WriteCells("heat", [1.0, 2.0])
    with pytest.raises(InvalidArgument):
        client.apply_edits(things, [])

"""Tests of maps, layers, transforms, interchange files and backups."""

from __future__ import annotations

import math
import pathlib
import sqlite3
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
import shapely
from server import OFFICE

from hypermap_client import (
    AlreadyExists,
    CellRule,
    Client,
    FileFormat,
    GridGeometry,
    InvalidArgument,
    LayerKind,
    LayerSpec,
    MapObject,
    NamedFile,
    NotFound,
    OccupancyThresholds,
    Pose,
    PutObject,
    ShapeKind,
    Transform,
    WriteCells,
)


def test_the_life_cycle_of_a_map(client: Client) -> None:
    made = client.create_map("life", frame_id="hall")
    assert (made.name, made.frame_id, made.layer_count, made.problem) == ("life", "hall", 0, "")
    assert abs(datetime.now(timezone.utc) - made.create_time) < timedelta(minutes=5)
    assert client.get_map("life") == made
    assert made in client.list_maps()
    with pytest.raises(AlreadyExists, match="life"):
        client.create_map("life")
    client.delete_map("life")
    with pytest.raises(NotFound, match="life"):
        client.get_map("life")


def test_layers_of_all_kinds_round_trip(client: Client, site: str) -> None:
    specs = [
        LayerSpec(
            name="floor",
            kind=LayerKind.OCCUPANCY,
            grid=GridGeometry(0.05, Pose(1, -2, 0.5)),
            thresholds=OccupancyThresholds(0.1, 0.9),
        ),
        LayerSpec(
            name="seen",
            kind=LayerKind.EXPLORATION,
            grid=GridGeometry(0.1),
            explored_rule=CellRule.TOUCHED,
        ),
        LayerSpec(
            name="things",
            kind=LayerKind.SEMANTIC,
            frame_id="dock",
            aliases={"furniture": ("chair", "table")},
            shape_kinds=(ShapeKind.POLYGON, ShapeKind.POINT),
        ),
        LayerSpec(name="wifi", kind=LayerKind.SCALAR, grid=GridGeometry(0.25), unit="dBm"),
    ]
    client.set_transform(site, "map", "dock", Pose(20, 0, 1.75))
    for spec in specs:
        made = client.create_layer(site, spec)
        assert made == client.get_layer(site, spec.name)
    layers = client.list_layers(site)
    assert [layer.name for layer in layers.layers] == ["floor", "seen", "things", "wifi"]
    assert layers["floor"].grid == GridGeometry(0.05, Pose(1, -2, 0.5))
    assert layers["floor"].thresholds == OccupancyThresholds(0.1, 0.9)
    assert layers["seen"].explored_rule == CellRule.TOUCHED
    assert layers["things"].aliases == {"furniture": ("chair", "table")}
    assert layers["things"].frame_id == "dock"
    assert (layers["wifi"].unit, layers["wifi"].kind) == ("dBm", LayerKind.SCALAR)
    assert layers["things"].shape_kinds == (ShapeKind.POLYGON, ShapeKind.POINT)
    properties = {layer.name: layer.properties for layer in layers.layers}
    assert [name for name, p in properties.items() if p.has_cells] == ["floor", "seen", "wifi"]
    assert [name for name, p in properties.items() if p.has_shapes] == ["things"]
    assert properties["floor"].value_range == properties["seen"].value_range == (0.0, 1.0)
    assert [properties[name].is_binary for name in ("floor", "seen")] == [False, True]
    assert (properties["wifi"].unit, properties["wifi"].value_range) == ("dBm", None)
    assert {"free", "occupied"} <= set(properties["floor"].words)
    assert dict(properties["seen"].words_of_values) == {"explored": 1.0, "unexplored": 0.0}
    with pytest.raises(KeyError):
        layers["cellar"]
    assert client.delete_layer(site, "wifi") == layers.revision + 1
    with pytest.raises(NotFound, match="wifi"):
        client.get_layer(site, "wifi")


def test_transforms(client: Client, site: str) -> None:
    client.set_transform(site, "map", "dock", Pose(20, 0, math.pi / 2))
    client.set_transform(site, "dock", "shelf", Pose(1, 2, 0))
    frames = client.list_transforms(site)
    assert frames.frame_id == "map"
    assert frames.transforms == (
        Transform("map", "dock", Pose(20, 0, math.pi / 2)),
        Transform("dock", "shelf", Pose(1, 2, 0)),
    )
    with pytest.raises(InvalidArgument):
        client.set_transform(site, "shelf", "dock", Pose())


def test_geojson_import_and_export(client: Client, site: str) -> None:
    path = OFFICE / "objects.geojson"
    answer = client.import_map(site, path, layer="objects")
    assert answer.layers == ("objects",)
    out = client.export_map(site, FileFormat.GEOJSON, layers="objects")
    assert out.revision == answer.revision
    (file,) = out.files
    again = client.import_map(site, file, format=FileFormat.GEOJSON, layer="again")
    assert again.revision == answer.revision + 1
    assert again.repairs  # The ids of the objects are in use, so the import gives new ones.
    before, after = (client.get_layer(site, name).size for name in ("objects", "again"))
    assert before == after > 10


def test_nav2_and_hmap_preserve_cells(client: Client, site: str, tmp_path: pathlib.Path) -> None:
    client.create_layer(
        site, LayerSpec(name="floor", kind=LayerKind.OCCUPANCY, grid=GridGeometry(0.5))
    )
    values = np.array([[0.0, 1.0, np.nan], [1.0, 0.0, 0.0]])
    client.apply_edits(site, WriteCells("floor", values))
    nav2 = client.export_map(site, FileFormat.NAV2, image_format="png")
    client.import_map(f"{site}-nav2", nav2.save(tmp_path))
    read = client.read_grid(f"{site}-nav2", "occupancy")
    np.testing.assert_array_equal(np.round(read.values), values)

    (hmap,) = client.export_map(site, FileFormat.HMAP).files
    client.import_map(f"{site}-hmap", NamedFile("some.hmap", hmap.data))
    read = client.read_grid(f"{site}-hmap", "floor")
    np.testing.assert_array_equal(np.round(read.values), values)


def test_a_failed_import_reports_the_reason(client: Client, site: str) -> None:
    with pytest.raises(InvalidArgument):
        client.import_map(site, NamedFile("x.geojson", b"{"), layer="x")
    with pytest.raises(ValueError, match="format"):
        client.import_map(site, NamedFile("x.bin", b""))
    with pytest.raises(FileNotFoundError):
        client.import_map(site, "/nowhere/x.hmap")
    with pytest.raises(NotFound):
        client.import_map("nowhere", NamedFile("x.geojson", b"{}"), layer="x", create_map=False)


def test_a_backup_is_a_geopackage(client: Client, site: str, tmp_path: pathlib.Path) -> None:
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    client.apply_edits(site, PutObject("things", MapObject("chair", shapely.box(0, 0, 1, 1))))
    path = tmp_path / "copy.gpkg"
    size = client.backup_map(site, path)
    assert path.stat().st_size == size == len(b"".join(client.iter_backup(site)))
    database = sqlite3.connect(path)
    tables = {row[0] for row in database.execute("SELECT table_name FROM gpkg_contents")}
    database.close()
    assert "things" in tables


def test_a_failed_backup_keeps_the_earlier_file(client: Client, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "copy.gpkg"
    path.write_bytes(b"earlier")
    with pytest.raises(NotFound):
        client.backup_map("nowhere", path)
    assert path.read_bytes() == b"earlier"
    assert list(tmp_path.iterdir()) == [path]

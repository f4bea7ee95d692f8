"""Tests of maps, layers, transforms, interchange files, backups and checks."""

from __future__ import annotations

import math
import pathlib
import sqlite3
from datetime import datetime, timedelta, timezone
from typing import Any

import grpc
import numpy as np
import pytest
import shapely
from scripted_server import scripted_server
from server import OFFICE

from hypermap_client import (
    Aborted,
    AlreadyExists,
    CellRule,
    CheckReport,
    Client,
    FailedPrecondition,
    FileFormat,
    Finding,
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
    _rpc,
)
from hypermap_client._proto import catalog_service_pb2 as pb


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


def test_a_backup_becomes_a_map_again(client: Client, site: str, tmp_path: pathlib.Path) -> None:
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    path = tmp_path / "copy.gpkg"
    client.backup_map(site, path)
    client.delete_layer(site, "things")
    before = client.get_map(site)

    with pytest.raises(AlreadyExists, match=site):
        client.restore_map(site, path)
    with pytest.raises(Aborted, match=site):
        client.restore_map(site, path, replace=True, incarnation=before.incarnation ^ 1)
    assert client.get_map(site) == before

    restored = client.restore_map(site, path, replace=True, request_id=f"restore {site}")
    assert restored == client.get_map(site)
    assert (restored.name, restored.layer_count) == (site, 1)
    assert restored.incarnation != before.incarnation
    # A repetition with the same id changes nothing.
    again = client.restore_map(site, path, replace=True, request_id=f"restore {site}")
    assert again.incarnation == restored.incarnation

    copy = client.restore_map(f"{site}-copy", path)
    assert (copy.name, copy.revision) == (f"{site}-copy", restored.revision)


def test_a_file_that_is_not_a_map_is_not_restored(client: Client, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "some.gpkg"
    path.write_bytes(b"not a database" * 1000)
    with pytest.raises(FailedPrecondition):
        client.restore_map("some", path)
    with pytest.raises(FileNotFoundError):
        client.restore_map("some", tmp_path / "missing.gpkg")
    # Opens, but cannot be read.
    with pytest.raises(OSError, match="Input/output error"):
        client.restore_map("some", "/proc/self/mem")
    with pytest.raises(NotFound):
        client.get_map("some")


def test_each_attempt_to_restore_sends_the_whole_file(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "big.gpkg"
    path.write_bytes(bytes(range(256)) * 10_000)  # three chunks
    uploads = []

    def answer(requests: list[pb.RestoreMapRequest], _metadata: dict[str, str]) -> Any:
        uploads.append(requests)
        if len(uploads) < 3:
            return grpc.StatusCode.UNAVAILABLE
        return pb.RestoreMapResponse(map=pb.Map(name="big", incarnation=2**64 - 1))

    with scripted_server({_rpc.RESTORE_MAP: answer}) as address, Client(address) as client:
        restored = client.restore_map("big", path, replace=True, incarnation=7)
    assert (restored.name, restored.incarnation) == ("big", 2**64 - 1)
    for first, *others in uploads:
        header = first.header
        assert (header.map, header.replace, header.incarnation) == ("big", True, 7)
        assert b"".join(request.data for request in others) == path.read_bytes()
        assert len(others) == 3
    assert len({requests[0].header.request_id for requests in uploads}) == 1


def test_an_intact_map_has_no_findings(client: Client, site: str) -> None:
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    now = client.get_map(site)
    report = client.check_map(site)
    assert report == CheckReport(site, now.revision, (), incarnation=now.incarnation)
    assert report.is_intact
    with pytest.raises(NotFound, match="nowhere"):
        client.check_map("nowhere")


def test_findings_of_a_check() -> None:
    found = pb.Finding(table="things", row="id 7", problem="no shape", can_be_rebuilt=True)
    response = pb.CheckMapResponse(map="m", revision=4, findings=[found], more=2, incarnation=9)
    with scripted_server({_rpc.CHECK_MAP: lambda *_: response}) as address:
        with Client(address) as client:
            report = client.check_map("m")
    assert report == CheckReport("m", 4, (Finding("things", "id 7", "no shape", True),), 2, 9)
    assert not report.is_intact


def test_digests_tell_layers_apart(client: Client, site: str) -> None:
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    before = client.digest_map(site)
    now = client.get_map(site)
    assert before.map == site
    assert (before.revision, before.incarnation) == (now.revision, now.incarnation)
    assert list(before.layers) == ["things"]
    assert client.digest_map(site) == before
    client.create_layer(site, LayerSpec(name="others", kind=LayerKind.SEMANTIC))
    after = client.digest_map(site)
    assert after.layers["things"] == before.layers["things"]
    assert after.layers["others"] != before.layers["things"]
    assert after.frames == before.frames
    with pytest.raises(NotFound, match="nowhere"):
        client.digest_map("nowhere")

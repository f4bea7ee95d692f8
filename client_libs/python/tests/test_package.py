"""Tests of the installed package: imports, optional dependencies, tables."""

from __future__ import annotations

import importlib.metadata
import importlib.resources
import subprocess
import sys

import pytest
import shapely

import hypermap_client
from hypermap_client import (
    Answer,
    AnswerStatus,
    Client,
    GridGeometry,
    LayerAnswer,
    LayerKind,
    LayerSpec,
    MapObject,
    NearestAnswer,
    NearestMatch,
    PutObject,
)


def run_python(code: str) -> str:
    """Runs code in a new interpreter and returns its output."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_installed_package_is_tested() -> None:
    assert "site-packages" in hypermap_client.__file__
    assert importlib.metadata.version("hypermap-client") == hypermap_client.__version__
    assert importlib.resources.files(hypermap_client).joinpath("py.typed").is_file()


def test_importing_the_package_does_not_import_optional_libraries() -> None:
    code = "import sys, hypermap_client; print([m for m in {} if m in sys.modules])"
    assert run_python(code.format(["matplotlib", "pandas", "geopandas", "rosbags"])).strip() == "[]"


def test_other_versions_of_the_protos_do_not_conflict() -> None:
    """Another geometry.proto of the same name is in the default descriptor pool."""
    run_python("""
from google.protobuf import descriptor_pb2, descriptor_pool
other = descriptor_pb2.FileDescriptorProto(
    name="hypermap/v1/geometry.proto", package="hypermap.v1", syntax="proto3")
other.message_type.add(name="Point").field.add(name="z", number=9, type=1, label=1)
descriptor_pool.Default().Add(other)
import hypermap_client
from hypermap_client._proto import geometry_pb2
assert [f.name for f in geometry_pb2.Point.DESCRIPTOR.fields] == ["x", "y"]
pool = descriptor_pool.Default()
assert [f.name for f in pool.FindMessageTypeByName("hypermap.v1.Point").fields] == ["z"]
""")


def test_all_exported_names_exist() -> None:
    for name in hypermap_client.__all__:
        assert hasattr(hypermap_client, name), name


@pytest.fixture
def room(client: Client, site: str) -> str:
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    client.create_layer(site, LayerSpec(name="heat", kind=LayerKind.SCALAR, grid=GridGeometry(0.5)))
    client.apply_edits(
        site,
        [
            PutObject("things", MapObject("chair", shapely.box(0, 0, 1, 1), tags=("old",))),
            PutObject("things", MapObject("sofa", shapely.box(3, 0, 5, 1))),
            hypermap_client.WriteCells("heat", [[1.0, 1.0, 2.0], [3.0, 3.0, 3.0]]),
        ],
    )
    return site


def test_geodataframes(client: Client, room: str) -> None:
    area = client.query_area(room, shapely.box(-1, -1, 9, 9))
    table = area.to_geodataframe()
    assert table["label"].tolist() == ["chair", "sofa"]
    assert table["tags"].tolist() == [("old",), ()]
    assert table.geometry.area.tolist() == [1.0, 2.0] and table.crs is None
    cells = area["heat"].to_geodataframe()
    assert cells["value"].tolist() == [1.0, 2.0, 3.0]
    assert cells.geometry.area.tolist() == [0.5, 0.25, 0.75]
    assert cells.geometry.iloc[1].equals(shapely.box(1.0, 0.0, 1.5, 0.5))
    point = client.query_point(room, (4, 0.5)).to_geodataframe()
    assert point[["layer", "label"]].values.tolist() == [["things", "sofa"]]
    nearest = client.query_nearest(room, (9, 0), "chair", k=2).to_geodataframe()
    assert nearest["distance_m"].tolist() == [8.0]
    cell = client.query_nearest(room, (9, 0), "=3").to_geodataframe()
    assert cell["value"].tolist() == [3.0] and cell.geometry.iloc[0].area == 0.25
    assert len(client.query_value(room, "lamp").to_geodataframe()) == 0


def test_a_table_has_objects_of_each_kind_of_shape() -> None:
    shapes = (shapely.box(0, 0, 2, 1), shapely.LineString([(0, 0), (3, 4)]), shapely.Point(5, 6))
    objects = tuple(MapObject("thing", shape, id=i) for i, shape in enumerate(shapes, 1))
    layer = LayerAnswer("things", LayerKind.SEMANTIC, AnswerStatus.VALUE, objects)
    table = Answer("site", 1, "", (layer,)).to_geodataframe()
    assert table.geom_type.tolist() == ["Polygon", "LineString", "Point"]
    assert table.geometry.tolist() == list(shapes)
    assert (table.area.tolist(), table.length.tolist()) == ([2, 0, 0], [6, 5, 0])
    matches = tuple(NearestMatch("things", LayerKind.SEMANTIC, 0.5, o) for o in objects)
    nearest = NearestAnswer("site", 1, "map", matches, ()).to_geodataframe()
    assert nearest.geometry.tolist() == list(shapes)
    # Objects that are made of the rows of a table have its geometries.
    again = [MapObject(row.label, row.geometry) for row in table.itertuples()]
    assert [o.shape for o in again] == list(shapes)


def test_tables_without_geopandas_name_the_extra_to_install(
    client: Client, room: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = client.query_value(room, "chair")
    monkeypatch.setitem(sys.modules, "geopandas", None)
    with pytest.raises(ImportError, match=r"hypermap-client\[geopandas\]"):
        answer.to_geodataframe()

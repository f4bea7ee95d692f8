"""Tests with recorded maps: imported content is found by queries. Skipped without the data."""

from __future__ import annotations

import os
import pathlib

import numpy as np
import pytest
import shapely
from server import ROOT

from hypermap_client import AnswerStatus, Client, FileFormat

DATA = pathlib.Path(os.environ.get("HYPERMAP_DATA") or ROOT.parent / "shared" / "data")
MAPS = sorted(DATA.glob("maps/*.hmap"))


@pytest.mark.skipif(not MAPS, reason="the recorded maps are missing")
@pytest.mark.parametrize("path", MAPS, ids=lambda path: path.stem)
def test_a_recorded_map(client: Client, site: str, path: pathlib.Path) -> None:
    answer = client.import_map(site, path)
    layers = [client.get_layer(site, name) for name in answer.layers]
    assert layers
    for layer in layers:
        assert layer.properties.has_shapes != layer.properties.has_cells
        if layer.properties.has_shapes:
            check_objects(client, site, layer.name, layer.size)
        else:
            check_cells(client, site, layer.name)
    (file,) = client.export_map(site, FileFormat.HMAP).files
    again = client.import_map(f"{site}-again", file)
    assert again.layers == answer.layers


def check_objects(client: Client, site: str, layer: str, size: int) -> None:
    """All objects of a layer are found by area, by label, and at a point inside each."""
    found = client.query_area(site, shapely.box(-1e4, -1e4, 1e4, 1e4), layers=layer).objects
    assert len(found) == size
    labels = {o.label for o in found}
    by_label = [client.query_value(site, label, layers=layer).objects for label in labels]
    assert {o.id for objects in by_label for o in objects} == {o.id for o in found}
    inside = [o.shape.representative_point() for o in found]
    batch = client.query_points(site, inside, layers=layer)[layer]
    at_points = set(zip(batch.points.tolist(), batch.object_ids.tolist(), strict=True))
    assert {(i, o.id) for i, o in enumerate(found)} <= at_points
    table = client.query_value(site, found[0].label, layers=layer).to_geodataframe()
    assert found[0].id in table["id"].tolist()


def check_cells(client: Client, site: str, layer: str) -> None:
    """The values of read_grid equal those of query_points at the centres of the cells."""
    grid = client.read_grid(site, layer)
    assert np.isfinite(grid.values).any()
    generator = np.random.default_rng(1)
    rows, cols = (generator.integers(0, n, 200) for n in grid.values.shape)
    centres = grid.grid.centres(rows + grid.row_begin, cols + grid.col_begin)
    batch = client.query_points(
        site, centres, layers=layer, frame_id=client.get_layer(site, layer).frame_id
    )[layer]
    np.testing.assert_array_equal(batch.values, grid.values[rows, cols])
    known = batch.statuses == AnswerStatus.VALUE
    np.testing.assert_array_equal(known, np.isfinite(grid.values[rows, cols]))
    free = client.query_value(site, "free", layers=layer)[layer].cells
    thresholded = int(np.sum(grid.values < 0.196))
    assert free is not None and free.num_cells == thresholded

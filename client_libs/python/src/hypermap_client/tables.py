"""Results as GeoDataFrames, in planar metres without a coordinate reference system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from .objects import MapObject

if TYPE_CHECKING:
    import geopandas

    from .answers import NearestMatch
    from .grids import CellRuns

OBJECT_COLUMNS = (
    "layer",
    "id",
    "label",
    "existence",
    "low_m",
    "high_m",
    "classes",
    "tags",
    "attributes",
    "version",
)


def objects_table(objects: Sequence[tuple[str, MapObject]]) -> geopandas.GeoDataFrame:
    """A row for each object, beside the name of its layer."""
    rows = [_object_row(layer, o) for layer, o in objects]
    return _table(rows, OBJECT_COLUMNS, [o.polygon for _, o in objects])


def matches_table(matches: Sequence[NearestMatch]) -> geopandas.GeoDataFrame:
    """A row for each match; `value` is a cell's, most other columns an object's."""
    rows: list[dict[str, Any]] = []
    geometry: list[shapely.Polygon] = []
    for match in matches:
        row: dict[str, Any] = {"layer": match.layer}
        if match.object is not None:
            row = _object_row(match.layer, match.object)
            geometry.append(match.object.polygon)
        elif match.cell is not None:
            row.update(row=match.cell.row, col=match.cell.col, value=match.cell.value)
            geometry.append(match.cell.polygon)
        row["distance_m"] = match.distance_m
        rows.append(row)
    return _table(rows, ("distance_m", *OBJECT_COLUMNS, "row", "col", "value"), geometry)


def runs_table(runs: CellRuns) -> geopandas.GeoDataFrame:
    """A rectangle for each run of cells."""
    corners = np.stack(
        [
            runs.grid.corners(runs.rows, runs.col_begins),
            runs.grid.corners(runs.rows, runs.col_ends),
            runs.grid.corners(runs.rows.astype(np.int64) + 1, runs.col_ends),
            runs.grid.corners(runs.rows.astype(np.int64) + 1, runs.col_begins),
        ],
        axis=1,
    )
    columns = {
        "row": runs.rows,
        "col_begin": runs.col_begins,
        "col_end": runs.col_ends,
        "value": runs.values,
    }
    return _geopandas().GeoDataFrame(columns, geometry=shapely.polygons(corners))


def _object_row(layer: str, o: MapObject) -> dict[str, Any]:
    return {
        "layer": layer,
        "id": o.id,
        "label": o.label,
        "existence": o.existence,
        "low_m": o.height.low_m if o.height else np.nan,
        "high_m": o.height.high_m if o.height else np.nan,
        "classes": dict(o.classes),
        "tags": o.tags,
        "attributes": dict(o.attributes),
        "version": o.version,
    }


def _table(
    rows: Sequence[dict[str, Any]], columns: Sequence[str], geometry: Sequence[shapely.Geometry]
) -> geopandas.GeoDataFrame:
    by_column = {name: [row.get(name) for row in rows] for name in columns}
    return _geopandas().GeoDataFrame(by_column, geometry=list(geometry))


def _geopandas() -> Any:
    try:
        import geopandas  # noqa: PLC0415  (an extra)
    except ImportError as error:
        raise ImportError(
            "to_geodataframe() needs GeoPandas: pip install 'hypermap-client[geopandas]'"
        ) from error
    return geopandas

"""Tables of map objects, one row per object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._geodataframe import make_geodataframe
from .objects import MapObject

if TYPE_CHECKING:
    import geopandas

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


def object_row(layer: str, o: MapObject) -> dict[str, Any]:
    """The values of OBJECT_COLUMNS by name; NaN where an object has no height."""
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


def columns_of_rows(rows: Sequence[dict[str, Any]], names: Sequence[str]) -> dict[str, list[Any]]:
    """The named columns of rows; None where a row has no value of that name."""
    return {name: [row.get(name) for row in rows] for name in names}


def object_table(objects: Sequence[tuple[str, MapObject]]) -> geopandas.GeoDataFrame:
    """A table with OBJECT_COLUMNS and the shape of each (layer name, object).

    Raises ImportError when GeoPandas is missing.
    """
    rows = [object_row(layer, o) for layer, o in objects]
    return make_geodataframe(columns_of_rows(rows, OBJECT_COLUMNS), [o.shape for _, o in objects])

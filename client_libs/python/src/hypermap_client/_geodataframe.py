"""Makes GeoDataFrames in planar metres, without a coordinate reference system.

GeoPandas is an optional dependency. It is imported when the first table is made.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import geopandas


def make_geodataframe(columns: Mapping[str, Any], geometry: Any) -> geopandas.GeoDataFrame:
    """Makes a table of columns and geometries of equal length.

    Raises ImportError that names the extra to install when GeoPandas is missing.
    """
    try:
        import geopandas  # noqa: PLC0415  (an optional dependency)
    except ImportError as error:
        raise ImportError(
            "to_geodataframe() needs GeoPandas: pip install 'hypermap-client[geopandas]'"
        ) from error
    return geopandas.GeoDataFrame(columns, geometry=geometry)

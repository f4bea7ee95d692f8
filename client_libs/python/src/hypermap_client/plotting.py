"""Maps as Matplotlib pictures, in metres. Needs Matplotlib's pyplot only for new figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import shapely

from .grids import Grid
from .objects import MapObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.typing import ColorType

# Told apart also by those who see few colours (Okabe and Ito).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")


def draw_grid(axes: Axes, grid: Grid, **options: Any) -> QuadMesh:
    """Draws the known cells of a grid, turned as it lies; options are of `pcolormesh`."""
    import numpy as np  # noqa: PLC0415

    x, y = grid.mesh()
    mesh = axes.pcolormesh(x, y, np.ma.masked_invalid(grid.values), **options)
    axes.set_aspect("equal")
    return mesh


def draw_objects(
    axes: Axes,
    objects: Iterable[MapObject],
    *,
    colours: Mapping[str, ColorType] | None = None,
    names: bool = True,
    **options: Any,
) -> dict[str, ColorType]:
    """Draws objects filled by label, and answers the colours; options are of `PathPatch`.

    colours: by label; labels that it has not get one of COLOURS.
    names: whether to write labels at the objects.
    """
    found = list(objects)
    by_label: dict[str, ColorType] = dict(colours or {})
    for label in sorted({o.label for o in found} - by_label.keys()):
        by_label[label] = COLOURS[len(by_label) % len(COLOURS)]
    for o in found:
        draw_polygon(axes, o.polygon, facecolor=by_label[o.label], **options)
        if names:
            at = o.polygon.representative_point()
            axes.annotate(o.label, (at.x, at.y), ha="center", va="center", fontsize=8)
    axes.set_aspect("equal")
    return by_label


def draw_polygon(
    axes: Axes, polygon: shapely.Polygon | shapely.MultiPolygon, **options: Any
) -> None:
    """Draws one or several polygons with their holes; options are of `PathPatch`."""
    from matplotlib.patches import PathPatch  # noqa: PLC0415
    from matplotlib.path import Path  # noqa: PLC0415

    # Holes are what runs the other way round.
    rings = shapely.get_rings(shapely.get_parts(shapely.normalize(polygon)))
    paths = [Path(shapely.get_coordinates(ring), closed=True) for ring in rings]
    axes.add_patch(PathPatch(Path.make_compound_path(*paths), **options))
    axes.autoscale_view()

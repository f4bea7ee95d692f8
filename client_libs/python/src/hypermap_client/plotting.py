"""Draws grids, objects and polygons on Matplotlib axes, in metres.

Matplotlib is imported when something is drawn first; pyplot is not needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from .grids import Grid
from .objects import MapObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.typing import ColorType

# The palette of Okabe and Ito, whose colours remain distinct with colour vision deficiency.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")


def draw_grid(axes: Axes, grid: Grid, **options: Any) -> QuadMesh:
    """Draws the known cells of a grid in their frame, also if the grid is rotated in it.

    `options` are passed to `Axes.pcolormesh`.
    """
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
    """Draws objects filled with a colour for each label, and returns the colours by label.

    colours: colours by label; other labels get colours of COLOURS in turn.
    names: whether to write the label of each object at its position.
    options: passed to Matplotlib's `PathPatch`.
    """
    found = list(objects)
    by_label: dict[str, ColorType] = dict(colours or {})
    for label in sorted({o.label for o in found} - by_label.keys()):
        by_label[label] = COLOURS[len(by_label) % len(COLOURS)]
    for o in found:
        draw_polygon(axes, o.polygon, facecolor=by_label[o.label], **options)
        if names:
            position = o.polygon.representative_point()
            axes.annotate(o.label, (position.x, position.y), ha="center", va="center", fontsize=8)
    axes.set_aspect("equal")
    return by_label


def draw_polygon(
    axes: Axes, polygon: shapely.Polygon | shapely.MultiPolygon, **options: Any
) -> None:
    """Draws a polygon or multipolygon with its holes.

    `options` are passed to Matplotlib's `PathPatch`.
    """
    from matplotlib.patches import PathPatch  # noqa: PLC0415
    from matplotlib.path import Path  # noqa: PLC0415

    # Matplotlib fills by the winding of the rings: holes must run against the outer ring, which
    # normalize() ensures.
    rings = shapely.get_rings(shapely.get_parts(shapely.normalize(polygon)))
    paths = [Path(shapely.get_coordinates(ring), closed=True) for ring in rings]
    axes.add_patch(PathPatch(Path.make_compound_path(*paths), **options))
    axes.autoscale_view()

"""Draws grids, objects and shapes on Matplotlib axes, in metres.

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
    from matplotlib.path import Path
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
    """Draws objects in a colour for each label, and returns the colours by label.

    Polygons are filled, line strings are lines of twice the usual width, points are dots.

    colours: colours by label; other labels get colours of COLOURS in turn.
    names: whether to write the label of each object at its position.
    options: as in `draw_shape`. Those for edges apply to the outlines of polygons and points.
    """
    from matplotlib.cbook import normalize_kwargs  # noqa: PLC0415
    from matplotlib.patches import PathPatch  # noqa: PLC0415

    found = list(objects)
    by_label: dict[str, ColorType] = dict(colours or {})
    for label in sorted({o.label for o in found} - by_label.keys()):
        by_label[label] = COLOURS[len(by_label) % len(COLOURS)]
    options = normalize_kwargs(options, PathPatch)
    for o in found:
        colour = by_label[o.label]
        if isinstance(o.shape, shapely.LineString):
            draw_shape(axes, o.shape, **{"linewidth": 2.0, **options, "edgecolor": colour})
        else:
            draw_shape(axes, o.shape, **{**options, "facecolor": colour})
        if names:
            _write_name(axes, o)
    axes.set_aspect("equal")
    return by_label


def draw_shape(axes: Axes, shape: shapely.Geometry, **options: Any) -> None:
    """Draws a polygon with its holes, a line string, a point, or a geometry of several of them.

    options: passed to Matplotlib's `PathPatch`, or to its `PathCollection` for points. Lines are
        drawn with the options for edges and are never filled.
    """
    from matplotlib.cbook import normalize_kwargs  # noqa: PLC0415
    from matplotlib.patches import PathPatch  # noqa: PLC0415

    options = normalize_kwargs(options, PathPatch)
    parts = shapely.get_parts(shapely.get_parts(shape))  # a collection may have multipolygons
    points, lines, polygons = (parts[shapely.get_dimensions(parts) == d] for d in range(3))
    if len(polygons):
        # Matplotlib fills by the winding of the rings: holes must run against the outer ring, which
        # normalize() ensures.
        rings = shapely.get_rings(shapely.normalize(polygons))
        axes.add_patch(PathPatch(_path_of(rings, closed=True), **options))
    if len(lines):
        axes.add_patch(PathPatch(_path_of(lines, closed=False), **{**options, "fill": False}))
    if len(points):
        if not options.pop("fill", True):
            options["facecolor"] = "none"
        axes.scatter(*shapely.get_coordinates(points).T, **options)
    axes.autoscale_view()


def _path_of(parts: Iterable[shapely.Geometry], closed: bool) -> Path:
    """The vertices of rings or line strings as one path."""
    from matplotlib.path import Path  # noqa: PLC0415

    return Path.make_compound_path(
        *(Path(shapely.get_coordinates(part), closed=closed) for part in parts)
    )


def _write_name(axes: Axes, o: MapObject) -> None:
    """Writes the label of an object inside a polygon, at the middle of a line, above a point."""
    if isinstance(o.shape, shapely.Polygon):
        position, offset = o.shape.representative_point(), 0
    elif isinstance(o.shape, shapely.LineString):
        position, offset = o.shape.interpolate(0.5, normalized=True), 5
    else:
        position, offset = o.shape, 5
    axes.annotate(
        o.label,
        (position.x, position.y),
        xytext=(0, offset),
        textcoords="offset points",
        ha="center",
        va="bottom" if offset else "center",
        fontsize=8,
    )

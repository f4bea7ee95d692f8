"""Tests of drawing on Matplotlib axes."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hypermap_client import CellRuns, GridGeometry, MapObject, Pose
from hypermap_client.plotting import draw_grid, draw_objects, draw_shape


@pytest.fixture
def axes() -> Axes:
    return Figure().add_subplot()


def test_a_polygon_with_holes_and_parts(axes: Axes) -> None:
    ring = shapely.box(0, 0, 4, 4).difference(shapely.box(1, 1, 3, 3))
    draw_shape(axes, shapely.union(ring, shapely.box(6, 0, 7, 1)), facecolor="red")
    (patch,) = axes.patches
    path = patch.get_path()
    assert len([code for code in path.codes if code == path.MOVETO]) == 3
    assert path.get_extents().extents.tolist() == [0, 0, 7, 4]
    # Holes run against the outer rings.
    areas = [shapely.Polygon(p) for p in path.to_polygons()]
    assert sorted(a.exterior.is_ccw for a in areas) in ([False, False, True], [False, True, True])
    holes = {a.exterior.is_ccw for a in areas if a.area == 4}
    others = {a.exterior.is_ccw for a in areas if a.area != 4}
    assert holes.isdisjoint(others)


def test_objects_with_the_same_label_have_the_same_colour(axes: Axes) -> None:
    objects = [
        MapObject(label, shapely.box(i, 0, i + 1, 1))
        for i, label in enumerate(["chair", "cup", "chair"])
    ]
    colours = draw_objects(axes, objects, colours={"cup": "black"})
    assert colours.keys() == {"chair", "cup"} and colours["cup"] == "black"
    assert [text.get_text() for text in axes.texts] == ["chair", "cup", "chair"]
    first, cup, second = (patch.get_facecolor() for patch in axes.patches)
    assert first == second != cup == mpl.colors.to_rgba("black")


def test_lines_and_points(axes: Axes) -> None:
    lane = shapely.LineString([(0, 0), (4, 0), (4, 2)])
    everything = shapely.GeometryCollection(
        [lane, shapely.Point(5, 5), shapely.MultiPoint([(6, 6), (7, 7)]), shapely.box(8, 8, 9, 9)]
    )
    draw_shape(axes, everything, ec="red", lw=3)
    square, line = axes.patches
    np.testing.assert_array_equal(line.get_path().vertices, shapely.get_coordinates(lane))
    assert square.get_fill() and not line.get_fill()
    assert line.get_edgecolor() == mpl.colors.to_rgba("red") and line.get_linewidth() == 3
    (dots,) = axes.collections
    assert dots.get_offsets().tolist() == [[5, 5], [6, 6], [7, 7]]
    np.testing.assert_array_equal(dots.get_edgecolor(), [mpl.colors.to_rgba("red")])
    # All parts are in the limits of the axes.
    assert axes.get_xlim()[0] < 0 and axes.get_xlim()[1] > 9
    draw_shape(axes, shapely.Point(0, 0), fill=False, edgecolor="blue")
    assert axes.collections[1].get_facecolor().size == 0


def test_objects_of_each_kind_of_shape_have_the_colour_of_their_label(axes: Axes) -> None:
    shapes = {
        "room": shapely.box(0, 0, 1, 1),
        "lane": shapely.LineString([(0, 0), (2, 0)]),
        "dock": shapely.Point(3, 0),
    }
    objects = [MapObject(label, shape) for label, shape in shapes.items()]
    colours = draw_objects(axes, objects, edgecolor="black", alpha=0.5)
    room, lane = axes.patches
    (dock,) = axes.collections
    for drawn, label in (
        (room.get_facecolor(), "room"),
        (lane.get_edgecolor(), "lane"),
        (dock.get_facecolor()[0], "dock"),
    ):
        np.testing.assert_array_equal(drawn, mpl.colors.to_rgba(colours[label], 0.5))
    assert len(set(colours.values())) == 3
    at = {text.get_text(): text.xy for text in axes.texts}
    assert at == {"room": (0.5, 0.5), "lane": (1, 0), "dock": (3, 0)}


def test_a_rotated_grid_is_drawn_in_its_frame(axes: Axes) -> None:
    runs = CellRuns(
        GridGeometry(1.0, Pose(10, 0, np.pi / 2)),
        np.array([0, 1], np.int32),
        np.array([0, 0], np.int32),
        np.array([3, 1], np.int32),
        np.array([1.0, np.nan]),
    )
    mesh = draw_grid(axes, runs.to_grid())
    # The grid has two rows against the x axis and three columns along the y axis; three cells have
    # values.
    np.testing.assert_allclose(mesh.get_datalim(axes.transData).extents, [8, 0, 10, 3], atol=1e-9)
    assert mesh.get_array().count() == 3

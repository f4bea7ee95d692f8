# %% [markdown]
# # A tour of Hypermap from Python
#
# A *hypermap* is a set of layers of one site, such as grids of cells or sets of labelled shapes.
# Each layer has its own frame and its own kind of value. All layers answer the same three
# questions: what is **at this point**, what is **in this area**, **where is this value**?
#
# This tour creates the map of a small flat, queries and edits it, queries earlier revisions, and
# draws a picture. It needs a running server (`hypermapd --data_dir=maps`) and
# `pip install hypermap-client`:
#
#     python tutorial.py --server 127.0.0.1:50051 --plot flat.png
#
# The `# %%` lines divide the script into notebook cells for Jupyter (jupytext), VS Code, Spyder and
# PyCharm.

# %%
import argparse
import asyncio

import matplotlib
import numpy as np
import shapely

from hypermap_client import (
    AsyncClient,
    ChangeKind,
    Client,
    CreateLayer,
    FillPolygon,
    GridGeometry,
    LayerKind,
    LayerSpec,
    MapObject,
    NotFound,
    Pose,
    PutObject,
    SetAliases,
    SetTransform,
    ShapeKind,
    WriteCells,
)
from hypermap_client.plotting import draw_grid, draw_objects, draw_shape

parser = argparse.ArgumentParser(description="Creates and queries the map of a small flat.")
parser.add_argument("--server", default="127.0.0.1:50051", metavar="HOST:PORT")
parser.add_argument("--map", default="tutorial", help="the map to create; replaced if it exists")
parser.add_argument("--plot", default="tutorial.png", metavar="FILE")
arguments, _ = parser.parse_known_args()

# %% [markdown]
# ## A map and its layers
#
# The client connects at its first call, and reconnects after failures. A script would use it in a
# `with` block, which closes the connection; this tour closes it at the end.

# %%
client = Client(arguments.server)
flat = arguments.map
try:
    client.delete_map(flat)  # An earlier run of the tour may have left a map.
except NotFound:
    pass
client.create_map(flat)

# %% [markdown]
# A map is changed by batches of edits. A batch becomes one revision of the map, or changes nothing
# if one of its edits is invalid. When the call returns, the revision is on the server's disk. This
# batch creates the layers and places a frame; the methods `create_layer` and `set_transform` do so
# one by one.
#
# Lengths are in metres and angles in radians. A grid has square cells and no fixed extent; its
# geometry is the size of a cell and the pose of cell (0, 0). The balcony has its own frame. A
# transform places it in the map by the pose of the child frame in the parent frame. The layer
# "lanes" takes line strings and points only.

# %%
client.apply_edits(
    flat,
    [
        SetTransform("map", "balcony", Pose(8.0, 1.0, np.pi / 2)),
        CreateLayer(LayerSpec(name="floor", kind=LayerKind.OCCUPANCY, grid=GridGeometry(0.05))),
        CreateLayer(
            LayerSpec(name="wifi", kind=LayerKind.SCALAR, unit="dBm", grid=GridGeometry(0.25))
        ),
        CreateLayer(LayerSpec(name="objects", kind=LayerKind.SEMANTIC)),
        CreateLayer(LayerSpec(name="outside", kind=LayerKind.SEMANTIC, frame_id="balcony")),
        CreateLayer(
            LayerSpec(
                name="lanes",
                kind=LayerKind.SEMANTIC,
                shape_kinds=(ShapeKind.LINE_STRING, ShapeKind.POINT),
            )
        ),
    ],
)

# %% [markdown]
# The properties of a layer describe its content, also for kinds of layers that a program does not
# know.

# %%
for layer in client.list_layers(flat).layers:
    content = "cells" if layer.properties.has_cells else "shapes"
    print(f"{layer.name:8} {content:6} {layer.properties.unit or '-':5} in frame {layer.frame_id}")

# %% [markdown]
# ## Content
#
# Polygons fill the cells of the floor plan: the rooms are free (0.02), the walls are occupied
# (1.0), and the doors are free again.

# %%
outline = shapely.box(0.0, 0.0, 8.0, 6.0)
walls = shapely.union_all(
    [
        outline.difference(outline.buffer(-0.15, join_style="mitre")),
        shapely.box(4.9, 0.0, 5.0, 6.0),  # between living room and bedroom
        shapely.box(5.0, 2.9, 8.0, 3.0),  # between bedroom and bath
    ]
)
doors = [
    shapely.box(4.9, 3.6, 5.0, 4.5),  # bedroom
    shapely.box(4.9, 1.2, 5.0, 2.0),  # bath
    shapely.box(0.0, 2.5, 0.15, 3.5),  # entrance
    shapely.box(7.85, 1.2, 8.0, 2.2),  # balcony
]
painted = client.apply_edits(
    flat,
    [
        FillPolygon("floor", outline, 0.02),
        FillPolygon("floor", walls, 1.0),
        *(FillPolygon("floor", door, 0.02) for door in doors),
    ],
)
print(f"the floor plan is revision {painted.revision}")

# %% [markdown]
# Cells can also be written as an array with the lowest row first. These are signal strengths of a
# radio that depend on the distance from the access point only, as if walls did not matter.

# %%
access_point = np.array([1.0, 5.2])
rows, cols = np.mgrid[0:24, 0:32]
centres = GridGeometry(0.25).centres(rows, cols)  # shape (24, 32, 2), metres
distance_m = np.linalg.norm(centres - access_point, axis=-1)
client.apply_edits(flat, WriteCells("wifi", -38.0 - 26.0 * np.log10(np.maximum(distance_m, 0.3))))

# %% [markdown]
# Objects are labelled shapes: polygons, line strings or points of Shapely. They may have
# confidences of alternative classes, tags, a range of heights, and free attributes. An alias is a
# word that stands for several labels of a layer in queries.


# %%
def thing(label: str, x: float, y: float, width: float, depth: float, **more: object) -> PutObject:
    """Puts a box on the layer "objects". (x, y) is its lower left corner, in metres."""
    return PutObject("objects", MapObject(label, shapely.box(x, y, x + width, y + depth), **more))


lane = shapely.LineString([(0.45, 2.2), (0.9, 2.5), (4.3, 2.5), (4.6, 4.0), (5.25, 4.1)])
furniture = client.apply_edits(
    flat,
    [
        thing("sofa", 0.4, 0.4, 2.0, 0.9, classes={"sofa": 0.8, "bed": 0.2}),
        thing("table", 2.0, 3.6, 1.6, 0.9, tags=("wood",), attributes={"seats": 4}),
        thing("chair", 2.2, 4.6, 0.45, 0.45),
        thing("chair", 3.0, 4.6, 0.45, 0.45),
        thing("chair", 2.2, 3.05, 0.45, 0.45),
        thing("chair", 3.0, 3.05, 0.45, 0.45, existence=0.6),
        thing("cup", 3.34, 4.2, 0.12, 0.12),
        thing("plant", 4.1, 0.35, 0.5, 0.5),
        thing("bed", 5.5, 4.0, 2.1, 1.7),
        thing("bath", 5.3, 0.35, 0.8, 1.8),
        PutObject("outside", MapObject("chair", shapely.box(0.2, -1.0, 0.7, -0.5))),
        PutObject("lanes", MapObject("lane", lane, attributes={"max_speed_m_s": 0.6})),
        PutObject("lanes", MapObject("charger", shapely.Point(0.45, 2.2))),
        SetAliases("objects", {"furniture": ["sofa", "table", "chair", "bed"]}),
    ],
)
sofa_id = furniture.object_ids[0]
print(f"{sum(i > 0 for i in furniture.object_ids)} objects are revision {furniture.revision}")

# %% [markdown]
# ## What is at this point?
#
# One query asks all layers. Each answers independently: a grid with the value of a cell, a semantic
# layer with objects. The status tells a cell without a value (UNKNOWN) from a point outside the
# extent of the grid (OUTSIDE).

# %%
answer = client.query_point(flat, (3.4, 4.26))
for content in answer.layers:
    things = ", ".join(o.label for o in content.objects)
    print(f"{content.layer:8} {content.status.name:8} {content.value or things}")

# %% [markdown]
# A line or a point is found near a point with a tolerance in metres.

# %%
near = client.query_point(flat, (3.0, 2.55), layers="lanes", tolerance_m=0.1)
print("up to 0.1 m from (3.0, 2.55):", [o.label for o in near["lanes"].objects])

# %% [markdown]
# ## What is in this area?
#
# The answer has the objects that intersect the area, and the cells whose centre it covers. All
# geometry is in the frame of the query, here the map's own, also if the layer has another frame
# like the layer of the balcony.

# %%
dining_corner = shapely.Polygon([(1.6, 2.7), (4.2, 2.7), (4.2, 5.4), (1.6, 5.4)])
answer = client.query_area(flat, dining_corner)
print("in the dining corner:", sorted(o.label for o in answer.objects))
print("cells of the floor there:", answer["floor"].cells.num_cells)

# %% [markdown]
# ## Where is this value?
#
# A value is a string: a label or an alias, a word such as `free` or `occupied`, or a comparison. A
# layer that does not support the value answers with the status UNSUPPORTED_VALUE; the other layers
# answer nevertheless.

# %%
for value in ("chair", "furniture", "tag:wood", "occupied", "<-55"):
    answer = client.query_value(flat, value)
    found = []
    for part in answer.layers:
        if part.objects:
            found.append(f"{len(part.objects)} in {part.layer}")
        if part.cells is not None and part.cells.num_cells:
            area_m2 = part.cells.num_cells * part.cells.grid.resolution_m**2
            found.append(f"{area_m2:.2f} m² of {part.layer}")
    print(f"{value:10}", "; ".join(found))

# %% [markdown]
# A nearest query returns the places with a value that are nearest to a point, over all layers.

# %%
entrance = shapely.Point(0.3, 3.0)
for match in client.query_nearest(flat, entrance, "furniture", k=3).matches:
    print(f"{match.object.label} {match.object.id}: {match.distance_m:.2f} m")

# %% [markdown]
# ## Changes and earlier revisions
#
# A watch reports each revision once, completely and in order. It starts with a snapshot, or with
# the changes after a given revision, and resumes by itself when the connection breaks. Here the
# sofa is moved while the watch is open.

# %%
before = client.get_map(flat).revision
moved = MapObject("sofa", shapely.box(2.2, 0.4, 4.0, 1.3), id=sofa_id)
with client.watch(flat, layers="objects", start_revision=before, timeout=60) as watch:
    client.apply_edits(flat, PutObject("objects", moved))
    event = next(event for event in watch if event.changes)
(change,) = event.changes
assert change.kind == ChangeKind.PUT
print(f"revision {event.revision}: the {change.object.label} is at {change.object.centroid}")

# %% [markdown]
# Every query takes an earlier revision or time, and returns the answer of that revision.
# `list_changes` returns the differences between two revisions.

# %%
(sofa_then,) = client.query_value(flat, "sofa", as_of=before).objects
(sofa_now,) = client.query_value(flat, "sofa").objects
shift_m = sofa_then.centroid.distance(sofa_now.centroid)
print(f"the sofa has moved by {shift_m:.2f} m since revision {before}")
for change in client.list_changes(flat, before).changes:
    print("changed:", change.kind.name, change.layer, change.object_id)

# %% [markdown]
# ## Arrays
#
# `read_grid` returns a grid layer as a NumPy array: `values` has the lowest row first and NaN for
# unknown cells, `origin` is the pose of its corner, and `mesh()` has the corners of the cells for
# plots. `query_points` answers many points with one array per column.

# %%
floor = client.read_grid(flat, "floor")
free_m2 = np.count_nonzero(floor.values < 0.2) * floor.grid.resolution_m**2
print(f"floor: {floor.values.shape[0]}×{floor.values.shape[1]} cells, {free_m2:.1f} m² are free")

path = shapely.get_coordinates(lane.segmentize(0.02))  # shape (N, 2), metres
batch = client.query_points(flat, path, tolerance_m=0.6)
dbm = batch["wifi"].values
print(f"radio on the lane from the charger to the bed: {dbm.min():.0f} to {dbm.max():.0f} dBm")
print("objects up to 0.6 m from the lane:", sorted(set(batch["objects"].labels)))

# %% [markdown]
# ## asyncio
#
# `AsyncClient` has the same methods for asyncio. Here several queries run concurrently.


# %%
async def count(values: list[str]) -> dict[str, int]:
    """Counts the objects that have each value."""
    async with AsyncClient(arguments.server) as client:
        answers = await asyncio.gather(*(client.query_value(flat, value) for value in values))
        return {v: len(answer.objects) for v, answer in zip(values, answers, strict=True)}


print(asyncio.run(count(["chair", "cup", "furniture"])))

# %% [markdown]
# ## Tables
#
# With GeoPandas (`pip install 'hypermap-client[geopandas]'`), answers can be converted to
# GeoDataFrames with coordinates in metres.

# %%
try:
    table = client.query_value(flat, "furniture").to_geodataframe()
    print(table.assign(area_m2=table.area)[["label", "existence", "area_m2"]].to_string())
except ImportError as error:
    print(error)

# %% [markdown]
# ## A picture

# %%
matplotlib.use("Agg")
import matplotlib.pyplot as plt

figure, (left, right) = plt.subplots(1, 2, figsize=(13, 4.9), layout="constrained")
for axes in (left, right):
    axes.set(xlim=(-0.4, 9.6), ylim=(-0.4, 6.4), xlabel="x [m]", ylabel="y [m]")
    axes.spines[["top", "right"]].set_visible(False)

everything = client.query_area(flat, shapely.box(-5, -5, 15, 15))
draw_grid(left, floor, cmap="gray_r", vmin=0, vmax=1.3, zorder=0)
draw_shape(left, sofa_then.shape, fill=False, linestyle=":", edgecolor="0.3", zorder=2)
at = sofa_then.centroid
left.annotate(f"sofa at revision {before}", (at.x, at.y), ha="center", color="0.3", fontsize=8)
draw_shape(left, dining_corner, fill=False, linestyle="--", edgecolor="#0072B2", zorder=2)
left.annotate("dining corner", (1.65, 5.45), color="#0072B2", fontsize=8)
draw_objects(left, everything.objects, alpha=0.75, edgecolor="0.2", zorder=3)
left.set_title("Objects, and the sofa's earlier place")

wifi = client.read_grid(flat, "wifi")
mesh = draw_grid(right, wifi, cmap="viridis", zorder=0)
figure.colorbar(mesh, ax=right, label="wifi [dBm]", shrink=0.85)
draw_shape(right, walls.difference(shapely.union_all(doors)), color="0.15", zorder=2)
orange = dict.fromkeys(("chair", "table", "sofa", "bed"), "#E69F00")
right.plot(*path.T, color="white", linewidth=2, zorder=3, label="lane from the charger to the bed")
for match in client.query_nearest(flat, entrance, "furniture", k=4).matches:
    line = shapely.shortest_line(entrance, match.object.shape)
    draw_objects(right, [match.object], colours=orange, edgecolor="0.2", zorder=3)
    right.plot(*line.xy, color="#D55E00", zorder=4, marker="o", markersize=3)
right.plot([], [], color="#D55E00", label="nearest furniture to the entrance")
right.plot(*access_point, marker="^", color="#D55E00", markersize=9, linestyle="", zorder=4)
right.legend(loc="lower right", facecolor="0.85", framealpha=0.9, fontsize=8)
right.set_title("Signal strength, and the nearest furniture")

figure.savefig(arguments.plot, dpi=130)
print(f"the picture is {arguments.plot}")
client.close()

"""Creates small maps for tests through the API."""

import rpc

SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]


def square(x, y, side=1.0):
    return {"outer": rpc.columns([(x, y), (x + side, y), (x + side, y + side), (x, y + side)])}


def put(label, x, y, layer="things", **fields):
    """Returns an edit that adds a square object of 1 m with its lower left corner at (x, y)."""
    return put_shape({"polygon": square(x, y)}, label, layer, **fields)


def put_shape(shape, label="thing", layer="things", **fields):
    """Returns an edit that adds an object with the shape of a Shape message."""
    return {"put_object": {"layer": layer, "object": {"label": label, "shape": shape, **fields}}}


def write_cells(values, row=0, col=0, layer="grid"):
    """Returns an edit that writes rows of cells, the lowest first; "NaN" makes a cell unknown."""
    box = {"row_begin": row, "row_end": row + len(values),
           "col_begin": col, "col_end": col + len(values[0])}
    return {"write_cells": {"layer": layer, "box": box, "values": [v for r in values for v in r]}}


def make(client, name="site"):
    """Creates a map with an empty semantic layer `things`, an occupancy layer `grid` with cells of
    half a metre, and a layer `adrift` in a frame that no transform connects to the others."""
    client.CreateMap(map=name)
    client.CreateLayer(map=name, layer={"name": "things", "kind": "LAYER_KIND_SEMANTIC"})
    client.CreateLayer(map=name, layer={
        "name": "grid", "kind": "LAYER_KIND_OCCUPANCY",
        "grid": {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": 0.5}})
    client.CreateLayer(map=name, layer={
        "name": "adrift", "kind": "LAYER_KIND_SEMANTIC", "frame_id": "raft"})


def labels(client, name="site", layer="things"):
    """Returns {id: label} of all objects within 5 km of the origin in x and y."""
    area = square(-5000, -5000, 10000)
    return {o.id: o.label
            for answer in client.QueryArea(scope=rpc.scope(name, layer), area=area)
            for o in answer.part.objects}


def revision(client, name="site"):
    return client.GetMap(map=name).map.revision

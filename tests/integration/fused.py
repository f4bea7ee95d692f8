"""A map with a fused layer, observations of four fixed objects, and what the layers show."""

import datetime
import itertools

import rpc
import sites

BEGIN_S = 1_699_999_200  # Time of frame 0.
LABELS = ["cup", "chair", "sofa", "plant"]


def observation(robot, sequence, frame):
    """Returns the observation of a frame: some of four fixed objects, and free space that moves."""
    stamp = datetime.datetime.fromtimestamp(BEGIN_S + frame, datetime.timezone.utc)
    seen = [k for k in range(len(LABELS)) if (frame * 7 + k) % 3 != 0]
    return {
        "robot": robot, "sequence": sequence,
        "stamp": f"{stamp:%Y-%m-%dT%H:%M:%SZ}",
        "pose": {"rotation": [0, 0, 1, -1, 0, 0, 0, -1, 0], "translation": [-1.0, 0.0, 0.8]},
        "free_space": sites.square(frame % 20, -1, 2.0),
        "detections": [{
            "scores": [{"label": LABELS[k], "score": 0.9}],
            "hull": sites.square(2 + 2 * k + 0.001 * frame, 0.5, 0.6),
            "cells": {"origin": {"x": 2 + 2 * k, "y": 0.5}, "resolution_m": 0.1,
                      "spans": [n for row in range(6) for n in (int(row > 0), 0, 6)]},
            "height": {"low_m": 0.2, "high_m": 0.7}, "num_points": 400, "range_m": 1.5,
            "truncation": 0.0, "weight": 0.8} for k in seen]}


def opening(robot="", **fields):
    return {"opening": {"map": "site", "layer": "things", "robot": robot, **fields}}


def make(client):
    sites.make(client)
    client.CreateLayer(map="site", layer={
        "name": "seen", "kind": "LAYER_KIND_EXPLORATION",
        "grid": {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": 0.25}})


def observe(client, observations, **fields):
    """Sends observations and waits for all outcomes. Returns {(robot, sequence): outcome}."""
    requests = itertools.chain([opening(exploration_layer="seen", **fields)],
                               ({"observations": [o]} for o in observations))
    return {(a.robot, a.sequence): a.outcome for response in client.Observe(requests)
            for a in response.acknowledgements}


def shown(client, map_name="site", layers=("things", "seen")):
    """Returns the objects without ids and versions, and the known cells of the layer `seen`."""
    objects, cells = [], []
    for answer in client.QueryArea(scope=rpc.scope(map_name, *layers),
                                   area=sites.square(-500, -500, 1000)):
        for o in answer.part.objects:
            o.id = o.version = 0  # Both depend on how observations were grouped into commits.
            objects.append(o.SerializeToString(deterministic=True))
        runs = answer.part.cells
        cells += [run for run in zip(runs.rows, runs.col_begins, runs.col_ends, runs.values)
                  if run[3] == run[3]]
    return sorted(objects), cells

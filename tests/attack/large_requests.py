"""Attacks by single requests that cost more than they weigh, or that weigh too much together. Each
is a generator as in connections.py."""

import itertools
import math
import threading
import time
import zlib

import grpc

import rpc
from hypermap.v1 import (catalog_service_pb2, edit_service_pb2, exploration_service_pb2,
                         geometry_pb2, layer_pb2, query_service_pb2)

import http2
from site_under_attack import PREY, server_stream, unary

_APPLY = "EditService/ApplyEdits"


def _batch(edits):
    """Returns the encoded request with these edits, as in protobuf's JSON, to the attacked map."""
    request = edit_service_pb2.ApplyEditsRequest()
    rpc.json_format.ParseDict({"map": PREY, "edits": list(edits)}, request)
    return request.SerializeToString()


def _square_ring(x, y, side):
    return {"outer": rpc.columns([(x, y), (x + side, y), (x + side, y + side), (x, y + side)])}


def _grid(name, resolution_m):
    return {"name": name, "kind": "LAYER_KIND_OCCUPANCY",
            "grid": {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": resolution_m}}


def _create_grid(site, name, resolution_m):
    with site.client() as client:
        client.CreateLayer(map=PREY, layer=_grid(name, resolution_m))


def _repeat(site, method, message, at_once, timeout_s):
    """Makes `at_once` calls at a time, again and again while the attack lasts."""
    with site.channel() as channel:
        while site.attacking():
            calls = [unary(channel, method, message, timeout_s) for _ in range(at_once)]
            for call in calls:
                site.tell_result(call)


def author_names(site):
    """A3: the author of a change is no UTF-8, or "expiry"."""
    body = http2.grpc_message(_batch([{"set_transform": {"transform": {
        "parent_frame_id": "map", "child_frame_id": "dock", "parent_from_child": {"x": 1}}}}]))
    names = [b"\xff\xfe", b"expiry", "é".encode() * 100]
    with site.client() as client:
        before = client.GetMap(map=PREY).map.revision
    yield
    while site.attacking():
        with http2.Connection(site.address) as connection:
            for name in names:
                site.tell_status(*connection.call(
                    http2.grpc_headers(_APPLY, (b"x-hypermap-author", name)), body))
    yield
    with site.client() as client:
        log = client.ListRevisions(map=PREY)
        assert log.revisions, "the log has no revisions"
        assert "expiry" not in {r.author for r in log.revisions}, "the name expiry was taken"
        wanted = client.GetMap(map=PREY).map.revision
        watch = client.Watch(scope=rpc.scope(PREY), start_revision=before)
        for answer in watch:  # Progress is told after 10 s, if there was no change.
            if answer.revision >= wanted:
                break
        watch.cancel()


def _disc_with_overlapping_holes():
    """Returns a disc of 50,000 vertices with 16,000 triangular holes of which two overlap."""
    polygon = geometry_pb2.Polygon()
    angles = [2 * math.pi * i / 50_000 for i in range(50_000)]
    polygon.outer.xs.extend(1000 * math.cos(a) for a in angles)
    polygon.outer.ys.extend(1000 * math.sin(a) for a in angles)
    places = [(10 * col - 635, 10 * row - 635) for row in range(126) for col in range(127)]
    places = places[:15_999]
    for x, y in (*places, (places[0][0] + 0.5, places[0][1] + 0.5)):
        hole = polygon.holes.add()
        hole.xs.extend((x, x + 4, x))
        hole.ys.extend((y, y, y + 4))
    return polygon


def area_with_holes(site):
    """A4: four questions at once for an area of 98,000 vertices in 16,001 rings."""
    request = query_service_pb2.QueryAreaRequest(area=_disc_with_overlapping_holes())
    request.scope.map = PREY
    message = request.SerializeToString()
    yield
    with site.channel() as channel:
        while site.attacking():
            calls = [server_stream(channel, "QueryService/QueryArea", message, 10)
                     for _ in range(4)]
            for call in calls:
                site.tell_stream(call)
    yield


def shape_with_holes(site):
    """A4: the same polygon as the shape of an object, four at once."""
    request = edit_service_pb2.ApplyEditsRequest(map=PREY)
    put = request.edits.add().put_object
    put.layer = "things"
    put.object.label = "disc"
    put.object.shape.polygon.CopyFrom(_disc_with_overlapping_holes())
    yield
    _repeat(site, _APPLY, request.SerializeToString(), 4, 10)
    yield


def many_fills(site):
    """B1: one batch of 2,000 fills of 64 M cells each, at other places."""
    _create_grid(site, "wide", 0.5)
    message = _batch({"fill_polygon": {"layer": "wide", "value": 0.5,
                                       "area": _square_ring(4000 * i, 0, 3999)}}
                     for i in range(2000))
    yield
    _repeat(site, _APPLY, message, 1, 20)
    yield


def many_aliases(site):
    """B2: one batch that sets 10,000 aliases of a layer that has aliases of 9,000 labels."""
    labels = [f"label-{i:05}" for i in range(9000)]
    with site.client() as client:
        client.ApplyEdits(map=PREY, edits=[{"set_aliases": {
            "layer": "things", "aliases": [{"alias": "all", "labels": labels}]}}])
    message = _batch({"set_aliases": {"layer": "things", "aliases": [
        {"alias": "one", "labels": [labels[i % 9000]]}]}} for i in range(10_000))
    yield
    _repeat(site, _APPLY, message, 1, 20)
    yield


def many_frames(site):
    """B3: 12,000 new frames, each in a commit of its own."""
    messages = [_batch([{"set_transform": {"transform": {
        "parent_frame_id": "map", "child_frame_id": f"frame-{i}",
        "parent_from_child": {"x": i}}}}]) for i in range(site.size(12_000, 3000))]
    yield
    with site.channel() as channel:
        for begin in range(0, len(messages), 64):
            calls = [unary(channel, _APPLY, m, 20) for m in messages[begin:begin + 64]]
            if not any([site.tell_result(call) for call in calls]):
                break  # Nothing is accepted any more.
    yield


def large_explorations(site):
    """B4: 16 explorations of almost 25 M cells each, started at once."""
    _create_grid(site, "floor", 0.05)
    # The box that counts is larger than the area by a robot's radius on each side.
    area = _square_ring(0.01, 0.01, 239)
    with site.client() as client:
        client.ApplyEdits(map=PREY, edits=[
            {"fill_polygon": {"layer": "floor", "value": 0.0, "area": area}}])
    request = exploration_service_pb2.StartExplorationRequest(
        map=PREY, occupancy_layer="floor", exploration_layer="seen", robot_radius_m=0.2)
    rpc.json_format.ParseDict(area, request.area)
    yield
    _repeat(site, "ExplorationService/StartExploration", request.SerializeToString(),
            site.size(16, 4), site.size(10, 3))
    yield


def goal_searches(site):
    """Claims of goals in explorations of five maps that want more than any view reveals.

    Another map's exploration has to be answered meanwhile.
    """
    maps = [PREY, "prey-1", "prey-2", "prey-3", "prey-4", "explored"]
    area = _square_ring(0.01, 0.01, 33)
    with site.client() as client:
        for name in maps:
            if name != PREY:
                client.CreateMap(map=name)
            client.CreateLayer(map=name, layer=_grid("floor", 0.05))
            client.ApplyEdits(map=name, edits=[
                {"fill_polygon": {"layer": "floor", "value": 0.0, "area": area}}])
            client.StartExploration(
                map=name, occupancy_layer="floor", exploration_layer="seen", area=area, range_m=4,
                min_gain_cells=4 if name == "explored" else 20_400)
    claims = [exploration_service_pb2.ClaimGoalRequest(
        map=name, robot="a", pose={"x": 16, "y": 16}).SerializeToString() for name in maps[:-1]]
    honest = exploration_service_pb2.GetExplorationRequest(map=maps[-1]).SerializeToString()
    yield
    answered = []
    with site.channel() as channel, site.channel() as other:
        while site.attacking():
            calls = [unary(channel, "ExplorationService/ClaimGoal", claim, 20)
                     for claim in claims * 4]
            answered.append(site.tell_result(
                unary(other, "ExplorationService/GetExploration", honest, 30)))
            for call in calls:
                site.tell_result(call)
    if answered and all(answered):
        site.tell("the other exploration was answered")
    yield


def unreachable_places(site):
    """Goals are claimed in an exploration of which a client has written tens of thousands of
    places that robots could not reach."""
    area = _square_ring(0.01, 0.01, 9)
    with site.client() as client:
        client.CreateLayer(map=PREY, layer=_grid("floor", 0.015))
        client.ApplyEdits(map=PREY, edits=[
            {"fill_polygon": {"layer": "floor", "value": 0.0, "area": area}}])
        started = client.StartExploration(
            map=PREY, occupancy_layer="floor", exploration_layer="seen", area=area, range_m=4)
        attributes = {
            "exploration": {"int_value": started.exploration.id},
            "robot": {"string_value": "r"}, "occupancy_version": {"int_value": 1 << 62}}
        for begin in range(0, site.size(60_000, 40_000), 5000):
            client.ApplyEdits(map=PREY, edits=[
                {"put_object": {"layer": "explorations", "object": {
                    "label": "unreachable place", "attributes": attributes,
                    "shape": {"polygon": _square_ring(1 + i % 7, 1 + i // 7 % 7, 0.01)}}}}
                for i in range(begin, begin + 5000)])
    claim = exploration_service_pb2.ClaimGoalRequest(
        map=PREY, robot="a", pose={"x": 4, "y": 4}).SerializeToString()
    yield
    with site.channel() as channel:
        while site.attacking():
            calls = [unary(channel, "ExplorationService/ClaimGoal", claim, 20) for _ in range(8)]
            for call in calls:
                site.tell_result(call)
    yield


def many_maps(site):
    """B10: more maps than there are threads for are created at once and deleted, over and over."""
    names = [f"map-{i}" for i in range(100)]
    creations = [(name, catalog_service_pb2.CreateMapRequest(map=name).SerializeToString())
                 for name in names]
    yield
    with site.channel() as channel:
        while site.attacking():
            calls = [(name, unary(channel, "CatalogService/CreateMap", message, 20))
                     for name, message in creations]
            made = [name for name, call in calls if site.tell_result(call)]
            for name in made:
                message = catalog_service_pb2.DeleteMapRequest(map=name).SerializeToString()
                site.tell_result(unary(channel, "CatalogService/DeleteMap", message, 20))
    yield
    with site.client() as client:
        left = {entry.name for entry in client.ListMaps().maps} & set(names)
        assert not left, f"{len(left)} maps were not deleted"


def compressed_message(site):
    """B5: a message of 4 MB that gzip unpacks to 4 GB."""
    megabyte = bytes(1 << 20)
    deflate = zlib.compressobj(9, zlib.DEFLATED, 31)
    packed = bytearray()
    for _ in range(site.size(4096, 1536)):
        packed += deflate.compress(megabyte)
    packed += deflate.flush()
    body = http2.grpc_message(bytes(packed), compressed=True)
    headers = http2.grpc_headers("QueryService/QueryPoint", (b"grpc-encoding", b"gzip"))
    yield
    while site.attacking():
        with http2.Connection(site.address, timeout_s=20) as connection:
            site.tell_status(*connection.call(headers, body))
    yield


def large_batches(site):
    """B7: 300 batches of 15 MB at once, from 20 connections."""
    side = 1370
    request = edit_service_pb2.ApplyEditsRequest(map=PREY)
    write = request.edits.add().write_cells
    write.layer = "grid"
    write.box.CopyFrom(layer_pb2.CellBox(row_end=side, col_end=side))
    write.values.extend(itertools.repeat(0.5, side * side))
    body = http2.grpc_message(request.SerializeToString())
    headers = http2.grpc_headers(_APPLY, (b"grpc-timeout", b"10S"))
    lock = threading.Lock()

    def send(count):
        streams = []
        try:
            with http2.Connection(site.address, http2.ATTACKER, timeout_s=20) as connection:
                for _ in range(count):
                    streams.append(connection.new_stream())
                    connection.send(
                        http2.frame(http2.HEADERS, http2.END_HEADERS, streams[-1], headers))
                    connection.send_data(streams[-1], body)
                while streams:
                    status = connection.status(streams[0])
                    streams.pop(0)
                    with lock:
                        site.tell_status(*status)
        except (http2.Closed, OSError) as error:
            with lock:
                site.tell(f"connection lost: {error}", max(len(streams), 1))

    threads = [threading.Thread(target=send, args=(site.size(15, 5),)) for _ in range(20)]
    yield
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    yield


def wide_hulls(site):
    """Observations of 40 kB with 254 detections of 15 m in size, each of which fusion keeps in cells
    of its own."""
    now = time.time()
    side = 15

    def observation(sequence):
        detections = []
        for i in range(254):
            x, y = 3 * side * i, 3 * side * sequence
            detections.append({
                "scores": [{"label": "chair", "score": 0.9}],
                "hull": _square_ring(x, y, side),
                "cells": {"origin": {"x": x, "y": y}, "resolution_m": 1, "spans": [0, 0, 1]},
                "height": {"low_m": 0, "high_m": 1}, "num_points": 10, "range_m": 3, "weight": 1})
        stamp = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(now - 60 + sequence / 100))
        return {"robot": "r", "sequence": sequence, "stamp": stamp, "detections": detections,
                "pose": {"rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "translation": [0, 0, 1]}}

    def requests():
        yield {"opening": {"map": PREY, "layer": "things"}}
        for i in itertools.count():
            if not site.attacking():
                return
            yield {"observations": [observation(i)]}

    yield
    with site.client() as client:
        while site.attacking():
            try:
                for answer in client.Observe(requests(), timeout=60):
                    for _ in answer.acknowledgements:
                        site.tell("accepted or known")
            except grpc.RpcError as error:
                site.tell_status(error.code(), error.details() or "")
    yield

"""Attacks by short requests whose answers, or what is read for them, are large. Each is a generator
as in connections.py."""

import contextlib
import time

import grpc

import rpc
import sites
from hypermap.v1 import (edit_service_pb2, ingest_service_pb2, query_service_pb2,
                         watch_service_pb2)

import http2
from site_under_attack import PREY, server_stream, unary

_POINT = "QueryService/QueryPoint"
_OBJECTS = 2000


def _put_large_objects(site):
    """Puts 2,000 objects of 4 kB on top of each other: 8 MB. Returns the revision."""
    with site.client() as client:
        for begin in range(0, _OBJECTS, 500):
            made = client.ApplyEdits(map=PREY, edits=[
                sites.put("sign", 0, 0, attributes={"a": {"string_value": "z" * 4000}})
                for _ in range(begin, begin + 500)])
    return made.revision


def _everything_near_the_origin():
    """Returns the encoded question what lies within 10,000 km of the origin."""
    request = query_service_pb2.QueryPointRequest(tolerance_m=1e7)
    request.scope.map = PREY
    request.point.x = 0.5
    return request.SerializeToString()


def unread_answers(site):
    """400 calls whose answers have 8 MB, on connections without a window for them."""
    _put_large_objects(site)
    headers, body = http2.grpc_headers(_POINT), http2.grpc_message(_everything_near_the_origin())
    yield
    connections, streams = [], []
    for i in range(site.size(400, 100)):
        if i % 20 == 0:
            connections.append(http2.Connection(site.address, http2.ATTACKER, window=0))
        stream = connections[-1].new_stream()
        connections[-1].send(http2.frame(http2.HEADERS, http2.END_HEADERS, stream, headers) +
                             http2.frame(http2.DATA, http2.END_STREAM, stream, body))
        streams.append((connections[-1], stream))
    while site.attacking():
        for connection in connections:
            connection.receive(0)
        time.sleep(0.02)
    for connection, stream in streams:
        if stream in connection.ended:
            site.tell_status(*connection.status(stream))
        else:
            site.tell("held until cancelled")
    for connection in connections:
        connection.close()
    yield


def unread_acknowledgements(site):
    """Four streams of observations that have no fields: two bytes each, and 80 times as much for the
    acknowledgement, which nobody reads."""
    opening = ingest_service_pb2.ObserveRequest(
        opening=ingest_service_pb2.ObserveOpening(map=PREY, layer="things"))
    request = ingest_service_pb2.ObserveRequest()
    for _ in range(500):
        request.observations.add()
    body = http2.grpc_message(request.SerializeToString()) * 60
    yield
    with contextlib.ExitStack() as stack:
        streams = []
        for _ in range(4):
            connection = stack.enter_context(
                http2.Connection(site.address, http2.ATTACKER, window=0, timeout_s=0.05))
            stream = connection.new_stream()
            connection.send(http2.frame(http2.HEADERS, http2.END_HEADERS, stream,
                                        http2.grpc_headers("IngestService/Observe")))
            connection.send_data(stream, http2.grpc_message(opening.SerializeToString()), end=False)
            streams.append((connection, stream))
        while site.attacking(10, 6):
            for connection, stream in streams:
                try:
                    if connection.send_data(stream, body, end=False):
                        site.tell("KB sent", len(body) >> 10)
                except http2.Closed:
                    # The server reads no more, and the rest of a message is lost with the time.
                    site.tell("not read in time")
    yield


def unread_commits(site):
    """Watches that nobody reads, each with an area of its own, while large commits are made; others
    resume before a large commit that the feed still has."""
    with site.client() as client:
        client.ApplyEdits(map=PREY, edits=[sites.write_cells([[0.5]])])
        for label in ("a" * 300, "b" * 300):
            made = client.ApplyEdits(map=PREY, edits=[
                sites.put_shape({"point": {"x": i % 100, "y": i // 100}}, label=label,
                                id=i + 1 if label[0] == "b" else 0)
                for i in range(5000)])
    yield
    connections, streams = [], []
    headers = http2.grpc_headers("WatchService/Watch")
    for i in range(site.size(900, 200)):
        if i % 50 == 0:
            # One address may have half of the watches.
            address = http2.ATTACKER if i % 100 == 0 else http2.SECOND_ATTACKER
            connections.append(http2.Connection(site.address, address, window=0))
        request = watch_service_pb2.WatchRequest()
        request.scope.map = PREY
        rpc.json_format.ParseDict(sites.square(-1 - i * 0.01, -1, 5000), request.area)
        if i % 2:
            request.start_revision = made.revision - 1
        stream = connections[-1].new_stream()
        body = http2.grpc_message(request.SerializeToString())
        connections[-1].send(http2.frame(http2.HEADERS, http2.END_HEADERS, stream, headers) +
                             http2.frame(http2.DATA, http2.END_STREAM, stream, body))
        streams.append((connections[-1], stream))
    cells = edit_service_pb2.ApplyEditsRequest(map=PREY)
    write = cells.edits.add().write_cells
    write.layer = "grid"
    write.box.row_end = write.box.col_end = 1000
    write.values.extend([0.25, 0.75] * 500_000)
    message = cells.SerializeToString()
    with site.channel() as channel:
        site.tell_result(unary(channel, "EditService/ApplyEdits", message, 60))
    while site.attacking():
        for connection in connections:
            connection.receive(0)
        time.sleep(0.02)
    for connection, stream in streams:
        if stream in connection.ended:
            site.tell_status(*connection.status(stream))
        else:
            site.tell("held until cancelled")
    for connection in connections:
        connection.close()
    yield


def wide_reaches(site):
    """64 questions at a time for everything that is near."""
    _put_large_objects(site)
    message = _everything_near_the_origin()
    yield
    with site.channel() as channel:
        while site.attacking():
            calls = [unary(channel, _POINT, message, 20) for _ in range(64)]
            for call in calls:
                site.tell_result(call)
    yield


def past_areas(site):
    """60 questions at a time about a past revision with 8 MB of objects, which nobody reads."""
    revision = _put_large_objects(site)
    with site.client() as client:
        client.ApplyEdits(map=PREY, edits=[{"set_transform": {"transform": {
            "parent_frame_id": "map", "child_frame_id": "dock", "parent_from_child": {"x": 1}}}}])
    request = query_service_pb2.QueryAreaRequest()
    request.scope.map = PREY
    request.as_of.at_revision = revision
    rpc.json_format.ParseDict(sites.square(-5000, -5000, 10000), request.area)
    message = request.SerializeToString()
    yield
    while site.attacking():
        with site.channel() as channel:
            calls = [server_stream(channel, "QueryService/QueryArea", message, 20)
                     for _ in range(60)]
            for call in calls:
                try:
                    next(call)
                    site.tell("held until cancelled")
                except grpc.RpcError:
                    site.tell_status(call.code(), call.details() or "")
            for call in calls:
                call.cancel()
    yield


def stacked_points(site):
    """Batches of 65,536 points, at each of which there are 2,000 objects."""
    _put_large_objects(site)
    opening = query_service_pb2.QueryPointsRequest()
    opening.opening.scope.map = PREY
    batch = query_service_pb2.QueryPointsRequest(xs=[0.5] * 65536, ys=[0.5] * 65536)
    messages = [opening.SerializeToString(), batch.SerializeToString()]
    yield
    with site.channel() as channel:
        method = channel.stream_stream("/hypermap.v1.QueryService/QueryPoints")
        while site.attacking():
            for call in [method(iter(messages), timeout=20) for _ in range(8)]:
                site.tell_stream(call)
    yield

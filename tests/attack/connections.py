"""Attacks by connections: too many, ones that do not speak HTTP/2, and ones that do not read.

Each attack is a generator: it prepares, yields, attacks, closes its connections, yields, and checks
what must hold afterwards (AssertionError, grpc.RpcError).
"""

import os
import random
import resource
import socket
import time

import rpc
import sites
from hypermap.v1 import query_service_pb2, watch_service_pb2

import http2
from site_under_attack import PREY


def _raise_file_limit():
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def too_many(site):
    """A1: 1,100 connections from three addresses are opened, held, and closed."""
    _raise_file_limit()
    yield
    held, closed = [], 0
    for i in range(1100):
        try:
            held.append(http2.Connection(site.address, f"127.0.0.{2 + i % 3}", timeout_s=1))
        except (http2.Closed, OSError):
            closed += 1
    while site.attacking():
        for connection in list(held):
            try:
                connection.receive(0)
            except http2.Closed:
                connection.close()
                held.remove(connection)
                closed += 1
        time.sleep(0.05)
    site.tell(f"{closed} of 1100 closed at once")
    for connection in held:
        connection.close()
    yield


def random_bytes(site):
    """Bytes that are no HTTP/2, damaged frames, and other protocols, over and over."""
    generator = random.Random(1)
    host, port = site.address.rsplit(":", 1)
    settings = http2.frame(http2.SETTINGS, 0, 0)
    headers = http2.grpc_headers("QueryService/QueryPoint")

    def broken_frames():
        sent = bytearray(settings +
                         http2.frame(http2.HEADERS, http2.END_HEADERS, 1, headers) +
                         http2.frame(http2.DATA, 0, 1, bytes(99)))
        for _ in range(4):
            sent[generator.randrange(len(sent))] = generator.randrange(256)
        return http2.PREFACE + sent

    kinds = [
        lambda: generator.randbytes(4096),
        lambda: http2.PREFACE + generator.randbytes(4096),
        broken_frames,
        lambda: b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
        lambda: b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + generator.randbytes(506),
        lambda: http2.PREFACE + settings + http2.frame(
            http2.HEADERS, http2.END_HEADERS, 1, http2.header_block([(b"a", bytes(60_000))])),
        lambda: http2.PREFACE + settings + b"\xff\xff\xff" + bytes([http2.DATA, 0, 0, 0, 0, 1]),
        lambda: http2.PREFACE + settings + http2.frame(http2.WINDOW_UPDATE, 0, 0, bytes(4)),
        lambda: http2.PREFACE + settings * 1000,
    ]
    yield
    open_connections = []
    while site.attacking():
        for kind in kinds:
            connection = socket.create_connection((host, int(port)), timeout=10)
            try:
                connection.sendall(kind())
            except OSError:
                pass  # The server has closed it before it had all bytes.
            open_connections.append(connection)
            site.tell("connections")
        while len(open_connections) > 100:
            open_connections.pop(0).close()
    for connection in open_connections:
        connection.close()
    yield


def slow_readers(site):
    """900 watches and 500 answers that nobody reads, while the map changes."""
    watch = watch_service_pb2.WatchRequest(coalesce=True)
    watch.scope.map = PREY
    area = query_service_pb2.QueryAreaRequest()
    area.scope.map = PREY
    rpc.json_format.ParseDict(sites.square(-5000, -5000, 10000), area.area)
    # One address may have half of the watches.
    calls = [("WatchService/Watch", watch.SerializeToString(), site.size(900, 300),
              (http2.ATTACKER, http2.SECOND_ATTACKER)),
             ("QueryService/QueryArea", area.SerializeToString(), site.size(500, 200),
              (http2.ATTACKER,))]
    with site.client() as client:
        ids = sorted(sites.labels(client, PREY))
    yield
    connections = []
    for method, message, count, addresses in calls:
        headers, body = http2.grpc_headers(method), http2.grpc_message(message)
        for i in range(count):
            if i % 100 == 0:
                # Half of the connections have no window for answers; the others are not read.
                window = 0 if i % 200 == 0 else 65535
                address = addresses[i // 200 % len(addresses)]
                connections.append(http2.Connection(site.address, address, window=window))
            stream = connections[-1].new_stream()
            connections[-1].send(
                http2.frame(http2.HEADERS, http2.END_HEADERS, stream, headers) +
                http2.frame(http2.DATA, http2.END_STREAM, stream, body))
        site.tell(f"{count} of {method.split('/')[1]} unread")
    # The map does not grow: its first objects are replaced again and again.
    with site.client() as client:
        while site.attacking():
            client.ApplyEdits(map=PREY, edits=[
                sites.put(os.urandom(4).hex(), i, 10, id=ids[i]) for i in range(100)])
            site.tell("commits meanwhile")
    for connection in connections:
        connection.close()
    yield

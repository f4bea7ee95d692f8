"""Very many clients that do little: others are served, and memory stays as it is.

The numbers are those of an attack that was withstood: 1,000 watches with areas of 2,000 vertices,
1,000 connections whose headers come byte by byte, 2,000 connections that do nothing.
"""

import math
import os
import pathlib
import re
import resource
import socket
import time
import unittest

import grpc
from google.protobuf import json_format
from hypermap.v1 import watch_service_pb2

import rpc
import sites
from asking import Asking
from processes import DEADLINE_S, IS_SANITIZED, SiteTest

MIB = 1 << 20
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
SETTINGS = b"\0\0\0\4\0\0\0\0\0"
# A frame of HEADERS that is not the last, on stream 1, with room for 200 bytes.
HEADERS = b"\0\0\xc8\1\0\0\0\0\1"
# A header field without an index: its name has one byte, and its value, of which bytes can be sent
# on and on, 100.
FIELD = b"\0\1a\x64"


def resident(pid):
    """Returns the resident memory of a process in bytes."""
    status = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(re.search(r"VmRSS:\s+(\d+) kB", status)[1]) * 1024


def sockets(pid):
    """Returns the number of open sockets of a process."""
    count = 0
    for entry in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        try:
            count += os.readlink(entry).startswith("socket:")
        except OSError:
            pass  # It was closed meanwhile.
    return count


def disc(x, vertices):
    """Returns a Polygon that is almost a disc of 10 m around (x, 0)."""
    angles = [2 * math.pi * i / vertices for i in range(vertices)]
    return {"outer": rpc.columns([(x + 10 * math.cos(a), 10 * math.sin(a)) for a in angles])}


class ManyClients(SiteTest):

    def start(self, *flags):
        self.site = self.server(*flags)
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)
        sites.make(self.client, "other")
        self.other = Asking(self.site.address, "other")
        self.other.start()
        self.addCleanup(self.other.stop)

    def assert_others_are_served(self):
        self.assertTrue(self.other.await_answer(), self.other.error)
        with rpc.Client(self.site.address) as newcomer:
            newcomer.GetMap(map="other")

    def assert_grown_at_most(self, most, before, what):
        """The server has taken at most this much memory since it had `before` bytes."""
        grown = resident(self.site.pid) - before
        print(f"{grown / MIB:.0f} MiB for {what}, from {before / MIB:.0f} MiB")
        if not IS_SANITIZED:
            self.assertLess(grown, most)

    def connect(self, count):
        """Returns connections on which the server has answered to SETTINGS. They come from several
        addresses, because new ones of one address would have to wait."""
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        # The server's files, and those of its maps, are as many again.
        if hard != resource.RLIM_INFINITY and hard < 4 * count:
            self.skipTest(f"a process may have {hard} open files only")
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        host, port = self.site.address.split(":")
        connections = []
        for i in range(count):
            connections.append(self.enterContext(socket.create_connection(
                (host, int(port)), timeout=DEADLINE_S, source_address=(f"127.0.0.{2 + i % 4}", 0))))
            connections[-1].sendall(PREFACE + SETTINGS)
        for connection in connections:
            self.assertTrue(connection.recv(9), "a connection was closed")
        return connections

    def assert_sockets_are_closed(self, before):
        deadline = time.monotonic() + DEADLINE_S
        # Those of others come and go.
        while sockets(self.site.pid) > before + 20:
            self.assertLess(time.monotonic(), deadline, "connections stay open")
            time.sleep(0.05)

    def test_watches_with_large_areas(self):
        self.start("--max_watchers=2000", "--max_request_bytes=8589934592")
        before = resident(self.site.pid)
        watches = []
        request = json_format.ParseDict({"scope": rpc.scope("site"), "area": disc(0.0, 2000)},
                                        watch_service_pb2.WatchRequest())
        for _ in range(1000):
            request.area.outer.xs[:] = [x + 0.001 for x in request.area.outer.xs]
            watches.append(self.client.Watch(request))
        for watch in watches:
            next(watch)
        self.assert_others_are_served()
        revision = self.client.ApplyEdits(map="site", edits=[sites.put("cup", 0, 0)]).revision
        for watch in watches:
            self.assertEqual(next(answer.revision for answer in watch if answer.changes), revision)
        self.assert_others_are_served()
        self.assert_grown_at_most(512 * MIB, before, "1,000 watches")
        for watch in watches:
            watch.cancel()

    def test_headers_that_come_byte_by_byte(self):
        self.start()
        sockets_before = sockets(self.site.pid)
        connections = self.connect(1000)
        for connection in connections:
            connection.sendall(HEADERS + FIELD)
        self.assert_others_are_served()
        before = resident(self.site.pid)
        for _ in range(20):
            for connection in connections:
                connection.sendall(b"x")
            self.assert_others_are_served()
        self.assert_grown_at_most(32 * MIB, before, "1,000 headers that come byte by byte")
        for connection in connections:
            connection.close()
        self.assert_sockets_are_closed(sockets_before)
        self.assert_others_are_served()

    def test_idle_connections(self):
        self.start()
        sockets_before, before = sockets(self.site.pid), resident(self.site.pid)
        connections = self.connect(2000)
        self.assert_others_are_served()
        print(f"{(resident(self.site.pid) - before) / MIB:.0f} MiB for 2,000 connections")
        for connection in connections:
            connection.close()
        self.assert_sockets_are_closed(sockets_before)
        self.assert_others_are_served()


if __name__ == "__main__":
    unittest.main()

"""Hostile files, frames and headers: each is refused without an internal error, leaves nothing
behind, and does not keep the server from answering others."""

import contextlib
import pathlib
import socket
import struct
import sys
import unittest

import grpc
from hypermap.v1 import edit_service_pb2, query_service_pb2

import rpc
import sites
from hostile_files import GOOD, LIMITS, odd_files, upload, uploads
from processes import DEADLINE_S, ROOT, SiteTest
from test_all_at_once import files_of, wait_until_at_most
from test_bad_input import EXHAUSTED, INVALID, NOT_FOUND

sys.path.append(str(ROOT / "tests" / "attack"))
import http2  # pylint: disable=wrong-import-position


class HostileFiles(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server(*LIMITS)
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)

    def test_each_is_refused_and_leaves_nothing_behind(self):
        outside = self.folder / "outside"
        outside.mkdir()
        before, revision, open_files = (set(self.folder.rglob("*")), sites.revision(self.client),
                                        files_of(self.site.pid))
        for what, requests in uploads(outside):
            for name in ("new", "site"):
                with self.subTest(what, map=name):
                    with self.assertRaises(grpc.RpcError) as caught:
                        self.client.ImportMap(requests(name))
                    self.assertIn(caught.exception.code(), (INVALID, EXHAUSTED, NOT_FOUND),
                                  caught.exception.details())
                    self.assertEqual([m.name for m in self.client.ListMaps().maps], ["site"])
        self.assertEqual(sites.revision(self.client), revision)
        self.assertEqual(set(self.folder.rglob("*")), before)
        self.assertFalse(pathlib.Path("/etc/hypermap-x").exists())
        wait_until_at_most(self.site.pid, files_of, open_files)
        # Good files are still imported.
        self.client.ImportMap(upload("FILE_FORMAT_HMAP", ("x.hmap", GOOD))("new"))
        self.assertEqual(list(sites.labels(self.client, "new", "s").values()), ["x"])

    def read(self, name):
        """Reads all of a map, in the frames that it has, in all formats."""
        frames = {t.child_frame_id for t in self.client.ListTransforms(map=name).transforms}
        for frame in {"", *frames}:
            scope = rpc.scope(name, frame_id=frame)
            for x in (0, 1e9, -1e300, 1e300, 1.7e308):
                point = rpc.point(x, 1)
                self.client.QueryPoint(scope=scope, point=point)
                for value in ("x", "occupied", "free"):
                    self.client.QueryNearest(scope=scope, point=point, value=value, k=3)
            list(self.client.QueryArea(scope=scope, area=sites.square(-5000, -5000, 10000)))
            for value in ("x", "occupied", "free", "tag:a"):
                list(self.client.QueryValue(scope=scope, value=value))
            list(self.client.ListChanges(scope=scope, from_revision=0))
        for file_format in ("HMAP", "GEOJSON"):
            list(self.client.ExportMap(map=name, format=f"FILE_FORMAT_{file_format}"))
        list(self.client.BackupMap(map=name))
        self.assertFalse(self.client.CheckMap(map=name).findings)

    def test_maps_of_odd_files_can_be_asked_exported_and_deleted(self):
        for what, file_format, files in odd_files():
            with self.subTest(what):
                self.client.ImportMap(upload(f"FILE_FORMAT_{file_format}", *files)("new"))
                self.read("new")
                self.client.DeleteMap(map="new")
        self.assertTrue(self.site.running())


def setting(identifier, value):
    return http2.frame(http2.SETTINGS, 0, 0, http2.setting(identifier, value))


PRIORITY, PUSH_PROMISE, CONTINUATION = 2, 5, 9
ENABLE_PUSH, HEADER_TABLE_SIZE, UNKNOWN_SETTING = 2, 1, 0xfff0
PADDED = 8
POINT_HEADERS = http2.grpc_headers("QueryService/QueryPoint")


def begin(stream=1, flags=http2.END_HEADERS, block=POINT_HEADERS):
    """Returns the frame that begins a call."""
    return http2.frame(http2.HEADERS, flags, stream, block)


def window(stream, value):
    return http2.frame(http2.WINDOW_UPDATE, 0, stream, struct.pack(">I", value))


# Bytes that are sent instead of the preface of HTTP/2.
PREFACES = [
    ("nothing", b""), ("half of the preface", http2.PREFACE[:12]),
    ("a wrong preface", http2.PREFACE.replace(b"SM", b"XX")),
    ("HTTP/1.1", b"POST /hypermap.v1.QueryService/QueryPoint HTTP/1.1\r\nHost: x\r\n\r\n"),
    ("an upgrade",
     b"GET / HTTP/1.1\r\nHost: x\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABk\r\n\r\n"),
    ("a call before the settings", http2.PREFACE + begin()),
    ("the preface twice", http2.PREFACE * 2),
]

# Bytes that are sent after the preface and the settings.
FRAMES = [
    ("a frame that is longer than what comes",
     b"\x00\x40\x00" + bytes([http2.DATA, 0, 0, 0, 0, 1])),
    ("a frame of 16 MB", b"\xff\xff\xff" + bytes([http2.HEADERS, 4, 0, 0, 0, 1]) + bytes(100_000)),
    ("half of a frame's header", b"\x00\x00\x08\x06"),
    ("an unknown type", http2.frame(0xfa, 0xff, 0, bytes(100))),
    ("an unknown type within a header block",
     begin(flags=0) + http2.frame(0xfa, 0, 1) + http2.frame(CONTINUATION, 4, 1)),
    ("settings of 5 bytes", http2.frame(http2.SETTINGS, 0, 0, bytes(5))),
    ("settings of a stream", http2.frame(http2.SETTINGS, 0, 1, http2.setting(3, 1))),
    ("an acknowledgement with settings",
     http2.frame(http2.SETTINGS, http2.ACK, 0, http2.setting(3, 1))),
    ("acknowledgements of no settings", 100 * http2.frame(http2.SETTINGS, http2.ACK, 0)),
    ("push 2", setting(ENABLE_PUSH, 2)),
    ("a window of 2^31", setting(http2.INITIAL_WINDOW_SIZE, 1 << 31)),
    ("a window of 2^31 - 1, then less",
     begin() + setting(http2.INITIAL_WINDOW_SIZE, (1 << 31) - 1) +
     setting(http2.INITIAL_WINDOW_SIZE, 0)),
    ("frames of 0 bytes", setting(http2.MAX_FRAME_SIZE, 0)),
    ("frames of 2^24 bytes", setting(http2.MAX_FRAME_SIZE, 1 << 24)),
    ("a header table of 2^32 - 1 bytes", setting(HEADER_TABLE_SIZE, (1 << 32) - 1)),
    ("an unknown setting", setting(UNKNOWN_SETTING, 1)),
    ("a window update of 0", window(0, 0)),
    ("a window update of 0 of a call", begin() + window(1, 0)),
    ("a window above 2^31", 2 * window(0, (1 << 31) - 1)),
    ("a call's window above 2^31", begin() + 2 * window(1, (1 << 31) - 1)),
    ("a window update of 3 bytes", http2.frame(http2.WINDOW_UPDATE, 0, 0, bytes(3))),
    ("a window update of an idle stream", window(9, 1)),
    ("a call on an even stream", begin(2)),
    ("a call on stream 0", begin(0)),
    ("a call on the last stream", begin((1 << 31) - 1)),
    ("streams in descending order", begin(9) + begin(7) + begin(5)),
    ("headers twice", begin() + begin()),
    ("more padding than there is",
     begin(flags=http2.END_HEADERS | PADDED, block=b"\xff" + bytes(9))),
    ("headers with a priority that is cut", begin(flags=http2.END_HEADERS | 0x20, block=bytes(3))),
    ("a continuation without headers", http2.frame(CONTINUATION, 4, 1, POINT_HEADERS)),
    ("a ping within a header block", begin(flags=0) + http2.frame(http2.PING, 0, 0, bytes(8))),
    ("a continuation on another stream", begin(flags=0) + http2.frame(CONTINUATION, 4, 3)),
    ("a header block without end", begin(flags=0) + 1000 * http2.frame(CONTINUATION, 0, 1)),
    ("an index 0 of the header table", begin(block=b"\x80")),
    ("an index beyond the header table", begin(block=b"\xff\xff\x03")),
    ("an integer beyond 64 bits", begin(block=b"\x7f" + b"\xff" * 12)),
    ("a header that is cut", begin(block=b"\0\x05ab")),
    ("a wrong Huffman code", begin(block=b"\0\x84\xff\xff\xff\xff\x01a")),
    ("a larger header table than allowed", begin(block=b"\x3f\xe1\xff\xff\x0f")),
    ("a push promise", http2.frame(PUSH_PROMISE, 4, 1, struct.pack(">I", 2) + POINT_HEADERS)),
    ("a stream that depends on itself", http2.frame(PRIORITY, 0, 1, struct.pack(">IB", 1, 9))),
    ("a priority of 4 bytes", http2.frame(PRIORITY, 0, 1, bytes(4))),
    ("a priority of no stream", http2.frame(PRIORITY, 0, 0, bytes(5))),
    ("a ping of 7 bytes", http2.frame(http2.PING, 0, 0, bytes(7))),
    ("a ping of a stream", http2.frame(http2.PING, 0, 1, bytes(8))),
    ("pings of no bytes", 1000 * http2.frame(http2.PING, 0, 0)),
    ("10,000 pings", 10_000 * http2.frame(http2.PING, 0, 0, bytes(8))),
    ("answers to no pings", 1000 * http2.frame(http2.PING, http2.ACK, 0, bytes(8))),
    ("data of an idle stream", http2.frame(http2.DATA, 0, 5, bytes(100))),
    ("data of stream 0", http2.frame(http2.DATA, 0, 0, bytes(100))),
    ("data after the end", begin(flags=5) + http2.frame(http2.DATA, 0, 1, bytes(100))),
    ("data of padding only", begin() + http2.frame(http2.DATA, PADDED, 1, b"\xff")),
    ("more data than the window", begin() + 10 * http2.frame(http2.DATA, 0, 1, bytes(16384))),
    ("empty data", begin() + 10_000 * http2.frame(http2.DATA, 0, 1)),
    ("a goodbye", http2.frame(http2.GOAWAY, 0, 0, bytes(8)) + begin()),
    ("a goodbye of 4 bytes", http2.frame(http2.GOAWAY, 0, 0, bytes(4))),
    ("a goodbye of a stream", http2.frame(http2.GOAWAY, 0, 1, bytes(8))),
    ("a reset of an idle stream", http2.frame(http2.RST_STREAM, 0, 7, bytes(4))),
    ("a reset of stream 0", http2.frame(http2.RST_STREAM, 0, 0, bytes(4))),
    ("a reset of 3 bytes", begin() + http2.frame(http2.RST_STREAM, 0, 1, bytes(3))),
]

# Fields of a call, in order.
FIELDS = {b":method": b"POST", b":scheme": b"http",
          b":path": b"/hypermap.v1.EditService/ApplyEdits", b":authority": b"localhost",
          b"te": b"trailers", b"content-type": b"application/grpc"}


def fields(*more, **changed):
    """Returns the header block of a call whose fields of these names (with _ for - and without the
    colon) have another value, or none if it is None, with more fields after them."""
    changed = {name.replace("_", "-").encode(): value for name, value in changed.items()}
    own = [(name, changed.get(name.strip(b":"), value)) for name, value in FIELDS.items()]
    return http2.header_block([*((n, v) for n, v in own if v is not None), *more])


# Calls that must not be carried out: (description, header block).
REFUSED_HEADERS = [
    ("no path", fields(path=None)), ("an empty path", fields(path=b"")),
    ("a path without a slash", fields(path=b"hypermap.v1.EditService.ApplyEdits")),
    ("a path with folders", fields(path=b"/x/../hypermap.v1.EditService/ApplyEdits")),
    ("a path of 4,000 bytes", fields(path=b"/" + b"x" * 4000)),
    ("a path with a question", fields(path=FIELDS[b":path"] + b"?x=1")),
    ("no method", fields(method=None)), ("the method GET", fields(method=b"GET")),
    ("the method CONNECT", fields(method=b"CONNECT")), ("no scheme", fields(scheme=None)),
    ("an unknown scheme", fields(scheme=b"gopher")), ("no te", fields(te=None)),
    ("another te", fields(te=b"gzip")),
    # The field x enters the header table of the connection, as number 62.
    ("a field of 3,000 bytes, 10,000 times",
     fields() + b"\x40\x01x\x7f\xb9\x16" + b"v" * 3000 + b"\xbe" * 10_000),
]

# Calls that gRPC may carry out.
TOLERATED_HEADERS = [
    ("an unknown compression", fields((b"grpc-encoding", b"evil"))),
    ("an unknown pseudo field", fields((b":evil", b"1"))),
    ("a value with a zero", fields((b"x", b"1\0"))),
    ("a value with a line break", fields((b"x", b"1\r\nhost: evil"))),
    ("a name with blanks", fields((b"a b", b"1"))), ("an empty name", fields((b"", b"1"))),
    ("a name in upper case", fields((b"X-Upper", b"1"))),
    ("another path in addition", fields((b":path", b"/evil"))),
    ("no content type", fields(content_type=None)),
    ("another content type", fields(content_type=b"text/html")),
    ("no authority", fields(authority=None)),
    ("a field of HTTP/1.1", fields((b"connection", b"close"))),
    ("a wrong length", fields((b"content-length", b"-1"))),
    ("binary metadata that is not base64", fields((b"x-bin", b"***"))),
    *((f"the timeout {text}", fields((b"grpc-timeout", text)))
      for text in (b"-1S", b"-9223372036854775808n", b"", b"1", b"S", b"1X", b"1.5S", b"0x10S",
                   b"99999999H", b"99999999999999999999H", b" 1S", b"0n")),
]


class HostileConnections(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)
        point = query_service_pb2.QueryPointRequest()
        point.scope.map = "site"
        point.point.x = 1
        self.question = http2.grpc_message(point.SerializeToString())
        edit = edit_service_pb2.ApplyEditsRequest()
        rpc.json_format.ParseDict({"map": "site", "edits": [sites.put("x", 0, 0)]}, edit)
        self.edit = http2.grpc_message(edit.SerializeToString())

    def assert_others_are_answered(self):
        """Asks on a connection from before and on a new one."""
        self.client.QueryPoint(scope=rpc.scope("site"), point=rpc.point(1, 0))
        with http2.Connection(self.site.address, timeout_s=DEADLINE_S) as connection:
            self.assertEqual(connection.call(POINT_HEADERS, self.question), (0, ""))

    def send_and_half_close(self, data):
        """Sends bytes and no more, and reads until the server closes the connection."""
        host, port = self.site.address.rsplit(":", 1)
        with socket.create_connection((host, int(port)), timeout=DEADLINE_S) as connection:
            try:
                connection.sendall(data)
                connection.shutdown(socket.SHUT_WR)
                while connection.recv(1 << 16):
                    pass
            except TimeoutError:
                raise
            except OSError:
                pass  # The server closed it before everything was sent or read.

    def test_odd_frames_end_at_most_their_own_connection(self):
        before = files_of(self.site.pid)
        hello = http2.PREFACE + http2.frame(http2.SETTINGS, 0, 0)
        for what, data in [*PREFACES, *((what, hello + data) for what, data in FRAMES)]:
            with self.subTest(what):
                self.send_and_half_close(data)
                self.assert_others_are_answered()
        wait_until_at_most(self.site.pid, files_of, before)
        self.assertTrue(self.site.running())

    def call(self, headers, body):
        """Makes a call on a connection of its own. Returns gRPC's status, or None if the server
        answers without one or closes the connection."""
        with (http2.Connection(self.site.address, timeout_s=DEADLINE_S) as connection,
              contextlib.suppress(http2.Closed)):
            return connection.call(headers, body)[0]
        return None

    def test_calls_with_odd_headers_are_not_carried_out(self):
        revision = sites.revision(self.client)
        for what, headers in REFUSED_HEADERS:
            with self.subTest(what):
                self.assertNotEqual(self.call(headers, self.edit), 0)
                self.assert_others_are_answered()
                self.assertEqual(sites.revision(self.client), revision)
        self.assertEqual(self.call(fields(), self.edit), 0)
        self.assertEqual(sites.revision(self.client), revision + 1)

    def test_a_deadline_may_be_centuries_ahead(self):
        for hours in (b"2000000H", b"2500000H", b"99999999H"):
            with self.subTest(hours):
                self.assertEqual(self.call(fields((b"grpc-timeout", hours)), self.edit), 0)

    def test_calls_with_other_odd_headers_harm_nobody(self):
        compressed = http2.grpc_message(self.edit[5:], compressed=True)
        for what, headers, body in (
                *((what, headers, self.edit) for what, headers in TOLERATED_HEADERS),
                ("two messages", fields(), 2 * self.edit),
                ("a compressed message without a compression", fields(), compressed)):
            with self.subTest(what):
                self.call(headers, body)
                self.assert_others_are_answered()
        self.assertTrue(self.site.running())

    def test_odd_messages_are_not_carried_out(self):
        revision, size = sites.revision(self.client), len(self.edit) - 5
        message = self.edit[5:]
        for what, body in (
                ("half of a length", bytes(3)),
                ("no message", http2.grpc_message(b"")),
                ("a length above the message's", struct.pack(">BI", 0, size + 1) + message),
                ("a length below the message's", struct.pack(">BI", 0, size - 1) + message),
                ("a length of 4 GiB", struct.pack(">BI", 0, (1 << 32) - 1) + message),
                ("an unknown flag", struct.pack(">BI", 7, size) + message),
                ("bytes that are no message", http2.grpc_message(b"\xff" * 100)),
                ("a group without end", http2.grpc_message(b"\x0b" * 100_000)),
                ("invalid UTF-8", http2.grpc_message(message.replace(b"things", b"\xff\xfeings")))):
            with self.subTest(what):
                self.assertNotEqual(self.call(fields(), body), 0)
                self.assert_others_are_answered()
                self.assertEqual(sites.revision(self.client), revision)


if __name__ == "__main__":
    unittest.main()

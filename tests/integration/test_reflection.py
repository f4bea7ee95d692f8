"""grpcurl can call the server and its health service without .proto files, and streams of
reflection cost the server no thread each and are counted among its calls."""

import json
import os
import pathlib
import queue
import shutil
import signal
import subprocess
import sys
import time
import unittest

import grpc

import rpc
import sites
from processes import DEADLINE_S, ROOT, SiteTest
from test_all_at_once import threads_of

sys.path.append(str(ROOT / "tests" / "attack"))
import http2  # pylint: disable=wrong-import-position

VERSIONS = ("v1", "v1alpha")
# Encoded requests of reflection: for all services, and for a symbol that does not exist.
LIST_SERVICES, NO_SYMBOL = b"\x3a\x01*", b"\x22\x03a.b"
MOST_BYTES = 64 << 10

GRPCURL = shutil.which("grpcurl", path=os.pathsep.join([
    str(pathlib.Path(os.environ.get("HYPERMAP_TOOLS", ""), "bin")), os.environ["PATH"]]))


@unittest.skipUnless(GRPCURL, "grpcurl is not installed")
class Reflection(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()

    def grpcurl(self, *arguments, request=None):
        options = [] if request is None else ["-d", json.dumps(request)]
        return subprocess.run([GRPCURL, "-plaintext", *options, f"localhost:{self.site.port}",
                               *arguments], capture_output=True, text=True, timeout=DEADLINE_S,
                              check=False)

    def test_services_are_listed(self):
        listed = self.grpcurl("list").stdout.split()
        for service in ("hypermap.v1.CatalogService", "hypermap.v1.QueryService",
                        "hypermap.v1.EditService", "hypermap.v1.IngestService",
                        "hypermap.v1.ExplorationService", "hypermap.v1.RobotService",
                        "hypermap.v1.ServerService", "hypermap.v1.WatchService",
                        "grpc.health.v1.Health", "grpc.reflection.v1.ServerReflection",
                        "grpc.reflection.v1alpha.ServerReflection"):
            self.assertIn(service, listed)

    def test_each_service_that_is_listed_is_described(self):
        described = self.grpcurl("describe").stdout
        for service in self.grpcurl("list").stdout.split():
            self.assertIn(f"{service} is a service:", described)

    def test_both_versions_answer_alike(self):
        for question in ({"host": "x", "list_services": "*"},
                         {"file_containing_symbol": "hypermap.v1.QueryService"},
                         {"file_containing_symbol": "hypermap.v1.QueryService.NoMethod"}):
            answers = [self.grpcurl(f"grpc.reflection.{version}.ServerReflection/"
                                    "ServerReflectionInfo", request=question).stdout
                       for version in VERSIONS]
            self.assertEqual(answers[0], answers[1])
            self.assertEqual(json.loads(answers[0])["original_request"], question)

    def test_rpcs_are_described(self):
        described = self.grpcurl("describe", "hypermap.v1.QueryService").stdout
        self.assertIn("rpc QueryArea ( .hypermap.v1.QueryAreaRequest ) "
                      "returns ( stream .hypermap.v1.QueryAreaResponse )", described)

    def test_a_point_is_answered(self):
        with rpc.Client(self.site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", edits=[sites.put("cup", 1, 1)])
        answer = self.grpcurl("hypermap.v1.QueryService/QueryPoint",
                              request={"scope": {"map": "site"}, "point": {"x": 1.5, "y": 1.5}})
        self.assertEqual(answer.returncode, 0, answer.stderr)
        layers = {layer["layer"]: layer for layer in json.loads(answer.stdout)["layers"]}
        self.assertEqual(layers["things"]["objects"][0]["label"], "cup")
        self.assertEqual(layers["adrift"]["status"], "ANSWER_STATUS_NO_TRANSFORM")

    def test_a_point_that_is_not_finite_is_refused_by_name(self):
        with rpc.Client(self.site.address) as client:
            sites.make(client)
        for number in ("NaN", "Infinity", "-Infinity"):
            answer = self.grpcurl("hypermap.v1.QueryService/QueryPoint",
                                  request={"scope": {"map": "site"},
                                           "point": {"x": number, "y": 0}})
            self.assertIn("InvalidArgument", answer.stderr)
            self.assertIn("point", answer.stderr)

    def test_it_is_healthy(self):
        answer = self.grpcurl("grpc.health.v1.Health/Check", request={})
        self.assertEqual(json.loads(answer.stdout), {"status": "SERVING"})


def path(version):
    return f"/grpc.reflection.{version}.ServerReflection/ServerReflectionInfo"


def headers(version):
    """Returns the header block of a call."""
    return http2.header_block([
        (b":method", b"POST"), (b":scheme", b"http"), (b":path", path(version).encode()),
        (b":authority", b"localhost"), (b"te", b"trailers"),
        (b"content-type", b"application/grpc")])


class ReflectionStreams(SiteTest):

    def call(self, site, version, *requests):
        """Makes a call with encoded requests. Returns the encoded answers."""
        with grpc.insecure_channel(site.address) as channel:
            answers = channel.stream_stream(path(version))(iter(requests), timeout=DEADLINE_S)
            return list(answers)

    def refused(self, site, version, *requests):
        with self.assertRaises(grpc.RpcError) as caught:
            self.call(site, version, *requests)
        return caught.exception.code(), caught.exception.details()

    def open_streams(self, connection, count):
        """Opens streams that have got an answer and stay open."""
        streams = []
        for i in range(count):
            streams.append(connection.new_stream())
            connection.send(http2.frame(http2.HEADERS, http2.END_HEADERS, streams[-1],
                                        headers(VERSIONS[i % 2])))
            connection.send_data(streams[-1], http2.grpc_message(LIST_SERVICES), end=False)
        while not all(stream in connection.fields for stream in streams):
            connection.receive(DEADLINE_S)
        return streams

    def test_requests_of_a_stream_are_answered_in_order(self):
        site = self.server()
        for version in VERSIONS:
            answers = self.call(site, version, LIST_SERVICES, NO_SYMBOL, LIST_SERVICES)
            self.assertEqual(len(answers), 3)
            self.assertIn(b"hypermap.v1.QueryService", answers[0])
            self.assertIn(b'no symbol "a.b"', answers[1])
            self.assertEqual(answers[2], answers[0])

    def test_large_and_malformed_requests_end_the_stream(self):
        site = self.server()
        for version in VERSIONS:
            code, message = self.refused(site, version, LIST_SERVICES, bytes(MOST_BYTES + 1))
            self.assertEqual(code, grpc.StatusCode.RESOURCE_EXHAUSTED)
            self.assertIn(str(MOST_BYTES), message)
            code, _ = self.refused(site, version, b"\x22\x09short")
            self.assertEqual(code, grpc.StatusCode.INVALID_ARGUMENT)

    def test_open_streams_take_no_threads(self):
        site = self.server()
        self.call(site, "v1", LIST_SERVICES)
        with http2.Connection(site.address, timeout_s=DEADLINE_S) as connection:
            self.open_streams(connection, 10)
            before = threads_of(site.pid).total()
            self.open_streams(connection, 500)
            # gRPC's own pools may grow a little.
            self.assertLess(threads_of(site.pid).total(), before + 50)

    def test_streams_count_as_calls_and_leave_half_for_others(self):
        site = self.server("--max_calls=20")
        with http2.Connection(site.address, source=http2.ATTACKER,
                              timeout_s=DEADLINE_S) as connection:
            self.open_streams(connection, 11)
            (refused,) = connection.ended
            code, message = connection.status(refused)
            self.assertEqual(code, grpc.StatusCode.RESOURCE_EXHAUSTED.value[0])
            self.assertIn("--max_calls", message)
            self.assertEqual(len(self.call(site, "v1", LIST_SERVICES)), 1)
        # Soon after the connection was closed, its calls are given back.
        deadline = time.monotonic() + DEADLINE_S
        with http2.Connection(site.address, source=http2.ATTACKER,
                              timeout_s=DEADLINE_S) as connection:
            while self.open_streams(connection, 1)[0] in connection.ended:
                self.assertLess(time.monotonic(), deadline)

    def test_an_open_stream_does_not_hold_up_the_shutdown(self):
        site, requests = self.server("--grace=1h"), queue.Queue()
        requests.put(LIST_SERVICES)
        with grpc.insecure_channel(site.address) as channel:
            answers = channel.stream_stream(path("v1"))(iter(requests.get, None))
            next(answers)
            site.signal(signal.SIGTERM)
            with self.assertRaises(grpc.RpcError) as caught:
                next(answers)
            requests.put(None)
        self.assertEqual(caught.exception.code(), grpc.StatusCode.UNAVAILABLE)
        self.assertIn("stopping", caught.exception.details())
        self.assertEqual(site.wait(), 0)


if __name__ == "__main__":
    unittest.main()

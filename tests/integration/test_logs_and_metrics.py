"""What a server tells those who run it: its log as JSON, its metrics by HTTP, and its health."""

import collections
import concurrent.futures
import json
import re
import time
import urllib.error
import urllib.request

import grpc

import rpc
import sites
from processes import DEADLINE_S, SiteTest

TRACE_ID = "4bf92f3577b34da6a3ce929d0e0e4736"
TRACEPARENT = f"00-{TRACE_ID}-00f067aa0ba902b7-01"


class Observed(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server("--log_format=json", "--metrics_listen=127.0.0.1:0")
        self.client = self.enterContext(rpc.Client(self.site.address))
        (listens,) = self.lines("metrics are served")
        self.http = f"http://{listens['address']}"

    def lines(self, message, **fields):
        """Returns the lines of the log with this message and these fields. All must be JSON."""
        lines = [json.loads(line) for line in self.site.log().splitlines()]
        return [line for line in lines if {"message": message, **fields}.items() <= line.items()]

    def ask_for_nothing(self, *metadata):
        """Asks for a map that there isn't; returns the request id of the answer."""
        with rpc.Client(self.site.address, metadata=metadata) as client:
            with self.assertRaises(grpc.RpcError) as failed:
                client.GetMap(map="nowhere")
        self.assertEqual(failed.exception.code(), grpc.StatusCode.NOT_FOUND)
        return dict(failed.exception.trailing_metadata()).get("x-request-id")

    def get(self, path):
        """Returns the HTTP status and the body."""
        try:
            with urllib.request.urlopen(self.http + path, timeout=DEADLINE_S) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.read().decode()

    def metrics(self):
        """Returns {name with labels: value}."""
        status, text = self.get("/metrics")
        self.assertEqual(status, 200)
        lines = [line.rsplit(" ", 1) for line in text.splitlines() if not line.startswith("#")]
        return {name: float(value) for name, value in lines}

    def await_health(self, service, status):
        deadline = time.monotonic() + DEADLINE_S
        while rpc.health(self.site.address, service) != status:
            self.assertLess(time.monotonic(), deadline)


class Log(Observed):

    def test_a_call_that_fails_is_a_line(self):
        name = self.ask_for_nothing(("x-request-id", "robot-7.12"), ("traceparent", TRACEPARENT))
        self.assertEqual(name, "robot-7.12")
        (line,) = self.lines("call failed", request_id="robot-7.12")
        self.assertRegex(line["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
        self.assertEqual({key: line[key] for key in ("level", "rpc", "code", "map", "trace_id")},
                         {"level": "info", "rpc": "GetMap", "code": "NOT_FOUND", "map": "nowhere",
                          "trace_id": TRACE_ID})
        self.assertRegex(line["peer"], r"^ipv4:127\.0\.0\.1:\d+$")
        self.assertGreaterEqual(line["duration_ms"], 0)
        self.assertIn("nowhere", line["error"])
        self.assertEqual(line["file"], "request_log.cc")

    def test_a_call_that_reads_two_maps_names_both(self):
        side = [{"scope": rpc.scope(name, "floor")} for name in ("nowhere", "elsewhere")]
        with rpc.Client(self.site.address, metadata=[("x-request-id", "two")]) as client:
            with self.assertRaises(grpc.RpcError):
                client.EstimateTransform(source=side[0], target=side[1])
        (line,) = self.lines("call failed", request_id="two")
        self.assertEqual((line["source_map"], line["map"]), ("nowhere", "elsewhere"))

    def test_a_call_without_a_valid_name_gets_one(self):
        for metadata in ([], [("x-request-id", "two words")], [("x-request-id", "x" * 129)]):
            name = self.ask_for_nothing(*metadata, ("traceparent", TRACEPARENT.upper()))
            self.assertRegex(name, r"^[0-9a-f]{16}$")
            (line,) = self.lines("call failed", request_id=name)
            self.assertNotIn("trace_id", line)

    def test_calls_that_succeed_are_named_by_their_callers_only(self):
        named = self.enterContext(rpc.Client(self.site.address, metadata=[("x-request-id", "a")]))
        for client, name in ((named, "a"), (self.client, None)):
            call = client.ListMaps.begin()
            call.result()
            self.assertEqual(dict(call.trailing_metadata()).get("x-request-id"), name)
        self.assertEqual(self.lines("call"), [])

    def test_edits_have_author_and_name(self):
        with rpc.Client(self.site.address, metadata=[("x-request-id", "a")]) as client:
            client.CreateMap(map="site", request_id="once")
        (line,) = self.lines("edit", request_id="a")
        self.assertEqual((line["rpc"], line["map"], line["edit_id"]), ("CreateMap", "site", "once"))
        self.assertIn("identity", line)


class Metrics(Observed):

    def test_numbers_agree_with_what_was_done(self):
        sites.make(self.client)
        for _ in range(7):
            self.client.GetMap(map="site")
        self.ask_for_nothing()
        self.client.Report(map="site", report={"robot": "r1", "stamp": "2026-01-01T00:00:00Z", "pose": {}})
        found = self.metrics()
        labels = '{grpc_service="hypermap.v1.CatalogService",grpc_method="GetMap"'
        self.assertEqual(found[f'grpc_server_started_total{labels}}}'], 8)
        self.assertEqual(found[f'grpc_server_handled_total{labels},grpc_code="OK"}}'], 7)
        self.assertEqual(found[f'grpc_server_handled_total{labels},grpc_code="NotFound"}}'], 1)
        self.assertEqual(found[f'grpc_server_handling_seconds_count{labels}}}'], 8)
        self.assertEqual(found['hypermap_map_revision{map="site"}'],
                         self.client.GetMap(map="site").map.revision)
        self.assertEqual(found['hypermap_map_up{map="site"}'], 1)
        self.assertEqual(found['hypermap_map_robots{map="site",state="online"}'], 1)
        self.assertEqual(found['hypermap_map_robots{map="site",state="offline"}'], 0)
        self.assertEqual(found['hypermap_auth_failures_total{reason="unknown_token"}'], 0)
        self.assertEqual(found['hypermap_store_seconds_count{operation="write"}'],
                         found['hypermap_map_commits_total{map="site"}'])
        self.assertEqual(found['hypermap_store_failures_total{operation="write"}'], 0)
        self.assertGreater(found["hypermap_memory_limit_bytes"], 0)
        self.assertGreater(found["process_resident_memory_bytes"], 0)

    def test_numbers_agree_with_what_many_clients_count(self):
        sites.make(self.client)
        before = sites.revision(self.client)
        watches = [self.client.Watch(scope=rpc.scope("site")) for _ in range(20)]
        for watch in watches:
            next(watch)
        self.assertEqual(self.metrics()["hypermap_watchers"], 20)

        def work(number):
            """Returns how many calls of each rpc it has made."""
            made = collections.Counter()
            with rpc.Client(self.site.address) as client:
                for i in range(50):
                    client.ApplyEdits(map="site", edits=[sites.put("thing", number, i)])
                    client.QueryPoint(scope=rpc.scope("site"), point=rpc.point(number, i))
                    made.update(["ApplyEdits", "QueryPoint"])
                    if i % 5 == number % 5:
                        with self.assertRaises(grpc.RpcError):
                            client.QueryPoint(scope=rpc.scope("nowhere"), point=rpc.point(0, 0))
                        made["failed"] += 1
            return made

        with concurrent.futures.ThreadPoolExecutor(12) as pool:
            working = [pool.submit(work, number) for number in range(12)]
            scrapes = 0
            while not all(worker.done() for worker in working):
                self.assertEqual(self.metrics()["hypermap_watchers"], 20)
                scrapes += 1
            made = sum((worker.result() for worker in working), collections.Counter())
        found = self.metrics()
        for code, method, count in (("OK", "ApplyEdits", made["ApplyEdits"]),
                                    ("OK", "QueryPoint", made["QueryPoint"]),
                                    ("NotFound", "QueryPoint", made["failed"])):
            service = "EditService" if method == "ApplyEdits" else "QueryService"
            labels = f'grpc_service="hypermap.v1.{service}",grpc_method="{method}"'
            self.assertEqual(found[f'grpc_server_handled_total{{{labels},grpc_code="{code}"}}'],
                             count, (method, code))
        self.assertEqual(found['hypermap_map_revision{map="site"}'], before + made["ApplyEdits"])
        self.assertGreater(scrapes, 0)
        for watch in watches:
            watch.cancel()
        deadline = time.monotonic() + DEADLINE_S
        while self.metrics()["hypermap_watchers"]:
            self.assertLess(time.monotonic(), deadline)

    def test_each_name_is_there_once(self):
        _, text = self.get("/metrics")
        types = re.findall(r"^# TYPE (\S+)", text, re.MULTILINE)
        self.assertEqual([name for name, n in collections.Counter(types).items() if n > 1], [])


class Health(Observed):

    def test_the_server_is_alive_and_ready(self):
        self.assertEqual(self.get("/livez"), (200, "alive\n"))
        self.assertEqual(self.get("/readyz"), (200, "ready\n"))
        self.assertEqual(self.get("/")[0], 404)

    def test_a_map_has_health_while_there_is_the_map(self):
        self.assertEqual(rpc.health(self.site.address, "map/site"), None)
        self.client.CreateMap(map="site")
        self.await_health("map/site", rpc.SERVING)
        self.client.DeleteMap(map="site")
        self.await_health("map/site", None)
        self.assertEqual(rpc.health(self.site.address, ""), rpc.SERVING)

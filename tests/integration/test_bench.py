"""`hypermap bench`: the load of a fleet, also when the server is killed and started again meanwhile.

What the operations took is not tested, since it depends on the machine."""

import contextlib
import json
import os
import pathlib
import shutil
import subprocess
import time
import unittest

import rpc
import sites
from certificates import Certificates
from processes import BIN, DEADLINE_S, SiteTest, cli

ROBOTS, REPLICAS, FULL_REPLICAS, WATCHERS, EDITORS = 8, 4, 2, 3, 1
FLEET = [f"--robots={ROBOTS}", f"--replicas={REPLICAS}", f"--full_replicas={FULL_REPLICAS}",
         f"--watchers={WATCHERS}", f"--editors={EDITORS}", "--warmup_seconds=1"]
# Counts in the report that are zero if nothing was lost.
FAULTS = ["edits_lost", "edits_repeated", "observations_lost", "revisions_missed",
          "revisions_repeated", "revisions_reordered", "watchers_behind", "replicas_behind",
          "replicas_different", "unanswered"]


class Bench(SiteTest):

    def setUp(self):
        super().setUp()
        self.scratch = self.folder / "scratch"
        self.scratch.mkdir()

    def bench(self, address, *arguments):
        """Returns the running command."""
        process = subprocess.Popen(
            [BIN / "hypermap", "--server", address, "bench", "site", *FLEET,
             f"--scratch={self.scratch}", "--json", *arguments],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.kill)
        return process

    def report(self, process):
        """Waits for the end of the command, and returns what it printed and its exit code."""
        out, err = process.communicate(timeout=DEADLINE_S)
        self.assertTrue(out, err)
        return json.loads(out), process.returncode

    def assert_holds(self, report, code):
        self.assertEqual({name: report["consistency"][name] for name in FAULTS},
                         dict.fromkeys(FAULTS, 0), report)
        self.assertEqual(report["consistency"]["problems"], [])
        self.assertEqual((report["holds"], report["lost"], code), (True, 0, 0), report)
        self.assertEqual(os.listdir(self.scratch), [])

    def test_a_fleet_loses_nothing(self):
        site = self.server("--metrics_listen=127.0.0.1:0")
        metrics = site.log().split("metrics are served address=")[1].split()[0]
        report, code = self.report(self.bench(
            site.address, "--seconds=6", "--claims_hz=1", f"--metrics={metrics}"))
        self.assert_holds(report, code)

        # Each operation has a time at which it is due, so that their number is known.
        operations = report["operations"]
        self.assertEqual({kind: operations[kind]["count"] for kind in
                          ("observation", "points", "edit", "claim")},
                         {"observation": ROBOTS * 6, "points": ROBOTS * 6 * 5,
                          "edit": EDITORS * 6 * 5, "claim": ROBOTS * 6})
        for kind, operation in operations.items():
            self.assertEqual((operation["errors"], operation["retries"]), (0, 0), operation)
            times = [operation[f"{p}_ms"] for p in ("p50", "p90", "p99", "p99_9", "max")]
            self.assertEqual(times, sorted(times), kind)
            self.assertGreater(times[0], 0, kind)
        # Every follower gets every revision that changes something.
        for kind, followers in (("watch_delivery", WATCHERS), ("replica_lag", FULL_REPLICAS),
                                ("replica_delivery", REPLICAS - FULL_REPLICAS)):
            self.assertGreaterEqual(operations[kind]["count"],
                                    followers * operations["edit"]["count"], kind)
        self.assertEqual(operations["watch_delivery"]["count"] % WATCHERS, 0)

        consistency = report["consistency"]
        self.assertGreaterEqual(consistency["observations_acknowledged"], ROBOTS * 6)
        self.assertGreaterEqual(consistency["edits_acknowledged"], EDITORS * 6 * 5)
        self.assertGreaterEqual(consistency["revisions_with_changes"],
                                consistency["edits_acknowledged"])
        with rpc.Client(site.address) as client:
            self.assertEqual(consistency["newest_revision"], sites.revision(client))
        self.assertEqual(report["outages"], [])
        self.assertEqual(report["configuration"]["robots"], ROBOTS)
        self.assertGreater(report["server"]["samples"], 1)
        self.assertGreater(report["server"]["cpu_seconds"], 0)
        self.assertGreater(report["server"]["resident_bytes"]["max"], 0)
        self.assertGreater(report["generator"]["cpu_seconds"], 0)

    def test_each_client_has_a_connection_of_its_own(self):
        site = self.server()
        process = self.bench(site.address, "--seconds=2", "--edits_hz=50")
        # A client for the preparation besides.
        expected = ROBOTS + REPLICAS + WATCHERS + EDITORS + 1
        deadline = time.monotonic() + DEADLINE_S
        most = 0
        while most < expected and process.poll() is None:
            self.assertLess(time.monotonic(), deadline)
            most = max(most, self.connections(process.pid, site.port))
            time.sleep(0.05)
        self.assertEqual(most, expected)
        self.assert_holds(*self.report(process))

    @staticmethod
    def connections(pid, port):
        """Returns the number of TCP connections of a process to a local port."""
        inodes = set()
        with contextlib.suppress(FileNotFoundError):  # the process has ended
            for fd in os.listdir(f"/proc/{pid}/fd"):
                with contextlib.suppress(FileNotFoundError):  # the file was closed
                    inodes.add(os.readlink(f"/proc/{pid}/fd/{fd}").removeprefix("socket:["))
        # gRPC connects to IPv4 addresses by sockets of IPv6, too.
        lines = []
        for table in ("tcp", "tcp6"):
            with contextlib.suppress(FileNotFoundError):
                lines += pathlib.Path("/proc/net", table).read_text(encoding="ascii").splitlines()[1:]
        established = "01"
        return sum(f"{inode}]" in inodes and state == established
                   and int(remote.rsplit(":", 1)[1], 16) == int(port)
                   for _, _, remote, state, *_, inode in
                   (line.split()[:10] for line in lines))

    def test_all_come_back_after_a_kill_and_nothing_is_lost(self):
        site = self.server()
        process = self.bench(site.address, "--seconds=10")
        with rpc.Client(site.address) as client:
            self.await_revision(client, 50, process)
        site.kill()
        # The last --listen counts.
        again = self.server(f"--listen={site.address}")
        report, code = self.report(process)
        self.assert_holds(report, code)
        (outage,) = report["outages"]
        # Each robot has two streams. Editors count, too.
        self.assertEqual(outage["streams_not_back"], 0)
        self.assertGreater(outage["streams_failed"], ROBOTS)
        self.assertGreaterEqual(outage["all_back_seconds"], 0)
        self.assertGreater(outage["down_seconds"], 0)
        self.assertLess(outage["last_answer_before_seconds"], outage["first_answer_after_seconds"])
        for kind in ("observation", "points", "edit"):
            operation = report["operations"][kind]
            self.assertGreater(operation["retries"], 0, kind)
            self.assertEqual(operation["errors"], operation["retries"], operation)
        self.assertEqual(report["operations"]["points"]["count"], ROBOTS * 10 * 5)
        self.assertEqual(report["operations"]["edit"]["count"], EDITORS * 10 * 5)
        with rpc.Client(again.address) as client:
            self.assertEqual(report["consistency"]["newest_revision"], sites.revision(client))

    def test_a_server_that_forgets_is_found_out(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            self.report(self.bench(site.address, "--seconds=1"))
            self.assertEqual(site.stop(), 0)
            old = self.folder / "old"
            shutil.copytree(self.data_dir, old)
            site = self.server(f"--listen={site.address}")
            before = sites.revision(client)
            process = self.bench(site.address, "--seconds=6")
            self.await_revision(client, before + 50, process)
        site.kill()
        # The file as it was before the load, with the same incarnation.
        self.server(f"--listen={site.address}", data_dir=old)
        report, code = self.report(process)
        self.assertEqual((report["holds"], code), (False, 1), report)
        self.assertGreater(report["consistency"]["observations_lost"], 0, report)
        self.assertGreater(report["lost"], 0)

    def await_revision(self, client, revision, process):
        """Waits until the map has the revision, while the load runs."""
        deadline = time.monotonic() + DEADLINE_S
        while not any(entry.name == "site" and entry.revision >= revision
                      for entry in client.ListMaps().maps):
            self.assertLess(time.monotonic(), deadline)
            self.assertIsNone(process.poll())
            time.sleep(0.05)

    def test_a_map_of_somebody_else_is_left_alone(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            before = sites.revision(client)
            result = site.cli("bench", "site", *FLEET, "--seconds=1")
            self.assertEqual(result.returncode, 1)
            self.assertIn("--into_existing", result.stderr)
            self.assertEqual(sites.revision(client), before)
        report, code = self.report(self.bench(site.address, "--seconds=1", "--into_existing"))
        self.assert_holds(report, code)

    def test_a_second_run_goes_on_with_the_map_of_the_first(self):
        site = self.server()
        for _ in range(2):
            self.assert_holds(*self.report(self.bench(site.address, "--seconds=1")))

    def test_all_clients_show_their_token_and_certificate(self):
        root = Certificates(self.folder)
        for name in ("server", "operator"):
            root.sign(name)
        access_file = self.folder / "access.yaml"
        created = cli("token", "create", "operator", "--file", access_file, "--role", "admin")
        self.assertEqual(created.returncode, 0, created.stderr)
        token_file = self.folder / "token"
        token_file.write_text(created.stdout.strip())
        token_file.chmod(0o600)
        # A client without the token may do nothing, and one without the certificate can't connect.
        site = self.server(f"--tls_cert={self.folder / 'server.pem'}",
                           f"--tls_key={self.folder / 'server.key'}",
                           f"--tls_client_ca={self.folder / 'root.pem'}",
                           f"--access_file={access_file}")
        tls = [f"--tls_ca={self.folder / 'root.pem'}", f"--tls_cert={self.folder / 'operator.pem'}",
               f"--tls_key={self.folder / 'operator.key'}"]
        report, code = self.report(self.bench(
            site.address, "--seconds=2", "--claims_hz=1", *tls, f"--token_file={token_file}"))
        self.assert_holds(report, code)
        self.assertEqual(sum(operation["errors"] for operation in report["operations"].values()), 0)

    def test_wrong_options_are_errors(self):
        for flag in ("--robots=-1", "--seconds=0", "--batch_points=0", "--watchers=0",
                     "--metrics=nowhere"):
            result = cli("bench", "site", flag)
            self.assertNotEqual(result.returncode, 0, flag)
            self.assertIn(flag.split("=", maxsplit=1)[0] if flag != "--watchers=0" else "--replicas",
                          result.stderr)


if __name__ == "__main__":
    unittest.main()

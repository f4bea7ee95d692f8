"""Several servers on one database: their clients go on with another one when theirs dies.

The clients are those in C++, as the `hypermap` command has them. The tests of the Python and the
TypeScript client are with them.
"""

import itertools
import json
import re
import signal
import subprocess
import time
import urllib.request

import grpc

import rpc
import sites
from shared_database import FleetTest, Pgbouncer, Servers, changes
from processes import DEADLINE_S, cli, start_and_fail


def metrics(server):
    """Returns what a server tells Prometheus: {name with labels: value}."""
    address = re.search(r"metrics are served.*address=(\S+)", server.log())[1]
    with urllib.request.urlopen(f"http://{address}/metrics", timeout=DEADLINE_S) as answer:
        lines = [line.rsplit(" ", 1) for line in answer.read().decode().splitlines()
                 if not line.startswith("#")]
    return {name: float(value) for name, value in lines}


def failure(call, **arguments):
    """Returns the code with which a call fails; None if it does not."""
    try:
        call(**arguments)
    except grpc.RpcError as error:
        return error.code()
    return None


class FailoverTest(FleetTest):
    def setUp(self):
        super().setUp()
        self.fleet = self.servers(2)

    def test_a_folder_of_temporary_files_has_one_server(self):
        code, log = start_and_fail(self.fleet.folder_of(0), f"--store={self.fleet.store}",
                                   "--server_id=other")
        self.assertNotEqual(code, 0)
        self.assertIn("cannot use the data folder", log)

    def test_a_load_loses_nothing(self):
        """Editors, watches, replicas and streams of observations, whose server is killed twice."""
        self.check_load(self.fleet.addresses, killed=[0, 1])

    def test_a_load_at_a_server_that_follows_loses_nothing(self):
        """The owner is killed, to which their server passes on what they change."""
        with rpc.Client(self.fleet[0].address) as client:
            client.CreateMap(map="site")
        self.fleet.await_map("site")
        self.check_load(f"{self.fleet[1].address},{self.fleet[0].address}", killed=[0])

    def check_load(self, addresses, killed):
        load = self.begin(addresses, "--json", "bench", "site", "--robots=4", "--observe_hz=2",
                          "--replicas=3", "--full_replicas=2", "--watchers=3", "--editors=3",
                          "--edits_hz=10", "--warmup_seconds=1", f"--seconds={12 * len(killed)}")
        self.await_revisions(40)
        watch = self.begin(addresses, "--json", "watch", "site", "--from=0")
        for i in killed:
            self.assertEqual(self.fleet.owner_of("site"), i)
            self.fleet.kill(i)
            self.await_revisions(40)
            self.fleet.restart(i)
        report, errors = load.communicate(timeout=DEADLINE_S)
        self.assertEqual(load.returncode, 0, report + errors)
        # Each change was told once and in order: as it is told to one who asks now.
        newest = f"--until={self.revision()}"
        afterwards = list(changes(self.fleet[1].json_lines("watch", "site", "--from=0", newest)))
        self.assertGreater(len(afterwards), 100)
        told = changes(map(json.loads, watch.stdout))
        self.assertEqual(list(itertools.islice(told, len(afterwards))), afterwards)

    def test_commands_pass_over_a_server_that_is_gone(self):
        with rpc.Client(self.fleet[1].address) as client:
            sites.make(client)
        self.fleet.kill(0)
        maps = cli("--server", self.fleet.addresses, "--json", "maps")
        self.assertEqual(maps.returncode, 0, maps.stderr)
        self.assertIn("site", maps.stdout)
        alone = cli("--server", self.fleet[0].address, "maps")
        self.assert_fails(alone, "unavailable", code=alone.returncode)

    def test_servers_and_owners_are_listed(self):
        with rpc.Client(self.fleet[1].address) as client:
            sites.make(client)
        self.fleet.await_map("site", revision=3)
        listed = self.fleet[0].json("servers")
        self.assertEqual(listed["answered_by"], "server_0")
        (site,) = listed["maps"]
        self.assertEqual((site["name"], site["stored_revision"], site["lag"]), ("site", 3, 0))
        # A slow machine may have given the map to the other server by now.
        owner = int(site["owner"].removeprefix("server_"))
        self.assertEqual([(s["id"], s["address"], s["maps"]) for s in listed["servers"]],
                         [(f"server_{i}", self.fleet[i].address, int(i == owner)) for i in (0, 1)])
        self.assertIn("server_1", self.fleet[1].cli("servers").stdout)

        self.fleet.kill(owner)
        self.fleet.await_owner("site", 1 - owner)
        (left,) = self.fleet[1 - owner].json("servers")["servers"]
        self.assertEqual((left["id"], left["maps"]), (f"server_{1 - owner}", 1))

    def test_metrics_tell_owners_lags_and_takeovers(self):
        fleet = self.enterContext(Servers(self.cluster, self.new_folder()))
        fleet.start(1, "--metrics_listen=127.0.0.1:0")
        with rpc.Client(fleet[0].address) as client:
            sites.make(client)
        found = metrics(fleet[0])
        self.assertEqual(found['hypermap_map_owned{map="site"}'], 1)
        self.assertEqual(found["hypermap_map_takeovers_total"], 0)
        self.assertLess(found["hypermap_lease_age_seconds"], DEADLINE_S)
        fleet.start(1, "--metrics_listen=127.0.0.1:0")
        fleet.await_map("site", revision=3)
        fleet.kill(0)
        fleet.await_owner("site", 1)
        deadline = time.monotonic() + DEADLINE_S
        while (found := metrics(fleet[1])).get('hypermap_map_owned{map="site"}') != 1:
            self.assertLess(time.monotonic(), deadline)
        self.assertEqual(found['hypermap_map_lag_revisions{map="site"}'], 0)
        self.assertGreaterEqual(found["hypermap_map_takeovers_total"], 1)

    def test_readers_may_go_through_a_pooler(self):
        maps = 20
        pooler = self.enterContext(Pgbouncer(self.cluster))
        fleet = self.enterContext(Servers(self.cluster, self.new_folder()))
        flag = f"--store_readers={pooler.through(fleet.store)}"
        fleet.start(1, flag)
        with rpc.Client(fleet[0].address) as owner:
            for i in range(maps):
                sites.make(owner, f"site-{i}")
            edited = owner.ApplyEdits(map="site-0", edits=[sites.put("cup", 0, 0)])
        fleet.start(1, flag)
        for i in range(maps):
            fleet.await_map(f"site-{i}", revision=3)
        fleet.await_map("site-0", edited.revision)
        with rpc.Client(fleet[1].address) as follower:
            self.assertEqual(list(sites.labels(follower, "site-0").values()), ["cup"])
            before = follower.QueryPoint(scope=rpc.scope("site-0", "things"),
                                         point=rpc.point(0.5, 0.5), as_of=rpc.at(edited.revision - 1))
            self.assertEqual(len(before.layers[0].objects), 0)
        sessions = subprocess.run(
            ["psql", "-qAtX", "-d", fleet.store, "-c", "SELECT count(*) FROM pg_stat_activity "
             "WHERE datname = current_database()"], capture_output=True, text=True, check=True,
            timeout=DEADLINE_S).stdout
        # One for each map, a few for each server, two of the pooler.
        self.assertLess(int(sessions), 2 * maps)

    def new_folder(self):
        folder = self.folder / "more"
        folder.mkdir()
        return folder

    def test_a_frozen_server_is_left(self):
        """Its connections stay open, also new ones, but nothing comes back."""
        with rpc.Client(self.fleet[0].address) as client:
            sites.make(client)
        self.fleet.await_map("site", revision=3)
        watch = self.begin(self.fleet.addresses, "--json", "watch", "site")
        self.assertTrue(watch.stdout.readline())
        self.fleet[0].signal(signal.SIGSTOP)
        self.addCleanup(self.fleet[0].signal, signal.SIGCONT)
        features = self.folder / "edit.geojson"
        features.write_text(json.dumps({"type": "FeatureCollection", "features": [
            {"type": "Feature", "properties": {"label": "cup"},
             "geometry": {"type": "Point", "coordinates": [1, 2]}}]}))
        edit = cli("--server", self.fleet.addresses, "--retry=60s", "edit", "site", features,
                   "--layer=things")
        self.assertEqual(edit.returncode, 0, edit.stderr)
        (change,) = itertools.islice(changes(map(json.loads, watch.stdout)), 1)
        self.assertEqual((change["revision"], change["op"]), (4, "put"))

    def test_no_server_answers_with_less_than_was_seen(self):
        with rpc.Client(self.fleet[0].address) as owner, rpc.Client(self.fleet[1].address) as other:
            sites.make(owner)
            self.fleet.await_map("site")
            incarnation = owner.GetMap(map="site").map.incarnation
            for i in range(50):
                edited = owner.ApplyEdits(map="site", edits=[sites.put(f"cup {i}", 0, 0)])
                as_of = {"seen_revision": edited.revision, "seen_incarnation": incarnation}
                query = {"scope": rpc.scope("site"), "as_of": as_of}
                asked = other.QueryPoint(**query, point=rpc.point(9, 9))
                self.assertGreaterEqual(asked.revision, edited.revision)
                (part, *_) = other.QueryArea(**query, area=sites.square(9, 9))
                self.assertGreaterEqual(part.revision, edited.revision)

    def test_a_revision_that_does_not_come_is_waited_for_a_short_time(self):
        with rpc.Client(self.fleet[0].address) as owner, rpc.Client(self.fleet[1].address) as other:
            sites.make(owner)
            self.fleet.await_map("site", revision=3)
            incarnation = owner.GetMap(map="site").map.incarnation
            for seen, code in ((incarnation, grpc.StatusCode.UNAVAILABLE), (incarnation + 1, None)):
                as_of = {"seen_revision": 99, "seen_incarnation": seen}
                self.assertEqual(code, failure(
                    other.QueryPoint, scope=rpc.scope("site"), as_of=as_of, point=rpc.point(0, 0)))

    def test_a_follower_that_is_behind_asks_to_come_again(self):
        with rpc.Client(self.fleet[0].address) as owner, rpc.Client(self.fleet[1].address) as other:
            sites.make(owner)
            self.fleet.await_map("site", revision=3)
            incarnation = owner.GetMap(map="site").map.incarnation
            known = {**rpc.scope("site"), "incarnation": incarnation}

            def list_from(client, revision):
                return failure(lambda: list(client.ListChanges(scope=known, from_revision=revision)))

            for i in range(50):
                edited = owner.ApplyEdits(map="site", edits=[sites.put(f"cup {i}", 0, 0)])
                self.assertIn(list_from(other, edited.revision), (None, grpc.StatusCode.UNAVAILABLE))
            for client in owner, other:
                self.assertEqual(list_from(client, 99), grpc.StatusCode.OUT_OF_RANGE)

    def revision(self):
        """The newest revision of the map at the first server that has it; 0 if there is none yet."""
        for server in self.fleet:
            if server.running():
                with rpc.Client(server.address) as client:
                    try:
                        return sites.revision(client)
                    except grpc.RpcError as error:
                        if error.code() not in (grpc.StatusCode.NOT_FOUND, grpc.StatusCode.UNAVAILABLE):
                            raise
        return 0

    def await_revisions(self, number):
        """Waits until the map has so many more revisions."""
        deadline, first = time.monotonic() + DEADLINE_S, self.revision()
        while self.revision() < first + number:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)

"""Two servers on the PostgreSQL of deploy/patroni, whose primary is killed while they are edited: the
standby takes over, no acknowledged edit is lost, and the servers go on by themselves.

Runs by `make prove-patroni`: a failover takes the time of Patroni's ttl.
"""

import itertools
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest
import urllib.request

import grpc
import yaml

import rpc
import sites
from certificates import Certificates
from processes import DEADLINE_S, ROOT, Server, lasting_port

DEPLOY = ROOT / "deploy" / "patroni"
PROGRAMS = ("patroni", "etcd", "runuser")
# Edits that must be acknowledged before and after each failover.
EDITS = 100
FAILOVERS = int(os.environ.get("HYPERMAP_TEST_PATRONI", "0"))
AS_POSTGRES = ("runuser", "-u", "postgres", "--")


def eventually(condition, problem, deadline_s=DEADLINE_S):
    """Waits until the condition returns something true, and returns that."""
    deadline = time.monotonic() + deadline_s
    while not (result := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(problem())
        time.sleep(0.1)
    return result


class Machine:
    """A machine with Patroni and PostgreSQL, by the file of deploy/patroni, on loopback."""

    def __init__(self, name, folder, etcd):
        self.name, self.folder = name, folder / name
        self.folder.mkdir()
        self.port, self.rest_port = lasting_port(), lasting_port()
        certificates = Certificates(self.folder)
        certificates.sign("server")
        text = (DEPLOY / "patroni.yml").read_text()
        for old, new in (("/etc/patroni", self.folder), ("/var/run/postgresql", self.folder),
                         ("/var/lib/postgresql/15/hypermap", self.folder / "data"),
                         ("/var/lib/postgresql", self.folder)):
            text = text.replace(old, str(new))
        config = yaml.safe_load(text)
        config["name"] = name
        config["etcd3"]["hosts"] = [etcd]
        for part, port in ((config["restapi"], self.rest_port), (config["postgresql"], self.port)):
            part["listen"] = part["connect_address"] = f"127.0.0.1:{port}"
        self.config = self.folder / "config.yml"
        self.config.write_text(yaml.safe_dump(config))
        subprocess.run(["chown", "-R", "postgres", self.folder], check=True, timeout=DEADLINE_S)
        self._process = None

    def start(self):
        with open(self.folder / "log", "ab") as log:
            self._process = subprocess.Popen([*AS_POSTGRES, "patroni", self.config], stdout=log,
                                             stderr=log, start_new_session=True)

    def kill(self):
        """Kills all processes, as a power loss would, but for what they have written."""
        if self._process:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait(DEADLINE_S)
            self._process = None
        pid = self.folder / "data" / "postmaster.pid"
        if pid.exists():
            subprocess.run(["kill", "-KILL", pid.read_text().splitlines()[0]], check=False,
                           capture_output=True, timeout=DEADLINE_S)

    def log(self):
        return (self.folder / "log").read_text()[-4000:]

    def roles(self):
        """Returns the roles of the members that Patroni tells: {name: role}."""
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.rest_port}/cluster",
                                        timeout=5) as answer:
                members = json.load(answer)["members"]
        except OSError:
            return {}
        return {member["name"]: member["role"] for member in members
                if member["state"] in ("running", "streaming")}

    def psql(self, *statements, database="maps"):
        subprocess.run([*AS_POSTGRES, "psql", "-qX", "-h", self.folder, "-p", str(self.port),
                        "-d", database, *(f"--command={s}" for s in statements)],
                       check=True, capture_output=True, timeout=DEADLINE_S)


class Writer:
    """Adds objects until it is stopped, through both servers, and notes those that were acknowledged."""

    def __init__(self, clients, name):
        self._clients, self._name = clients, name
        self._stops = threading.Event()
        self.acknowledged = {}  # label -> id
        self.longest_pause_s = 0.0
        self.error = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        acknowledged_at = time.monotonic()
        for number in itertools.count():
            label = f"{self._name}, object {number}"
            while not self._stops.is_set():
                try:
                    answer = random.choice(self._clients).ApplyEdits(
                        map="site", edits=[sites.put(label, number % 100, number // 100)],
                        request_id=label, timeout=10)
                except grpc.RpcError as error:
                    if error.code() not in (grpc.StatusCode.UNAVAILABLE,
                                            grpc.StatusCode.DEADLINE_EXCEEDED):
                        self.error = error
                        return
                    time.sleep(0.05)
                    continue
                now = time.monotonic()
                self.longest_pause_s = max(self.longest_pause_s, now - acknowledged_at)
                acknowledged_at = now
                self.acknowledged[label] = answer.object_ids[0]
                break
            if self._stops.is_set():
                return

    def stop(self):
        self._stops.set()
        self._thread.join()


@unittest.skipUnless(FAILOVERS, "takes minutes: make prove-patroni")
@unittest.skipUnless(all(map(shutil.which, PROGRAMS)), "Patroni or etcd is missing")
@unittest.skipUnless(os.getuid() == 0, "needs root, to be the user postgres")
class Patroni(unittest.TestCase):

    def setUp(self):
        # Readable for the user postgres.
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="hypermap-")))
        self.folder.chmod(0o755)
        etcd = self.start_etcd()
        self.machines = [Machine(f"db-{i}", self.folder, etcd) for i in (1, 2)]
        for machine in self.machines:
            self.addCleanup(machine.kill)
        self.machines[0].start()
        eventually(lambda: "leader" in self.machines[0].roles().values(), self.machines[0].log)
        self.machines[1].start()
        self.await_standby()
        self.primary().psql("CREATE DATABASE maps OWNER hypermap", database="postgres")
        self.primary().psql("CREATE EXTENSION btree_gist", "CREATE EXTENSION IF NOT EXISTS postgis")

    def start_etcd(self):
        """Starts etcd, one server of it, and returns its address."""
        client, peer = (f"http://127.0.0.1:{lasting_port()}" for _ in range(2))
        process = subprocess.Popen(
            ["etcd", f"--data-dir={self.folder / 'etcd'}", f"--listen-client-urls={client}",
             f"--advertise-client-urls={client}", f"--listen-peer-urls={peer}",
             f"--initial-advertise-peer-urls={peer}", f"--initial-cluster=default={peer}"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return client.removeprefix("http://")

    def role_of(self, machine):
        return next(filter(None, (m.roles() for m in self.machines)), {}).get(machine.name)

    def primary(self):
        return eventually(
            lambda: next((m for m in self.machines if self.role_of(m) == "leader"), None),
            self.logs)

    def await_standby(self):
        """Waits until there are a primary and a standby that confirms commits."""
        eventually(lambda: {self.role_of(m) for m in self.machines} == {"leader", "sync_standby"},
                   self.logs)

    def logs(self):
        return "\n".join(machine.log() for machine in self.machines)

    def start_server(self, number):
        store = yaml.safe_load((DEPLOY / "hypermapd.yaml").read_text())["store"]
        ports = ",".join(f"localhost:{machine.port}" for machine in self.machines)
        # Each machine has an authority of its own here.
        authorities = self.folder / "database_ca.pem"
        authorities.write_text("".join((m.folder / "root.pem").read_text() for m in self.machines))
        store = store.replace("@db-1,db-2/", f"@{ports}/").replace(
            "/etc/hypermap/database_ca.pem", str(authorities))
        folder = self.folder / f"server-{number}"
        folder.mkdir()
        return self.enterContext(Server(folder, f"--store={store}", f"--server_id=server-{number}"))

    def test_no_acknowledged_edit_is_lost(self):
        servers = [self.start_server(i) for i in range(2)]
        clients = [self.enterContext(rpc.Client(server.address)) for server in servers]
        sites.make(clients[0])
        eventually(lambda: self.has_map(clients[1]), servers[1].log)
        for failover in range(FAILOVERS):
            writer = Writer(clients, f"failover {failover}")
            self.addCleanup(writer.stop)
            self.await_edits(writer, servers)
            lost = self.primary()
            lost.kill()
            self.await_edits(writer, servers)
            writer.stop()
            print(f"failover {failover}: {writer.longest_pause_s:.1f} s without edits", flush=True)
            self.check(writer, clients)
            edits = [{"delete_object": {"layer": "things", "id": i}} for i in sites.labels(clients[0])]
            self.retried(lambda: clients[0].ApplyEdits(map="site", edits=edits,
                                                       request_id=f"clear {failover}"))
            lost.start()
            self.await_standby()

    @staticmethod
    def has_map(client):
        try:
            return client.GetMap(map="site").map.revision >= 3
        except grpc.RpcError:
            return False

    def await_edits(self, writer, servers):
        """Waits until more edits are acknowledged."""
        enough = len(writer.acknowledged) + EDITS
        eventually(lambda: writer.error or len(writer.acknowledged) >= enough,
                   lambda: "\n".join([self.logs(), *(server.log()[-4000:] for server in servers)]))
        self.assertIsNone(writer.error)

    def retried(self, call):
        def attempt():
            try:
                return call()
            except grpc.RpcError as error:
                self.assertEqual(error.code(), grpc.StatusCode.UNAVAILABLE, error)
                return None
        return eventually(attempt, self.logs)

    def check(self, writer, clients):
        """Checks that both servers have each acknowledged object once, and at most one more: the last
        edit may have been carried out though nobody heard."""
        newest = max(client.GetMap(map="site").map.revision for client in clients)
        for client in clients:
            eventually(lambda: client.GetMap(map="site").map.revision >= newest, self.logs)
            labels = sites.labels(client)
            ids = {label: i for i, label in labels.items()}
            self.assertEqual(len(ids), len(labels))
            self.assertEqual({label: ids.get(label) for label in writer.acknowledged},
                             writer.acknowledged)
            self.assertLessEqual(len(labels), len(writer.acknowledged) + 1)


if __name__ == "__main__":
    unittest.main()

"""Several servers that share a PostgreSQL database, for tests and tools.

    with Cluster() as cluster, Servers(cluster, folder) as servers:
        servers.start(2)
        client = rpc.Client(servers[0].address)
        ...
        servers.kill(servers.owner_of("site"))
"""

import itertools
import os
import pathlib
import shutil
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.parse

import rpc
from processes import BIN, DEADLINE_S, ROOT, Server, SiteTest, lasting_port

_databases = itertools.count(1)


class Cluster:
    """A PostgreSQL cluster: that of $HYPERMAP_TEST_POSTGRES, or one that ends with the `with` block.

    Raises unittest.SkipTest if PostgreSQL is missing.
    """

    def __enter__(self):
        self._process = None
        self.uri = os.environ.get("HYPERMAP_TEST_POSTGRES", "")
        if not self.uri:
            # The script ends the cluster when `cat` sees the end of its input, also if this process
            # is killed.
            self._process = subprocess.Popen(
                [ROOT / "tests" / "postgres" / "with_cluster.sh", "bash", "-c",
                 "echo $HYPERMAP_TEST_POSTGRES; cat"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            self.uri = self._process.stdout.readline().strip()
            if not self.uri:
                self.__exit__()
                raise unittest.SkipTest("PostgreSQL is missing")
        return self

    def __exit__(self, *_):
        if self._process:
            self._process.communicate()

    def new_database(self):
        """Creates an empty database and returns its URI."""
        name = f"fleet_{os.getpid()}_{next(_databases)}"
        subprocess.run(["psql", "-qAtX", "-d", f"{self.uri}/postgres",
                        "-c", f"CREATE DATABASE {name} STRATEGY FILE_COPY"],
                       check=True, capture_output=True, timeout=DEADLINE_S)
        return f"{self.uri}/{name}"


class Pgbouncer:
    """A pgbouncer in transaction mode before a cluster, which ends with the `with` block. Raises
    unittest.SkipTest if it is missing."""

    PROGRAM = "/usr/sbin/pgbouncer"

    def __init__(self, cluster):
        if not os.access(self.PROGRAM, os.X_OK):
            raise unittest.SkipTest("pgbouncer is missing")
        self._cluster = urllib.parse.urlsplit(cluster.uri)
        self._port = lasting_port()

    def __enter__(self):
        self._temporary = tempfile.TemporaryDirectory(prefix="hypermap-")
        folder = pathlib.Path(self._temporary.name)
        users, config = folder / "users", folder / "pgbouncer.ini"
        users.write_text(f'"{self._cluster.username}" ""\n')
        config.write_text(f"""[databases]
* = host={self._cluster.hostname} port={self._cluster.port}
[pgbouncer]
listen_addr = 127.0.0.1
listen_port = {self._port}
unix_socket_dir =
auth_type = trust
auth_file = {users}
pool_mode = transaction
default_pool_size = 2
""")
        as_other = []
        if os.getuid() == 0:  # pgbouncer refuses to run as root.
            as_other = ["runuser", "-u", "postgres", "--"]
            for path in (folder, users, config):
                shutil.chown(path, "postgres")
        self._process = subprocess.Popen([*as_other, self.PROGRAM, config],
                                         stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._await_ready()
        return self

    def _await_ready(self):
        deadline = time.monotonic() + DEADLINE_S
        while True:
            try:
                socket.create_connection(("127.0.0.1", self._port), DEADLINE_S).close()
                return
            except ConnectionRefusedError:
                if self._process.poll() is not None or time.monotonic() > deadline:
                    raise
                time.sleep(0.01)

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(DEADLINE_S)
        self._temporary.cleanup()

    def through(self, uri):
        """Returns the URI by which a database of the cluster is reached through this."""
        return uri.replace(f":{self._cluster.port}/", f":{self._port}/")


class Servers:
    """hypermapd processes on a new database. The end of the `with` block kills those that run."""

    def __init__(self, cluster, folder):
        self._folder = pathlib.Path(folder)
        self.store = cluster.new_database()
        self._servers = []

    def start(self, number=1, *flags):
        """Starts further servers, with the flags."""
        for _ in range(number):
            self._servers.append(self._start(len(self._servers), *flags))

    def _start(self, i, *flags):
        data_dir = self.folder_of(i)
        data_dir.mkdir(exist_ok=True)
        return Server(data_dir, f"--store={self.store}", f"--server_id=server_{i}", *flags)

    def folder_of(self, i):
        return self._folder / f"server_{i}"

    def restart(self, i, *flags):
        """Starts a server that was killed again, at its address."""
        self._servers[i] = self._start(i, f"--listen={self._servers[i].address}", *flags)

    def kill(self, i):
        """Kills a server with SIGKILL."""
        self._servers[i].kill()

    def __getitem__(self, i):
        return self._servers[i]

    def __len__(self):
        return len(self._servers)

    @property
    def addresses(self):
        """The addresses of all servers, also of killed ones, as clients take them."""
        return ",".join(server.address for server in self._servers)

    def owner_of(self, map_name):
        """Returns the index of the server that owns a map, as a server that runs tells; None if the
        map has no owner at the moment, or is not there."""
        with rpc.Client(next(s for s in self._servers if s.running()).address) as client:
            owners = {entry.name: entry.owner for entry in client.ListServers().maps}
        owner = owners.get(map_name)
        return int(owner.removeprefix("server_")) if owner else None

    def await_owner(self, map_name, i):
        """Waits until a server owns a map."""
        self._await(lambda: self.owner_of(map_name) == i, f"server {i} does not own {map_name}")

    def await_map(self, map_name, revision=0):
        """Waits until all servers that run have the map, at this revision or a later one."""
        for server in self._servers:
            if server.running():
                with rpc.Client(server.address) as client:
                    self._await(lambda: _has(client, map_name, revision),
                                f"{server.address} does not have {map_name}")

    def _await(self, condition, problem):
        deadline = time.monotonic() + DEADLINE_S
        while not condition():
            if time.monotonic() > deadline:
                raise AssertionError("\n".join([problem, *(s.log() for s in self._servers)]))
            time.sleep(0.01)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for server in self._servers:
            server.__exit__()


def _has(client, map_name, revision):
    try:
        return client.GetMap(map=map_name).map.revision >= revision
    except rpc.grpc.RpcError as error:
        if error.code() in (rpc.grpc.StatusCode.NOT_FOUND, rpc.grpc.StatusCode.UNAVAILABLE):
            return False
        raise


def changes(events):
    """Yields the events of a watch without those that only tell its progress."""
    return (event for event in events if "time" in event)


class FleetTest(SiteTest):
    """A test case with a cluster for all its tests, and servers on a database for each."""

    @classmethod
    def setUpClass(cls):
        cls.cluster = cls.enterClassContext(Cluster())

    def servers(self, number, *flags):
        servers = self.enterContext(Servers(self.cluster, self.folder))
        servers.start(number, *flags)
        return servers

    def begin(self, addresses, *arguments):
        """Starts a command with the addresses of servers, which ends with the test."""
        command = subprocess.Popen(
            [BIN / "hypermap", "--server", addresses, *map(str, arguments)],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(command.kill)
        return command

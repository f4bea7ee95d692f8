"""The programs of deploy/compose.yaml, and of compose.postgres.yaml with it, work together as they
start them.

The test needs no container engine. It starts the real programs with the commands of the file and the
secrets of deploy/make_secrets.sh, with the folders of this machine in place of the containers', and
ports of the loopback that the programs choose in place of theirs.
"""

import functools
import os
import pathlib
import re
import shutil
import socket
import ssl
import subprocess
import tempfile
import time
import unittest
import urllib.request

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("HYPERMAP_BIN", ROOT / "build" / "bin"))
DEPLOY = ROOT / "deploy"
DEADLINE_S = 120
PROGRAMS = {"server": "hypermapd", "server-b": "hypermapd", "ingest": "hypermap-ingest",
            "dashboard": "hypermap-gateway"}
METRICS = r"metrics are served.*127\.0\.0\.1:(\d+)"
POSTGRES = pathlib.Path("/usr/lib/postgresql/15/bin")


def eventually(condition):
    """Waits until the condition returns something true, and returns that."""
    deadline = time.monotonic() + DEADLINE_S
    while not (result := condition()):
        if time.monotonic() > deadline:
            raise AssertionError("nothing happens")
        time.sleep(0.05)
    return result


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def merged(below, above):
    """Merges two files as compose does: lists grow, except commands, and values are replaced."""
    if isinstance(below, dict) and isinstance(above, dict):
        return below | {key: above[key] if key == "command" or key not in below
                        else merged(below[key], above[key]) for key in above}
    return below + above if isinstance(below, list) else above


class ComposeTest(unittest.TestCase):
    """A test case with secrets, and functions that start services of the files."""

    FILES = ()

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.secrets = self.folder / "secrets"
        self.volumes = self.folder / "volumes"
        self.volumes.mkdir()
        self.compose = functools.reduce(
            merged, (yaml.safe_load((DEPLOY / name).read_text()) for name in self.FILES))
        # (service, port in its container) -> port on this machine, of the programs that were started
        self.ports = {}
        self.make_secrets()

    def make_secrets(self):
        subprocess.run([DEPLOY / "make_secrets.sh", "maps.example.org"], check=True, timeout=60,
                       stdout=subprocess.DEVNULL,
                       env={**os.environ, "SECRETS": str(self.secrets),
                            "HYPERMAP": str(BIN / "hypermap")})

    def path_on_host(self, service, path):
        """Returns where a path in a container is on this machine."""
        folder, _, name = path.rpartition("/")
        if folder == "/run/secrets":
            self.assertIn(name, service["secrets"])
            return self.secrets / pathlib.Path(self.compose["secrets"][name]["file"]).name
        for volume in service.get("volumes", []):
            source, target = volume.split(":")[:2]
            if pathlib.PurePath(path).is_relative_to(target):
                inner = pathlib.PurePath(path).relative_to(target)
                if source in self.compose["volumes"]:
                    return self.volumes / source / inner
                return self.secrets / pathlib.PurePath(source).relative_to("./secrets") / inner
        return path

    def arguments(self, name):
        """Returns the command of a service with the paths and ports of this machine."""
        service = self.compose["services"][name]
        for argument in service["command"]:
            argument = re.sub(r"\$\{HYPERMAP_HOST:-([^}]*)\}", r"\1", argument)
            flag, equals, value = argument.partition("=")
            if value.startswith("/"):
                value = str(self.path_on_host(service, value))
            if flag.endswith("listen"):
                value = f"127.0.0.1:{self.ports.get((name, int(value.rpartition(':')[2])), 0)}"
            elif re.fullmatch(r"[\w.-]+:\d+(,[\w.-]+:\d+)*", value):
                value = ",".join(self.address_of(address) for address in value.split(","))
            yield flag + equals + value

    def address_of(self, address):
        """Returns where a service of this machine is that containers find at the address."""
        service, _, port = address.partition(":")
        return f"localhost:{self.ports[service, int(port)]}"

    def start(self, name, **told):
        """Starts a service. `told` has patterns of the lines that tell its ports, by the flags."""
        log = self.folder / f"{name}.log"
        with open(log, "wb") as output:
            process = subprocess.Popen([BIN / PROGRAMS[name], *self.arguments(name)],
                                       stdout=output, stderr=output)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        eventually(lambda: " ready on " in log.read_text() or process.poll() is not None)
        self.assertIsNone(process.poll(), log.read_text())
        for flag, pattern in {"listen": r" ready on \S+:(\d+)", **told}.items():
            number = re.search(rf"--{flag}=\S+:(\d+)",
                               " ".join(self.compose["services"][name]["command"]))[1]
            self.ports[name, int(number)] = int(re.search(pattern, log.read_text())[1])
        return process

    def hypermap(self, *arguments, servers=("server",), token="ops.token"):
        addresses = ",".join(self.address_of(f"{server}:50051") for server in servers)
        return subprocess.run(
            [BIN / "hypermap", "--server", addresses,
             "--tls_ca", self.secrets / "ca.pem", "--token_file", self.secrets / token, *arguments],
            capture_output=True, text=True, check=False, timeout=DEADLINE_S)

    def check_images(self):
        """Checks that images are targets of the Dockerfile, and that there are the secrets."""
        stages = re.findall(r"^FROM \S+ AS (\S+)$", (DEPLOY / "Dockerfile").read_text(),
                            re.MULTILINE)
        for name, service in self.compose["services"].items():
            if "build" in service:
                self.assertIn(service["build"]["target"], stages)
                self.assertIn(name, PROGRAMS)
            self.assertLessEqual(set(service.get("secrets", [])), set(self.compose["secrets"]))


class Compose(ComposeTest):
    FILES = ("compose.yaml",)

    def test_the_services_work_together(self):
        self.start("server", metrics_listen=METRICS)
        done = self.hypermap("map", "create", "site")
        self.assertEqual(done.returncode, 0, done.stderr)
        if (BIN / "hypermap-ingest").exists():
            self.start("ingest")
            self.assertIn("semantic", self.hypermap("layers", "site").stdout)
        if (BIN / "hypermap-gateway").exists():
            self.start("dashboard")
            trust = ssl.create_default_context(cafile=self.secrets / "ca.pem")
            address = f"https://{self.address_of('dashboard:8443')}/"
            with urllib.request.urlopen(address, context=trust, timeout=60) as page:
                self.assertIn(b"<html", page.read().lower())
        with urllib.request.urlopen(f"http://{self.address_of('server:9464')}/readyz",
                                    timeout=60) as ready:
            self.assertEqual(ready.status, 200)

    def test_secrets_stay_when_they_are_made_again(self):
        before = {path: path.read_bytes() for path in self.secrets.rglob("*") if path.is_file()}
        self.assertIn(self.secrets / "access" / "access.yaml", before)
        self.make_secrets()
        self.assertEqual({path: path.read_bytes() for path in before}, before)
        self.assertEqual(self.secrets.stat().st_mode & 0o077, 0)
        for private in ("ca.key", "ops.token"):
            self.assertEqual((self.secrets / private).stat().st_mode & 0o077, 0)

    def test_the_certificate_has_the_names_under_which_the_server_is_called(self):
        text = subprocess.run(["openssl", "x509", "-in", self.secrets / "server.pem", "-noout",
                               "-ext", "subjectAltName"], capture_output=True, text=True,
                              check=True, timeout=60).stdout
        for name in ("localhost", "127.0.0.1", "server", "maps.example.org"):
            self.assertIn(name, text)

    def test_images_and_secrets_are_there(self):
        self.check_images()


@unittest.skipUnless((POSTGRES / "initdb").exists(), "PostgreSQL is missing")
class ComposePostgres(ComposeTest):
    FILES = ("compose.yaml", "compose.postgres.yaml")

    def start_database(self):
        """Starts PostgreSQL with the settings of the file, and a password as its image asks for."""
        service = self.compose["services"]["database"]
        database = self.folder / "database"
        database.mkdir()
        as_postgres = []
        if os.getuid() == 0:  # PostgreSQL refuses to run as root.
            as_postgres = ["runuser", "-u", "postgres", "--"]
            self.folder.chmod(0o755)
            shutil.chown(database, "postgres")
        environment = service["environment"]
        password = self.path_on_host(service, environment["POSTGRES_PASSWORD_FILE"])
        certificate = self.path_on_host(service, "/run/secrets/server_cert")
        for source, copy in ((password, "password"), (certificate, "server.pem"),
                             (self.path_on_host(service, "/run/secrets/server_key"), "server.key")):
            shutil.copy(source, database / copy)
            if as_postgres:
                shutil.chown(database / copy, "postgres")
            (database / copy).chmod(0o600)
        data, user = database / "data", environment["POSTGRES_USER"]
        subprocess.run([*as_postgres, POSTGRES / "initdb", "-D", data, "-U", user, "--no-sync",
                        "--auth=scram-sha-256", f"--pwfile={database / 'password'}"],
                       check=True, capture_output=True, timeout=DEADLINE_S)
        settings = dict(re.findall(r"-c (\w+)=(\S+)", service["command"][-1])) | {
            "ssl_cert_file": database / "server.pem", "ssl_key_file": database / "server.key",
            "listen_addresses": "127.0.0.1", "unix_socket_directories": database, "fsync": "off"}
        self.ports["database", 5432] = port = free_port()
        process = subprocess.Popen(
            [*as_postgres, POSTGRES / "postgres", "-D", data, "-p", str(port),
             *(word for name, value in settings.items() for word in ("-c", f"{name}={value}"))],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(subprocess.run, [*as_postgres, POSTGRES / "pg_ctl", "-D", data, "stop",
                                         "--mode=immediate"], capture_output=True, timeout=60)
        probe = ["psql", "-qAtX", "-h", "localhost", "-p", str(port), "-U", user, "-d", "postgres"]
        secret = {**os.environ, "PGPASSWORD": password.read_text().strip()}
        eventually(lambda: subprocess.run([*probe, "-c", "SELECT 1"], env=secret, timeout=60,
                                          capture_output=True, check=False).returncode == 0)
        subprocess.run([*probe, "-c", f"CREATE DATABASE {environment['POSTGRES_DB']}"], env=secret,
                       check=True, timeout=60)

    def use_database(self):
        """Puts the places of this machine in the file of flags of the servers."""
        store = self.secrets / "store.yaml"
        server = self.compose["services"]["server"]
        text = store.read_text().replace("@database/", f"@{self.address_of('database:5432')}/")
        store.write_text(re.sub(r"/run/secrets/\w+",
                                lambda path: str(self.path_on_host(server, path[0])), text))

    def start_server(self, name):
        # Others are told the port, which therefore is one that is chosen before.
        self.ports[name, 50051] = free_port()
        return self.start(name, metrics_listen=METRICS)

    def test_one_server_goes_on_for_the_other(self):
        self.start_database()
        self.use_database()
        first = self.start_server("server")
        self.start_server("server-b")
        both = ("server", "server-b")
        eventually(lambda: all(self.hypermap("servers", servers=[name]).stdout.count("localhost:") == 2
                               for name in both))
        for number, name in enumerate(both):
            self.succeed("map", "create", f"site-{number}", servers=[name])
        # Whichever owns a map, the other passes calls on to it.
        for number in range(2):
            for name in both:
                self.succeed("layer", "create", f"site-{number}", f"things-{name}",
                             "--kind=semantic", servers=[name])
        first.kill()
        first.wait()
        for number in range(2):
            self.succeed("layer", "create", f"site-{number}", "more", "--kind=semantic", servers=both)

    def succeed(self, *arguments, servers):
        """Runs a command until it succeeds: a server learns soon of a map that another has made."""
        eventually(lambda: self.hypermap(*arguments, servers=servers).returncode == 0)

    def test_images_and_secrets_are_there(self):
        self.check_images()
        self.assertEqual(self.compose["services"]["server-b"]["image"],
                         self.compose["services"]["server"]["image"])

    def test_prometheus_asks_both_servers(self):
        config = pathlib.Path(next(
            argument.partition("=")[2] for argument in self.compose["services"]["prometheus"]["command"]
            if argument.startswith("--config.file=")))
        (job,) = yaml.safe_load((DEPLOY / "prometheus" / config.name).read_text())["scrape_configs"]
        self.assertEqual(job["static_configs"][0]["targets"], ["server:9464", "server-b:9464"])


if __name__ == "__main__":
    unittest.main()

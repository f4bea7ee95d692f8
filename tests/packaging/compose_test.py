"""The programs of deploy/compose.yaml work together as it starts them.

The test needs no container engine. It starts the real programs with the commands of the file and the
secrets of deploy/make_secrets.sh, with the folders of this machine in place of the containers', and
ports of the loopback that the programs choose in place of theirs.
"""

import contextlib
import os
import pathlib
import re
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
PROGRAMS = {"server": "hypermapd", "ingest": "hypermap-ingest", "dashboard": "hypermap-gateway"}


def eventually(condition):
    """Waits until the condition returns something true, and returns that."""
    deadline = time.monotonic() + DEADLINE_S
    while not (result := condition()):
        if time.monotonic() > deadline:
            raise AssertionError("nothing happens")
        time.sleep(0.05)
    return result


class Compose(unittest.TestCase):

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.secrets = self.folder / "secrets"
        self.maps = self.folder / "maps"
        self.maps.mkdir()
        self.compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
        self.ports = {}  # in a container -> on this machine, of the programs that were started
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
                    return self.maps / inner
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
            if port := re.fullmatch(r"[\w.]+:(\d+)", value):
                value = ("127.0.0.1:0" if flag.endswith("listen") else
                         f"localhost:{self.ports[int(port[1])]}")
            yield flag + equals + value

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
            self.ports[int(number)] = int(re.search(pattern, log.read_text())[1])

    def hypermap(self, *arguments, token="ops.token"):
        return subprocess.run(
            [BIN / "hypermap", "--server", f"localhost:{self.ports[50051]}",
             "--tls_ca", self.secrets / "ca.pem", "--token_file", self.secrets / token, *arguments],
            capture_output=True, text=True, check=False, timeout=DEADLINE_S)

    def test_the_services_work_together(self):
        self.start("server", metrics_listen=r"metrics are served.*127\.0\.0\.1:(\d+)")
        done = self.hypermap("map", "create", "site")
        self.assertEqual(done.returncode, 0, done.stderr)
        if (BIN / "hypermap-ingest").exists():
            self.start("ingest")
            self.assertIn("semantic", self.hypermap("layers", "site").stdout)
        if (BIN / "hypermap-gateway").exists():
            self.start("dashboard")
            trust = ssl.create_default_context(cafile=self.secrets / "ca.pem")
            address = f"https://localhost:{self.ports[8443]}/"
            with urllib.request.urlopen(address, context=trust, timeout=60) as page:
                self.assertIn(b"<html", page.read().lower())
        with urllib.request.urlopen(f"http://127.0.0.1:{self.ports[9464]}/readyz",
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

    def test_images_are_targets_of_the_dockerfile(self):
        stages = re.findall(r"^FROM \S+ AS (\S+)$", (DEPLOY / "Dockerfile").read_text(),
                            re.MULTILINE)
        for name, service in self.compose["services"].items():
            if "build" in service:
                self.assertIn(service["build"]["target"], stages)
                self.assertIn(name, PROGRAMS)
            with contextlib.suppress(KeyError):
                for secret in service["secrets"]:
                    self.assertIn(secret, self.compose["secrets"])


if __name__ == "__main__":
    unittest.main()

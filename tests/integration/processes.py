"""Runs the real programs as processes: hypermapd on a free port, and the hypermap command.

The functions do not sleep: they wait for output with a deadline.
"""

import json
import os
import pathlib
import random
import re
import resource
import selectors
import signal
import socket
import subprocess
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("HYPERMAP_BIN", ROOT / "build" / "bin"))
DATA = pathlib.Path(os.environ.get("HYPERMAP_DATA") or ROOT.parent / "shared" / "data")
# Maximum duration of each operation. It is generous: on a busy machine, sanitizers are slow, and
# long work of the server gets little of the processors (decision 25). A hang lasts forever anyway.
DEADLINE_S = float(os.environ.get("HYPERMAP_TEST_DEADLINE", "300"))
# Number of random queries per kind and map.
QUESTIONS = int(os.environ.get("HYPERMAP_TEST_QUESTIONS", "200"))
# Sanitizers make programs slow and take memory of their own. Only their builds set this variable.
IS_SANITIZED = "HYPERMAP_TEST_ROUNDS" in os.environ
SEED = int(os.environ.get("HYPERMAP_TEST_SEED", time.time_ns() % 1_000_000))

READY = re.compile(rb"^hypermapd ready on (127\.0\.0\.1:(\d+))\n", re.MULTILINE)


# For tests of the files of maps: tests/postgres runs the others with maps in a database.
needs_files = unittest.skipIf("HYPERMAP_TEST_POSTGRES" in os.environ, "the maps are no files here")


class Server:
    """A hypermapd process on `data_dir`. The end of the `with` block kills it if it still runs.

    `limits` are resource limits by their number, such as {resource.RLIMIT_NOFILE: 1024}; each is
    the soft and the hard limit. `environment` are further environment variables. `program` is
    another copy of the program, and `user` the number of the user that it runs as.

    A server has a session of its own, as under systemd, unless `own_session` is False. Linux shares
    the processors among sessions (autogroup), so that the niceness of the server's long work does
    not count against the tests that run at the same time (decision 25).
    """

    def __init__(self, data_dir, *flags, limits=None, environment=None, program=None, user=None,
                 own_session=True):
        def limit_resources():
            for number, value in (limits or {}).items():
                resource.setrlimit(number, (value, value))
            if user is not None:
                os.setuid(user)

        self._log = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [program or BIN / "hypermapd", f"--data_dir={data_dir}", "--listen=127.0.0.1:0",
             *flags],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self._log,
            start_new_session=own_session,
            preexec_fn=limit_resources if limits or user is not None else None,
            env={**os.environ, **environment} if environment else None)
        try:
            self.stdout = self._read_until_ready()
        except BaseException:
            self.__exit__()
            raise
        self.address, self.port = (g.decode() for g in READY.search(self.stdout).groups())

    def _read_until_ready(self):
        deadline, output = time.monotonic() + DEADLINE_S, b""
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while not READY.search(output):
                if not selector.select(deadline - time.monotonic()):
                    raise AssertionError(f"hypermapd not ready in {DEADLINE_S} s: {self.log()}")
                piece = os.read(self._process.stdout.fileno(), 65536)
                if not piece:
                    self._process.wait(DEADLINE_S)
                    raise AssertionError(f"hypermapd did not start: {output} {self.log()}")
                output += piece
        return output

    def log(self):
        """Returns everything that the server has written to stderr so far."""
        self._log.seek(0)
        return self._log.read().decode(errors="replace")

    @property
    def pid(self):
        return self._process.pid

    def running(self):
        return self._process.poll() is None

    def signal(self, number):
        self._process.send_signal(number)

    def wait(self, deadline_s=DEADLINE_S):
        """Waits until the process has ended and returns its exit code."""
        return self._process.wait(deadline_s)

    def stop(self):
        """Stops the server with SIGTERM, like systemd, and returns its exit code."""
        self.signal(signal.SIGTERM)
        return self.wait()

    def kill(self):
        """Kills the server with SIGKILL, so that it cannot shut down cleanly."""
        self.signal(signal.SIGKILL)
        self.wait()

    def cli(self, *arguments, **options):
        return cli("--server", self.address, *arguments, **options)

    def json(self, *arguments):
        """Runs a command that must succeed, and returns the one JSON document that it prints."""
        (document,) = self.json_lines(*arguments)
        return document

    def json_lines(self, *arguments):
        result = self.cli("--json", *arguments)
        if result.returncode != 0:
            raise AssertionError(f"hypermap {arguments}: {result.returncode} {result.stderr}")
        return [json.loads(line) for line in result.stdout.splitlines()]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.running():
            self.kill()
        self._process.stdout.close()
        self._log.close()


def cli(*arguments, **options):
    """Runs `hypermap`. Returns the result whatever its exit code is."""
    return subprocess.run([BIN / "hypermap", *map(str, arguments)], capture_output=True, text=True,
                          timeout=DEADLINE_S, check=False, stdin=subprocess.DEVNULL, **options)


def start_and_fail(data_dir, *flags):
    """Runs a hypermapd that must refuse to start, and returns (exit code, stderr)."""
    result = subprocess.run(
        [BIN / "hypermapd", f"--data_dir={data_dir}", "--listen=127.0.0.1:0", *flags],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    return result.returncode, result.stderr


def lasting_port():
    """Returns a port that is free. The kernel gives it to nobody who asks for any port, so that it
    is still free each time the server starts again."""
    while True:
        port = random.randrange(10_000, 32_768)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
                return port
            except OSError:
                continue


def real_maps():
    """Returns the paths of the recorded maps by name; empty if this machine does not have them."""
    return {path.stem: path for path in sorted(DATA.glob("maps/*.hmap"))}


class SiteTest(unittest.TestCase):
    """A test case with an empty data folder, which is deleted after each test."""

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="hypermap-")))
        self.data_dir = self.folder / "data"
        self.data_dir.mkdir()

    def server(self, *flags, data_dir=None):
        return self.enterContext(Server(data_dir or self.data_dir, *flags))

    def assert_fails(self, result, *words, code=1):
        """Checks that a command has failed with an exit code and one line that has all words."""
        self.assertEqual(result.returncode, code, result)
        self.assertEqual(result.stdout, "")
        lines = result.stderr.splitlines()
        self.assertEqual(len(lines), 1, result.stderr)
        for word in words:
            self.assertIn(word.lower(), lines[0].lower())

"""Runs hypermapd as a process on a free port."""

from __future__ import annotations

import os
import pathlib
import random
import re
import selectors
import socket
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
BIN = pathlib.Path(os.environ.get("HYPERMAP_BIN", ROOT / "build" / "bin"))
OFFICE = ROOT / "demo" / "office"
# Seconds after which a test gives up waiting. Only a hang takes this long, also on a busy machine.
DEADLINE_S = 300.0

READY = re.compile(rb"^hypermapd ready on (127\.0\.0\.1:\d+)\n", re.MULTILINE)


def lasting_port() -> int:
    """A port that is free, and that the kernel gives to nobody who asks for any port."""
    while True:
        port = random.randrange(10_000, 32_768)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
                return port
            except OSError:
                continue


class Server:
    """A hypermapd process on `data_dir`. The end of the `with` block kills it if it still runs."""

    def __init__(
        self, data_dir: os.PathLike[str], *flags: str, listen: str = "127.0.0.1:0"
    ) -> None:
        self._log = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [BIN / "hypermapd", f"--data_dir={data_dir}", f"--listen={listen}", *flags],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self._log,
            start_new_session=True,  # As in tests/integration/processes.py.
        )
        try:
            self.address = self._read_address()
        except BaseException:
            self.__exit__()
            raise

    def _read_address(self) -> str:
        deadline, output = time.monotonic() + DEADLINE_S, b""
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while not (ready := READY.search(output)):
                assert selector.select(deadline - time.monotonic()), f"not ready: {self.log()}"
                data = os.read(self._process.stdout.fileno(), 65536)
                assert data, f"did not start: {self.log()}"
                output += data
        return ready[1].decode()

    def log(self) -> str:
        self._log.seek(0)
        return self._log.read().decode(errors="replace")

    def stop(self) -> int:
        """Stops the server with SIGTERM and returns its exit code."""
        self._process.terminate()
        return self._process.wait(DEADLINE_S)

    def send_signal(self, number: int) -> None:
        self._process.send_signal(number)

    def kill(self) -> None:
        """Kills the server with SIGKILL, so that it cannot shut down cleanly."""
        self._process.kill()
        self._process.wait(DEADLINE_S)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self.kill()
        self._process.stdout.close()
        self._log.close()

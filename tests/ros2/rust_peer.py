"""A node of ros2-client, whose DDS is RustDDS, as a process (peer/src/main.rs has its commands)."""

import dataclasses
import functools
import json
import pathlib
import selectors
import subprocess
import time
import types

import dds_types as dds
from processes import DEADLINE_S

FOLDER = pathlib.Path(__file__).resolve().parent / "peer"


@functools.cache
def build():
    """The program, or None where it can't be built, because Rust or a registry of crates is missing."""
    result = subprocess.run([FOLDER / "build.sh"], stdout=subprocess.PIPE, text=True, check=False)
    if result.returncode == 77:
        return None
    if result.returncode != 0:
        raise AssertionError("the peer was not built")
    return result.stdout.strip()


class RustPeer:
    """The process. `mapping` is "cyclone" or "enhanced", by which rmw_fastrtps tells calls apart."""

    def __init__(self, domain, mapping):
        self._process = subprocess.Popen([build(), str(domain), mapping], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, text=True)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._process.stdout, selectors.EVENT_READ)

    def latched_map(self, topic):
        """The OccupancyGrid of a topic."""
        return self._command(map=topic)

    def await_node(self, name):
        self._command(node=name)

    def client(self, service):
        return RustClient(self._command, service)

    def _command(self, **command):
        print(json.dumps(command), file=self._process.stdin, flush=True)
        if not self._selector.select(DEADLINE_S):
            raise AssertionError(f"no answer within {DEADLINE_S} s: {command}")
        # Each command is answered by one line, so that none can be in the buffer already.
        line = self._process.stdout.readline()
        if not line:
            raise AssertionError(f"the peer ended: {command}")
        return json.loads(line, object_hook=lambda fields: types.SimpleNamespace(**fields))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._process.stdin.close()
        self._process.stdout.close()
        self._selector.close()


class RustClient:
    """A client of a service, with the method of nodes.Client."""

    def __init__(self, command, service):
        self._command = command
        self._service = service
        self._request, _ = dds.SERVICES[service.rsplit("/", 1)[1]]

    def call(self, *fields):
        # The 16 bytes of Cyclone DDS are ros2-client's business.
        request = dataclasses.asdict(self._request(0, 0, *fields))
        return self._command(call=self._service, request=request)

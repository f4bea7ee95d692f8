"""Puts the load of a fleet (`hypermap bench`) on a real hypermapd, injects a fault every minute, and
reports whether anything was lost and whether the server's memory stayed flat.

The faults take turns: the server is killed, stopped, or frozen; its disk is full, also while it is
killed and started again; it gets no more file descriptors. A full disk is a small file system in
memory, which only root can mount; without it, those faults are left out, and the report says so.

The last line is a JSON object with the counts and "holds". Exit code 1: something was lost, the
server did not notice a full disk or did not get over a fault, the map's file is damaged, or memory
grew.
"""

import argparse
import contextlib
import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time

from processes import BIN, DEADLINE_S, Server, cli, lasting_port

SMALL_FLEET = {"robots": 8, "replicas": 4, "full_replicas": 2, "watchers": 3, "editors": 1}
DISK_MIB = 6144
MAX_GROWTH = 0.05
# After a start, the server's memory grows while its clients come back.
SETTLED_S = 10
# Counts in the report of the load that are zero if nothing was lost.
NOTHING = ["edits_lost", "edits_repeated", "observations_lost", "revisions_missed",
           "revisions_repeated", "revisions_reordered", "watchers_behind", "replicas_behind",
           "replicas_different", "unanswered"]


def process_status(pid, name):
    """Returns the first word of a line of /proc/PID/status."""
    status = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return re.search(rf"^{name}:\s+(\S+)", status, re.MULTILINE)[1]


class Machine:
    """The server with its data folder and its disk, and what befalls them."""

    def __init__(self, folder, address, has_small_disk):
        self.folder, self.address, self.has_small_disk = folder, address, has_small_disk
        self.data_dir = folder / "data"
        self.data_dir.mkdir()
        self.server = None
        self.started = 0

    def start(self):
        self.server = Server(self.data_dir, f"--listen={self.address}")
        self.started = time.monotonic()

    def resident_mib(self):
        """Returns None while the server is away, frozen, or has just started."""
        if time.monotonic() < self.started + SETTLED_S or not self.server.running():
            return None
        return int(process_status(self.server.pid, "VmRSS")) / 1024

    def map_state(self):
        (site,) = self.server.json("maps")["maps"]
        return site["state"]

    def await_state(self, *states):
        deadline = time.monotonic() + DEADLINE_S
        while (state := self.map_state()) not in states:
            if time.monotonic() > deadline:
                raise AssertionError(f"the map stays {state}")
            time.sleep(0.1)

    def end(self):
        if self.server:
            self.server.__exit__()

    # The faults, for `seconds` each. They return when the fault is over.

    def kill(self, seconds):
        self.server.kill()
        self.server.__exit__()
        time.sleep(min(1, seconds))
        self.start()

    def stop(self, _):
        code = self.server.stop()
        self.server.__exit__()
        if code != 0:
            raise AssertionError(f"a server that was stopped ended with {code}")
        self.start()

    def freeze(self, seconds):
        self.server.signal(signal.SIGSTOP)
        time.sleep(seconds)
        self.server.signal(signal.SIGCONT)

    def full_disk(self, seconds):
        with self.filled_disk():
            self.await_state("read_only")
            time.sleep(seconds)
        self.await_state("serving")

    def kill_on_full_disk(self, seconds):
        with self.filled_disk():
            self.await_state("read_only")
            self.kill(seconds)
            time.sleep(seconds)
        self.await_state("serving")

    def no_descriptors(self, seconds):
        limits = resource.prlimit(self.server.pid, resource.RLIMIT_NOFILE)
        in_use = max(map(int, os.listdir(f"/proc/{self.server.pid}/fd")))
        resource.prlimit(self.server.pid, resource.RLIMIT_NOFILE, (in_use, limits[1]))
        time.sleep(seconds)
        resource.prlimit(self.server.pid, resource.RLIMIT_NOFILE, limits)

    @contextlib.contextmanager
    def filled_disk(self):
        path = self.folder / "filler"
        with open(path, "wb", buffering=0) as file:
            # Space may become free meanwhile, such as that of a log.
            for size in (64 << 20, 1 << 20, 4096):
                with contextlib.suppress(OSError):
                    while True:
                        os.posix_fallocate(file.fileno(), os.fstat(file.fileno()).st_size, size)
            try:
                yield
            finally:
                os.unlink(path)

    def faults(self):
        always = [self.kill, self.freeze, self.stop, self.no_descriptors]
        return always + ([self.full_disk, self.kill_on_full_disk] if self.has_small_disk else [])


@contextlib.contextmanager
def small_disk(mib):
    """Yields a folder, and whether it is a disk of its own of that size."""
    with tempfile.TemporaryDirectory(prefix="hypermap-load-") as name:
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={mib}m", "tmpfs", name],
                                 capture_output=True, check=False).returncode == 0
        try:
            yield pathlib.Path(name), mounted
        finally:
            if mounted:
                subprocess.run(["umount", "--lazy", name], check=True)


def inject(machine, load, options):
    """Injects faults until the load is about to end. Returns what was injected, and the memory of
    the server and of the load, each with the second at which it was."""
    begin = time.monotonic()
    injected, memory, load_memory = [], [], []
    faults = machine.faults()
    next_fault = options.period / 2
    while load.poll() is None:
        now = time.monotonic() - begin
        if now >= next_fault and next_fault + options.period / 2 <= options.seconds:
            fault = faults[len(injected) % len(faults)]
            fault(options.fault_seconds)
            took = time.monotonic() - begin - now
            injected.append({"second": round(now), "fault": fault.__name__, "took": round(took, 1)})
            print(f"{now:6.0f} s  {fault.__name__}, {took:.1f} s", flush=True)
            next_fault += options.period
        mib = machine.resident_mib()
        if now <= options.seconds:
            if mib is not None:
                memory.append((now, mib))
            with contextlib.suppress(FileNotFoundError, TypeError):  # The load has just ended.
                load_memory.append((now, int(process_status(load.pid, "VmRSS")) / 1024))
        time.sleep(1)
    return injected, memory, load_memory


def mean_between(memory, begin, end):
    values = [mib for second, mib in memory if begin <= second < end]
    return sum(values) / len(values) if values else None


def growth(memory, seconds):
    """Returns the mean memory of the second and of the last quarter, and the growth between them,
    by their names in the report. Nones if there are no values."""
    second = mean_between(memory, seconds / 4, seconds / 2)
    last = mean_between(memory, seconds * 3 / 4, seconds)
    return {"second_quarter": second, "last_quarter": last,
            "growth": last / second - 1 if second and last else None}


def rounded(numbers):
    return {name: number and round(number, 4) for name, number in numbers.items()}


def run(options, folder, has_small_disk, log, answer):
    """`log` and `answer` are files for what the load prints: a pipe that nobody reads until the end
    could hold it up."""
    address = f"127.0.0.1:{lasting_port()}"
    machine = Machine(folder, address, has_small_disk)
    fleet = SMALL_FLEET if options.short else {}
    try:
        machine.start()
        with subprocess.Popen(
                [BIN / "hypermap", "--server", address, "bench", "site", "--json",
                 f"--seconds={options.seconds}", f"--seed={options.seed}",
                 *(f"--{name}={number}" for name, number in fleet.items())],
                stdin=subprocess.DEVNULL, stdout=answer, stderr=log) as load:
            try:
                injected, memory, load_memory = inject(machine, load, options)
            finally:
                load.kill()
        answer.seek(0)
        told = answer.read()
        if not told:
            log.seek(0)
            raise AssertionError(f"the load ended with {load.returncode} and tells nothing: "
                                 f"{log.read().decode()[-20_000:]}")
        report = json.loads(told)
        state = machine.map_state()
        code = machine.server.stop()
        check = cli("check", machine.data_dir / "site.gpkg")
    finally:
        machine.end()

    grown = growth(memory, options.seconds)
    lost = {name: report["consistency"][name] for name in NOTHING}
    # The short form is over before memory has settled.
    is_flat = options.short or (grown["growth"] is not None and grown["growth"] <= MAX_GROWTH)
    holds = (report["holds"] and not any(lost.values()) and injected != [] and state == "serving"
             and code == 0 and check.returncode == 0 and is_flat)
    if not holds:
        log.seek(0)
        print(check.stdout, check.stderr, log.read().decode()[-20_000:])
    operations = report["operations"]
    return {
        "proof": "load", "seconds": options.seconds, "faults": len(injected),
        "by_fault": {fault.__name__: sum(i["fault"] == fault.__name__ for i in injected)
                     for fault in machine.faults()},
        "small_disk": has_small_disk,
        "observations": operations["observation"]["count"], "edits": operations["edit"]["count"],
        "retries": sum(operation["retries"] for operation in operations.values()),
        "outages": len(report["outages"]),
        "streams_not_back": sum(outage["streams_not_back"] for outage in report["outages"]),
        **lost, "problems": report["consistency"]["problems"], "state": state, "exit_code": code,
        "check": check.returncode,
        "resident_mib": rounded(grown),
        "resident_mib_of_load": rounded(growth(load_memory, options.seconds)),
        "holds": holds}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=int, default=3600, help="duration of the load")
    parser.add_argument("--period", type=float, default=60, help="seconds from fault to fault")
    parser.add_argument("--fault_seconds", type=float, default=5, help="duration of a fault")
    parser.add_argument("--seed", type=int, default=1, help="of the load's random numbers")
    parser.add_argument("--short", action="store_true", help="a small fleet, each fault once")
    options = parser.parse_args()
    if options.short:
        options.period, options.fault_seconds = 8, 1
        options.seconds = 6 * int(options.period)
    # The files are not on the disk that is full at times.
    with (small_disk(512 if options.short else DISK_MIB) as (folder, has_small_disk),
          tempfile.TemporaryFile() as log, tempfile.TemporaryFile() as answer):
        report = run(options, folder, has_small_disk, log, answer)
    print(json.dumps(report))
    return 0 if report["holds"] else 1


if __name__ == "__main__":
    sys.exit(main())

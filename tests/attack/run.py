"""Attacks real hypermapd processes that have small limits, and reports which they withstand.

Each attack gets a new server. Another process ("others") queries and edits a map, mostly not the
attacked one, first without the attack and then during it. Afterwards a new client queries, edits,
creates and deletes a map. An attack is "defended" unless the server ends, exceeds its memory limit,
answers others more than three times slower (p99 of all rounds) than without the attack, lets the
new client wait for more than a second, or fails to refuse what it should. The full form makes five
rounds of each attack; the short form makes one, and judges no times. If that one does not reach the
limit that it is to reach, because the machine is busy, the short form attacks again for longer.
"""

import argparse
import contextlib
import dataclasses
import json
import math
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import grpc

import attacks
import others
import rpc
import sites
from processes import BIN, DEADLINE_S, Server
from site_under_attack import PREY

HERE = pathlib.Path(__file__).resolve().parent
MEMORY_LIMIT = 1 << 30
# The address space keeps a server without defence from taking the memory of the machine. The limit
# of threads (Attack.max_threads) holds for a user other than root, of whom there is no other
# process: parts of the attacks may run at once.
LIMITS = {resource.RLIMIT_NOFILE: 1024, resource.RLIMIT_AS: 8 << 30}
USER = 30_000 + os.getpid() % 30_000
FLAGS = {"memory_limit": MEMORY_LIMIT, "max_scratch_bytes": 512 << 20}

ROUNDS = 5
QUIET_S = 3
# Pause of the clients that are not attacked after each call. The short form measures no time, and
# leaves the processors to the tests beside it.
PAUSE_S = {"full": 0, "short": 0.01}
SERVED_DEADLINE_S = 30
MAX_P99_RATIO = 3
MAX_SERVED_S = 1
# How many times as long the short form attacks when it attacks again.
STRETCHES = (4, 16)


@dataclasses.dataclass
class Round:
    """What was seen in one round of an attack."""
    told: dict
    # Faults apart from the measured times, such as "the server ended".
    wrong: list
    # Durations of others' calls in seconds; failed ones count as others.TIMEOUT_S.
    quiet: list
    during: list
    lost: int
    # Most memory that was in use during the attack, in bytes.
    peak: int
    # Time from the end of the attack until a new client was served, in seconds; None if it never
    # was.
    served_s: float | None


def percentile(durations, share):
    """Returns the duration that this share of all does not exceed, or None if there are none."""
    if not durations:
        return None
    return sorted(durations)[math.ceil(share * len(durations)) - 1]


def reset_peak_memory(pid):
    pathlib.Path(f"/proc/{pid}/clear_refs").write_text("5")


def peak_memory(pid):
    """Returns the most memory that the process has used since reset_peak_memory, in bytes; 0 if the
    process has ended."""
    try:
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    found = re.search(r"VmHWM:\s+(\d+) kB", status)
    return int(found[1]) * 1024 if found else 0


def make_maps(server):
    with rpc.Client(server.address) as client:
        for name in (PREY, others.MAP):
            sites.make(client, name)
            client.ApplyEdits(map=name, edits=[
                sites.put("chair", 2 * (i % 40), 2 * (i // 40)) for i in range(1000)])


def time_until_served(server):
    """Returns the seconds until a new client could ask, edit, create and delete; None if it could
    not within SERVED_DEADLINE_S or the server has ended."""
    begin, attempt = time.monotonic(), 0
    while (passed := time.monotonic() - begin) < SERVED_DEADLINE_S and server.running():
        attempt += 1
        left = {"timeout": SERVED_DEADLINE_S - passed}
        try:
            with rpc.Client(server.address) as client:
                client.QueryPoint(scope=rpc.scope(others.MAP), point=rpc.point(1, 1), **left)
                list(client.QueryArea(scope=rpc.scope(others.MAP),
                                      area=sites.square(0, 0, 10), **left))
                client.ApplyEdits(map=others.MAP, edits=[sites.put("lamp", 0, 0)], **left)
                client.CreateMap(map=f"new-{attempt}", **left)
                client.DeleteMap(map=f"new-{attempt}", **left)
            return time.monotonic() - begin
        except grpc.RpcError:
            time.sleep(0.005)
    return None


class Others:
    """The process of the clients that are not attacked."""

    def __init__(self, address, name, pause_s):
        self._output = tempfile.TemporaryFile("w+")
        self._process = subprocess.Popen(
            [sys.executable, HERE / "others.py", address, name, str(pause_s)],
            stdin=subprocess.PIPE, stdout=self._output)

    def wait_until_ready(self):
        """Waits for the first answer."""
        deadline = time.monotonic() + DEADLINE_S
        while os.fstat(self._output.fileno()).st_size == 0:
            if time.monotonic() > deadline or self._process.poll() is not None:
                raise AssertionError("the clients that are not attacked get no answer")
            time.sleep(0.01)

    def stop(self):
        self._process.stdin.close()
        self._process.wait(DEADLINE_S)

    def calls(self, begin, end):
        """Returns the durations of the calls that were under way between two times, and how many of
        them failed. Only after stop()."""
        self._output.seek(0)
        durations, lost = [], 0
        for line in self._output:
            started, ended, status = line.split()
            if float(ended) < begin or float(started) > end:
                continue
            if status == "OK":
                durations.append(float(ended) - float(started))
            else:
                durations.append(others.TIMEOUT_S)
                lost += 1
        return durations, lost

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._process.stdin.close()
        self._output.close()


class Attacker:
    """The process that attacks, in the steps of attacker.py."""

    def __init__(self, *arguments):
        self._output = tempfile.TemporaryFile("w+")
        self._process = subprocess.Popen(
            [sys.executable, HERE / "attacker.py", *map(str, arguments)], text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._output)

    def read(self):
        """Returns the next line of the attacker; None if it has ended."""
        return self._process.stdout.readline().strip() or None

    def go_on(self):
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write("\n")
            self._process.stdin.flush()

    def error(self):
        """Returns the last line that the attacker wrote to its standard error, or what it wrote of
        an RpcError, which has several lines."""
        self._output.seek(0)
        lines = [line.strip() for line in self._output.read().strip().splitlines()]
        told = [line for line in lines if line.startswith(("status =", "details ="))]
        return ", ".join(told) or (lines or ["no reason told"])[-1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._process.stdin.close()
        self._process.stdout.close()
        self._output.close()


@contextlib.contextmanager
def start_server(flags, max_threads):
    """Runs a server with LIMITS and at most so many threads; gives it with its data folder. If this
    process may, the server is of the user USER, with a copy of the program that this user can
    read."""
    with tempfile.TemporaryDirectory(prefix="hypermap-attack-") as folder:
        data_dir, program, user = pathlib.Path(folder) / "data", None, None
        data_dir.mkdir()
        if os.geteuid() == 0:
            user, program = USER, pathlib.Path(folder) / "hypermapd"
            shutil.copy(BIN / "hypermapd", program)
            pathlib.Path(folder).chmod(0o755)
            os.chown(data_dir, USER, -1)
        limits = {**LIMITS, resource.RLIMIT_NPROC: max_threads}
        # In the same session, so that attackers and server compete for the processors as equals.
        with Server(data_dir, *flags, limits=limits, program=program, user=user,
                    own_session=False) as server:
            yield server, data_dir


def attack_once(attack, form, share, flags, stretch=1):
    """Runs one round against a server of its own, `stretch` times as long as usual."""
    with start_server(flags, attack.max_threads) as (server, folder):
        make_maps(server)
        with Attacker(attack.name, server.address, server.pid, folder, form, stretch,
                      share) as attacker:
            if attacker.read() != "prepared":
                raise AssertionError(f"{attack.name} could not be prepared: {attacker.error()}")
            name = PREY if attack.same_map else others.MAP
            with Others(server.address, name, PAUSE_S[form]) as clients:
                return _attack_prepared(attack, form, server, attacker, clients)


def _attack_prepared(attack, form, server, attacker, clients):
    clients.wait_until_ready()
    quiet_begin = time.monotonic()
    time.sleep(QUIET_S if form == "full" else 0.3)
    reset_peak_memory(server.pid)
    begin = time.monotonic()
    attacker.go_on()
    told = attacker.read()
    end = time.monotonic()
    served_s = time_until_served(server)
    peak = peak_memory(server.pid)
    wrong = []
    if told is None:
        wrong.append(f"the attacker ended: {attacker.error()}")
    elif server.running():
        attacker.go_on()
        if found := json.loads(attacker.read() or json.dumps(attacker.error())):
            wrong.append(found)
    clients.stop()
    if not server.running():
        wrong.append(f"the server ended with code {server.wait()}")
    if attack.logged and not re.search(attack.logged, server.log()):
        wrong.append(f"the log does not have {attack.logged}")
    quiet, _ = clients.calls(quiet_begin, begin)
    during, lost = clients.calls(begin, end)
    return Round(dict(json.loads(told or "[]")), wrong, quiet, during, lost, peak, served_s)


def is_refused(attack, rounds):
    """Whether the attacker was told in some round what it must be told."""
    return not attack.refusal or any(re.search(attack.refusal, text)
                                     for seen in rounds for text in seen.told)


def run_rounds(attack, form, share, flags, number):
    """Runs rounds until a server can't be used any more."""
    rounds = []
    while len(rounds) < number and not (rounds and rounds[-1].served_s is None):
        rounds.append(attack_once(attack, form, share, flags))
    for stretch in STRETCHES if form == "short" else ():
        if is_refused(attack, rounds) or rounds[-1].wrong or rounds[-1].served_s is None:
            break
        print(f"{attack.name}: nobody was told {attack.refusal}; again for {stretch} times as long",
              flush=True)
        rounds.append(attack_once(attack, form, share, flags, stretch))
    return rounds


class Result:
    """The rounds of one attack together."""

    def __init__(self, attack, form, rounds):
        self.attack = attack
        self.told = {}
        for seen in rounds:
            for text, count in seen.told.items():
                self.told[text] = self.told.get(text, 0) + count
        self.quiet = [d for seen in rounds for d in seen.quiet]
        self.during = [d for seen in rounds for d in seen.during]
        self.lost = sum(seen.lost for seen in rounds)
        self.peak = max(seen.peak for seen in rounds)
        served = [seen.served_s for seen in rounds]
        self.served_s = None if None in served else max(served)
        p99s = percentile(self.quiet, 0.99), percentile(self.during, 0.99)
        self.ratio = p99s[1] / p99s[0] if all(p99s) else None
        self.wrong = list(dict.fromkeys(w for seen in rounds for w in seen.wrong))
        if not is_refused(attack, rounds):
            self.wrong.append(f"nobody was told {attack.refusal}")
        self._judge(form)

    def _judge(self, form):
        if self.peak > MEMORY_LIMIT:
            self.wrong.append(f"memory {self.peak >> 20} MiB")
        if self.served_s is None:
            self.wrong.append("no new client is served")
        if form == "short":
            return
        if self.served_s is not None and self.served_s > MAX_SERVED_S:
            self.wrong.append(f"a new client waits for {self.served_s:.1f} s")
        if self.ratio is not None and self.ratio > MAX_P99_RATIO:
            self.wrong.append(f"others' p99 is {self.ratio:.1f} times that of quiet")

    def row(self):
        def times(durations):
            if not durations:
                return "-"
            return "/".join(f"{1000 * percentile(durations, share):.0f}" for share in (0.5, 0.99))

        answers = ", ".join(f"{count} {text}" if not text[0].isdigit() else text
                            for text, count in list(self.told.items())[:4])
        return [f"{self.attack.name} {self.attack.title()}",
                f"not defended: {'; '.join(self.wrong)}" if self.wrong else "defended",
                answers, times(self.quiet), times(self.during),
                "-" if self.ratio is None else f"{self.ratio:.1f}", str(self.lost),
                str(self.peak >> 20),
                "never" if self.served_s is None else f"{1000 * self.served_s:.0f}"]


HEADER = ["attack", "outcome", "the attacker was told", "quiet p50/p99 ms", "attack p50/p99 ms",
          "ratio", "lost", "peak MiB", "served after ms"]


def print_table(rows):
    def line(cells):
        return f"| {' | '.join(cells)} |"

    print("\n".join([line(HEADER), line("---" for _ in HEADER), *map(line, rows)]))


def server_flags():
    """Returns the flags of the servers. Programs that do not have all of them yet are attacked
    without them."""
    known = subprocess.run([BIN / "hypermapd", "--helpfull"], capture_output=True, text=True,
                           timeout=DEADLINE_S, check=False).stdout
    for name in FLAGS:
        if f"--{name} " not in known:
            print(f"this hypermapd has no --{name}")
    return [f"--{name}={value}" for name, value in FLAGS.items() if f"--{name} " in known]


def part_of(text):
    """Returns the numbers I and N of "I/N"."""
    found = re.fullmatch(r"(\d+)/(\d+)", text)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise argparse.ArgumentTypeError(f"{text} is not I/N with 1 <= I <= N")
    return int(found[1]), int(found[2])


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="ATTACK",
                        help=f"attacks to run; default: all. {', '.join(attacks.BY_NAME)}")
    parser.add_argument("--short", action="store_true",
                        help="one short round, by default of the attacks that are defended")
    parser.add_argument("--own_session", action="store_true",
                        help="run in a session of its own, whose share of the processors does not "
                             "depend on how many other tests run (autogroups, sched(7))")
    parser.add_argument("--part", metavar="I/N", type=part_of, default="1/1",
                        help="only the I-th of N equal parts of these attacks")
    parser.add_argument("--rounds", type=int, help=f"rounds of each attack; default: {ROUNDS}")
    parser.add_argument("--attackers_share", choices=("idle", "equal"),
                        help="share of the attackers in the processors: the time that nobody else "
                             "needs, because in the field they are other machines, or as much as "
                             "the server; default: idle, in the short form equal")
    arguments = parser.parse_args()
    if arguments.own_session:
        os.setsid()
    form = "short" if arguments.short else "full"
    # The short form measures no time, and runs beside other tests, which may leave no idle time.
    share = arguments.attackers_share or ("equal" if arguments.short else "idle")
    rounds = arguments.rounds or (1 if arguments.short else ROUNDS)
    names = arguments.names or list(attacks.BY_NAME)
    if unknown := set(names) - set(attacks.BY_NAME):
        parser.error(f"there is no attack {', '.join(sorted(unknown))}")
    part, parts = arguments.part
    names = names[part - 1::parts]
    if not names:
        parser.error(f"part {part} of {parts} has no attacks")
    flags = server_flags()
    results = []
    for name in names:
        attack = attacks.BY_NAME[name]
        results.append(Result(attack, form, run_rounds(attack, form, share, flags, rounds)))
        print(f"{name}: {'; '.join(results[-1].wrong) or 'defended'}", flush=True)
    print_table([result.row() for result in results])
    failed = [result.attack.name for result in results if result.wrong]
    if failed:
        print(f"not defended: {', '.join(failed)} ({len(failed)} of {len(results)} attacks)")
        return 1
    print(f"all {len(results)} attacks are defended")
    return 0


if __name__ == "__main__":
    sys.exit(main())

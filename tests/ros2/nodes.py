"""hypermap-ros2 as a process, and nodes of Cyclone DDS that talk to it, on 127.0.0.1."""

import contextlib
import fcntl
import functools
import itertools
import pathlib
import random
import subprocess
import tempfile
import time

from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import dds_types as dds
from processes import BIN, DEADLINE_S



def take_domain():
    """Returns a domain that no other process of these tests has, and the locked file that says so. Those from 100 on are
    ros2_dds_test's."""
    for domain in range(1, 100):
        lock = open(pathlib.Path(tempfile.gettempdir()) / f"hypermap-ros2-domain-{domain}", "wb")
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return domain, lock
        lock.close()
    raise AssertionError("all domains are taken")


# The domain of this process, so that tests that run at the same time do not meet.
DOMAIN, _domain_lock = take_domain()

CONFIGURATION = """<CycloneDDS><Domain Id="any">
<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>119</MaxAutoParticipantIndex>
<Peers><Peer Address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""

LATCHED = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal,
              Policy.History.KeepLast(1))
RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile,
               Policy.History.KeepLast(100),
               Policy.DataRepresentation(use_cdrv0_representation=True))
BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile,
                  Policy.History.KeepLast(100),
                  Policy.DataRepresentation(use_cdrv0_representation=True))

# Every client gets the replies to all of them.
REPLIES = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile,
              Policy.History.KeepAll, Policy.DataRepresentation(use_cdrv0_representation=True))


def await_condition(condition, problem):
    deadline = time.monotonic() + DEADLINE_S
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(problem)
        time.sleep(0.002)


class Bridge:
    """A hypermap-ros2 process. The end of the `with` block kills it if it still runs."""

    def __init__(self, server_address, *flags, domain=DOMAIN):
        self._log = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [BIN / "hypermap-ros2", f"--server={server_address}", "--localhost",
             f"--domain={domain}", *flags],
            stdin=subprocess.DEVNULL, stdout=self._log, stderr=self._log)

    def log(self):
        self._log.seek(0)
        return self._log.read().decode()

    def end(self, timeout_s=DEADLINE_S):
        """Ends it by SIGTERM and returns its exit code."""
        self._process.terminate()
        return self._process.wait(timeout_s)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._log.close()


@functools.cache
def configured(domain):
    """The domain of this process, which is configured once."""
    return Domain(domain, CONFIGURATION)


class Node:
    """A node of Cyclone DDS. It lives as long as its topics and clients."""

    def __init__(self, domain=DOMAIN):
        configured(domain)
        self._participant = DomainParticipant(domain)

    def subscribe(self, name, message, qos=LATCHED, prefix="rt"):
        return Subscription(self._participant, prefix + name, message, qos)

    def publish(self, name, message, sample):
        """Publishes one sample, latched, as long as the result lives."""
        topic = Topic(self._participant, f"rt{name}", message)
        writer = DataWriter(self._participant, topic, qos=LATCHED)
        writer.write(sample)
        return writer

    def publisher(self, name, message, qos=RELIABLE):
        return Publisher(self._participant, f"rt{name}", message, qos)

    def client(self, name, service=None):
        return Client(self._participant, name, *dds.SERVICES[service or name.rsplit("/", 1)[1]])


class Publisher:
    """A topic that is written."""

    def __init__(self, participant, name, message, qos):
        self._writer = DataWriter(participant, Topic(participant, name, message), qos=qos)

    def write(self, sample):
        self._writer.write(sample)

    def await_subscribers(self, count):
        await_condition(lambda: len(self._writer.get_matched_subscriptions()) >= count,
                        "a subscriber is missing")


class Subscription:
    """A topic that is read."""

    def __init__(self, participant, name, message, qos):
        self._participant = participant
        self._reader = DataReader(participant, Topic(participant, name, message), qos=qos)
        self._waitset = WaitSet(participant)
        self._waitset.attach(ReadCondition(
            self._reader, SampleState.NotRead | ViewState.Any | InstanceState.Alive))

    def next(self, wanted=lambda sample: True, timeout_s=DEADLINE_S):
        """The next message for which `wanted` is true."""
        deadline = time.monotonic() + timeout_s
        while True:
            for sample in self._reader.take(1):
                # One without content says that its writer has gone.
                if not isinstance(sample, InvalidSample) and wanted(sample):
                    return sample
            left = deadline - time.monotonic()
            if left <= 0:
                raise AssertionError(f"no message within {timeout_s} s")
            self._waitset.wait(duration(seconds=min(left, 1)))

    def await_no_publisher(self):
        await_condition(lambda: not self._reader.get_matched_publications(), "a publisher is left")


class Client:
    """A client of a service, in the convention of rmw_cyclonedds_cpp."""

    def __init__(self, participant, name, request, response):
        self._request = request
        self._replies = Subscription(participant, f"rr{name}Reply", response, REPLIES)
        self._requests = DataWriter(participant, Topic(participant, f"rq{name}Request", request),
                                    qos=RELIABLE)
        self._client = random.getrandbits(63)
        self._numbers = itertools.count(1)

    def await_service(self):
        await_condition(self._requests.get_matched_subscriptions, "no such service")

    def call(self, *fields, timeout_s=DEADLINE_S):
        number = next(self._numbers)
        self._requests.write(self._request(self._client, number, *fields))
        return self._replies.next(
            lambda reply: (reply.client, reply.number) == (self._client, number), timeout_s)

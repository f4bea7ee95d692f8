"""Attacks by observations of robots. Each is a generator as in connections.py."""

import threading
import time

import grpc

import sites
from hypermap.v1 import ingest_service_pb2

from site_under_attack import PREY

# A layer of its own: the clients that are not attacked edit other layers of the map.
LAYER = "fused"


def _stamp(seconds):
    whole, fraction = divmod(seconds, 1)
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(whole)) + f".{int(fraction * 1e6):06d}Z"


def _observation(robot, sequence, stamp):
    """Three things of a square metre, in one of 400 places."""
    detections = []
    for i in range(3):
        x, y = 5 * (sequence % 20) + 1.5 * i, 5 * (sequence // 20 % 20)
        detections.append({
            "scores": [{"label": "chair", "score": 0.9}], "hull": sites.square(x, y),
            "cells": {"origin": {"x": x, "y": y}, "resolution_m": 0.25,
                      "spans": [s for row in range(4) for s in (row, 0, 4)]},
            "height": {"low_m": 0, "high_m": 1}, "num_points": 50, "range_m": 3, "weight": 1})
    return {"robot": robot, "sequence": sequence, "stamp": _stamp(stamp), "detections": detections,
            "pose": {"rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "translation": [0, 0, 1]}}


def _send(client, robot, batches, on_answer):
    """Sends lists of observations on a stream, at most 16 that are not answered."""
    answered = threading.Semaphore(16)

    def requests():
        yield {"opening": {"map": PREY, "layer": LAYER, "robot": robot}}
        for batch in batches:
            answered.acquire()
            yield {"observations": batch}

    for answer in client.Observe(requests(), timeout=120):
        if answer.acknowledgements:
            answered.release()
        for acknowledgement in answer.acknowledgements:
            on_answer(acknowledgement)


def old_observations(site):
    """Eight robots send observations that are ten minutes old, and so come before all that others
    have sent in that time: 20,000 observations, of the map that the other clients edit."""
    number = site.size(20_000, 2_000)
    begin = time.time() - 590
    with site.client() as client:
        client.CreateLayer(map=PREY, layer={"name": LAYER, "kind": "LAYER_KIND_SEMANTIC"})
        _send(client, "honest",
              ([_observation("honest", k, begin + 580 * k / number)
                for k in range(i, min(i + 50, number))] for i in range(0, number, 50)),
              lambda _: None)
    yield

    def attack(robot):
        def batches():
            k = 0
            while site.attacking():
                yield [_observation(robot, k, begin + 0.001 * k)]
                k += 1

        try:
            with site.client() as client:
                _send(client, robot, batches(), lambda a: site.tell(outcome(a)))
        except grpc.RpcError as error:
            site.tell_status(error.code(), error.details() or "")

    def outcome(acknowledgement):
        return ingest_service_pb2.ObservationOutcome.Name(acknowledgement.outcome)

    site.attacking()
    threads = [threading.Thread(target=attack, args=(f"late-{i}",), daemon=True) for i in range(8)]
    for thread in threads:
        thread.start()
    while site.attacking():
        time.sleep(0.05)
    # Their last observations may wait: the attackers go away without the answers.
    yield

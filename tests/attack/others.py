"""A client that is not attacked: it asks points of a map and edits it, one call after another,
until its standard input ends.

Usage: others.py ADDRESS MAP PAUSE_S. Pauses after each call, and prints a line for it: the times of its
beginning and end by the monotonic clock in seconds, and its status.
"""

import sys
import threading
import time

import grpc

import rpc
import sites

# The map, unless an attack says otherwise.
MAP = "other"
# Deadline of a call. One that fails counts as if it had taken this long.
TIMEOUT_S = 20


def _calls(client, name, object_id):
    yield lambda: client.QueryPoint(scope=rpc.scope(name), point=rpc.point(1, 1), timeout=TIMEOUT_S)
    yield lambda: client.ApplyEdits(map=name, timeout=TIMEOUT_S, edits=[
        sites.put("chair", time.monotonic() % 100, 0, id=object_id)])


def main():
    address, name, pause_s = sys.argv[1], sys.argv[2], float(sys.argv[3])
    stop = threading.Event()

    def wait_for_end():
        sys.stdin.read()
        stop.set()

    threading.Thread(target=wait_for_end, daemon=True).start()
    with rpc.Client(address) as client:
        (object_id,) = client.ApplyEdits(map=name, edits=[sites.put("chair", 0, 0)]).object_ids
        while not stop.is_set():
            for call in _calls(client, name, object_id):
                begin, status = time.monotonic(), "OK"
                try:
                    call()
                except grpc.RpcError as error:
                    status = error.code().name
                print(begin, time.monotonic(), status, flush=True)
                # A server that has ended refuses connections at once.
                stop.wait(pause_s if status == "OK" else 0.01)


if __name__ == "__main__":
    main()

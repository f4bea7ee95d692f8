"""A client that is not attacked: it asks points of the map "other" and edits it, one call after
another, until its standard input ends.

Usage: others.py ADDRESS. Prints a line for each call: the times of its beginning and end by the
monotonic clock in seconds, and its status.
"""

import sys
import threading
import time

import grpc

import rpc
import sites

MAP = "other"
# Deadline of a call. One that fails counts as if it had taken this long.
TIMEOUT_S = 20


def _calls(client, object_id):
    yield lambda: client.QueryPoint(scope=rpc.scope(MAP), point=rpc.point(1, 1), timeout=TIMEOUT_S)
    yield lambda: client.ApplyEdits(map=MAP, timeout=TIMEOUT_S, edits=[
        sites.put("chair", time.monotonic() % 100, 0, id=object_id)])


def main():
    stop = threading.Event()

    def wait_for_end():
        sys.stdin.read()
        stop.set()

    threading.Thread(target=wait_for_end, daemon=True).start()
    with rpc.Client(sys.argv[1]) as client:
        (object_id,) = client.ApplyEdits(map=MAP, edits=[sites.put("chair", 0, 0)]).object_ids
        while not stop.is_set():
            for call in _calls(client, object_id):
                begin, status = time.monotonic(), "OK"
                try:
                    call()
                except grpc.RpcError as error:
                    status = error.code().name
                print(begin, time.monotonic(), status, flush=True)
                if status != "OK":
                    stop.wait(0.01)  # A server that has ended refuses connections at once.


if __name__ == "__main__":
    main()

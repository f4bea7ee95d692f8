"""A client that goes on asking while others are up to something."""

import threading

import grpc

import rpc
import sites
from processes import DEADLINE_S


class Asking(threading.Thread):
    """Edits a map of sites.make() and asks a point of it, one call after another, until stop()."""

    def __init__(self, address, map_name):
        super().__init__()
        self._address, self._map = address, map_name
        self._ends = threading.Event()
        self._answered = threading.Semaphore(0)
        self.error = None

    def run(self):
        with rpc.Client(self._address) as client:
            while not self._ends.wait(0.01):
                try:
                    client.ApplyEdits(map=self._map, edits=[sites.put("lamp", 0, 0)])
                    client.QueryPoint(scope=rpc.scope(self._map, "things"),
                                      point=rpc.point(0.5, 0.5))
                except grpc.RpcError as error:
                    self.error = error
                    return
                self._answered.release()

    def await_answer(self):
        """Waits until both calls have been answered once more. Returns whether they were."""
        while self._answered.acquire(blocking=False):
            pass
        return self._answered.acquire(timeout=DEADLINE_S)

    def stop(self):
        self._ends.set()
        self.join()

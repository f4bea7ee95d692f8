"""C1: the wall clock of the server jumps while it runs, by libfaketime. Nothing that was promised
is let go, nothing is carried out twice, and objects expire when their time has really passed."""

import glob
import socket
import time
import unittest

import rpc
from hypermap.v1 import watch_service_pb2
from processes import DEADLINE_S, Server, SiteTest

LIBRARY = next(iter(glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1")), None)
# An object that should have expired is gone within this real time.
EXPIRED_WITHIN_S = 60
REMOVE = watch_service_pb2.CHANGE_KIND_REMOVE


def put(label, time_to_live):
    return {"put_object": {
        "layer": "things", "time_to_live": time_to_live,
        "object": {"label": label, "existence": 1, "shape": {"point": rpc.point(1, 2)}}}}


@unittest.skipUnless(LIBRARY, "libfaketime is not installed")
class Clock(SiteTest):

    def setUp(self):
        super().setUp()
        self.clock = self.folder / "clock"
        self.set_clock("+0")
        self.start()

    def set_clock(self, text):
        """Sets what libfaketime reads: an offset to the true time, or a time that stands still."""
        changed = self.clock.with_suffix(".new")
        changed.write_text(text + "\n")
        changed.rename(self.clock)

    def start(self, *flags):
        self.site = self.enterContext(Server(self.data_dir, *flags, environment={
            "LD_PRELOAD": LIBRARY, "FAKETIME_TIMESTAMP_FILE": str(self.clock),
            "FAKETIME_NO_CACHE": "1", "FAKETIME_DONT_FAKE_MONOTONIC": "1",
            "DONT_FAKE_MONOTONIC": "1", "NO_FAKE_STAT": "1"}))
        self.client = self.enterContext(rpc.Client(self.site.address))

    def apply(self, *edits, request_id=""):
        return self.client.ApplyEdits(map="site", edits=list(edits), request_id=request_id)

    def labels(self):
        answer = self.client.QueryPoint(scope=rpc.scope("site", "things"), point=rpc.point(1, 2))
        return {found.label for found in answer.layers[0].objects}

    def await_expiry_of(self, receipt):
        """Waits until the server has removed the object that the edit put."""
        (object_id,) = receipt.object_ids
        for answer in self.client.Watch(scope=rpc.scope("site"), start_revision=receipt.revision,
                                        timeout=EXPIRED_WITHIN_S):
            if any(change.kind == REMOVE and change.object_id == object_id
                   for change in answer.changes):
                self.assertEqual(answer.author, "expiry")
                return

    def await_health_of_the_clock(self, status):
        """Waits until the standard health service tells this status of hypermap.clock."""
        deadline = time.monotonic() + DEADLINE_S
        while rpc.health(self.site.address, "hypermap.clock") != status:
            self.assertLess(time.monotonic(), deadline)

    def promise(self):
        """Makes a map, and what must survive every jump."""
        self.client.CreateMap(map="site")
        self.client.CreateLayer(map="site", layer={"name": "things", "kind": "LAYER_KIND_SEMANTIC"})
        self.receipt = self.apply(put("kept for an hour", "3600s"), request_id="once")

    def check_promises(self):
        revisions = self.client.ListRevisions(map="site")
        self.assertEqual(revisions.oldest_revision, 0)
        times = [r.time.ToNanoseconds() for r in revisions.revisions]
        self.assertEqual(times, sorted(times))
        again = self.apply(put("kept for an hour", "3600s"), request_id="once")
        self.assertEqual(again.revision, self.receipt.revision)
        # Nothing else was made meanwhile, unless an object has expired.
        later = self.client.ListRevisions(map="site", after_revision=revisions.newest_revision)
        self.assertLessEqual({r.author for r in later.revisions}, {"expiry"})
        self.assertIn("kept for an hour", self.labels())

    def live_through(self, clock):
        self.promise()
        before = self.apply(put("put before", "2s"))
        self.set_clock(clock)
        during = self.apply(put("put during the jump", "2s"))
        self.await_health_of_the_clock(rpc.NOT_SERVING)
        self.check_promises()
        self.await_expiry_of(before)
        self.await_expiry_of(during)
        self.check_promises()
        self.set_clock("+0")
        self.await_health_of_the_clock(rpc.SERVING)
        self.await_expiry_of(self.apply(put("put after", "2s")))
        self.check_promises()
        self.assertEqual(self.site.stop(), 0)
        self.start()
        self.await_expiry_of(self.apply(put("put after a restart", "2s")))
        self.check_promises()
        newest = self.client.ListRevisions(map="site", newest_first=True, page_size=1).revisions[0]
        self.assertAlmostEqual(newest.time.ToNanoseconds() / 1e9, time.time(), delta=600)

    def test_c1_clock_goes_a_year_ahead_and_comes_back(self):
        self.live_through("+365d")

    def test_c1_clock_goes_a_year_back_and_comes_again(self):
        self.live_through("-365d")

    def test_c1_clock_stands_still(self):
        self.live_through(time.strftime("%Y-%m-%d %H:%M:%S"))

    def is_accepted(self):
        """Opens and closes a connection. Returns whether the server has sent its settings."""
        with socket.create_connection(("127.0.0.1", self.site.port), DEADLINE_S) as connection:
            try:
                return connection.recv(1) != b""
            except ConnectionResetError:
                return False

    def test_c1_closed_connections_are_forgotten_while_the_clock_stands_still(self):
        self.site.kill()
        self.set_clock(time.strftime("%Y-%m-%d %H:%M:%S"))
        self.start("--max_connections_per_address=20")
        for _ in range(60):
            deadline = time.monotonic() + DEADLINE_S
            while not self.is_accepted():
                self.assertLess(time.monotonic(), deadline, "closed connections still count")
                time.sleep(0.02)

    def test_c1_server_is_started_while_the_clock_is_a_year_ahead(self):
        self.promise()
        self.site.kill()
        self.set_clock("+365d")
        self.start()
        self.check_promises()
        self.await_expiry_of(self.apply(put("put in the wrong year", "2s")))
        self.site.kill()
        self.set_clock("+0")
        self.start()
        self.await_expiry_of(self.apply(put("put in the right year", "2s")))
        self.check_promises()


if __name__ == "__main__":
    unittest.main()

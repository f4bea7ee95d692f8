"""Concurrent readers and writers: each answer is of one revision, and a slow client delays no
other."""

import threading
import unittest

import grpc

import rpc
import sites
from processes import SiteTest

EVERYWHERE = sites.square(-5000, -5000, 10000)


class Concurrency(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)

    def checkerboard(self, side):
        """Fills the grid with a checkerboard. Its answer is the longest one, with one cell per
        run."""
        for row in range(0, side, 100):
            self.client.ApplyEdits(map="site", edits=[sites.write_cells(
                [[(r + c) % 2 for c in range(side)] for r in range(row, row + 100)], row=row)])

    def test_a_slow_reader_gets_one_revision_and_delays_no_other_client(self):
        self.checkerboard(1000)
        before = sites.revision(self.client)
        stream = self.client.QueryArea(scope=rpc.scope("site", "grid"), area=EVERYWHERE)
        first = next(stream)
        for i in range(20):  # The answer is not read yet.
            self.client.ApplyEdits(map="site", edits=[sites.write_cells([[0.5]], row=i, col=i)])
        self.assertEqual(sites.revision(self.client), before + 20)
        parts = [first, *stream]
        self.assertEqual({part.revision for part in parts}, {before})
        self.assertEqual({v for part in parts for v in part.part.cells.values}, {0, 1})
        self.assertEqual(sum(len(part.part.cells.values) for part in parts), 1000 * 1000)
        self.assertGreater(len(parts), 10)

    def test_readers_see_all_of_a_batch_or_nothing(self):
        ids = self.client.ApplyEdits(map="site", edits=[
            sites.put("0", 0, 0), sites.put("0", 10, 10)]).object_ids
        done, seen, torn = threading.Event(), [], []

        def read():
            with rpc.Client(self.site.address) as client:
                while not done.is_set():
                    labels = {o.label for answer in client.QueryArea(
                        scope=rpc.scope("site", "things"), area=EVERYWHERE)
                        for o in answer.part.objects}
                    (torn if len(labels) != 1 else seen).append(labels)

        readers = [threading.Thread(target=read) for _ in range(3)]
        for reader in readers:
            reader.start()
        try:
            for i in range(1, 100):
                self.client.ApplyEdits(map="site", edits=[
                    {"put_object": {"layer": "things", "object": {
                        "id": id_, "label": str(i), "shape": {"polygon": sites.square(j, j)}}}}
                    for j, id_ in enumerate(ids)])
        finally:
            done.set()
            for reader in readers:
                reader.join()
        self.assertEqual(torn, [])
        self.assertGreater(len(set().union(*seen)), 5, "the readers saw too few states")

    def test_concurrent_writers_get_different_revisions(self):
        before, revisions, failures = sites.revision(self.client), [], []

        def write(number):
            with rpc.Client(self.site.address) as client:
                for i in range(25):
                    try:
                        revisions.append(client.ApplyEdits(map="site", edits=[
                            sites.put(f"{number} {i}", number, i)]).revision)
                    except grpc.RpcError as error:
                        failures.append(error)

        writers = [threading.Thread(target=write, args=(n,)) for n in range(8)]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        self.assertEqual(failures, [])
        self.assertEqual(sorted(revisions), list(range(before + 1, before + 201)))
        self.assertEqual(len(sites.labels(self.client)), 200)

    def test_concurrent_retries_of_a_request_are_carried_out_once(self):
        answers = []

        def write():
            with rpc.Client(self.site.address) as client:
                answers.append(client.ApplyEdits(map="site", request_id="once",
                                                 edits=[sites.put("cup", 1, 1)]))

        writers = [threading.Thread(target=write) for _ in range(8)]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        self.assertEqual([a == answers[0] for a in answers], [True] * 8)
        self.assertEqual(list(sites.labels(self.client).values()), ["cup"])

    def test_expired_and_cancelled_calls_free_their_threads(self):
        self.checkerboard(1000)
        with self.assertRaises(grpc.RpcError) as caught:
            list(self.client.QueryValue(scope=rpc.scope("site"), value="occupied", timeout=0.005))
        self.assertEqual(caught.exception.code(), grpc.StatusCode.DEADLINE_EXCEEDED)
        abandoned = []
        for _ in range(50):  # Many more calls than the server has threads.
            stream = self.client.QueryArea(scope=rpc.scope("site"), area=EVERYWHERE)
            next(stream)
            abandoned.append(stream)
        self.client.QueryPoint(scope=rpc.scope("site"), point=rpc.point(1, 1))
        self.client.ApplyEdits(map="site", edits=[sites.put("cup", 1, 1)])
        for stream in abandoned:
            stream.cancel()
        self.assertEqual(self.site.stop(), 0)


if __name__ == "__main__":
    unittest.main()

"""Queries of past revisions, compared with a list of recorded states. The server is restarted and
killed, and compacts its history."""

import random
import threading
import time
import unittest

import grpc

import rpc
import sites
from processes import SEED, SiteTest

SITE = rpc.scope("site")
CELL_M = 0.5


class State:
    """The content of a map at a revision."""

    def __init__(self, objects, cells):
        self.objects = objects  # id -> (label, x, y): a square of 1 m with its lower left corner
        self.cells = cells  # (row, col) -> value, without unknown cells

    def objects_in(self, x, y, side):
        # Compares the coordinates of the vertices, rounded as sites.square rounds them.
        return {i: o for i, o in self.objects.items()
                if x <= o[1] + 1 and o[1] <= x + side and y <= o[2] + 1 and o[2] <= y + side}

    def cells_in(self, x, y, side):
        return {c: v for c, v in self.cells.items()
                if x <= (c[1] + 0.5) * CELL_M <= x + side and y <= (c[0] + 0.5) * CELL_M <= y + side}


def decode_object(thing):
    outer = thing.shape.polygon.outer
    return thing.label, outer.xs[0], outer.ys[0]


def decode_cells(runs):
    return {(row, col): value
            for row, begin, end, value in zip(runs.rows, runs.col_begins, runs.col_ends,
                                              runs.values)
            for col in range(begin, end)}


def known(cells):
    return {c: v for c, v in cells.items() if v == v}


class Writer:
    """Makes random changes, and records the state after each of them."""

    def __init__(self, draw):
        self.draw = draw
        self.states = {}
        self.authors = {}

    def begin(self, client):
        sites.make(client)
        self.states[sites.revision(client)] = State({}, {})

    @property
    def newest(self):
        return max(self.states)

    def place(self):
        return round(self.draw.uniform(-10, 10), 3), round(self.draw.uniform(-10, 10), 3)

    def change(self, client):
        now = self.states[self.newest]
        objects, cells, edits, new = dict(now.objects), dict(now.cells), [], []
        for _ in range(self.draw.randint(1, 4)):
            dice = self.draw.random()
            if dice < 0.25:
                row, col = self.draw.randint(-300, 300), self.draw.randint(-300, 300)
                values = [[self.draw.choice([0.0, 0.25, 1.0, "NaN"]) for _ in range(3)]
                          for _ in range(2)]
                edits.append(sites.write_cells(values, row=row, col=col))
                for r, line in enumerate(values):
                    for c, value in enumerate(line):
                        cells[row + r, col + c] = float(value)
                continue
            label, (x, y) = self.draw.choice(["cup", "chair", "pallet"]), self.place()
            if dice < 0.5 or not objects:
                edits.append(sites.put(label, x, y))
                new.append((len(edits) - 1, (label, x, y)))
            elif dice < 0.85:
                moved = self.draw.choice(sorted(objects))
                edits.append(sites.put(label, x, y))
                edits[-1]["put_object"]["object"]["id"] = moved
                objects[moved] = (label, x, y)
            else:
                gone = self.draw.choice(sorted(objects))
                edits.append({"delete_object": {"layer": "things", "id": gone}})
                del objects[gone]
        answer = client.ApplyEdits(map="site", request_id=f"{self.draw.random()}", edits=edits)
        for index, thing in new:
            objects[answer.object_ids[index]] = thing
        self.states[answer.revision] = State(objects, known(cells))


class History(SiteTest):

    def setUp(self):
        super().setUp()
        self.draw = random.Random(SEED)
        self.writer = Writer(self.draw)

    def run(self, result=None):
        with self.subTest(HYPERMAP_TEST_SEED=SEED):
            return super().run(result)

    def connect(self, server):
        return self.enterContext(rpc.Client(server.address))

    def check_area(self, client, revision):
        """Queries a random area at a past revision. The answer must equal the recorded state."""
        state = self.writer.states[revision]
        x, y = self.writer.place()
        side = self.draw.choice([0.7, 3.0, 11.0, 200.0])
        objects, cells = {}, {}
        for answer in client.QueryArea(scope=rpc.scope("site", "things", "grid"),
                                       area=sites.square(x, y, side), as_of=rpc.at(revision)):
            self.assertEqual(answer.revision, revision)
            objects.update({o.id: decode_object(o) for o in answer.part.objects})
            cells.update(decode_cells(answer.part.cells))
        self.assertEqual(objects, state.objects_in(x, y, side), (revision, x, y, side))
        self.assertEqual(known(cells), state.cells_in(x, y, side), (revision, x, y, side))

    def check_value(self, client, revision):
        state = self.writer.states[revision]
        cups = {o.id for answer in client.QueryValue(scope=SITE, value="cup",
                                                     as_of=rpc.at(revision))
                for o in answer.part.objects}
        self.assertEqual(cups, {i for i, o in state.objects.items() if o[0] == "cup"})

    def check_point(self, client, revision):
        state = self.writer.states[revision]
        x, y = self.writer.place()
        answer = client.QueryPoint(scope=rpc.scope("site", "things", "grid"),
                                   point=rpc.point(x, y), as_of=rpc.at(revision))
        things, cell = answer.layers
        self.assertEqual({o.id for o in things.objects}, set(state.objects_in(x, y, 0)))
        index = int(y // CELL_M), int(x // CELL_M)
        self.assertEqual(cell.value if cell.HasField("value") else None, state.cells.get(index))

    def check_difference(self, client, a, b):
        before, after = self.writer.states[a], self.writer.states[b]
        objects, cells = dict(before.objects), dict(before.cells)
        for answer in client.ListChanges(scope=SITE, from_revision=a, to_revision=b):
            for change in answer.changes:
                if change.kind in (1, 2):  # PUT, REMOVE
                    was = (decode_object(change.object_before) if change.HasField("object_before")
                           else None)
                    self.assertEqual(was, objects.pop(change.object_id, None))
                if change.kind == 1:
                    objects[change.object_id] = decode_object(change.object)
                if change.kind == 5:  # CELLS
                    for cell, value in decode_cells(change.cells_before).items():
                        self.assertEqual(value if value == value else None, cells.get(cell))
                    cells.update(decode_cells(change.cells))
        self.assertEqual(objects, after.objects, (a, b))
        self.assertEqual(known(cells), after.cells, (a, b))

    def check(self, client, oldest):
        revisions = [r for r in self.writer.states if r >= oldest]
        for _ in range(6):
            revision = self.draw.choice(revisions)
            self.check_area(client, revision)
            self.check_value(client, revision)
            self.check_point(client, revision)
        self.check_difference(client, *sorted(self.draw.sample(revisions, 2)))

    def test_past_revisions_have_the_same_answers_after_restarts_and_kills(self):
        server = self.server()
        client = self.connect(server)
        self.writer.begin(client)
        first = self.writer.newest
        for round_ in range(12):
            for _ in range(15):
                self.writer.change(client)
            self.check(client, first)
            if round_ % 3 == 2:
                (server.kill if self.draw.random() < 0.5 else server.stop)()
                server = self.server()
                client = self.connect(server)
        self.check(client, first)
        for revision in self.writer.states:
            self.check_area(client, revision)

    def oldest_at_rest(self, client):
        """Returns the oldest kept revision when compaction has not moved it for two seconds."""
        oldest, since = None, time.monotonic()
        while time.monotonic() < since + 2:
            newer = client.ListRevisions(map="site").oldest_revision
            if newer != oldest:
                oldest, since = newer, time.monotonic()
            time.sleep(0.05)
        return oldest

    def test_queries_of_compacted_revisions_fail_and_later_ones_work(self):
        server = self.server("--history_revisions=40")
        client = self.connect(server)
        self.writer.begin(client)
        for _ in range(200):
            self.writer.change(client)
        deadline = time.monotonic() + 60
        while client.ListRevisions(map="site").oldest_revision < self.writer.newest - 60:
            self.assertLess(time.monotonic(), deadline, "no revision was compacted")
            self.writer.change(client)
        oldest = self.oldest_at_rest(client)
        with self.assertRaises(grpc.RpcError) as refused:
            client.QueryPoint(scope=SITE, point=rpc.point(0, 0), as_of=rpc.at(oldest - 1))
        self.assertEqual(refused.exception.code(), grpc.StatusCode.OUT_OF_RANGE)
        self.assertIn(str(oldest), refused.exception.details())
        self.check(client, oldest)
        server.kill()
        client = self.connect(self.server("--history_revisions=40"))
        oldest = self.oldest_at_rest(client)
        with self.assertRaises(grpc.RpcError) as refused:
            next(iter(client.Watch(scope=SITE, start_revision=oldest - 1)))
        self.assertEqual(refused.exception.code(), grpc.StatusCode.OUT_OF_RANGE)
        self.check(client, oldest)

    def test_a_future_revision_is_awaited_or_refused(self):
        client = self.connect(self.server())
        self.writer.begin(client)
        newest = self.writer.newest
        with self.assertRaises(grpc.RpcError) as refused:
            client.QueryPoint(scope=SITE, point=rpc.point(0, 0), as_of=rpc.at(newest + 1))
        self.assertEqual(refused.exception.code(), grpc.StatusCode.OUT_OF_RANGE)
        with self.assertRaises(grpc.RpcError) as late:
            client.QueryPoint(scope=SITE, point=rpc.point(0, 0),
                              as_of={"min_revision": newest + 1}, timeout=0.5)
        self.assertEqual(late.exception.code(), grpc.StatusCode.DEADLINE_EXCEEDED)
        answers = []
        waiter = threading.Thread(target=lambda: answers.append(
            client.QueryPoint(scope=SITE, point=rpc.point(0, 0),
                              as_of={"min_revision": newest + 2})))
        waiter.start()
        self.writer.change(client)
        self.assertEqual(answers, [])
        self.writer.change(client)
        waiter.join()
        self.assertGreaterEqual(answers[0].revision, newest + 2)

    def test_a_query_as_of_a_time_reads_the_revision_of_that_time(self):
        client = self.connect(self.server())
        self.writer.begin(client)
        for _ in range(5):
            self.writer.change(client)
        revisions = client.ListRevisions(map="site").revisions
        for made in revisions:
            answer = client.QueryPoint(scope=SITE, point=rpc.point(0, 0),
                                       as_of={"at_time": made.time.ToJsonString()})
            # The revisions of one group commit have the same time, so the newest of them answers.
            self.assertEqual(answer.revision, max(r.revision for r in revisions
                                                  if r.time.ToNanoseconds() <= made.time.ToNanoseconds()))

    def test_a_stale_version_changes_nothing(self):
        client = self.connect(self.server())
        sites.make(client)
        put = client.ApplyEdits(map="site", edits=[sites.put("cup", 0, 0)])
        edit = sites.put("mug", 0, 0)
        edit["put_object"]["object"]["id"] = put.object_ids[0]
        edit["put_object"]["if_version"] = put.revision
        changed = client.ApplyEdits(map="site", edits=[edit])
        with self.assertRaises(grpc.RpcError) as stale:
            client.ApplyEdits(map="site", edits=[sites.put("bowl", 3, 3), edit])
        self.assertEqual(stale.exception.code(), grpc.StatusCode.ABORTED)
        with self.assertRaises(grpc.RpcError) as stale:
            client.ApplyEdits(map="site", edits=[sites.put("bowl", 3, 3)],
                              if_layers=[{"layer": "things", "version": put.revision}])
        self.assertEqual(stale.exception.code(), grpc.StatusCode.ABORTED)
        self.assertEqual(set(sites.labels(client).values()), {"mug"})
        self.assertEqual(sites.revision(client), changed.revision)

    def test_objects_expire_after_their_time_to_live_unless_renewed(self):
        server = self.server()
        client = self.connect(server)
        sites.make(client)
        start = sites.revision(client)
        short, renewed = sites.put("pallet", 0, 0), sites.put("robot", 5, 5)
        short["put_object"]["time_to_live"] = renewed["put_object"]["time_to_live"] = "5s"
        ids = client.ApplyEdits(map="site", edits=[short, renewed]).object_ids
        renewed["put_object"]["object"]["id"] = ids[1]
        renewed["put_object"]["time_to_live"] = "3600s"
        client.ApplyEdits(map="site", edits=[renewed])
        told = []
        for answer in client.Watch(scope=SITE, start_revision=start):
            told.extend((c.kind, c.object_id, answer.author == "expiry") for c in answer.changes)
            if told and told[-1][0] == 2:
                break
        self.assertEqual(told, [(1, ids[0], False), (1, ids[1], False), (1, ids[1], False),
                                (2, ids[0], True)])
        self.assertEqual(sites.labels(client), {ids[1]: "robot"})


if __name__ == "__main__":
    unittest.main()

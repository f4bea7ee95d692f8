"""Random batches of edits, compared with a model in memory that computes answers with Shapely: at
the newest and at earlier revisions, between revisions, and after the server was killed."""

import contextlib
import os
import unittest

import grpc
import shapely.geometry
from hypermap.v1 import watch_service_pb2

import rpc
import sites
from map_model import (ALIASES, GRIDS, SIDE, WORDS, Batch, State, known_cells, selected_cells)
from processes import SEED, SiteTest
from test_history import decode_cells
from test_shapes import LABELS, Draw, covering, decoded, intersecting, selected

ROUNDS = int(os.environ.get("HYPERMAP_TEST_ROUNDS", "8"))
BATCHES = 25
QUESTIONS = 25
# About the time that a commit takes.
COMMIT_S = 0.005
# Server and Shapely may differ in the last digits of a distance.
EXACT_M = 1e-9

PUT, REMOVE, CELLS, CREATED, DELETED, CHANGED = (
    watch_service_pb2.ChangeKind.Value(f"CHANGE_KIND_{kind}") for kind in
    ("PUT", "REMOVE", "CELLS", "LAYER_CREATED", "LAYER_DELETED", "LAYER_CHANGED"))


class RandomEdits(SiteTest):

    def setUp(self):
        super().setUp()
        self.draw = Draw(SEED)
        self.random = self.draw.random
        self.states = {}
        self.with_content = 0
        self.start()
        sites.make(self.client)
        self.client.DeleteLayer(map="site", layer="adrift")
        self.client.CreateLayer(map="site", layer={
            "name": "signal", "kind": "LAYER_KIND_SCALAR",
            "grid": {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": GRIDS["signal"]}})
        self.states[sites.revision(self.client)] = State()

    def start(self):
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))

    @property
    def newest(self):
        return max(self.states)

    def compare(self, got, expected, *asked):
        self.with_content += bool(expected)
        self.assertEqual(got, expected, (f"HYPERMAP_TEST_SEED={SEED}", *asked))

    def commit(self, kill=False):
        """Sends a random batch. With `kill`, the server is killed meanwhile, and the batch is sent
        again to the next one."""
        batch = Batch(self.draw, self.states[self.newest])
        request = {"map": "site", "edits": batch.edits,
                   "request_id": f"after {self.newest}"}
        if not batch.edits:
            return
        if kill:
            # The moment is random: the batch may be lost, on its way, or carried out.
            call = self.client.ApplyEdits.begin(**request)
            with contextlib.suppress(grpc.FutureTimeoutError):
                call.exception(self.random.uniform(0, 2 * COMMIT_S))
            self.site.kill()
            self.start()
        answer = self.client.ApplyEdits(**request)
        self.assertEqual(answer.revision, self.newest + 1)
        self.states[answer.revision] = batch.acknowledged(answer.object_ids)

    def check_a_refused_batch_changes_nothing(self):
        batch = Batch(self.draw, self.states[self.newest])
        unknown = {"delete_object": {"layer": "things", "id": 1 << 40}}
        with self.assertRaises(grpc.RpcError) as refused:
            self.client.ApplyEdits(map="site", edits=[*batch.edits, unknown])
        self.assertEqual(refused.exception.code(), grpc.StatusCode.NOT_FOUND)
        self.assertEqual(sites.revision(self.client), self.newest)

    def scope_of(self, state):
        """Returns the scope of random layers of a state, and their names."""
        layers = sorted(state.layers())
        chosen = self.random.sample(layers, self.random.randint(1, len(layers)))
        return rpc.scope("site", *chosen), chosen

    # Each of these makes a random query at a revision, where None means the newest.

    def a_place(self, state):
        things = state.things["things"]
        return shapely.geometry.Point(self.draw.question(things) if things else self.draw.place())

    def check_point(self, state, as_of):
        p, (scope, layers) = self.a_place(state), self.scope_of(state)
        answer = self.client.QueryPoint(scope=scope, as_of=as_of, point=rpc.point(p.x, p.y))
        self.assertEqual([layer.layer for layer in answer.layers], layers)
        for layer in answer.layers:
            asked = ("QueryPoint", layer.layer, as_of, p.wkt)
            if layer.layer in GRIDS:
                index = tuple(int(c // GRIDS[layer.layer]) + SIDE // 2 for c in (p.y, p.x))
                value = state.cells[layer.layer][index]
                self.compare(layer.value if layer.HasField("value") else None,
                             float(value) if value == value else None, *asked)
            else:
                self.compare({o.id for o in layer.objects},
                             covering(state.things[layer.layer], p), *asked)

    def read_parts(self, stream, layers):
        """Returns {layer: ids and labels, or known cells}."""
        found = {layer: {} for layer in layers}
        for answer in stream:
            part, known = answer.part, found[answer.part.layer]
            new = {o.id: o.label for o in part.objects}
            new |= {c: v for c, v in decode_cells(part.cells).items() if v == v}
            self.assertEqual(known.keys() & new.keys(), set(), "listed twice")
            known |= new
        return found

    def check_area(self, state, as_of):
        area, (scope, layers) = self.draw.polygon(), self.scope_of(state)
        found = self.read_parts(
            self.client.QueryArea(scope=scope, as_of=as_of, area=rpc.polygon(area)), layers)
        for layer in layers:
            things = state.things.get(layer, {})
            expected = (state.cells_in(layer, area) if layer in GRIDS else
                        {i: things[i].label for i in intersecting(things, area)})
            self.compare(found[layer], expected, "QueryArea", layer, as_of, area.wkt)

    def check_value(self, state, as_of):
        layer = self.random.choice(sorted(state.layers()))
        word = self.random.choice([*WORDS[layer]] if layer in GRIDS else [*LABELS, *ALIASES])
        area = self.random.choice([None, self.draw.polygon()])
        found = self.read_parts(self.client.QueryValue(
            scope=rpc.scope("site", layer), as_of=as_of, value=word,
            **({"area": rpc.polygon(area)} if area else {})), [layer])[layer]
        if layer in GRIDS:
            chosen = WORDS[layer][word](state.cells[layer])
            if area:
                chosen &= selected_cells(layer, area)
            expected = known_cells(state.cells[layer], chosen)
        else:
            expected = {i: state.things[layer][i].label
                        for i in state.with_value(layer, word, area)}
        self.compare(found, expected, "QueryValue", layer, word, as_of, area)

    def check_nearest(self, state, as_of):
        p, k = self.a_place(state), self.random.randint(1, 12)
        word = self.random.choice([*LABELS, *ALIASES, "occupied", "free"])
        expected = state.distances(word, p)
        # "free" and "occupied" are words of the occupancy layer only.
        answer = self.client.QueryNearest(scope=rpc.scope("site"), as_of=as_of, value=word, k=k,
                                          point=rpc.point(p.x, p.y))
        asked = ("QueryNearest", word, as_of, k, p.wkt)
        got = []
        for match in answer.matches:
            place = ((match.cells.rows[0], match.cells.col_begins[0]) if match.layer in GRIDS else
                     match.object.id)
            self.assertIn((match.layer, place), expected, asked)
            self.assertAlmostEqual(match.distance_m, expected[match.layer, place], delta=EXACT_M,
                                   msg=asked)
            got.append((match.layer, place))
        self.assertEqual(len(got), len(set(got)), asked)
        distances = sorted(expected.values())[:k]
        self.with_content += bool(distances)
        self.assertEqual(len(got), len(distances), asked)
        for match, distance in zip(answer.matches, distances):
            self.assertAlmostEqual(match.distance_m, distance, delta=EXACT_M, msg=asked)

    def check_questions(self, count=QUESTIONS):
        for _ in range(count):
            revision = self.random.choice([self.newest, *self.states])
            as_of = ({} if revision == self.newest and self.random.random() < 0.7 else
                     rpc.at(revision))
            for check in (self.check_point, self.check_area, self.check_value, self.check_nearest):
                check(self.states[revision], as_of)

    def check_changes(self, a, b):
        """Applies the difference of two revisions to the first, which must make the second."""
        before, after = self.states[a], self.states[b]
        things = {layer: selected(of) for layer, of in before.things.items()}
        cells = {layer: known_cells(values, values == values)
                 for layer, values in before.cells.items()}
        seen = set()
        for answer in self.client.ListChanges(scope=rpc.scope("site"), from_revision=a,
                                              to_revision=b):
            for change in answer.changes:
                asked = (f"HYPERMAP_TEST_SEED={SEED}", a, b, change.layer)
                if change.kind in (PUT, REMOVE):
                    self.assertNotIn((change.layer, change.object_id), seen, asked)
                    seen.add((change.layer, change.object_id))
                    was = (decoded(change.object_before) if change.HasField("object_before")
                           else None)
                    self.assertEqual(was, things[change.layer].pop(change.object_id, None), asked)
                    if change.kind == PUT:
                        things[change.layer][change.object_id] = decoded(change.object)
                elif change.kind == CELLS:
                    was = decode_cells(change.cells_before)
                    now = decode_cells(change.cells)
                    self.assertEqual(was.keys(), now.keys(), asked)
                    for cell, value in was.items():
                        self.assertEqual(value if value == value else None,
                                         cells[change.layer].pop(cell, None), (*asked, cell))
                    cells[change.layer] |= {c: v for c, v in now.items() if v == v}
                elif change.kind == CREATED:
                    things[change.layer] = {}
                elif change.kind == DELETED:
                    del things[change.layer]
                else:
                    self.assertEqual(change.kind, CHANGED, asked)
        self.compare(things, {layer: selected(of) for layer, of in after.things.items()}, a, b)
        self.compare(cells, {layer: known_cells(values, values == values)
                             for layer, values in after.cells.items()}, a, b)

    def test_every_answer_is_that_of_the_model(self):
        for _ in range(ROUNDS):
            for _ in range(BATCHES):
                self.commit()
            self.check_questions()
            self.check_a_refused_batch_changes_nothing()
            self.commit(kill=True)
            self.check_questions()
            for _ in range(3):
                self.check_changes(*sorted(self.random.sample(sorted(self.states), 2)))
        self.check_changes(min(self.states), self.newest)
        # Answers without content prove little.
        self.assertGreater(self.with_content, ROUNDS * QUESTIONS)


if __name__ == "__main__":
    unittest.main()

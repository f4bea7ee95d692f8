"""A map that version 0.1 wrote can be opened. It has the same answers as in 0.1, also after edits.

testdata/v0_1/make.py wrote the map and recorded the answers of 0.1. This version must give the same
answers, with floats that are exactly equal. It may add members to JSON objects.
"""

import datetime
import itertools
import json
import lzma
import pathlib
import sqlite3
import subprocess
import sys
import unittest

import rpc
from processes import BIN, DEADLINE_S, QUESTIONS, SiteTest

TESTDATA = pathlib.Path(__file__).resolve().parent / "testdata" / "v0_1"
sys.path.insert(0, str(TESTDATA))

from questions import EVERYWHERE, MAP, Asker, query  # noqa: E402

# Makes the server keep all history and receipts, whatever the date of the test is.
KEEP_ALL = ["--history_age=876000h", "--history_revisions=1000000000", "--receipt_age=876000h",
            "--observation_age=inf"]
WORKER, RENDERER = BIN / "hypermap-ingest", BIN / "render_sequence"
# Members whose values grow with each commit.
COUNTERS = {"revision", "newest_revision", "version"}
# If HYPERMAP_TEST_QUESTIONS is small, each round asks every n-th query, and the next round asks
# others.
STEP = max(1, 50 // QUESTIONS)


def read(name):
    return lzma.decompress((TESTDATA / name).read_bytes())


def difference(expected, got, place="", ignored=frozenset()):
    """Returns the first place where a part of `expected` is missing in `got` or has another value.
    Empty if there is none."""
    if type(expected) is not type(got):
        return f"{place}: {got!r}, expected {expected!r}"
    if isinstance(expected, dict):
        for key in expected.keys() - ignored:
            if key not in got:
                return f"{place}.{key} is missing"
            if found := difference(expected[key], got[key], f"{place}.{key}", ignored):
                return found
    elif isinstance(expected, list):
        for i, (a, b) in enumerate(zip(expected, got)):
            if found := difference(a, b, f"{place}[{i}]", ignored):
                return found
        if len(expected) != len(got):
            return f"{place}: {len(got)} entries, expected {len(expected)}"
    elif expected != got:
        return f"{place}: {got!r}, expected {expected!r}"
    return ""


def comparable(question, outcome):
    """Returns the lines of an answer that do not depend on timing, or the code of an error."""
    lines = outcome.get("answer", outcome.get("error"))
    if question["ask"][0] != "watch" or "error" in outcome:
        return lines
    # After a reset, which moved frames cause, a watch reports the newest revision. A watch that
    # ends at a revision without a selected change can still receive it.
    if not question["newest"]:
        lines = list(itertools.takewhile(lambda line: "reset" not in line, lines))
    # Lines with only a revision report progress. The number of them depends on timing.
    return [line for line in lines if line.keys() != {"revision"}]


def asks_for_the_future(question):
    """Whether a question is about a time in the future by this machine's clock, which servers
    reject."""
    words = question["ask"]
    at = words[words.index("--at") + 1] if "--at" in words else ""
    return "T" in at and (datetime.datetime.fromisoformat(at[:19] + "+00:00") >=
                          datetime.datetime.now(datetime.timezone.utc))


def feature(entity, **members):
    """Returns a GeoJSON feature that puts an object as the command line has printed it."""
    properties = {key: entity[key] for key in ("label", "classes", "existence", "tags")}
    if entity["height"]:
        properties["height_min"], properties["height_max"] = entity["height"]
    return {"type": "Feature", "properties": {**properties, **entity["attributes"]},
            "geometry": {"type": "Polygon", "coordinates": entity["polygon"]}, **members}


def shifted(entity, x):
    return {**entity, "polygon": [[[px + x, py] for px, py in ring] for ring in entity["polygon"]]}


class GoldenMap(SiteTest):

    def setUp(self):
        super().setUp()
        self.file = self.data_dir / f"{MAP}.gpkg"
        self.file.write_bytes(read(f"{MAP}.gpkg.xz"))
        self.recorded = json.loads(read("answers.json.xz"))
        self.recorded["questions"] = [q for q in self.recorded["questions"]
                                      if not asks_for_the_future(q)]
        self.newest = self.recorded["newest"]
        self.rounds = 0

    def open(self):
        self.site = self.server(*KEEP_ALL)
        self.asker = Asker(BIN / "hypermap", self.site.address, DEADLINE_S)

    def assert_as_before(self, questions, ignored=frozenset()):
        """Asks the questions. Fails if an answer differs from the recorded one."""
        questions = questions[self.rounds % STEP::STEP]
        self.rounds += 1
        self.assertTrue(questions)
        wrong = []
        for expected, got in zip(questions, self.asker.ask_each(questions), strict=True):
            if found := difference(comparable(expected, expected), comparable(expected, got),
                                   ignored=ignored):
                wrong.append(f"hypermap {' '.join(expected['ask'])}\n    {found[:500]}")
        if wrong:
            self.fail(f"{len(wrong)} of {len(questions)} answers differ:\n" + "\n".join(wrong[:20]))

    def about_the_newest(self):
        return [q for q in self.recorded["questions"] if q["newest"]]

    def about_the_past(self):
        """Returns the questions whose answers do not depend on later commits. Questions about the
        newest revision of 0.1 name its number."""
        return [q for q in self.recorded["questions"] if not q["newest"]] + [
            {**q, "ask": [*q["ask"][:3], "--at", str(self.newest), *q["ask"][3:]]}
            for q in self.about_the_newest() if q["ask"][0] == "query"]

    def assert_newest_as_before(self):
        """Checks that the newest revision has the content of the last one of 0.1, and that the log
        ends with the log of 0.1."""
        self.assert_as_before([q for q in self.about_the_newest() if q["ask"][0] != "log"],
                              ignored=COUNTERS)
        (log,) = self.asker.answer("log", MAP, "--limit", 100000)
        (expected,) = next(q for q in self.recorded["questions"] if q["ask"][0] == "log")["answer"]
        later = len(log["revisions"]) - len(expected["revisions"])
        self.assertEqual(difference(expected["revisions"], log["revisions"][later:]), "")

    def edit(self, layer, *features):
        """Edits a layer and returns the revision. Coordinates are in the layer's frame."""
        path = self.folder / "edit.geojson"
        (layers,) = self.asker.answer("layers", MAP)
        (frame,) = (known["frame_id"] for known in layers["layers"] if known["name"] == layer)
        path.write_text(json.dumps({"type": "FeatureCollection", "frame": frame,
                                    "features": features}))
        return self.asker.answer("edit", MAP, path, "--layer", layer)[0]["revision"]

    def entities(self, layer, frame=None, at=None):
        return {line["entity"]["id"]: line["entity"] for line in self.asker.answer(
            *query("area", *EVERYWHERE, layers=[layer], frame=frame, at=at)) if "entity" in line}

    def test_the_file_has_the_schema_of_version_0_1(self):
        self.assertEqual(self.recorded["commit"], "743c4b9")
        with sqlite3.connect(self.file) as file:
            versions = file.execute("SELECT schema_version FROM hypermap_metadata").fetchall()
        self.assertEqual(versions, [(3,)])

    def put_remove_and_move(self, layer, frame):
        """Puts an object and removes it; moves an old object and moves it back. Returns the states
        in between: {(revision, id): the object, or None after its removal}."""
        objects = self.entities(layer, frame)
        # Prefers an object with attributes and a hole.
        old = max((e for e in objects.values() if "expires_at" not in e),
                  key=lambda e: (bool(e["attributes"]), len(e["polygon"])))
        put = self.edit(layer, feature(shifted(old, 0.5)))
        (new,) = self.entities(layer, frame).keys() - objects.keys()
        self.assertGreater(new, max(i for receipt in self.recorded["receipts"]
                                    for i in receipt["object_ids"]), "an id was assigned twice")
        removed = self.edit(layer, {"type": "Feature", "id": new, "geometry": None})
        moved = self.edit(layer, feature(shifted(old, 1.25), id=old["id"]))
        back = self.edit(layer, feature(old, id=old["id"]))
        return {(put, new): shifted(old, 0.5), (put, old["id"]): old, (removed, new): None,
                (moved, old["id"]): shifted(old, 1.25), (back, old["id"]): old}

    def write_cells_and_restore_them(self):
        """Writes a square of the layer "scratch", whose cells are 7.5 there."""
        ring = [[1, 1], [2, 1], [2, 2], [1, 2], [1, 1]]
        for value in (-3, 7.5):
            self.edit("scratch", {"type": "Feature", "properties": {"value": value},
                                  "geometry": {"type": "Polygon", "coordinates": [ring]}})

    def test_answers_are_unchanged_after_edits_and_restarts(self):
        self.open()
        self.assert_as_before(self.recorded["questions"])
        self.assertEqual(self.site.stop(), 0)

        self.open()
        edited = {"things": "map", "dock_things": "dock"}
        states = {layer: self.put_remove_and_move(layer, frame) for layer, frame in edited.items()}
        self.write_cells_and_restore_them()
        self.assert_as_before(self.about_the_past())
        self.assertEqual(self.site.stop(), 0)

        self.open()
        self.assert_as_before(self.about_the_past())
        self.assert_newest_as_before()
        for layer, frame in edited.items():
            for (revision, i), expected in states[layer].items():
                got = self.entities(layer, frame, at=revision).get(i)
                for key in ("label", "classes", "existence", "polygon", "tags", "attributes",
                            "height"):
                    self.assertEqual(got and got[key], expected and expected[key],
                                     (layer, revision, i, key))
        self.assertEqual(self.site.stop(), 0)
        with sqlite3.connect(self.file) as file:
            self.assertEqual(file.execute("PRAGMA integrity_check").fetchall(), [("ok",)])

    def test_a_retry_of_a_request_that_0_1_carried_out_gets_its_answer(self):
        self.open()
        with rpc.Client(self.site.address) as client:
            for receipt in self.recorded["receipts"]:
                answer = client.ApplyEdits(map=MAP, request_id=receipt["request_id"], edits=[
                    {"delete_object": {"layer": "things", "id": 1}}])
                self.assertEqual((answer.revision, list(answer.object_ids)),
                                 (receipt["revision"], receipt["object_ids"]))
        self.assert_newest_as_before()

    def assert_fused_as_before(self):
        """Checks that the fused objects, their explanations and the explored floor equal those of
        0.1."""
        layers = {"found", "found_paper", "corner", "found_floor", "corner_floor"}
        questions = [q for q in self.about_the_newest()
                     if q["ask"][0] == "explain" or
                     (q["ask"][:2] == ["query", "area"] and layers & set(q["ask"]))]
        self.assertGreater(len(questions), len(layers))
        self.rounds = 0
        self.assert_as_before(questions, ignored=COUNTERS)

    def rebuild(self, layer, strategy=None):
        """Fuses a layer again as 0.1 did: by the strategy, or that of the layer."""
        strategy = strategy or ("paper" if layer == "found_paper" else "evidence")
        as_0_1_did = ["--param", "same_view_m=0"] if strategy == "evidence" else []
        self.asker.answer("rebuild", MAP, "--layer", layer, "--fusion", strategy, *as_0_1_did)

    def test_fused_layers_can_be_rebuilt(self):
        self.open()
        for layer in ("found", "found_paper", "corner"):
            self.rebuild(layer)
        self.assert_fused_as_before()
        other = {"found": "paper", "found_paper": "evidence", "corner": "paper"}
        fused = {layer: self.entities(layer) for layer in other}
        for layer, strategy in other.items():
            self.rebuild(layer, strategy)
            self.assertNotEqual(self.entities(layer), fused[layer])
        self.assertEqual(self.site.stop(), 0)
        self.open()
        for layer, strategy in other.items():
            first = {"evidence": "paper", "paper": "evidence"}[strategy]
            self.rebuild(layer, first)
        self.assert_fused_as_before()

    def replay(self, rooms, *flags):
        result = subprocess.run(
            [WORKER, "replay", rooms, "--server", self.site.address, "--map", MAP, "--layer",
             "found", "--frame_id", "annex", "--detections", "detections_noisy.json", "--poses",
             "estimated.txt", "--json", *flags],
            capture_output=True, text=True, timeout=DEADLINE_S, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    @unittest.skipUnless(WORKER.exists() and RENDERER.exists(), "built without the worker")
    def test_robots_resume_and_add_observations(self):
        self.open()
        rooms = self.folder / "rooms"
        subprocess.run([RENDERER, rooms, "--every", "12"], check=True, stdout=subprocess.DEVNULL,
                       timeout=DEADLINE_S)
        again = self.replay(rooms)
        self.assertEqual((again["known"], again["accepted"]), (again["frames"], 0), again)
        more = self.replay(rooms, "--robot", "rooms-2", "--stride", "5")
        self.assertGreater(more["accepted"], 0)
        self.assertEqual(more["accepted"], more["frames"], more)
        self.asker.answer("retract", MAP, "--layer", "found", "--robot", "rooms-2")
        self.assert_fused_as_before()

    def test_the_exploration_continues_and_stops(self):
        self.open()
        (listed,) = self.asker.answer("explore", "list", MAP)
        (active,) = (e for e in listed["explorations"] if e["state"] == "active")
        self.assertEqual(len(active["goals"]), 1)
        self.edit("corridor", {"type": "Feature", "properties": {"value": "explored"}, "geometry": {
            "type": "Polygon", "coordinates": [[[0, 5], [9, 5], [9, 7], [0, 7], [0, 5]]]}})
        (status,) = self.asker.answer("explore", "status", MAP, active["id"])
        self.assertEqual(status["progress"]["reachable_cells"], 0)
        self.asker.answer("explore", "stop", MAP, active["id"])
        (status,) = self.asker.answer("explore", "status", MAP, active["id"])
        self.assertEqual((status["exploration"]["state"], status["exploration"]["goals"]),
                         ("ended", []))


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/python3
"""Writes golden.gpkg.xz, a map of version 0.1, and answers.json.xz, the answers of 0.1 about it.

    make.py CHECKOUT [FOLDER]

CHECKOUT is a checkout of commit 743c4b9 with hypermapd, hypermap, hypermap-ingest and
render_sequence in build/bin. The files go to FOLDER (default: the folder of this script). Each run
makes the same edits; commit times, the ports of authors, and how many observations share a revision
differ from run to run.

../../test_golden_map.py checks that later versions open the map and give the same answers. The two
files are not made again: a map of a later version gets a folder of its own.
"""

import json
import lzma
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile

COMMIT = "743c4b9"
CHECKOUT = pathlib.Path(sys.argv[1]).resolve()
HERE = pathlib.Path(__file__).resolve().parent
# The modules of the checkout that are imported below read it.
os.environ["HYPERMAP_BIN"] = str(CHECKOUT / "build" / "bin")
GENERATED = tempfile.TemporaryDirectory()
subprocess.run(["protoc", f"-I{CHECKOUT}/proto", f"--python_out={GENERATED.name}",
                *map(str, (CHECKOUT / "proto").rglob("*.proto"))], check=True)
sys.path[:0] = [GENERATED.name, str(CHECKOUT / "tests" / "integration"), str(HERE)]

import questions  # noqa: E402
import rpc  # noqa: E402
from processes import BIN, Server  # noqa: E402
from things import LABELS, polygon, rectangle, star, thing  # noqa: E402

# The server keeps all history and receipts, whatever the date is when the map is opened.
FLAGS = ["--history_age=876000h", "--history_revisions=1000000000", "--receipt_age=876000h"]
CENTURY = "3155760000s"


class Life:
    """Sends the edits that make the history of the map to one server."""

    # Ranges of x and y in the layer's frame within which objects are placed.
    SPREAD = {"things": ((-6, 22), (-4, 14)), "dock_things": ((0, 12), (-7, 6)),
              "shelf_things": ((0, 3), (0, 2)), "adrift": ((-5, 5), (-5, 5)),
              "1st-floor": ((0, 10), (0, 10)), "1st.floor": ((0, 10), (0, 10))}

    def __init__(self, server, folder):
        self.server, self.folder = server, folder
        self.draw = random.Random(743)
        self.objects = {layer: {} for layer in self.SPREAD}  # id -> the object
        self.receipts = []
        self.moved = []  # the revisions that moved frames
        self.clients = [rpc.Client(server.address) for _ in range(3)]

    @property
    def client(self):
        return self.draw.choice(self.clients)

    def cli(self, *arguments):
        result = self.server.cli("--json", *arguments)
        assert result.returncode == 0, (arguments, result.stderr)
        return json.loads(result.stdout.splitlines()[-1])

    def worker(self, command, *arguments):
        result = subprocess.run(
            [BIN / "hypermap-ingest", command, *map(str, arguments), "--server",
             self.server.address, "--map", "golden", "--json"],
            capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
        return json.loads(result.stdout)

    def edit(self, *edits, **fields):
        answer = self.client.ApplyEdits(map="golden", edits=list(edits), **fields)
        if "request_id" in fields:
            self.receipts.append({"request_id": fields["request_id"], "revision": answer.revision,
                                  "object_ids": list(answer.object_ids)})
        return answer

    def geojson(self, layer, *features, frame=None, flags=()):
        """Edits through the command line. Each process is an author of its own."""
        path = self.folder / "edit.geojson"
        path.write_text(json.dumps({"type": "FeatureCollection", "features": [
            {"type": "Feature", "properties": properties,
             "geometry": {"type": "Polygon", "coordinates": [ring]}}
            for properties, ring in features], **({"frame": frame} if frame else {})}))
        return self.cli("edit", "golden", path, "--layer", layer, *flags)

    # The steps of the history, in the order of write_map. Each makes several revisions.

    def make_layers(self):
        self.cli("map", "create", "golden")
        for child, parent, *pose in (("dock", "map", 20, 0, 1.75), ("rack", "dock", 1.5, 0.8, -0.4),
                                     ("annex", "map", -15, 3, -0.6), ("buoy", "raft", 1, 2, 3)):
            self.cli("transform", "set", "golden", child, parent, *pose)
        for name, kind, *flags in (
                ("floor", "occupancy", "--resolution", 0.05),
                ("seen", "exploration", "--resolution", 0.1, "--explored-rule", "touched"),
                ("wifi", "scalar", "--unit", "dBm", "--resolution", 0.25),
                ("office", "semantic"), ("dock", "semantic", "--frame", "dock"),
                ("things", "semantic"), ("dock_things", "semantic", "--frame", "dock"),
                ("shelf_things", "semantic", "--frame", "rack"),
                ("adrift", "semantic", "--frame", "raft"),
                # Layers whose table names differ from their own names.
                ("1st-floor", "semantic"), ("1st.floor", "semantic"), ("select", "semantic"),
                ("dock_floor", "occupancy", "--resolution", 0.2, "--frame", "dock", "--origin",
                 "-1,-7,0.1", "--free-below", 0.3, "--occupied-above", 0.7),
                ("temperature", "scalar", "--unit", "°C", "--resolution", 0.25, "--origin",
                 "-3,-2,0.3"),
                ("load", "scalar", "--unit", "kg", "--resolution", 0.1, "--frame", "rack"),
                ("scratch", "semantic")):
            self.cli("layer", "create", "golden", name, "--kind", kind, *flags)

    def load_office(self):
        office = CHECKOUT / "demo" / "office"
        for layer, file in (("floor", "floor"), ("seen", "seen"), ("wifi", "wifi"),
                            ("office", "objects"), ("dock", "dock")):
            self.cli("edit", "golden", office / f"{file}.geojson", "--layer", layer)
        # A layer and its objects as one revision.
        self.cli("import", office / "dock.geojson", "--map", "golden", "--layer", "imported")

    def place(self, layer):
        (x0, x1), (y0, y1) = self.SPREAD[layer]
        return self.draw.uniform(x0, x1), self.draw.uniform(y0, y1)

    def put_things(self):
        for layer, count in (("things", 40), ("dock_things", 20), ("shelf_things", 10),
                             ("adrift", 5), ("1st-floor", 4), ("1st.floor", 4)):
            objects = [thing(self.draw, *self.place(layer)) for _ in range(count)]
            answer = self.edit(*({"put_object": {"layer": layer, "object": o}} for o in objects),
                               request_id=f"put {layer}")
            self.objects[layer] = dict(zip(answer.object_ids, objects))
        far = {"label": "far", "polygon": polygon(rectangle(1e6, -2e6, 1e6 + 1, -2e6 + 1))}
        self.edit({"put_object": {"layer": "things", "object": far}})

    def random_put(self, layer):
        objects = self.objects[layer]
        made = thing(self.draw, *self.place(layer))
        edit = {"put_object": {"layer": layer, "object": made}}
        if objects and self.draw.random() < 0.6:  # replaces an object, or only moves it
            made["id"] = self.draw.choice(sorted(objects))
            if self.draw.random() < 0.6:
                made = {**objects[made["id"]], "id": made["id"], "polygon": made["polygon"]}
                edit["put_object"]["object"] = made
            objects[made["id"]] = made
        if layer == "dock_things" and self.draw.random() < 0.3:
            edit["put_object"]["frame_id"] = "map"
        return edit

    def random_cells(self):
        layer, steps = self.draw.choice([
            ("floor", [0.0, 0.02, 0.5, 1.0, 0.12345, "NaN"]), ("seen", [0.0, 1.0, "NaN"]),
            ("temperature", [20.5, 21.25, -40.0, 1 / 3, 3.4e38, "NaN"]),
            ("load", [0.0, 0.1, 1e-40, "NaN"]), ("dock_floor", [0.0, 0.5, 0.9, "NaN"])])
        rows, cols = self.draw.randint(1, 12), self.draw.randint(1, 25)
        # Tiles have 128 x 128 cells: these boxes cross or touch their borders.
        row = self.draw.choice([-140, -5, 0, 40, 120, 125]) + self.draw.randint(-2, 2)
        col = self.draw.choice([-130, -10, 0, 60, 120, 250]) + self.draw.randint(-2, 2)
        return {"write_cells": {
            "layer": layer, "values": [self.draw.choice(steps) for _ in range(rows * cols)],
            "box": {"row_begin": row, "row_end": row + rows, "col_begin": col,
                    "col_end": col + cols}}}

    def random_fill(self):
        layer, value = self.draw.choice([
            ("floor", 0.02), ("floor", 1.0), ("seen", 1.0), ("temperature", 19.75),
            ("dock_floor", 0.1), ("wifi", None)])
        x, y = self.place("things")
        fill = {"layer": layer, "area": polygon(star(self.draw, x, y, 2, 9)), "frame_id": "map",
                "rule": self.draw.choice(["CELL_RULE_CENTRE", "CELL_RULE_COVERED",
                                          "CELL_RULE_TOUCHED"])}
        return {"fill_polygon": fill if value is None else {**fill, "value": value}}

    def random_edit(self):
        dice = self.draw.random()
        if dice < 0.25:
            return self.random_cells()
        if dice < 0.4:
            return self.random_fill()
        if dice < 0.5:
            return {"set_aliases": {"layer": "things", "aliases": [
                {"alias": self.draw.choice(["Seat", "mug", "green  thing"]),
                 "labels": self.draw.sample(LABELS, self.draw.randint(0, 3))}]}}
        layer = self.draw.choice(sorted(self.SPREAD))
        if dice < 0.6 and len(self.objects[layer]) > 2:
            gone = self.draw.choice(sorted(self.objects[layer]))
            del self.objects[layer][gone]
            return {"delete_object": {"layer": layer, "id": gone}}
        return self.random_put(layer)

    def change(self, count):
        for i in range(count):
            edits = [self.random_edit() for _ in range(self.draw.randint(1, 3))]
            fields = {"request_id": f"change {self.draw.random()}"} if i % 5 == 0 else {}
            self.edit(*edits, **fields)

    def use_a_scratch_layer(self):
        """Deletes a layer with its content, then creates a layer of another kind by its name."""
        self.geojson("scratch", ({"label": "note"}, rectangle(1, 1, 2, 2) + [(1, 1)]))
        self.cli("alias", "golden", "scratch", "memo=note")
        self.cli("layer", "delete", "golden", "scratch")
        self.cli("layer", "create", "golden", "scratch", "--kind", "scalar", "--resolution", 0.5)
        self.geojson("scratch", ({"value": 7.5}, rectangle(0, 0, 4, 3) + [(0, 0)]))

    def survey_again(self):
        """Moves two frames. One of them gets another parent."""
        for child, *pose in (("dock", 20.02, -0.03, 1.7453), ("rack", 18.25, 2.5, 1.3)):
            answer = self.cli("transform", "set", "golden", child, "map", *pose)
            self.moved.append(answer["revision"])

    def let_expire(self):
        ring = rectangle(3, 8, 4, 9) + [(3, 8)]
        put = self.geojson("things", ({"label": "pallet"}, ring), flags=("--ttl", "1s"))
        self.geojson("things", ({"label": "lease of a century"}, ring),
                     flags=("--ttl", "876600h"))
        command = [BIN / "hypermap", "--server", self.server.address, "--json", "watch", "golden",
                   "--from", str(put["revision"])]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as watch:
            for line in watch.stdout:
                if json.loads(line).get("author") == "expiry":
                    watch.terminate()
                    return

    def drive(self):
        """Fuses a short drive into a layer of the frame "annex". An operator edits the layer
        between two parts of the drive, observations of a second robot are retracted, and the layer
        is rebuilt. A second layer is fused by the strategy "paper"."""
        rooms = self.folder / "rooms"
        subprocess.run([BIN / "render_sequence", rooms, "--every", "12"], check=True,
                       stdout=subprocess.DEVNULL)
        self.cli("layer", "create", "golden", "found", "--kind", "semantic", "--frame", "annex")
        self.cli("layer", "create", "golden", "found_floor", "--kind", "exploration", "--frame",
                 "annex", "--resolution", 0.1)
        self.cli("import", rooms / "occupancy.yaml", "--map", "golden", "--layer", "annex_floor",
                 "--frame", "annex")
        replay = [rooms, "--frame_id", "annex", "--detections", "detections_noisy.json"]
        into_found = ["--layer", "found", "--exploration", "found_floor", "--poses",
                      "estimated.txt"]
        self.worker("replay", *replay, *into_found, "--end", 16)
        self.correct_what_was_found()
        self.worker("replay", *replay, *into_found, "--first", 16)
        self.worker("replay", *replay, *into_found, "--robot", "other", "--first", 2, "--stride", 4)
        self.cli("retract", "golden", "--layer", "found", "--robot", "other", "--from",
                 "2023-11-14T22:13:40Z")
        self.cli("alias", "golden", "found", "furniture=chair,couch,diningtable")
        self.cli("rebuild", "golden", "--layer", "found", "--fusion", "paper")
        self.cli("rebuild", "golden", "--layer", "found", "--fusion", "evidence")
        self.cli("layer", "create", "golden", "found_paper", "--kind", "semantic", "--frame",
                 "annex")
        self.worker("replay", *replay, "--layer", "found_paper", "--fusion", "paper", "--stride", 3)

    def correct_what_was_found(self):
        found = sorted((o for answer in self.client.QueryArea(
            map="golden", layers=["found"], frame_id="annex",
            area=polygon(rectangle(-50, -50, 50, 50))) for o in answer.part.objects),
            key=lambda o: o.id)
        assert len(found) >= 3, "the drive found too little"
        # The first is pinned with another label and shape, the second removed, the third was never
        # detected.
        centre = found[0].centroid
        self.edit({"put_object": {"layer": "found", "object": {
            "id": found[0].id, "label": "armchair", "tags": ["checked"],
            "polygon": polygon(star(self.draw, centre.x, centre.y, 0.4, 9))}}})
        self.edit({"delete_object": {"layer": "found", "id": found[1].id}})
        self.edit({"put_object": {"layer": "found", "object": {
            "label": "fire extinguisher", "polygon": polygon(rectangle(2, 3, 2.2, 3.2))}}})

    def simulate(self):
        """A simulated robot explores a corner of the office to the end."""
        self.worker("simulate", "--occupancy", "floor", "--objects", "office", "--area", "10.2,0.3",
                    "12,0.3", "12,2", "10.2,2", "--frame-every", 6, "--range", 2, "--radius", 0.15,
                    "--layer", "corner", "--explored", "corner_floor")

    def explore(self):
        """Leaves one stopped exploration, and an active one with a leased goal and a place given
        up as unreachable."""
        office = ["0.3,5.3", "9,5.3", "9,6.7", "0.3,6.7"]
        self.cli("explore", "start", "golden", "--occupancy", "floor", "--layer", "corridor",
                 "--area", *office, "--robot-radius", 0.2, "--range", 3, "--rule", "covered")
        self.cli("explore", "stop", "golden")
        self.cli("explore", "start", "golden", "--occupancy", "floor", "--layer", "corridor",
                 "--area", *office, "--robot-radius", 0.2, "--range", 3)
        self.geojson("corridor", ({"value": "explored"}, rectangle(0, 5, 2.5, 7) + [(0, 5)]))

        def claim(robot, x, y):
            return self.client.ClaimGoal(map="golden", robot=robot, pose={"x": x, "y": y},
                                         lease="600s").goal

        for robot, outcome in (("r1", "UNREACHABLE"), ("r2", "ABANDONED"), ("r3", "REACHED")):
            goal = claim(robot, 1.5, 6)
            assert goal.id, f"{robot} got no goal"
            self.client.ReleaseGoal(map="golden", robot=robot, goal_id=goal.id,
                                    outcome=f"GOAL_OUTCOME_{outcome}")
        goal = claim("r4", 1.0, 6)
        self.client.RenewGoal(map="golden", robot="r4", goal_id=goal.id, lease="300s")
        self.lease_for_a_century(goal.id)

    def lease_for_a_century(self, goal):
        """Puts the goal with a long lease, so that it does not expire before the map is opened."""
        (there,) = (o for answer in self.client.QueryArea(
            map="golden", layers=["explorations"], area=polygon(rectangle(-50, -50, 50, 50)))
            for o in answer.part.objects if o.id == goal)
        for answers_only in ("centroid", "version", "expire_time"):
            there.ClearField(answers_only)
        message = rpc.json_format.MessageToDict(there, preserving_proto_field_name=True)
        self.edit({"put_object": {"layer": "explorations", "object": message,
                                  "time_to_live": CENTURY}})


def write_map(folder):
    """Writes golden.gpkg to the folder and closes it. Returns the Life that made it."""
    with Server(folder, *FLAGS) as server:
        with tempfile.TemporaryDirectory() as scratch:
            life = Life(server, pathlib.Path(scratch))
            life.make_layers()
            life.load_office()
            life.put_things()
            life.change(25)
            life.use_a_scratch_layer()
            life.drive()
            life.survey_again()
            life.change(25)
            life.let_expire()
            life.simulate()
            life.explore()
            life.change(10)
        assert server.stop() == 0, server.log()
    assert not list(folder.glob("*-wal")), "the write-ahead log was not checkpointed"
    return life


def main():
    target = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else HERE)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        life = write_map(folder)
        answers = []
        for name in ("first", "second"):  # two servers must give the same answers
            copy = folder / name
            copy.mkdir()
            shutil.copy(folder / "golden.gpkg", copy)
            with Server(copy, *FLAGS) as server:
                asker = questions.Asker(BIN / "hypermap", server.address)
                answers.append(questions.ask_all(asker, random.Random(34), life.moved))
                server.stop()
        assert answers[0] == answers[1]
        written = (folder / "golden.gpkg").read_bytes()
    recorded = {"commit": COMMIT, "receipts": life.receipts, **answers[0]}
    for name, data in (("golden.gpkg.xz", written),
                       ("answers.json.xz", json.dumps(recorded).encode())):
        packed = lzma.compress(data, preset=9 | lzma.PRESET_EXTREME)
        (target / name).write_bytes(packed)
        print(f"{name}: {len(data)} bytes, {len(packed)} compressed")
    print(f"{len(recorded['questions'])} questions, newest revision {recorded['newest']}")


if __name__ == "__main__":
    main()

"""Tests of the hypermap command: its tables, its JSON, its exit codes and its error messages."""

import json
import os
import signal
import threading
import unittest

import rpc
import sites
from processes import SiteTest, cli, real_maps


class CommandLine(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))

    def geojson(self, *features):
        path = self.folder / "edit.geojson"
        path.write_text(json.dumps({"type": "FeatureCollection", "features": list(features)}))
        return path

    @staticmethod
    def feature(label, x, y, **members):
        ring = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]]
        return {"type": "Feature", "properties": {"label": label},
                "geometry": {"type": "Polygon", "coordinates": [ring]}, **members}

    def test_a_point_in_json_has_the_documented_members(self):
        sites.make(self.client)
        (object_id,) = self.client.ApplyEdits(map="site", edits=[sites.put(
            "cup", 1, 1, classes={"cup": 0.9, "bowl": 0.1}, existence=0.75, tags=["kitchen"],
            height={"low_m": 0.7, "high_m": 0.8}, attributes={"red": {"bool_value": True}})
        ]).object_ids
        self.client.ApplyEdits(map="site", edits=[sites.write_cells([[0.25]], row=2, col=2)])
        answer = self.site.json("query", "point", "site", 1.25, 1.25)
        self.assertEqual({k: answer[k] for k in ("map", "revision", "frame_id", "point")},
                         {"map": "site", "revision": sites.revision(self.client),
                          "frame_id": "map", "point": [1.25, 1.25]})
        layers = {layer["layer"]: layer for layer in answer["layers"]}
        self.assertEqual(layers["adrift"]["status"], "no_transform")
        self.assertEqual((layers["grid"]["kind"], layers["grid"]["status"],
                          layers["grid"]["value"]), ("occupancy", "value", 0.25))
        (entity,) = layers["things"]["entities"]
        self.assertEqual(entity, {
            "id": object_id, "label": "cup", "classes": {"cup": 0.9, "bowl": 0.1},
            "existence": 0.75, "polygon": [[[1, 1], [2, 1], [2, 2], [1, 2], [1, 1]]],
            "centroid": [1.5, 1.5], "tags": ["kitchen"], "attributes": {"red": True},
            "height": [0.7, 0.8]})

    def test_the_four_answers_of_a_grid_differ(self):
        sites.make(self.client)
        self.client.ApplyEdits(map="site", edits=[sites.write_cells([[0.5, "NaN"]])])

        def status(x, y):
            answer = self.site.json("query", "point", "site", x, y, "--layer", "grid")
            return answer["layers"][0]["status"]

        # Cells are half open: a cell contains its lower and left edges, but not the others.
        self.assertEqual([status(0, 0), status(0.5, 0), status(1, 0), status(0, 0.5),
                          status(-0.001, 0)],
                         ["value", "unknown", "outside", "outside", "outside"])

    def test_a_layer_can_be_queried_by_aliases(self):
        sites.make(self.client)
        self.client.ApplyEdits(map="site", edits=[
            sites.put("chair", 1, 1), sites.put("Dining Table", 5, 1), sites.put("cup", 9, 1)])

        def labels(value):
            lines = self.site.json_lines("query", "value", "site", value, "--layer", "things")
            return [line["entity"]["label"] for line in lines if "entity" in line]

        self.assertEqual(labels("furniture"), [])
        self.site.json("alias", "site", "things", "Furniture=chair,dining table", "mug=cup")
        self.assertEqual(labels("FURNITURE"), ["chair", "Dining Table"])
        nearest, *_ = self.site.json_lines("query", "nearest", "site", 9, 1, "--value", "furniture")
        self.assertEqual(nearest["entity"]["label"], "Dining Table")
        self.site.stop()
        self.site = self.server()
        self.assertEqual(labels("mug"), ["cup"])
        self.site.json("alias", "site", "things", "mug=")
        self.assertEqual(labels("mug"), [])
        (layer,) = [layer for layer in self.site.json("layers", "site")["layers"]
                    if layer["name"] == "things"]
        self.assertEqual(layer["aliases"], {"furniture": ["chair", "dining table"]})

    def test_a_layer_is_compared_with_ground_truth(self):
        sites.make(self.client)
        self.client.ApplyEdits(map="site", edits=[
            sites.put("chair", 1.5, 1), sites.put("cup", 5, 5), sites.put("cup", 8, 8)])
        truth = self.geojson(self.feature("chair", 1, 1), self.feature("Mug", 5, 5))
        self.site.json("alias", "site", "things", "mug=cup")
        picture = self.folder / "picture.png"
        answer = self.site.json("eval", "site", "--layer", "things", "--truth", truth,
                                "--png", picture)
        self.assertEqual({key: answer[key] for key in ("n_truth", "n_map", "tp", "spurious")},
                         {"n_truth": 2, "n_map": 3, "tp": 2, "spurious": 1})
        self.assertAlmostEqual(answer["pq"], (1 / 3 + 1) / 2.5)
        self.assertAlmostEqual(answer["centroid_error_m"], 0.25)
        self.assertEqual(picture.read_bytes()[:4], b"\x89PNG")
        itself = self.site.json("eval", "site", "--layer", "things", "--truth-map", "site")
        self.assertEqual((itself["f1"], itself["pq"]), (1, 1))

    def test_a_map_is_rendered_as_a_png(self):
        sites.make(self.client)
        picture = self.folder / "map.png"
        self.assert_fails(self.site.cli("render", "site", "-o", picture), "nothing to draw")
        self.client.ApplyEdits(map="site", edits=[
            sites.put("chair", 1, 1), sites.write_cells([[0, 0, 1, "NaN"]])])
        answer = self.site.json("render", "site", "-o", picture)
        self.assertEqual({k: answer[k] for k in ("map", "revision", "file", "layers", "objects")},
                         {"map": "site", "revision": sites.revision(self.client),
                          "file": str(picture), "layers": ["grid", "things"], "objects": 1})
        self.assertEqual(picture.read_bytes()[:4], b"\x89PNG")
        # The PNG header contains width and height.
        self.assertEqual([int.from_bytes(picture.read_bytes()[i:i + 4], "big") for i in (16, 20)],
                         [answer["width"], answer["height"]])
        self.assert_fails(self.site.cli("render", "nowhere", "-o", picture), "nowhere")
        self.assert_fails(self.site.cli("render", "site", "-o", picture, "--layers", "none"), "none")

    def test_an_area_is_explored_from_start_to_stop(self):
        sites.make(self.client)
        self.client.ApplyEdits(map="site", edits=[sites.write_cells([[0] * 20] * 10)])
        self.assert_fails(self.site.cli("explore", "status", "site"), "NOT_FOUND")
        # The left 8 m of a floor of 10 x 5 m.
        area = ["0,0", "8,0", "8,5", "0,5"]
        start = ["explore", "start", "site", "--layer", "seen", "--area", *area]
        self.assert_fails(self.site.cli(*start, "--occupancy", "none"), "none")
        self.assert_fails(self.site.cli(*start, "--occupancy", "things"), "FAILED_PRECONDITION")
        begun = self.site.json(*start, "--occupancy", "grid", "--rule", "covered")
        self.assertEqual((begun["map"], begun["exploration"]["state"]), ("site", "active"))
        seen, = (layer for layer in self.site.json("layers", "site")["layers"]
                 if layer["name"] == "seen")
        self.assertEqual((seen["kind"], seen["explored_rule"]), ("exploration", "covered"))

        file = self.folder / "seen.geojson"
        ring = [[0, 0], [2, 0], [2, 5], [0, 5], [0, 0]]
        file.write_text(json.dumps({"type": "FeatureCollection", "features": [
            {"type": "Feature", "properties": {"value": "explored"},
             "geometry": {"type": "Polygon", "coordinates": [ring]}}]}))
        self.site.json("edit", "site", file, "--layer", "seen")
        status = self.site.json("explore", "status", "site", begun["exploration"]["id"])
        self.assertEqual({k: status["progress"][k] for k in
                          ("explored_cells", "reachable_cells", "unreachable_cells", "fraction")},
                         {"explored_cells": 40, "reachable_cells": 120, "unreachable_cells": 0,
                          "fraction": 0.25})
        (frontier,) = self.site.json("explore", "frontiers", "site", "--cells")["frontiers"]
        self.assertEqual(sorted(frontier["cells"]), [[2.25, 0.5 * i + 0.25] for i in range(10)])
        self.assertIn("25 % seen", self.site.cli("explore", "status", "site").stdout)

        self.assertEqual(self.site.json("explore", "stop", "site")["exploration"]["end_reason"],
                         "stopped")
        (ended,) = self.site.json("explore", "list", "site")["explorations"]
        self.assertEqual((ended["id"], ended["state"]), (begun["exploration"]["id"], "ended"))
        paths = self.folder / "paths.geojson"
        paths.write_text(json.dumps({"type": "FeatureCollection", "features": [
            {"type": "Feature", "properties": {"robot": "r1"},
             "geometry": {"type": "LineString", "coordinates": [[1, 1], [3, 2]]}}]}))
        drawn = self.site.json("render", "site", "-o", self.folder / "map.png", "--path", paths)
        self.assertEqual(drawn["objects"], 0)

    def test_an_unsupported_value_does_not_affect_the_answers_of_other_layers(self):
        sites.make(self.client)
        self.client.ApplyEdits(map="site", edits=[sites.put("chair", 1, 1),
                                                  sites.write_cells([[1, 1]])])
        lines = self.site.json_lines("query", "value", "site", ">0.65")
        self.assertEqual([line["status"] for line in lines if line.get("layer") == "things"],
                         ["unsupported_value"])
        runs = [line["runs"] for line in lines if line.get("layer") == "grid"]
        self.assertEqual(runs, [[[0, 0, 2, 1.0]]])
        self.assertEqual(list(lines[-1]), ["revision"])

    def test_nearest_gives_distances_to_objects_and_cells(self):
        sites.make(self.client)
        self.client.ApplyEdits(map="site", edits=[sites.put("chair", 1, 0), sites.put("chair", 5, 0),
                                                  sites.put("chair", 9, 0)])
        lines = self.site.json_lines("query", "nearest", "site", 0, 0.5, "--value", "chair", "-k", 2)
        self.assertEqual([line["distance_m"] for line in lines if "entity" in line], [1, 5])

    def test_an_edit_puts_replaces_and_deletes(self):
        self.site.json("map", "create", "site")
        first = self.site.json("edit", "site", self.geojson(
            self.feature("chair", 0, 0), self.feature("desk", 5, 0)), "--layer", "things")
        self.assertEqual((first["map"], first["layers"]), ("site", ["things"]))
        ids = {label: i for i, label in sites.labels(self.client).items()}
        second = self.site.json("edit", "site", self.geojson(
            self.feature("stool", 0, 0, id=ids["chair"]),
            {"type": "Feature", "id": ids["desk"], "geometry": None, "properties": {}}),
            "--layer", "things")
        self.assertGreater(second["revision"], first["revision"])
        self.assertEqual(sites.labels(self.client), {ids["chair"]: "stool"})

    def test_answers_come_in_the_callers_frame(self):
        sites.make(self.client)
        self.client.SetTransform(map="site", transform={
            "parent_frame_id": "map", "child_frame_id": "dock",
            "parent_from_child": {"x": 10, "y": 0, "yaw": 0}})
        self.client.ApplyEdits(map="site", edits=[sites.put("chair", 12, 3)])
        answer = self.site.json("query", "point", "site", 2.5, 3.5, "--frame", "dock",
                                "--layer", "things")
        (entity,) = answer["layers"][0]["entities"]
        self.assertEqual(entity["centroid"], [2.5, 3.5])

    def test_answers_are_printed_as_tables(self):
        sites.make(self.client)
        self.client.ApplyEdits(map="site", edits=[sites.put("chair", 1, 1)])
        for command in (["maps"], ["layers", "site"], ["query", "point", "site", 1.5, 1.5],
                        ["query", "area", "site", "0,0", "9,0", "9,9"],
                        ["query", "value", "site", "chair"]):
            result = self.site.cli(*command)
            self.assertEqual((result.returncode, result.stderr), (0, ""), command)
            self.assertTrue(result.stdout.strip(), command)
            self.assertNotIn("{", result.stdout)

    def test_exit_code_is_2_for_wrong_usage_and_1_for_errors_with_one_line_each(self):
        for arguments in ([], ["no-such-command"], ["query", "point", "site"],
                          ["query", "point", "site", "x", "y"], ["--no-such-flag", "maps"]):
            result = self.site.cli(*arguments)
            self.assertEqual((result.returncode, result.stdout), (2, ""), (arguments, result))
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        self.assert_fails(self.site.cli("layers", "nowhere"), "nowhere")
        self.assert_fails(self.site.cli("--json", "layers", "nowhere"), "nowhere")

    def test_a_connection_may_take_seconds(self):
        """As handshakes do over a slow link; here the server is stopped meanwhile."""
        os.kill(self.site.pid, signal.SIGSTOP)
        goes_on = threading.Timer(3.0, os.kill, (self.site.pid, signal.SIGCONT))
        goes_on.start()
        result = self.site.cli("maps")
        goes_on.join()
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_no_server_is_an_error_that_names_the_address(self):
        self.assertEqual(self.site.stop(), 0)
        self.assert_fails(cli("--server", self.site.address, "maps"), self.site.address)

    @unittest.skipUnless("map_office_small_sem_gt" in real_maps(), "the recorded maps are missing")
    def test_the_office_of_the_paper(self):
        path = real_maps()["map_office_small_sem_gt"]
        imported = self.site.json("import", path, "--map", "office")
        self.assertEqual(sorted(imported["layers"]), ["occupancy", "semantic"])
        commas = [line for line in imported["repairs"] if "missing comma" in line]
        self.assertEqual(len(commas), 1, imported["repairs"])
        answer = self.site.json("query", "point", "office", 2.75, 0.4)
        layers = {layer["layer"]: layer for layer in answer["layers"]}
        self.assertEqual({e["label"] for e in layers["semantic"]["entities"]},
                         {"diningtable", "cup"})
        self.assertEqual(layers["occupancy"]["status"], "value")
        self.assertTrue(0 <= layers["occupancy"]["value"] <= 1)
        chairs = self.site.json_lines("query", "value", "office", "chair", "--layer", "semantic")
        self.assertEqual(len([line for line in chairs if "entity" in line]), 7)


if __name__ == "__main__":
    unittest.main()

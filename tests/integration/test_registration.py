"""The transform between two maps, estimated by the command with a real server: of a recorded map and
the same map imported again turned and shifted, and of points."""

import math
import unittest

import numpy as np

import rpc
import sites
from processes import SiteTest, real_maps

# target_from_source: x and y in metres, yaw in radians.
TRUE = (-3.25, 7.5, 2.1)
MAP, OTHER = "ipa_kitchen", "hmap_example"
PNG = b"\x89PNG\r\n\x1a\n"


def matrix(pose):
    x, y, yaw = pose
    return np.array([[math.cos(yaw), -math.sin(yaw), x], [math.sin(yaw), math.cos(yaw), y],
                     [0, 0, 1]])


def apply(pose, point):
    return (matrix(pose) @ (*point, 1))[:2]


def turned(origin):
    """Returns the pose of a grid after the transform."""
    x, y = apply(TRUE, origin[:2])
    return x, y, origin[2] + TRUE[2]


class Registration(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()

    def assert_true(self, pose, delta=0.02):
        self.assertAlmostEqual(pose[0], TRUE[0], delta=delta)
        self.assertAlmostEqual(pose[1], TRUE[1], delta=delta)
        self.assertAlmostEqual(math.remainder(pose[2] - TRUE[2], 2 * math.pi), 0, delta=0.005)

    @unittest.skipUnless(real_maps(), "the recorded maps are missing")
    def test_a_recorded_map_is_laid_over_itself_turned(self):
        layer = self.import_turned()
        picture = self.folder / "over.png"
        estimate = ("transform", "estimate", MAP, "turned", "--layer", layer)
        found = self.site.json(*estimate, "--output", picture)
        self.assertEqual(found["ambiguity"], "none")
        self.assert_true(found["target_from_source"])
        self.assertGreater(found["score"], 0.85)
        self.assertLess(found["runner_up"]["score"], 0.7 * found["score"])
        self.assertTrue(picture.read_bytes().startswith(PNG))
        self.assertEqual(self.site.json("transforms", "turned")["transforms"], [])
        # Applied, the turned map answers in the frame of the other one.
        applied = self.site.json(*estimate, "--apply")["applied"]
        (transform,) = self.site.json("transforms", "turned")["transforms"]
        self.assertEqual((transform["child_frame_id"], transform["parent_frame_id"]), (MAP, "map"))
        self.assertEqual(applied["parent_from_child"], transform["parent_from_child"])
        walls = self.walls(layer)
        agreeing = sum(self.is_occupied("turned", layer, x, y, "--frame", MAP) for x, y in walls)
        # A wall is some cells thick, and the transform is off by less than one.
        self.assertGreaterEqual(agreeing, 0.6 * len(walls))

    @unittest.skipUnless(real_maps(), "the recorded maps are missing")
    def test_another_place_is_ambiguous_and_is_not_applied(self):
        layer = self.import_turned()
        self.site.json("import", real_maps()[OTHER], "--map", OTHER)
        (other,) = self.occupancy_layers(OTHER)[:1]
        result = self.site.cli("transform", "estimate", MAP, OTHER, "--source-layer", layer,
                               "--target-layer", other, "--apply")
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("ambiguous", result.stdout)
        self.assertIn("not applied", result.stderr)
        frames = [t["child_frame_id"] for t in self.site.json("transforms", OTHER)["transforms"]]
        self.assertNotIn(MAP, frames)

    def test_points_are_read_from_a_file(self):
        self.site.json("map", "create", "attic")
        self.site.json("map", "create", "office")
        places = [(0, 0), (4, 1), (5, 7), (-3, 2), (1, -6)]
        lines = [f"p{i},{p[0]},{p[1]},{q[0]},{q[1]}"
                 for i, p in enumerate(places) for q in [apply(TRUE, p)]]
        lines[2] = "wrong,5,7,0,0"
        pairs = self.folder / "pairs.csv"
        pairs.write_text("name,source_x,source_y,target_x,target_y\n" + "\n".join(lines))
        picture = self.folder / "pairs.png"
        found = self.site.json("transform", "estimate", "attic", "office", "--pairs", pairs,
                               "--output", picture)
        self.assert_true(found["target_from_source"], delta=1e-6)
        self.assertEqual([pair["name"] for pair in found["agreeing"]], ["p0", "p1", "p3", "p4"])
        self.assertTrue(picture.read_bytes().startswith(PNG))

    def test_objects_of_two_maps(self):
        places = [(0, 0), (4, 1), (5, 7), (-3, 2), (1, -6)]
        client = self.enterContext(rpc.Client(self.site.address))
        for name, pose in (("attic", (0, 0, 0)), ("office", TRUE)):
            sites.make(client, name)
            client.ApplyEdits(map=name, edits=[
                sites.put("cup", *map(float, apply(pose, p) - 0.5)) for p in places])
        found = self.site.json("transform", "estimate", "attic", "office", "--layer", "things")
        self.assertEqual(found["ambiguity"], "none")
        self.assert_true(found["target_from_source"], delta=1e-6)
        self.assertEqual(len(found["agreeing"]), 5)

    def occupancy_layers(self, name):
        return [layer["name"] for layer in self.site.json("layers", name)["layers"]
                if layer["kind"] == "occupancy"]

    def import_turned(self):
        """Imports a recorded map, and its grid once more into the map "turned". Returns the name of
        the layer, which is the same in both."""
        self.site.json("import", real_maps()[MAP], "--map", MAP)
        (layer,) = self.occupancy_layers(MAP)[:1]
        yaml = self.folder / "floor.yaml"
        self.site.json("export", MAP, "--format", "nav2", "--layer", layer, "-o", yaml)
        lines = yaml.read_text().splitlines()
        (at,) = [i for i, line in enumerate(lines) if line.startswith("origin:")]
        origin = [float(number) for number in lines[at].partition("[")[2].rstrip("] ").split(",")]
        lines[at] = "origin: [" + ", ".join(repr(float(v)) for v in turned(origin)) + "]"
        yaml.write_text("\n".join(lines) + "\n")
        self.site.json("import", yaml, "--map", "turned", "--layer", layer)
        return layer

    def walls(self, layer):
        """Returns places in cells that are occupied, 40 of them, in the map's own frame."""
        lines = self.site.json_lines("query", "value", MAP, "occupied", "--layer", layer)
        places = []
        for line in lines:
            for row, begin, _, _ in line.get("runs", []):
                grid = line["grid"]
                places.append(apply(grid["origin"], ((begin + 0.5) * grid["resolution_m"],
                                                     (row + 0.5) * grid["resolution_m"])))
        return places[::max(1, len(places) // 40)][:40]

    def is_occupied(self, name, layer, x, y, *options):
        (content,) = self.site.json("query", "point", name, str(x), str(y), "--layer", layer,
                                    *options)["layers"]
        return (content["value"] or 0) > 0.65


if __name__ == "__main__":
    unittest.main()

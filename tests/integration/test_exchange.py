"""Export and import of maps, and checks of stored and exported files by other software."""

import json
import math
import shutil
import subprocess
import sys
import unittest
import zipfile

import numpy
import shapely.geometry
import yaml

import answers
import hmap_reader
import rpc
import sites
from oracle import Oracle, Questions
from processes import DEADLINE_S, SEED, SiteTest, real_maps


def run(*command):
    """Runs a program that must succeed, and returns its standard output."""
    result = subprocess.run(list(map(str, command)), capture_output=True, text=True,
                            timeout=DEADLINE_S, check=False)
    assert result.returncode == 0, (command, result.stdout, result.stderr)
    return result.stdout


class ExchangeTest(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()

    def export(self, name, kind, *options):
        path = self.folder / f"{name}.{kind}"
        self.site.json("export", name, "--format", kind, "-o", path, *options)
        return path

    def content(self, name):
        """Returns the whole content of a map: each layer's objects without ids, and its cells."""
        with rpc.Client(self.site.address) as client:
            return [(part.layer, strip_ids(part.objects), list(part.cells.rows),
                     list(part.cells.col_begins), list(part.cells.col_ends),
                     [None if math.isnan(v) else v for v in part.cells.values])
                    for part in merge(client.QueryArea(scope=rpc.scope(name),
                                                       area=sites.square(-5000, -5000, 10000)))]


def merge(stream):
    """Merges the parts of a response stream. Returns one part per layer."""
    parts = {}
    for answer in stream:
        if answer.part.layer in parts:
            parts[answer.part.layer].MergeFrom(answer.part)
        else:
            parts[answer.part.layer] = answer.part
    return parts.values()


def strip_ids(objects):
    """Returns the objects as sorted strings without their ids, which differ between maps."""
    for o in objects:
        o.id = 0
    return sorted(str(o) for o in objects)


@unittest.skipUnless(real_maps(), "the recorded maps are missing")
class RealMaps(ExchangeTest):

    def test_an_exported_hmap_can_be_imported_again(self):
        for name, path in real_maps().items():
            with self.subTest(map=name):
                self.site.json("import", path, "--map", name)
                exported = self.export(name, "hmap")
                answer = self.site.json("import", exported, "--map", f"{name}.again")
                self.assertEqual(answer["repairs"], [])
                self.assertEqual(self.content(f"{name}.again"), self.content(name))

    def test_an_exported_hmap_is_what_the_original_reads(self):
        for name, path in real_maps().items():
            with self.subTest(map=name):
                self.site.json("import", path, "--map", name)
                exported = self.export(name, "hmap")
                self.check_members(exported)
                self.check_same_content(hmap_reader.read(path), hmap_reader.read(exported))

    def check_members(self, path):
        archive = zipfile.ZipFile(path)
        self.assertIsNone(archive.testzip())
        config = yaml.safe_load(archive.read("hmap_config.yaml"))
        members = {"hmap_config.yaml"}
        for layer in config["layers"]:
            self.assertLessEqual({"class", "name", "frame_id", "load_file", "file"}, set(layer))
            members.add(layer["file"] if layer["class"] == "SemanticLayer"
                        else layer["file"] + ".yaml")
            if layer["class"] == "OccupancyGridLayer":
                about = yaml.safe_load(archive.read(layer["file"] + ".yaml"))
                self.assertLessEqual({"image", "resolution", "origin", "negate", "occupied_thresh",
                                      "free_thresh", "mode"}, set(about))
                self.assertEqual((about["mode"], about["occupied_thresh"], about["free_thresh"],
                                  about["negate"]), ("scale", 1, 0, 0))
                members.add(about["image"])
        self.assertEqual(set(archive.namelist()), members)
        self.assertTrue(all("/" not in m for m in members))

    def check_same_content(self, first, second):
        self.assertEqual(set(first), set(second))
        for name, layer in first.items():
            if isinstance(layer, hmap_reader.Grid):
                self.assertEqual((layer.origin, layer.resolution),
                                 (second[name].origin, second[name].resolution))
                numpy.testing.assert_array_equal(layer.values, second[name].values)
            else:
                parts = hmap_reader.distinct_parts(layer.objects)
                again = [(o.label, o.shape) for o in second[name].objects]
                self.assertEqual([label for label, _ in parts], [label for label, _ in again])
                for (_, a), (_, b) in zip(parts, again):
                    self.assertTrue(hmap_reader.same_shape(a, b), (a.wkt, b.wkt))

    def test_an_exported_geojson_can_be_imported_again(self):
        for name, path in real_maps().items():
            with self.subTest(map=name):
                self.site.json("import", path, "--map", name)
                content = [c for c in self.content(name) if c[0] == "semantic" and c[1]]
                if content:
                    exported = self.export(name, "geojson")
                    self.site.json("import", exported, "--map", f"{name}.again",
                                   "--layer", "semantic")
                    self.assertEqual(self.content(f"{name}.again"), content)

    def test_an_exported_nav2_map_can_be_imported_again(self):
        for name, path in real_maps().items():
            for image in ("pgm", "png"):
                with self.subTest(map=name, image=image):
                    if image == "pgm":
                        self.site.json("import", path, "--map", name)
                    folder = self.folder / f"{name}.{image}"
                    folder.mkdir()
                    written = self.site.json("export", name, "--format", "nav2", "--image", image,
                                             "-o", folder / "map.yaml")
                    self.assertEqual(len(written["files"]), 2, written)
                    self.site.json("import", folder / "map.yaml", "--map", f"{name}.{image}",
                                   "--layer", "occupancy")
                    self.assertEqual(self.content(f"{name}.{image}"),
                                     [c for c in self.content(name) if c[0] == "occupancy"])

    def test_ogr_reads_the_objects_of_a_stored_map(self):
        for name, path in real_maps().items():
            with self.subTest(map=name):
                self.site.json("import", path, "--map", name)
                exported = json.loads(self.export(name, "geojson").read_text())
                oracle = Oracle(path, exported)
                for layer, objects in oracle.polygons.items():
                    listed = run("ogrinfo", "-al", self.data_dir / f"{name}.gpkg", layer)
                    self.assertIn(f"Feature Count: {len(objects)}", listed)
                    for _, label, _ in objects:
                        self.assertIn(label, listed)

    def test_gdal_reads_the_grid_of_a_stored_map(self):
        for name, path in real_maps().items():
            with self.subTest(map=name):
                self.site.json("import", path, "--map", name)
                for layer in hmap_reader.read(path).values():
                    if isinstance(layer, hmap_reader.Grid) and layer.origin[2] == 0:
                        self.check_raster(self.data_dir / f"{name}.gpkg", layer)

    def check_raster(self, gpkg, grid):
        source = f"GPKG:{gpkg}:{grid.name}"
        about = json.loads(run("gdalinfo", "-json", source))
        rows, cols = grid.values.shape
        left, width, _, top, _, height = about["geoTransform"]
        self.assertAlmostEqual(width, grid.resolution, 9)
        self.assertAlmostEqual(height, -grid.resolution, 9)
        # The extent may be rounded up to whole tiles, but must begin where the grid does.
        self.assertAlmostEqual((grid.origin[0] - left) / width % 1, 0, 6)
        copy = self.folder / "raster.tif"
        run("gdal_translate", "-q", "-projwin", grid.origin[0],
            grid.origin[1] + rows * grid.resolution, grid.origin[0] + cols * grid.resolution,
            grid.origin[1], source, copy)
        from osgeo import gdal  # Imported here because the other tests do not need GDAL.
        raster = gdal.Open(str(copy))
        band = raster.GetRasterBand(1)
        values = band.ReadAsArray().astype(float)[::-1]
        self.assertEqual(values.shape, grid.values.shape)
        scale, offset, nothing = band.GetScale() or 1.0, band.GetOffset() or 0.0, \
            band.GetNoDataValue()
        values = numpy.where(values == nothing, numpy.nan, values * scale + offset)
        numpy.testing.assert_allclose(values, grid.values, rtol=0, atol=1e-6)

    def test_stored_maps_are_valid_geopackages(self):
        for name, path in real_maps().items():
            with self.subTest(map=name):
                self.site.json("import", path, "--map", name)
                run(sys.executable, "-m", "osgeo_utils.samples.validate_gpkg",
                    self.data_dir / f"{name}.gpkg")
                self.assertEqual(run("sqlite3", f"file:{self.data_dir}/{name}.gpkg?mode=ro",
                                     "PRAGMA integrity_check").strip(), "ok")


class OwnMaps(ExchangeTest):

    def test_a_stored_map_stays_valid_through_edits(self):
        with rpc.Client(self.site.address) as client:
            sites.make(client)
            ids = client.ApplyEdits(map="site", edits=[
                sites.put("chair", x, 0, tags=["a", "b"], existence=0.5) for x in range(20)
            ]).object_ids
            client.ApplyEdits(map="site", edits=[
                {"delete_object": {"layer": "things", "id": ids[3]}},
                sites.write_cells([[0.1, "NaN"], [1, 0.5]], row=-300, col=700)])
        path = self.data_dir / "site.gpkg"
        run(sys.executable, "-m", "osgeo_utils.samples.validate_gpkg", path)
        self.assertIn("Feature Count: 19", run("ogrinfo", "-al", path, "things"))

    def test_a_backup_has_the_content_of_the_map(self):
        with rpc.Client(self.site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", edits=[sites.put("chair", 1, 1)])
        content = self.content("site")
        self.site.json("backup", "site", "-o", self.folder / "copy.gpkg")
        run(sys.executable, "-m", "osgeo_utils.samples.validate_gpkg", self.folder / "copy.gpkg")
        self.assertEqual(self.site.stop(), 0)
        (self.data_dir / "site.gpkg").unlink()
        shutil.copy(self.folder / "copy.gpkg", self.data_dir / "site.gpkg")
        self.site = self.server()
        self.assertEqual(self.content("site"), content)

    def test_an_object_without_an_area_is_left_out_and_reported(self):
        path = self.folder / "thin.hmap"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("hmap_config.yaml", "layers:\n- {class: SemanticLayer, name: semantic, "
                             "frame_id: map, load_file: true, file: semantic}\n")
            archive.writestr("semantic", "- {name: line, shape: 'POLYGON((0 0,1 1))'}\n"
                             "- {name: cup, shape: 'POLYGON((0 0,1 0,1 1,0 0))'}\n")
        answer = self.site.json("import", path, "--map", "thin")
        self.assertTrue(any("line" in r and "left out" in r for r in answer["repairs"]), answer)
        with rpc.Client(self.site.address) as client:
            self.assertEqual(list(sites.labels(client, "thin", "semantic").values()), ["cup"])

    def test_a_ring_that_repeats_its_hull_is_repaired_and_reported(self):
        path = self.folder / "odd.hmap"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("hmap_config.yaml", "layers:\n- {class: SemanticLayer, name: semantic, "
                             "frame_id: map, load_file: true, file: semantic}\n")
            archive.writestr("semantic", "\n".join([
                "- {name: hull, shape: 'POLYGON((0 0,2 0,2 2,0 2,0 0,2 0,2 2,0 2))'}",
                "- {name: wedge, shape: 'POLYGON((5 0,6 0 6 1))'}",
                "- {name: star, shape: 'POLYGON((0 14,1.2 10.4,-1.9 12.6,1.9 12.6,-1.2 10.4))'}",
                "- {name: pair, shape: 'POLYGON((20 0,22 2,22 0,20 2))'}"]))
        answer = self.site.json("import", path, "--map", "odd")
        self.assertGreaterEqual(len(answer["repairs"]), 4)
        exported = json.loads(self.export("odd", "geojson").read_text())
        oracle = Oracle(path, exported)  # Fails if the shapes differ from Shapely's.
        areas = {}
        for f in exported["features"]:
            label, shape = f["properties"]["label"], shapely.geometry.shape(f["geometry"])
            areas[label] = areas.get(label, 0) + shape.area
        self.assertAlmostEqual(areas["hull"], 4)
        self.assertAlmostEqual(areas["wedge"], 0.5)
        self.assertAlmostEqual(areas["pair"], 2)
        questions = Questions(oracle, SEED)
        with rpc.Client(self.site.address) as client:
            for _ in range(50):
                area = questions.area()
                answer = client.QueryArea(scope=rpc.scope("odd"), area=rpc.polygon(area))
                got = answers.from_messages(answer, {})
                self.assertEqual(answers.differences(got, oracle.content(area)), [], area.wkt)


if __name__ == "__main__":
    unittest.main()

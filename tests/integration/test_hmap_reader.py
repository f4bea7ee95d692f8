"""Tests of hmap_reader, with small files whose content is obvious."""

import io
import math
import struct
import tempfile
import unittest
import zipfile
import zlib

import numpy
import shapely.geometry

import hmap_reader


def png(rows, colour, filters):
    """Encodes a PNG. `rows` has the samples of each line, `filters` the filter of each line."""
    channels = {0: 1, 4: 2}[colour]
    packed = b""
    for y, (row, kind) in enumerate(zip(rows, filters)):
        packed += bytes([kind])
        for x, sample in enumerate(row):
            left = row[x - channels] if x >= channels else 0
            up = rows[y - 1][x] if y else 0
            corner = rows[y - 1][x - channels] if y and x >= channels else 0
            p = left + up - corner
            paeth = sorted((left, up, corner), key=lambda v: abs(p - v))[0]
            guess = [0, left, up, (left + up) // 2, paeth][kind]
            packed += bytes([(sample - guess) % 256])
    head = struct.pack(">IIBBBBB", len(rows[0]) // channels, len(rows), 8, colour, 0, 0, 0)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(packed)) +
            chunk(b"IEND", b""))


class ReadPng(unittest.TestCase):

    def test_all_png_filters_are_decoded(self):
        rows = [[(7 * x + 31 * y * y) % 256 for x in range(6)] for y in range(5)]
        grey, alpha = hmap_reader.read_png(png(rows, 0, [0, 1, 2, 3, 4]))
        self.assertEqual(grey.tolist(), rows)
        self.assertTrue((alpha == 255).all())

    def test_alpha_is_read_separately(self):
        grey, alpha = hmap_reader.read_png(png([[10, 255, 127, 0]], 4, [1]))
        self.assertEqual((grey.tolist(), alpha.tolist()), ([[10, 127]], [[255, 0]]))


class ReadShape(unittest.TestCase):

    def test_a_missing_comma_is_tolerated(self):
        shape = hmap_reader.read_shape("POLYGON((0 0, 2 0 2 1, 0 1))")
        self.assertTrue(shape.equals(shapely.geometry.box(0, 0, 2, 1)))

    def test_a_ring_that_repeats_its_hull_is_the_hull(self):
        shape = hmap_reader.read_shape("POLYGON((0 0,2 0,2 2,0 2,0 0,2 0,2 2,0 2,0 0))")
        self.assertTrue(shape.equals(shapely.geometry.box(0, 0, 2, 2)))

    def test_a_star_is_filled_but_opposite_windings_cancel(self):
        star = [(math.sin(4 * math.pi * i / 5), math.cos(4 * math.pi * i / 5)) for i in range(5)]
        shape = hmap_reader.fill_non_zero(star)
        self.assertTrue(shape.covers(shapely.geometry.Point(0, 0)))
        bow_tie = hmap_reader.fill_non_zero([(0, 0), (2, 2), (2, 0), (0, 2)])
        self.assertAlmostEqual(bow_tie.area, 2.0)


class ReadMap(unittest.TestCase):

    def test_rows_count_from_below_and_thresholds_are_strict(self):
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w") as z:
            z.writestr("hmap_config.yaml", "layers:\n- {class: OccupancyGridLayer, name: grid, "
                       "frame_id: map, load_file: true, file: g}\n")
            z.writestr("g.yaml", "image: g.png\nresolution: 0.5\norigin: [1, 2, 0]\nnegate: 0\n"
                       "occupied_thresh: 0.6\nfree_thresh: 0.2\n")
            z.writestr("g.png", png([[0, 102], [204, 255]], 0, [0, 0]))
        with tempfile.NamedTemporaryFile() as file:
            file.write(archive.getvalue())
            file.flush()
            grid = hmap_reader.read(file.name)["grid"]
        # The values (255 - 102) / 255 = 0.6 and (255 - 204) / 255 = 0.2 equal the thresholds, so
        # they do not exceed them.
        numpy.testing.assert_array_equal(grid.values, [[numpy.nan, 0], [1, numpy.nan]])
        x, y = grid.centres()
        self.assertEqual((x.tolist(), y.tolist()), ([[1.25, 1.75]] * 2, [[2.25] * 2, [2.75] * 2]))


if __name__ == "__main__":
    unittest.main()

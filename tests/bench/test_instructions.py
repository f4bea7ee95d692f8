"""Fails when a hot path executes more instructions than its bound, or when the instructions of an
operation grow faster than its input.

Unlike run time, instruction counts do not depend on the load of the machine. Callgrind counts the
instructions that `hot_paths PATH` executes in its function hot_path. The bounds leave room for
other compilers and libraries. A commit that makes a path cheaper lowers its bound; a commit that
raises a bound gives the reason.

For growth, `growth OPERATION SIZE` runs an operation once on an input of SIZE and on one of four
times SIZE. An operation is added in growth.cc and in GROWTH.
"""

import os
import re
import subprocess
import tempfile
import unittest

# Maximum number of instructions for one query of the path; for "points", for a batch of 256.
BOUNDS = {
    "point": 1_200,
    "points": 160_000,
    "area": 14_000,
    "cells": 54_000,
    "value": 7_500,
    "nearest": 18_500,
    "change": 30_000,
}

# Size of the smaller input of each operation. It is so large that the growth shows.
GROWTH = {
    "polygon_with_holes": 2_000,
    "polygon_with_overlapping_holes": 2_000,
    "polygon_of_slanted_teeth": 4_000,
    "polygon_of_nested_holes": 2_000,
    "chains_of_frames": 1_024,
    "moving_frame": 1_000,
    "layers_at_a_point": 1_000,
    "layers_in_an_area": 1_000,
    "new_objects": 2_000,
    "replaced_objects": 2_000,
    "aliases_in_one_edit": 2_000,
    "aliases_one_by_one": 2_000,
}
# Maximum ratio of the instructions for an input of four times the size. O(n log n) is below 5, and
# O(n^2) is 16.
MAX_GROWTH = 6


def count(program, *arguments):
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "callgrind.out")
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", "--collect-atstart=no", "--toggle-collect=hot_path",
             f"--callgrind-out-file={out}", os.environ[program], *arguments],
            capture_output=True, text=True, check=True)
        with open(out) as lines:
            total = re.search(r"^(?:summary|totals): (\d+)", lines.read(), re.MULTILINE)
    return int(total.group(1)) / int(run.stdout)


class InstructionsTest(unittest.TestCase):
    def test_hot_paths_stay_within_their_bounds(self):
        for path, bound in BOUNDS.items():
            with self.subTest(path):
                counted = count("HYPERMAP_HOT_PATHS", path)
                print(f"{path}: {counted:.0f} instructions, bound {bound}", flush=True)
                self.assertGreater(counted, 0)
                self.assertLessEqual(counted, bound)

    def test_a4_operations_grow_with_their_input(self):
        for operation, size in GROWTH.items():
            with self.subTest(operation):
                small = count("HYPERMAP_GROWTH", operation, str(size))
                large = count("HYPERMAP_GROWTH", operation, str(4 * size))
                print(f"{operation}: {small:.0f} instructions for {size}, "
                      f"{large / small:.1f} times as many for {4 * size}", flush=True)
                self.assertGreater(small, 0)
                self.assertLessEqual(large / small, MAX_GROWTH)


if __name__ == "__main__":
    unittest.main()

"""Fails when a hot path executes more instructions than its bound.

Unlike run time, instruction counts do not depend on the load of the machine. Callgrind counts the
instructions that `hot_paths PATH` executes in its function hot_path. The bounds leave room for
other compilers and libraries. A commit that makes a path cheaper lowers its bound; a commit that
raises a bound gives the reason.
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


def count(path):
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "callgrind.out")
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", "--collect-atstart=no", "--toggle-collect=hot_path",
             f"--callgrind-out-file={out}", os.environ["HYPERMAP_HOT_PATHS"], path],
            capture_output=True, text=True, check=True)
        with open(out) as lines:
            total = re.search(r"^(?:summary|totals): (\d+)", lines.read(), re.MULTILINE)
    return int(total.group(1)) / int(run.stdout)


class InstructionsTest(unittest.TestCase):
    def test_hot_paths_stay_within_their_bounds(self):
        for path, bound in BOUNDS.items():
            with self.subTest(path):
                counted = count(path)
                print(f"{path}: {counted:.0f} instructions, bound {bound}", flush=True)
                self.assertGreater(counted, 0)
                self.assertLessEqual(counted, bound)


if __name__ == "__main__":
    unittest.main()

"""docs/limits.md has a row for each rpc, and the flags that bound it exist."""

import re
import subprocess
import unittest

import rpc
from processes import BIN, DEADLINE_S, ROOT

# `| Rpc | holds at most | bounded by |`
ROW = re.compile(r"^\| ([A-Z]\w+) \| (.+) \| (.+) \|$", re.MULTILINE)
# FrameService is served by hypermap-ingest.
OF_OTHER_SERVERS = {"StreamFrames"}


class Limits(unittest.TestCase):

    def setUp(self):
        self.rows = ROW.findall((ROOT / "docs" / "limits.md").read_text())

    def test_each_rpc_has_one_row(self):
        rpcs = {method.name for _, _, method in rpc.methods()} - OF_OTHER_SERVERS
        self.assertEqual(sorted(row[0] for row in self.rows), sorted(rpcs))

    def test_the_flags_that_bound_them_exist(self):
        shown = subprocess.run([BIN / "hypermapd", "--helpfull"], capture_output=True, text=True,
                               timeout=DEADLINE_S, check=False)
        flags = set(re.findall(r"--(\w+) \(", shown.stdout + shown.stderr))
        for name, _, bounds in self.rows:
            with self.subTest(name):
                for flag in re.findall(r"`--(\w+)`", bounds):
                    self.assertIn(flag, flags)

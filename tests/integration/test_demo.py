"""The demo runs from start to end, and stops the processes that it has started."""

import os
import pathlib
import re
import shlex
import subprocess
import textwrap
import unittest

from processes import BIN, DEADLINE_S, IS_SANITIZED, ROOT, SiteTest


def examples_of_readme():
    """Returns the README's commands that name a revision, each with the answer that it prints."""
    commands = r"^    \$ build/bin/hypermap (.* --at \d+)\n((?:    [^$\n].*\n)+)"
    return re.findall(commands, (ROOT / "README.md").read_text(), re.MULTILINE)


def without_margins(text):
    return [line.rstrip() for line in textwrap.dedent(text).splitlines()]


class Demo(SiteTest):

    def test_the_tour_asks_all_questions_and_ends(self):
        build = self.folder / "build"  # Not build/: `make demo` may be running.
        build.mkdir()
        (build / "bin").symlink_to(BIN)
        environment = os.environ | {"BUILD_DIR": str(build)}
        if IS_SANITIZED:  # One room only, because instrumented programs are slow.
            environment["DEMO_AREA"] = "0.2,0.2 5,0.2 5,5.1 0.2,5.1"
        result = subprocess.run([ROOT / "demo" / "run.sh", "--exit"], capture_output=True,
                                text=True, timeout=12 * DEADLINE_S, check=False,
                                env=environment, stdin=subprocess.DEVNULL)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        for question in ("query point", "query area", "query value", "query nearest"):
            self.assertIn(question, result.stdout)
        if (BIN / "hypermap-ingest").exists():
            self.assertIn("eval rooms", result.stdout)
            self.assertRegex(result.stdout, r"\nPQ +0\.[1-9]")
            self.assertTrue((build / "demo" / "rooms.png").exists())
            self.assertIn("explore status office", result.stdout)
            self.assertRegex(result.stdout, r"office: \d+ steps .* ended: ")
            if not IS_SANITIZED:
                self.assertRegex(result.stdout, r"\nrecall +1  65 of 65 true objects")
                self.assertRegex(result.stdout, r"\nprecision +1  65 of 65 map objects")
            self.assertTrue((build / "demo" / "explored.png").exists())
        self.assertEqual(self.servers_on(build), [])
        self.check_examples(build / "demo" / "maps")

    def check_examples(self, maps):
        """The README's examples ask the office of the demo."""
        server = self.server(data_dir=maps)
        examples = examples_of_readme()
        self.assertGreaterEqual(len(examples), 3)
        for command, answer in examples:
            with self.subTest(command):
                told = server.cli(*shlex.split(command))
                self.assertEqual(without_margins(told.stdout), without_margins(answer), told.stderr)

    @staticmethod
    def servers_on(folder):
        """Returns the command lines of running processes that contain the path of the folder."""
        lines = []
        for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
            try:
                line = path.read_bytes().decode(errors="replace")
            except OSError:  # The process has ended.
                continue
            if str(folder) in line:
                lines.append(line)
        return lines


if __name__ == "__main__":
    unittest.main()

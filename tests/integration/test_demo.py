"""The demo runs from start to end, and stops the processes that it has started."""

import os
import pathlib
import re
import shlex
import subprocess
import textwrap
import unittest

from processes import BIN, DEADLINE_S, IS_SANITIZED, ROOT, SiteTest

# Parts of the office. Robots explore the whole office for two minutes, and much longer if their
# programs are instrumented.
WEST_SIDE = "0.2,0.2 5,0.2 5,11.8 0.2,11.8"
ROOM = "0.2,0.2 5,0.2 5,5.1 0.2,5.1"
# In CI and in `make nightly` the robots explore the whole office, as in `make demo`.
IS_WHOLE = bool({"CI", "HYPERMAP_TEST_WHOLE_DEMO"} & set(os.environ))


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
        if IS_SANITIZED:
            environment["DEMO_AREA"] = ROOM
        elif not IS_WHOLE:
            environment["DEMO_AREA"] = WEST_SIDE
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
            if "DEMO_AREA" not in environment:
                self.assertRegex(result.stdout, r"\nrecall +1  65 of 65 true objects")
                self.assertRegex(result.stdout, r"\nprecision +1  65 of 65 map objects")
            elif not IS_SANITIZED:
                self.assertRegex(result.stdout, r"\nrecall +0\.3\d*  2\d of 65 true objects")
                self.assertRegex(result.stdout, r"\nprecision +(1|0\.9\d*)  ")
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

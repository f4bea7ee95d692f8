"""Man pages and completions have every command and flag, and the version is in one place."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("HYPERMAP_BIN", ROOT / "build" / "bin"))
VERSION = (ROOT / "VERSION").read_text().strip()
MAKER = ROOT / "packaging" / "make_documents.py"


class Documents(unittest.TestCase):

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def make(self, name):
        subprocess.run([sys.executable, "-B", MAKER, self.folder, VERSION, BIN / name,
                        ROOT / "packaging" / "man" / f"{name}.roff"], check=True, timeout=60)

    def page(self, name, section):
        self.make(name)
        return (self.folder / "man" / f"{name}.{section}").read_text().replace("\\-", "-")

    def complete(self, *words):
        """Returns what bash offers for the last word."""
        script = (f"source {self.folder}/completions/hypermap.bash\n"
                  'COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _hypermap 2>/dev/null\n'
                  'printf "%s\\n" "${COMPREPLY[@]}"')
        done = subprocess.run(["bash", "-c", script, "bash", *words], capture_output=True, text=True,
                              cwd=self.folder, check=True, timeout=60)
        return done.stdout.split()

    def test_the_page_of_the_server_has_every_flag(self):
        page = self.page("hypermapd", 8)
        text = subprocess.run([BIN / "hypermapd", "--help"], capture_output=True, text=True,
                              check=False, timeout=60).stdout
        flags = re.findall(r"^    --(\w+) \(", text, re.MULTILINE)
        self.assertGreater(len(flags), 40)
        for flag in flags:
            self.assertIn(f"\\fB--{flag}\\fR", page)

    def test_the_page_of_the_command_has_every_command(self):
        page = self.page("hypermap", 1)
        table = json.loads(subprocess.run([BIN / "hypermap", "--command_table"], check=True,
                                          capture_output=True, text=True, timeout=60).stdout)
        for command in table["commands"]:
            self.assertIn(f".SS {command['name']}", page)

    @unittest.skipUnless((BIN / "hypermap-gateway").exists(), "the gateway is not built")
    def test_the_page_of_the_gateway_has_every_flag(self):
        page = self.page("hypermap-gateway", 8)
        text = subprocess.run([BIN / "hypermap-gateway", "--help"], capture_output=True, text=True,
                              check=False, timeout=60).stderr
        flags = re.findall(r"^  -(\w+)", text, re.MULTILINE)
        self.assertGreater(len(flags), 10)
        for flag in flags:
            self.assertIn(f"\\fB--{flag}\\fR", page)

    @unittest.skipUnless((BIN / "hypermap-ros2").exists(), "hypermap-ros2 is not built")
    def test_the_page_of_hypermap_ros2_has_every_option(self):
        page = self.page("hypermap-ros2", 8)
        self.assertTrue(page.startswith(".TH HYPERMAP-ROS2 8 "))
        text = subprocess.run([BIN / "hypermap-ros2", "--help"], check=True, capture_output=True,
                              text=True, timeout=60).stdout
        options = re.findall(r"^  (?:-\w,)?(--\w+)", text, re.MULTILINE)
        self.assertGreater(len(options), 10)
        for option in options:
            self.assertIn(f"{option}\\fR", page)

    @unittest.skipUnless(shutil.which("man"), "needs man")
    def test_pages_are_valid(self):
        self.make("hypermap")
        done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z",
                               self.folder / "man" / "hypermap.1"], capture_output=True, text=True,
                              check=False, timeout=60)
        self.assertEqual(done.stderr, "")

    def test_bash_completes_commands_options_and_files(self):
        self.make("hypermap")
        (self.folder / "token.txt").touch()
        self.assertEqual(self.complete("hypermap", "map", "cre"), ["create"])
        self.assertIn("--tolerance", self.complete("hypermap", "query", "point", "--tol"))
        self.assertEqual(self.complete("hypermap", "--json", "token", "rev"), ["revoke"])
        self.assertEqual(self.complete("hypermap", "--token_file", "tok"), ["token.txt"])

    @unittest.skipUnless(shutil.which("zsh"), "needs zsh")
    def test_zsh_reads_its_completions(self):
        self.make("hypermap")
        subprocess.run(["zsh", "-n", self.folder / "completions" / "_hypermap"], check=True,
                       timeout=60)


class Version(unittest.TestCase):

    def test_programs_tell_it(self):
        for name in ("hypermapd", "hypermap", "hypermap-ingest", "hypermap-gateway",
                     "hypermap-ros2"):
            if (BIN / name).exists():
                done = subprocess.run([BIN / name, "--version"], capture_output=True, text=True,
                                      check=False, timeout=60)
                self.assertEqual(done.stdout.strip(), f"{name} {VERSION}")

    def test_the_changelog_begins_with_it(self):
        newest = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[1]
        self.assertEqual(newest, VERSION)

    def test_it_is_nowhere_else(self):
        for package in ("client", "dashboard", "e2e"):
            described = json.loads((ROOT / "client_libs/web" / package / "package.json").read_text())
            self.assertEqual(described["version"], "0.0.0")
        self.assertIn('dynamic = ["version"]',
                      (ROOT / "client_libs/python/pyproject.toml").read_text())


if __name__ == "__main__":
    unittest.main()

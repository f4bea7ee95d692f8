"""The commands of docs/operations.md work, in the order in which the page has them.

All blocks of commands run in one shell, with the folders of a system replaced by folders of the test. A line
`#> TEXT` in a block says what its output contains. Comments `<!-- sh … -->` are run, too: they cause what the page
tells how to mend.
"""

import os
import re
import shutil
import subprocess
import unittest

from processes import BIN, DEADLINE_S, ROOT, SiteTest, lasting_port

PAGE = ROOT / "docs" / "operations.md"
TOOLS = ("curl", "openssl", "sqlite3")
FOLDERS = ("/etc/hypermap", "/var/lib/hypermap", "/var/backups/hypermap")

# What systemd does for the server, and commands that only root may use.
PRELUDE = r"""
set -euo pipefail
server=
systemctl() {
  case $1 in
    stop | restart)
      if [[ -n $server ]]; then
        kill -TERM "$server"
        wait "$server"
        server=
      fi ;;&
    start | restart)
      : >"$SCRATCH/ready"  # The line of the server before is no sign of this one.
      hypermapd --config=/etc/hypermap/hypermapd.yaml >"$SCRATCH/ready" 2>>"$SCRATCH/journal" </dev/null &
      server=$!
      until grep -q '^hypermapd ready on ' "$SCRATCH/ready"; do
        kill -0 "$server" || { cat "$SCRATCH/journal"; return 1; }
        sleep 0.05
      done ;;
  esac
}
journalctl() { cat "$SCRATCH/journal"; }
chown() { :; }
chgrp() { :; }
trap '[[ -z $server ]] || kill -KILL "$server"' EXIT
"""


def blocks(text):
    """Returns the commands of each block in the order of the page, with the line where it begins."""
    found = re.finditer(r"^```sh\n(.*?)^```$|^<!-- sh\n(.*?)^-->$", text, re.MULTILINE | re.DOTALL)
    return [(text.count("\n", 0, match.start()) + 1, match[1] or match[2]) for match in found]


class OperationsDoc(SiteTest):

    def in_scratch(self, text, ports):
        for folder in FOLDERS:
            text = text.replace(folder, f"{self.folder}{folder}")
        for port, free in ports.items():
            text = re.sub(rf"\b{port}\b", str(free), text)
        return text

    @unittest.skipUnless(all(map(shutil.which, TOOLS)), f"needs {', '.join(TOOLS)}")
    def test_the_commands_work_in_their_order(self):
        ports = {50051: lasting_port(), 9464: lasting_port()}
        for folder in FOLDERS:
            (self.folder / folder[1:]).mkdir(parents=True)
        (self.folder / "home").mkdir()
        config = (ROOT / "packaging" / "hypermapd.yaml").read_text()
        (self.folder / "etc/hypermap/hypermapd.yaml").write_text(self.in_scratch(config, ports))

        found = blocks(PAGE.read_text())
        self.assertGreater(len(found), 10)
        # Only whole blocks are marked, so that the output of each can be told from the others'.
        script = PRELUDE + "".join(f"echo '@@ {line}'\n{commands}\n" for line, commands in found)
        environment = os.environ | {
            "HOME": str(self.folder / "home"), "PATH": f"{BIN}:{os.environ['PATH']}",
            "SCRATCH": str(self.folder), "LC_ALL": "C.UTF-8",
            "HYPERMAP_ACCESS_FILE": f"{self.folder}/etc/hypermap/access.yaml",
            "HYPERMAP_SERVER": f"127.0.0.1:{ports[50051]}"}
        for name in ("HYPERMAP_TOKEN", "HYPERMAP_TOKEN_FILE"):
            environment.pop(name, None)
        path = self.folder / "commands.sh"
        path.write_text(self.in_scratch(script, ports))
        # A file, because a pipe would stay open if a program were left running.
        with (self.folder / "output").open("w+") as output:
            done = subprocess.run(["bash", path], stdin=subprocess.DEVNULL, stdout=output,
                                  stderr=subprocess.STDOUT, env=environment, check=False,
                                  start_new_session=True, timeout=2 * DEADLINE_S)
            output.seek(0)
            text = output.read()
        outputs = dict(re.findall(r"^@@ (\d+)\n(.*?)(?=^@@ |\Z)", text, re.MULTILINE | re.DOTALL))
        for line, commands in found:
            with self.subTest(line=line):
                self.assertIn(str(line), outputs, f"not reached: {text[-2000:]}")
                for wanted in re.findall(r"^#> (.*)$", commands, re.MULTILINE):
                    self.assertIn(wanted, outputs[str(line)], commands)
        self.assertEqual(done.returncode, 0, text[-2000:])

    def test_links_lead_to_sections(self):
        text = PAGE.read_text()
        sections = {re.sub(r"[^a-z0-9 -]", "", title.lower()).replace(" ", "-")
                    for title in re.findall(r"^## (.*)$", text, re.MULTILINE)}
        for target in re.findall(r"\]\(#([^)]*)\)", text):
            self.assertIn(target, sections)

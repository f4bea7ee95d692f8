"""A3: the log of a map of version 0.1 that has authors which are no UTF-8 is read by all clients.

The clients in Python and TypeScript read the same file in client_libs/python/tests/test_authors.py
and client_libs/web/client/src/authors.test.ts.
"""

import contextlib
import json
import lzma
import pathlib
import sqlite3
import subprocess
import urllib.request

import rpc
from processes import BIN, DEADLINE_S, SiteTest

FILE = pathlib.Path(__file__).resolve().parent / "testdata" / "v0_1" / "authors.gpkg.xz"
MAP = "authors"
HONEST = "an honest name"
REPLACEMENT = "\N{REPLACEMENT CHARACTER}"


class Authors(SiteTest):

    def setUp(self):
        super().setUp()
        self.file = self.data_dir / f"{MAP}.gpkg"
        self.file.write_bytes(lzma.decompress(FILE.read_bytes()))
        self.site = self.start()

    def start(self):
        return self.server("--history_age=876000h", "--history_revisions=1000000000")

    def check(self, authors, cut="é" * 64):
        """Checks the authors of the last three revisions in order: two bytes that are no UTF-8, a
        name that version 0.1 cut to 128 bytes, and an honest one."""
        self.assertEqual(list(authors[-3:]), [REPLACEMENT * 2, cut, HONEST])

    def read(self):
        """Returns the authors in the list of revisions, and those that a watch reports."""
        with rpc.Client(self.site.address) as client:
            log = client.ListRevisions(map=MAP)
            watched = []
            for answer in client.Watch(scope=rpc.scope(MAP), start_revision=0):
                watched.append(answer.author)
                if answer.revision == log.newest_revision and not answer.more:
                    break
            return [r.author for r in log.revisions], watched

    def test_a3_grpc_clients_list_revisions_and_watch(self):
        listed, watched = self.read()
        self.check(listed)
        self.assertEqual(watched, listed)

    def test_a3_a_name_that_was_cut_within_a_character(self):
        # Version 0.1 cut the name in the file between two characters, so a byte is taken off it.
        self.assertEqual(self.site.stop(), 0)
        with contextlib.closing(sqlite3.connect(self.file)) as database, database:
            changed = database.execute(
                "UPDATE hypermap_revisions SET author = CAST(CAST(? AS BLOB) AS TEXT) "
                "WHERE author = ?", ("é".encode() * 63 + b"\xc3", "é" * 64))
            self.assertEqual(changed.rowcount, 1)
            # Otherwise the server takes the change for damage.
            database.execute("UPDATE hypermap_metadata SET foreign_writes = 1")
        self.site = self.start()
        listed, watched = self.read()
        self.check(listed, cut="é" * 63 + REPLACEMENT)
        self.assertEqual(watched, listed)

    def test_a3_the_command_line_prints_the_log(self):
        (log,) = [json.loads(line) for line in self.site.cli("--json", "log", MAP).stdout.splitlines()]
        self.check([entry["author"] for entry in reversed(log["revisions"])])

    def test_a3_the_gateway_gives_the_log_as_json(self):
        gateway = BIN / "hypermap-gateway"
        if not gateway.exists():
            self.skipTest("the gateway is not built")
        process = self.enterContext(subprocess.Popen(
            [gateway, "--server", self.site.address, "--listen", "127.0.0.1:0"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True))
        self.addCleanup(process.kill)
        address = process.stdout.readline().split()[-1].removeprefix("http://").rstrip("/")
        request = urllib.request.Request(
            f"http://{address}/hypermap.v1.WatchService/ListRevisions",
            data=json.dumps({"map": MAP}).encode(), headers={"Content-Type": "application/json"})
        with urllib.request.urlopen(request, timeout=DEADLINE_S) as answer:
            self.check([r["author"] for r in json.load(answer)["revisions"]])

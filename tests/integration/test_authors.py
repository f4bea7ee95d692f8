"""A3: the log of a map of version 0.1 that has authors which are no UTF-8 is read by all clients."""

import json
import lzma
import pathlib
import subprocess
import urllib.request

import rpc
from processes import BIN, DEADLINE_S, SiteTest

FILE = pathlib.Path(__file__).resolve().parent / "testdata" / "v0_1" / "authors.gpkg.xz"
MAP = "authors"
HONEST = "an honest name"


class Authors(SiteTest):

    def setUp(self):
        super().setUp()
        (self.data_dir / f"{MAP}.gpkg").write_bytes(lzma.decompress(FILE.read_bytes()))
        self.site = self.server("--history_age=876000h", "--history_revisions=1000000000")

    def check(self, authors):
        """Checks the authors of the last three revisions in order: names that were no UTF-8 have
        replacement characters."""
        broken, cut, honest = authors[-3:]
        self.assertIn("\N{REPLACEMENT CHARACTER}", broken)
        self.assertTrue(cut.startswith("éé"), cut)
        self.assertEqual(honest, HONEST)

    def test_a3_grpc_clients_list_revisions_and_watch(self):
        with rpc.Client(self.site.address) as client:
            log = client.ListRevisions(map=MAP)
            self.check([r.author for r in log.revisions])
            watched = []
            for answer in client.Watch(scope=rpc.scope(MAP), start_revision=0):
                watched.append(answer.author)
                if answer.revision == log.newest_revision and not answer.more:
                    break
            self.check(watched)

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

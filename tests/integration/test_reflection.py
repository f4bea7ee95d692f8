"""grpcurl can call the server and its health service without .proto files."""

import json
import os
import pathlib
import shutil
import subprocess
import unittest

import rpc
import sites
from processes import DEADLINE_S, SiteTest

GRPCURL = shutil.which("grpcurl", path=os.pathsep.join([
    str(pathlib.Path(os.environ.get("HYPERMAP_TOOLS", ""), "bin")), os.environ["PATH"]]))


@unittest.skipUnless(GRPCURL, "grpcurl is not installed")
class Reflection(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()

    def grpcurl(self, *arguments, request=None):
        options = [] if request is None else ["-d", json.dumps(request)]
        return subprocess.run([GRPCURL, "-plaintext", *options, f"localhost:{self.site.port}",
                               *arguments], capture_output=True, text=True, timeout=DEADLINE_S,
                              check=False)

    def test_services_are_listed(self):
        listed = self.grpcurl("list").stdout.split()
        for service in ("hypermap.v1.CatalogService", "hypermap.v1.QueryService",
                        "hypermap.v1.EditService", "hypermap.v1.IngestService",
                        "hypermap.v1.ExplorationService", "grpc.health.v1.Health"):
            self.assertIn(service, listed)

    def test_rpcs_are_described(self):
        described = self.grpcurl("describe", "hypermap.v1.QueryService").stdout
        self.assertIn("rpc QueryArea ( .hypermap.v1.QueryAreaRequest ) "
                      "returns ( stream .hypermap.v1.QueryAreaResponse )", described)

    def test_a_point_is_answered(self):
        with rpc.Client(self.site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", edits=[sites.put("cup", 1, 1)])
        answer = self.grpcurl("hypermap.v1.QueryService/QueryPoint",
                              request={"scope": {"map": "site"}, "point": {"x": 1.5, "y": 1.5}})
        self.assertEqual(answer.returncode, 0, answer.stderr)
        layers = {layer["layer"]: layer for layer in json.loads(answer.stdout)["layers"]}
        self.assertEqual(layers["things"]["objects"][0]["label"], "cup")
        self.assertEqual(layers["adrift"]["status"], "ANSWER_STATUS_NO_TRANSFORM")

    def test_a_point_that_is_not_finite_is_refused_by_name(self):
        with rpc.Client(self.site.address) as client:
            sites.make(client)
        for number in ("NaN", "Infinity", "-Infinity"):
            answer = self.grpcurl("hypermap.v1.QueryService/QueryPoint",
                                  request={"scope": {"map": "site"},
                                           "point": {"x": number, "y": 0}})
            self.assertIn("InvalidArgument", answer.stderr)
            self.assertIn("point", answer.stderr)

    def test_it_is_healthy(self):
        answer = self.grpcurl("grpc.health.v1.Health/Check", request={})
        self.assertEqual(json.loads(answer.stdout), {"status": "SERVING"})


if __name__ == "__main__":
    unittest.main()

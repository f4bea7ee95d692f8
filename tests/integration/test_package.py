"""The installed C++ client, as a program of somebody else finds it."""

import os
import pathlib
import re
import shutil
import subprocess
import unittest

from processes import BIN, ROOT, SiteTest

EXAMPLE = ROOT / "client_libs" / "cpp" / "example"


@unittest.skipIf("HYPERMAP_TEST_ROUNDS" in os.environ, "sanitized libraries ask for more")
class Package(SiteTest):

    def run_tool(self, *command):
        result = subprocess.run(list(map(str, command)), capture_output=True, text=True,
                                stdin=subprocess.DEVNULL, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return result.stdout

    def test_a_program_of_its_own_finds_builds_and_asks(self):
        prefix, source = self.folder / "prefix", self.folder / "whats_here"
        self.run_tool("cmake", "--install", BIN.parent, "--prefix", prefix)
        shutil.copytree(EXAMPLE, source)
        self.run_tool("cmake", "-S", source, "-B", source / "build",
                      f"-DCMAKE_PREFIX_PATH={prefix}")
        self.run_tool("cmake", "--build", source / "build")

        server = self.server()
        server.cli("map", "create", "site")
        server.cli("layer", "create", "site", "things", "--kind", "semantic")
        path = self.folder / "things.geojson"
        path.write_text('{"type": "FeatureCollection", "features": [{"type": "Feature", '
                        '"properties": {"label": "chair"}, "geometry": {"type": "Polygon", '
                        '"coordinates": [[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]]}}]}')
        self.assertEqual(server.cli("edit", "site", path, "--layer", "things").returncode, 0)
        program = source / "build" / "whats_here"
        self.assertEqual(self.run_tool(program, server.address, "site", 0.5, 0.5),
                         "things: chair\n")
        wrong = subprocess.run([program, server.address, "nowhere", "0", "0"], text=True,
                               capture_output=True, check=False)
        self.assertEqual(wrong.returncode, 1)
        self.assertIn("NOT_FOUND", wrong.stderr)

    def test_installed_headers_name_neither_grpc_nor_protobuf(self):
        prefix = self.folder / "prefix"
        self.run_tool("cmake", "--install", BIN.parent, "--prefix", prefix)
        client = prefix / "include" / "hypermap" / "client_libs" / "cpp"
        public, todo = set(), [client / "client.h"]
        while todo:  # what client.h brings in
            header = todo.pop()
            if header in public:
                continue
            public.add(header)
            for name in re.findall(r'#include "([^"]+)"', header.read_text()):
                file = prefix / "include" / "hypermap" / name
                if file.exists():
                    todo.append(file)
                else:
                    self.assertRegex(name, r"^absl/", pathlib.Path(header).name)
            self.assertNotRegex(header.read_text(), r"#include <(grpc|google)", header.name)
        self.assertGreater(len(public), 20)


if __name__ == "__main__":
    unittest.main()

"""Programs outside of the project can find, build with and use the installed C++ client."""

import pathlib
import re
import shutil
import subprocess
import unittest

from processes import BIN, IS_SANITIZED, ROOT, SiteTest

EXAMPLE = ROOT / "client_libs" / "cpp" / "example"

# mirror HOST:PORT FOLDER prints the number of layers of a replica of the map "site".
MIRROR = r"""
#include <cstdio>
#include "client_libs/cpp/replica/replica.h"
int main(int, char** argv) {
  using namespace hypermap::client;
  const auto replica = Replica::Open(Client(argv[1]), {.map = "site", .folder = argv[2]});
  if (!replica.ok()) return std::fprintf(stderr, "%s\n", replica.status().ToString().c_str()), 1;
  const LayerList list = (*replica)->ListLayers();
  std::printf("%d layers at revision %d\n", int(list.layers.size()), int(list.revision));
}
"""


@unittest.skipIf(IS_SANITIZED, "sanitizers need further link options")
class Package(SiteTest):

    def run_tool(self, *command):
        result = subprocess.run(list(map(str, command)), capture_output=True, text=True,
                                stdin=subprocess.DEVNULL, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return result.stdout

    def test_a_separate_project_builds_with_the_client_and_queries_a_map(self):
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

    def test_a_separate_project_builds_with_the_replica_and_opens_it_offline(self):
        prefix, source = self.folder / "prefix", self.folder / "mirror"
        self.run_tool("cmake", "--install", BIN.parent, "--prefix", prefix)
        source.mkdir()
        (source / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(mirror CXX)\n"
            "set(CMAKE_CXX_STANDARD 20)\n"
            "find_package(hypermap REQUIRED COMPONENTS replica)\n"
            "add_executable(mirror main.cc)\n"
            "target_link_libraries(mirror PRIVATE hypermap::replica)\n")
        (source / "main.cc").write_text(MIRROR)
        self.run_tool("cmake", "-S", source, "-B", source / "build",
                      f"-DCMAKE_PREFIX_PATH={prefix}")
        self.run_tool("cmake", "--build", source / "build")

        server = self.server()
        server.cli("map", "create", "site")
        server.cli("layer", "create", "site", "things", "--kind", "semantic")
        mirror = [source / "build" / "mirror", server.address, self.folder / "kept"]
        self.assertEqual(self.run_tool(*mirror), "1 layers at revision 1\n")
        server.kill()
        self.assertEqual(self.run_tool(*mirror), "1 layers at revision 1\n")

    def test_installed_headers_do_not_include_grpc_or_protobuf(self):
        prefix = self.folder / "prefix"
        self.run_tool("cmake", "--install", BIN.parent, "--prefix", prefix)
        client = prefix / "include" / "hypermap" / "client_libs" / "cpp"
        public, todo = set(), [client / "client.h", client / "replica" / "replica.h"]
        while todo:  # Follows their includes.
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
            self.assertNotRegex(header.read_text(), r"#include <(grpc|google|sqlite)", header.name)
        self.assertGreater(len(public), 20)
        for header in (prefix / "include").rglob("*.h"):
            self.assertNotIn("#include <geos_c.h>", header.read_text(), header.name)


if __name__ == "__main__":
    unittest.main()

"""Tests of check_includes.py with allowed and forbidden includes."""

import pathlib
import tempfile
import unittest

import check_includes


class CheckIncludes(unittest.TestCase):
    def violations_of(self, files):
        with tempfile.TemporaryDirectory() as root:
            for name, text in files.items():
                path = pathlib.Path(root, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            return check_includes.violations(root)

    def assert_allowed(self, name, include):
        self.assertEqual(self.violations_of({name: f"#include {include}\n"}), [])

    def assert_refused(self, name, include, why):
        found = self.violations_of({name: f"// A comment.\n#include {include}\n"})
        self.assertEqual(len(found), 1, found)
        self.assertRegex(found[0], f"^{name}:2: .*{why}")

    def test_rooms_may_include_lower_rooms(self):
        self.assert_allowed("map/frames/frame_tree.h", '"map/geometry/point.h"')
        self.assert_allowed("wire/decode.cc", '"hypermap/v1/edit.pb.h"')
        self.assert_allowed("wire/reflection/x.cc", '"grpc/reflection/v1/reflection.grpc.pb.h"')
        self.assert_allowed("storage/sqlite/connection.cc", "<sqlite3.h>")
        self.assert_allowed("map/layers/layer.h", '"map/grid/tile.h"')
        self.assert_allowed("map/geometry/predicates.cc", "<geos_c.h>")

    def test_the_domain_must_not_include_storage_server_or_wire(self):
        self.assert_refused("map/query/query.cc", '"storage/map_store.h"', "must not include storage")
        self.assert_refused("map/snapshot.h", '"server/session/session.h"', "must not include")
        self.assert_refused("map/edits/edit.h", '"wire/decode.h"', "must not include wire")

    def test_the_domain_must_not_use_protobuf_sql_or_grpc(self):
        self.assert_refused("map/edits/edit.h", '"hypermap/v1/edit.pb.h"', "must not include proto")
        self.assert_refused("base/tls/x.cc", '"grpc/health/v1/health.pb.h"',
                            "must not include proto")
        self.assert_refused("map/snapshot.cc", "<sqlite3.h>", "must not use sqlite")
        self.assert_refused("map/query/query.cc", "<grpcpp/grpcpp.h>", "must not use grpc")

    def test_the_domain_must_not_use_files_threads_or_clocks(self):
        for header in ("<thread>", "<fstream>", "<chrono>", "<unistd.h>", '"absl/time/clock.h"',
                       '"absl/synchronization/mutex.h"'):
            self.assert_refused("map/layers/layer.cc", header, "no files, threads or clocks")

    def test_a_lower_room_of_the_domain_must_not_include_a_higher_one(self):
        self.assert_refused("map/geometry/polygon.h", '"map/frames/frame_tree.h"', "must not include")
        self.assert_refused("map/layers/layer.h", '"map/snapshot.h"', "must not include map")

    def test_a_library_must_not_be_used_outside_of_its_rooms(self):
        self.assert_refused("storage/interchange/hmap.cc", "<sqlite3.h>", "must not use sqlite")
        self.assert_refused("server/session/session.cc", '"hypermap/v1/edit.pb.h"', "must not include")
        self.assert_refused("client_libs/cli/main.cc", '"hypermap/v1/edit.pb.h"', "must not include")
        self.assert_refused("wire/status.cc", "<spdlog/spdlog.h>", "must not use spdlog")

    def test_headers_with_a_hidden_library_are_private_to_their_room(self):
        found = self.violations_of({
            "map/geometry/geos_context.h": "#include <geos_c.h>\n",
            "map/geometry/shape.h": '#include "map/geometry/geos_context.h"\n',
            "map/geometry/shape.cc": '#include "map/geometry/shape.h"\n',
            "map/frames/frame_tree.h": '#include "map/geometry/shape.h"\n',
        })
        self.assertEqual(found, [
            "map/frames/frame_tree.h:1: map/geometry/shape.h: is private to map/geometry"])

    def test_unknown_libraries_and_rooms_are_refused(self):
        self.assert_refused("map/query/query.cc", "<boost/geometry.hpp>", "no library in the table")
        self.assert_refused("server/extra/x.cc", "<pqxx/pqxx>", "must not|no library")

    def test_headers_in_a_cycle_are_found(self):
        found = self.violations_of({
            "map/layers/a.h": '#include "map/layers/b.h"\n',
            "map/layers/b.h": '#include "map/layers/c.h"\n',
            "map/layers/c.h": '#include "map/layers/a.h"\n',
        })
        self.assertEqual(len(found), 1, found)
        self.assertIn("cycle: map/layers/a.h -> map/layers/b.h -> map/layers/c.h", found[0])

    def test_folders_of_one_room_in_a_cycle_are_found(self):
        found = self.violations_of({
            "map/layers/a.cc": '#include "map/layers/grid/b.h"\n',
            "map/layers/grid/c.cc": '#include "map/layers/d.h"\n',
        })
        self.assertEqual(found, ["folders in a cycle: map/layers -> map/layers/grid -> map/layers"])

    def test_top_folders_in_a_cycle_are_found(self):
        rooms = {"a/low": check_includes.Room(), "b": check_includes.Room(["a/low"]),
                 "a/high": check_includes.Room(["b"])}
        with tempfile.TemporaryDirectory() as root:
            self.assertEqual(check_includes.violations(root, rooms),
                             ["top folders in a cycle: a -> b -> a"])
            self.assertEqual(check_includes.violations(root, rooms, {("a/high", "b")}), [])

    def test_a_cycle_in_the_table_is_found(self):
        rooms = {"a": check_includes.Room(["b"]), "b": check_includes.Room(["a"])}
        with tempfile.TemporaryDirectory() as root:
            self.assertIn("cycle: a -> b -> a", check_includes.violations(root, rooms)[0])

    def test_an_entry_of_the_table_that_nothing_needs_is_found(self):
        rooms = {"a": check_includes.Room(), "b": check_includes.Room(["a"]),
                 "c": check_includes.Room(["a"])}
        with tempfile.TemporaryDirectory() as root:
            for room in rooms:
                pathlib.Path(root, room).mkdir()
            pathlib.Path(root, "b", "b.cc").write_text('#include "a/a.h"\n', encoding="utf-8")
            self.assertEqual(check_includes.unused(root, rooms), ["c may include a, but does not"])

    def test_tests_may_include_any_room(self):
        self.assertEqual(
            self.violations_of({"map/snapshot_test.cc": '#include "storage/map_store.h"\n'}), [])


if __name__ == "__main__":
    unittest.main()

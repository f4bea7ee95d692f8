"""Tests of check_links.py and draw.py with tables and targets that differ."""

import pathlib
import tempfile
import unittest

import check_links
import draw
from rooms import ROOMS, Room

ROOMS_OF_TEST = {
    "low": Room(),
    "middle": Room(["low"]),
    "high": Room(["low", "middle"]),
}


class Links(unittest.TestCase):
    def differences(self, links):
        with tempfile.TemporaryDirectory() as root:
            folder = pathlib.Path(root, "middle")
            folder.mkdir()
            (folder / "a.h").write_text("#pragma once\n", encoding="utf-8")
            (folder / "a.cc").write_text('#include "low/b.h"\n', encoding="utf-8")
            (folder / "CMakeLists.txt").write_text(f"hypermap_library(middle SOURCES a.cc {links})",
                                                   encoding="utf-8")
            return check_links.differences(root, ROOMS_OF_TEST)

    def test_links_that_follow_the_includes_pass(self):
        self.assertEqual(self.differences("PRIVATE hypermap::low absl::status"), [])

    def test_a_missing_link_is_found(self):
        self.assertEqual(len(self.differences("")), 1)

    def test_a_link_without_an_include_is_found(self):
        self.assertEqual(len(self.differences("PUBLIC hypermap::low")), 2)

    def test_a_missing_target_is_found(self):
        self.assertRegex(self.differences(")\nhypermap_library(other")[0], "lacks|no hypermap_library")


class Diagram(unittest.TestCase):
    def test_arrows_that_follow_from_others_are_left_out(self):
        self.assertEqual(draw.reduced(ROOMS_OF_TEST),
                         {"low": set(), "middle": {"low"}, "high": {"middle"}})

    def test_another_table_gives_another_diagram(self):
        text = f"before\n{draw.BEGIN}\n{draw.END}\nafter\n"
        self.assertNotEqual(draw.with_diagram(text, ROOMS), draw.with_diagram(text, ROOMS_OF_TEST))

    def test_drawing_again_changes_nothing(self):
        text = f"before\n{draw.BEGIN}\n{draw.END}\nafter\n"
        drawn = draw.with_diagram(text, ROOMS)
        self.assertEqual(draw.with_diagram(drawn, ROOMS), drawn)


if __name__ == "__main__":
    unittest.main()

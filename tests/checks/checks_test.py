# SPDX-License-Identifier: MIT
"""The checks find what they are for: each is run on a small tree that breaks it.

    checks_test.py SOURCE_DIR
"""
import pathlib
import sys
import tempfile
import unittest

import comments
import rooms

ROOT = pathlib.Path(sys.argv.pop())


class TreeTest(unittest.TestCase):
    """A tree of two rooms, `terrain/low` under `terrain/high`, and one of `collision`."""

    TABLES = ("## base\n| `base` | all | `b.h` |\n"
              "## terrain\n| `terrain/low` | x | `l.h` |\n| `terrain/high` | x | `h.h` |\n"
              "## collision\n| `collision/top` | x | `t.h` |\n")

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)
        self.write("docs/rooms.md", self.TABLES)
        self.write("base/b.h", "")
        self.write("terrain/low/l.h", '#include "base/b.h"\n')
        self.write("terrain/high/h.h", '#include "base/b.h"\n')
        self.write("collision/top/t.h", "#include <terrane/terrain/a.h>\n")

    def tearDown(self):
        self.folder.cleanup()

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text)

    def room_faults(self):
        found = rooms.Rooms(self.root)
        found.run()
        return found.faults

    def comment_faults(self):
        return list(comments.check(self.root))


class RoomsTest(TreeTest):
    def test_includes_that_go_down_are_no_fault(self):
        self.assertEqual(self.room_faults(), [])

    def test_an_include_upwards_is_a_fault(self):
        self.write("terrain/low/l.h", '#include "high/h.h"\n')
        self.assertIn("terrain/high is above terrain/low", self.room_faults()[0])

    def test_a_private_file_of_another_component_is_a_fault(self):
        self.write("collision/top/t.h", '#include "terrain/low/l.h"\n')
        self.assertIn("private to terrain", self.room_faults()[0])

    def test_an_include_that_names_no_room_is_a_fault(self):
        self.write("terrain/high/h.h", '#include "l.h"\n')
        self.assertIn("does not name a room", self.room_faults()[0])

    def test_a_public_include_against_the_direction_is_a_fault(self):
        self.write("terrain/low/l.h", "#include <terrane/collision/c.h>\n")
        self.assertIn("terrain must not see collision", self.room_faults()[0])

    def test_a_room_without_a_row_and_a_row_without_a_room_are_faults(self):
        self.write("terrain/new/n.h", "")
        self.write("docs/rooms.md", self.TABLES + "| `collision/gone` | x | `g.h` |\n")
        faults = " ".join(self.room_faults())
        self.assertIn("terrain/new has no row", faults)
        self.assertIn("collision/gone, which has no sources", faults)

    def test_a_private_header_of_one_file_alone_is_a_fault(self):
        self.write("terrain/high/h.cpp", '#include "high/h.h"\n')
        self.assertIn("terrain/high/h.h is included by terrain/high/h.cpp alone", self.room_faults()[0])
        self.write("tests/terrain/h_test.cpp", '#include "high/h.h"\n')
        self.assertEqual(self.room_faults(), [])


class CommentsTest(TreeTest):
    HEADER = "terrain/include/terrane/terrain/a.h"

    def test_a_comment_of_121_columns_is_a_fault(self):
        self.write("terrain/low/l.h", "// " + "x" * 117 + "\n")
        self.assertEqual(self.comment_faults(), [])
        self.write("terrain/low/l.h", "// " + "x" * 118 + "\n")
        self.assertIn("121 columns", self.comment_faults()[0])

    def test_public_names_without_a_comment_are_faults(self):
        self.write(self.HEADER, "namespace terrane {\nstruct A {\n    int b = 0;\n};\nint f(int x);\n"
                                "enum class E {\n    one,\n};\n}\n")
        names = [fault.split(": ")[-1] for fault in self.comment_faults()]
        self.assertEqual(names, ["struct A {", "int b = 0;", "int f(int x);", "enum class E {", "one,"])

    def test_documented_and_private_names_are_no_fault(self):
        self.write(self.HEADER, "namespace terrane {\n\n/// A.\nclass A {\npublic:\n    A();\n    ~A();\n    /// B, and C.\n"
                                "    int b() const;\n    int c() const;\n\n    int d() const;  ///< d\n"
                                "private:\n    struct State;\n    int e_ = 0;\n};\n\n/// F.\nint f(int x,\n      int y);\n}\n")
        self.assertEqual(self.comment_faults(), [])


class TreeOfTerraneTest(unittest.TestCase):
    def test_the_checks_read_the_whole_tree(self):
        self.assertGreater(len(rooms.read_tables((ROOT / "docs/rooms.md").read_text())), 5)
        self.assertGreater(len(list(comments.sources(ROOT))), 500)


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/env python3
"""rooms.py on made trees: a circle of rooms and an old picture must be found."""
import tempfile
import unittest

import rooms
from includes_test import made_tree

GOOD = {
    "gpu/simplify.h": "#pragma once\n",
    "pipeline/faces/all_faces.cpp": '#include "pipeline/faces/tiles_3d/tiles_3d.h"\n',
    "pipeline/faces/face.h": "#pragma once\n",
    "pipeline/faces/tiles_3d/tiles_3d.h": '#include "pipeline/faces/face.h"\n',
    "gpu/mesh/rings.h": '#include "gpu/simplify.h"\n',
    "gpu/border/mend.h": '#include "gpu/mesh/rings.h"\n',
    "gpu/collapse/waves.h": '#include "gpu/border/mend.h"\n#include "gpu/mesh/rings.h"\n',
}


class Rooms(unittest.TestCase):
    def findings(self, more, picture_of=None):
        with tempfile.TemporaryDirectory() as root:
            made_tree(root, {**GOOD, **(picture_of or {})})
            pictures = "\n".join(rooms.picture(root, floor) for floor in rooms.FLOORS)
            made_tree(root, {**GOOD, **more, "CONTRIBUTING.md": pictures})
            return rooms.findings(root)

    def test_a_good_tree(self):
        self.assertEqual(self.findings({}), [])

    def test_a_circle_of_three(self):
        more = {"gpu/mesh/rings.h": '#include "gpu/collapse/waves.h"\n'}
        found = self.findings(more, picture_of=more)
        self.assertTrue(found)
        self.assertIn("gpu/mesh/rings.h: gpu/collapse/waves.h: gpu/collapse includes gpu/mesh too, directly or not", found)

    def test_an_empty_file_that_a_shell_has_left(self):
        self.assertEqual(self.findings({"cone.asc": "", "deploy/python/cordillera/py.typed": ""}), ["cone.asc: an empty file"])

    def test_the_door_may_include_any_room(self):
        self.assertEqual(self.findings({"pipeline/faces/all_faces.cpp": '#include "pipeline/faces/face.h"\n'}), [])

    def test_a_floor_with_more_files_than_somebody_looks_through(self):
        more = {f"raster/file_{k}.h": "#pragma once\n" for k in range(rooms.MOST_FILES + 1)}
        self.assertEqual(self.findings(more), [f"raster/ has {rooms.MOST_FILES + 1} files, more than {rooms.MOST_FILES}: it is two rooms"])
        more.popitem()
        self.assertEqual(self.findings(more), [])

    def test_an_old_picture(self):
        found = self.findings({"gpu/refine/thin.h": '#include "gpu/mesh/rings.h"\n'})
        self.assertEqual(len(found), 1)
        self.assertIn("the picture of gpu", found[0])

    def test_what_is_seen_through_another_room_has_no_arrow(self):
        with tempfile.TemporaryDirectory() as root:
            made_tree(root, GOOD)
            text = rooms.picture(root, "gpu")
        self.assertIn("collapse[collapse/] --> border[border/]", text)
        self.assertNotIn("collapse[collapse/] --> mesh[mesh/]", text)


if __name__ == "__main__":
    unittest.main()

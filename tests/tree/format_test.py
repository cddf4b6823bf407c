#!/usr/bin/env python3
"""format.py on made trees: a long line and a file that is not formatted must be found."""
import tempfile
import unittest

import format as tree_format
from includes_test import made_tree

GOOD = {".clang-format": "BasedOnStyle: Google\nColumnLimit: 130\n", "gpu/a.h": "int one();\n", "gpu/a.cu": "int one() { return 1; }\n"}


class Format(unittest.TestCase):
    def findings(self, more):
        with tempfile.TemporaryDirectory() as root:
            made_tree(root, {**GOOD, **more})
            return tree_format.findings(root, tree_format.formatter())[1]

    def test_a_good_tree(self):
        self.assertEqual(self.findings({}), [])

    def test_columns_are_characters_and_not_bytes(self):
        self.assertEqual(self.findings({"gpu/b.h": "// " + "°" * 127 + "\n"}), [])
        wrong = self.findings({"gpu/b.h": 'const char* k =\n    R"(' + "x" * 130 + ')";\n'})
        self.assertEqual(len(wrong), 1)
        self.assertIn("gpu/b.h:2: 140 columns", wrong[0])

    @unittest.skipUnless(tree_format.formatter(), f"no clang-format {tree_format.VERSION}")
    def test_what_is_not_formatted(self):
        wrong = self.findings({"gpu/c.cu": "int  two( ) {return 2;}\n"})
        self.assertEqual(len(wrong), 1)
        self.assertIn("gpu/c.cu", wrong[0])


if __name__ == "__main__":
    unittest.main()

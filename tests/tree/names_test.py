#!/usr/bin/env python3
"""names.py on made trees: a name in a third namespace must be found, and nothing else."""
import os
import tempfile
import unittest

import names
from includes_test import made_tree


def source(space, body):
    return f"namespace cordillera::{space} {{\n{body}\n}}  // namespace\n"


GOOD = {
    "gpu/a.h": source("gpu", "struct Place {\n  int x = 0;\n};"),
    "raster/b.cpp": source("raster", "namespace {\nclass Place final : public Base<int> {};\n}"),
}


class Names(unittest.TestCase):
    def findings(self, more):
        with tempfile.TemporaryDirectory() as root:
            made_tree(root, {**GOOD, **more})
            return names.findings(root)

    def test_two_namespaces_may_have_a_name(self):
        self.assertEqual(self.findings({}), [])

    def test_a_third_namespace(self):
        for body in ("struct Place {};", "class Place : public Other {\n};", "enum Place { here };", "enum class Place : std::uint8_t { here };",
                     "namespace {\nstruct Place {};\n}", "template <class T>\nstruct Place {};", "struct alignas(16) Place {};"):
            found = self.findings({"server/c.cpp": source("server", body)})
            self.assertEqual(len(found), 1, body)
            self.assertIn("Place is a type of 3 namespaces", found[0])
            self.assertIn(os.path.join("server", "c.cpp"), found[0])

    def test_what_is_no_further_type(self):
        for body in ("struct Place;", "using Place = int;", "struct Other {\n  struct Place {};\n};", "void f() {\n  struct Place {};\n}",
                     "// struct Place {\n", 'const char* k = "struct Place {";', "Place place() { return {}; }", "struct Placed {};",
                     'const char* k = R"(} struct Place {)";\nchar open = \'{\';'):
            self.assertEqual(self.findings({"server/c.cpp": source("server", body)}), [], body)

    def test_an_unnamed_namespace_is_that_around_it(self):
        self.assertEqual(self.findings({"raster/c.cpp": source("raster", "struct Place {};")}), [])

    def test_a_source_goes_on_behind_a_function(self):
        found = self.findings({"server/c.cpp": source("server", "int f() {\n  if (true) { return 1; }\n  return 2;\n}\nstruct Place {};")})
        self.assertEqual(len(found), 1)


if __name__ == "__main__":
    unittest.main()

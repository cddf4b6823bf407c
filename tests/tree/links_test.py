#!/usr/bin/env python3
"""links.py on made pages: each rule is broken once, and must be found."""
import os
import tempfile
import unittest

import links

GOOD = {
    "README.md": "# One\n\nSee [two](docs/two.md#a-heading) and [here](#one), [elsewhere](https://example.org/x).\n\n    [not](a-link)\n",
    "docs/README.md": "[two](two.md) `[no](link)`\n",
    "docs/two.md": "# Two\n\n## A `heading`\n\n<img src=\"p.png\">\n\n```\n[no](link)\n## Not a heading\n```\n",
}
FILES = set(GOOD) | {"docs/p.png", "docs"}


def findings(changes):
    pages = {**GOOD, **changes}
    return links.judge(pages, lambda path: path in FILES | set(pages))


class Links(unittest.TestCase):
    def test_good_pages_are_good(self):
        self.assertEqual(findings({}), [])

    def test_what_is_broken_is_found(self):
        broken = {
            "a missing file": {"docs/two.md": "[x](three.md)\n## A `heading`\n"},
            "a missing heading": {"docs/two.md": "# Two\n"},
            "a heading in code": {"README.md": "[x](docs/two.md#not-a-heading)\n"},
            "a missing picture": {"docs/two.md": "## A heading\n<img src=\"q.png\">\n"},
            "a page that the index forgets": {"docs/three.md": "# Three\n"},
            "a folder above": {"README.md": "[x](../elsewhere.md)\n"},
            "a long README": {"README.md": "\n" * 121},
        }
        for name, changes in broken.items():
            with self.subTest(name):
                self.assertEqual(len(findings(changes)), 1)

    def test_equal_headings_have_numbers(self):
        self.assertEqual(links.anchors("# A b\n## A b\n# C, d!\n"), {"a-b", "a-b-1", "c-d"})

    def test_files_of_a_folder_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, "docs", "empty"))
            for name in ("README.md", "docs/two.md"):
                with open(os.path.join(folder, name), "w", encoding="utf-8"):
                    pass
            self.assertEqual(links.found(folder), {"README.md", "docs/two.md"})


if __name__ == "__main__":
    unittest.main()

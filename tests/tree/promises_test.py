#!/usr/bin/env python3
"""promises.py finds what is not there."""
import os
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import promises  # noqa: E402

TABLE = "# Security\n`No.Test` elsewhere\n\n%s\n\n| promise | tests |\n|---|---|\n| `a` word | %s |\n\n## More\n| x | `Other` |\n"


def judged(cell, tests=("A.B",), files=("tests/x.py",)):
    return promises.judge(TABLE % (promises.HEADING, cell), set(tests), lambda name: name in files)


class Promises(unittest.TestCase):
    def test_what_is_there(self):
        self.assertEqual(judged("`A.B`, `tests/x.py`"), [])

    def test_what_is_not(self):
        self.assertEqual(len(judged("`A.B`, `A.C`, `tests/y.py`")), 2)

    def test_a_table_of_nothing(self):
        self.assertEqual(len(judged("nothing")), 1)
        self.assertEqual(len(promises.judge("# Security\n", set(), lambda name: False)), 1)

    def test_a_glossary_that_grows(self):
        head = "# Glossary\n\n| word | what it is |\n|---|---|\n"
        self.assertEqual(promises.too_many_words(head + "| word | this |\n" * promises.MOST_WORDS), [])
        self.assertEqual(len(promises.too_many_words(head + "| word | this |\n" * (promises.MOST_WORDS + 1))), 1)


if __name__ == "__main__":
    unittest.main()

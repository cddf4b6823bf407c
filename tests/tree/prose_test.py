#!/usr/bin/env python3
"""prose.py on made pages."""
import unittest

import prose

PAGE = """# A heading of a page that is not counted

One two three. Four `a piece of code` six! A list:

* one item of five words
  that goes on. Another one (e.g. this)

| a table | is not counted. It is not. |

    indented code is not counted. It is not.

```
nor is this. It is not.
```
"""


class Prose(unittest.TestCase):
    def test_sentences_are_told_apart(self):
        self.assertEqual([prose.words(sentence) for sentence in prose.sentences(PAGE)], [3, 3, 2, 8, 4])

    def test_a_link_is_its_words(self):
        self.assertEqual(prose.mean("See [two words](a/b.md#c) here.\n"), (4.0, 1))

    def test_long_sentences_are_too_long(self):
        long = ("word " * 25).strip().capitalize() + ".\n\n"
        self.assertGreaterEqual(prose.mean(long * 3)[0], prose.MOST_WORDS)


if __name__ == "__main__":
    unittest.main()

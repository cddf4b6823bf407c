#!/usr/bin/env python3
"""How long sentences of the documents are: prose.py REPOSITORY. The mean of every page that users read stays below 20 words.

A sentence ends at a full stop, question or exclamation mark before a capital, or where its paragraph or list item ends. Code, tables and
headings are left out; a piece of code within a sentence is one word."""
import os
import re
import sys

MOST_WORDS = 20
FEWEST_SENTENCES = 3
PAGES = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "deploy/README.md", "deploy/UPGRADE.md", "tests/README.md")
FENCED = re.compile(r"^(```|~~~).*?^\1\s*$", re.S | re.M)
NO_PROSE = re.compile(r"^(?:\s*\||#|\[[^\]]*\]:|<)")
ITEM = re.compile(r"^\s*(?:[*+-]|\d+\.)\s+")
END = re.compile(r"(?<=[.?!])[)\"*_]*\s+(?=[\"'(*_`\[]*[A-Z0-9`])")


def paragraphs(text):
    """The paragraphs and list items of a page, each as one line."""
    lines, in_item = [], False
    for line in FENCED.sub("\n", text).split("\n"):
        if not line.strip():
            lines.append("")
            in_item = False
        elif NO_PROSE.match(line) or (line.startswith("    ") and not in_item):
            lines.append("")
        elif ITEM.match(line):
            lines += ["", ITEM.sub("", line)]
            in_item = True
        else:
            lines.append(line.strip())
    return [" ".join(part.split("\n")) for part in re.split(r"\n{2,}", "\n".join(lines)) if part.strip()]


def sentences(text):
    found = []
    for paragraph in paragraphs(text):
        plain = re.sub(r"`[^`]*`", "code", paragraph)
        plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", plain)
        found += [part for part in END.split(plain) if re.search(r"[A-Za-z]", part)]
    return found


def words(sentence):
    return len([word for word in sentence.split() if re.search(r"\w", word)])


def mean(text):
    """(words a sentence, sentences) of a page."""
    lengths = [words(sentence) for sentence in sentences(text)]
    return (sum(lengths) / len(lengths) if lengths else 0.0), len(lengths)


def pages(root):
    yield from PAGES
    for folder, _, names in os.walk(os.path.join(root, "docs")):
        for name in names:
            if name.endswith(".md"):
                yield os.path.relpath(os.path.join(folder, name), root)


def main(root, verbose):
    wrong = []
    for page in sorted(pages(root)):
        with open(os.path.join(root, page), encoding="utf-8") as file:
            average, count = mean(file.read())
        if verbose:
            print(f"{average:5.1f} {count:4d}  {page}")
        if count >= FEWEST_SENTENCES and average >= MOST_WORDS:
            wrong.append(f"{page}: {average:.1f} words a sentence; write shorter ones")
    print("\n".join(wrong) or f"every page has fewer than {MOST_WORDS} words a sentence")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], "--list" in sys.argv))

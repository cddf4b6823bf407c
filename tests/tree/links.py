#!/usr/bin/env python3
"""Links and code lines of the documents: links.py REPOSITORY, or of an installation's documents: links.py --folder FOLDER

Every relative link of a Markdown file leads to a file of the repository, and to a heading where it has an anchor. Every page of docs/ is reached from
docs/README.md, and README.md is short enough to be read."""
import os
import re
import subprocess
import sys

README_LINES = 120
FENCED = re.compile(r"^(```|~~~).*?^\1\s*$", re.S | re.M)
INLINE = re.compile(r"`[^`\n]*`")
INDENTED = re.compile(r"^(?: {4}|\t).*$", re.M)
LINK = re.compile(r"\]\(<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\)")
SOURCE = re.compile(r"<(?:img|a|source)\b[^>]*?\b(?:src|href|srcset)=\"([^\"]+)\"")
EXTERNAL = re.compile(r"[a-z][a-z0-9+.-]*:", re.I)


def prose(text):
    """The text without code, in which nothing is a link."""
    return INLINE.sub("", INDENTED.sub("", FENCED.sub("", text)))


def anchors(text):
    """The anchors that GitHub gives to the headings of a page."""
    found = set()
    for heading in re.findall(r"^#{1,6} +(.*?)\s*#*$", FENCED.sub("", text), re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        name = base = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        count = 0
        while name in found:
            count += 1
            name = f"{base}-{count}"
        found.add(name)
    return found | set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", text))


def targets(text):
    return [target for pattern in (LINK, SOURCE) for target in pattern.findall(prose(text)) if not EXTERNAL.match(target)]


def judge(pages, exists):
    """What is wrong: pages is {path: text}; exists says whether a path is a file or folder of the repository."""
    wrong, reached = [], set()
    names = {path: anchors(text) for path, text in pages.items()}
    for path, text in sorted(pages.items()):
        for target in targets(text):
            name, _, anchor = target.partition("#")
            to = os.path.normpath(os.path.join(os.path.dirname(path), name)) if name else path
            if path == "docs/README.md":
                reached.add(to)
            if to.startswith("..") or not exists(to):
                wrong.append(f"{path}: {target} leads nowhere")
            elif anchor and to in names and anchor not in names[to]:
                wrong.append(f"{path}: {to} has no heading #{anchor}")
    wrong += [f"{path}: docs/README.md does not link to it" for path in sorted(pages)
              if path.startswith("docs/") and path != "docs/README.md" and path not in reached]
    if len(pages.get("README.md", "").splitlines()) > README_LINES:
        wrong.append(f"README.md: more than {README_LINES} lines")
    return wrong


def tracked(root):
    """The files of a repository, or None where there is none."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "--cached", "--others", "--exclude-standard"], capture_output=True, text=True)
    if listed.returncode != 0:
        return None
    return {name for name in listed.stdout.splitlines() if os.path.exists(os.path.join(root, name))}


def found(root):
    """The files of a folder."""
    return {os.path.relpath(os.path.join(folder, name), root) for folder, _, names in os.walk(root) for name in names}


def main(root, files):
    if files is None:
        print("links: not a git repository, so the files of the tree are not known")
        return 77
    folders = {os.path.dirname(name) for name in files}
    folders |= {parent for folder in folders for parent in (folder.rsplit("/", k)[0] for k in range(folder.count("/") + 1))} | {"."}
    pages = {}
    for name in files:
        if name.endswith(".md"):
            with open(os.path.join(root, name), encoding="utf-8") as file:
                pages[name] = file.read()
    wrong = judge(pages, lambda path: path in files or path in folders)
    links = sum(len(targets(text)) for text in pages.values())
    if links < 100:
        wrong.append(f"only {links} links were found")
    print("\n".join(wrong) or f"{links} links of {len(pages)} pages lead somewhere")
    return 1 if wrong else 0


if __name__ == "__main__":
    FOLDER = sys.argv[-1]
    sys.exit(main(FOLDER, found(FOLDER) if sys.argv[1] == "--folder" else tracked(FOLDER)))

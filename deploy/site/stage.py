#!/usr/bin/env python3
"""Lays out the pages for Eleventy: stage.py REPOSITORY PAGES SITE

Every Markdown file of the repository keeps its path, but a README.md becomes index.md, and links lead to .html. Pictures and other files that pages
link to, such as headers and scripts, go straight into the site; what is no picture gets the ending .txt, so that browsers show it. The groups of
docs/README.md become the sidebar, _data/groups.json."""
import json
import os
import re
import shutil
import subprocess
import sys

LINK = re.compile(r"(\]\()([^)\s]+)(\))")
IMAGE = re.compile(r"<img src=\"([^\":]+)\"")
CODE = re.compile(r"(^```.*?^```$|`[^`\n]*`|^ {4}[^\n]*$)", re.S | re.M)
GROUP = re.compile(r"^\*\*([^*]+)\*\*: (.*?)(?=\n\n|\Z)", re.S | re.M)
ITEM = re.compile(r"\[([^\]]+)\]\(([^)]+)\)")
PICTURE = re.compile(r"\.(png|jpe?g|svg|webp|gif)$")


def staged(path):
    """Where a page lies among the pages."""
    return re.sub(r"(^|/)README\.md$", r"\1index.md", path)


def published(path):
    """Where a file of the repository lies on the site."""
    if path.endswith(".md"):
        return re.sub(r"\.md$", ".html", staged(path))
    return path if PICTURE.search(path) else path + ".txt"


def rewrite(text, page, files, linked):
    """The text with links to where things lie on the site; names of linked files that are no pages go into linked."""
    here = os.path.dirname(page)

    def link(match):
        target = match.group(2)
        if re.match(r"[a-z][a-z0-9+.-]*:|#", target):
            return match.group(0)
        name, hash_, anchor = target.partition("#")
        to = os.path.normpath(os.path.join(here, name))
        if to not in files:  # a folder: its page, or its listing in the repository, which a site has not
            to = os.path.join(to, "README.md")
            if to not in files:
                return match.group(1) + "#" + match.group(3)
        if not to.endswith(".md"):
            linked.add(to)
        return f"{match.group(1)}{os.path.relpath(published(to), here or '.')}{hash_}{anchor}{match.group(3)}"

    linked |= {os.path.normpath(os.path.join(here, name)) for name in IMAGE.findall(text)}
    return "".join(part if k % 2 else LINK.sub(link, part) for k, part in enumerate(CODE.split(text)))


def groups_of(index):
    return [{"name": name, "items": [{"text": text, "path": published(os.path.normpath(os.path.join("docs", target)))} for text, target in ITEM.findall(items)]}
            for name, items in GROUP.findall(index)]


def write(path, text):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def main(root, pages, site):
    listed = subprocess.run(["git", "-C", root, "ls-files", "--cached", "--others", "--exclude-standard"], capture_output=True, text=True, check=True)
    files = {name for name in listed.stdout.splitlines() if os.path.isfile(os.path.join(root, name))}
    linked = set()
    for page in sorted(name for name in files if name.endswith(".md") and not name.startswith(".")):
        write(os.path.join(pages, staged(page)), rewrite(read(os.path.join(root, page)), page, files, linked))
    for name in sorted(linked):
        to = os.path.join(site, published(name))
        os.makedirs(os.path.dirname(to), exist_ok=True)
        shutil.copyfile(os.path.join(root, name), to)
    write(os.path.join(pages, "_data", "groups.json"), json.dumps(groups_of(read(os.path.join(root, "docs/README.md")))))


main(*sys.argv[1:])

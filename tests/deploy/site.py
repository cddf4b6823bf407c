#!/usr/bin/env python3
"""Every link within a static site leads to a file of it, and to a place in it where there is one: site.py FOLDER"""
import html.parser
import os
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.headings = set(), [], 0
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.headings += tag == "h1"
        if values.get("id"):
            self.ids.add(values["id"])
        self.links += [values[name] for name in ("href", "src") if values.get(name)]


def file_of(path, files):
    """The file that a server shows for a path; VitePress makes x.html of x.md."""
    for name in (path, path + ".html", os.path.join(path, "index.html").lstrip("/")):
        if name in files:
            return name
    return None


def judge(root):
    files = {os.path.relpath(os.path.join(folder, name), root) for folder, _, names in os.walk(root) for name in names}
    pages = {}
    for name in sorted(files):
        if name.endswith(".html"):
            with open(os.path.join(root, name), encoding="utf-8") as file:
                pages[name] = Page(file.read())
    wrong, count = [], 0
    for name, page in pages.items():
        if name != "404.html" and page.headings != 1:
            wrong.append(f"{name}: {page.headings} headings of the first level")
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            path = urllib.parse.unquote(parts.path)
            full = path.lstrip("/") if path.startswith("/") else os.path.normpath(os.path.join(os.path.dirname(name), path)) if path else name
            to = file_of(full.rstrip("/") if full != "." else "", files)
            count += 1
            if to is None:
                wrong.append(f"{name}: {link} leads nowhere")
            elif parts.fragment and to in pages and urllib.parse.unquote(parts.fragment) not in pages[to].ids | {"VPContent"}:
                wrong.append(f"{name}: {link}: no such place")
    return wrong, len(pages), count


if __name__ == "__main__":
    found, page_count, link_count = judge(sys.argv[1])
    print("\n".join(found) or f"{link_count} links of {page_count} pages lead somewhere")
    sys.exit(1 if found or page_count < 60 or link_count < 1000 else 0)

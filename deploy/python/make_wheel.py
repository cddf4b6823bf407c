#!/usr/bin/env python3
"""Makes the wheel, with the standard library alone:  deploy/python/make_wheel.py FOLDER

It is also what pip builds with (PEP 517), so `pip install deploy/python` needs no network. The same sources give the same bytes: every
file gets the time $SOURCE_DATE_EPOCH, else that of the oldest a zip file knows.
"""
import base64
import hashlib
import os
import re
import sys
import time
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))


def _read(*path):
    with open(os.path.join(HERE, *path), encoding="utf-8") as file:
        return file.read()


def _fields():
    """The plain strings of pyproject.toml: Python 3.9 has no reader of it."""
    return dict(re.findall(r'^([a-z-]+) = "(.*)"$', _read("pyproject.toml"), re.M))


def _metadata(fields):
    lines = ["Metadata-Version: 2.1", "Name: " + fields["name"], "Version: " + fields["version"], "Summary: " + fields["description"],
             "License: Apache-2.0", "Requires-Python: " + fields["requires-python"], "Classifier: Typing :: Typed",
             "Description-Content-Type: text/markdown"]
    return "\n".join(lines) + "\n\n" + _read("README.md")


def _add(archive, name, text, records):
    data = text.encode()
    seconds = max(int(os.environ.get("SOURCE_DATE_EPOCH", 0)), 315532800)
    entry = zipfile.ZipInfo(name, time.gmtime(seconds)[:6])
    entry.external_attr, entry.compress_type = 0o644 << 16, zipfile.ZIP_DEFLATED
    archive.writestr(entry, data)
    records.append("%s,sha256=%s,%d" % (name, base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("="), len(data)))


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    fields = _fields()
    stem = "%s-%s" % (fields["name"], fields["version"])
    info, records = stem + ".dist-info", []
    name = stem + "-py3-none-any.whl"
    with zipfile.ZipFile(os.path.join(wheel_directory, name), "w") as archive:
        for file in sorted(os.listdir(os.path.join(HERE, "cordillera"))):
            if file.endswith((".py", ".typed")):
                _add(archive, "cordillera/" + file, _read("cordillera", file), records)
        _add(archive, info + "/METADATA", _metadata(fields), records)
        _add(archive, info + "/WHEEL", "Wheel-Version: 1.0\nGenerator: cordillera\nRoot-Is-Purelib: true\nTag: py3-none-any\n", records)
        _add(archive, info + "/RECORD", "\n".join(records) + "\n%s/RECORD,,\n" % info, [])
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("the wheel is all there is: its sources are in it")


if __name__ == "__main__":
    print(build_wheel(sys.argv[1]))

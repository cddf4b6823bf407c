#!/usr/bin/env python3
"""What Cordillera is made of, as CycloneDX 1.5 JSON: Debian packages with the versions that are installed, npm packages as locked.

    deploy/sbom.py > sbom.json

Debian packages are those of packages.txt and what the program is linked with (Depends of the libraries, as dpkg knows them). The same
machine gives the same bytes: nothing in it is random, and the time is $SOURCE_DATE_EPOCH or that of the last commit.
"""
import datetime
import json
import os
import re
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(HERE)


def lines(path):
    with open(path) as file:
        return [line for line in (raw.split("#")[0].strip() for raw in file) if line]


def installed():
    """name -> (version, names of what it depends on)."""
    listed = subprocess.run(["dpkg-query", "-W", "-f", "${db:Status-Abbrev}\t${Package}\t${Version}\t${Pre-Depends}, ${Depends}\n"], check=True,
                            capture_output=True, text=True).stdout
    packages = {}
    for line in listed.splitlines():
        status, name, version, depends = line.split("\t")
        if status.startswith("ii"):
            packages[name] = (version, re.findall(r"(?:^|, *)([a-z0-9][a-z0-9+.-]+)", depends))
    return packages


def debian(packages):
    """What packages.txt names, and every library that those bring with them: a -dev package has its library as a dependency."""
    wanted, seen = lines(os.path.join(HERE, "packages.txt")), {}
    missing = [name for name in wanted if name not in packages]
    if missing:
        sys.exit("sbom: not installed: " + ", ".join(missing) + " (deploy/install.sh)")
    queue = [(name, "named") for name in wanted]
    while queue:
        name, why = queue.pop()
        if name in seen or name not in packages:
            continue
        seen[name] = why
        queue += [(other, "library") for other in packages[name][1] if other.startswith("lib")]
    return [{
        "type": "library" if name.startswith("lib") else "application",
        "bom-ref": "pkg:deb/debian/%s@%s" % (name, packages[name][0]),
        "name": name,
        "version": packages[name][0],
        "purl": "pkg:deb/debian/%s@%s" % (name, packages[name][0]),
        "scope": "required",
        "properties": [{"name": "cordillera:why", "value": why}],
    } for name, why in sorted(seen.items())]


def npm(lock):
    with open(lock) as file:
        locked = json.load(file)["packages"]
    components = []
    for place, package in sorted(locked.items()):
        if not place:
            continue
        name = place.rsplit("node_modules/", 1)[-1]
        component = {
            "type": "library",
            "bom-ref": "pkg:npm/%s@%s" % (name.replace("@", "%40"), package["version"]),
            "name": name,
            "version": package["version"],
            "purl": "pkg:npm/%s@%s" % (name.replace("@", "%40"), package["version"]),
        }
        if "license" in package:
            component["licenses"] = [{"expression": package["license"]}]
        components.append(component)
    return components


def moment():
    seconds = os.environ.get("SOURCE_DATE_EPOCH")
    if not seconds:
        seconds = subprocess.run(["git", "-C", ROOT, "log", "-1", "--format=%ct"], check=True, capture_output=True, text=True).stdout
    return datetime.datetime.fromtimestamp(int(seconds), datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def main():
    with open(os.path.join(ROOT, "CMakeLists.txt")) as file:
        version = re.search(r"project\(cordillera VERSION ([0-9.]+)", file.read()).group(1)
    components = debian(installed()) + npm(os.path.join(ROOT, "server", "web", "package-lock.json"))
    unique = {component["bom-ref"]: component for component in components}
    json.dump({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "timestamp": moment(),
            "component": {"type": "application", "bom-ref": "cordillera", "name": "cordillera", "version": version,
                          "licenses": [{"license": {"id": "Apache-2.0"}}]},
        },
        "components": [unique[key] for key in sorted(unique)],
        "dependencies": [{"ref": "cordillera", "dependsOn": sorted(unique)}],
    }, sys.stdout, indent=2)
    print()


if __name__ == "__main__":
    main()

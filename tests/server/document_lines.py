#!/usr/bin/env python3
"""Runs every shell line of README.md and docs/*/*.md, in order, each section in a folder of its own.

  document_lines.py REPOSITORY URL ID GIVEN     a server with a dataset; a folder with the files that readers have

A line of an indented block is run, or stands in LEFT_OUT with the reason; one that is neither, or a reason that is no longer needed,
fails the test. Errors of HTTP fail it too."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SHOWN = "http://127.0.0.1:8080"  # the address in the documents
RUN = re.compile(r"(curl|cordillera|diff) ")
TIME_LIMIT_S = 300
LEFT_OUT = [  # (first words of a line and why it is not run here; those of a block stand for all of it)
    ("deploy/quickstart.sh", "deploy.quickstart_once runs it, and tests/run.sh runs this test"),
    ("tar -xzf cordillera-", "the archive of a release; deploy.package makes, unpacks and runs it"),
    ("cordillera serve", "this test has a server, at an address of its own"),
    ("cordillera view", "it goes on until it is stopped; server.view does it"),
    ("cordillera build fine.tif", "several rasters, which the reader has"),
    ("cordillera plan", "the same"),
    ("survey.tif", "lines of a list of rasters"),
    ("deploy/slurm/", "a cluster"),
    ("deploy/kubernetes/", "the same; deploy.jobs runs what it makes"),
    ("deploy/aws-batch/", "the same"),
    ("curl -G http://127.0.0.1:8080/v1/live", "an address of a raster, which the reader has"),
    ("curl -d source=https://dem.example.org", "the same"),
    ("curl -H 'Authorization", "a token, where a service asks for one"),
    ("node read.js", "browser.clients runs it"),
    ("npm install", "browser.clients has the packages, copies and bundles as the block does"),
    ("x = floor(", "a formula"),
    ("lon = -180", "a formula"),
    ("lon = west", "a formula"),
    ("zoom = z + 1", "a formula"),
    ("{", "an answer"),
    ("map.", "JavaScript"),
    ("const ", "JavaScript"),
    ("location /", "lines for nginx"),
    ("cordillera check", "crash.upkeep checks, sound ones and broken ones"),
    ("cordillera backup", "crash.upkeep does it"),
    ("journalctl", "a machine whose service systemd runs"),
    ("cordillera adopt", "it wants a lost registry; lost_registry_test.cpp makes some"),
    ("cordillera vacuum", "it wants a stopped server; crash.upkeep does it"),
    ("curl -i -X POST -H 'Upload-Length", "parts of a raster that the reader has; crash.upkeep sends some"),
    ("cordillera doctor", "it wants port 8080, which may be another's; program_test runs it with any"),
]


def sections(path):
    """(heading, [indented blocks as lists of lines]) of a document; fenced blocks are none."""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"^```.*?^```$", "", file.read(), flags=re.S | re.M)
    for part in re.split(r"^(?=#+ )", text, flags=re.M):
        blocks = [found.group(0).rstrip("\n").split("\n") for found in re.finditer(r"(?:^ {4}.*\n?)+", part, flags=re.M)]
        blocks = [[line.strip() for line in block] for block in blocks if not block[0].startswith("     ")]
        yield part.split("\n", 1)[0].lstrip("# "), blocks


def reason(line):
    return next((k for k, (words, _) in enumerate(LEFT_OUT) if line.startswith(words)), None)


class Reader:
    """Somebody who copies line by line, puts their own address and id in, and looks at what comes back."""

    def __init__(self, url, dataset):
        self.url, self.dataset = url, dataset

    def run(self, line, folder):
        own = line.replace(SHOWN, self.url).replace("datasets/ID", f"datasets/{self.dataset}")
        environment = dict(os.environ, ID=self.dataset, D=f"{self.url}/v1/datasets/{self.dataset}")
        script = 'curl() { command curl --fail-with-body -sS "$@"; }\n' + own
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=folder, env=environment, capture_output=True, timeout=TIME_LIMIT_S)
        said = (done.stdout + done.stderr).decode(errors="replace")
        if done.returncode != 0:
            return f"exit code {done.returncode}: {said[-600:]}"
        if "-X POST" in line and "/v1/datasets?" in line:
            self.dataset = json.loads(done.stdout)["id"]
        if line.startswith("cordillera post"):
            said = done.stdout.decode()
            self.dataset = json.loads(said)["id"] if "--json" in line else said.split()[1]
        return None


def run_document(path, name, reader, given, used):
    count, failures = 0, []
    for heading, blocks in sections(path):
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(given, folder, dirs_exist_ok=True)
            for line in [line for block in blocks for line in (block[:1] if reason(block[0]) is not None else block)]:
                left_out = reason(line)
                if left_out is not None:
                    used.add(left_out)
                    continue
                wrong = reader.run(line, folder) if RUN.match(line) else "neither a known command nor left out with a reason"
                count += 1
                if wrong:
                    failures.append(f"{name}, {heading}\n    {line}\n    {wrong}")
    return count, failures


def main(repository, url, dataset, given):
    pages = sorted(pathlib.Path(repository, "docs").rglob("*.md"))
    documents = ["README.md"] + [str(page.relative_to(repository)) for page in pages]
    used, failures, total = set(), [], 0
    for name in documents:
        # Some pages post and delete datasets of their own; the others speak of one that is there.
        count, found = run_document(f"{repository}/{name}", name, Reader(url, dataset), given, used)
        total += count
        failures += found
        if count:
            print(f"{name}: {count} lines")
    failures += [f"LEFT_OUT: no line begins with '{LEFT_OUT[k][0]}'" for k in range(len(LEFT_OUT)) if k not in used]
    if total < 30:
        failures.append(f"only {total} lines were run")
    print("\n".join(failures))
    sys.exit(1 if failures else 0)


main(*sys.argv[1:])

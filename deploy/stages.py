"""The stages of a plan as arrays of tasks, for schedulers that are told with JSON. Used by kubernetes/jobs.py and aws-batch/jobs.py."""
import argparse
import json
import math
import os
import shutil
import subprocess
import sys


def parser(about):
    """The words that both have in common, as deploy/slurm/submit.sh spells them."""
    words = argparse.ArgumentParser(description=about)
    words.add_argument("plan", help="as the tasks see it: a folder on a shared volume, or /vsis3/BUCKET/PLAN")
    words.add_argument("-o", "--output", required=True, help="what publish writes: a folder, or NAME.sqlite, also in object storage")
    words.add_argument("--overwrite", action="store_true", help="publish replaces what is in the output's place; without it that is refused")
    words.add_argument("--image", required=True, help="a container whose entry point is cordillera, such as that of deploy/Dockerfile")
    words.add_argument("--parts", type=int, default=1000, help="most tasks of an array [1000]")
    words.add_argument("--samples", type=float, default=4e7, help="finest samples that an array task should get at least [40000000, about a minute of a core]")
    words.add_argument("--cpus", type=int, default=1, help="cores of a task [1]")
    words.add_argument("--mem", type=int, help="memory of a task, MiB [1024, and 512 for each further core]; a stage that takes more gets more")
    words.add_argument("--gpu", action="store_true", help="a GPU for each task of stage 0")
    words.add_argument("--retries", type=int, default=5, help="how often a task is done again when it says that this may help [5]")
    words.add_argument("--name", default="cordillera", help="beginning of all names [cordillera]")
    words.add_argument("--env", action="append", default=[], metavar="NAME=VALUE", help="for every task, such as AWS_REGION=eu-central-1; may be repeated")
    words.add_argument("--program", default="cordillera", help="cordillera on this machine [found in PATH]")
    words.add_argument("--here", help="where this machine sees the plan, if not under the name that the tasks use")
    return words


def stages(given):
    """[(number, parts, MiB)] of the stages that are not done, from below."""
    if not shutil.which(given.program):
        sys.exit(f"{os.path.basename(sys.argv[0])}: {given.program} is not in PATH; say --program")
    if not given.overwrite and is_taken(given):
        sys.exit(f"{os.path.basename(sys.argv[0])}: {given.output} is there already; --overwrite replaces it")
    tasks = subprocess.run([given.program, "tasks", given.here or given.plan, "--json"], stdout=subprocess.PIPE)
    if tasks.returncode != 0:
        sys.exit(tasks.returncode)  # the program has said why
    listed = json.loads(tasks.stdout)
    return [(s["stage"], max(1, min(math.ceil(s["cost"] / given.samples), s["tasks"], given.parts)), memory_mib(given, s["memory_mib"]))
            for s in listed if s["done"] < s["tasks"]]


def is_taken(given):
    """Whether there is an output already, as far as this machine sees it; publish would refuse after hours."""
    if given.output.startswith("/vsi"):
        return subprocess.run([given.program, "info", given.output], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    return os.path.isfile(given.output) or (os.path.isdir(given.output) and bool(os.listdir(given.output)))


LEAST_MIB = 1024  # of a block, and of publish


def memory_mib(given, least=LEAST_MIB):
    """least: what a task takes on one core, as the program says. --mem may be less for blocks, which know to do with that."""
    if given.mem and (given.mem > least or least <= LEAST_MIB):
        return given.mem
    return least + 512 * (given.cpus - 1)


def work(given, stage, parts, memory):
    """What a task of an array is told: it finds its number in the variable that its scheduler sets."""
    device = "cuda" if given.gpu and stage == 0 else "cpu"
    return ["work", given.plan, "--stage", str(stage), "--part", f"array/{parts}", "--threads", str(given.cpus),
            "--memory", str(memory), "--device", device, "--quiet"]


def publish(given):
    return ["publish", given.plan, "-o", given.output, *(["--overwrite"] if given.overwrite else []), "--quiet"]


def variables(given):
    return [{"name": name, "value": value} for name, _, value in (word.partition("=") for word in given.env)]

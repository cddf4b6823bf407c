#!/usr/bin/env python3
"""A plan as Kubernetes Jobs, one a stage, for kubectl; run.sh starts them one after the other.

  deploy/kubernetes/jobs.py /vsis3/bucket/plan -o /vsis3/bucket/dem.sqlite --image REGISTRY/cordillera --secret storage-keys > jobs.yaml

A stream of YAML whose documents are JSON. Needs Kubernetes 1.29 or newer (backoffLimitPerIndex)."""
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import stages  # noqa: E402

GROUP = 990  # of cordillera in deploy/Dockerfile
SCRATCH = "/scratch"


def job(given, name, arguments, parts, memory, gpu=False):
    resources = {"cpu": str(given.cpus), "memory": f"{memory}Mi"}
    limits = {"memory": resources["memory"], **({"nvidia.com/gpu": "1"} if gpu else {})}
    container = {"name": "cordillera", "image": given.image, "args": arguments, "env": stages.variables(given),
                 "resources": {"requests": resources, "limits": limits}}
    if given.secret:
        container["envFrom"] = [{"secretRef": {"name": given.secret}}]
    pod = {"restartPolicy": "Never", "containers": [container]}
    if given.volume:
        claim, _, path = given.volume.partition(":")
        container["volumeMounts"] = [{"name": "data", "mountPath": path}]
        pod["volumes"] = [{"name": "data", "persistentVolumeClaim": {"claimName": claim}}]
        # A new volume belongs to root. Once its top folder has the group, pods do not walk through all of the plan again.
        pod["securityContext"] = {"fsGroup": GROUP, "fsGroupChangePolicy": "OnRootMismatch"}
    return {
        "apiVersion": "batch/v1", "kind": "Job",
        "metadata": {"name": name, "labels": {"app": "cordillera", "plan": given.name}},
        "spec": {
            # Started by run.sh: pods that waited for the stage below would hold the nodes that it needs.
            "suspend": True,
            "completionMode": "Indexed", "completions": parts, "parallelism": min(parts, given.parallel),
            # 1 and 2 fail again wherever they run, and leave the others alone; 75, a lost node and an eviction do not.
            "backoffLimitPerIndex": given.retries, "maxFailedIndexes": parts,
            "podFailurePolicy": {"rules": [
                {"action": "Ignore", "onPodConditions": [{"type": "DisruptionTarget", "status": "True"}]},
                {"action": "FailIndex", "onExitCodes": {"containerName": "cordillera", "operator": "In", "values": [1, 2]}}]},
            "template": {"metadata": {"labels": {"app": "cordillera", "plan": given.name}}, "spec": pod},
        },
    }


def with_scratch(given, publish):
    """The dataset is put together in TMPDIR: a volume of its own, so that the node is one that has room for it."""
    pod = publish["spec"]["template"]["spec"]
    container = pod["containers"][0]
    container["env"] = [*container["env"], {"name": "TMPDIR", "value": SCRATCH}]
    container.setdefault("volumeMounts", []).append({"name": "scratch", "mountPath": SCRATCH})
    empty = {}
    if given.scratch:
        container["resources"]["requests"]["ephemeral-storage"] = empty["sizeLimit"] = f"{given.scratch}Gi"
    pod.setdefault("volumes", []).append({"name": "scratch", "emptyDir": empty})
    return publish


def jobs(given):
    for stage, parts, memory in stages.stages(given):
        yield job(given, f"{given.name}-{stage}", stages.work(given, stage, parts, memory), parts, memory, given.gpu and stage == 0)
    yield with_scratch(given, job(given, f"{given.name}-publish", stages.publish(given), 1, given.mem or stages.LEAST_MIB))


def main():
    words = stages.parser(__doc__.split("\n")[0])
    words.add_argument("--secret", help="a Secret whose entries become variables: keys of the storage")
    words.add_argument("--volume", metavar="CLAIM:PATH", help="a PersistentVolumeClaim and where tasks see it, for a plan that is a folder")
    words.add_argument("--parallel", type=int, default=1000, help="most pods of a stage at the same time [1000]")
    words.add_argument("--scratch", type=int, metavar="GIB", help="room for the dataset on the node that publishes it [not asked for: what the node has]")
    for document in jobs(words.parse_args()):
        # Before the first one, too: kubectl takes a stream that begins with a brace for JSON, and stops at the second document.
        print("---\n" + json.dumps(document, indent=2))


if __name__ == "__main__":
    main()

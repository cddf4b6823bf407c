#!/usr/bin/env python3
"""A plan as requests to AWS Batch: definition.json for RegisterJobDefinition, then one for SubmitJob a stage; submit.sh sends them.

  deploy/aws-batch/jobs.py /vsis3/bucket/plan -o /vsis3/bucket/dem.sqlite --image REGISTRY/cordillera --queue QUEUE --role ARN --into requests/

Tasks have the keys of the storage from the job role. `@NAME` in dependsOn stands for the id that Batch gives to that job."""
import glob
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import stages  # noqa: E402

MOST_OF_AN_ARRAY = 10000


def definition(given):
    resources = [{"type": "VCPU", "value": str(given.cpus)}, {"type": "MEMORY", "value": str(stages.memory_mib(given))}]
    return {
        "jobDefinitionName": given.name, "type": "container", "platformCapabilities": ["EC2"],
        "containerProperties": {"image": given.image, "command": ["--version"], "resourceRequirements": resources,
                                "environment": stages.variables(given), **({"jobRoleArn": given.role} if given.role else {})},
        # 75 may succeed later, and so may a machine that was taken away; the rest fails again.
        "retryStrategy": {"attempts": min(10, given.retries + 1), "evaluateOnExit": [
            {"onExitCode": "75", "action": "RETRY"},
            {"onStatusReason": "Host EC2*", "action": "RETRY"},
            {"onReason": "*", "action": "EXIT"}]},
    }


def job(given, name, arguments, parts, after, memory, gpu=False):
    request = {"jobName": name, "jobQueue": given.queue, "jobDefinition": given.name, "containerOverrides": {"command": arguments}}
    needs = request["containerOverrides"]["resourceRequirements"] = [{"type": "MEMORY", "value": str(memory)}]
    if gpu:
        needs.append({"type": "GPU", "value": "1"})
    if parts > 1:  # an array of one is refused
        request["arrayProperties"] = {"size": parts}
    if after:
        request["dependsOn"] = [{"jobId": f"@{after}"}]
    return request


def requests(given):
    """(file name, request) in the order in which they are to be sent."""
    yield "definition.json", definition(given)
    after = None
    for stage, parts, memory in stages.stages(given):
        name = f"{given.name}-{stage}"
        yield f"{stage:02}.json", job(given, name, stages.work(given, stage, parts, memory), parts, after, memory, given.gpu and stage == 0)
        after = name
    yield "publish.json", job(given, f"{given.name}-publish", stages.publish(given), 1, after, given.mem or stages.LEAST_MIB)


def main():
    words = stages.parser(__doc__.split("\n")[0])
    words.add_argument("--queue", required=True, help="a job queue")
    words.add_argument("--role", help="ARN of the role that tasks have: may read the sources, read and write the plan")
    words.add_argument("--into", required=True, help="folder for the requests")
    given = words.parse_args()
    given.parts = min(given.parts, MOST_OF_AN_ARRAY)
    os.makedirs(given.into, exist_ok=True)
    for earlier in glob.glob(os.path.join(glob.escape(given.into), "[0-9]*.json")):  # of a stage that is done meanwhile
        os.remove(earlier)
    for name, request in requests(given):
        with open(os.path.join(given.into, name), "w", encoding="utf-8") as out:
            json.dump(request, out, indent=2)
            out.write("\n")


if __name__ == "__main__":
    main()

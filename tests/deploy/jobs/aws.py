"""Requests as deploy/aws-batch/jobs.py writes them, against the service model of botocore: aws.py FOLDER. Exits with 77 without botocore."""
import copy
import json
import os
import sys

try:
    import botocore.loaders
    import botocore.model
    import botocore.validate
except ImportError:
    print("AWS Batch is left out; missing: botocore (Debian: python3-botocore)")
    sys.exit(77)

service = botocore.model.ServiceModel(botocore.loaders.Loader().load_service_model("batch", "service-2"))


def wrong(operation, request):
    report = botocore.validate.ParamValidator().validate(request, service.operation_model(operation).input_shape)
    return report.generate_report() if report.has_errors() else ""


folder = sys.argv[1]
names = sorted(name for name in os.listdir(folder) if name.endswith(".json"))
assert "definition.json" in names and "publish.json" in names and "00.json" in names, names
requests = {}
for name in names:
    with open(os.path.join(folder, name), encoding="utf-8") as file:
        requests[name] = json.load(file)
    found = wrong("RegisterJobDefinition" if name == "definition.json" else "SubmitJob", requests[name])
    assert not found, f"{name}: {found}"
    size = requests[name].get("arrayProperties", {}).get("size", 2)
    assert 2 <= size <= 10000, f"{name}: an array of {size}"

# What the model must refuse.
for spoil in (lambda r: r.pop("jobQueue"), lambda r: r.update(depends=[]), lambda r: r["arrayProperties"].update(size="12")):
    broken = copy.deepcopy(requests["00.json"])
    broken.setdefault("arrayProperties", {"size": 2})
    spoil(broken)
    assert wrong("SubmitJob", broken), "a spoilt request passes"
print(f"{len(names)} requests are valid, by botocore {botocore.__version__}")

"""Finding 9: one dataset with many changes, and those who wait behind it."""
import json

from attack import case
from client import cone

OPTIONS = "crs=EPSG:4326&vertical_datum=ellipsoid&error=2"
CHANGES = 12


@case("9 a raster behind a dataset with 12 pending changes", expect="ready after 3 of them at most", holds=lambda done: done <= 3)
def changes(attack):
    server = attack.start()  # one build at a time

    def post(path, body):
        status, _, answer = server.ask("POST", path, body)
        assert status == 202, answer
        return json.loads(answer)

    changed = post("/v1/datasets?name=a.asc&updates=1&" + OPTIONS, cone())["id"]
    assert server.wait(changed) == "ready"
    for number in range(CHANGES):
        post("/v1/datasets/%s/sources?name=%d.asc" % (changed, number), cone(120 + number))
    other = post("/v1/datasets?name=b.asc&" + OPTIONS, cone())["id"]
    before = ended(server, changed)
    assert server.wait(other) == "ready"
    return ended(server, changed) - before


def ended(server, dataset):
    listed = json.loads(server.ask("GET", "/v1/datasets/%s/sources" % dataset)[2])["changes"]
    return sum(change["state"] != "pending" for change in listed)

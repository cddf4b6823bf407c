"""What a user of the Python client does, with the module from its wheel. python_client.py RASTER FINE; the server is $CORDILLERA_SERVER.
FINE is a raster of several blocks."""
import contextlib
import io
import json
import os
import sys
import threading
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import cutting_proxy  # noqa: E402
import cordillera  # noqa: E402
from cordillera import service as services, uploads  # noqa: E402

RASTER, FINE = sys.argv[1:]
BOX = (-71.4, 44.2, -71.2, 44.3)
SERVER = os.environ["CORDILLERA_SERVER"]
uploads.PART = os.path.getsize(RASTER) // 7


class Killed(Exception):
    pass


def killed_in_the_middle(service):
    """A process that ends after the second part."""
    def sent(done, total):
        if done >= 2 * uploads.PART:
            raise Killed

    try:
        service.post(RASTER, resume=True, error=50, sent=sent)
    except Killed:
        return
    sys.exit("the whole raster went in two parts")


def resumed(service):
    seen = []
    dataset = service.post(RASTER, resume=True, error=1, pixels="lattice", sent=lambda done, total: seen.append(done))
    # A connection that broke between two parts is told as the place where it stands.
    assert seen[0] >= 2 * uploads.PART, "it began at %s instead of going on" % seen[0]
    assert seen[-1] == os.path.getsize(RASTER)
    return dataset


def refused(what, call):
    try:
        call()
    except cordillera.Problem as problem:
        assert problem.type == what, "%s instead of %s: %s" % (problem.type, what, problem)
        return problem
    sys.exit("nothing was wrong with what should be " + what)


def plain(address):
    with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(address) as answer:
        return answer.read()


def heights(dataset):
    places = [(-71.3033, 44.2706), (-71.25, 44.2)]
    one = dataset.elevation(*places[0])
    assert one == dataset.elevations(places)[0]
    answer = json.loads(plain(dataset.url + "/elevation?points=-71.3033,44.2706"))
    assert one.orthometric_m == answer["points"][0]["orthometric_height"] and one.stated_error_m == answer["stated_max_error"]
    assert abs(one.orthometric_m - 1908) < 60, one  # Mount Washington, 1,917 m, in three arc seconds
    assert dataset.elevation(0, 0).ellipsoidal_m is None
    assert len(dataset.elevations(places * 2501)) == 5002
    profile = dataset.profile(places, samples=7)
    assert [h.distance_m for h in profile.heights][::6] == [0, profile.length_m]
    assert profile.heights[0].orthometric_m == one.orthometric_m and len(profile.heights) == 7
    coarse = dataset.elevation(*places[0], level=5)
    assert coarse.stated_error_m > one.stated_error_m


def given_in_other_ways(service):
    """Bytes, files, a stream that cannot be read twice, an address, a dry run; lists and None as values."""
    with open(RASTER, "rb") as file:
        data = file.read()
        made = [service.post(data, name="bytes.tif", error=60, bbox=BOX, keep=None),
                service.post(file, keep=[0.5, 0.25], bbox=list(BOX), resume=True)]
    reading, writing = os.pipe()
    thread = threading.Thread(target=lambda: write_all(writing, data))
    thread.start()
    with open(reading, "rb") as pipe:
        made.append(service.post(pipe, error=60, bbox=BOX))
    thread.join()
    assert [dataset.wait(600).status()["name"] for dataset in made] == ["bytes.tif", os.path.basename(RASTER), "raster"]
    assert made[1].manifest()["options"]["keep"] == [0.5, 0.25] and made[0].manifest()["options"]["bbox"] == list(BOX)
    assert [d.id for d in service.datasets(bbox=BOX, q="bytes")] == [made[0].id]
    for wrong, call in ((TypeError, lambda: service.post(io.StringIO("text"))), (ValueError, service.post), (ValueError, lambda: service.dataset("")),
                        (ValueError, lambda: service.post(RASTER, source="https://example.org/dem.tif"))):
        try:
            call()
        except wrong:
            continue
        sys.exit("nothing was wrong with what should be a " + wrong.__name__)
    refused("option-forbidden", lambda: service.post(source="https://example.org/dem.tif"))
    estimate = service.post(RASTER, dry_run=True, error=60)
    assert estimate["dry_run"] and estimate["manifest"]["levels"]
    for dataset in made:
        dataset.delete()


def write_all(pipe, data):
    with open(pipe, "wb") as file:
        file.write(data)


def changed(service):
    """Another title; rasters that come and go; a change that fails is told to who asked for it, and to nobody else."""
    def sent(done, total):
        seen.append(done)
        if len(seen) > 1 and done < seen[-2]:
            raise Killed  # with the second raster under way

    seen = []
    options = {"error": 60, "bbox": BOX, "crs": "EPSG:4326", "resume": True}
    with contextlib.suppress(Killed):
        service.post([RASTER, RASTER], sent=sent, **options)
    begun = [d.id for d in service.datasets(limit=1)]
    dataset = service.post([RASTER, RASTER], **options).wait(600)
    assert [dataset.id] == begun, "another dataset than that of the first raster"
    assert dataset.edit(title="White Mountains")["title"] == "White Mountains"
    first, second = dataset.sources()
    assert [first["options"], second["options"]] == [{"crs": "EPSG:4326"}] * 2, (first, second)
    third = dataset.add_source(RASTER, position=2, name="third.tif", resume=True)
    assert [source["id"] for source in dataset.wait(600).sources()] == [first["id"], second["id"], third]
    dataset.replace_source(third, position=0)
    dataset.remove_source(second["id"])
    assert [source["id"] for source in dataset.wait(600).sources()] == [third, first["id"]]
    served, before = [version["number"] for version in dataset.versions()]
    assert [version["number"] for version in dataset.rollback()] == [before]
    assert [version["number"] for version in dataset.rollback(before)] == [before]
    dataset.add_source(b"no raster", name="bad.tif")
    refused("raster-format-unsupported", lambda: dataset.wait(600))
    assert dataset.status()["updates"]["last"]["error"]
    dataset.wait(600)
    service.dataset(dataset.id).wait(600)
    refused("source-unknown", lambda: dataset.remove_source("none"))
    dataset.delete()


def lazy(service):
    dataset = service.post(FINE, build="lazy", error=50, pixels="lattice").wait(600)
    status = dataset.status()
    assert status["state"] != "ready" and status["provisional"], status["state"]
    assert dataset.edit(build="full")["build"] == "full"
    dataset.delete()


def main():
    direct = cordillera.Service(SERVER)
    with cutting_proxy.between(int(SERVER.rsplit(":", 1)[1]), after=os.path.getsize(RASTER) // 5, often=3) as port:
        service = cordillera.Service("http://127.0.0.1:%d" % port, patience_s=240)
        killed_in_the_middle(service)
        dataset = resumed(service)
        stages = [progress.stage for progress in dataset.watch()]
        order = ["queued", "fetch", "provisional", "open", "plan", "build", "merge", "publish"]  # a short stage may go by between two looks
        assert "build" in stages and stages == sorted(stages, key=order.index), stages
    dataset = direct.dataset(dataset.id).wait()
    assert dataset.status()["state"] == "ready" and dataset.manifest()["levels"]
    assert not os.listdir(os.path.join(os.environ["XDG_STATE_HOME"], "cordillera", "uploads"))
    assert dataset.tile(8, 154, 190) == plain(dataset.url + "/tiles/8/154/190.drc")
    assert dataset.tile(8, 154, 190, "glb")[:4] == b"glTF"
    assert dataset.tile(8, 154, 190, "terrain") == dataset.fetch("terrain/8/154/190.terrain")
    assert refused("tile-unknown", lambda: dataset.tile(8, 0, 0)).status == 404
    heights(dataset)

    other = direct.post(RASTER, error=60, bbox="-71.4,44.2,-71.2,44.3")  # in one request
    services.PAGE = 1
    assert [d.id for d in direct.datasets()] == [other.id, dataset.id]
    services.PAGE = 100
    assert [d.id for d in direct.datasets(limit=1)] == [other.id]
    other.delete()
    assert [d.id for d in direct.datasets()] == [dataset.id]
    assert refused("dataset-unknown", other.status).status == 404
    assert "accepted" in str(refused("option-invalid", lambda: direct.post(RASTER, error=-1)))
    refused("service-unreachable", cordillera.Service("http://127.0.0.1:1", patience_s=0).version)

    given_in_other_ways(direct)
    changed(direct)
    lazy(direct)

    page = dataset._repr_html_()
    assert page.startswith("<a ") and dataset.viewer_url in page, page
    assert plain(dataset.viewer_url)
    print("ok")


main()

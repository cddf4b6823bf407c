"""What a user of the Python client does, with the module from its wheel. python_client.py RASTER; the server is $CORDILLERA_SERVER."""
import json
import os
import sys
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import cutting_proxy  # noqa: E402
import cordillera  # noqa: E402
from cordillera import uploads  # noqa: E402

RASTER = sys.argv[1]
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
    assert [d.id for d in direct.datasets(limit=1)] == [other.id, dataset.id]
    other.delete()
    assert [d.id for d in direct.datasets()] == [dataset.id]
    assert refused("dataset-unknown", other.status).status == 404
    assert "accepted" in str(refused("option-invalid", lambda: direct.post(RASTER, error=-1)))
    refused("service-unreachable", cordillera.Service("http://127.0.0.1:1", patience_s=0).version)

    page = dataset._repr_html_()
    assert page.startswith("<a ") and dataset.viewer_url in page, page
    assert plain(dataset.viewer_url)
    print("ok")


main()

#!/usr/bin/env python3
"""check, vacuum, backup, restore and uploads in parts, with the real program:  upkeep.py PROGRAM"""
import json
import os
import shutil
import sqlite3
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from client import Server, cone, noise, tiles  # noqa: E402
import processes  # noqa: E402

OPTIONS = "crs=EPSG:4326&vertical_datum=ellipsoid&error=5"


def expect(holds, what):
    if not holds:
        print("upkeep: " + what)
        sys.exit(1)


def run(program, *words):
    ended = subprocess.run([program, *words], capture_output=True, text=True)
    return ended.returncode, ended.stdout + ended.stderr


def post(server, name, raster):
    status, _, body = server.ask("POST", "/v1/datasets?%s&name=%s" % (OPTIONS, name), raster)
    expect(status == 202, "%s: %d %s" % (name, status, body))
    dataset = json.loads(body)["id"]
    expect(server.wait(dataset) == "ready", name + " was not built")
    return dataset


def upload_survives_a_kill(program, folder):
    raster = cone(44, 700)
    server = Server(program, folder)
    status, headers, _ = server.ask("POST", "/v1/uploads", headers={"Upload-Length": str(len(raster)), "Upload-Metadata": "filename Y29uZS5hc2M="})
    expect(status == 201, "no upload begins")
    place = "/v1/" + headers["location"]
    part = {"Content-Type": "application/offset+octet-stream"}
    status, headers, _ = server.ask("PATCH", place, raster[:5000], dict(part, **{"Upload-Offset": "0"}))
    expect((status, headers.get("upload-offset")) == (204, "5000"), "the first part was answered with %d" % status)
    status, _, _ = server.ask("PATCH", place, raster[:10], dict(part, **{"Upload-Offset": "4999"}))
    expect(status == 409, "a wrong offset was answered with %d" % status)
    upload = place.rsplit("/", 1)[1]
    status, _, _ = server.ask("POST", "/v1/datasets?%s&upload=%s" % (OPTIONS, upload))
    expect(status == 409, "half an upload was answered with %d" % status)
    server.kill()
    server = Server(program, folder)
    status, headers, _ = server.ask("HEAD", place)
    expect((status, headers.get("upload-offset")) == (200, "5000"), "after a kill the upload stands at %s" % headers.get("upload-offset"))
    status, _, _ = server.ask("PATCH", place, raster[5000:] + b"more", dict(part, **{"Upload-Offset": "5000"}))
    expect(status == 413, "more bytes than announced were answered with %d" % status)
    offset = int(server.ask("HEAD", place)[1]["upload-offset"])
    status, headers, _ = server.ask("PATCH", place, raster[offset:], dict(part, **{"Upload-Offset": str(offset)}))
    expect(status == 204 and headers["upload-offset"] == str(len(raster)), "the rest was answered with %d" % status)
    status, _, body = server.ask("POST", "/v1/datasets?%s&upload=%s" % (OPTIONS, upload))
    expect(status == 202 and json.loads(body)["name"] == "cone.asc", "the dataset was answered with %d %s" % (status, body))
    dataset = json.loads(body)["id"]
    status, _, body = server.ask("POST", "/v1/datasets?%s&upload=%s" % (OPTIONS, upload))
    expect(json.loads(body)["id"] == dataset, "asking again made another dataset")
    expect(server.wait(dataset) == "ready", "the upload was not built")
    expect(server.ask("HEAD", place)[0] == 404, "the upload is still there")
    whole = post(server, "cone.asc", raster)
    stores = [os.path.join(server.data, "datasets", d, "dataset.sqlite") for d in (dataset, whole)]
    expect(tiles(stores[0]) == tiles(stores[1]), "in parts and in one piece give different tiles")
    for d in (dataset, whole):
        server.ask("DELETE", "/v1/datasets/" + d)
    server.stop()


def damage(store, sql):
    database = sqlite3.connect(store)
    database.execute(sql)
    database.commit()
    database.close()


def check_finds_damage(program, store, raster):
    code, said = run(program, "check", store, "--source", raster)
    expect(code == 0 and "sound" in said, "a sound store is said not to be: " + said)
    broken = store + ".broken.sqlite"
    for name, sql, words in [
            ("a byte of a tile", "UPDATE blobs SET bytes = zeroblob(length(bytes)) WHERE id = (SELECT max(id) FROM blobs)", "not those of their name"),
            ("a record", "UPDATE tiles SET error = error / 2 WHERE level = (SELECT max(level) FROM tiles)", "row and its record"),
            ("a region of the tree", "UPDATE nodes SET high = high - 50", "nodes"),
            ("a tile", "DELETE FROM tiles WHERE level = (SELECT max(level) FROM tiles) AND x = (SELECT min(x) FROM tiles WHERE level = (SELECT max(level) FROM tiles))", "manifest"),
            ("bytes of a tile", "UPDATE tiles SET drc = x'00' WHERE level = (SELECT max(level) FROM tiles)", "bytes are missing"),
            ("its neighbour's bytes", "UPDATE tiles SET drc = (SELECT drc FROM tiles t WHERE t.drc <> tiles.drc LIMIT 1)", "its .drc is another tile's")]:
        shutil.copy(store, broken)
        damage(broken, sql)
        code, said = run(program, "check", broken)
        expect(code == 1 and words in said, "%s was changed, and check said %d: %s" % (name, code, said[-1500:]))
    shutil.copy(store, broken)
    with open(broken, "r+b") as file:
        file.truncate(os.path.getsize(broken) // 2)
    expect(run(program, "check", broken)[0] == 1, "half a file is sound")
    other = raster + ".other.asc"
    with open(other, "wb") as file:
        file.write(cone(40, 1000))
    code, said = run(program, "check", store, "--source", other)
    expect(code == 1 and "off the raster" in said, "another raster fits the stated errors: " + said)
    os.remove(broken)


def check_measures_a_folder(program, folder):
    """Its samples are those that the build moved towards the pixels."""
    raster, built = os.path.join(folder, "noise.asc"), os.path.join(folder, "built")
    with open(raster, "wb") as file:
        file.write(noise(60))
    code, said = run(program, "build", raster, "-o", built, "--crs", "EPSG:4326", "--error", "20", "--quiet")
    expect(code == 0, "no folder was built: " + said)
    code, said = run(program, "check", built, "--source", raster)
    expect(code == 0 and "sound" in said, "a sound folder is said not to be: " + said)


def check_measures_several_rasters(program, folder):
    names = [os.path.join(folder, name) for name in ("first.asc", "next.asc")]
    for name, raster in zip(names, (cone(40, 900), noise(60))):
        with open(name, "wb") as file:
            file.write(raster)
    store = os.path.join(folder, "both.sqlite")
    code, said = run(program, "build", *names, "-o", store, "--crs", "EPSG:4326", "--error", "20", "--quiet")
    expect(code == 0, "two rasters were not built: " + said)
    first, following = (("--source", name) for name in names)
    code, said = run(program, "check", store, *first, *following)
    expect(code == 0 and "tiles measured" in said, "a sound store of two rasters is said not to be: " + said)
    code, said = run(program, "check", store, *following, *first)
    expect(code == 1 and "off the raster" in said, "they fit in another order, too: " + said)


def backup_while_it_runs(program, folder):
    server = Server(program, folder)
    ready = post(server, "a.asc", cone(40, 900))
    expected = tiles(os.path.join(server.data, "datasets", ready, "dataset.sqlite"))
    place, restored = os.path.join(folder, "copy"), os.path.join(folder, "restored", "data")
    code, said = run(program, "backup", server.data, "-o", place)
    expect(code == 0, "backup: " + said)
    expect(run(program, "backup", server.data, "-o", place)[0] == 1, "a backup was written over another one")
    expect(run(program, "vacuum", server.data)[0] == 1, "vacuum took a folder that is in use")
    server.ask("DELETE", "/v1/datasets/" + ready)
    server.stop()
    os.makedirs(os.path.dirname(restored))
    code, said = run(program, "restore", place, "--data", restored)
    expect(code == 0, "restore: " + said)
    again = Server(program, os.path.join(folder, "restored"))
    expect(again.state(ready) == "ready", "the restored dataset is not ready")
    expect(tiles(os.path.join(restored, "datasets", ready, "dataset.sqlite")) == expected, "the restored tiles are others")
    again.stop()
    store = os.path.join(place, "datasets", ready, "dataset.sqlite")
    damage(store, "CREATE TABLE extra(x)")
    code, said = run(program, "restore", place, "--data", os.path.join(folder, "third"))
    expect(code == 1 and "not what was backed up" in said, "a changed backup was restored: " + said)
    expect(not os.path.exists(os.path.join(folder, "third")), "half a restored folder is left")
    return restored, ready


def vacuum_and_versions(program, data, dataset):
    store = os.path.join(data, "datasets", dataset, "dataset.sqlite")
    expected = tiles(store)
    damage(store, "INSERT INTO blobs(hash, bytes) VALUES(x'00', zeroblob(3000000))")
    os.makedirs(os.path.join(data, "datasets", "nobody"))
    open(os.path.join(data, "datasets", dataset, "left.tmp"), "w").close()
    code, said = run(program, "vacuum", data)
    expect(code == 0, "vacuum: " + said)
    expect(os.path.getsize(store) < 1000000 and tiles(store) == expected, "the store was not made smaller, or changed: " + said)
    expect(sorted(os.listdir(os.path.join(data, "datasets"))) == [dataset], "a folder without a dataset is left")
    expect(sorted(os.listdir(os.path.join(data, "datasets", dataset))) == ["dataset.json", "dataset.sqlite"], "a file that nobody needs is left")
    code, said = run(program, "check", data, "--json")
    expect(code == 0 and json.loads(said)["sound"], "check of the data folder: " + said)
    registry = os.path.join(data, "registry.sqlite")
    damage(registry, "PRAGMA user_version = 0")
    server = Server(program, os.path.dirname(data))
    expect(server.state(dataset) == "ready", "an earlier folder was not taken over")
    server.stop()
    damage(registry, "PRAGMA user_version = 99")
    code, said = run(program, "serve", "--listen", "127.0.0.1:0", "--data", data)
    expect(code == 1 and "version 99" in said, "a later folder was taken: " + said)


def main():
    program = os.path.abspath(sys.argv[1])
    with processes.folder("cordillera-upkeep-") as folder:
        upload_survives_a_kill(program, folder)
        raster = os.path.join(folder, "a.asc")
        with open(raster, "wb") as file:
            file.write(cone(40, 900))
        store = os.path.join(folder, "a.sqlite")
        code, said = run(program, "build", raster, "-o", store, "--crs", "EPSG:4326", "--vertical-datum", "ellipsoid", "--error", "5", "-q")
        expect(code == 0, said)
        check_finds_damage(program, store, raster)
        check_measures_a_folder(program, folder)
        check_measures_several_rasters(program, folder)
        data, dataset = backup_while_it_runs(program, folder)
        vacuum_and_versions(program, data, dataset)
    print("upkeep: all is well")


if __name__ == "__main__":
    main()

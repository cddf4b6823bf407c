#!/usr/bin/env python3
"""Tiles over HTTP against nginx, which serves the same bytes as files, in one run on one machine.

  bench.py BUILD DEM [--connections 1,32,200] [--seconds 10] [--json FILE] [--write]

Needs wrk and nginx. Each server gets the same list of addresses, in the same order, by wrk's own script. The two take turns, three rounds
each, and the better round counts."""
import argparse
import json
import os
import platform
import re
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request

HERE = os.path.dirname(os.path.abspath(__file__))
ROUNDS = 3
LUA = """
local paths = {}
for line in io.lines(os.getenv("PATHS")) do paths[#paths + 1] = line end
local k = 0
request = function()
  k = k % #paths + 1
  return wrk.format("GET", os.getenv("PREFIX") .. paths[k])
end
done = function(summary, latency)
  io.write(string.format("FIGURES %d %d %d %d %d %d\\n", summary.requests, summary.duration, latency:percentile(50), latency:percentile(99),
    latency:percentile(99.9), summary.errors.status + summary.errors.read + summary.errors.connect + summary.errors.timeout))
end
"""
NGINX = """
worker_processes 2; daemon off; pid {work}/nginx.pid; error_log {work}/error.log;
events {{ worker_connections 4096; }}
http {{
  access_log off; sendfile on; tcp_nopush on; keepalive_requests 100000; etag on;
  client_body_temp_path {work}/t1; proxy_temp_path {work}/t2; fastcgi_temp_path {work}/t3; uwsgi_temp_path {work}/t4; scgi_temp_path {work}/t5;
  server {{ listen 127.0.0.1:{port}; root {folder}; }}
}}
"""


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def wait_for(url):
    for _ in range(300):
        try:
            return urllib.request.urlopen(url).read()
        except OSError:
            time.sleep(0.1)
    sys.exit(f"{url} does not answer")


def wrk(work, port, prefix, paths, connections, seconds):
    """Requests a second, and the latency's 50th, 99th and 99.9th percentile in milliseconds."""
    environment = dict(os.environ, PATHS=paths, PREFIX=prefix)
    threads = min(2, connections)
    out = subprocess.run(["wrk", f"-t{threads}", f"-c{connections}", f"-d{seconds}s", "--timeout", "30s", "-s", os.path.join(work, "wrk.lua"),
                          f"http://127.0.0.1:{port}"], env=environment, capture_output=True, text=True, check=True).stdout
    requests, micros, p50, p99, p999, errors = map(int, re.search(r"FIGURES (.*)", out)[1].split())
    return {"requests_per_s": requests / micros * 1e6, "p50_ms": p50 / 1e3, "p99_ms": p99 / 1e3, "p999_ms": p999 / 1e3, "errors": errors}


def post(cordillera, port, raster):
    """The id of the finished dataset."""
    with open(raster, "rb") as file:
        body = file.read()
    request = urllib.request.Request(f"http://127.0.0.1:{port}/v1/datasets?name={os.path.basename(raster)}", data=body, method="POST",
                                     headers={"Prefer": "wait=600", "Content-Type": "application/octet-stream"})
    return json.load(urllib.request.urlopen(request, timeout=700))["id"]


def table(rows):
    lines = ["| connections | server | requests/s | of nginx | p50 ms | p99 ms | p99.9 ms | p99 / p50 | errors |", "|--:|---|--:|--:|--:|--:|--:|--:|--:|"]
    for row in rows:
        for name in ("nginx", "cordillera"):
            f = row[name]
            lines.append(f"| {row['connections']} | {name} | {f['requests_per_s']:,.0f} | {f['requests_per_s'] / row['nginx']['requests_per_s']:.2f} | "
                         f"{f['p50_ms']:.2f} | {f['p99_ms']:.2f} | {f['p999_ms']:.2f} | {f['p99_ms'] / max(f['p50_ms'], 1e-3):.1f} | {f['errors']} |")
    return "\n".join(lines)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("build")
    arguments.add_argument("dem")
    arguments.add_argument("--connections", default="1,32,200")
    arguments.add_argument("--seconds", type=int, default=10)
    arguments.add_argument("--json")
    arguments.add_argument("--write", action="store_true")
    given = arguments.parse_args()
    cordillera = os.path.join(os.path.abspath(given.build), "bin", "cordillera")
    with tempfile.TemporaryDirectory() as work:
        folder = os.path.join(work, "out")
        subprocess.run([cordillera, "build", given.dem, "-o", folder, "--quiet"], check=True)
        paths = os.path.join(work, "paths")
        tiles = sorted(os.path.relpath(os.path.join(base, name), folder) for base, _, names in os.walk(folder) for name in names
                       if name.endswith((".glb", ".drc")))
        with open(paths, "w", encoding="utf-8") as file:
            file.write("\n".join(tiles) + "\n")
        with open(os.path.join(work, "wrk.lua"), "w", encoding="utf-8") as file:
            file.write(LUA)
        ports = {"nginx": free_port()}
        with open(os.path.join(work, "nginx.conf"), "w", encoding="utf-8") as file:
            file.write(NGINX.format(work=work, port=ports["nginx"], folder=folder))
        os.chmod(work, 0o755)  # nginx's workers are another user where it is started by root
        ports["cordillera"] = free_port()
        running = [subprocess.Popen(["/usr/sbin/nginx", "-c", os.path.join(work, "nginx.conf")], stderr=subprocess.DEVNULL),
                   subprocess.Popen([cordillera, "serve", "--listen", f"127.0.0.1:{ports['cordillera']}", "--data", os.path.join(work, "data")],
                                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)]
        try:
            wait_for(f"http://127.0.0.1:{ports['cordillera']}/readyz")
            wait_for(f"http://127.0.0.1:{ports['nginx']}/manifest.json")
            prefixes = {"nginx": "/", "cordillera": f"/v1/datasets/{post(cordillera, ports['cordillera'], given.dem)}/"}
            for name in ports:  # the same bytes, or nothing is compared
                wanted = open(os.path.join(folder, tiles[0]), "rb").read()
                if wait_for(f"http://127.0.0.1:{ports[name]}{prefixes[name]}{tiles[0]}") != wanted:
                    sys.exit(f"{name} serves other bytes")
            rows = []
            for connections in map(int, given.connections.split(",")):
                rounds = {"nginx": [], "cordillera": []}
                for _ in range(ROUNDS):
                    for name in ports:
                        rounds[name].append(wrk(work, ports[name], prefixes[name], paths, connections, given.seconds))
                rows.append({"connections": connections, **{name: max(found, key=lambda f: f["requests_per_s"]) for name, found in rounds.items()}})
        finally:
            for process in running:
                process.terminate()
                process.wait()
    head = f"{time.strftime('%Y-%m-%d')}, {os.cpu_count()} cores, {platform.machine()}; {len(tiles)} tiles of {os.path.basename(given.dem)}, {given.seconds} s a round"
    text = head + "\n\n" + table(rows) + "\n"
    print(text)
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump({"machine": head, "rows": rows}, file, indent=1)
    if given.write:
        readme = os.path.join(HERE, "README.md")
        with open(readme, encoding="utf-8") as file:
            before = file.read().split("<!-- table of bench.py -->")[0]
        with open(readme, "w", encoding="utf-8") as file:
            file.write(before + "<!-- table of bench.py -->\n\n" + text)


main()

#!/usr/bin/env python3
"""Tiles over HTTP against nginx, which serves the same bytes as files, in one run on one machine.

  bench.py BUILD DEM [--connections 1,32,200,1000] [--seconds 5] [--rounds 5] [--before PROGRAM] [--apart]
           [--upload RASTER] [--json FILE] [--write]

Needs wrk and nginx. Each server gets the same list of addresses, in the same order, by wrk's own script. They take turns, and of all figures
the median of the rounds counts. --before: another cordillera, which is measured beside. --upload: a large raster that is posted, beside a
copy of the file by dd. --apart: the servers have the second half of the cores to themselves, wrk the first: who waits longest is then
decided by the server, and not by which of wrk's and its threads the kernel runs next. --write puts the table of such a run behind the other."""
import argparse
import json
import os
import platform
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
import processes  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
MARK = "<!-- table of bench.py -->"
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
worker_processes {workers}; worker_rlimit_nofile 8192; daemon off; pid {work}/nginx.pid; error_log {work}/error.log;
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


def processor_seconds(process):
    """Of a server and its children. Unlike the rate it hardly depends on what else the machine does."""
    ticks = 0
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
                fields = file.read().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(pid) == process.pid or int(fields[1]) == process.pid:
            ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def measured(process, *asked):
    before = processor_seconds(process)
    figures = wrk(*asked)
    figures["cpu_us"] = (processor_seconds(process) - before) / max(1, figures["requests"]) * 1e6
    return figures


def halves():
    """Cores of wrk, and of the servers when they are apart."""
    cores = sorted(os.sched_getaffinity(0))
    return cores[:len(cores) // 2], cores[len(cores) // 2:]


def wrk(work, port, prefix, paths, connections, seconds):
    """Requests a second, and the latency's 50th, 99th and 99.9th percentile in milliseconds."""
    environment = dict(os.environ, PATHS=paths, PREFIX=prefix)
    threads = min(2, connections)
    out = subprocess.run(["wrk", f"-t{threads}", f"-c{connections}", f"-d{seconds}s", "--timeout", "30s", "-s", os.path.join(work, "wrk.lua"),
                          f"http://127.0.0.1:{port}"], env=environment, capture_output=True, text=True, check=True).stdout
    requests, micros, p50, p99, p999, errors = map(int, re.search(r"FIGURES (.*)", out)[1].split())
    return {"requests": requests, "requests_per_s": requests / micros * 1e6, "p50_ms": p50 / 1e3, "p99_ms": p99 / 1e3, "p999_ms": p999 / 1e3, "errors": errors}


def post(port, raster):
    """The id of the finished dataset."""
    with open(raster, "rb") as file:
        body = file.read()
    request = urllib.request.Request(f"http://127.0.0.1:{port}/v1/datasets?name={os.path.basename(raster)}", data=body, method="POST",
                                     headers={"Prefer": "wait=600", "Content-Type": "application/octet-stream"})
    return json.load(urllib.request.urlopen(request, timeout=700))["id"]


def median_of(rounds):
    return {name: statistics.median(f[name] for f in rounds) for name in rounds[0]}


def table(rows, names):
    lines = ["| connections | server | requests/s | of nginx | p50 ms | p99 ms | p99.9 ms | p99 / p50 | CPU µs a request | errors |",
             "|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|"]
    for row in rows:
        for name in names:
            f = row[name]
            lines.append(f"| {row['connections']} | {name} | {f['requests_per_s']:,.0f} | {f['requests_per_s'] / row['nginx']['requests_per_s']:.2f} | "
                         f"{f['p50_ms']:.2f} | {f['p99_ms']:.2f} | {f['p999_ms']:.2f} | {f['p99_ms'] / max(f['p50_ms'], 1e-3):.1f} | {f['cpu_us']:.0f} | {f['errors']:.0f} |")
    return "\n".join(lines)


def upload(port, raster):
    """Seconds until a raster is accepted: received and on disk. Its build is cancelled."""
    begin = time.monotonic()
    out = subprocess.run(["curl", "-sS", "-f", "-T", raster, "-X", "POST", "-H", "Expect:", f"http://127.0.0.1:{port}/v1/datasets?name={os.path.basename(raster)}"],
                         capture_output=True, text=True, check=True).stdout
    took = time.monotonic() - begin
    urllib.request.urlopen(urllib.request.Request(f"http://127.0.0.1:{port}/v1/datasets/{json.loads(out)['id']}", method="DELETE"))
    return took


def copied(work, raster):
    begin = time.monotonic()
    subprocess.run(["dd", f"if={raster}", f"of={work}/copy", "bs=256k", "conv=fsync"], check=True, stderr=subprocess.DEVNULL)
    took = time.monotonic() - begin
    os.remove(f"{work}/copy")
    return took


def uploads(work, ports, raster, rounds):
    """Megabytes a second, the median of the rounds."""
    size = os.path.getsize(raster) / 1e6
    rates = {name: [] for name in [*ports, "dd"]}
    for _ in range(rounds):
        for name, port in ports.items():
            rates[name].append(size / upload(port, raster))
        rates["dd"].append(size / copied(work, raster))
    return {name: statistics.median(found) for name, found in rates.items()}


def start(program, work, name, port):
    return processes.start([program, "serve", "--listen", f"127.0.0.1:{port}", "--data", os.path.join(work, name)],
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=dict(os.environ, CORDILLERA_MAX_CLIENT_CONNECTIONS="4000"))


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("build")
    arguments.add_argument("dem")
    arguments.add_argument("--connections", default="1,32,200,1000")
    arguments.add_argument("--seconds", type=int, default=5)
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--before")
    arguments.add_argument("--apart", action="store_true")
    arguments.add_argument("--upload")
    arguments.add_argument("--json")
    arguments.add_argument("--write", action="store_true")
    given = arguments.parse_args()
    programs = {"cordillera": os.path.join(os.path.abspath(given.build), "bin", "cordillera")}
    if given.before:
        programs["before"] = os.path.abspath(given.before)
    names = ["nginx", *programs]
    all_cores = os.sched_getaffinity(0)
    with tempfile.TemporaryDirectory() as work:
        folder = os.path.join(work, "out")
        subprocess.run([programs["cordillera"], "build", given.dem, "-o", folder, "--quiet"], check=True)
        paths = os.path.join(work, "paths")
        tiles = sorted(os.path.relpath(os.path.join(base, name), folder) for base, _, files in os.walk(folder) for name in files
                       if name.endswith((".glb", ".drc")))
        with open(paths, "w", encoding="utf-8") as file:
            file.write("\n".join(tiles) + "\n")
        with open(os.path.join(work, "wrk.lua"), "w", encoding="utf-8") as file:
            file.write(LUA)
        ports = {name: free_port() for name in names}
        os.chmod(work, 0o755)  # nginx's workers are another user where it is started by root
        if given.apart:
            os.sched_setaffinity(0, halves()[1])
        # As many as cordillera has loops: its "auto" counts cores that it may not use.
        workers = len(os.sched_getaffinity(0))
        with open(os.path.join(work, "nginx.conf"), "w", encoding="utf-8") as file:
            file.write(NGINX.format(work=work, port=ports["nginx"], folder=folder, workers=workers))
        running = {"nginx": processes.start(["/usr/sbin/nginx", "-c", os.path.join(work, "nginx.conf")], stderr=subprocess.DEVNULL)}
        running.update((name, start(program, work, name, ports[name])) for name, program in programs.items())
        try:
            wait_for(f"http://127.0.0.1:{ports['nginx']}/manifest.json")
            prefixes = {"nginx": "/"}
            for name in programs:
                wait_for(f"http://127.0.0.1:{ports[name]}/readyz")
                prefixes[name] = f"/v1/datasets/{post(ports[name], given.dem)}/"
            wanted = open(os.path.join(folder, tiles[0]), "rb").read()
            for name in names:  # the same bytes, or nothing is compared
                if wait_for(f"http://127.0.0.1:{ports[name]}{prefixes[name]}{tiles[0]}") != wanted:
                    sys.exit(f"{name} serves other bytes")
            if given.apart:
                os.sched_setaffinity(0, all_cores)
                os.sched_setaffinity(0, halves()[0])
            rows = []
            for connections in map(int, given.connections.split(",")):
                rounds = {name: [] for name in names}
                for _ in range(given.rounds):
                    for name in names:
                        rounds[name].append(measured(running[name], work, ports[name], prefixes[name], paths, connections, given.seconds))
                rows.append({"connections": connections, **{name: median_of(found) for name, found in rounds.items()}})
            sent = uploads(work, {name: ports[name] for name in programs}, given.upload, given.rounds) if given.upload else {}
        finally:
            for process in running.values():
                process.terminate()
                process.wait()
    head = (f"{time.strftime('%Y-%m-%d')}, {len(all_cores)} cores, {platform.machine()}; {len(tiles)} tiles of {os.path.basename(given.dem)}, "
            f"medians of {given.rounds} rounds of {given.seconds} s" + (", servers and clients on cores of their own" if given.apart else ""))
    text = head + "\n\n" + table(rows, names) + "\n"
    if sent:
        text += (f"\nUpload of a raster of {os.path.getsize(given.upload) / 1e6:,.0f} MB, until it is accepted (received, hashed and on disk), MB/s: "
                 + ", ".join(f"{name} {rate:,.0f}" for name, rate in sent.items()) + ".\n")
    print(text)
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump({"machine": head, "rows": rows, "upload_mb_per_s": sent}, file, indent=1)
    if given.write:
        readme = os.path.join(HERE, "README.md")
        with open(readme, encoding="utf-8") as file:
            parts = file.read().split(MARK)  # what is said, the table, that of --apart
        parts[1 + given.apart:2 + given.apart] = ["\n\n" + text + ("" if given.apart else "\n")]
        with open(readme, "w", encoding="utf-8") as file:
            file.write(MARK.join(parts))


main()

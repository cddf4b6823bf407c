#!/usr/bin/env python3
"""Writes what nginx answers to the requests of smuggling.tsv into its last column:  record_nginx.py [NGINX]

By hand, with Debian's nginx-light: the table is read by people who ask how strict others are, and by no test. nginx stands as a proxy before a
service that takes everything, so a body is read to its end before it is answered."""
import os
import shutil
import socketserver
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import smuggling  # noqa: E402

sys.path.insert(1, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import processes  # noqa: E402

CONFIG = """
daemon off; master_process off; pid {folder}/pid; error_log {folder}/error.log;
events {{ worker_connections 64; }}
http {{
  access_log off; client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;
  client_body_timeout 2s; client_header_timeout 2s; proxy_ignore_client_abort on;
  server {{ listen 127.0.0.1:{port}; location / {{ proxy_pass http://127.0.0.1:{behind}; }} }}
}}
"""


class TakesAll(socketserver.StreamRequestHandler):
    def handle(self):
        left = 0
        while (line := self.rfile.readline()) not in (b"\r\n", b""):
            if line.lower().startswith(b"content-length:"):
                left = int(line.split(b":")[1])
        self.rfile.read(left)
        self.wfile.write(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")


def free_port():
    with socketserver.TCPServer(("127.0.0.1", 0), None) as server:
        return server.server_address[1]


def wait_for(port):
    while True:
        try:
            return smuggling.answers(port, smuggling.NEXT)
        except ConnectionRefusedError:
            time.sleep(0.02)


def main():
    nginx = sys.argv[1] if len(sys.argv) > 1 else shutil.which("nginx") or sys.exit("nginx is missing: apt-get install nginx-light")
    behind = socketserver.ThreadingTCPServer(("127.0.0.1", 0), TakesAll)
    behind.daemon_threads = True
    threading.Thread(target=behind.serve_forever, daemon=True).start()
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "conf"), "w", encoding="utf-8") as config:
            config.write(CONFIG.format(folder=folder, port=port, behind=behind.server_address[1]))
        process = processes.start([nginx, "-e", os.path.join(folder, "error.log"), "-c", os.path.join(folder, "conf")])
        try:
            wait_for(port)
            recorded = [row[:3] + [smuggling.answers(port, smuggling.bytes_of(row[1]))] for row in smuggling.rows()]
        finally:
            process.kill()
            process.wait()
    smuggling.write(recorded)


if __name__ == "__main__":
    main()

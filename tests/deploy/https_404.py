#!/usr/bin/env python3
"""Speaks https and has nothing:  https_404.py PORT CERTIFICATE KEY"""
import http.server
import ssl
import sys


class Nothing(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_error(404)

    def log_message(self, *words):
        pass


if __name__ == "__main__":
    port, certificate, key = sys.argv[1:]
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", int(port)), Nothing)
    server.socket = context.wrap_socket(server.socket, server_side=True)
    server.serve_forever()

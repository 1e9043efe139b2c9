#!/usr/bin/env python3
"""link_server.py FOLDER LOG - a server of meshes for test_links.sh, in the ways in which servers behave and misbehave.

Prints its port. Each request leaves its path in LOG."""
import http.server
import pathlib
import sys
import time

FOLDER, LOG = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = 'HTTP/1.1'

    def log_message(self, format, *arguments):
        pass

    def send(self, status, body, fields=()):
        self.send_response(status)
        for name, value in fields:
            self.send_header(name, value)
        self.send_header('Content-Length', str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_GET(self):
        with LOG.open('a') as log:
            log.write(self.path + '\n')
        path = self.path.split('?')[0]
        part = path.rsplit('/', 1)[1]
        if part == 'near':
            self.send(302, b'', [('Location', 'thalamus.ply')])
        elif part == 'away':
            self.send(302, b'', [('Location', '/elsewhere/thalamus.ply')])
        elif part == 'file':
            self.send(302, b'', [('Location', 'file:///etc/passwd')])
        elif part == 'round':
            self.send(307, b'', [('Location', 'round')])
        elif part == 'page':
            self.send(200, b'<!DOCTYPE html><title>Sign in</title>', [('Content-Type', 'text/html')])
        elif part == 'missing':
            self.send(404, b'no' * 1000)
        elif part == 'heads':
            self.send(200, b'x', [('X-%d' % i, 'y' * 8000) for i in range(12)])
        elif part == 'line':
            self.send_response(200)
            self.flush_headers()
            self.close_connection = True
            for _ in range(1 << 10):
                self.wfile.write(b'X' * 1024)
        elif part == 'slow':
            self.send_response(200)
            self.send_header('Content-Length', '1000')
            self.end_headers()
            for _ in range(1000):
                self.wfile.write(b'x')
                self.wfile.flush()
                time.sleep(.1)
        elif part in ('long', 'endless'):
            self.send_response(200)
            if part == 'long':
                self.send_header('Content-Length', str(1 << 40))
            self.send_header('Connection', 'close')
            self.end_headers()
            for _ in range(1 << 12):
                self.wfile.write(b'x' * (1 << 16))
        else:
            self.send(200, (FOLDER / part).read_bytes(), [('Content-Type', 'application/octet-stream')])


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request, client_address):
        pass  # a client that hangs up


server = Server(('127.0.0.1', 0), Handler)
print(server.server_port, flush=True)
server.serve_forever()

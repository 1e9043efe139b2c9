"""What the Python tests share: the real daemon, on a port that it keeps when it returns, and a server that misbehaves."""

import http.server
import json
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SRNFD = os.environ.get("SRNFD", str(ROOT / "build" / "srnfd"))
NUCLEI = ROOT / "tests" / "data" / "aal_subcortex"
SLOW = 4 if os.environ.get("SRNFD_SANITIZED") else 1


class Daemon:
    """A running srnfd. ``stop`` drains it, ``kill`` ends it as a power failure would; ``start`` brings it back."""

    def __init__(self, folder, *options):
        self.folder, self.options, self.listen = pathlib.Path(folder), options, "127.0.0.1:0"
        self.log = self.folder / "log"
        self.start()

    def start(self):
        """Starts it; the address stays what it was."""
        environment = {k: v for k, v in os.environ.items() if not k.startswith("SRNF")}
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [SRNFD, "serve", "--listen", self.listen, "--data", str(self.folder / "data"), *self.options],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=log, env=environment,
            )  # fmt: skip
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and self.process.poll() is None:
            found = re.search(r'"event":"listening","address":"([^"]*)"', self.log.read_text())
            if found:
                self.listen = found.group(1)
                self.url = f"http://{self.listen}"
                return
            time.sleep(0.02)
        raise AssertionError("the daemon did not get ready: " + self.log.read_text()[-2000:])

    def kill(self):
        """Ends it at once."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def stop(self):
        """Drains it; fails if it did not end well."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(60)
        assert status == 0, f"the daemon ended with {status}: {self.log.read_text()[-2000:]}"


class Scripted:
    """A server on the loopback that answers by a list of functions, one for each request, and keeps the requests.

    A function gets the handler; ``answer`` makes one. ``drop`` closes the connection without an answer.
    """

    def __init__(self, answers):
        self.seen, left = [], list(answers)
        outer = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
                outer.seen.append((self.command, self.path, dict(self.headers), body, time.monotonic()))
                left.pop(0)(self)

            do_POST = do_DELETE = do_GET

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}"
        threading.Thread(target=self.server.serve_forever, args=(0.02,), daemon=True).start()

    def close(self):
        """Ends it."""
        self.server.shutdown()
        self.server.server_close()


def answer(status, document, **headers):
    """An answer for ``Scripted``: JSON, with headers such as Retry_After=1."""

    def send(handler):
        body = json.dumps(document).encode()
        handler.send_response(status)
        kind = "application/problem+json" if status >= 400 else "application/json"
        for name, value in {"Content-Type": kind, "Content-Length": len(body), **headers}.items():
            handler.send_header(name.replace("_", "-"), str(value))
        handler.end_headers()
        handler.wfile.write(body)

    return send


def drop(handler):
    """Closes the connection without an answer."""
    handler.close_connection = True
    handler.connection.close()


def scratch():
    """A folder that goes away with the returned object."""
    return tempfile.TemporaryDirectory()


def nuclei_table():
    """The twelve nuclei as a table: file, label, subject, side, age."""
    rows = ["file,label,subject,side,age"]
    for side in "LR":
        for k, name in enumerate(("amygdala", "hippocampus", "thalamus", "caudate", "pallidum", "putamen")):
            rows.append(f"{side}_{name}.ply,{'A' if k < 3 else 'B'},{name},{side},{61 - 4 * k}")
    return "\n".join(rows) + "\n"

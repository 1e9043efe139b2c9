#!/usr/bin/env bash
# srnfd-test: timeout 60
#
# test_workers_hostile.sh - a worker whose service answers with what is no lease: nothing of it gets into a path or a
# header, and the worker ends.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

# Answers the first request for a lease with one in which MEMBER is VALUE; prints how the worker ended and what it asked for.
lease_with() { # MEMBER VALUE
    timeout 20 /usr/bin/python3 - "$SRNFD" "$1" "$2" <<'PYTHON'
import http.server, json, subprocess, sys, threading
program, member, value = sys.argv[1:]
lease = {"task": "task-" + "0" * 32, "kind": "pairs", "attempt": 1, "secret": "a" * 32, "expiresInSeconds": 15,
         "inputs": "AAAA", "contents": ["0" * 64]}
lease[member] = [value] if member == "contents" else value
asked, asks = set(), []

class Service(http.server.BaseHTTPRequestHandler):
    def answer(self):
        asked.add(self.path)
        self.rfile.read(int(self.headers.get("Content-Length", 0)))
        is_ask = self.path == "/v1/leases"
        asks.append(is_ask)
        self.send_response(409 if not is_ask else 201 if sum(asks) == 1 else 204)
        self.end_headers()
        if is_ask and sum(asks) == 1:
            self.wfile.write(json.dumps(lease).encode())
    do_GET = do_POST = do_PUT = do_DELETE = answer
    def log_message(self, *arguments):
        pass

service = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Service)
threading.Thread(target=service.serve_forever, daemon=True).start()
worker = subprocess.Popen([program, "worker", "--server", f"http://127.0.0.1:{service.server_address[1]}", "--slots", "1",
                           "--idle-seconds", "0.2"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
try:
    status = worker.wait(8)
except subprocess.TimeoutExpired:
    worker.kill()
    worker.wait()
    status = "none"
print(status, *sorted(asked))
PYTHON
}

is "$(lease_with secret "$(printf 'a%.0s' {1..32})")" '0 /v1/leases /v1/leases/task-00000000000000000000000000000000 /v1/leases/task-00000000000000000000000000000000/contents/0000000000000000000000000000000000000000000000000000000000000000' \
    'what belongs to a lease is asked for'
is "$(lease_with task '../../../v1/users?x=#')" '3 /v1/leases' 'a task that leads to another path is none'
is "$(lease_with task $'a HTTP/1.1\r\nX: y')" '3 /v1/leases' 'nor is one with a line end'
is "$(lease_with secret $'a\r\nX: y')" '3 /v1/leases' 'a secret has none either'
is "$(lease_with contents "$(printf '../%.0s' {1..21})x")" '3 /v1/leases' 'and a content is named by its digits'

done_testing

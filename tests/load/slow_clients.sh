#!/usr/bin/env bash
# slow_clients.sh - what a caller with a token gets while slowhttptest holds 4,000 connections: slow heads (-H), slow
# bodies (-B), ranges (-R), slow reading (-X). Not a test of tests/run.sh, since it needs slowhttptest
# (apt-get install slowhttptest) and two minutes:
#
#   ulimit -n 20000; tests/load/slow_clients.sh [BINARY [SECONDS]]
#
# Each line: requests sent one after the other, each on a connection of its own, how many of them were answered 200,
# and their times; then the same for a connection that is kept.
set -u
SRNFD=${1:-build/srnfd}
SECONDS_EACH=${2:-20}
SCRATCH=$(mktemp -d) || exit 1
"$SRNFD" token add --name probe --data "$SCRATCH" --max-requests 1000 >"$SCRATCH/token" || exit 1
"$SRNFD" serve --listen 127.0.0.1:0 --data "$SCRATCH" --access-log refusals 2>"$SCRATCH/log" &
PID=$!
trap 'kill $PID; timeout 30 tail --pid=$PID -f /dev/null; kill -KILL $PID 2>/dev/null; rm -rf "$SCRATCH"' EXIT
for _ in $(seq 100); do
    URL=$(sed -n 's/.*"event":"listening".*"address":"\([^"]*\)".*/\1/p' "$SCRATCH/log" | head -n 1)
    [ -n "$URL" ] && break
    sleep 0.05
done
cat >"$SCRATCH/probe.py" <<'END'
import socket, sys, time

host, port = sys.argv[1].rsplit(":", 1)
seconds, token = float(sys.argv[2]), sys.argv[3]
request = (f"GET /v1/meshes HTTP/1.1\r\nHost: {sys.argv[1]}\r\nAuthorization: Bearer {token}\r\n\r\n").encode()

def ask(s):
    s.sendall(request)
    text = b""
    while b"\r\n\r\n" not in text:
        piece = s.recv(65536)
        if not piece:
            return "closed"
        text += piece
    return text[9:12].decode()

def fresh():
    with socket.create_connection((host, int(port)), 10) as s:
        return ask(s)

kept = None
def again():
    global kept
    try:
        kept = kept or socket.create_connection((host, int(port)), 10)
        return ask(kept)
    except OSError:
        kept = None
        raise

results, others = {"fresh": [], "kept": []}, {}
end = time.monotonic() + seconds
while time.monotonic() < end:
    for name, one in ("fresh", fresh), ("kept", again):
        start = time.monotonic()
        try:
            status = one()
        except OSError as error:
            status = type(error).__name__
        well = status == "200"
        if not well:
            others[status] = others.get(status, 0) + 1
        if not well and name == "kept" and kept:
            kept.close()
            kept = None
        results[name].append((well, 1e3 * (time.monotonic() - start)))
    time.sleep(0.02)
for name, all_ in results.items():
    times = sorted(t for well, t in all_ if well) or [float("nan")]
    print("  %-5s %4d of %4d served, p50 %.1f ms, p99 %.1f ms, most %.1f ms" % (
        name, sum(well for well, _ in all_), len(all_), times[len(times) // 2],
        times[min(len(times) - 1, int(0.99 * len(times)))], times[-1]))
if others:
    print("  otherwise:", others)
END
TOKEN=$(grep -o 'srnf[A-Za-z0-9_-]*' "$SCRATCH/token" | tail -n 1)
run() { # NAME ARGUMENTS OF slowhttptest..
    local name=$1 attack
    shift
    echo "$name"
    slowhttptest -c 4000 -r 2000 -l "$SECONDS_EACH" -p 3 "$@" >"$SCRATCH/attack" 2>&1 </dev/null &
    attack=$!
    sleep 3
    python3 "$SCRATCH/probe.py" "$URL" "$((SECONDS_EACH - 5))" "$TOKEN"
    wait "$attack"
}
python3 "$SCRATCH/probe.py" "$URL" 2 "$TOKEN"
[ "${3-}" ] && MODES=$3
MODES=${MODES-HBRX}
case $MODES in *H*) run '-H' -H -i 5 -t GET -u "http://$URL/healthz" ;; esac
case $MODES in *B*) run '-B' -B -i 5 -s 8192 -t POST -f application/octet-stream -u "http://$URL/v1/meshes" ;; esac
case $MODES in *R*) run '-R' -R -t HEAD -u "http://$URL/v1/openapi.yaml" -a 10 -b 3000 ;; esac
case $MODES in *X*) run '-X' -X -w 512 -y 1024 -n 5 -z 32 -k 3 -u "http://$URL/v1/openapi.yaml" ;; esac

#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: slow
# srnfd-test: waits
# TLS by clients who mean harm: handshakes and heads that come byte by byte are cut off in time and keep nobody out,
# nothing is renegotiated, an end without notice is an end, and neither TLS on a plain port nor plain HTTP on one of TLS
# gets anywhere.
. "$(dirname "$0")/../support/lib.sh"

openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=x \
    -addext 'subjectAltName=IP:127.0.0.1' -out "$SCRATCH/certificate.pem" -keyout "$SCRATCH/key.pem" 2>/dev/null ||
    skip_all 'openssl cannot make a certificate'
command -v python3 >/dev/null || skip_all 'python3 is not installed'
TOKEN=$("$SRNFD" token add --data "$SCRATCH/data" --name ada 2>/dev/null)
start_server "$SCRATCH/data" --tls-certificate "$SCRATCH/certificate.pem" --tls-key "$SCRATCH/key.pem" \
    --header-seconds 2 --max-connections 16 --max-waiting 64 || exit 1
PORT=${URL##*:}

cat >"$SCRATCH/slow.py" <<'END'
import socket, ssl, struct, sys, threading, time

address, token = ("127.0.0.1", int(sys.argv[1])), sys.argv[2]
context = ssl._create_unverified_context()
host = b"Host: localhost:%d\r\n" % address[1]
good = b"GET /v1/jobs HTTP/1.1\r\n" + host + b"Authorization: Bearer " + token.encode() + b"\r\nConnection: close\r\n\r\n"

def hello():
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    try:
        context.wrap_bio(incoming, outgoing).do_handshake()
    except ssl.SSLWantReadError:
        pass
    return outgoing.read()

def ends(raw, seconds):  # after how long the other end closes; None if it does not
    raw.settimeout(seconds)
    began = time.monotonic()
    try:
        while raw.recv(65536):
            pass
    except socket.timeout:
        return None
    except OSError:
        pass
    return time.monotonic() - began

def drip(send, text, raw, results):
    began = time.monotonic()
    try:
        for i in range(len(text)):
            send(text[i:i + 1])
            time.sleep(0.25)
            if time.monotonic() - began > 25:
                break
        results.append(99.0)
    except OSError:
        results.append(time.monotonic() - began)

def serve():  # seconds that a request with a token takes
    began = time.monotonic()
    with context.wrap_socket(socket.create_connection(address, 20)) as s:
        s.sendall(good)
        if s.recv(65536)[9:12] != b"200":
            return 99.0
    return time.monotonic() - began

def crowd(make, text):
    results, threads = [], []
    for _ in range(30):
        raw, send = make()
        threads.append(threading.Thread(target=drip, args=(send, text, raw, results)))
        threads[-1].start()
    slowest = 0.0
    for _ in range(10):
        time.sleep(0.2)
        slowest = max(slowest, serve())
    for thread in threads:
        thread.join()
    return "cut" if max(results) < 15 else "stays %.1f" % max(results), \
        "served" if slowest < 5 else "waits %.1f" % slowest

def plain():
    raw = socket.create_connection(address, 20)
    return raw, raw.send

def inside():
    secure = context.wrap_socket(socket.create_connection(address, 20))
    return secure, secure.send

print(*crowd(plain, hello()))
print(*crowd(inside, b"GET /v1/jobs HTTP/1.1\r\n" + host + b"X: " + b"x" * 200))

# Gone without close_notify, in the middle of a body and behind a whole request; and with a reset.
for text in (b"POST /v1/meshes HTTP/1.1\r\n" + host + b"Authorization: Bearer " + token.encode() +
             b"\r\nContent-Length: 100\r\n\r\nabc", good):
    for reset in (False, True):
        secure = context.wrap_socket(socket.create_connection(address, 20))
        secure.sendall(text)
        raw = socket.socket(fileno=secure.detach())
        if reset:
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        raw.close()
# An end of the half behind a whole request: it is answered.
secure = context.wrap_socket(socket.create_connection(address, 20))
secure.sendall(good)
copy = socket.fromfd(secure.fileno(), socket.AF_INET, socket.SOCK_STREAM)
copy.shutdown(socket.SHUT_WR)
secure.settimeout(20)
try:
    print("half", secure.recv(100)[9:12].decode())
except OSError as error:
    print("half", error)

raw = socket.create_connection(address, 20)
raw.sendall(b"GET /healthz HTTP/1.1\r\n" + host + b"\r\n")
took = ends(raw, 20)
print("plain", "closed" if took is not None and took < 12 else took)
print("after", "served" if serve() < 5 else "late")
END
python3 "$SCRATCH/slow.py" "$PORT" "$TOKEN" >"$SCRATCH/out" 2>"$SCRATCH/error"
note "$(tail -n 3 "$SCRATCH/error")"
is "$(sed -n 1p "$SCRATCH/out")" 'cut served' 'handshakes byte by byte'
is "$(sed -n 2p "$SCRATCH/out")" 'cut served' 'heads byte by byte inside TLS'
is "$(sed -n 3p "$SCRATCH/out")" 'half 200' 'who closed its half behind a request is answered'
is "$(sed -n 4p "$SCRATCH/out")" 'plain closed' 'plain HTTP to the port of TLS ends'
is "$(sed -n 5p "$SCRATCH/out")" 'after served' 'and after ends without notice others are served'

# A client that asks for another handshake in its session: TLS 1.2, "R" to openssl.
renegotiate() {
    (sleep 0.5; echo R; sleep 1; printf 'GET /healthz HTTP/1.1\r\nHost: 127.0.0.1:%s\r\n\r\n' "$PORT"; sleep 1) |
        timeout 20 openssl s_client -connect "127.0.0.1:$PORT" -tls1_2 2>&1
}
renegotiate >"$SCRATCH/renegotiated"
like "$(cat "$SCRATCH/renegotiated")" 'RENEGOTIATING' 'openssl asks for another handshake'
unlike "$(cat "$SCRATCH/renegotiated")" 'HTTP/1.1 200' 'which no request follows'
is "$(curl --silent --insecure --output /dev/null --write-out '%{http_code}' --max-time 20 "https://127.0.0.1:$PORT/healthz")" \
    200 'and the service goes on'
is "$(jq -Rr 'fromjson? | objects | select(.level == "error") | .event' "$SERVER_LOG" | sort -u | paste -sd' ')" '' \
    'none of this is an error of the service'
stop_server || not_ok 'the server ends well'

start_server "$SCRATCH/plain" || exit 1
timeout 20 openssl s_client -connect "127.0.0.1:${URL##*:}" </dev/null >"$SCRATCH/plain-tls" 2>&1
isnt $? 0 'TLS to a plain port fails'
get /healthz
is "$STATUS" 200 'and others are served'
stop_server || not_ok 'the server ends well'
done_testing

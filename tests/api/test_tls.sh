#!/usr/bin/env bash
# HTTPS by the daemon itself: requests of every kind pass, only current versions of TLS are spoken, and a certificate
# that is replaced is shown from the next connection on, while one that cannot be used is passed over.
# srnfd-test: once (what is read and sent does not depend on the build)
. "$(dirname "$0")/../support/lib.sh"

CERTIFICATE=$SCRATCH/certificate.pem
KEY=$SCRATCH/key.pem

# Makes a certificate of that name for 127.0.0.1, and its key.
make_pair() { # NAME CERTIFICATE KEY
    openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj "/CN=$1" \
        -addext 'subjectAltName=IP:127.0.0.1' -out "$2" -keyout "$3" 2>/dev/null
}

# The name in the certificate that a new connection is shown.
shown() {
    openssl s_client -connect "${URL#https://}" </dev/null 2>/dev/null | openssl x509 -noout -subject 2>/dev/null |
        sed 's/.*CN *= *//'
}

# Waits until the log has the event so many times.
await_event() { # EVENT COUNT
    local waited=0
    while [ "$(jq -Rr 'fromjson? | objects | .event' "$SERVER_LOG" | grep -cx "$1")" -lt "$2" ] && [ "$waited" -lt 100 ]; do
        sleep 0.05
        waited=$((waited + 1))
    done
}

make_pair first "$CERTIFICATE" "$KEY" || skip_all 'openssl cannot make a certificate'

"$SRNFD" serve --listen 127.0.0.1:0 --data "$SCRATCH/none" --tls-certificate "$CERTIFICATE" --tls-key "$SCRATCH/absent" \
    >/dev/null 2>"$SCRATCH/refused"
is $? 1 'a key that is not there: refused'
like "$(tail -n 1 "$SCRATCH/refused" | jq -r .message)" 'absent' 'and said which'
make_pair other "$SCRATCH/other.pem" "$SCRATCH/other-key.pem"
"$SRNFD" serve --listen 127.0.0.1:0 --data "$SCRATCH/none" --tls-certificate "$CERTIFICATE" \
    --tls-key "$SCRATCH/other-key.pem" >/dev/null 2>"$SCRATCH/refused"
is $? 1 'a key of another certificate: refused'

start_server "$SCRATCH/data" --tls-certificate "$CERTIFICATE" --tls-key "$KEY" || exit 1
URL=https://${URL#http://}
cp "$CERTIFICATE" "$SCRATCH/trusted.pem"
is "$(jq -Rr 'fromjson? | objects | select(.event == "listening") | .scheme' "$SERVER_LOG")" https 'the log says so'

secure() { # METHOD PATH [CURL ARGUMENTS..]
    local method=$1 path=$2
    shift 2
    STATUS=$(curl --silent --show-error --cacert "$SCRATCH/trusted.pem" --max-time "$REQUEST_SECONDS" --request "$method" \
        --output "$BODY" --dump-header "$HEADERS" --write-out '%{http_code}' "$@" "$URL$path")
}
secure GET /healthz
is "$STATUS" 200 'a request over TLS'
TOKEN=$("$SRNFD" token add --data "$SCRATCH/data" --name ada 2>/dev/null)
secure POST '/v1/meshes?name=t' --data-binary @tests/data/aal_subcortex/L_thalamus.ply
is_problem 401 token-required 'a body is refused over TLS'
secure POST '/v1/meshes?name=t' --header "Authorization: Bearer $TOKEN" --data-binary @tests/data/aal_subcortex/L_thalamus.ply
is "$STATUS" 201 'and taken'
ID=$(json .id)
secure GET "/v1/meshes/$ID/content" --header "Authorization: Bearer $TOKEN"
check 'and comes back' cmp "$BODY" tests/data/aal_subcortex/L_thalamus.ply
secure POST /v1/processes/encode/execution --header "Authorization: Bearer $TOKEN" --header 'Content-Type: application/json' \
    --data-binary "{\"inputs\":{\"mesh\":\"$ID\",\"lmax\":8}}"
is "$STATUS" 200 'an answer that waited for its job'
status=$(curl --silent --output /dev/null --write-out '%{http_code}' --max-time 20 "http://${URL#https://}/healthz")
is "$status" 000 'plain HTTP is not answered'
curl --silent --output /dev/null --max-time 20 --cacert "$SCRATCH/trusted.pem" --tlsv1.0 --tls-max 1.1 \
    --ciphers 'DEFAULT@SECLEVEL=0' "$URL/healthz"
isnt $? 0 'nor is TLS 1.1'

# TLS 1.2 with ciphers that keep no secret once the key is lost, or that authenticate by SHA-1, is not spoken.
make_rsa() {
    openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=rsa -addext 'subjectAltName=IP:127.0.0.1' \
        -out "$SCRATCH/rsa.pem" -keyout "$SCRATCH/rsa-key.pem" 2>/dev/null
}
handshake() { # CIPHERS
    timeout 20 openssl s_client -connect "${URL#https://}" -tls1_2 -cipher "$1@SECLEVEL=0" </dev/null >/dev/null 2>&1
    echo $?
}
(
    make_rsa
    start_server "$SCRATCH/rsa" --tls-certificate "$SCRATCH/rsa.pem" --tls-key "$SCRATCH/rsa-key.pem" || exit 1
    URL=https://${URL#http://}
    for ciphers in ECDHE-RSA-AES256-GCM-SHA384 AES256-GCM-SHA384 AES128-SHA ECDHE-RSA-AES256-SHA; do
        handshake "$ciphers"
    done | paste -sd' ' >"$SCRATCH/handshakes"
    stop_server
)
like "$(cat "$SCRATCH/handshakes")" '^0 [1-9] [1-9] [1-9]$' 'TLS 1.2 has neither static RSA nor CBC with SHA-1'

# A new pair, the certificate first: between the two files there is no pair, and the one before is shown.
is "$(shown)" first 'the certificate is shown'
make_pair second "$SCRATCH/new.pem" "$SCRATCH/new-key.pem"
mv "$SCRATCH/new.pem" "$CERTIFICATE"
is "$(shown)" first 'half a pair is passed over'
await_event tls-not-reloaded 1
is "$(jq -Rr 'fromjson? | objects | select(.event == "tls-not-reloaded") | .level' "$SERVER_LOG")" error \
    'and logged once, as an error'
mv "$SCRATCH/new-key.pem" "$KEY"
is "$(shown)" second 'the new pair is shown without a restart'
secure GET /healthz
is "$STATUS" 000 'and the old one no more'
cp "$CERTIFICATE" "$SCRATCH/trusted.pem"
printf 'no certificate\n' >"$SCRATCH/broken.pem"
mv "$SCRATCH/broken.pem" "$CERTIFICATE"
secure GET /healthz
is "$STATUS" 200 'what is no certificate is passed over'
rm "$CERTIFICATE"
secure GET /healthz
is "$STATUS" 200 'and so is its absence'

# Handshakes while the pair is replaced again and again: each sees one pair or another.
failures=0
for i in 1 2 3 4 5 6 7 8; do
    make_pair "turn$i" "$SCRATCH/new.pem" "$SCRATCH/new-key.pem"
    cp "$SCRATCH/new.pem" "$SCRATCH/new-copy.pem"
    mv "$SCRATCH/new.pem" "$CERTIFICATE"
    mv "$SCRATCH/new-key.pem" "$KEY"
    cat "$SCRATCH/new-copy.pem" >>"$SCRATCH/trusted.pem"
    for _ in 1 2 3; do
        secure GET /healthz
        [ "$STATUS" = 200 ] || failures=$((failures + 1))
    done
done
is "$failures" 0 'no handshake fails while certificates change'
stop_server || not_ok 'the server ends well'

# The pair that a service manager hands over; half of it is refused, and settings come before it.
mkdir "$SCRATCH/credentials"
make_pair handed "$SCRATCH/credentials/tls-certificate" "$SCRATCH/credentials/tls-key"
CREDENTIALS_DIRECTORY=$SCRATCH/credentials start_server "$SCRATCH/handed" || exit 1
URL=https://${URL#http://}
is "$(shown)" handed 'the certificate that was handed over is shown'
stop_server || not_ok 'the server ends well'
make_pair third "$CERTIFICATE" "$KEY"
CREDENTIALS_DIRECTORY=$SCRATCH/credentials start_server "$SCRATCH/handed" --tls-certificate "$CERTIFICATE" \
    --tls-key "$KEY" || exit 1
URL=https://${URL#http://}
is "$(shown)" third 'settings come before it'
stop_server || not_ok 'the server ends well'
rm "$SCRATCH/credentials/tls-key"
CREDENTIALS_DIRECTORY=$SCRATCH/credentials "$SRNFD" serve --listen 127.0.0.1:0 --data "$SCRATCH/none" >/dev/null \
    2>"$SCRATCH/refused"
is $? 2 'a certificate without its key: refused'

# Inside TLS as outside: what is malformed gets one problem, also behind a good request; and clients that send the
# first byte, or the first record, of a handshake and no more keep nobody out.
start_server "$SCRATCH/crowded" --tls-certificate "$CERTIFICATE" --tls-key "$KEY" --max-connections 8 --max-waiting 32 ||
    exit 1
cat >"$SCRATCH/crowd.py" <<'END'
import socket, ssl, sys, time

address = ("127.0.0.1", int(sys.argv[1]))
context = ssl._create_unverified_context()

def dial():
    return context.wrap_socket(socket.create_connection(address, 20))

def hear(s):
    text = b""
    while b"\r\n\r\n" not in text or text.count(b"}") == 0:
        piece = s.recv(65536)
        if not piece:
            break
        text += piece
    return text

good = b"GET /healthz HTTP/1.1\r\nHost: localhost:%d\r\n\r\n" % address[1]
shapes = [b"GET /healthz HTTP/1.1\nHost: x\n\n",
          b"POST /v1/meshes HTTP/1.1\r\nHost: localhost:%d\r\nTransfer-Encoding: chunked\r\n\r\n5\nhello\n" % address[1],
          b"POST /v1/meshes HTTP/1.1\r\nHost: x\r\nContent-Length: 2\0\r\n\r\nab"]
for shape in shapes:
    s = dial()
    s.sendall(good)
    first = hear(s)[9:12].decode()
    s.sendall(shape)
    answer = hear(s)
    print(first, answer[9:12].decode(), answer.count(b"HTTP/1.1 "), b"malformed-request" in answer)
idle = []
for i in range(40):
    s = socket.create_connection(address, 20)
    s.sendall(b"\x16")
    idle.append(s)
    s = socket.create_connection(address, 20)
    s.sendall(b"\x16\x03\x01\x00\x05\x01\x00\x00\x40\x00")
    idle.append(s)
time.sleep(1)
for i in range(3):
    s = dial()
    s.sendall(good)
    print(hear(s)[9:12].decode())
END
is "$(python3 "$SCRATCH/crowd.py" "${URL##*:}" 2>"$SCRATCH/error" | paste -sd' ')" \
    '200 400 1 True 200 400 1 True 200 400 1 True 200 200 200' 'TLS hides nothing, and its handshakes keep nobody out'
stop_server || not_ok 'the server ends well'
done_testing

#!/usr/bin/env bash
# The daemon as a program: its commands, its settings from file, environment and command line, what it refuses to
# start with, its signals, and clients that send what no client should.
. "$(dirname "$0")/../support/lib.sh"

# Runs serve, which must refuse; its status is in REFUSED, its last line in WHY.
refuses() { # NAME STATUS WHY-REGEX ARGUMENTS..
    local name=$1 wanted=$2 why=$3 got
    shift 3
    timeout 20 "$SRNFD" serve "$@" >/dev/null 2>"$SCRATCH/refused"
    got=$?
    is "$got" "$wanted" "$name: refused"
    like "$(tail -n 1 "$SCRATCH/refused" | jq -r .message)" "$why" "$name: and said why"
}

like "$("$SRNFD" version)" 'srnfd +[0-9]+\.[0-9]+.*openblas' 'version names the libraries'
# On a processor that OpenBLAS does not know it falls back to the kernels of one of 2004.
core() { # [NAME=VALUE]
    env -u OPENBLAS_CORETYPE "$@" "$SRNFD" version | sed -n 's/^openblas .*, //p'
}
if grep -w avx2 /proc/cpuinfo | grep -qw fma; then
    is "$([ "$(core)" = Prescott ] && echo slow)" '' 'OpenBLAS has kernels for this processor'
    env -u OPENBLAS_CORETYPE "$SRNFD" serve --listen 127.0.0.1:0 --data "$SCRATCH/named" </dev/null >/dev/null 2>"$SCRATCH/named.log" &
    SERVER_PIDS+=("$!")
    for _ in $(seq 100); do
        [ -n "$(announced_address "$SCRATCH/named.log")" ] && break
        sleep 0.05
    done
    is "$(cat "/proc/$!/comm")" "$(basename "$SRNFD")" '  and the process has the name of the program'
    stop_server "$!"
    is "$(core OPENBLAS_CORETYPE=Nehalem)" Nehalem 'or those that the environment names'
    is "$(core OPENBLAS_CORETYPE=Prescott)" Prescott 'whatever they are'
fi
like "$("$SRNFD" help)" '--listen.*SRNFD_LISTEN' 'help lists the settings'
is "$("$SRNFD" --help)" "$("$SRNFD" help)" '--help does, too'
is "$("$SRNFD" serve --help)" "$("$SRNFD" help)" 'behind a command as well'
"$SRNFD" fly 2>/dev/null
is $? 2 'an unknown command is an error'
"$SRNFD" 2>/dev/null
is $? 2 'no command, too'

data=$SCRATCH/none
refuses 'an unknown option' 2 'fast' --fast 1
refuses 'an option without its value' 2 'data' --data
refuses 'a number out of range' 2 'workers.*256' --workers 1000
refuses 'a number that is none' 2 'workers' --workers many
refuses 'an address that is none' 2 'no address' --listen localhost:80 --data "$data"
refuses 'a word for an address' 2 'no address' --listen foo --data "$data"
refuses 'every address without tokens' 2 'insecure' --listen 0.0.0.0:0 --data "$data"
refuses 'allowed hosts without tokens' 2 'insecure' --listen 127.0.0.1:0 --data "$data" --allowed-hosts shapes.example
refuses 'a port that is none' 2 'port' --listen 127.0.0.1:99999 --data "$data" --insecure
printf '{"workers":1,"wrokers":2}' >"$SCRATCH/unknown.json"
refuses 'an unknown member of the file' 2 'wrokers' --config "$SCRATCH/unknown.json"
printf '{"workers":"1"}' >"$SCRATCH/type.json"
refuses 'a member of the wrong type' 2 'workers' --config "$SCRATCH/type.json"
printf '{"workers":1' >"$SCRATCH/broken.json"
refuses 'a file that is no JSON' 2 'broken.json' --config "$SCRATCH/broken.json"
refuses 'a file that is not there' 2 'absent.json' --config "$SCRATCH/absent.json"
refuses 'a data directory that cannot be' 1 '--data /proc/none' --listen 127.0.0.1:0 --data /proc/none

# The file is overridden by the environment, and that by the command line.
printf '{"workers":3,"maxBody":5000,"syncWaitSeconds":2}' >"$SCRATCH/good.json"
SRNFD_WORKERS=2 start_server "$SCRATCH/data" --config "$SCRATCH/good.json" || exit 1
get /v1/version
is "$(json .workers)" 2 'the environment overrides the file'
post /v1/meshes --data-binary "@tests/data/aal_subcortex/L_thalamus.ply"
is_problem 413 body-too-large 'what only the file says holds'
refuses 'a data directory that is in use' 1 '.' --listen 127.0.0.1:0 --data "$SCRATCH/data"
refuses 'an address that is in use' 1 'listen' --listen "${URL#http://}" --data "$SCRATCH/other"

# Clients that send what no client should: the service answers or hangs up, and goes on.
host=${URL#http://}
raw() { # BYTES as printf takes them
    # shellcheck disable=SC2059 # the bytes are the format
    (
        exec 3<>"/dev/tcp/${host%:*}/${host#*:}" || exit 1
        printf "$1" >&3
        timeout 3 head -c 12 <&3
    ) 2>/dev/null | tr -d '\0'
}
for bytes in 'GET /nothing\0x HTTP/1.1\r\nHost: x\r\n\r\n' '\0\0\0\0\r\n\r\n' 'GET\r\n\r\n' \
    'GET / HTTP/9.9\r\nHost: x\r\n\r\n' '\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03' \
    'POST /v1/meshes HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n' \
    'POST /v1/meshes HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nxyz\r\n' \
    'POST /v1/meshes HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999999999999\r\n\r\n' \
    'CONNECT x:80 HTTP/1.1\r\nHost: x\r\n\r\n' 'OPTIONS * HTTP/1.1\r\nHost: x\r\n\r\n'; do
    answer=$(raw "$bytes")
    unlike "$answer" '^HTTP/1.[01] 2' "not answered well: ${bytes:0:40}"
    get /healthz
    is "$STATUS" 200 'and the service goes on'
done

# Pages of other sites in a browser on this machine are kept out.
get /v1/version --header 'Host: rebound.example'
is_problem 403 forbidden 'a foreign Host'
get /v1/version --header "Host: localhost:${host#*:}"
is "$STATUS" 200 'localhost with the port is no foreign Host'
post /v1/meshes --header 'Origin: http://evil.example' --data-binary 'x'
is_problem 403 forbidden 'a foreign Origin that would change something'
post /v1/processes/encode/execution --header 'Content-Type:' --data-binary '{"inputs":{}}'
is_problem 415 unsupported-media-type 'an execution without Content-Type'

kill -HUP "$SERVER_PID"
for _ in $(seq 100); do
    grep -q '"event":"hangup"' "$SERVER_LOG" && break
    sleep 0.05
done
like "$(grep hangup "$SERVER_LOG")" 'the service goes on' 'SIGHUP leaves a line'
get /v1/version
is "$STATUS" 200 'and the service goes on'

kill -INT "$SERVER_PID"
wait_server "$SERVER_PID"
is "$SERVER_STATUS" 0 'SIGINT ends it as SIGTERM does'
is "$(tail -n 1 "$SERVER_LOG" | jq -r .event)" stopped 'and it says so'
is "$(grep -c '"event":"http-library"' "$SERVER_LOG")" 0 'the HTTP library has nothing to warn of'
check 'every line of the log is JSON with a time and an event' jq -e '.ts and .event' "$SERVER_LOG"

SRNFD_WORKERS=2 start_server "$SCRATCH/data" --workers 1 --config="$SCRATCH/good.json" || exit 1
get /v1/version
is "$(json .workers)" 1 'the command line overrides the environment'
stop_server || not_ok 'the server ends well'

# Threads of libraries are older than main: what ends a process by default must not reach them either, when the thread
# that waits for it is busy, or stopped.
start_server "$SCRATCH/data" || exit 1
for _ in $(seq 20); do
    kill -STOP "$SERVER_PID"
    kill -HUP "$SERVER_PID"
    kill -CONT "$SERVER_PID"
done
get /healthz
is "$STATUS" 200 'hangups of a busy daemon leave it alone'
kill -STOP "$SERVER_PID"
kill -TERM "$SERVER_PID"
kill -CONT "$SERVER_PID"
wait_server "$SERVER_PID" 20
is "$SERVER_STATUS" 0 'and SIGTERM ends it well'

# A limit of open files below what all connections need: they are fitted to it, and idle ones lock nobody out.
limited() { # LIMIT-OPTIONS DATA: start_server within a limit of open files
    printf '#!/bin/sh\nulimit %s && exec "%s" "$@"\n' "$1" "$SRNFD" >"$SCRATCH/limited"
    chmod +x "$SCRATCH/limited"
    SRNFD=$SCRATCH/limited start_server "$2" --workers 1 --access-log refusals
}
fitted() { # MEMBER of the line that tells
    jq -r "select(.event == \"connections-fitted\") | $1" "$SERVER_LOG"
}
silent_crowd() { # CONNECTIONS that say nothing; CROWD holds them, and others are answered meanwhile
    : >"$SCRATCH/crowd"
    /usr/bin/python3 - "${URL#http://}" "$1" >"$SCRATCH/crowd" <<'END' &
import resource, socket, sys, time
resource.setrlimit(resource.RLIMIT_NOFILE, (4000, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
host, port = sys.argv[1].split(':')
crowd = [socket.create_connection((host, int(port)), 10) for _ in range(int(sys.argv[2]))]
print('here', flush=True)
time.sleep(60)
END
    CROWD=$!
    for _ in $(seq 400); do
        [ -s "$SCRATCH/crowd" ] && break
        sleep 0.05
    done
    is "$(cat "$SCRATCH/crowd")" here "$1 connections that say nothing come"
    for _ in 1 2 3; do
        get /healthz --max-time 3
        is "$STATUS" 200 '  and others are answered at once'
    done
}
disperse() {
    kill "$CROWD"
    wait "$CROWD" 2>/dev/null
}
connections_limit() { # PLACE
    get /metrics
    awk -v name="srnfd_http_connections_limit{place=\"$1\"}" '$1 == name { print $2 }' "$BODY"
}
if [ "$(ulimit -Hn)" != unlimited ] && [ "$(ulimit -Hn)" -lt 12000 ]; then
    skip 'connections are fitted to the limit of open files' 'the limit here is below 12,000'
else
    limited '-n 1024' "$SCRATCH/fitted" || exit 1
    like "$(fitted .message)" 'LimitNOFILE.*ulimit -Hn' 'with few open files a line says what to do'
    is "$(fitted .openFiles)" 1024 '  and how many there are'
    compare "$(fitted .maxConnections)" '>=' 128 '  and what is left of the connections'
    compare "$(fitted .maxWaiting)" '>=' 64 '  and of those that wait'
    compare "$(fitted '2 * (.maxWaiting + .maxConnections)')" '<' 900 '  with room for files'
    is "$(connections_limit serving)" "$(fitted .maxConnections)" '  and so do the metrics'
    is "$(connections_limit waiting)" "$(fitted .maxWaiting)" '  of both'
    silent_crowd 1500
    post '/v1/meshes?format=ply' --max-time 10 --data-binary "@tests/data/aal_subcortex/L_thalamus.ply"
    is "$STATUS" 201 '  and there are files to store what they send'
    is "$(grep -c no-descriptors "$SERVER_LOG")" 0 '  as descriptors never ran out'
    disperse
    prlimit --pid "$SERVER_PID" --nofile=100
    silent_crowd 200
    disperse
    stop_server || not_ok 'the server ends well'
    limited '-Sn 256' "$SCRATCH/fitted" || exit 1
    is "$(fitted .event)" '' 'a soft limit alone is raised'
    is "$(connections_limit serving) $(connections_limit waiting)" '1024 4096' '  and all connections may come'
    stop_server || not_ok 'the server ends well'
fi

done_testing

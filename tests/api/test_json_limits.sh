#!/usr/bin/env bash
# JSON bodies take bounded memory, whatever they hold: a text that is small and a document that would be large is
# refused while it is read, lists of problems are cut, and what a large request took is given back.
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 || exit 1

resident_kib() { # VmRSS or VmHWM
    sed -n "s/^$1:[[:space:]]*\([0-9]*\) kB/\1/p" "/proc/$SERVER_PID/status"
}
# So many copies of a text, between a head and a tail.
repeated() { # HEAD TEXT COUNT TAIL
    printf '%s' "$1"
    yes "$2" | head -n "$3" | tr -d '\n'
    printf '%s' "$4"
}
send() { # PATH FILE
    post "$1" --header 'Content-Type: application/json' --data-binary "@$2"
}

get /healthz
before=$(resident_kib VmRSS)
repeated '{"name":"a","members":[' '{},' 5600000 '{}]}' >"$SCRATCH/objects"
send /v1/cohorts "$SCRATCH/objects"
is_problem 413 body-too-large '16 MiB of empty members'
repeated '{"name":"a","members":[' '{},' 2500000 '{}]}' >"$SCRATCH/objects"
send /v1/cohorts "$SCRATCH/objects"
is_problem 413 body-too-large '7 MiB of them, which the route would read'
like "$(json .detail)" 'MiB' 'and the limit is named'
{
    printf '{'
    seq -f '"k%.0f":0,' 1500000 | tr -d '\n'
    printf '"z":0}'
} >"$SCRATCH/keys"
send /v1/cohorts "$SCRATCH/keys"
is_problem 413 body-too-large '1,500,000 keys'
send /v1/processes/mean/execution "$SCRATCH/objects"
is_problem 413 body-too-large 'the same to an execution'
printf '{"inputs":%s}' "$(repeated '' '[' 5000 '')" >"$SCRATCH/deep"
send /v1/processes/mean/execution "$SCRATCH/deep"
is_problem 400 malformed-json 'a deep nest'
# The largest document of a text that goes to a request thread.
repeated '{"name":"a","members":[' '{},' 21000 '{}]}' >"$SCRATCH/small"
send /v1/cohorts "$SCRATCH/small"
is_problem 422 invalid-input '64 KiB of them are read, and refused for what they are'
for _ in 1 2 3 4 5 6; do
    curl --silent --output /dev/null --header 'Content-Type: application/json' --data-binary "@$SCRATCH/objects" \
        "$URL/v1/processes/mean/execution" &
    pids+=("$!")
done
wait "${pids[@]}"
if [ -z "$SRNFD_SANITIZED" ]; then
    # Two threads for uploads, 128 MiB each, and the bodies themselves.
    compare "$(($(resident_kib VmHWM) - before))" '<=' $(((2 * 128 + 6 * 32) * 1024)) 'memory stays within its bound'
    sleep 0.5
    compare "$(($(resident_kib VmRSS) - before))" '<=' $((64 * 1024)) 'and is given back'
fi

# What is refused for 900 reasons says twenty of them, and how many there are.
repeated '{"name":"a","members":[' '{"id":"nothing"},' 899 '{"id":"nothing"}]}' >"$SCRATCH/wrong"
send /v1/cohorts "$SCRATCH/wrong"
is_problem 422 invalid-input '900 wrong members'
is "$(json '.errors | length') $(json .errorCount)" '20 900' 'twenty are named, and all are counted'
compare "$(wc -c <"$BODY")" '<=' 8192 'in a small answer'

# Names that no process has are looked for among those that it has until twenty are told.
{
    printf '{"inputs":{'
    seq -f '"surface%.0f":0,' 400000 | tr -d '\n'
    printf '"z":0}}'
} >"$SCRATCH/names"
started=${EPOCHREALTIME/./}
send /v1/processes/mean/execution "$SCRATCH/names"
took=$((${EPOCHREALTIME/./} - started))
is_problem 422 invalid-input '400,000 unknown inputs'
is "$(json '.errors | length')" 20 'twenty are named'
[ -n "$SRNFD_SANITIZED" ] || compare "$took" '<=' 5000000 'within seconds'

# A field given as numbers, as large as inputs may be, is read: only its name is wrong.
awk 'BEGIN { printf "{\"inputs\":{\"nothing\":["; for (i = 0; i < 884736; i++) printf "%s0.12345678901234567", i ? "," : ""; printf "]}}" }' \
    >"$SCRATCH/numbers"
send /v1/processes/invert/execution "$SCRATCH/numbers"
is_problem 422 invalid-input 'a large field of numbers is read'
done_testing

# shellcheck shell=bash
# lib.sh - what shell tests share: TAP, servers, requests. Sourced, by bash:
#
#   . "$(dirname "$0")/../support/lib.sh"
#   start_server "$SCRATCH/data" --workers 2
#   post '/v1/meshes?format=ply' --data-binary @tests/data/aal_subcortex/L_thalamus.ply
#   is "$STATUS" 201 'a mesh is accepted'
#   is "$(json .format)" ply 'and its format is known'
#   done_testing
#
# TAP goes to standard output, everything else to standard error. A script that ends without done_testing
# has no plan, which tests/run.sh counts as a failure. Every server that start_server started is ended when
# the script ends, whichever way, by its process id.
#
# tests/run.sh sets SRNFD, SRNFD_BUILD and SRNFD_SANITIZED; by hand, the release build is taken. The script
# runs in the project's root; SCRATCH is a folder of its own that goes away with it.

set -u

# Whatever the caller speaks: mawk and bash read and write numbers with the comma of the locale, and what tools say is
# looked for in English.
export LC_ALL=C

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$ROOT" || exit 1
SRNFD_BUILD=${SRNFD_BUILD:-$ROOT/build}
SRNFD=${SRNFD:-$SRNFD_BUILD/srnfd}
SRNFD_SANITIZED=${SRNFD_SANITIZED-}
SCRATCH=$(mktemp -d "${TMPDIR:-/tmp}/srnfd-sh.XXXXXX") || exit 1

# Debian's own, which has the packages that tests need, and which starts eight times as fast as the shim of a version manager.
python3() {
    /usr/bin/python3 "$@"
}

# Scripts in Python find service.py.
export PYTHONPATH=$ROOT/tests/support PYTHONDONTWRITEBYTECODE=1

# ---- TAP -----------------------------------------------------------------------------------------------

TAP_COUNT=0
TAP_FAILED=0

ok() { # NAME
    TAP_COUNT=$((TAP_COUNT + 1))
    printf 'ok %d - %s\n' "$TAP_COUNT" "$1"
}

not_ok() { # NAME [DETAIL..]
    TAP_COUNT=$((TAP_COUNT + 1))
    TAP_FAILED=$((TAP_FAILED + 1))
    printf 'not ok %d - %s\n' "$TAP_COUNT" "$1"
    shift
    if [ $# -gt 0 ]; then
        printf '%s\n' "$@" | sed 's/^/#   /'
    fi
}

note() { # TEXT..
    printf '%s\n' "$*" | sed 's/^/# /'
}

skip() { # NAME REASON
    TAP_COUNT=$((TAP_COUNT + 1))
    printf 'ok %d - %s # SKIP %s\n' "$TAP_COUNT" "$1" "$2"
}

# Runs the ```sh blocks of documents word for word, in order, in one bash that stops at the first failure. It runs in
# $SCRATCH/clone, where tests, build and data are links, so that no file it writes lands in the project. What it prints
# is in $SCRATCH/out, what it runs in $SCRATCH/trace.
run_documents() { # FILE..
    mkdir "$SCRATCH/clone"
    ln -s "$ROOT/tests" "$SCRATCH/clone/tests"
    ln -s "$SRNFD_BUILD" "$SCRATCH/clone/build"
    ln -s "$SCRATCH/data" "$SCRATCH/clone/data"
    awk '/^```sh$/ { on = 1; next } /^```$/ { on = 0 } on' "$@" >"$SCRATCH/blocks.sh"
    if (
        # Asked for the text of a plain member, gojq does what jq does.
        jq() {
            if [ -n "$GOJQ" ] && [ $# -eq 2 ] && [[ $1 =~ ^-e?r$ && $2 =~ ^(\.[A-Za-z]+)+$ ]]; then
                "$GOJQ" "$@"
            else
                command jq "$@"
            fi
        }
        export -f jq
        cd "$SCRATCH/clone" && GOJQ=$GOJQ URL=$URL bash -eu -o pipefail -x "$SCRATCH/blocks.sh"
    ) >"$SCRATCH/out" 2>"$SCRATCH/trace"; then
        ok "all lines of $* succeed"
    else
        not_ok "all lines of $* succeed" "$(tail -n 5 "$SCRATCH/trace")"
    fi
}

# Leaves the whole script out. Only before the first test.
skip_all() { # REASON
    printf '1..0 # SKIP %s\n' "$1"
    exit 0
}

done_testing() {
    printf '1..%d\n' "$TAP_COUNT"
    [ "$TAP_FAILED" -eq 0 ]
    exit
}

is() { # GOT WANTED NAME
    if [ "$1" = "$2" ]; then
        ok "$3"
    else
        not_ok "$3" "got:    $1" "wanted: $2"
    fi
}

# What is empty or null was most likely not there at all, and fails.
isnt() { # GOT UNWANTED NAME
    if [ -n "$1" ] && [ "$1" != null ] && [ "$1" != "$2" ]; then
        ok "$3"
    else
        not_ok "$3" "got what must not be: $1"
    fi
}

like() { # GOT EXTENDED-REGEX NAME
    if [[ $1 =~ $2 ]]; then
        ok "$3"
    else
        not_ok "$3" "got:          $1" "which is not: $2"
    fi
}

unlike() { # GOT EXTENDED-REGEX NAME
    if [[ $1 =~ $2 ]]; then
        not_ok "$3" "got:      $1" "which has: $2"
    else
        ok "$3"
    fi
}

# Passes if the command succeeds; its output is shown if it does not.
check() { # NAME COMMAND..
    local name=$1 output
    shift
    if output=$("$@" 2>&1); then
        ok "$name"
    else
        not_ok "$name" "failed: $*" "$output"
    fi
}

# Passes if an arithmetic comparison of real numbers holds: compare 1e-7 '<=' 1e-5 'the error is small'.
# A value that is no number fails.
compare() { # GOT OPERATOR BOUND NAME
    local number='^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$'
    if [[ $2 =~ ^([<>]=?|[!=]=)$ ]] && [[ $1 =~ $number ]] && [[ $3 =~ $number ]] &&
        awk -v a="$1" -v b="$3" "BEGIN { exit !(a + 0 $2 b + 0) }"; then
        ok "$4"
    else
        not_ok "$4" "not true: $1 $2 $3"
    fi
}

# ---- Servers -------------------------------------------------------------------------------------------

SERVER_PIDS=()
SERVER_PID=
SERVER_LOG=
SERVER_STATUS=
URL=

# How long a server may take to be ready and to drain: sanitizers make both slower.
SERVER_SECONDS=30
if [ -n "$SRNFD_SANITIZED" ]; then
    SERVER_SECONDS=120
fi

alive() { # PID
    kill -0 "$1" 2>/dev/null
}

# The address that a server's log announces, or nothing as long as it does not.
announced_address() { # LOG
    local line
    while IFS= read -r line; do
        if [[ $line =~ \"event\":\ *\"listening\" && $line =~ \"address\":\ *\"([^\"]+)\" ]]; then
            printf '%s\n' "${BASH_REMATCH[1]}"
            return
        fi
    done <"$1"
}

# Starts a server on a free port of the loopback and waits until it is ready. Sets URL, SERVER_PID and
# SERVER_LOG (its standard error; a new file for each start). Returns 1, having shown the log, if it is not
# ready in time or ends before it is.
start_server() { # DATA-FOLDER [ARGUMENTS OF serve..]
    local data=$1 address waited=0
    shift
    SERVER_LOG=$(mktemp "$SCRATCH/server-XXXXXX.log") # of its own, also when subshells start servers
    "$SRNFD" serve --listen 127.0.0.1:0 --data "$data" "$@" </dev/null >/dev/null 2>"$SERVER_LOG" &
    SERVER_PID=$!
    SERVER_PIDS+=("$SERVER_PID")
    URL=
    while [ "$waited" -lt $((SERVER_SECONDS * 20)) ]; do
        address=$(announced_address "$SERVER_LOG")
        if [ -n "$address" ]; then
            URL=http://$address
            return 0
        fi
        alive "$SERVER_PID" || break
        sleep 0.05
        waited=$((waited + 1))
    done
    echo "the server did not get ready:" >&2
    tail -n 40 "$SERVER_LOG" >&2
    return 1
}

# Waits for a server to end and reaps it; SERVER_STATUS is its exit status (128 + N after signal N).
# Returns 1 if it still runs when the seconds are over.
wait_server() { # [PID [SECONDS]]
    local pid=${1:-$SERVER_PID} waited=0
    while alive "$pid" && [ "$waited" -lt $((${2:-$SERVER_SECONDS} * 20)) ]; do
        sleep 0.05
        waited=$((waited + 1))
    done
    alive "$pid" && return 1
    wait "$pid" 2>/dev/null
    SERVER_STATUS=$?
    return 0
}

# Asks the server to drain and waits for its end. Fails unless it ends in time with status 0, so that what
# a sanitizer finds at the end (leaks) is not lost; the log's tail is shown then.
stop_server() { # [PID]
    local pid=${1:-$SERVER_PID}
    kill -TERM "$pid" 2>/dev/null
    if ! wait_server "$pid"; then
        echo "the server did not drain in $SERVER_SECONDS s" >&2
        kill_server "$pid"
        return 1
    fi
    if [ "$SERVER_STATUS" -ne 0 ]; then
        echo "the server ended with status $SERVER_STATUS:" >&2
        tail -n 60 "$SERVER_LOG" >&2
        return 1
    fi
}

# Ends it as a power failure would, and reaps it.
kill_server() { # [PID]
    local pid=${1:-$SERVER_PID}
    kill -KILL "$pid" 2>/dev/null
    wait "$pid" 2>/dev/null
    SERVER_STATUS=$?
    return 0
}

clean_up() {
    local status=$? pid
    trap - EXIT
    for pid in ${SERVER_PIDS[@]+"${SERVER_PIDS[@]}"}; do
        if [ "$status" -eq 0 ] && [ -n "${SRNFD_SANITIZED-}${GCOV_PREFIX-}" ] && alive "$pid"; then
            stop_server "$pid" || status=1 # or else what leaks, or was reached, would not be told
        elif alive "$pid"; then
            kill -KILL "$pid" 2>/dev/null
            wait "$pid" 2>/dev/null
        fi
    done
    rm -rf --one-file-system "$SCRATCH"
    exit "$status"
}
trap clean_up EXIT
trap 'exit 143' TERM INT HUP

# ---- Requests ------------------------------------------------------------------------------------------

STATUS=
BODY=$SCRATCH/body
HEADERS=$SCRATCH/headers
REQUEST_SECONDS=120

# Sends a request. Sets STATUS (000 if there was no answer); the body is in the file $BODY, the headers are in
# $HEADERS. PATH is taken as it is, an absolute URL too. Further arguments are curl's.
request() { # METHOD PATH [CURL ARGUMENTS..]
    local method=$1 path=$2 url
    shift 2
    case $path in
    http://*) url=$path ;;
    *) url=$URL$path ;;
    esac
    : >"$BODY"
    : >"$HEADERS"
    if [ "$method" = HEAD ]; then
        set -- --head "$@"
    fi
    STATUS=$(curl --silent --show-error --path-as-is --max-time "$REQUEST_SECONDS" --request "$method" \
        --output "$BODY" --dump-header "$HEADERS" --write-out '%{http_code}' "$@" "$url")
}

get() { # PATH [CURL ARGUMENTS..]
    request GET "$@"
}

post() { # PATH [CURL ARGUMENTS..]
    request POST "$@"
}

post_json() { # PATH JSON [CURL ARGUMENTS..]
    local path=$1 document=$2
    shift 2
    request POST "$path" --header 'Content-Type: application/json' --data-binary "$document" "$@"
}

# Runs a process: execute encode '{"mesh":"mesh-..."}' --header 'Prefer: respond-async'.
execute() { # PROCESS INPUTS [CURL ARGUMENTS..]
    local process=$1 inputs=$2
    shift 2
    # Longer than the daemon waits by itself, so that a busy machine changes no status.
    [ $# -gt 0 ] || set -- --header 'Prefer: wait=120'
    post_json "/v1/processes/$process/execution" "{\"inputs\":$inputs}" "$@"
}

# jq 1.6 reads its own library for 25 ms before it reads anything; gojq, which deploy/install-deps.sh unpacks, answers in
# 3. It writes doubles as jq does, in the fewest digits that tell them apart, and sorts the members of objects: who asks
# for their order says json_in_order, or "command jq". Documents are run with jq, as by readers, but for plain members.
GOJQ=$(PATH=$PATH:$ROOT/build/tools/usr/bin command -v gojq) || GOJQ=
jq() {
    if [ -z "$GOJQ" ] || [[ $1 =~ ^-[a-z]*S ]]; then
        command jq "$@"
    else
        "$GOJQ" "$@"
    fi
}

# A member of the last body, as jq's raw output; nothing if the body is not JSON. To jq null is less than every
# number, and null is how a NaN is written: "real" in a filter passes numbers on and is an error for anything else.
# A plain member (.items[0].name) is read by tests/tools/json_member.c, as jq would print it.
JSON_MEMBER=$SRNFD_BUILD/tests/tools/json_member
json() { # JQ-FILTER
    if [[ $1 =~ ^\.[A-Za-z_][][A-Za-z0-9_.]*$ ]] && "$JSON_MEMBER" "$BODY" "$1" 2>/dev/null; then
        return
    fi
    jq -r "def real: if type == \"number\" then . else error(\"no number\") end; $1" "$BODY" 2>/dev/null
}

# The same with the members of objects in the order in which they were sent.
json_in_order() { # JQ-FILTER
    command jq -r "$1" "$BODY" 2>/dev/null
}

# A header of the last answer, by name without regard to case.
header() { # NAME
    local line value=
    while IFS= read -r line; do
        if [[ ${line,,} == "${1,,}:"* ]]; then
            value=${line#*:}
            value=${value#"${value%%[! ]*}"}
        fi
    done <"$HEADERS"
    printf '%s\n' "${value%$'\r'}"
}

# Passes if the last answer is a problem document of that status and code.
is_problem() { # STATUS CODE NAME
    local got
    got="$STATUS $(json .code) $(json .status) $(header Content-Type)"
    if [[ $got == "$1 $2 $1 application/problem+json"* ]]; then
        ok "$3"
    else
        not_ok "$3" "got:    $got" "wanted: $1 $2 $1 application/problem+json" "$(head -c 500 "$BODY")"
    fi
}

# Waits until a job has ended and sets JOB_STATUS; returns 1 if it has not when the seconds are over. The job's
# last record is in $BODY.
JOB_STATUS=
poll_job() { # ID SECONDS
    local deadline=$((SECONDS + $2)) pause=0.1 asked=0
    while :; do
        get "/v1/jobs/$1"
        JOB_STATUS=$(json .status)
        case $JOB_STATUS in
        successful | failed | dismissed) return 0 ;;
        esac
        [ "$SECONDS" -lt "$deadline" ] || return 1
        asked=$((asked + 1))
        [ "$asked" -lt 10 ] || pause=0.3 # a question takes processor time, too
        sleep "$pause"
    done
}

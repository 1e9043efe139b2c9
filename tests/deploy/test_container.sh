#!/usr/bin/env bash
# The image's entry without an image: its first start makes one token and prints it once, or takes that of the secret;
# later starts make none, and nothing is served without one.
. "$(dirname "$0")/../support/lib.sh"

mkdir "$SCRATCH/bin"
ln -s "$(realpath "$SRNFD")" "$SCRATCH/bin/srnfd"

# Starts it as the image does, but on loopback.
start_container() { # DATA [VARIABLE=VALUE..]
    local data=$1
    shift
    SERVER_LOG=$SCRATCH/container-${#SERVER_PIDS[@]}.log
    env PATH="$SCRATCH/bin:$PATH" SRNFD_DATA="$data" SRNFD_LISTEN=127.0.0.1:0 "$@" deploy/container-start.sh \
        </dev/null >"$SERVER_LOG" 2>&1 &
    SERVER_PID=$!
    SERVER_PIDS+=("$SERVER_PID")
    URL=
    for _ in $(seq $((SERVER_SECONDS * 20))); do
        URL=$(announced_address "$SERVER_LOG")
        [ -z "$URL" ] || break
        alive "$SERVER_PID" || return 1
        sleep 0.05
    done
    URL=http://$URL
}
# The tokens that a log has.
tokens() { # LOG
    grep -oE 'srnfd_[A-Za-z0-9_-]{32,}' "$1" | sort -u
}

mkdir -m 700 "$SCRATCH/data" "$SCRATCH/secret-data" "$SCRATCH/bad-data"

# ---- A new token -------------------------------------------------------------------------------------

start_container "$SCRATCH/data" SRNFD_TOKEN_FILE= || not_ok 'the first start serves' "$(tail -n 5 "$SERVER_LOG")"
TOKEN=$(tokens "$SERVER_LOG")
is "$(wc -w <<<"$TOKEN")" 1 'the first start prints one token'
get /v1/meshes
is "$STATUS" 401 'a request without it is refused'
get /v1/meshes --header "Authorization: Bearer $TOKEN"
is "$STATUS" 200 'one with it is answered'
unlike "$(cat "$SCRATCH/data/tokens")" "$TOKEN" 'the file of tokens does not have it in the clear'
stop_server || not_ok 'it ends well on SIGTERM'
start_container "$SCRATCH/data" SRNFD_TOKEN_FILE= || not_ok 'the second start serves' "$(tail -n 5 "$SERVER_LOG")"
is "$(tokens "$SERVER_LOG")" '' 'the second start prints none'
get /v1/meshes --header "Authorization: Bearer $TOKEN"
is "$STATUS" 200 'and the first one holds'
stop_server || not_ok 'it ends well on SIGTERM'

# ---- A secret ----------------------------------------------------------------------------------------

SECRET=a-secret-of-forty-letters-and-hyphens-000
(umask 077 && echo "$SECRET" >"$SCRATCH/secret")
start_container "$SCRATCH/secret-data" SRNFD_TOKEN_FILE="$SCRATCH/secret" ||
    not_ok 'a start with a secret serves' "$(tail -n 5 "$SERVER_LOG")"
unlike "$(cat "$SERVER_LOG")" "$SECRET" 'the secret is not printed'
get /v1/meshes
is "$STATUS" 401 'a request without the secret is refused'
get /v1/meshes --header "Authorization: Bearer $SECRET"
is "$STATUS" 200 'one with it is answered'
stop_server || not_ok 'it ends well on SIGTERM'

# ---- No secret where one was named -------------------------------------------------------------------

if start_container "$SCRATCH/bad-data" SRNFD_TOKEN_FILE="$SCRATCH/none"; then
    not_ok 'a secret that is missing ends the start'
else
    ok 'a secret that is missing ends the start'
fi
check 'without a token of its own' test ! -s "$SCRATCH/bad-data/tokens"
done_testing

#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: slow
# srnfd-test: timeout 300
#
# kill -9 every fifth of a second with 48 jobs queued: none of them fails for it, and all end once the daemon is left
# alone. A job with which the daemon dies each time has failed after it died with that job alone, and says so; the others
# end as if nothing had been.
. "$(dirname "$0")/../support/lib.sh"

KILLS=12
JOBS=48
MESH_FILE=tests/data/aal_subcortex/L_thalamus.ply

# Submits encodings that take a second or so each; their ids go to the file.
submit_all() { # MESH FILE
    local n
    : >"$2"
    for n in $(seq "$JOBS"); do
        execute encode "{\"mesh\":\"$1\",\"lmax\":42,\"smoothing\":0.000$((100 + n))}" --header 'Prefer: respond-async'
        [ "$STATUS" = 201 ] || return 1
        json .id >>"$2"
    done
}

count_jobs() { # STATE
    get "/v1/jobs?limit=200&status=$1"
    json '.jobs | length'
}

await_none_left() {
    local deadline=$(($(date +%s) + 200))
    while [ "$(date +%s)" -lt "$deadline" ]; do
        [ "$(count_jobs accepted) $(count_jobs running)" = '0 0' ] && return 0
        sleep 0.2
    done
    return 1
}

# ---- Kills that have nothing to do with the jobs -------------------------------------------------------

DATA=$SCRATCH/data
start_server "$DATA" --workers 2 || exit 1
post '/v1/meshes?format=ply' --data-binary "@$MESH_FILE"
MESH=$(json .id)
submit_all "$MESH" "$SCRATCH/ids"
is "$(sort -u "$SCRATCH/ids" | wc -l)" "$JOBS" 'forty-eight jobs are accepted'
for n in $(seq "$KILLS"); do
    sleep 0.2
    kill_server
    start_server "$DATA" --workers 2 || exit 1
done
is "$(count_jobs failed)" 0 'after a kill every fifth of a second none has failed'

# ---- A job that takes the daemon with it ---------------------------------------------------------------

# The last in the queue: whenever it begins to run, the daemon is killed.
execute encode "{\"mesh\":\"$MESH\",\"lmax\":127}" --header 'Prefer: respond-async'
DEADLY=$(json .id)
deaths=0
deadline=$(($(date +%s) + 200))
while [ "$deaths" -lt 5 ] && [ "$(date +%s)" -lt "$deadline" ]; do
    get "/v1/jobs/$DEADLY"
    case $(json .status) in
    running)
        kill_server
        deaths=$((deaths + 1))
        start_server "$DATA" --workers 2 || exit 1
        ;;
    failed | successful) break ;;
    esac
    sleep 0.05
done
is "$deaths" 4 'the daemon has died four times with the same job'
is "$(json '[.status, .exception.code] | join(" ")')" 'failed attempts-exhausted' 'which has failed then'
like "$(json .exception.detail)" 'died 4 times .* no other job beside it' 'and says why'
await_none_left
is "$(count_jobs successful) $(count_jobs failed)" "$JOBS 1" 'all others end successful'
stop_server || not_ok 'the server drains'
done_testing

#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: timeout 600
#
# kill -9 in the middle of a batch of fifty encode jobs, at moments left to chance; after the next start all
# fifty end successful, none that had succeeded runs again, and the database is intact.
#
#   SRNFD_KILL_ROUNDS=1  data directories (make crash has 3)    SRNFD_KILL_SEED=...  to repeat the moments of a run
#
# Each round kills twice: a job that both kills hit is at its third attempt, the last that it has.
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

ROUNDS=${SRNFD_KILL_ROUNDS:-1}
RANDOM=${SRNFD_KILL_SEED:-$$}
SEED=${SRNFD_KILL_SEED:-$$}
JOBS=50
MESH_FILE=tests/data/aal_subcortex/L_thalamus.ply

# Submits the jobs: ten degrees, five strengths of smoothing. Their ids go to the file.
submit_all() { # MESH FILE
    local degree smoothing
    : >"$2"
    for smoothing in 0 0.00001 0.0001 0.001 0.002; do
        for degree in 12 15 18 21 24 27 30 33 36 39; do
            execute encode "{\"mesh\":\"$1\",\"lmax\":$degree,\"smoothing\":$smoothing}" \
                --header 'Prefer: respond-async'
            [ "$STATUS" = 201 ] || return 1
            header Location | sed 's#.*/##' >>"$2"
        done
    done
}

# How many jobs are in a state, by the lists.
count_jobs() { # STATE
    get "/v1/jobs?limit=200&status=$1"
    json '.jobs | length'
}

# The ids of the jobs in a state, sorted.
ids_of() { # STATE
    get "/v1/jobs?limit=200&status=$1"
    json '.jobs[].id' | sort
}

# Waits until at least so many jobs are successful, or 150 s: builds that count lines are slow.
await_successful() { # COUNT
    local deadline=$(($(date +%s) + 150)) count=0
    while [ "$(date +%s)" -lt "$deadline" ]; do
        count=$(count_jobs successful)
        [ "${count:-0}" -ge "$1" ] && return 0
        sleep 0.02
    done
    return 1
}

# The ids of the log lines with an event, one per line.
logged() { # EVENT LOG..
    local event=$1
    shift
    jq -Rr --arg event "$event" 'fromjson? | objects | select(.event == $event) | .job' "$@"
}

# Lets some more jobs end, notes which have, and kills. Appends the ids to $1.
kill_amid() { # SUCCEEDED-FILE COUNT
    await_successful "$2"
    sleep "0.$(printf '%02d' $((RANDOM % 20)))"
    ids_of successful >>"$1"
    kill_server
}

# One data directory: two kills, then the truth.
round() { # NUMBER
    local data=$SCRATCH/data-$1 ids=$SCRATCH/ids-$1 succeeded=$SCRATCH/succeeded-$1
    local logs=() first second mesh id wrong=0
    first=$((RANDOM % 18))
    second=$((first + 3 + RANDOM % 15))
    note "round $1: kills after $first and $second successes"
    : >"$succeeded"

    start_server "$data" || return 1
    logs+=("$SERVER_LOG")
    post '/v1/meshes?format=ply' --data-binary "@$MESH_FILE"
    mesh=$(json .id)
    if ! submit_all "$mesh" "$ids"; then
        not_ok "round $1: the jobs are accepted" "status $STATUS" "$(head -c 300 "$BODY")"
        return 1
    fi
    is "$(sort -u "$ids" | wc -l)" "$JOBS" "round $1: fifty jobs are accepted"
    kill_amid "$succeeded" "$first"

    start_server "$data" || return 1
    logs+=("$SERVER_LOG")
    is "$(comm -23 <(sort -u "$succeeded") <(ids_of successful) | wc -l)" 0 \
        "round $1: what was successful before the kill is so after it"
    kill_amid "$succeeded" "$second"
    note "$(sort -u "$succeeded" | wc -l) jobs were known as successful at the second kill"

    start_server "$data" || return 1
    logs+=("$SERVER_LOG")
    await_successful "$JOBS"
    is "$(ids_of successful | comm -3 - <(sort "$ids") | wc -l)" 0 \
        "round $1: exactly the fifty jobs end successful"
    is "$(count_jobs accepted) $(count_jobs running) $(count_jobs failed) $(count_jobs dismissed)" \
        '0 0 0 0' "round $1: and none is left over"
    while read -r id; do
        get "/v1/jobs/$id/results"
        [ "$STATUS" = 200 ] && [ -n "$(json .surface.id)" ] || wrong=$((wrong + 1))
    done <"$ids"
    is "$wrong" 0 "round $1: all results are there"

    is "$(logged job-successful "${logs[@]}" | sort | uniq -d | wc -l)" 0 \
        "round $1: none succeeded twice"
    is "$(comm -12 <(logged job-successful "${logs[0]}" | sort) \
        <(logged job-running "${logs[1]}" "${logs[2]}" | sort -u) | wc -l)" 0 \
        "round $1: none ran again after it had succeeded"
    is "$(comm -12 <(logged job-successful "${logs[1]}" | sort) \
        <(logged job-running "${logs[2]}" | sort -u) | wc -l)" 0 \
        "round $1: nor after the second kill"
    if stop_server; then
        ok "round $1: the server drains"
    else
        not_ok "round $1: the server drains"
    fi
    if command -v sqlite3 >/dev/null; then
        is "$(sqlite3 "$data/srnfd.db" 'PRAGMA integrity_check; PRAGMA foreign_key_check;')" ok \
            "round $1: the database is intact"
        is "$(sqlite3 "$data/srnfd.db" 'SELECT max(attempt) <= 3, min(attempt) >= 1 FROM job')" '1|1' \
            "round $1: attempts are counted"
    else
        skip "round $1: the database is intact" 'no sqlite3'
    fi
}

note "seed $SEED"
for number in $(seq "$ROUNDS"); do
    round "$number" || not_ok "round $number goes to its end"
done
done_testing

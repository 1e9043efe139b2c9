# shellcheck shell=bash
# workers.sh - what tests of worker processes share: surfaces to compute with, workers, and leases by hand. Sourced after
# lib.sh.

BUILD= # the numeric build that leases by hand tell
WORKER_LOG=$SCRATCH/worker.log
: >"$WORKER_LOG"

# The numbers of a mean: the id of a surface is that of its coefficients.
MEAN_NUMBERS='[.surface.id, .relativeEnergy, .distances, [.history[] | [.change, .variance, .objective]]] | tojson'
FOLD_NUMBERS='.methods["srnf-nn"] | [.confusion, [.perSubject[] | [.predicted, .logLikelihoods]]] | tojson'

# Surfaces, as JSON: four, or of those names.
surfaces() { # [NAMES..]
    local ids=() name
    [ $# -gt 0 ] || set -- L_thalamus R_thalamus L_pallidum R_pallidum
    for name in "$@"; do
        post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":4}"
        ids+=("$(json .surface.id)")
    done
    jq -nc '$ARGS.positional' --args "${ids[@]}"
}

# Seconds of processors that a process has taken.
processor_of() { # PID
    awk -v tick="$(getconf CLK_TCK)" '{ sub(/.*\) /, ""); print ($12 + $13) / tick }' "/proc/$1/stat"
}

# So many shapes from one surface to another, with waves of their own, as JSON.
shapes_between() { # COUNT ID ID
    local i ids=()
    for i in 2 3; do
        get "/v1/surfaces/${!i}/coefficients"
        cp "$BODY" "$SCRATCH/end-$i"
    done
    for ((i = 0; i < $1; i++)); do
        post_json /v1/surfaces "$(jq -nc --argjson t "$i" --argjson n "$1" --slurpfile a "$SCRATCH/end-2" --slurpfile b "$SCRATCH/end-3" '
            def mix($m; $k): [range($a[0][$m] | length) as $j |
                $a[0][$m][$j] * (1 - $t / $n) + $b[0][$m][$j] * $t / $n * (1 + 0.1 * (($j * $k + $t * 7) | sin))];
            {coefficients: {lmax: $a[0].lmax, x: mix("x"; 3), y: mix("y"; 5), z: mix("z"; 11)}}')"
        ids+=("$(json .id)")
    done
    jq -nc '$ARGS.positional' --args "${ids[@]}"
}

start_worker() { # [ARGUMENTS..]; sets WORKER_PID
    nice -n 10 "$SRNFD" worker --server "${WORKER_URL:-$URL}" --slots 1 "$@" </dev/null >/dev/null 2>>"$WORKER_LOG" &
    WORKER_PID=$!
    SERVER_PIDS+=("$WORKER_PID")
}

# What tasks became of, in the log of all workers.
told() { # EVENT
    jq -Rr --arg event "$1" 'fromjson? | objects | select(.event == $event) | .task' "$WORKER_LOG" | wc -l
}

# Waits until some process of srnfd worker has a lease.
wait_leased() {
    local waited=0
    until get /v1/workers && [ "$(json '[.items[] | select(.worker != "by-hand") | .leased] | max')" = 1 ] ||
        [ "$waited" -gt 200 ]; do
        sleep 0.05
        waited=$((waited + 1))
    done
}

leased_to() { # PID; how many tasks, of the process of srnfd worker
    get /v1/workers
    json "[.items[] | select(.worker | test(\"-$1-[0-9a-f]{8}$\")) | .leased] | max"
}

# Stops a process of srnfd worker in the middle of a task, which may take a tenth of a second: again and again, until it is.
stop_at_work() { # PID
    local tries=0
    while [ "$tries" -lt 300 ]; do
        kill -STOP "$1"
        sleep 0.02 # what it had sent arrives
        [ "$(leased_to "$1")" != 1 ] || return
        kill -CONT "$1"
        sleep 0.03
        tries=$((tries + 1))
    done
}

matrix() { # JOB
    get "/v1/jobs/$1/results"
    json '.matrix | tojson'
}

# Leases as a worker would, by hand, under NAME: sets TASK and SECRET. The lease is in $BODY.
lease() { # [CURL ARGUMENTS..]
    post_json /v1/leases "$(jq -nc --arg build "$BUILD" --arg name "${NAME:-by-hand}" --argjson wait "${WAIT:-20}" \
        '{worker: $name, host: "here", cpu: "any", slots: 1, numericBuild: $build, wait: $wait}')" "$@"
    TASK=$(json .task)
    SECRET=$(json .secret)
}

# What the workers of this build tell; from the log of one that has worked.
read_build() {
    BUILD=$(jq -Rr 'fromjson? | objects | select(.event == "working") | .numericBuild' "$WORKER_LOG" | head -n 1)
}

# Sends bytes as the result of the lease.
result() { # FILE SECRET [DIGEST [CURL ARGUMENTS..]]
    local digest
    digest=${3:-sha-256=:$(openssl dgst -sha256 -binary "$1" | base64):}
    request PUT "/v1/leases/$TASK/result" --header "Lease-Secret: $2" --header "Content-Digest: $digest" \
        --header 'Worker-Host: here' --header 'Worker-CPU: any' --header "Worker-Build: ${MADE_BY-$BUILD}" \
        --header 'Content-Type: application/octet-stream' --data-binary "@$1" "${@:4}"
}

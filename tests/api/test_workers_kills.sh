#!/usr/bin/env bash
# srnfd-test: nightly
# srnfd-test: timeout 900
#
# test_workers_kills.sh - workers are killed at random while means are computed (KILLS=100), and now and then the daemon: each
# answer has the bits of the one that was computed here, and no task was accepted twice.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

KILLS=${KILLS:-100}
DATA=$SCRATCH/data
N=40
RANDOM=${SEED:-$$}
note "SEED=${SEED:-$$}"

# Forty shapes between one and another.
shapes() {
    local i ids=()
    surfaces L_caudate L_thalamus >"$SCRATCH/two"
    for i in 0 1; do
        get "/v1/surfaces/$(jq -r ".[$i]" "$SCRATCH/two")/coefficients"
        cp "$BODY" "$SCRATCH/end-$i"
    done
    for ((i = 0; i < N; i++)); do
        post_json /v1/surfaces "$(jq -nc --argjson t "$i" --argjson n "$N" --slurpfile a "$SCRATCH/end-0" --slurpfile b "$SCRATCH/end-1" '
            def mix($m; $k): [range($a[0][$m] | length) as $j |
                $a[0][$m][$j] * (1 - $t / $n) + $b[0][$m][$j] * $t / $n * (1 + 0.1 * (($j * $k + $t * 7) | sin))];
            {coefficients: {lmax: $a[0].lmax, x: mix("x"; 3), y: mix("y"; 5), z: mix("z"; 11)}}')"
        ids+=("$(json .id)")
    done
    jq -nc '$ARGS.positional' --args "${ids[@]}"
}

# Inputs of the mean number K: the same numbers, another job.
mean_of() { # K
    jq -nc --argjson surfaces "$SHAPES" --argjson k "$1" '{surfaces: $surfaces, tolerance: (0.01 + $k * 1e-9), maxIterations: 3}'
}

count() { # EVENT; of searches, since the daemon started
    get /metrics
    awk -v event="event=\"$1\"" '/^srnfd_tasks_total/ && /"searches"/ && index($0, event) { n = $2 } END { print n + 0 }' "$BODY"
}

start_server "$SCRATCH/local" --workers 2 || exit 1
SHAPES=$(shapes)
execute mean "$(mean_of 0)" --header 'Prefer: wait=200'
LOCAL=$(json "$MEAN_NUMBERS")
like "$LOCAL" '^\["surf-' 'a mean, computed here'
stop_server || not_ok 'it drains'

start_server "$DATA" --workers 2 --executor workers --lease-seconds 1 || exit 1
is "$(shapes)" "$SHAPES" 'the same shapes'
WORKERS=()
for i in 0 1 2; do
    start_worker --idle-seconds 0 --cache "$SCRATCH/cache"
    WORKERS[i]=$WORKER_PID
done
ADDRESS=${URL#http://}
killed=0
means=0
wrong=0
lost=0
while [ "$killed" -lt "$KILLS" ]; do
    means=$((means + 1))
    done_before=$(count "done")
    execute mean "$(mean_of "$means")" --header 'Prefer: respond-async'
    JOB=$(json .jobID)
    restarted=
    while get "/v1/jobs/$JOB" && case $(json .status) in accepted | running) true ;; *) false ;; esac; do
        sleep "$((RANDOM % 2)).$((RANDOM % 10))"
        victim=$((RANDOM % 3))
        kill_server "${WORKERS[victim]}"
        killed=$((killed + 1))
        start_worker --idle-seconds 0 --cache "$SCRATCH/cache"
        WORKERS[victim]=$WORKER_PID
        if [ $((killed % 20)) -eq 0 ]; then # the daemon too
            restarted=yes
            kill_server
            nice -n 10 "$SRNFD" serve --listen "$ADDRESS" --data "$DATA" --workers 2 --executor workers --lease-seconds 1 \
                </dev/null >/dev/null 2>"$SERVER_LOG" &
            SERVER_PID=$!
            SERVER_PIDS+=("$SERVER_PID")
            for _ in {1..200}; do
                get /readyz 2>/dev/null && break
                sleep 0.1
            done
        fi
    done
    get "/v1/jobs/$JOB/results"
    if [ "$(json "$MEAN_NUMBERS")" != "$LOCAL" ]; then
        wrong=$((wrong + 1))
        get "/v1/jobs/$JOB"
        note "mean $means: $(json .status) $(json .exception.detail)"
    fi
    if [ -z "$restarted" ]; then
        accepted=$(($(count "done") - done_before))
        [ "$accepted" -eq $((N / 2)) ] || note "mean $means: $accepted tasks accepted of $((N / 2))"
        [ "$accepted" -eq $((N / 2)) ] || lost=$((lost + 1))
    fi
done
note "$means means, $killed kills"
is "$wrong" 0 'each mean has the same bits'
is "$lost" 0 'and each of its tasks was accepted once'
for pid in "${WORKERS[@]}"; do
    kill -TERM "$pid"
    wait_server "$pid" 30
done
stop_server || not_ok 'the service drains'

done_testing

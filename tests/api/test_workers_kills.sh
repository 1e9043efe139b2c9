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
N=100
RANDOM=${SEED:-$$}
note "SEED=${SEED:-$$}"

# A hundred shapes between one and another.
shapes() {
    surfaces L_caudate L_thalamus >"$SCRATCH/two"
    shapes_between "$N" "$(jq -r '.[0]' "$SCRATCH/two")" "$(jq -r '.[1]' "$SCRATCH/two")"
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
counted=0
while [ "$killed" -lt "$KILLS" ] || [ "$counted" -eq 0 ]; do
    means=$((means + 1))
    done_before=$(count "done")
    execute mean "$(mean_of "$means")" --header 'Prefer: respond-async'
    JOB=$(json .jobID)
    restarts=0
    tasks=0 # of its first registrations, as it says
    while get "/v1/jobs/$JOB" && case $(json .status) in accepted | running) true ;; *) false ;; esac; do
        TASKS=$(json .message | sed -n 's/^[0-9]* of \([0-9]*\) tasks done.*/\1/p')
        [ -z "$TASKS" ] || tasks=$TASKS
        sleep "$((RANDOM % 2)).$((RANDOM % 10))"
        victim=$((RANDOM % 3))
        kill_server "${WORKERS[victim]}"
        killed=$((killed + 1))
        start_worker --idle-seconds 0 --cache "$SCRATCH/cache"
        WORKERS[victim]=$WORKER_PID
        # The daemon too, in every other mean: with the fourth death its job would be what kills it.
        if [ $((killed % 10)) -eq 0 ] && [ $((means % 2)) -eq 1 ] && [ "$restarts" -lt 2 ]; then
            restarts=$((restarts + 1))
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
    if [ "$restarts" -eq 0 ] && [ "$tasks" -gt 0 ]; then
        counted=$((counted + 1))
        accepted=$(($(count "done") - done_before))
        [ "$accepted" -eq "$tasks" ] || note "mean $means: $accepted tasks accepted of $tasks"
        [ "$accepted" -eq "$tasks" ] || lost=$((lost + 1))
    fi
done
note "$means means, $killed kills, $counted means without a death of the daemon"
is "$wrong" 0 'each mean has the same bits'
is "$lost" 0 'and each task of those means that the daemon outlived was accepted once'
for pid in "${WORKERS[@]}"; do
    kill -TERM "$pid"
    wait_server "$pid" 30
done
stop_server || not_ok 'the service drains'

done_testing

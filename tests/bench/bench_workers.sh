#!/usr/bin/env bash
# bench_workers.sh - a mean, a classification and distances by the daemon alone and by one to six processes of srnfd worker on
# this machine: the same bits, and what it costs. Seconds of processors tell what tasks cost beside their computation,
# whatever else the machine does: efficiency is what the daemon alone takes, divided by what all processes take. "On n" is
# how long the job would take with a processor for each worker and two for the daemon, against the processor time of the
# daemon alone divided by n: what the daemon computes by itself is part of it.
#
#   SHAPES=FOLDER    meshes of the mean and the classification; tests/data/aal_subcortex without it and ../shared/data
#   MEMBERS=100      of them, at most
#   DEGREE=15        of all surfaces
#   PAIRED=20        of the distances

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

VENTRICLES=../shared/data/lv_endocardium_ed
[ -n "${SHAPES-}" ] || { [ -d "$VENTRICLES" ] && SHAPES=$VENTRICLES; }
SHAPES=${SHAPES:-tests/data/aal_subcortex}
MEMBERS=${MEMBERS:-100}
DEGREE=${DEGREE:-15}
PAIRED=${PAIRED:-20}
WORKERS=${WORKERS:-1 2 4 6}
REQUEST_SECONDS=3600
mapfile -t FILES < <(find -L "$SHAPES" -name '*.ply' | sort | head -n "$MEMBERS")

upload() { # sets MEMBER_IDS
    local ids=() file
    for file in "${FILES[@]}"; do
        post "/v1/meshes?name=$(basename "$file" .ply)" --data-binary "@$file"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$DEGREE}"
        ids+=("$(json .surface.id)")
    done
    MEMBER_IDS=$(jq -nc '$ARGS.positional' --args "${ids[@]}")
    post_json /v1/cohorts "$(jq -c '{name: "members", members: [to_entries[] |
        {id: .value, label: (if .key % 2 == 0 then "one" else "other" end)}]}' <<<"$MEMBER_IDS")"
}

seconds_of_all() { # PIDS..
    local pid sum=0
    for pid; do
        sum=$(awk -v a="$sum" -v b="$(processor_of "$pid")" 'BEGIN { print a + b }')
    done
    echo "$sum"
}

minus() {
    awk -v a="$1" -v b="$2" 'BEGIN { print a - b }'
}

# Computes it anew: sets WALL, GOT and the seconds DAEMON and HANDS.
run() { # PROCESS INPUTS NUMBERS PIDS..
    local process=$1 inputs=$2 numbers=$3 begun daemon hands
    shift 3
    begun=$(date +%s.%N)
    daemon=$(processor_of "$SERVER_PID")
    hands=$(seconds_of_all "$@")
    execute "$process" "$inputs" --header 'Prefer: respond-async'
    if [ "$(json .cache)" = hit ]; then
        request DELETE "/v1/jobs/$(json .jobID)"
        execute "$process" "$inputs" --header 'Prefer: respond-async'
    fi
    JOB=$(json .jobID)
    while get "/v1/jobs/$JOB" && case $(json .status) in accepted | running) true ;; *) false ;; esac; do
        sleep 0.5
    done
    WALL=$(minus "$(date +%s.%N)" "$begun")
    DAEMON=$(minus "$(processor_of "$SERVER_PID")" "$daemon")
    HANDS=$(minus "$(seconds_of_all "$@")" "$hands")
    get "/v1/jobs/$JOB/results"
    GOT=$(json "$numbers" | sha256sum)
}

tasks_counted() {
    get /metrics
    awk '/^srnfd_tasks_total\{.*event="done"/ { n += $2 } END { print n + 0 }' "$BODY"
}

names=(mean classify distances)
declare -A inputs numbers alone bits
numbers[mean]=$MEAN_NUMBERS
numbers[classify]=$FOLD_NUMBERS
numbers[distances]='.matrix[]'
start_server "$SCRATCH/alone" --workers 2 || exit 1
upload
inputs[mean]="{\"surfaces\":$MEMBER_IDS}"
inputs[classify]='{"cohort":"members","method":"srnf-nn"}'
inputs[distances]="{\"surfaces\":$(jq -c ".[:$PAIRED]" <<<"$MEMBER_IDS"),\"handedness\":\"ignore\"}"
printf '%d shapes of %s, degree %d\n\n' "${#FILES[@]}" "$(basename "$SHAPES")" "$DEGREE"
printf '%-10s %7s %7s %8s %9s %10s %11s %9s %12s %s\n' process workers tasks 's' 'daemon s' 'workers s' efficiency 'on n, s' \
    'against' bits
for name in "${names[@]}"; do
    run "$name" "${inputs[$name]}" "${numbers[$name]}"
    alone[$name]=$DAEMON
    bits[$name]=$GOT
    printf '%-10s %7s %7s %8.1f %9.1f\n' "$name" alone '' "$WALL" "$DAEMON"
done
stop_server || exit 1
start_server "$SCRATCH/spread" --workers 2 --executor workers --verify-tasks 0 || exit 1
upload
status=0
for n in $WORKERS; do
    PIDS=()
    for ((i = 0; i < n; i++)); do
        start_worker --idle-seconds 0
        PIDS+=("$WORKER_PID")
    done
    for name in "${names[@]}"; do
        TASKS=$(tasks_counted)
        run "$name" "${inputs[$name]}" "${numbers[$name]}" "${PIDS[@]}"
        SAME=same
        [ "$GOT" = "${bits[$name]}" ] || { SAME=OTHERS; status=1; }
        awk -v name="$name" -v n="$n" -v wall="$WALL" -v alone="${alone[$name]}" -v daemon="$DAEMON" -v hands="$HANDS" \
            -v tasks="$(($(tasks_counted) - TASKS))" -v same=$SAME 'BEGIN {
            printf "%-10s %7d %7d %8.1f %9.1f %10.1f %9.1f %% %9.1f %9.1f    %s\n", name, n, tasks, wall, daemon, hands,
                100 * alone / (daemon + hands), hands / n + daemon / 2, alone / n, same }'
    done
    for pid in "${PIDS[@]}"; do
        kill -TERM "$pid"
        wait_server "$pid" 60
    done
done
stop_server && exit $status

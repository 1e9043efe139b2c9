#!/usr/bin/env bash
# bench_workers.sh - distances of nine nuclei at degree 15, 36 tasks, by the daemon alone and by one to six processes of
# srnfd worker on this machine. Seconds of processors tell what tasks cost beside their computation, whatever else the
# machine does; the ideal time is that of the daemon alone, divided by the processors that the workers have.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

NAMES=(L_thalamus R_thalamus L_pallidum R_pallidum L_putamen R_putamen L_amygdala R_amygdala L_caudate)
TASKS=36
DATA=$SCRATCH/data
REQUEST_SECONDS=600

# The distances in an order of their own: sets WALL and the seconds of all processes, DAEMON and HANDS.
run() { # SHIFT PIDS..
    local shift=$1 begun before pid
    shift
    before=$(processor_of "$SERVER_PID")
    begun=$(date +%s.%N)
    execute distances "$(jq -c --argjson k "$shift" '{surfaces: (.[$k:] + .[:$k]), handedness: "ignore"}' <<<"$SURFACES")" \
        --header 'Prefer: wait=600'
    WALL=$(awk -v a="$begun" -v b="$(date +%s.%N)" 'BEGIN { print b - a }')
    [ "$STATUS" = 200 ] || echo "status $STATUS: $(head -c 300 "$BODY")" >&2
    DAEMON=$(awk -v a="$before" -v b="$(processor_of "$SERVER_PID")" 'BEGIN { print b - a }')
    HANDS=0
    for pid; do
        HANDS=$(awk -v a="$HANDS" -v b="$(processor_of "$pid")" 'BEGIN { print a + b }')
    done
}

upload() {
    local ids=() name
    for name in "${NAMES[@]}"; do
        post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":15}"
        ids+=("$(json .surface.id)")
    done
    SURFACES=$(jq -nc '$ARGS.positional' --args "${ids[@]}")
}

start_server "$DATA" --workers 2 || exit 1
upload
run 0
ALONE=$DAEMON
printf '%8s %8s %8s %10s %12s %12s %12s\n' workers s 'ideal s' 'cpu s' efficiency 'by time' 'daemon ms'
printf '%8s %8.1f %8s %10.1f\n' alone "$WALL" '' "$ALONE"
stop_server || exit 1
start_server "$DATA" --workers 2 --executor workers || exit 1
for n in 1 2 4 6; do
    PIDS=()
    for ((i = 0; i < n; i++)); do
        start_worker --idle-seconds 0
        PIDS+=("$WORKER_PID")
    done
    run "$n" "${PIDS[@]}"
    awk -v n="$n" -v wall="$WALL" -v alone="$ALONE" -v daemon="$DAEMON" -v hands="$HANDS" -v tasks=$TASKS -v cores="$(nproc)" 'BEGIN {
        ideal = alone / (n < cores ? n : cores)
        printf "%8d %8.1f %8.1f %10.1f %10.1f %% %10.1f %% %12.2f\n", n, wall, ideal, daemon + hands,
            100 * alone / (daemon + hands), 100 * ideal / wall, 1000 * daemon / tasks }'
    for pid in "${PIDS[@]}"; do
        kill -TERM "$pid"
        wait_server "$pid" 30
    done
done
stop_server

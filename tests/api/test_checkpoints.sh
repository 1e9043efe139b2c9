#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: slow
# srnfd-test: timeout 600
#
# test_checkpoints.sh - jobs that are killed with kill -9 half way and go on from there: classify from the members that
# were registered, evaluate-model from the samples that were measured, compare-groups from the iterations of its mean.
# test_statistics.sh has mean itself, test_bridged.sh has distances. Their numbers are those of jobs that were left in peace, to the last bit.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
REQUEST_SECONDS=400

# Eight surfaces between the left and the right nucleus of a kind.
between() { # KIND
    local ends=() side
    for side in L R; do
        post "/v1/meshes?name=${side}_$1" --data-binary "@tests/data/aal_subcortex/${side}_$1.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX}"
        ends+=("$(json .surface.id)")
    done
    execute geodesic "{\"from\":\"${ends[0]}\",\"to\":\"${ends[1]}\",\"steps\":8,\"register\":false}"
    json '[.surfaces[].id] | tojson'
}
prepare() {
    local a b
    a=$(between thalamus)
    b=$(between pallidum)
    post_json /v1/cohorts "$(jq -nc --argjson a "$a" --argjson b "$b" \
        '{name: "nuclei", members: [(0, 1, 2, 3, 4, 5, 6, 7) as $i | {id: $a[$i], label: "a"}, {id: $b[$i], label: "b"}]}')"
    is "$STATUS" 201 'a cohort of surfaces'
}
CLASSIFY='{"cohort":"nuclei","method":["srnf-nn","srm-nn"],"refit":"shared"}'
COMPARE='{"cohort":"nuclei","permutations":99,"commonPose":true,"tolerance":1e-8,"maxIterations":6}'
EVALUATE='{"cohort":"nuclei","register":false,"components":4,"samples":1600}'
numbers() { # PROCESS: its numbers in the last body
    case $1 in
    classify) jq -S '[.methods]' "$BODY" ;;
    compare-groups) jq -S '[.pValue, .distance, .map, .leastSignificance]' "$BODY" ;;
    evaluate-model) jq -S '[.compactness, .generalisation, .specificity]' "$BODY" ;;
    esac
}
logged() { # EVENT JOB: the details, one a line
    jq -Rr --arg event "$1" --arg job "$2" \
        'fromjson? | objects | select(.event == $event and .job == $job) | .detail' "$SERVER_LOG"
}

start_server "$SCRATCH/whole" --workers 2 || exit 1
prepare
for PROCESS in classify compare-groups evaluate-model; do
    case $PROCESS in
    classify) INPUTS=$CLASSIFY ;; compare-groups) INPUTS=$COMPARE ;; *) INPUTS=$EVALUATE ;;
    esac
    execute "$PROCESS" "$INPUTS" --header 'Prefer: wait=300'
    is "$STATUS" 200 "$PROCESS that is left in peace"
    numbers "$PROCESS" >"$SCRATCH/$PROCESS.json"
    [ "$PROCESS" = compare-groups ] && ITERATIONS=$(json .iterations)
done
stop_server || not_ok 'the server ends well'

# Runs a process until it has left a checkpoint of more than so many bytes and is half done, kills the server, and
# lets the job end. BEFORE: checkpoints of its state before the kill.
cut() { # PROCESS INPUTS BYTES PROGRESS
    local last
    execute "$1" "$2" --header 'Prefer: respond-async'
    JOB=$(json .id)
    for _ in $(seq 6000); do
        get "/v1/jobs/$JOB"
        last=$(logged job-checkpoint "$JOB" | tail -n 1)
        [ "$(json ".progress >= $4 or .status != \"running\"")" = true ] && [ "${last%% *}" ] && [ "${last%% *}" -gt "$3" ] && break
        [ "$(json '.status | . == "successful" or . == "failed"')" = true ] && break
        sleep 0.05
    done
    is "$(json .status)" running "$1 runs"
    kill_server
    BEFORE=$(logged job-checkpoint "$JOB" | grep -c state)
    note "killed at $(json .progress) %, last checkpoint ${last:-none}"
    start_server "$SCRATCH/cut" --workers 2 || exit 1
    poll_job "$JOB" 400
    is "$JOB_STATUS $(json .attempt)" 'successful 2' "$1 that was killed half way ends well"
    RESUMED=$(logged job-resumed "$JOB")
    is "$(wc -l <<<"$RESUMED")" 1 'it goes on from its checkpoint'
    compare "${RESUMED%% *}" '>' "$3" 'which holds what it had'
    get "/v1/jobs/$JOB/results"
    numbers "$1" >"$SCRATCH/cut.json"
    check 'and gives the same numbers' cmp "$SCRATCH/$1.json" "$SCRATCH/cut.json"
}

start_server "$SCRATCH/cut" --workers 2 || exit 1
prepare
PART=$((24 + 8 * 3 * 8 * 16)) # a registered member: a field on the grid of degree 4
cut classify "$CLASSIFY" $((40 + 3 * PART)) 10
cut compare-groups "$COMPARE" 100 15
compare "$((BEFORE + $(logged job-checkpoint "$JOB" | grep -c state)))" '<=' "$ITERATIONS" 'no iteration of the mean is done again'
cut evaluate-model "$EVALUATE" $((40 + 300 * (24 + 8 * 8))) 45
if command -v sqlite3 >/dev/null; then
    is "$(sqlite3 "$SCRATCH/cut/srnfd.db" 'SELECT count(*) FROM checkpoint')" 0 'the checkpoints are gone'
fi
stop_server || not_ok 'the server ends well'
done_testing

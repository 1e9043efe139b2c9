#!/usr/bin/env bash
# test_kill_statistics.sh - kill -9 amid score, change, asymmetry and trajectories: after the next start each ends with
# the numbers of a job that was left in peace, to the last bit; and each ends soon when it is cancelled.
# srnfd-test: nightly
# srnfd-test: timeout 1200
#
#   SRNFD_ENDS_LIMIT=5000  milliseconds that the end of a cancelled job may take: 1000 are promised on an idle machine

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LIMIT=${SRNFD_ENDS_LIMIT:-5000}
REQUEST_SECONDS=400
LMAX=12

# Six nuclei: the left ones at time 0, the right ones, mirrored by asymmetry alone, at time 1; and a model of all.
prepare() {
    local members='' side name hand id
    for name in amygdala caudate hippocampus pallidum putamen thalamus; do
        for side in L R; do
            hand=$([ "$side" = L ] && echo left || echo right)
            post "/v1/meshes?name=${side}_$name" --data-binary "@tests/data/aal_subcortex/${side}_$name.ply"
            execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX}" --header 'Prefer: wait=300'
            id=$(json .surface.id)
            members="$members,{\"id\":\"$id\",\"subject\":\"$name\",\"side\":\"$hand\",\"time\":$([ "$side" = L ] && echo 0 || echo 1)}"
        done
    done
    post_json /v1/cohorts "{\"name\":\"pairs\",\"members\":[${members#,}]}"
    is "$STATUS" 201 'a cohort of pairs'
    execute pca '{"cohort":"pairs","register":false}' --header 'Prefer: wait=300'
    MODEL=$(json .model.id)
    SURFACE=$id
}
inputs() { # PROCESS SEED
    case $1 in
    score) echo "{\"model\":\"$MODEL\",\"surface\":\"$SURFACE\"}" ;;
    trajectories) echo "{\"cohort\":\"pairs\",\"at\":[{\"time\":0.5}],\"seed\":$2}" ;;
    *) echo "{\"cohort\":\"pairs\",\"seed\":$2}" ;;
    esac
}
numbers() { # of the last body: all but records of surfaces and times of the clock
    jq -S 'del(.. | objects | (.seconds?, .created?, .job?, .links?, .source?))' "$BODY"
}
# Submits, and waits until it is well under way.
begin() { # PROCESS SEED
    execute "$1" "$(inputs "$1" "$2")" --header 'Prefer: respond-async'
    JOB=$(json .id)
    for _ in $(seq 4000); do
        get "/v1/jobs/$JOB"
        [ "$(json '(.progress // 0) >= 15 or .status == "successful" or .status == "failed"')" = true ] && break
        sleep 0.02
    done
    is "$(json .status)" running "$1 runs"
}
PROCESSES='score change asymmetry trajectories'

start_server "$SCRATCH/whole" --workers 2 || exit 1
prepare
for PROCESS in $PROCESSES; do
    execute "$PROCESS" "$(inputs "$PROCESS" 1)" --header 'Prefer: wait=400'
    is "$STATUS" 200 "$PROCESS that is left in peace"
    numbers >"$SCRATCH/$PROCESS.json"
done
stop_server || not_ok 'the server ends well'

start_server "$SCRATCH/cut" --workers 2 || exit 1
prepare
for PROCESS in $PROCESSES; do
    begin "$PROCESS" 1
    kill_server
    start_server "$SCRATCH/cut" --workers 2 || exit 1
    poll_job "$JOB" 400
    is "$JOB_STATUS $(json .attempt)" 'successful 2' "$PROCESS that was killed ends well"
    get "/v1/jobs/$JOB/results"
    numbers >"$SCRATCH/cut.json"
    check 'with the same numbers' cmp "$SCRATCH/$PROCESS.json" "$SCRATCH/cut.json"
done
for PROCESS in $PROCESSES; do
    [ "$PROCESS" = score ] && continue # it has no seed, and is in the cache: bench_ends.sh cancels it
    begin "$PROCESS" 2
    FROM=$(date +%s%3N)
    post "/v1/jobs/$JOB/cancel"
    poll_job "$JOB" 60
    LAG=$(($(date +%s%3N) - FROM))
    is "$JOB_STATUS" dismissed "$PROCESS is cancelled"
    compare "$LAG" '<' "$LIMIT" "within $LAG ms"
done
stop_server || not_ok 'the server ends well'
done_testing

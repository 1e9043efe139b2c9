#!/usr/bin/env bash
# srnfd-test: nightly
# srnfd-test: timeout 900
#
# test_blocks.sh - distances of so many pairs that a task is a block of them: with the same bits as here, whatever worker
# computed which, and whoever was killed.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

REQUEST_SECONDS=600
MEMBERS=17 # 136 pairs: two in each task

start_server "$SCRATCH/local" --workers 2 || exit 1
ENDS=$(surfaces L_thalamus R_caudate)
SHAPES=$(shapes_between "$MEMBERS" "$(jq -r '.[0]' <<<"$ENDS")" "$(jq -r '.[1]' <<<"$ENDS")")
INPUTS="{\"surfaces\":$SHAPES,\"handedness\":\"ignore\"}"
execute distances "$INPUTS" --header 'Prefer: wait=300'
LOCAL=$(json '.matrix | tojson')
like "$LOCAL" '^\[\[0,0\.[0-9]' 'distances, computed here'
stop_server || not_ok 'it drains'

start_server "$SCRATCH/spread" --workers 2 --executor workers --lease-seconds 2 --verify-tasks 0.1 || exit 1
ENDS=$(surfaces L_thalamus R_caudate)
is "$(shapes_between "$MEMBERS" "$(jq -r '.[0]' <<<"$ENDS")" "$(jq -r '.[1]' <<<"$ENDS")")" "$SHAPES" 'the same surfaces'
start_worker
FIRST=$WORKER_PID
start_worker
execute distances "$INPUTS" --header 'Prefer: respond-async'
JOB=$(json .jobID)
until get "/v1/jobs/$JOB" && [ "$(json '(.progress // 0) > 30 or .status != "running" and .status != "accepted"')" = true ]; do
    sleep 0.2
done
kill -9 "$FIRST"
poll_job "$JOB" 300
get "/v1/jobs/$JOB"
is "$(json '[.status, (.executors | map(.tasks) | add)] | tojson')" '["successful",68]' 'tasks of two pairs, though a worker was killed'
get "/v1/jobs/$JOB/results"
is "$(json '.matrix | tojson')" "$LOCAL" 'have the same bits'
stop_server
is $? 0 'the daemon ends well'
done_testing

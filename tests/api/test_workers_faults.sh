#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: timeout 300
#
# test_workers_faults.sh - workers and machines that fail while tasks are computed: a worker that hangs, with heartbeats and
# without, a network that is cut or changes bytes, a full disk, clocks that are wrong or step, a computation that fails
# everywhere. The answer has the same bits each time.
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

CLOCK=$SCRATCH/clock
SHIM=$SRNFD_BUILD/tests/clock_shim.so
echo 0 >"$CLOCK"

# Submits distances of surfaces by their places: sets JOB and ORDER. An order that was asked for before is not computed
# again.
submit() { # ORDER
    ORDER=$1
    execute distances "$(jq -c --argjson order "$1" '{surfaces: [.[$order[]]], handedness: "ignore"}' <<<"$SURFACES")" \
        --header 'Prefer: respond-async'
    JOB=$(json .jobID)
    [ "$(json .cache)" != hit ] || not_ok "the order $1 was asked for before"
}

# Waits for the job and compares its matrix: the distance of two surfaces is the same in any order.
has_bits() { # NAME
    poll_job "$JOB" 60
    is "$JOB_STATUS $(matrix "$JOB")" "successful $(jq -c --argjson order "$ORDER" '[.[$order[]] | [.[$order[]]]]' <<<"$LOCAL")" "$1"
}

# A network that can be cut: workers beyond it come through NEAR.
/usr/bin/python3 tests/support/proxy.py "$SCRATCH/far" >"$SCRATCH/near" &
PROXY=$!
SERVER_PIDS+=("$PROXY")
waited=0
until [ -s "$SCRATCH/near" ] || [ "$waited" -gt 100 ]; do
    sleep 0.05
    waited=$((waited + 1))
done
NEAR=127.0.0.1:$(cat "$SCRATCH/near")

# ---- As it is computed here, and once by a worker --------------------------------------------------------

start_server "$SCRATCH/local" --workers 2 || exit 1
SURFACES=$(surfaces)
submit '[0,1,2,3]'
poll_job "$JOB" 60
LOCAL=$(matrix "$JOB")
stop_server || not_ok 'it drains'

CLOCK_SHIM=$CLOCK LD_PRELOAD=$SHIM start_server "$SCRATCH/data" --workers 2 --executor workers --lease-seconds 2 --verify-tasks 0 \
    --task-seconds 4 --allowed-hosts "$NEAR" --insecure || exit 1
echo "${URL##*:}" >"$SCRATCH/far"
is "$(surfaces)" "$SURFACES" 'the same surfaces'
start_worker --idle-seconds 0.1
wait_server "$WORKER_PID" 20
read_build
like "$BUILD" '[a-z]' 'a worker tells its build'

# ---- A computation that fails ---------------------------------------------------------------------------

fail_by_hand() { # DETAIL CERTAIN
    lease
    post_json "/v1/leases/$TASK/failure" "{\"detail\":\"$1\",\"certain\":$2}" --header "Lease-Secret: $SECRET"
}

submit '[0,1]'
fail_by_hand 'the matrix is singular' true
fail_by_hand 'another reason' true
fail_by_hand 'the matrix is singular' false
fail_by_hand 'the matrix is singular' true
get "/v1/jobs/$JOB"
is "$(json .status)" running 'one certain failure, or two that differ, end nothing'
fail_by_hand 'the matrix is singular' true
poll_job "$JOB" 20
is "$JOB_STATUS $(json .exception.code)" 'failed task-failed' 'what fails twice in the same way fails its job'
like "$(json .exception.detail)" 'was lost 5 times.*the matrix is singular' 'and says how'
submit '[0,2]'
fail_by_hand 'the matrix is singular' true
fail_by_hand 'the matrix is singular' true
poll_job "$JOB" 20
is "$JOB_STATUS" failed 'at the second attempt'
like "$(json .exception.detail)" 'was lost 2 times' 'without three more'
lease_body='{"detail":"x","certain":"yes"}'
post_json "/v1/leases/$TASK/failure" "$lease_body" --header "Lease-Secret: $SECRET"
is_problem 422 invalid-input 'certain is a boolean'

# ---- A worker that hangs, but its heart beats -------------------------------------------------------------

submit '[0,1,2]'
lease
before=$(stat -c %s "$SCRATCH/data/"*-wal 2>/dev/null | paste -sd+ | bc)
after='not measured'
beats=0
request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
started=$(date +%s%N)
while [ "$STATUS" = 200 ] && [ "$beats" -lt 100 ]; do
    beats=$((beats + 1))
    sleep 0.1
    request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
    [ "$beats" != 10 ] || after=$(stat -c %s "$SCRATCH/data/"*-wal 2>/dev/null | paste -sd+ | bc)
done
is_problem 409 lease-lost 'whoever brings nothing loses the lease, whatever signs he gives'
compare "$(($(date +%s%N) - started))" '>=' 3000000000 'after the time of a task'
compare "$beats" '>=' 10 'and before it heartbeats are answered'
is "$after" "$before" 'they write nothing to the disk'
start_worker --idle-seconds 2
has_bits 'the others compute it'
get /metrics
like "$(cat "$BODY")" 'srnfd_tasks_total\{kind="pairs",event="lost"\}' 'the loss is counted'
like "$(cat "$BODY")" 'srnfd_task_seconds_total\{kind="pairs"\} [0-9.]+' 'and the seconds of those that are done'
like "$(cat "$SERVER_LOG")" 'task-lost.*no result of by-hand in 4 s' 'and told'
wait_server "$WORKER_PID" 20

# ---- A worker that hangs altogether -----------------------------------------------------------------------

submit '[3,2,1,0]'
: >"$WORKER_LOG"
start_worker --idle-seconds 2
FROZEN=$WORKER_PID
stop_at_work "$FROZEN"
start_worker --idle-seconds 4
has_bits 'a worker is frozen, and another one goes on'
get /metrics
done_before=$(grep 'kind="pairs",event="done"' "$BODY")
kill -CONT "$FROZEN"
wait_server "$FROZEN" 30
is "$SERVER_STATUS" 0 'the frozen one wakes up and ends as ever'
compare "$(($(told task-dropped) + $(told lease-lost)))" '>=' 1 'its task is dropped'
get /metrics
is "$(grep 'kind="pairs",event="done"' "$BODY")" "$done_before" 'and its result not taken'
wait_server "$WORKER_PID" 20

# ---- A network that is cut --------------------------------------------------------------------------------

submit '[0,1,3]'
: >"$WORKER_LOG"
WORKER_URL=http://$NEAR start_worker --idle-seconds 30
CUT=$WORKER_PID
wait_leased
kill -STOP "$PROXY"
start_worker --idle-seconds 4
has_bits 'the network is cut, and a worker this side of it goes on'
kill -CONT "$PROXY"
submit '[0,3]'
has_bits 'it heals'
get /v1/workers
compare "$(json '[.items[] | select(.worker != "by-hand")] | length')" '>=' 2 'the worker beyond it comes back'
kill -TERM "$CUT"
wait_server "$CUT" 30
is "$SERVER_STATUS" 0 'and drains' || tail -n 5 "$WORKER_LOG" >&2
wait_server "$WORKER_PID" 20

# ---- A network that changes bytes --------------------------------------------------------------------------

submit '[3,0,1]'
: >"$WORKER_LOG"
touch "$SCRATCH/far.damage"
WORKER_URL=http://$NEAR start_worker --idle-seconds 60 # it may rest after the loss
has_bits 'bytes of a surface are changed on their way to a worker: what is computed is the same'
is "$(jq -Rr 'fromjson? | objects | select(.event == "task-failed") | .detail' "$WORKER_LOG")" \
    'what the task is about came damaged' 'since it has looked at them'
kill -TERM "$WORKER_PID"
wait_server "$WORKER_PID" 20

# ---- A full disk at a worker ------------------------------------------------------------------------------

submit '[0,2,3]'
(
    ulimit -f 0
    trap '' PIPE
    exec nice -n 10 "$SRNFD" worker --server "$URL" --slots 1 --idle-seconds 3 --cache "$SCRATCH/full" </dev/null 2>&1 >/dev/null
) | cat >"$SCRATCH/full.log" &
FULL=$!
has_bits 'a worker has no room on its disk: what it computes is the same'
wait "$FULL"
is "$(find "$SCRATCH/full" -type f | wc -l)" 0 'it keeps nothing'
like "$(cat "$SCRATCH/full.log")" '"stopped"' 'and ends as ever'

# ---- Clocks -----------------------------------------------------------------------------------------------

echo 7200 >"$SCRATCH/ahead"
submit '[1,0,3,2]'
: >"$WORKER_LOG"
CLOCK_SHIM=$SCRATCH/ahead LD_PRELOAD=$SHIM start_worker --idle-seconds 3
wait_leased
echo 86400 >"$CLOCK"
has_bits 'the clock of the daemon steps a day ahead, that of the worker is two hours off'
is "$(told lease-lost) $(told task-dropped)" '0 0' 'and no lease is lost for it'
submit '[1,2,3]'
wait_leased
echo -86400 >"$CLOCK"
has_bits 'the clock steps two days back'
submit '[2,1,3]'
NAME=silent lease # by-hand has lost so much that it rests beside the worker
sleep 3
request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
is_problem 409 lease-lost 'and leases expire as ever'
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 20
wait_server "$WORKER_PID" 20
stop_server || not_ok 'the service drains'

done_testing

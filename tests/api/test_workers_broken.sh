#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: timeout 300
#
# test_workers_broken.sh - workers that lease and bring nothing, beside others that work: who gets what they have lost,
# who rests, how much one may hold, and whose a lease is.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

# Leases as the worker of that name, by hand.
lease_as() { # NAME [SLOTS [CURL ARGUMENTS..]]
    post_json /v1/leases "$(jq -nc --arg build "$BUILD" --arg name "$1" --argjson slots "${2:-1}" --argjson wait "${WAIT:-20}" \
        '{worker: $name, host: "here", cpu: "any", slots: $slots, numericBuild: $build, wait: $wait}')" "${@:3}"
    TASK=$(json .task)
    SECRET=$(json .secret)
}

fail() { # DETAIL CERTAIN [CURL ARGUMENTS..]
    post_json "/v1/leases/$TASK/failure" "{\"detail\":\"$1\",\"certain\":$2}" --header "Lease-Secret: $SECRET" "${@:3}"
}

submit() { # SURFACES
    execute distances "{\"surfaces\":$1,\"handedness\":\"ignore\"}" --header 'Prefer: respond-async'
    JOB=$(json .jobID)
}

start_server "$SCRATCH/data" --workers 2 --executor workers --lease-seconds 5 || exit 1
SURFACES=$(surfaces)
PAIR=$(jq -c '.[:2]' <<<"$SURFACES")
start_worker --idle-seconds 0.1
wait_server "$WORKER_PID" 20
read_build

# ---- Beside one that works -------------------------------------------------------------------------------

submit "$SURFACES"
: >"$WORKER_LOG"
lease_as broken
fail 'out of memory' false
start_worker --idle-seconds 4
leases=1
poll=running
until [ "$poll" != running ] || [ "$leases" -gt 60 ]; do
    WAIT=0.1 lease_as broken
    [ "$STATUS" != 201 ] || { fail 'out of memory' false && leases=$((leases + 1)); }
    get "/v1/jobs/$JOB"
    poll=$(json .status)
done
poll_job "$JOB" 60
is "$JOB_STATUS" successful 'one broken worker fails no job that another can compute'
compare "$leases" '<=' 8 'and rests: it gets few tasks'
is "$(told task-done)" 6 'the other one computes all'
wait_server "$WORKER_PID" 20

submit "$PAIR"
lease_as broken
FIRST=$TASK
fail 'it always breaks' true
WAIT=0.1 lease_as other
[ "$STATUS" = 201 ] || WAIT=3 lease_as other
is "$TASK" "$FIRST" 'what one has lost goes to another'
post_json "/v1/leases/$TASK/failure" '{"detail":"it always breaks","certain":true}' --header "Lease-Secret: $SECRET"
poll_job "$JOB" 20
is "$JOB_STATUS" failed 'two workers say the same, and the job fails'
like "$(json .exception.detail)" 'was lost 2 times by 2 workers' 'and how many tried is told'

# ---- Slots -----------------------------------------------------------------------------------------------

submit "$(jq -c '[.[3], .[1], .[0]]' <<<"$SURFACES")"
lease_as miser 1
is "$STATUS" 201 'a worker with one slot gets a task'
HELD=$TASK KEY=$SECRET
WAIT=0.1 lease_as miser 1
is "$STATUS" 204 'and no second one'
lease_as honest 2
is "$STATUS" 201 'others do'
WAIT=1 lease_as honest 2
is "$STATUS" 201 'as many as they have slots'
request DELETE "/v1/leases/$HELD" --header "Lease-Secret: $KEY"
WAIT=1 lease_as miser 1
is "$STATUS" 201 'one that is given back makes room'
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 20
get /v1/workers
is "$(json '[.items[].leased] | add')" 0 'no lease outlives its job'

# ---- Names -----------------------------------------------------------------------------------------------

for name in "a
b" '<script>' $'\a' 'é'; do
    WAIT=0 lease_as "$name"
    is_problem 422 invalid-input "no name: $(printf %q "$name")"
done
request POST /v1/leases --header 'Content-Type: application/json' --data-binary "$(jq -nc --arg build "$BUILD. Another end" \
    '{worker: "w", host: "h", cpu: "c", slots: 1, numericBuild: $build, wait: 0}')"
is_problem 409 build-mismatch 'a build that differs after many words'
like "$(json .detail)" 'Another end' 'is quoted from where it differs'
/usr/bin/python3 - "$URL" "$BUILD" <<'PYTHON' || not_ok 'names are sent'
import http.client, json, sys
link = http.client.HTTPConnection(sys.argv[1].removeprefix("http://"))
for number in range(2100):
    body = {"worker": f"none-{number}", "host": "h", "cpu": "c", "slots": 1, "numericBuild": sys.argv[2], "wait": 0}
    link.request("POST", "/v1/leases", json.dumps(body), {"Content-Type": "application/json"})
    answer = link.getresponse()
    answer.read()
    assert answer.status == 204, answer.status
PYTHON
submit "$(jq -c '[.[2], .[1]]' <<<"$SURFACES")"
lease_as late
get /v1/workers
is "$(json '.items | length') $(json '[.items[] | select(.worker == "late")][0].leased')" '2048 1' 'whoever works is listed among 2048'

# ---- The end of the daemon -------------------------------------------------------------------------------

started=$(date +%s%N)
stop_server || not_ok 'it drains'
compare "$(($(date +%s%N) - started))" '<=' 5000000000 'SIGTERM does not wait for what silent workers hold'
start_server "$SCRATCH/data" --workers 2 --executor workers --lease-seconds 2 || exit 1
start_worker --idle-seconds 8
poll_job "$JOB" 60
is "$JOB_STATUS" successful 'the job goes on after the start'
wait_server "$WORKER_PID" 30
stop_server || not_ok 'it drains'

# ---- Results that are made up -----------------------------------------------------------------------------

start_server "$SCRATCH/data" --workers 2 --executor workers --lease-seconds 2 --verify-tasks 1 || exit 1
submit "$(jq -c '[.[3], .[2], .[1]]' <<<"$SURFACES")"
lease_as liar 2
lease_as liar 2
printf '\0\0\0\0\0\0\110\100' >"$SCRATCH/large"
result "$SCRATCH/large" "$SECRET"
is_problem 422 invalid-result 'a distance beyond the norms of both surfaces is none'
lease_as liar 2
printf '\0\0\0\0\0\0\340\077' >"$SCRATCH/half"
result "$SCRATCH/half" "$SECRET"
is "$STATUS" 204 'a number that could be a distance is taken'
poll_job "$JOB" 20
is "$JOB_STATUS $(json .exception.code)" 'failed task-failed' 'but compared, and its job fails'
like "$(json .exception.detail)" 'liar returned other bits' 'since whoever made it up made others'
like "$(cat "$SERVER_LOG")" '"error".*result-differs.*liar' 'which the log says'
submit "$(jq -c '[.[3], .[2], .[1]]' <<<"$SURFACES")"
WAIT=1 lease_as liar 2
is "$STATUS" 204 'it gets nothing more'
start_worker --idle-seconds 3
poll_job "$JOB" 60
is "$JOB_STATUS" successful 'asked again it is computed by another, whose results are all compared'
wait_server "$WORKER_PID" 20
stop_server || not_ok 'it drains'

# ---- Tokens ----------------------------------------------------------------------------------------------

start_server "$SCRATCH/data" --workers 2 --executor workers --lease-seconds 20 --verify-tasks 0 || exit 1
for name in lab other; do
    "$SRNFD" token add --data "$SCRATCH/data" --name "$name" --role worker 2>/dev/null >"$SCRATCH/$name"
done
ROOT=$("$SRNFD" token add --data "$SCRATCH/data" --name root --role admin 2>/dev/null)
MINE=(--header "Authorization: Bearer $(cat "$SCRATCH/lab")")
THEIRS=(--header "Authorization: Bearer $(cat "$SCRATCH/other")")
execute distances "$(jq -c '{surfaces: [.[0], .[3]], handedness: "ignore"}' <<<"$SURFACES")" --header 'Prefer: respond-async' \
    --header "Authorization: Bearer $ROOT"
lease_as mine 1 "${MINE[@]}"
is "$STATUS" 201 'a lease of a token'
CONTENT=$(json '.contents[0]')
printf '\0\0\0\0\0\0\340\077' >"$SCRATCH/half"
get "/v1/leases/$TASK/contents/$CONTENT" --header "Lease-Secret: $SECRET" "${THEIRS[@]}"
is_problem 409 lease-lost 'with its secret another token reads nothing'
request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET" "${THEIRS[@]}"
is_problem 409 lease-lost 'nor extends it'
result "$SCRATCH/half" "$SECRET" "" "${THEIRS[@]}"
is_problem 409 lease-lost 'nor ends it with a result'
fail 'not mine' false "${THEIRS[@]}"
is_problem 409 lease-lost 'or with a failure'
request DELETE "/v1/leases/$TASK" --header "Lease-Secret: $SECRET" "${THEIRS[@]}"
is_problem 409 lease-lost 'or gives it back'
get "/v1/leases/$TASK/contents/$CONTENT" --header "Lease-Secret: $SECRET" "${MINE[@]}"
is "$STATUS" 200 'its own does'
result "$SCRATCH/half" "$SECRET" "" "${MINE[@]}"
is "$STATUS" 204 'all of it'
stop_server || not_ok 'it drains'

done_testing

#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: timeout 300
#
# test_workers_broken.sh - workers that lease and bring nothing, beside others that work: who gets what they have lost,
# who rests, how much one may hold, and whose a lease is.
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

# Leases as the worker of that name, by hand.
lease_as() { # NAME [SLOTS [CURL ARGUMENTS..]]
    post_json /v1/leases "$(jq -nc --arg build "$BUILD" --arg name "$1" --argjson slots "${2:-1}" --argjson wait "${WAIT:-20}" \
        --arg host "${HOST_OF:-here}" '{worker: $name, host: $host, cpu: "any", slots: $slots, numericBuild: $build, wait: $wait}')" "${@:3}"
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

# Cut within a character, where there is no room for the sentence.
LONG="x$(printf 'ä%.0s' $(seq 150))"
submit "$PAIR"
for name in cutter other; do
    WAIT=3 lease_as "$name"
    fail "$LONG" true
done
poll_job "$JOB" 20
like "$(json .exception.detail)" 'which said: .*xä+' 'a long failure in any script is told'
unlike "$(json .exception.detail)" '\?' 'and ends with a whole character'

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
LIED=$JOB
like "$(json .exception.detail)" 'liar returned other bits' 'since whoever made it up made others'
like "$(cat "$SERVER_LOG")" '"error".*result-differs.*liar' 'which the log says'
submit "$(jq -c '[.[3], .[2], .[1]]' <<<"$SURFACES")"
WAIT=1 lease_as liar 2
is "$STATUS" 204 'it gets nothing more'
WAIT=1 lease_as honest 2
is "$STATUS" 204 'nor does it under another name'
get /v1/workers
is "$(json '[.bars | length, .[0].bar, .[0].worker, .[0].host, .[0].pilots, ((.[0].until[:10]) > (.[0].since[:10]))] | tojson')" \
    '[1,1,"liar","here",false,true]' 'an admin sees who is barred, and until when'
like "$(json '.bars[0].why')" "^Other bits for a task of $LIED \\(pairs\\)" 'and why'
is "$(json '[.items[] | select(.barred) | .worker] | sort | tojson')" '["honest","liar"]' 'and whom it holds for'
start_worker --idle-seconds 3
poll_job "$JOB" 60
is "$JOB_STATUS" successful 'asked again it is computed by another, whose results are all compared'
wait_server "$WORKER_PID" 20
request DELETE /v1/workers/bars/1x
is_problem 404 no-such-bar 'a bar is a number'
request DELETE /v1/workers/bars/9999999999999999999
is_problem 404 no-such-bar 'of 18 digits at most'
request DELETE /v1/workers/bars/7
get /v1/workers
is "$(json '.bars | length')" 1 'another number lifts nothing'
request DELETE /v1/workers/bars/1
is "$STATUS" 204 'a bar can be lifted'
get /v1/workers
is "$(json '[(.bars | length), ([.items[] | select(.barred)] | length)] | tojson')" '[0,0]' 'and is gone'
# False from one host after the other, the token is barred on all.
for host in one two three; do
    submit "$(jq -c '[.[3], .[1]]' <<<"$SURFACES")"
    HOST_OF=$host WAIT=5 lease_as "on-$host"
    result "$SCRATCH/half" "$SECRET"
    is "$STATUS" 204 "a false result from host $host is taken"
    poll_job "$JOB" 20
    is "$JOB_STATUS" failed 'and found'
done
submit "$(jq -c '[.[3], .[1]]' <<<"$SURFACES")"
HOST_OF=four WAIT=1 lease_as on-four
is "$STATUS" 204 'who is false on three hosts gets nothing on a fourth'
get /v1/workers
is "$(json '[.bars[] | .host // "any"] | tojson')" '["one","two","any"]' 'as is told'
request DELETE /v1/workers/bars/4
HOST_OF=four WAIT=1 lease_as on-four
is "$STATUS" 201 'until the bar is lifted'
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 20
stop_server || not_ok 'it drains'

# ---- Comparing takes no memory from a job ------------------------------------------------------------------

start_server "$SCRATCH/data" --workers 2 --executor workers --lease-seconds 5 --verify-tasks 1 --job-memory 8000000 || exit 1
start_worker --idle-seconds 3
execute distances "$(jq -c '{surfaces: [.[3], .[2], .[0]], handedness: "ignore", metric: "srm"}' <<<"$SURFACES")" \
    --header 'Prefer: wait=60'
is "$STATUS $(json '.matrix | length')" '200 3' 'a job that has no room to compare results does without'
get /metrics
like "$(cat "$BODY")" 'srnfd_tasks_total\{kind="pairs",event="uncompared"\} 3' 'which is counted'
wait_server "$WORKER_PID" 20
stop_server || not_ok 'it drains'

# ---- Numbers that no search finds, where nothing is compared ------------------------------------------------

start_server "$SCRATCH/data" --workers 2 --executor workers --lease-seconds 5 --verify-tasks 0 || exit 1
execute mean "$(jq -c '{surfaces: [.[0], .[2], .[3]], maxIterations: 1}' <<<"$SURFACES")" --header 'Prefer: respond-async'
JOB=$(json .jobID)
lease_as dreamer
# For each surface one link, exp of a field of degree 1 with numbers that are finite.
/usr/bin/python3 - "$(json '.contents | length')" "$SCRATCH/folded" <<'PYTHON'
import struct, sys
one = struct.pack("<Q9d", 1, 1, 0, 0, 0, 1, 0, 0, 0, 1) + struct.pack("<2Q8d", 1, 1, 0, 9e3, 7e3, 5e3, 0, 3e3, 2e3, 1e3)
open(sys.argv[2], "wb").write(one * (int(sys.argv[1]) - 1))
PYTHON
result "$SCRATCH/folded" "$SECRET"
is_problem 422 invalid-result 'a warp that folds the sphere is none'
start_worker --idle-seconds 3
poll_job "$JOB" 60
is "$JOB_STATUS" successful 'and another computes what was asked'
wait_server "$WORKER_PID" 20
stop_server || not_ok 'it drains'

# ---- Tokens ----------------------------------------------------------------------------------------------

start_server "$SCRATCH/data" --workers 2 --executor workers --lease-seconds 20 --verify-tasks 0 || exit 1
MANY=$(shapes_between 12 "$(jq -r '.[0]' <<<"$SURFACES")" "$(jq -r '.[1]' <<<"$SURFACES")")
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

# ---- How many leases a token may hold ---------------------------------------------------------------------

# As NAME with 1,024 slots takes what it gets; prints how many. With "result" it returns one of them.
grab() { # NAME TOKEN_FILE [result]
    /usr/bin/python3 - "$URL" "$BUILD" "$1" "$(cat "$2")" "${3:-}" <<'PYTHON'
import base64, hashlib, http.client, json, sys
url, build, name, token, then = sys.argv[1:]
link = http.client.HTTPConnection(url.removeprefix("http://"))
def ask(method, path, body, headers):
    link.request(method, path, body, {"Authorization": "Bearer " + token, **headers})
    answer = link.getresponse()
    return answer.status, answer.read()
taken = []
while True:
    status, text = ask("POST", "/v1/leases", json.dumps({"worker": name, "host": "h", "cpu": "c", "slots": 1024,
        "numericBuild": build, "wait": 0}), {"Content-Type": "application/json"})
    if status != 201:
        break
    taken.append(json.loads(text))
print(len(taken))
if then:
    body = b"\0" * 6 + b"\xe0\x3f"
    status, text = ask("PUT", "/v1/leases/" + taken[0]["task"] + "/result", body, {"Lease-Secret": taken[0]["secret"],
        "Content-Type": "application/octet-stream", "Worker-Host": "h", "Worker-CPU": "c", "Worker-Build": build,
        "Content-Digest": "sha-256=:" + base64.b64encode(hashlib.sha256(body).digest()).decode() + ":"})
    assert status == 204, text
PYTHON
}

execute distances "{\"surfaces\":$MANY,\"handedness\":\"ignore\"}" --header 'Prefer: respond-async' --header "Authorization: Bearer $ROOT"
JOB=$(json .jobID)
waited=0
until GRABBED=$(grab greedy "$SCRATCH/lab" result) && [ "$GRABBED" -gt 0 ] || [ "$waited" -gt 100 ]; do
    sleep 0.1
    waited=$((waited + 1))
done
is "$GRABBED" 34 'a token without results takes no more than 32 of 66 tasks, and two more for the one it had'
is "$(grab another "$SCRATCH/lab")" 3 'a result lets it have two more, under another name too'
is "$(grab fair "$SCRATCH/other")" 29 'another token has its own share'
post "/v1/jobs/$JOB/cancel" --header "Authorization: Bearer $ROOT"
stop_server || not_ok 'it drains'

done_testing

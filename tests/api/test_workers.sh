#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: timeout 300
#
# test_workers.sh - distances, means and folds computed by worker processes: with the same bits as here, when a worker is
# killed, when the daemon is killed and starts again, and when somebody sends what he should not: a forged secret, a stale
# lease, a result twice, with a wrong digest or that cannot be one. Who may lease, and what is refused in clear text or by
# another build.
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

DATA=$SCRATCH/data

tasks_done() { # KIND
    get /metrics
    sed -n "s/^srnfd_tasks_total{kind=\"$1\",event=\"done\"} //p" "$BODY"
}

# ---- As it is computed here -----------------------------------------------------------------------------

start_server "$SCRATCH/local" --workers 2 || exit 1
INPUTS="{\"surfaces\":$(surfaces),\"handedness\":\"ignore\"}"
SRM="{\"surfaces\":$(jq -c .surfaces <<<"$INPUTS"),\"handedness\":\"ignore\",\"metric\":\"srm\"}"
execute distances "$INPUTS"
LOCAL=$(json '.matrix | tojson')
execute distances "$SRM"
LOCAL_SRM=$(json '.matrix | tojson')
MEAN="{\"surfaces\":$(jq -c .surfaces <<<"$INPUTS")}"
NEAREST="{\"surfaces\":$(jq -c .surfaces <<<"$INPUTS"),\"k\":1}"
NEAREST_NUMBERS='[.indices, .distances, .pairs] | tojson'
execute neighbours "$NEAREST"
LOCAL_NEAREST=$(json "$NEAREST_NUMBERS")
execute mean "$MEAN"
LOCAL_MEAN=$(json "$MEAN_NUMBERS")
like "$LOCAL_MEAN" '^\["surf-.*[0-9]' 'a mean, computed here'
POSED=$(jq -c '. + {commonPose: true, tolerance: 0.1}' <<<"$MEAN")
execute mean "$POSED"
LOCAL_POSED=$(json "$MEAN_NUMBERS")
GUIDED=$(jq -c '. + {maxIterations: 2, landmarks: {vertices: [10, 200, 400], weight: 0.5}}' <<<"$MEAN")
execute mean "$GUIDED"
LOCAL_GUIDED=$(json "$MEAN_NUMBERS")
like "$LOCAL_GUIDED" '^\["surf-.*[0-9]' 'a mean with landmarks, computed here'
TWICE=$(jq -c '.surfaces |= [.[0], .[0], .[1]]' <<<"$INPUTS")
execute distances "$TWICE"
LOCAL_TWICE=$(json '.matrix | tojson')
MEAN_TWICE=$(jq -c 'del(.handedness)' <<<"$TWICE")
execute mean "$MEAN_TWICE"
LOCAL_MEAN_TWICE=$(json "$MEAN_NUMBERS")
like "$LOCAL_TWICE$LOCAL_MEAN_TWICE" '^\[\[0,[0-9.e-]+,0\.[0-9].*surf-' 'a group with one surface twice, computed here'
LABELLED=$(jq -c --argjson more "$(surfaces L_caudate R_caudate)" '{name: "six", members:
    [.surfaces + $more | to_entries[] | {id: .value, label: (if .key % 2 == 0 then "left" else "right" end)}]}' <<<"$MEAN")
post_json /v1/cohorts "$LABELLED"
PARTED=$(jq -c '{name: "parted", members: [.members | to_entries[] |
    {id: .value.id, subject: "s\(.key / 2 | floor)", covariates: {part: (if .key % 2 == 0 then "one" else "two" end)}}]}' <<<"$LABELLED")
post_json /v1/cohorts "$PARTED"
PARTS='{"cohort":"parted","modes":1,"maxIterations":2}'
execute pca-parts "$PARTS"
LOCAL_PARTS=$(json '[.eigenvalues, .scores, .warnings] | tojson')
like "$LOCAL_PARTS" '^\[\[[0-9]' 'components of two parts, computed here'
FOLDS='{"cohort":"six","method":"srnf-nn"}'
execute classify "$FOLDS"
LOCAL_FOLDS=$(json "$FOLD_NUMBERS")
like "$LOCAL_FOLDS" '^\[.*[0-9]' 'folds, computed here'
# The meshes themselves, with one that has no surface of this kind.
cohort_of_meshes() {
    post_json /v1/cohorts "$(jq -nc '{name: "meshes", members: [$ARGS.positional[] | {id: .}]}' --args "$@")"
}
MESHES=()
for name in L_hippocampus R_putamen L_amygdala; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESHES+=("$(json .id)")
done
cohort_of_meshes "${MESHES[@]}"
ROWS='[.rows[] | [.surface, .route, .scale, .area, .volume, .fit, .problem, .warnings]] | tojson'
BY_STAR='{"cohort":"meshes","parameterization":"star","lmax":9}'
execute encode "$BY_STAR"
LOCAL_STARS=$(json "$ROWS")
execute encode '{"cohort":"meshes","lmax":11,"smoothing":0.0001}'
LOCAL_ROWS=$(json "$ROWS")
like "$LOCAL_ROWS$LOCAL_STARS" 'surf-.*surf-.*surf-.*not-star-shaped' 'encodings, made here'
like "$LOCAL" '^\[\[0,0\.[0-9]' 'distances, computed here'
post_json /v1/leases '{}'
is_problem 409 tasks-not-offered 'who computes by itself offers nothing'
stop_server || not_ok 'it drains'

# ---- By two workers --------------------------------------------------------------------------------------

start_server "$DATA" --workers 2 --executor workers --lease-seconds 2 --verify-tasks 0 || exit 1
is "$(surfaces)" "$(jq -c .surfaces <<<"$INPUTS")" 'the same surfaces'
post_json /v1/leases '{"worker":"w","host":"h","cpu":"c","slots":1,"numericBuild":"srnf of long ago","wait":0}'
is_problem 409 build-mismatch 'a worker of another build is refused'
start_worker --idle-seconds 8 --cache "$SCRATCH/cache"
FIRST=$WORKER_PID
start_worker --idle-seconds 8
SECOND=$WORKER_PID
execute distances "$INPUTS" --header 'Prefer: wait=100'
is "$(json '.matrix | tojson')" "$LOCAL" 'two workers: the same bits'
get /v1/workers
is "$(json '[[.items[].done], [.items[].kinds.pairs.done] | add] | tojson')" '[6,6]' 'each pair was a task, and was done once'
is "$(json '[.items[] | select(.done > 0)] | length')" 2 'both have worked'
is "$(json '[.items[] | select(.done > 0) | .alive] | unique | tojson')" '[true]' 'and are there'
is "$(told task-done)" 6 'as they say themselves'
compare "$(find "$SCRATCH/cache" -type f | wc -l)" '>=' 2 'what tasks were about is kept on the disk'
get /metrics
like "$(cat "$BODY")" 'srnfd_tasks_total\{kind="pairs",event="done"\} 6' 'and counted'
is "$(sed -n 's/^srnfd_task_bytes_total{kind="pairs",part="results"} //p' "$BODY")" 48 'with the bytes of their results'
compare "$(sed -n 's/^srnfd_task_bytes_total{kind="pairs",part="contents"} //p' "$BODY")" '>=' 2400 'and those that were read'
get '/v1/jobs?process=distances'
get "/v1/jobs/$(json '.jobs[0].jobID')"
is "$(json '[.executors | length, .[0].tasks, (.[0].host | length > 0), (.[0].cpu | length > 0), (.[0].build | contains("openblas"))] | tojson')" \
    '[1,6,true,true,true]' 'and the job names the host, the processor and the build of its results'
PAIRS=$(tasks_done pairs)
execute neighbours "$NEAREST" --header 'Prefer: wait=100'
is "$(json "$NEAREST_NUMBERS")" "$LOCAL_NEAREST" 'neighbours by two workers: the same bits'
compare "$(tasks_done pairs)" '>' "$PAIRS" 'whose registrations were tasks'
execute mean "$MEAN" --header 'Prefer: wait=100'
is "$(json "$MEAN_NUMBERS")" "$LOCAL_MEAN" 'a mean by two workers: the same bits'
execute mean "$POSED" --header 'Prefer: wait=100'
is "$(json "$MEAN_NUMBERS")" "$LOCAL_POSED" 'in a common pose too'
SEARCHES=$(tasks_done searches)
execute mean "$GUIDED" --header 'Prefer: wait=100'
is "$(json "$MEAN_NUMBERS")" "$LOCAL_GUIDED" 'where landmarks guide, too'
compare "$(tasks_done searches)" '>' "$SEARCHES" 'whose registrations were tasks'
execute distances "$TWICE" --header 'Prefer: wait=30'
is "$(json '.matrix | tojson')" "$LOCAL_TWICE" 'a surface that is twice in a group makes two tasks'
execute mean "$MEAN_TWICE" --header 'Prefer: wait=30'
is "$(json "$MEAN_NUMBERS")" "$LOCAL_MEAN_TWICE" 'of its mean, too'
is "$(surfaces L_caudate R_caudate | jq length)" 2 'two more surfaces'
post_json /v1/cohorts "$LABELLED"
post_json /v1/cohorts "$PARTED"
SEARCHES=$(tasks_done searches)
execute pca-parts "$PARTS" --header 'Prefer: wait=100'
is "$(json '[.eigenvalues, .scores, .warnings] | tojson')" "$LOCAL_PARTS" 'components of several parts'
compare "$(tasks_done searches)" '>' "$SEARCHES" 'whose registrations were tasks'
SEARCHES=$(tasks_done searches)
execute classify "$FOLDS" --header 'Prefer: wait=100'
is "$(json "$FOLD_NUMBERS")" "$LOCAL_FOLDS" 'and folds'
compare "$(tasks_done searches)" '>' "$SEARCHES" 'whose registrations were tasks'
for name in L_hippocampus R_putamen L_amygdala; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
done
cohort_of_meshes "${MESHES[@]}"
start_worker --idle-seconds 5
execute encode '{"cohort":"meshes","lmax":11,"smoothing":0.0001}' --header 'Prefer: wait=100'
is "$(json "$ROWS")" "$LOCAL_ROWS" 'and encodings'
execute encode "$BY_STAR" --header 'Prefer: wait=100'
is "$(json "$ROWS")" "$LOCAL_STARS" 'also of what cannot be encoded'
get /metrics
like "$(cat "$BODY")" 'srnfd_tasks_total\{kind="encodings",event="done"\} 2' 'and three encodings one'
wait_server "$WORKER_PID" 20
wait_server "$FIRST" 20
is "$SERVER_STATUS" 0 'without work a worker ends'
wait_server "$SECOND" 20
is "$SERVER_STATUS" 0 'and the other one'
read_build

# ---- Hostile hands ---------------------------------------------------------------------------------------

execute distances "$SRM" --header 'Prefer: respond-async'
JOB=$(json .jobID)
lease
is "$STATUS" 201 'a lease by hand'
like "$TASK" '^task-[0-9a-f]{32}$' 'of a task'
CONTENT=$(json '.contents[0]')
get "/v1/leases/$TASK/contents/$CONTENT" --header "Lease-Secret: $SECRET"
is "$STATUS $(sha256sum <"$BODY" | cut -d ' ' -f 1)" "200 $CONTENT" 'what it is about is what its digest says'
get "/v1/leases/$TASK/contents/$CONTENT"
is_problem 409 lease-lost 'without the secret nobody reads it'
get "/v1/leases/$TASK/contents/$(printf '%064d' 0)" --header "Lease-Secret: $SECRET"
is_problem 404 no-such-content 'nor what the task is not about'
request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
is "$STATUS $(json .expiresInSeconds)" '200 2' 'a heartbeat extends it'
printf '\0\0\0\0\0\0\360\077' >"$SCRATCH/one"
printf '\0\0\0\0\0\0\360\277' >"$SCRATCH/minus-one"
FORGED=$(printf '%032d' 7)
result "$SCRATCH/one" "$FORGED"
is_problem 409 lease-lost 'a forged secret is refused'
for call in "GET /v1/leases/$TASK/contents/$CONTENT" "POST /v1/leases/$TASK/heartbeat" "DELETE /v1/leases/$TASK"; do
    # shellcheck disable=SC2086
    request $call --header "Lease-Secret: $FORGED"
    is_problem 409 lease-lost "also by ${call%% *}"
done
post_json "/v1/leases/$TASK/failure" '{"detail":"forged"}' --header "Lease-Secret: $FORGED"
is_problem 409 lease-lost 'and as a failure'
request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
is "$STATUS" 200 'none of which ends it'
result "$SCRATCH/one" "$SECRET" 'sha-256=:AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=:'
is_problem 422 digest-mismatch 'bytes that are not those of the digest are refused'
MADE_BY='' result "$SCRATCH/one" "$SECRET"
is_problem 422 invalid-input 'a result without the build that made it is refused'
request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
is "$STATUS" 200 'and may be sent again'
MADE_BY="$BUILD of old" result "$SCRATCH/one" "$SECRET"
is_problem 409 build-mismatch 'that of another build is refused'
request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
is_problem 409 lease-lost 'and its attempt is over'
lease
result "$SCRATCH/minus-one" "$SECRET"
is_problem 422 invalid-result 'a negative distance is no result'
result "$SCRATCH/one" "$SECRET"
is_problem 409 lease-lost 'and the attempt is over'
lease
request DELETE "/v1/leases/$TASK" --header "Lease-Secret: $SECRET"
is "$STATUS" 204 'a lease may be given back'
request DELETE "/v1/leases/$TASK" --header "Lease-Secret: $SECRET"
is_problem 409 lease-lost 'once'
lease
STALE_TASK=$TASK STALE=$SECRET
sleep 3
TASK=$STALE_TASK
result "$SCRATCH/one" "$STALE"
is_problem 409 lease-lost 'after the lease has expired its result is stale'
HELD=()
for i in {1..6}; do # those before it, too
    NAME=other-$i lease
    [ "$TASK" != "$STALE_TASK" ] || break
    HELD+=("$TASK $SECRET")
done
is "$TASK" "$STALE_TASK" 'the task goes to another'
result "$SCRATCH/one" "$STALE"
is_problem 409 lease-lost 'whose lease the secret of the first attempt does not end'
request DELETE "/v1/leases/$TASK" --header "Lease-Secret: $STALE"
is_problem 409 lease-lost 'nor gives back'
request DELETE "/v1/leases/$TASK" --header "Lease-Secret: $SECRET"
is "$STATUS" 204 'only its own does'
for held in ${HELD[@]+"${HELD[@]}"}; do
    request DELETE "/v1/leases/${held% *}" --header "Lease-Secret: ${held#* }"
done
get "/v1/jobs/$JOB"
is "$(json .status)" running 'nothing of that has ended the job'

# ---- Killed workers --------------------------------------------------------------------------------------

: >"$WORKER_LOG"
start_worker
wait_leased
kill_server "$WORKER_PID"
start_worker --idle-seconds 2
poll_job "$JOB" 100
is "$JOB_STATUS" successful 'the job outlives its worker'
is "$(matrix "$JOB")" "$LOCAL_SRM" 'and has the same bits'

# ---- Poison ----------------------------------------------------------------------------------------------

wait_server "$WORKER_PID" 20
execute distances "{\"surfaces\":$(jq -c '.surfaces[:2]' <<<"$INPUTS"),\"handedness\":\"ignore\"}" --header 'Prefer: respond-async'
JOB=$(json .jobID)
for _ in 1 2 3 4 5; do
    lease
    post_json "/v1/leases/$TASK/failure" '{"detail":"it always breaks"}' --header "Lease-Secret: $SECRET"
done
is "$STATUS" 204 'a worker tells of a failure'
poll_job "$JOB" 20
is "$JOB_STATUS $(json .exception.code)" 'failed task-failed' 'what fails everywhere fails its job'
like "$(json .exception.detail)" 'here \(any\): it always breaks' 'with what the workers said, and where'
WAIT=0.2 lease
is "$STATUS" 204 'and is no longer offered'

# ---- The daemon starts again -----------------------------------------------------------------------------

execute distances "{\"surfaces\":$(jq -c '.surfaces[1:]' <<<"$INPUTS"),\"handedness\":\"ignore\"}" --header 'Prefer: respond-async'
JOB=$(json .jobID)
: >"$WORKER_LOG"
NAME=holder lease # so that the job does not end before the daemon is killed
start_worker
waited=0
until [ "$(told task-done)" -ge 1 ] || [ "$waited" -gt 600 ]; do
    request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
    sleep 0.05
    waited=$((waited + 1))
done
ADDRESS=${URL#http://}
kill_server
nice -n 10 "$SRNFD" serve --listen "$ADDRESS" --data "$DATA" --workers 2 --executor workers --lease-seconds 2 --verify-tasks 0 \
    </dev/null >/dev/null 2>"$SERVER_LOG" &
SERVER_PID=$!
SERVER_PIDS+=("$SERVER_PID")
poll_job "$JOB" 100
is "$JOB_STATUS $(json .attempt)" 'successful 2' 'the daemon is killed, and the job goes on'
is "$(matrix "$JOB")" "$(jq -c '[.[1:][] | .[1:]]' <<<"$LOCAL")" 'to the same bits'
is "$(told task-done)" 3 'what was done before was not done again'
kill -TERM "$WORKER_PID"
wait_server "$WORKER_PID" 20
is "$SERVER_STATUS" 0 'SIGTERM ends a worker'

# ---- A request whose worker has gone ----------------------------------------------------------------------

curl --silent --max-time 1 --output /dev/null --header 'Content-Type: application/json' --data-binary "$(jq -nc --arg build "$BUILD" \
    '{worker: "gone", host: "here", cpu: "any", slots: 1, numericBuild: $build, wait: 30}')" "$URL/v1/leases"
is "$?" 28 'a worker that waits for a task leaves'
execute distances "{\"surfaces\":$(jq -c '.surfaces[:3]' <<<"$INPUTS"),\"handedness\":\"ignore\"}" --header 'Prefer: respond-async'
JOB=$(json .jobID)
sleep 1
get /v1/workers
is "$(json '[.items[] | select(.worker == "gone") | .leased] | max')" 0 'and no task is leased to nobody'
is "$(json '[.items[] | select(.worker == "gone") | .alive] | unique | tojson')" '[false]' 'it is listed as gone'

# ---- A result twice --------------------------------------------------------------------------------------

lease
result "$SCRATCH/one" "$SECRET"
is "$STATUS" 204 'a result is taken'
result "$SCRATCH/one" "$SECRET"
is_problem 409 lease-lost 'and not again, though it is the same'
request POST "/v1/leases/$TASK/heartbeat" --header "Lease-Secret: $SECRET"
is_problem 409 lease-lost 'the lease has ended with it'
get /v1/workers
is "$(json '[.items[] | select(.worker == "by-hand") | .done] | add')" 1 'it counts once'
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 20

# ---- Draining --------------------------------------------------------------------------------------------

# At a degree whose tasks outlast the signal on a busy machine, too.
execute distances "$(jq -nc '{surfaces: $ARGS.positional, lmax: 31, handedness: "ignore"}' --args "${MESHES[@]:0:2}")" \
    --header 'Prefer: respond-async'
is "$(json .status | grep -cE 'accepted|running')" 1 'a job of one long task'
JOB=$(json .jobID)
: >"$WORKER_LOG"
start_worker --grace-seconds 0
stop_at_work "$WORKER_PID"
kill -TERM "$WORKER_PID"
kill -CONT "$WORKER_PID"
wait_server "$WORKER_PID" 20
is "$SERVER_STATUS $(told task-returned)" '0 1' 'without grace a worker gives its task back'
# One that was given while the worker stood still, and is told to end before it knows.
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 20
: >"$WORKER_LOG"
start_worker --grace-seconds 0
leased=
for _ in $(seq 100); do
    leased=$(leased_to "$WORKER_PID")
    [ "$leased" != 0 ] || break
    sleep 0.05
done
sleep 0.3 # it asks by now
kill -STOP "$WORKER_PID"
execute distances "$(jq -nc '{surfaces: $ARGS.positional, lmax: 31, handedness: "ignore"}' --args "${MESHES[@]:1:2}")" \
    --header 'Prefer: respond-async'
JOB=$(json .jobID)
for _ in $(seq 200); do
    leased=$(leased_to "$WORKER_PID")
    [ "$leased" != 1 ] || break
    sleep 0.05
done
is "$leased" 1 'a worker that stands still is given a task that it had asked for'
kill -TERM "$WORKER_PID"
kill -CONT "$WORKER_PID"
wait_server "$WORKER_PID" 20
is "$SERVER_STATUS $(told task-returned)" '0 1' 'and gives it back, told to end before it has read of it'
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 20
is "$JOB_STATUS" dismissed 'a job whose tasks wait can be cancelled'
WAIT=0.2 lease
is "$STATUS" 204 'and they are no longer offered'

# ---- Who may ---------------------------------------------------------------------------------------------

"$SRNFD" token add --data "$DATA" --name lab --role worker 2>/dev/null >"$SCRATCH/token"
USER=$("$SRNFD" token add --data "$DATA" --name ada 2>/dev/null)
ROOT=$("$SRNFD" token add --data "$DATA" --name root --role admin 2>/dev/null)
lease
is_problem 401 token-required 'with tokens, nobody leases without'
lease --header "Authorization: Bearer $USER"
is_problem 403 forbidden 'nor does a user'
WAIT=0.2 lease --header "Authorization: Bearer $(cat "$SCRATCH/token")"
is "$STATUS" 204 'a worker does'
for path in /v1/jobs /v1/meshes /v1/workers /metrics "/v1/jobs/$JOB"; do
    get "$path" --header "Authorization: Bearer $(cat "$SCRATCH/token")"
    is_problem 403 forbidden "and reads nothing else: $path"
done
get /v1/workers --header "Authorization: Bearer $USER"
is_problem 403 forbidden 'who works is not for users'
get /v1/workers --header "Authorization: Bearer $ROOT"
is "$STATUS $(json .executor)" '200 workers' 'but for admins'
"$SRNFD" worker --server "$URL" --slots 1 2>"$SCRATCH/refused"
is "$?" 3 'a worker without a token ends, refused'
like "$(cat "$SCRATCH/refused")" 'token-required' 'and says why'
unlike "$(cat "$SCRATCH/refused")" '"event": ?"working"' 'and not that it works'
for empty in '' $'\n'; do
    printf '%s' "$empty" >"$SCRATCH/empty"
    "$SRNFD" worker --server "$URL" --slots 1 --token-file "$SCRATCH/empty" 2>"$SCRATCH/refused"
    is "$?" 2 'a file that has no token is refused'
    like "$(head -n 1 "$SCRATCH/refused")" 'is empty.*/empty$' 'by its name'
done
"$SRNFD" worker --server http://192.0.2.1:8080 2>"$SCRATCH/refused"
is "$?" 2 'clear text beyond this machine is refused'
like "$(cat "$SCRATCH/refused")" 'https' 'and the worker says so'
/usr/bin/python3 tests/api/link_server.py "$SCRATCH" "$SCRATCH/asked" >"$SCRATCH/port" &
SERVER_PIDS+=("$!") # ended with the script
for _ in $(seq 100); do
    [ -s "$SCRATCH/port" ] && break
    sleep 0.05
done
"$SRNFD" worker --server "http://127.0.0.1:$(cat "$SCRATCH/port")" --slots 1 --idle-seconds 5 2>"$SCRATCH/refused"
is "$?" 3 'a worker that is sent to another service ends, and not as if there were no tasks'
like "$(cat "$SCRATCH/refused")" '501, and nothing that srnfd answers: look at what --server names' 'and says why'
start_worker --token-file "$SCRATCH/token" --idle-seconds 1
wait_server "$WORKER_PID" 20
is "$SERVER_STATUS" 0 'a worker with its token is served'
"$SRNFD" worker --server "$URL" --slots 1 --token-file - --idle-seconds 0.1 <"$SCRATCH/token" 2>/dev/null
is "$?" 0 'or with a token on standard input'
for input in '' "$(head -c 20000 /dev/zero | tr '\0' x)" "$(printf '%0200d' 0)"; do
    "$SRNFD" worker --server "$URL" --token-file - <<<"$input" 2>"$SCRATCH/refused"
    is "$?" 2 "what is no token is refused: ${#input} bytes"
done
"$SRNFD" worker --server "$URL" --token-file - --certificate - <"$SCRATCH/token" 2>"$SCRATCH/refused"
like "$? $(cat "$SCRATCH/refused")" '^2 .*no certificate follows' 'nor is a certificate that is not there'
{
    sleep 0.5
    "$SRNFD" token revoke lab --data "$DATA" 2>/dev/null
} &
WAIT=2 lease --header "Authorization: Bearer $(cat "$SCRATCH/token")"
is_problem 401 token-invalid 'who waits with a token that is revoked meanwhile gets no lease'
get /healthz
is "$STATUS" 200 'and the service goes on'
stop_server || not_ok 'the service drains'

done_testing

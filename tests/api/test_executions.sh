#!/usr/bin/env bash
# Executions and jobs: waiting and not waiting, the cache and its time, idempotency keys, results before and after
# the end, cancel, delete, lists with cursors, entity tags, HEAD and OPTIONS.
# srnfd-test: plain-core (core/inversion/test_invert_contract.c and test_processes.sh run its numerics)
# srnfd-test: slow
# srnfd-test: waits
. "$(dirname "$0")/../support/lib.sh"

DATA=tests/data/aal_subcortex

# Runs a request in the background with files of its own for what it gets.
aside() {
    BODY=$SCRATCH/aside.body HEADERS=$SCRATCH/aside.headers "$@"
}

start_server "$SCRATCH/data" --workers 1 --grace-seconds 2 || exit 1

post '/v1/meshes?name=left%20thalamus' --data-binary "@$DATA/L_thalamus.ply"
is "$STATUS" 201 'a mesh is accepted'
is "$(json .name)" 'left thalamus' 'with its name'
mesh=$(json .id)
is "$(header Location)" "/v1/meshes/$mesh" 'and its place'
post '/v1/meshes?format=ply&name=other' --data-binary "@$DATA/L_thalamus.ply"
is "$STATUS $(json .id) $(json .name)" "200 $mesh other" 'the same bytes are the same mesh, which takes the name that it comes with'

# ---- Waiting -------------------------------------------------------------------------------------------

execute encode "{\"mesh\":\"$mesh\",\"lmax\":15}"
is "$STATUS" 200 'without Prefer the results come at once'
surface=$(json .surface.id)
like "$surface" '^surf-[0-9a-f]{32}$' 'with a surface'
monitor=$(header Link)
like "$monitor" '^</v1/jobs/job-[0-9a-f-]+>; rel="monitor"$' 'and a link to the job'
is "$(header Cache-Status)" 'srnfd; fwd=miss' 'which was computed'
cp "$BODY" "$SCRATCH/first"

milliseconds() {
    sed 's/.*dur=//' <<<"$(header Server-Timing)"
}
best=1000
for _ in 1 2 3 4 5; do
    execute encode "{\"lmax\": 15, \"mesh\": \"$mesh\", \"scale\": \"unit-area\"}"
    best=$(printf '%s\n%s\n' "$best" "$(milliseconds)" | sort -g | head -n 1)
done
is "$(header Cache-Status)" 'srnfd; hit' 'the same meaning in other words is answered from the cache'
is "$(header Link)" "$monitor" 'by the same job'
check 'with the same bytes' cmp "$BODY" "$SCRATCH/first"
note "a cached encode takes $best ms on the server's own clock"
if [ -n "$SRNFD_SANITIZED" ]; then
    skip 'in less than 5 ms' 'sanitizers are slower'
else
    compare "$best" '<' 5 'in less than 5 ms'
fi

execute encode "{\"mesh\":\"$mesh\",\"lmax\":15}" -H 'Prefer: respond-async'
is "$STATUS $(json .cache) $(json .status)" '201 hit successful' 'asked for the job, the job is answered, known'
is "$(header Preference-Applied)" respond-async 'and the preference is confirmed'
is "$(header Location)" "/v1/jobs/$(json .id)" 'with its place'
execute encode "{\"mesh\":\"$mesh\",\"lmax\":16}" -H 'Prefer: respond-async, wait=20'
is "$STATUS $(header Preference-Applied)" '200 respond-async, wait=20' 'a wait that is long enough ends in results'

# A long job: many iterations of the slow method, on the only worker.
slow="{\"srnf\":{\"surface\":\"$surface\"},\"initial\":\"sphere\",\"method\":\"gradient\",\"tolerance\":1e-30,\"maxIterations\":100000}"
execute invert "$slow" -H 'Prefer: respond-async'
is "$STATUS $(json .cache)" '201 miss' 'a long job is accepted'
job=$(json .id)
like "$(json .status)" '^(accepted|running)$' 'and has not ended'
get "/v1/jobs/$job/results"
is_problem 409 result-not-ready 'its results are not there'
is "$(header Retry-After)" 1 'and it is said when to come again'
started=$(date +%s%N)
execute invert "$slow" -H 'Prefer: respond-async, wait=1'
is "$STATUS $(json .id) $(json .cache)" "201 $job joined" 'an identical job is joined, and waited for'
compare "$((($(date +%s%N) - started) / 1000000))" '>=' 900 'as long as was asked'

# A short job is done beside it; another long one waits, and is cancelled while it does.
execute encode "{\"mesh\":\"$mesh\",\"lmax\":17}"
is "$STATUS $(json .surface.lmax)" '200 17' 'a short job does not wait for a long one'
execute invert "${slow/100000/99996}" -H 'Prefer: respond-async'
waiting=$(json .id)
post "/v1/jobs/$waiting/cancel"
is "$STATUS $(json .status)" '200 dismissed' 'a job that waits is dismissed at once'
post "/v1/jobs/$waiting/cancel"
is "$STATUS $(json .status)" '200 dismissed' 'as often as one likes'
execute invert "${slow/100000/99995}" -H 'Prefer: respond-async'
also=$(json .id)
request DELETE "/v1/jobs/$also"
is "$STATUS $(json '"\(.jobID) \(.status)"')" "200 $also dismissed" 'DELETE dismisses one that waits, too'
get "/v1/jobs/$also"
is "$STATUS $(json .status)" '200 dismissed' 'which stays'
get "/v1/jobs/$waiting/results"
is_problem 410 job-dismissed 'and has no results'

# Somebody waits for the running job while it is cancelled.
aside execute invert "$slow" -H 'Prefer: wait=60' &
waiter=$!
sleep 0.5
post "/v1/jobs/$job/cancel"
is "$STATUS $(json .cancelRequested)" '200 true' 'a running job is asked to stop'
poll_job "$job" 60
is "$JOB_STATUS" dismissed 'and does'
started=$(date +%s)
wait "$waiter"
compare "$(($(date +%s) - started))" '<=' 20 'who waited for it is answered then'
request DELETE "/v1/jobs/$job"
is "$STATUS $(json '"\(.jobID) \(.status)"')" "200 $job dismissed" 'an ended job is removed'
get "/v1/jobs/$job"
is_problem 404 no-such-job 'and gone'

# ---- Idempotency ----------------------------------------------------------------------------------------

execute encode "{\"mesh\":\"$mesh\",\"lmax\":18}" -H 'Prefer: respond-async' -H 'Idempotency-Key: key-1'
is "$STATUS" 201 'a request with a key'
keyed=$(json .id)
poll_job "$keyed" 60
execute encode "{\"mesh\":\"$mesh\",\"lmax\":18}" -H 'Prefer: respond-async' -H 'Idempotency-Key: key-1'
is "$STATUS $(json .id)" "201 $keyed" 'repeated is the same job'
execute encode "{\"mesh\":\"$mesh\",\"lmax\":19}" -H 'Idempotency-Key: key-1'
is_problem 422 idempotency-key-reused 'the key with another body is refused'
execute encode "{\"mesh\":\"$mesh\",\"lmax\":18}" -H "Idempotency-Key: $(printf 'k%.0s' {1..201})"
is_problem 400 malformed-request 'a key that is too long is refused'
slow2=${slow/100000/99999}
aside execute invert "$slow2" -H 'Idempotency-Key: key-2' -H 'Prefer: wait=60' &
waiter=$!
sleep 1
execute invert "$slow2" -H 'Idempotency-Key: key-2'
is_problem 409 idempotency-key-in-flight 'a key whose first request is not answered yet is refused'
get '/v1/jobs?status=running'
post "/v1/jobs/$(json '.jobs[0].id')/cancel"
wait "$waiter"

# ---- Lists -----------------------------------------------------------------------------------------------

for name in L_amygdala R_amygdala L_pallidum R_pallidum; do
    post "/v1/meshes?name=$name" --data-binary "@$DATA/$name.ply"
done
get '/v1/meshes?limit=2'
is "$(json '.items | map(.name) | join(" ")')" 'R_pallidum L_pallidum' 'a page has the newest'
like "$(header Link)" '^</v1/meshes\?limit=2&cursor=[0-9a-f]+>; rel="next"$' 'and a link to the next'
seen=$(json '.items[].id')
while :; do
    next=$(json '.next // empty')
    [ -n "$next" ] || break
    get "/v1/meshes?limit=2&cursor=$next"
    seen="$seen $(json '.items[].id')"
done
is "$(wc -w <<<"$seen") $(tr ' ' '\n' <<<"$seen" | sort -u | wc -l)" '5 5' 'pages have each mesh once'
is "$(header Link)" '' 'the last has no next'

# Progress of a job that encodes two meshes, registers and follows a path: told as one, in its record and in the list
# alike, and never taken back. Meanwhile others wait, and know where.
post /v1/meshes --data-binary @tests/data/aal_subcortex/R_pallidum.ply
execute geodesic "{\"from\":\"$mesh\",\"to\":\"$(json .id)\",\"steps\":25,\"symmetric\":true}" -H 'Prefer: respond-async'
long=$(json .id)
execute invert "${slow/100000/99998}" -H 'Prefer: respond-async'
is "$(json '"\(.status) \(.estimatedSecondsLeft)"')" 'accepted null' 'of a job that waits nothing is estimated'
behind=$(json .id)
execute invert "${slow/100000/99997}" -H 'Prefer: respond-async'
for _ in $(seq 600); do
    get "/v1/jobs/$long"
    [ "$(json .status)" = running ] && break
    sleep 0.05
done
get '/v1/jobs?status=accepted'
is "$(json '[.jobs[].queuePosition] | join(" ")')" '2 1' 'jobs that wait have their places in the list'
get "/v1/jobs/$behind"
is "$(json .queuePosition)" 1 'and in their records'
for job in $(curl -fsS "$URL/v1/jobs?status=accepted" | jq -r '.jobs[].id'); do
    post "/v1/jobs/$job/cancel"
done
is "$(json '"\(.status) \(.queuePosition)"')" 'dismissed null' 'which end with the waiting'
for _ in $(seq 6000); do
    get '/v1/jobs?process=geodesic&limit=1'
    json '.jobs[0] | "\(.progress) \(.status) \(.message)"'
    get "/v1/jobs/$long"
    json '"\(.progress) \(.status) \(.message)"'
    json 'select(.status == "running") | "\(.estimatedSecondsLeft // "-") \(.updated)"' >>"$SCRATCH/estimates"
    case $(json .status) in successful | failed | dismissed) break ;; esac
    sleep 0.02
done >"$SCRATCH/progress"
is "$(tail -n 1 "$SCRATCH/progress" | cut -d ' ' -f 1-2)" '100 successful' 'a job of several steps ends at 100 percent'
note "progress: $(uniq "$SCRATCH/progress" | awk '{ printf "%s%.3g", (NR > 1 ? ", " : ""), $1 }')"
check 'and its progress never falls' sort -c -n -s -k 1,1 "$SCRATCH/progress"
compare "$(awk '$2 == "running" && $1 > 0 && $1 < 100' "$SCRATCH/progress" | cut -d ' ' -f 1 | sort -u | wc -l)" '>=' 3 \
    'through values between'
like "$(tail -n 1 "$SCRATCH/estimates")" '^[0-9.e-]+ 20' 'with an estimate of the seconds that are left'
compare "$(cut -d ' ' -f 2 "$SCRATCH/estimates" | sort -u | wc -l)" '>=' 3 'and the time of the last change'
get '/v1/meshes?limit=1'
cursor=$(json .next)
get "/v1/jobs?cursor=$cursor"
is_problem 422 invalid-input 'a cursor of another list is refused'
get "/v1/meshes?cursor=${cursor%?}0"
compare "$STATUS" '>=' 200 'a cursor that was changed is answered'
get '/v1/jobs?process=encode&status=successful&limit=1'
is "$(json '.jobs[0].processID') $(json '.jobs[0].status')" 'encode successful' 'jobs are filtered'
like "$(header Link)" 'process=encode&status=successful' 'and the next page, too'

# ---- Representations ---------------------------------------------------------------------------------------

for path in "/v1/meshes/$mesh" "/v1/meshes/$mesh/content" "/v1/jobs/$keyed/results"; do
    get "$path"
    tag=$(header ETag)
    like "$tag" '^"[^"]+"$' "$path has a tag"
    get "$path" -H "If-None-Match: $tag"
    is "$STATUS $(wc -c <"$BODY")" '304 0' 'and is not sent again'
    get "$path" -H 'If-None-Match: "other"'
    is "$STATUS" 200 'unless it is another'
done
get "/v1/jobs/$keyed/results?outputs=fit,nothing"
is_problem 422 invalid-input 'an output that the process does not have is refused'
get "/v1/jobs/$keyed/results?outputs=fit"
is "$STATUS $(json 'keys | join(" ")')" '200 fit' 'and one that it has is given alone'
get "/v1/jobs/$keyed/results?outputs=fit,fit,route,fit&response=document"
is "$STATUS $(grep -o '"\(fit\|route\)" *:' "$BODY" | tr -d ' \n')" '200 "fit":"route":' 'once, however often it is named'
get "/v1/meshes/$mesh/content"
check 'the content is the file' cmp "$BODY" "$DATA/L_thalamus.ply"
length=$(wc -c <"$BODY")
while read -r method pattern _; do
    [ "$method" = GET ] || continue
    case $pattern in
    *'{id}'*) continue ;;
    esac
    get "$pattern"
    full=$STATUS
    request HEAD "$pattern"
    is "$STATUS" "$full" "HEAD $pattern is answered as GET is"
    like "$(header X-Request-Id) $(header Server-Timing)" '^req-[0-9a-f]+ total;dur=[0-9.]+$' 'with an id and a time'
done < <("$SRNFD" routes)
ID_BEFORE=$(header X-Request-Id)
get /healthz
unlike "$(header X-Request-Id)" "^${ID_BEFORE:0:12}" 'ids do not count requests'
request HEAD "/v1/meshes/$mesh/content"
is "$STATUS $(header Content-Length)" "200 $length" 'HEAD tells the length'
request OPTIONS "/v1/jobs/$keyed"
is "$STATUS $(header Allow)" '204 GET, HEAD, PATCH, DELETE, OPTIONS' 'OPTIONS tells the methods'

# ---- The end -----------------------------------------------------------------------------------------------

# A job that runs when the service ends is there, to be run again, at the next start.
execute invert "${slow/100000/99998}" -H 'Prefer: respond-async'
job=$(json .id)
aside execute invert "${slow/100000/99998}" -H 'Prefer: wait=60' &
waiter=$!
sleep 0.5
kill -TERM "$SERVER_PID"
wait_server "$SERVER_PID"
is "$SERVER_STATUS" 0 'the service drains and ends well'
wait "$waiter"
check 'the log is JSON, line by line' jq -e . "$SERVER_LOG"
is "$(jq -r 'select(.event == "request") | select(.status == 0) | .path' "$SERVER_LOG" | wc -l)" 0 \
    'no request was left without an answer'
start_server "$SCRATCH/data" --workers 1 || exit 1
get "/v1/jobs/$job"
like "$STATUS $(json .status)" '^200 (accepted|running)$' 'the job is taken up again'
get "/v1/jobs/$keyed/results"
is "$STATUS" 200 'results are kept'
execute encode "{\"mesh\":\"$mesh\",\"lmax\":15}"
is "$(header Cache-Status)" 'srnfd; hit' 'and the cache'
post "/v1/jobs/$job/cancel"
stop_server || not_ok 'the server ends well'
done_testing

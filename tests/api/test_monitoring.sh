#!/usr/bin/env bash
# What a monitor sees: /metrics in the text format of Prometheus, checked line by line by a strict parser;
# /readyz and what makes it say no; lines of the log for refusals; request ids and traceparent.
# srnfd-test: once (what is counted does not depend on the build)
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 --max-queued 2 || exit 1

# ---- /readyz -------------------------------------------------------------------------------------------

get /readyz
is "$STATUS $(json '[.checks[]] | unique | length')" '200 1' 'a service at rest is ready'
is "$(json '.checks | keys | join(" ")')" \
    'databaseReadable queueAccepting spaceLeft storeWritable tokensReadable workersAlive' 'and says what it looked at'

# One who writes for two seconds keeps writes waiting, and no monitor: here another program.
sleep 0.6
python3 - "$SCRATCH/data/srnfd.db" >"$SCRATCH/locked" <<'END' &
import sqlite3, sys, time
db = sqlite3.connect(sys.argv[1], isolation_level=None)
db.execute("BEGIN IMMEDIATE")
print("locked", flush=True)
time.sleep(2)
db.execute("ROLLBACK")
END
locker=$!
until [ -s "$SCRATCH/locked" ]; do sleep 0.02; done
begun=$(date +%s%N)
get /readyz
compare "$((($(date +%s%N) - begun) / 1000000))" '<' 1000 'a monitor does not wait for the writes of others, ms'
is "$STATUS" 200 'and the service is ready'
wait "$locker"

post '/v1/meshes?format=ply' --data-binary @tests/data/aal_subcortex/L_thalamus.ply
left=$(json .id)
post '/v1/meshes?format=ply' --data-binary @tests/data/aal_subcortex/R_thalamus.ply
right=$(json .id)
jobs=()
for steps in 97 99 101; do
    execute geodesic "{\"from\":\"$left\",\"to\":\"$right\",\"steps\":$steps}" \
        --header 'Prefer: respond-async'
    jobs+=("$(json .id)")
    # The first is claimed before the queue is filled.
    for _ in $(seq 100); do
        [ "$steps" = 97 ] || break
        get "/v1/jobs/${jobs[0]}"
        [ "$(json .status)" = accepted ] || break
        sleep 0.05
    done
done
get /readyz
is_problem 503 not-ready 'a full queue is not ready'
is "$(json '.errors[].pointer' | paste -sd' ')" /checks/queueAccepting 'and that is what failed'
is "$(header Retry-After)" 5 'with a time to come back'
execute encode "{\"mesh\":\"$left\",\"lmax\":6}" --header 'Prefer: respond-async'
is_problem 503 queue-full 'as an execution finds'

# ---- /metrics ------------------------------------------------------------------------------------------

# Reads the format as its specification has it and prints what is wrong: order and place of HELP and TYPE, names,
# escapes, values, one line a series, families in one piece, and histograms that add up.
strict() { # FILE
    awk '
        function wrong(what) { print FNR ": " what ": " $0 }
        function close_histogram(    key) {
            for (key in last) if (last[key] != total[key]) wrong("buckets and count differ of " key)
            delete last; delete total
        }
        /^# HELP / {
            close_histogram()
            if (!match($0, /^# HELP [a-zA-Z_:][a-zA-Z0-9_:]* ./)) wrong("HELP")
            if ($3 in helped) wrong("a family in two pieces")
            helped[$3] = 1; family = $3; kind = ""
            next
        }
        /^# TYPE / {
            if ($3 != family || kind != "" || $4 !~ /^(counter|gauge|histogram)$/) wrong("TYPE")
            kind = $4
            if (kind == "counter" && family !~ /_total$/) wrong("a counter is named _total")
            next
        }
        /^#/ || /^$/ { wrong("neither a sample nor HELP nor TYPE"); next }
        {
            if (!match($0, /^[a-zA-Z_:][a-zA-Z0-9_:]*/)) { wrong("name"); next }
            name = substr($0, 1, RLENGTH); rest = substr($0, RLENGTH + 1); labels = ""
            if (rest ~ /^{/) {
                if (!match(rest, /^{[a-zA-Z_][a-zA-Z0-9_]*="([^"\\\n]|\\["\\n])*"(,[a-zA-Z_][a-zA-Z0-9_]*="([^"\\\n]|\\["\\n])*")*}/)) { wrong("labels"); next }
                labels = substr(rest, 1, RLENGTH); rest = substr(rest, RLENGTH + 1)
            }
            if (rest !~ /^ ([-+]?[0-9]+(\.[0-9]+)?(e[-+]?[0-9]+)?|\+Inf|-Inf|NaN)$/) wrong("value")
            value = substr(rest, 2) + 0
            if ((name, labels) in seen) wrong("a series twice")
            seen[name, labels] = 1
            base = name
            if (kind == "histogram") sub(/_(bucket|sum|count)$/, "", base)
            if (base != family || kind == "") wrong("a sample outside its family")
            if (kind != "gauge" && value < 0) wrong("below zero")
            if (name == family "_bucket") {
                key = labels; sub(/,?le="[^"]*"/, "", key); if (key == "{}") key = ""
                if (value < last[key]) wrong("buckets are cumulative")
                last[key] = value
            }
            if (name == family "_count" && kind == "histogram") total[labels] = value
        }
        END { close_histogram() }' "$1"
}
value() { # SERIES AS IN THE TEXT
    awk -v series="$1" 'index($0, series " ") == 1 { print $NF }' "$BODY"
}

get '/nothing"\\'
get /v1/version
get /metrics
is "$STATUS $(header Content-Type)" '200 text/plain; version=0.0.4; charset=utf-8' 'the text format'
is "$(strict "$BODY")" '' 'is kept to'
if command -v promtool >/dev/null; then
    check 'promtool finds nothing either' promtool check metrics <"$BODY"
fi
is "$(value srnfd_queue_length)" 2 'two jobs wait'
is "$(value 'srnfd_jobs{process="geodesic",status="accepted"}')" 2 'of this process'
is "$(value 'srnfd_jobs{process="geodesic",status="running"}')" 1 'one runs'
is "$(value srnfd_workers_busy) $(value srnfd_workers)" '1 1' 'on the one worker'
is "$(value srnfd_express_workers_busy) $(value srnfd_express_workers)" '0 2' 'and none on the threads for short jobs'
compare "$(value srnfd_queue_age_seconds)" '>' 0 'the oldest has waited'
is "$(value 'srnfd_http_requests_total{route="/v1/version",method="GET",status="200"}')" 1 'requests are counted'
is "$(value 'srnfd_http_requests_total{route="none",method="GET",status="404"}')" 1 'under no path that a client made up'
is "$(value 'srnfd_http_refusals_total{code="queue-full"}')" 1 'refusals by their code'
is "$(value 'srnfd_http_refusals_total{code="not-found"}')" 1 'of every kind'
is "$(value 'srnfd_http_request_duration_seconds_count{route="/v1/version"}')" 1 'their time'
for part in database wal blobs; do
    compare "$(value "srnfd_store_bytes{part=\"$part\"}")" '>=' 0 "the size of the store: $part"
done
compare "$(value srnfd_store_free_bytes)" '>' 0 'and what is left'
compare "$(value process_resident_memory_bytes)" '>' 1000000 'memory'
compare "$(value process_open_fds)" '>' 5 'descriptors'
is "$(value process_max_fds)" "$(sed -n 's/^Max open files *[0-9]* *\([0-9]*\).*/\1/p' "/proc/$SERVER_PID/limits")" \
    'of as many as the system allows'

for job in "${jobs[@]}"; do post "/v1/jobs/$job/cancel"; done
for job in "${jobs[@]}"; do poll_job "$job" 60; done
for _ in 1 2; do execute encode "{\"mesh\":\"$left\",\"lmax\":6}"; done
get /metrics
is "$(strict "$BODY")" '' 'the format is kept to with jobs that ended'
is "$(value 'srnfd_jobs_ended_total{process="geodesic",status="dismissed"}')" 3 'dismissed jobs'
is "$(value 'srnfd_jobs_ended_total{process="encode",status="successful"}')" 1 'a successful one'
is "$(value 'srnfd_jobs_submitted_total{process="encode",how="cached"}')" 1 'and a hit in the cache'
is "$(value 'srnfd_job_duration_seconds_count{process="encode"}')" 1 'how long jobs took'
is "$(value srnfd_queue_length)" 0 'nothing waits any more'
series=$(grep -vc '^#' "$BODY")
get /readyz
is "$STATUS" 200 'and the service is ready again'

# Whatever clients send, the number of series stays.
for i in $(seq 40); do
    request "METHOD$i" "/made/up/$i?x=$i" --header "X-Request-Id: id-$i"
done
get /metrics
compare "$(grep -vc '^#' "$BODY")" '<=' $((series + 50)) 'forty methods and paths are one series'

# ---- The log -------------------------------------------------------------------------------------------

trace=0af7651916cd43dd8448eb211c80319c
execute encode "{\"mesh\":\"$right\",\"lmax\":6}" --header "traceparent: 00-$trace-b7ad6b7169203331-01" \
    --header 'X-Request-Id: traced'
like "$(header traceparent)" "^00-$trace-[0-9a-f]{16}-01\$" 'a trace goes on'
unlike "$(header traceparent)" b7ad6b7169203331 'under an id of its own'
job=$(header Link | sed 's,.*/jobs/\([^>]*\)>.*,\1,')
is "$(jq -r "select(.event == \"request\" and .id == \"traced\") | .traceparent" "$SERVER_LOG")" \
    "$(header traceparent)" 'into the line of the request'
is "$(jq -r "select(.event == \"job-submitted\" and .job == \"$job\") | .request + \" \" + .traceparent" \
    "$SERVER_LOG")" "traced $(header traceparent)" 'and the line that ties the job to it'
trace_line=$(header traceparent)
poll_job "$job" 60
is "$(jq -r "select(.job == \"$job\" and .event != \"job-submitted\") | .event + \" \" + .traceparent" "$SERVER_LOG" |
    sort | paste -sd' ')" \
    "job-accepted $trace_line job-running $trace_line job-successful $trace_line" 'and those of its run'
execute encode "{\"mesh\":\"$right\",\"lmax\":7}"
is "$(jq -r "select(.event == \"job-running\" and .job == \"$(header Link | sed 's,.*/jobs/\([^>]*\)>.*,\1,')\") |
    has(\"traceparent\")" "$SERVER_LOG")" false 'which a job without a trace does not have'
for bad in "00-$trace-b7ad6b7169203331" "00-${trace^^}-b7ad6b7169203331-01" "ff-$trace-b7ad6b7169203331-01" \
    "00-00000000000000000000000000000000-b7ad6b7169203331-01" "00-$trace-0000000000000000-01" \
    "00-$trace-b7ad6b7169203331-01-more" "00-$trace-b7ad6b7169203331-0g"; do
    get /healthz --header "traceparent: $bad"
    is "$STATUS$(header traceparent)" 200 "no trace: $bad"
done
get /healthz --header "traceparent: 01-$trace-b7ad6b7169203331-00-more"
like "$(header traceparent)" "^00-$trace-[0-9a-f]{16}-00\$" 'a later version is read as the first'

get /v1/jobs/job-0 --header 'X-Request-Id: refused'
is "$(jq -r 'select(.event == "request" and .id == "refused") | .level + " " + .code' "$SERVER_LOG")" \
    'warn no-such-job' 'a refusal leaves a line with its code'
get /healthz --header 'X-Request-Id: probe'
get /v1/version --header 'X-Request-Id: told'
get /v1/nothing
is "$(jq -r 'select(.event == "request" and (.id == "probe" or .id == "told")) | .id' "$SERVER_LOG")" told \
    'a probe that is answered well leaves no line'
check 'every line has a time, a level and an event' jq -e '.ts and (.level | IN("info", "warn", "error")) and .event' \
    "$SERVER_LOG"
stop_server || not_ok 'the server ends well'

# The log without those that were answered well; no space left as the floor has it.
start_server "$SCRATCH/data" --workers 1 --access-log refusals --least-free 1000000000000000 || exit 1
get /healthz --header 'X-Request-Id: quiet'
get /v1/nothing --header 'X-Request-Id: loud'
get /readyz
is_problem 503 not-ready 'a disk below the floor is not ready'
is "$(json '.errors[].pointer')" /checks/spaceLeft 'and says so'
is "$(jq -r 'select(.event == "request") | .id' "$SERVER_LOG" | head -n 1)" loud 'only refusals are logged if so set'
stop_server || not_ok 'the server ends well'
done_testing

#!/usr/bin/env bash
# GET /v1/jobs/{id}/events with curl, as a dashboard would use it: events from acceptance to the end, progress
# that moves, ids that a client can come back with, and what ends a stream early.
# srnfd-test: slow
# srnfd-test: no-asan (api/test_events_all.sh and api/test_tickets.sh run its code)
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 --max-streams 3 --grace-seconds 2 || exit 1
post '/v1/meshes?format=ply' --data-binary @tests/data/aal_subcortex/L_thalamus.ply
left=$(json .id)
post '/v1/meshes?format=ply' --data-binary @tests/data/aal_subcortex/R_thalamus.ply
right=$(json .id)

# A job that runs for some seconds, and one behind it.
submit() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: respond-async'
    json .id
}
long_inputs() { # STEPS
    printf '{"from":"%s","to":"%s","steps":%d,"register":false}' "$left" "$right" "$1"
}
STEPS=(41 21 61)
[ -n "$SRNFD_SANITIZED" ] && STEPS=(15 16 6) # each takes longer; the first two are no short jobs
first=$(submit geodesic "$(long_inputs "${STEPS[0]}")")
second=$(submit geodesic "$(long_inputs "${STEPS[1]}")")

stream() { # JOB [CURL ARGUMENTS..]: the events to the end
    local job=$1
    shift
    curl --silent --no-buffer --max-time 120 "$@" "$URL/v1/jobs/$job/events"
}
stream "$second" >"$SCRATCH/second" &
follower=$!
stream "$first" >"$SCRATCH/first"
wait "$follower"
is $? 0 'the stream of a job that waits ends, too'

data() { # FILE JQ-FILTER: of each event
    sed -n 's/^data: //p' "$1" | jq -r "$2"
}
is "$(data "$SCRATCH/first" .id | sort -u)" "$first" 'every event tells the job'
is "$(data "$SCRATCH/first" .status | uniq | paste -sd' ')" 'running successful' 'from its state to its end'
is "$(data "$SCRATCH/second" .status | uniq | paste -sd' ')" 'accepted running successful' \
    'the job behind it waits, runs, ends'
compare "$(data "$SCRATCH/first" .progress | sort -u | wc -l)" '>=' 3 'progress moves'
is "$(data "$SCRATCH/first" .progress | sort -n -c 2>&1)" '' 'and never back'
is "$(grep -c '^id: ' "$SCRATCH/first")" "$(sed -n 's/^id: //p' "$SCRATCH/first" | sort -u | wc -l)" \
    'no event is told twice'
is "$(grep -c '^retry: ' "$SCRATCH/first")" 1 'the time to come back is told once'
is "$(grep '^event: ' "$SCRATCH/first" | sed -n '1p;$p' | sort -u)" 'event: status' \
    'the first and the last event are of the status'
unlike "$(cat "$SCRATCH/first")" $'\r' 'lines end in a line feed'

# Coming back.
last=$(sed -n 's/^id: //p' "$SCRATCH/first" | tail -n 1)
get "/v1/jobs/$first/events" --header "Last-Event-ID: $last"
is "$STATUS" 204 'who has seen the end is told to stay away'
get "/v1/jobs/$first/events" --header 'Last-Event-ID: 0123456789abcdef'
is "$STATUS $(grep -c '^id: ' "$BODY")" '200 1' 'who has not gets it'
is "$(sed -n 's/^id: //p' "$BODY")" "$last" 'under the same id'
like "$(header Content-Type)" '^text/event-stream' 'as an event stream'

# Dropped in the middle, and taken up where it was.
third=$(submit geodesic "$(long_inputs "${STEPS[2]}")")
curl --silent --no-buffer --max-time 120 "$URL/v1/jobs/$third/events" >"$SCRATCH/begun" &
follower=$!
for _ in $(seq 200); do
    grep -q '^data' "$SCRATCH/begun" && break
    sleep 0.01
done
kill "$follower"
wait "$follower"
seen=$(sed -n 's/^id: //p' "$SCRATCH/begun" | tail -n 1)
stream "$third" --header "Last-Event-ID: $seen" >"$SCRATCH/resumed"
unlike "$(sed -n 's/^id: //p' "$SCRATCH/resumed")" "$seen" 'what was seen is not told again'
is "$(data "$SCRATCH/resumed" .status | tail -n 1)" successful 'the rest is'

# Refusals.
get /v1/jobs/job-0/events
is_problem 404 no-such-job 'no job, no stream'
get "/v1/jobs/$first/events" --header 'Accept: application/json'
is_problem 406 not-acceptable 'events are not JSON'
request HEAD "/v1/jobs/$first/events"
is "$STATUS" 200 'HEAD asks without a stream'

# As many streams as allowed; the next is refused, and those that hang up make room. Clients that are ended in
# the middle are noticed by the next thing that is sent to them.
fourth=$(submit geodesic "$(long_inputs 99)")
pids=()
for i in 1 2 3; do
    curl --silent --no-buffer --max-time 120 "$URL/v1/jobs/$fourth/events" >"$SCRATCH/many-$i" &
    pids+=($!)
done
for i in 1 2 3; do
    for _ in $(seq 100); do
        grep -q '^data' "$SCRATCH/many-$i" && break
        sleep 0.05
    done
done
get "/v1/jobs/$fourth/events" --max-time 5
is_problem 503 server-busy 'the limit of streams'
post "/v1/jobs/$fourth/cancel"
for pid in "${pids[@]}"; do wait "$pid"; done
is "$(data "$SCRATCH/many-3" .status | tail -n 1)" dismissed 'a dismissed job ends its streams'
get "/v1/jobs/$first/events"
is "$STATUS" 200 'and then there is room again'

# A service that stops.
fifth=$(submit geodesic "$(long_inputs 97)")
stream "$fifth" >"$SCRATCH/stopped" &
follower=$!
for _ in $(seq 100); do
    grep -q '^data' "$SCRATCH/stopped" && break
    sleep 0.05
done
stop_server
is $? 0 'a service with streams stops'
wait "$follower"
is $? 0 'and ends them in good order'
done_testing

#!/usr/bin/env bash
# GET /v1/events: all jobs of a caller in one stream; what a client that comes back is told; whose jobs they are; and
# how many streams a token may have.
# srnfd-test: waits
# srnfd-test: once (what is told does not depend on the build)
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
ADA=$("$SRNFD" token add --data "$DATA" --name ada --role user 2>/dev/null)
BEN=$("$SRNFD" token add --data "$DATA" --name ben --role user 2>/dev/null)
SEES=$("$SRNFD" token add --data "$DATA" --name ada --role viewer 2>/dev/null)
OVER=$("$SRNFD" token add --data "$DATA" --name root --role admin 2>/dev/null)
start_server "$DATA" --workers 1 --grace-seconds 2 --quota-streams 2 || exit 1

as() { # TOKEN COMMAND ARGUMENTS..
    "${@:2}" --header "Authorization: Bearer $1"
}
follow() { # FILE TOKEN [QUERY] [CURL ARGUMENTS..]: in the background; its process is in $follower
    : >"$1"
    curl --silent --no-buffer --max-time 120 --header "Authorization: Bearer $2" "${@:4}" "$URL/v1/events${3:-}" >"$1" &
    follower=$!
}
await() { # FILE PATTERN [TIMES]: until the file has the pattern that often
    for _ in $(seq 100); do
        [ "$(grep -c -- "$2" "$1")" -ge "${3:-1}" ] && return 0
        sleep 0.05
    done
    return 1
}
hang_up() { # PROCESS
    kill "$1" 2>/dev/null
    wait "$1" 2>/dev/null
}
data() { # FILE JQ-FILTER: of each event
    sed -n 's/^data: //p' "$1" | jq -r "$2"
}
newest_id() { # FILE
    sed -n 's/^id: //p' "$1" | tail -n 1
}

as "$ADA" post /v1/meshes --data-binary @tests/data/aal_subcortex/L_thalamus.ply
MESH=$(json .id)
as "$BEN" post /v1/meshes --data-binary @tests/data/aal_subcortex/L_putamen.ply
OTHER=$(json .id)
encode() { # TOKEN MESH LMAX: prints the job
    as "$1" execute encode "{\"mesh\":\"$2\",\"lmax\":$3}" --header 'Prefer: respond-async'
    json .id
}

# ---- What is told --------------------------------------------------------------------------------------

BEFORE=$(encode "$ADA" "$MESH" 4)
await_job() { # TOKEN JOB
    for _ in $(seq 200); do
        as "$1" get "/v1/jobs/$2"
        [ "$(json .status)" = successful ] && return 0
        sleep 0.05
    done
    return 1
}
await_job "$ADA" "$BEFORE"
is $? 0 'a job ends before anyone looks'
follow "$SCRATCH/ada" "$ADA"
ADAS=$follower
follow "$SCRATCH/ben" "$BEN"
BENS=$follower
follow "$SCRATCH/root" "$OVER"
ROOTS=$follower
for one in ada ben root; do
    await "$SCRATCH/$one" '^event: start'
    is $? 0 "the stream of $one begins with where it begins"
done
like "$(newest_id "$SCRATCH/ada")" '^[0-9a-f]{96}$' 'which has an id'
is "$(grep -c '^retry: ' "$SCRATCH/ada")" 1 'and says when to come back'
FIRST=$(encode "$ADA" "$MESH" 6)
SECOND=$(encode "$BEN" "$OTHER" 6)
THIRD=$(encode "$ADA" "$MESH" 8)
for one in "ada $FIRST" "ada $THIRD" "ben $SECOND" "root $FIRST" "root $SECOND" "root $THIRD"; do
    await "$SCRATCH/${one% *}" "\"id\":\"${one#* }\".*\"status\":\"successful\""
    is $? 0 "${one% *} is told the end of a job"
done
is "$(data "$SCRATCH/ada" '.id // empty' | sort -u | grep -c .)" 2 'of its own jobs'
unlike "$(cat "$SCRATCH/ada")" "$BEFORE|$SECOND" 'and of no other, nor of what was before'
is "$(data "$SCRATCH/ben" '.id // empty' | sort -u)" "$SECOND" 'another owner sees its own'
is "$(data "$SCRATCH/root" '.id // empty' | sort -u | grep -c .)" 3 'an administrator sees all'
is "$(data "$SCRATCH/ada" "select(.id == \"$FIRST\").status" | tail -n 1)" successful 'up to the end of each'
is "$(sed -n 's/^id: //p' "$SCRATCH/ada" | sort | uniq -d)" '' 'each id once'
is "$(grep '^event: ' "$SCRATCH/ada" | sort -u | grep -vE 'start|status|progress')" '' 'by the names that are described'

# ---- Changes by requests -------------------------------------------------------------------------------

as "$ADA" request PATCH "/v1/jobs/$FIRST" --header 'Content-Type: application/json' --data '{"name":"the first"}'
await "$SCRATCH/ada" '"name":"the first"'
is $? 0 'a new name is told'
as "$ADA" request DELETE "/v1/jobs/$FIRST"
await "$SCRATCH/ada" '^event: deleted'
is $? 0 'that a job was removed is told'
is "$(grep -A1 '^event: deleted' "$SCRATCH/ada" | sed -n 's/^data: //p')" "{\"id\":\"$FIRST\"}" 'with its id alone'
unlike "$(cat "$SCRATCH/ben")" "$FIRST" 'to nobody else'

# ---- How many, and coming back -------------------------------------------------------------------------

follow "$SCRATCH/viewer" "$SEES"
await "$SCRATCH/viewer" '^event: start'
is $? 0 'a viewer has one, too'
follow "$SCRATCH/second" "$ADA"
await "$SCRATCH/second" '^event: start'
SECONDS_STREAM=$follower
as "$ADA" get /v1/events --max-time 5
is_problem 429 quota-exceeded 'a token has as many as its quota says'
SEEN=$(newest_id "$SCRATCH/ada")
hang_up "$ADAS"
hang_up "$SECONDS_STREAM"
FOURTH=$(encode "$ADA" "$MESH" 10)
await_job "$ADA" "$FOURTH"
await_place() { # as streams are left when the daemon notices
    for _ in $(seq 200); do
        as "$ADA" get /v1/events --max-time 0.5
        [ "$STATUS" = 429 ] || return 0
        sleep 0.1
    done
    return 1
}
await_place
is $? 0 'who hangs up makes room'
for _ in $(seq 50); do # until what asked for a place has left it
    follow "$SCRATCH/again" "$ADA" '' --header "Last-Event-ID: $SEEN"
    await "$SCRATCH/again" '^event: \|quota-exceeded'
    grep -q quota-exceeded "$SCRATCH/again" || break
    hang_up "$follower"
    sleep 0.2
done
await "$SCRATCH/again" "\"id\":\"$FOURTH\""
is $? 0 'who comes back is told what happened meanwhile'
unlike "$(cat "$SCRATCH/again")" "event: start|$THIRD" 'and nothing that it has seen'
hang_up "$follower"
for _ in $(seq 50); do # until the streams that were left have made room
    as "$ADA" post /v1/tickets
    curl --silent --no-buffer --max-time 3 "$URL/v1/events?ticket=$(json .ticket)&after=$SEEN" >"$SCRATCH/ticket"
    grep -q quota-exceeded "$SCRATCH/ticket" || break
    sleep 0.2
done
is "$(data "$SCRATCH/ticket" .id)" "$FOURTH" 'so it is with a ticket, in the address'
follow "$SCRATCH/strange" "$OVER" '' --header 'Last-Event-ID: 00000000-0000000000000003'
await "$SCRATCH/strange" '^event: start'
is $? 0 'the id of another run is where a stream begins anew'
get /v1/events
is_problem 401 token-required 'a stream is for who has a token'
as "$ADA" get /v1/events --header 'Accept: application/json'
is_problem 406 not-acceptable 'events are not JSON'
as "$ADA" get "/v1/events?after=$(printf '%0100d' 0)"
is_problem 400 malformed-request 'no id is that long'
"$SRNFD" token revoke ben --data "$DATA" 2>/dev/null
wait "$BENS"
is $? 0 'a token that is revoked ends its stream'

# ---- The end --------------------------------------------------------------------------------------------

stop_server
is $? 0 'a service with streams stops'
wait "$ROOTS"
is $? 0 'and ends them in good order'
done_testing

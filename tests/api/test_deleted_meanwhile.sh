#!/usr/bin/env bash
# test_deleted_meanwhile.sh - what one request deletes while others send or export it: they find it or they do not, and
# the service never fails.
# srnfd-test: slow
# srnfd-test: once (the order of requests does not depend on the build)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 2 || exit 1

AAL=tests/data/aal_subcortex
SECONDS_LONG=3

# Every status that came of requests while their like was deleted, each once.
statuses() {
    sort -u "$SCRATCH"/status.* | tr '\n' ' '
}

send_named() { # N
    local end=$((SECONDS + SECONDS_LONG)) i=0
    while [ $SECONDS -lt $end ]; do
        curl -s -o /dev/null -w '%{http_code}\n' "$URL/v1/meshes?name=n$1-$((i++))" --data-binary "@$AAL/R_amygdala.ply"
    done >"$SCRATCH/status.$1"
}
post /v1/meshes --data-binary "@$AAL/R_amygdala.ply"
MESH=$(json .id)
senders=()
for n in 1 2 3; do
    send_named $n &
    senders+=($!)
done
end=$((SECONDS + SECONDS_LONG))
while [ $SECONDS -lt $end ]; do
    curl -s -o /dev/null -X DELETE "$URL/v1/meshes/$MESH"
done
wait "${senders[@]}"
is "$(statuses)" '200 201 ' 'a mesh that is sent again under another name while it is deleted is there, or comes in'
rm "$SCRATCH"/status.*

files=()
for side in L R; do
    for what in amygdala pallidum; do
        files+=(-F "f=@$AAL/${side}_$what.ply")
    done
done
request POST '/v1/imports?cohort=group' "${files[@]}"
is "$STATUS" 201 'a group comes in'
for _ in 1 2 3 4 5 6 7 8; do
    execute pca '{"cohort":"group","register":false,"lmax":6}' --header 'Prefer: respond-async, wait=60'
    MODEL=$(json .model.id)
    exports=()
    for n in 1 2 3 4 5 6 7 8; do
        curl -s -o /dev/null -w '%{http_code}\n' "$URL/v1/models/$MODEL/export" >"$SCRATCH/status.$n" &
        exports+=($!)
    done
    sleep 0.02
    request DELETE "/v1/models/$MODEL?cascade=true"
    wait "${exports[@]}"
    cat "$SCRATCH"/status.? >>"$SCRATCH/all"
done
grep -q 404 "$SCRATCH/all" || note 'no export came late'
is "$(grep -cv '^200$\|^404$' "$SCRATCH/all")" 0 'exports of a model that is deleted meanwhile are whole, or there is none'

# Many wait for a job that waits itself, behind long ones; others dismiss it and remove it at once.
post /v1/meshes --data-binary "@$AAL/L_thalamus.ply"
MESH=$(json .id)
execute encode "{\"mesh\":\"$MESH\",\"lmax\":6}"
SLOW="{\"srnf\":{\"surface\":\"$(json .surface.id)\"},\"initial\":\"sphere\",\"method\":\"gradient\",\"tolerance\":1e-30"
LONG=()
for n in 100000 99999; do
    execute invert "$SLOW,\"maxIterations\":$n}" --header 'Prefer: respond-async'
    LONG+=("$(json .id)")
done
for n in 1 2 3; do
    inputs="$SLOW,\"maxIterations\":$((99990 - n))}"
    execute invert "$inputs" --header 'Prefer: respond-async'
    JOB=$(json .id)
    waiters=()
    for k in $(seq 20); do
        curl -s -o "$SCRATCH/waited.$n.$k" "$URL/v1/processes/invert/execution" --header 'Prefer: wait=60' \
            --header 'Content-Type: application/json' --data "{\"inputs\":$inputs}" &
        waiters+=($!)
    done
    sleep 0.7
    curl -s -o /dev/null --parallel --parallel-immediate -X DELETE "$URL/v1/jobs/$JOB#[1-40]" 2>/dev/null
    wait "${waiters[@]}"
done
is "$(jq -r '"\(.status) \(.code)"' "$SCRATCH"/waited.* | sort -u)" '410 job-dismissed' \
    'who waits for a job that is dismissed, and removed at once, is told so'
check 'also in words' grep -q 'was deleted by another request before this one was answered' "$SCRATCH"/waited.*
for job in "${LONG[@]}"; do
    request DELETE "/v1/jobs/$job"
done

# Many ask for the results of a job, under a name, while it is deleted.
end=$((SECONDS + SECONDS_LONG))
while [ $SECONDS -lt $end ]; do
    execute encode "{\"mesh\":\"$MESH\",\"lmax\":4}" --header 'Prefer: respond-async'
    curl -s --parallel --parallel-immediate -o /dev/null -w '%{http_code}\n' --header 'Prefer: respond-async' \
        --header 'Content-Type: application/json' --data "{\"name\":\"n\",\"inputs\":{\"mesh\":\"$MESH\",\"lmax\":4}}" \
        "$URL/v1/processes/encode/execution#[1-30]" 2>/dev/null >>"$SCRATCH/named" &
    asked=$!
    curl -s -o /dev/null --parallel --parallel-immediate -X DELETE "$URL/v1/jobs/$(json .id)#[1-20]" 2>/dev/null
    wait "$asked"
done
grep -q 410 "$SCRATCH/named" || note 'no name came late'
is "$(grep -cv '^201$\|^410$' "$SCRATCH/named")" 0 'what is named while it is deleted is there, or is gone'

stop_server
is $? 0 'the daemon ends well'
done_testing

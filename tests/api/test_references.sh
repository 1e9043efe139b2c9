#!/usr/bin/env bash
# test_references.sh - inputs by links to outputs of jobs, in small and large bodies.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 2 || exit 1

encode() { # NAME: sets ID
    post /v1/meshes --data-binary "@tests/data/aal_subcortex/$1.ply"
    execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":4}"
    ID=$(json .surface.id)
}
encode L_amygdala
A=$ID
encode L_thalamus
B=$ID
execute geodesic "{\"from\":\"$A\",\"to\":\"$B\",\"steps\":3,\"register\":false}" -H 'Prefer: respond-async'
JOB=$(json .id)
for _ in $(seq 600); do
    get "/v1/jobs/$JOB"
    [ "$(json .status)" = successful ] && break
    sleep 0.05
done
LINK="{\"href\":\"/v1/jobs/$JOB/results/surfaces\"}"
# A large body is read with its memory charged to an account, which must be even afterwards.
for blanks in 0 70000; do
    printf '{"inputs":{"surfaces":%s,"register":false}}%*s' "$LINK" "$blanks" '' >"$SCRATCH/request.json"
    post /v1/processes/distances/execution -H 'Content-Type: application/json' --data-binary "@$SCRATCH/request.json"
    is "$STATUS $(json '.matrix | length')" '200 3' "a list of surfaces is linked to, with $blanks blanks behind"
    get /healthz
    is "$STATUS" 200 'and the service goes on'
done
# Each link to an output reads the results of a job, so there are not many in a request.
many=$(jq -nc --argjson link "$LINK" '[range(1000) | $link]')
printf '{"inputs":{"surfaces":%s}}' "$many" >"$SCRATCH/request.json"
post /v1/processes/distances/execution -H 'Content-Type: application/json' --data-binary "@$SCRATCH/request.json"
is_problem 422 invalid-input 'more links to outputs than a request may have are refused'
like "$(json '.errors[0].detail')" 'at most 16 links' 'with their number'
is "$(json '.errors | length')" 1 'once'

stop_server || not_ok 'the server ends well'
done_testing

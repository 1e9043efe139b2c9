#!/usr/bin/env bash
# test_users.sh - GET /v1/users: for admins alone, with quotas and what each holds, and without any secret.
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 --quota-queued 7 || exit 1
get /v1/users
is "$STATUS $(jq -Sc . "$BODY")" '200 {"items":[]}' 'without tokens there are no users'

token() { # ARGUMENTS..: prints the secret
    "$SRNFD" token add --data "$SCRATCH/data" "$@" 2>/dev/null
}
ROOT_TOKEN=$(token --name root --role admin)
ADA=$(token --name ada --max-bytes 1000000)
EYE=$(token --name ada --role viewer)
post '/v1/meshes?name=a' --data-binary @tests/data/aal_subcortex/L_thalamus.ply --header "Authorization: Bearer $ADA"
is "$STATUS" 201 'one of them uploads a mesh'

get /v1/users --header "Authorization: Bearer $ROOT_TOKEN"
is "$STATUS $(header Cache-Control)" '200 private, no-store' 'an admin sees them'
is "$(json '[.items[] | "\(.name) \(.tokens | length)"] | join(", ")')" 'root 1, ada 2' 'by their names, with their tokens'
is "$(json '[.items[1].tokens[].role] | join(" ")')" 'user viewer' 'and roles'
is "$(json '.items[1].tokens[0].quotas | "\(.bytes) \(.queued)"')" '1000000 7' 'quotas are their own, or those of the service'
compare "$(json '.items[1].bytes')" '>' 10000 'what a user holds is counted'
is "$(json '.items[0].bytes, .items[1].jobsWaiting, .items[1].jobsRunning' | tr '\n' ' ')" '0 0 0 ' 'for each by itself'
for secret in "$ROOT_TOKEN" "$ADA" "$EYE"; do
    unlike "$(cat "$BODY")" "$secret|$(printf '%s' "$secret" | sha256sum | cut -c 1-64)" 'no secret is told, nor its digest'
done

get /v1/users --header "Authorization: Bearer $ADA"
is_problem 403 forbidden 'a user does not see them'
get /v1/users --header "Authorization: Bearer $EYE"
is_problem 403 forbidden 'nor does a viewer'
get /v1/users
is_problem 401 token-required 'nor a stranger'

stop_server
is $? 0 'the daemon ends well'
done_testing

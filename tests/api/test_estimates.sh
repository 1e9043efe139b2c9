#!/usr/bin/env bash
# POST /v1/processes/{id}/estimate: seconds and memory of an execution, told before it is started; nothing is, and what an
# execution refuses is refused.
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 || exit 1

IDS=()
for name in L_thalamus R_thalamus L_putamen; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    IDS+=("\"$(json .id)\"")
done
ALL=$(IFS=, && echo "${IDS[*]}")
estimate() { # PROCESS INPUTS
    post_json "/v1/processes/$1/estimate" "{\"inputs\":$2}"
}

estimate mean "{\"surfaces\":[$ALL],\"lmax\":15}"
is "$STATUS" 200 'a mean is estimated'
is "$(json 'keys | join(" ")')" 'estimatedBytes estimatedSeconds memoryLimit' 'in seconds and bytes'
COARSE=$(json .estimatedSeconds) BYTES=$(json .estimatedBytes)
compare "$COARSE" '>' 0 'which it takes'
compare "$BYTES" '>' 100000 'and needs'
compare "$(json .memoryLimit)" '>' "$BYTES" 'and has'
estimate mean "{\"surfaces\":[$ALL],\"lmax\":63}"
compare "$(json .estimatedSeconds)" '>' "$COARSE" 'a higher degree takes longer'
compare "$(json .estimatedBytes)" '>' "$BYTES" 'and needs more'
estimate mean "{\"surfaces\":[$ALL],\"lmax\":15,\"register\":false}"
compare "$(json .estimatedSeconds)" '<' "$COARSE" 'without registration it is faster'

# The same search is told to take as long, whichever process makes it.
seconds() { # PROCESS INPUTS
    estimate "$1" "$2"
    json .estimatedSeconds
}
PAIR="\"template\":${IDS[0]},\"moving\":${IDS[1]}"
ENDS="\"from\":${IDS[0]},\"to\":${IDS[1]},\"steps\":2"
BOTH=$(seconds register "{$PAIR,\"symmetric\":true}") ONE=$(seconds register "{$PAIR}")
is "$(seconds distances "{\"surfaces\":[${IDS[0]},${IDS[1]}]}")" "$BOTH" \
    'a distance takes what registering both ways takes'
compare "$BOTH" '>' "$ONE" 'which takes more than one way'
PATH_BOTH=$(seconds geodesic "{$ENDS}") PATH_ONE=$(seconds geodesic "{$ENDS,\"symmetric\":false}")
is "$(jq -n "($PATH_BOTH - $PATH_ONE) * 1e6 | round")" "$(jq -n "($BOTH - $ONE) * 1e6 | round")" \
    'as a path that searches so takes more'

estimate encode "{\"mesh\":${IDS[0]}}"
is "$STATUS $(json .estimatedBytes)" '200 null' 'memory that nothing is judged by is null'
compare "$(json .estimatedSeconds)" '<' 1 'an encode is short'
estimate invert '{"srnf":{"lmax":4,"nTheta":1,"nPhi":1,"q":[0]}}'
is_problem 422 invalid-input 'inputs are checked'
get /v1/jobs
is "$(json '.jobs | length')" 0 'nothing was started'

estimate invert "{\"srnf\":{\"surface\":${IDS[0]}}}"
is "$STATUS $(json .estimatedSeconds)" '200 null' 'what the inputs do not tell is null'
estimate encode '{"mesh":"mesh-00000000000000000000000000000000"}'
is_problem 404 no-such-mesh 'what is not there'
estimate nonsense '{}'
is_problem 404 no-such-process 'of no process'
estimate encode '{"mesh":{"href":"https://example.org/a.ply"}}'
is_problem 422 invalid-input 'nothing is fetched for an estimate'
post_json /v1/processes/mean/estimate "{\"inputs\":{\"surfaces\":[$ALL]},\"nonsense\":1}"
is_problem 422 invalid-input 'the body is that of an execution'

execute mean "{\"surfaces\":[$ALL],\"lmax\":8,\"register\":false}"
is "$STATUS" 200 'and what was estimated runs'

"$SRNFD" token add --data "$SCRATCH/data" --name eve --role viewer >"$SCRATCH/eye" 2>/dev/null
post_json /v1/processes/mean/estimate "{\"inputs\":{\"surfaces\":[$ALL]}}" --header "Authorization: Bearer $(cat "$SCRATCH/eye")"
is "$STATUS $(json .code)" '404 no-such-mesh' 'a viewer may ask, of what is its own'

stop_server
is $? 0 'the daemon ends well'
done_testing

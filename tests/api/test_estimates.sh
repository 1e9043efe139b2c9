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

# A pca has no more in use than was told: with all its components, of many members of few numbers each, and with each
# subject measured twice, where every worker leaves out another one.
start_server "$SCRATCH/many" --workers 8 || exit 1
/usr/bin/python3 - "$URL" 150 >"$SCRATCH/members" <<'PYTHON' || not_ok 'surfaces are sent'
import json, random, sys, urllib.request
random.seed(1)
members = []
for number in range(int(sys.argv[2])):
    coefficients = {"lmax": 4}
    for axis, place in ("x", 3), ("y", 1), ("z", 2):
        coefficients[axis] = [random.gauss(0, 0.002) for _ in range(25)]
        coefficients[axis][place] += 1.3 if axis == "x" else 1
    request = urllib.request.Request(sys.argv[1] + "/v1/surfaces", json.dumps({"coefficients": coefficients}).encode(),
                                     {"Content-Type": "application/json"})
    surface = json.load(urllib.request.urlopen(request))["id"]
    members.append({"id": surface, "subject": f"s{number // 2}"})
print(json.dumps(members))
PYTHON
# The most that a pca of the cohort has in use at once.
BEFORE=0
measure() { # COHORT
    local all
    execute pca "{\"cohort\":\"$1\",\"register\":false}" --header 'Prefer: wait=60'
    is "$STATUS" 200 "a pca of cohort $1"
    get /metrics
    all=$(awk '$1 == "srnfd_job_memory_bytes_sum{process=\"pca\"}" { print $2 }' "$BODY")
    PEAK=$((all - BEFORE)) BEFORE=$all
}
cohort_of() { # NAME JQ
    post_json /v1/cohorts "$(jq -c "{name: \"$1\", members: ($2)}" "$SCRATCH/members")"
}
cohort_of first '.[:3]'
measure first # from now on the transform is there
cohort_of few '.[3:6]'
measure few
ALWAYS=$PEAK # of that, what does not grow with the group
cohort_of once 'map(del(.subject))'
cohort_of twice .
for measured in once twice; do
    estimate pca "{\"cohort\":\"$measured\",\"register\":false}"
    BYTES=$(json .estimatedBytes)
    measure $measured
    compare $((PEAK - ALWAYS)) '<=' "$BYTES" 'has no more in use than was told'
done
stop_server
is $? 0 'the daemon ends well'
done_testing

#!/usr/bin/env bash
# srnfd-test: plain-core (core/stats/test_stats_allocation.c and test_standard.sh run its numerics)
# srnfd-test: timeout 300
#
# test_neighbours.sh - neighbours over HTTP: those that the matrix of distances has, as JSON, CSV and .npy; what is wrong
# with inputs. core/stats/test_neighbours.c has what is pruned.
# srnfd-test: once (core/stats/test_neighbours.c has the figures in the release build)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 2 || exit 1
members=()
for name in L_thalamus R_thalamus L_pallidum R_pallidum; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":4}"
    members+=("$(json .surface.id)")
done
post_json /v1/cohorts "$(printf '%s\n' "${members[@]}" |
    jq -Rnc '{name: "nuclei", members: [inputs as $id | {id: $id, subject: "s\($id[5:9])"}]}')"
is "$STATUS" 201 'a cohort of four'

execute distances '{"cohort":"nuclei","handedness":"ignore"}' --header 'Prefer: wait=120'
is "$STATUS" 200 'all distances'
jq -c '.matrix as $m | [range(4) as $i | [range(4) | select(. != $i)] | sort_by($m[$i][.]) | .[:2]] as $near |
    [$near, [range(4) as $i | $near[$i] | map($m[$i][.])]]' "$BODY" >"$SCRATCH/wanted.json"
execute neighbours '{"cohort":"nuclei","k":2}' --header 'Prefer: wait=120'
is "$STATUS" 200 'two neighbours of each'
check 'are those of all distances, to the bit' cmp "$SCRATCH/wanted.json" <(jq -c '[.indices, .distances]' "$BODY")
is "$(json '.pairs.all')" 6 'there are six pairs'
compare "$(json '.pairs.registered')" '<=' 6 'of which no more are registered'
is "$(json '.pairs | .share == (.all - .registered) / .all')" true 'and the share of the others is told'
get "/v1/jobs?process=neighbours"
JOB=$(json ".jobs[0].id")
get "/v1/jobs/$JOB/results?format=csv"
is "$(wc -l <"$BODY")" 9 'CSV has a line for each member and neighbour'
is "$(head -n 1 "$BODY" | tr -d '\r')" 'label,subject,id,rank,neighbour,distance' 'with their names'
get "/v1/jobs/$JOB/results?format=npy"
is "$(head -c 128 "$BODY" | grep -ac "(4, 2)")" 1 '.npy has the distances'

execute neighbours '{"cohort":"nuclei"}' --header 'Prefer: wait=120'
is "$(json '.indices[0] | length')" 3 'of four, each has three others at most'
execute neighbours '{"cohort":"nuclei","k":0}'
is "$STATUS $(json .code)" '422 invalid-input' 'k is at least one'
execute neighbours '{"cohort":"nuclei","k":4}'
is "$STATUS $(json '.errors | map("\(.pointer) \(.detail)") | tojson')" '422 ["/inputs/k is 4; each member has 3 others"]' \
    'and no more than there are others'
get /v1/processes/neighbours
is "$(json '.inputs.k.schema.maximum')" 100 'nor more than its schema has'
execute neighbours '{"cohort":"nuclei","k":101}'
is "$STATUS $(json '.errors[0].detail')" '422 is 101; it must be from 1 to 100' 'which is what a larger one is told'
execute neighbours '{"cohort":"nuclei","k":3}' --header 'Prefer: wait=120'
is "$STATUS $(json '.indices[0] | length')" '200 3' 'all of them may be asked for'
for limit in 'distances 1000' 'neighbours 4000'; do
    execute "${limit% *}" "{\"surfaces\":[\"${members[0]}\"]}"
    is "$STATUS $(json '.errors[0].detail')" "422 has 1 surface; it must have from 2 to ${limit#* }" "${limit% *}: its own limit"
    get "/v1/processes/${limit% *}"
    is "$(json '.inputs.surfaces.schema.maxItems')" "${limit#* }" 'as its schema has it'
done
stop_server || not_ok 'the server ends well'

start_server "$SCRATCH/data" --workers 1 --job-memory 50000 || exit 1
execute neighbours '{"cohort":"nuclei","k":1,"lmax":4}'
is "$STATUS $(json '.errors | map(.pointer) | tojson')" '422 ["/inputs"]' 'what does not fit is refused at once'
like "$(json '.errors[0].detail')" '^4 surfaces of degree 4 need about .* a job may have .*job-memory' 'and why is told'
stop_server || not_ok 'the server with little memory ends well'
done_testing

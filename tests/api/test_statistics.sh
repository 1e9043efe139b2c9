#!/usr/bin/env bash
# srnfd-test: timeout 900
#
# test_statistics.sh - registration, distances, mean, principal components, modes, samples and projection end to
# end, on small surfaces of brain structures; the same numbers with any number of workers; and a mean that goes on
# after kill -9 from where it was (other processes: test_checkpoints.sh).
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
REQUEST_SECONDS=400
NAMES='L_pallidum R_pallidum L_thalamus R_thalamus'

# Uploads and encodes the structures, and names the cohort of their surfaces. Sets S.
S=()
prepare() {
    local name members=
    S=()
    for name in $NAMES; do
        post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX,\"parameterization\":\"star\"}"
        S+=("$(json .surface.id)")
        members="$members,{\"id\":\"$(json .surface.id)\"}"
    done
    post_json /v1/cohorts "{\"name\":\"nuclei\",\"members\":[${members#,}]}"
}

# Largest absolute value of a jq expression over the last body.
largest() { # EXPRESSION
    json "[$1] | map(fabs) | max"
}

# Runs a process to its end, however long it takes.
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

start_server "$SCRATCH/data" --workers 2 || exit 1
prepare
is "$STATUS" 201 'a cohort of surfaces'

# ---- register ----------------------------------------------------------------------------------------

run register "{\"template\":\"${S[0]}\",\"moving\":\"${S[1]}\",\"start\":\"rigid\",\"degree\":4}"
is "$STATUS" 200 'two pallida are registered'
compare "$(json .distance)" '<' "$(json '.distanceBefore / 2')" 'which brings them nearer to each other'
compare "$(json .minJacobian)" '>' 0.05 'without folding the sphere'
compare "$(largest '.rotation as $r | range(3) as $i | range(3) as $j |
    ([range(3) | $r[$i][.] * $r[$j][.]] | add) - (if $i == $j then 1 else 0 end)')" '<' 1e-12 'the rotation is one'
compare "$(largest '.warp.grid.points[][] | (map(. * .) | add) - 1')" '<' 1e-12 'the warp stays on the sphere'
is "$(json '[.registration.degree, .registration.penalty.jacobian, (.warp.links | length > 0)] | tojson')" \
    '[4,0.003,true]' 'its options and its links are told'
is "$(json '"\(.surface.parameterization) \(.surface.source.reference)"')" "registered ${S[0]}" \
    'the registered surface is kept, and knows its template'
run register "{\"template\":\"${S[0]}\",\"moving\":\"${S[0]}\",\"start\":\"rigid\",\"degree\":4}"
compare "$(json .distance)" '<' 1e-6 'a surface lies on itself'
run geodesic "{\"from\":\"${S[0]}\",\"to\":\"${S[1]}\",\"steps\":3}"
is "$STATUS $(json '.surfaces[2].parameterization')" '200 registered' 'a geodesic registers its end by default'
compare "$(json .distance)" '<' "$(json .registration.distanceBefore)" 'and is shorter for it'

# ---- distances ---------------------------------------------------------------------------------------

run distances '{"cohort":"nuclei","register":false}'
is "$(json '.matrix | length')" 4 'distances between four surfaces'
compare "$(largest '.matrix as $m | range(4) as $i | $m[$i][$i], (range(4) as $j | $m[$i][$j] - $m[$j][$i])')" \
    '==' 0 'are symmetric, with a diagonal of 0'
is "$(json '.matrix as $m | [range(4) as $i | range(4) as $j | range(4) as $k |
    ($m[$i][$k] | real) <= ($m[$i][$j] + $m[$j][$k]) * (1 + 1e-12)] | all')" true 'and a metric'
is "$(json '.labels | join(" ")')" "$NAMES" 'under the names of the surfaces'
is "$(json .registration)" null 'and say that nothing was registered'
MATRIX=$(json '.matrix | tojson')

# ---- mean --------------------------------------------------------------------------------------------

run mean "{\"surfaces\":[\"${S[0]}\",\"${S[2]}\"],\"register\":false}"
is "$STATUS $(json '"\(.iterations) \(.converged)"')" '200 1 true' 'the mean of two surfaces as they are'
compare "$(json ".distances[0] / ($MATRIX | .[0][2]) - 0.5 | fabs")" '<' 1e-12 'is half way between them'
MIDDLE=$(json .surface.id)
RELATIVE=$(json .relativeEnergy)
execute geodesic "{\"from\":\"${S[0]}\",\"to\":\"${S[2]}\",\"steps\":3,\"register\":false}"
compare "$(json ".relativeEnergies.geodesic[1] - $RELATIVE | fabs")" '<' 1e-6 'as far from a surface as that of their geodesic'
get "/v1/surfaces/$MIDDLE"
compare "$(largest '.centroid[]')" '<' 1e-9 'its surface is centred'

# Three neighbours on a path, which differ by little.
execute geodesic "{\"from\":\"${S[0]}\",\"to\":\"${S[2]}\",\"steps\":9,\"register\":false}"
NEAR=$(json '.surfaces[:3] | map(.id) | tojson')
run mean "{\"surfaces\":$NEAR,\"register\":false}"
PLAIN=$(json '.history[-1].variance')
run mean "{\"surfaces\":$NEAR,\"commonPose\":true}"
is "$STATUS" 200 'a registered mean in a common pose'
note "$(json '"converged: \(.converged), changes: \(.history | map(.change * 1e4 | round / 1e4) | tojson)"')"
compare "$(json '.history[-1].variance')" '<' "$PLAIN" 'lowers the variance'
is "$(json '.registration | [.commonPose, .rotation, .start] | tojson')" '[true,false,"identity"]' 'without turning anything'
# The history is measured on the finer grid that the warps are searched on; the distances are those of the result.
compare "$(json '([.distances[] | . * .] | add / 3) / .history[-1].variance - 1 | fabs')" '<' 0.01 \
    'its variance is the mean of the squared distances, but for the quadrature of the coarser grid'

# ---- pca ---------------------------------------------------------------------------------------------

run pca '{"cohort":"nuclei","register":false}'
is "$STATUS" 200 'principal components of the surfaces as they are'
cp "$BODY" "$SCRATCH/pca.json"
MODEL=$(json .model.id)
like "$MODEL" '^model-[0-9a-f]{32}$' 'are a model with a content address'
is "$(json .model.components)" 3 'of one component less than surfaces'
is "$(json '.model.eigenvalues | . == (sort | reverse)')" true 'in decreasing order'
compare "$(json '.model.cumulative[-1] - 1 | fabs')" '<' 1e-9 'that explain all variance'
compare "$(largest '.model as $m | range(3) as $k |
    ([$m.scores[][$k] | . * .] | add) / 3 / $m.eigenvalues[$k] - 1')" '<' 1e-9 'the variances of the scores are the eigenvalues'
compare "$(largest '.model as $m | [$m.scores[][0]] | add')" '<' 1e-9 'which have mean 0'
is "$(json '.compactness | [.[0].components, .[2].components] | tojson')" '[1,3]' 'compactness goes along'
execute pca '{"cohort":"nuclei","register":false,"components":1}'
isnt "$(json .model.id)" "$MODEL" 'fewer components are another model'
is "$(json .model.components)" 1 'of as many as asked for'
ONE=$(jq -r '.inputs.surfaces[0]' "$SCRATCH/pca.json")
for PROCESS in pca evaluate-model; do
    execute "$PROCESS" "{\"surfaces\":[\"$ONE\",\"$ONE\",\"$ONE\"],\"register\":false}"
    is_problem 422 numerical-failure "$PROCESS: one surface three times has no components"
    like "$(json .detail)" 'surfaces do not differ' 'and that is said'
done

get "/v1/models/$MODEL"
is "$STATUS $(jq -S .model "$SCRATCH/pca.json" | sha256sum)" "200 $(jq -S . "$BODY" | sha256sum)" 'the model is read back'
is "$(json .madeFrom.cohort)" nuclei 'and says what it was made from'
get "/v1/models/$MODEL/scores?format=csv"
is "$(head -n 1 "$BODY" | tr -d '\r') $(wc -l <"$BODY")" 'label,subject,id,component 1,component 2,component 3 5' 'scores come as CSV'
is "$(tail -n +2 "$BODY" | cut -d, -f3 | grep -c '^\(surf\|mesh\)-')" 4 'with the ids of the members'
get "/v1/models/$MODEL/scores" --header 'Accept: application/x-npy'
is "$(wc -c <"$BODY")" $((128 + 4 * 3 * 8)) 'and as .npy'
get "/v1/models/$MODEL/modes"
compare "$(largest '.weights as $w | .modes as $m | range(3) as $a | range(3) as $b |
    ([$m[$a], $m[$b], $w] | transpose | map(.[2] as $v | [.[0], .[1]] | transpose |
        map([.[0], .[1]] | transpose | map(.[0] * .[1]) | add) | add * $v) | add) -
    (if $a == $b then 1 else 0 end)')" '<' 1e-9 'the modes are orthonormal'
get "/v1/models/$MODEL/modes?format=npy"
like "$(head -c 128 "$BODY" | tr -d '\0')" "'shape': \(3, 8, 16, 3\)" 'and come as .npy'
get "/v1/models/$MODEL/modes?format=csv"
is "$(wc -l <"$BODY")" $((1 + 3 * 8 * 16)) 'and as CSV'
get '/v1/models?limit=10'
is "$(json '.items | length') $(json '.items[0] | has("scores")')" '2 false' 'models are listed'
get /v1/models/model-00000000000000000000000000000000
is_problem 404 no-such-model 'what is no model is not found'

# ---- modes, sample, project --------------------------------------------------------------------------

execute modes "{\"model\":\"$MODEL\",\"mode\":1,\"coefficients\":[3,-3,0,1.5]}"
is "$STATUS $(json '[.coefficients, (.surfaces | length), (.relativeEnergy | length)] | tojson')" \
    '200 [[3,-3,0,1.5],4,4]' 'surfaces along the first mode'
compare "$(json ".relativeEnergy[2] / $(jq .relativeEnergy "$SCRATCH/pca.json") - 1 | fabs")" '<' 1e-3 \
    'at 0 it is the mean'
compare "$(json '.relativeEnergy[0]')" '>' "$(json '.relativeEnergy[2]')" 'far out, a shape that exists less is told by its energy'
is "$(json '.surfaces[0].source.reference')" "$(jq -r .model.mean.id "$SCRATCH/pca.json")" 'deformation is measured from the mean'
get "/v1/surfaces/$(json '.surfaces[0].id')/mesh?format=ply&resolution=4"
like "$(head -c 600 "$BODY" | tr -d '\0')" deformation 'and rides along in the mesh'

execute sample "{\"model\":\"$MODEL\",\"count\":3,\"seed\":5}"
is "$STATUS $(json '[(.surfaces | length), (.scores | length), (.scores[0] | length)] | tojson')" '200 [3,3,3]' 'samples'
SCORES=$(json '.scores | tojson')
execute sample "{\"model\":\"$MODEL\",\"count\":2,\"seed\":5,\"components\":2}"
is "$(json '.scores[0][2]')" 0 'of some components'
execute sample "{\"model\":\"$MODEL\",\"count\":3,\"seed\":6}"
isnt "$(json '.scores | tojson')" "$SCORES" 'another seed, other samples'

for i in 0 3; do
    execute project "{\"model\":\"$MODEL\",\"surface\":\"${S[$i]}\"}"
    compare "$(largest "[.scores, ($(jq -c .model.scores "$SCRATCH/pca.json") | .[$i])] | transpose[] | .[0] - .[1]")" \
        '<' 1e-9 'a surface that the model was made from has its own scores'
    compare "$(json .residual)" '<' 1e-6 'and nothing is left of it'
done
execute project "{\"model\":\"$MODEL\",\"surface\":\"$MIDDLE\"}"
compare "$(json '(.distance * .distance) / (([.scores[] | . * .] | add) + .residual * .residual) - 1 | fabs')" '<' 1e-6 \
    'of another, distance, scores and residual make a right angle'
stop_server || not_ok 'the server ends well'

# ---- Any number of workers ---------------------------------------------------------------------------

# What must not depend on the workers: all but times and the ids of jobs.
essence() {
    jq -S 'walk(if type == "object" then del(.seconds, .job, .created) else . end)' "$BODY"
}
WORKERS='1 2 8'
if [ -n "$SRNFD_SANITIZED" ]; then
    WORKERS='1 8' # each start computes everything anew, and a sanitizer makes it slow
fi
for workers in $WORKERS; do
    start_server "$SCRATCH/data-$workers" --workers "$workers" || exit 1
    prepare
    run pca '{"cohort":"nuclei","commonPose":true,"maxIterations":3}'
    is "$STATUS" 200 "registered components with $workers workers"
    essence >"$SCRATCH/pca-$workers.json"
    run modes "{\"model\":\"$(json .model.id)\"}"
    essence >"$SCRATCH/modes-$workers.json"
    run distances "{\"surfaces\":[\"${S[0]}\",\"${S[1]}\",\"${S[2]}\"],\"register\":false}"
    essence >"$SCRATCH/distances-$workers.json"
    stop_server || not_ok 'the server ends well'
done
for what in pca modes distances; do
    for workers in $WORKERS; do
        check "$what: the same numbers with 1 worker and $workers" cmp "$SCRATCH/$what-1.json" "$SCRATCH/$what-$workers.json"
    done
done

# ---- kill -9 -----------------------------------------------------------------------------------------

LONG='{"cohort":"nuclei","commonPose":true,"tolerance":1e-8,"maxIterations":8}'
logged() { # EVENT: how often, without checkpoints of parts of an iteration
    jq -Rr --arg event "$1" 'fromjson? | objects | select(.event == $event) | .detail' "$SERVER_LOG" | grep -vc parts
}
start_server "$SCRATCH/whole" --workers 2 || exit 1
prepare
run mean "$LONG"
is "$STATUS" 200 'a mean that is left in peace'
essence >"$SCRATCH/whole.json"
ITERATIONS=$(json .iterations)
compare "$ITERATIONS" '>' 3 'takes more than three iterations'
is "$(logged job-checkpoint)" "$ITERATIONS" 'each of which leaves a checkpoint'
stop_server || not_ok 'the server ends well'

start_server "$SCRATCH/cut" --workers 2 || exit 1
prepare
execute mean "$LONG" --header 'Prefer: respond-async'
JOB=$(json .id)
for _ in $(seq 6000); do
    [ "$(logged job-checkpoint)" -ge 3 ] && break
    sleep 0.02
done
kill_server
DONE=$(logged job-checkpoint)
start_server "$SCRATCH/cut" --workers 2 || exit 1
poll_job "$JOB" 400
is "$JOB_STATUS $(json .attempt)" 'successful 2' 'a mean that was killed after its third iteration ends well'
is "$(logged job-resumed)" 1 'it goes on from its checkpoint'
compare "$(logged job-checkpoint)" '<=' $((ITERATIONS - 3)) 'without doing the first iterations again'
note "$DONE of $ITERATIONS iterations before the kill, $(logged job-checkpoint) after it"
get "/v1/jobs/$JOB/results"
essence >"$SCRATCH/cut.json"
check 'and gives the same numbers' cmp "$SCRATCH/whole.json" "$SCRATCH/cut.json"

if command -v sqlite3 >/dev/null; then
    is "$(sqlite3 "$SCRATCH/cut/srnfd.db" 'SELECT count(*) FROM checkpoint')" 0 'the checkpoint is gone'
fi
stop_server || not_ok 'the server ends well'
done_testing

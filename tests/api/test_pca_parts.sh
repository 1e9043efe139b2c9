#!/usr/bin/env bash
# test_pca_parts.sh - joint components of several structures: one part is pca, scores and shares fit together, weights
# scale as stated, positions count where they are asked for, and incomplete cohorts are told by name.
# srnfd-test: slow
# srnfd-test: no-asan (api/test_model_parts.sh and api/test_standard.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400

# Runs a process to its end, however long it takes.
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

start_server "$SCRATCH/data" --workers 2 || exit 1
declare -A SURFACE
for side in L R; do
    for name in thalamus putamen caudate; do
        post "/v1/meshes?name=${side}_$name" --data-binary "@tests/data/aal_subcortex/${side}_$name.ply"
        run encode "{\"mesh\":\"$(json .id)\",\"lmax\":4,\"mirror\":$([ $side = R ] && echo true || echo false)}"
        SURFACE[${side}_$name]=$(json .surface.id)
    done
done
# Two more subjects: halfway between the two, and smoothed.
for name in thalamus putamen; do
    run geodesic "{\"from\":\"${SURFACE[L_$name]}\",\"to\":\"${SURFACE[R_$name]}\",\"steps\":4}"
    SURFACE[a_$name]=$(json '.surfaces[1].id')
    SURFACE[b_$name]=$(json '.surfaces[2].id')
done

member() { # SURFACE SUBJECT PART
    printf '{"id":"%s","subject":"%s","label":"%s","covariates":{"part":"%s"}}' "${SURFACE[$1]}" "$2" "${2:0:1}" "$3"
}

cohort() { # NAME MEMBER..
    post_json /v1/cohorts "{\"name\":\"$1\",\"members\":[$(IFS=,; echo "${*:2}")]}"
}

PAIRS=()
for subject in L R a b; do
    for name in thalamus putamen; do
        PAIRS+=("$(member "${subject}_$name" "$subject" "$name")")
    done
done
cohort both "${PAIRS[3]}" "${PAIRS[0]}" "${PAIRS[2]}" "${PAIRS[1]}" "${PAIRS[@]:4}" # in any order
cohort one "${PAIRS[2]}" "${PAIRS[0]}" "${PAIRS[4]}" "${PAIRS[6]}"

# ---- One part ------------------------------------------------------------------------------------------

run pca '{"cohort":"one","register":false}'
cp "$BODY" "$SCRATCH/pca.json"
run pca-parts '{"cohort":"one","register":false}'
is "$STATUS" 200 'one part'
is "$(jq -s '.[0].model.eigenvalues == .[1].eigenvalues' "$SCRATCH/pca.json" "$BODY")" true \
    'has the eigenvalues of pca, to the last bit'
is "$(jq -s '.[0].model.scores == .[1].scores' "$SCRATCH/pca.json" "$BODY")" true 'and its scores'
is "$(json '.shares | map(.[0] > 0.999999) | all')" true 'all of it is that part'
is "$(json .positions)" null 'without positions'

# ---- Two parts -----------------------------------------------------------------------------------------

run pca-parts '{"cohort":"both","modes":2}'
is "$STATUS" 200 'two parts, registered'
cp "$BODY" "$SCRATCH/both.json"
is "$(json '[.parts[].name] | tostring')" '["putamen","thalamus"]' 'in the order of the cohort'
is "$(json '.subjects | tostring')" '["R","L","a","b"]' 'with its subjects'
is "$(json '.groups | tostring')" '["R","L","a","b"]' 'and their labels'
is "$(json '[.scores | length, (.[0] | length)] | tostring')" '[4,3]' 'have scores'
compare "$(json '[.shares[] | add - 1 | fabs] | max')" '<=' 1e-9 'shares of each component are 1 together'
compare "$(json '([.parts[].variance] | add) / .totalVariance - 1 | fabs')" '<=' 1e-9 'and variances the total'
compare "$(json '(.cumulative | last) - 1 | fabs')" '<=' 1e-9 'all of which is explained'
is "$(json '.modes | length')" 8 'two components, two parts, either way'
is "$(json '[.modes[] | select(.component == 2 and .part == "thalamus") | .deviations] | tostring')" '[-2,2]' \
    'two deviations out'
MEAN=$(json '.parts[0].mean.id')
is "$(json '.modes[0].surface.source.reference')" "$MEAN" 'from the mean of the part'
get "/v1/surfaces/$(json '.modes[0].surface.id')/mesh?format=ply"
is "$STATUS" 200 'whose surfaces have meshes'
cp "$SCRATCH/both.json" "$BODY"
isnt "$(json .registration)" null 'and it is told how they were registered'
if [ -z "$SRNFD_SANITIZED" ]; then # figures of what runs again below
    run pca-parts '{"cohort":"both","weights":{"putamen":4,"thalamus":4},"modes":0}'
    compare "$(jq -s '.[1].eigenvalues[0] / .[0].eigenvalues[0] - 4 | fabs' "$SCRATCH/both.json" "$BODY")" '<=' 1e-9 \
        'four times the weights are four times the variance'
    compare "$(jq -s '.[1].scores[0][0] / .[0].scores[0][0] - 2 | fabs' "$SCRATCH/both.json" "$BODY")" '<=' 1e-9 \
        'and twice the scores'
fi
run pca-parts '{"cohort":"both","weights":{"putamen":0.000001},"modes":0,"components":1}'
compare "$(json '.shares[0][0]')" '<=' 1e-3 'a part that weighs nothing has no share'

# ---- Where they are ------------------------------------------------------------------------------------

cohort sided "$(member L_thalamus l thalamus)" "$(member L_putamen l putamen)" "$(member L_caudate l caudate)" \
    "$(member R_thalamus r thalamus)" "$(member R_putamen r putamen)" "$(member R_caudate r caudate)"
run pca-parts '{"cohort":"sided","commonPose":true,"relativePose":true,"poseWeight":2}'
is "$STATUS" 200 'with relative pose'
compare "$(json '.positions.share + ([.parts[].share] | add) - 1 | fabs')" '<=' 1e-9 'positions have their share'
compare "$(json '.positions.share')" '>' 0 'of the variance'
compare "$(json '[.positions.mean | transpose[] | add | fabs] | max')" '<=' 1e-9 'about the middle of the parts'
is "$(json '.shares[0] | length')" 4 'and in the components'
run pca-parts '{"cohort":"sided","register":false,"modes":0,"relativePose":true}'
cp "$BODY" "$SCRATCH/sided.json"
for name in thalamus putamen caudate; do
    for side in L R; do
        get "/v1/surfaces/${SURFACE[${side}_$name]}"
        run encode "{\"mesh\":\"$(json .source.mesh)\",\"lmax\":4,\"scale\":\"none\",\"mirror\":$(json '.mirrored // false')}"
        SURFACE[${side}_${name}_mm]=$(json .surface.id)
    done
done
cohort unscaled "$(member L_thalamus_mm l thalamus)" "$(member L_putamen_mm l putamen)" "$(member L_caudate_mm l caudate)" \
    "$(member R_thalamus_mm r thalamus)" "$(member R_putamen_mm r putamen)" "$(member R_caudate_mm r caudate)"
run pca-parts '{"cohort":"unscaled","register":false,"modes":0,"relativePose":true}'
compare "$(jq -s '[.[].positions.mean | flatten] | transpose | map(.[0] - .[1] | fabs) | max' "$SCRATCH/sided.json" "$BODY")" \
    '<=' 1e-9 'positions are the same for surfaces that keep their units'
compare "$(jq -s '(.[0].positions.variance / .[1].positions.variance) - 1 | fabs' "$SCRATCH/sided.json" "$BODY")" '<=' 1e-9 \
    'and so is their variance'

# The right sides are encoded as they are, and taken mirrored by the cohort: as surfaces, and as meshes.
mirrored() { # SURFACE SUBJECT PART: as it is, of the right side mirrored
    printf '{"id":"%s","subject":"%s","mirror":%s,"covariates":{"part":"%s"}}' "$1" "$2" "$([ "$2" = r ] && echo true || echo false)" "$3"
}
AS_MESHES=() AS_SURFACES=()
for side in L R; do
    for name in thalamus putamen; do
        get "/v1/surfaces/${SURFACE[${side}_$name]}"
        MESH=$(json .source.mesh)
        run encode "{\"mesh\":\"$MESH\",\"lmax\":4}"
        AS_MESHES+=("$(mirrored "$MESH" "${side,}" "$name")")
        AS_SURFACES+=("$(mirrored "$(json .surface.id)" "${side,}" "$name")")
    done
done
cohort meshes "${AS_MESHES[@]}"
cohort surfaces "${AS_SURFACES[@]}"
run pca-parts '{"cohort":"meshes","lmax":4,"register":false,"modes":0,"relativePose":true}'
cp "$BODY" "$SCRATCH/meshes.json"
run pca-parts '{"cohort":"surfaces","register":false,"modes":0,"relativePose":true}'
is "$STATUS" 200 'members that are taken mirrored'
compare "$(jq -s '[.[].positions.mean | flatten] | transpose | map(.[0] - .[1] | fabs) | max' "$SCRATCH/meshes.json" "$BODY")" \
    '<=' 0.005 'have the places of their mirror images, but for where the encodings have their centroids'
compare "$(jq -s '(.[0].positions.variance / .[1].positions.variance) - 1 | fabs' "$SCRATCH/meshes.json" "$BODY")" '<=' 0.1 \
    'as meshes that are taken mirrored have'
compare "$(json '.positions.variance')" '<' 0.001 'and both sides are alike, which are mirror images'

# ---- Doubts of a part ----------------------------------------------------------------------------------

# An ellipsoid with axes 3, 2 and 1 + STRETCH, its sphere as it is (SIGNS 1,1,1), or turned by half a circle under it. The
# mean of the three turns has normals that no surface has.
ellipsoid() { # NAME STRETCH SIGNS
    post /v1/surfaces -H 'Content-Type: application/json' \
        --data "$(jq -nc --argjson s "0$2" --argjson sign "[$3]" 'def only(k; v): [range(25) | if . == k then v else 0 end];
            {coefficients: {lmax: 4, x: only(3; 3 * $sign[0]), y: only(1; 2 * $sign[1]), z: only(2; (1 + $s) * $sign[2])}}')"
    SURFACE[$1]=$(json .id)
}

# Of each part, the codes that are told of it.
told() {
    json '[.warnings[] | select(.figures.part) | "\(.figures.part) \(.code)"] | unique | join(", ")'
}

STRANGE=()
TURNS=("1,-1,-1" "-1,1,-1" "-1,-1,1")
STRETCH=(8 3 4 1 5 9 6 7 2) # by 15 for each of the turns
for i in 0 1 2 3 4 5 6 7 8; do
    ellipsoid "even$i" ".${STRETCH[i]}" 1,1,1
    ellipsoid "odd$i" ".0$i" "${TURNS[i % 3]}"
    STRANGE+=("$(member "even$i" "s$i" even)" "$(member "odd$i" "s$i" odd)")
done
cohort strange "${STRANGE[@]}"
run pca-parts '{"cohort":"strange","register":false,"weights":{"even":1000000}}'
is "$STATUS" 200 'a part whose members do not correspond'
cp "$BODY" "$SCRATCH/strange.json"
is "$(told)" 'odd not-reached, odd pose-differs' 'is told of by its name, and the other part is not'
is "$(json '[.warnings[] | select(.figures.part == "odd") | .detail | startswith("Part odd")] | all')" true \
    'in words as well'
is "$(json '[.warnings[] | select(.code == "not-reached" and .figures.what == "modes") | .figures.of] | tostring')" '[2]' \
    'modes that no surface has among them'
like "$(json '[.warnings[] | select(.code == "pose-differs")][-1].detail')" 'lies as .* does, but their maps to the sphere are turned' \
    'surfaces that share a pose are told from others'
is "$(json '[.warnings[] | select(.code == "pose-differs")][-1].figures.members | map(.sphereAlone) | unique | tostring')" \
    '[true]' 'each of them'
run pca-parts '{"cohort":"strange","register":false,"weights":{"even":1000000},"relativePose":true}'
like "$(json '[.warnings[] | select(.code == "pose-differs")][-1].detail')" 'cannot undo that: leave out relativePose, .*commonPose false' \
    'what relativePose refuses is not advised beside it'
run register "{\"template\":\"${SURFACE[even3]}\",\"moving\":\"${SURFACE[odd0]}\",\"commonPose\":true}"
is "$(json '[.warnings[] | select(.code == "pose-differs") | .figures.sphereAlone] | tostring')" '[true]' \
    'so is a pair in a common pose'
TURNED=$(json '.warnings[] | select(.code == "pose-differs") | .figures.turned')
compare "$(json '.warnings[] | select(.code == "pose-differs") | .figures | .distance / .turned')" '>' 2 'with both distances'
run register "{\"template\":\"${SURFACE[even3]}\",\"moving\":\"${SURFACE[odd0]}\",\"rotation\":false}"
compare "$(json .distance)" '<=' "$TURNED" 'and a search that turns the sphere alone undoes it'
is "$(json '.rotation | tostring')" '[[1,0,0],[0,1,0],[0,0,1]]' 'without turning the surface'
run register "{\"template\":\"${SURFACE[even0]}\",\"moving\":\"${SURFACE[even1]}\",\"commonPose\":true}"
is "$(json '[.warnings[].code] | index("pose-differs")')" null 'a pair that does share one is not warned of'
run pca-parts '{"cohort":"both","maxIterations":2,"tolerance":1e-8,"modes":0}'
is "$(told)" 'putamen mean-not-converged, thalamus mean-not-converged' 'means that had not come to rest'
is "$(json '[.warnings[] | select(.code == "mean-not-converged") | .figures.iterations] | tostring')" '[2,2]' \
    'after so many iterations'
is "$(json '.parts[0].converged')" false 'as the result says'
run pca-parts '{"cohort":"both","maxIterations":2,"tolerance":1e-8,"modes":0,"commonPose":true,"relativePose":true}'
is "$(json '[.warnings[] | select(.code == "mean-not-converged") | .detail | contains("or leave out relativePose")] | tostring')" \
    '[true,true]' 'and with relativePose what can be done'
if [ -z "$SRNFD_SANITIZED" ]; then # by the same lines
    run pca-parts '{"cohort":"both","maxIterations":1,"tolerance":1e-8,"modes":0}'
    is "$(told)" '' 'one iteration is what was asked for'
    run mean '{"cohort":"one","maxIterations":2,"tolerance":1e-8}'
    is "$(json '[.warnings[] | select(.code == "mean-not-converged") | .figures.iterations] | tostring')" '[2]' \
        'a mean says so too'
    compare "$(json '.warnings[] | select(.code == "mean-not-converged") | .figures.change')" '>' 1e-8 'and how far it still moved'
fi

# The putamen of both subjects in centimetres: their positions are in other units than those of the thalamus.
UNITS=()
for side in L R; do
    for name in thalamus putamen; do
        run encode "{\"mesh\":\"$(curl -s "$URL/v1/surfaces/${SURFACE[${side}_$name]}" | jq -r .source.mesh)\",\"lmax\":4,\"scale\":\"none\"}"
        curl -s "$URL/v1/surfaces/$(json .surface.id)/mesh?format=obj&resolution=12" |
            awk -v by="$([ $name = putamen ] && echo 10 || echo 1)" '/^v / {printf "v %.9g %.9g %.9g\n", $2 / by, $3 / by, $4 / by; next} /^f/' >"$SCRATCH/unit.obj"
        post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/unit.obj"
        run encode "{\"mesh\":\"$(json .id)\",\"lmax\":4}"
        SURFACE[unit_${side}_$name]=$(json .surface.id)
        UNITS+=("$(member "unit_${side}_$name" "$side" "$name")")
    done
done
cohort units "${UNITS[@]}"
run pca-parts '{"cohort":"units","register":false,"relativePose":true,"modes":0,"mixedRoutes":true}'
is "$STATUS $(json '[.warnings[] | select(.code == "mixed-units") | .figures | [.smallest, .largest]] | tojson')" \
    '200 [["putamen","thalamus"]]' 'a part in another unit is told of, where positions count'
run pca-parts '{"cohort":"units","register":false,"modes":0,"mixedRoutes":true}'
is "$STATUS $(json '[.warnings[] | select(.code == "mixed-units")] | length')" '200 0' 'and not where they do not'

# ---- Routes --------------------------------------------------------------------------------------------

for side in L R; do
    get "/v1/surfaces/${SURFACE[${side}_thalamus]}"
    run encode "{\"mesh\":\"$(json .source.mesh)\",\"lmax\":4,\"parameterization\":\"star\",\"mirror\":$(json '.mirrored // false')}"
    SURFACE[${side}_star]=$(json .surface.id)
done
cohort routes "$(member L_star l thalamus)" "$(member R_star r thalamus)" \
    "$(member L_putamen l putamen)" "$(member R_putamen r putamen)"
run pca-parts '{"cohort":"routes","register":false,"modes":0}'
is "$STATUS" 200 'parts may have come by different routes, since they are not compared'
cohort routes2 "$(member L_star l thalamus)" "$(member R_thalamus r thalamus)" \
    "$(member L_putamen l putamen)" "$(member R_putamen r putamen)"
run pca-parts '{"cohort":"routes2","register":false,"modes":0}'
is_problem 422 mixed-routes 'the members of a part may not'

# ---- What is wrong -------------------------------------------------------------------------------------

refused() { # INPUTS REGEX NAME
    run pca-parts "$1"
    is_problem 422 invalid-input "$3"
    like "$(json '.errors[0].detail')" "$2" 'in words'
}

cohort lacking "${PAIRS[0]}" "${PAIRS[1]}" "${PAIRS[2]}"
refused '{"cohort":"lacking"}' 'subject "R" has no member of part "putamen"' 'a subject without a part'
cohort misspelt "${PAIRS[@]:0:7}" "$(member b_putamen b putmen)"
refused '{"cohort":"misspelt"}' '1 of 4 subjects has a member of part "putmen", subject "b" first: is it misspelt' \
    'a part that one subject calls by another name'
cohort twice "${PAIRS[0]}" "${PAIRS[1]}" "$(member R_thalamus L thalamus)"
refused '{"cohort":"twice"}' 'subject "L" has two members of part "thalamus"' 'a part twice'
cohort single "${PAIRS[0]}" "${PAIRS[1]}"
refused '{"cohort":"single"}' 'has 1 subject; 2 are needed' 'one subject'
refused '{"cohort":"both","by":"structure"}' 'no covariate "structure"' 'a covariate that there is not'
refused '{"cohort":"both","by":7}' 'name of a covariate' 'no name'
refused '{"cohort":"both","weights":{"pallidum":2}}' 'names "pallidum", a part that no member is; the parts are "putamen", "thalamus"' 'a weight of no part'
refused '{"cohort":"both","weights":{"putamen":0}}' 'above 0' 'no weight'
refused '{"cohort":"both","weights":[1,1]}' 'object' 'weights without names'
refused '{"cohort":"both","relativePose":true}' 'commonPose' 'relative pose of parts that are turned'
post_json /v1/cohorts "{\"name\":\"nobody\",\"members\":[{\"id\":\"${SURFACE[L_thalamus]}\",\"covariates\":{\"part\":\"x\"}},
    {\"id\":\"${SURFACE[R_thalamus]}\",\"covariates\":{\"part\":\"x\"}}]}"
refused '{"cohort":"nobody"}' 'has no subject' 'members without a subject'
run register "{\"template\":\"${SURFACE[L_thalamus]}\",\"moving\":\"${SURFACE[R_thalamus]}\",\"start\":\"rigid\",\"degree\":4}"
SURFACE[turned]=$(json .surface.id)
cohort turned "$(member L_thalamus l thalamus)" "$(member turned r thalamus)"
run pca-parts '{"cohort":"turned","commonPose":true,"relativePose":true}'
is_problem 422 invalid-input 'a surface that was turned'
like "$(json .detail)" 'was turned' 'by name'

done_testing

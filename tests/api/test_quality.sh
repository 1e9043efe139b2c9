#!/usr/bin/env bash
# test_quality.sh - the quality of a model and the comparison of two groups end to end, on small surfaces of brain
# structures: results, the map that travels with the mean surface, and what is refused.
# srnfd-test: slow
# srnfd-test: no-asan (api/test_statistics.sh and api/test_standard.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

# However busy the machine is, answers come with the result.
REQUEST_SECONDS=400
execute() { # PROCESS INPUTS
    post_json "/v1/processes/$1/execution" "{\"inputs\":$2}" --header 'Prefer: wait=300'
}

LMAX=4
NAMES='amygdala caudate hippocampus pallidum putamen thalamus'

start_server "$SCRATCH/data" --workers 2 || exit 1

# Left and right structures, with an age that has nothing to do with the side, and a volume that one lacks.
MEMBERS=
AGE=40
for SIDE in L R; do
    for NAME in $NAMES; do
        post "/v1/meshes?name=${SIDE}_$NAME" --data-binary "@tests/data/aal_subcortex/${SIDE}_$NAME.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX}"
        AGE=$((AGE * 7 % 61 + 20))
        NEAR=$((AGE % 7))
        if [ "$SIDE" = R ]; then NEAR=$((NEAR + 50)); fi
        MEMBERS="$MEMBERS,{\"id\":\"$(json .surface.id)\",\"label\":\"$SIDE\",\"covariates\":{\"age\":$AGE,\"one\":1,\"near\":$NEAR}}"
        LAST=$(json .surface.id)
    done
done
post_json /v1/cohorts "{\"name\":\"sides\",\"members\":[${MEMBERS#,}]}"
is "$STATUS" 201 'a cohort of two labels'
post_json /v1/cohorts "{\"name\":\"three\",\"members\":[${MEMBERS#,},{\"id\":\"$LAST\",\"label\":\"middle\"}]}"
post_json /v1/cohorts "$(jq -cn --argjson all "[${MEMBERS#,}]" '{name: "four", members: [$all[0, 1, 6, 7]]}')"
post_json /v1/cohorts "{\"name\":\"bare\",\"members\":[${MEMBERS#,},{\"id\":\"$LAST\"}]}"

# ---- evaluate-model ----------------------------------------------------------------------------------

execute pca '{"cohort":"sides","register":false}'
MODEL=$(json .model.id)
execute evaluate-model "{\"model\":\"$MODEL\",\"components\":4,\"samples\":5,\"seed\":7}"
is "$STATUS $(json '[.subjects, (.compactness, .generalisation, .specificity | length)] | tojson')" '200 [12,4,4,4]' \
    'a model is evaluated'
cp "$BODY" "$SCRATCH/model.json"
is "$(json '[.compactness[].value | real] | . == sort and .[3] <= 1')" true 'compactness rises, to 1 at most'
is "$(json '[.generalisation[].elastic | real] | . == (sort | reverse)')" true 'more components describe a new subject better'
is "$(json '[.compactness, .generalisation, .specificity | .[].standardError > 0] | length > 0 and all')" true 'all with standard errors'
is "$(json '[.refitted, .shared] | tojson')" '[["mean","components"],["registration"]]' 'and it says what was fitted again'
# Distances between SRNFs know no inversion, which between such different shapes has more than one answer. With sanitizers
# test_subjects.sh evaluates a cohort.
if [ -z "$SRNFD_SANITIZED" ]; then
    execute evaluate-model '{"cohort":"sides","register":false,"components":4,"samples":5,"seed":7}'
    is "$STATUS" 200 'the same of the cohort'
    compare "$(jq -n --slurpfile a "$SCRATCH/model.json" --slurpfile b "$BODY" '
        [range(4) as $i | (["compactness", "value"], ["generalisation", "elastic"], ["specificity", "elastic"]) as [$c, $m] |
            $a[0][$c][$i][$m] / $b[0][$c][$i][$m] - 1 | fabs] | max')" '<' 1e-9 'agrees'
fi
execute evaluate-model '{"cohort":"sides","register":false,"components":11}'
is_problem 422 invalid-input 'more components than the group allows are refused'
like "$(json '.errors[0].pointer')" '/inputs/components' 'at their place'

if [ -z "$SRNFD_SANITIZED" ]; then
    execute pca '{"cohort":"sides","register":false,"components":2}'
    execute evaluate-model "{\"model\":\"$(json .model.id)\"}"
    like "$(json '.exception.detail // .detail')" 'keeps' 'a model that was cut off is refused'
fi
execute evaluate-model "{\"model\":\"$MODEL\",\"register\":true}"
is_problem 422 invalid-input 'options of the mean are not those of a model'

# ---- compare-groups ----------------------------------------------------------------------------------

execute compare-groups '{"cohort":"sides","register":false,"permutations":199}'
is "$STATUS $(json '[.groups, .permutations, .regressedOut] | tojson')" '200 [["L","R"],199,[]]' 'two groups are compared'
compare "$(json .pValue)" '>=' 0.005 'p has the least that the permutations allow'
compare "$(json .pValue)" '<=' 1 'and is a probability'
is "$(json '.distanceInterval[0] >= 0 and .distanceInterval[0] <= .distance and .distance <= .distanceInterval[1]')" true \
    'the distance lies in its interval'
is "$(json '[.map.pointwiseP, .map.significance] | transpose | map(.[0] > 0 and .[0] <= .[1] + 1e-15) | length == 128 and all')" true \
    'p of single points is not corrected'
is "$(json '[.map.significance, .map.fdr, .map.effect | length == 128] | tojson')" '[true,true,true]' \
    'the map has a value at every node of the grid'
is "$(json '[.map.significance, .map.fdr | .[] | . > 0 and . <= 1] | length > 0 and all')" true 'of probabilities'
compare "$(json '(.map.significance | min) - .leastSignificance | fabs')" '<' 1e-15 'and its least is told'
SURFACE=$(json .surface.id)
execute mean '{"cohort":"sides","register":false}'
isnt "$(json .surface.id)" "$SURFACE" 'the surface with its map is another than the plain mean'
compare "$(json .surface.area)" '>' 0 'of the same kind'
get "/v1/surfaces/$SURFACE"
is "$(json '.maps | tojson')" '["significance","fdr","effect","normalEffect","pointwiseP","statistic"]' \
    'its record names the maps'
get "/v1/surfaces/$SURFACE/mesh?format=ply&resolution=4"
like "$(head -c 900 "$BODY" | tr -d '\0')" 'double significance' 'which ride along in its meshes'
for FORMAT in vtk glb; do
    get "/v1/surfaces/$SURFACE/mesh?format=$FORMAT&resolution=4"
    is "$STATUS" 200 "also as $FORMAT"
done

execute compare-groups '{"cohort":"sides","register":false,"permutations":199,"seed":0,"covariates":[]}'
is "$(json .surface.id)" "$SURFACE" 'the same seed gives the same map'
execute compare-groups '{"cohort":"sides","register":false,"permutations":99,"covariates":["age"]}'
is "$STATUS $(json '.regressedOut | tojson')" '200 ["age"]' 'with a covariate regressed out'
cp "$BODY" "$SCRATCH/age.json"
isnt "$(json .surface.id)" "$SURFACE" 'the map is another'

execute compare-groups '{"cohort":"sides","covariates":["volume"]}'
is_problem 422 invalid-input 'a covariate that members do not have is refused'
like "$(json '.errors[0].detail')" '^member 0 .surf-[0-9a-f]+.* of the cohort has no covariate "volume"; the cohort has "age", "near", "one"$' \
    'by name, with those there are'
MIXED=$(jq -c '[.[] | .covariates.age |= tostring] | .[3].covariates.age = "old"' <<<"[${MEMBERS#,}]")
post_json /v1/cohorts "{\"name\":\"mixed\",\"members\":$MIXED}"
execute compare-groups '{"cohort":"mixed","covariates":["age"]}'
is_problem 422 invalid-input 'a covariate of texts is refused'
ADVICE='code two levels as 0 and 1; formulas, as that of regress, take texts as levels'
is "$(json '.errors[0].detail')" \
    "\"age\" of member 3 of the cohort ($(jq -r '.[3].id' <<<"$MIXED")) is the text \"old\", not a number, true or false: $ADVICE" \
    'by the first member that is to blame, with what to do'
post_json /v1/cohorts "{\"name\":\"quoted\",\"members\":$(jq -c '.[3].covariates.age = "41"' <<<"$MIXED")}"
execute compare-groups '{"cohort":"quoted","covariates":["age"]}'
like "$(json '.errors[0].detail')" '^"age" of member 0 .* not a number, true or false: send it as a number, without the quotes$' \
    'as are numbers in quotes'
execute compare-groups '{"cohort":"sides","covariates":["one"]}'
is_problem 422 invalid-input 'a covariate that is the same for all is refused'
is "$(json '.errors[0] | "\(.pointer) \(.detail)"')" \
    '/inputs/covariates/0 "one" is the same for all members: leave it out' 'by name'
execute compare-groups '{"cohort":"sides","covariates":["age","near","age"]}'
like "$(json '.errors[0].detail')" '"age" follows from' 'as is one that says nothing new'
execute compare-groups '{"cohort":"sides","register":false,"permutations":99,"covariates":["age","near"]}'
is "$STATUS $(json '[.warnings[] | select(.code == "covariates-collinear") | .figures.covariate] | join(" ")')" '200 near' \
    'covariates that tell the groups are warned of'
compare "$(json '.warnings[] | select(.code == "covariates-collinear") | .figures.inflation')" '>' 10 'with the inflation'
cp "$SCRATCH/age.json" "$BODY"
is "$(json '[.warnings[] | select(.code == "covariates-collinear")] | length')" 0 'and others are not'
execute compare-groups '{"cohort":"four"}'
is_problem 422 invalid-input 'few subjects are refused'
is "$(json '.errors[0].detail')" 'has 4 subjects, too few for a comparison: 5 are needed' 'without a word on covariates'
execute compare-groups '{"cohort":"three"}'
is_problem 422 invalid-input 'three labels are refused'
like "$(json '.errors[0].detail')" '"L", "R", "middle"' 'with all of them'
execute compare-groups '{"cohort":"bare"}'
is_problem 422 invalid-input 'a member without a label is refused'
execute compare-groups '{"surfaces":["a"]}'
is_problem 422 invalid-input 'a list of surfaces has no groups'

stop_server || not_ok 'the server ends well'
done_testing

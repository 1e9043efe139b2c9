#!/usr/bin/env bash
# test_subjects.sh - members that belong to one subject, against a live server: counted, left out and relabelled
# together, refused where their labels differ, and content that stands for two members warned of.
# srnfd-test: slow
# srnfd-test: no-asan (api/test_classify.sh and api/test_statistics.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

# However busy the machine is, answers come with the result.
REQUEST_SECONDS=400
execute() { # PROCESS INPUTS
    post_json "/v1/processes/$1/execution" "{\"inputs\":$2}" --header 'Prefer: wait=300'
}

LMAX=4
start_server "$SCRATCH/data" --workers 2 || exit 1

# Six surfaces between the left and the right nucleus of a kind: the first and the last are the nuclei's own.
between() { # KIND
    local ends=() side
    for side in L R; do
        post "/v1/meshes?name=${side}_$1" --data-binary "@tests/data/aal_subcortex/${side}_$1.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX}"
        ends+=("$(json .surface.id)")
    done
    execute geodesic "{\"from\":\"${ends[0]}\",\"to\":\"${ends[1]}\",\"steps\":6,\"register\":false}"
    json '[.surfaces[].id] | tojson'
}
THALAMI=$(between thalamus)
PALLIDA=$(between pallidum)
cohort() { # NAME JQ-FILTER of $a (thalami) and $b (pallida)
    post_json /v1/cohorts "$(jq -nc --argjson a "$THALAMI" --argjson b "$PALLIDA" "{name: \"$1\", members: ($2)}")"
    is "$STATUS" 201 "the cohort $1"
}
# Three subjects of each kind, each with two surfaces.
cohort repeated '[range(6) as $i | {id: $a[$i], label: "thalamus", subject: "t\($i / 2 | floor)"},
    {id: $b[$i], label: "pallidum", subject: "p\($i / 2 | floor)"}]'
# The same surfaces: each subject has one of each kind.
cohort within '[range(6) as $i | {id: $a[$i], label: "thalamus", subject: "s\($i)"},
    {id: $b[$i], label: "pallidum", subject: "s\($i)"}]'
# One surface under two subjects, and twice under one.
cohort copies '[range(6) as $i | {id: $a[$i], label: "thalamus", subject: "t\($i)"},
    {id: $b[$i], label: "pallidum", subject: "p\($i)"}] +
    [{id: $a[1], label: "thalamus", subject: "other"}, {id: $b[2], label: "pallidum", subject: "p2"}]'

# ---- classify ----------------------------------------------------------------------------------------

OPTIONS='"method":["srnf-nn","srnf-gauss","harmonic-nn"],"components":1,"covariance":"pooled","refit":"shared","commonPose":true'
UNREGISTERED="\"method\":\"harmonic-nn\",\"lmax\":$LMAX" # quick: for what every method does
execute classify "{\"cohort\":\"repeated\",$OPTIONS,\"permutations\":99}"
is "$STATUS $(json '[.members, .subjects, .chance, .majorityRate] | tojson')" '200 [12,6,0.5,0.5]' \
    'members and subjects are counted'
is "$(json '[.methods[] | .effectiveCount >= 1 and .effectiveCount <= 12] | all')" true 'the accuracy is worth as many at most'
is "$(json '[.methods[] | select(.accuracy == 1) | .effectiveCount <= 6] | unique | tojson')" '[true]' \
    'and where all are right no more than the subjects'
is "$(json '[.permutations, .relabellings, .exact] | tojson')" '[19,20,true]' 'six subjects have 20 relabellings: all are taken'
is "$(json '[.methods[] | .pValue >= 0.1 and .pValueInterval == [.pValue, .pValue]] | all')" true 'p is exact, 2 / 20 at least'
is "$(json '[.methods[] | .pValueIsFloor == (.pValue <= 0.1000001)] | all')" true 'and marked where it is that'
warned() { # CODE: how often
    json "[.warnings[] | select(.code == \"$1\")] | length"
}
is "$(warned p-floor)" 1 'a p that cannot be significant is warned of'
is "$(json '.warnings[] | select(.code == "p-floor") | .figures.leastP')" 0.1 '  with the least there is'
execute classify "{\"cohort\":\"repeated\",$UNREGISTERED}"
is "$(json '[.permutations, .relabellings, .exact, .methods[].pValue, .methods[].pValueIsFloor] | unique | tojson') $(warned p-floor)" \
    '[null,0] 0' 'without permutations there is no p and nothing to warn of'
execute classify "{\"cohort\":\"within\",$OPTIONS,\"permutations\":99}"
is_problem 422 labels-within-subject 'labels that differ within a subject cannot be permuted'
is "$(json '.detail | test("change") and test("permutations 0") and test("s0")')" true 'the problem names the subject and the way out'
execute classify "{\"cohort\":\"within\",$UNREGISTERED}"
is "$STATUS $(json '[.members, .subjects] | tojson')" '200 [12,6]' 'but be classified, each subject left out'
execute classify '{"cohort":"repeated","components":4,"covariance":"pooled"}'
is_problem 422 invalid-input 'six subjects determine three components'
if [ -z "$SRNFD_SANITIZED" ]; then
    execute classify '{"cohort":"repeated","components":3,"covariance":"pooled","refit":"shared","commonPose":true}'
    is "$STATUS" 200 'and no fewer'
fi

# ---- compare-groups ----------------------------------------------------------------------------------

execute compare-groups '{"cohort":"repeated","register":false,"permutations":199}'
is "$STATUS $(json_in_order '[.members, .subjects, .groupSizes] | tojson')" \
    '200 [12,6,{"members":[6,6],"subjects":[3,3]}]' 'groups are counted by member and by subject'
is "$(json '[.permutations, .relabellings, .exact, .pValueInterval == [.pValue, .pValue]] | tojson')" '[19,20,true,true]' \
    'all relabellings are taken'
is "$(json '[.pValueIsFloor == (.pValue < 0.1000001), .leastSignificanceIsFloor == (.leastSignificance < 0.1000001)] | all')" true \
    'both p are marked at the floor'
is "$(warned p-floor)" 1 'which is warned of'
is "$(json .level)" exact 'without covariates the test has its level'
# Of two subjects no interval is known: nothing refers to it.
cohort unequal '[{id: $a[0], label: "wide"}, {id: $b[0], label: "wide"}] + [range(1; 6) as $i | {id: $a[$i], label: "narrow"}]'
execute compare-groups '{"cohort":"unequal","register":false,"permutations":19}'
is "$STATUS $(json '.distanceInterval | tojson') $(warned spreads-differ)" '200 [null,null] 1' 'two subjects that scatter are warned of'
unlike "$(json '.warnings[] | select(.code == "spreads-differ") | .detail')" 'distanceInterval allows' 'without an interval that is none'
# The ages of the one group are those of the other: exchanged within a group they change what age explains.
cohort aged '[range(6) as $i | {covariates: {age: (31 + ($i / 2 | floor))}} + ({id: $a[$i], label: "thalamus", subject: "t\($i / 2 | floor)"},
    {id: $b[$i], label: "pallidum", subject: "p\($i / 2 | floor)"})]'
execute compare-groups '{"cohort":"aged","register":false,"permutations":800,"covariates":["age"]}'
is "$STATUS $(json '[.permutations, .relabellings, .exact, .level] | tojson')" '200 [719,720,true,"asymptotic"]' \
    'with covariates the level is asymptotic, also of all relabellings'
is "$(json '[.warnings[] | select(.code == "p-floor")] | length') $(json '.pValue >= 0.0055555')" '0 true' 'what always ties is counted: 4 of 720'
is "$(json '[.pValueIsFloor == (.pValue < 0.0055556), .leastSignificanceIsFloor == (.leastSignificance < 0.0055556)] | all')" true \
    'for the groups and for the map'
execute compare-groups '{"cohort":"within","register":false,"permutations":199}'
is_problem 422 labels-within-subject 'a subject in both groups is refused'
is "$(json '.detail | test("change")')" true '  with what would compare within subjects'

# ---- evaluate-model ----------------------------------------------------------------------------------

execute evaluate-model '{"cohort":"repeated","register":false,"components":9,"samples":2}'
is "$STATUS $(json '[.members, .subjects, (.generalisation | length)] | tojson')" '200 [12,6,9]' 'a subject is left out whole'
execute evaluate-model '{"cohort":"repeated","register":false,"components":10,"samples":2}'
is_problem 422 invalid-input 'which leaves one component less'
execute pca '{"cohort":"repeated","register":false}'
is "$(warned duplicate-content)" 0 'a model of them'
execute evaluate-model "{\"model\":\"$(json .model.id)\",\"components\":2,\"samples\":2}"
is "$STATUS $(json '[.members, .subjects] | tojson')" '200 [12,6]' 'knows its subjects'

# ---- The same content twice --------------------------------------------------------------------------

doubles() { # PROCESS INPUTS
    execute "$1" "$2"
    is "$STATUS $(json '[.warnings[] | select(.code == "duplicate-content") | .figures.members] | tojson')" \
        '200 [[2,12],[5,13]]' "$1 warns of both copies"
    is "$(json '[.warnings[] | select(.code == "duplicate-content")] | (.[0].detail | test("t1") and test("other")) and (.[1].detail | test("both of subject p2"))')" true \
        '  and of whose they are'
}
doubles distances '{"cohort":"copies","register":false}'
if [ -z "$SRNFD_SANITIZED" ]; then # all by the same lines; test_quality.sh runs these processes with sanitizers
    doubles classify "{\"cohort\":\"copies\",$UNREGISTERED}"
    doubles compare-groups '{"cohort":"copies","register":false,"permutations":99}'
    doubles mean '{"cohort":"copies","register":false}'
    doubles pca '{"cohort":"copies","register":false}'
    doubles evaluate-model '{"cohort":"copies","register":false,"components":1,"samples":2}'
fi
# A mesh, and a surface that comes from it.
post /v1/meshes --data-binary @tests/data/aal_subcortex/L_thalamus.ply
MESH=$(json .id)
execute encode "{\"mesh\":\"$MESH\",\"lmax\":$LMAX}"
execute distances "{\"surfaces\":[\"$MESH\",$(json .surface.id | jq -R .),$(jq '.[3]' <<<"$PALLIDA")],\"register\":false}"
is "$(json '[.warnings[] | select(.code == "duplicate-content") | .figures.content] | tojson')" "[\"$MESH\"]" \
    'a mesh and its surface are the same content'
is "$(warned mixed-degrees)" 1 'at two degrees'

post_json /v1/cohorts "{\"name\": \"images\", \"members\": [{\"id\": \"$MESH\"}, {\"id\": \"$MESH\", \"mirror\": true},
    {\"id\": $(jq '.[3]' <<<"$PALLIDA")}, {\"id\": $(jq '.[3]' <<<"$PALLIDA"), \"mirror\": true}]}"
execute distances '{"cohort":"images","register":false}'
is "$STATUS $(json '[.warnings[] | select(.code == "duplicate-content")] | length')" '200 0' 'mirror images are not'
if [ -z "$SRNFD_SANITIZED" ]; then
    execute mean '{"cohort":"images","register":false}'
    is "$STATUS $(json '[.warnings[] | select(.code == "duplicate-content")] | length')" '200 0' 'in a mean either'
fi

# ---- Models ------------------------------------------------------------------------------------------

# The same surfaces as those of other subjects: leaving out the one grouping is not leaving out the other.
cohort shifted '[range(6) as $i | {id: $a[$i], label: "thalamus", subject: "t\(($i + 1) % 6 / 2 | floor)"},
    {id: $b[$i], label: "pallidum", subject: "p\(($i + 1) % 6 / 2 | floor)"}]'
cohort single '[range(6) as $i | {id: $a[$i]}, {id: $b[$i]}]'
cohort pair '[range(6) as $i | {id: $a[$i], subject: "t"}, {id: $b[$i], subject: "p"}]'
IDS='' LIMITS='' MADE=''
for COHORT in repeated shifted single pair; do
    execute pca "{\"cohort\":\"$COHORT\",\"register\":false}"
    MODEL=$(json .model.id)
    IDS+="$MODEL "
    get "/v1/models/$MODEL"
    MADE+="$(json '.madeFrom.cohort') "
    execute project "{\"model\":\"$MODEL\",\"surface\":$(jq '.[3]' <<<"$PALLIDA")}"
    LIMITS+="$STATUS $(json '[.typicality.subjects, .typicality.residual.limit // 0, .typicality.distance.limit // 0] | tojson') "
    eval "WARNED_$COHORT=\"$(warned model-uncalibrated) $(warned few-subjects)\""
done
is "$MADE" 'repeated shifted single pair ' 'a model tells of the cohort that it was made from'
is "$(tr ' ' '\n' <<<"$IDS" | grep -c .) $(tr ' ' '\n' <<<"$IDS" | grep . | sort -u | wc -l)" '4 4' \
    'models of the same surfaces by other subjects are other models'
is "$(sed 's/,[^]]*//g' <<<"$LIMITS")" '200 [6] 200 [6] 200 [12] 200 [null] ' 'limits rest on subjects'
is "$(tr ' ' '\n' <<<"$LIMITS" | grep '^\[' | sort -u | wc -l)" 4 'and differ with what is left out'
is "$WARNED_repeated, $WARNED_single, $WARNED_pair" '0 1, 0 1, 1 0' 'a model of two subjects judges nobody'
if [ -z "$SRNFD_SANITIZED" ]; then
    execute pca '{"cohort":"repeated","register":false,"components":11}'
    is "$(json .model.id)" "${IDS%% *}" 'made again, it is the model that there is'
fi

stop_server "$SERVER_PID" || not_ok 'the server ends well'
done_testing

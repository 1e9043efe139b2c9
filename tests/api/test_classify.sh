#!/usr/bin/env bash
# test_classify.sh - classification of a labelled cohort, and distances by the metrics that have no SRNFs, against a
# live server: two kinds of nuclei with three surfaces each, which every method can tell apart.
# srnfd-test: plain-core (core/stats/test_classify.c and test_standard.sh run its numerics)
# srnfd-test: slow
# srnfd-test: once (core/stats/test_classify.c has the figures in both builds)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" || exit 1

# Three surfaces between the left and the right nucleus of a kind.
between() { # KIND
    local ends=() side
    for side in L R; do
        post "/v1/meshes?name=${side}_$1" --data-binary "@tests/data/aal_subcortex/${side}_$1.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":6,\"parameterization\":\"star\"}"
        ends+=("$(json .surface.id)")
    done
    execute geodesic "{\"from\":\"${ends[0]}\",\"to\":\"${ends[1]}\",\"steps\":3,\"register\":false}"
    json "[.surfaces[].id | {id: ., label: \"$1\"}] | tojson"
}
THALAMI=$(between thalamus)
PALLIDA=$(between pallidum)
post_json /v1/cohorts "$(jq -nc "{name: \"kinds\", members: ($THALAMI + $PALLIDA | to_entries | map(.value + {subject: \"s\(.key)\"}))}")"
is "$STATUS" 201 'a cohort of two kinds'

# ---- classify ----------------------------------------------------------------------------------------

execute classify '{"cohort":"kinds","method":["srnf-gauss","srnf-nn","harmonic-nn","icp-nn","spharm-pdm"],"components":1,
    "covariance":"pooled","refit":"shared","commonPose":true,"scale":"shape-and-size","permutations":19,"seed":3}'
is "$STATUS" 200 'five methods at once'
is "$(json '.classes | join(" ")')" 'thalamus pallidum' 'classes are in the order of the labels'
is "$(json '[.methods[] | .accuracy >= .confidenceInterval[0] and .accuracy <= .confidenceInterval[1]] | tojson')" \
    '[true,true,true,true,true]' 'each accuracy lies in its interval'
is "$(json '[.methods[] | .balancedAccuracy, .auc.thalamus, .auc.pallidum | .value == 1 and .interval[0] < 1 and .interval[1] == 1] | all')" \
    true 'as do balanced accuracies and areas under curves in theirs'
is "$(json '[.methods[] | (.confusion | add | add) == 6 and .correct == .confusion[0][0] + .confusion[1][1]] | all')" true \
    'confusions count all subjects'
is "$(json '[.methods[] | .accuracy] | unique | tojson')" '[1]' 'the kinds are told apart by all of them'
is "$(json '[.comparisons | length, map(.onlyFirst + .onlySecond)[]] | unique | tojson')" '[0,10]' 'in which no two methods differ'
is "$(json '[.comparisons[] | .pValue] | unique | tojson') $(json '.comparisons[0] | .first + " " + .second')" '[1] srnf-gauss srnf-nn' \
    'as McNemar finds'
is "$(json '[.methods[] | .pValue | . >= 0.05 and . <= 1] | all')" true 'p-values are those of 19 permutations'
is "$(json '.methods["srnf-gauss"] | [.components, .covariance] | tojson')" \
    '[[1,1,1,1,1,1],["pooled","pooled","pooled","pooled","pooled","pooled"]]' 'the Gaussians are what was asked for'
is "$(json '[.methods["srnf-gauss"].perSubject[] | .logLikelihoods[.predicted] == ([.logLikelihoods[]] | max)] | all')" true \
    'predictions follow the likelihoods'
is "$(json '[.methods["icp-nn"].perSubject[] | .nearestDistances[.predicted] == ([.nearestDistances[]] | min)] | all')" true \
    'and the distances'
is "$(json '[.methods["srnf-nn"].perSubject[].subject] | join(" ")')" 's0 s1 s2 s3 s4 s5' 'under the names of the subjects'
is "$(json '[.methods["srnf-gauss"].refitted, .methods["srnf-gauss"].shared, .methods["spharm-pdm"].refitted | length] | tojson')" \
    '[4,2,0]' 'what is refitted and what is shared is told'
is "$(json '[.inputs.seed, .inputs.sizeWeight, .registration.commonPose] | tojson')" '[3,1,true]' 'with every option'
get '/v1/jobs?process=classify&limit=1'
JOB=$(json '.jobs[0].id')
get "/v1/jobs/$JOB/results?format=csv"
is "$STATUS $(head -n 1 "$BODY" | tr -d '\r')" "200 method,member,subject,id,label,predicted,$(
    for kind in logLikelihood nearestDistance; do printf '%s thalamus,%s pallidum,' $kind $kind; done | sed 's/,$//')" \
    'the members come as CSV'
is "$(wc -l <"$BODY") $(cut -d, -f1,2 "$BODY" | sort -u | wc -l)" '31 31' 'a line for each method and member'
is "$(grep '^icp-nn,4,' "$BODY" | cut -d, -f2-6)" "4,s3,$(jq -r '.[0].id' <<<"$PALLIDA"),pallidum,pallidum" 'with subject and id'
is "$(grep '^icp-nn,4,' "$BODY" | cut -d, -f7-8)" ',' 'what a method does not tell is empty'
get "/v1/jobs/$JOB/results?format=npy"
is_problem 406 not-acceptable 'they are no array'

wrong() { # INPUTS POINTER WHAT
    execute classify "$1"
    is_problem 422 invalid-input "refused: $3"
    is "$(json "any(.errors[]; .pointer == \"$2\")")" true "  at $2"
}
wrong '{}' /inputs/cohort 'no cohort'
wrong '{"cohort":"kinds","components":4}' /inputs/components 'more components than the folds determine'
wrong '{"cohort":"kinds","method":"svm"}' /inputs/method 'a method that there is not'
post_json /v1/cohorts "$(jq -nc "{name: \"few\", members: (${THALAMI} + ${PALLIDA}[:2])}")"
wrong '{"cohort":"few"}' /inputs/cohort 'a label with two members'

# ---- distances ---------------------------------------------------------------------------------------

for metric in harmonic icp; do
    execute distances "{\"cohort\":\"kinds\",\"metric\":\"$metric\"}"
    is "$STATUS $(json '[.matrix[][]] | length') $(json .registration)" '200 36 null' "distances by $metric"
    is "$(json '.matrix as $m | [range(6) as $i | range(6) as $j | $m[$i][$j] == $m[$j][$i]] | all')" true 'are symmetric'
    is "$(json '.matrix as $m | ([$m[0][1], $m[1][2], $m[3][4], $m[4][5]] | add / 4) <
        ([$m[range(3)][range(3; 6)]] | add / 9)')" true 'and less within a kind than between the two'
done
execute distances '{"cohort":"kinds","metric":"srm","register":false}'
is "$STATUS $(json '.matrix[0][0]')" '200 0' 'distances by square-root maps'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

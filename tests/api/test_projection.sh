#!/usr/bin/env bash
# srnfd-test: timeout 900
#
# test_projection.sh - what a model says of surfaces, against the surfaces: samples that are projected back have
# the scores that they were drawn with, and the covariance of the model; subjects of the model have their own
# scores, registered or not, however they are named; points far out that no surface has are told by their relative
# energy; and what is unlike the subjects of a model or the members of a cohort, or turned against them, is warned of.
# srnfd-test: slow
# srnfd-test: release-only
# It compares figures; under the sanitizers test_statistics.sh, test_doubts.sh and test_routes.sh project.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=6
REQUEST_SECONDS=400
NAMES='L_pallidum R_pallidum L_thalamus R_thalamus'
SAMPLES=100

# Runs a process to its end, however long it takes.
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

# Like json, with more arguments of jq.
query() { # FILTER ARGUMENTS..
    jq -r "$@" "$BODY"
}

# Largest difference between the scores of the last body and those in row $2 of a file's .model.scores, in
# standard deviations of the components.
off() { # FILE ROW
    query --slurpfile from "$1" --argjson row "$2" '$from[0].model as $m | [.scores, $m.scores[$row], $m.eigenvalues] |
        transpose | map((.[0] - .[1]) / (.[2] | sqrt) | fabs) | max'
}

start_server "$SCRATCH/data" --workers 2 || exit 1
S=() M=() A=() # by star, which lie near each other as they are; meshes; and by area, as meshes are
for name in $NAMES; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    M+=("$(json .id)")
    execute encode "{\"mesh\":\"${M[-1]}\",\"lmax\":$LMAX,\"parameterization\":\"star\"}"
    S+=("$(json .surface.id)")
    execute encode "{\"mesh\":\"${M[-1]}\",\"lmax\":$LMAX}"
    A+=("$(json .surface.id)")
done
FOUR=$(printf '"%s",' "${S[@]}")

# ---- Samples come back -------------------------------------------------------------------------------

run pca "{\"surfaces\":[${FOUR%,}],\"register\":false}"
is "$STATUS" 200 'a model of surfaces as they are'
cp "$BODY" "$SCRATCH/plain.json"
PLAIN=$(json .model.id)
run sample "{\"model\":\"$PLAIN\",\"count\":$SAMPLES,\"seed\":11}"
is "$STATUS" 200 "$SAMPLES samples"
cp "$BODY" "$SCRATCH/samples.json"
for surface in $(json '.surfaces[].id'); do
    run project "{\"model\":\"$PLAIN\",\"surface\":\"$surface\"}"
    json '{scores, residual, trainingSubject}'
done | jq -s . >"$SCRATCH/back.json"
is "$(jq length "$SCRATCH/back.json")" "$SAMPLES" 'are projected back'
is "$(jq 'map(.trainingSubject) | any' "$SCRATCH/back.json")" false 'none of them a subject of the model'

# Of drawn scores and those that came back, each in standard deviations of its component: the median and the
# largest distance between them, and the covariance of those that came back, whose expectation is the identity.
jq -n --slurpfile model "$SCRATCH/plain.json" --slurpfile drawn "$SCRATCH/samples.json" \
    --slurpfile back "$SCRATCH/back.json" '
    $model[0].model.eigenvalues as $l | ($drawn[0].scores | length) as $n |
    def unit: [., $l] | transpose | map(.[0] / (.[1] | sqrt));
    ($drawn[0].scores | map(unit)) as $a | ($back[0] | map(.scores | unit)) as $b |
    ([$a, $b] | transpose | map(. as $p | [range($l | length) | ($p[0][.] - $p[1][.]) | . * .] | add | sqrt) | sort) as $off |
    def covariance: . as $s | [range($l | length) as $i | [range($l | length) as $j |
        ($s | map(.[$i] * .[$j]) | add) / $n]];
    {median: $off[$n / 2 | floor], largest: $off[-1], covariance: ($b | covariance), drawn: ($a | covariance)}' \
    >"$SCRATCH/agreement.json"
cp "$SCRATCH/agreement.json" "$BODY"
note "$(json '"off by \(.median) (median), \(.largest) (largest) of a standard deviation"')"
note "$(json '"covariance \(.covariance | map(map(. * 1e3 | round / 1e3)) | tojson), drawn \(.drawn | map(map(. * 1e3 | round / 1e3)) | tojson)"')"
compare "$(json .median)" '<' 0.05 'with the scores that they were drawn with'
compare "$(json '[.covariance, .drawn] | transpose | map(transpose | map(.[0] - .[1] | fabs)) | flatten | max')" '<' 0.12 \
    'and so with their covariance'
compare "$(json "[.covariance | range(length) as \$i | .[\$i][\$i] - 1 | fabs] | max / (2 / $SAMPLES | sqrt)")" '<' 4 \
    'whose variances are the eigenvalues, to four standard errors of so many'
compare "$(json "[.covariance | range(length) as \$i | range(\$i) as \$j | .[\$i][\$j] | fabs] | max * ($SAMPLES | sqrt)")" \
    '<' 4 'and whose components do not go together'

# ---- Shapes that do not exist ------------------------------------------------------------------------

run modes "{\"model\":\"$PLAIN\",\"mode\":1,\"coefficients\":[-3,-2,-1,0,1,2,3]}"
note "$(json '"relative energy from -3 to 3 sd: \(.relativeEnergy | map(. * 1e6 | round / 1e6) | tojson)"')"
is "$(json '.relativeEnergy | map(real) | [.[0] > .[1], .[1] > .[2], .[6] > .[5], .[5] > .[4]] | all')" true \
    'the farther out, the less a shape exists'
# The distance of the surface from the point of the model, as a part of that of the point from the mean.
cp "$BODY" "$SCRATCH/modes.json"
MISSED=$(json '. as $r | [0, 2, 4, 6] | map(($r.relativeEnergy[.] * $r.surfaces[.].area | sqrt) /
    ($r.coefficients[.] * $r.standardDeviation | fabs))')
note "of the way from the mean, at -3, -1, 1 and 3 sd, is not reached: $(jq -c 'map(. * 1e3 | round / 1e3)' <<<"$MISSED")"
is "$(jq 'all(type == "number") and .[0] > .[1] and .[3] > .[2]' <<<"$MISSED")" true 'which its relative energy tells'

# ---- Subjects of a model as they are -----------------------------------------------------------------

for i in 0 3; do
    run project "{\"model\":\"$PLAIN\",\"surface\":\"${S[$i]}\"}"
    is "$STATUS $(json .trainingSubject)" '200 true' 'a subject of the model is known again'
    compare "$(off "$SCRATCH/plain.json" "$i")" '<' 1e-9 'and has its own scores'
done

# ---- Subjects of a registered model ------------------------------------------------------------------

run pca "{\"surfaces\":[\"${M[0]}\",\"${A[1]}\",\"${A[2]}\"],\"lmax\":$LMAX,\"maxIterations\":2,\"components\":1}"
is "$STATUS" 200 'a registered model, of a mesh and two surfaces'
cp "$BODY" "$SCRATCH/registered.json"
MODEL=$(json .model.id)
run encode "{\"mesh\":\"${M[0]}\"}"
WHOLE=$(json .surface.id)
is "$(jq -c .model.madeFrom.contents "$SCRATCH/registered.json")" "[\"$WHOLE\",\"${A[1]}\",\"${A[2]}\"]" \
    'knows its subjects by what their surfaces are'
known() { # SURFACE ROW DESCRIPTION
    run project "{\"model\":\"$MODEL\",\"surface\":\"$1\"}"
    is "$STATUS $(json .trainingSubject) $(off "$SCRATCH/registered.json" "$2")" '200 true 0' "$3"
    compare "$(query --slurpfile from "$SCRATCH/registered.json" ".distance - \$from[0].distances[$2] | fabs")" '==' 0 \
        'with its distance from the mean'
    compare "$(json '(.scores[0] * .scores[0] + .residual * .residual) / (.distance * .distance) - 1 | fabs')" '<' 1e-9 \
        'and its residual'
}
known "${M[0]}" 0 'a mesh among the subjects has its own scores'
known "$WHOLE" 0 'and so has the surface that it is encoded to'
known "${A[2]}" 2 'and a surface among the subjects'

# A mesh beside a model of surfaces is encoded as they were.
run pca "{\"surfaces\":[\"${A[0]}\",\"${A[1]}\",\"${A[2]}\"],\"maxIterations\":2}"
cp "$BODY" "$SCRATCH/encoded.json"
run project "{\"model\":\"$(json .model.id)\",\"surface\":\"${M[1]}\"}"
is "$STATUS $(json .trainingSubject) $(off "$SCRATCH/encoded.json" 1)" '200 true 0' 'a mesh is encoded at the degree of a model of surfaces'
is "$(json '[.warnings[]? | select(.code == "mixed-degrees")] | length')" 0 'without a warning of degrees'

# The same but for a hair: no subject, so registered anew, from its pose and parameterization to the mean.
get "/v1/surfaces/${A[2]}/coefficients"
jq '{coefficients: (.x[5] *= 1.000001)}' "$BODY" >"$SCRATCH/hair.json"
post_json /v1/surfaces "@$SCRATCH/hair.json"
run project "{\"model\":\"$MODEL\",\"surface\":\"$(json .id)\"}"
is "$STATUS $(json .trainingSubject)" '200 false' 'a surface that is not quite one of the subjects is registered'
note "$(query --slurpfile from "$SCRATCH/registered.json" \
    '"anew at \(.distance) from the mean, within the group at \($from[0].distances[2])"')"
compare "$(json .distance)" '<' "$(json '.distanceBefore')" 'to the mean'

# ---- What does not belong to a model -----------------------------------------------------------------

codes() { # of the warnings of the last body
    json '[.warnings[].code] | sort | join(" ")'
}

is "$(json '[.warnings[].code] | contains(["few-subjects"])')" true 'a model of three subjects has wide limits'
is "$(json '.typicality | [.subjects, .residual.percentile >= 0, .angle] | tojson')" '[3,true,null]' \
    'which the result gives, and no angle where the model rotates'
run pca "{\"surfaces\":[\"${S[0]}\",\"${S[1]}\"],\"register\":false}"
run project "{\"model\":\"$(json .model.id)\",\"surface\":\"${S[2]}\"}"
is "$STATUS $(json .typicality) $(codes)" '200 null model-uncalibrated' 'one of two has none, and says so'

mapfile -t DRAWN < <(jq -r '.surfaces[].id' "$SCRATCH/samples.json")
group() { # FROM COUNT: ids of samples, for JSON
    printf '"%s"\n' "${DRAWN[@]:$1:$2}" | paste -sd,
}
run pca "{\"surfaces\":[$(group 0 40)],\"register\":false}"
is "$STATUS $(codes)" '200 ' 'a model of forty samples'
FORTY=$(json .model.id)
# The samples are drawn from a model of three components, whose eigenvalues are what they were planted with.
note "$(json '.model | [.eigenvalues, .eigenvalueIntervals, .explainedIntervals, .totalVarianceInterval] | map(.[:4]) | tojson')"
is "$(json '.model | (.eigenvalueIntervals | length) == .components and (.explainedIntervals | length) == .components')" true \
    'whose components have intervals'
is "$(json '.model | [.eigenvalues, .eigenvalueIntervals] | transpose | map(select(.[1]) | .[1][0] <= .[0] and .[0] <= .[1][1]) | all')" \
    true 'that hold their eigenvalues'
is "$(jq -s '.[1].model.eigenvalueIntervals[0] as $i | .[0].model.eigenvalues[0] | $i[0] <= . and . <= $i[1]' "$SCRATCH/plain.json" "$BODY")" \
    true 'and the first that of the model they were drawn from'
is "$(json '.model | .totalVarianceInterval as $i | $i[0] < .totalVariance and .totalVariance < $i[1]')" true 'as the total has'
for i in {40..69}; do
    run project "{\"model\":\"$FORTY\",\"surface\":\"${DRAWN[$i]}\"}"
    json '{warnings, typicality}'
done | jq -s . >"$SCRATCH/members.json"
# 4 or more of 30 have the probability 1e-4 where 1 % are beyond each of four limits of .5 %, and .02 at 4 %.
note "$(jq -c '[.[].warnings[].code]' "$SCRATCH/members.json")"
compare "$(jq 'map(select(.warnings | length > 0)) | length' "$SCRATCH/members.json")" '<=' 3 \
    'other samples are not far from it'
compare "$(jq 'map(.typicality.distance.percentile) | add / length' "$SCRATCH/members.json")" '>' 25 \
    'and lie among its subjects'
run project "{\"model\":\"$FORTY\",\"surface\":\"${DRAWN[5]}\"}"
is "$(json .trainingSubject) $(codes)" 'true ' 'nor is one of them'
is "$(json '.typicality | [.residual, .distance, .mahalanobis, .angle] | map(.percentile as $p | .percentileInterval |
    .[0] <= $p and $p <= .[1] and .[1] - .[0] < 32) | all')" true 'whose percentiles have intervals, as of forty'
post "/v1/meshes?name=L_hippocampus" --data-binary @tests/data/aal_subcortex/L_hippocampus.ply
run encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX}"
FOREIGN=$(json .surface.id)
run project "{\"model\":\"$FORTY\",\"surface\":\"$FOREIGN\"}"
is "$(json '[.warnings[].code] | contains(["far-from-model"])')" true 'a hippocampus is'
is "$(json '.warnings[] | select(.code == "far-from-model") | .figures.residual |
    .value > .limit and .percentileInterval[1] == 100')" true 'with its figures'

# A sample turned about the z axis.
turn() { # SURFACE DEGREES
    get "/v1/surfaces/$1/coefficients"
    jq --argjson angle "$2" '($angle * 3.141592653589793 / 180) as $a | ($a | cos) as $c | ($a | sin) as $s |
        [.x, .y] as [$x, $y] | .x = [range($x | length) | $c * $x[.] - $s * $y[.]] |
        .y = [range($x | length) | $s * $x[.] + $c * $y[.]] | {name: "turned sample", coefficients: .}' \
        "$BODY" >"$SCRATCH/turned.json"
    post_json /v1/surfaces "@$SCRATCH/turned.json"
    json .id
}
TURNED=$(turn "${DRAWN[70]}" 25)
run project "{\"model\":\"$FORTY\",\"surface\":\"$TURNED\"}"
is "$(json '[.warnings[].code] | contains(["pose-differs"])')" true 'a sample that is turned differs in pose'
compare "$(json '.warnings[] | select(.code == "pose-differs") | .figures.angle - 25 | fabs')" '<' 5 'by that angle'
compare "$(json '.warnings[] | select(.code == "pose-differs") | .figures.standardDeviations')" '>' 0.1 \
    'and so in its scores'
run mean "{\"surfaces\":[$(group 0 12),\"$TURNED\"],\"register\":false}"
is "$(json '[.warnings[] | select(.code == "pose-differs") | .figures.member] | tojson')" '[12]' \
    'and is told among the members of a mean'
like "$(json '.warnings[] | select(.code == "pose-differs").detail')" '^Member 12 \(turned sample\) lies' 'by number and name'
post_json /v1/cohorts "$(printf '%s\n' "${DRAWN[@]:0:12}" "$TURNED" |
    jq -R . | jq -sc '{name: "posed", members: (to_entries | map({id: .value, label: (["a", "b"][.key % 2])}))}')"
run compare-groups '{"cohort":"posed","register":false,"permutations":99}'
like "$STATUS $(json '.warnings[] | select(.code == "pose-differs").detail')" '^200 Member 12 \(turned sample\) lies' \
    'and so in a comparison of groups'

# ---- What does not belong to a cohort ----------------------------------------------------------------

get "/v1/surfaces/$FOREIGN/coefficients"
jq '{coefficients: (.x |= map(8 * .))}' "$BODY" >"$SCRATCH/long.json"
post_json /v1/surfaces "@$SCRATCH/long.json"
LONG=$(json .id)
members=$(printf '%s\n' "${DRAWN[@]:0:20}" "$LONG" |
    jq -R . | jq -sc 'to_entries | map({id: .value, label: (["a", "b"][.key % 2])})')
post_json /v1/cohorts "{\"name\":\"mixed\",\"members\":$members}"
is "$STATUS" 201 'a cohort of samples and a hippocampus drawn out eightfold'
run classify "{\"cohort\":\"mixed\",\"method\":\"harmonic-nn\",\"lmax\":$LMAX}"
note "$(json '.methods[].perSubject[-1].typicality | tojson')"
is "$STATUS $(json '[.warnings[] | select(.code == "far-from-group") | .figures.member] | tojson')" '200 [20]' \
    'a member is unlike the others, whatever its class'
like "$(json '.warnings[] | select(.code == "far-from-group").detail')" \
    '^Member 20 .*, by harmonic-nn: nearest [0-9.]+ [(]limit [0-9.]+[)][.] No method that registers was asked: it may lie' \
    'by the method that finds it so, which does not register'
is "$(json '.methods["harmonic-nn"].perSubject[20].typicality.nearest | [.percentile, .value > .limit,
    .percentileInterval[1], .percentileInterval[0] > 80] | tojson')" '[100,true,100,true]' \
    'by its distance from the nearest'
run classify '{"cohort":"mixed","method":["srnf-nn","harmonic-nn"],"lmax":4,"commonPose":true}'
note "$(json '.warnings[] | select(.code == "far-from-group").detail')"
like "$STATUS $(json '.warnings[] | select(.code == "far-from-group").detail')" \
    '^200 Member 20 .*, by srnf-nn: (nearest|distance) .*; so by harmonic-nn[.] What class .* see whether it belongs to the cohort' \
    'and by all that do, of which one registers'
stop_server || not_ok 'the server ends well'
done_testing

#!/usr/bin/env bash
# test_score.sh - surfaces beside the norm end to end: percentiles, the map, calibration and covariates, members of the
# model, and what is refused by name.
# srnfd-test: plain-core (core/stats/test_norms.c and test_standard.sh run its numerics)
# srnfd-test: slow
# srnfd-test: once (core/stats/test_norms.c has the figures in both builds)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 2 || exit 1

# Ellipsoids with bumps that follow no rule; z grows with age. The last three are no members: one alike, one with a bump,
# and one that is tall for its age.
MEMBERS=$(python3 - "$URL" <<'PYTHON'
import json, math
from service import send

members, lmax = [], 5
for i in range(21):
    age = 40 + (i * 37 % 41) if i < 20 else 45
    rows = {axis: [0.0] * (lmax + 1) ** 2 for axis in 'xyz'}
    rows['x'][3], rows['y'][1], rows['z'][2] = 1.0, 1.0, 0.9 + 0.02 * (80 if i == 20 else age)
    for axis in 'xyz':
        for k in range(4, 16):
            rows[axis][k] = 0.02 * math.sin(1.7 * i * k + ord(axis) * k * k)
    if i == 19:
        rows['x'][6] += 0.4
    surface = send('/v1/surfaces', {'coefficients': {'lmax': lmax, **rows}})
    covariates = {'age': age, 'site': 'AB'[i % 2], 'one': 1, 'rare': 1 if i == 3 else 0}
    members.append({'id': surface['id'], 'covariates': covariates})
print(json.dumps(members))
PYTHON
)
id() {
    jq -r ".[$1].id" <<<"$MEMBERS"
}
post_json /v1/cohorts "{\"name\":\"norm\",\"members\":$(jq -c '.[:18]' <<<"$MEMBERS")}"
is "$STATUS" 201 'a cohort with covariates'
execute pca '{"cohort":"norm","register":false}'
MODEL=$(json .model.id)
execute pca '{"cohort":"norm","register":false,"components":3}'
CUT=$(json .model.id)

score() {
    execute score "{\"model\":\"${3:-$MODEL}\",\"surface\":\"$(id "$1")\"${2:-}}"
}

# ---- The result ---------------------------------------------------------------------------------------

score 18
is "$STATUS" 200 'one of the same kind'
cp "$BODY" "$SCRATCH/alike.json"
is "$(json '[.subjects, .trainingSubject, .at, .typicality.subjects] | tojson')" '[18,false,null,18]' 'is compared with all'
is "$(json '[.percentile, .ranks[].percentile | real | . > 0 and . < 100] | all')" true 'has percentiles'
is "$(json '[{i: .percentileInterval, p: .percentile}, (.ranks[] | {i: .interval, p: .percentile}) |
    .i[0] <= .p and .p <= .i[1]] | all')" true 'within their intervals'
compare "$(json .pValue)" '>' 0.05 'and is not odd'
is "$(json '[.zMap.maps | sort | .[]] | join(" ")')" 'deviation significance spread zScore' 'its surface has the maps'
is "$(json '[.calibration.subjects, (.calibration.overall.percentiles | length), (.calibration.overall.pValue | real > 0.01)] | tojson')" \
    '[18,18,true]' 'percentiles are tried on those that are left out'
get "/v1/surfaces/$(json .zMap.id)/mesh?format=ply"
is "$STATUS $(json .detail)" "200 " 'maps travel with the mesh'
execute project "{\"model\":\"$MODEL\",\"surface\":\"$(id 18)\"}"
compare "$(json "[.mahalanobis, .residual, .distance] | map(real) | . as \$a | [$(
    jq -c '.mahalanobis, .residual, .distance' "$SCRATCH/alike.json" | paste -sd,)] | [., \$a] | transpose |
    map((.[0] / .[1]) - 1 | fabs) | max")" '<' 1e-9 'figures are those of project'

score 19
compare "$(json .ranks.largestZ.pValue)" '<=' 0.053 'a bump is odd somewhere'
compare "$(json '.ranks.largestZ.value')" '>' "$(jq '2 * .ranks.largestZ.value' "$SCRATCH/alike.json")" 'by far'
score 4
is "$(json '[.subjects, .trainingSubject, ([.warnings[].code] | index("training-subject") != null)] | tojson')" '[17,true,true]' \
    'a member is compared with the others'
compare "$(json '.residual | real')" '>' 0.01 'and its residual is that without it'
score 18 ',"map":false,"calibration":false'
is "$(json '[.zMap, .calibration, .ranks.largestZ] | tojson')" '[null,null,null]' 'what is not wanted is not made'
is "$(json .percentile)" "$(jq .percentile "$SCRATCH/alike.json")" 'and changes nothing'
score 18 '' "$CUT"
is "$(json '[.zMap, .calibration, ([.warnings[].code] | index("components-missing") != null)] | tojson')" '[null,null,true]' \
    'a cut model has percentiles alone, and says so'

# ---- Covariates ---------------------------------------------------------------------------------------

score 20
compare "$(json .ranks.distance.pValue)" '>' 0.05 'one that is tall'
score 20 ',"formula":"shape ~ age + site","covariates":{"age":45,"site":"A"}'
is "$STATUS" 200 'with its covariates'
is "$(json_in_order '[.at, .inputs.covariates] | tojson')" '[{"age":45,"site":"A"},{"age":45,"site":"A"}]' 'which the result repeats'
compare "$(json .ranks.distance.pValue)" '<=' 0.053 'is too tall for its age'
compare "$(json .ranks.largestZ.pValue)" '<=' 0.053 'which the map shows'
is "$(json .typicality)" null 'and project knows nothing of'
score 20 ',"formula":"shape ~ age + site","covariates":{"age":80,"site":"A"}'
compare "$(json .ranks.distance.pValue)" '>' 0.05 'but not for another age'
score 19
FAR=$(json '[.warnings[] | select(.code == "far-from-model") | .figures.residual] | tojson')
score 19 ',"formula":"shape ~ age","covariates":{"age":60}'
is "$(json '[.warnings[] | select(.code == "far-from-model") | .figures.residual] | tojson')" "$FAR" \
    'what the components do not represent is warned of with covariates too'
isnt "$FAR" '[]' 'as without'
score 20 ',"formula":"shape ~ age","covariates":{"age":120}'
is "$(json '[.warnings[] | select(.code == "extrapolated") | .figures.covariate] | join(" ")')" age 'a line far out is warned of'

# ---- Refusals -----------------------------------------------------------------------------------------

refused() {
    score 20 "$1" "${3:-}"
    like "$STATUS $(json '.errors[0] | "\(.pointer) \(.detail)"')" "$2" "refused: $1 ${3:+of another model}"
}
refused ',"formula":"shape ~ age"' '422 /inputs/covariates has no "age", which the formula names'
refused ',"covariates":{"age":4}' '422 /inputs/covariates are of no use without a formula'
refused ',"formula":"shape ~ age","covariates":{"age":4,"size":2}' '422 /inputs/covariates "size" is no covariate of the formula'
refused ',"formula":"shape ~ age","covariates":{"age":"old"}' '422 /inputs/covariates "age" must be a number'
refused ',"formula":"shape ~ age","covariates":[4]' '422 /inputs/covariates must be an object'
refused ',"formula":"shape ~ one","covariates":{"one":1}' '"one" is the same for all members'
refused ',"formula":"shape ~ weight","covariates":{"weight":1}' 'no member of the cohort has a covariate "weight"'
refused ',"formula":"shape ~ rare","covariates":{"rare":1}' 'the column rare cannot be told without the subject of member 3'
refused ',"formula":"age ~ shape"' 'must begin with "shape ~"'
refused ',"formula":"shape ~ age","covariates":{"age":45}' 'needs all components of the members, and the model keeps 3' "$CUT"
execute pca "{\"surfaces\":[\"$(id 0)\",\"$(id 1)\",\"$(id 2)\",\"$(id 3)\"],\"register\":false}"
refused ',"formula":"shape ~ age","covariates":{"age":45}' 'the model was made of surfaces, which have none' "$(json .model.id)"
curl -fsS -X DELETE "$URL/v1/cohorts/norm"
post_json /v1/cohorts "{\"name\":\"norm\",\"members\":$(jq -c '.[1:18]' <<<"$MEMBERS")}"
refused ',"formula":"shape ~ age","covariates":{"age":45}' 'member 0 of the model, .* is not in the cohort norm any more'

stop_server || not_ok 'the server ends well'
done_testing

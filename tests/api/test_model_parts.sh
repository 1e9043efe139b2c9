#!/usr/bin/env bash
# test_model_parts.sh - models of several structures, against a live server: pca-parts keeps one; it is listed, read,
# taken by modes, sample, project and score, refused where another kind is needed, exported, imported and deleted; of one
# part it is the model of pca. What does not fit its parts is told by name.
# srnfd-test: plain-core (core/stats/test_train.c and test_standard.sh run its numerics)
# srnfd-test: once (models of the core have tests of their own in both builds)
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

# However busy the machine is, answers come with the result.
REQUEST_SECONDS=400
execute() { # PROCESS INPUTS
    post_json "/v1/processes/$1/execution" "{\"inputs\":$2}" --header 'Prefer: wait=300'
}

start_server "$SCRATCH/data" --workers 2 || exit 1

# Twelve subjects of two ellipsoids with bumps that follow no rule; both grow with age. The last two are no members: one
# alike, and one whose right part has a bump.
MEMBERS=$(python3 - "$URL" <<'PYTHON'
import json, math
from service import send

members, lmax = [], 4
for i in range(14):
    age = 40 + (i * 37 % 41)
    for part in ('left', 'right'):
        rows = {axis: [0.0] * (lmax + 1) ** 2 for axis in 'xyz'}
        rows['x'][3], rows['y'][1], rows['z'][2] = 1.0, 1.2 if part == 'left' else 1.5, 0.9 + 0.01 * age
        for axis in 'xyz':
            for k in range(4, 25):
                rows[axis][k] = 0.02 * math.sin(1.7 * (i + 0.3 * (part == 'left')) * k + ord(axis) * k * k)
        if i == 13 and part == 'right':
            rows['x'][6] += 0.4
        surface = send('/v1/surfaces', {'coefficients': {'lmax': lmax, **rows}})
        members.append({'id': surface['id'], 'subject': f's{i}', 'label': 'AB'[i % 2],
                        'covariates': {'part': part, 'age': age}})
print(json.dumps(members))
PYTHON
)
id() { # SUBJECT PART
    jq -r ".[2 * $1 + $2].id" <<<"$MEMBERS"
}
post_json /v1/cohorts "{\"name\":\"both\",\"members\":$(jq -c '.[:24]' <<<"$MEMBERS")}"
is "$STATUS" 201 'a cohort of two parts'
post_json /v1/cohorts "{\"name\":\"one\",\"members\":$(jq -c '[.[:24][] | select(.covariates.part == "left")]' <<<"$MEMBERS")}"

# ---- The model -----------------------------------------------------------------------------------------

execute pca-parts '{"cohort":"both","register":false,"modes":0}'
is "$STATUS" 200 'joint components'
cp "$BODY" "$SCRATCH/both.json"
MODEL=$(json .model.id)
is "$(json '[.model.kind, (.model.parts | map(.name) | join(" ")), .model.positions, .model.subjects] | tojson')" \
    '["parts","left right",null,12]' 'are kept as a model of parts'
is "$(json '.model.scores == .scores and .model.eigenvalues == .eigenvalues')" true 'with the same scores'
is "$(json '[.model.parts[].mean] == [.parts[].mean.id] and .model.mean.id == .parts[0].mean.id')" true 'and means'
is "$(json '.model.labels == .subjects and .model.groups == .groups and (.model.madeFrom.surfaces | length) == 24')" true \
    'of the subjects'
compare "$(json '[.model.parts[].size] | min')" '>' 1 'and the sizes of the parts'
execute pca-parts '{"cohort":"both","register":false,"modes":0,"weights":{"left":4,"right":4}}'
WEIGHTED=$(json .model.id)
isnt "$WEIGHTED" "$MODEL" 'other weights are another model'
get "/v1/models/$MODEL"
is "$STATUS" 200 'it is read'
is "$(json '.kind + " " + (.nTheta | tostring)')" 'parts 8' 'with the grid of its parts'
get '/v1/models'
is "$(json "[.items[] | select(.id == \"$MODEL\") | .kind, (.parts | length)] | tojson")" '["parts",2]' 'listed'
get "/v1/models/$MODEL/scores?format=csv"
is "$(wc -l <"$BODY")" 13 'its scores are a table of subjects'
get "/v1/models/$MODEL/modes?part=right"
is "$(json '[.nTheta, (.modes | length), (.modes[0] | length)] | tojson')" '[8,11,8]' 'the modes of a part'
cp "$BODY" "$SCRATCH/right.json"
get "/v1/models/$MODEL/modes?part=left"
is "$(jq -s '.[0].modes == .[1].modes' "$SCRATCH/right.json" "$BODY")" false 'are those of that part'
get "/v1/models/$MODEL/modes"
is_problem 422 invalid-input 'modes of no part'
like "$(json '.errors[0].detail')" 'is required: .*"left", "right"' 'names the parts'

# ---- Shapes --------------------------------------------------------------------------------------------

get "/v1/models/$MODEL/shape?coefficients=0&part=right"
is "$STATUS $(json .part)" '200 right' 'the mean of a part as a shape'
cp "$BODY" "$SCRATCH/shape.json"
get "/v1/surfaces/$(jq -r '.model.parts[1].mean' "$SCRATCH/both.json")/coefficients"
compare "$(jq -s '[.[0].surface.x, .[1].x] | transpose | map(.[0] - .[1] | fabs) | max' "$SCRATCH/shape.json" "$BODY")" \
    '<' 1e-4 'is that of the part'
get "/v1/models/$MODEL/shape?coefficients=2,-1&part=left&format=ply"
is "$STATUS" 200 'shapes are meshes as well'
get "/v1/models/$MODEL/shape?coefficients=2&part=left"
OFFSET=$(json .offset)
compare "$OFFSET" '>' 0 'how far a shape is from its point'
get "/v1/models/$WEIGHTED/shape?coefficients=2&part=left"
compare "$(jq -n "($(json .offset) - $OFFSET | fabs) / $OFFSET")" '<' 1e-6 'does not depend on what the parts weigh'
get "/v1/models/$MODEL/shape?coefficients=0"
is_problem 422 invalid-input 'a shape of no part'
get "/v1/models/$MODEL/shape?coefficients=0&part=middle"
like "$(json '.errors[0].detail')" 'none of the model.s parts: "left", "right"' 'or of none of its parts'
execute sample "{\"model\":\"$MODEL\",\"count\":2,\"seed\":5}"
is "$STATUS $(json '[(.surfaces | length), .parts, (.scores | length), (.relativeEnergy | length)] | tojson')" \
    '200 [4,["left","left","right","right"],2,4]' 'samples have all parts'
is "$(jq -s '[.[1].surfaces[].source.reference] == [.[0].model.parts[0, 0, 1, 1].mean]' "$SCRATCH/both.json" "$BODY")" true \
    'each from the mean of its part'
execute modes "{\"model\":\"$MODEL\",\"coefficients\":[-1,1]}"
is "$(json '.parts | tojson')" '["left","left","right","right"]' 'and so have modes'

# ---- One part ------------------------------------------------------------------------------------------

execute pca '{"cohort":"one","register":false}'
PLAIN=$(json .model.id)
execute pca-parts '{"cohort":"one","register":false,"modes":0}'
SINGLE=$(json .model.id)
execute project "{\"model\":\"$PLAIN\",\"surface\":\"$(id 12 0)\"}"
cp "$BODY" "$SCRATCH/plain.json"
is "$(json '[.parts, .position] | tojson')" '[null,null]' 'a surface has no parts'
execute project "{\"model\":\"$SINGLE\",\"parts\":{\"left\":\"$(id 12 0)\"}}"
is "$STATUS" 200 'a model of one part'
is "$(jq -s 'map({scores, residual, distance, mahalanobis, typicality}) | .[0] == .[1]' "$SCRATCH/plain.json" "$BODY")" true \
    'projects as pca does, to the last bit'
compare "$(json '.parts[0].mahalanobisShare - 1 | fabs')" '<' 1e-9 'all of it is that part'
execute score "{\"model\":\"$PLAIN\",\"surface\":\"$(id 12 0)\"}"
cp "$BODY" "$SCRATCH/plain.json"
execute score "{\"model\":\"$SINGLE\",\"parts\":{\"left\":\"$(id 12 0)\"}}"
is "$(jq -s 'map({percentile, ranks: (.ranks | del(.largestZ)), calibration}) | .[0] == .[1]' "$SCRATCH/plain.json" "$BODY")" true \
    'and scores as pca does'
is "$(jq -s 'map(.ranks.largestZ // .parts[0].largestZ) | .[0] == .[1]' "$SCRATCH/plain.json" "$BODY")" true 'with the same map'

# ---- Subjects of two parts -----------------------------------------------------------------------------

both() { # PROCESS SUBJECT [MORE]
    execute "$1" "{\"model\":\"$MODEL\",\"parts\":{\"right\":\"$(id "$2" 1)\",\"left\":\"$(id "$2" 0)\"}${3:-}}"
}
both project 3
is "$(json .trainingSubject)" true 'a member is known by all of its parts'
compare "$(jq -s '[.[0].scores[3], .[1].scores] | transpose | map(.[0] - .[1] | fabs) | max' "$SCRATCH/both.json" "$BODY")" \
    '<' 1e-9 'and has its scores'
compare "$(json .residual)" '<' 1e-6 'all of it is in the components'
cp "$BODY" "$SCRATCH/third.json"
execute project "{\"model\":\"$MODEL\",\"parts\":{\"left\":{\"href\":\"/v1/surfaces/$(id 3 0)\"},\"right\":{\"value\":\"$(id 3 1)\"}}}"
is "$(jq -s 'map(.scores) | .[0] == .[1]' "$SCRATCH/third.json" "$BODY")" true 'its parts may be links, and values with a name'
post_json /v1/surfaces "$(jq -nc '[range(36) | 0] as $no | {coefficients:{lmax:5,x:($no | .[3] = 1),y:($no | .[1] = 1.2),z:($no | .[2] = 1.3)}}')"
FINER=$(json .id)
execute project "{\"model\":\"$MODEL\",\"parts\":{\"left\":\"$FINER\",\"right\":\"$(id 4 1)\"}}"
is "$(json '[.warnings[] | select(.code == "mixed-degrees") | .figures | [.lowest, .highest]] | tojson')" '[[4,5]]' 'a part of another degree is told'
execute project "{\"model\":\"$MODEL\",\"parts\":{\"left\":\"$(id 3 0)\",\"right\":\"$(id 4 1)\"}}"
is "$(json .trainingSubject)" false 'parts of two members are no member'
both project 13
is "$STATUS" 200 'another subject'
compare "$(json '([.parts[].distance | . * .] | add) / (.distance * .distance) - 1 | fabs')" '<' 1e-9 \
    'squares of distances of the parts add up'
compare "$(json '([.parts[].residual | . * .] | add) / (.residual * .residual) - 1 | fabs')" '<' 1e-6 'so do residuals'
compare "$(json '([.parts[].mahalanobisShare] | add) - 1 | fabs')" '<' 1e-9 'and shares of the Mahalanobis distance'
is "$(json '.parts | map(.name) | join(" ")')" 'left right' 'in the order of the model'
compare "$(json '.parts[1].residual / .parts[0].residual')" '>' 2 'what is odd is in the part with the bump'
is "$(json '[.warnings[].code] | index("far-from-model") != null')" true 'and warned of'
both score 12
is "$STATUS" 200 'a subject beside the norm'
compare "$(json .pValue)" '>' 0.05 'one alike is not odd'
is "$(json '[.zMap, (.parts | map(.zMap.maps | sort | join(" ")) | unique)] | tojson')" \
    '[null,["deviation significance spread zScore"]]' 'each part has its map'
is "$(json '[.calibration.subjects, .subjects] | tojson')" '[12,12]' 'percentiles were tried'
both score 13 ',"map":false'
compare "$(json .percentile)" '>' 90 'a bump is odd'
is "$(json '[.parts[].zMap] | tojson')" '[null,null]' 'maps are left out on demand'
both score 12 ',"map":false,"formula":"shape ~ age","covariates":{"age":60}'
is "$STATUS $(json '.at | tojson')" '200 {"age":60}' 'covariates of the subjects count'
both score 3 ',"map":false'
is "$(json '[.trainingSubject, .subjects] | tojson')" '[true,11]' 'a member is left out'

# ---- Registered, of meshes, with positions -------------------------------------------------------------

post_json /v1/cohorts "{\"name\":\"few\",\"members\":$(jq -c '.[:12]' <<<"$MEMBERS")}"
execute pca-parts '{"cohort":"few","modes":0,"commonPose":true,"maxIterations":2}'
REGISTERED=$(json .model.id)
cp "$BODY" "$SCRATCH/registered.json"
execute project "{\"model\":\"$REGISTERED\",\"parts\":{\"left\":\"$(id 5 0)\",\"right\":\"$(id 5 1)\"}}"
is "$(json '[.trainingSubject, .parts[0].residual] | tojson')" '[true,null]' 'a registered member'
is "$(jq -s '.[0].scores[5] == .[1].scores' "$SCRATCH/registered.json" "$BODY")" true 'has the scores of the model'
execute project "{\"model\":\"$REGISTERED\",\"parts\":{\"left\":\"$(id 12 0)\",\"right\":\"$(id 12 1)\"}}"
is "$(json '.parts | map(.distance < .distanceBefore) | all')" true 'others are registered part by part'
like "$(json '.typicality.angle | type')" object 'in a pose that is judged'
PLACED=()
for side in L R; do
    for name in thalamus putamen; do
        post "/v1/meshes" --data-binary "@tests/data/aal_subcortex/${side}_$name.ply"
        MESH=$(json .id)
        execute encode "{\"mesh\":\"$MESH\",\"lmax\":4,\"mirror\":$([ $side = R ] && echo true || echo false)}"
        PLACED+=("{\"id\":\"$(json .surface.id)\",\"subject\":\"$side\",\"covariates\":{\"part\":\"$name\"}}")
        [ $side = L ] && declare "$name=$MESH"
    done
done
post_json /v1/cohorts "{\"name\":\"placed\",\"members\":[$(IFS=,; echo "${PLACED[*]}")]}"
execute pca-parts '{"cohort":"placed","register":false,"modes":0,"relativePose":true}'
is "$STATUS $(json '.model.positions.mean == .positions.mean')" '200 true' 'a model with positions keeps them'
PLACES=$(json .model.id)
# shellcheck disable=SC2154 # declared above
execute project "{\"model\":\"$PLACES\",\"parts\":{\"thalamus\":\"$(jq -r .id <<<"${PLACED[0]}")\",\"putamen\":\"$(jq -r .id <<<"${PLACED[1]}")\"}}"
is "$(json .trainingSubject)" true 'a member with positions'
compare "$(json .residual)" '<' 1e-6 'lies in its model'
compare "$(json .position.distance)" '>' 0 'with its positions'
# shellcheck disable=SC2154
execute project "{\"model\":\"$PLACES\",\"parts\":{\"thalamus\":\"$thalamus\",\"putamen\":\"$putamen\"},\"handedness\":\"ignore\"}"
is "$STATUS" 200 'meshes are encoded'
compare "$(json .position.residual)" '<' 0.01 'and placed where they are'
compare "$(json .residual)" '<' 0.3 'near to the member that they are'
execute project "{\"model\":\"$PLACES\",\"parts\":{\"thalamus\":\"$(jq -r '.parts[0].mean.id' "$SCRATCH/both.json")\",\"putamen\":\"$(id 1 1)\"}}"
is_problem 422 invalid-input 'a surface without a place'
like "$(json .detail)" 'has no place' 'is told'

# ---- What does not fit ---------------------------------------------------------------------------------

refused() { # PROCESS INPUTS REGEX NAME
    execute "$1" "$2"
    is_problem 422 invalid-input "$4"
    like "$(json '.errors | map(.pointer + " " + .detail) | join("; ")')" "$3" 'in words'
}
A=$(id 12 0) B=$(id 12 1)
refused project "{\"model\":\"$MODEL\",\"surface\":\"$A\"}" \
    '/inputs/surface is one surface: .* several structures, .* of "left", "right"' 'one surface of several parts'
refused project "{\"model\":\"$MODEL\",\"parts\":{\"l~/r\":7}}" '/inputs/parts/l~0~1r must' 'a name with a slash and a tilde'
refused score "{\"model\":\"$MODEL\"}" '/inputs/parts is required' 'nothing'
refused project "{\"model\":\"$PLAIN\",\"parts\":{\"left\":\"$A\"}}" '/inputs/parts must be left out' 'parts of one structure'
refused project "{\"model\":\"$PLAIN\"}" '/inputs/surface is required' 'no surface'
refused score "{\"model\":\"$MODEL\",\"parts\":{\"left\":\"$A\",\"middle\":\"$B\"}}" \
    'has no "right".*has "middle", which is none' 'a wrong name'
refused project "{\"model\":\"$MODEL\",\"parts\":{\"left\":\"$A\"}}" 'has no "right": .* each is needed' 'a part too few'
refused project "{\"model\":\"$MODEL\",\"parts\":{}}" 'object of 1 to 32' 'no parts'
refused project "{\"model\":\"$MODEL\",\"parts\":[\"$A\",\"$B\"]}" 'object of 1 to 32' 'parts without names'
refused project "{\"model\":\"$MODEL\",\"parts\":{\"left\":7,\"right\":\"$B\"}}" '/inputs/parts/left must be the id' 'no id'
refused project "{\"model\":\"$MODEL\",\"surface\":\"$A\",\"parts\":{\"left\":\"$A\",\"right\":\"$B\"}}" \
    '/inputs/surface must be left out where parts' 'both'
refused evaluate-model "{\"model\":\"$MODEL\",\"samples\":2}" 'is a model of several structures' 'where one structure is needed'
refused predict "{\"model\":\"$MODEL\",\"surfaces\":[\"$A\"]}" 'is a model of several structures' 'or a classifier'
execute project "{\"model\":\"$MODEL\",\"parts\":{\"left\":\"$A\",\"right\":\"surf-00000000000000000000000000000000\"}}"
is_problem 404 no-such-surface 'a surface that there is not'

# ---- Kept like others ----------------------------------------------------------------------------------

MEAN=$(jq -r '.model.parts[1].mean' "$SCRATCH/both.json")
request DELETE "/v1/surfaces/$MEAN"
is "$STATUS" 409 'the mean of every part stays as long as the model'
curl -sf "$URL/v1/models/$MODEL/export" >"$SCRATCH/study.zip"
start_server "$SCRATCH/second" || exit 1
post '/v1/imports' --data-binary "@$SCRATCH/study.zip" --header 'Content-Type: application/zip'
like "$STATUS" '^20' 'an export of the model is imported elsewhere'
get "/v1/models/$MODEL/shape?coefficients=0&part=right"
is "$(jq -s '.[0].surface == .[1].surface' "$SCRATCH/shape.json" "$BODY")" true 'where it has the same shapes'
both project 3
is "$(json .trainingSubject)" true 'and knows its members'

tests/support/forge_model.py "$SCRATCH/study.zip" "$SCRATCH/forged.zip" replace \
    '"name": *"right"' '"name":"left"' >"$SCRATCH/forged"
post '/v1/imports' --data-binary "@$SCRATCH/forged.zip" --header 'Content-Type: application/zip'
is "$STATUS $(json '.refused[0] | "\(.code) \(.file)"')" '422 not-as-described srnfd-study.json' \
    'one with two parts of one name is refused'
like "$(json '.refused[0].detail')" '^model-.* cannot be used: two of its parts are called "left"$' \
    'by what is wrong with it'

# A file that somebody made may name a mean of another degree than the model's.
post_json /v1/surfaces "$(jq -nc '[range(36) | 0] as $no | {coefficients:{lmax:5,x:($no | .[3] = 1),y:($no | .[1] = 1),z:($no | .[2] = 1)}}')"
SMALL=$(json .id)
stop_server
cp "$SCRATCH/second/srnfd.db" "$SCRATCH/sound.db"
sqlite3 "$SCRATCH/second/srnfd.db" "UPDATE model SET record = replace(record, '$MEAN', '$SMALL') WHERE id = '$MODEL'"
start_server "$SCRATCH/second" || exit 1
get "/v1/models/$MODEL/shape?coefficients=0&part=right"
is_problem 500 data-damaged 'a part whose mean is of another degree has no shape'
execute modes "{\"model\":\"$MODEL\",\"coefficients\":[0]}"
is_problem 500 data-damaged 'and no modes'
execute sample "{\"model\":\"$MODEL\",\"count\":1}"
is_problem 500 data-damaged 'nor samples'
stop_server
cp "$SCRATCH/sound.db" "$SCRATCH/second/srnfd.db"
start_server "$SCRATCH/second" || exit 1
request DELETE "/v1/models/$MODEL?cascade=true"
like "$STATUS" '^20' 'and is deleted'
get "/v1/models/$MODEL"
is_problem 404 no-such-model 'it is gone'
done_testing

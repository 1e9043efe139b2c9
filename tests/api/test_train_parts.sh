#!/usr/bin/env bash
# test_train_parts.sh - classifiers of several structures of each subject: their folds say what those of classify-parts
# say, to the last bit, the model is kept, listed, exported and read, predict asks it about subjects by their parts or by
# a cohort, with sizes and covariates where it takes them, and what is wrong is told by name.
# srnfd-test: release-only
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400
WAIT='Prefer: wait=300'

start_server "$SCRATCH/data" --workers 2 || exit 1
# Eighteen subjects of two labels; ten are trained on. What bumps both parts tells the label, what bumps one and dents
# the other says nothing. The second part of one label is larger, and those of that label are older.
python3 - "$URL" 18 >"$SCRATCH/members.json" <<'PYTHON'
import json, random, sys
from service import send

lmax = 4
random.seed(3)
def surface(bump, part, scale):
    rows = {axis: [0.0] * (lmax + 1) ** 2 for axis in 'xyz'}
    rows['x'][3], rows['y'][1], rows['z'][2] = (1.5, 1.2, 1.0) if part else (1.1, 1.0, 1.6)
    for axis, k in (('x', 12), ('y', 10), ('z', 6)):
        rows[axis][k] = bump
    for axis in 'xyz':
        for k in range(4, 9):
            rows[axis][k] += random.gauss(0, 0.004)
    return send('/v1/surfaces', {'coefficients': {'lmax': lmax, **{a: [scale * x for x in r] for a, r in rows.items()}}})['id']

members = []
for s in range(int(sys.argv[2])):
    label = s % 2
    together, apart = (0.05 if label else -0.05) + random.gauss(0, 0.01), random.gauss(0, 0.09)
    for part in (0, 1):
        members.append({'id': surface(together + (apart if part else -apart), part, 1 + 0.3 * label * part + 0.01 * (s % 5)),
                        'subject': f's{s}', 'label': ('low', 'high')[label],
                        'covariates': {'part': ('first', 'second')[part], 'age': 40 + 20 * label + s % 5}})
print(json.dumps(members))
PYTHON
cohort() { # NAME FILTER
    curl -sS -X DELETE "$URL/v1/cohorts/$1" -o "$SCRATCH/ignored"
    jq -c "{name: \"$1\", members: ($2)}" "$SCRATCH/members.json" >"$SCRATCH/cohort.json"
    post_json /v1/cohorts "@$SCRATCH/cohort.json"
}
run() { # PROCESS INPUTS [MORE]
    execute "$1" "$(jq -c ". + {${3-}}" <<<"$2")" -H "$WAIT"
}
train() { # COHORT [MORE] [PROCESS]
    run "${3:-train-parts}" "{\"cohort\":\"$1\",\"commonPose\":true,\"components\":2,\"covariance\":\"pooled\"}" "${2-}"
}
predict() { # MODEL MORE
    run predict "{\"model\":\"$1\"}" "$2"
}
parts_of() { # SUBJECT: what predict takes
    jq -c "[.[] | select(.subject == \"$1\")] | map({(.covariates.part): .id}) | add" "$SCRATCH/members.json"
}
EVIDENCE='[.perSubject[] | .predicted, (.logLikelihoods // .nearestDistances)]'

# ---- train-parts ---------------------------------------------------------------------------------------

# The members of the second part first, and in another order.
cohort known '.[:20] | [.[5:][], .[:5][]]'
train known '"weights":{"first":2}'
is "$STATUS $(json .model.kind)" '200 classifier' 'a classifier of two structures'
MODEL=$(json .model.id)
cp "$BODY" "$SCRATCH/trained.json"
is "$(json '[.subjects, .members, (.perSubject | length), .lmax, .features] | tojson')" '[10,null,10,4,[]]' 'of subjects'
is "$(json '[.parts[] | .name, .weight] | tojson')" '["second",1,"first",2]' 'whose parts are in the order of the cohort, with their weights'
is "$(json '[.model.parts == .parts, .model.positions, .model.classifier.template] | tojson')" '[true,null,null]' 'and in the record'
is "$(json '[.parts[] | (.template.surface, .mean) | startswith("surf-")] | all')" true 'with a template and a mean of each'
is "$(json '[.model.subjects, (.model.scores | length), .model.groups[:2]] | tojson')" '[10,10,["low","high"]]' \
    'scores are of subjects'
is "$(json '[.warnings[]?.code | select(. == "far-from-group")] | length')" 0 'and all subjects belong together'
post_json /v1/surfaces "$(jq -nc '[range(25) | 0] | {coefficients: {lmax: 4, x: (.[3] = 1), y: (.[1] = 1), z: (.[2] = 0.1)}}')"
cohort odd ".[:20] | .[0].id = \"$(json .id)\""
train odd '"method":"srnf-nn"'
is "$(json '[.warnings[]? | select(.code == "far-from-group") | .figures | .part, .member] | tojson')" '["first",0]' \
    'a structure that is unlike those of all others is told of'
is "$(json '.model.mean.id == .model.parts[0].mean')" true 'the mean is that of the first'
compare "$(json .validation.accuracy.value)" '>=' 0.9 'which tell the label together'
is "$(json '[.perSubject[] | .probabilities | add | . > 1 - 1e-12 and . < 1 + 1e-12] | all')" true 'probabilities sum to 1'
train known '"weights":{"first":2},"method":"srnf-nn"'
cp "$BODY" "$SCRATCH/neighbours.json"
NEAREST=$(json .model.id)
train known '"weights":{"first":2},"method":["srnf-gauss","srnf-nn"]' classify-parts
for FILE in srnf-gauss:trained srnf-nn:neighbours; do
    is "$(jq -s "(.[0] | $EVIDENCE) == (.[1].methods[\"${FILE%:*}\"] | $EVIDENCE)" "$SCRATCH/${FILE#*:}.json" "$BODY")" true \
        "${FILE%:*}: the folds say what those of classify-parts say, to the last bit"
done

cohort one '.[:20] | [.[] | select(.covariates.part == "first")]'
train one '' train
cp "$BODY" "$SCRATCH/train.json"
train one
is "$(jq -s "[.[] | $EVIDENCE, [.perSubject[].probabilities], .validation.brier, .relativeEnergy // .parts[0].relativeEnergy] | .[:4] == .[4:]" \
    "$SCRATCH/train.json" "$BODY")" true 'one structure is train, to the last bit'
is "$(jq -s '[.[].model | .eigenvalues, .scores] | .[:2] == .[2:]' "$SCRATCH/train.json" "$BODY")" true 'and so is its model'

# ---- predict -------------------------------------------------------------------------------------------

cohort others '.[24:] | [.[3:][], .[:3][]]'
predict "$MODEL" '"cohort":"others"'
is "$STATUS $(json '[.predictions[].subject] | sort | tojson')" '200 ["s12","s13","s14","s15","s16","s17"]' 'subjects of a cohort'
is "$(json '[.predictions[] | .label == .truth] | all') $(json '.assessment.accuracy.value')" 'true 1' 'are told'
is "$(json '[.predictions[] | .surface, (.parts | map(.name) | join(" "))] | unique | tojson')" '[null,"second first"]' \
    'each with its parts'
is "$(json '[.predictions[] | ([.parts[].distance | . * .] | add | sqrt) - .typicality.distance.value | fabs < 1e-12] | all')" true \
    'whose distances add up'
is "$(json '[.predictions[] | .trainingSubject] | any') $(json '[.warnings[].code] | index("far-from-model")')" 'false null' \
    'none was trained on or is far from all'
cp "$BODY" "$SCRATCH/others.json"
told() { # SUBJECT FILTER: of the cohort
    jq -c ".predictions[] | select(.subject == \"$1\") | $2" "$SCRATCH/others.json"
}
predict "$MODEL" "\"parts\":$(parts_of s15)"
is "$STATUS $(json '.predictions[0].probabilities | tojson')" "200 $(told s15 .probabilities)" 'one subject gets what it got among others'
is "$(json '.predictions[0].parts | map(.surface) | tojson')" "$(parts_of s15 | jq -c '[.second, .first]')" 'by its parts'
predict "$MODEL" "\"parts\":[$(parts_of s12),$(parts_of s3)]"
is "$(json '.predictions[0].probabilities | tojson')" "$(told s12 .probabilities)" 'so do several'
is "$(json '[.predictions[].trainingSubject] | tojson')" '[false,true]' 'one that was trained on is known'
is "$(json '[.predictions[].warnings[].code] | tojson')" '["training-subject"]' 'and told'
FOREIGN=$(jq -c '[.[] | select(.subject == "s13").id] | {first: .[1], second: .[0]}' "$SCRATCH/members.json")
predict "$MODEL" "\"parts\":$FOREIGN"
is "$STATUS $(json '[.predictions[0].warnings[].code] | tojson')" '200 ["far-from-model"]' 'exchanged parts are far from all'
like "$(json '.predictions[0].warnings[0].detail')" '^Subject 0 ' 'as a subject'
predict "$MODEL" "\"parts\":$(jq -c '.second = .first' <<<"$FOREIGN")"
is "$STATUS $(json '[.warnings[] | select(.code == "duplicate-content") | .figures.parts] | tojson')" '200 [["second","first"]]' \
    'one surface as two parts is told'
predict "$NEAREST" '"cohort":"others","priors":{"low":0.5,"high":0.5}'
is "$STATUS $(json '[.predictions[] | .nearestDistances[.label] == ([.nearestDistances[]] | min)] | all')" '200 true' 'neighbours, too'
cohort named '.[24:] | map(.covariates = {organ: .covariates.part} | del(.label))'
predict "$MODEL" '"cohort":"named","by":"organ"'
is "$STATUS $(jq -s 'map([.predictions[] | {subject, probabilities}] | sort_by(.subject)) | .[0] == .[1]' "$BODY" "$SCRATCH/others.json")" \
    '200 true' 'by another covariate, without labels'
is "$(json .assessment) $(json '[.warnings[].code] | index("not-assessed")')" 'null null' 'which cannot be assessed, nor need be told'

# ---- A structure that was segmented anew ---------------------------------------------------------------

get "/v1/surfaces/$(jq -r '.[5].id' "$SCRATCH/members.json")/coefficients"
post_json /v1/surfaces "$(jq -c '{coefficients: {lmax, x: (.x | .[7] += 0.002), y, z}}' "$BODY")"
cohort again ".[24:] + [.[4], (.[5] | .id = \"$(json .id)\")]"
predict "$MODEL" '"cohort":"again"'
is "$STATUS $(json '[.warnings[] | select(.code == "training-subject") | .figures | [.member, .parts, .part]] | tojson')" '200 [[6,1,"first"]]' \
    'a subject that it was trained on is known by one part'
is "$(json '[.predictions[6].trainingSubject, .assessment.members] | tojson')" '[false,6]' 'and is not counted in the assessment'

# ---- Sizes and covariates ------------------------------------------------------------------------------

train known '"components":1,"scale":"shape-and-size","covariates":["age"]'
is "$STATUS $(json '[.features, .model.classifier.features.names, (.model.classifier.features.values | map(length) | unique)] | tojson')" \
    '200 [["size of second","size of first","age"],["size of second","size of first","age"],[3]]' 'numbers beside shape'
AGED=$(json .model.id)
predict "$AGED" '"cohort":"others"'
is "$STATUS $(json '.assessment.accuracy.value') $(json '[.predictions[] | select(.subject == "s15").numbers | .age, (."size of second" > 1)] | tojson')" \
    '200 1 [60,true]' 'are read of the members'
cp "$BODY" "$SCRATCH/others.json"
predict "$AGED" "\"parts\":[$(parts_of s15),$(parts_of s15)],\"covariates\":[{\"age\":60},{\"age\":99}]"
is "$STATUS $(json '.predictions[0].probabilities | tojson')" "200 $(told s15 .probabilities)" 'or given'
is "$(json '[.predictions[] | [.warnings[] | select(.code == "extrapolated" and .figures.covariate == "age").figures.value]] | tojson')" \
    '[[],[99]]' 'and told where they are beyond those'

# ---- Sizes in other units ------------------------------------------------------------------------------

# Meshes of six subjects, whose second part is twenty times as large as their first; of one a hundred times that.
scaled() { # SUBJECT PART FACTOR: the id of a mesh
    get "/v1/surfaces/$(parts_of "$1" | jq -r ".$2")/mesh?format=obj&resolution=8"
    awk -v by="$3" '/^v / {printf "v %.9g %.9g %.9g\n", by * $2, by * $3, by * $4; next} /^f/' "$BODY" >"$SCRATCH/scaled.obj"
    post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/scaled.obj"
    json .id
}
for SUBJECT in 12 13 14 15 16 17; do
    printf '{"first":"%s","second":"%s"}\n' "$(scaled "s$SUBJECT" first 1)" \
        "$(scaled "s$SUBJECT" second "$([ "$SUBJECT" = 15 ] && echo 2000 || echo 20)")"
done >"$SCRATCH/scaled.jsonl"
sized() { # NAME HOW-MANY: a cohort of them
    post_json /v1/cohorts "$(jq -sc --arg name "$1" --argjson n "$2" '{name: $name, members: [to_entries[:$n][] | .key as $s | .value | to_entries[] |
        {id: .value, subject: "t\($s)", label: (if $s % 2 == 0 then "low" else "high" end), covariates: {part: .key}}]}' "$SCRATCH/scaled.jsonl")"
}
UNITS='[.warnings[] | select(.code == "mixed-units") | .figures | [.part, .members]] | tojson'
predict "$MODEL" "\"handedness\":\"ignore\",\"parts\":$(jq -sc '.[:4]' "$SCRATCH/scaled.jsonl")"
is "$STATUS $(json "$UNITS")" '200 [["second",[3]]]' 'sizes are held against those of the same part'
sized four 4
predict "$MODEL" '"handedness":"ignore","cohort":"four"'
is "$STATUS $(json "$UNITS")" '200 [["second",[3]]]' 'as in a cohort'
sized six 6
run classify-parts '{"cohort":"six","commonPose":true,"method":"srnf-nn","scale":"shape-and-size","lmax":4}'
is "$STATUS $(json "$UNITS")" '200 [["second",null]]' 'and where they count'

# ---- The model -----------------------------------------------------------------------------------------

get "/v1/models/$MODEL"
is "$STATUS $(json '[.kind, (.parts | length), .nTheta < 20] | tojson')" '200 ["classifier",2,true]' 'the model is read'
get '/v1/models'
is "$(json "[.items[] | select(.id == \"$MODEL\") | .kind, .classifier.means, (.parts | length)] | tojson")" '["classifier",null,2]' \
    'and listed'
get "/v1/models/$MODEL/modes?part=first"
is "$STATUS" 200 'with the modes of a part'
for SURFACE in $(jq -r '.parts[] | .template.surface, .mean' "$SCRATCH/trained.json" | tail -2); do
    request DELETE "/v1/surfaces/$SURFACE"
    is "$STATUS" 409 'template and mean of a part stay as long as their model'
done
refused() { # PROCESS INPUTS POINTER DETAIL WHAT
    execute "$1" "$2" -H "$WAIT"
    is "$STATUS" 422 "refused: $5"
    like "$(json "[.errors[]? | select(.pointer == \"$3\") | .detail] | join(\"; \")")" "$4" "  at $3"
}
refused score "{\"model\":\"$MODEL\",\"parts\":$(parts_of s15)}" /inputs/model 'is a classifier, made by train or train-parts, which predict takes' \
    'score takes no classifier'

# ---- What is wrong -------------------------------------------------------------------------------------

wrong() { # PART-OF-PREDICT POINTER DETAIL WHAT
    refused predict "{\"model\":\"$MODEL\",$1}" "$2" "$3" "$4"
}
S15=$(parts_of s15)
SURFACE=$(jq -r .first <<<"$S15")
wrong "\"parts\":{\"first\":\"$SURFACE\"}" /inputs/parts 'has no "second": the model.s parts are "second", "first", and each is needed' 'a part is missing'
wrong "\"parts\":[$S15,{\"first\":\"$SURFACE\"}]" /inputs/parts/1 'has no "second"' 'of the second subject'
wrong "\"parts\":$(jq -c ".third = \"$SURFACE\"" <<<"$S15")" /inputs/parts 'has "third", which is none of the model.s parts: "second", "first"' 'an unknown part'
wrong '"parts":[]' /inputs/parts 'list of 1 to' 'no subject'
wrong '"parts":"first"' /inputs/parts 'must be an object' 'a text'
wrong '"parts":{"first":"mesh","second":"mesh"}' /inputs/parts/first 'id' 'no ids'
wrong "\"parts\":$S15,\"cohort\":\"others\"" /inputs/cohort 'left out where parts is given' 'parts and a cohort'
wrong "\"parts\":$S15,\"surfaces\":[\"$SURFACE\"]" /inputs/surfaces 'left out where parts is given' 'parts and surfaces'
wrong "\"parts\":$S15,\"by\":\"part\"" /inputs/by 'names the parts of a cohort' 'by without a cohort'
wrong "\"surfaces\":[\"$SURFACE\"]" /inputs/surfaces 'of several structures, and needs parts, a surface for each of "second", "first", or a cohort' 'single surfaces'
wrong "\"parts\":$S15,\"covariates\":[{\"age\":4}]" /inputs/covariates 'takes none' 'covariates of no use'
refused predict "{\"model\":\"$AGED\",\"parts\":$S15}" /inputs/covariates 'for 0 subjects; there is 1, and the classifier needs 1 covariate of each, "age"' 'no covariates'
ONE=$(jq -r .model.id "$SCRATCH/train.json")
refused predict "{\"model\":\"$ONE\",\"parts\":$S15}" /inputs/parts 'left out: the classifier is of one structure' 'parts for one structure'
refused predict "{\"model\":\"$ONE\",\"surfaces\":[\"$SURFACE\"],\"by\":\"part\"}" /inputs/by 'of one structure' 'by for one structure'
cohort wrong '.[24:] | del(.[3])'
wrong '"cohort":"wrong"' /inputs/cohort 'subject "s13" has no member of part "second"' 'a member without its other part'
cohort wrong '.[24:] | .[2].covariates.part = "third"'
wrong '"cohort":"wrong"' /inputs/cohort 'is part "third", which is none of the model.s parts: "second", "first"' 'a member that is another part'
cohort wrong '.[24:] | map(del(.covariates.part))'
wrong '"cohort":"wrong"' /inputs/cohort 'has no covariate "part"' 'members that do not say'
cohort wrong '.[24:] | .[0].label = "high" | .[1].label = "low"'
wrong '"cohort":"wrong"' /inputs/cohort 'subject "s12" has members of different labels: give all its parts one' 'a subject of two labels'
refused predict "{\"model\":\"$AGED\",\"cohort\":\"named\",\"by\":\"organ\"}" /inputs/cohort 'subject "s12" has no covariate "age"' 'members without covariates'
cohort few '.[:16]'
refused train-parts '{"cohort":"few"}' /inputs/cohort 'has 4 subjects .* with the label .low.; each label needs 5' 'too few subjects'
cohort wrong '.[:24] | map(.covariates["size of first"] = .covariates.age)'
refused train-parts '{"cohort":"wrong","scale":"shape-and-size","covariates":["size of first"]}' /inputs/covariates/0 'is what a size is called' \
    'a covariate that is called as a size'
refused train-parts '{"cohort":"known","components":8}' /inputs/components 'covariance of 8 features' 'more components than are determined'
refused train-parts '{"cohort":"known","weights":{"third":1}}' /inputs/weights 'names "third"' 'a weight of no part'
refused train-parts '{"cohort":"known","weights":{"first":0}}' /inputs/weights 'above 0' 'no weight'

# ---- Away and back -------------------------------------------------------------------------------------

curl -sf "$URL/v1/models/$NEAREST/export" >"$SCRATCH/nearest.zip"
is "$(unzip -p "$SCRATCH/nearest.zip" srnfd-study.json | jq -c '[[.models[].id], [.jobs[].process | select(. != "encode")]]')" \
    "[[\"$NEAREST\"],[\"train-parts\"]]" 'an export has one model, though another has the means of its parts too'
curl -sf "$URL/v1/models/$MODEL/export" >"$SCRATCH/study.zip"
predict "$MODEL" "\"parts\":$S15"
PROBABILITIES=$(json '.predictions[0].probabilities | tojson')
cohort others '.[24:]'
curl -sf "$URL/v1/cohorts/others/export" >"$SCRATCH/others.zip"
start_server "$SCRATCH/second" || exit 1
for FILE in study others; do
    post '/v1/imports' --data-binary "@$SCRATCH/$FILE.zip" --header 'Content-Type: application/zip'
    like "$STATUS" '^20' 'an export is imported elsewhere'
done
predict "$MODEL" "\"parts\":$S15"
is "$STATUS $(json '.predictions[0].probabilities | tojson')" "200 $PROBABILITIES" 'where it says the same'

# What somebody made of a record that a file may have, and how it is asked differently each time.
damaged() { # SQL-OF-RECORD PRIOR WHAT
    stop_server
    cp "$SCRATCH/sound.db" "$SCRATCH/second/srnfd.db"
    sqlite3 "$SCRATCH/second/srnfd.db" "UPDATE model SET record = $1 WHERE id = '$MODEL'"
    start_server "$SCRATCH/second" || exit 1
    predict "$MODEL" "\"parts\":$S15,\"priors\":{\"low\":$2,\"high\":$(jq -n "1 - $2")}"
    is_problem 500 data-damaged "refused: $3"
}
post_json /v1/surfaces "$(jq -nc '[range(36) | 0] as $no | {coefficients:{lmax:5,x:($no | .[3] = 1),y:($no | .[1] = 1),z:($no | .[2] = 1)}}')"
SMALL=$(json .id)
stop_server
cp "$SCRATCH/second/srnfd.db" "$SCRATCH/sound.db"
damaged "json_set(record, '\$.parts[1].weight', -1)" 0.1 'a weight below 0'
damaged "json_remove(record, '\$.parts[1].template')" 0.2 'a part without a template'
damaged "json_set(record, '\$.parts[1].template.surface', '$SMALL')" 0.3 'a template of another degree'
damaged "json_set(record, '\$.classifier.means', json('[[1]]'))" 0.4 'means of another length'
damaged "json_set(record, '\$.classifier.calibration.targets[0]', 0)" 0.7 'a calibration that divides by 0'
damaged "json_set(record, '\$.positions', json('{\"weight\": 1}'))" 0.6 'positions, which a classifier has not'
done_testing

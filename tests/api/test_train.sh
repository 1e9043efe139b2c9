#!/usr/bin/env bash
# test_train.sh - classifiers that are kept, against a live server: trained on half of a cohort, asked about the other
# half, about one surface and about one that is like none; as models they are listed, read, refused where another kind
# is needed, exported, imported and deleted. Under a sanitizer a training takes longer than an answer waits, and
# core/stats/test_train.c does the same.
# srnfd-test: release-only
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400
WAIT='Prefer: wait=300' # however busy the machine is

start_server "$SCRATCH/data" || exit 1

# ---- Shapes --------------------------------------------------------------------------------------------

# Ellipsoids of degree 4 with bumps that differ; those of one kind are flatter than those of the other. NUMBER KIND
shape() {
    awk -v seed="$1" -v kind="$2" 'BEGIN {
        srand(1000 * seed + 7)
        split("x y z", names, " ")
        printf "{\"name\":\"%s %d\",\"coefficients\":{\"lmax\":4", kind, seed
        for (axis = 1; axis <= 3; axis++) {
            for (k = 0; k < 25; k++) f[k] = k > 3 ? 0.02 * (rand() - 0.5) : 0
            f[axis == 1 ? 3 : axis == 2 ? 1 : 2] = axis == 1 ? 1.3 : axis == 2 ? 1 : kind == "flat" ? 0.68 : kind == "round" ? 0.8 : 0.2
            if (kind == "strange") f[20] = f[12] = 0.3
            printf ",\"%s\":[%.6f", names[axis], f[0]
            for (k = 1; k < 25; k++) printf ",%.6f", f[k]
            printf "]"
        }
        print "}}"
    }'
}
declare -a SURFACES
for i in $(seq 0 23); do
    KIND=$([ $((i % 2)) = 0 ] && echo round || echo flat)
    post_json /v1/surfaces "$(shape "$i" "$KIND")"
    SURFACES+=("$(json .id)")
done
is "$STATUS ${#SURFACES[@]}" '201 24' 'two dozen shapes of two kinds'
post_json /v1/surfaces "$(shape 99 strange)"
STRANGE=$(json .id)

cohort() { # NAME FROM TO
    printf '%s\n' "${SURFACES[@]:$2:$(($3 - $2))}" | jq -Rnc --arg name "$1" \
        '{name: $name, members: [inputs] | to_entries | map({id: .value, label: (if .key % 2 == 0 then "round" else "flat" end)}) | .}'
}
post_json /v1/cohorts "$(cohort half 0 12)"
is "$STATUS" 201 'half of them are trained on'
post_json /v1/cohorts "$(cohort other 12 24)"

# ---- train ---------------------------------------------------------------------------------------------

post_json /v1/cohorts "$(cohort odd 0 10 | jq -c --arg id "$STRANGE" '.members += [{id: $id, label: "round"}]')"
execute train '{"cohort":"odd","method":"srnf-nn","commonPose":true}' -H "$WAIT"
is "$STATUS $(json '[.warnings[]? | select(.code == "far-from-group") | .figures.member] | tojson')" '200 [10]' 'a member that does not is told of'
request DELETE "/v1/models/$(json .model.id)?cascade=true"

execute train '{"cohort":"half"}' -H "$WAIT"
is "$STATUS $(json .model.kind)" '200 classifier' 'a classifier is made'
MODEL=$(json .model.id)
cp "$BODY" "$SCRATCH/trained.json"
is "$(json '.validation | [.members, .subjects, .majorityRate, .chance] | tojson')" '[12,12,0.5,0.5]' 'it is validated on all'
is "$(json '[.warnings[]?.code | select(. == "far-from-group")] | length')" 0 'and all of its members belong together'
compare "$(json '.validation.accuracy.value | real')" '>=' 0.75 'and tells them apart'
is "$(json '.validation | [.accuracy, .balancedAccuracy, .auc.round, .auc.flat, .sensitivity.flat][] | .value >= .interval[0] and .value <= .interval[1]' | sort -u)" \
    true 'values lie in their intervals'
is "$(json '.validation | [.brier > .brierInterval[0], .brier < .brierInterval[1], .logLoss > .logLossInterval[0], .logLoss < .logLossInterval[1]] | unique | tojson')" \
    '[true]' 'scores as well'
is "$(json '[.perSubject[] | .probabilities | add | . > 1 - 1e-12 and . < 1 + 1e-12] | all')" true 'probabilities sum to 1'
is "$(json '[.perSubject[] | .probabilities[.predicted] >= 0.5] | all')" true 'the likelier class is told'
is "$(json '[.validation.calibration[] | map(.members) | add] | tojson')" '[12,12]' 'the calibration table has all members'
is "$(json '.validation | (.confusion | add | add) == 12 and .correct == .confusion[0][0] + .confusion[1][1]')" true 'so has the confusion'
compare "$(json '.validation.brier | real')" '<' "$(json .validation.brierReference)" 'better than saying the shares'
is "$(json '.model.classifier | [.method, .classes, .priors, (.means | length), (.nearest | length)] | tojson')" \
    '["srnf-gauss",["round","flat"],[0.5,0.5],2,12]' 'the record has what it is'
TEMPLATE=$(json .model.classifier.template.surface)
get "/v1/surfaces/$TEMPLATE"
is "$STATUS" 200 'the template is a surface'

# ---- predict -------------------------------------------------------------------------------------------

execute predict "{\"model\":\"$MODEL\",\"cohort\":\"other\"}" -H "$WAIT"
is "$STATUS $(json '.predictions | length')" '200 12' 'asked about the other half'
compare "$(json '.assessment.accuracy.value | real')" '>=' 0.75 'it is mostly right'
is "$(json '[.predictions[] | .label == .truth] | map(select(.)) | length')" "$(json .assessment.correct)" 'as the assessment counts'
is "$(json '[.predictions[] | .trainingSubject] | any')" false 'none was trained on'
cp "$BODY" "$SCRATCH/other.json"
is "$(json '[.warnings[].code] | index("not-assessed")')" null 'and leaves out none of them'
post_json /v1/cohorts "$(cohort third 12 24 | jq -c '.members[0].label = "long" | .members[3].label = "oblong"')"
execute predict "{\"model\":\"$MODEL\",\"cohort\":\"third\"}" -H "$WAIT"
is "$STATUS $(json .assessment.members) $(json '.warnings[] | select(.code == "not-assessed").figures | [.class, .labelled, .unknown, .label, .trainingSubjects] | tojson')" \
    '200 10 [null,12,2,"long",0]' 'labels that it does not know among others are told, as its assessment leaves them out'
execute predict "{\"model\":\"$MODEL\",\"surfaces\":[\"${SURFACES[15]}\"]}" -H "$WAIT"
is "$STATUS $(json '.predictions[0].probabilities.flat') $(json .assessment)" \
    "200 $(jq '.predictions[3].probabilities.flat' "$SCRATCH/other.json") null" 'one surface gets what it got among others'
post_json /v1/surfaces "$(shape 15 flat | jq -c '.coefficients |= map_values(if type == "array" then map(. * 30) else . end)')"
execute predict "{\"model\":\"$MODEL\",\"surfaces\":[\"$(json .id)\"]}" -H "$WAIT"
is "$STATUS $(json '.predictions[0].label')" "200 $(jq -r '.predictions[3].label' "$SCRATCH/other.json")" \
    'in its own units it is taken as well'
compare "$(json ".predictions[0].probabilities.flat - $(jq '.predictions[3].probabilities.flat' "$SCRATCH/other.json") | fabs")" '<' 1e-6 \
    'and gets the same'
execute predict "{\"model\":\"$MODEL\",\"surfaces\":[\"${SURFACES[15]}\",\"${SURFACES[0]}\",\"$STRANGE\"],\"priors\":{\"round\":0.9,\"flat\":0.1}}" -H "$WAIT"
compare "$(json '.predictions[0].probabilities.flat | real')" '<' "$(jq '.predictions[3].probabilities.flat' "$SCRATCH/other.json")" \
    'a class that is rare is less likely'
is "$(json '[.predictions[] | .trainingSubject] | tojson')" '[false,true,false]' 'a surface that it was trained on is known'
is "$(json '[.predictions[2].warnings[].code] | tojson')" '["far-from-model"]' 'one that is like none is flagged'
is "$(json '.predictions[2].typicality.nearest | [.percentile, .percentileInterval[1], .percentileInterval[0] > 70] | tojson')" \
    '[100,100,true]' 'further from all than any member'
is "$(json '[.warnings[].code] | map(select(. == "far-from-model" or . == "training-subject")) | sort | tojson')" \
    '["far-from-model","training-subject"]' 'the result warns of both'

is "$(jq -c '[.warnings[]?.code | select(. == "near-duplicates")]' "$SCRATCH/other.json")" '[]' 'new subjects are next to none'
post_json /v1/surfaces "$(shape 0 round | jq -c '.coefficients.z[2] += 0.001')"
execute predict "{\"model\":\"$MODEL\",\"surfaces\":[\"${SURFACES[15]}\",\"$(json .id)\"]}" -H "$WAIT"
is "$STATUS $(json '[.predictions[].trainingSubject] | tojson') $(json '[.warnings[] | select(.code == "near-duplicates") | .figures.index] | tojson')" \
    '200 [false,false] [1]' 'another scan of one that it was trained on is told of'

post_json /v1/surfaces "$(shape 12 round | jq -c '.coefficients |= (.lmax = 5 | [range(11) | 0] as $no | .x += $no | .y += $no | .z += $no)')"
execute predict "{\"model\":\"$MODEL\",\"surfaces\":[\"$(json .id)\"]}" -H "$WAIT"
is "$STATUS $(json '[.warnings[].code] | index("mixed-degrees")')" '200 null' 'what is finer than the classifier is cut off, of which nothing need be said'

# Labels that follow nothing: all are told as the one that most have; or as well as chance does.
post_json /v1/cohorts "$(cohort rare 0 20 | jq -c '.members |= (to_entries | map(.value.label = (if .key % 8 < 2 then "few" else "many" end) | .value))')"
post_json /v1/cohorts "$(cohort noise 0 12 | jq -c '.members |= (to_entries | map(.value.label = (if .key % 4 < 2 then "a" else "b" end) | .value))')"
execute train '{"cohort":"rare","commonPose":true}' -H "$WAIT"
is "$STATUS $(json '.validation | [.accuracy.value == .majorityRate, (.balancedAccuracy.value - 0.5 | fabs) < 1e-12] | tojson')" '200 [true,true]' \
    'where labels say nothing the larger class is named'
is "$(json '[.warnings[] | select(.code == "names-one-class") | .figures | .class, .chance] | tojson')" '["many",0.5]' 'which is told'
request DELETE "/v1/models/$(json .model.id)?cascade=true"
execute predict "{\"model\":\"$MODEL\",\"cohort\":\"rare\"}" -H "$WAIT"
is "$STATUS $(json '.assessment') $(json '.warnings[] | select(.code == "not-assessed").figures | [.class, .labelled, .unknown, .label] | tojson')" \
    '200 null ["round",20,20,"few"]' 'labels that a classifier does not know are told'
execute predict "{\"model\":\"$MODEL\",\"cohort\":\"half\"}" -H "$WAIT"
is "$(json '.warnings[] | select(.code == "not-assessed").figures | [.class, .labelled, .unknown, .trainingSubjects] | tojson')" \
    '["round",12,0,12]' 'so are those that it was trained on'
execute classify '{"cohort":"noise","method":["srnf-gauss"],"permutations":19,"commonPose":true}' -H "$WAIT"
is "$STATUS $(json '[.warnings[] | select(.code == "not-above-chance" or .code == "names-one-class") | .figures.method] | tojson')" \
    '200 ["srnf-gauss"]' 'methods of classify that may be chance are told'
is "$(jq -c '[.warnings[]?.code | select(. == "not-above-chance" or . == "names-one-class")]' "$SCRATCH/trained.json")" '[]' \
    'and a classifier that tells its classes is not'

execute train '{"cohort":"half","method":"srnf-nn","priors":"equal","commonPose":true}' -H "$WAIT"
is "$STATUS $(json '.model.classifier | [.method, .components, .means] | tojson')" '200 ["srnf-nn",null,null]' 'by the nearest neighbour'
NEAREST=$(json .model.id)
execute predict "{\"model\":\"$NEAREST\",\"surfaces\":[\"${SURFACES[12]}\",\"${SURFACES[13]}\",\"${SURFACES[14]}\"]}" -H "$WAIT"
is "$STATUS $(json '[.predictions[] | .nearestDistances[.label] == ([.nearestDistances[]] | min)] | all')" '200 true' 'which is told'

# ---- Size and covariates ---------------------------------------------------------------------------------

# A number that tells the kinds, and one that tells nothing.
measured() { # NAME FROM TO
    cohort "$@" | jq -c '.members |= (to_entries | map(.value + {covariates: {
        age: ((if .key % 2 == 0 then 40 else 70 end) + .key), dose: (.key * 7 % 5)}}))'
}
post_json /v1/cohorts "$(measured aged 0 12)"
post_json /v1/cohorts "$(measured others 12 18)"
for METHOD in srnf-gauss srnf-nn; do
    execute train "{\"cohort\":\"aged\",\"method\":\"$METHOD\",\"commonPose\":true,\"components\":1,\"covariance\":\"pooled\",\"scale\":\"shape-and-size\",\"covariates\":[\"age\",\"dose\"]}" -H "$WAIT"
    is "$STATUS $(json '[.features, .model.classifier.features.names, (.model.classifier.features.values | length)] | tojson')" \
        '200 [["size","age","dose"],["size","age","dose"],12]' "numbers beside shape, $METHOD"
    compare "$(json .validation.accuracy.value)" '>=' 0.9 'and a better classifier'
    AGED=$(json .model.id)
    execute predict "{\"model\":\"$AGED\",\"cohort\":\"others\"}" -H "$WAIT"
    is "$STATUS $(json_in_order '.predictions[0].numbers | del(.size) | tojson') $(json '[.predictions[].numbers.size > 0] | all')" \
        '200 {"age":40,"dose":0} true' 'the members of a cohort have their own'
    compare "$(json .assessment.accuracy.value)" '>=' 0.9 'which are used'
    cp "$BODY" "$SCRATCH/aged.json"
    execute predict "{\"model\":\"$AGED\",\"surfaces\":[\"${SURFACES[12]}\",\"${SURFACES[12]}\"],\"covariates\":[{\"age\":40,\"dose\":0},{\"age\":99,\"dose\":0}]}" -H "$WAIT"
    is "$STATUS $(json '.predictions[0].probabilities | tojson')" "200 $(jq -c '.predictions[0].probabilities' "$SCRATCH/aged.json")" \
        'as are those given with a surface'
    compare "$(json '.predictions[1].probabilities.flat')" '>' "$(json '.predictions[0].probabilities.flat')" 'an older one is likelier flat'
    is "$(json '[.predictions[] | [.warnings[] | select(.code == "extrapolated") | .figures | select(.covariate != "size") | [.covariate, .value, .highest]]] | tojson')" \
        '[[],[["age",99,81]]]' 'and beyond what was trained on'
    FLAT=$(json '.predictions[1] | .label')
    post_json /v1/surfaces "$(shape 12 round | jq -c '.coefficients |= map_values(if type == "array" then map(. / 1000) else . end)')"
    execute predict "{\"model\":\"$AGED\",\"surfaces\":[\"$(json .id)\"],\"covariates\":[{\"age\":40,\"dose\":0}]}" -H "$WAIT"
    is "$STATUS $(json '[.warnings[] | select(.code == "extrapolated") | .figures | [.covariate, .factor]] | tojson')" \
        '200 [["size",1000]]' 'metres among millimetres are told by the factor'
    like "$(json '.warnings[] | select(.code == "extrapolated") | .detail')" 'Times 1000 it would lie among them: is its mesh in another unit' 'in words'
done
is "$FLAT" flat 'whose neighbours are flat'

# ---- Models of two kinds ---------------------------------------------------------------------------------

get "/v1/models/$MODEL"
is "$STATUS $(json .kind) $(json '.scores | length')" '200 classifier 12' 'the model is read'
get '/v1/models'
is "$(json '[.items[] | [.kind, .classifier.method, .classifier.means]] | sort | tojson')" \
    '[["classifier","srnf-gauss",null],["classifier","srnf-gauss",null],["classifier","srnf-nn",null],["classifier","srnf-nn",null]]' 'and listed, without its matrices'
execute project "{\"model\":\"$MODEL\",\"surface\":\"$STRANGE\"}"
is_problem 422 invalid-input 'project takes no classifier'
like "$(json '.errors[0] | .pointer + " " + .detail')" '/inputs/model is a classifier, made by train or train-parts, which predict takes' 'and says so'
get "/v1/models/$MODEL/shape?coefficients=1"
is_problem 422 invalid-input 'nor has it shapes along components'
execute pca "$(printf '%s\n' "${SURFACES[@]:0:4}" | jq -Rnc '{surfaces: [inputs]}')"
COMPONENTS=$(json .model.id)
is "$(json .model.kind)" components 'a model of pca is of the other kind'
execute predict "{\"model\":\"$COMPONENTS\",\"surfaces\":[\"$STRANGE\"]}" -H "$WAIT"
is_problem 422 invalid-input 'predict takes no components'
like "$(json '.errors[0] | .pointer + " " + .detail')" '/inputs/model is a model of principal components, made by pca' 'and says so'

# ---- Wrong inputs ----------------------------------------------------------------------------------------

wrong() { # PROCESS INPUTS POINTER DETAIL WHAT
    execute "$1" "$2"
    is_problem 422 invalid-input "refused: $5"
    like "$(json "[.errors[] | select(.pointer == \"$3\") | .detail] | join(\"; \")")" "$4" "  at $3"
}
post_json /v1/cohorts "$(cohort one 0 12 | jq -c '.members |= map(.label = "round") | .name = "one"')"
wrong train '{"cohort":"one"}' /inputs/cohort 'one label only' 'one class'
post_json /v1/cohorts "$(cohort single 0 12 | jq -c '.members |= (map(.label = "round") | .[3].label = "flat")')"
wrong train '{"cohort":"single"}' /inputs/cohort 'has 1 subject \(1 member\) with the label "flat"; each label needs 5' 'a class of one member'
post_json /v1/cohorts "$(cohort missing 0 12 | jq -c 'del(.members[5].label)')"
wrong train '{"cohort":"missing"}' /inputs/cohort '^member 5 .surf-[0-9a-f]+.* has no label' 'a label that is missing'
wrong train '{"cohort":"half","components":9}' /inputs/components 'covariance of 9 features' 'more components than are determined'
wrong train '{"cohort":"half","method":"icp-nn"}' /inputs/method '' 'a method that cannot be kept'
wrong train '{}' /inputs/cohort required 'no cohort'
post_json /v1/cohorts "$(cohort twice 0 12 | jq -c '.members |= (to_entries | map(.value + {subject: "s\(.key / 2 | floor)"}))')"
execute train '{"cohort":"twice"}' -H "$WAIT"
is "$STATUS" 422 'refused: subjects of two labels'
wrong predict "{\"model\":\"$MODEL\"}" /inputs/surfaces 'must be given' 'nothing to predict'
wrong predict "{\"model\":\"$MODEL\",\"surfaces\":[\"$STRANGE\"],\"priors\":{\"round\":1}}" /inputs/priors 'no number for the class flat' \
    'priors of some classes'
wrong predict "{\"model\":\"$MODEL\",\"surfaces\":[\"$STRANGE\"],\"priors\":{\"round\":0.5,\"flat\":0.2}}" /inputs/priors 'must have the sum 1, and have 0.7: divide each' \
    'priors that do not sum to 1'
wrong predict "{\"model\":\"$MODEL\",\"surfaces\":[\"$STRANGE\"],\"priors\":{\"round\":0.5,\"flat\":0.25,\"oval\":0.25}}" \
    /inputs/priors 'has 3 classes; the classifier has 2' 'priors of a class too many'
wrong predict "{\"model\":\"$AGED\",\"surfaces\":[\"$STRANGE\"]}" /inputs/covariates 'needs 2 covariates of each, "age" first' 'no covariates'
wrong predict "{\"model\":\"$AGED\",\"surfaces\":[\"$STRANGE\"],\"covariates\":[{\"age\":4}]}" /inputs/covariates/0 'has no "dose"' \
    'a covariate that is missing'
wrong predict "{\"model\":\"$AGED\",\"surfaces\":[\"$STRANGE\"],\"covariates\":[{\"age\":4,\"dose\":1,\"sex\":1}]}" \
    /inputs/covariates/0 'has 3 covariates; the classifier takes 2 of them, and not "sex": leave it out' 'one too many'
wrong predict "{\"model\":\"$AGED\",\"surfaces\":[\"$STRANGE\"],\"covariates\":[{\"age\":\"old\",\"dose\":1}]}" \
    /inputs/covariates/0 '"age" must be a number' 'a text'
wrong predict "{\"model\":\"$AGED\",\"cohort\":\"other\"}" /inputs/cohort 'has no covariate "age"' 'members without them'
wrong predict "{\"model\":\"$AGED\",\"surfaces\":[\"$STRANGE\"],\"covariates\":[{\"age\":1e308,\"dose\":1}]}" \
    /inputs/covariates/0 '"age" is 1e[+]308' 'a number beyond all use'
MANY=$(jq -nc '[range(64) | "c\(.)"]')
wrong train "{\"cohort\":\"half\",\"scale\":\"shape-and-size\",\"covariates\":$MANY}" /inputs/covariates \
    '64 names, which with the sizes are 65 numbers beside shape; at most 64' 'more numbers than a classifier takes'
wrong classify "{\"cohort\":\"half\",\"method\":[\"srnf-nn\"],\"scale\":\"shape-and-size\",\"covariates\":$MANY}" /inputs/covariates \
    'are 65 numbers beside shape' 'in any of them'
wrong predict "{\"model\":\"$MODEL\",\"surfaces\":[\"$STRANGE\"],\"covariates\":[{\"age\":4}]}" /inputs/covariates \
    'takes none' 'covariates of no use'
post_json /v1/cohorts "$(cohort told 0 12 | jq -c '.members |= (to_entries | map(.value + {covariates: {age: (.key * 7 % 5), kind: (.key % 2)}}))')"
execute train '{"cohort":"told","commonPose":true,"components":1,"covariance":"pooled","covariates":["age","kind"]}' -H "$WAIT"
like "$STATUS $(json .code) $(json .detail)" '422 numerical-failure .* is singular .*"kind" is the same in all members of each label' \
    'a covariate that is the label is named where Gaussians fail by it'
wrong train '{"cohort":"half","covariates":["age"]}' /inputs/covariates/0 'has no covariate "age"' 'a covariate that nobody has'
execute predict "{\"model\":\"model-00000000000000000000000000000000\",\"surfaces\":[\"$STRANGE\"]}" -H "$WAIT"
is_problem 404 no-such-model 'refused: a model that is not there'

# ---- Away and back -----------------------------------------------------------------------------------------

request DELETE "/v1/surfaces/$TEMPLATE"
is "$STATUS" 409 'the template stays as long as its model'
curl -sf "$URL/v1/models/$MODEL/export" >"$SCRATCH/study.zip"
is "$(unzip -p "$SCRATCH/study.zip" srnfd-study.json | jq -c '[[.models[].id], [.jobs[].process], (.surfaces | length)]')" \
    "[[\"$MODEL\"],[\"train\"],14]" 'an export has the model, its members, mean, template and the job that made it, and no other model'
start_server "$SCRATCH/second" || exit 1
post '/v1/imports' --data-binary "@$SCRATCH/study.zip" --header 'Content-Type: application/zip'
like "$STATUS" '^20' 'an export of the model is imported elsewhere'
post_json /v1/surfaces "$(shape 15 flat)"
execute predict "{\"model\":\"$MODEL\",\"surfaces\":[\"$(json .id)\"]}" -H "$WAIT"
is "$STATUS $(json '.predictions[0].probabilities.flat')" "200 $(jq '.predictions[3].probabilities.flat' "$SCRATCH/other.json")" \
    'where it says the same'
request DELETE "/v1/models/$MODEL?cascade=true"
like "$STATUS" '^20' 'and is deleted'
get "/v1/models/$MODEL"
is_problem 404 no-such-model 'it is gone'

# ---- Forged ------------------------------------------------------------------------------------------------

# Ids are hashes that anybody can make: what predict could not use is no classifier, and is refused when it comes.
token() { "$SRNFD" token add --data "$SCRATCH/owners" --name "$1" 2>/dev/null; }
ADA=$(token ada)
BOB=$(token bob)
start_server "$SCRATCH/owners" || exit 1
bob() { # PATTERN BY [everywhere]: bob sends the classifier with that changed
    tests/support/forge_model.py "$SCRATCH/study.zip" "$SCRATCH/forged.zip" "${3:-replace}" "$1" "$2" >"$SCRATCH/forged"
    post /v1/imports --data-binary "@$SCRATCH/forged.zip" -H 'Content-Type: application/zip' -H "Authorization: Bearer $BOB"
}
while IFS='#' read -r pattern by what; do
    bob "$pattern" "$by"
    is "$STATUS $(json '.refused[0] | "\(.code) \(.file)"')" '422 not-as-described srnfd-study.json' "refused: $what"
done <<'DAMAGE'
"nearest":\[[^]]*#"nearest":[#a list of another length
"nearest":\[[^,]*#"nearest":[-0.5#a distance below 0
"nearest":\[[^,]*#"nearest":["NaN"#a distance that is a text
"priors":\[[^]]*#"priors":[-1.0,2.0#shares below 0
"slope":[^,}]*#"slope":"NaN"#a slope that is a text
"classes":\["round",#"classes":[#one class
"groups":\["round"#"groups":["oval"#a member of a class that is none
"components":[0-9]+#"components":-1#a number of components below 0
"means":\[\[[^]]*\],#"means":[#means that do not fit
"method":"srnf-gauss"#"method":"magic"#a method that is none
"calibration":\{"o#"elsewhere":{"o#no calibration
"template":\{[^}]*\}#"template":null#no template
"covariances":\[\[\[#"covariances":[[[-#a covariance that is not positive definite
"registration":\{[^}]*\}[^}]*\}#"registration":null#no registration
DAMAGE
bob '"covariances":\[\[\[' '"covariances":[[[-'
like "$(json '.refused[0].detail')" 'cannot be used: the covariance of its class(es|) .*is not positive definite$' \
    'and told what is wrong with it'
bob '"flat"(?!:)' '"round"' everywhere
like "$STATUS $(json '.refused[0].detail')" '^422 .*cannot be used: two of its classes are called "round"$' \
    'refused: two classes of one name'
# A template is a surface: with that of another the sender would learn how far his own are from it.
post_json /v1/surfaces "$(shape 77 round)" -H "Authorization: Bearer $ADA"
OTHERS=$(json .id)
bob "$TEMPLATE" "$OTHERS"
is "$STATUS $(json '.refused[0].code')" '422 no-such-surface' 'refused: a template that another owner has'
json '.refused[0].detail' >"$SCRATCH/others"
bob "$TEMPLATE" "surf-$(printf '%032d' 0)"
is "$STATUS $(json '.refused[0].code')" '422 no-such-surface' 'refused: one that nobody has'
is "$(json '.refused[0].detail')" "$(cat "$SCRATCH/others")" 'in the same words'
get /v1/models -H "Authorization: Bearer $BOB"
is "$(json '.items | length')" 0 'nothing of it is kept'
bob '"totalVariance"' '"totalVariance"'
is "$STATUS $(json .restored.models)" '201 1' 'as it was it is taken'
bob '("surfaces": *\[ *")[^"]*' "\\g<1>$OTHERS"
is "$STATUS $(json .restored.models)" '201 1' 'a model that says it was made of what another has'
request DELETE "/v1/surfaces/$OTHERS" -H "Authorization: Bearer $ADA"
is "$STATUS" 204 'does not keep it from going'
post_json /v1/surfaces "$(shape 77 round | jq -c '.coefficients |= (.lmax = 5 | [range(11) | 0] as $no | .x += $no | .y += $no | .z += $no)')" \
    -H "Authorization: Bearer $BOB"
FINER=$(json .id)
bob "$TEMPLATE" "$FINER"
is "$STATUS $(json '.refused[0].code')" '422 not-as-described' 'refused: a template of another degree'

done_testing

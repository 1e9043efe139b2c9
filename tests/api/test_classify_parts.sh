#!/usr/bin/env bash
# test_classify_parts.sh - subjects classified by several structures together: one structure is classify, two tell what
# neither does alone, sizes and covariates count where they are asked for, and what is wrong is told by name.
# srnfd-test: slow
# srnfd-test: no-asan (core/stats/test_classify_allocation.c, api/test_classify.sh and api/test_standard.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400
PROCESS=classify-parts

run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

start_server "$SCRATCH/data" --workers 2 || exit 1
# Ten subjects of two labels; with sanitizers six, which are too few to tell anything, so that figures are for release
# builds. What bumps both parts tells the label, what bumps one and dents the other says nothing and
# is larger. The second part of one label is larger, and those of that label are older.
N=10
[ -n "$SRNFD_SANITIZED" ] && N=6
python3 - "$URL" $N >"$SCRATCH/members.json" <<'PYTHON'
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
        members.append({'id': surface(together + (apart if part else -apart), part, 1 + 0.3 * label * part),
                        'subject': f's{s}', 'label': ('low', 'high')[label],
                        'covariates': {'part': ('first', 'second')[part], 'age': 40 + 20 * label + s % 5, 'one': 1, 'kind': label}})
print(json.dumps(members))
PYTHON
cohort() { # NAME FILTER
    curl -sS -X DELETE "$URL/v1/cohorts/$1" -o "$SCRATCH/ignored"
    jq -c "{name: \"$1\", members: ($2)}" "$SCRATCH/members.json" >"$SCRATCH/cohort.json"
    post_json /v1/cohorts "@$SCRATCH/cohort.json"
}
classify() { # COHORT [MORE] [PROCESS]
    run "${3:-$PROCESS}" "$(jq -c ". + {cohort: \"$1\"}" <<<"{\"commonPose\":true,\"components\":2,\"covariance\":\"pooled\"${2-}}")"
}
ACCURACY='.methods["srnf-gauss"].accuracy'
tells() { # GOT OPERATOR BOUND NAME: as compare, where subjects are enough
    [ -n "$SRNFD_SANITIZED" ] || compare "$@"
}

# ---- One part ------------------------------------------------------------------------------------------

cohort one '[.[] | select(.covariates.part == "first")]'
classify one '' classify
cp "$BODY" "$SCRATCH/classify.json"
classify one
is "$STATUS" 200 'one part'
FIELDS='[.methods["srnf-gauss"] | .accuracy, .confidenceInterval, .confusion, [.perSubject[] | .predicted, .logLikelihoods]]'
is "$(jq -s "(.[0] | $FIELDS) == (.[1] | $FIELDS)" "$SCRATCH/classify.json" "$BODY")" true 'is classify, to the last bit'
is "$(json '.parts[0] | [.name, .weight, .methods["srnf-gauss"].onlyTogether, .methods["srnf-gauss"].pValue] | tostring')" \
    '["first",1,0,1]' 'and what it says alone'

classify one ',"scale":"shape-and-size","covariates":["age"],"components":1' classify
cp "$BODY" "$SCRATCH/classify.json"
is "$STATUS $(json '.features | tojson')" '200 ["size","age"]' 'classify takes covariates'
tells "$(json '.methods["srnf-gauss"].accuracy')" '==' 1 'which tell the labels'
if [ -z "$SRNFD_SANITIZED" ]; then # what runs above and below, by other numbers
    classify one ',"scale":"shape-and-size","covariates":["age"],"components":1'
    is "$(jq -s "(.[0] | $FIELDS) == (.[1] | $FIELDS)" "$SCRATCH/classify.json" "$BODY")" true 'as one part with them, to the last bit'
    classify one ',"components":1,"refit":"shared"' classify
    compare "$(json '.methods["srnf-gauss"].accuracy')" '<' 1 'and shape does not'
fi
classify one ',"method":"srnf-nn","covariates":["age"],"sizeWeight":1000,"refit":"shared"' classify
is "$(json '.methods["srnf-nn"].accuracy')" 1 'in distances, too'

# ---- Two parts -----------------------------------------------------------------------------------------

cohort both '[.[5:][], .[:5][]]'
classify both ',"permutations":99,"seed":1,"method":["srnf-gauss","srnf-nn"]'
is "$STATUS" 200 'two parts'
cp "$BODY" "$SCRATCH/both.json"
is "$(json '[.subjects, (.methods["srnf-gauss"].perSubject | length), (.parts | length), (.features | length)] | tostring')" \
    "[$N,$N,2,0]" 'of all subjects'
tells "$(json "$ACCURACY")" '>=' 0.9 'tell the label together'
tells "$(json "$ACCURACY as \$all | [.parts[].methods[\"srnf-gauss\"].accuracy < \$all | if . then 1 else 0 end] | add")" '==' 2 \
    'better than either alone'
tells "$(json '.methods["srnf-gauss"].pValue')" '<=' 0.05 'and not by chance'
is "$(json '.comparisons | length')" 1 'the two methods are compared'
is "$(json '[.parts[].methods["srnf-gauss"] | .onlyTogether - .onlyAlone] ==
    [.methods["srnf-gauss"].correct as $all | .parts[].methods["srnf-gauss"].correct | $all - .]')" true 'counts fit together'
is "$(json '[.methods["srnf-gauss"].perSubject[].subject] | sort == ([range('"$N"')] | map("s\(.)") | sort)')" true \
    'each subject has its name'
if [ -z "$SRNFD_SANITIZED" ]; then
    classify both ',"weights":{"first":9,"second":9}'
    is "$(json '[.methods["srnf-gauss"].perSubject[].predicted] | tostring')" \
        "$(jq -c '[.methods["srnf-gauss"].perSubject[].predicted]' "$SCRATCH/both.json")" 'equal weights decide as none'
fi
classify both ',"weights":{"second":1e-6}'
is "$STATUS" 200 'a part may weigh next to nothing'
tells "$(json "$ACCURACY")" '<' 0.9 'and is of no help'

# ---- Other numbers -------------------------------------------------------------------------------------

cohort few '.[:12] | [.[5:][], .[:5][]]'
classify few ',"scale":"shape-and-size","components":1'
is "$(json '.features | tostring')" '["size of second","size of first"]' 'sizes'
tells "$(json "$ACCURACY")" '==' 1 'tell'
classify few ',"covariates":["age"],"components":1'
is "$(json '.features | tostring')" '["age"]' 'a covariate'
tells "$(json "$ACCURACY")" '==' 1 'tells'
is "$(json '[.inputs.cohort.values[0][], (.inputs.cohort.subjectLabels | length)] | length')" 7 'and stands in the inputs'
classify few ',"method":"srnf-nn","covariates":["age"],"sizeWeight":1000'
is "$STATUS" 200 'in distances, too'
tells "$(json '.methods["srnf-nn"].accuracy')" '==' 1 'where it weighs enough'

# ---- What is wrong -------------------------------------------------------------------------------------

refused() { # FILTER PATTERN [MORE]
    cohort wrong "$1"
    classify wrong "${3-}"
    like "$STATUS $(json '.errors[0] | "\(.pointer) \(.detail)"')" "422 $2" "refused: $2"
}
refused 'del(.[3])' '/inputs/cohort subject "s1" has no member of part "second"'
refused '.[3].covariates.part = "first"' '/inputs/cohort subject "s1" has two members of part "first"'
refused '.[3].label = "low"' '/inputs/cohort subject "s1" has members of different labels: give all its parts one'
refused 'del(.[3].label)' '/inputs/cohort subject "s1" has a member without a label'
refused '.[:8]' '/inputs/cohort has 2 subjects .2 members. with the label .low.; each label needs 3'
refused '[.[] | .label = "low"]' '/inputs/cohort has one label only'
refused . '/inputs/covariates/0 .*no covariate "weight"' ',"covariates":["weight"]'
refused . '/inputs/covariates/0 .*same' ',"covariates":["one"]'
refused '[.[] | .covariates.days = 365 * .covariates.age]' '/inputs/covariates/1 "days" follows from "age": leave one of' \
    ',"covariates":["age","days"]'
refused '[to_entries[] | .value + {covariates: (.value.covariates + {at: (.key / 2 | floor)} | .sum = .age + .at)}]' \
    '/inputs/covariates/2 "sum" follows from those before it together' ',"covariates":["age","at","sum"]'
refused '.[3].covariates.age = 7' '/inputs/covariates "age" differs between the members of subject "s1", which are parts of one: give all the same' ',"covariates":["age"]'
refused '.[].covariates.age = true | .[3].covariates.age = false' '/inputs/covariates "age" differs between the members of subject "s1"' ',"covariates":["age"]'
refused '.[6].covariates.age = "old" | .[7].covariates.age = "old"' '/inputs/covariates/0 "age" of subject "s3" is the text "old", not a number, true or false: code two levels as 0 and 1' ',"covariates":["age"]'
refused '.[6].covariates.age = null | .[7].covariates.age = null' '/inputs/covariates/0 subject "s3" has no covariate "age"; the cohort has .*one' ',"covariates":["age"]'
PROCESS=classify
refused '.[6].covariates.age = null' '/inputs/covariates/0 member 6 .surf-[0-9a-f]*, of subject "s3". of the cohort has no covariate "age"' \
    ',"covariates":["age"]'
refused . '/inputs/covariates/0 .*same' ',"covariates":["one"]'
refused . '/inputs/components asks for a covariance of 13 features, size and covariates counted' ',"components":12,"covariates":["age"]'
PROCESS=classify-parts
refused . '/inputs/method icp-nn has no joint comparison' ',"method":"icp-nn"'
refused . '/inputs/components asks for a covariance of 13 features' ',"components":12,"covariates":["age"]'
refused . '/inputs/weights' ',"weights":{"third":1}'

classify few ',"covariates":["kind"],"covariance":"pooled","components":1'
isnt "$STATUS" 200 'a covariate that is the label has no variance within classes'
like "$(json .detail)" 'covariance of 2 features, sizes and covariates .1. counted, is singular in the fold .*"kind" is the same in all members of each label, ' \
    'and is told by its name'
cohort one '[.[] | select(.covariates.part == "first")] | .[2].covariates.kind = 1'
classify one ',"covariates":["age","kind"],"covariance":"pooled","components":1,"refit":"shared"' classify
like "$STATUS $(json .code) $(json .detail)" '422 numerical-failure .*fold of subject 2: .*"kind" is the same in all members of each label but that subject, ' \
    'as is one that is so in a fold'

stop_server || not_ok 'the server ends well'
done_testing

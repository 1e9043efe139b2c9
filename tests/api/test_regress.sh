#!/usr/bin/env bash
# test_regress.sh - linear models of shape end to end: formulas as R reads them, what the result tells, coefficients and
# p against numpy's least squares on exported fields, and what is refused by name.
# srnfd-test: slow
# srnfd-test: no-asan (core/stats/test_regress.c and api/test_standard.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 2 || exit 1

# Ellipsoids with bumps that follow no rule; z grows with age.
MEMBERS=$(python3 - "$URL" <<'PYTHON'
import json, math
from service import send

members, lmax = [], 4
for i in range(18):
    age = 40 + (i * 37 % 41)
    rows = {axis: [0.0] * (lmax + 1) ** 2 for axis in 'xyz'}
    rows['x'][3], rows['y'][1], rows['z'][2] = 1.0, 1.0, 0.9 + 0.004 * age
    for axis in 'xyz':
        for k in range(4, 16):
            rows[axis][k] = 0.02 * math.sin(1.7 * i * k + ord(axis) * k * k)
    surface = send('/v1/surfaces', {'coefficients': {'lmax': lmax, **rows}})
    covariates = {'age': age, 'volume': 1.5 + i % 5, 'treated': i % 4 == 1, 'site': 'ABC'[i * 5 % 3 if i < 9 else i % 3],
                  'one': 1, 'double': 2 * age, 'moved': 1e9 + age, 'tiny': 1e-200 * age, 'away': 1e13 + age,
                  'Intercept': i, 'zone': 'uv'[i % 6 == 0 or i % 3 == 2], 'shift': 'mno'[i % 3], 'arm': 'xy'[i % 2], 'sum': age + 1.5 + i % 5,
                  'north': 'yn'['ABC'[i * 5 % 3 if i < 9 else i % 3] == 'B'], 'rare': 'x' if i == 3 else 'yz'[i % 2]}
    if i > 2:
        covariates['late'] = i * i % 7
    covariates['city'] = '' if i in (4, 7) else 'PQ'[i % 2]
    members.append({'id': surface['id'], 'label': 'ab'[i % 2], 'covariates': covariates})
print(json.dumps(members))
PYTHON
)
post_json /v1/cohorts "{\"name\":\"study\",\"members\":$MEMBERS}"
is "$STATUS" 201 'a cohort with covariates'

regress() {
    execute regress "{\"cohort\":\"study\",\"register\":false,\"permutations\":99,\"bootstraps\":100,\"formula\":\"$1\"${2:-}}"
}

# ---- The result ---------------------------------------------------------------------------------------

regress 'shape ~ age + site + treated' ',"at":[{"age":45},{"age":70,"site":"B","treated":true}],"fields":true'
is "$STATUS" 200 'a model is fitted'
cp "$BODY" "$SCRATCH/first.json"
is "$(json '[.terms[].name] | tojson')" '["age","site","treated"]' 'with its terms'
is "$(json '[.coefficients[].name] | tojson')" '["Intercept","age","site[T.B]","site[T.C]","treated[T.true]"]' \
    'and its columns, in treatment coding'
is "$(json '[.terms[].degreesOfFreedom, .residualDegreesOfFreedom, .model.degreesOfFreedom] | tojson')" '[1,2,1,13,4]' \
    'and degrees of freedom'
is "$(json '.terms[0] | [.pValue == 0.01, .pValueIsFloor, .level] | tojson')" '[true,true,"asymptotic"]' 'age is found'
is "$(json '[.terms[], .model | .r2 >= .r2Interval[0] and .r2 <= .r2Interval[1] and .partialR2 >= .r2 - 1e-12] | all')" true \
    'shares of the variance lie in their intervals'
is "$(json '[.residualVariance, .residualVarianceInterval, .variance, .varianceInterval, (.coefficients[] | .norm, .normInterval)]
    | [range(0; length; 2) as $k | .[$k + 1][0] < .[$k] and .[$k] <= .[$k + 1][1]] | all')" true 'as norms and variances do'
is "$(json '[.terms[0].map.significance, .terms[0].map.fdr, .terms[0].map.pointwiseP, .terms[0].map.statistic | length] | unique | length')" 1 \
    'each term has a map'
is "$(json '[.pairwise[] | .levels | join(" ")] | join(",")')" 'A B,A C,B C' 'three levels are compared pair by pair'
is "$(json '[.pairwise[] | .correctedP >= .pValue] | all')" true 'with corrected p'
is "$(json_in_order '[.predictions[].at] | tojson')" '[{"age":45,"site":"A","treated":"false"},{"age":70,"site":"B","treated":"true"}]' \
    'predictions say where they are'
compare "$(json '[.predictions[].relativeEnergy | real] | max')" '<' 0.01 'as surfaces that exist'
is "$(json '[.predictions[1].surface.maps, (.coefficients[1].surface.maps | length)] | tojson')" '[["standardError","confidence"],7]' \
    'with maps'
LOW=$(json .predictions[0].surface.id)
HIGH=$(json .predictions[1].surface.id)
get "/v1/surfaces/$(json .coefficients[1].surface.id)/mesh?format=ply"
is "$STATUS" 200 'that travel with meshes'
get "/v1/surfaces/$LOW/coefficients"
Z=$(json '.z[2]')
get "/v1/surfaces/$HIGH/coefficients"
compare "$(json ".z[2] - $Z - 0.1 | fabs")" '<' 0.03 'the predicted surfaces grow by as much as planted'

is "$(jq '[.warnings[].code] | index("covariate-far")' "$SCRATCH/first.json")" null 'no value is far from the others'
post_json /v1/cohorts "{\"name\":\"slip\",\"members\":$(jq -c '.[3].covariates.age = -999' <<<"$MEMBERS")}"
SLIP='[.warnings[] | select(.code == "covariate-far") | .figures | [.covariate, .member, .value, .members]] | tojson'
execute regress '{"cohort":"slip","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ age + site"}'
is "$STATUS $(json "$SLIP")" '200 [["age",3,-999,1]]' 'a code for what is missing is told'
execute compare-groups '{"cohort":"slip","register":false,"permutations":9,"covariates":["treated","age"]}'
is "$STATUS $(json "$SLIP")" '200 [["age",3,-999,1]]' 'also among covariates that are regressed out'

# Codes where no median deviation tells of them, near by it, or in several members; none where values merely lie apart.
post_json /v1/cohorts "{\"name\":\"codes\",\"members\":$(jq -c 'to_entries | map(.key as $i | .value | .covariates += {
    coded: (if $i == 4 or $i == 9 then 999 else $i % 2 end), seldom: (if $i == 5 then -9 else 20 + $i * 7 % 60 end),
    many: (if $i % 3 == 1 then 9999 else 10 + $i * $i % 17 end), volumes: (if $i == 2 then 999 else 300 + 100 * $i end),
    change: (if $i == 7 then -9 else $i * 5 % 13 - 7 end)})' <<<"$MEMBERS")}"
CODES='[.warnings[] | select(.code == "covariate-far") | .figures | [.covariate, .member, .value, .members, .code]] | sort | tojson'
execute regress '{"cohort":"codes","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ coded + seldom + many + volumes + change"}'
is "$STATUS $(json "$CODES")" '200 [["coded",4,999,2,true],["many",1,9999,6,true],["seldom",5,-9,1,true]]' \
    'so are codes that no deviation tells of, with how many have them, and no value that merely looks like one'
execute compare-groups '{"cohort":"codes","register":false,"permutations":9,"covariates":["coded","volumes"]}'
is "$STATUS $(json "$CODES")" '200 [["coded",4,999,2,true]]' 'whatever reads the covariate'
like "$(json '.warnings[] | select(.code == "covariate-far") | .detail')" '^coded is 999 in 2 of 18 members, member 4 ' 'in words'

# Six subjects scatter three times as far as the eighteen others, about one mean.
SPREAD=$(python3 - "$URL" <<'PYTHON'
import json, math
from service import send

members, lmax = [], 4
for i in range(24):
    rows = {axis: [0.0] * (lmax + 1) ** 2 for axis in 'xyz'}
    rows['x'][3], rows['y'][1], rows['z'][2] = 1.0, 1.0, 1.2
    for axis in 'xyz':
        for k in range(4, 16):
            rows[axis][k] = (0.03 if i < 6 else 0.01) * math.sin(1.7 * (i + 1) * k + ord(axis) * k * k)
    surface = send('/v1/surfaces', {'coefficients': {'lmax': lmax, **rows}})
    members.append({'id': surface['id'], 'label': 'wide' if i < 6 else 'narrow',
                    'covariates': {'arm': 'xy'[i % 2], 'three': 'w' if i < 6 else 'mn'[i % 2]}})
print(json.dumps({'name': 'spread', 'members': members}))
PYTHON
)
post_json /v1/cohorts "$SPREAD"
spread() {
    execute regress "{\"cohort\":\"spread\",\"register\":false,\"permutations\":99,\"bootstraps\":100,\"formula\":\"$1\"}"
}
warned='[.warnings[] | select(.code == "spreads-differ") | .figures]'
spread 'shape ~ group + arm'
is "$(json "$warned"' | map([.term, .levels, .subjects, .inflation > 1.5, .spreads[0] * 2 < .spreads[1]]) | tojson')" \
    '[["group",["narrow","wide"],[18,6],true,true]]' 'of levels that scatter unequally it is told, and of no others'
spread 'shape ~ group'
cp "$BODY" "$SCRATCH/spread.json"
execute compare-groups '{"cohort":"spread","register":false,"permutations":99}'
is "$(json "$warned"'[0].inflation' | cut -c 1-6)" "$(jq -r "$warned"'[0].inflation' "$SCRATCH/spread.json" | cut -c 1-6)" \
    'as compare-groups has it'
spread 'shape ~ three'
is "$(json "$warned"' | map([.term, .levels, .subjects]) | tojson')" '[["three",["m","n","w"],[9,9,6]]]' 'once for a term of three'

# Cells that a spreadsheet left empty come as 0: no age of 0 among grown people, but a dose, a sign, a start.
post_json /v1/cohorts "{\"name\":\"zeros\",\"members\":$(jq -c 'to_entries | map(.key as $i | .value | .covariates += {
    empty: (if $i == 4 or $i == 9 then 0 else 41 + $i * 5 % 17 end), less: (if $i == 6 then -1 else 30 + $i * 3 % 11 end),
    dose: (if $i % 3 == 0 then 0 else 50 + $i end), sign: ($i % 4 / 2 | floor * 2 - 1), start: $i})' <<<"$MEMBERS")}"
execute compare-groups '{"cohort":"zeros","register":false,"permutations":9,"covariates":["empty","less","dose","sign","start"]}'
is "$STATUS $(json "$CODES")" '200 [["empty",4,0,2,true],["less",6,-1,1,true]]' \
    'so are 0 and -1 where few have them and no other is near, and not where they are values as others'

# Terms that others all but tell, by the variance inflation of the textbook; never of one covariate among themselves.
post_json /v1/cohorts "{\"name\":\"collinear\",\"members\":$(jq -c 'to_entries | map(.key as $i | .value | .covariates.year =
    2020 - .covariates.age + $i % 3)' <<<"$MEMBERS")}"
collinear() {
    execute regress "{\"cohort\":\"collinear\",\"register\":false,\"permutations\":9,\"bootstraps\":100,\"formula\":\"$1\"}"
    FOUND=$(json '[.warnings[] | select(.code == "covariates-collinear") | .figures]')
}
collinear 'shape ~ age + treated + year'
is "$STATUS $(jq -c 'map([.term, .covariate, .terms])' <<<"$FOUND")" '200 [["age","year",["age","year"]]]' \
    'covariates of a formula that tell each other are warned of'
INFLATION=$(python3 -c 'import json, sys
rows = [m["covariates"] for m in json.load(sys.stdin)]
columns = [[float(2020 - r["age"] + i % 3) for i, r in enumerate(rows)], [float(r["treated"]) for r in rows],
           [float(r["age"]) for r in rows]]
about = [[x - sum(c) / len(c) for x in c] for c in columns]
for k, c in enumerate(about):
    for b in about[:k]:
        along = sum(x * y for x, y in zip(b, c)) / sum(x * x for x in b)
        c[:] = [x - along * y for x, y in zip(c, b)]
    if k < 2:
        continue
    age = [x - sum(columns[2]) / len(rows) for x in columns[2]]
    print(sum(x * x for x in age) / sum(x * x for x in c))' <<<"$MEMBERS")
compare "$(jq ".[0].inflation / $INFLATION - 1 | fabs" <<<"$FOUND")" '<' 1e-9 'with the inflation'
compare "$(jq '.[0].inflation * .[0].tolerance - 1 | fabs' <<<"$FOUND")" '<' 1e-12 'and the tolerance'
collinear 'shape ~ age * treated + I(age^2) + site'
is "$STATUS $FOUND" '200 []' 'but not powers and products of one covariate'
collinear 'shape ~ (age + year) * treated'
is "$STATUS $(jq -c 'map([.term, .covariate])' <<<"$FOUND")" '200 [["age","year"]]' 'which hide nothing of others'

# Dates that are written as numbers; not where one of them is no day.
post_json /v1/cohorts "{\"name\":\"dated\",\"members\":$(jq -c 'to_entries | map(.key as $i | .value | .covariates += {
    month: (201900 + $i % 5 * 100 + 1 + $i % 3),
    volume: (20200229 + $i * 13 % 18 * 10000)})' <<<"$MEMBERS")}"
execute regress '{"cohort":"dated","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ volume + month"}'
is "$STATUS $(json_in_order '[.warnings[] | select(.code == "covariate-is-date") | .figures] | tojson')" \
    '200 [{"covariate":"month","format":"YYYYMM","first":201901,"last":202303,"members":18}]' 'months as numbers are warned of'
execute compare-groups '{"cohort":"dated","register":false,"permutations":9,"covariates":["age","month"]}'
is "$STATUS $(json '[.warnings[] | select(.code == "covariate-is-date") | .figures.covariate] | tojson')" '200 ["month"]' \
    'whatever takes them'

# A covariate that is text though half of it are numbers.
post_json /v1/cohorts "{\"name\":\"mixed\",\"members\":$(jq -c 'to_entries | map(.key as $i | .value | .covariates += {
    stage: (if $i % 2 == 0 then "unclear" else "\($i / 2 | floor | . % 2)" end), years: (if $i < 6 then "unknown" else "\(40 + $i)" end)})' <<<"$MEMBERS")}"
execute regress '{"cohort":"mixed","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ stage"}'
is "$STATUS $(json_in_order '[.warnings[] | select(.code == "column-is-text") | .figures] | tojson')" \
    '200 [{"cell":"unclear","column":"stage","numbers":9,"others":9}]' 'a covariate of numbers and texts that counts as levels is told'
is "$(json '.inputs.cohort.design | has("mixed")')" false 'as a warning alone'
execute regress '{"cohort":"mixed","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ C(stage)"}'
is "$STATUS $(json '[.warnings[] | select(.code == "column-is-text")] | length')" '200 0' 'but not where levels are asked for'
execute regress '{"cohort":"mixed","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ years"}'
is_problem 422 invalid-input 'and where its levels are too many for it'
like "$(json '.errors[0].detail')" 'It is text in the cohort, since "unknown" is no number; 12 of its values are' 'that is why'

# Numbers and dates in quotes.
post_json /v1/cohorts "{\"name\":\"quoted\",\"members\":$(jq -c 'to_entries | map(.key as $i | .value | .label = "\($i % 2)" | .covariates += {
    years: "\(40 + $i % 3)", comma: (if $i % 3 == 0 then "11" else "1\($i % 3),5" end), day: "2021-03-0\(1 + $i % 3)",
    each: "-0.\(100 + $i)", seldom: (if $i == 3 then "NA" else $i % 5 end), number: (if $i == 3 then "4" else $i % 5 end),
    some: (if $i % 3 == 0 then $i else "a" end), "my-x": $i, "my x": $i, "gr\u00f6\u00dfe": $i, word: ["inf", "1b"][$i / 4 % 2 | floor]})' <<<"$MEMBERS")}"
for case in 'years number 40 18' 'comma decimal-comma 11 18' 'day date 2021-03-01 0'; do
    read -r NAME WRITTEN CELL NUMBERS <<<"$case"
    execute regress "{\"cohort\":\"quoted\",\"register\":false,\"permutations\":9,\"bootstraps\":100,\"formula\":\"shape ~ $NAME\"}"
    is "$STATUS $(json '[.warnings[] | select(.code == "column-is-text") | .figures | .column, .written, .cell, .numbers, (.cells | length)] | join(" ")')" \
        "200 $NAME $WRITTEN $CELL $NUMBERS 3" "levels that are all a $WRITTEN in quotes are told"
done
execute regress '{"cohort":"quoted","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ C(years) + word + label"}'
is "$STATUS $(json '[.warnings[] | select(.code == "column-is-text")] | length')" '200 0' 'levels that are meant, words and labels are not'
execute regress '{"cohort":"quoted","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ each"}'
is_problem 422 invalid-input 'a level for each subject'
like "$(json '.errors[0].detail')" 'one subject; each level needs two. "-0.1[0-9]*" and the others are numbers in quotes. Send them as numbers' \
    'is told what it lacks'
quoted_refused() { # FORMULA PATTERN
    execute regress "{\"cohort\":\"quoted\",\"register\":false,\"permutations\":9,\"bootstraps\":100,\"formula\":\"$1\"}"
    like "$STATUS $(json '.errors[0].detail')" "$2" "refused: $1"
}
quoted_refused 'shape ~ seldom' '422 .* not for 1 of 18. Of member 3 .* it is "NA", a text: send a number, or null'
quoted_refused 'shape ~ number' '422 .* it is "4", a number in quotes: send it as a number'
quoted_refused 'shape ~ some' '422 .* not for 12 of 18. .* it is "a", a text: write C[(]some[)] to take all as levels'
quoted_refused 'shape ~ my' '422 no member .* covariate "my"; the cohort has .*"my-x".*$'
quoted_refused 'shape ~ my-x' '422 .*If "my-x" is meant, write Q[(]"my-x"[)]'
quoted_refused 'shape ~ my x' '422 has "x" at character 12 .* is written Q[(]"my x"[)]'
quoted_refused 'shape ~ gro\u0308\u00dfe' '422 no member .*differs in how its letters are composed [(]Unicode NFC and NFD[)]'
quoted_refused 'shape ~ gra\u0308\u00dfe' '422 no member .*"word"$'

# Texts that differ in case or white space alone, numbers with their unit, and numbers beyond all use.
post_json /v1/cohorts "{\"name\":\"alike\",\"members\":$(jq -c 'to_entries | map(.key as $i | .value
    | .label = ["Patient", " patient"][$i % 2] | .covariates += {centre: ["North 1", "north1", "South"][$i % 3],
    stage: ["50 y", "60 y"][$i % 2], scanner: ["A", "NA", "B"][$i % 3], huge: (if $i == 4 then 1e308 else $i end)})' <<<"$MEMBERS")}"
execute regress '{"cohort":"alike","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ centre + stage"}'
is "$STATUS $(json_in_order '[.warnings[] | select(.code == "labels-alike") | .figures] | tojson')" \
    '200 [{"of":"centre","texts":["North 1","north1"]}]' 'levels that are alike are told, labels that do not count are not'
is "$(json '[.warnings[] | select(.code == "column-is-text") | .figures | [.column, .unit, .cells]] | tojson')" \
    '[["stage","y",["50 y","60 y"]]]' 'so are numbers with a unit'
is "$(json '.inputs.cohort.design | has("alike")')" false 'as warnings alone'
execute compare-groups '{"cohort":"alike","register":false,"permutations":9}'
is "$STATUS $(json_in_order '[.warnings[] | select(.code == "labels-alike") | .figures] | tojson')" \
    '200 [{"of":"label","texts":["Patient"," patient"]}]' 'and labels that are compared'
post_json /v1/cohorts "{\"name\":\"twice\",\"members\":$(jq -c 'to_entries | map(.key as $i | .value
    | .subject = (["sub-01", "Sub-01", "sub-1", "s10", "s 10", "S1.05", "S1.5"][$i] // "other\($i * 10)"))' <<<"$MEMBERS")}"
execute compare-groups '{"cohort":"twice","register":false,"permutations":9}'
is "$STATUS $(json_in_order '[.warnings[] | select(.code == "subjects-alike") | .figures] | tojson')" \
    '200 [{"texts":["sub-01","Sub-01","sub-1"],"count":2}]' 'and subjects, where zeros before a number are no difference either'
like "$(json '.warnings[] | select(.code == "subjects-alike") | .detail')" '"sub-01", "Sub-01", "sub-1", and so 1 more' 'in words'
execute regress '{"cohort":"alike","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ scanner"}'
is "$STATUS $(json_in_order '[.warnings[] | select(.code == "level-says-missing") | .figures] | tojson')" \
    '200 [{"of":"scanner","texts":["NA"]}]' 'a level that says that nothing is known is told'
is "$(json '.inputs.cohort.design | has("missing")')" false 'as a warning alone'
execute regress '{"cohort":"alike","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ huge"}'
is_problem 422 invalid-input 'a number beyond all use'
like "$(json '.errors[0] | .pointer + " " + .detail')" '^/inputs/formula huge of member 4 .* is 1e[+]308' 'is told by name and member'
execute compare-groups '{"cohort":"alike","register":false,"permutations":9,"covariates":["huge"]}'
is_problem 422 invalid-input 'also as a covariate'
like "$(json '.errors[0] | .pointer + " " + .detail')" '^/inputs/covariates/0 "huge" of member 4 .* is 1e[+]308' 'by name and member'
execute compare-groups '{"cohort":"study","register":false,"permutations":9,"covariates":["tiny","away"]}'
is "$STATUS $(json '.errors | length')" '422 2' 'differences that no number is fit for'
like "$(json '.errors[0] | .pointer + " " + .detail')" '^/inputs/covariates/0 the numbers of "tiny" differ by .*e-199 at most, .* in another unit' \
    'are told by name, with a way out'
like "$(json '.errors[1].detail')" '^"away" hardly differs between members, by .* give it less that number' 'as are those that are lost in a large number'
regress 'shape ~ age' ',"at":[{"age":1e308}]'
is_problem 422 invalid-input 'and where it is asked for'
like "$(json '.errors[0] | .pointer + " " + .detail')" '^/inputs/at/0/age age is 1e[+]308' 'which names it'
regress 'shape ~ site + age^2'
is_problem 422 invalid-input 'a power of a covariate, which in R is the covariate'
like "$(json '.errors[0].detail')" 'write I[(]age\^2[)]' 'hints at what is meant'

regress 'shape~treated+site+age' ',"at":[{"age":45}]'
compare "$(json ".terms[2].r2 / $(jq '.terms[0].r2' "$SCRATCH/first.json") - 1 | fabs")" '<' 1e-12 \
    'the order of terms does not matter, but for rounding'
regress 'shape ~ age * treated + I(age^2) + log(volume) - age:treated'
is "$(json '[.terms[].name] | join(" ")')" 'age treated I(age^2) log(volume)' 'operators are those of R'
regress 'shape ~ C(volume, Treatment(\"3.5\")) / age'
is "$(json '[.terms[] | "\(.name) \(.degreesOfFreedom)"] | join(", ")')" \
    'C(volume, Treatment("3.5")) 4, C(volume, Treatment("3.5")):age 5' \
    'levels of numbers, and a slope in each'
# Functions that take mean and deviation of the members: a point is standardized by those, so that predictions stay.
regress 'shape ~ C(site, Treatment(reference=\u0027B\u0027)) + age' ',"at":[{"age":45},{"age":70}]'
is "$(json '[.coefficients[].name] | join(" ")')" \
    "Intercept C(site, Treatment(reference='B'))[T.A] C(site, Treatment(reference='B'))[T.C] age" 'columns name their reference'
predicted() { # the coefficients of z of both predictions
    for K in 0 1; do
        curl -fsS "$URL/v1/surfaces/$(json ".predictions[$K].surface.id")/coefficients" | jq -c .z
    done | jq -sc .
}
PLAIN=$(predicted)
for FUNCTION in 'center(age)' 'scale(age)' 'standardize(age, ddof=1)' 'scale(age, scale=FALSE)'; do
    regress "shape ~ C(site, Treatment(\\\"B\\\")) + $FUNCTION" ',"at":[{"age":45},{"age":70}]'
    compare "$(jq -n --argjson a "$PLAIN" --argjson b "$(predicted)" \
        '[$a, $b | flatten] | transpose | map(.[0] - .[1] | fabs) | max')" '<' 1e-9 "$FUNCTION predicts what age does"
done

regress 'shape ~ C(site, Treatment(\"B\")) + moved' ',"at":[{"moved":1000000045},{"moved":1000000070}]'
compare "$(jq -n --argjson a "$PLAIN" --argjson b "$(predicted)" \
    '[$a, $b | flatten] | transpose | map(.[0] - .[1] | fabs) | max')" '<' 1e-6 'so does an age that is counted from far away'

regress 'shape ~ group'
is "$(json '[.terms[0].level, .coefficients[1].name] | tojson')" '["exact","group[T.b]"]' 'labels are groups'
P=$(json .terms[0].pValue)
execute compare-groups '{"cohort":"study","register":false,"permutations":99}'
is "$(json .pValue)" "$P" 'and two of them are what compare-groups compares'
regress 'shape ~ age' ',"at":[{"age":200}]'
is "$(json '[.warnings[] | select(.code == "extrapolated") | .figures.covariate] | join(" ")')" age 'a prediction far out is warned of'
FAR=$(json '.predictions[.warnings[] | select(.code == "extrapolated") | .figures.index].surface.name' |
    grep -o '[0-9]*$')
like "$(json '.warnings[] | select(.code == "extrapolated") | .detail')" "^Prediction $FAR is at" \
    'under the number that its surface has'

# ---- Against numpy --------------------------------------------------------------------------------------

if /usr/bin/python3 -c 'import numpy' 2>/dev/null; then
    jq -n --argjson members "$MEMBERS" --slurpfile found "$SCRATCH/first.json" '{members: $members, found: $found[0]}' >"$SCRATCH/both.json"
    /usr/bin/python3 - "$URL" "$SCRATCH/both.json" >"$SCRATCH/numpy.txt" <<'PYTHON'
import io, json, sys, urllib.request
import numpy as np

both = json.load(open(sys.argv[2]))
members, found = both['members'], both['found']
rows = found['terms'][0]['map']['nTheta']
fields = []
for member in members:
    url = f"{sys.argv[1]}/v1/surfaces/{member['id']}/srnf?format=npy&nTheta={rows}"
    fields.append(np.load(io.BytesIO(urllib.request.urlopen(url).read())))
y = np.array(fields)
weights = np.repeat(np.polynomial.legendre.leggauss(rows)[1], y.shape[2]) * 2 * np.pi / y.shape[2]
q = y.reshape(len(members), -1)
c = [m['covariates'] for m in members]
x = np.array([[1, m['age'], m['site'] == 'B', m['site'] == 'C', m['treated']] for m in c], float)
b = np.linalg.lstsq(x, q, rcond=None)[0]
ours = np.array([one['q'] for one in found['coefficients']]).reshape(b.shape)
print(np.abs(ours - b).max() / np.abs(b).max())

# Freedman and Lane with numpy's own permutations: p of the site, from 4000 of them.
w = np.repeat(weights, 3) ** 0.5
def projection(columns):
    return columns @ np.linalg.pinv(columns)
data, small, whole = q * w, projection(x[:, [0, 1, 4]]), projection(x)
fit = small @ data
def rss(hat, data):
    return ((data - hat @ data) ** 2).sum()
def f(data):
    large = rss(whole, data)
    return (rss(small, data) - large) / 2 / (large / (len(x) - 5))
random, observed = np.random.default_rng(1), f(data)
site = found['terms'][1]
print(abs(site['f'] / observed - 1))
as_far = sum(f(fit + (data - fit)[random.permutation(len(x))]) >= observed for _ in range(4000))
p = (1 + as_far) / 4001
# Ours is of 99 permutations: within four standard deviations.
print(abs(site['pValue'] - p) / (p * (1 - p) / 99) ** 0.5)
PYTHON
    compare "$(sed -n 1p "$SCRATCH/numpy.txt")" '<' 1e-10 'coefficients are those of least squares by numpy'
    compare "$(sed -n 2p "$SCRATCH/numpy.txt")" '<' 1e-9 'F is that of numpy'
    compare "$(sed -n 3p "$SCRATCH/numpy.txt")" '<' 4 'p is that of permutations by numpy'
else
    skip 'numpy is not installed'
fi

# ---- Refusals --------------------------------------------------------------------------------------------

refused() {
    regress "$1" "${3:-}"
    like "$STATUS $(json '.errors[0] | "\(.pointer) \(.detail)"')" "$2" "refused: $1"
}
for formula in 5 '["shape ~ age"]'; do
    execute regress "{\"cohort\":\"study\",\"formula\":$formula}"
    like "$STATUS $(json '.errors[0] | "\(.pointer) \(.detail)"')" '422 /inputs/formula must be a formula' "refused: the formula $formula"
done
refused 'shape ~ weight' '422 /inputs/formula no member of the cohort has a covariate "weight"; the cohort has .*"age"'
refused 'shape ~ age + late' '3 of 18 members have no "late", member 0'
refused 'shape ~ age + city' '2 of 18 members have no "city", member 4'
refused 'shape ~ one' '"one" is the same for all members'
refused 'shape ~ C(one)' '"one" has 1 level; 2 to 50 are needed'
refused 'shape ~ age + double' 'the terms age and double say the same: double repeats the first'
refused 'shape ~ label + arm' 'the terms label and arm say the same: arm repeats the first'
refused 'shape ~ group + age + label' 'the terms group and label say the same: label repeats the first'
refused 'shape ~ site + north' 'the term north follows from site, which says more: leave north out'
refused 'shape ~ north + age + site' 'the terms north and site say the same in part: a column of site follows from the first'
refused 'shape ~ age + volume + sum' 'the column sum follows from the constant and the columns before it'
refused 'shape ~ log(scale(age))' 'log.scale.age.. of member 0 .* is not finite: scale.age. is -1[.].* there, and log takes numbers above 0'
refused 'shape ~ exp(exp(age))' 'exp.exp.age.. of member 0 .* is not finite: exp.age. is 2.35.*e[+]17 there, of which exp makes a number too large'
refused 'shape ~ log(age)' '/inputs/at/0/age log.age. is not finite: age is -3 there, and log takes numbers above 0' ',"at":[{"age":-3}]'
refused 'shape ~ log(age)' '/inputs/at/0/age "age" must be a number' ',"at":[{"age":"x"}]'
refused 'shape ~ age' '/inputs/at/0/a~1b "a/b" is no covariate of the formula' ',"at":[{"a/b":1}]'
refused 'shape ~ C(zone) * C(shift)' '422 /inputs/formula no member has zone "v" and shift "n" together, so that C.zone.:C.shift. cannot be fitted: leave this interaction out'
refused 'shape ~ away + site' '422 /inputs/formula the column away hardly differs between members, from 100000000000.* center.x.'
refused 'shape ~ tiny' '422 /inputs/formula the numbers of the column tiny differ by .*e-199 at most, and differences from 1e-100 .* in another unit'
refused 'shape ~ Intercept' '422 /inputs/formula has a column "Intercept", which is the name of the constant: give the covariate another name'
refused 'shape ~ scale(age, ddof=1, ddof=0)' 'ddof= twice in scale'
refused 'shape ~ scale(age, rescale=False, rescale=True)' 'rescale= twice in scale'
refused 'shape ~ scale(age, rescale=False, center=False)' 'scale without center and rescale, which changes nothing'
refused 'shape ~ rare' 'level "x" of "rare" has one subject; each level needs two'
refused 'shape ~ log(site)' 'log.site. needs numbers'
refused 'shape ~ sqrt(Q(\"age\")' 'ends where a closing bracket is expected'
refused 'shape ~ poly(age)' 'has the function poly, which is not known'
refused 'shape ~ 0 + age' 'leaves out the constant'
refused 'shape ~ age age' 'has "age" at character 13 where'
refused 'age ~ sex' 'must begin with "shape ~"'
refused 'shape ~ 1' 'has no term'
refused 'shape ~ C(site, Treatment(\"D\"))' '"site" has no level "D"; it has "A", "B", "C"'
refused 'shape ~ bs(age, df=4)' 'has the function bs, which is not known; there are log, .*, center, scale, .*For a curve write powers'
refused 'shape ~ C(site, Sum)' 'has the contrast Sum, which is not known'
refused 'shape ~ age' '/inputs/at/0/site "site" is no covariate of the formula' ',"at":[{"site":"A"}]'
refused 'shape ~ site' '/inputs/at/0/site "site" must be a level that members have: "A", "B", "C"' ',"at":[{"site":"D"}]'
refused 'shape ~ age' '/inputs/at/0 must be an object' ',"at":[3]'
regress 'shape ~ C(volume) * site * treated'
like "$STATUS $(json '.errors[0].detail')" \
    '422 makes 29 columns, and with 18 subjects at most 14 can be fitted: leave terms out; C.volume.:site.* alone has 8' \
    'refused: more columns than subjects tell apart, by the largest term'

post_json /v1/cohorts "{\"name\":\"four\",\"members\":$(jq -c '.[:4]' <<<"$MEMBERS")}"
execute regress '{"cohort":"four","register":false,"permutations":9,"bootstraps":100,"formula":"shape ~ age"}'
is "$STATUS $(json '.errors[0] | "\(.pointer) \(.detail)"')" \
    '422 /inputs/cohort has 4 subjects; a formula of one column needs 5 at least' 'refused: too few subjects for any formula'
post_json /v1/cohorts "{\"name\":\"told\",\"members\":$(jq -c 'map(.covariates.told = if .label == "a" then 3 else 7 end)' <<<"$MEMBERS")}"
execute compare-groups '{"cohort":"told","register":false,"permutations":9,"covariates":["age","told"]}'
is "$STATUS $(json '.errors[0].pointer')" '422 /inputs/covariates/1' 'refused by compare-groups: covariates that determine the label'
like "$(json '.errors[0].detail')" '^"told" and the other covariates determine the label' 'by name'

# Visits of nine subjects, whose ages add up to the same.
post_json /v1/cohorts "$(jq '{name: "averaged", members: [to_entries[] |
    {id: .value.id, subject: "s\(.key % 9)", covariates: {age: (if .key < 9 then 40 + .key else 60 - (.key - 9) end),
     dose: .key}}]}' <<<"$MEMBERS")"
is "$STATUS" 201 'a cohort of subjects with two visits'
averaged() {
    execute regress "{\"cohort\":\"averaged\",\"register\":false,\"permutations\":9,\"bootstraps\":100,\"formula\":\"$1\"}"
    like "$STATUS $(json '.errors[0] | "\(.pointer) \(.detail)"')" "$2" "refused: $1 of subjects"
}
averaged 'shape ~ age' '422 /inputs/formula the column age is the same for all subjects once the members of each are averaged'
averaged 'shape ~ dose + I(dose^2) + age' '422 /inputs/formula the column age '

stop_server || not_ok 'the server ends well'
done_testing

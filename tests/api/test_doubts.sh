#!/usr/bin/env bash
# srnfd-test: plain-core (core/registration/test_register_known.c and test_standard.sh run its numerics)
# srnfd-test: slow
#
# test_doubts.sh - what records tell of a group that does not belong together: surfaces of two scales (refused), of
# several degrees, in several units. Small surfaces of nuclei.
# srnfd-test: once (core/registration has the figures in both builds)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400

run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

# The warnings of a code in the last body, or none.
warned() { # CODE
    json_in_order "[.warnings[] | select(.code == \"$1\")]"
}

count() { # CODE
    warned "$1" | jq length
}

encode() { # MESH LMAX [SCALE]
    run encode "{\"mesh\":\"$1\",\"lmax\":$2,\"parameterization\":\"area\",\"scale\":\"${3:-unit-area}\"}"
    json .surface.id
}

start_server "$SCRATCH/data" --workers 2 || exit 1
MESH=()
UNIT=()
for name in L_pallidum L_thalamus L_putamen L_amygdala; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESH+=("$(json .id)")
    UNIT+=("$(encode "$(json .id)" 6)")
done

# ---- Scales ------------------------------------------------------------------------------------------

OWN=("$(encode "${MESH[0]}" 6 none)" "$(encode "${MESH[1]}" 6 none)")
for process in distances mean pca evaluate-model; do
    run "$process" "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\",\"${OWN[0]}\"],\"register\":false}"
    is_problem 422 mixed-scales "$process: surfaces of two scales are refused"
done
like "$(json .detail)" "2 of unit area .${UNIT[0]}. and 1 of a size of their own .${OWN[0]} has the area [0-9]" \
    'with an example of each'
like "$(json .detail)" 'Encode all meshes again with one scale' 'and what to do'
run distances "{\"surfaces\":[\"${MESH[0]}\",\"${OWN[0]}\"],\"register\":false}"
is_problem 422 mixed-scales 'a mesh is of unit area'
run register "{\"template\":\"${UNIT[0]}\",\"moving\":\"${OWN[0]}\"}"
is_problem 422 mixed-scales 'so are pairs: register'
for process in geodesic transport; do
    run "$process" "{\"from\":\"${OWN[0]}\",\"to\":\"${UNIT[1]}\",\"vector\":{\"toward\":\"${UNIT[2]}\"}}"
    [ "$process" = geodesic ] && run geodesic "{\"from\":\"${OWN[0]}\",\"to\":\"${UNIT[1]}\"}"
    is_problem 422 mixed-scales "so are pairs: $process"
done
run distances "{\"surfaces\":[\"${OWN[0]}\",\"${OWN[1]}\"],\"register\":false}"
is "$STATUS" 200 'surfaces of their own size go together'
run mean "{\"surfaces\":[\"${OWN[0]}\",\"${OWN[1]}\"],\"register\":false}"
OWN_MEAN=$(json .surface.id)
run distances "{\"surfaces\":[\"${OWN[0]}\",\"$OWN_MEAN\"],\"register\":false}"
is "$STATUS" 200 'and with their mean'
run distances "{\"surfaces\":[\"${UNIT[0]}\",\"$OWN_MEAN\"],\"register\":false}"
is_problem 422 mixed-scales 'which does not go with others'
run mean "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\"],\"register\":false}"
UNIT_MEAN=$(json .surface.id)
compare "$(json '.surface.area - 1 | fabs')" '>' 1e-4 'a mean of surfaces of unit area has not quite that area'
run distances "{\"surfaces\":[\"${UNIT[0]}\",\"$UNIT_MEAN\"],\"register\":false}"
is "$STATUS" 200 'and goes with them'
run distances "{\"surfaces\":[\"$UNIT_MEAN\",\"${OWN[0]}\"],\"register\":false}"
is_problem 422 mixed-scales 'and not with others'
run pca "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\",\"${UNIT[2]}\"],\"register\":false}"
MODEL=$(json .model.id)
run project "{\"model\":\"$MODEL\",\"surface\":\"${OWN[0]}\"}"
is_problem 422 mixed-scales 'a model of unit area takes no others'
run sample "{\"model\":\"$MODEL\",\"count\":2,\"seed\":1}"
is "$STATUS" 200 'samples of it'
SAMPLE=$(json '.surfaces[0].id // .samples[0].surface.id')
run distances "{\"surfaces\":[\"${UNIT[0]}\",\"$SAMPLE\"],\"register\":false}"
is "$STATUS" 200 'go with its members'

# ---- Degrees -----------------------------------------------------------------------------------------

HIGH=("$(encode "${MESH[0]}" 9)" "$(encode "${MESH[1]}" 9)")
request PATCH "/v1/surfaces/${HIGH[0]}" --header 'Content-Type: application/json' --data-binary '{"name":"finer"}'
run distances "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\",\"${HIGH[0]}\"],\"register\":false}"
is "$STATUS $(count mixed-degrees)" '200 1' 'surfaces of two degrees are warned of'
is "$(warned mixed-degrees | command jq -c '.[0].figures')" '{"lowest":6,"highest":9,"usual":6,"others":1,"members":[2]}' \
    'with the figures'
like "$(warned mixed-degrees | jq -r '.[0].detail')" ' 1 of 3 members is not at 6, which most are: member 2 [(]finer[)] at 9[.]' \
    'and who is of the rarer degree'
run distances "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\"],\"register\":false}"
is "$STATUS $(count mixed-degrees)" '200 0' 'those of one are not'
run mean "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\",\"${HIGH[0]}\"],\"register\":false}"
is "$STATUS $(count mixed-degrees)" '200 1' 'so in a mean'
run mean "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\",\"${HIGH[0]}\"],\"register\":false,\"lmax\":6}"
is "$STATUS $(count mixed-degrees)" '200 0' 'unless all are cut to the lowest'
run geodesic "{\"from\":\"${UNIT[0]}\",\"to\":\"${HIGH[1]}\",\"steps\":2,\"method\":\"linear\",\"register\":false}"
is "$STATUS $(count mixed-degrees)" '200 1' 'so in a pair'
post_json /v1/cohorts "{\"name\":\"degrees\",\"members\":[{\"id\":\"${UNIT[2]}\",\"label\":\"ctl\"},
    {\"id\":\"${HIGH[0]}\",\"label\":\"pat\"},{\"id\":\"${UNIT[3]}\",\"label\":\"ctl\"},
    {\"id\":\"${HIGH[1]}\",\"label\":\"pat\"},{\"id\":\"${UNIT[0]}\",\"label\":\"ctl\"}]}"
run compare-groups '{"cohort":"degrees","register":false,"permutations":9}'
is "$STATUS $(warned mixed-degrees | command jq -c '.[0].figures')" '200 {"lowest":6,"highest":9,"labels":["ctl","pat"],"usual":6,"others":2,"members":[1,3]}' \
    'and where the degree goes with the label, that is said'
like "$(warned mixed-degrees | jq -r '.[0].detail')" 'goes with the label: up to 6 for ctl, from 9 for pat' 'in words too'

# ---- Units -------------------------------------------------------------------------------------------

# The first two again, as if their files were in metres; and the first in two units that are five to six times as long.
METRES=()
LONGER=()
in_unit() { # SURFACE-AS-OBJ MILLIMETRES: the mesh with coordinates so many times smaller, encoded
    awk -v unit="$2" '/^v / {printf "v %.9g %.9g %.9g\n", $2 / unit, $3 / unit, $4 / unit; next} /^f/' "$1" >"$SCRATCH/unit.obj"
    post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/unit.obj"
    encode "$(json .id)" 6
}
for i in 0 1; do
    run encode "{\"mesh\":\"${MESH[i]}\",\"lmax\":6,\"parameterization\":\"area\",\"scale\":\"none\"}"
    curl -s "$URL/v1/surfaces/$(json .surface.id)/mesh?format=obj&resolution=12" >"$SCRATCH/millimetres.obj"
    METRES+=("$(in_unit "$SCRATCH/millimetres.obj" 1000)")
    [ "$i" -eq 1 ] || LONGER=("$(in_unit "$SCRATCH/millimetres.obj" 5.9)" "$(in_unit "$SCRATCH/millimetres.obj" 5.5)")
done
members() { # THE-THREE-OF-PAT..
    local out='' i
    for i in 0 1 2; do
        out="$out,{\"id\":\"${UNIT[i]}\",\"label\":\"ctl\"}"
    done
    for i in "$@"; do
        out="$out,{\"id\":\"$i\",\"label\":\"pat\"}"
    done
    echo "[${out#,}]"
}
post_json /v1/cohorts "{\"name\":\"units\",\"members\":$(members "${METRES[@]}" "${UNIT[3]}")}"
run classify '{"cohort":"units","method":"harmonic-nn","lmax":4,"scale":"shape-and-size"}'
is "$STATUS $(count mixed-units)" '200 1' 'members in metres among others in millimetres are warned of'
compare "$(warned mixed-units | jq '.[0].figures | .greatest / .least')" '>' 900 'with the figures'
post_json /v1/cohorts "{\"name\":\"longer\",\"members\":$(members "${LONGER[@]}" "${UNIT[3]}")}"
run classify '{"cohort":"longer","method":"harmonic-nn","lmax":4,"scale":"shape-and-size"}'
is "$STATUS $(warned mixed-units | jq -c 'map(.figures.members)')" '200 [[3,4]]' 'so are two classes of sizes that are less than ten times apart'
request PATCH "/v1/surfaces/${METRES[0]}" --header 'Content-Type: application/json' --data-binary '{"name":"in metres"}'
run classify '{"cohort":"units","method":"harmonic-nn","lmax":4}'
is "$STATUS $(count mixed-units)" '200 1' 'where sizes do not count two classes of them are'
is "$(warned mixed-units | jq -c '.[0].figures | [.members, .first]')" "[[3,4],\"${METRES[0]}\"]" 'by their members'
like "$(warned mixed-units | jq -r '.[0].detail')" 'member 3 [(]in metres[)] first' 'with the name of the first'
run mean "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\",\"${UNIT[2]}\",\"${UNIT[3]}\"],\"register\":false}"
is "$STATUS $(count mixed-units)" '200 0' 'and structures of one unit are not'
run pca "{\"surfaces\":[\"${UNIT[0]}\",\"${UNIT[1]}\",\"${UNIT[2]}\",\"${UNIT[3]}\"],\"register\":false}"
MODEL=$(json .model.id)
run project "{\"model\":\"$MODEL\",\"surface\":\"${METRES[0]}\"}"
is "$STATUS $(count mixed-units)" '200 1' 'nor does a surface in metres pass beside a model in millimetres'
run project "{\"model\":\"$MODEL\",\"surface\":\"${UNIT[3]}\"}"
is "$STATUS $(count mixed-units)" '200 0' 'as one in millimetres does'
run transfer "{\"source\":\"${UNIT[0]}\",\"deformed\":\"${METRES[1]}\",\"target\":\"${UNIT[2]}\",\"register\":false}"
is "$STATUS $(count mixed-units)" '200 1' 'so in the ratio of sizes of a transfer'
run transfer "{\"source\":\"${UNIT[0]}\",\"deformed\":\"${UNIT[1]}\",\"target\":\"${METRES[0]}\",\"register\":false}"
is "$STATUS $(count mixed-units)" '200 0' 'where the target has its own units'

# Surfaces that keep the units of their files: their sizes count in every distance.
curl -s "$URL/v1/surfaces/${OWN[0]}/mesh?format=obj&resolution=12" >"$SCRATCH/millimetres.obj"
awk '/^v / {printf "v %.9g %.9g %.9g\n", $2 / 10, $3 / 10, $4 / 10; next} /^f/' "$SCRATCH/millimetres.obj" >"$SCRATCH/unit.obj"
post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/unit.obj"
CENTIMETRES=$(encode "$(json .id)" 6 none)
for process in distances mean pca; do
    run "$process" "{\"surfaces\":[\"${OWN[0]}\",\"$CENTIMETRES\"],\"register\":false}"
    is "$STATUS $(warned mixed-units | jq -c '.[0].figures | [.smallest, .largest]')" \
        "200 [\"$CENTIMETRES\",\"${OWN[0]}\"]" "$process: surfaces of their own size in two units are told of"
done
like "$(warned mixed-units | jq -r '.[0].detail')" '^Sizes count here, and surf-.* is [0-9.]* times as large as' 'in words too'
run geodesic "{\"from\":\"${OWN[0]}\",\"to\":\"$CENTIMETRES\",\"steps\":2,\"method\":\"linear\",\"register\":false}"
is "$STATUS $(count mixed-units)" '200 1' 'so in geodesic'
run register "{\"template\":\"$CENTIMETRES\",\"moving\":\"${OWN[0]}\"}"
is "$STATUS $(count mixed-units)" '200 1' 'so in register'
run distances "{\"surfaces\":[\"${OWN[0]}\",\"${OWN[1]}\"],\"register\":false}"
is "$STATUS $(count mixed-units)" '200 0' 'those of one unit are not'
run distances "{\"surfaces\":[\"${UNIT[0]}\",\"${METRES[0]}\"],\"register\":false}"
is "$STATUS $(count mixed-units)" '200 0' 'nor are two of unit area, whose sizes do not count'
run pca "{\"surfaces\":[\"${OWN[0]}\",\"${OWN[1]}\"],\"register\":false}"
run project "{\"model\":\"$(json .model.id)\",\"surface\":\"$CENTIMETRES\"}"
is "$STATUS $(count mixed-units)" '200 1' 'a surface beside a model in another unit is'

# ---- Covariates that are the label ---------------------------------------------------------------------

python3 - "$URL" >"$SCRATCH/told.json" <<'PYTHON'
import json, math
from service import send

def surface(k, more=0.0):
    rows = {axis: [0.0] * 25 for axis in 'xyz'}
    rows['x'][3], rows['y'][1], rows['z'][2] = 1.5, 1.2, 1.0 + 0.1 * (k % 2) + more
    for axis in 'xyz':
        for i in range(4, 16):
            rows[axis][i] = 0.03 * math.sin(1.7 * k * i + ord(axis) * i * i)
    return send('/v1/surfaces', {'coefficients': {'lmax': 4, **rows}})['id']

print(json.dumps({'name': 'told', 'again': surface(4, 0.002), 'new': surface(71), 'members': [{'id': surface(k), 'label': ('ctl', 'pat')[k % 2], 'covariates':
    {'group': k % 2, 'age': -999 if k == 3 else 40 + k * k % 11, 'dose': 100 * (k % 2) + k}} for k in range(14)]}))
PYTHON
AGAIN=$(jq -r .again "$SCRATCH/told.json") NEW=$(jq -r .new "$SCRATCH/told.json")
jq -c 'del(.again, .new)' "$SCRATCH/told.json" >"$SCRATCH/cohort.json"
post_json /v1/cohorts "@$SCRATCH/cohort.json"
run classify '{"cohort":"told","method":"srnf-gauss","components":2,"refit":"shared","commonPose":true,"covariates":["age","dose"]}'
is "$STATUS $(warned covariate-is-label | jq -c 'map(.figures.covariate)')" '200 ["dose"]' \
    'covariates that tell the label by themselves are told of'
is "$(warned covariate-far | jq -c 'map(.figures | [.covariate, .member])')" '[["age",3]]' 'so is a value far from all others'
like "$(warned covariate-is-label | jq -r '.[0].detail')" '^dose tells the label of all 14 subjects by itself' 'by name'

# ---- Members scanned again -----------------------------------------------------------------------------

run pca '{"cohort":"told","register":false}'
MODEL=$(json .model.id)
run score "{\"model\":\"$MODEL\",\"surface\":\"$AGAIN\",\"map\":false,\"calibration\":false}"
is "$STATUS $(warned near-duplicates | jq -c 'map(.figures.member)')" '200 [4]' 'what is next to a member is told of'
run score "{\"model\":\"$MODEL\",\"surface\":\"$NEW\",\"map\":false,\"calibration\":false}"
is "$STATUS $(count near-duplicates)" '200 0' 'and a new one is not'

done_testing

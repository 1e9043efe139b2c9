#!/usr/bin/env bash
# test_mirror.sh - left and right: surfaces encoded mirrored, members of cohorts taken mirrored, and the warning
# where left and right structures are compared as they are. Two pairs of nuclei at a low degree.
# srnfd-test: slow
# srnfd-test: release-only
# Under the sanitizers test_mirror_process.sh and test_subjects.sh mirror surfaces and members.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
REQUEST_SECONDS=400

# Runs a process to its end, however long it takes.
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

warned() { # the number of warnings of mirror images in the last body
    json '[.warnings[] | select(.code == "mirror-images")] | length'
}

start_server "$SCRATCH/data" --workers 2 || exit 1

# ---- encode ------------------------------------------------------------------------------------------

MESH=()
S=()
for name in L_caudate R_caudate L_putamen R_putamen; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESH+=("$(json .id)")
    run encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX,\"parameterization\":\"area\"}"
    S+=("$(json .surface.id)")
done
is "$(json .surface.mirrored)" false 'a surface says that it is no mirror image'
PLAIN=$(json '.surface | {volume, area, scale, x: .origin[0], y: .origin[1]} | tojson')
STAR=$(json '.starShaped.center | tojson')

run encode "{\"mesh\":\"${MESH[3]}\",\"lmax\":$LMAX,\"parameterization\":\"area\",\"mirror\":true}"
is "$STATUS $(json '[.surface.mirrored, .inputs.mirror] | tojson')" '200 [true,true]' 'a mesh is encoded mirrored'
IMAGE=$(json .surface.id)
isnt "$IMAGE" "${S[3]}" 'which is another surface'
compare "$(json ".surface.volume / ($PLAIN | .volume) - 1 | fabs")" '<' 0.01 'of the same volume, with its sign'
compare "$(json ".surface.scale / ($PLAIN | .scale) - 1 | fabs")" '<' 0.01 'and the same size'
compare "$(json "[(.surface.origin[0] - ($PLAIN | .x)), (.surface.origin[1] - ($PLAIN | .y))] | map(fabs) | max")" \
    '<' 0.1 'in the same place (millimetres)'
compare "$(json ".starShaped.center as \$c | $STAR | [.[0] - \$c[0], .[1] - \$c[1], .[2] - \$c[2]] | map(fabs) | max")" \
    '<' 1e-3 'its star centre is a point of the mesh as it was uploaded'
get "/v1/surfaces/$IMAGE"
is "$(json .mirrored)" true 'and its record keeps that it is a mirror image'
post_json /v1/surfaces "{\"coefficients\":$(curl -s "$URL/v1/surfaces/${S[0]}/coefficients?format=json"),\"name\":\"sent\"}"
is "$(json .mirrored)" false 'coefficients that are sent are none'
run encode "{\"mesh\":\"${MESH[0]}\",\"mirror\":\"yes\"}"
is_problem 422 invalid-input 'mirror is true or false'

# ---- Pairs -------------------------------------------------------------------------------------------

run register "{\"template\":\"${S[2]}\",\"moving\":\"${S[3]}\",\"degree\":4}"
is "$STATUS $(warned)" '200 1' 'registering a right putamen to a left one warns of mirror images'
note "$(json '.warnings[0].detail')"
like "$(json '.warnings[0].detail')" '^L_putamen and R_putamen: mirrored and registered, the distance would be 0\.[0-9]+ instead of 0\.' \
    'with both distances'
compare "$(json '.warnings[0].figures.distance - .distance | fabs')" '==' 0 'of which one is that of the result'
WOULD=$(json '.warnings[0].figures.mirrored')
compare "$WOULD" '<' "$(json '0.9 * .distance')" 'and the other clearly lower'
run register "{\"template\":\"${S[2]}\",\"moving\":\"$IMAGE\",\"degree\":4}"
is "$(warned) $(json .surface.mirrored)" '0 true' 'after mirroring there is no warning, and the record follows'
compare "$(json ".distance / $WOULD - 1 | fabs")" '<' 0.05 'and the distance is what the warning said'
run register "{\"template\":\"${S[2]}\",\"moving\":\"${S[3]}\",\"degree\":4,\"handedness\":\"ignore\"}"
is "$(warned) $(json .inputs.handedness)" '0 ignore' 'handedness can be ignored'
run geodesic "{\"from\":\"${S[0]}\",\"to\":\"${S[1]}\",\"steps\":2,\"method\":\"linear\"}"
is "$STATUS $(warned)" '200 1' 'a geodesic from left to right warns too'
run geodesic "{\"from\":\"$IMAGE\",\"to\":\"${S[2]}\",\"steps\":3,\"method\":\"linear\",\"register\":false}"
is "$(json '[.surfaces[].mirrored] | tojson')" '[true,false,false]' 'and says which of its surfaces are mirror images'

# ---- Cohorts -----------------------------------------------------------------------------------------

cohort() { # NAME MEMBER..
    local name=$1
    shift
    post_json /v1/cohorts "{\"name\":\"$name\",\"members\":[$(
        IFS=,
        echo "$*"
    )]}"
}

plain=()
turned=()
for i in 0 1 2 3; do
    plain+=("{\"id\":\"${S[i]}\"}")
    turned+=("{\"id\":\"${S[i]}\",\"mirror\":$([ $((i % 2)) = 1 ] && echo true || echo false)}")
done
cohort plain "${plain[@]}"
is "$STATUS $(json '.members | map(.mirror) | tojson')" '201 [false,false,false,false]' 'members are not mirrored by default'
cohort plain "{\"id\":\"${S[0]}\",\"mirror\":false}" "${plain[@]:1}"
is "$STATUS" 200 'which may be said'
cohort turned "${turned[@]}"
is "$STATUS $(json '.members | map(.mirror) | tojson')" '201 [false,true,false,true]' 'unless it is asked for'
cohort wrong "{\"id\":\"${S[0]}\",\"mirror\":1}"
is "$STATUS $(json '.errors[0].pointer')" '422 /members/0/mirror' 'by true'

cohort caudates "${plain[@]:0:2}"
cohort turned-caudates "${turned[@]:0:2}"
run distances '{"cohort":"caudates"}'
is "$STATUS $(warned)" '200 1' 'distances between left and right ones come with the warning'
note "$(json '.warnings[0].detail')"
is "$(json '.warnings[0].figures | [.tried, .better, (.pairs[] | .first, .second)] | tojson')" '[1,1,0,1]' 'for the pair'
compare "$(json '.warnings[0].figures.pairs[0].distance - .matrix[0][1] | fabs')" '==' 0 'with the distance as it is'
WOULD=$(json '.warnings[0].figures.pairs[0].mirrored')
compare "$WOULD" '<' "$(json '0.9 * .matrix[0][1]')" 'and a clearly lower one'

# Two surfaces whose names say nothing, one of them turned over: distances find out, as register does.
nameless() { # SURFACE NAME
    post_json /v1/surfaces "{\"coefficients\":$(curl -s "$URL/v1/surfaces/$1/coefficients?format=json"),\"name\":\"$2\"}"
    json .id
}
run encode "{\"mesh\":\"${MESH[0]}\",\"lmax\":$LMAX,\"parameterization\":\"area\",\"mirror\":true}"
TURNED=$(json .surface.id)
TURNED=$(nameless "$TURNED" turned)
PLAIN=$(nameless "${S[0]}" plain)
run distances "{\"surfaces\":[\"$PLAIN\",\"$TURNED\"]}"
is "$STATUS $(warned)" '200 1' 'distances of two try a mirrored match whatever they are called'
compare "$(json '.warnings[] | select(.code == "mirror-images") | .figures.mirrored / .figures.distance')" '<' 0.1 \
    'which is that of the mirror image'
compare "$(json '(.warnings[] | select(.code == "mirror-images") | .figures.distance) - .matrix[0][1] | fabs')" '==' 0 \
    'against the distance as they are'
run distances "{\"surfaces\":[\"$PLAIN\",\"$TURNED\"],\"handedness\":\"ignore\"}"
is "$STATUS $(warned)" '200 0' 'unless that is not wanted'
run distances '{"cohort":"turned-caudates"}'
is "$STATUS $(warned) $(json '.inputs.cohort.mirrored | tojson')" '200 0 [false,true]' 'with one side mirrored there is none'
compare "$(json ".matrix[0][1] / $WOULD - 1 | fabs")" '<' 1e-9 'and the distance is what the warning said'
run distances "{\"surfaces\":[\"${S[0]}\",\"${S[1]}\"],\"register\":false,\"handedness\":\"ignore\"}"
is "$(warned)" 0 'ignored, nothing is tried'
run distances "{\"surfaces\":[\"${S[0]}\",\"${S[2]}\"],\"register\":false}"
is "$(warned)" 0 'two of one side are not tried'

for cohort in plain turned; do
    run mean "{\"cohort\":\"$cohort\",\"register\":false}"
    is "$STATUS $(warned)" "200 $([ $cohort = plain ] && echo 1 || echo 0)" "a mean of the $cohort ones"
    run pca "{\"cohort\":\"$cohort\",\"register\":false}"
    is "$STATUS $(warned)" "200 $([ $cohort = plain ] && echo 1 || echo 0)" "and their components"
done
note "$(json '.warnings')"

# The labels tell of the sides here: the names agree.
labelled() { # COHORT MIRROR
    cohort "$1" "{\"id\":\"${S[0]}\",\"label\":\"L\"}" "{\"id\":\"${S[1]}\",\"label\":\"R\",\"mirror\":$2}" \
        "{\"id\":\"${S[2]}\",\"label\":\"L\"}" "{\"id\":\"${S[3]}\",\"label\":\"R\",\"mirror\":$2}" \
        "{\"id\":\"$NEXT\",\"label\":\"L\"}"
}
NEXT=$(curl -s "$URL/v1/surfaces?limit=20" | jq -r '[.items[] | select(.name == "sent")][0].id // empty')
like "$NEXT" '^surf-' 'a surface without a side in its name'
labelled sides false
run compare-groups '{"cohort":"sides","register":false,"permutations":10}'
is "$STATUS $(warned)" '200 1' 'comparing L with R warns of it'
like "$(json '.warnings[] | select(.code == "mirror-images").detail')" '^L and R: .* 5 members' 'by the labels'
labelled mirrored-sides true
run compare-groups '{"cohort":"mirrored-sides","register":false,"permutations":10}'
is "$STATUS $(warned)" '200 0' 'and not when one side is mirrored'

# A mesh is mirrored as encode does it: the two are one surface.
run encode "{\"mesh\":\"${MESH[2]}\",\"mirror\":true}"
cohort same "{\"id\":\"${MESH[2]}\",\"mirror\":true}" "{\"id\":\"$(json .surface.id)\"}"
run distances '{"cohort":"same","register":false}'
is "$(json '.matrix[0][1]')" 0 'a mesh among the members is mirrored as encode does it'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

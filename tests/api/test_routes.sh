#!/usr/bin/env bash
# test_routes.sh - surfaces that came to their sphere by different routes: groups of them are refused unless asked
# for, pairs are told, and what processes make goes by the route of what it was made of.
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
start_server "$SCRATCH/data" --workers 2 || exit 1

encode() { # MESH ROUTE: sets ID
    execute encode "{\"mesh\":\"$1\",\"lmax\":$LMAX,\"parameterization\":\"$2\"}"
    ID=$(json .surface.id)
}
warned() { # whether the result has that warning, whatever else it warns of
    json '.warnings | map(.code | select(. == "mixed-routes")) | join(" ")'
}

declare -a MESHES AREA
for name in L_pallidum R_pallidum L_thalamus R_thalamus L_amygdala; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESHES+=("$(json .id)")
    encode "${MESHES[-1]}" area
    AREA+=("$ID")
done
is "$(json .surface.route)" area 'the record of a surface tells its route'
encode "${MESHES[0]}" star
STAR=$ID
is "$(json .surface.route)" star 'star where that was asked for'

# ---- groups ------------------------------------------------------------------------------------------

PAIR="\"surfaces\":[\"${AREA[1]}\",\"${AREA[2]}\",\"$STAR\"]"
execute distances "{$PAIR}"
is_problem 422 mixed-routes 'surfaces of two routes are refused'
like "$(json .detail)" "$STAR" 'and the odd ones named'
like "$(json .detail)" 'one parameterization, or set mixedRoutes' 'with the way out'
members=
for k in 0 1 2 3 4; do
    members="$members,{\"id\":\"${AREA[k]}\",\"label\":\"$((k % 2))\"}"
done
post_json /v1/cohorts "{\"name\":\"mixed\",\"members\":[{\"id\":\"$STAR\",\"label\":\"1\"}$members]}"
for process in distances mean pca evaluate-model classify compare-groups; do
    execute "$process" '{"cohort":"mixed"}'
    is_problem 422 mixed-routes "so does a cohort of them, by $process"
done
execute distances "{\"surfaces\":[\"${MESHES[1]}\",\"$STAR\"]}"
is_problem 422 mixed-routes 'a mesh goes by the default route, and so not with star'
execute distances "{\"surfaces\":[\"${MESHES[1]}\",\"${AREA[0]}\"],\"register\":false}"
is "$STATUS $(warned)" '200 ' 'but with area'
execute distances "{$PAIR,\"register\":false,\"mixedRoutes\":1}"
is_problem 422 invalid-input 'mixedRoutes is true or false'

execute distances "{$PAIR,\"register\":false,\"mixedRoutes\":true}"
is "$STATUS $(warned)" '200 mixed-routes' 'those who ask for it get an answer, and a warning'
is "$(json_in_order '.warnings[] | select(.code == "mixed-routes") | .figures | tojson')" '{"star":1,"area":2,"given":0,"unknown":0,"bridged":0}' 'with the counts'
like "$(json '.warnings[] | select(.code == "mixed-routes") | .detail')" "1 by star .$STAR" 'and the odd ones'
for process in mean pca evaluate-model; do
    FEW=$([ $process = evaluate-model ] && echo ',"samples":5')
    execute "$process" "{$PAIR,\"register\":false,\"mixedRoutes\":true$FEW}"
    is "$STATUS $(warned)" '200 mixed-routes' "so has $process"
done
execute classify '{"cohort":"mixed","mixedRoutes":true,"method":"harmonic-nn"}'
is "$STATUS $(json .bridged) $(warned)" '200 true ' 'but not classify, which registers, and so bridges them'
execute compare-groups '{"cohort":"mixed","mixedRoutes":true,"register":false,"permutations":2}'
is "$STATUS $(warned)" '200 mixed-routes' 'so has compare-groups'

# ---- what is made goes by the route of what it was made of ---------------------------------------------

execute invert "{\"srnf\":{\"surface\":\"$STAR\"}}"
INVERTED=$(json .surface.id)
is "$(json .surface.route)" star 'what is inverted has the route of its surface'
execute distances "{\"surfaces\":[\"$INVERTED\",\"${AREA[1]}\"]}"
is_problem 422 mixed-routes 'which counts in a group'
execute mean "{\"surfaces\":[\"${AREA[0]}\",\"${MESHES[1]}\"],\"register\":false}"
is "$(json .surface.route)" area 'a mean has that of its members'
execute mean "{$PAIR,\"register\":false,\"mixedRoutes\":true}"
is "$(json .surface.route)" null 'but none where they differ'
execute geodesic "{\"from\":\"${AREA[0]}\",\"to\":\"$STAR\",\"steps\":3,\"register\":false}"
is "$(json '.surfaces | map(.route) | tojson')" '["area",null,"star"]' 'nor has what lies between two routes'
is "$(warned)" mixed-routes 'and the geodesic is warned of'
execute geodesic "{\"from\":\"${MESHES[0]}\",\"to\":\"${MESHES[1]}\",\"steps\":2,\"register\":false,\"method\":\"closed-form\"}"
is "$(json '.surfaces | map(.route) | tojson') $(warned)" '["star","star"] ' 'meshes go by star for the closed form'

get "/v1/surfaces/${AREA[3]}/coefficients"
jq -c '{coefficients: (.x[5] += 0.001 | .)}' "$BODY" >"$SCRATCH/sent.json"
post_json /v1/surfaces "@$SCRATCH/sent.json"
SENT=$(json .id)
is "$STATUS $(json .route)" '201 null' 'of coefficients that are sent in no route is known'
execute distances "{\"surfaces\":[\"$SENT\",\"${AREA[3]}\"],\"register\":false}"
is "$STATUS $(warned)" '200 mixed-routes' 'beside others they are warned of'
is "$(json '.warnings[] | select(.code == "mixed-routes") | .figures.unknown')" 1 'as not known'
execute distances "{\"surfaces\":[\"$SENT\",\"$SENT\"],\"register\":false}"
is "$STATUS $(warned)" '200 ' 'and by themselves they are not'

# ---- pairs -------------------------------------------------------------------------------------------

execute pca "{\"surfaces\":[\"${AREA[0]}\",\"${AREA[1]}\",\"${AREA[2]}\"],\"register\":false}"
MODEL=$(json .model.id)
execute project "{\"model\":\"$MODEL\",\"surface\":\"${AREA[3]}\"}"
is "$(warned)" '' 'a surface of the route of the model is projected without a word'
execute project "{\"model\":\"$MODEL\",\"surface\":\"$INVERTED\"}"
like "$(warned)" mixed-routes 'one of another route with a warning'
encode "${MESHES[1]}" star
OTHER=$ID
execute register "{\"template\":\"${AREA[0]}\",\"moving\":\"$INVERTED\",\"degree\":2,\"start\":\"rigid\"}"
is "$STATUS $(json .bridged)" '200 false' 'one registered to another'
like "$(warned)" mixed-routes 'has it where nothing leads from route to route'

# ---- through the mesh ----------------------------------------------------------------------------------

execute register "{\"template\":\"${AREA[0]}\",\"moving\":\"$STAR\"}"
is "$STATUS $(json .bridged) $(json '.warp.links | map(.kind) | index("series") != null')" '200 true true' \
    'one mesh by two routes is registered by what the mesh knows of both'
unlike "$(warned)" mixed-routes 'without that warning'
SAME=$(json .distance)
compare "$(json .minJacobian)" '>' 0 'and does not fold'
is "$(json .surface.route)" area 'what is registered has the route of its template'
execute geodesic "{\"from\":\"$STAR\",\"to\":\"${AREA[0]}\",\"steps\":2}"
is "$(json .bridged)" true 'so does a geodesic'
like "$(json .registration.note)" 'maps of the meshes' 'which says how'
if [ -z "$SRNFD_SANITIZED" ]; then
    execute distances "{\"surfaces\":[\"${AREA[0]}\",\"$STAR\",\"${AREA[1]}\"],\"mixedRoutes\":true}" \
        --header 'Prefer: wait=120'
    compare "$(json '.matrix[0][1]')" '<=' "$SAME" 'and distances'
    compare "$(json '.matrix[0][1]')" '<' "$(json '.matrix[0][2]')" 'a surface is nearer to itself than to another'
    compare "$(json '.matrix[1][2] / .matrix[0][2] - 1 | fabs')" '<' 0.2 'and equally far from that by either route'
else
    skip 'distances go through the mesh' 'slow under a sanitizer'
fi
execute shoot "{\"surface\":\"${AREA[0]}\",\"velocity\":{\"toward\":\"$OTHER\"},\"times\":[1],\"register\":false}"
is "$STATUS $(warned)" '200 mixed-routes' 'shot towards another'
execute transport "{\"from\":\"${AREA[0]}\",\"to\":\"$OTHER\",\"vector\":{\"toward\":\"${AREA[1]}\"},\"register\":false}"
is "$STATUS $(warned)" '200 mixed-routes' 'transported to another'
execute transfer "{\"source\":\"${AREA[0]}\",\"deformed\":\"${AREA[1]}\",\"target\":\"$OTHER\",\"register\":false}"
is "$STATUS $(warned)" '200 mixed-routes' 'or deformed as another'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

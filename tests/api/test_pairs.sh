#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: timeout 600
#
# test_pairs.sh - what the processes say of one pair of surfaces agrees: geodesic from either side, distances and
# register; what was searched is told; the closed form is told of where it applies; and numbers that are to be doubted
# come with a warning. Its core runs under the sanitizers in tests/core/shape.
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400
start_server "$SCRATCH/data" --workers 2 || exit 1

encode() { # NAME LMAX ROUTE: sets ID
    post "/v1/meshes?name=$1" --data-binary "@tests/data/aal_subcortex/$1.ply"
    execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$2,\"parameterization\":\"$3\"}"
    ID=$(json .surface.id)
}
# Runs a process to its end, however long it takes.
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}
same() { # A B NAME: to rounding
    compare "$(jq -n "$1 / $2 - 1 | fabs")" '<' 1e-12 "$3"
}
warned() { # the codes of the last result
    json '[.warnings[].code] | join(" ")'
}
encode L_pallidum 6 area
A=$ID
encode L_amygdala 6 area
B=$ID
encode L_pallidum 6 star
STAR=$ID
encode L_amygdala 8 star
STAR8=$ID

# ---- As the surfaces are parameterized ---------------------------------------------------------------

run geodesic "{\"from\":\"$STAR\",\"to\":\"$STAR8\",\"steps\":3,\"register\":false}"
THERE=$(json .distance)
is "$STATUS $(json '.distance == .lineLength')" '200 true' 'without registration the distance is the length of the line'
run distances "{\"surfaces\":[\"$STAR\",\"$STAR8\"],\"register\":false}"
is "$(json .lmax)" 8 'surfaces of two degrees are compared at the larger one'
same "$(json '.matrix[0][1]')" "$THERE" 'where distances have the distance of the geodesic'
run distances "{\"surfaces\":[\"$STAR\",\"$STAR8\"],\"register\":false,\"lmax\":4}"
is "$STATUS $(json .lmax) $(json '[.warnings[]?.code] | index("mixed-degrees")')" '200 4 null' 'or at the degree that is asked for'
isnt "$(json '.matrix[0][1]')" "$THERE" 'which is another distance'
CUT=$(json '.matrix[0][1]')
run neighbours "{\"surfaces\":[\"$STAR\",\"$STAR8\"],\"lmax\":4}"
is "$STATUS $(json .lmax)" '200 4' 'as neighbours are found at one'
compare "$(json '.distances[0][0]')" '<=' "$CUT" 'no further apart, registered'

# ---- The closed form ---------------------------------------------------------------------------------

run geodesic "{\"from\":\"$STAR\",\"to\":\"$STAR8\",\"steps\":3,\"register\":false,\"method\":\"closed-form\"}"
is "$(json '[.energies.closedForm, .relativeEnergies.closedForm] | map(length) | tojson') $(warned)" '[3,3] mixed-degrees' \
    'between radial surfaces the closed form applies'
run geodesic "{\"from\":\"$STAR\",\"to\":\"$B\",\"steps\":3,\"register\":false,\"method\":\"closed-form\"}"
is "$(json '[.energies.closedForm, .relativeEnergies.closedForm] | tojson') $(warned)" \
    '[null,null] closed-form-inapplicable mixed-routes' 'one that is not radial is enough for it not to apply'
run geodesic "{\"from\":\"$A\",\"to\":\"$B\",\"steps\":3,\"register\":false}"
is "$(json '[.energies.closedForm, (.energies.linear | length)] | tojson') $(warned)" '[null,3] ' \
    'which is null, and nothing to warn of, where nobody asked for it'
run invert "{\"srnf\":{\"surface\":\"$STAR\"},\"method\":\"closed-form\"}"
compare "$(json .closedForm.relativeEnergy)" '<' 1e-20 'of a radial surface it is the inverse'
is "$(json '"\(.converged) \(.stopped)"') $(warned)" 'true tolerance ' 'and says so'
run invert "{\"srnf\":{\"surface\":\"$A\"},\"method\":\"closed-form\"}"
is "$(json '"\(.closedForm.relativeEnergy) \(.converged) \(.stopped)"') $(warned)" \
    'null false closedForm closed-form-inapplicable not-reached' 'of another it is nothing'
run invert "{\"srnf\":{\"surface\":\"$A\"}}"
is "$(json '"\(.closedForm.relativeEnergy) \(.converged) \(.stopped)"') $(warned)" 'null true tolerance ' \
    'whose SRNF the search inverts'

# ---- Registered --------------------------------------------------------------------------------------

run geodesic "{\"from\":\"$A\",\"to\":\"$B\",\"steps\":2,\"method\":\"linear\"}"
cp "$BODY" "$SCRATCH/there.json"
THERE=$(json .distance)
is "$STATUS $(json '.distance == .registration.distance')" '200 true' 'a registered pair has one distance'
is "$(json '.registration | [.symmetric, .options.symmetric, .converged, .stopped] | tojson')" \
    '[true,true,true,"stationary"]' 'both ways were searched to the end'
like "$(json .registration.note)" '^Both ways .* same from either side' 'which the result says in words'
note "distance $THERE, line $(json .lineLength), truncation $(json .registration.truncationError), warnings $(warned)"
compare "$(json '.lineLength - .distance | fabs')" '<=' "$(json '.registration.truncationError * 1.0001')" \
    'the line is longer or shorter by no more than what the degree cuts off'
run geodesic "{\"from\":\"$B\",\"to\":\"$A\",\"steps\":2,\"method\":\"linear\"}"
is "$(json .distance)" "$THERE" 'the distance is the same from the other side'
run geodesic "{\"from\":\"$A\",\"to\":\"$B\",\"steps\":2,\"method\":\"linear\",\"symmetric\":false}"
is "$(json '.registration | [.symmetric, .options.symmetric, .inverseConsistency] | tojson')" '[false,false,null]' \
    'one way is searched where that is asked for'
ONE_WAY=$(json .distance)
run distances "{\"surfaces\":[\"$B\",\"$A\"]}"
same "$(json '.matrix[0][1]')" "$THERE" 'and that of distances'
is "$(json '.registration | [.symmetric, .degree, .penalty.jacobian, .penalty.displacement] | tojson')" \
    '[true,12,0.003,0.01]' 'which tell how they registered'
run register "{\"template\":\"$A\",\"moving\":\"$B\",\"symmetric\":true}"
is "$(json '"\(.distance) \(.symmetric) \(.registration.symmetric) \(.inverseConsistency >= 0)"')" \
    "$THERE true true true" 'and that of register both ways'
is "$(json '.truncationError')" "$(jq -r .registration.truncationError "$SCRATCH/there.json")" 'whose surface ends the path'
run register "{\"template\":\"$A\",\"moving\":\"$B\"}"
is "$(json '"\(.symmetric) \(.inverseConsistency)"')" 'false null' 'by default register searches one way'
like "$(json .note)" '^One way .* may differ.* both ways' 'which it says in words'
compare "$(json .distance)" '>=' "$(jq -n "$THERE * 0.999")" 'and finds no less'
is "$(json .distance)" "$ONE_WAY" 'as the geodesic one way'
run distances "{\"surfaces\":[\"$A\",\"$B\"],\"metric\":\"srm\"}"
is "$(json '[.registration.symmetric, (.matrix[0][1] != '"$THERE"')] | tojson')" '[true,true]' \
    'another metric has another distance'

# ---- The other processes -----------------------------------------------------------------------------

AS_POSED='"commonPose":true'
run shoot "{\"surface\":\"$A\",\"velocity\":{\"toward\":\"$B\"},\"times\":[0],$AS_POSED}"
ALONG=$(json .registration.distance)
is "$(json '.registration | [.symmetric, .options.symmetric, .stopped, .ambiguity.rotationalCurvature] | tojson')" \
    '[true,true,"stationary",null]' 'shoot searches both ways; nothing is known of rotations that were not tried'
run shoot "{\"surface\":\"$B\",\"velocity\":{\"toward\":\"$A\"},\"times\":[0],$AS_POSED}"
is "$(json .registration.distance)" "$ALONG" 'and finds the same from the other side'
run transport "{\"from\":\"$A\",\"to\":\"$B\",\"vector\":{\"toward\":\"$B\"},$AS_POSED}"
is "$(json '.registration | [.toward.distance, .from.distance, .toward.symmetric, .from.symmetric] | tojson')" \
    "[$ALONG,$ALONG,true,true]" 'as does transport, twice'
run transfer "{\"source\":\"$A\",\"deformed\":\"$B\",\"target\":\"$B\",$AS_POSED}"
is "$(json '.registration | [.deformed.distance, .source.distance] | tojson')" "[$ALONG,$ALONG]" 'and transfer'

# ---- Doubts ------------------------------------------------------------------------------------------

run register "{\"template\":\"$A\",\"moving\":\"$B\",\"start\":\"identity\",\"reparameterization\":false}"
is "$(json '"\(.stopped) \(.converged) \(.ambiguity.objective) \(.ambiguity.angle)"')" 'direct true null null' \
    'where nothing is searched for it says so'
run register "{\"template\":\"$A\",\"moving\":\"$A\",\"start\":\"identity\"}"
is "$(json .stopped) $(warned)" 'tolerance ' 'a surface is on itself at once'
run register "{\"template\":\"$A\",\"moving\":\"$B\",\"start\":\"identity\",\"penalty\":\"none\",\"degree\":20}"
note "$(json '"J \(.minJacobian) to \(.maxJacobian), truncation \(.truncationError), distance \(.distance)"')"
like "$(warned)" 'registration-truncated' 'a surface that its degree cuts to pieces is warned of'
compare "$(json '.warnings[] | select(.code == "registration-truncated") | .figures | .truncationDistance / .distance')" \
    '>' 0.5 'with the figures'
# A sphere and one that is a little longer can be turned at will.
sphere() { # FACTOR: sets ID
    post_json /v1/surfaces "$(jq -nc --argjson k "$1" '[range(25) | 0] as $o | (4 * 3.141592653589793 / 3 | sqrt) as $r |
        {coefficients: {lmax: 4, x: ($o | .[3] = $r), y: ($o | .[1] = $r), z: ($o | .[2] = $r * $k)}}')"
    ID=$(json .id)
}
sphere 1
ROUND=$ID
sphere 1.05
run register "{\"template\":\"$ID\",\"moving\":\"$ROUND\",\"start\":\"rigid\",\"degree\":2}"
is "$(warned)" registration-ambiguous 'surfaces that can be turned against each other are warned of'
note "$(json '.ambiguity | tojson')"

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

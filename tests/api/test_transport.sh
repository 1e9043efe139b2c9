#!/usr/bin/env bash
# srnfd-test: timeout 600
#
# test_transport.sh - shoot, transport and transfer end to end, on small surfaces of brain structures: the ends
# that velocities point at, a vector that comes back, deformations with their sizes, and what is registered.
# srnfd-test: slow
# srnfd-test: once (core/pullback has the figures in both builds)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
REQUEST_SECONDS=400

# Largest absolute value of a jq expression over the last body.
largest() { # EXPRESSION
    json "[$1] | map(fabs) | max"
}

run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

# Coefficients of a surface into a file.
coefficients() { # SURFACE FILE
    get "/v1/surfaces/$1/coefficients"
    cp "$BODY" "$2"
}

# Largest difference between the coefficients in two files.
apart() { # FILE FILE
    jq -s '[.[0], .[1]] | map(.x + .y + .z) | transpose | map(.[0] - .[1] | fabs) | max' "$1" "$2"
}

start_server "$SCRATCH/data" --workers 2 || exit 1
S=()
M=()
for name in L_thalamus R_thalamus L_pallidum; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    M+=("$(json .id)")
    execute encode "{\"mesh\":\"${M[-1]}\",\"lmax\":$LMAX,\"parameterization\":\"star\"}"
    S+=("$(json .surface.id)")
done
for i in 0 1 2; do
    coefficients "${S[$i]}" "$SCRATCH/s$i.json"
done
AS_THEY_ARE='"register":false'

# ---- shoot -------------------------------------------------------------------------------------------

run shoot "{\"surface\":\"${S[0]}\",\"velocity\":{\"toward\":\"${S[1]}\"},\"times\":[1,0,0.5],$AS_THEY_ARE}"
is "$STATUS $(json '[(.surfaces | length), .times, .registration] | tojson')" '200 [3,[1,0,0.5],null]' 'three shots'
cp "$BODY" "$SCRATCH/shot.json"
is "$(json '.surfaces[1].id')" "${S[0]}" 'at t = 0 it is the surface itself'
compare "$(json '.relativeEnergies[0]')" '<' 1e-14 'at t = 1 the line is at a surface again'
coefficients "$(json '.surfaces[0].id')" "$SCRATCH/end.json"
compare "$(apart "$SCRATCH/end.json" "$SCRATCH/s1.json")" '<' 1e-7 'which is the one that the velocity is toward'
compare "$(jq '.relativeEnergies[2]' "$SCRATCH/shot.json")" '>' 1e-9 'on the way it leaves the image of Q'
is "$(jq -r '.surfaces[2].source | "\(.process) \(.reference)"' "$SCRATCH/shot.json")" "shoot ${S[0]}" 'deformation is measured from where it started'
get "/v1/surfaces/${S[1]}"
compare "$(json ".scale / $(jq '.surfaces[0].scale' "$SCRATCH/shot.json") - 1 | fabs")" '<' 1e-12 'its scale goes along'
run geodesic "{\"from\":\"${S[0]}\",\"to\":\"${S[1]}\",\"steps\":3,$AS_THEY_ARE}"
coefficients "$(json '.surfaces[1].id')" "$SCRATCH/middle.json"
coefficients "$(jq -r '.surfaces[2].id' "$SCRATCH/shot.json")" "$SCRATCH/half.json"
compare "$(apart "$SCRATCH/middle.json" "$SCRATCH/half.json")" '<' 1e-3 'half way it is on their geodesic'

# Growing: the motion of the points is the surface itself.
MOTION=$(jq -c . "$SCRATCH/s0.json")
run shoot "{\"surface\":\"${S[0]}\",\"velocity\":{\"coefficients\":$MOTION},\"times\":[0.25],\"register\":false}"
is "$STATUS" 200 'a velocity by its coefficients'
compare "$(json '.surfaces[0].area / 1.5625 - 1 | fabs')" '<' 1e-6 'makes a surface that moves along itself grow'
run shoot "{\"surface\":\"${S[0]}\",\"velocity\":{\"coefficients\":$MOTION},\"times\":[-1],\"register\":false}"
is_problem 422 numerical-failure 'down to a point is a failed job'
like "$(json .detail)" 'shrinks to a point' 'that says why'

run shoot "{\"surface\":\"${S[0]}\",\"velocity\":{\"toward\":\"${S[1]}\"},\"times\":[1],\"commonPose\":true}"
compare "$(json .registration.distance)" '<' "$(json .registration.distanceBefore)" 'by default the other surface is registered'
is "$(json '.registration.options | [.commonPose, .rotation] | tojson')" '[true,false]' 'in a common pose without turning it'

# ---- transport ---------------------------------------------------------------------------------------

run transport "{\"from\":\"${S[0]}\",\"to\":\"${S[2]}\",\"vector\":{\"coefficients\":$MOTION},$AS_THEY_ARE}"
is "$STATUS" 200 'a vector is transported'
cp "$BODY" "$SCRATCH/there.json"
compare "$(json '.norm - 1 | fabs')" '<' 1e-6 'of the norm of the SRNF, which is its own velocity of growing'
compare "$(json .residual)" '>' 1e-4 'part of it is no motion of the other surface'
compare "$(json '.residual / .norm')" '<' 0.5 'but most is'
VECTOR=$(jq -c '{srnf: .vector.srnf}' "$SCRATCH/there.json")
printf '{"inputs":{"from":"%s","to":"%s","vector":%s,%s}}' "${S[2]}" "${S[0]}" "$VECTOR" "$AS_THEY_ARE" >"$SCRATCH/back.in"
post '/v1/processes/transport/execution' --header 'Content-Type: application/json' --header 'Prefer: wait=300' \
    --data-binary "@$SCRATCH/back.in"
is "$STATUS" 200 'and back'
json .vector.coefficients >"$SCRATCH/back.json"
jq '.x[0] = 0 | .y[0] = 0 | .z[0] = 0' "$SCRATCH/s0.json" >"$SCRATCH/vector.json"
compare "$(apart "$SCRATCH/back.json" "$SCRATCH/vector.json")" '<' 1e-9 'it is the vector that it was'
compare "$(json '.residual')" '<' 1e-9 'with nothing lost'
like "$(json .inputs.vector.srnf.qDigest)" '^[0-9a-f]{64}$' 'the field in the inputs is told by its digest'
is "$(json '.inputs.vector.srnf | has("q")')" false 'not by its numbers'

run transport "{\"from\":\"${S[0]}\",\"to\":\"${S[0]}\",\"vector\":{\"toward\":\"${S[1]}\"},$AS_THEY_ARE}"
coefficients "$(json .surface.id)" "$SCRATCH/reached.json"
compare "$(apart "$SCRATCH/reached.json" "$SCRATCH/s1.json")" '<' 1e-7 'a vector toward a surface, carried nowhere, leads there'
run transport "{\"from\":\"${S[0]}\",\"to\":\"${S[2]}\",\"vector\":{\"toward\":\"${S[1]}\"},\"commonPose\":true}"
is "$STATUS $(json '[.registration.toward.options.commonPose, .registration.from.options.commonPose] | tojson')" \
    '200 [true,true]' 'both surfaces are registered where that is wanted'
is "$(json .surface.source.reference)" "${S[2]}" 'deformation is measured from where the vector arrived'

# ---- transfer ----------------------------------------------------------------------------------------

for size in ratio absolute; do
    run transfer "{\"source\":\"${S[0]}\",\"deformed\":\"${S[1]}\",\"target\":\"${S[0]}\",\"size\":\"$size\",$AS_THEY_ARE}"
    is "$STATUS" 200 "transfer onto the source, size $size"
    cp "$BODY" "$SCRATCH/transferred.json"
    coefficients "$(json .surface.id)" "$SCRATCH/result.json"
    get "/v1/surfaces/${S[1]}"
    jq --argjson k "$(jq "$(json .scale) / .surface.scale" "$SCRATCH/transferred.json")" \
        '.x |= map(. * $k) | .y |= map(. * $k) | .z |= map(. * $k)' "$SCRATCH/s1.json" >"$SCRATCH/wanted.json"
    compare "$(apart "$SCRATCH/result.json" "$SCRATCH/wanted.json")" '<' 1e-9 'gives the deformed surface, its size included'
    compare "$(jq .relativeEnergy "$SCRATCH/transferred.json")" '<' 1e-20 'exactly'
done
run transfer "{\"source\":\"${S[0]}\",\"deformed\":\"${S[1]}\",\"target\":\"${S[2]}\",\"commonPose\":true}"
is "$STATUS" 200 'transfer to another surface'
RATIO=$(json .sizeRatio)
SCALE=$(json .surface.scale)
compare "$(json '.surface.area - 1 | fabs')" '<' 1e-9 'a shape of unit area stays one'
compare "$(largest '.surface.centroid[]')" '<' 1e-9 'and centred'
is "$(json '[.registration.deformed.options.commonPose, .registration.source.options.commonPose] | tojson')" \
    '[true,true]' 'what it was registered to is told'
is "$(json .surface.source.reference)" "${S[2]}" 'deformation is measured from the target'
get "/v1/surfaces/${S[2]}"
compare "$(json "$SCALE / .scale / $RATIO - 1 | fabs")" '<' 1e-12 'its scale changes in the ratio of the sizes'

# Surfaces in their own sizes: what is reached has its size as they have it.
N=()
for mesh in "${M[@]}"; do
    execute encode "{\"mesh\":\"$mesh\",\"lmax\":$LMAX,\"parameterization\":\"star\",\"scale\":\"none\"}"
    N+=("$(json .surface.id)")
done
OWN_AREA=$(json .surface.area)
for method in srnf pullback; do
    for which in S N; do
        declare -n ids=$which
        run transfer "{\"source\":\"${ids[0]}\",\"deformed\":\"${ids[1]}\",\"target\":\"${ids[2]}\",\"method\":\"$method\",$AS_THEY_ARE}"
        cp "$BODY" "$SCRATCH/in_$which.json"
        get "/v1/surfaces/$(json .surface.id)/mesh?format=obj&space=original&resolution=32"
        awk '$1 == "v" { print $2, $3, $4 }' "$BODY" >"$SCRATCH/in_$which.points"
    done
    RATIO=$(jq .sizeRatio "$SCRATCH/in_N.json")
    is "$(jq .surface.scale "$SCRATCH/in_N.json")" 1 "$method: in their own sizes the scale stays 1"
    compare "$(jq ".surface.area / ($OWN_AREA * $RATIO * $RATIO) - 1 | fabs" "$SCRATCH/in_N.json")" '<' 1e-9 \
        'the area is that of the target in the ratio of the sizes'
    compare "$(jq -s '.[0].surface.scale as $k | .[1].surface.volume / (.[0].surface.volume * $k * $k * $k) - 1 | fabs' \
        "$SCRATCH/in_S.json" "$SCRATCH/in_N.json")" '<' 1e-6 'and the volume that of the same at unit area, scaled'
    compare "$(paste "$SCRATCH/in_S.points" "$SCRATCH/in_N.points" |
        awk '{ for (k = 1; k < 4; k++) { d = $k - $(k + 3); most = d > most ? d : -d > most ? -d : most } }
            END { print (NR > 1000 ? most + 0 : "none") }')" '<' 1e-3 'in the original space both are the same'
done
run transfer "{\"source\":\"${N[0]}\",\"deformed\":\"${N[1]}\",\"target\":\"${N[0]}\",$AS_THEY_ARE}"
REACHED=$(json .surface.id)
execute distances "{\"surfaces\":[\"${N[1]}\",\"$REACHED\"],$AS_THEY_ARE}"
compare "$(json '.matrix[0][1]')" '<' 1e-6 'other processes see the size: onto the source it is the deformed surface'

# ---- What is refused ---------------------------------------------------------------------------------

execute transport "{\"from\":\"${S[0]}\",\"to\":\"${S[2]}\",\"vector\":{\"toward\":\"${S[1]}\"},\"method\":\"flow\"}"
is_problem 422 invalid-input 'a method that is not there'
like "$(json '.errors[0] | "\(.pointer) \(.detail)"')" '/inputs/method must be one of: srnf, pullback' 'names those that are'
stop_server || not_ok 'the server ends well'
done_testing

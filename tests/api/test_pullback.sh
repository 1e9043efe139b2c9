#!/usr/bin/env bash
# srnfd-test: plain-core (core/pullback/test_pullback_geodesic.c and test_standard.sh run its numerics)
# srnfd-test: timeout 600
#
# test_pullback.sh - shoot, transport, transfer and mean in the pulled-back metric end to end, on small surfaces of
# brain structures as they are parameterized: what takes a surface back to itself or to another, what the metric
# keeps, how near both frameworks are, and a job that is cancelled on the way.
# srnfd-test: slow
# srnfd-test: once (core/pullback has the figures in both builds)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
REQUEST_SECONDS=400
PULLBACK='"method":"pullback","register":false'

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
for name in L_thalamus R_thalamus L_pallidum; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX,\"parameterization\":\"star\"}"
    S+=("$(json .surface.id)")
done
for i in 0 1 2; do
    coefficients "${S[$i]}" "$SCRATCH/s$i.json"
done

# ---- shoot -------------------------------------------------------------------------------------------

run shoot "{\"surface\":\"${S[0]}\",\"velocity\":{\"toward\":\"${S[1]}\"},\"times\":[1,0,-0.5],$PULLBACK}"
is "$STATUS $(json '.pullback | [.converged, .toward.converged, (.shots | map(.segments?))] | tojson')" \
    '200 [true,true,[8,null,8]]' 'shots along a geodesic of surfaces'
is "$(json '.surfaces[1].id')" "${S[0]}" 'at t = 0 it is the surface itself'
compare "$(json '.pullback | .shots[0].length / .toward.length - 1 | fabs')" '<' 1e-6 'a unit of time is as long as the way'
compare "$(json '.pullback | .shots[0].length / .shots[2].length / 2 - 1 | fabs')" '<' 0.2 'and half of one, backwards, half as long'
compare "$(json '.pullback.shots[0].speedVariation')" '<' 0.01 'at constant speed'
coefficients "$(json '.surfaces[0].id')" "$SCRATCH/end.json"
compare "$(apart "$SCRATCH/end.json" "$SCRATCH/s1.json")" '<' 1e-6 'it leads to the surface that the velocity is toward'

MOTION=$(jq -c . "$SCRATCH/s0.json")
run shoot "{\"surface\":\"${S[0]}\",\"velocity\":{\"coefficients\":$MOTION},\"times\":[0.25],$PULLBACK}"
compare "$(json '.surfaces[0].area / 1.5625 - 1 | fabs')" '<' 1e-6 'growing is a geodesic here too'
is "$(json .pullback.toward)" null 'a motion is taken as it is'

# ---- transport ---------------------------------------------------------------------------------------

run transport "{\"from\":\"${S[0]}\",\"to\":\"${S[2]}\",\"vector\":{\"coefficients\":$MOTION},$PULLBACK}"
is "$STATUS $(json .pullback.converged)" '200 true' 'a vector is carried along a geodesic'
cp "$BODY" "$SCRATCH/there.json"
compare "$(json '.pullback.normFrom - 1 | fabs')" '<' 1e-6 'of the norm of the SRNF, which is its own velocity of growing'
compare "$(json '.pullback | .norm / .normFrom - 1 | fabs')" '<' 1e-3 'which it keeps'
is "$(json '[.norm == .pullback.norm, .residual] | tojson')" '[true,0]' 'and nothing is lost'
compare "$(json '.pullback.path.energy - (.pullback.path.length | . * .) | fabs')" '<' 1e-2 'the path has constant speed'
VECTOR=$(jq -c '{coefficients: .vector.coefficients}' "$SCRATCH/there.json")
run transport "{\"from\":\"${S[2]}\",\"to\":\"${S[0]}\",\"vector\":$VECTOR,$PULLBACK}"
json .vector.coefficients >"$SCRATCH/back.json"
compare "$(apart "$SCRATCH/back.json" "$SCRATCH/s0.json")" '<' 0.01 'back along the same geodesic it is the vector that it was'
printf '{"inputs":{"from":"%s","to":"%s","vector":%s,%s}}' "${S[2]}" "${S[2]}" \
    "$(jq -c '{srnf: .vector.srnf}' "$SCRATCH/there.json")" "$PULLBACK" >"$SCRATCH/stay.in"
post '/v1/processes/transport/execution' --header 'Content-Type: application/json' --header 'Prefer: wait=300' \
    --data-binary "@$SCRATCH/stay.in"
is "$STATUS" 200 'a vector as a field'
compare "$(json '.residual / .norm')" '<' 1e-9 'is a motion where it came from one'
json .vector.coefficients >"$SCRATCH/stay.json"
jq '.vector.coefficients | .x[0] = 0 | .y[0] = 0 | .z[0] = 0' "$SCRATCH/there.json" >"$SCRATCH/vector.json"
compare "$(apart "$SCRATCH/stay.json" "$SCRATCH/vector.json")" '<' 1e-7 'and stays that where it is not moved'
run transport "{\"from\":\"${S[0]}\",\"to\":\"${S[0]}\",\"vector\":{\"toward\":\"${S[1]}\"},$PULLBACK}"
coefficients "$(json .surface.id)" "$SCRATCH/reached.json"
compare "$(apart "$SCRATCH/reached.json" "$SCRATCH/s1.json")" '<' 1e-6 'a vector toward a surface, carried nowhere, leads there'

# ---- transfer ----------------------------------------------------------------------------------------

run transfer "{\"source\":\"${S[0]}\",\"deformed\":\"${S[1]}\",\"target\":\"${S[0]}\",$PULLBACK}"
is "$STATUS $(json .pullback.converged)" '200 true' 'transfer onto the source'
cp "$BODY" "$SCRATCH/transferred.json"
coefficients "$(json .surface.id)" "$SCRATCH/result.json"
get "/v1/surfaces/${S[1]}"
jq --argjson k "$(jq "$(json .scale) / .surface.scale" "$SCRATCH/transferred.json")" \
    '.x |= map(. * $k) | .y |= map(. * $k) | .z |= map(. * $k)' "$SCRATCH/s1.json" >"$SCRATCH/wanted.json"
compare "$(apart "$SCRATCH/result.json" "$SCRATCH/wanted.json")" '<' 1e-6 'gives the deformed surface, its size included'
run transfer "{\"source\":\"${S[0]}\",\"deformed\":\"${S[1]}\",\"target\":\"${S[2]}\",\"size\":\"absolute\",$PULLBACK}"
is "$STATUS $(json .pullback.converged)" '200 true' 'transfer to another surface, in one unit'
compare "$(json '.pullback | .norm / .normFrom - 1 | fabs')" '<' 0.01 'keeps the norm of the deformation'
compare "$(json '.energy / (.pullback.deformation | . * .)')" '<' 0.7 'and ends nearer than the target to where straight lines end'

# ---- mean --------------------------------------------------------------------------------------------

run mean "{\"surfaces\":[\"${S[0]}\",\"${S[1]}\"],$PULLBACK}"
is "$STATUS $(json '[.converged, .pullback.converged, .registration] | tojson')" '200 [true,true,null]' 'the mean of two surfaces'
compare "$(json '.distances[0] / .distances[1] - 1 | fabs')" '<' 1e-3 'is half way between them'
compare "$(json '.pullback.meanVelocity / (.pullback.variance | sqrt)')" '<' 1e-2 'where the mean velocity vanishes'
compare "$(json '.pullback.variance / ((.distances | map(. * .) | add) / 2) - 1 | fabs')" '<' 1e-9 'variance is that of the lengths'
LENGTH=$(json '.distances | add')
run geodesic "{\"from\":\"${S[0]}\",\"to\":\"${S[1]}\",\"steps\":17,$PULLBACK}"
compare "$(json "$LENGTH / .length - 1 | fabs")" '<' 1e-3 'on their geodesic'
run mean "{\"surfaces\":[\"${S[0]}\",\"${S[1]}\"],\"register\":false}"
is "$(json .pullback)" null 'the mean SRNF has none of this'
run mean "{\"surfaces\":[\"${S[0]}\",\"${S[1]}\"],\"commonPose\":true,\"method\":\"pullback\",\"maxIterations\":3}"
is "$STATUS $(json .registration.commonPose)" '200 true' 'surfaces are registered where that is wanted'
compare "$(json '.distances | add')" '<' "$LENGTH" 'and nearer to each other then'

# ---- What is refused, and what is cancelled ----------------------------------------------------------

execute pca "{\"surfaces\":[\"${S[0]}\",\"${S[1]}\"],\"method\":\"pullback\"}"
is_problem 422 invalid-input 'components belong to the other framework'
get "/v1/surfaces/${S[0]}"
execute encode "{\"mesh\":\"$(json .source.mesh)\",\"lmax\":40,\"parameterization\":\"star\"}"
BIG=$(json .surface.id)
execute mean "{\"surfaces\":[\"${S[1]}\",\"${S[2]}\",\"$BIG\"],$PULLBACK}" --header 'Prefer: respond-async'
JOB=$(json .id)
for _ in $(seq 300); do
    get "/v1/jobs/$JOB"
    [ "$(json '.progress > 5 or .status != "running" and .status != "accepted"')" = true ] && break
    sleep 0.1
done
is "$(json .status)" running 'a long mean tells its progress'
post "/v1/jobs/$JOB/cancel"
is "$STATUS $(json .cancelRequested)" '200 true' 'is asked to stop on the way'
poll_job "$JOB" 60
is "$JOB_STATUS" dismissed 'and does'

stop_server || not_ok 'the server ends well'
done_testing

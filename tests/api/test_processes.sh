#!/usr/bin/env bash
# test_processes.sh - encode, invert and geodesic end to end, on real meshes and on surfaces that are known.

# jq's variables are not the shell's.
# shellcheck disable=SC2016

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" || exit 1

upload() { # NAME: sets ID
    post "/v1/meshes?name=$1" --data-binary "@tests/data/aal_subcortex/$1.ply"
    ID=$(json .id)
}
upload L_pallidum
LEFT=$ID
upload R_pallidum
RIGHT=$ID
upload L_caudate
CAUDATE=$ID

# ---- encode ----------------------------------------------------------------------------------------

execute encode "{\"mesh\":\"$LEFT\",\"lmax\":15}"
is "$STATUS" 200 'a pallidum is encoded'
S=$(json .surface.id)
SCALE=$(json .surface.scale)
is "$(json '"\(.route) \(.starShaped.value) \(.surface.lmax) \(.surface.name) \(.distortion)"')" \
    'star true 15 L_pallidum null' 'by the star route, under the name of its mesh'
is "$(json .surface.source.mesh)" "$LEFT" 'its record names the mesh'
compare "$(json '(.surface.area - 1 | fabs), (.surface.centroid | map(fabs) | max)' | sort -g | tail -n 1)" \
    '<' 1e-6 'it is centred and of unit area'
compare "$(json .fit.relativeToDiagonal.rms)" '<' 0.01 'it fits its mesh to 1 % of the diagonal'
is "$(json '(.fit.rms <= .fit.p95) and (.fit.p95 <= .fit.max)')" true 'rms, p95 and max are in order'
is "$(json '.inputs | keys | join(" ")')" 'center lmax mesh parameterization scale smoothing' \
    'the result holds every option'
like "$(json .numericBuild)" 'srnf' 'and the build that made the numbers'
RMS15=$(json .fit.rms)
execute encode "{\"mesh\":\"$LEFT\",\"lmax\":31}"
compare "$(json .fit.rms)" '<' "$RMS15" 'a higher degree fits better'
execute encode "{\"mesh\":\"$LEFT\",\"lmax\":15,\"smoothing\":0.01}"
compare "$(json .fit.rms)" '>' "$RMS15" 'smoothing fits worse'
execute encode "{\"mesh\":\"$LEFT\",\"lmax\":15,\"scale\":\"none\"}"
is "$(json .surface.scale)" 1 'scale none keeps the units'
compare "$(json "(.surface.area | sqrt) / $SCALE - 1 | fabs")" '<' 1e-9 'which the scale would give back'
execute encode "{\"smoothing\":0.0,\"lmax\":15,\"center\":\"auto\",\"mesh\":\"$LEFT\"}" \
    --header 'Prefer: respond-async'
is "$(json '.cache // .surface.id')" hit 'the same meaning in other words is answered from the cache'

execute encode "{\"mesh\":\"$CAUDATE\"}"
is_problem 422 not-star-shaped 'a caudate is refused at once'
like "$(json .detail)" '[0-9]' 'with the area that is seen from behind'
get '/v1/jobs?process=encode&limit=200'
is "$(json '[.items[] | select(.status == "failed")] | length')" 0 'without a job'
execute encode "{\"mesh\":\"$LEFT\",\"center\":[0,0,0]}"
is "$(json .code)" not-star-shaped 'a centre from which it is not star-shaped fails'
execute encode "{\"mesh\":\"$LEFT\",\"parameterization\":\"area\",\"lmax\":200}"
is_problem 422 invalid-input 'what is not available is refused'
is "$(json '.errors | map(.pointer) | sort | join(" ")')" '/inputs/lmax /inputs/parameterization' \
    'and every wrong input named'

# ---- invert ----------------------------------------------------------------------------------------

execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"sphere\"}"
is "$STATUS $(json '"\(.converged) \(.stopped)"')" '200 true tolerance' 'its SRNF is inverted from the sphere'
compare "$(json .relativeEnergy)" '<=' 1e-12 'to the tolerance'
compare "$(json .surfaceError)" '<=' 1e-5 'and the surface is the one that was encoded'
compare "$(json .surface.scale)" '==' "$SCALE" 'whose scale it keeps'
is "$(json '.history | (length > 1) and (.[0].energy > .[-1].energy) and all(.[]; has("iteration") and has("seconds"))')" \
    true 'its history falls'
INVERTED=$(json .surface.id)
get "/v1/surfaces/$S/coefficients"
cp "$BODY" "$SCRATCH/a.json"
get "/v1/surfaces/$INVERTED/coefficients"
compare "$(jq -n --slurpfile a "$SCRATCH/a.json" --slurpfile b "$BODY" '[("x", "y", "z") as $k |
    [$a[0][$k][1:], $b[0][$k][1:]] | transpose[] | (.[0] - .[1]) | . * .] | add | sqrt')" '<=' 1e-5 \
    'as its coefficients say too'

get "/v1/surfaces/$S/srnf"
jq -c '{inputs: {srnf: {lmax: 15, nTheta, nPhi, q: .values}, method: "closed-form"}}' "$BODY" >"$SCRATCH/q.json"
post_json /v1/processes/invert/execution "@$SCRATCH/q.json"
is "$STATUS $(json .method)" '200 closed-form' 'an SRNF given as numbers is inverted by the closed form'
compare "$(json .relativeEnergy)" '<=' 1e-20 'which is exact for a radial parameterisation'
is "$(json '.surfaceError')" null 'no truth is known then'
like "$(json .inputs.srnf.qDigest)" '^[0-9a-f]{64}$' 'the result names q by its digest'
get "/v1/surfaces/$S/srnf?nTheta=30&nPhi=64"
jq -c '{inputs: {srnf: {lmax: 15, nTheta, nPhi, q: .values | flatten}}}' "$BODY" >"$SCRATCH/q2.json"
post_json /v1/processes/invert/execution "@$SCRATCH/q2.json"
compare "$(json .relativeEnergy)" '<=' 1e-12 'on another grid too'

execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"sphere\",\"method\":\"gradient\",\"maxIterations\":3}"
is "$STATUS $(json '"\(.converged) \(.stopped) \(.iterations)"')" '200 false maxIterations 3' \
    'iterations that were limited give what was reached'
if [ -z "$SRNFD_SANITIZED" ]; then
    execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"sphere\",\"method\":\"gradient\",\"tolerance\":1e-30}"
    is_problem 422 not-converged 'a method that reaches its own limit has failed'
    like "$(json .detail)" 'relative energy is [0-9].* after [0-9]+ iterations' 'and says how far it got'
else
    skip 'a method that reaches its own limit has failed' 'slow under a sanitizer'
fi
execute invert "{\"srnf\":{\"surface\":\"$S\"},\"lmax\":8,\"initial\":\"$INVERTED\"}"
is "$STATUS $(json '"\(.surface.lmax) \(.converged) \(.stopped) \(.surfaceError)"')" \
    '200 8 false stationary null' 'a degree that is too low ends at a minimum that is not zero'
execute invert "{\"srnf\":{\"surface\":\"$S\"},\"lmax\":18,\"initial\":\"star\"}"
compare "$(json .relativeEnergy)" '<=' 1e-12 'a higher degree than needed inverts'
execute invert '{"srnf":{"lmax":4,"nTheta":5,"nPhi":9,"q":'"$(jq -nc '[range(135) | 0]')"'}}'
is "$(json '"\(.code)"')" invalid-input 'an SRNF that is zero has no inverse'

# ---- geodesic --------------------------------------------------------------------------------------

execute geodesic "{\"from\":\"$LEFT\",\"to\":\"$RIGHT\",\"steps\":5}"
is "$STATUS" 200 'two meshes are joined'
cp "$BODY" "$SCRATCH/geodesic.json"
is "$(json '"\(.surfaces | length) \(.times | tojson) \(.energies | map(length) | tojson)"')" \
    '5 [0,0.25,0.5,0.75,1] [5,5,5]' 'by as many surfaces, times and energies as were asked for'
is "$(json '.surfaces[0].source.mesh, .surfaces[4].source.mesh' | paste -sd ' ')" "$LEFT $RIGHT" \
    'whose ends name their meshes'
compare "$(json '.relativeEnergies.geodesic[0], .relativeEnergies.geodesic[4]' | sort -g | tail -n 1)" '<' 1e-20 \
    'the ends are on the straight line'
is "$(json '[.energies.geodesic, .energies.linear] | transpose | .[1:-1] | all(.[0] <= .[1] * 1.01)')" true \
    'between them the geodesic is nearer to it than the linear blend'
compare "$(json .length)" '>=' "$(json '.distance * (1 - 1e-9)')" 'its length is at least the distance'
compare "$(json '[.surfaces[].centroid[] | fabs] | max')" '<' 1e-9 'every surface is centred'
is "$(json '.surfaces | map(.scale) | . == sort or . == (sort | reverse)')" true 'scales go from end to end'
MIDDLE=$(json '.surfaces[2].id')
DISTANCE=$(json .distance)
get "/v1/surfaces/$MIDDLE/mesh?format=ply&resolution=4"
like "$(head -c 600 "$BODY" | tr -d '\0')" 'deformation' 'the deformation rides along in its mesh'
execute geodesic "{\"from\":\"$RIGHT\",\"to\":\"$LEFT\",\"steps\":5}"
compare "$(json ".distance / $DISTANCE - 1 | fabs")" '<' 1e-12 'the distance is the same from the other side'
execute geodesic "{\"from\":\"$S\",\"to\":\"$S\",\"steps\":2}"
compare "$(json '.distance + .length')" '<' 1e-12 'and zero to itself'
is "$(json '.surfaces | map(.id) | unique | join(" ")')" "$S" 'whose surfaces are that surface'
execute geodesic "{\"from\":\"$S\",\"to\":\"$RIGHT\",\"steps\":3,\"method\":\"linear\"}"
is "$(json '.surfaces | map(.lmax) | unique | tojson')" '[31]' 'ends of two degrees meet at the larger one'
is "$(json '.energies.geodesic == .energies.linear')" true 'linear returns the linear blend'
execute geodesic "{\"from\":\"$S\",\"to\":\"$RIGHT\",\"register\":true}"
is_problem 422 invalid-input 'registration is refused'
like "$(json .detail)" 'not available' 'and the detail says why'

# ---- jobs ------------------------------------------------------------------------------------------

execute invert "{\"srnf\":{\"surface\":\"$LEFT\"},\"method\":\"gradient\",\"initial\":\"sphere\",\"maxIterations\":90000,\"tolerance\":1e-30}" \
    --header 'Prefer: respond-async'
is "$STATUS" 201 'a long inversion is accepted'
JOB=$(json .id)
for _ in $(seq 100); do
    get "/v1/jobs/$JOB"
    [ "$(json .status)" = accepted ] || break
    sleep 0.1
done
is "$(json .status)" running 'and starts'
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 60
is "$JOB_STATUS" dismissed 'and stops where it stands when it is cancelled'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

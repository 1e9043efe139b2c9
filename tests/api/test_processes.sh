#!/usr/bin/env bash
# test_processes.sh - encode, invert and geodesic end to end, on real meshes and on surfaces that are known.
# srnfd-test: slow

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

execute encode "{\"mesh\":\"$LEFT\",\"lmax\":15,\"parameterization\":\"star\"}"
is "$STATUS" 200 'a pallidum is encoded'
S=$(json .surface.id)
SCALE=$(json .surface.scale)
is "$(json '"\(.route) \(.starShaped.value) \(.surface.lmax) \(.surface.name) \(.surface.parameterization)"')" \
    'star true 15 L_pallidum star' 'by the star route, under the name of its mesh'
like "$(json .reason)" 'star was asked for' 'and it says why'
is "$(json '"\(.distortion.flipped) \(.distortion.symmetricDirichlet > 4) \(.distortion.logAreaDeviation > 0)"')" \
    '0 true true' 'with the distortion of its map'
is "$(json .surface.source.mesh)" "$LEFT" 'its record names the mesh'
compare "$(json '(.surface.area - 1 | fabs), (.surface.centroid | map(fabs) | max)' | sort -g | tail -n 1)" \
    '<' 1e-6 'it is centred and of unit area'
compare "$(json .fit.relativeToDiagonal.rms)" '<' 0.01 'it fits its mesh to 1 % of the diagonal'
is "$(json '.fit | (.rms | real) <= (.p95 | real) and .p95 <= (.max | real)')" true 'rms, p95 and max are in order'
is "$(json '.inputs | keys | join(" ")')" 'center cohort lmax mesh mirror parameterization scale smoothing sphere' \
    'the result holds every option'
like "$(json .numericBuild)" 'srnf' 'and the build that made the numbers'
RMS15=$(json .fit.rms)
execute encode "{\"mesh\":\"$LEFT\",\"lmax\":31,\"parameterization\":\"star\"}"
compare "$(json .fit.rms)" '<' "$RMS15" 'a higher degree fits better'
execute encode "{\"mesh\":\"$LEFT\",\"lmax\":15,\"smoothing\":0.01,\"parameterization\":\"star\"}"
compare "$(json .fit.rms)" '>' "$RMS15" 'smoothing fits worse'
execute encode "{\"mesh\":\"$LEFT\",\"lmax\":15,\"scale\":\"none\",\"parameterization\":\"star\"}"
is "$(json .surface.scale)" 1 'scale none keeps the units'
compare "$(json "(.surface.area | sqrt) / $SCALE - 1 | fabs")" '<' 1e-9 'which the scale would give back'
execute encode "{\"smoothing\":0.0,\"lmax\":15,\"center\":\"auto\",\"parameterization\":\"star\",\"mesh\":\"$LEFT\"}" \
    --header 'Prefer: respond-async'
is "$(json '.cache // .surface.id')" hit 'the same meaning in other words is answered from the cache'

get "/v1/meshes/$CAUDATE"
is "$(json '.report | "\(.analysable) \(.route) \(.starShaped.value) \(.problems | length)"')" 'true area false 0' \
    'a caudate is not star-shaped, and can be analysed by the route area'
execute encode "{\"mesh\":\"$CAUDATE\"}"
is "$STATUS" 200 'which encode takes'
is "$(json '"\(.route) \(.surface.parameterization) \(.distortion.flipped) \(.starShaped.value)"')" 'area area 0 false' \
    'without a flip'
like "$(json .reason)" 'area is the route of every mesh' 'and says why'
compare "$(json .distortion.symmetricDirichlet)" '<' 6 'with little distortion'
compare "$(json .fit.relativeToDiagonal.rms)" '<' 0.002 'and fits to 0.2 % of the diagonal'
AREA=$(json .surface.id)
execute encode "{\"mesh\":\"$CAUDATE\",\"parameterization\":\"star\"}"
is "$(json .code)" not-star-shaped 'the route star fails on it'
like "$(json .detail)" '[0-9]' 'with the area that is seen from behind'
get "/v1/meshes/$LEFT"
is "$(json '.report | "\(.route) \(.starShaped.value)"')" 'area true' 'area is the route of star-shaped meshes, too'
execute encode "{\"mesh\":\"$LEFT\",\"lmax\":15}"
is "$(json '"\(.route) \(.starShaped.value) \(.surface.parameterization)"')" 'area true area' 'and encode takes it by default'
CENTER=$(json '.starShaped.center | tojson')
execute encode "{\"mesh\":\"$LEFT\",\"lmax\":15,\"center\":$CENTER}"
is "$(json .route)" star 'a centre asks for star'

# A map of the mesh as a mesh on a sphere: here that of a convex body, projected from within.
ball() { # RADIUS: an octahedron whose edges are cut in two, as OBJ
    awk -v r="$1" 'BEGIN {
        split("1 0 0 0 1 0 -1 0 0 0 -1 0 0 0 1 0 0 -1 1 1 0 -1 1 0 -1 -1 0 1 -1 0 1 0 1 0 1 1 -1 0 1 0 -1 1 1 0 -1 0 1 -1 -1 0 -1 0 -1 -1", x, " ")
        for (i = 0; i < 18; i++) {
            a = x[3 * i + 1]; b = x[3 * i + 2]; c = x[3 * i + 3]
            l = r > 0 ? r / sqrt(a * a + b * b + c * c) : 1
            # Not to scale, so that the body is no sphere.
            printf "v %.17g %.17g %.17g\n", l * a * (r > 0 ? 1 : 2), l * b, l * c
        }
        n = split("1 7 11 7 2 12 11 12 5 7 12 11 2 8 12 8 3 13 12 13 5 8 13 12 3 9 13 9 4 14 13 14 5 9 14 13 4 10 14 10 1 11 14 11 5 10 11 14 2 7 16 7 1 15 16 15 6 7 15 16 3 8 17 8 2 16 17 16 6 8 16 17 4 9 18 9 3 17 18 17 6 9 17 18 1 10 15 10 4 18 15 18 6 10 18 15", f, " ")
        for (i = 1; i <= n; i += 3)
            printf "f %d %d %d\n", f[i], f[i + 1], f[i + 2]
    }'
}
ball 0 >"$SCRATCH/body.obj"
ball 100 >"$SCRATCH/ball.obj"
post '/v1/meshes?format=obj&name=body' --data-binary "@$SCRATCH/body.obj"
BODY_MESH=$(json .id)
post '/v1/meshes?format=obj&name=ball' --data-binary "@$SCRATCH/ball.obj"
BALL=$(json .id)
execute encode "{\"mesh\":\"$BODY_MESH\",\"parameterization\":\"given\",\"sphere\":\"$BALL\",\"lmax\":9}"
is "$STATUS $(json '"\(.route) \(.surface.parameterization) \(.distortion.flipped) \(.inputs.sphere)"')" \
    "200 given given 0 $BALL" 'a sphere that comes with the mesh is its map'
awk '/^v/ && ++n == 7 { $0 = "v -70.7106781186547524 -70.7106781186547524 0" } { print }' "$SCRATCH/ball.obj" >"$SCRATCH/folded.obj"
post '/v1/meshes?format=obj&name=folded' --data-binary "@$SCRATCH/folded.obj"
execute encode "{\"mesh\":\"$BODY_MESH\",\"parameterization\":\"given\",\"sphere\":\"$(json .id)\",\"lmax\":9}"
is "$(json .code)" invalid-input 'one that folds over is refused'
like "$(json .detail)" 'face [0-9]+ of the sphere is turned over' 'and the face is named'
execute encode "{\"mesh\":\"$CAUDATE\",\"parameterization\":\"given\",\"sphere\":\"$BALL\"}"
like "$(json '"\(.code) \(.detail)"')" 'invalid-input .*18 vertices' 'and so is the sphere of another mesh'
execute encode "{\"mesh\":\"$LEFT\",\"sphere\":\"$BALL\"}"
is_problem 422 invalid-input 'a sphere without the parameterization given'
is "$(json '.errors[0].pointer')" /inputs/sphere 'is pointed at'
execute encode "{\"mesh\":\"$LEFT\",\"center\":[0,0,0]}"
is "$(json .code)" not-star-shaped 'a centre from which it is not star-shaped fails'
execute encode "{\"mesh\":\"$LEFT\",\"parameterization\":\"polar\",\"lmax\":200}"
is_problem 422 invalid-input 'what does not exist is refused'
is "$(json '.errors | map(.pointer) | sort | join(" ")')" '/inputs/lmax /inputs/parameterization' \
    'and every wrong input named'

# ---- invert ----------------------------------------------------------------------------------------

execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"sphere\"}"
is "$STATUS $(json '"\(.converged) \(.stopped) \(.warnings | length)"')" '200 true tolerance 0' 'its SRNF is inverted from the sphere'
compare "$(json .relativeEnergy)" '<=' 1e-12 'to the tolerance'
compare "$(json .surfaceError)" '<=' 1e-5 'and the surface is the one that was encoded'
compare "$(json .surface.scale)" '==' "$SCALE" 'whose scale it keeps'
is "$(json '.history | (length > 1) and (.[0].energy > (.[-1].energy | real)) and all(.[]; has("iteration") and has("seconds"))')" \
    true 'its history falls'
INVERTED=$(json .surface.id)
get "/v1/surfaces/$S/coefficients"
cp "$BODY" "$SCRATCH/a.json"
get "/v1/surfaces/$INVERTED/coefficients"
compare "$(jq -n --slurpfile a "$SCRATCH/a.json" --slurpfile b "$BODY" '[("x", "y", "z") as $k |
    [$a[0][$k][1:], $b[0][$k][1:]] | transpose[] | (.[0] - .[1]) | . * .] | add | sqrt')" '<=' 1e-5 \
    'as its coefficients say too'

execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"sphere\",\"certificate\":\"none\"}"
is "$STATUS $(json '[.certificate, .smallestSingularValue, .surfaceErrorBound] | map(. == null) | all')" '200 true' \
    'without a certificate nothing is said of its error'
compare "$(json .surfaceError)" '<=' 1e-5 'and the surface is the same'
execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"sphere\",\"certificate\":\"require\"}"
is "$STATUS $(json '.certificate | .unique and .secondEigenvalue > .threshold')" '200 true' \
    'a surface with folds is the only one of its degree'
execute invert "{\"srnf\":{\"surface\":\"$CAUDATE\"},\"lmax\":15,\"certificate\":\"require\"}"
is_problem 422 not-certified 'where that is not proved, it was required in vain'
like "$(json .detail)" 'relative energy that is left is 0[.][0-9]+, the tolerance 1e-12' 'with its figures'
execute invert "{\"srnf\":{\"surface\":\"$S\"},\"lmax\":32,\"certificate\":\"require\"}"
is "$STATUS $(json '.errors | map("\(.pointer) \(.detail)") | tojson')" \
    '422 ["/inputs/certificate cannot be require: there is a certificate up to degree 31, and lmax is 32"]' \
    'beyond the degrees that have one it is refused at once'
execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"$S\"}"
is "$STATUS $(json '"\(.converged) \(.method)"')" '200 true gauss-newton' 'from the surface itself, with the method that was at work'
post_json /v1/surfaces "$(jq -cn 'def unit($k): [range(81) | if . == $k then 1 else 0 end];
    {coefficients: {lmax: 8, x: unit(3), y: unit(1), z: unit(2)}}')"
execute invert "{\"srnf\":{\"surface\":\"$(json .id)\"},\"certificate\":\"require\"}"
is_problem 422 not-certified 'a sphere is never proved to be the only one'
like "$(json .detail)" 'second eigenvalue is at most [0-9.e-]+, and means something only above' 'and why'

get "/v1/surfaces/$S/srnf"
jq -c '{inputs: {srnf: {lmax: 15, nTheta, nPhi, q: .values}, method: "closed-form"}}' "$BODY" >"$SCRATCH/q.json"
post_json /v1/processes/invert/execution "@$SCRATCH/q.json"
is "$STATUS $(json .method)" '200 closed-form' 'an SRNF given as numbers is inverted by the closed form'
compare "$(json .relativeEnergy)" '<=' 1e-20 'which is exact for a radial parameterization'
is "$(json '.surfaceError')" null 'no truth is known then'
like "$(json .inputs.srnf.qDigest)" '^[0-9a-f]{64}$' 'the result names q by its digest'
get "/v1/surfaces/$S/srnf?nTheta=30&nPhi=64"
jq -c '{inputs: {srnf: {lmax: 15, nTheta, nPhi, q: .values | flatten}}}' "$BODY" >"$SCRATCH/q2.json"
post_json /v1/processes/invert/execution "@$SCRATCH/q2.json"
compare "$(json .relativeEnergy)" '<=' 1e-12 'on another grid too'

execute invert "{\"srnf\":{\"surface\":\"$LEFT\"},\"method\":\"closed-form\"}"
compare "$(json .relativeEnergy)" '<=' 1e-20 'a mesh is encoded by star for the closed form'
execute invert "{\"srnf\":{\"surface\":\"$CAUDATE\"},\"method\":\"closed-form\"}"
is "$(json .code)" not-star-shaped 'which one that is not star-shaped does not have'
execute encode "{\"mesh\":\"$CAUDATE\",\"lmax\":6,\"parameterization\":\"area\"}"
execute invert "{\"srnf\":{\"surface\":\"$(json .surface.id)\"},\"method\":\"closed-form\",\"certificate\":\"require\"}"
is_problem 422 not-certified 'nor is a surface certified that the closed form does not give'
like "$(json .detail)" 'closed form does not give this SRNF back.*tolerance 1e-12. Use method auto' 'and that is why'

execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"sphere\",\"method\":\"gradient\",\"maxIterations\":3}"
is "$STATUS $(json '"\(.converged) \(.stopped) \(.iterations)"')" '200 false maxIterations 3' \
    'iterations that were limited give what was reached'
execute invert "{\"srnf\":{\"surface\":\"$S\"},\"initial\":\"sphere\",\"method\":\"gauss-newton\",\"maxIterations\":3}"
is "$(json '[.stopped, (.warnings[] | "\(.code) \(.figures.stopped) \(.figures.tolerance)")] | tojson')" \
    '["maxIterations","inversion-not-converged maxIterations 1e-12"]' 'with a warning'
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
is "$(json '.relativeEnergy as $e | [.warnings[] | select(.code == "inversion-not-converged") | .figures.relativeEnergy == $e] | tojson')" \
    '[true]' 'which is told, with the energy that is left'
execute invert "{\"srnf\":{\"surface\":\"$S\"},\"lmax\":18,\"initial\":\"star\"}"
compare "$(json .relativeEnergy)" '<=' 1e-12 'a higher degree than needed inverts'
refuses() { # INPUTS POINTER DETAIL: that one problem
    execute invert "$1"
    is "$STATUS $(json '.errors | map("\(.pointer): \(.detail)") | join("; ")')" "422 $2: $3" "refused: $1"
}
FORMS='{"surface": id} or {"lmax", "nTheta", "nPhi", "q"}'
refuses '{}' /inputs/srnf "is required: $FORMS"
refuses "{\"srnf\":\"$S\"}" /inputs/srnf "must be $FORMS"
refuses "{\"srnf\":{\"Surface\":\"$S\"}}" /inputs/srnf "must be $FORMS"
for start in 5 '"SPHERE"'; do
    refuses "{\"srnf\":{\"surface\":\"$S\"},\"initial\":$start}" /inputs/initial \
        'must be auto, sphere, star or the id of a surface or a mesh'
done
execute invert '{"srnf":{"lmax":4,"nTheta":5,"nPhi":9,"q":'"$(jq -nc '[range(135) | 0]')"'}}'
is "$(json '"\(.code)"')" invalid-input 'an SRNF that is zero has no inverse'

# ---- geodesic --------------------------------------------------------------------------------------

execute geodesic "{\"from\":\"$LEFT\",\"to\":\"$RIGHT\",\"steps\":5,\"register\":false}"
is "$STATUS" 200 'two meshes are joined'
cp "$BODY" "$SCRATCH/geodesic.json"
is "$(json '"\(.surfaces | length) \(.times | tojson) \(.energies | [.geodesic, .linear] | map(length) | tojson)"')" \
    '5 [0,0.25,0.5,0.75,1] [5,5]' 'by as many surfaces, times and energies as were asked for'
is "$(json '.surfaces[0].source.mesh, .surfaces[4].source.mesh' | paste -sd ' ')" "$LEFT $RIGHT" \
    'whose ends name their meshes'
compare "$(json '.relativeEnergies.geodesic | [.[0], .[4] | real] | max')" '<' 1e-20 \
    'the ends are on the straight line'
is "$(json '[.energies.geodesic, .energies.linear] | transpose | .[1:-1] | length > 0 and all((.[0] | real) <= .[1] * 1.01)')" true \
    'between them the geodesic is nearer to it than the linear blend'
compare "$(json .length)" '>=' "$(json '.distance * (1 - 1e-9)')" 'its length is at least the distance'
compare "$(json '[.surfaces[].centroid[] | fabs] | max')" '<' 1e-9 'every surface is centred'
is "$(json '.surfaces | map(.scale) | . == sort or . == (sort | reverse)')" true 'scales go from end to end'
MIDDLE=$(json '.surfaces[2].id')
DISTANCE=$(json .distance)
get "/v1/surfaces/$MIDDLE/mesh?format=ply&resolution=4"
like "$(head -c 600 "$BODY" | tr -d '\0')" 'deformation' 'the deformation rides along in its mesh'
execute geodesic "{\"from\":\"$RIGHT\",\"to\":\"$LEFT\",\"steps\":5,\"register\":false}"
compare "$(json ".distance / $DISTANCE - 1 | fabs")" '<' 1e-12 'the distance is the same from the other side'
execute geodesic "{\"from\":\"$S\",\"to\":\"$S\",\"steps\":2,\"register\":false}"
compare "$(json '.distance + .length')" '<' 1e-12 'and zero to itself'
is "$(json '.surfaces | map(.id) | unique | join(" ")')" "$S" 'whose surfaces are that surface'
execute geodesic "{\"from\":\"$S\",\"to\":\"$RIGHT\",\"steps\":3,\"method\":\"linear\",\"register\":false}"
is "$(json '.surfaces | map(.lmax) | unique | tojson')" '[31]' 'ends of two degrees meet at the larger one'
is "$(json '.energies.geodesic == .energies.linear')" true 'linear returns the linear blend'
is "$(json .registration)" null 'and nothing was registered'
is "$(json .pullback)" null 'nor is there a path of another metric'
execute geodesic "{\"from\":\"$LEFT\",\"to\":\"$RIGHT\",\"steps\":3,\"method\":\"closed-form\",\"register\":false}"
is "$(json '"\(.surfaces[0].parameterization) \(.surfaces[2].parameterization)"')" 'star star' \
    'meshes are encoded by star for the closed form'
execute geodesic "{\"from\":\"$LEFT\",\"to\":\"$RIGHT\",\"steps\":3,\"method\":\"linear\",\"register\":false}"
is "$(json '"\(.surfaces[0].parameterization) \(.surfaces[2].parameterization)"')" 'area area' 'and by area otherwise'
execute geodesic "{\"from\":\"$LEFT\",\"to\":\"$RIGHT\",\"steps\":5,\"method\":\"pullback\",\"register\":false}"
is "$STATUS $(json '"\(.surfaces | length) \(.pullback | "\(.converged) \(.speeds | length)")"')" '200 5 true 4' \
    'pullback straightens a path of surfaces'
is "$(json '.pullback | (.energy | real) < .linear.energy and .energy < .inverted.energy')" true \
    'whose energy is below that of the straight line and of the inverted one'
is "$(json '.length >= (.distance | real) and .length == .pullback.length and .length <= .pullback.inverted.length')" true \
    'and its length between the distance and that of the inverted line'
compare "$(json .pullback.speedVariation)" '<' 0.01 'at constant speed'

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

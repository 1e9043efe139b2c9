#!/usr/bin/env bash
# test_landmarks.sh - landmarks of register and geodesic: by vertices and by positions they are the same points; met
# exactly, or the nearer the more they weigh; what is held out is measured alone; wrong ones are told by name.
# srnfd-test: slow
# srnfd-test: no-asan (core/registration/test_landmarks.c and api/test_landmarks_mean.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400

# Runs a process to its end, however long it takes.
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

start_server "$SCRATCH/data" --workers 2 || exit 1
for name in L_thalamus L_putamen; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    printf '%s %s\n' "$name" "$(json .id)" >>"$SCRATCH/meshes"
done
A=$(awk 'NR == 1 {print $2}' "$SCRATCH/meshes")
B=$(awk 'NR == 2 {print $2}' "$SCRATCH/meshes")
for mesh in "$A" "$B"; do
    run encode "{\"mesh\":\"$mesh\",\"lmax\":8}"
    json .surface.id
done >"$SCRATCH/surfaces"
read -r -d '' SA SB <"$SCRATCH/surfaces" || true

# The place of a vertex in its file.
vertex() { # NAME NUMBER
    /usr/bin/python3 - "tests/data/aal_subcortex/$1.ply" "$2" <<'PYTHON'
import struct, sys

data = open(sys.argv[1], 'rb').read()
head, body = data.split(b'end_header\n', 1)
lines = head.decode().splitlines()
names = []
for line in lines[lines.index(next(l for l in lines if l.startswith('element vertex'))) + 1:]:
    if not line.startswith('property'):
        break
    names.append(line.split()[1])
size = {'float': 4, 'float32': 4, 'double': 8, 'uchar': 1, 'int': 4}
if 'ascii' in lines[1]:
    print('[' + ','.join(body.decode().splitlines()[int(sys.argv[2])].split()[:3]) + ']')
else:
    at = int(sys.argv[2]) * sum(size[n] for n in names)
    kind = 'f' if names[0] in ('float', 'float32') else 'd'
    print(list(struct.unpack_from(('<' if 'little' in lines[1] else '>') + 3 * kind, body, at)))
PYTHON
}

register() { # LANDMARKS [MORE]
    run register "{\"template\":\"$SA\",\"moving\":\"$SB\",\"degree\":8,\"start\":\"rigid\",\"landmarks\":$1${2-}}"
}

# ---- What is met ---------------------------------------------------------------------------------------

PAIRS='"template":[10,200,400,600,800],"moving":[30,150,500,90,700]'
register null
is "$STATUS" 200 'without landmarks'
is "$(json .landmarks)" null 'and there is nothing to tell of them'
register "{$PAIRS}"
is "$STATUS" 200 'with landmarks'
cp "$BODY" "$SCRATCH/exact.json"
is "$(json '.landmarks.points | length')" 5 'each is told of'
compare "$(json .landmarks.guiding.maxAngle)" '<=' 1e-6 'they are met'
compare "$(json .landmarks.guiding.maxDistance)" '<=' 1e-6 'in the units of the mesh'
is "$(json .landmarks.heldOut)" null 'none is held out'
is "$(json .landmarks.weight)" exact 'exactly'
is "$(json '.inputs.landmarks.weight')" exact 'which is the default'
compare "$(json '[.landmarks.points[].offFixed] | max')" '<=' 1.5 'vertices are near the surface'
compare "$(json .minJacobian)" '>' 0 'and nothing folds'
register "{\"template\":[10,$(vertex L_thalamus 200),400,600,800],\"moving\":[30,150,500,$(vertex L_putamen 90),700]}"
is "$STATUS" 200 'positions'
compare "$(jq -s '.[0].distance - .[1].distance | fabs' "$SCRATCH/exact.json" "$BODY")" '<=' 1e-6 \
    'where the vertices are give the same'
register "{$PAIRS,\"weight\":0.05}"
compare "$(json .landmarks.guiding.rmsAngle)" '>' 1e-3 'a light weight leaves something'
LIGHT=$(json .landmarks.guiding.rmsAngle)
register "{$PAIRS,\"weight\":50}"
compare "$(json .landmarks.guiding.rmsAngle)" '<' "$LIGHT" 'a heavy one less'
compare "$(json .landmarks.guiding.rmsAngle)" '>' 0 'but something'
register "{$PAIRS,\"heldOut\":[4,1]}"
is "$(json '[.landmarks.points[].heldOut] | tostring')" '[false,true,false,false,true]' 'held out'
is "$(json .landmarks.heldOut.count)" 2 'are two'
compare "$(json .landmarks.guiding.maxAngle)" '<=' 1e-6 'the others are met'
compare "$(json .landmarks.heldOut.rmsDistance)" '>' 1e-3 'these are not'
is "$(json '.inputs.landmarks.heldOut | tostring')" '[1,4]' 'in rising order'
run register "{\"template\":\"$A\",\"moving\":\"$B\",\"degree\":6,\"start\":\"rigid\",\"landmarks\":{$PAIRS,\"heldOut\":[0,1,2,3,4]}}"
is "$STATUS" 200 'meshes, with all of them held out'
is "$(json .landmarks.guiding)" null 'are registered as ever, and measured'

run geodesic "{\"from\":\"$SA\",\"to\":\"$SB\",\"steps\":3,\"landmarks\":{\"from\":[10,200,400],\"to\":[30,150,500]}}"
is "$STATUS" 200 'a geodesic'
compare "$(json .landmarks.guiding.maxAngle)" '<=' 1e-6 'meets them too'

# ---- What is wrong -------------------------------------------------------------------------------------

refused() { # LANDMARKS POINTER REGEX NAME
    register "$1" "${5-}"
    is_problem 422 invalid-input "$4"
    is "$(json '.errors[0].pointer')" "/inputs/landmarks$2" 'at its place'
    like "$(json '.errors[0].detail')" "$3" 'in words'
}

refused '7' '' 'object' 'no object'
refused '{"template":[1],"moving":[1],"wieght":2}' '' 'object' 'an unknown member'
refused '{"template":[1,2],"moving":[1]}' '' '2 points of template and 1' 'unequal counts'
refused '{"template":[],"moving":[]}' /template '1 to 64' 'none'
refused '{"template":[1,99999999],"moving":[1,2]}' /template/1 'vertices 0 to' 'a vertex that is not there'
refused '{"template":[1,-1],"moving":[1,2]}' /template/1 'vertex' 'a negative one'
refused '{"template":[1,[0,0]],"moving":[1,2]}' /template/1 'position' 'two coordinates'
refused '{"template":[1,2],"moving":[5,5]}' /moving/1 'landmark 0' 'the same vertex twice'
refused '{"template":[1],"moving":[1],"weight":0}' /weight 'above 0' 'no weight'
refused '{"template":[1],"moving":[1],"heldOut":[1]}' /heldOut 'each once' 'a landmark that there is not'
refused '{"template":[1],"moving":[2]}' '' 'exact is true' 'with exact' ',"exact":true'
refused '{"template":[1],"moving":[2]}' '' 'reparameterization is false' 'without a warp' ',"reparameterization":false'
register '{"template":[1,[500,500,500]],"moving":[1,2],"weight":0.001}'
is "$STATUS" 200 'a position far off is an answer'
is "$(json '[.warnings[].code] | index("landmark-off-surface") != null')" true 'with a warning'
is "$(json '.warnings[] | select(.code == "landmark-off-surface") | .figures | [.input, .landmark, .beyond, .of] | tostring')" \
    '["template",1,1,2]' 'that names it, and its list'
like "$(json '.warnings[] | select(.code == "landmark-off-surface") | .detail')" '1 of 2 landmarks of template' 'in words'
register "{\"template\":[1,2],\"moving\":[$(jq -nc "$(vertex L_putamen 30) | map(. / 10)"),$(
    jq -nc "$(vertex L_putamen 500) | map(. / 10)")],\"weight\":0.001}"
is "$(json '.warnings[] | select(.code == "landmark-off-surface") | .figures | [.input, .beyond, .of] | tostring')" \
    '["moving",2,2]' 'centimetres are all off'
like "$(json '.warnings[] | select(.code == "landmark-off-surface") | .detail')" 'All 2 landmarks of moving .* unit' \
    'which points to the units'

# On one surface twice, with its own landmarks in order and with two of them exchanged.
itself() { # MOVING
    run register "{\"template\":\"$SA\",\"moving\":\"$SA\",\"start\":\"rigid\",\"degree\":8,
        \"landmarks\":{\"template\":[10,200,400,600],\"moving\":[$1],\"weight\":5}}"
}
itself 10,200,400,600
is "$STATUS $(json '[.warnings[].code] | index("landmarks-raise-distance")')" '200 null' 'landmarks in order cost nothing'
itself 200,10,400,600
is "$STATUS $(json '[.warnings[].code] | index("landmarks-raise-distance") != null')" '200 true' 'exchanged ones are told of'
compare "$(json '.warnings[] | select(.code == "landmarks-raise-distance") | .figures.free')" '<' 0.01 \
    'with the distance without them'
is "$(json '(.warnings[] | select(.code == "landmarks-raise-distance") | .figures.distance) == .distance')" true 'and with them'
is "$(json '.truncationError > .distance and ([.warnings[].code] | index("registration-truncated")) == null')" true \
    'a warp that they bend is no reason for a higher degree'
itself 11,201,401,601
is "$STATUS $(json '[.warnings[].code] | index("landmarks-raise-distance") != null')" '200 true' \
    'as are numbers that begin elsewhere, each next to the right one'
compare "$(json .distance)" '<' 0.05 'where the distance is small with them too'
itself "$(for at in 10 200 400 600; do vertex L_thalamus "$at" | jq -c '.[0] += 0.3'; done | paste -sd,)"
is "$STATUS $(json '[.warnings[].code] | index("landmarks-raise-distance")')" '200 null' 'and what is off by the error of a hand is not'
run geodesic "{\"from\":\"$SA\",\"to\":\"$SA\",\"steps\":2,\"landmarks\":{\"from\":[10,200,400,600],\"to\":[200,10,400,600],\"weight\":5}}"
is "$(json '[.warnings[].code] | index("landmarks-raise-distance") != null')" true 'of a geodesic as well'

P=$(vertex L_thalamus 10)
register "{\"template\":[10,$(jq -nc "$P | .[0] += 1e-6")],\"moving\":[30,150]}"
is_problem 422 invalid-input 'points that coincide on the surface'
like "$(json .detail)" 'landmarks 0 and 1 of the template coincide' 'by name'

# Points all over one surface, to points of the other in another order: no warp that keeps orientation does that.
run register "{\"template\":\"$SA\",\"moving\":\"$SA\",\"landmarks\":{\"template\":[$(seq -s, 1 40 1200)],\"moving\":[$(
    seq 1 40 1200 | tac | paste -sd,)]}}"
is_problem 422 landmarks-not-matched 'landmarks that no warp can meet'
like "$(json .detail)" 'landmark [0-9]+ was not met' 'by name'

post /v1/surfaces -H 'Content-Type: application/json' \
    --data "$(jq -nc 'def only(k): [range(25) | if . == k then 1 else 0 end];
        {coefficients: {lmax: 4, x: only(3), y: only(1), z: only(2)}}')"
run register "{\"template\":\"$(json .id)\",\"moving\":\"$SB\",\"landmarks\":{\"template\":[1],\"moving\":[1]}}"
like "$(json '.errors[0].detail')" 'comes from no mesh' 'a surface without a mesh has no vertices'

done_testing

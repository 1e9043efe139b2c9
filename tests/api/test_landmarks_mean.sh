#!/usr/bin/env bash
# test_landmarks_mean.sh - landmarks of mean and pca: by vertices for all members, by points of each, they are met exactly
# or the nearer the more they weigh; what is held out is measured alone; wrong ones are told by name.
# srnfd-test: slow
# srnfd-test: once (core/registration/test_landmarks.c has the figures in both builds)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400

# Runs a process to its end, however long it takes.
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

start_server "$SCRATCH/data" --workers 2 || exit 1
# Three meshes whose vertices correspond: a thalamus, and two that it was bent to.
python3 - tests/data/aal_subcortex/L_thalamus.ply "$SCRATCH" <<'PYTHON'
import math, struct, sys

data = open(sys.argv[1], 'rb').read()
head, body = data.split(b'end_header\n', 1)
lines = head.decode().splitlines()
count = {l.split()[1]: int(l.split()[2]) for l in lines if l.startswith('element')}
properties, element = [], None
for line in lines:
    element = line.split()[1] if line.startswith('element') else element
    if line.startswith('property') and element == 'vertex':
        properties.append(line.split()[1:])
size = {'float': 4, 'float32': 4, 'double': 8, 'float64': 8, 'uchar': 1, 'uint8': 1, 'int': 4}
stride = sum(size[kind] for kind, _ in properties)
kind = 'f' if size[properties[0][0]] == 4 else 'd'
for m in range(3):
    out = bytearray(body)
    for v in range(count['vertex']):
        x, y, z = struct.unpack_from('<3' + kind, body, v * stride)
        bent = (x + 0.08 * m * y * math.sin(z / 6), y * (1 + 0.1 * m), z + 0.02 * m * x * x / 10)
        struct.pack_into('<3' + kind, out, v * stride, *bent)
    open(f'{sys.argv[2]}/bent{m}.ply', 'wb').write(head + b'end_header\n' + out)
PYTHON
for m in 0 1 2; do
    post "/v1/meshes?name=bent$m" --data-binary "@$SCRATCH/bent$m.ply"
    printf '%s\n' "$(json .id)" >>"$SCRATCH/meshes"
    run encode "{\"mesh\":\"$(json .id)\",\"lmax\":7}"
    json .surface.id >>"$SCRATCH/surfaces"
done
mapfile -t M <"$SCRATCH/meshes"
SURFACES=$(jq -Rnc '[inputs]' "$SCRATCH/surfaces")

mean() { # LANDMARKS [MORE] [PROCESS]
    run "${3:-mean}" "{\"surfaces\":$SURFACES,\"maxIterations\":4,\"landmarks\":$1${2-}}"
}

# ---- What is met ---------------------------------------------------------------------------------------

VERTICES='"vertices":[10,200,400,600,800,30]'
mean null
is "$STATUS $(json .landmarks)" '200 null' 'without landmarks there is nothing to tell of them'
mean "{$VERTICES}"
is "$STATUS" 200 'vertices of all members'
cp "$BODY" "$SCRATCH/exact.json"
is "$(json '[(.landmarks.points | length), (.landmarks.members | length)] | tostring')" '[6,3]' 'each is told of, of each member'
compare "$(json .landmarks.guiding.maxAngle)" '<=' 1e-6 'they are met'
compare "$(json .landmarks.guiding.maxDistance)" '<=' 1e-5 'in the units of the meshes'
compare "$(json '[.landmarks.members[].off[]] | max')" '<=' 2.5 'vertices are near the surfaces'
is "$(json '[.landmarks.weight, .landmarks.heldOut, .landmarks.guiding.count] | tostring')" '["exact",null,6]' \
    'exactly, which is the default, and none is held out'
get "/v1/surfaces/$(json .surface.id)/mesh?format=obj&space=original"
cp "$BODY" "$SCRATCH/mean.obj"
compare "$(python3 - "$SCRATCH" <<'PYTHON'
import json, sys

vertices = [[float(x) for x in l.split()[1:4]] for l in open(sys.argv[1] + '/mean.obj') if l.startswith('v ')]
points = json.load(open(sys.argv[1] + '/exact.json'))['landmarks']['points']
print(max(min(sum((a - b) ** 2 for a, b in zip(p['position'], v)) ** .5 for v in vertices) for p in points))
PYTHON
)" '<=' 1.5 'and those of the mean lie on its surface'
OTHER=$(python3 - "$SCRATCH/bent1.ply" <<'PYTHON'
import struct, sys

data = open(sys.argv[1], 'rb').read()
head, body = data.split(b'end_header\n', 1)
lines = head.decode().splitlines()
properties, element = [], None
for line in lines:
    element = line.split()[1] if line.startswith('element') else element
    if line.startswith('property') and element == 'vertex':
        properties.append(line.split()[1:])
size = {'float': 4, 'float32': 4, 'double': 8, 'float64': 8, 'uchar': 1, 'uint8': 1, 'int': 4}
stride = sum(size[kind] for kind, _ in properties)
kind = 'f' if size[properties[0][0]] == 4 else 'd'
print([list(struct.unpack_from('<3' + kind, body, v * stride)) for v in (10, 200, 400, 600, 800, 30)])
PYTHON
)
mean "{\"points\":[[10,200,400,600,800,30],$OTHER,[10,200,400,600,800,30]]}"
is "$STATUS" 200 'points of each member'
compare "$(jq -s '.[0].distances[1] - .[1].distances[1] | fabs' "$SCRATCH/exact.json" "$BODY")" '<=' 1e-6 \
    'positions where the vertices are give the same'
mean "{$VERTICES,\"weight\":0.02}"
LIGHT=$(json .landmarks.guiding.rmsAngle)
compare "$LIGHT" '>' 1e-4 'a light weight leaves something'
mean "{$VERTICES,\"weight\":20}"
compare "$(json .landmarks.guiding.rmsAngle)" '<' "$LIGHT" 'a heavy one less'
compare "$(json .landmarks.guiding.rmsAngle)" '>' 0 'but something'
mean "{$VERTICES,\"heldOut\":[5,1]}"
is "$(json '[.landmarks.points[].heldOut] | tostring')" '[false,true,false,false,false,true]' 'held out'
is "$(json '[.landmarks.heldOut.count, .landmarks.guiding.count] | tostring')" '[2,4]' 'are two of six'
compare "$(json .landmarks.guiding.maxAngle)" '<=' 1e-6 'the others are met'
compare "$(json .landmarks.heldOut.rmsDistance)" '>' 1e-3 'these are not'
compare "$(json '[.landmarks.members[] | .angles[1], .angles[5]] | min')" '>' 1e-6 'and are those two'
is "$(json '.inputs.landmarks.heldOut | tostring')" '[1,5]' 'in rising order'
mean "{$VERTICES,\"heldOut\":[0,1,2,3,4,5]}"
is "$(json .landmarks.guiding)" null 'all of them held out guide nothing'
HELD=$(json .distances)
mean null
is "$(json .distances)" "$HELD" 'and the mean is the one without'
mean "{$VERTICES}" '' pca
is "$STATUS" 200 'components of registrations that landmarks guide'
compare "$(json .landmarks.guiding.maxAngle)" '<=' 1e-6 'which meet them too'
is "$(json '.distances | tostring')" "$(jq -c .distances "$SCRATCH/exact.json")" 'as those of the mean do'

# ---- What is wrong -------------------------------------------------------------------------------------

refused() { # LANDMARKS POINTER REGEX NAME [MORE]
    mean "$1" "${5-}"
    is_problem 422 invalid-input "$4"
    is "$(json '.errors[0].pointer')" "/inputs/landmarks$2" 'at its place'
    like "$(json '.errors[0].detail')" "$3" 'in words'
}

refused '7' '' 'object' 'no object'
refused '{"weight":2}' '' 'either vertices or points' 'no points'
refused '{"vertices":[1],"points":[[1],[1],[1]]}' '' 'either' 'both kinds'
refused '{"vertices":[1],"wieght":1}' '' 'object' 'an unknown member'
refused '{"vertices":[1,[0,0,0]]}' /vertices 'numbers of vertices' 'one position for all'
refused '{"vertices":[1,1]}' /vertices/1 'landmark 0' 'a vertex twice'
refused '{"vertices":[1,99999999]}' /vertices/1 'member 0' 'a vertex that is not there'
refused '{"points":[[1,2],[1,2]]}' /points '2 lists for 3 members' 'too few lists'
refused '{"points":[[1,2],[1],[1,2]]}' /points/1 'has 1 point, ' 'a list that is shorter'
refused '{"points":[[1,2],[1,2],[1,-2]]}' /points/2/1 'number of a vertex' 'what is no point'
refused '{"vertices":[1],"weight":0}' /weight 'above 0' 'no weight'
refused '{"vertices":[1],"heldOut":[1]}' /heldOut 'each once' 'a landmark that there is not'
refused '{"vertices":[1]}' '' 'register is false' 'without registration' ',"register":false'
refused '{"vertices":[1]}' '' 'method pullback' 'in the pulled-back metric' ',"method":"pullback"'

post_json /v1/cohorts "{\"name\":\"hands\",\"members\":[{\"id\":\"${M[0]}\"},{\"id\":\"${M[1]}\",\"mirror\":true}]}"
run mean '{"cohort":"hands","landmarks":{"vertices":[1,400]}}'
like "$STATUS $(json '.errors[0].detail')" '422 .*mirrored, as member 1 is' 'members that are taken mirrored'

mean '{"points":[[10,200],[10,[500,500,500]],[10,200]],"weight":0.001}'
is "$STATUS" 200 'a position far off is an answer'
is "$(json '.warnings[] | select(.code == "landmark-off-surface") | [.figures.landmark, .figures.surface] | tostring')" \
    "[1,$(jq '.[1]' <<<"$SURFACES")]" 'with a warning that names it and whose it is'

stop_server || not_ok 'the server ends well'
done_testing

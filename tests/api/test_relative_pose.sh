#!/usr/bin/env bash
# test_relative_pose.sh - classifiers of several structures that heed where these are to each other: labels that nothing
# else tells are told, also of new subjects and wherever those are as a whole, and what has no place is refused by name.
# srnfd-test: plain-core (core/stats/test_train.c, core/stats/test_norms.c and test_standard.sh run its numerics)
# srnfd-test: slow
# srnfd-test: once (core/stats/test_train.c and core/stats/test_folds_join.c run the numerics in both builds)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400
start_server "$SCRATCH/data" --workers 2 || exit 1

# Ellipsoids in pairs; of one label the second is farther from the first. The last four subjects are asked about, two of
# them again, moved by 50 as a whole.
python3 - "$URL" >"$SCRATCH/members.json" <<'PYTHON'
import json, math, random, sys, urllib.request
from service import send

random.seed(8)
def mesh(axes, at):
    rows, columns, points, faces = 8, 10, [], []
    for k in range(rows + 1):
        for j in range(1 if k in (0, rows) else columns):
            t, p = math.pi * k / rows, 2 * math.pi * j / columns
            e = (math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t))
            points.append([x + a * c for x, a, c in zip(at, axes, e)])
    def node(k, j):
        return 0 if k == 0 else len(points) - 1 if k == rows else 1 + (k - 1) * columns + j % columns
    for k in range(rows):
        for j in range(columns):
            a, b, c, d = node(k, j), node(k + 1, j), node(k + 1, j + 1), node(k, j + 1)
            faces += [f for f in ((a, b, c), (a, c, d)) if len(set(f)) == 3]
    return 'OFF\n%d %d 0\n' % (len(points), len(faces)) + ''.join('%.9g %.9g %.9g\n' % tuple(p) for p in points) \
        + ''.join('3 %d %d %d\n' % f for f in faces)

def upload(content):
    with urllib.request.urlopen(sys.argv[1] + '/v1/meshes?format=off', content.encode()) as answer:
        mesh = json.load(answer)['id']
    inputs = {'mesh': mesh, 'lmax': 4, 'parameterization': 'star'}
    return send('/v1/processes/encode/execution', {'inputs': inputs})['surface']['id']

members = []
for s in range(14):
    label, apart = s % 2, 3 + 0.8 * (s % 2) + random.gauss(0, 0.05)
    axes = [[a * (1 + random.gauss(0, 0.04)) for a in (1, 0.9, 0.7)] for _ in range(2)]
    for moved in (0, 50) if s > 11 else (0,):
        for part in (0, 1):
            at = (moved + apart * part, moved, -moved)
            members.append({'id': upload(mesh(axes[part], at)), 'subject': f's{s}' + ('m' if moved else ''),
                            'label': ('near', 'far')[label], 'covariates': {'part': ('first', 'second')[part]}})
print(json.dumps(members))
PYTHON
is "$(jq length "$SCRATCH/members.json")" 32 'there are pairs'
cohort() { # NAME FILTER
    post_json /v1/cohorts "$(jq -c "{name: \"$1\", members: ($2)}" "$SCRATCH/members.json")"
}
run() { # PROCESS INPUTS
    execute "$1" "$2" -H 'Prefer: wait=300'
}
parts_of() { # SUBJECT
    jq -c "[.[] | select(.subject == \"$1\")] | map({(.covariates.part): .id}) | add" "$SCRATCH/members.json"
}
cohort known '.[:20]'

# ---- classify-parts ------------------------------------------------------------------------------------

OPTIONS='"cohort":"known","lmax":4,"commonPose":true,"method":"srnf-nn"'
run classify-parts "{$OPTIONS}"
is "$STATUS" 200 'shapes alone'
compare "$(json '.methods["srnf-nn"].accuracy')" '<' 0.9 'do not tell the label'
run classify-parts "{$OPTIONS,\"relativePose\":true,\"poseWeight\":10}"
is "$STATUS $(json '.methods["srnf-nn"].accuracy')" '200 1' 'where they are does'
is "$(json '[.inputs.relativePose, .inputs.poseWeight] | tojson')" '[true,10]' 'as asked'

# ---- train-parts, predict ------------------------------------------------------------------------------

run train-parts "{$OPTIONS,\"relativePose\":true,\"poseWeight\":10}"
is "$STATUS $(json '.validation.accuracy.value')" '200 1' 'a classifier that heeds it'
MODEL=$(json .model.id)
is "$(json '[.positions == .model.positions, .positions.weight, (.positions.mean | length)] | tojson')" '[true,10,2]' 'has positions'
compare "$(json '.positions.mean | (.[1][0] - .[0][0]) / 3.4 * 4 | fabs')" '>' 0.5 'which are apart along x'
compare "$(json '.positions.mean | (.[0][0] + .[1][0] | fabs)')" '<' 1e-9 'about the middle of the two'
run predict "{\"model\":\"$MODEL\",\"parts\":[$(parts_of s10),$(parts_of s11),$(parts_of s12),$(parts_of s13)]}"
is "$STATUS $(json '[.predictions[].label] | join(" ")')" '200 near far near far' 'it tells new subjects'
is "$(json '[.predictions[] | ([.parts[].distance, .position.distance | . * .] | add | sqrt) - .typicality.distance.value | fabs < 1e-12] | all')" \
    true 'whose parts and positions add up'
is "$(json '[.predictions[].position | (.distance | real) > 0 and (.residual | real) >= 0] | all')" true 'all of them'
PROBABILITIES=$(json '.predictions[2].probabilities.near')
run predict "{\"model\":\"$MODEL\",\"parts\":$(parts_of s12m)}"
compare "$(json ".predictions[0].probabilities.near - $PROBABILITIES | fabs")" '<' 1e-6 'wherever they are as a whole'
cohort new '.[20:24]'
run predict "{\"model\":\"$MODEL\",\"cohort\":\"new\"}"
is "$STATUS $(json '[.predictions[] | .label == .truth] | tojson')" '200 [true,true]' 'so it does by a cohort'
get "/v1/models/$MODEL/modes?part=second"
is "$STATUS" 200 'its modes are those of a part'
get "/v1/models/$MODEL"
is "$STATUS $(json '.positions.weight')" '200 10' 'its record has the weight'
run train-parts "{$OPTIONS}"
is "$STATUS $(json '[.positions, .model.positions] | tojson')" '200 [null,null]' 'without it there are none'
run predict "{\"model\":\"$(json .model.id)\",\"parts\":$(parts_of s10)}"
is "$STATUS $(json '.predictions[0].position')" '200 null' 'nor in predictions'

# ---- Surfaces that were posted -------------------------------------------------------------------------

# Ellipsoids of unit area or as they are, with their centroid (.3, -.2, .1) or 3 to 3.8 apart along x: subjects of pca-parts.
posted() { # SUBJECT PART X SCALE
    post_json /v1/surfaces "$(jq -nc --argjson x "$3" --argjson s "$1" --arg scale "$4" 'def only(k; v): [range(25) | if . == k then v else 0 end];
        (16 * atan2(1; 1) | sqrt) as $one | {scale: $scale, coefficients: {lmax: 4, x: only(3; 1.3 + 0.02 * $s), y: only(1; 1), z: only(2; 0.8)}}
        | .coefficients |= (.x[0] = $one * (0.3 + $x) | .y[0] = -0.2 * $one | .z[0] = 0.1 * $one)')"
}
placed() { # NAME MIRROR..: a cohort of the surfaces in IDS, its positions
    post_json /v1/cohorts "$(printf '%s\n' "${IDS[@]}" | jq -Rnc --arg name "$1" --argjson mirror "$2" '{name: $name, members: ([inputs] | to_entries
        | map({id: .value, mirror: $mirror, subject: "s\(.key / 2 | floor)", covariates: {part: ["first", "second"][.key % 2]}}))}')"
    run pca-parts "{\"cohort\":\"$1\",\"register\":false,\"modes\":0,\"components\":1,\"relativePose\":true}"
    is "$STATUS" 200 "$1"
}
mean_is() { # FILE SIGN: as in FILE, mirrored where SIGN is -1
    compare "$(jq -s --argjson sign "$2" '[.[].positions.mean | flatten] | [transpose | to_entries[]
        | .value[0] - .value[1] * (if .key % 3 == 0 then $sign else 1 end) | fabs] | max' "$1" "$BODY")" '<' 1e-9 "$3"
}
for scale in none unit-area; do
    IDS=()
    for s in 0 1 2 3; do
        posted $s first 0 $scale
        IDS+=("$(json .id)")
        posted $s second "3.$((2 * s))" $scale
        IDS+=("$(json .id)")
    done
    placed "posted-$scale" false
    cp "$BODY" "$SCRATCH/$scale.json"
    compare "$(json '.positions.variance')" '>' 1e-4 'have places that differ'
    compare "$(json '.positions.mean[1][0] - .positions.mean[0][0]')" '>' 0.4 'and are apart along x'
    placed "mirrored-$scale" true
    mean_is "$SCRATCH/$scale.json" -1 'members that are taken mirrored have mirrored places'
    IMAGES=()
    for id in "${IDS[@]}"; do
        execute mirror "{\"surface\":\"$id\"}"
        IMAGES+=("$(json .surface.id)")
    done
    IDS=("${IMAGES[@]}")
    placed "images-$scale" false
    mean_is "$SCRATCH/$scale.json" -1 'so have images that mirror made of them'
done
IDS=()
for i in 0 1 2 3 4 5 6 7; do # half of the way to the next subject, where the first of the two lies
    execute geodesic "{\"from\":\"${IMAGES[i]}\",\"to\":\"${IMAGES[(i + 2) % 8]}\",\"steps\":3,\"method\":\"linear\",\"register\":false}"
    IDS+=("$(json '.surfaces[1].id')")
done
placed steps false
compare "$(json '.positions.mean[1][0] - .positions.mean[0][0]')" '<' -0.4 'and steps between such images'
cp "$SCRATCH/none.json" "$BODY"
mean_is "$SCRATCH/unit-area.json" 1 'it is one whether they were centred when they came or not'

# ---- What is wrong -------------------------------------------------------------------------------------

for PROCESS in classify-parts train-parts; do
    run "$PROCESS" '{"cohort":"known","lmax":4,"relativePose":true}'
    is "$STATUS $(json '.errors[0].pointer')" '422 /inputs/relativePose' "refused: $PROCESS of parts that are turned one by one"
    like "$(json '.errors[0].detail')" '^needs commonPose: where parts are turned' '  in words'
done
run register "{\"template\":$(parts_of s13 | jq .first),\"moving\":$(parts_of s12 | jq .first),\"start\":\"rigid\",\"degree\":4}"
run predict "{\"model\":\"$MODEL\",\"parts\":{\"first\":$(json .surface.id | jq -R .),\"second\":$(parts_of s12 | jq .second)}}"
is_problem 422 invalid-input 'a surface that was turned'
like "$(json .detail)" 'surf-[0-9a-f]* was turned' 'is told by name'

done_testing

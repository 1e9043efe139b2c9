#!/usr/bin/env bash
# GET /v1/models/{id}/shape: a point of a model by several coefficients, beside what modes answers for one; nothing is
# kept of it, and it does not wait behind jobs. Positions alone, of it and of surfaces.
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 || exit 1
IDS=()
for name in L_thalamus L_putamen L_pallidum R_thalamus; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    IDS+=("\"$(json .id)\"")
done
SURFACES="[$(
    IFS=,
    printf '%s' "${IDS[*]}"
)]"
execute pca "{\"surfaces\":$SURFACES,\"lmax\":6,\"register\":false}" --header 'Prefer: wait=120'
is "$STATUS" 200 'a model'
MODEL=$(json .model.id)
MEAN=$(json .model.mean.id)
execute modes "{\"model\":\"$MODEL\",\"mode\":2,\"coefficients\":[1.5]}" --header 'Prefer: wait=120'
BY_MODES=$(json '.surfaces[0].id')
ENERGY=$(json '.relativeEnergy[0] | real')

count() { # LIST: how many there are
    get "/v1/$1"
    json .total
}
JOBS=$(count jobs)
SURFACES_BEFORE=$(count surfaces)

get "/v1/models/$MODEL/shape?coefficients=0,1.5"
is "$STATUS $(header Content-Type)" '200 application/json' 'a point of the model'
cp "$BODY" "$SCRATCH/shape"
is "$(json '.coefficients | map(. + 0) | tostring')" '[0,1.5]' 'says which'
get "/v1/surfaces/$BY_MODES/coefficients"
jq -s '[.[0].surface, .[1]] | [range(0; .[0].x | length) as $i | (.[0].x[$i] - .[1].x[$i], .[0].y[$i] - .[1].y[$i],
    .[0].z[$i] - .[1].z[$i]) | fabs] | max' "$SCRATCH/shape" "$BODY" >"$SCRATCH/difference"
compare "$(cat "$SCRATCH/difference")" '<=' 1e-5 'is the surface that modes finds'
compare "$(jq '.relativeEnergy' "$SCRATCH/shape")" '<=' "$(jq -n "1.01 * $ENERGY + 1e-9")" 'as near to the point'
compare "$(jq '.offset' "$SCRATCH/shape")" '>=' 0 'with how far off it is'
get "/v1/models/$MODEL"
DEVIATION=$(json '.eigenvalues[1] | sqrt')
compare "$(jq "(.relativeEnergy | sqrt) / (1.5 * $DEVIATION) / .offset | log | fabs" "$SCRATCH/shape")" '<=' 0.3 \
    'against how far the point is from the mean, as both norms are about 1'
get "/v1/models/$MODEL/shape?coefficients=1,-2,0.5"
is "$STATUS" 200 'several at once'

# The mean is where all are zero; positions are in the order of the other formats.
get "/v1/models/$MODEL/shape?coefficients=0&format=positions&resolution=4"
is "$STATUS $(header Content-Type)" '200 application/octet-stream' 'positions alone'
is "$(wc -c <"$BODY")" $((162 * 12)) 'are three numbers of 32 bits for each vertex'
compare "$(header Srnfd-Relative-Energy)" '<=' 1e-2 'their energy is in a header'
is "$(header Srnfd-Offset)" 0 'and how far off they are'
cp "$BODY" "$SCRATCH/mean"
get "/v1/surfaces/$MEAN/mesh?format=positions&resolution=4"
is "$STATUS" 200 'surfaces have them, too'
/usr/bin/python3 - "$SCRATCH/mean" "$BODY" >"$SCRATCH/far" <<'PYTHON'
import struct, sys
a, b = ([v for v, in struct.iter_unpack("<f", open(name, "rb").read())] for name in sys.argv[1:])
print(max(abs(x - y) for x, y in zip(a, b)) if len(a) == len(b) else "nan")
PYTHON
compare "$(cat "$SCRATCH/far")" '<=' 1e-3 'and the mean is the same by both'
get "/v1/surfaces/$MEAN/mesh?format=obj&resolution=4"
sed -n 's/^v //p' "$BODY" >"$SCRATCH/vertices"
get "/v1/surfaces/$MEAN/mesh?format=positions&resolution=4"
/usr/bin/python3 - "$SCRATCH/vertices" "$BODY" >"$SCRATCH/far" <<'PYTHON'
import struct, sys
a = [float(v) for line in open(sys.argv[1]) for v in line.split()[:3]]
b = [v for v, in struct.iter_unpack("<f", open(sys.argv[2], "rb").read())]
print(max(abs(x - y) for x, y in zip(a, b)) if len(a) == len(b) else "nan")
PYTHON
compare "$(cat "$SCRATCH/far")" '<=' 1e-5 'in the order of the other formats'
get "/v1/models/$MODEL/shape?coefficients=0,1&format=glb&resolution=4"
is "$STATUS $(header Content-Type)" '200 model/gltf-binary' 'a mesh in any format'
TAG=$(header ETag)
get "/v1/models/$MODEL/shape?coefficients=0,1&format=glb&resolution=4" --header "If-None-Match: $TAG"
is "$STATUS" 304 'which need not be computed twice'

# What is refused.
refused() { # QUERY NAME
    get "/v1/models/$MODEL/shape$1"
    is_problem 422 invalid-input "$2"
}
refused '' 'coefficients must be given'
refused '?coefficients=' 'as numbers'
refused '?coefficients=1,,2' 'without gaps'
refused '?coefficients=1,2x' 'nothing else'
refused '?coefficients=nan' 'that are finite'
refused '?coefficients=0x1p3' 'and decimal'
refused '?coefficients=11' 'within ten standard deviations'
refused '?coefficients=1,1,1,1,1' 'no more than components'
refused '?coefficients=1&format=gif' 'in a format that is known'
refused '?coefficients=1&resolution=0' 'at some resolution'
execute pca "{\"surfaces\":[${IDS[0]},${IDS[1]}],\"lmax\":32,\"register\":false}" --header 'Prefer: wait=120'
get "/v1/models/$(json .model.id)/shape?coefficients=1"
is_problem 422 invalid-input 'a degree that takes long is refused'
like "$(json '.errors[0].detail')" 'up to degree 31.*modes' 'which says up to where, and what to use'
get "/v1/models/model-0/shape?coefficients=1"
is_problem 404 no-such-model 'of a model that is there'
is "$(count jobs) $(count surfaces)" "$((JOBS + 1)) $((SURFACES_BEFORE + 1))" 'nothing of all this was kept'

# Beside a job that holds the only worker.
execute geodesic "{\"from\":${IDS[0]},\"to\":${IDS[1]},\"steps\":99,\"register\":false}" --header 'Prefer: respond-async'
LONG=$(json .id)
get "/v1/models/$MODEL/shape?coefficients=0.5,0.5&format=positions"
is "$STATUS" 200 'a shape comes beside a long job'
get "/v1/jobs/$LONG"
like "$(json .status)" 'accepted|running' 'which goes on'
post "/v1/jobs/$LONG/cancel"
done_testing

#!/usr/bin/env bash
# test_mirror_process.sh - the process mirror: meshes and surfaces mirrored, what their records say, where they lie,
# and that what is made of them knows. Shapes without a mirror plane, at a low degree.
# srnfd-test: slow
# srnfd-test: once (core/surface/test_mirror.c has the figures in both builds)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
REQUEST_SECONDS=400

run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

encode() { # MESH [MORE]: prints the id of the surface
    run encode "{\"mesh\":\"$1\",\"lmax\":$LMAX,\"parameterization\":\"area\"${2:-}}"
    json .surface.id
}

# The vertices of a binary PLY as rows of text; SIGN -1: those with -x.
vertices() { # FILE [SIGN]
    /usr/bin/python3 - "$1" "${2:-1}" <<'PY'
import sys
data = open(sys.argv[1], 'rb').read()
head, body = data.split(b'end_header\n', 1)
n = int(head.split(b'element vertex ')[1].split()[0])
import struct
kinds = [line.split()[1] for line in head.split(b'element face')[0].splitlines() if line.startswith(b'property')]
form = '<' + ''.join({b'double': 'd', b'float': 'f'}[k] for k in kinds)
size = struct.calcsize(form)
for i in range(n):
    x, y, z = struct.unpack_from(form, body, i * size)[:3]
    print(*('%.9g' % (v + 0.0) for v in (int(sys.argv[2]) * x, y, z)))
PY
}

start_server "$SCRATCH/data" --workers 2 || exit 1

# ---- Meshes ------------------------------------------------------------------------------------------

post '/v1/meshes?name=L_putamen' --data-binary @tests/data/aal_subcortex/L_putamen.ply
LEFT=$(json .id)
is "$(json .mirrored)" false 'an uploaded mesh is no mirror image'
post '/v1/meshes?name=R_putamen' --data-binary @tests/data/aal_subcortex/R_putamen.ply
RIGHT=$(json .id)
get "/v1/meshes/$RIGHT"
BEFORE=$(json '.report | {area, volume} | tojson')

run mirror "{\"mesh\":\"$RIGHT\"}"
is "$STATUS $(json '[.surface, .mesh.name, .mesh.mirrored, .mesh.report.analysable, .inputs.plane] | tojson')" \
    '200 [null,"R_putamen",true,true,"sagittal"]' 'a mesh is mirrored in the sagittal plane'
IMAGE=$(json .mesh.id)
is "$(json '.mesh.source | [.process, .mesh, .plane, .mirrored] | tojson')" "[\"mirror\",\"$RIGHT\",\"sagittal\",true]" \
    'and its record says of what, and how'
compare "$(json ".mesh.report.volume / ($BEFORE | .volume) - 1 | fabs")" '<' 1e-9 'its volume has its sign: the faces were turned'
compare "$(json ".mesh.report.area / ($BEFORE | .area) - 1 | fabs")" '<' 1e-9 'and the area is the same'
get "/v1/meshes/$IMAGE"
is "$(json '[.mirrored, .source.mesh] | tojson')" "[true,\"$RIGHT\"]" 'which is stored'
curl -fsS -o "$SCRATCH/image.ply" "$URL/v1/meshes/$IMAGE/content"

run mirror "{\"mesh\":\"$IMAGE\"}"
is "$STATUS $(json '.mesh.mirrored')" '200 false' 'the image of an image is none'
TWICE=$(json .mesh.id)
run mirror "{\"mesh\":\"$TWICE\"}"
is "$(json '[.mesh.id, .mesh.mirrored] | tojson')" "[\"$IMAGE\",true]" 'and its image is the first one, bit by bit'
curl -fsS -o "$SCRATCH/twice.ply" "$URL/v1/meshes/$TWICE/content"
curl -fsS -o "$SCRATCH/plain.ply" "$URL/v1/meshes/$RIGHT/content?format=ply"
vertices "$SCRATCH/image.ply" -1 | sort >"$SCRATCH/image.txt"
vertices "$SCRATCH/twice.ply" | sort >"$SCRATCH/twice.txt"
vertices "$SCRATCH/plain.ply" | sort >"$SCRATCH/plain.txt"
is "$(cmp "$SCRATCH/twice.txt" "$SCRATCH/image.txt" && wc -l <"$SCRATCH/twice.txt")" "$(wc -l <"$SCRATCH/twice.txt")" \
    'its points are those of the image with -x'
is "$(cmp "$SCRATCH/twice.txt" "$SCRATCH/plain.txt" && echo same)" same 'and those of the mesh that was sent'

# What is encoded of it has the coefficients of what encode makes of the mesh with mirror, in another place.
shape() { # SURFACE
    get "/v1/surfaces/$1/coefficients"
    sha256sum <"$BODY"
}
MIRRORED=$(encode "$RIGHT" ',"mirror":true')
SAME=$(encode "$IMAGE")
is "$(json .surface.mirrored)" true 'an image encoded is an image'
is "$(shape "$SAME")" "$(shape "$MIRRORED")" 'the image encoded is the mesh encoded with mirror'
isnt "$SAME" "$MIRRORED" 'elsewhere'
AGAIN=$(encode "$IMAGE" ',"mirror":true')
is "$(json .surface.mirrored)" false 'encoded with mirror it is none'
is "$(shape "$AGAIN")" "$(shape "$(encode "$TWICE")")" 'but what its own image becomes'
run repair "{\"mesh\":\"$IMAGE\",\"merge\":0.001}"
is "$(json .mesh.mirrored)" true 'what is mended of an image is one'

run mirror "{\"mesh\":\"$RIGHT\",\"plane\":[0,-2,2]}"
is "$STATUS $(json '.inputs.plane | map(. * 1e6 | round) | tojson')" '200 [0,707107,-707107]' 'another plane is given by its normal'
is "$(json .mesh.mirrored)" true 'and gives an image too'
compare "$(json ".mesh.report.volume / ($BEFORE | .volume) - 1 | fabs")" '<' 1e-9 'of the same volume'
run mirror "{\"mesh\":\"$(json .mesh.id)\",\"plane\":[0,1,-1]}"
is "$(json .mesh.mirrored)" false 'whose image in that plane is none'
curl -fsS -o "$SCRATCH/back.ply" "$URL$(json .mesh.links.content)"
paste <(vertices "$SCRATCH/back.ply") <(vertices "$SCRATCH/twice.ply") |
    awk '{ for (k = 1; k <= 3; k++) { d = $k - $(k + 3); if (d < 0) d = -d; if (!(d <= w)) w = d } } END { print w + 0 }' >"$SCRATCH/worst"
compare "$(cat "$SCRATCH/worst")" '<' 1e-6 'and lies where the mesh was, to rounding'
run mirror "{\"mesh\":\"$RIGHT\",\"plane\":[-3,0,0]}"
is "$(json '[.inputs.plane, .mesh.id] | tojson')" "[\"sagittal\",\"$IMAGE\"]" 'a plane has one spelling'

# ---- Surfaces ----------------------------------------------------------------------------------------

A=$(encode "$LEFT")
B=$(encode "$RIGHT")
PLACE=$(json '.surface | {origin, scale, volume} | tojson')
run mirror "{\"surface\":\"$B\"}"
M=$(json .surface.id)
is "$STATUS $(json '[.mesh, .surface.mirrored, .surface.name, .surface.lmax, .surface.route] | tojson')" \
    "200 [null,true,\"R_putamen\",$LMAX,\"area\"]" 'a surface is mirrored'
is "$(json '.surface.source | [.process, .surface, .mesh] | tojson')" "[\"mirror\",\"$B\",\"$RIGHT\"]" 'and says of what'
compare "$(json ".surface.volume / ($PLACE | .volume) - 1 | fabs")" '<' 1e-9 'oriented as before'
compare "$(json ".surface.origin as \$o | $PLACE | [.origin[0] + \$o[0], .origin[1] - \$o[1], .origin[2] - \$o[2]] | map(fabs) | max")" \
    '<' 1e-9 'its place is on the other side'
run mirror "{\"surface\":\"$M\"}"
is "$(json '[.surface.id, .surface.mirrored] | tojson')" "[\"$B\",false]" 'its image is the surface itself'
get "/v1/surfaces/$B"
is "$(json .source.process)" encode 'whose first record stays'

# space=original: the points of the image are those of the surface with -x. The sphere is reflected too, so nearest
# points are compared, by the extent of both.
OF_IMAGE=$(encode "$IMAGE")
for id in "$B" "$M" "$OF_IMAGE"; do
    curl -fsS -o "$SCRATCH/original.ply" "$URL/v1/surfaces/$id/mesh?format=ply&space=original&resolution=24"
    vertices "$SCRATCH/original.ply" | awk '
        { for (k = 1; k <= 3; k++) { if (NR == 1 || $k < l[k]) l[k] = $k; if (NR == 1 || $k > h[k]) h[k] = $k } }
        END { print l[1], h[1], l[2], h[2], l[3], h[3] }' >"$SCRATCH/$id.extent"
done
paste "$SCRATCH/$B.extent" "$SCRATCH/$M.extent" |
    awk 'function a(x) { return x < 0 ? -x : x } { w = a($1 + $8); e = a($2 + $7); w = e > w ? e : w;
        for (k = 3; k <= 6; k++) { e = a($k - $(k + 6)); w = e > w ? e : w } print w }' >"$SCRATCH/worst"
compare "$(cat "$SCRATCH/worst")" '<' 0.2 'in space=original it has the extent of the surface with -x (millimetres)'
grep -aq 'The coordinates of the mesh\.' "$SCRATCH/original.ply" && ok 'a surface of a mirrored mesh lies where that mesh is' ||
    not_ok 'a surface of a mirrored mesh lies where that mesh is'
paste "$SCRATCH/$M.extent" "$SCRATCH/$OF_IMAGE.extent" |
    awk 'function a(x) { return x < 0 ? -x : x } { for (k = 1; k <= 6; k++) { e = a($k - $(k + 6)); w = e > w ? e : w } print w }' \
        >"$SCRATCH/worst"
compare "$(cat "$SCRATCH/worst")" '<' 1 'and the image of the surface and the surface of the image lie together'

# A registered surface was turned, and its image goes to the other side all the same.
run register "{\"template\":\"$A\",\"moving\":\"$M\",\"start\":\"rigid\",\"degree\":4}"
is "$STATUS $(json '[.surface.mirrored, ([.warnings[] | select(.code == "mirror-images")] | length)] | tojson')" \
    '200 [true,0]' 'a mirrored right one registers to a left one without a warning'
NEAR=$(json .distance)
TURNED=$(json .surface.id)
run register "{\"template\":\"$A\",\"moving\":\"$B\",\"start\":\"rigid\",\"degree\":4,\"handedness\":\"ignore\"}"
compare "$NEAR" '<' "$(json '0.9 * .distance')" 'and is nearer to it than it was: these shapes have no mirror plane'
run mirror "{\"surface\":\"$TURNED\"}"
is "$(json .surface.mirrored)" false 'the image of the registered one is none'
extent() { # SURFACE
    curl -fsS -o "$SCRATCH/$1.ply" "$URL/v1/surfaces/$1/mesh?format=ply&space=original&resolution=24"
    vertices "$SCRATCH/$1.ply" | awk '{ for (k = 1; k <= 3; k++) s[k] += $k } END { print s[1] / NR, s[2] / NR, s[3] / NR }'
}
# In the frame of its template it is reflected, so in that of its input by the same turn: as far from the origin.
paste <(extent "$TURNED") <(extent "$(json .surface.id)") | awk '
    { d = sqrt($1 * $1 + $2 * $2 + $3 * $3) - sqrt($4 * $4 + $5 * $5 + $6 * $6); print d < 0 ? -d : d }' >"$SCRATCH/worst"
compare "$(cat "$SCRATCH/worst")" '<' 0.2 'and is as far from the origin of the coordinates'

# ---- What is made of them ----------------------------------------------------------------------------

run distances "{\"surfaces\":[\"$A\",\"$M\",\"$OF_IMAGE\"],\"register\":false}"
is "$STATUS $(json '[.warnings[] | select(.code == "mirror-images")] | length')" '200 0' 'a left and mirrored right ones are of one side'
run distances "{\"surfaces\":[\"$LEFT\",\"$IMAGE\"],\"register\":false}"
is "$STATUS $(json '[.warnings[] | select(.code == "mirror-images")] | length')" '200 0' 'and so are their meshes'
run geodesic "{\"from\":\"$A\",\"to\":\"$M\",\"steps\":2,\"method\":\"linear\",\"register\":false}"
is "$STATUS $(json '[.surfaces[].mirrored] | tojson')" '200 [false,true]' 'a geodesic says which of its ends is an image'
is "$(json '[.surfaces[].frame.of] | tojson')" "[\"$A\",\"$A\"]" 'and that all of it is in the frame of the first'
like "$(json '.surfaces[1].frame.detail')" 'is not where its own mesh was' 'so that nobody takes the last one for where its mesh was'
run distances "{\"surfaces\":[\"$M\",\"$B\"],\"register\":false}"
PLAIN=$(json '.matrix[0][1]')
run mirror "{\"surface\":\"$A\"}"
MA=$(json .surface.id)
run distances "{\"surfaces\":[\"$A\",\"$B\"],\"register\":false}"
FAR=$(json '.matrix[0][1]')
run distances "{\"surfaces\":[\"$MA\",\"$M\"],\"register\":false}"
compare "$(json ".matrix[0][1] / $FAR - 1 | fabs")" '<' 1e-9 'images are as far from each other as what they show'
compare "$PLAIN" '>' 0.1 'and an image is apart from it'

# A new surface is of the side that the members of a model are of, or is another shape.
run pca "{\"surfaces\":[\"$A\",\"$M\"],\"register\":false}"
MODEL=$(json .model.id)
run project "{\"model\":\"$MODEL\",\"surface\":\"$B\"}"
is "$STATUS $(json '[.warnings[] | select(.code == "mirror-images") | .figures.second] | tojson')" '200 [0]' 'a right one among left ones is told'
like "$(json '.warnings[] | select(.code == "mirror-images") | .detail')" '^R_.* is the other side of .*L_' 'by both names'
run project "{\"model\":\"$MODEL\",\"surface\":\"$M\"}"
is "$STATUS $(json '[.warnings[] | select(.code == "mirror-images")] | length')" '200 0' 'its image is of their side'

# Maps go with the surface.
run geodesic "{\"from\":\"$A\",\"to\":\"$B\",\"steps\":3,\"method\":\"linear\",\"register\":false}"
MIDDLE=$(json '.surfaces[1].id')
run mirror "{\"surface\":\"$MIDDLE\"}"
is "$STATUS $(json .surface.mirrored)" '200 true' 'a surface on a path can be mirrored'
run mirror "{\"surface\":\"$LEFT\"}"
is "$STATUS $(json '[.surface.name, .surface.lmax, .surface.mirrored, .surface.source.mesh] | tojson')" \
    "200 [\"L_putamen\",31,true,\"$LEFT\"]" 'a mesh in the place of a surface is encoded first'

# ---- Refusals ----------------------------------------------------------------------------------------

run mirror '{}'
is "$STATUS $(json '.errors[0].pointer')" '422 /inputs/mesh' 'something must be given'
run mirror "{\"mesh\":\"$LEFT\",\"surface\":\"$A\"}"
is "$STATUS $(json '.errors[0].pointer')" '422 /inputs/mesh' 'and not both'
for plane in '"axial"' '[0,0,0]' '[1,2]' '{}' 'null' '[1e200,0,0]'; do
    run mirror "{\"mesh\":\"$LEFT\",\"plane\":$plane}"
    is "$STATUS $(json '.errors[0].pointer')" '422 /inputs/plane' "the plane $plane is none"
done
run mirror '{"mesh":"mesh-00000000000000000000000000000000"}'
is "$STATUS $(json .code)" '404 no-such-mesh' 'the mesh must be there'
curl -fsS -o /dev/null -X DELETE "$URL/v1/surfaces/$B" 2>/dev/null && not_ok 'what an image was made of stays' ||
    ok 'what an image was made of stays'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

#!/usr/bin/env bash
# test_mesh_export.sh - exported meshes: in the units and the place of what they came from or as they are stored, in
# each format, as Accept says; and uploaded meshes in another format.
# srnfd-test: no-asan (api/test_standard.sh and fuzz/test_api.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400

# Runs a process to its end, however long it takes.
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

# Bounding box of an OBJ file: the three least coordinates and the three largest.
box() { # FILE
    awk '$1 == "v" { for (k = 2; k <= 4; k++) { if (!n[k]++ || $k < lo[k]) lo[k] = $k; if (n[k] == 1 || $k > hi[k]) hi[k] = $k } }
        END { printf "%.9g %.9g %.9g %.9g %.9g %.9g\n", lo[2], lo[3], lo[4], hi[2], hi[3], hi[4] }' "$1"
}

# Largest difference of two boxes over the diagonal of the first.
apart() { # BOX BOX
    echo "$1 $2" | awk '{ for (k = 1; k <= 6; k++) { d = $k - $(k + 6); if (d < 0) d = -d; if (d > most) most = d }
        for (k = 1; k <= 3; k++) s += ($(k + 3) - $k)^2; printf "%.9g\n", most / sqrt(s) }'
}

export_box() { # SURFACE SPACE
    get "/v1/surfaces/$1/mesh?format=obj&resolution=24&space=$2"
    cp "$BODY" "$SCRATCH/$1.$2.obj"
    box "$BODY"
}

# The first ellipsoid, and a second that is turned about z and moved.
make_ellipsoid() { # FILE ANGLE DX DY DZ
    awk -v a="$2" -v dx="$3" -v dy="$4" -v dz="$5" 'BEGIN {
        pi = 3.14159265358979; n = 24; m = 36
        for (i = 0; i <= n; i++) for (j = 0; j < (i % n ? m : 1); j++) {
            t = pi * i / n; p = 2 * pi * j / m
            x = 30 * sin(t) * cos(p) + 2 * sin(t)^2 * cos(2 * p); y = 18 * sin(t) * sin(p); z = 12 * cos(t) + 3 * sin(t) * cos(p)
            printf "v %.9g %.9g %.9g\n", cos(a) * x - sin(a) * y + dx, sin(a) * x + cos(a) * y + dy, z + dz }
        for (j = 0; j < m; j++) print "f", 1, 2 + j, 2 + (j + 1) % m
        for (i = 1; i < n - 1; i++) for (j = 0; j < m; j++) {
            b = 2 + (i - 1) * m; print "f", b + j, b + m + j, b + m + (j + 1) % m, b + (j + 1) % m }
        b = 2 + (n - 2) * m; for (j = 0; j < m; j++) print "f", b + j, b + m, b + (j + 1) % m }' >"$1"
}

start_server "$SCRATCH/data" --workers 2 || exit 1
make_ellipsoid "$SCRATCH/first.obj" 0 100 -50 20
make_ellipsoid "$SCRATCH/second.obj" 0.6 -200 70 5
FIRST=$(box "$SCRATCH/first.obj")
SECOND=$(box "$SCRATCH/second.obj")
post '/v1/meshes?name=first' --data-binary "@$SCRATCH/first.obj"
is "$STATUS $(json .report.analysable)" '201 true' 'a mesh far from the origin is accepted'
MESH=$(json .id)
post '/v1/meshes?name=second' --data-binary "@$SCRATCH/second.obj"
MOVING=$(json .id)

# ---- Units and place ---------------------------------------------------------------------------------

run encode "{\"mesh\":\"$MESH\",\"lmax\":8}"
SURFACE=$(json .surface.id)
compare "$(apart "$FIRST" "$(export_box "$SURFACE" original)")" '<' 0.01 'in the original space it is where its mesh was'
compare "$(apart "$FIRST" "$(export_box "$SURFACE" normalized)")" '>' 1 'which a normalized one is not'
get "/v1/surfaces/$SURFACE/mesh?format=obj&resolution=24"
cmp -s "$BODY" "$SCRATCH/$SURFACE.normalized.obj"
is $? 0 'and which is what comes without space'
like "$(sed -n 1,4p "$SCRATCH/$SURFACE.original.obj" | tr '\n' ' ')" '# space: original .*place and orientation of the input' \
    'the file says so'
get "/v1/surfaces/$SURFACE/mesh?space=mni"
is_problem 422 invalid-input 'there are no other spaces'
run register "{\"template\":\"$SURFACE\",\"moving\":\"$MOVING\",\"degree\":4}"
REGISTERED=$(json .surface.id)
compare "$(apart "$SECOND" "$(export_box "$REGISTERED" original)")" '<' 0.02 \
    'a registered surface goes back to the place and the orientation of its own mesh'
run encode "{\"mesh\":\"$MOVING\",\"lmax\":8}"
run register "{\"template\":\"$REGISTERED\",\"moving\":\"$(json .surface.id)\",\"degree\":4}"
run register "{\"template\":\"$SURFACE\",\"moving\":\"$(json .surface.id)\",\"degree\":4}"
compare "$(apart "$SECOND" "$(export_box "$(json .surface.id)" original)")" '<' 0.03 'also one that was registered twice'
run geodesic "{\"from\":\"$SURFACE\",\"to\":\"$MOVING\",\"steps\":3,\"method\":\"linear\"}"
PATH_END=$(json '.surfaces[2].id')
PATH_MIDDLE=$(json '.surfaces[1].id')
compare "$(apart "$FIRST" "$(export_box "$PATH_MIDDLE" original)")" '<' 0.05 'a path lies where its first surface was'
run mean "{\"surfaces\":[\"$SURFACE\",\"$REGISTERED\"],\"register\":false}"
MEAN=$(json .surface.id)
like "$(export_box "$MEAN" original)" '^-[0-9]' 'a mean gets its units back, and stays around its centroid'
like "$(cat "$SCRATCH/$MEAN.original.obj" | head -4 | tail -1)" 'never had a place' 'and says that it has no place'
post_json /v1/surfaces "{\"scale\":\"unit-area\",\"coefficients\":$(curl -s "$URL/v1/surfaces/$MEAN/coefficients" |
    jq '.x[0] = 40 | .x |= map(. * 3) | .y |= map(. * 3) | .z |= map(. * 3)')}"
is "$STATUS" 201 'coefficients are sent'
GIVEN=$(json .id)
like "$(json '.origin[0] | round')" '^3[34]$' 'their place is kept'
note "$(export_box "$GIVEN" original)"
compare "$(export_box "$GIVEN" original | awk '{ print ($1 + $4) / 2 }')" '>' 30 'and they go back to it'

# ---- Formats -----------------------------------------------------------------------------------------

for format in ply obj stl vtk vtp gii glb; do
    get "/v1/surfaces/$PATH_END/mesh?format=$format&resolution=6&space=original"
    is "$STATUS" 200 "$format is written"
    like "$(LC_ALL=C tr -cd '[:print:]' <"$BODY" | head -c 3000)" \
        '([Ss]pace"?: ?"?original|CDATA\[original\]|Name="space" [^>]*>111 114 105 103 105 110 97 108 0)' 'and says its space'
done
tail -c +21 "$BODY" | head -c 3000 | LC_ALL=C sed 's/ *$//' >"$SCRATCH/json" # behind the header of GLB
like "$(LC_ALL=C tr -cd '[:print:]' <"$SCRATCH/json")" \
    '"fields":\{"_DEFORMATION":\{"name":"deformation","unit":"length","meaning":"distance to' 'GLB says what its maps are'
for pair in model/gltf-binary=glTF model/stl=bina application/ply=ply application/x-vtp='<?xm' model/gifti='<?xm'; do
    get "/v1/surfaces/$SURFACE/mesh?resolution=4" --header "Accept: ${pair%%=*};q=0.9, image/png, */*;q=0.1"
    is "$STATUS $(header Content-Type) $(head -c 4 "$BODY" | tr -d '\n')" "200 ${pair%%=*} ${pair#*=}" 'Accept is honoured'
done
get "/v1/surfaces/$SURFACE/mesh" --header 'Accept: model/gltf-binary;q=0, image/*'
is_problem 406 not-acceptable 'what is not served is not acceptable'
like "$(json .detail)" 'application/x-vtp.*\?format=' 'and what is served is named'

# ---- Uploaded meshes ---------------------------------------------------------------------------------

get "/v1/meshes/$MESH/content"
cmp -s "$BODY" "$SCRATCH/first.obj"
is $? 0 'without a format the bytes are those that were sent'
get "/v1/meshes/$MESH/content?format=glb"
is "$STATUS $(header Content-Type) $(head -c 4 "$BODY")" '200 model/gltf-binary glTF' 'a mesh can be had as GLB'
get "/v1/meshes/$MESH/content?format=obj"
compare "$(apart "$FIRST" "$(box "$BODY")")" '<' 1e-9 'in its own place and units'
for format in ply stl vtk vtp gii; do
    get "/v1/meshes/$MESH/content?format=$format"
    is "$STATUS" 200 "as $format, too"
done
get "/v1/meshes/$MESH/content?format=off"
is_problem 422 invalid-input 'in the formats that are written'
get "/v1/meshes/mesh-00000000000000000000000000000000/content?format=glb"
is_problem 404 no-such-mesh 'and where there is one'
done_testing

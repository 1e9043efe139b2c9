#!/usr/bin/env bash
# test_surfaces.sh - the surfaces resource: a surface given as coefficients, as a grid in JSON or as .npy comes
# back as it was, in every representation, and wrong ones are answered by name.
# srnfd-test: slow
#
# The surface is an ellipsoid of degree 4 whose points are known: f = (2 x, y, z / 2) on the unit sphere, off
# its centre by (0, 0, 3). Y_1m = sqrt(3 / 4 pi) (y, z, x), so that the coefficients are factors of
# sqrt(4 pi / 3), and those of a constant of sqrt(4 pi).

# jq's variables are not the shell's.
# shellcheck disable=SC2016

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" || exit 1

axis() { # INDEX VALUE INDEX VALUE: 25 coefficients, all 0 but two
    jq -nc --argjson i "$1" --argjson a "$2" --argjson j "$3" --argjson b "$4" \
        '[range(25)] | map(if . == $i then $a elif . == $j then $b else 0 end)'
}
X=$(axis 3 4.093306831785954 0 0)
Y=$(axis 1 2.046653415892977 0 0)
Z=$(axis 2 1.0233267079464885 0 10.634723105433096)
DIRECT="{\"name\":\"egg\",\"coefficients\":{\"lmax\":4,\"x\":$X,\"y\":$Y,\"z\":$Z}}"

# Largest absolute number of a jq expression over two files, $a[0] and $b[0].
largest() { # EXPRESSION FILE [FILE]
    jq -n --slurpfile a "$2" --slurpfile b "${3:-$2}" "[$1] | map(fabs) | max"
}

# ---- Given as coefficients -------------------------------------------------------------------------

post_json /v1/surfaces "$DIRECT"
is "$STATUS" 201 'a surface given as coefficients is accepted'
ID=$(json .id)
like "$ID" '^surf-[0-9a-f]{32}$' 'its id is a content address'
is "$(header Location)" "/v1/surfaces/$ID" 'Location names it'
is "$(json '"\(.name) \(.lmax) \(.scale) \(.parameterization)"')" 'egg 4 1 given' 'its record says how it came'
compare "$(json '(.volume - 4.1887902047863905) | fabs')" '<' 1e-12 'its volume is that of the ellipsoid'
compare "$(json '(.centroid[2] - 3) | fabs')" '<' 1e-12 'its centroid is kept'
AREA=$(json .area)
post_json /v1/surfaces "$DIRECT"
is "$STATUS $(json .id)" "200 $ID" 'the same content is the same resource'
get "/v1/surfaces/$ID"
is "$STATUS $(json .links.srnf)" "200 /v1/surfaces/$ID/srnf" 'its record is read back'
get "/v1/surfaces/$ID" --header "If-None-Match: $(header ETag)"
is "$STATUS" 304 'and has an entity tag'

get "/v1/surfaces/$ID/coefficients"
cp "$BODY" "$SCRATCH/coefficients.json"
is "$(json '[.lmax, .x, .y, .z] | tojson')" "$(jq -nc "[4, $X, $Y, $Z]" | jq -r tojson)" \
    'its coefficients are those that were sent, bit for bit'

# ---- Fields ----------------------------------------------------------------------------------------

get "/v1/surfaces/$ID/grid"
cp "$BODY" "$SCRATCH/grid.json"
is "$(json '"\(.nTheta) \(.nPhi) \(.theta | length) \(.phi | length) \(.values | length) \(.values[0] | length)"')" \
    '8 16 8 16 8 16' 'the grid is the working grid of the degree'
compare "$(json '((.weights | add) * .nPhi - 12.566370614359172) | fabs')" '<' 1e-13 'its weights sum to 4 pi'
compare "$(largest '$a[0] as $g | range($g.nTheta) as $i | range($g.nPhi) as $j |
        $g.values[$i][$j] as $p | $g.theta[$i] as $t | $g.phi[$j] as $u |
        ($p[0] - 2 * ($t | sin) * ($u | cos), $p[1] - ($t | sin) * ($u | sin), $p[2] - 3 - ($t | cos) / 2)' \
    "$SCRATCH/grid.json")" '<' 1e-13 'its values are the points of the ellipsoid'
get "/v1/surfaces/$ID/srnf?nTheta=40"
is "$(json '"\(.nTheta) \(.nPhi)"')" '40 80' 'another grid can be asked for'
get "/v1/surfaces/$ID/srnf"
compare "$(jq "([.weights, .values] | transpose | map(.[0] *
        (.[1] | map(map(. * .) | add) | add)) | add) - $AREA | fabs" "$BODY")" '<' 1e-12 \
    'the squared norm of the SRNF on the working grid is the area'
get "/v1/surfaces/$ID/grid?kind=equiangular&nTheta=9&nPhi=10"
compare "$(json '.theta[0], .theta[8] - 3.141592653589793, .values[0][3][2] - 3.5, .values[8][7][2] - 2.5 | fabs' |
    sort -g | tail -n 1)" '<' 1e-13 'an equiangular grid has the poles'

# ---- .npy -------------------------------------------------------------------------------------------

get "/v1/surfaces/$ID/grid" --header 'Accept: application/x-npy'
is "$STATUS $(header Content-Type)" '200 application/x-npy' 'Accept chooses .npy'
cp "$BODY" "$SCRATCH/grid.npy"
is "$(head -c 6 "$SCRATCH/grid.npy" | tail -c 5)" NUMPY 'it begins as .npy'
like "$(head -c 128 "$SCRATCH/grid.npy" | tr -d '\0')" "'shape': \(8, 16, 3\)" 'its shape is that of the grid'
is "$(tail -c +129 "$SCRATCH/grid.npy" | wc -c)" $((8 * 16 * 3 * 8)) 'and so is its size'
tail -c +129 "$SCRATCH/grid.npy" | od -An -v -t f8 -w8 | jq -s . >"$SCRATCH/npy.json"
compare "$(largest '[$a[0].values | flatten, $b[0]] | transpose[] | .[0] - .[1]' "$SCRATCH/grid.json" \
    "$SCRATCH/npy.json")" '<' 1e-14 'both representations hold the same numbers'
get "/v1/surfaces/$ID/coefficients?format=npy"
like "$(head -c 128 "$BODY" | tr -d '\0')" "'shape': \(3, 25\)" 'coefficients come as .npy too'
get "/v1/surfaces/$ID/grid" --header 'Accept: image/png'
is_problem 406 not-acceptable 'nothing else is served'

# ---- Given on a grid -------------------------------------------------------------------------------

# The distance of the last surface's coefficients from the first one's.
coefficients_error() {
    get "/v1/surfaces/$(json .id)/coefficients"
    largest '[$a[0] | .x, .y, .z | .[]] as $p | [$b[0] | .x, .y, .z | .[]] as $q | [$p, $q] | transpose[] |
        .[0] - .[1]' "$SCRATCH/coefficients.json" "$BODY"
}

post '/v1/surfaces?lmax=4&name=grid' --header 'Content-Type: application/x-npy' \
    --data-binary "@$SCRATCH/grid.npy"
like "$STATUS $(json .name)" '^20[01] (grid|egg)$' 'a .npy body is a surface'
compare "$(json '.fit.max')" '<' 1e-13 'which its degree fits to rounding'
compare "$(coefficients_error)" '<' 1e-13 'and which is the surface that it came from'

jq '{lmax: 4, grid: {kind: "gauss-legendre", nTheta, nPhi, xyz: .values}}' "$SCRATCH/grid.json" >"$SCRATCH/nested.json"
jq '.grid.xyz |= flatten' "$SCRATCH/nested.json" >"$SCRATCH/flat.json"
post_json /v1/surfaces "@$SCRATCH/nested.json"
NESTED=$(json .id)
compare "$(coefficients_error)" '<' 1e-13 'nested arrays are a surface'
post_json /v1/surfaces "@$SCRATCH/flat.json"
is "$STATUS $(json .id)" "200 $NESTED" 'flat ones are the same one'

get "/v1/surfaces/$ID/grid?kind=equiangular&nTheta=17"
jq '{lmax: 4, grid: {kind, nTheta, nPhi, xyz: .values}}' "$BODY" >"$SCRATCH/equiangular.json"
post_json /v1/surfaces "@$SCRATCH/equiangular.json"
compare "$(coefficients_error)" '<' 1e-13 'an equiangular grid is analysed as exactly'

post_json /v1/surfaces "$(jq -c '.scale = "unit-area"' <<<"$DIRECT")"
compare "$(json '(.area - 1 | fabs), (.centroid | map(fabs) | max)' | sort -g | tail -n 1)" '<' 1e-14 \
    'scale unit-area centres and scales'
compare "$(json ".scale * .scale - $AREA | fabs")" '<' 1e-12 'and the record keeps the scale'
UNIT=$(json .id)
get "/v1/surfaces/$UNIT/srnf?nTheta=48&format=npy"
is "$STATUS" 200 'the scaled surface has its own fields'

# ---- Normals inwards, and nothing inside -------------------------------------------------------------

# (x, y, z) -> (-x, y, z) turns the normals inwards; on a grid the columns in reverse order turn them back.
INSIDE=$(jq -c '.coefficients.x |= map(-.)' <<<"$DIRECT")
post_json /v1/surfaces "$INSIDE"
is_problem 422 surface-inside-out 'a surface of negative volume is refused'
like "$(json .detail)" 'volume is -4.18879.*columns of a grid in reverse order.*orientation any' 'with the ways out'
jq '.grid.xyz |= map(reverse)' "$SCRATCH/nested.json" >"$SCRATCH/turned.json"
post_json /v1/surfaces "@$SCRATCH/turned.json"
is_problem 422 surface-inside-out 'a grid whose columns run backwards is another'
post_json /v1/surfaces "$(jq -c '.coefficients |= with_entries(if .key == "lmax" then . else
    .value[1] |= -. | .value[4] |= -. end)' <<<"$INSIDE")"
is "$STATUS $(json '.volume > 4.18')" '201 true' 'signs changed for m < 0 it is a surface'
post_json /v1/surfaces "$(jq -c '.orientation = "any"' <<<"$INSIDE")"
is "$STATUS $(json '[.warnings[].code] | tojson')" '201 ["surface-inside-out"]' 'asked for, it is taken with a warning'
TURNED=$(json .id)
get "/v1/surfaces/$TURNED"
is "$(json '.warnings[0].figures.volume < -4.18')" true 'which its record keeps'
execute distances "{\"surfaces\":[\"$ID\",\"$TURNED\",\"$NESTED\"],\"register\":false}"
is "$STATUS $(json '[.warnings[] | select(.code == "surface-inside-out") | .figures | .surface, .count] | tojson')" \
    "200 [\"$TURNED\",1]" 'and every result of it tells'
execute distances "{\"surfaces\":[\"$ID\",\"$NESTED\"],\"register\":false}"
is "$(json '[.warnings[].code] | index("surface-inside-out")')" null 'others do not'
post_json /v1/surfaces "$(jq -c '.coefficients.z |= map(0)' <<<"$DIRECT")"
is "$STATUS $(json '[.warnings[].code] | tojson')" '201 ["surface-flat"]' 'a disc is taken with a warning'
execute distances "{\"surfaces\":[\"$ID\",\"$(json .id)\"],\"register\":false}"
is "$(json '[.warnings[].code] | index("surface-flat") != null')" true 'which its results repeat'

flat_mesh() { # HALF-THICKNESS of an octahedron
    printf 'OFF\n6 8 0\n1 0 0\n-1 0 0\n0 1 0\n0 -1 0\n0 0 %s\n0 0 -%s\n' "$1" "$1"
    printf '3 %s\n' '0 2 4' '2 1 4' '1 3 4' '3 0 4' '2 0 5' '1 2 5' '3 1 5' '0 3 5'
}
post '/v1/meshes?format=off' --data-binary "$(flat_mesh 0.001)"
is "$(json '[.report | .analysable, .warnings[0].code] | tojson')" '[true,"surface-flat"]' 'a flat mesh is told of in its report'
post '/v1/meshes?format=off' --data-binary "$(flat_mesh 0.1)"
is "$(json '[.report | .analysable, .warnings] | tojson')" '[true,null]' 'a thin one is not'

# ---- Triangles --------------------------------------------------------------------------------------

for format in ply obj stl vtk glb; do
    get "/v1/surfaces/$ID/mesh?format=$format&resolution=6"
    cp "$BODY" "$SCRATCH/mesh.$format"
    is "$STATUS" 200 "it is written as $format"
    if [ "$format" != glb ]; then
        post "/v1/meshes?format=$format" --data-binary "@$SCRATCH/mesh.$format"
        is "$(json '"\(.vertices) \(.faces) \(.report.analysable)"')" '362 720 true' \
            'and read back as a closed mesh of 10 r^2 + 2 vertices'
    fi
done
get "/v1/surfaces/$ID/mesh?resolution=6" --header 'Accept: text/plain, model/stl;q=0.5'
is "$STATUS $(header Content-Type)" '200 model/stl' 'Accept chooses a format, too'
cmp -s "$BODY" "$SCRATCH/mesh.stl"
is "$?" 0 'the same one'
get "/v1/surfaces/$ID/mesh?resolution=6" --header 'Accept: text/html, */*;q=0.1'
is "$STATUS $(header Content-Type)" '200 model/ply' 'whoever takes anything gets ply'
get "/v1/surfaces/$ID/mesh" --header 'Accept: image/png'
is_problem 406 not-acceptable 'what there is not is not acceptable'
get "/v1/surfaces/$ID/mesh?resolution=6&format=obj" --header 'Accept: image/png'
is "$STATUS" 200 'unless the query says what is wanted'
is "$(head -c 4 "$SCRATCH/mesh.glb")" glTF 'glb begins as it must'

# ---- Lists ------------------------------------------------------------------------------------------

for wrong in %201 +1 1x '' 201 0; do
    get "/v1/surfaces?limit=$wrong"
    is_problem 422 invalid-input "limit=$wrong is no number of items"
done
post_json '/v1/surfaces?lmax=5' "@$SCRATCH/nested.json"
is_problem 422 invalid-input 'options in the query of a JSON body are refused, not passed over'
is "$(json '.errors[0].pointer')" /lmax 'by their name'

get '/v1/surfaces?limit=2'
is "$(json '.items | length')" 2 'the list has pages'
FIRST=$(json '.items | map(.id) | join(" ")')
get "/v1/surfaces?limit=200&cursor=$(json .next)"
REST=$(json '.items | map(.id) | join(" ")')
is "$(tr ' ' '\n' <<<"$FIRST $REST" | sort | uniq -d | wc -l)" 0 'without repeats'
like " $FIRST $REST " " $ID " 'and without gaps'

# ---- Wrong ones --------------------------------------------------------------------------------------

wrong() { # JSON POINTER WHAT
    post_json /v1/surfaces "$1"
    if [ "$STATUS $(json .code)" = '422 invalid-input' ] &&
        jq -e --arg p "$2" 'any(.errors[]; .pointer == $p)' "$BODY" >/dev/null; then
        ok "refused with its pointer: $3"
    else
        not_ok "refused with its pointer: $3" "$STATUS $(head -c 300 "$BODY")"
    fi
}

wrong '{}' /grid 'neither coefficients nor grid'
wrong "$(jq -c '.more = 1' <<<"$DIRECT")" /more 'an unknown member'
wrong "$(jq -c '.coefficients.w = []' <<<"$DIRECT")" /coefficients/w 'an unknown coordinate'
wrong "$(jq -c '.coefficients.lmax = 3' <<<"$DIRECT")" /coefficients/lmax 'a degree below the limits'
wrong "$(jq -c '.coefficients.lmax = 128' <<<"$DIRECT")" /coefficients/lmax 'a degree above the limits'
wrong "$(jq -c '.coefficients.y[7] = "x"' <<<"$DIRECT")" /coefficients/y 'a word among the numbers'
wrong "$(jq -c 'del(.coefficients.z[24])' <<<"$DIRECT")" /coefficients/z 'a number too few'
wrong "$(jq -c '.scale = "metres"' <<<"$DIRECT")" /scale 'an unknown scale'
wrong "$(jq -c '.orientation = "left"' <<<"$DIRECT")" /orientation 'an unknown orientation'
wrong "$(jq -c '.coefficients |= (.x |= map(0) | .y |= map(0) | .z |= map(0))' <<<"$DIRECT")" /coefficients 'no area'
wrong "$(jq -c '.grid.kind = "hexagonal"' "$SCRATCH/flat.json")" /grid/kind 'an unknown grid'
wrong "$(jq -c '.grid.nTheta = 1e9' "$SCRATCH/flat.json")" /grid/nTheta 'a grid beyond the limit'
wrong "$(jq -c '.lmax = 8' "$SCRATCH/flat.json")" /lmax 'a degree that the grid does not resolve'
wrong "$(jq -c '.grid.xyz[5] = null' "$SCRATCH/flat.json")" /grid/xyz 'a hole among the values'
head -c 1000 "$SCRATCH/grid.npy" >"$SCRATCH/cut.npy"
post /v1/surfaces --header 'Content-Type: application/x-npy' --data-binary "@$SCRATCH/cut.npy"
is_problem 422 invalid-input 'a .npy body that is cut short is refused'
like "$(json .detail)" '384 numbers of 8 bytes, but 872 bytes' 'with what is missing'
is "$(json '.errors[0].pointer')" /grid/xyz 'and where'
get /v1/surfaces/surf-00000000000000000000000000000000/grid
is_problem 404 no-such-surface 'an unknown surface is not found'
get "/v1/surfaces/$ID/grid?nTheta=4"
is_problem 422 invalid-input 'a grid below the degree is refused'
get "/v1/surfaces/$ID/grid?nTheta=512&format=json"
like "$STATUS $(json .detail)" '422 .*300000 numbers' 'a JSON answer has a limit, which is named'
get "/v1/surfaces/$ID/grid?nTheta=512&format=npy"
is "$STATUS" 200 '.npy goes further'
get "/v1/surfaces/$ID/mesh?format=dxf"
is_problem 422 invalid-input 'an unknown format of triangles is refused'
get "/v1/surfaces/$ID/mesh?resolution=101"
like "$STATUS $(json .detail)" '422 .*from 1 to 100' 'so is a resolution beyond the limit, which is named'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

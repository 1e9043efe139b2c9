#!/usr/bin/env bash
# test_repair.sh - the process repair: a fault each, mended or refused with the reason, with what was changed and where,
# and the distance; the mesh that comes out can be encoded, and a sound one is left as it is.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

# A box of n x n squares on each side as OFF, in one piece by equal points. FAULT is one of: none, hole (two
# faces missing), flipped (four faces turned), island (a tetrahedron beside it), sheet (four faces twice, 1e-7 off), noise
# (every face with vertices of its own, 1e-6 off), handle (a square tunnel through it).
make_mesh() { # FAULT
    awk -v fault="$1" '
    function corner(x, y, z) {
        off = fault == "noise" ? 1e-6 * (rand() - .5) : 0
        point[n_points] = x + off " " y + off " " z - off
        return n_points++
    }
    function face(a, b, c) { faces[n_faces++] = "3 " a " " b " " c }
    function square(k, s, u, v,    i, j, p, q) { # on side s of axis k, between u, v and u + 1, v + 1
        for (i = 0; i < 2; i++) for (j = 0; j < 2; j++) {
            p[k] = s * n; p[(k + 1) % 3] = u + i; p[(k + 2) % 3] = v + j
            q[i, j] = corner(p[0], p[1], p[2])
        }
        quad(q[0, 0], q[1, 0], q[1, 1], q[0, 1], s)
    }
    function quad(a, b, c, d, outward) {
        if (outward) { face(a, b, c); face(a, c, d) } else { face(a, c, b); face(a, d, c) }
    }
    BEGIN {
        srand(1); n = 6; n_points = n_faces = 0
        for (k = 0; k < 3; k++) for (s = 0; s < 2; s++) for (u = 0; u < n; u++) for (v = 0; v < n; v++) {
            middle = k == 2 && (u == 2 || u == 3) && (v == 2 || v == 3)
            if (fault == "hole" && k == 0 && s == 0 && u == 2 && v == 2) continue
            if (fault == "handle" && middle) continue
            square(k, s, u, v)
        }
        if (fault == "handle") for (z = 0; z < n; z++) for (t = 2; t < 4; t++) {
            quad(corner(2, t, z), corner(2, t + 1, z), corner(2, t + 1, z + 1), corner(2, t, z + 1), 1)
            quad(corner(4, t, z), corner(4, t + 1, z), corner(4, t + 1, z + 1), corner(4, t, z + 1), 0)
            quad(corner(t, 2, z), corner(t + 1, 2, z), corner(t + 1, 2, z + 1), corner(t, 2, z + 1), 0)
            quad(corner(t, 4, z), corner(t + 1, 4, z), corner(t + 1, 4, z + 1), corner(t, 4, z + 1), 1)
        }
        if (fault == "flipped") for (f = 20; f < 24; f++) { split(faces[f], c, " "); faces[f] = "3 " c[2] " " c[4] " " c[3] }
        if (fault == "sheet") for (f = 20; f < 24; f++) {
            split(faces[f], c, " ")
            for (i = 2; i < 5; i++) { split(point[c[i]], p, " "); c[i] = corner(p[1] + 1e-7, p[2], p[3]) }
            face(c[2], c[3], c[4])
        }
        if (fault == "island") {
            a = corner(20, 0, 0); b = corner(21, 0, 0); c1 = corner(20, 1, 0); d = corner(20, 0, 1)
            face(a, c1, b); face(a, b, d); face(a, d, c1); face(b, c1, d)
        }
        print "OFF"; print n_points, n_faces, 0
        for (i = 0; i < n_points; i++) print point[i]
        for (i = 0; i < n_faces; i++) print faces[i]
    }' >"$SCRATCH/$1.off"
}

upload() { # FAULT; sets MESH
    make_mesh "$1"
    post "/v1/meshes?name=$1" --data-binary "@$SCRATCH/$1.off"
    MESH=$(json .id)
    PROBLEM=$(json '.report.problems[0].code // "none"')
    DETAIL=$(json '.report.problems[0].detail // "none"')
}

repair() { # OPTIONS, JSON members
    execute repair "{\"mesh\":\"$MESH\"${1:+,$1}}" --header 'Prefer: wait=100'
}

change() { # MEMBER-OF-FIRST-CHANGE
    json "(.changes[] | select(.code == \"$1\")) | $2"
}

ALL='"orient":true,"islands":true,"duplicates":true,"degenerate":true,"merge":1e-4,"holes":10'

start_server "$SCRATCH/data" --workers 2 || exit 1

upload none
repair "$ALL,\"handles\":32"
is "$STATUS $PROBLEM $(json '[.changes, .refused] | tojson')" '200 none [[],[]]' 'nothing is changed on a sound mesh'
is "$(json .mesh.id) $(json .mesh.name)" "$MESH none" 'and the result is its own record'
is "$(json_in_order '.distance | tojson')" '{"rms":0,"max":0}' 'at distance 0'

upload hole
like "$PROBLEM: $DETAIL" 'mesh-not-closed: .*holes' 'the problem of a hole names the repair'
repair '"holes":5'
is "$STATUS $(json .mesh.report.analysable)" '200 true' 'a hole is closed'
is "$(change holes-closed '[.count, .element, .position] | tojson')" '[1,"face",[0,2.5,2.5]]' 'and located'
compare "$(json .distance.max)" '<' 0.51 'and the distance is at most half its width'
compare "$(json .distance.rms)" '>' 0 'and above 0'
is "$(json .mesh.source.process) $(json .mesh.source.mesh) $(json .mesh.name)" "repair $MESH hole" 'the record says what it came from'
isnt "$(json .mesh.id)" "$MESH" 'and is another mesh'
execute encode "{\"mesh\":\"$(json .mesh.id)\",\"lmax\":6}" --header 'Prefer: wait=100'
is "$STATUS" 200 'which can be encoded'
repair '"holes":3'
is "$(json '[.changes, .mesh.id] | tojson') $(json '.refused[0].code')" "[[],\"$MESH\"] hole-too-long" \
    'a hole of more than the perimeter is refused'
like "$(json '.refused[0].detail')" 'perimeter of 4, more than the 3 asked for' 'with the reason'

upload flipped
like "$PROBLEM: $DETAIL" 'mesh-not-oriented: .*repair: orient' 'the problem of turned faces names the repair'
repair '"orient":true'
is "$(json .mesh.report.analysable) $(change faces-turned '[.count, .first] | tojson')" 'true [4,20]' \
    'a flipped patch is turned'
compare "$(json .distance.max)" '<' 1e-14 'and nothing moves'

upload island
like "$DETAIL" 'repair: islands' 'the problem of an island names the repair'
repair '"islands":true'
is "$(json .mesh.report.analysable) $(change islands-removed '[.count, .first] | tojson')" 'true [1,432]' \
    'an island is removed'
compare "$(json .distance.max)" '>' 10 'and was far away'

upload sheet
isnt "$PROBLEM" none 'a sheet on the surface is a problem'
repair '"duplicates":true,"merge":1e-5'
is "$(json .mesh.report.analysable) $(change duplicate-faces-dropped .count)" 'true 4' 'a duplicate sheet is dropped'
compare "$(json .distance.max)" '<' 2e-7 'and was near'

upload noise
like "$DETAIL" 'merge' 'the problem of noise names the repair'
repair '"merge":1e-4'
is "$(json .mesh.report.analysable) $(json .mesh.vertices) $(change near-vertices-merged .element)" 'true 218 vertex' \
    'split vertices with noise are merged'
compare "$(json .distance.max)" '<' 2e-6 'by as much as the noise'

upload handle
like "$PROBLEM: $DETAIL" 'not-genus-zero: .*repair: handles' 'the problem of a handle names the repair'
repair '"handles":30'
is "$STATUS $(json .mesh.report.genus) $(json .mesh.report.analysable)" '200 0 true' 'a handle is mended by voxels'
note "$(json '.changes | tojson')" "$(json '.distance | tojson')"
is "$(json '.changes[0].code') $(json '[.changes[1].code | . == "handle-cut" or . == "tunnel-filled"] | tojson')" \
    'made-anew-from-voxels [true]' 'and the result says so, and what was done to it'
is "$(json '.changes[0] | [.element, .first, .position] | tojson')" '[null,null,null]' 'everywhere'
compare "$(json '.changes[1].position | max')" '<' 6.5 'and where'
compare "$(json '.changes[1].count')" '>' 0 'with voxels'
compare "$(json '.distance.max')" '<' 4 'and the distance'
repair "$ALL"
is "$(json '[.changes, .mesh.id] | tojson')" "[[],\"$MESH\"]" 'without handles nothing is changed'

upload hole
repair '"handles":32'
is "$(json '.refused[0].code') $(json .mesh.id)" "handles-in-doubt $MESH" 'handles of an open mesh are refused'
repair '"handles":7'
is_problem 422 invalid-input 'too few voxels are refused'
repair '"holes":-1'
is_problem 422 invalid-input 'a perimeter is not negative'
repair '"merge":1000'
is "$STATUS" 422 'a tolerance beyond the mesh leaves nothing'
note "$(json .detail)"
execute repair '{"mesh":"surf-00000000000000000000000000000000"}'
is_problem 422 invalid-input 'a surface is no mesh'
execute repair '{"mesh":"mesh-00000000000000000000000000000000","orient":true}'
is_problem 404 no-such-mesh 'a mesh that is not there'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

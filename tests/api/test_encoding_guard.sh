#!/usr/bin/env bash
# test_encoding_guard.sh - meshes as marching cubes writes them, and encodings that are poor or another shape,
# end to end: repairs are counted, warnings stand in results and records, whichever process encodes.

# jq's variables are not the shell's.
# shellcheck disable=SC2016

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" || exit 1

# ---- Points that are several vertices --------------------------------------------------------------

post '/v1/meshes?name=bent' --data-binary @tests/data/marching_cubes/bent-160-flying-edges.ply
BENT=$(json .id)
is "$(json '.report.analysable')" true 'a surface with vertices on each other is analysable'
is "$(json '[.report.repairs[] | "\(.code) \(.count)"] | join(", ")')" \
    'duplicate-vertices-merged 196, collapsed-faces-dropped 392' 'and its report counts what was merged'
get "/v1/meshes/$BENT/content"
cmp -s "$BODY" tests/data/marching_cubes/bent-160-flying-edges.ply
is "$?" 0 'its content is what was sent'
execute encode "{\"mesh\":\"$BENT\"}"
is "$STATUS" 200 'it is encoded'
compare "$(json '.surface | .volume * .scale * .scale * .scale / 980.863 - 1 | fabs')" '<' 0.005 \
    'with the volume that its faces enclose'
compare "$(json .fit.relativeToDiagonal.rms)" '<' 0.003 'and near it'
compare "$(json '(.surface | .volume * .scale * .scale * .scale / 980.863) - 1 - .fit.volumeDifference | fabs')" '<' 1e-5 \
    'the fit says by what part the volume differs'
is "$(json '.fit == .surface.fit and (.fit.areaDifference | fabs) < 0.05')" true 'and the area, as does the record'
is "$(json '"\(.warnings | length) \(.surface.warnings | length)"')" '0 0' 'without a warning'

# ---- A mesh and its sphere -------------------------------------------------------------------------

# An octahedron of which every face has its own vertices, and a sphere that says where they go.
octahedron() { # X Y Z (half axes)
    local a b c f=0
    for a in 1 -1; do
        for b in 1 -1; do
            for c in 1 -1; do
                printf 'v %s 0 0\nv 0 %s 0\nv 0 0 %s\n' "$((a * $1))" "$((b * $2))" "$((c * $3))"
                if [ $((a * b * c)) -gt 0 ]; then
                    printf 'f %d %d %d\n' $((f + 1)) $((f + 2)) $((f + 3))
                else
                    printf 'f %d %d %d\n' $((f + 1)) $((f + 3)) $((f + 2))
                fi
                f=$((f + 3))
            done
        done
    done
}
octahedron 3 2 1 >"$SCRATCH/soup.obj"
octahedron 5 5 5 >"$SCRATCH/sphere.obj"
post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/soup.obj"
SOUP=$(json .id)
is "$(json '"\(.vertices) \(.faces) \(.report.analysable)"')" '6 8 true' 'a soup of triangles is one surface'
post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/sphere.obj"
execute encode "{\"mesh\":\"$SOUP\",\"lmax\":8,\"parameterization\":\"given\",\"sphere\":\"$(json .id)\"}"
is "$STATUS $(json .route)" '200 given' 'and its sphere is merged with it'

# ---- Poor, and another shape -----------------------------------------------------------------------

# A tetrahedron at a degree that cannot have its corners, and a needle from its middle.
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' >"$SCRATCH/tetrahedron.obj"
octahedron 1 1 90 >"$SCRATCH/needle.obj"
post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/tetrahedron.obj"
TETRAHEDRON=$(json .id)
execute encode "{\"mesh\":\"$TETRAHEDRON\",\"lmax\":4,\"parameterization\":\"star\"}"
is "$STATUS $(json '.warnings[0].code')" '200 encoding-poor' 'a poor encoding is an answer with a warning'
is "$(json '.warnings == .surface.warnings')" true 'which stands in the record of the surface, too'
is "$(json '.warnings[0].figures | [keys[]] | join(" ")')" 'area energy fit lmax max mesh volume' 'with its figures'
compare "$(json '.warnings[0].figures.fit - .fit.relativeToDiagonal.rms | fabs')" '<' 1e-12 'that are those of the fit'
get "/v1/surfaces/$(json .surface.id)"
is "$(json '.warnings[0].code')" encoding-poor 'and is read back with it'

post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/needle.obj"
NEEDLE=$(json .id)
execute encode "{\"mesh\":\"$NEEDLE\",\"lmax\":8,\"parameterization\":\"star\"}"
is_problem 422 encoding-unfaithful 'what is another shape than its mesh is no answer'
like "$(json .detail)" 'times its volume' 'and the problem has the figures'

# Damping takes away volume, which was asked for, but is said.
execute encode "{\"mesh\":\"$BENT\",\"lmax\":8,\"smoothing\":0.1}"
is "$STATUS $(json '.warnings[0].code')" '200 encoding-poor' 'a surface that smoothing took far from its mesh is poor'

# Coordinates in single precision, far from the origin: steps of half an edge.
awk 'BEGIN { f = "%s" } /^v / { printf "v %d %d %d\n", $2 * 2 + 16777216, $3 * 2, $4 * 2; next } { print }' \
    "$SCRATCH/tetrahedron.obj" >"$SCRATCH/far.obj"
post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/far.obj"
is "$(json '.report | "\(.analysable) \(.warnings[0].code)"')" 'true coordinates-coarse' \
    'a mesh whose coordinates are coarse is told at its upload'
compare "$(json '.report.warnings[0].figures.coarseness')" '>' 0.5 'with the figure'
execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":8}"
like "$(json '[.warnings[].code] | join(" ")')" coordinates-coarse 'and in what is computed from it'

# A file that says how to bring its points into another space, where they would be mirrored and smaller.
gifti() { # HEIGHT: a tetrahedron
    printf '<GIFTI><DataArray Intent="NIFTI_INTENT_POINTSET" DataType="NIFTI_TYPE_FLOAT32" Encoding="ASCII" '
    printf 'Dim0="4" Dim1="3"><CoordinateSystemTransformMatrix><MatrixData>-.1 0 0 0 0 .1 0 0 0 0 .1 0 0 0 0 1'
    printf '</MatrixData></CoordinateSystemTransformMatrix><Data>0 0 0 1 0 0 0 1 0 0 0 %s</Data></DataArray>' "$1"
    printf '<DataArray Intent="NIFTI_INTENT_TRIANGLE" DataType="NIFTI_TYPE_INT32" Encoding="ASCII" Dim0="4" '
    printf 'Dim1="3"><Data>0 2 1 0 1 3 1 2 3 0 3 2</Data></DataArray></GIFTI>'
}
untransformed() { # [OF]
    json "[${1-}.warnings[] | select(.code == \"transform-not-applied\") | .figures | \"\(.count) \(.mesh)\"] | join(\" \")"
}
mkdir "$SCRATCH/turned"
gifti 1 >"$SCRATCH/turned/a.gii"
gifti 2 >"$SCRATCH/turned/b.gii"
cp "$SCRATCH/tetrahedron.obj" "$SCRATCH/turned"
(cd "$SCRATCH/turned" && zip -q ../turned.zip ./*)
post '/v1/imports' --data-binary "@$SCRATCH/turned.zip" --header 'Content-Type: application/zip'
read -r TURNED AGAIN <<<"$(json '[.meshes[] | select(.format == "gii") | .id] | join(" ")')"
is "$(untransformed)" "2 $TURNED" 'a transform that was not applied is told at an import'
get "/v1/meshes/$TURNED"
is "$(untransformed .report)" 'null null' 'and in the report of the mesh'
for time in first second; do
    execute encode "{\"mesh\":\"$TURNED\",\"lmax\":6}"
    is "$STATUS $(untransformed) $(untransformed .surface)" "200 1 $TURNED 1 $TURNED" \
        "and in what is computed from it, the $time time"
done
execute distances "{\"surfaces\":[\"$AGAIN\",\"$TURNED\"],\"lmax\":6,\"metric\":\"harmonic\"}"
is "$(untransformed)" "2 $(printf '%s\n' "$TURNED" "$AGAIN" | sort | head -n 1)" 'whichever process encodes'
execute mirror "{\"mesh\":\"$TURNED\"}"
is "$(untransformed)" "1 $TURNED" 'and where the mesh itself is changed'

# Where another process encodes the mesh, the doubt is that process's.
post '/v1/meshes' --data-binary @tests/data/aal_subcortex/L_thalamus.ply
GOOD=$(json .id)
execute geodesic "{\"from\":\"$TETRAHEDRON\",\"to\":\"$GOOD\",\"steps\":2,\"register\":false}"
is "$STATUS" 200 'a process that encodes by itself goes on'
is "$(json '[.warnings[] | select(.code == "encoding-poor") | .figures.mesh] | join(" ")')" "$TETRAHEDRON" \
    'and says which mesh is not what it should be'

# And where the encoding stands for a surface by another route, it is said for which.
execute encode "{\"mesh\":\"$TETRAHEDRON\",\"lmax\":4,\"parameterization\":\"star\"}"
STAR=$(json .surface.id)
execute distances "{\"surfaces\":[\"$STAR\",\"$GOOD\"],\"mixedRoutes\":true,\"metric\":\"harmonic\"}"
is "$(json '[.bridged, (.warnings[] | select(.code == "encoding-poor") | .figures.mesh, .figures.standsFor)] | tojson')" \
    "[true,\"$TETRAHEDRON\",\"$STAR\"]" 'the doubt of an encoding that bridges routes names what it stands for'

done_testing

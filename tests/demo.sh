#!/usr/bin/env bash
# demo.sh - the main job on real meshes, through the daemon: `make demo` builds and then runs this.
#
# Starts srnfd on a free port of the loopback with a temporary data folder, uploads the twelve subcortical
# structures of tests/data/aal_subcortex, encodes them at degree 31, inverts the SRNFs of some from the unit
# sphere, and joins the two thalami by a geodesic of seven surfaces, which it writes to
# build/demo as PLY and GLB. Prints what it did; stops the daemon; fails if any step failed.
#
# The surface error is computed here, not by the service: the L2 norm of the difference between the
# coefficients of the encoded surface and of the inverted one, both at area 1, translations left out.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/support/lib.sh"

LMAX=31
STEPS=7
OUT=$SRNFD_BUILD/demo
MESHES=tests/data/aal_subcortex
SECONDS=0

fail() { # TEXT
    printf 'demo: %s\n' "$1" >&2
    head -c 1000 "$BODY" >&2
    exit 1
}

want() { # STATUS WHAT
    [ "$STATUS" = "$1" ] || fail "$2 was answered $STATUS:"
}

# Milliseconds that the last request took, by the server's own clock.
server_ms() {
    header Server-Timing | sed -n 's/.*dur=\([0-9.]*\).*/\1/p'
}

# What the paper reports for a structure with 200 harmonics (relative energy after inversion).
reported() { # NAME
    case $1 in
    *_thalamus) echo 9.0e-4 ;;
    *_pallidum) echo 6.9e-4 ;;
    *) echo - ;;
    esac
}

# L2 distance between two coefficient documents without their l = 0 terms.
distance() { # FILE FILE
    jq -n --slurpfile a "$1" --slurpfile b "$2" '
        [("x", "y", "z") as $k | [$a[0][$k][1:], $b[0][$k][1:]] | transpose[] | (.[0] - .[1]) | . * .]
        | add | sqrt'
}

rule() {
    printf '%.0s-' $(seq 1 82)
    printf '\n'
}

declare -A MESH SURFACE ROUTE

upload_all() {
    local file name verdict
    printf 'Twelve subcortical structures (AAL atlas), uploaded as PLY. The pre-flight check says:\n\n'
    printf '  %-14s %6s %6s %10s %10s  %s\n' structure vertices faces area volume verdict
    for file in "$MESHES"/*.ply; do
        name=$(basename "$file" .ply)
        post "/v1/meshes?format=ply&name=$name" --data-binary "@$file"
        want 201 "the upload of $name"
        MESH[$name]=$(json .id)
        verdict=$(json 'if .report.starShaped.value then
                "star-shaped; its centre sees \(.report.starShaped.margin * 100 | round / 100) mm around"
            elif .report.starShaped then "not star-shaped: \(.report.starShaped.violatingAreaFraction * 1000
                | round / 10) % of its area is seen from behind at best"
            else .report.problems[0] | .code + ": " + .detail end')
        printf '  %-14s %6s %6s %10s %10s  %s\n' "$name" "$(json .vertices)" "$(json .faces)" \
            "$(json '.report.area | round')" "$(json '.report.volume | round')" "$verdict"
    done
}

encode_all() {
    local name faces
    printf '\nAll of them encoded at degree %d, area 1, by area, which maps the surface to the sphere with little\n' "$LMAX"
    printf 'distortion, whether or not a centre sees the whole of it:\n'
    printf 'E is the symmetric Dirichlet energy / 4 pi (4: none), sd the spread of the log area ratio.\n\n'
    printf '  %-14s %6s  %-5s %7s %6s %6s %9s %9s %9s\n' structure faces route E sd flips 'fit %' 'max %' 'encode s'
    for name in $(printf '%s\n' "${!MESH[@]}" | sort); do
        get "/v1/meshes/${MESH[$name]}"
        faces=$(json .faces)
        execute encode "{\"mesh\":\"${MESH[$name]}\",\"lmax\":$LMAX}" || fail "encode of $name"
        want 200 "encode of $name"
        SURFACE[$name]=$(json .surface.id)
        ROUTE[$name]=$(json .route)
        printf '  %-14s %6d  %-5s %7.3f %6.3f %6d %9.3f %9.3f %9.2f\n' "$name" "$faces" "${ROUTE[$name]}" \
            "$(json .distortion.symmetricDirichlet)" "$(json .distortion.logAreaDeviation)" \
            "$(json .distortion.flipped)" "$(json '.fit.relativeToDiagonal.rms * 100')" \
            "$(json '.fit.relativeToDiagonal.max * 100')" "$(server_ms | awk '{ print $1 / 1000 }')"
    done
}

round_trip() { # NAME
    local name=$1 invert_ms relative inverted error
    execute invert "{\"srnf\":{\"surface\":\"${SURFACE[$name]}\"},\"initial\":\"sphere\"}"
    want 200 "inversion of $name"
    invert_ms=$(server_ms)
    relative=$(json .relativeEnergy)
    inverted=$(json .surface.id)
    get "/v1/surfaces/${SURFACE[$name]}/coefficients"
    cp "$BODY" "$SCRATCH/encoded.json"
    get "/v1/surfaces/$inverted/coefficients"
    cp "$BODY" "$SCRATCH/inverted.json"
    error=$(distance "$SCRATCH/encoded.json" "$SCRATCH/inverted.json") || fail "error of $name"
    awk -v name="$name" -v route="${ROUTE[$name]}" -v r="$relative" -v d="$error" \
        -v paper="$(reported "$name")" -v b="$invert_ms" 'BEGIN {
        printf "  %-14s %-5s %10.1e %11.1e %9s %9.2f\n", name, route, r, d, paper, b / 1000 }'
}

invert_all() {
    local name
    printf '\nSRNFs inverted from the unit sphere (method auto): thalami and pallida, which are star-shaped, and two that\n'
    printf 'are not. Seconds\n'
    printf 'are of the server'"'"'s clock, request to answer. "paper" is the energy that Xie et al. (ECCV 2014) report\n'
    printf 'for the structure, with 200 harmonics.\n\n'
    printf '  %-14s %-5s %10s %11s %9s %9s\n' structure route 'relative E' 'surf. error' paper 'invert s'
    for name in $(printf '%s\n' "${!MESH[@]}" | sort); do
        case $name in
        *_thalamus | *_pallidum | L_caudate | L_hippocampus) round_trip "$name" ;;
        esac
    done
}

geodesic() {
    local ms i=0 id format
    execute geodesic "{\"from\":\"${SURFACE[L_thalamus]}\",\"to\":\"${SURFACE[R_thalamus]}\",\"steps\":$STEPS,\"register\":false}"
    want 200 'the geodesic'
    ms=$(server_ms)
    cp "$BODY" "$SCRATCH/geodesic.json"
    printf '\nGeodesic from the left thalamus to the right one, %d surfaces, as they are parameterized\n' "$STEPS"
    awk -v ms="$ms" -v d="$(json .distance)" -v l="$(json .length)" 'BEGIN {
        printf "(distance %.4f, length %.4f, %.2f s). Squared distance from the straight line in the space\n",
            d, l, ms / 1000 }'
    printf 'of SRNFs, relative to its squared norm:\n\n'
    printf '  %6s %12s %12s %12s\n' t geodesic linear 'closed form'
    jq -r '.times as $t | .relativeEnergies | [$t, .geodesic, .linear, (.closedForm // [])] | transpose[] | @tsv' \
        "$SCRATCH/geodesic.json" |
        awk -F '\t' '{ printf "  %6.3f %12.1e %12.1e %12s\n", $1, $2, $3, ($4 == "" ? "none" : sprintf("%.1e", $4)) }'
    if [ "$(json .energies.closedForm)" = null ]; then
        printf '\nThe closed form is for star-shaped surfaces in their radial parameterization, which these are not in.\n'
    fi
    for id in $(jq -r '.surfaces[].id' "$SCRATCH/geodesic.json"); do
        i=$((i + 1))
        for format in ply glb; do
            get "/v1/surfaces/$id/mesh?format=$format"
            want 200 "surface $i as $format"
            cp "$BODY" "$OUT/thalamus-$i.$format"
        done
    done
    printf '\n%d surfaces written to %s as PLY and GLB, with the deformation from the first at each vertex.\n' \
        "$i" "${OUT#"$ROOT"/}"
}

mkdir -p "$OUT" || exit 1
start_server "$SCRATCH/data" || exit 1
printf 'srnfd listens on %s; its data are in a temporary folder.\n\n' "${URL#http://}"
upload_all
encode_all
invert_all
geodesic
stop_server "$SERVER_PID" || fail 'the daemon did not stop'
rule
printf 'All of it took %d s; the daemon is stopped.\n' "$SECONDS"

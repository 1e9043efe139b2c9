#!/usr/bin/env bash
# srnfd-test: slow
# srnfd-test: release-only
#
# test_likeness.sh - groups of which members repeat, are unlike the others, mirrored or turned: variants of a caudate,
# and a thalamus among them.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400

run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

# The warnings of a code in the last body, or none.
warned() { # CODE
    json "[.warnings[] | select(.code == \"$1\")]"
}

count() { # CODE
    warned "$1" | jq length
}

encode() { # MESH LMAX [SCALE]
    run encode "{\"mesh\":\"$1\",\"lmax\":$2,\"parameterization\":\"area\",\"scale\":\"${3:-unit-area}\"}"
    json .surface.id
}

start_server "$SCRATCH/data" --workers 2 || exit 1
post '/v1/meshes?name=thalamus' --data-binary @tests/data/aal_subcortex/L_thalamus.ply
THALAMUS=$(encode "$(json .id)" 4)

# Variants of a caudate, sent as coefficients. jq: seed, size of the change, order of the axes.
post '/v1/meshes?name=caudate' --data-binary @tests/data/aal_subcortex/L_caudate.ply
BASE=$(encode "$(json .id)" 4)
curl -s "$URL/v1/surfaces/$BASE/coefficients?format=json" >"$SCRATCH/base.json"
variant() { # SEED NOISE [AXES]
    jq -c --argjson s "$1" --argjson noise "$2" --argjson axes "${3:-[0,1,2]}" \
        '[.x, .y, .z] as $c |
        def noise($p; $q; $r; $k; $a): ($p * $s + $q * $k + $r * $a | sin) * 43758.5 | . - floor - 0.5;
        [$axes[] as $a | [range($c[$a] | length) as $k | $c[$a][$k] + (if $k == 0 then 0 else 1 end) / (1 + $k) *
            (0.1 * noise(127.1; 311.7; 74.7; $k; $a) + $noise * noise(269.5; 183.3; 246.1; $k; $a))]] as $f |
        {name: "case \($s) \($noise)", coefficients: {lmax, x: $f[0], y: $f[1], z: $f[2]}}' \
        "$SCRATCH/base.json" >"$SCRATCH/variant.json"
    request POST /v1/surfaces --header 'Content-Type: application/json' --data-binary "@$SCRATCH/variant.json"
    json .id
}
CASE=()
AGAIN=()
TURNED=()
for seed in 1 2 3 4 5 6 7 8 9 10; do
    CASE+=("$(variant $seed 0)")
done
for seed in 1 2 6; do
    AGAIN+=("$(variant $seed 0.005)")
done
for seed in 6 7 8 9 10; do
    TURNED+=("$(variant $seed 0 '[1,2,0]')")
done
# The first five of label ctl, the others pat; a member that begins with - is mirrored.
group() { # NAME ID..
    local name=$1 out='' label id count=0
    shift
    for id in "$@"; do
        label=$([ $count -lt 5 ] && echo ctl || echo pat)
        count=$((count + 1))
        out="$out,{\"id\":\"${id#-}\",\"label\":\"$label\",\"mirror\":$([ "${id#-}" = "$id" ] && echo false || echo true)}"
    done
    post_json /v1/cohorts "{\"name\":\"$name\",\"members\":[${out#,}]}"
}
doubts() { # of the last body
    json '[.warnings[].code | select(IN("near-duplicates", "far-from-group", "mirror-images", "pose-differs"))] | unique | join(" ")'
}
group plain "${CASE[@]}"
group again "${CASE[@]}" "${AGAIN[@]}"
group foreign "${CASE[@]:0:9}" "$THALAMUS"
group one "${CASE[@]:0:9}" "-${CASE[9]}"
group half "${CASE[@]:0:5}" "${CASE[@]/#/-}"
group turned "${CASE[@]:0:5}" "${TURNED[@]}"
FEW='"maxIterations":3'
run compare-groups "{\"cohort\":\"plain\",$FEW}"
is "$STATUS $(doubts)" '200 ' 'members that belong together are not doubted'
for process in mean pca evaluate-model distances; do
    MORE=$([ "$process" = evaluate-model ] && echo ',"samples":20')
    run "$process" "{\"cohort\":\"plain\",\"register\":false$MORE}"
    is "$STATUS $(doubts)" '200 ' "$process: nor as they are parameterized"
done
for process in mean compare-groups distances; do
    run "$process" "{\"cohort\":\"again\",\"register\":false}"
    is "$STATUS $(doubts)" '200 near-duplicates' "$process: members that repeat are"
    is "$(warned near-duplicates | jq '.[0].figures.pairs')" 3 'and counted'
done
for process in pca compare-groups; do
    run "$process" "{\"cohort\":\"foreign\",$FEW}"
    is "$STATUS $(doubts) $(warned far-from-group | jq '.[0].figures.member')" '200 far-from-group 9' \
        "$process: a member of another structure is unlike the others"
done
run mean "{\"cohort\":\"one\",$FEW}"
is "$STATUS $(doubts) $(warned mirror-images | jq '.[0].figures.second')" '200 mirror-images 9' 'a mirrored member is found out'
COPY=$(variant 3 0)
group copied "${CASE[@]}" "-$COPY"
run mean "{\"cohort\":\"copied\",$FEW}"
is "$(warned mirror-images | jq -c '[.[].figures | [.first, .second, .mirrored < 0.01]]')" '[[2,10,true]]' \
    'of a mirrored copy it is said whose'
run compare-groups "{\"cohort\":\"half\",$FEW}"
is "$STATUS $(doubts)" '200 mirror-images' 'so is a mirrored group'
like "$(warned mirror-images | jq -r '.[-1].detail')" '^The group pat looks like a mirror image' 'by its label'
run compare-groups '{"cohort":"turned","register":false}'
like "$(warned pose-differs | jq -r '.[-1].detail')" 'the group pat lies in another pose than the group ctl' \
    'groups in two poses are told, where nothing is rotated'
run classify '{"cohort":"half","method":"harmonic-nn"}'
like "$(doubts)" mirror-images 'classify tells of a mirrored group too'

# ---- Maps to the sphere that are turned --------------------------------------------------------------

# An ellipsoid with axes 3, 2 and 1 + STRETCH, its sphere turned by so many degrees under it.
ellipsoid() { # STRETCH DEGREES
    post_json /v1/surfaces "$(jq -nc --argjson s "$1" --argjson degrees "$2" '
        ($degrees * 3.14159265358979 / 180) as $t | ($t | cos) as $c | ($t | sin) as $n |
        def row(v; x; y; z): [range(25) | if . == 3 then v * x elif . == 1 then v * y elif . == 2 then v * z else 0 end];
        {coefficients: {lmax: 4, x: row(3; $c; -$n; 0), y: row(2; $n; $c; 0), z: row(1 + $s; 0; 0; 1)}}')"
    json .id
}
# NAME STEP DEGREES: seven whose last axes differ by so much, and one like the first, its sphere turned.
turned_sphere() {
    local even=() k
    for k in 1 2 3 4 5 6 7; do
        even+=("$(ellipsoid "$(jq -n "$k * $2")" 0)")
    done
    group "$1" "${even[@]}" "$(ellipsoid "$(jq -n "1.1 * $2")" "$3")"
}
turned_sphere alike 0.02 60
turned_sphere unlike 0.25 32
FOUND='[.[].figures.members[]? | [.member, .sphereAlone]]'
for cohort in alike unlike; do
    run mean "{\"cohort\":\"$cohort\",\"register\":false}"
    is "$STATUS $(warned pose-differs | jq -c "$FOUND")" '200 [[7,true]]' "$cohort: a map to the sphere that is turned is found out"
done
# Warps turn the sphere back but for what their penalty keeps, which counts beside small differences only.
run mean '{"cohort":"alike","commonPose":true}'
is "$STATUS $(warned pose-differs | jq -c "$FOUND")" '200 [[7,true]]' 'where warps do not undo it it is told'
compare "$(warned pose-differs | jq '[.[].figures.members[]?.distance][0]')" '<' 0.5 'by the distance that they leave'
run pca '{"cohort":"unlike","commonPose":true}'
is "$STATUS $(warned pose-differs | jq -c "$FOUND")" '200 []' 'where they do it is not'

# ---- Pairs and few, as they are parameterized --------------------------------------------------------

like_turned() { # NAME: the last result tells of one that is turned by 120 degrees, as the axes are
    is "$STATUS $(doubts)" '200 pose-differs' "$1: a surface beside itself turned is told of"
    compare "$(warned pose-differs | jq '[.[0].figures | (.members[0] // .)][0] | .turned / .distance')" '<' 0.01 \
        'turned back it is the same'
}
SAME="${CASE[5]}"
OTHER="${TURNED[0]}"
run distances "{\"surfaces\":[\"$SAME\",\"$OTHER\"],\"register\":false}"
like_turned 'distances of two'
run distances "{\"surfaces\":[\"${CASE[0]}\",\"$SAME\",\"${CASE[1]}\",\"$OTHER\"],\"register\":false}"
is "$(doubts) $(warned pose-differs | jq -c '[.[].figures.members[].member]')" 'pose-differs [3]' 'one of four is found out'
run distances "{\"surfaces\":[\"$SAME\",\"$OTHER\"]}"
is "$STATUS $(doubts)" '200 ' 'registered it is not doubted'
for process in distances mean; do
    run "$process" "{\"surfaces\":[\"${CASE[0]}\",\"${CASE[1]}\",\"${CASE[2]}\"],\"register\":false}"
    is "$STATUS $(doubts)" '200 ' "$process: nor are three that share a pose"
done
run mean "{\"surfaces\":[\"$SAME\",\"$OTHER\"],\"register\":false}"
like_turned 'mean of two'
AS_THEY_ARE='"register":false'
run geodesic "{\"from\":\"$SAME\",\"to\":\"$OTHER\",\"steps\":3,$AS_THEY_ARE}"
like_turned geodesic
run geodesic "{\"from\":\"${CASE[0]}\",\"to\":\"${CASE[1]}\",\"steps\":3,$AS_THEY_ARE}"
is "$STATUS $(doubts)" '200 ' 'two that share a pose are not'
run shoot "{\"surface\":\"$SAME\",\"velocity\":{\"toward\":\"$OTHER\"},\"times\":[0.1],$AS_THEY_ARE}"
like_turned shoot
run transport "{\"from\":\"$SAME\",\"to\":\"$OTHER\",\"vector\":{\"toward\":\"${CASE[6]}\"},$AS_THEY_ARE}"
like_turned transport
run transfer "{\"source\":\"$SAME\",\"deformed\":\"${CASE[6]}\",\"target\":\"$OTHER\",$AS_THEY_ARE}"
like_turned transfer
like "$(warned pose-differs | jq -r '.[0].detail')" 'source and target are .* apart as they lie' 'by the names of the two'

done_testing

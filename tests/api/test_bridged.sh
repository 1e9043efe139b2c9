#!/usr/bin/env bash
# test_bridged.sh - groups whose members came by star and by area, where mixedRoutes allows it: members by star are
# compared by the encodings of their meshes by area, so that the numbers are those of a group by area, to the last
# digit, also after kill -9; what cannot be encoded again is told.
# srnfd-test: release-only
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
FAST='"metric":"harmonic"' # registered all the same, by rotations
start_server "$SCRATCH/data" --workers 2 || exit 1

encode() { # MESH OPTIONS: sets ID
    execute encode "{\"mesh\":\"$1\",\"lmax\":$LMAX,$2}"
    ID=$(json .surface.id)
}
warned() { # the figures of the warning, or nothing
    json_in_order '.warnings[] | select(.code == "mixed-routes") | .figures | tojson'
}
by() { # ROUTE INDEX..: their ids as members of an array
    local -n ids=$1
    local text='' k
    for k in "${@:2}"; do
        text="$text,\"${ids[k]}\""
    done
    printf '%s' "${text#,}"
}

declare -a MESHES AREA STAR
for name in L_pallidum R_pallidum L_thalamus R_thalamus L_amygdala R_amygdala; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESHES+=("$(json .id)")
    encode "${MESHES[-1]}" '"parameterization":"area"'
    AREA+=("$ID")
    encode "${MESHES[-1]}" '"parameterization":"star"'
    STAR+=("$ID") # null for the last, which is not star-shaped
done

# ---- distances -----------------------------------------------------------------------------------------

execute distances "{\"surfaces\":[$(by AREA 0 1 2)],$FAST}"
ALIKE=$(json '.matrix | tojson')
is "$(json '[.bridged, .bridgedSurfaces] | tojson')" '[false,[]]' 'a group by one route is not bridged'
execute distances "{\"surfaces\":[$(by STAR 0),$(by AREA 1 2)],\"mixedRoutes\":true,$FAST}"
is "$(json '.matrix | tojson')" "$ALIKE" 'a member by star has the distances of its mesh by area'
is "$(json '[.bridged, .bridgedSurfaces] | tojson')" "[true,[$(by STAR 0)]]" 'which the result tells'
is "$(warned)" '' 'without a warning'
execute distances "{\"surfaces\":[$(by STAR 0 1),$(by AREA 2)],\"mixedRoutes\":true,$FAST}"
is "$(json '.matrix | tojson')" "$ALIKE" 'two members by star are near each other by area too'
execute distances "{\"surfaces\":[$(by STAR 0),\"${MESHES[1]}\",$(by AREA 2)],\"mixedRoutes\":true,\"register\":false}"
is "$(json '[.bridged, .bridgedSurfaces] | tojson')" '[false,[]]' 'as parameterized, they are taken as they are'
is "$(warned)" '{"star":1,"area":2,"given":0,"unknown":0,"bridged":0}' 'with the warning'
execute distances "{\"surfaces\":[$(by STAR 0 1 2)],$FAST}"
is "$(json .bridged) $(warned)" 'false ' 'members that are all by star stay so'

# What encode was asked for is asked for again: mirrored, smoothed, in the units of the mesh.
for options in '"mirror":true' '"smoothing":0.001' '"scale":"none"'; do
    encode "${MESHES[3]}" "$options,\"parameterization\":\"area\""
    one=$ID
    encode "${MESHES[3]}" "$options,\"parameterization\":\"star\""
    execute distances "{\"surfaces\":[\"$one\",$(by AREA 2)],$FAST}"
    same=$(json '.matrix | tojson')
    execute distances "{\"surfaces\":[\"$ID\",$(by AREA 2)],\"mixedRoutes\":true,$FAST}"
    is "$(json '.matrix | tojson') $(warned)" "$same " "also with $options"
done

# ---- groups --------------------------------------------------------------------------------------------

cohort() { # NAME ID..: two labels, the last but one mirrored
    local members='' k=0 id
    for id in "${@:2}"; do
        members="$members,{\"id\":\"$id\",\"label\":\"$((k % 2))\",\"mirror\":$([ "$k" = 4 ] && echo true || echo false)}"
        k=$((k + 1))
    done
    post_json /v1/cohorts "{\"name\":\"$1\",\"members\":[${members#,}]}"
}
cohort alike "${AREA[@]}"
cohort mixed "${STAR[0]}" "${AREA[@]:1:3}" "${STAR[4]}" "${AREA[5]}"
group() { # PROCESS JQ OPTIONS WHAT
    local alike
    execute "$1" "{\"cohort\":\"alike\"$3}" --header 'Prefer: wait=100'
    alike=$(json "$2")
    execute "$1" "{\"cohort\":\"mixed\",\"mixedRoutes\":true$3}" --header 'Prefer: wait=100'
    is "$STATUS $(json "$2")" "200 $alike" "$1: $4"
    is "$(json '.bridgedSurfaces | tojson') $(warned)" "[\"${STAR[0]}\",\"${STAR[4]}\"] " 'without a warning'
}
group mean '[.surface.id, .surface.route, .distances] | tojson' ',"commonPose":true,"maxIterations":2' 'the mean is the same surface'
if [ -z "$SRNFD_SANITIZED" ]; then
    group compare-groups '[.pValue, .surface.id] | tojson' ',"commonPose":true,"maxIterations":2,"permutations":20' 'so is the map of a comparison'
    group classify '.methods | map_values(.perSubject | map(.nearestDistances)) | tojson' \
        ',"method":["harmonic-nn"]' 'so are the neighbours of a classification'
else
    skip 'the other processes on groups' 'slow under a sanitizer'
fi

# ---- what cannot be bridged ------------------------------------------------------------------------------

execute invert "{\"srnf\":{\"surface\":\"${STAR[4]}\"}}"
LOOSE=$(json .surface.id)
is "$(json .surface.route)" star 'a surface by star whose mesh is not known'
execute distances "{\"surfaces\":[$(by AREA 1),$(by STAR 0),\"$LOOSE\"],\"mixedRoutes\":true,$FAST}"
is "$STATUS $(json '[.bridged, .bridgedSurfaces] | tojson')" "200 [true,[$(by STAR 0)]]" \
    'is taken as it is'
is "$(warned)" '{"star":1,"area":2,"given":0,"unknown":0,"bridged":1}' 'and warned of, it alone'
like "$(json '.warnings[] | select(.code == "mixed-routes") | .detail')" "1 by star .$LOOSE" 'by its name'

# ---- kill -9 -------------------------------------------------------------------------------------------

# The first checkpoint comes after a second. With two workers the job is nearly done then; one has half of it to do.
if [ -z "$SRNFD_SANITIZED" ]; then
    GROUP="{\"surfaces\":[$(by STAR 0 2 4),$(by AREA 1 3)],\"mixedRoutes\":true}"
    stop_server
    start_server "$SCRATCH/data" --workers 1 || exit 1
    execute distances "$GROUP" --header 'Prefer: respond-async'
    JOB=$(json .id)
    for _ in $(seq 6000); do
        grep -qE "\"job-(checkpoint|successful|failed)\".*$JOB" "$SERVER_LOG" && break
        sleep 0.02
    done
    get "/v1/jobs/$JOB"
    is "$(json '.status, (.progress | real > 0 and . < 100)' | tr '\n' ' ')" 'running true ' \
        'distances that are bridged tell of their progress'
    kill_server
    start_server "$SCRATCH/data" --workers 2 || exit 1
    poll_job "$JOB" 400
    is "$JOB_STATUS $(json .attempt)" 'successful 2' 'and go on after kill -9'
    # 24 bytes for each pair, 32 around them
    resumed=$(jq -Rr 'fromjson? | select(.event == "job-resumed") | .detail' "$SERVER_LOG")
    compare "$(((${resumed%% *} - 32) / 24))" '>=' 1 'from the pairs that were kept'
    get "/v1/jobs/$JOB/results"
    RESUMED=$(json '.matrix | tojson')
    execute distances "{\"surfaces\":[$(by AREA 0 2 4 1 3)]}" --header 'Prefer: wait=100'
    is "$RESUMED" "$(json '.matrix | tojson')" 'to the same numbers'
else
    skip 'distances are killed' 'slow under a sanitizer'
fi

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing

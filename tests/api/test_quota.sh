#!/usr/bin/env bash
# srnfd-test: timeout 600
# Ways to fill a quota of bytes, each by an owner of its own and until it is refused: the owner never holds more than it
# may, not for a moment, the refusal names the quota, and what was there stays. Run by test_quota_ways.sh with
# SRNFD_QUOTA_WAYS=all it tries a hundred.
# srnfd-test: once (what is counted does not depend on the build)
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

ALL=${SRNFD_QUOTA_WAYS-}
DATA=$SCRATCH/data
QUOTA=30000
STEPS=30 # at most, of one way

start_server "$DATA" --workers 2 --quota-requests 0 --access-log refusals || exit 1
held() { # OWNER
    sqlite3 -readonly "$DATA/srnfd.db" ".timeout 5000" "SELECT bytes FROM owner WHERE name = '$1'"
}

# Three surfaces of degree 5 as their coefficients, which each owner sends for itself.
for side in L_thalamus R_thalamus L_caudate; do
    post /v1/meshes --data-binary "@tests/data/aal_subcortex/$side.ply"
    execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":5,\"parameterization\":\"area\"}"
    get "/v1/surfaces/$(json .surface.id)/coefficients"
    jq -c '{coefficients: {lmax, x, y, z}}' "$BODY" >"$SCRATCH/$side.json"
done
"$SRNFD" token add --data "$DATA" --name someone >/dev/null 2>&1
LONG_NAME=$(printf 'n%.0s' {1..250})
LABEL=$(printf 'l%.0s' {1..200})

# ---- The ways ------------------------------------------------------------------------------------------------

# A request of the owner; what it answers is looked at by the caller.
own() { # METHOD PATH [CURL ARGUMENTS..]
    request "$@" --header "Authorization: Bearer $TOKEN"
}
tetrahedron() { # FORMAT NUMBER
    case $1 in
    ply)
        printf 'ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n'
        printf 'element face 4\nproperty list uchar int vertex_indices\nend_header\n'
        printf '0 0 0\n%d 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n' "$2"
        ;;
    off) printf 'OFF\n4 4 0\n0 0 0\n%d 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n' "$2" ;;
    obj) printf 'v 0 0 0\nv %d 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n' "$2" ;;
    vtk)
        printf '# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n'
        printf '0 0 0\n%d 0 0\n0 1 0\n0 0 1\nPOLYGONS 4 16\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n' "$2"
        ;;
    esac
}
mesh() { # NUMBER FORMAT NAME
    tetrahedron "$2" $(($1 + 1)) >"$SCRATCH/send-$1"
    own POST "/v1/meshes?format=$2&name=$3" --data-binary "@$SCRATCH/send-$1"
}
surface() { # NUMBER DEGREE SCALE NAME
    jq -c --argjson n "$1" --argjson l "$2" --arg scale "$3" --arg name "$4" \
        '(($l + 1) * ($l + 1)) as $count | (.coefficients.lmax = $l)
         | .coefficients |= with_entries(if .key == "lmax" then . else .value |=
            ([.[] * (1 + $n / 100)] + [range($count)] | .[:$count] | to_entries
             | map(if .key < 36 then .value else 0 end)) end)
         | .scale = $scale | .name = $name' "$SCRATCH/L_caudate.json" >"$SCRATCH/send-$1"
    own POST /v1/surfaces --header 'Content-Type: application/json' --data-binary "@$SCRATCH/send-$1"
}
cohort() { # NUMBER MEMBERS LABEL COVARIATES
    jq -nc --arg name "c$1" --arg id "$A" --argjson m "$2" --arg text "$3" --argjson k "$4" \
        '{name: $name, members: [range($m) | {id: $id, label: $text,
          covariates: ([range($k) | {key: "covariate-\(.)", value: $text}] | from_entries)}]}' >"$SCRATCH/send-$1"
    own POST /v1/cohorts --header 'Content-Type: application/json' --data-binary "@$SCRATCH/send-$1"
}
job() { # NUMBER PROCESS INPUTS [CURL ARGUMENTS..]: A, B, C are the surfaces, N the number
    local n=$1 process=$2 inputs=$3
    shift 3
    inputs=${inputs//\"A\"/\"$A\"}
    inputs=${inputs//\"B\"/\"$B\"}
    inputs=${inputs//\"C\"/\"$C\"}
    own POST "/v1/processes/$process/execution" --header 'Content-Type: application/json' \
        --header 'Prefer: respond-async' --data-binary "{\"inputs\":${inputs//N/$n}}" "$@"
}
keyed() { # NUMBER PROCESS INPUTS: with a long key of its own
    job "$@" --header "Idempotency-Key: $1-${LABEL:0:190}"
}
# Four at once.
together() { # NUMBER COMMAND ARGUMENTS..
    local n=$1 i pids=()
    shift
    for i in 1 2 3 4; do
        (
            BODY=$SCRATCH/body-$i HEADERS=$SCRATCH/headers-$i
            "$1" $((4 * n + i)) "${@:2}"
            printf '%s' "$STATUS" >"$SCRATCH/code-$i"
        ) &
        pids+=("$!")
    done
    wait "${pids[@]}"
    STATUS=201
    for i in 1 2 3 4; do
        [ "$(cat "$SCRATCH/code-$i")" = 507 ] && STATUS=507 && cp "$SCRATCH/body-$i" "$BODY"
    done
}
removed() { # NUMBER COMMAND ARGUMENTS..: a job that is removed again makes room for the next, but its surfaces stay
    local id
    "$2" "$1" "${@:3}"
    id=$(json .id)
    [ "$STATUS" = 201 ] || return 0
    settle
    own DELETE "/v1/jobs/$id"
    STATUS=201
}

# Waits until the owner has no job that has not ended; notes whether one failed for want of room.
settle() {
    local open=1 tries=0
    while [ "$open" -gt 0 ] && [ "$tries" -lt 600 ]; do
        look
        open=$(sqlite3 -readonly "$DATA/srnfd.db" ".timeout 5000" \
            "SELECT count(*) FROM job WHERE owner = '$OWNER' AND status IN ('accepted', 'running')")
        [ "$open" -gt 0 ] && sleep 0.05
        tries=$((tries + 1))
    done
    detail=$(sqlite3 -readonly "$DATA/srnfd.db" ".timeout 5000" \
        "SELECT problem_detail FROM job WHERE owner = '$OWNER' AND problem_code = 'storage-quota-exceeded' LIMIT 1")
    [ -n "$detail" ] && refusal="a job: $detail"
}
most=0
look() {
    local now
    now=$(held "$OWNER")
    [ "${now:-0}" -gt "$most" ] && most=$now
}

WAY=0
way() { # COMMAND ARGUMENTS..
    WAY=$((WAY + 1))
    OWNER=owner$WAY
    TOKEN=$("$SRNFD" token add --data "$DATA" --name "$OWNER" --max-bytes "$QUOTA" 2>/dev/null)
    local n refusal='' name="$*" detail='' base=() side
    most=0
    for side in L_thalamus R_thalamus L_caudate; do
        own POST /v1/surfaces --header 'Content-Type: application/json' --data-binary "@$SCRATCH/$side.json"
        base+=("$(json .id)")
    done
    A=${base[0]} B=${base[1]} C=${base[2]}
    for ((n = 1; n <= STEPS; n++)); do
        "$1" "$n" "${@:2}"
        case $STATUS in
        507) refusal="$(json '.code + " " + .quota + " " + (.limit | tostring)')" ;;
        200 | 201) ;;
        *) refusal="$STATUS $(json .code) $(json '.errors[0].detail')" ;;
        esac
        look
        [ -n "$refusal" ] && break
        case $name in *job* | *keyed*) settle ;; esac
        [ -n "$refusal" ] && break
    done
    settle
    name=${name//$LONG_NAME/long}
    name=${name//$LABEL/label}
    like "$refusal" "(storage-quota-exceeded bytes $QUOTA|The quota .bytes. has no room)" "$WAY $name: is refused for its quota"
    compare "$most" '<=' "$QUOTA" "$WAY: never above it"
    own GET "/v1/surfaces/$A/coefficients"
    is "$STATUS" 200 "$WAY: and what was there stays"
}

# ---- A few of each -------------------------------------------------------------------------------------------

GEODESIC='{"from":"A","to":"B","steps":N,"register":false,"method":"linear"}'
way mesh ply "$LONG_NAME"
way surface 8 none ''
way cohort 10 "$LABEL" 0
way cohort 1 a 64
way job geodesic "${GEODESIC/N/1N}"
way together job geodesic "${GEODESIC/N/1N}"
way keyed distances '{"surfaces":["A","B","C"],"register":false}'
way removed job geodesic "${GEODESIC/N/1N}"
way job mean '{"surfaces":["A","B","C"],"register":false,"tolerance":0.00N}'

if [ "$ALL" = all ]; then
    for format in ply off obj vtk; do
        for name in '' "$LONG_NAME"; do
            way mesh "$format" "$name"
            way together mesh "$format" "$name"
        done
    done
    for degree in 5 6 8 10; do
        for scale in none unit-area; do
            way surface "$degree" "$scale" "$LONG_NAME"
        done
        way together surface "$degree" none ''
    done
    for members in 1 3 10 12; do
        for label in a "$LABEL"; do
            for covariates in 0 8; do
                way cohort "$members" "$label" "$covariates"
            done
        done
        way together cohort "$members" a 0
    done
    while read -r process inputs; do
        for how in job keyed 'together job' 'together keyed' 'removed job'; do
            case "$how $process" in removed*invert | removed*mean) continue ;; esac # too small to fill it
            # shellcheck disable=SC2086 # two words
            way $how "$process" "$inputs"
        done
    done <<'JOBS'
geodesic {"from":"A","to":"B","steps":1N,"register":false,"method":"srnf"}
geodesic {"from":"B","to":"C","steps":1N,"register":false,"method":"closed-form"}
geodesic {"from":"A","to":"C","steps":1N,"register":false,"method":"linear"}
shoot {"surface":"A","velocity":{"toward":"B"},"times":[0.0N,0.1N,0.2N,0.3N,0.4N]}
shoot {"surface":"B","velocity":{"toward":"C"},"times":[0.0N,0.1N,0.2N,0.3N],"method":"pullback"}
invert {"srnf":{"surface":"A"},"lmax":4,"maxIterations":10N,"tolerance":1e-3}
register {"template":"A","moving":"B","degree":4,"rotation":true,"penalty":{"jacobian":0.0N,"displacement":0.001}}
mean {"surfaces":["A","B","C"],"register":false,"tolerance":0.00N}
pca {"surfaces":["A","B","C"],"register":false,"tolerance":0.00N}
JOBS
    way keyed transfer '{"source":"A","deformed":"B","target":"C","register":false}'
    way keyed transport '{"from":"A","to":"B","vector":{"toward":"C"}}'
    for metric in srnf harmonic srm icp; do
        way keyed distances "{\"surfaces\":[\"A\",\"B\",\"C\"],\"register\":false,\"metric\":\"$metric\"}"
    done
fi
note "$WAY ways"

# What is on the disk is what was counted: all owners together, and rows that are not packed.
sqlite3 "$DATA/srnfd.db" 'PRAGMA wal_checkpoint(TRUNCATE)' >/dev/null
on_disk=$(($(stat -c %s "$DATA/srnfd.db") + $(find "$DATA/blobs" -type f -printf '%s\n' | awk '{ s += $1 } END { print s + 0 }')))
compare "$on_disk" '<' $((WAY * QUOTA + (2 << 20))) 'all of them have no more on the disk than their quotas, and the first meshes'
stop_server || not_ok 'the server ends well'
done_testing

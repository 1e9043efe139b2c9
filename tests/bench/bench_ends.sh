#!/usr/bin/env bash
# bench_ends.sh - how long jobs go on after they were told to stop: all processes at degree 127, each cancelled several
# times at moments drawn at random; from the cancellation to the end by the server's log, the median and the longest.
# Fails where a job takes longer than SRNFD_ENDS_LIMIT.
#
#   SRNFD_ENDS_LIMIT=5000   milliseconds: 1000 are promised on an idle machine    SRNFD_ENDS_ROUNDS=3
#   SRNFD_ENDS_LATEST=20    seconds after which a job is cancelled at the latest  SRNFD_ENDS_SEED=1

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LIMIT=${SRNFD_ENDS_LIMIT:-5000}
ROUNDS=${SRNFD_ENDS_ROUNDS:-3}
LATEST=${SRNFD_ENDS_LATEST:-20}
RANDOM=${SRNFD_ENDS_SEED:-1}
LMAX=${SRNFD_ENDS_LMAX:-127}
NAMES='amygdala caudate hippocampus pallidum putamen thalamus'

run() { # PROCESS INPUTS: waits for the end, however long that takes
    execute "$1" "$2" --header 'Prefer: respond-async'
    local id
    id=$(json .id)
    poll_job "$id" 1200
    get "/v1/jobs/$id/results"
}

# Milliseconds from the cancellation of a job to its end; nothing where it had ended before.
lag() { # ID
    jq -Rrn --arg id "$1" '
        def ms: (.[0:19] + "Z" | fromdateiso8601) * 1000 + (.[20:23] | tonumber);
        [inputs | fromjson? | objects | select(.job == $id)] as $lines |
        [$lines[] | select(.event == "job-cancel-requested") | .ts | ms][0] as $from |
        [$lines[] | select(.event == "job-dismissed") | .ts | ms][0] as $to |
        if $from and $to then $to - $from else empty end' "$SERVER_LOG"
}

start_server "$SCRATCH/data" --workers 2 || exit 1
MEMBERS=
PARTS=
BOTH=
S=()
MESH=
for side in L R; do
    for name in $NAMES; do
        post "/v1/meshes?name=${side}_$name" --data-binary "@tests/data/aal_subcortex/${side}_$name.ply"
        MESH=$(json .id)
        run encode "{\"mesh\":\"$MESH\",\"lmax\":$LMAX}"
        S+=("$(json .surface.id)")
        MEMBERS="$MEMBERS,{\"id\":\"${S[-1]}\",\"label\":\"$side\"}"
        PARTS="$PARTS,{\"id\":\"${S[-1]}\",\"subject\":\"$side\",\"covariates\":{\"part\":\"$name\"}}"
        HAND=$([ "$side" = L ] && echo left || echo right)
        BOTH="$BOTH,{\"id\":\"${S[-1]}\",\"subject\":\"$name\",\"side\":\"$HAND\",\"time\":$([ "$side" = L ] && echo 0 || echo 1)}"
    done
done
# Twelve subjects of two labels, of two structures each.
LABELLED=
for i in "${!S[@]}"; do
    for part in 0 1; do
        LABELLED="$LABELLED,{\"id\":\"${S[(i + part) % ${#S[@]}]}\",\"subject\":\"s$i\",\"label\":\"$((i % 2))\",\"covariates\":{\"part\":\"p$part\"}}"
    done
done
post_json /v1/cohorts "{\"name\":\"labelled\",\"members\":[${LABELLED#,}]}"
post_json /v1/cohorts "{\"name\":\"sides\",\"members\":[${MEMBERS#,}]}"
post_json /v1/cohorts "{\"name\":\"parts\",\"members\":[${PARTS#,}]}"
post_json /v1/cohorts "{\"name\":\"pairs\",\"members\":[${BOTH#,}]}"
run pca '{"cohort":"sides","register":false}'
M=$(json .model.id)
run train '{"cohort":"labelled","method":"srnf-nn","lmax":15}'
T=$(json .model.id)
A=${S[0]} B=${S[5]} C=${S[11]}
AS_THEY_ARE='"register":false'

# A segmentation of 16.8 million voxels, half of them of one label.
python3 - >"$SCRATCH/ball.nrrd" <<'END'
import sys
N = 256
sys.stdout.buffer.write((f'NRRD0004\ntype: uint8\ndimension: 3\nsizes: {N} {N} {N}\nencoding: raw\n'
                         'space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n\n').encode())
for z in range(N):
    for y in range(N):
        left = (0.49 * N) ** 2 - (y - N / 2) ** 2 - (z - N / 2) ** 2
        half = int(left ** 0.5) if left > 0 else 0
        row = bytearray(N)
        row[N // 2 - half:N // 2 + half] = b'\1' * (2 * half)
        sys.stdout.buffer.write(row)
END
post /v1/volumes --data-binary "@$SCRATCH/ball.nrrd"
VOLUME=$(json .id)

worst=0
printf '%-28s %8s %8s   ms from cancellation to end, of %d\n' process median longest "$ROUNDS"
while read -r name process inputs; do
    lags=()
    for _ in $(seq "$ROUNDS"); do
        execute "$process" "$inputs" --header 'Prefer: respond-async'
        id=$(json .id)
        [ -n "$id" ] || exit 1
        until [ "$(json .status)" != accepted ]; do
            sleep 0.05
            get "/v1/jobs/$id"
        done
        sleep "$((RANDOM % LATEST)).$((RANDOM % 10))"
        post "/v1/jobs/$id/cancel"
        poll_job "$id" 300
        mapfile -t -O ${#lags[@]} lags < <(lag "$id")
    done
    if [ ${#lags[@]} -eq 0 ]; then
        printf '%-28s %8s %8s\n' "$name" - 'ended'
        continue
    fi
    mapfile -t lags < <(printf '%s\n' "${lags[@]}" | sort -n)
    printf '%-28s %8d %8d\n' "$name" "${lags[${#lags[@]} / 2]}" "${lags[-1]}"
    [ "${lags[-1]}" -gt "$worst" ] && worst=${lags[-1]}
done <<END
encode encode {"mesh":"$MESH","lmax":127,"smoothing":1e-6}
register register {"template":"$A","moving":"$B","symmetric":true}
register-landmarks register {"template":"$A","moving":"$B","symmetric":true,"landmarks":{"template":[1,100,200,300],"moving":[1,100,200,300]}}
register-exact register {"template":"$A","moving":"$B","exact":true,"degree":32}
geodesic geodesic {"from":"$A","to":"$B","steps":101}
geodesic-pullback geodesic {"from":"$A","to":"$B",$AS_THEY_ARE,"method":"pullback","steps":99}
invert invert {"srnf":{"surface":"$A"}}
distances distances {"cohort":"sides"}
distances-icp distances {"cohort":"sides","metric":"icp"}
neighbours neighbours {"cohort":"sides"}
mean mean {"cohort":"sides"}
mean-pullback mean {"cohort":"sides",$AS_THEY_ARE,"method":"pullback"}
pca pca {"cohort":"sides"}
pca-parts pca-parts {"cohort":"parts","modes":20}
classify-parts classify-parts {"cohort":"labelled","covariance":"pooled"}
modes modes {"model":"$M","mode":1,"coefficients":[-3,-2,-1,0,1,2,3]}
sample sample {"model":"$M","count":200,"seed":1}
project project {"model":"$M","surface":"$C"}
evaluate-model evaluate-model {"model":"$M","samples":10000,"seed":1}
compare-groups compare-groups {"cohort":"sides",$AS_THEY_ARE,"permutations":1000000,"seed":1}
shoot shoot {"surface":"$A","velocity":{"toward":"$B"},"times":[0.25,0.5,0.75]}
shoot-pullback shoot {"surface":"$A","velocity":{"toward":"$B"},"times":[0.5],$AS_THEY_ARE,"method":"pullback"}
transport transport {"from":"$A","to":"$B","vector":{"toward":"$C"}}
transport-pullback transport {"from":"$A","to":"$B","vector":{"toward":"$C"},$AS_THEY_ARE,"method":"pullback"}
transfer transfer {"source":"$A","deformed":"$B","target":"$C"}
classify classify {"cohort":"sides","method":["srnf-gauss","srm-gauss","icp-nn"],"seed":1}
extract extract {"volume":"$VOLUME","labels":[1]}
repair repair {"mesh":"$MESH"}
mirror mirror {"mesh":"$MESH"}
regress regress {"cohort":"sides",$AS_THEY_ARE,"formula":"shape ~ label","permutations":1000000,"seed":1}
train train {"cohort":"sides","method":"srnf-gauss"}
train-parts train-parts {"cohort":"labelled","method":"srnf-gauss"}
predict predict {"model":"$T","cohort":"sides"}
report report {"cohort":"sides"}
score score {"model":"$M","surface":"$A"}
change change {"cohort":"pairs","permutations":1000000,"seed":1}
change-flips change {"cohort":"pairs",$AS_THEY_ARE,"permutations":1000000,"bootstraps":10000,"seed":1}
asymmetry asymmetry {"cohort":"pairs","permutations":1000000,"seed":1}
trajectories trajectories {"cohort":"pairs","at":[{"time":0},{"time":0.5},{"time":1}],"seed":1}
trajectories-flips trajectories {"cohort":"pairs",$AS_THEY_ARE,"at":[{"time":0.5}],"bootstraps":10000,"seed":1}
END
printf 'longest %d ms, limit %d ms\n' "$worst" "$LIMIT"
stop_server || exit 1
[ "$worst" -le "$LIMIT" ]

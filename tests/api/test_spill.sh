#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: slow
# srnfd-test: timeout 600
#
# test_spill.sh - a pca whose warps go to scratch (--job-cache): its numbers have the bits of one in memory, also when
# the daemon is killed with kill -9 twice, and what it leaves of the file is garbled, cut or gone; the file goes with the
# job. core/stats/test_mean_spill.c has the same in the sanitizers' build, and more, server/jobs/test_storage_full.c a disk
# that is full.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=4
TINY=100000 # bytes: less than the warp of one member

# Fourteen surfaces between the left and the right thalamus.
prepare() {
    local ends=() side
    for side in L R; do
        post "/v1/meshes?name=${side}_thalamus" --data-binary "@tests/data/aal_subcortex/${side}_thalamus.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$LMAX}"
        ends+=("$(json .surface.id)")
    done
    execute geodesic "{\"from\":\"${ends[0]}\",\"to\":\"${ends[1]}\",\"steps\":14,\"register\":false}"
    post_json /v1/cohorts "$(jq -c '{name: "between", members: [.surfaces[] | {id: .id}]}' "$BODY")"
    is "$STATUS" 201 'a cohort of surfaces'
}
PCA='{"cohort":"between","tolerance":1e-8,"maxIterations":8,"components":5}'
numbers() { # of the last body
    jq -S '[.model.eigenvalues, .distances, [.history[] | .objective]]' "$BODY"
}

start_server "$SCRATCH/whole" --workers 2 || exit 1
prepare
execute pca "$PCA" --header 'Prefer: wait=300'
is "$STATUS" 200 'a pca in memory'
[ "$STATUS" = 200 ] || exit 1
numbers >"$SCRATCH/whole.json"
is "$(find "$SCRATCH/whole/scratch" -type f)" '' 'which has no file'
stop_server || not_ok 'the server ends well'

start_server "$SCRATCH/cut" --workers 2 --job-cache $TINY || exit 1
prepare
damage() { # HOW FILE
    case $1 in
    garbled) # every hundredth byte is another
        /usr/bin/python3 - "$2" <<'PYTHON'
import sys
with open(sys.argv[1], "r+b") as file:
    content = bytearray(file.read())
    content[::100] = bytes(255 - byte for byte in content[::100])
    file.seek(0)
    file.write(content)
PYTHON
        ;;
    cut) truncate -s 450001 "$2" ;;
    gone) rm "$2" ;;
    whole) ;;
    esac
}

for LEFT in 'whole whole' 'garbled cut' 'whole gone'; do
    execute pca "$PCA" --header 'Prefer: respond-async'
    is "$STATUS" 201 "the same with few bytes of memory, and a file that is left: $LEFT"
    [ "$STATUS" = 201 ] || exit 1
    JOB=$(json .id)
    for HOW in $LEFT; do
        for _ in $(seq 2000); do
            grep -q 'job-checkpoint.* state' "$SERVER_LOG" && break
            sleep 0.02
        done
        get "/v1/jobs/$JOB"
        is "$(json .status)" running 'it runs after a checkpoint'
        kill_server
        compare "$(stat -c %s "$SCRATCH/cut/scratch/$JOB")" '>' 900000 'its file is there after kill -9'
        damage "$HOW" "$SCRATCH/cut/scratch/$JOB"
        start_server "$SCRATCH/cut" --workers 2 --job-cache $TINY || exit 1
    done
    poll_job "$JOB" 400
    is "$JOB_STATUS" successful 'it ends well'
    is "$(grep -c job-resumed "$SERVER_LOG")" 1 'it went on from what it had'
    get "/v1/jobs/$JOB/results"
    numbers >"$SCRATCH/cut.json"
    check 'and gives the same numbers' cmp "$SCRATCH/whole.json" "$SCRATCH/cut.json"
    is "$(find "$SCRATCH/cut/scratch" -type f)" '' 'its file has gone'
    request DELETE "/v1/jobs/$JOB"
    # The log of each start is its own: what a job says of checkpoints is that of this one.
    stop_server || not_ok 'the server ends well'
    start_server "$SCRATCH/cut" --workers 2 --job-cache $TINY || exit 1
done
stop_server || not_ok 'the server ends well'
done_testing

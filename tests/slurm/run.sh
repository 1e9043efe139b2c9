#!/usr/bin/env bash
# run.sh - the executor "slurm" on a real cluster of three nodes, which it brings up on this machine and takes down again:
# make test-slurm. Not part of make check: it needs root and Debian's packages slurm-wlm and munge.
#
# Distances with the same bits as computed by the daemon alone, undisturbed and with kill -9 of a pilot, of a slurmd, of
# slurmctld at once after sbatch, and of the daemon in the middle; nodes that are drained and jobs that are held; what
# others see of a pilot; and nothing left in squeue. About two minutes.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

CLUSTER=$ROOT/tests/slurm/cluster.sh
LAB=$SCRATCH/lab
DATA=$SCRATCH/data
if ! WHY=$("$CLUSTER" up "$LAB" 3); then
    "$CLUSTER" down "$LAB"
    skip_all "no cluster: ${WHY:-it did not start}"
fi
trap 'status=$?; "$CLUSTER" down "$LAB"; (exit $status); clean_up' EXIT
. "$LAB/env"

begin() { # PLACES
    PLACES=$1
    BEGUN=$(date +%s.%N)
    execute distances "{\"surfaces\":$(jq -c "[.[$1]]" <<<"$SURFACES"),\"handedness\":\"ignore\"}" --header 'Prefer: respond-async'
    JOB=$(json .jobID)
}

ends_as_local() { # NAME
    poll_job "$JOB" 180
    note "$(awk -v a="$BEGUN" -v b="$(date +%s.%N)" 'BEGIN { printf "%.1f s", b - a }')"
    get "/v1/jobs/$JOB/results"
    is "$JOB_STATUS $(json '.matrix | tojson')" "successful $(jq -c "[.[$PLACES] | [.[$PLACES]]]" <<<"$LOCAL")" "$1"
}

await() { # REGEX COMMAND..
    local pattern=$1 waited=0
    shift
    GOT=
    while [ $waited -lt "${TENTHS:-400}" ]; do
        GOT=$("$@")
        [[ $GOT =~ $pattern ]] && return
        sleep 0.1
        waited=$((waited + 1))
    done
}

message() {
    get "/v1/jobs/$JOB"
    json .message
}

# States in the queue, those that have ended left out; "" is an empty queue.
queue() {
    timeout 20 squeue -h -r -o %T | sort | uniq -c | awk '{ printf "%s%s %s", (NR > 1 ? ", " : ""), $1, $2 }'
}

# Processes of pilots.
pilots() {
    pgrep -f "^$SRNFD worker --server $URL" | paste -sd' '
}

told() { # EVENT
    grep -c "\"event\":\"$1\"" "$SERVER_LOG"
}

done_tasks() {
    message | sed -n 's/^\([0-9]*\) of .*/\1/p'
}

tasks_counted() { # KIND
    get /metrics
    sed -n "s/^srnfd_tasks_total{kind=\"$1\",event=\"done\"} //p" "$BODY"
}

serve() { # ADDRESS
    nice -n 10 "$SRNFD" serve --listen "$1" --data "$DATA" --workers 2 --executor slurm --slurm-partition shape \
        --slurm-time 10:00 --slurm-workers 6 --slurm-poll-seconds 1 --lease-seconds 5 </dev/null >/dev/null 2>"$SERVER_LOG" &
    SERVER_PID=$!
    SERVER_PIDS+=("$SERVER_PID")
}

# ---- As it is computed here -----------------------------------------------------------------------------

start_server "$DATA" --workers 2 || exit 1
IDS=()
for name in L_thalamus R_thalamus L_pallidum R_pallidum L_putamen R_putamen; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":5}"
    IDS+=("$(json .surface.id)")
done
SURFACES=$(jq -nc '$ARGS.positional' --args "${IDS[@]}")
execute distances "{\"surfaces\":$SURFACES,\"handedness\":\"ignore\"}" --header 'Prefer: wait=200'
LOCAL=$(json '.matrix | tojson')
like "$LOCAL" '^\[\[0,0\.[0-9]' 'distances, computed here'
MEAN="{\"surfaces\":$(jq -c '.[:4]' <<<"$SURFACES"),\"maxIterations\":3}"
execute mean "$MEAN" --header 'Prefer: wait=200'
LOCAL_MEAN=$(json '[.surface.id, .iterations, .distances] | tojson')
like "$LOCAL_MEAN" '^\["surf-' 'and a mean'
ADDRESS=${URL#http://}
stop_server || not_ok 'it drains'

# ---- Undisturbed -----------------------------------------------------------------------------------------

serve "$ADDRESS"
await '200' curl -s -o /dev/null -w '%{http_code}' "$URL/healthz"
begin 1,0,2,3,4,5
await RUNNING queue
TOKEN=$(sqlite3 "$DATA/srnfd.db" 'SELECT token FROM pilots')
like "$TOKEN" '^[0-9a-f]{64}$' 'the database has the digest of the token'
for element in $(squeue -h -o %A | sort -u); do scontrol show job "$element"; done >"$SCRATCH/shown"
squeue --json >>"$SCRATCH/shown" 2>/dev/null
cat /proc/[0-9]*/cmdline 2>/dev/null | tr '\0' '\n' >>"$SCRATCH/shown"
like "$(cat "$SCRATCH/shown")" "JobName=srnfd-[0-9a-f]{8}-$JOB-1" 'others see the name of the array'
is "$(grep -ac 'srnfd_pilot_' "$SCRATCH/shown")" 0 'and no token: not in a job, nor in an argument'
ends_as_local 'a cluster computes the same bits'
await '^$' queue
is "$GOT" '' 'and no pilot is left'
is "$(tasks_counted pairs)" 15 'each task was done once'

# ---- kill -9 -----------------------------------------------------------------------------------------------

BEGUN=$(date +%s.%N)
execute mean "$MEAN" --header 'Prefer: respond-async'
JOB=$(json .jobID)
if [ "$(json .cache)" = hit ]; then
    # The answer of before, which the same daemon gave: it is made again.
    request DELETE "/v1/jobs/$JOB"
    execute mean "$MEAN" --header 'Prefer: respond-async'
    JOB=$(json .jobID)
fi
poll_job "$JOB" 180
note "$(awk -v a="$BEGUN" -v b="$(date +%s.%N)" 'BEGIN { printf "%.1f s", b - a }')"
get "/v1/jobs/$JOB/results"
is "$JOB_STATUS $(json '[.surface.id, .iterations, .distances] | tojson')" "successful $LOCAL_MEAN" 'a mean, too, whose rounds follow each other'
compare "$(tasks_counted searches)" '>=' 1 'by tasks'
is "$(told pilots-did-nothing)" 0 'no pilot was for nothing'

begin 2,1,0,3,4,5
await '[0-9]' pilots
await '^[1-9]' done_tasks
kill -9 "${GOT:+$(pilots | cut -d' ' -f 1)}"
ends_as_local 'kill -9 of a pilot'

begin 3,1,2,0,4,5
await 'RUNNING' queue
NODE=$(squeue -h -t running -o %N | head -n 1)
kill -9 "$("$CLUSTER" pid "$LAB" "$NODE")"
ends_as_local "kill -9 of slurmd on a node with a pilot"
"$CLUSTER" start "$LAB" "$NODE"

SUBMITTED=$(told pilots-submitted)
begin 4,1,2,3,0,5
await "^$((SUBMITTED + 1))\$" told pilots-submitted
kill -9 "$("$CLUSTER" pid "$LAB" slurmctld)"
sleep 1
await 'Slurm: ' message
note "slurmctld is gone: $(message)"
"$CLUSTER" start "$LAB" slurmctld
TENTHS=300 await '^$' message
note "after its return: $GOT; $(queue); $(sinfo -h -N -o '%N %T' | paste -sd' ')"
if [ -n "$GOT" ]; then
    # What an operator does: nodes that Slurm has drained, and jobs that it holds.
    scontrol update nodename=n[1-3] state=resume 2>/dev/null
    squeue -h -t pending -o %A | sort -u | xargs -r scontrol release 2>/dev/null
fi
ends_as_local 'kill -9 of slurmctld at once after sbatch'

begin 5,1,2,3,4,0
await '^[1-9]' done_tasks
ASKED=$(squeue -h -r --name="$(squeue -h -o %j | grep -F -- "$JOB" | sort -u | paste -sd,)" -o %i | wc -l)
kill_server
mv "$SERVER_LOG" "$SERVER_LOG.killed"
sleep 2
serve "$ADDRESS"
await '200' curl -s -o /dev/null -w '%{http_code}' "$URL/healthz"
sleep 3
compare "$(squeue -h -r -o %j | grep -cF -- "$JOB")" '<=' "$ASKED" 'kill -9 of the daemon: its pilots are counted, not asked for again'
ends_as_local 'and the job goes on with them'
is "$(told pilots-submitted)" 0 'no array was submitted for it'
await '^$' queue
is "$GOT" '' 'and none is left'

# ---- Nodes that do not work --------------------------------------------------------------------------------

scontrol update nodename=n[1-3] state=drain reason=test
begin 0,2,1,3,4,5
await 'pending \([A-Z]' message
note "$GOT"
like "$GOT" 'Slurm: 0 running, [0-9] pending \([A-Z]' 'drained nodes: the reason of Slurm'
squeue -h -o %A | sort -u | xargs scontrol hold
await 'JobHeld' message
like "$GOT" 'JobHeld' 'a held job: the same'
squeue -h -o %A | sort -u | xargs scontrol release
scontrol update nodename=n[1-3] state=resume
ends_as_local 'when they work again, so do the pilots'

# ---- The end -----------------------------------------------------------------------------------------------

begin 0,1,3,2,4,5
await '^[1-9]' done_tasks
post "/v1/jobs/$JOB/cancel"
await '^$' queue
is "$GOT" '' 'a cancelled job has no pilots'
begin 0,1,2,4,3,5
await 'RUNNING' queue
stop_server || not_ok 'it drains'
await '^$' queue
is "$GOT" '' 'nor has a daemon that stopped'
is "$(pilots)" '' 'nor are there processes of them'
"$CLUSTER" down "$LAB"
is "$(pgrep -f "$LAB" | wc -l)" 0 'the cluster is down'

done_testing

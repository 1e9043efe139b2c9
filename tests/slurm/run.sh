#!/usr/bin/env bash
# run.sh - the executor "slurm" on a real cluster of three nodes, which it brings up on this machine and takes down again:
# make test-slurm. Not part of make check: it needs root and Debian's packages slurm-wlm and munge.
#
# Distances, a mean and folds with the same bits as computed by the daemon alone: by two workers that are started by hand,
# and by pilots. Then distances with kill -9 of a pilot, of a slurmd, of slurmctld at once after sbatch, and of the daemon in
# the middle; with a node whose cable is pulled; with nodes that are drained and jobs that are held; what others see of a
# pilot; and nothing left in squeue. Eight minutes on two processors that do much else (load 20).
#
# All of it runs in a network namespace of its own, where that is allowed: then the service listens with TLS, and the last
# node is beyond a cable. Otherwise all is on loopback, and no cable is pulled.
#
#   SHAPES=FOLDER    meshes instead of those in tests/data/aal_subcortex, taken in turn from both ends of the sorted names
#   MEMBERS=12       of the mean and the folds
#   PAIRED=8         of one matrix of distances; the other distances are those of the first six members
#   DEGREE=5         of the surfaces
#   ITERATIONS=3     of the mean, at most
#   KILLS=5          of pilots, at random, while means are computed, but never of the last; SEED draws them again
#
#   SHAPES=/data/ventricles MEMBERS=100 DEGREE=12 ITERATIONS=20 KILLS=100 make test-slurm
#   SHAPES=/data/ventricles MEMBERS=100 PAIRED=100 DEGREE=4 ITERATIONS=2 ONLY=equal make test-slurm  # no faults

if [ -z "${OWN_NETWORK-}" ] && unshare --net true 2>/dev/null; then
    exec unshare --net env OWN_NETWORK=1 "$0" "$@"
fi
# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

CLUSTER=$ROOT/tests/slurm/cluster.sh
LAB=$SCRATCH/lab
DATA=$SCRATCH/data
MEMBERS=${MEMBERS:-12}
PAIRED=${PAIRED:-8}
DEGREE=${DEGREE:-5}
KILLS=${KILLS:-5}
SECONDS_EACH=$((180 + 10 * MEMBERS)) # that a job may take
REQUEST_SECONDS=$SECONDS_EACH
MEAN_NUMBERS='[.surface.id, .iterations, .distances] | tojson'
MATRIX_NUMBERS='.matrix[]'
FOLD_NUMBERS='.methods["srnf-nn"] | [.confusion, [.perSubject[] | [.predicted, .logLikelihoods]]] | tojson'
if ! WHY=$("$CLUSTER" "$([ -n "${OWN_NETWORK-}" ] && echo far || echo up)" "$LAB" 3); then
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
    poll_job "$JOB" "$SECONDS_EACH"
    note "$(awk -v a="$BEGUN" -v b="$(date +%s.%N)" 'BEGIN { printf "%.1f s", b - a }')"
    get "/v1/jobs/$JOB/results"
    is "$JOB_STATUS $(json '.matrix | tojson')" "successful $(jq -c "[.[$PLACES] | [.[$PLACES]]]" <<<"$LOCAL")" "$1"
}

# Starts a process whose answer may be known from before, so that it is computed again.
start_anew() { # PROCESS INPUTS
    BEGUN=$(date +%s.%N)
    execute "$1" "$2" --header 'Prefer: respond-async'
    if [ "$(json .cache)" = hit ]; then
        request DELETE "/v1/jobs/$(json .jobID)"
        execute "$1" "$2" --header 'Prefer: respond-async'
    fi
    JOB=$(json .jobID)
}

# Waits for its end.
finish() { # NAME NUMBERS; sets GOT
    poll_job "$JOB" "$SECONDS_EACH"
    note "$1: $(awk -v a="$BEGUN" -v b="$(date +%s.%N)" 'BEGIN { printf "%.1f s", b - a }')"
    get "/v1/jobs/$JOB/results"
    GOT="$JOB_STATUS $(json "$2")"
    if [ "$2" = "$MATRIX_NUMBERS" ]; then # by its digest
        GOT="$JOB_STATUS $(json "$2" | sha256sum | cut -d ' ' -f 1)"
    fi
}

compute() { # PROCESS INPUTS NUMBERS; sets GOT
    start_anew "$1" "$2"
    finish "$1" "$3"
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

serve() { # EXECUTOR [ARGUMENTS..]
    local executor=$1
    shift
    nice -n 10 "$SRNFD" serve --listen "$ADDRESS" --data "$DATA" --workers 2 --executor "$executor" --lease-seconds 5 \
        ${TLS[@]+"${TLS[@]}"} "$@" </dev/null >/dev/null 2>"$SERVER_LOG" &
    SERVER_PID=$!
    SERVER_PIDS+=("$SERVER_PID")
    await '200' curl -s -o /dev/null -w '%{http_code}' "$URL/healthz"
}

serve_slurm() { # [PILOTS]
    serve slurm --slurm-partition shape --slurm-time 30:00 --slurm-workers "${1:-6}" --slurm-poll-seconds 1
}

# ---- As it is computed here -----------------------------------------------------------------------------

if [ -n "${SHAPES-}" ]; then
    mapfile -t ALL < <(find -L "$SHAPES" -name '*.ply' | sort)
    for ((i = 0; i < MEMBERS; i++)); do
        FILES[i]=${ALL[i % 2 ? ${#ALL[@]} - 1 - i / 2 : i / 2]}
    done
else
    FILES=()
    for name in thalamus pallidum putamen amygdala caudate hippocampus; do
        FILES+=("tests/data/aal_subcortex/L_$name.ply" "tests/data/aal_subcortex/R_$name.ply")
    done
fi
start_server "$DATA" --workers 2 || exit 1
IDS=()
for file in "${FILES[@]:0:MEMBERS}"; do
    post "/v1/meshes?name=$(basename "$file" .ply)" --data-binary "@$file"
    execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":$DEGREE}"
    IDS+=("$(json .surface.id)")
done
MEMBER_IDS=$(jq -nc '$ARGS.positional' --args "${IDS[@]}")
SURFACES=$(jq -c '.[:6]' <<<"$MEMBER_IDS")
execute distances "{\"surfaces\":$SURFACES,\"handedness\":\"ignore\"}" --header "Prefer: wait=$SECONDS_EACH"
LOCAL=$(json '.matrix | tojson')
like "$LOCAL" '^\[\[0,0\.[0-9]' 'distances, computed here'
MATRIX="{\"surfaces\":$(jq -c ".[:$PAIRED]" <<<"$MEMBER_IDS"),\"handedness\":\"ignore\"}"
compute distances "$MATRIX" "$MATRIX_NUMBERS"
LOCAL_MATRIX=$GOT
like "$LOCAL_MATRIX" '^successful [0-9a-f]{64}$' "distances of $PAIRED"
MEAN="{\"surfaces\":$MEMBER_IDS,\"maxIterations\":${ITERATIONS:-3}}"
compute mean "$MEAN" "$MEAN_NUMBERS"
LOCAL_MEAN=$GOT
like "$LOCAL_MEAN" '^successful \["surf-' "a mean of $MEMBERS"
post_json /v1/cohorts "$(jq -c '{name: "members", members: [to_entries[] |
    {id: .value, label: (if .key % 2 == 0 then "one" else "other" end)}]}' <<<"$MEMBER_IDS")"
FOLDS='{"cohort":"members","method":"srnf-nn"}'
compute classify "$FOLDS" "$FOLD_NUMBERS"
LOCAL_FOLDS=$GOT
like "$LOCAL_FOLDS" '^successful \[.*[0-9]' 'and folds'
ADDRESS=$NEAR:${URL##*:}
stop_server || not_ok 'it drains'
TLS=()
URL=http://$ADDRESS
if [ -n "$LAST" ]; then
    openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=srnfd -addext \
        "subjectAltName=IP:$NEAR" -keyout "$SCRATCH/key.pem" -out "$SCRATCH/certificate.pem" 2>/dev/null
    export CURL_CA_BUNDLE=$SCRATCH/certificate.pem
    TLS=(--tls-certificate "$SCRATCH/certificate.pem" --tls-key "$SCRATCH/key.pem" --insecure)
    URL=https://$ADDRESS
fi

# ---- In clear text -----------------------------------------------------------------------------------------

if [ -n "$LAST" ]; then
    "$SRNFD" serve --listen "$ADDRESS" --data "$SCRATCH/clear" --executor workers --insecure </dev/null >/dev/null 2>"$SERVER_LOG" &
    SERVER_PID=$!
    SERVER_PIDS+=("$SERVER_PID")
    await '200' curl -s -o /dev/null -w '%{http_code}' "http://$ADDRESS/healthz"
    post_json "http://$ADDRESS/v1/leases" '{}'
    is_problem 403 forbidden 'beyond loopback workers are not served in clear text'
    stop_server || not_ok 'it drains'
fi

# ---- By workers that are started by hand ------------------------------------------------------------------

serve workers
for i in 0 1; do
    nice -n 10 "$SRNFD" worker --server "$URL" ${TLS[@]+--certificate "$SCRATCH/certificate.pem"} --slots 1 --idle-seconds 0 \
        --cache "$SCRATCH/cache" </dev/null >/dev/null 2>>"$SCRATCH/worker.log" &
    HANDS[i]=$!
    SERVER_PIDS+=("${HANDS[i]}")
done
begin 0,1,2,3,5,4
ends_as_local 'two workers compute the same distances'
TASKS=$(tasks_counted pairs)
compute distances "$MATRIX" "$MATRIX_NUMBERS"
is "$GOT" "$LOCAL_MATRIX" "those of $PAIRED, too"
TASKS=$(($(tasks_counted pairs) - TASKS)) # pairs, or blocks of them where they are many
get "/v1/jobs/$JOB"
is "$(json '[.executors[].tasks] | add')" "$TASKS" 'and the job says where each task was computed'
compute mean "$MEAN" "$MEAN_NUMBERS"
is "$GOT" "$LOCAL_MEAN" 'the same mean'
compute classify "$FOLDS" "$FOLD_NUMBERS"
is "$GOT" "$LOCAL_FOLDS" 'and the same folds'
compare "$(tasks_counted searches)" '>=' 2 'by tasks'
for pid in "${HANDS[@]}"; do
    kill -TERM "$pid"
    wait_server "$pid" 60
    is "$SERVER_STATUS" 0 'a worker drains'
done
stop_server || not_ok 'it drains'

# ---- By pilots ---------------------------------------------------------------------------------------------

serve_slurm
begin 1,0,2,3,4,5
await RUNNING queue
TOKEN=$(sqlite3 "$DATA/srnfd.db" 'SELECT token FROM pilots')
like "$TOKEN" '^[0-9a-f]{64}$' 'the database has the digest of the token'
for element in $(squeue -h -o %A | sort -u); do scontrol show job "$element"; done >"$SCRATCH/shown"
squeue --json >>"$SCRATCH/shown" 2>/dev/null
cat /proc/[0-9]*/cmdline 2>/dev/null | tr '\0' '\n' >>"$SCRATCH/shown"
like "$(cat "$SCRATCH/shown")" "JobName=srnfd-[0-9a-f]{8}-$JOB-1-[0-9a-f]{4}" 'others see the name of the array'
is "$(grep -ac 'srnfd_pilot_' "$SCRATCH/shown")" 0 'and no token: not in a job, nor in an argument'
ends_as_local 'a cluster computes the same distances'
await '^$' queue
is "$GOT" '' 'and no pilot is left'
is "$(tasks_counted pairs)" 15 'each task was done once'
compute distances "$MATRIX" "$MATRIX_NUMBERS"
is "$GOT" "$LOCAL_MATRIX" "those of $PAIRED, too"
is "$(tasks_counted pairs)" "$((15 + TASKS))" 'each of these, too'
compute mean "$MEAN" "$MEAN_NUMBERS"
is "$GOT" "$LOCAL_MEAN" 'the same mean'
SEARCHES=$(tasks_counted searches) # of a mean
compare "$SEARCHES" '>=' 1 'by tasks'
compute classify "$FOLDS" "$FOLD_NUMBERS"
is "$GOT" "$LOCAL_FOLDS" 'and the same folds'
compare "$(tasks_counted searches)" '>' "$SEARCHES" 'by tasks'
is "$(told pilots-did-nothing)" 0 'no pilot was for nothing'

if [ "${ONLY-}" = equal ]; then
    stop_server || not_ok 'it drains'
    await '^$' queue
    is "$GOT" '' 'and no pilot is left'
    done_testing
    exit
fi

# ---- kill -9 -----------------------------------------------------------------------------------------------

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

RANDOM=${SEED:-$$}
note "SEED=${SEED:-$$}"
killed=0
means=0
wrong=0
twice=0
while [ "$killed" -lt "$KILLS" ]; do
    means=$((means + 1))
    DONE_BEFORE=$(tasks_counted searches)
    start_anew mean "$MEAN"
    while get "/v1/jobs/$JOB" && case $(json .status) in accepted | running) true ;; *) false ;; esac; do
        sleep "$((RANDOM % 5)).$((RANDOM % 10))"
        read -ra PIDS < <(pilots)
        if [ ${#PIDS[@]} -gt 1 ] && kill -9 "${PIDS[RANDOM % ${#PIDS[@]}]}" 2>/dev/null; then
            killed=$((killed + 1))
        fi
    done
    finish "mean $means" "$MEAN_NUMBERS"
    [ "$GOT" = "$LOCAL_MEAN" ] || wrong=$((wrong + 1))
    [ $(($(tasks_counted searches) - DONE_BEFORE)) -eq "$SEARCHES" ] || twice=$((twice + 1))
done
note "$killed pilots killed during $means means"
is "$wrong" 0 'pilots are killed at random: each mean is the same'
is "$twice" 0 'and each of its tasks was accepted once'
await '^$' queue
is "$GOT" '' 'and no pilot is left'

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
kill_server
mv "$SERVER_LOG" "$SERVER_LOG.killed"
sleep 2
ASKED=$(squeue -h -r -o %j | grep -cF -- "$JOB") # also what it asked for last
serve_slurm "$ASKED" # on a busy machine, where tasks are long, it would rightly ask for more
sleep 3
compare "$ASKED" '>=' 1 'kill -9 of the daemon: pilots stay'
compare "$(squeue -h -r -o %j | grep -cF -- "$JOB")" '<=' "$ASKED" 'they are counted, not asked for again'
ends_as_local 'and the job goes on with them'
is "$(told pilots-submitted)" 0 'no array was submitted for it'
await '^$' queue
is "$GOT" '' 'and none is left'

# ---- A cable that is pulled --------------------------------------------------------------------------------

node() { # NAME
    timeout 20 sinfo -h -N -n "$1" -o %T
}

busy_nodes() {
    timeout 20 squeue -h -t running -o %N | sort -u | paste -sd' '
}

if [ -n "$LAST" ]; then
    scontrol update nodename=n[1-2] state=drain reason=test
    begin 0,1,2,4,5,3
    await "^$LAST\$" busy_nodes
    await '^[1-9]' done_tasks
    "$CLUSTER" cut "$LAB"
    scontrol update nodename=n[1-2] state=resume
    ends_as_local 'the cable of a node is pulled, and the others go on'
    TENTHS=900 await '^down' node "$LAST"
    note "$LAST: $GOT; $(queue)"
    like "$GOT" '^down|\*$' 'Slurm takes notice'
    "$CLUSTER" heal "$LAB"
    TENTHS=900 await '^idle' node "$LAST"
    is "$GOT" idle 'and when it is put back, the node is there again'
    await '^$' queue
    is "$GOT" '' 'no pilot waits or runs'
    TENTHS=1300 await '^$' pilots
    is "$GOT" '' 'and none has stayed on the node'
else
    skip 'the cable of a node is pulled' 'no network namespace may be made here'
fi

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

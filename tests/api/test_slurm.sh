#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: waits
# srnfd-test: timeout 300
#
# test_slurm.sh - distances computed by pilots of a cluster that tests/support/fake_slurm.sh plays: with the same bits as
# here; what sbatch is told and what it is not; pilots as many as are needed, for each job its own; a daemon that is
# killed while sbatch is at work; programs of Slurm that refuse, hang, or print garbage; pilots that fail, run out of memory
# or are held; and none left when a job is cancelled or the daemon stops.
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
FAKE=$SCRATCH/fake
STATE=$FAKE/state
mkdir -p "$STATE"
for program in sbatch squeue scancel; do
    ln -s "$ROOT/tests/support/fake_slurm.sh" "$FAKE/$program"
done

# Pilots that a failed test leaves, and programs that its daemons left when they were killed.
end_pilots() {
    local file pid
    while read -r pid; do
        [ "$(cat "/proc/$pid/comm" 2>/dev/null)" != sleep ] || kill -KILL "$pid" 2>/dev/null
    done < <(cat "$STATE/asleep" 2>/dev/null)
    for file in "$STATE"/*/*/worker "$STATE"/*/*/pid; do
        [ -e "$file" ] && kill -KILL "$(cat "$file")" 2>/dev/null
    done
}
trap 'status=$?; end_pilots; (exit $status); clean_up' EXIT

# Surfaces, as a JSON array.
surfaces() {
    local ids=() name
    for name in L_thalamus R_thalamus L_pallidum R_pallidum; do
        post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
        execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":4}"
        ids+=("$(json .surface.id)")
    done
    jq -nc '$ARGS.positional' --args "${ids[@]}"
}

# Starts the job on the surfaces at these places, so that each test has one of its own: sets JOB and PLACES.
begin() { # PLACES
    PLACES=$1
    execute distances "{\"surfaces\":$(jq -c "[.[$1]]" <<<"$SURFACES"),\"handedness\":\"ignore\"}" \
        --header 'Prefer: respond-async'
    JOB=$(json .jobID)
}

# Waits for its end, and compares it with what was computed here.
ends_as_local() { # NAME
    poll_job "$JOB" 100
    get "/v1/jobs/$JOB/results"
    is "$JOB_STATUS $(json '.matrix | tojson')" "successful $(jq -c "[.[$PLACES] | [.[$PLACES]]]" <<<"$LOCAL")" "$1"
}

message() { # JOB
    get "/v1/jobs/$1"
    json .message
}

# Waits until the command prints what the pattern allows, for a minute, since a machine may do much else; GOT is what it
# printed last.
await() { # REGEX COMMAND..
    local pattern=$1 deadline=$((SECONDS + 60))
    shift
    GOT=
    until
        GOT=$("$@")
        [[ $GOT =~ $pattern ]] || [ $SECONDS -ge $deadline ]
    do
        sleep 0.1
    done
}

# States of all elements of the arrays of a job, sorted; "" without any.
states() { # JOB
    local array
    for array in $(grep -lF -- "$1" "$STATE"/*/name 2>/dev/null); do
        cat "${array%/*}"/*/word
    done | sort | paste -sd' '
}

told() { # EVENT
    grep -c "\"event\":\"$1\"" "$SERVER_LOG"
}

arrays() { # JOB
    grep -lF -- "$1" "$STATE"/*/name 2>/dev/null | wc -l
}

# Pilots that the service counts.
pending_counted() {
    get /metrics
    sed -n 's/^srnfd_pilots{state="pending"} //p' "$BODY"
}

# Pilots that run compute nothing before they are let go, so that their job cannot end before what is to be seen.
hold_pilots() {
    echo "until [ -e $STATE/go ]; do sleep 0.1; done; exec sh \"\$1\"" >"$STATE/instead"
}

let_go() {
    rm "$STATE/instead"
    touch "$STATE/go"
}

elements() { # JOB
    states "$1" | wc -w
}

rows() {
    sqlite3 "file:$DATA/srnfd.db?mode=ro" 'SELECT count(*) FROM pilots'
}

live() { # how many elements wait or run, and processes of them
    local file n=0
    for file in "$STATE"/*/*/worker; do
        [ -e "$file" ] && kill -0 "$(cat "$file")" 2>/dev/null && n=$((n + 1))
    done
    echo "$(cat "$STATE"/*/*/word 2>/dev/null | grep -cE 'PENDING|RUNNING') $n"
}

start_slurm() { # [ARGUMENTS..]
    PATH=$FAKE:$PATH SECRET_OF_THE_DAEMON=1 start_server "$DATA" --workers 3 --executor slurm --lease-seconds 3 \
        --slurm-poll-seconds 0.3 --slurm-seconds 2 --slurm-workers 3 "$@" || exit 1
}

# The same daemon, killed before, at the address where its pilots know it.
start_again() {
    PATH=$FAKE:$PATH nice -n 10 "$SRNFD" serve --listen "${URL#http://}" --data "$DATA" --workers 3 --executor slurm \
        --lease-seconds 3 --slurm-poll-seconds 0.3 --slurm-seconds 2 --slurm-workers 3 \
        </dev/null >/dev/null 2>"$SERVER_LOG" &
    SERVER_PID=$!
    SERVER_PIDS+=("$SERVER_PID")
}

refused() { # PATH ARGUMENTS.. ; sets STATUS and GOT
    local path=$1
    shift
    env PATH="$path" "$SRNFD" serve --listen 127.0.0.1:0 --data "$SCRATCH/none" --executor slurm "$@" 2>"$SCRATCH/refused"
    STATUS=$?
    GOT=$(cat "$SCRATCH/refused")
}

# ---- What it does not start with --------------------------------------------------------------------------

mkdir "$SCRATCH/bin"
refused "$SCRATCH/bin"
is "$STATUS" 2 'without Slurm the executor is refused'
like "$GOT" 'sbatch.*install Slurm' 'with what to do about it'
ln -s "$FAKE/sbatch" "$FAKE/squeue" "$SCRATCH/bin/"
refused "$SCRATCH/bin"
like "$GOT" 'runs scancel' 'each of its programs is needed'
refused "$FAKE:$PATH" --listen 0.0.0.0:0 --insecure
like "$STATUS $GOT" '^2 .*TLS alone' 'beyond this machine it needs TLS'
for arguments in '-p x' 'x' '--array=1-9' '--exclusive --wrap=id'; do
    refused "$FAKE:$PATH" --slurm-arguments="$arguments"
    like "$STATUS $GOT" '^2 .*--slurm-arguments' "arguments that sbatch must not get: $arguments"
done
refused "$FAKE:$PATH" --slurm-workers 0
like "$STATUS $GOT" '^2 .*slurm-workers must be a whole number' 'a setting out of its range'

# ---- As it is computed here -----------------------------------------------------------------------------

start_server "$DATA" --workers 2 || exit 1
SURFACES=$(surfaces)
execute distances "{\"surfaces\":$SURFACES,\"handedness\":\"ignore\"}"
LOCAL=$(json '.matrix | tojson')
like "$LOCAL" '^\[\[0,0\.[0-9]' 'distances, computed here'
stop_server || not_ok 'it drains'

# ---- By pilots -------------------------------------------------------------------------------------------

start_slurm --slurm-partition shape --slurm-account lab --slurm-qos low --slurm-time 1:00:00 --slurm-cpus 2 \
    --slurm-workers 1 --slurm-arguments '--exclusive --gres=none:1'
is "$(told pilots-local)" 1 'on loopback it says that only this machine has pilots'
begin 1,0,2,3
ends_as_local 'pilots compute the same bits'
get /v1/workers
is "$(json .executor)" slurm 'the executor is told'
is "$(json '[.items[].token] | unique | join(",")')" "slurm:$JOB" 'and whose token the pilots have'
await '^0 0$' live
is "$GOT" '0 0' 'the end of the job is the end of its pilots'
await '^0$' rows
is "$GOT" 0 'and of their rows'
is "$(grep -c ^sbatch "$STATE/calls")" 1 'sbatch was called once'
NAME=$(cat "$STATE/101/name")
like "$NAME" "^srnfd-[0-9a-f]{8}-$JOB-1-[0-9a-f]{4}\$" 'the name says whose array it is'
is "$(sed -n 's/^sbatch //p' "$STATE/calls")" "--parsable --array=1-1 --job-name=$NAME --ntasks=1 --cpus-per-task=2 \
--partition=shape --account=lab --qos=low --time=1:00:00 --requeue --export=NONE --propagate=NONE --chdir=/ \
--output=/dev/null --exclusive --gres=none:1" 'what sbatch was told'
is "$(grep -c "^squeue -h -r -t all -o %j|%i|%T|%r --name=$NAME\$" "$STATE/calls")" \
    "$(grep ^squeue "$STATE/calls" | grep -vc -- --me)" 'squeue is asked by name'
TOKEN=$(grep -o 'srnfd_pilot_[A-Za-z0-9_-]*' "$STATE/101/script")
like "$TOKEN" '^srnfd_pilot_[A-Za-z0-9_-]{43}$' 'the token is in the script'
is "$(grep -rlF -- "$TOKEN" "$STATE" "$SERVER_LOG" "$DATA" | sort | paste -sd' ')" "$STATE/101/script" 'and nowhere else'
cat "$STATE"/seen-* >"$SCRATCH/seen"
like "$(cat "$SCRATCH/seen")" 'PATH=' 'sbatch has an environment'
unlike "$(cat "$SCRATCH/seen")" 'SECRET_OF_THE_DAEMON|SRNFD_' 'without what is the daemon'"'"'s'
post_json /v1/leases '{}' --header "Authorization: Bearer $TOKEN"
is_problem 401 token-invalid 'the token ended with the job'
echo 0 >"$STATE/nodes"
mkdir -p "$STATE/999/1"
echo 'a job | of somebody else' >"$STATE/999/name"
echo PENDING | tee "$STATE/999/1/word" >"$STATE/101/1/word"
await CANCELLED cat "$STATE/101/1/word"
is "$GOT" CANCELLED 'what comes back, as after a crash of the controller, is cancelled'
is "$(cat "$STATE/999/1/word") $(grep '"event":"pilot-stray"' "$SERVER_LOG" | grep -cvF "$NAME")" 'PENDING 0' 'and nothing else'
compare "$(told pilot-stray)" '>=' 1 'as the log says'
rm -r "$STATE/999"

# ---- Nothing runs: reasons, shares, growth, shrinking, and what a token may ---------------------------------

stop_server || not_ok 'it drains'
start_slurm
BUILD=$(jq -Rr 'fromjson? | objects | select(.event == "working") | .numericBuild' "$STATE/pilots.log" | head -n 1)
echo 0 >"$STATE/nodes"
echo Priority >"$STATE/reason"
begin 2,1,0,3
FIRST=$JOB
await 'pending \(Priority\)' message "$FIRST"
like "$GOT" '^0 of 6 tasks done, waiting for workers; Slurm: 0 running, 2 pending \(Priority\)' 'why nothing runs'
echo JobHeldUser >"$STATE/reason"
await JobHeldUser message "$FIRST"
like "$GOT" 'JobHeldUser' 'the reason as Slurm has it now'
begin 3,1,2,0
SECOND=$JOB
await PENDING states "$SECOND"
is "$(states "$FIRST"), $(states "$SECOND")" 'PENDING PENDING, PENDING' 'jobs share what there may be'
await '^3$' pending_counted # when sbatch has answered
is "$GOT" 3 'it is counted'
TOKEN=$(grep -oh 'srnfd_pilot_[A-Za-z0-9_-]*' "$(dirname "$(grep -lF -- "$SECOND" "$STATE"/*/name)")/script")
for _ in 1 2 3; do
    post_json /v1/leases "$(jq -nc --arg build "$BUILD" \
        '{worker: "by-hand", host: "here", cpu: "any", slots: 1, numericBuild: $build, wait: 5}')" --header "Authorization: Bearer $TOKEN"
    TASK=$(json .task)
    sqlite3 "file:$DATA/srnfd.db?mode=ro" "SELECT job FROM task WHERE id = '$TASK'"
done >"$SCRATCH/leased"
is "$(sort -u "$SCRATCH/leased")" "$SECOND" 'a token leases tasks of its job alone'
for path in /v1/jobs "/v1/jobs/$SECOND" /v1/meshes /metrics; do
    get $path --header "Authorization: Bearer $TOKEN"
    is_problem 403 forbidden "and reads nothing else: $path"
done
get /v1/jobs --header "Authorization: Bearer ${TOKEN%?????}AAAAA"
is_problem 401 token-invalid 'a forged one is none, though the service asks for no tokens'
post "/v1/jobs/$FIRST/cancel"
await 'PENDING PENDING' states "$SECOND"
is "$GOT" 'PENDING PENDING' 'what one gives up another gets'
await 'CANCELLED CANCELLED' states "$FIRST"
is "$GOT" 'CANCELLED CANCELLED' 'of the cancelled job nothing waits'
nice -n 10 "$SRNFD" worker --server "$URL" --slots 2 --idle-seconds 2 </dev/null >/dev/null 2>&1 &
WORKER_PID=$!
SERVER_PIDS+=("$WORKER_PID")
JOB=$SECOND PLACES=3,1,2,0 ends_as_local 'a worker that was started by hand computes, too'
kill "$WORKER_PID"
wait_server "$WORKER_PID" 20
is "$SERVER_STATUS" 0 'it leaves'
await '^0 0$' live
is "$GOT" '0 0' 'and the pilots are cancelled'

# ---- The daemon is killed ----------------------------------------------------------------------------------

echo 2 >"$STATE/nodes"
stop_server || not_ok 'it drains'
start_slurm --slurm-seconds 30 # until then sbatch is not killed, and nothing known of what it does
echo late >"$STATE/sbatch"
begin 0,2,1,3
await . states "$JOB"
kill_server
rm "$STATE/sbatch"
start_again
ends_as_local 'killed while sbatch was at work: the job goes on'
compare "$(elements "$JOB")" '<=' 3 'no pilots were asked for twice' # on a busy machine tasks are long, and one more is
is "$(told pilots-adopted)" 1 'those that there were are adopted'
begin 0,3,1,2
await 'RUNNING' states "$JOB"
kill_server
start_again
ends_as_local 'killed while pilots were at work: they go on'
compare "$(elements "$JOB")" '<=' 3 'and are counted'
await '^0 0$' live

# ---- Programs that do not do as they should -----------------------------------------------------------------

for mode in garbage drop late; do
    rm -f "$STATE"/sbatch
    case $mode in
    garbage) begin 0,1 ;;
    drop) begin 1,0 ;;
    late) begin 0,2 ;;
    esac
    echo $mode >"$STATE/sbatch"
    ends_as_local "sbatch that works, but answers by $mode"
    is "$(arrays "$JOB")" 1 'has worked once'
done
echo 'refuse Batch job submission failed: Invalid account' >"$STATE/sbatch"
begin 2,0
await 'Invalid account' message "$JOB"
like "$GOT" 'Slurm: sbatch: error: Batch job submission failed: Invalid account' 'why sbatch refuses'
rm "$STATE/sbatch"
ends_as_local 'it is tried again'
echo hang >"$STATE/sbatch"
begin 0,3
await 'no answer in time' message "$JOB"
like "$GOT" 'sbatch gave no answer in time' 'an sbatch that hangs is killed'
rm "$STATE/sbatch"
ends_as_local 'and tried again'
for mode in hang garbage flood 'refuse Unable to contact slurm controller'; do
    hold_pilots
    case $mode in
    hang) begin 3,0 ;;
    garbage) begin 1,2 ;;
    flood) begin 2,1 ;;
    refuse*) begin 1,3 ;;
    esac
    await RUNNING states "$JOB"
    echo "$mode" >"$STATE/squeue"
    await 'Slurm: squeue' message "$JOB"
    let_go
    ends_as_local "squeue that answers by ${mode%% *} tells nothing"
    is "$(arrays "$JOB")" 1 'and nothing is asked for again'
    rm "$STATE/squeue" "$STATE/go"
done
await '^0 0$' live
is "$GOT" '0 0' 'when it answers again, what is left is cancelled'

# A queue that hides what it took: it must not be filled, and what it took is cancelled by its number.
echo 0 >"$STATE/nodes"
echo hide >"$STATE/squeue"
begin 0,1,2
await '^[2-9]' arrays "$JOB"
await '^[2-9]' told pilots-vanished
sleep 8
is "$(arrays "$JOB")" 2 'arrays that vanish are asked for again once, and then waited for'
await '^CANCELLED( CANCELLED)*$' states "$JOB"
like "$GOT" '^CANCELLED( CANCELLED)*$' 'and they are cancelled'
kill_server
start_again
sleep 3
is "$(arrays "$JOB")" 2 'a daemon that starts again asks for no more'
rm "$STATE/squeue"
echo 2 >"$STATE/nodes"
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 20
is "$JOB_STATUS" dismissed 'their job can be cancelled'

# ---- Pilots that run and give no sign, as on a node that has gone ---------------------------------------------

hold_pilots
begin 2,1,3
await RUNNING states "$JOB"
rm "$STATE/instead"
ends_as_local 'pilots that give no sign are followed by others'
is "$(told pilots-silent)" 1 'as the log says'
await '^0 0$' live
is "$GOT" '0 0' 'and all are cancelled'

# A node that failed: Slurm starts its pilots again, but not before some minutes.
hold_pilots
begin 3,1,0
await 'Slurm: [1-9] running' message "$JOB"
rm "$STATE/instead"
for file in "$STATE"/*/*/word; do
    ! grep -q RUNNING "$file" || echo DELAYED >"$file"
done
ends_as_local 'pilots that Slurm puts off are followed by others'
is "$(told pilots-silent)" 1 'at once'
await '^0 0$' live

# ---- Pilots that end badly ----------------------------------------------------------------------------------

echo 1500 >"$STATE/memory"
begin 3,1
await 'out of memory' message "$JOB"
like "$GOT" 'a pilot ran out of memory, the next get 2048 MiB' 'out of memory is told'
ends_as_local 'and the next have more'
is "$(grep -oE '\--mem=[0-9]+M' "$STATE/calls" | paste -sd' ')" '--mem=2048M' 'which sbatch is told'
echo 700 >"$STATE/given"
echo 900 >"$STATE/memory"
begin 1,3,2,0
await 'out of memory' message "$JOB"
like "$GOT" 'a pilot ran out of memory, the next get 1400 MiB' 'from what the cluster gave'
ends_as_local 'and that is enough'
rm "$STATE/memory" "$STATE/given"
hold_pilots
begin 0,1,3
await RUNNING states "$JOB"
ELEMENT=$(dirname "$(grep -l RUNNING "$STATE"/*/*/word | tail -n 1)")
echo TIMEOUT >"$ELEMENT/word"
kill -9 "$(cat "$ELEMENT/worker")"
await TIMEOUT message "$JOB"
let_go
like "$GOT" 'a pilot ended: TIMEOUT \(TimeLimit\)' 'a time limit is told'
ends_as_local 'and another pilot goes on'
await '^0 0$' live
stop_server || not_ok 'it drains'
start_slurm --slurm-program /nonexistent/srnfd
begin 2,3
await FAILED message "$JOB"
like "$GOT" 'a pilot ended: FAILED \(NonZeroExitCode\)' 'pilots that cannot run are told'
sleep 3
compare "$(arrays "$JOB")" '<=' 3 'and asked for less and less often'
post "/v1/jobs/$JOB/cancel"
poll_job "$JOB" 20
is "$JOB_STATUS" dismissed 'a job that waits for pilots can be cancelled'

# ---- The end -----------------------------------------------------------------------------------------------

stop_server || not_ok 'it drains'
start_slurm --grace-seconds 1
echo 1 >"$STATE/nodes"
rm "$STATE/go"
hold_pilots
begin 3,2,1,0
await 'PENDING RUNNING' states "$JOB"
stop_server || not_ok 'it drains'
await '^0 0$' live
is "$GOT" '0 0' 'SIGTERM leaves no pilot'
is "$(states "$JOB")" 'CANCELLED CANCELLED' 'neither one that waited nor one that ran'
let_go # only now: a pilot that finds its token gone before it is cancelled ends as FAILED
echo 2 >"$STATE/nodes"
start_slurm
ends_as_local 'the next start takes the job up'
await '^0$' rows
is "$GOT" 0 'and nothing is left of what was'
stop_server || not_ok 'it drains'

# ---- TLS: the certificate goes along, and is the only one that pilots trust ---------------------------------------

openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=srnfd -addext \
    subjectAltName=IP:127.0.0.1 -keyout "$SCRATCH/key.pem" -out "$SCRATCH/certificate.pem" 2>/dev/null
export CURL_CA_BUNDLE=$SCRATCH/certificate.pem
start_slurm --tls-certificate "$SCRATCH/certificate.pem" --tls-key "$SCRATCH/key.pem"
URL=https://${URL#http://}
begin 3,2
poll_job "$JOB" 60
is "$JOB_STATUS" successful 'pilots compute over TLS'
is "$(grep -l 'BEGIN CERTIFICATE' "$STATE"/*/script | wc -l)" 1 'with the certificate in the script'
stop_server || not_ok 'it drains'
openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=other -addext \
    subjectAltName=IP:127.0.0.1 -keyout "$SCRATCH/key.pem" -out "$SCRATCH/other.pem" 2>/dev/null
start_server "$DATA" --tls-certificate "$SCRATCH/other.pem" --tls-key "$SCRATCH/key.pem" || exit 1
{
    echo none
    cat "$SCRATCH/certificate.pem"
} >"$SCRATCH/credentials"
"$SRNFD" worker --server "https://${URL#http://}" --token-file - --certificate - <"$SCRATCH/credentials" 2>"$SCRATCH/refused" &
WORKER_PID=$!
SERVER_PIDS+=("$WORKER_PID")
await 'service-gone' cat "$SCRATCH/refused"
like "$GOT" 'service-gone.*certificate' 'a service with another certificate is none'
kill "$WORKER_PID"
wait_server "$WORKER_PID" 20
stop_server || not_ok 'it drains'
await '^0 0$' live
is "$GOT" '0 0' 'no pilot is left'
is "$(cat "$STATE"/*/name | sort | uniq -d)" '' 'no two arrays had the same name: squeue shows those that have ended, too'

done_testing

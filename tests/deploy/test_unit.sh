#!/usr/bin/env bash
# What the service manager sees: READY when the daemon listens, signs of life while it does, STOPPING when it drains;
# and units without errors. The manager's socket is played by a few lines of perl, which every Debian has.
. "$(dirname "$0")/../support/lib.sh"

if command -v systemd-analyze >/dev/null; then
    mkdir -p "$SCRATCH/units"
    for unit in srnfd srnfd-worker; do
        sed "s#^ExecStart=/usr/bin/srnfd#ExecStart=$SRNFD#" "deploy/$unit.service" >"$SCRATCH/units/$unit.service"
        is "$(systemd-analyze verify --man=no "$SCRATCH/units/$unit.service" 2>&1 | grep -i "$unit.service")" '' \
            "the unit $unit has no errors"
    done
else
    skip 'the units have no errors' 'no systemd-analyze'
fi

# The worker's command line is one that it takes.
read -r -a COMMAND < <(sed -n 's/^ExecStart=//p' deploy/srnfd-worker.service)
echo srnf_token >"$SCRATCH/worker-token"
"$SRNFD" "${COMMAND[@]:1:2}" http://192.0.2.1 --token-file "$SCRATCH/worker-token" "${COMMAND[@]:6:4}" 2>"$SCRATCH/said"
is "$? $(grep -c 'must be https' "$SCRATCH/said")" '2 1' 'the command line of the worker is one that it takes'


command -v perl >/dev/null || { skip 'the manager is told' 'no perl'; done_testing; }
SOCKET=$SCRATCH/notify
perl -MSocket -e '
    socket(my $s, AF_UNIX, SOCK_DGRAM, 0) or die; bind($s, sockaddr_un($ARGV[0])) or die; $| = 1;
    while (defined recv($s, my $line, 4096, 0)) { print "$line\n"; last if $line eq "STOPPING=1" }
' "$SOCKET" >"$SCRATCH/told" &
LISTENER=$!
SERVER_PIDS+=("$LISTENER")
for _ in $(seq 100); do
    [ -S "$SOCKET" ] && break
    sleep 0.05
done
export NOTIFY_SOCKET=$SOCKET WATCHDOG_USEC=300000
start_server "$SCRATCH/data" || exit 1
unset NOTIFY_SOCKET WATCHDOG_USEC
sleep 1
if stop_server; then ok 'the daemon drains'; else not_ok 'the daemon drains'; fi
wait "$LISTENER" 2>/dev/null
is "$(head -n 1 "$SCRATCH/told")" READY=1 'it is ready first'
is "$(tail -n 1 "$SCRATCH/told")" STOPPING=1 'it is stopping last'
compare "$(grep -c '^WATCHDOG=1$' "$SCRATCH/told")" '>=' 4 'and gives signs of life in between'
done_testing

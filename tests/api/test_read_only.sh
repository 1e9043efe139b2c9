#!/usr/bin/env bash
# A data folder that the daemon cannot write to: it does not start, and says why. The superuser is not bound by the
# permissions of files, so the daemon runs as somebody else where the test is the superuser's.
. "$(dirname "$0")/../support/lib.sh"

as_user() {
    if [ "$(id -u)" = 0 ]; then
        setpriv --reuid=65534 --regid=65534 --clear-groups "$@"
    else
        "$@"
    fi
}
[ "$(id -u)" != 0 ] || command -v setpriv >/dev/null || skip_all 'setpriv is not installed'
mkdir "$SCRATCH/closed"
cp "$SRNFD" "$SCRATCH/srnfd"
chmod 755 "$SCRATCH" "$SCRATCH/srnfd"
chmod 555 "$SCRATCH/closed"
as_user "$SCRATCH/srnfd" serve --listen 127.0.0.1:0 --data "$SCRATCH/closed" </dev/null >/dev/null 2>"$SCRATCH/error" &
PID=$!
SERVER_PIDS+=("$PID")
wait_server "$PID" 60 || not_ok 'it ends'
is "$SERVER_STATUS" 1 'a folder that is read-only: the daemon does not start'
like "$(jq -r 'select(.event == "failed") | .message' "$SCRATCH/error")" "$SCRATCH/closed.*denied" 'and says why'
is "$(ls "$SCRATCH/closed")" '' 'nothing is left there'
done_testing

#!/usr/bin/env bash
# The same study as test_dashboard.sh in Debian's Firefox, which draws on a display that nobody sees.
# srnfd-test: nightly
. "$(dirname "$0")/../support/lib.sh"
. "$ROOT/tests/support/browser.sh"

for program in firefox-esr Xvfb; do
    command -v $program >/dev/null || skip_all "$program is not installed"
done
browser_ready
start_server "$SCRATCH/data" --workers 2 || exit 1
Xvfb -displayfd 3 -screen 0 1400x1000x24 3>"$SCRATCH/display" >"$SCRATCH/xvfb" 2>&1 &
SCREEN=$!
for _ in $(seq 100); do
    [ -s "$SCRATCH/display" ] && break
    sleep 0.1
done
export SRNFD_BROWSER=firefox LIBGL_ALWAYS_SOFTWARE=1
DISPLAY=:$(cat "$SCRATCH/display")
export DISPLAY
run_steps 400 tests/web/dashboard.cjs "$URL" "$SCRATCH"
kill $SCREEN
stop_server
is $? 0 'the daemon ends well'
done_testing

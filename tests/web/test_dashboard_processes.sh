#!/usr/bin/env bash
# Every process by its form, and the views of slopes, structures, neighbours and landmarks with fifty hostile names, in
# Debian's chromium.
# srnfd-test: nightly
# srnfd-test: timeout 1500
. "$(dirname "$0")/../support/lib.sh"
. "$ROOT/tests/support/browser.sh"

browser_ready
start_server "$SCRATCH/data" --workers 2 || exit 1
run_steps 1400 tests/web/processes.cjs "$URL" "$SCRATCH"
stop_server
is $? 0 'the daemon ends well'
done_testing

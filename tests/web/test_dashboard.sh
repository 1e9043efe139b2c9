#!/usr/bin/env bash
# The dashboard in Debian's chromium: a study from files to results, in some seconds. tests/web/dashboard.cjs has the
# steps; the nightly test has the rest.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"
. "$ROOT/tests/support/browser.sh"

browser_ready
start_server "$SCRATCH/data" --workers 2 || exit 1
run_steps 200 tests/web/dashboard.cjs "$URL" "$SCRATCH"
stop_server
is $? 0 'the daemon ends well'
done_testing

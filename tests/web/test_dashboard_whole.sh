#!/usr/bin/env bash
# All of the dashboard in Debian's chromium: from the example to a report, every page under axe-core in both schemes,
# fifty hostile names, tokens and viewers, a prefix, a daemon that dies and comes back, ten thousand meshes, budgets.
# srnfd-test: nightly
# srnfd-test: timeout 1500
. "$(dirname "$0")/../support/lib.sh"
. "$ROOT/tests/support/browser.sh"

browser_ready
start_server "$SCRATCH/data" --workers 2 || exit 1
run_steps 900 tests/web/whole.cjs "$URL" "$SCRATCH"
"$SRNFD" token add --data "$SCRATCH/tokens" --name ada >"$SCRATCH/user" 2>/dev/null
"$SRNFD" token add --data "$SCRATCH/tokens" --name ada --role viewer >"$SCRATCH/viewer" 2>/dev/null
start_server "$SCRATCH/tokens" --workers 1 --allowed-hosts 127.0.0.1 || exit 1
run_steps 300 tests/web/tokens.cjs "$URL" "$SCRATCH/user" "$SCRATCH/viewer"
run_steps 300 tests/web/restart.cjs "$SRNFD" "$SCRATCH/restarted"
done_testing

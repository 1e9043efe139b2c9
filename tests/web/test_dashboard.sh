#!/usr/bin/env bash
# The dashboard in Debian's chromium: a study from files to results, in some seconds. tests/web/dashboard.cjs has the
# steps; the nightly test has the rest.
# srnfd-test: release-only
. "$(dirname "$0")/../support/lib.sh"

browser_ready() {
    [ -x "${CHROMIUM:-/usr/bin/chromium}" ] || skip_all 'chromium is not installed'
    web/install.sh >"$SCRATCH/npm" 2>&1
    case $? in
    0) ;;
    3) skip_all 'the packages are not installed, and the registry cannot be reached' ;;
    *)
        not_ok 'the packages are installed' "$(head -n 4 "$SCRATCH/npm")"
        done_testing
        ;;
    esac
}

browser_ready
start_server "$SCRATCH/data" --workers 2 || exit 1
HOME=$SCRATCH timeout -k 2 200 node tests/web/dashboard.cjs "$URL" "$SCRATCH" >"$SCRATCH/steps" 2>"$SCRATCH/errors"
STATUS=$?
while IFS=$'\t' read -r verdict name detail; do
    if [ "$verdict" = ok ]; then ok "$name"; else not_ok "$name" "$detail"; fi
done <"$SCRATCH/steps"
is "$STATUS$(head -n 5 "$SCRATCH/errors")" 0 'all steps were taken'
stop_server
is $? 0 'the daemon ends well'
done_testing

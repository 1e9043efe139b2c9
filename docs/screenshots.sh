#!/usr/bin/env bash
# Draws the pictures of docs/dashboard.md anew, from the example, in Debian's chromium: make screenshots
. "$(dirname "$0")/../tests/support/lib.sh"
. "$ROOT/tests/support/browser.sh"

browser_ready
start_server "$SCRATCH/data" --workers 2 || exit 1
HOME=$SCRATCH node docs/screenshots.cjs "$URL" docs/pictures

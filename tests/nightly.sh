#!/usr/bin/env bash
# What "make nightly" runs: of both builds what make check leaves out (the markers in the head of run.sh).
#
#   tests/nightly.sh BUILD-FOLDER ASAN-BUILD-FOLDER
#
# The last line is the sum of both, "N passed, M failed"; the exit status is 1 if M > 0.
set -u
export LC_ALL=C
cd "$(dirname "$0")/.." || exit 2
LOG=$(mktemp) || exit 2
trap 'rm -f "$LOG"' EXIT
passed=0
failed=0
for build in "$@"; do
    SRNFD_NIGHTLY=only tests/run.sh "$build" 2>&1 | tee "$LOG"
    if [[ $(tail -n 1 "$LOG") =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
        passed=$((passed + BASH_REMATCH[1]))
        failed=$((failed + BASH_REMATCH[2]))
    else
        failed=$((failed + 1))
    fi
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]

#!/usr/bin/env bash
# Everything that has threads, under ThreadSanitizer: tests of the server, whole daemons asked over HTTP, in peace and
# by a hostile crowd, tests of the core whose loops are spread over threads, kills under load, and a soak.
#
#   tests/tsan.sh BUILD-FOLDER CORE-TEST..     sources below tests/, of which the tests named after threads run
#
#   REQUESTS=20000 JOBS=200   of the soak
#
# Reports go to files BUILD-FOLDER/report.PID, also those of daemons that a test kills, and are shown at the end. One
# report is a failure, whatever the tests say. tests/tsan.supp, where there is one, names what is not reported.
# The last line reads "N passed, M failed".
set -u
export LC_ALL=C # numbers with a point, messages in English
BUILD=$(cd "$1" && pwd) || exit 2
shift
cd "$(dirname "$0")/.." || exit 2
passed=0
failed=0

# Runs tests and adds what their last line says.
run() { # FILTER
    local more_passed more_failed output=$BUILD/tsan.log
    tests/run.sh "$BUILD" "$1" | tee "$output"
    read -r more_passed _ more_failed _ < <(tail -n 1 "$output")
    passed=$((passed + more_passed))
    failed=$((failed + more_failed))
}

rm -f "$BUILD"/report.*
export TSAN_OPTIONS="second_deadlock_stack=1:allocator_may_return_null=1:log_path=$BUILD/report"
run '^(server|http|crash|api)/'
SRNFD_TEST_FILTER='*thread*' run "^($(IFS='|' && echo "$*"))\$"

# What "make check" leaves out under a sanitizer, but has threads.
export SRNFD_SANITIZED=tsan SRNFD_BUILD=$BUILD SRNFD=$BUILD/srnfd
export REQUESTS=${REQUESTS:-20000} JOBS=${JOBS:-200} GROWTH=${GROWTH:-0.5} SRNFD_KILL_ROUNDS=${SRNFD_KILL_ROUNDS:-1}
for script in tests/crash/test_kill.sh tests/soak/test_soak.sh; do
    echo "$script"
    if "$script"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
    fi
done

reports=0
for file in "$BUILD"/report.*; do
    [ -e "$file" ] || continue
    cat "$file"
    reports=$((reports + $(grep -c 'WARNING: ThreadSanitizer' "$file")))
done
echo "$reports reports of ThreadSanitizer"
failed=$((failed + reports))
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]

#!/usr/bin/env bash
# What "make check" does once everything is installed, in stages:
#
#   release build   gcc, warnings are errors
#   lint            tests/lint/lint.sh, beside the next two
#   asan build      clang with ASan and UBSan, warnings are errors; benchmarks and fuzzers are only compiled
#   release tests   every test but those of make nightly and those that one run is enough for, which the next has
#   asan tests      every test not marked release-only or no-asan, beside the former: they share the processors
#   alone tests     those that measure time, when nothing else runs
#
# A stage that fails does not keep the later ones from running. Each tells its seconds; the output of builds
# is shown only when they fail, and kept in build/check/. Every lint check, every build and every test counts
# as one; the last line is their sum, "N passed, M failed", and the exit status is 1 if M > 0. Needs no
# terminal and no input. The thread sanitizer has its own target, "make tsan".
set -u
export LC_ALL=C # numbers with a point, messages in English
cd "$(dirname "$0")/.." || exit 2
exec </dev/null
# A build inside "make check" is a build of its own: it must not inherit targets' variables or job slots.
unset MAKEFLAGS MFLAGS MAKELEVEL MAKEOVERRIDES CONFIG B O
BUILD=build
LOGS=$BUILD/check
JOBS=${SRNFD_BUILD_JOBS:-$(nproc)}
mkdir -p "$LOGS"

total_passed=0
total_failed=0
summary=

# Runs one stage with its output in a log. KIND says how it counts: a build as one, a report by its last line.
stage() { # KIND NAME COMMAND..
    local kind=$1 name=$2 log=$LOGS/${2// /-}.log started=$SECONDS status
    shift 2
    printf '== %s\n' "$name"
    if [ "$kind" = build ]; then
        "$@" >"$log" 2>&1
        status=$?
        [ "$status" -eq 0 ] || head -n 100 "$log"
    else
        "$@" 2>&1 | tee "$log"
        status=${PIPESTATUS[0]}
    fi
    count "$kind" "$name" "$status" $((SECONDS - started))
}

count() { # KIND NAME STATUS SECONDS
    local kind=$1 name=$2 status=$3 passed=0 failed=0 last
    if [ "$kind" = build ]; then
        [ "$status" -eq 0 ] && passed=1 || failed=1
    else
        last=$(tail -n 1 "$LOGS/${name// /-}.log")
        if [[ $last =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
            passed=${BASH_REMATCH[1]}
            failed=${BASH_REMATCH[2]}
        fi
        # A stage that ends badly without having counted a failure is one.
        if [ "$failed" -eq 0 ] && { [ "$status" -ne 0 ] || [ "$passed" -eq 0 ]; }; then
            failed=1
        fi
    fi
    total_passed=$((total_passed + passed))
    total_failed=$((total_failed + failed))
    printf -v last '%-14s %5d passed, %3d failed  %5d s' "$name" "$passed" "$failed" "$4"
    summary+=$last$'\n'
    printf '== %s\n\n' "$last"
}

# A report that is made beside other stages, and shown and counted by "joined NAME" once it has ended.
declare -A running=()
beside() { # NAME COMMAND..
    local name=$1 log=$LOGS/${1// /-}.log started=$SECONDS
    shift
    {
        "$@" >"$log" 2>&1
        echo "$? $((SECONDS - started))" >"$log.end"
    } &
    running[$name]=$!
}

joined() { # NAME
    local log=$LOGS/${1// /-}.log status took
    wait "${running[$1]}"
    read -r status took <"$log.end"
    printf '== %s\n' "$1"
    cat "$log"
    count report "$1" "$status" "$took"
}

build() { # CONFIG TARGET..
    local config=$1
    shift
    make --no-print-directory -s -k -j"$JOBS" CONFIG="$config" "$@"
}

build_asan() {
    build asan build-tests && build warnings objects
}

# The linter wants the core's objects, so the release build is before it. It mostly uses one processor and waits for
# the registry of its npm packages, so it runs beside the other build.
stage build 'release build' build release build-tests build-benches
beside 'lint' tests/lint/lint.sh
stage build 'asan build' build_asan
joined 'lint'

# Tests of both builds take turns, so that no processor waits for the last of one. As run.sh alone would have them: two
# more than there are processors, as they wait a part of their time.
PLACES=$LOGS/places
rm -f "$PLACES"
mkfifo "$PLACES"
exec 3<>"$PLACES" # what is in a pipe lasts as long as it is open
printf "%.0s." $(seq $(($(nproc) + 2))) >&3
export SRNFD_ONCE=yes SRNFD_TEST_PLACES=$PLACES
SRNFD_ALONE=no beside 'release tests' tests/run.sh $BUILD 3>&-
stage report 'asan tests' tests/run.sh $BUILD/asan 3>&-
joined 'release tests'
SRNFD_ALONE=only stage report 'alone tests' tests/run.sh $BUILD 3>&-

printf '%s' "$summary"
printf 'in all %d s\n' "$SECONDS"
printf '%d passed, %d failed\n' "$total_passed" "$total_failed"
[ "$total_failed" -eq 0 ]

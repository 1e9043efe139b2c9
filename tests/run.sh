#!/usr/bin/env bash
# Runs the tests of one build and counts them.
#
#   tests/run.sh BUILD-FOLDER [FILTER]
#
# What runs: for every tests/**/test_*.c its program BUILD-FOLDER/tests/**/test_*, and every
# tests/**/test_*.sh; with FILTER (an extended regular expression) only those whose source's path matches.
# A source without its program counts as a failure: a test that is not built must not look like none.
#
# Each runs in a process group of its own, two more than there are processors at a time, with stdin closed, a fresh
# TMPDIR, a time limit, and SRNFD (the daemon), SRNFD_BUILD (the folder) and SRNFD_SANITIZED (asan, tsan or empty) set.
# Its standard output is read as TAP, its standard error is shown when it fails.
#
# What counts: each "ok" is a pass or a skip, each "not ok" a failure. One failure more is a program that
# ends with an error though every line was ok, is killed, runs out of time, reports another number of tests
# than it planned, plans none, or leaves processes behind.
#
# A test's source may carry marker lines among its first twenty:
#   srnfd-test: release-only    is left out of sanitizer builds
#   srnfd-test: no-asan (WHY)   is left out of the build with ASan, where tests that WHY names run the same code
#   srnfd-test: plain-core (WHY)  with ASan, its daemon has the core of the release build, as it waits for numerics that
#                               tests that WHY names run with ASan
#   srnfd-test: once (WHY)      make check runs it with ASan alone, and not in the release build too
#   srnfd-test: alone           runs when no other test does (it measures time)
#   srnfd-test: nightly         is left out, and runs in make nightly
#   srnfd-test: slow            is left out of make quick, and starts before the others, so that the last to end is short
#   srnfd-test: waits           mostly sleeps, for limits of time: it starts first and does not count as one at a time
#   srnfd-test: timeout N       may take N seconds instead of 300 (twice that in sanitizer builds)
#
# Environment: SRNFD_NIGHTLY ("only": what make check leaves out of this build and nothing else: of a release build the
# tests marked nightly or once, of one with ASan those marked no-asan or plain-core, with ASan in all of the daemon),
# SRNFD_ONCE (leave out those marked once, except
# with ASan), SRNFD_QUICK (leave out those marked slow or alone), SRNFD_ALONE ("no" or "only" those marked alone),
# SRNFD_TEST_JOBS (two more than processors), SRNFD_TEST_PLACES (a named pipe with a byte for each test that
# may run at a time, for several runs that share them), SRNFD_TEST_TIMEOUT (300), SRNFD_TESTS (this folder).
# Each report tells how long the test took and, in brackets, its processor time, which says more on a busy machine;
# the ten that needed most of it are listed at the end.
# The last line reads "N passed, M failed"; the exit status is 1 if M > 0. Of the tests that match a FILTER those that are
# left out are named before, with the marker that says so; where no test is left to run, the status is 2.
set -u
export LC_ALL=C # numbers with a point, messages in English

if [ $# -lt 1 ] || [ $# -gt 2 ] || [ ! -d "$1" ]; then
    echo "usage: tests/run.sh BUILD-FOLDER [FILTER]" >&2
    exit 2
fi
BUILD=$(cd "$1" && pwd)
FILTER=${2-}
TESTS=${SRNFD_TESTS:-$(dirname "$0")}
TESTS=$(cd "$TESTS" && pwd)
PROCESSORS=$(nproc 2>/dev/null || echo 2)
JOBS=${SRNFD_TEST_JOBS:-$((PROCESSORS + 2))} # tests wait a part of their time
LIMIT=${SRNFD_TEST_TIMEOUT:-300}
SHOWN_LINES=150 # of the output of a test that failed, from its end

SRNFD=$BUILD/srnfd
SRNFD_BUILD=$BUILD
SRNFD_SANITIZED=
SLOWER=1 # times what a release build takes
for kind in asan tsan; do
    if [ "${BUILD##*/}" = $kind ] || grep -qa "__${kind}_init" "$SRNFD" 2>/dev/null; then
        SRNFD_SANITIZED=$kind
        SLOWER=2
    fi
done
export SRNFD SRNFD_BUILD SRNFD_SANITIZED
# Test programs compute with the kernels that the daemon chose for itself (server/main/kernels.h).
KERNELS=$("$SRNFD" version 2>/dev/null | sed -n 's/^openblas .*, //p')
[ -z "$KERNELS" ] || export OPENBLAS_CORETYPE="$KERNELS"
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_stack_use_after_return=1:allocator_may_return_null=1}
export UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1}
export TSAN_OPTIONS=${TSAN_OPTIONS:-second_deadlock_stack=1:allocator_may_return_null=1}
if [ "$SRNFD_SANITIZED" = tsan ] && [ -f "$TESTS/tsan.supp" ]; then
    export TSAN_OPTIONS="$TSAN_OPTIONS:suppressions=$TESTS/tsan.supp"
fi

cd "$TESTS/.." || exit 2
WORK=$(mktemp -d "${TMPDIR:-/tmp}/srnfd-tests.XXXXXX") || exit 2

# Tests have sessions of their own, so that an interrupt at the keyboard does not reach them by itself.
clean_up() {
    local file
    for file in "$WORK"/*.pid; do
        [ -e "$file" ] && kill -KILL -- "-$(cat "$file")" 2>/dev/null
    done
    rm -rf "$WORK"
}
trap clean_up EXIT
trap 'exit 130' INT TERM HUP

sources=$(find "$TESTS" \( -name 'test_*.c' -o -name 'test_*.sh' \) -type f | sort)

# The markers of all sources: MARKERS[SOURCE NAME] is the marker's value, "yes" if it has none.
declare -A MARKERS
while IFS=$'\t' read -r source name value; do
    MARKERS[$source $name]=$value
done < <([ -z "$sources" ] || tr '\n' '\0' <<<"$sources" | xargs -0 awk '
    FNR > 20 { nextfile }
    sub(/^[#\/* ]*srnfd-test: /, "") {
        name = value = $0
        sub(/[^a-z-].*/, "", name)
        sub(/^[a-z-]* */, "", value)
        sub(/[^0-9].*/, "", value)
        print FILENAME "\t" name "\t" (value == "" ? "yes" : value)
    }')

marker() { # SOURCE NAME
    [ -n "${MARKERS[$1 $2]-}" ]
}

# Whether a test is left out, and WHY: the marker that says so, or "by day" where only those of the night run.
left_out() { # SOURCE
    local missed=nightly # what the night makes up for
    WHY=
    [ "$SRNFD_SANITIZED" != asan ] || missed=no-asan
    if [ -n "$SRNFD_SANITIZED" ] && marker "$1" release-only; then
        WHY=release-only
    elif [ "${SRNFD_NIGHTLY:-}" = only ]; then
        WHY='by day'
        if [ $missed = nightly ]; then
            if marker "$1" nightly || marker "$1" once; then WHY=; fi
        elif marker "$1" no-asan || marker "$1" plain-core; then
            WHY=
        fi
    elif marker "$1" nightly; then
        WHY=nightly
    elif marker "$1" $missed; then
        WHY=$missed
    elif [ -n "${SRNFD_ONCE:-}" ] && [ "$SRNFD_SANITIZED" != asan ] && marker "$1" once; then
        WHY=once
    elif [ -n "${SRNFD_QUICK:-}" ] && marker "$1" slow; then
        WHY=slow
    elif { [ -n "${SRNFD_QUICK:-}" ] || [ "${SRNFD_ALONE:-}" = no ]; } && marker "$1" alone; then
        WHY=alone
    elif [ "${SRNFD_ALONE:-}" = only ] && ! marker "$1" alone; then
        WHY='not alone'
    fi
    [ -n "$WHY" ]
}

# Reads TAP on stdin and prints "passed failed skipped" and, from the second line on, what is wrong with the
# stream as a whole. Several plans in one stream (several cmocka groups) add up.
read_tap() {
    awk '
        /^1\.\.[0-9]+/ {
            plans++
            split($1, range, /\.\./)
            planned += range[2]
            if (range[2] == 0 && toupper($0) ~ /# *SKIP/) skipped_whole = 1
        }
        /^(not )?ok([ \t]|$)/ {
            reported++
            if (toupper($0) ~ /# *SKIP/) skipped++
            else if ($1 == "ok") passed++
            else failed++
        }
        /^Bail out!/ { wrong = wrong "\n" $0 }
        END {
            if (!plans) wrong = wrong "\nno plan: it ended before its tests did"
            else if (planned != reported) wrong = wrong "\n" planned " planned, " reported + 0 " reported"
            else if (!reported && !skipped_whole) wrong = wrong "\nno test at all"
            if (skipped_whole) skipped++
            print passed + 0, failed + 0, skipped + 0 wrong
        }'
}

# True once nothing of a process group runs any more, false if two seconds were not enough for that.
# Orphans that ended but that nobody has reaped, as happens in containers, do not count.
group_ended() { # GROUP
    local running
    for _ in {1..20}; do
        kill -0 -- "-$1" 2>/dev/null || return 0
        running=$(sed -n "s/^\([0-9]*\) (.*) [^ZX] [0-9]* $1 .*/\1/p" /proc/[0-9]*/stat 2>/dev/null)
        [ -n "$running" ] || return 0
        sleep 0.1
    done
    return 1
}

# Processor time of what a shell started and waited for, in tenths of a second, as "used". Here and in run_one a shell
# does what it can by itself: there are hundreds of tests, and each program that is started for one takes milliseconds.
processor_time() { # reads what "times" printed
    local part minutes seconds spent
    used=0
    read -r _ && read -r -a spent
    for part in "${spent[@]}"; do # as 1m2.345s
        minutes=${part%m*} seconds=${part#*m} seconds=${seconds%s}
        used=$((used + 60000 * minutes + 1000 * ${seconds%.*} + 10#${seconds#*.}))
    done
    used=$((used / 100))
}

# Runs one test and leaves NAME.counts ("passed failed skipped"), NAME.time and NAME.report in $WORK.
run_one() { # NUMBER SOURCE PROGRAM
    local number=$1 source=$2 program=$3 name=${2#"$TESTS/"} base=$WORK/$1
    local limit passed failed skipped wrong status pid started took used verdict
    limit=${MARKERS[$source timeout]-yes}
    [ "$limit" != yes ] || limit=$LIMIT
    limit=$((SLOWER * limit))
    started=${EPOCHREALTIME/./}
    mkdir "$base.tmp"
    if [ "$SRNFD_SANITIZED" = asan ] && [ "${SRNFD_NIGHTLY:-}" != only ] && marker "$source" plain-core; then
        local SRNFD=$BUILD/srnfd-plain-core # exported, as what it hides is
    fi
    TMPDIR=$base.tmp setsid timeout -k 5 "$limit" "$program" </dev/null >"$base.out" 2>"$base.err" &
    pid=$!
    echo "$pid" >"$base.pid"
    wait "$pid"
    status=$?
    took=$(((${EPOCHREALTIME/./} - started) / 100000))
    times >"$base.times" # not in a pipe: that would be another shell
    processor_time <"$base.times"
    echo "$used $name" >"$base.time"

    { read -r passed failed skipped && IFS= read -r -d '' wrong; } < <(read_tap <"$base.out")
    wrong=${wrong%$'\n'}
    if [ "$status" -eq 124 ] || { [ "$status" -eq 137 ] && [ $((took / 10)) -ge "$limit" ]; }; then
        wrong="timed out after $limit s"
    elif [ "$status" -gt 128 ]; then
        wrong="killed by signal $((status - 128)) ($(kill -l $((status - 128))))"
    elif [ "$status" -ne 0 ] && [ "$failed" -eq 0 ] && [ -z "$wrong" ]; then
        wrong="exit status $status though no test failed"
    fi
    if ! group_ended "$pid"; then
        kill -KILL -- "-$pid" 2>/dev/null
        wrong="${wrong:+$wrong; }left processes behind"
    fi
    [ -z "$wrong" ] || failed=$((failed + 1))

    verdict=ok
    [ "$failed" -eq 0 ] || verdict=FAILED
    {
        printf '%-6s %s: %d passed' "$verdict" "$name" "$passed"
        [ "$failed" -eq 0 ] || printf ', %d failed' "$failed"
        [ "$skipped" -eq 0 ] || printf ', %d skipped' "$skipped"
        printf ' (%d.%d s) [%d.%d s]\n' $((took / 10)) $((took % 10)) $((used / 10)) $((used % 10))
        if [ "$failed" -gt 0 ]; then
            [ -z "$wrong" ] || printf '       %s\n' "$wrong"
            sed 's/^/  | /' "$base.out" | tail -n "$SHOWN_LINES"
            sed 's/^/  ! /' "$base.err" | tail -n "$SHOWN_LINES"
        elif [ "$skipped" -gt 0 ]; then
            grep -i '# *skip' "$base.out" | sed 's/^/  | /'
        fi
    } >"$base.report"
    echo "$passed $failed $skipped" >"$base.counts"
    rm -rf "$base.tmp" "$base.pid"
    : >"$base.done"
}

report_missing() { # NUMBER SOURCE
    printf 'FAILED %s: its program is not built\n' "${2#"$TESTS/"}" >"$WORK/$1.report"
    echo "0 1 0" >"$WORK/$1.counts"
    : >"$WORK/$1.done"
}

# Prints the reports that are there and not yet printed.
flush() {
    local ended=("$WORK"/*.done)
    [ -e "${ended[0]}" ] || return 0
    cat "${ended[@]/%.done/.report}"
    rm "${ended[@]}"
}

number=0
waiting=()
long=()
together=()
alone=()
missing=() # what matches and is left out
by_night=
while IFS= read -r source; do
    if [ -z "$source" ] || ! [[ ${source#"$TESTS/"} =~ $FILTER ]]; then
        continue
    fi
    if left_out "$source"; then
        missing+=("${source#"$TESTS/"} ($WHY)")
        case $WHY in nightly | no-asan | once) by_night=yes ;; esac
        continue
    fi
    if marker "$source" alone; then
        alone+=("$source")
    elif marker "$source" waits; then
        waiting+=("$source")
    elif marker "$source" slow; then
        long+=("$source")
    else
        together+=("$source")
    fi
done <<<"$sources"

# Who names tests is told of those that do not run; where none does, that is an error.
LEFT_OUT_SHOWN=5
if [ -n "$FILTER" ] && [ ${#missing[@]} -gt 0 ]; then
    printf -v said ', %s' "${missing[@]:0:LEFT_OUT_SHOWN}"
    [ ${#missing[@]} -le $LEFT_OUT_SHOWN ] || said+=", and $((${#missing[@]} - LEFT_OUT_SHOWN)) more"
    echo "left out: ${said#, }${by_night:+; SRNFD_NIGHTLY=only runs what is left to the night}"
fi
if [ -n "$FILTER" ] && [ $((${#waiting[@]} + ${#long[@]} + ${#together[@]} + ${#alone[@]})) -eq 0 ]; then
    [ ${#missing[@]} -gt 0 ] || echo "no test matches \"$FILTER\"" >&2
    exit 2
fi

start() { # SOURCE [placed]
    local program=$1
    number=$((number + 1))
    if [ "${program##*.}" = c ]; then
        program=$BUILD/tests/${program#"$TESTS/"}
        program=${program%.c}
    fi
    if [ ! -x "$program" ]; then
        report_missing "$number" "$1"
        [ -z "${2-}" ] || leave_place
        return
    fi
    {
        run_one "$number" "$1" "$program"
        [ -z "${2-}" ] || leave_place
    } &
    [ -z "${2-}" ] || placed[$!]=yes
}

declare -A placed=() # by process id: tests that take a place
take_place() {
    if [ -n "${SRNFD_TEST_PLACES-}" ]; then
        read -r -n 1 _ <>"$SRNFD_TEST_PLACES" # without a time limit: bash loses what it reads as the time is up
        flush
        return
    fi
    while [ "${#placed[@]}" -ge "$JOBS" ]; do
        wait -n -p ended
        unset "placed[$ended]"
        flush
    done
}

leave_place() {
    [ -z "${SRNFD_TEST_PLACES-}" ] || printf . 1<>"$SRNFD_TEST_PLACES"
}

for source in ${waiting[@]+"${waiting[@]}"}; do
    start "$source"
done
for source in ${long[@]+"${long[@]}"} ${together[@]+"${together[@]}"}; do
    take_place
    start "$source" placed
done
wait
flush
for source in ${alone[@]+"${alone[@]}"}; do
    start "$source"
    wait
    flush
done

cat "$WORK"/*.time 2>/dev/null | sort -rn | awk '
    { all += $1 }
    NR <= 10 && $1 > 0 { most = most sprintf("  %7.1f  %s\n", $1 / 10, $2) }
    END { if (most) printf "processor time %.1f s, most of it:\n%s", all / 10, most }'
cat "$WORK"/*.counts 2>/dev/null | awk '
    { passed += $1; failed += $2; skipped += $3 }
    END {
        if (skipped) printf "%d skipped\n", skipped
        printf "%d passed, %d failed\n", passed, failed
        exit failed > 0
    }'
exit "${PIPESTATUS[1]}"

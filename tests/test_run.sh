#!/usr/bin/env bash
# tests/run.sh counts right: fake tests that pass, fail, crash, hang, plan wrongly, leave processes behind,
# or are not built.
# srnfd-test: release-only
. "$(dirname "$0")/support/lib.sh"
unset SRNFD_QUICK SRNFD_NIGHTLY SRNFD_ONCE SRNFD_ALONE SRNFD_TEST_PLACES # of the run that this test is part of

FAKE=$SCRATCH/fake
mkdir -p "$FAKE/tests/deep" "$FAKE/build/tests/deep"

# A shell test of that name, from standard input.
script() { # NAME
    { echo '#!/usr/bin/env bash' && cat; } >"$FAKE/tests/$1"
    chmod +x "$FAKE/tests/$1"
}

# A C test: an (empty) source, and as its program a script from standard input.
program() { # NAME
    : >"$FAKE/tests/$1.c"
    { echo '#!/usr/bin/env bash' && cat; } >"$FAKE/build/tests/$1"
    chmod +x "$FAKE/build/tests/$1"
}

# Runs the runner; OUTPUT, LAST (line) and RESULT (status).
run() { # [FILTER]
    OUTPUT=$(SRNFD_TESTS=$FAKE/tests tests/run.sh "$FAKE/build" "$@" 2>&1)
    RESULT=$?
    LAST=$(tail -n 1 <<<"$OUTPUT")
}

program test_pass <<'END'
echo 1..2; echo 'ok 1 - a'; echo 'ok 2 - b'
END
program deep/test_groups <<'END'
echo 1..1; echo 'ok 1 - a'; echo 1..2; echo 'ok 1 - b'; echo 'ok 2 - c'
END
script test_late_plan.sh <<'END'
echo 'ok 1 - a'; echo 1..1
END
run
is "$LAST" '6 passed, 0 failed' 'passes of programs, of several plans in one, and of scripts add up'
is "$RESULT" 0 'and the status is 0'

run 'deep/'
is "$LAST" '3 passed, 0 failed' 'a filter chooses by path'

program test_skip <<'END'
echo 1..3; echo 'ok 1 - a'; echo 'ok 2 - b # SKIP no data'; echo 'not ok 3 # SKIP c'
END
script test_skip_all.sh <<'END'
echo '1..0 # SKIP nothing to test here'
END
run 'skip'
is "$LAST" '1 passed, 0 failed' 'skipped tests are neither passes nor failures'
like "$OUTPUT" '3 skipped' 'but they are counted'
like "$OUTPUT" 'nothing to test here' 'and their reasons are shown'

script test_long.sh <<'END'
# srnfd-test: nightly
echo 1..1; echo 'ok 1 - a'
END
run 'long|pass'
is "$LAST" '2 passed, 0 failed' 'what is marked nightly is left out'
like "$OUTPUT" 'left out: test_long\.sh \(nightly\).*SRNFD_NIGHTLY=only' 'which is said where a filter names it'
SRNFD_NIGHTLY=only run 'long|pass'
is "$LAST" '1 passed, 0 failed' 'and runs, alone, where the night is asked for'
run
unlike "$OUTPUT" 'left out' 'without a filter nothing is said of it'
run 'long'
is "$RESULT" 2 'a filter that leaves nothing to run is an error'
like "$LAST" 'left out: test_long\.sh \(nightly\).*SRNFD_NIGHTLY=only' 'and the last line says what would'
run 'nosuch'
is "$RESULT" 2 'a filter that nothing matches is one, too'
is "$LAST" 'no test matches "nosuch"' 'and the last line says so'

script test_slow.sh <<'END'
# srnfd-test: slow
echo 1..1; echo 'ok 1 - a'
END
run 'slow|pass'
is "$LAST" '3 passed, 0 failed' 'what is marked slow runs'
SRNFD_QUICK=1 run 'slow|pass'
is "$LAST" '2 passed, 0 failed' 'but not where a quick look is asked for'

script test_busy.sh <<'END'
awk 'BEGIN { for (i = 0; i < 4e7; i++) x += i }'; echo 1..1; echo 'ok 1 - a'
END
run 'busy|pass'
like "$OUTPUT" 'most of it:.* [0-9]+\.[0-9]  test_busy\.sh' 'a test that computes is listed with its processor time'

# Each of these must count as exactly this many failures, with a word that says why.
expect() { # NAME COUNT REASON
    run "/?$1\\."
    is "$LAST" "$2" "$1: $2"
    is "$RESULT" 1 "$1: the status says so"
    like "$OUTPUT" "$3" "$1: the report says why"
}

program test_fail <<'END'
echo 1..2; echo 'ok 1 - a'; echo 'not ok 2 - b'; echo 'b was 3' >&2; exit 1
END
expect test_fail '1 passed, 1 failed' 'b was 3'

program test_fail_quietly <<'END'
echo 1..1; echo 'not ok 1 - a'
END
expect test_fail_quietly '0 passed, 1 failed' 'not ok 1 - a'

program test_crash <<'END'
echo 1..3; echo 'ok 1 - a'; kill -SEGV $$
END
expect test_crash '1 passed, 1 failed' 'killed by signal 11'

program test_exit <<'END'
echo 1..1; echo 'ok 1 - a'; exit 3
END
expect test_exit '1 passed, 1 failed' 'exit status 3'

script test_short.sh <<'END'
echo 1..4; echo 'ok 1 - a'
END
expect test_short '1 passed, 1 failed' '4 planned, 1 reported'

script test_long.sh <<'END'
echo 1..1; echo 'ok 1 - a'; echo 'ok 2 - b'
END
expect test_long '2 passed, 1 failed' '1 planned, 2 reported'

script test_no_plan.sh <<'END'
echo 'ok 1 - a'
END
expect test_no_plan '1 passed, 1 failed' 'no plan'

script test_silent.sh <<'END'
END
expect test_silent '0 passed, 1 failed' 'no plan'

script test_empty_plan.sh <<'END'
echo 1..0
END
expect test_empty_plan '0 passed, 1 failed' 'no test at all'

script test_bail.sh <<'END'
echo 1..1; echo 'ok 1 - a'; echo 'Bail out! no disk'
END
expect test_bail '1 passed, 1 failed' 'no disk'

script test_hang.sh <<'END'
# srnfd-test: timeout 1
echo 1..1; echo 'ok 1 - a'; sleep 60
END
started=$SECONDS
expect test_hang '1 passed, 1 failed' 'timed out after 1 s'
compare $((SECONDS - started)) '<' 20 'a test that hangs is ended'
mv "$FAKE/build" "$FAKE/asan"
like "$(SRNFD_TESTS=$FAKE/tests tests/run.sh "$FAKE/asan" test_hang)" 'timed out after 2 s' \
    'in a sanitizer build after twice the time'
mv "$FAKE/asan" "$FAKE/build"

script test_leave.sh <<'END'
sleep 60 & echo $! >../left; echo 1..1; echo 'ok 1 - a'
END
sed -i "s|../left|$FAKE/left|" "$FAKE/tests/test_leave.sh"
expect test_leave '1 passed, 1 failed' 'left processes behind'
unlike "$(cat "/proc/$(cat "$FAKE/left")/stat" 2>/dev/null)" '\) [^ZX] ' 'and what was left is ended'

: >"$FAKE/tests/test_unbuilt.c"
expect test_unbuilt '0 passed, 1 failed' 'not built'

# The rooms of two tests: each sees a folder of its own, empty, and no standard input.
for name in test_room_1 test_room_2; do
    script "$name.sh" <<'END'
echo 1..2
[ -d "$TMPDIR" ] && [ -z "$(ls -A "$TMPDIR")" ] && echo 'ok 1 - an empty folder'
touch "$TMPDIR/mine"
read -r line || echo 'ok 2 - no input'
END
done
run 'test_room'
is "$LAST" '4 passed, 0 failed' 'each test has a fresh folder and a closed standard input'

script test_lone.sh <<'END'
# srnfd-test: alone
echo 1..1; [ -z "$(ls "$MEETING" 2>/dev/null)" ] && echo 'ok 1 - alone'
END
script test_lone_neighbour.sh <<'END'
mkdir -p "$MEETING"; touch "$MEETING/here"; sleep 0.5; rm "$MEETING/here"; echo 1..1; echo 'ok 1 - a'
END
export MEETING=$FAKE/meeting
run 'test_lone'
is "$LAST" '2 passed, 0 failed' 'a test that wants to be alone is'

SRNFD_ALONE=no run 'test_lone'
is "$LAST" '1 passed, 0 failed' 'is left out where it is run by itself'
SRNFD_ALONE=only run 'test_lone'
is "$LAST" '1 passed, 0 failed' 'and there nothing else is'

# Two runs that share one place: what each leaves, the other takes.
mkfifo "$FAKE/places"
exec 8<>"$FAKE/places"
printf . >&8
for name in test_share_1 test_share_2 test_share_3; do
    script "$name.sh" <<'END'
echo 1..1; mkdir "$MEETING.place" && echo 'ok 1 - a'; sleep 0.1; rmdir "$MEETING.place"
END
done
: >"$FAKE/tests/test_share_nothing.c" # takes a place and has no program
SRNFD_TEST_PLACES=$FAKE/places SRNFD_TESTS=$FAKE/tests tests/run.sh "$FAKE/build" test_share >"$FAKE/other" 2>&1 &
OTHER=$!
SRNFD_TEST_PLACES=$FAKE/places run 'test_share'
wait "$OTHER"
is "$LAST, $(tail -n 1 "$FAKE/other")" '3 passed, 1 failed, 3 passed, 1 failed' 'runs that share places keep to them together'
read -r -n 2 -t 0.1 -u 8 LEFT
is "$LEFT" . 'and leave as many as there were'
exec 8>&-
rm "$FAKE/tests/test_share_nothing.c"

script test_waits.sh <<'END'
# srnfd-test: waits
echo 1..1
for _ in $(seq 200); do [ ! -e "$MEETING.came" ] || { echo 'ok 1 - a'; exit; }; sleep 0.05; done
echo 'not ok 1 - nothing runs beside it'
END
script test_waits_not.sh <<'END'
touch "$MEETING.came" "$MEETING.busy"; sleep 0.3; rm "$MEETING.busy"; echo 1..1; echo 'ok 1 - a'
END
script test_waits_turn.sh <<'END'
[ ! -e "$MEETING.busy" ] && echo 'ok 1 - a'; echo 1..1
END
SRNFD_TEST_JOBS=1 run 'test_waits'
is "$LAST" '3 passed, 0 failed' 'a test that waits takes no place; the others keep to theirs'

script test_release.sh <<'END'
# srnfd-test: release-only
echo 1..1; echo 'ok 1 - a'
END
run 'test_release'
is "$LAST" '1 passed, 0 failed' 'a release-only test runs in a release build'
echo '__asan_init' >"$FAKE/build/srnfd"
run 'test_release|test_pass'
is "$LAST" '2 passed, 0 failed' 'and not in a sanitizer build'
like "$OUTPUT" 'left out: test_release\.sh \(release-only\)' 'which is said, too'
unlike "$OUTPUT" 'SRNFD_NIGHTLY' 'without a way that does not help'
script test_elsewhere.sh <<'END'
# srnfd-test: no-asan (test_pass.sh runs its code)
echo 1..1; echo 'ok 1 - a'
END
run 'test_elsewhere|test_pass'
is "$LAST" '2 passed, 0 failed' 'what others run under ASan is left out there'
like "$OUTPUT" 'left out: test_elsewhere\.sh \(no-asan\).*SRNFD_NIGHTLY=only' 'and said to run by night'
SRNFD_NIGHTLY=only run 'test_elsewhere|test_pass|test_long'
is "$LAST" '1 passed, 0 failed' 'and runs with it by night, without what is nightly'
script test_plain_core.sh <<'END'
# srnfd-test: plain-core (test_pass.sh runs its numerics)
echo 1..1; [ "${SRNFD##*/}" = srnfd-plain-core ] && echo 'ok 1 - a' || echo 'not ok 1 - a'
END
run 'test_plain_core|test_pass'
is "$LAST" '3 passed, 0 failed' 'who waits for numerics has a daemon with the core of the release build'
SRNFD_NIGHTLY=only run 'test_plain_core|test_pass'
is "$LAST" '0 passed, 1 failed' 'and by night that with ASan in all of it'
echo '__tsan_init' >"$FAKE/build/srnfd"
run 'test_plain_core|test_pass'
is "$LAST" '2 passed, 1 failed' 'and so in other builds'
run 'test_elsewhere|test_pass'
is "$LAST" '3 passed, 0 failed' 'and is left out only there'
rm "$FAKE/build/srnfd"

script test_once.sh <<'END'
# srnfd-test: once (as with ASan)
echo 1..1; echo 'ok 1 - a'
END
run 'test_once|test_pass'
is "$LAST" '3 passed, 0 failed' 'what need not run in both builds runs'
SRNFD_ONCE=yes run 'test_once|test_pass'
is "$LAST" '2 passed, 0 failed' 'but not where the other build has it'
echo '__asan_init' >"$FAKE/build/srnfd"
SRNFD_ONCE=yes run 'test_once|test_pass'
is "$LAST" '3 passed, 0 failed' 'which is the one with ASan'
rm "$FAKE/build/srnfd"
SRNFD_NIGHTLY=only run 'test_once|test_pass|test_elsewhere'
is "$LAST" '1 passed, 0 failed' 'and by night'

SRNFD_TESTS=$FAKE/tests tests/run.sh "$FAKE/nowhere" >/dev/null 2>&1
is $? 2 'a folder that is not there is a usage error'

done_testing

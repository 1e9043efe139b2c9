#!/bin/sh
# Runs every fuzz target that has been built, for a number of seconds each.
#
#   tests/fuzz/run.sh BUILD-FOLDER SECONDS [TARGET...]
#
# The inputs of tests/fuzz/corpus/<format> are the start. What the fuzzers add to them is thrown away; with
# FUZZ_KEEP=FOLDER it is left in FOLDER/<format>. Inputs that break something are kept in
# BUILD-FOLDER/findings, and make the exit status 1.
set -u
export LC_ALL=C # numbers with a point, messages in English

build=${1:?build folder}
seconds=${2:?seconds for each target}
shift 2
here=$(dirname "$0")
findings=$build/findings
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM
mkdir -p "$findings"
passed=0
failed=0

for target in "$build"/tests/fuzz/fuzz_*; do
    if [ ! -f "$target" ] || [ ! -x "$target" ]; then
        continue
    fi
    name=${target##*/fuzz_}
    if [ $# -gt 0 ]; then
        case " $* " in
        *" $name "*) ;;
        *) continue ;;
        esac
    fi
    added=${FUZZ_KEEP:-$work}/$name
    mkdir -p "$added"
    set_dictionary=
    [ -f "$here/dictionary/$name.dict" ] && set_dictionary=-dict=$here/dictionary/$name.dict
    if "$target" -max_total_time="$seconds" -max_len=4096 -rss_limit_mb=1024 -timeout=5 \
        -print_final_stats=1 -artifact_prefix="$findings/$name-" ${set_dictionary:+"$set_dictionary"} \
        "$added" "$here/corpus/$name" >"$work/$name.log" 2>&1; then
        passed=$((passed + 1))
        runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$work/$name.log")
        cover=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$work/$name.log" | tail -n 1)
        echo "ok - $name: ${runs:-?} inputs in $seconds s, ${cover:-?} edges"
    else
        failed=$((failed + 1))
        echo "not ok - $name"
        tail -n 40 "$work/$name.log"
    fi
done
echo "$passed targets without a finding, $failed with one"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]

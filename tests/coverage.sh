#!/usr/bin/env bash
# Line coverage of core/ and server/, from a build with CONFIG=coverage whose tests have been run.
#
#   tests/coverage.sh BUILD-FOLDER
#
# gcov tells for each object which lines with code were run; a line counts once, under the file that it is in
# (headers count where they are included from the same folder's objects). Prints the percentage of each part, the
# twenty files that miss the most lines, and fails below CORE_LEAST and SERVER_LEAST. A daemon that a test
# kills takes its counts with it, so that the figure is a lower bound.
set -u
export LC_ALL=C # numbers with a point, messages in English
cd "$(dirname "$0")/.." || exit 2
BUILD=${1:?build folder}
CORE_LEAST=${CORE_LEAST:-95}
SERVER_LEAST=${SERVER_LEAST:-88}

WORK=$(mktemp -d) || exit 2
trap 'rm -rf "$WORK"' EXIT

# An object that no program ran has notes and no counts; gcov takes those as zero.
find "$BUILD/obj/core" "$BUILD/obj/server" -name '*.gcno' | while IFS= read -r notes; do
    gcov --json-format --stdout "$notes" 2>/dev/null
done | jq -r '.files[] | select(.file | test("^(core|server)/")) | .file as $file |
    .lines[] | "\($file)\t\(.line_number)\t\(.count)"' >"$WORK/lines"

[ -s "$WORK/lines" ] || {
    echo 'coverage: no counts: build with CONFIG=coverage and run the tests first' >&2
    exit 1
}

awk -F '\t' -v core="$CORE_LEAST" -v server="$SERVER_LEAST" '
    { key = $1 FS $2; if (!(key in count)) { n[$1]++ } count[key] += $3 }
    END {
        for (key in count) if (count[key] > 0) { split(key, at, FS); run[at[1]]++ }
        for (file in n) {
            part = file; sub("/.*", "", part)
            lines[part] += n[file]; hit[part] += run[file]
            printf "%6d %6.1f %%  %s\n", n[file] - run[file], 100 * run[file] / n[file], file | "sort -rn | head -n 20"
        }
        close("sort -rn | head -n 20")
        least["core"] = core; least["server"] = server
        for (part in least) {
            share = lines[part] ? 100 * hit[part] / lines[part] : 0
            printf "%s: %d of %d lines, %.1f %% (at least %s %%)\n", part, hit[part], lines[part], share, least[part]
            if (share < least[part]) failed = 1
        }
        exit failed
    }' "$WORK/lines"

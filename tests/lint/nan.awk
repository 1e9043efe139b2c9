# Comparisons in tests that no NaN fails, in any number of C files:
#
#   awk -f nan.awk FILE..
#
# prints "file:line: what" for
#   - fmax and fmin, which drop a NaN (support/compare.h has forms that keep it),
#   - a double that keeps the larger or smaller by hand: if (d > worst) { worst = d; } and
#     worst = d > worst ? d : worst, which drop it too,
#   - assert_false(a > b) and assert_true(!(a > b)), which a NaN passes.
#
# A name is a double where a line before in its file declares it so. Comments are expected to be sentences, not
# code.

function report(what) {
    printf "%s:%d: %s\n", FILENAME, FNR, what
}

# The line without what looks like a comparison and is none.
function comparisons(line) {
    gsub(/->|<<|>>/, " ", line)
    return line
}

# The last name of "... > name".
function compared(text,    words, n) {
    n = split(text, words, /[^A-Za-z0-9_]+/)
    return words[n]
}

FNR == 1 {
    split("", is_double)
    kept = ""
}

/^ *\*|^ *\/\*/ { next }

/^ *(static |const )*double [^(]*[;,=]/ {
    line = $0
    gsub(/= [^,;]*/, "", line)
    n = split(line, words, /[^A-Za-z0-9_]+/)
    for (i = 1; i <= n; i++) is_double[words[i]] = 1
}

/(^|[^A-Za-z0-9_])fm(ax|in)[fl]?\(/ { report("fmax and fmin drop a NaN: compare_max, compare_min") }

comparisons($0) ~ /assert_false\(.*[<>]/ || comparisons($0) ~ /assert_true\(!\(.*[<>]/ {
    report("a NaN passes a comparison that is denied")
}

kept != "" && $1 == kept && $2 == "=" { report("a NaN is not kept in " kept ": compare_max, compare_min") }

{ kept = "" }

# if (d > worst) {  or  if (d > worst)
comparisons($0) ~ /^ *(\} else )?if \(.*[<>]=? [A-Za-z_0-9]+\)( \{)?$/ {
    line = $0
    sub(/\)( \{)?$/, "", line)
    if (compared(line) in is_double) kept = compared(line)
}

# worst = d > worst ? d : worst;
comparisons($0) ~ /^ *[A-Za-z_0-9]+ = .*[<>]=? [A-Za-z_0-9]+ \?/ {
    line = comparisons($0)
    sub(/ \?.*/, "", line)
    if (compared(line) == $1 && $1 in is_double)
        report("a NaN is not kept in " $1 ": compare_max, compare_min")
}

# Rules of the house that are about the text of C files, over any number of them:
#
#   awk -f c_rules.awk FILE..
#
# prints "rule<TAB>file:line: what" for every violation, and "note<TAB>..." for functions that are longer
# than they should be but not longer than they may be. The rules: forbidden-calls, function-length,
# file-length, file-header.
#
# A function is what stands between a line "{" and a line "}", both in the first column: the K&R style that
# the formatting check enforces has no other such lines. Comments and the contents of strings are taken out
# before calls are looked for.

BEGIN {
    FUNCTION_MAX = 100
    FUNCTION_GOOD = 60
    FILE_MAX = 800
    FORBIDDEN = "strcpy strcat sprintf vsprintf atoi atol atoll atof strtok alloca gets rand srand"
    n_forbidden = split(FORBIDDEN, forbidden, " ")
}

# The line without comments and with empty strings; knows block comments that span lines.
function code_of(line,    out, token, rest) {
    out = ""
    while (line != "") {
        if (in_comment) {
            if (!index(line, "*/")) return out
            line = substr(line, index(line, "*/") + 2)
            in_comment = 0
            out = out " "
        }
        if (!match(line, /"|'|\/\*|\/\//)) return out line
        out = out substr(line, 1, RSTART - 1)
        token = substr(line, RSTART, RLENGTH)
        rest = substr(line, RSTART + RLENGTH)
        if (token == "//") return out
        if (token == "/*") {
            in_comment = 1
            line = rest
            continue
        }
        if (token == "\"") match(rest, /^([^"\\]|\\.)*"/)
        else match(rest, /^([^'\\]|\\.)*'/)
        out = out token token
        if (RLENGTH < 0) return out
        line = substr(rest, RLENGTH + 1)
    }
    return out
}

function violation(rule, what) {
    printf "%s\t%s:%d: %s\n", rule, FILENAME, FNR, what
}

function end_of_file(name, lines) {
    if (name != "" && lines > FILE_MAX)
        printf "file-length\t%s:%d: %d lines, at most %d\n", name, lines, lines, FILE_MAX
}

FNR == 1 {
    end_of_file(last_file, last_line)
    in_comment = 0
    function_start = 0
    if ($0 !~ /^\/\*/) violation("file-header", "does not open with a comment on what it is")
}

{
    last_file = FILENAME
    last_line = FNR
    code = code_of($0)
    if (match(code, /[A-Za-z_][A-Za-z0-9_]*[ \t]*\(/)) {
        for (i = 1; i <= n_forbidden; i++)
            if (match(code, "(^|[^A-Za-z0-9_])" forbidden[i] "[ \t]*\\("))
                violation("forbidden-calls", forbidden[i])
    }
}

/^\{$/ { function_start = FNR }

/^\}$/ && function_start {
    lines = FNR - function_start + 1
    if (lines > FUNCTION_MAX)
        violation("function-length", lines " lines, at most " FUNCTION_MAX)
    else if (lines > FUNCTION_GOOD)
        violation("note", "function of " lines " lines, better at most " FUNCTION_GOOD)
    function_start = 0
}

END { end_of_file(last_file, last_line) }

#!/usr/bin/env bash
# What keeps the files of daemon and library apart, read from the objects of a build: few files call each other in a
# circle, and to edit a header of the store rebuilds few others. Objects whose source is gone are passed over.
# srnfd-test: release-only
. "$(dirname "$0")/support/lib.sh"

CIRCLE_MAX=4
REBUILT_MAX=40 # objects of the daemon

cd "$SRNFD_BUILD/obj" || exit 1
objects_of() { # FOLDER
    find "$1" -name '*.o' | sort | while IFS= read -r object; do
        if [ -f "$ROOT/${object%.o}.c" ]; then echo "$object"; fi
    done
}
objects_of server >"$SCRATCH/server"
objects_of core >"$SCRATCH/core"
compare "$(wc -l <"$SCRATCH/server")" '>' 100 'the daemon was built'
compare "$(wc -l <"$SCRATCH/core")" '>' 100 'and the library'

# Lines "DEFINES file symbol" and "USES file symbol".
symbols() { # FILE: a list of objects
    xargs nm -A <"$1" | awk '
        { file = substr($1, 1, index($1, ".o:") - 1) }
        $(NF - 1) ~ /^[TDRBC]$/ { print "DEFINES", file, $NF }
        $(NF - 1) == "U" || $(NF - 1) ~ /:U$/ { print "USES", file, $NF }'
}

# Each circle as "count file..", from the lines above. Two files are in one circle when each reaches the other by calls.
circles() {
    awk '
        function walk(file, i, list, n) {
            n = split(calls[file], list, " ")
            for (i = 1; i <= n; i++)
                if (!((start, list[i]) in reaches)) {
                    reaches[start, list[i]] = 1
                    walk(list[i])
                }
        }
        $1 == "DEFINES" { home[$3] = $2 }
        $1 == "USES" { used[++n_used] = $3; by[n_used] = $2 }
        END {
            for (i = 1; i <= n_used; i++) {
                to = home[used[i]]
                if (to != "" && to != by[i] && !((by[i], to) in seen)) {
                    seen[by[i], to] = 1
                    calls[by[i]] = calls[by[i]] " " to
                    if (!(by[i] in known)) { known[by[i]] = 1; files[++n_files] = by[i] }
                }
            }
            for (i = 1; i <= n_files; i++) { start = files[i]; walk(start) }
            for (i = 1; i <= n_files; i++) {
                if (files[i] in done) continue
                count = 1
                circle = files[i]
                for (k = i + 1; k <= n_files; k++)
                    if (((files[i], files[k]) in reaches) && ((files[k], files[i]) in reaches)) {
                        done[files[k]] = 1
                        circle = circle " " files[k]
                        count++
                    }
                if (count > 1) print count, circle
            }
        }'
}

too_large() {
    awk -v most="$CIRCLE_MAX" '$1 > most'
}

# That the search finds one: a -> b -> c -> a, and c <-> d, but not e.
is "$(printf '%s\n' 'DEFINES a a' 'DEFINES b b' 'DEFINES c c' 'DEFINES d d' 'DEFINES e e' 'USES a b' 'USES b c' \
    'USES c a' 'USES c d' 'USES d c' 'USES d e' | circles)" '4 a b c d' 'a circle is found'
for part in server core; do
    symbols "$SCRATCH/$part" | circles >"$SCRATCH/circles"
    note "circles: $(cut -d ' ' -f 1 "$SCRATCH/circles" | sort -rn | tr '\n' ' ')"
    is "$(too_large <"$SCRATCH/circles")" '' "no circle of calls in $part/ has more than $CIRCLE_MAX files"
done

# "count header": the objects that depend on each header of the store, as the compiler has noted in the first rule of
# each object's .d.
rebuilt() {
    sed 's/o$/d/' "$SCRATCH/server" | xargs awk '
        FNR == 1 { rule = 1 }
        rule { for (i = 1; i <= NF; i++) if ($i ~ /^server\/store\/[a-z_]*\.h$/) print FILENAME, $i }
        !/\\$/ { rule = 0 }' | sort -u | cut -d ' ' -f 2 | sort | uniq -c
}

rebuilt >"$SCRATCH/rebuilt"
compare "$(wc -l <"$SCRATCH/rebuilt")" '>' 5 'the headers of the store are known'
note "objects rebuilt: $(sort -rn "$SCRATCH/rebuilt" | awk '{ printf "%s %s  ", $1, $2 }')"
is "$(awk -v most="$REBUILT_MAX" '$1 >= most' "$SCRATCH/rebuilt")" '' \
    "to edit a header of the store rebuilds fewer than $REBUILT_MAX objects"
done_testing

#!/usr/bin/env bash
# The digest in the numeric build id changes with every file that decides an answer, so that no answer of the old
# file is served from the cache of the new one; and with the compiler's flags, but not with the build's folder.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/support/lib.sh"

COPY=$SCRATCH/copy
mkdir "$COPY"
cp -r Makefile core include server api migrations deploy "$COPY"
mkdir "$COPY/tests"

asked() { # TARGET [VARIABLE=VALUE]
    env -u MAKEFLAGS -u MAKELEVEL -u MFLAGS make -s --no-print-directory -C "$COPY" "$@"
}
digest() { # [VARIABLE=VALUE]
    asked numeric-digest "$@"
}

first=$(digest)
like "$first" '^[0-9a-f]{16}$' 'there is a digest'
is "$(digest)" "$first" 'the same sources have the same'
asked numeric-text | tr ' ' '\n' | sort >"$SCRATCH/text"
# Everything that a process's file reads inputs with, computes by, or writes results with; and of each folder of the
# core, which is taken by its wildcard, the first file of either kind.
one_each() {
    local folder kind
    for folder in core core/*/; do
        for kind in c h; do
            find "$folder" -maxdepth 1 -name "*.$kind" | sort | head -n 1
        done
    done
}
{
    printf '%s\n' server/processes/*.[ch] server/toolkit/*.[ch] server/api/json_numbers.c server/api/surfaces_record.c \
        server/compute/*.c server/jobs/transforms.c include/srnf/*.h
    one_each
} | sort >"$SCRATCH/deciding"
compare "$(wc -l <"$SCRATCH/deciding")" '>' 100 'files that decide an answer are known'
is "$(comm -23 "$SCRATCH/deciding" "$SCRATCH/text")" '' 'none of them is left out'
# Of which files the digest is, make tells at once; that it is of what they hold is tried on some.
for file in core/memory.c core/internal.h server/processes/mean.c server/toolkit/table.h "$(head -n 1 "$SCRATCH/text")" \
    "$(tail -n 1 "$SCRATCH/text")"; do
    cp "$COPY/$file" "$SCRATCH/kept"
    echo '/* another answer */' >>"$COPY/$file"
    [ "$(digest)" != "$first" ] || same+=" $file"
    cp "$SCRATCH/kept" "$COPY/$file"
done
is "${same-}" '' 'another line in one of them is another digest'
is "$(digest)" "$first" 'what was put back is as before'
isnt "$(digest CONFIG=asan)" "$first" 'other flags are another build'
done_testing

#!/bin/sh
# Prints a C file that holds the given files as constant, zero-terminated byte arrays and a table of them
# by path (server/embedded.h), so that the daemon needs no file beside its binary. NAME=FILE has another path
# than the file's own.
set -eu
printf '#include "embedded.h"\n\n'
n=0
for file in "$@"; do
    printf 'static const unsigned char file_%d[] = {\n' "$n"
    od -An -v -tu1 "${file#*=}" | sed -e 's/^ *//' -e 's/  */,/g' -e 's/$/,/'
    printf '0};\n\n'
    n=$((n + 1))
done
printf 'const struct embedded_file embedded_files[] = {\n'
n=0
for file in "$@"; do
    printf '    {"%s", file_%d, sizeof file_%d - 1},\n' "${file%%=*}" "$n" "$n"
    n=$((n + 1))
done
printf '    {0, 0, 0},\n};\n'

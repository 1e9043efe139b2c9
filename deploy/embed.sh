#!/bin/sh
# Prints a C file whose object holds the given files as zero-terminated bytes, and a table of them by path
# (server/embedded.h), so that the daemon needs no file beside its binary. NAME=FILE has another path than the
# file's own. The assembler reads the files from the folder that the compiler runs in.
set -eu
printf '#include "embedded.h"\n\n'
n=0
for file in "$@"; do
    printf '__asm__(".section .rodata\\nfile_%d: .incbin \\"%s\\"\\n.byte 0\\n.previous");\n' "$n" "${file#*=}"
    printf 'extern const unsigned char file_%d[];\n' "$n"
    n=$((n + 1))
done
printf '\nconst struct embedded_file embedded_files[] = {\n'
n=0
for file in "$@"; do
    printf '    {"%s", file_%d, %d},\n' "${file%%=*}" "$n" "$(wc -c <"${file#*=}")"
    n=$((n + 1))
done
printf '    {0, 0, 0},\n};\n'

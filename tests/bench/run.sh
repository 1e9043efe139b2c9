#!/usr/bin/env bash
# Runs the benchmarks of a build one after the other, below a head that says what machine they ran on:
#
#   tests/bench/run.sh BUILD-FOLDER [FILTER]
#
# Each program prints its own table; none runs beside another. Ends with 1 if one of them fails, which is how
# a benchmark says that a figure it promises was not reached.
set -u
export LC_ALL=C # numbers with a point, messages in English
if [ $# -lt 1 ] || [ ! -d "$1" ]; then
    echo 'usage: tests/bench/run.sh BUILD-FOLDER [FILTER]' >&2
    exit 2
fi
BUILD=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.." || exit 2
export SRNFD_BUILD=$BUILD SRNFD=$BUILD/srnfd
# With the kernels that the daemon chooses for itself (server/main/kernels.h), or those that the environment names.
KERNELS=$("$SRNFD" version 2>/dev/null | sed -n 's/^openblas .*, //p')
[ -z "$KERNELS" ] || export OPENBLAS_CORETYPE="$KERNELS"

version_of() { # PACKAGE
    pkg-config --modversion "$1" 2>/dev/null || echo '?'
}

printf 'machine   %s, %d processors, %s\n' \
    "$(sed -n 's/^model name[ \t]*: //p' /proc/cpuinfo | head -n 1)" "$(nproc)" "$(uname -srm)"
printf 'load      %s\n' "$(cut -d ' ' -f 1-3 /proc/loadavg)"
printf 'compiler  %s\n' "$(gcc --version | head -n 1)"
printf 'libraries OpenBLAS %s with kernels for %s, FFTW %s\n' "$(version_of openblas)" "${KERNELS:-?}" \
    "$(version_of fftw3)"
printf 'source    %s\n' "$(git describe --always --dirty 2>/dev/null || echo unknown)"

status=0
for source in tests/bench/bench_*.c tests/bench/bench_*.sh; do
    name=$(basename "${source%.*}")
    if [ ! -f "$source" ] || ! grep -qE -- "${2-}" <<<"$name"; then
        continue
    fi
    printf '\n== %s\n' "$name"
    case $source in
    *.sh) "$source" </dev/null ;;
    *) "$BUILD/tests/bench/$name" </dev/null ;;
    esac
    result=$?
    if [ "$result" -ne 0 ]; then
        printf '%s: status %d\n' "$name" "$result"
        status=1
    fi
done
exit $status

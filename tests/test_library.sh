#!/usr/bin/env bash
# The library as others have it: installed, it shows what its headers declare and nothing else, and the examples
# build and run against it alone, from C and C++, shared and static.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/support/lib.sh"

ROOT=$PWD
INSTALLED=$SCRATCH/installed
check 'the library installs' make --no-print-directory -s install-library DESTDIR="$INSTALLED" PREFIX=/usr

LIBRARY=$(ls "$INSTALLED"/usr/lib/libsrnf.so.*.*.*)
nm -D --defined-only "$LIBRARY" | awk '{ print $3 }' | sort >"$SCRATCH/shown"
cat "$INSTALLED"/usr/include/srnf/*.h | tr '\n' ' ' | sed 's,/\*[^*]*\*\+\([^/*][^*]*\*\+\)*/,,g' |
    grep -oE '\bsrnf_[a-z0-9_]+ *\(' | tr -d ' (' | sort -u >"$SCRATCH/named"
is "$(grep -vc '^srnf_' "$SCRATCH/shown")" 0 'no symbol lacks the prefix'
is "$(comm -23 "$SCRATCH/shown" "$SCRATCH/named")" '' 'what is shown is in a public header'
# An inline function has no symbol.
is "$(comm -13 "$SCRATCH/shown" "$SCRATCH/named" | tr '\n' ' ')" 'srnf_coefficient_count srnf_working_rows ' \
    'what a public header declares is shown'
is "$(nm --extern-only --defined-only "$INSTALLED/usr/lib/libsrnf.a" | awk 'NF == 3 { print $3 }' | sort)" \
    "$(cat "$SCRATCH/shown")" 'the archive shows the same'
is "$(readelf -d "$LIBRARY" | sed -n 's/.*SONAME.*\[\(.*\)\]/\1/p')" \
    "$(basename "$(readlink -f "$LIBRARY")" .0)" 'the name of the library has its minor version'

export PKG_CONFIG_SYSROOT_DIR=$INSTALLED PKG_CONFIG_PATH=$INSTALLED/usr/lib/pkgconfig
is "$(pkg-config --modversion srnf)" "$(make --no-print-directory version)" 'pkg-config knows the version'
# The examples are installed with it, and srnf(3) says what each needs.
EXAMPLES=$INSTALLED/usr/share/doc/srnfd/examples
is "$(ls "$EXAMPLES")" "$(ls examples)" 'the examples are installed'
cp "$EXAMPLES"/* "$SCRATCH"
MANUAL=$(sed -n '/^.SH EXAMPLES/,/^.SH SEE/p' "$INSTALLED/usr/share/man/man3/srnf.3" | tr -d '\\' | tr '\n' ' ')
like "$MANUAL" '/share/doc/srnfd/examples.*cc mean\.c -o mean .*pkg-config --cflags --libs srnf\) -lm' \
    'and the manual says where, and what they need'
for HEADER in "$INSTALLED"/usr/include/srnf.h "$INSTALLED"/usr/include/srnf/*.h; do
    sed -n 2p "$HEADER" | grep -q "^ \* ${HEADER##*/} - " || MISNAMED+=" ${HEADER##*/}"
done
is "${MISNAMED-}" '' 'each header begins with its name'
cd "$SCRATCH" || exit 1
# shellcheck disable=SC2046
check 'example geodesic compiles' cc -Wall -Wextra -Werror geodesic.c -o geodesic $(pkg-config --cflags --libs srnf)
# shellcheck disable=SC2046
check 'example mean compiles' cc -Wall -Wextra -Werror mean.c -o mean $(pkg-config --cflags --libs srnf) -lm
DATA=$ROOT/tests/data/aal_subcortex
export LD_LIBRARY_PATH=$INSTALLED/usr/lib
OUTPUT=$(./geodesic "$DATA/L_thalamus.ply" "$DATA/L_pallidum.ply" 2>&1)
like "$OUTPUT" '^distance 0\.[0-9]{4} as they came, 0\.[0-9]{4} registered.7 surfaces, path length 0\.' \
    'two meshes are joined by a geodesic'
is "$(find . -name 'step_?.ply' | wc -l)" 7 'which is written'
OUTPUT=$(./mean "$DATA"/L_{thalamus,pallidum,putamen}.ply 2>&1)
like "$OUTPUT" '^mean of 3 after [0-9]+ iterations; the first of 2 modes has [0-9]+ %' 'a mean of three has two modes'
is "$(head -c 3 mean.ply)$(head -c 3 plus.ply)$(head -c 3 minus.ply)" plyplyply 'it and the first are written'
OUTPUT=$(./geodesic "$DATA/L_thalamus.ply" geodesic.c 2>&1)
like "$?$OUTPUT" '^1geodesic.c: .+' 'a file that is no mesh is refused by name'

printf '#include <srnf.h>\nint main() { return srnf_strerror(SRNF_OK) == nullptr; }\n' >plus.cc
if command -v g++ >/dev/null; then
    # shellcheck disable=SC2046
    check 'a C++ program compiles' g++ plus.cc -o plus $(pkg-config --cflags --libs srnf)
    check 'and runs' ./plus
else
    skip 'a C++ program' 'no C++ compiler'
fi
unset LD_LIBRARY_PATH
rm "$INSTALLED"/usr/lib/libsrnf.so*
# shellcheck disable=SC2046
check 'an example links statically' cc geodesic.c -o geodesic $(pkg-config --cflags --libs --static srnf)
check 'and runs' ./geodesic "$DATA/L_thalamus.ply" "$DATA/L_thalamus.ply"
done_testing

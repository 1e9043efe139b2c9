#!/usr/bin/env bash
# What can be checked without running anything; speaks TAP and closes on "N passed, M failed".
#
#   tests/lint/lint.sh [CHECK..]     (all of them, in the order of the table below)
#
# Each check prints what it finds as "file:line: what" and passes if it finds nothing. Tracked files are
# looked at (all files, where there is no git). Objects for the checks of symbols, and the linter of
# api/openapi.yaml, are made under the build folder: SRNFD_BUILD, or build/.
set -u
export LC_ALL=C # numbers with a point, messages in English
cd "$(dirname "$0")/../.." || exit 2
BUILD=${SRNFD_BUILD:-build}
LINT=tests/lint
COLUMNS_MAX=100

CHECKS='formatting columns c-rules layers core-symbols core-globals refusals headers nan markers outside paths migrations processes shell shellcheck lockfile openapi web'

# ---- Files ---------------------------------------------------------------------------------------------

# Files of the project that exist, by name patterns.
files() { # PATTERN..
    if [ "$(git rev-parse --show-toplevel 2>/dev/null)" = "$PWD" ]; then
        git ls-files -- "$@"
    else
        local pattern
        for pattern in "$@"; do
            find . \( -path ./build -o -path ./.git \) -prune -o -type f -path "./$pattern" -print
        done | sed 's,^\./,,'
    fi | LC_ALL=C sort -u | while IFS= read -r file; do
        if [ -f "$file" ]; then printf '%s\n' "$file"; fi
    done
}

sources() {
    files '*.c' '*.h'
}

# ---- Checks: print violations, nothing if all is well ----------------------------------------------------

# Another version of clang-format has other opinions, so only the one that the style was settled with counts.
CLANG_FORMAT_VERSION=14

check_formatting() {
    local tool=clang-format-$CLANG_FORMAT_VERSION
    command -v "$tool" >/dev/null || tool=clang-format
    case $("$tool" --version 2>/dev/null) in
    *"version $CLANG_FORMAT_VERSION."*) ;;
    *)
        echo "SKIP clang-format $CLANG_FORMAT_VERSION is not installed"
        return
        ;;
    esac
    # The first complaint of each file is enough: "make format" mends them all.
    sources | xargs -r "$tool" --dry-run --Werror 2>&1 |
        sed -n 's/^\([^:]*\):\([0-9]*\):[0-9]*: error: code should be clang-formatted.*/\1:\2: not formatted/p' |
        LC_ALL=C sort -t : -k 1,1 -k 2,2n | awk -F : '!seen[$1]++'
}

check_columns() {
    sources | LC_ALL=C.UTF-8 xargs -r grep -nE "^.{$((COLUMNS_MAX + 1))}" /dev/null |
        sed "s/^\([^:]*:[0-9]*\):.*/\1: more than $COLUMNS_MAX columns/"
}

check_c-rules() {
    sources | xargs -r awk -f $LINT/c_rules.awk | sed 's/^\([a-z-]*\)\t\(.*\)/\2 [\1]/'
}

check_layers() {
    files 'core/*.c' 'core/*.h' 'include/*.h' 'server/*.c' 'server/*.h' | xargs -r awk -f $LINT/layers.awk
}

# Compiles the core (in the release configuration) and prints its objects.
core_objects() {
    local source object failed=0
    for source in $(files 'core/*.c'); do
        object=$BUILD/obj/${source%.c}.o
        echo "$object"
    done | tee "$SCRATCH/objects" >/dev/null
    xargs -r make --no-print-directory -s -k -j2 B="$BUILD" O="$BUILD/obj" <"$SCRATCH/objects" \
        >"$SCRATCH/make" 2>&1 || failed=1
    if [ $failed -eq 1 ]; then
        grep -m 5 -E 'error|Error' "$SCRATCH/make" >&2
    fi
    while IFS= read -r object; do
        if [ -f "$object" ]; then echo "$object"; fi
    done <"$SCRATCH/objects"
    return $failed
}

# What the core must not call: it does no input or output, reads no clock, environment or locale, starts no
# threads, ends no process, and allocates through srnf_alloc alone.
FORBIDDEN_IO='[fd]?printf|v[fd]?printf|v?as?printf|v?sprintf|f?puts|f?putc|putchar|fwrite|fread|fopen|fopen64'
FORBIDDEN_IO="$FORBIDDEN_IO|freopen|fdopen|tmpfile|open|open64|openat|read|write|perror|stdout|stderr|stdin"
FORBIDDEN_IO="$FORBIDDEN_IO|v?f?scanf|getline|socket|mmap|mmap64|system|popen|fork|exec[lv]p?e?"
FORBIDDEN_STATE='getenv|secure_getenv|setenv|putenv|time|clock|clock_gettime|gettimeofday|localtime(_r)?|gmtime(_r)?'
FORBIDDEN_STATE="$FORBIDDEN_STATE|s?rand(om)?|rand_r|[dlm]rand48|getrandom|getentropy|arc4random|setlocale"
FORBIDDEN_STATE="$FORBIDDEN_STATE|uselocale|exit|_exit|_Exit|quick_exit|atexit|abort|signal|sigaction|raise|sleep"
FORBIDDEN_STATE="$FORBIDDEN_STATE|usleep|nanosleep|pthread_.*|thrd_.*|mtx_.*|cnd_.*|GOMP_.*|omp_.*|strtok|strerror"
FORBIDDEN_LOCALE='strto(d|f|ld)|ato[fil]|v?sscanf|strcoll|to(lower|upper)|__ctype_.*'
FORBIDDEN_MEMORY='malloc|calloc|realloc|reallocarray|free|aligned_alloc|posix_memalign|memalign|valloc|strn?dup'

# The compiler may put fortified or versioned names (__printf_chk, __isoc99_sscanf) for the plain ones.
check_core-symbols() {
    local plain="$FORBIDDEN_IO|$FORBIDDEN_STATE|$FORBIDDEN_LOCALE"
    core_objects >"$SCRATCH/built" || echo 'core: does not compile'
    xargs -r nm -uA <"$SCRATCH/built" | sed -E "s|^$BUILD/obj/||; s/: +[Uw] /: calls /; s/@.*//" >"$SCRATCH/calls"
    grep -E ": calls (__)?(isoc[0-9]+_)?($plain)(_chk)?\$" "$SCRATCH/calls"
    grep -E ": calls (__)?(isoc[0-9]+_)?($FORBIDDEN_MEMORY)(_chk)?\$" "$SCRATCH/calls" | grep -v '^core/memory\.o:'
}

# No mutable data: neither initialized nor zeroed nor of a thread. Tables of pointers that are constant
# after relocation (.data.rel.ro) are fine.
check_core-globals() {
    local object
    core_objects >"$SCRATCH/built" || echo 'core: does not compile'
    while IFS= read -r object; do
        objdump -t "$object" |
            awk -v object="${object#"$BUILD"/obj/}" '
                / O (\.data|\.bss|\*COM\*)[^\t]*\t/ && !/ \.data\.rel\.ro/ ||
                / \.t(data|bss)[^\t]*\t/ && !/ d / { print object ": mutable " $NF }'
    done <"$SCRATCH/built"
}

# Every public function that can fail is called in a test that lets its allocations fail one by one.
check_refusals() {
    local tests declared
    tests=$(files 'tests/core/*.c' |
        xargs -r grep -lE '^(#include "support/refusing\.h"|void \*srnf_alloc\()' /dev/null)
    files 'include/srnf/*.h' | xargs -r grep -noE '^SRNF_CHECKED int srnf_[a-z0-9_]+' /dev/null |
        while IFS= read -r declared; do
            # shellcheck disable=SC2086
            grep -qw "${declared##* }" $tests /dev/null ||
                echo "${declared%:*}: no test refuses ${declared##* } its memory"
        done
}

# Every public header compiles by itself, as C and as C++, and srnf(3) names it.
check_headers() {
    local header language
    for header in $(files 'include/*.h'); do
        grep -qF "${header#include/}" docs/man/srnf.3 ||
            echo "$header:1: docs/man/srnf.3 does not name it"
        for language in c c++; do
            echo "#include \"${header#include/}\"" |
                gcc -x $language -Wall -Wextra -Wpedantic -Werror -Iinclude -fsyntax-only - 2>"$SCRATCH/compiled" ||
                echo "$header:1: does not compile alone as $language: $(grep -m 1 error "$SCRATCH/compiled")"
        done
    done
}

# Figures of tests that no NaN fails. The pictures of tests/paper are no tests.
check_nan() {
    files 'tests/*.c' 'tests/*.h' | grep -vE '^tests/(paper/|support/compare\.h$)' |
        xargs -r awk -f $LINT/nan.awk /dev/null
}

# Markers of tests (the head of tests/run.sh): known ones; of tests that make check runs in one build only, with a reason.
# Who is left out with ASan, or whose core is, names tests of which neither is; those whose core is left out may be named
# beside such, but for the core. Who is left out of the release build leaves nothing out with ASan,
# which would then run nowhere.
check_markers() {
    local file name why other found
    files 'tests/test_*.c' 'tests/test_*.sh' 'tests/*/test_*.c' 'tests/*/test_*.sh' |
        xargs -r awk 'FNR > 20 { nextfile } sub(/^[#\/* ]*srnfd-test: /, "") { print FILENAME "\t" $1 "\t" $0 }' /dev/null |
        sort -u >"$SCRATCH/markers"
    while IFS=$'\t' read -r file name why; do
        case $name in
        release-only | alone | nightly | slow | waits | timeout) continue ;;
        no-asan | plain-core | once) ;;
        *) echo "$file:1: \"$name\" is no marker" && continue ;;
        esac
        if ! [[ $why =~ ^[a-z-]+\ \(.+\)( \*/)?$ ]]; then
            echo "$file:1: $name without a reason in brackets"
        fi
        if [ "$name" = once ]; then
            ! grep -q SRNFD_SANITIZED "$file" || echo "$file:1: is left out of the release build, and leaves out something with ASan"
            ! grep -qP "^\Q$file\E\t(release-only|no-asan|alone|nightly)\t" "$SCRATCH/markers" ||
                echo "$file:1: is left out of the release build, and with ASan too"
            continue
        fi
        found=
        for other in $(grep -oE '[a-z_/]*test_[a-z0-9_]+\.(c|sh)' <<<"$why"); do
            [ -f "tests/$other" ] && other=tests/$other || other=${file%/*}/$other
            if [ ! -f "$other" ]; then
                echo "$file:1: $other, which is to run its code, is not there"
            elif grep -qP "^\Q$other\E\t(release-only|no-asan|nightly)\t" "$SCRATCH/markers"; then
                echo "$file:1: $other, which is to run its code, is left out with ASan, too"
            elif ! grep -qP "^\Q$other\E\tplain-core\t" "$SCRATCH/markers"; then
                found=yes
            elif [ "$name" = plain-core ] || [[ $file == tests/core/* ]]; then
                echo "$file:1: $other, which is to run its code, has a core without ASan"
            fi
        done
        [ -n "$found" ] || echo "$file:1: $name without a test that runs its code"
    done <"$SCRATCH/markers"
}

# A clone alone runs every test: what lies beside the project serves the benches and the paper only.
check_outside() {
    files 'tests/*' | grep -vE '^tests/(bench|paper)/|^tests/test_lint\.sh$' |
        xargs -r grep -nIE '\.\./shared' /dev/null | sed -E 's/^([^:]*:[0-9]+):.*/\1: names a folder outside/'
}

check_paths() {
    files '*' | xargs -r grep -nIE '(^|[^A-Za-z0-9_./$}~-])/(work|root|home)(/|$|[^A-Za-z0-9_/])' /dev/null |
        cut -c 1-160
}

# A data directory has the number of the last migration that ran. Two branches that each add the next one give two of
# one number, which builds, and the daemon then never gets ready.
check_migrations() {
    files 'migrations/*' | awk -F '[/_]' '
        !/^migrations\/[0-9][0-9][0-9][0-9]_[a-z0-9_]+\.sql$/ { print $0 ":1: is not named NNNN_what.sql"; next }
        $2 == number { print $0 ":1: has the number of " previous; next }
        $2 != number + 1 { printf "%s:1: its number is not %04d, the next one\n", $0, number + 1 }
        { number = $2 + 0; previous = $0 }'
}

# Each process has its place in every list of them that people keep by hand: "file:1: has no ..".
check_processes() {
    local id method
    # shellcheck disable=SC2016 # the backticks are Markdown's
    files 'server/processes/*.c' | xargs -r sed -n '/^const struct api_process/,/^};/s/^ *\.id = "\(.*\)",/\1/p' |
        while IFS= read -r id; do
            method=${id//-/_}
            in_list README.md "^\\|[^|]*\`$id\`" "row of $id in its table"
            in_list tests/web/processes.cjs "^ +'?$id'?: \\[" "form of $id"
            in_list tests/bench/bench_ends.sh "^[a-z-]+ $id \\{" "row of $id"
            in_list tests/bench/same_answers.sh "^[a-z-]+ $id \\{|^ *run [^ ]+ $id " "row of $id"
            in_list docs/reference.md "execute $id |/$id/execution" "example of $id"
            in_list docs/python.md "client\\.($method\\(|run\\(\"$id\")" "example of $id"
            in_list clients/python/src/srnf/processes.py "self\\.run\\(\"$id\"" "method of $id"
        done
}

in_list() { # FILE REGEX WHAT
    grep -qE "$2" "$1" 2>/dev/null || echo "$1:1: has no $3"
}

check_shell() {
    local file
    for file in $(files '*.sh' '.ci/run'); do
        bash -n "$file" 2>&1
        if [ ! -x "$file" ] && [ "${file#tests/support/}" = "$file" ]; then
            echo "$file:1: not executable"
        fi
    done
}

check_shellcheck() {
    if ! command -v shellcheck >/dev/null; then
        echo 'SKIP shellcheck is not installed'
        return
    fi
    # 2154: variables that lib.sh sets. 2034: variables that it sets for scripts.
    files '*.sh' '.ci/run' | xargs -r -n 5 -P "$(nproc)" shellcheck -S warning -e 2154,2034 -f gcc
}

# The packages' addresses would name the registry of whoever wrote the lock file.
check_lockfile() {
    grep -nH '"resolved"' $LINT/package-lock.json tests/fuzz/api/package-lock.json web/package-lock.json
    grep -qF "$(sed -n 's/.*"\(@redocly[^"]*": "[^"]*\)".*/\1/p' $LINT/package.json)" \
        $LINT/package-lock.json || echo "$LINT/package-lock.json:1: is not of $LINT/package.json"
}

OFFLINE='code (ENOTFOUND|EAI_AGAIN|ECONNREFUSED|ECONNRESET|ETIMEDOUT|ENETUNREACH|EHOSTUNREACH'
OFFLINE="$OFFLINE|ERR_SOCKET_TIMEOUT|SELF_SIGNED_CERT_IN_CHAIN|UNABLE_TO_[A-Z_]*)"

check_openapi() {
    local modules=$BUILD/lint major
    major=$(node --version 2>/dev/null | sed 's/^v\([0-9]*\).*/\1/')
    if [ -z "$major" ] || [ "$major" -lt 18 ]; then
        echo 'SKIP node 18 or newer is not installed'
        return
    fi
    mkdir -p "$modules"
    if ! cmp -s $LINT/package-lock.json "$modules/installed.json"; then
        cp $LINT/package.json $LINT/package-lock.json "$modules"
        if ! (cd "$modules" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error \
            --fetch-retries=1 --fetch-timeout=60000) >"$SCRATCH/npm" 2>&1 </dev/null; then
            # Being offline, or behind a proxy whose certificate is not known here, says nothing about the
            # description. Whatever else npm has to say is a failure.
            if grep -qE "$OFFLINE" "$SCRATCH/npm"; then
                echo 'SKIP its linter is not installed, and the registry cannot be reached'
            else
                echo "$LINT/package.json: npm ci failed: $(head -n 4 "$SCRATCH/npm")"
            fi
            return
        fi
        cp $LINT/package-lock.json "$modules/installed.json"
    fi
    node $LINT/openapi.cjs "$modules" api/openapi.yaml
}

# web/dist is what web/src and the packages of the lock file give, byte for byte, within its budgets (KB of 1000 bytes,
# packed: the first page, and the chunk that draws shapes); and the types fit.
FIRST_LOAD_MAX=30000
VIEWER_MAX=145000

packed() { # FILES..
    local file sum=0
    for file in "$@"; do
        sum=$((sum + $(gzip -9nc "$file" | wc -c)))
    done
    echo $sum
}

# What the first page loads: itself, its style, its program and what that imports at once.
first_load() {
    local dist=web/dist app
    app=$(echo $dist/app-*.js)
    # shellcheck disable=SC2046
    echo $dist/index.html $dist/style-*.css "$app" $(grep -oE '(from|import) ?"\./[^"]+"' "$app" | sed "s|.*\"\./|$dist/|; s|\"||" | sort -u)
}

check_web() {
    local made=$BUILD/web/dist size
    # shellcheck disable=SC2046
    size=$(packed $(first_load))
    [ "$size" -le $FIRST_LOAD_MAX ] || echo "web/dist/index.html:1: the first page loads $size bytes, more than $FIRST_LOAD_MAX"
    size=$(packed web/dist/three-*.js)
    [ "$size" -le $VIEWER_MAX ] || echo "web/dist: the chunk of three has $size bytes, more than $VIEWER_MAX"
    web/install.sh >"$SCRATCH/npm" 2>&1
    case $? in
    0) ;;
    3)
        echo 'SKIP its packages are not installed, and the registry cannot be reached'
        return
        ;;
    *)
        echo "web/package.json:1: npm ci failed: $(head -n 4 "$SCRATCH/npm")"
        return
        ;;
    esac
    NODE_PATH=$PWD/build/web/node_modules node web/build.mjs "$made" >"$SCRATCH/built" 2>&1 || sed 's/^/web: /' "$SCRATCH/built"
    NODE_PATH=$PWD/build/web/node_modules node web/types.mjs "$BUILD/web/service.d.ts" 2>&1 | sed 's/^/web: /'
    cmp -s web/src/service.d.ts "$BUILD/web/service.d.ts" ||
        echo 'web/src/service.d.ts:1: is not what make web gives of api/openapi.yaml'
    diff -rq web/dist "$made" | sed 's|^|web/dist:1: is not what make web gives: |'
    NODE_PATH=$PWD/build/web/node_modules node web/texts.mjs | sed 's/$/ (a text that no language can have: t`...`)/'
    node build/web/node_modules/typescript/bin/tsc -p web --pretty false | sed -E 's/\(([0-9]+),[0-9]+\): /:\1: /'
}

# ---- Driver --------------------------------------------------------------------------------------------

SCRATCH=$(mktemp -d "${TMPDIR:-/tmp}/srnfd-lint.XXXXXX") || exit 2
trap 'rm -rf "$SCRATCH"' EXIT
passed=0
failed=0
number=0
if [ $# -eq 0 ]; then
    # shellcheck disable=SC2086
    set -- $CHECKS
fi
for name in "$@"; do
    number=$((number + 1))
    if ! declare -F "check_$name" >/dev/null; then
        echo "no such check: $name (there are: $CHECKS)" >&2
        exit 2
    fi
    "check_$name" >"$SCRATCH/found"
    if grep -q '^SKIP ' "$SCRATCH/found"; then
        echo "ok $number - $name # $(cat "$SCRATCH/found")"
        continue
    fi
    # Notes and warnings are shown but do not count.
    grep -vE '\[note\]$|: warn: .*\[[a-z0-9-]+\]$' "$SCRATCH/found" >"$SCRATCH/violations"
    if [ -s "$SCRATCH/violations" ]; then
        failed=$((failed + 1))
        echo "not ok $number - $name"
    else
        passed=$((passed + 1))
        echo "ok $number - $name"
    fi
    sed 's/^/#   /' "$SCRATCH/found"
done
echo "1..$number"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]

#!/usr/bin/env bash
# tests/lint/lint.sh finds what it is there to find: a small project that passes, and in it, one after the
# other, a violation of each rule.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/support/lib.sh"

COPY=$SCRATCH/project
mkdir -p "$COPY"/core/{harmonics,mesh,surface} "$COPY"/server/{processes,toolkit,http,api,compute,jobs,store} "$COPY/tests" "$COPY/api"
cp -r Makefile .clang-format "$COPY"
cp -r tests/lint "$COPY/tests"
if [ -f "$SRNFD_BUILD/lint/installed.json" ]; then
    mkdir "$COPY/build"
    ln -s "$SRNFD_BUILD/lint" "$COPY/build/lint"
fi

# A file of the copy, from standard input; C files get their head comment.
file() { # PATH
    case $1 in
    *.[ch]) { echo '/* A file. */' && cat; } >"$COPY/$1" ;;
    *) cat >"$COPY/$1" ;;
    esac
}

lint() { # CHECK..
    OUTPUT=$(SRNFD_BUILD=build "$COPY/tests/lint/lint.sh" "$@" 2>&1)
    RESULT=$?
}

clean() { # CHECK
    lint "$1"
    is "$RESULT" 0 "$1: nothing is found where nothing is"
    [ "$RESULT" -eq 0 ] || note "$OUTPUT"
}

# The check must fail and say so of that file.
finds() { # CHECK REGEX NAME
    lint "$1"
    is "$RESULT" 1 "$1: $3"
    like "$OUTPUT" "$2" "$1: and it says where"
}

echo "/* $(printf '%94s' x) */" | file core/harmonics/bad.c
clean columns
echo "/* $(printf '%95s' x) */" | file core/harmonics/bad.c
finds columns 'bad.c:2: more than 100' 'a line of 101 columns is too long'
echo "/* $(printf '%93s' x)ä */" | file core/harmonics/bad.c
clean columns
rm "$COPY/core/harmonics/bad.c"
cp -r core/memory.c core/internal.h "$COPY/core"
mkdir "$COPY/docs"
cp -r include "$COPY"
cp -r docs/man "$COPY/docs"

marked() { # NAME MARKER..: a test of that name
    local name=$1
    shift
    { echo '#!/bin/sh' && printf '# srnfd-test: %s\n' "$@"; } >"$COPY/tests/api/test_$name.sh"
}
mkdir -p "$COPY/tests/api"
marked other slow
marked one 'once (it is)' 'timeout 30'
marked two 'no-asan (test_one.sh and api/test_other.sh run its code)'
clean markers
marked one once
finds markers 'test_one.sh:1: once without a reason' 'a test in one build says why'
marked one 'once (it is)' release-only
finds markers 'test_one.sh:1: .*with ASan too' 'a test that is nowhere is found'
marked one 'once (it is)'
echo '[ -n "$SRNFD_SANITIZED" ] || echo more' >>"$COPY/tests/api/test_one.sh"
finds markers 'test_one.sh:1: .*leaves out something' 'and one of which a part is nowhere'
marked one release-only
finds markers 'test_two.sh:1: .*test_one.sh, .*left out' 'a test that is to run the code of another runs'
rm "$COPY/tests/api/test_one.sh"
finds markers 'test_two.sh:1: .*test_one.sh, .*not there' 'and is there'
marked two 'no-asan (others run its code)'
finds markers 'test_two.sh:1: no-asan without a test' 'and has a name'
marked two 'plain-core (test_three.sh runs its numerics)'
marked three slow
clean markers
marked three 'plain-core (test_other.sh runs its numerics)'
finds markers 'test_two.sh:1: .*test_three.sh, .*has a core without ASan' 'a core that is left out is no other'\''s'
marked two 'no-asan (test_three.sh runs its code)'
finds markers 'test_two.sh:1: no-asan without a test' 'nor for who is left out'
marked two 'no-asan (test_three.sh and test_other.sh run its code)'
clean markers
marked two plain-core
finds markers 'test_two.sh:1: plain-core without a reason' 'and says why'
marked two no-asna
finds markers 'test_two.sh:1: "no-asna" is no marker' 'a marker is spelled right'
rm "$COPY"/tests/api/test_*.sh

file core/harmonics/grid.h <<'END'
int grid(int x);
END
file core/harmonics/grid.c <<'END'
#include "harmonics/grid.h"
#include "internal.h"

int grid(int x)
{
    return x;
}
END
cp "$COPY/core/harmonics/grid.c" "$SCRATCH/grid.c"
for name in processes toolkit http api compute jobs store; do
    file "server/$name/$name.h" </dev/null
done
file server/embedded.h </dev/null

for name in c-rules layers core-symbols core-globals paths shell lockfile; do
    clean "$name"
done

# Calls to strcpy( and sprintf( in comments and strings are no calls.
file core/harmonics/words.c <<'END'
/* strcpy(a, b)
   and gets(a) */
const char *words(void);
const char *words(void) // rand()
{
    return "\"sprintf(x)" + ('"' == 'a') /* atoi( */;
}
END
clean c-rules
rm "$COPY/core/harmonics/words.c"

file core/harmonics/bad.c <<'END'
void bad(char *x);
void bad(char *x)
{
    /* a
     */ (void)strcpy (x, "a");
}
END
finds c-rules 'bad.c:6: strcpy \[forbidden-calls\]' 'a forbidden call is found'
for call in strcat sprintf vsprintf atoi strtok alloca gets rand; do
    echo "int y = $call(x);" | file core/harmonics/bad.c
    lint c-rules
    like "$OUTPUT" "bad.c:2: $call" "c-rules: $call is forbidden"
done
echo 'int brand(x), my_atoi(y);' | file core/harmonics/bad.c
clean c-rules

long_function() { # LINES, braces included
    echo 'int bad(void)'
    echo '{'
    yes '    ;' | head -n $(($1 - 2))
    echo '}'
}
long_function 100 | file core/harmonics/bad.c
clean c-rules
like "$OUTPUT" 'function of 100 lines' 'but a function of more than 60 lines is noted'
long_function 101 | file core/harmonics/bad.c
finds c-rules 'bad.c.*101 lines.*function-length' 'a function of 101 lines is too long'

yes 'int x;' | head -n 799 | file core/harmonics/bad.c
clean c-rules
yes 'int x;' | head -n 800 | file core/harmonics/bad.c
finds c-rules 'bad.c:801: 801 lines.*file-length' 'a file of 801 lines is too long'
echo 'int x;' >"$COPY/core/harmonics/bad.c"
finds c-rules 'bad.c:1:.*file-header' 'a file must say what it is'

rm "$COPY/core/harmonics/bad.c"

if clang-format --version 2>/dev/null | grep -q 'version 14\.'; then
    echo 'int  x;' | file core/harmonics/bad.c
    finds formatting 'bad.c:2: not formatted' 'what is not formatted is found'
    rm "$COPY/core/harmonics/bad.c"
else
    skip 'formatting' 'clang-format 14 is not installed'
fi

# One include in one file: allowed or not.
allowed() { # FILE INCLUDE
    echo "#include $2" | file "$1"
    lint layers
    is "$RESULT" 0 "layers: $1 may include $2"
    rm "$COPY/$1"
}
refused() { # FILE INCLUDE
    echo "#include $2" | file "$1"
    lint layers
    like "$RESULT$OUTPUT" "^1.*$1:2: " "layers: $1 must not include $2"
    rm "$COPY/$1"
}
allowed server/http/x.c '"http/http.h"'
allowed server/http/x.c '"store/store.h"'
allowed server/http/x.c '<microhttpd.h>'
allowed server/api/x.c '"jobs/jobs.h"'
allowed server/api/x.c '"embedded.h"'
allowed server/main.c '"http/http.h"'
refused server/api/x.c '"http/http.h"'
refused server/jobs/x.c '"api/api.h"'
refused server/store/x.c '"jobs/jobs.h"'
refused server/store/x.c '"internal.h"'
refused server/store/x.c '"harmonics/grid.h"'
refused server/store/x.c '"../jobs/jobs.h"'
refused server/api/x.c '<microhttpd.h>'
refused server/jobs/x.c '<jansson.h>'
refused server/jobs/x.c '<sqlite3.h>'
refused server/common.c '"store/store.h"'
allowed core/surface/x.c '"harmonics/grid.h"'
refused core/harmonics/x.c '"surface/x.h"'
refused core/harmonics/x.c '"store/store.h"'
refused core/harmonics/x.c '"embedded.h"'
refused core/harmonics/x.c '<pthread.h>'
refused core/harmonics/x.c '<sys/stat.h>'
refused core/x.c '"harmonics/grid.h"'
allowed include/srnf/x.h '"srnf/base.h"'
refused include/srnf/x.h '"harmonics/grid.h"'
refused include/srnf/x.h '<pthread.h>'

clean headers
echo 'size_t needs_a_type(int x);' | file include/srnf/x.h
finds headers 'include/srnf/x.h:1: does not compile alone as c:' 'a header that needs another is found'
echo 'int new;' | file include/srnf/x.h
finds headers 'include/srnf/x.h:1: does not compile alone as c..:' 'a header that C++ does not take is found'
echo 'int x;' | file include/srnf/x.h
finds headers 'include/srnf/x.h:1: docs/man/srnf.3 does not name it' 'a header that the manual does not name is found'
rm "$COPY/include/srnf/x.h"

# The core's objects: a statement in one function, and what the check says of the call it makes.
call() { # HEADER STATEMENT
    {
        printf '#include "harmonics/grid.h"\n#include <%s>\n' "$1"
        printf 'int grid(int x)\n{\n    %s\n    return x;\n}\n' "$2"
    } | file core/harmonics/grid.c
    lint core-symbols
}
symbol() { # NAME HEADER STATEMENT
    call "$2" "$3"
    like "$RESULT$OUTPUT" "^1.*core/harmonics/grid.o: calls .*$1" "core-symbols: $1 is found"
}
symbol printf stdio.h 'printf("%d", x);'
symbol puts stdio.h 'printf("hello\n");'
symbol stderr stdio.h 'fputs("hello", stderr);'
symbol getenv stdlib.h 'x += getenv("A") != NULL;'
symbol time time.h 'x += (int)time(NULL);'
symbol malloc stdlib.h 'void *volatile p = malloc(3); x += p != NULL;'
symbol free stdlib.h 'void *volatile p = NULL; free(p);'
symbol abort stdlib.h 'if (x) abort();'
symbol exit stdlib.h 'if (x) exit(1);'
symbol pthread_self pthread.h 'x += pthread_self() != 0;'
symbol rand stdlib.h 'x += rand();'
symbol strtod stdlib.h 'x += (int)strtod("1", NULL);'
symbol sscanf stdio.h 'if (sscanf("1", "%d", &x)) x++;'

call stdio.h 'char b[9]; x += snprintf(b, sizeof b, "%d", x);'
is "$RESULT" 0 'core-symbols: snprintf is allowed'
call assert.h 'assert(x);'
is "$RESULT" 0 'core-symbols: assert is allowed'

file core/harmonics/grid.c <<'END'
#include "harmonics/grid.h"

int grid(int x)
{
    return undeclared(x);
}
END
finds core-symbols 'does not compile' 'a core that does not compile is no pass'

variable() { # NAME DECLARATION
    printf '#include "harmonics/grid.h"\n%s\nint grid(int x)\n{\n    return x + (state += x);\n}\n' "$2" |
        file core/harmonics/grid.c
    finds core-globals 'core/harmonics/grid.o: mutable state' "$1 is found"
}
variable 'a zeroed variable' 'static int state;'
variable 'an initialized variable' 'static int state = 5;'
variable 'a thread-local variable' 'static _Thread_local int state;'
file core/harmonics/grid.c <<'END'
#include "harmonics/grid.h"

static const char *const words[] = {"a", "b"};

int grid(int x)
{
    return words[x & 1][0];
}
END
clean core-globals
cp "$SCRATCH/grid.c" "$COPY/core/harmonics/grid.c"

mkdir -p "$COPY/tests/core"
{
    echo '#include "support/refusing.h"'
    sed -n 's/^SRNF_CHECKED int \(srnf_[a-z0-9_]*\).*/int \1;/p' "$COPY"/include/srnf/*.h
} | file tests/core/test_refusals.c
clean refusals
sed -i '/srnf_icp;/d' "$COPY/tests/core/test_refusals.c"
finds refusals 'include/srnf/mesh.h:[0-9]+: .*srnf_icp' 'a function is found that no test refuses memory'
rm -r "$COPY/tests/core"

mkdir -p "$COPY/tests/core" "$COPY/tests/support"
file tests/support/compare.h <<'END'
/* fmax is spoken of, and used: return fmax(a, b); */
double largest = fmax(a, b);
END
file tests/core/test_x.c <<'END'
    double d = 1.0, worst = 0.0;
    size_t count = 0, most = 0;
    worst = compare_max(worst, d);
    if (count > most) {
        most = count;
    }
    most = count > most ? count : most;
    if (d > worst) {
        count++;
    }
    assert_false(result->empty);
    assert_true(!result->large && d > worst);
END
clean nan
plain=$(cat "$COPY/tests/core/test_x.c")
for line in 'worst = fmax(worst, d);' 'worst = sqrt(fmin(0.0, d));' 'worst = d > worst ? d : worst;' \
    'worst = d >= worst ? d : worst;' 'assert_false(d > worst);' 'assert_true(!(d > 1e-3));' \
    'assert_false(result->error >= 1);' 'if (d > worst) { //
        worst = d;'; do
    printf '%s\n    %s\n' "$plain" "${line/ \/\//}" >"$COPY/tests/core/test_x.c"
    finds nan 'test_x.c:1[45]: ' "a NaN would pass: ${line//[$'\n']/ }"
done
rm -r "$COPY/tests/core" "$COPY/tests/support"

mkdir -p "$COPY/tests/core" "$COPY/tests/bench"
echo '#define DATA "../shared/data"' | file tests/bench/bench_x.c
clean outside
cp "$COPY/tests/bench/bench_x.c" "$COPY/tests/core/test_x.c"
finds outside 'tests/core/test_x.c:2: ' 'a test that needs a folder outside is found'
rm -r "$COPY/tests/core" "$COPY/tests/bench"

for folder in work root home; do
    echo "see /$folder/somebody" | file notes.md
    finds paths 'notes.md:1' "a path in /$folder is found"
done
echo 'see ../shared/data, $HOME/work/, https://host/home/x and a/root/b' | file notes.md
clean paths

mkdir "$COPY/migrations"
for number in 0001_initial 0002_lists 0003_names; do
    echo 'SELECT 1;' | file migrations/$number.sql
done
clean migrations
echo 'SELECT 1;' | file migrations/0003_subjects.sql
finds migrations '0003_subjects.sql:1: has the number of migrations/0003_names.sql' 'a number that two migrations have is found'
mv "$COPY/migrations/0003_subjects.sql" "$COPY/migrations/0005_subjects.sql"
finds migrations '0005_subjects.sql:1: its number is not 0004' 'a gap is found'
mv "$COPY/migrations/0005_subjects.sql" "$COPY/migrations/four.sql"
finds migrations 'four.sql:1: is not named' 'a migration without a number is found'
rm "$COPY/migrations/four.sql"
clean migrations

echo 'if' | file tests/bad.sh
chmod +x "$COPY/tests/bad.sh"
finds shell 'bad.sh' 'a script that does not parse is found'
echo 'true' | file tests/bad.sh
chmod -x "$COPY/tests/bad.sh"
finds shell 'bad.sh:1: not executable' 'a script that is not executable is found'
rm "$COPY/tests/bad.sh"

# One process, and each file that has a list of them.
PLACES='README.md tests/web/processes.cjs tests/bench/bench_ends.sh tests/bench/same_answers.sh docs/reference.md
    docs/python.md clients/python/src/srnf/processes.py'
mkdir -p "$COPY"/tests/{bench,web} "$COPY/clients/python/src/srnf"
printf 'const struct api_process drawn_out_process = {\n    .id = "drawn-out",\n};\n' | file server/processes/drawn_out.c
name_everywhere() {
    echo "| \`other\`, \`drawn-out\` | a surface |" >"$COPY/README.md"
    echo "        'drawn-out': [{ mesh }, 'Open']," >"$COPY/tests/web/processes.cjs"
    echo 'drawn-out-fast drawn-out {"mesh":"$MESH"}' | tee "$COPY/tests/bench/bench_ends.sh" >"$COPY/tests/bench/same_answers.sh"
    echo "execute drawn-out '{}'" >"$COPY/docs/reference.md"
    echo 'client.drawn_out(mesh)' >"$COPY/docs/python.md"
    echo '        return self.run("drawn-out", mesh=mesh)' >"$COPY/clients/python/src/srnf/processes.py"
}
name_everywhere
clean processes
for PLACE in $PLACES; do
    sed -i 's/drawn.out/drawn-in/g' "$COPY/$PLACE"
    finds processes "$PLACE:1: .*drawn-out" "a process that $PLACE does not have is found"
    name_everywhere
done
rm "$COPY/README.md" "$COPY/server/processes/drawn_out.c"

sed -i '0,/"version"/s//"resolved": "x", "version"/' "$COPY/tests/lint/package-lock.json"
finds lockfile 'package-lock.json' 'an address of a registry is found'
cp tests/lint/package-lock.json "$COPY/tests/lint"

description() { # EXTRA LINES ON STANDARD INPUT
    {
        cat <<'END'
openapi: 3.1.0
info: {title: A, version: '1', license: {name: A, identifier: GPL-3.0-only}}
security: []
servers: [{url: /}]
paths:
  /a:
    get:
      operationId: a
      summary: A.
      responses:
        '200': {description: Fine.}
        '404': {description: Gone.}
END
        cat
    } | file api/openapi.yaml
}
if [ -e "$COPY/build/lint" ]; then
    description </dev/null
    clean openapi
    sed -i 's/, license: .*/}/' "$COPY/api/openapi.yaml"
    clean openapi
    like "$OUTPUT" 'warn: .*license' 'openapi: a warning is shown and does not count'
    description <<<'      wrong: 1'
    finds openapi 'api/openapi.yaml:13: error' 'what OpenAPI does not know is found'
    rm "$COPY/api/openapi.yaml"
    finds openapi 'ENOENT' 'a description that is not there is no pass'
else
    skip openapi 'its linter is not installed; tests/lint/lint.sh installs it'
fi

# A pretended npm.
npm() { # WHAT IT SAYS
    mkdir -p "$SCRATCH/bin"
    printf '#!/bin/sh\necho "%s"\nexit 1\n' "$1" >"$SCRATCH/bin/npm"
    chmod +x "$SCRATCH/bin/npm"
    OUTPUT=$(PATH=$SCRATCH/bin:$PATH SRNFD_BUILD=build2 "$COPY/tests/lint/lint.sh" openapi 2>&1)
    RESULT=$?
}
npm 'npm error code ENOTFOUND'
like "$RESULT$OUTPUT" '^0ok 1 - openapi # SKIP .*registry' 'openapi: without a network it is left out'
npm 'npm error code EINTEGRITY'
like "$RESULT$OUTPUT" '^1not ok .*EINTEGRITY' 'openapi: packages that are not as they were locked are refused'

lint no-such-check
is "$RESULT" 2 'an unknown check is a usage error'

done_testing

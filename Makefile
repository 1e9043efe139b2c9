# srnfd - elastic shape analysis of closed surfaces as a service.
#
#   make demo       install what is missing, build, run the main job on real meshes, print what it did
#   make check      the same set-up, then lint and the tests, as they are and under ASan and UBSan
#   make run        serve on 127.0.0.1:8080
#   make            build the daemon, build/srnfd
#   make install    daemon, library, headers and manual, PREFIX=/usr/local DESTDIR=; make install-python: the client
#   make deb        the Debian packages, in build/deb; make test-deb installs them in a clean system
#   make help       this list
#
#   make quick      lint and the tests that take no more than some seconds
#   make lint       formatting, layers, public headers, shell, OpenAPI
#   make asan       the tests under ASan and UBSan
#   make tsan       what has threads under ThreadSanitizer
#   make nightly    the tests that are too long for make check, and those that it runs in one build, in the other
#   make crash      kill -9 under load, CYCLES=50 times
#   make faults     each write and each allocation fails in turn
#   make test-slurm the executor slurm on a cluster of its own, as root; not part of make check
#   make load       requests a second, beside hostile clients too; shares; short jobs beside long ones
#   make soak       REQUESTS=1000000 and JOBS=5000 against one daemon, and what it holds meanwhile
#   make fuzz       each reader, 60 s
#   make fuzz-api   requests drawn from api/openapi.yaml, REQUESTS=20000 of them
#   make coverage   lines of core/ and server/ that the tests run
#   make bench      every figure that the READMEs and docs/ quote
#   make paper      the paper's figures and tables with the data at hand, build/paper.html
#
#   make format     clang-format over all sources
#   make pictures   draw the pictures of README anew
#   make web        bundle the dashboard anew, web/dist
#   make screenshots the pictures of docs/dashboard.md
#   make openapi    write the processes' schemas into api/openapi.yaml
#   make wheel      the Python client for pip, in build/python
#   make library    libsrnf.so and libsrnf.a for others, in build/lib
#   make clean      remove build/
#
# Sources are found by their place: core/*/*.c is the library, server/*/*.c the daemon, and each
# tests/**/test_*.c, tests/bench/bench_*.c and tests/fuzz/fuzz_*.c a program of its own.
# Builds print one short line a file; V=1 shows the commands.
# CONFIG selects a build: release, asan, tsan, clang, warnings, fuzz, coverage. Each has its own folder under build/.

CONFIG  ?= release
PREFIX  ?= /usr/local
B       := build$(if $(filter-out release,$(CONFIG)),/$(CONFIG))
O       := $(B)/obj

CC_release := gcc
CC_asan    := clang
CC_tsan    := gcc
CC_clang   := clang
CC_warnings := clang
CC_fuzz    := clang
CC_coverage := gcc
CC         := $(CC_$(CONFIG))

WARN := -Wall -Wextra -Wshadow -Wconversion -Wstrict-prototypes -Wmissing-prototypes -Wvla -Wformat=2 \
        -Wpointer-arith -Wcast-qual -Wwrite-strings -Wundef -Werror
OPT_release := -O3 -g
OPT_clang   := -O2 -g
# For what clang has to say: its warnings come from the front end, so nothing behind that runs, and objects are empty.
OPT_warnings := -fsyntax-only
# By clang, so that its warnings count as well as gcc's. Its undefined behaviour has offsets from null in it, too, which
# gcc's has not. The macro is what gcc tells programs by. Traces need the lines alone.
OPT_asan    := -O1 -g1 -D__SANITIZE_ADDRESS__ -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all
OPT_tsan    := -O1 -g -fno-omit-frame-pointer -fsanitize=thread
OPT_fuzz    := -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined,fuzzer-no-link \
               -fno-sanitize-recover=all
OPT_coverage := -O1 -g --coverage -fprofile-update=atomic -DTESTS_COUNT_LINES
OPT         := $(OPT_$(CONFIG))

# Hot loops over grids are compiled for several instruction sets and chosen at run time (see
# core/harmonics/simd.h); everything else is built for the baseline of the architecture.
# Everything can become part of a shared library, libsrnf.so or that of the tests.
CFLAGS   = -std=c17 -D_GNU_SOURCE $(WARN) $(OPT) -fno-math-errno -ffp-contract=off -fstack-protector-strong \
           -fPIC -fno-semantic-interposition
CPPFLAGS = -Iinclude -Icore -Iserver -Itests -I. -MMD -MP
# A shared library, so that libraries that are loaded before it can stand in for malloc (tests/crash).
LD_asan := -shared-libsan -Wl,-rpath,$(shell clang -print-runtime-dir 2>/dev/null)
LDFLAGS  = $(LD_$(CONFIG)) $(filter -fsanitize=% -fno-sanitize% --coverage,$(subst $(comma)fuzzer-no-link,,$(OPT))) -Wl,-z,relro,-z,now
comma   := ,
# More than two hundred test programs are linked for each build; gold takes half of the time of ld.
GOLD     := $(shell $(CC) -fuse-ld=gold -Wl,--version >/dev/null 2>&1 && echo -fuse-ld=gold)
CORE_LIBS   = -llapacke -lopenblas -lfftw3 -lfftw3_threads -lglpk -lexpat -lz -lm
SERVER_LIBS = -lmicrohttpd -lgnutls -ljansson -lsqlite3 -lsodium -lutf8proc -larchive -lcurl -lzstd -lpthread

CORE_SRC   := $(sort $(wildcard core/*.c core/*/*.c))
SERVER_SRC := $(sort $(filter-out server/main.c,$(wildcard server/*.c server/*/*.c)))
SUPPORT_SRC:= $(sort $(wildcard tests/support/*.c))
TEST_SRC   := $(sort $(shell find tests -name 'test_*.c'))
BENCH_SRC  := $(sort $(wildcard tests/bench/bench_*.c))
FUZZ_SRC   := $(sort $(wildcard tests/fuzz/fuzz_*.c))
PAPER_SRC  := $(sort $(filter-out tests/paper/test_%,$(wildcard tests/paper/*.c)))
SHIM_SRC   := $(sort $(wildcard tests/crash/*_shim.c))
TOOL_SRC   := $(sort $(wildcard tests/tools/*.c))
EMBEDDED   := $(sort $(wildcard migrations/*.sql)) api/openapi.yaml
# The dashboard as it was built (make web) and its example, packed: by their names at /ui/.
UI_FILES   := $(sort $(wildcard web/dist/*)) $(sort $(wildcard tests/data/aal_subcortex/*.ply)) web/example/labels.csv \
              web/example/licence.txt
ui_name     = $(patsubst tests/data/aal_subcortex/%,example/%,$(patsubst web/dist/%,%,$(1:web/example/%=example/%)))

Q   := $(if $(V),,@)
say  = @$(if $(V),:,printf '  %-5s%s\n' '$(1)' '$(2)')
compile = $(CC) $(CPPFLAGS) $(CFLAGS) $(if $(filter warnings,$(CONFIG)),-MF $(@:.o=.d) -MT $@ $< && touch,-c $< -o) $@
obj = $(patsubst %,$(O)/%.o,$(basename $(1)))
CORE_LIB   := $(B)/libsrnf.a
SERVER_LIB := $(B)/libsrnfd.a
TESTED     := $(B)/tests/libtested.so
TESTS      := $(patsubst tests/%.c,$(B)/tests/%,$(TEST_SRC))
BENCHES    := $(patsubst tests/%.c,$(B)/tests/%,$(BENCH_SRC))
SHIMS      := $(patsubst tests/crash/%.c,$(B)/tests/%.so,$(SHIM_SRC))
TOOLS      := $(patsubst tests/%.c,$(B)/tests/%,$(TOOL_SRC))
FUZZERS    := $(patsubst tests/%.c,$(B)/tests/%,$(FUZZ_SRC))

.PHONY: all help demo run check quick nightly lint asan tsan clang bench paper crash faults load fuzz fuzz-api soak coverage install install-service install-library deb test-deb deps clean build-tests \
        build-threaded \
        build-benches unit format
# Kept, but not "secondary": then an object whose header is gone would not be made anew.
.PRECIOUS: $(O)/%.o
.DELETE_ON_ERROR:
all: $(B)/srnfd

# ---- set-up -------------------------------------------------------------------------------------------

deps:
	@deploy/install-deps.sh

help:
	@sed -n 's/^#   make/  make/p; /^# Sources/q' Makefile

demo: deps
	@$(MAKE) --no-print-directory -j2 all
	@tests/demo.sh

run: deps
	@$(MAKE) --no-print-directory -j2 all
	$(B)/srnfd serve --data "$${SRNFD_DATA:-data}"

check:
	@deploy/install-deps.sh --tests
	@tests/check.sh

# ---- building -----------------------------------------------------------------------------------------

$(O)/%.o: %.c
	@mkdir -p $(dir $@)
	$(call say,CC,$<)
	$(Q)$(compile)

# Most of what tests compute is sums of harmonics. At -O1 the sanitizers make them ten times slower than a release
# build, so they get what a release build chooses at run time (core/harmonics/simd.h), with every check left in. So do
# the files that inversions, registrations and searches of nearest points spend most of their time in.
AVX2 := $(shell grep -w avx2 /proc/cpuinfo 2>/dev/null | grep -w fma | grep -qw bmi2 && echo -march=x86-64-v3)
HOT_asan := -O3 $(AVX2)
HOT := harmonics/% linear/vector mesh/index mesh/index_box mesh/index_query mesh/measure \
       sphere_map/metric sphere_map/vertex_star srnf/pointwise registration/objective \
       registration/start registration/tabulated_follow registration/tabulated_load \
       registration/tabulated_matrix registration/tabulated_moving registration/tabulated_step
$(patsubst %,$(O)/core/%.o,$(HOT)): CFLAGS += $(HOT_$(CONFIG))
# Each is unrolled by hand for three orders of splines: at -O3 it is no faster, and takes longer to compile.
$(O)/core/registration/tabulated_step.o $(O)/core/registration/tabulated_load.o: HOT_asan += -O2

# Test programs take little time themselves, and compile in half of the time of -O1; those of the
# sanitizers, with every check, three times as fast.
$(patsubst %.c,$(O)/%.o,$(TEST_SRC)): CFLAGS += $(TEST_OPT_$(CONFIG))
TEST_OPT_release := -O0 -g1
TEST_OPT_asan    := -O0
# But for some that compute by themselves what they compare with.
OWN := mesh/test_crossings mesh/test_index stats/test_measured
$(patsubst %,$(O)/tests/core/%.o,$(OWN)): TEST_OPT_asan := -O2
$(patsubst %,$(O)/tests/core/%.o,$(OWN)): TEST_OPT_release := -O2 -g1
# So does the server, which the sanitizers' tests hardly wait for: JSON, SQLite and curl are not sanitized, and what is
# computed is the core.
$(O)/server/%.o: CFLAGS += $(SERVER_OPT_$(CONFIG))
SERVER_OPT_asan := -O0
# For the same reason: it compiles in five sixths of the time of -O3.
SERVER_OPT_release := -O2

# The transforms and what is built on them may fuse multiply and add; the exact predicates of the meshes may not.
FUSED := harmonics linear srnf surface inversion registration geodesic pullback
FUSED_FLAGS := -ffp-contract=fast -fno-trapping-math
$(foreach folder,$(FUSED),$(O)/core/$(folder)/%.o): CFLAGS += $(FUSED_FLAGS)

$(CORE_LIB): $(call obj,$(CORE_SRC))
	@rm -f $@
	$(call say,AR,$@)
	$(Q)ar qcs $@ $^

# Part of the numeric build id, and so of every cache key: whatever of another core, or of another reading of
# inputs and writing of results, made an answer is computed anew. A file too many costs a few answers made
# twice; one too few serves old answers as new. make numeric-digest prints it.
ANSWER_TEXT   := $(CORE_SRC) $(sort $(wildcard include/*.h include/srnf/*.h core/*.h core/*/*.h \
                   server/processes/*.[ch] server/toolkit/*.[ch] server/api/*.[ch] \
                   server/compute/*.[ch] server/jobs/*.[ch] server/tasks/*.[ch]))
ANSWER_FLAGS  := $(CFLAGS) $(HOT_$(CONFIG)) $(SERVER_OPT_$(CONFIG)) $(FUSED) $(FUSED_FLAGS)
answer_digest  = $(shell (echo '$(ANSWER_FLAGS)'; cat $(ANSWER_TEXT)) | sha256sum | cut -c 1-16)
$(O)/server/build.o: $(ANSWER_TEXT)
$(O)/server/build.o: CPPFLAGS += -DSRNF_ANSWER_DIGEST='"$(answer_digest)"'

# The processes that the service offers: found in server/processes, and listed after those whose order is given.
PROCESS_SRC := $(sort $(wildcard server/processes/*.c))
FIRST       := extract encode invert geodesic register distances mean pca modes sample project evaluate compare shoot \
               transport transfer classify repair mirror regress train predict score report change asymmetry pca_parts \
               trajectories neighbours
FOUND       := $(shell sed -n 's/^const struct api_process \([a-z_]*\)_process = {$$/\1/p' $(PROCESS_SRC))
PROCESSES   := $(filter $(FOUND),$(FIRST)) $(filter-out $(FIRST),$(FOUND))
$(O)/server/processes/processes.o: $(PROCESS_SRC)
$(O)/server/processes/processes.o: CPPFLAGS += -D'PROCESSES(row)=$(patsubst %,row(%),$(PROCESSES))'
.PHONY: numeric-digest numeric-text
numeric-digest:
	@echo $(answer_digest)
numeric-text:
	@echo $(ANSWER_TEXT)

# ---- the library for others ---------------------------------------------------------------------------

# The shared library's name has the minor version as long as the major one is 0: until then any minor version
# may change the interface.
VERSION   := $(shell sed -n 's/^.define SRNF_VERSION "\(.*\)"/\1/p' include/srnf/base.h)
SONAME    := libsrnf.so.$(basename $(VERSION))
SHARED    := $(B)/lib/libsrnf.so.$(VERSION)
# The archive for others is one object, in which names that include/ does not declare are local.
ARCHIVE   := $(B)/lib/libsrnf.a

# The names that include/ declares, and nothing else, are seen in both.
SHOWN     := $(B)/lib/shown
$(SHOWN): $(wildcard include/*.h include/srnf/*.h)
	@mkdir -p $(dir $@)
	$(call say,GEN,$@)
	$(Q)cat $^ | $(CC) -E -P -Iinclude -x c - | grep -oE '\bsrnf_[a-z0-9_]+ *\(' | tr -d ' (' | sort -u >$@

$(SHARED): $(CORE_LIB) $(SHOWN)
	$(call say,LINK,$@)
	$(Q)(echo '{ global:'; sed 's/$$/;/' $(SHOWN); echo 'local: *; };') >$(SHOWN).map
	$(Q)$(CC) $(LDFLAGS) -shared -Wl,-soname,$(SONAME) -Wl,--no-undefined \
	    -Wl,--version-script,$(SHOWN).map -o $@ \
	    -Wl,--whole-archive $< -Wl,--no-whole-archive -Wl,--as-needed $(CORE_LIBS)

$(ARCHIVE): $(CORE_LIB) $(SHOWN)
	$(call say,AR,$@)
	$(Q)ld -r -o $(B)/lib/srnf.o --whole-archive $<
	$(Q)objcopy --keep-global-symbols=$(SHOWN) $(B)/lib/srnf.o
	@rm -f $@
	$(Q)ar rcs $@ $(B)/lib/srnf.o

.PHONY: library version
library: $(SHARED) $(ARCHIVE)
version:
	@echo $(VERSION)

# The description of the API in OpenAPI 3.0, and as a page.
DERIVED := $(O)/openapi.json $(O)/openapi.html
$(DERIVED): $(O)/openapi.%: api/openapi.yaml api/derive.py
	@mkdir -p $(dir $@)
	$(call say,GEN,$@)
	$(Q)/usr/bin/python3 api/derive.py $* <$< >$@

# The bytes of migrations, of the API description and of the dashboard, as arrays in one C file.
$(O)/embedded.c: deploy/embed.sh $(EMBEDDED) $(DERIVED) $(UI_FILES)
	@mkdir -p $(O)/ui/example
	$(call say,GEN,$@)
	$(Q)$(foreach f,$(UI_FILES),gzip -9nc $(f) >$(O)/ui/$(call ui_name,$(f)).gz &&) \
	    deploy/embed.sh $(EMBEDDED) $(foreach file,$(DERIVED),api/$(notdir $(file))=$(file)) \
	    $(foreach f,$(UI_FILES),ui/$(call ui_name,$(f))=$(O)/ui/$(call ui_name,$(f)).gz) > $@

# The parts of the API's description that the tables of the processes give; tests/api/test_openapi.sh compares.
.PHONY: openapi
openapi: $(B)/srnfd
	$(Q)api/generate.sh $(B)/srnfd <api/openapi.yaml >$(B)/openapi.yaml
	$(Q)cp $(B)/openapi.yaml api/openapi.yaml

$(O)/embedded.o: $(O)/embedded.c
	$(call say,CC,$<)
	$(Q)$(compile)

$(SERVER_LIB): $(call obj,$(SERVER_SRC)) $(O)/embedded.o
	@rm -f $@
	$(call say,AR,$@)
	$(Q)ar qcs $@ $^

# Under ThreadSanitizer the daemon has the core of the release build: instrumented it is 15 to 25 times slower,
# and it neither makes threads nor waits for any. What it does in loops that others spread over threads is for
# its own tests, which have it instrumented. So has the daemon the files in which bodies of a loop take turns with what
# they work in: whoever does not see that takes it for shared.
TURNS       := core/stats/mean_tools.c core/registration/tabulated_tools.c
DAEMON_CORE := $(if $(filter tsan,$(CONFIG)),$(call obj,$(TURNS)) build/libsrnf.a,$(CORE_LIB))
ifneq ($(filter asan tsan,$(CONFIG)),)
.PHONY: build/libsrnf.a
build/libsrnf.a:
	@$(MAKE) --no-print-directory CONFIG=release $@
endif

# libmicrohttpd reads through server/http/tap.c.
TAP := -Wl,--defsym=recv=tap_recv,--defsym=gnutls_record_recv=tap_record_recv
$(B)/srnfd $(B)/srnfd-plain-core $(TESTED): LDFLAGS += $(TAP)

$(B)/srnfd: $(O)/server/main.o $(SERVER_LIB) $(DAEMON_CORE)
	$(call say,LINK,$@)
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(SERVER_LIBS) $(CORE_LIBS)

# Beside it, for tests of the API that wait for numerics which others run with ASan (plain-core in tests/run.sh).
PLAIN_asan := $(B)/srnfd-plain-core
$(B)/srnfd-plain-core: $(O)/server/main.o $(SERVER_LIB) build/libsrnf.a
	$(call say,LINK,$@)
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(SERVER_LIBS) $(CORE_LIBS)

$(B)/tests/fuzz/fuzz_%: $(O)/tests/fuzz/fuzz_%.o $(O)/tests/support/scratch.o $(SERVER_LIB) $(CORE_LIB)
	@mkdir -p $(dir $@)
	$(call say,LINK,$@)
	$(Q)$(CC) $(LDFLAGS) $(if $(filter fuzz,$(CONFIG)),-fsanitize=fuzzer) -o $@ $^ $(SERVER_LIBS) \
	    $(CORE_LIBS) -lcmocka

$(B)/paper: $(call obj,$(PAPER_SRC) $(SUPPORT_SRC)) $(SERVER_LIB) $(CORE_LIB)
	$(call say,LINK,$@)
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(SERVER_LIBS) $(CORE_LIBS) -lsharp -lpng

# The dashboard's bundle and the types of the API that it is held to, both committed, so that nothing else needs npm.
# make lint compares.
.PHONY: web
web:
	@web/install.sh
	NODE_PATH=$(abspath build/web/node_modules) node web/types.mjs
	NODE_PATH=$(abspath build/web/node_modules) node web/build.mjs

# The pictures of docs/dashboard.md.
.PHONY: screenshots
screenshots: $(B)/srnfd
	docs/screenshots.sh

# The pictures that README shows, drawn anew.
.PHONY: pictures
pictures: $(B)/pictures
	$(B)/pictures docs/pictures
$(B)/pictures: $(O)/docs/pictures.o $(call obj,$(filter-out tests/paper/paper.c,$(PAPER_SRC)) \
    $(SUPPORT_SRC)) $(SERVER_LIB) $(CORE_LIB)
	$(call say,LINK,$@)
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(SERVER_LIBS) $(CORE_LIBS) -lsharp -lpng

# Loaded into a daemon under test with LD_PRELOAD; never sanitized, so that they load before anything.
$(B)/tests/%_shim.so: tests/crash/%_shim.c tests/support/fault.h
	@mkdir -p $(dir $@)
	$(call say,LINK,$@)
	$(Q)$(CC) -std=c17 -D_GNU_SOURCE $(WARN) -Itests -O2 -g -shared -fPIC -o $@ $< -ldl

# What shell tests call thousands of times; never sanitized, so that it starts at once.
$(B)/tests/tools/%: tests/tools/%.c
	@mkdir -p $(dir $@)
	$(call say,LINK,$@)
	$(Q)$(CC) -std=c17 -D_GNU_SOURCE $(WARN) -O1 -g -o $@ $< -ljansson

# The test of the report links the parts that write it.
$(B)/tests/paper/test_report: $(call obj,$(addprefix tests/paper/,report.c chart.c picture.c))
$(B)/tests/paper/test_report: SERVER_LIBS += -lpng

# What test programs share is one library: each is linked with it in a tenth of the time that the archives took, and
# none is linked again when the library changes. It is found from the place of the program. A program's own srnf_alloc
# (tests/support/refusing.h) stands in for the library's, as that of server/jobs/memory.c does for the core's.
$(TESTED): $(call obj,$(filter-out core/memory.c,$(CORE_SRC)) $(SERVER_SRC) $(SUPPORT_SRC)) $(O)/embedded.o
	@mkdir -p $(dir $@)
	$(call say,LINK,$@)
	$(Q)$(CC) $(LDFLAGS) $(GOLD) -shared -o $@ $^ $(SERVER_LIBS) $(CORE_LIBS) -lsharp -lcmocka

$(B)/tests/%: $(O)/tests/%.o | $(TESTED)
	@mkdir -p $(dir $@)
	$(call say,LINK,$@)
	$(Q)$(CC) $(LDFLAGS) $(GOLD) -Wl,-rpath,'$$ORIGIN/$(call up,$*)' -o $@ $^ $(TESTED) $(SERVER_LIBS) $(CORE_LIBS) \
	    -lsharp -lcmocka
up = $(subst $() ,,$(patsubst %,../,$(subst /, ,$(dir $(1)))))

# What is measured is linked as the daemon is.
$(B)/tests/bench/%: $(O)/tests/bench/%.o $(call obj,$(SUPPORT_SRC)) $(SERVER_LIB) $(CORE_LIB)
	@mkdir -p $(dir $@)
	$(call say,LINK,$@)
	$(Q)$(CC) $(LDFLAGS) $(GOLD) -o $@ $^ $(SERVER_LIBS) $(CORE_LIBS) -lsharp -lcmocka

build-tests: $(B)/srnfd $(PLAIN_$(CONFIG)) $(B)/paper $(TESTS) $(SHIMS) $(TOOLS)

# What has threads: all of the server, whole daemons, and of the core what a test spreads over threads.
THREADED_CORE := $(shell grep -lE 'group_threads|parallel_threads|parallel_spread' $(filter tests/core/%,$(TEST_SRC)))
THREADED      := $(THREADED_CORE) $(filter tests/server/% tests/http/% tests/crash/%,$(TEST_SRC))
build-threaded: $(B)/srnfd $(SHIMS) $(TOOLS) $(patsubst tests/%.c,$(B)/tests/%,$(THREADED))
build-benches: $(BENCHES)

# What clang is not asked about when it builds the tests: compiled, nothing linked.
.PHONY: objects
objects: $(call obj,$(BENCH_SRC) $(FUZZ_SRC))

-include $(shell [ -d $(O) ] && find $(O) -name '*.d')

# ---- testing ------------------------------------------------------------------------------------------

unit: build-tests
	tests/run.sh $(B)

# Before each commit: all that is quick. make check is the whole of it. The linter waits and mostly uses one processor.
quick:
	$(MAKE) --no-print-directory -s -j2 build-tests
	@tests/lint/lint.sh >$(B)/linter.log 2>&1 & SRNFD_QUICK=1 tests/run.sh $(B); tested=$$?; \
	    wait $$!; linted=$$?; cat $(B)/linter.log; exit $$((tested | linted))

# What make check leaves out because it takes too long, or runs in the other build alone.
nightly:
	@deploy/install-deps.sh --tests
	@$(MAKE) --no-print-directory -s -j2 build-tests
	@$(MAKE) --no-print-directory -s -j2 CONFIG=asan build-tests
	@tests/nightly.sh build build/asan

asan clang:
	$(MAKE) --no-print-directory -j2 CONFIG=$@ build-tests
	tests/run.sh build/$@

tsan:
	$(MAKE) --no-print-directory -j2 CONFIG=$@ build-threaded
	@tests/tsan.sh build/$@ $(patsubst tests/%,%,$(THREADED_CORE))

lint:
	tests/lint/lint.sh

format:
	@clang-format -i $(shell git ls-files '*.c' '*.h')

bench: $(BENCHES) $(B)/srnfd
	@tests/bench/run.sh $(B)

crash: build-tests
	CYCLES=$${CYCLES:-50} $(B)/tests/crash/test_crash
	SRNFD_KILL_ROUNDS=$${ROUNDS:-3} tests/run.sh $(B) '^crash/test_kill'

faults: build-tests
	STRIDE=$${STRIDE:-1} $(B)/tests/crash/test_storage
	STRIDE=$${STRIDE:-1} $(B)/tests/crash/test_memory
	STRIDE=$${STRIDE:-1} SRNFD_TEST_TIMEOUT=$${SRNFD_TEST_TIMEOUT:-1800} tests/run.sh $(B) '^core/.*(allocation|memory)\.c'

load: $(B)/srnfd $(B)/tests/load/test_load $(B)/tests/load/test_shares $(B)/tests/load/test_express
	SRNFD_LOAD=full SRNFD=$(B)/srnfd $(B)/tests/load/test_load 2>/dev/null
	SRNFD_LOAD=full SRNFD=$(B)/srnfd $(B)/tests/load/test_shares 2>/dev/null
	SRNFD_LOAD=full SRNFD=$(B)/srnfd $(B)/tests/load/test_express 2>/dev/null

# Line coverage of the library and the daemon by all tests; fails below what tests/coverage.sh demands.
coverage:
	$(MAKE) --no-print-directory -j2 CONFIG=coverage build-tests
	find build/coverage -name '*.gcda' -delete
	tests/run.sh build/coverage; tests/coverage.sh build/coverage

soak: $(B)/srnfd
	@REQUESTS=$${REQUESTS:-1000000} JOBS=$${JOBS:-5000} GROWTH=$${GROWTH:-0.05} SRNFD_BUILD=$(abspath $(B)) \
	    SRNFD=$(abspath $(B))/srnfd tests/soak/test_soak.sh

fuzz-api: $(B)/srnfd
	@SEED=$${SEED:-random} REQUESTS=$${REQUESTS:-20000} SRNFD_BUILD=$(abspath $(B)) SRNFD=$(abspath $(B))/srnfd \
	    tests/fuzz/test_api.sh

fuzz:
	$(MAKE) --no-print-directory -j2 CONFIG=fuzz fuzzers
	tests/fuzz/run.sh build/fuzz $${SECONDS_EACH:-60}

# Every figure and table of the paper with the data at hand, as one HTML file.
paper:
	@deploy/install-deps.sh --tests
	@$(MAKE) --no-print-directory -j2 $(B)/paper
	$(B)/paper $(B)/paper.html

.PHONY: fuzzers
fuzzers: $(FUZZERS)

# Needs slurm-wlm and munge; says so and ends well where they are not.
.PHONY: test-slurm
test-slurm: $(B)/srnfd $(TOOLS)
	@SRNFD_BUILD=$(abspath $(B)) SRNFD=$(abspath $(B))/srnfd tests/slurm/run.sh

# ---- installing ---------------------------------------------------------------------------------------

MULTIARCH ?=
LIBDIR    := $(PREFIX)/lib$(if $(MULTIARCH),/$(MULTIARCH))
INSTALL   := install -D -m 644

install: install-service install-library

install-service: all
	install -D -m 755 $(B)/srnfd $(DESTDIR)$(PREFIX)/bin/srnfd
	$(INSTALL) api/openapi.yaml $(DESTDIR)$(PREFIX)/share/srnfd/openapi.yaml
	$(INSTALL) docs/man/srnfd.8 $(DESTDIR)$(PREFIX)/share/man/man8/srnfd.8
	$(INSTALL) -t $(DESTDIR)$(PREFIX)/share/doc/srnfd README.md CHANGELOG.md deploy/OPERATIONS.md docs/*.md
	$(INSTALL) -t $(DESTDIR)$(PREFIX)/share/doc/srnfd/examples deploy/nginx.conf deploy/srnfd-slurm.json

# Where the examples of the library go: with the documents, or those of its package.
EXAMPLEDIR ?= $(PREFIX)/share/doc/srnfd/examples

install-library: library
	$(INSTALL) include/srnf.h $(DESTDIR)$(PREFIX)/include/srnf.h
	$(INSTALL) -t $(DESTDIR)$(PREFIX)/include/srnf include/srnf/*.h
	$(INSTALL) $(ARCHIVE) $(DESTDIR)$(LIBDIR)/libsrnf.a
	$(INSTALL) $(SHARED) $(DESTDIR)$(LIBDIR)/$(notdir $(SHARED))
	ln -sf $(notdir $(SHARED)) $(DESTDIR)$(LIBDIR)/$(SONAME)
	ln -sf $(SONAME) $(DESTDIR)$(LIBDIR)/libsrnf.so
	@mkdir -p $(DESTDIR)$(LIBDIR)/pkgconfig
	sed -e 's,@PREFIX@,$(PREFIX),' -e 's,@LIBDIR@,$(LIBDIR),' -e 's,@VERSION@,$(VERSION),' \
	    -e 's,@LIBS@,$(CORE_LIBS),' deploy/srnf.pc.in >$(DESTDIR)$(LIBDIR)/pkgconfig/srnf.pc
	$(INSTALL) docs/man/srnf.3 $(DESTDIR)$(PREFIX)/share/man/man3/srnf.3
	$(INSTALL) -t $(DESTDIR)$(EXAMPLEDIR) examples/*.[ch]

# The Python client and its command: its metadata by hand, as pip would leave it, so that no pip is needed.
PYTHON    := /usr/bin/python3
PYTHONDIR ?= $(PREFIX)/lib/python$(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')/dist-packages
.PHONY: install-python wheel
install-python:
	$(INSTALL) -t $(DESTDIR)$(PYTHONDIR)/srnf clients/python/src/srnf/*.py clients/python/src/srnf/py.typed
	@mkdir -p $(DESTDIR)$(PYTHONDIR)/srnf-$(VERSION).dist-info $(DESTDIR)$(PREFIX)/bin
	printf 'Metadata-Version: 2.1\nName: srnf\nVersion: %s\nRequires-Dist: numpy\n' $(VERSION) \
	    >$(DESTDIR)$(PYTHONDIR)/srnf-$(VERSION).dist-info/METADATA
	printf '#!/usr/bin/python3\nimport sys\n\nfrom srnf.cli import main\n\nsys.exit(main())\n' \
	    >$(DESTDIR)$(PREFIX)/bin/srnf
	chmod 755 $(DESTDIR)$(PREFIX)/bin/srnf
	$(INSTALL) docs/man/srnf.1 $(DESTDIR)$(PREFIX)/share/man/man1/srnf.1

# The wheel of the Python client, built without a network from a copy, so that nothing is left in the tree.
wheel:
	@rm -rf $(B)/python
	@mkdir -p $(B)/python/clients
	@cp -r clients/python $(B)/python/clients/python
	@$(INSTALL) include/srnf/base.h $(B)/python/include/srnf/base.h
	@$(PYTHON) -m pip wheel --quiet --disable-pip-version-check --no-index --no-deps --no-build-isolation \
	    --wheel-dir $(B)/python $(B)/python/clients/python
	@ls $(B)/python/*.whl

# The Debian packages of the release build, in build/deb; test-deb installs them in a clean system.
deb: all library
	@deploy/install-deps.sh --package
	@deploy/deb.sh build/deb

test-deb: deb
	@tests/deploy/deb.sh

clean:
	rm -rf build

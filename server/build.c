/*
 * build.c - versions and the numeric build id.
 *
 * The id names the project's version, a digest of the compiler flags and of the sources that decide
 * answers (ANSWER_TEXT of the Makefile), the compiler, and the libraries that compute: FFTW, GLPK
 * and OpenBLAS with the kernels that it has chosen for this processor. The HTTP library or the
 * database may change without making results stale; they are only listed.
 */
#include "build.h"

#include "srnf.h"

#include <archive.h>
#include <cblas.h>
#include <curl/curl.h>
#include <expat.h>
#include <fftw3.h>
#include <glpk.h>
#include <jansson.h>
#include <microhttpd.h>
#include <pthread.h>
#include <sodium.h>
#include <sqlite3.h>
#include <stdio.h>
#include <string.h>
#include <utf8proc.h>
#include <zlib.h>
#include <zstd.h>

/* Set by the Makefile from what decides answers, and the flags. */
#ifndef SRNF_ANSWER_DIGEST
#define SRNF_ANSWER_DIGEST "unknown"
#endif

#ifdef __clang__
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

/* What OpenBLAS, GLPK and libcurl say of themselves. Each puts it together in a buffer of its own
   with every call, where another thread would read it half written: they are asked once. */
static struct {
    char config[160], core[32], glpk[32], curl[200];
} said;

static void ask_libraries(void)
{
    (void)snprintf(said.config, sizeof said.config, "%s", openblas_get_config());
    (void)snprintf(said.core, sizeof said.core, "%s", openblas_get_corename());
    (void)snprintf(said.glpk, sizeof said.glpk, "%s", glp_version());
    (void)snprintf(said.curl, sizeof said.curl, "%s", curl_version());
}

static void hear_libraries(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;

    (void)pthread_once(&once, ask_libraries);
}

void build_parts(struct build_part parts[BUILD_PARTS])
{
    const struct {
        const char *name, *first, *second;
    } table[BUILD_PARTS] = {
        {"srnfd", SRNF_VERSION, "core " SRNF_ANSWER_DIGEST},
        {"compiler", COMPILER, ""},
        {"openblas", said.config, said.core},
        {"fftw", fftw_version, ""},
        {"glpk", said.glpk, ""},
        {"zlib", zlibVersion(), ""},
        {"expat", XML_ExpatVersion(), ""},
        {"libmicrohttpd", MHD_get_version(), ""},
        {"sqlite", sqlite3_libversion(), ""},
        {"jansson", jansson_version_str(), ""},
        {"libcurl", said.curl, ""},
        {"libarchive", archive_version_string(), ""},
        {"utf8proc", utf8proc_version(), ""},
        {"libzstd", ZSTD_versionString(), ""},
        {"libsodium", sodium_version_string(), ""},
    };

    hear_libraries();
    for (size_t i = 0; i < BUILD_PARTS; i++) {
        parts[i].name = table[i].name;
        (void)snprintf(parts[i].version, sizeof parts[i].version, "%s%s%s", table[i].first,
                       table[i].second[0] ? ", " : "", table[i].second);
    }
}

void build_numeric_id(char id[BUILD_ID_SIZE])
{
    hear_libraries();
    (void)snprintf(id, BUILD_ID_SIZE, "srnf %s core %s; %s; openblas %s %s; %s; glpk %s",
                   SRNF_VERSION, SRNF_ANSWER_DIGEST, COMPILER, said.config, said.core, fftw_version,
                   said.glpk);
}

void build_arithmetic_id(char id[BUILD_ARITHMETIC_SIZE])
{
    char numeric[BUILD_ID_SIZE];
    const char *instructions = "baseline";

#ifdef __x86_64__
    __builtin_cpu_init();
    /* Those of x86-64-v3 that core/harmonics/simd.h asks for; no processor has one without the
       others. */
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
        __builtin_cpu_supports("bmi2")) {
        instructions = "x86-64-v3";
    }
#endif
    build_numeric_id(numeric);
    (void)snprintf(id, BUILD_ARITHMETIC_SIZE, "%s; %s", numeric, instructions);
}

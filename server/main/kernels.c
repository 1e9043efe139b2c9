/*
 * kernels.c - which of OpenBLAS's kernels the process computes with.
 */
#include "main/kernels.h"

#include <cblas.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define VARIABLE "OPENBLAS_CORETYPE"
/* Those that OpenBLAS falls back to on x86-64: SSE3. */
#define FALLBACK "Prescott"

const char *kernels_better(const char *core, struct kernels_processor processor)
{
    if (strcmp(core, FALLBACK) != 0) {
        return NULL;
    }
    return processor.avx512 ? "SkylakeX" : processor.avx2 ? "Haswell" : NULL;
}

static struct kernels_processor this_processor(void)
{
    struct kernels_processor can = {false, false};

#ifdef __x86_64__
    __builtin_cpu_init();
    can.avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    can.avx512 = can.avx2 && __builtin_cpu_supports("avx512f") &&
                 __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
                 __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
#endif
    return can;
}

void kernels_choose(char **arguments)
{
    const char *given = getenv(VARIABLE);
    const char *better = kernels_better(openblas_get_corename(), this_processor());
    char program[PATH_MAX];
    ssize_t n;

    if (!better || (given && given[0]) || setenv(VARIABLE, better, 1) != 0) {
        return;
    }
    /* By its own path: a process that is started by the link is called "exe" by ps. */
    n = readlink("/proc/self/exe", program, sizeof program - 1);
    if (n > 0) {
        program[n] = '\0';
        (void)execv(program, arguments);
    }
}

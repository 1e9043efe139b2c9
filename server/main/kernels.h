/*
 * kernels.h - which of OpenBLAS's kernels the process computes with.
 */
#ifndef SRNFD_MAIN_KERNELS_H
#define SRNFD_MAIN_KERNELS_H

#include <stdbool.h>

/* What the processor and its system can do. */
struct kernels_processor {
    bool avx2, avx512; /* with fused multiply and add; all of avx512 that Skylake-X has */
};

/* The kernels, a value of OPENBLAS_CORETYPE, that this processor should have instead of `core`, as
   openblas_get_corename has it; NULL: none better. */
const char *kernels_better(const char *core, struct kernels_processor processor);

/*
 * OpenBLAS chooses kernels by a list of processors while it is loaded. For one that is newer than
 * the list, as an Emerald Rapids is to OpenBLAS 0.3.21, it takes those of 2004, and products of
 * matrices take five times as long. Then this starts the program again, in the same process, with
 * OPENBLAS_CORETYPE set; a value that is there already stays. Goes on as it is where that cannot be
 * done. Call it before threads, files and signals.
 */
void kernels_choose(char **arguments);

#endif

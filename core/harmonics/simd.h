/*
 * simd.h - vectors of four doubles and the choice of instruction set at run time.
 *
 * The hot loops are written with the vector extension that gcc and clang share. SRNF_HOT compiles a
 * function once for the baseline and once for processors with AVX2 and FMA; the loader picks one.
 * Sanitizers cannot live with the resolver functions that this needs, so their builds have the
 * baseline only. Both versions do the same operations in the same order; they differ in the last
 * bits because one of them fuses multiply and add.
 */
#ifndef SRNF_HARMONICS_SIMD_H
#define SRNF_HARMONICS_SIMD_H

#include <stddef.h>
#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SRNF_HOT __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define SRNF_HOT
#endif

#define SRNF_LANES ((size_t)4)

typedef double simd __attribute__((vector_size(32)));

#define SIMD_INLINE static inline __attribute__((always_inline))

/* Loads and stores need no alignment. Macros, because a function that passes a vector by value has
   another calling convention in each instruction set; and no memcpy, which gcc takes for four
   numbers on their way through integer registers where a vector lies in an array. */
typedef double simd_loose __attribute__((vector_size(32), aligned(8), may_alias));
#define SIMD_LOAD(destination, source) ((destination) = *(const simd_loose *)(source))
#define SIMD_STORE(destination, value) (*(simd_loose *)(destination) = (value))
#define SIMD_SET(x) ((simd){(x), (x), (x), (x)})

#endif

/*
 * test_register_warps_nightly.c - test_register_warps.c with the strongest warps too.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 600
 */
#define STRENGTHS (sizeof strengths / sizeof strengths[0])
#include "test_register_warps.c"

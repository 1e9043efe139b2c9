/*
 * test_register_symmetric_nightly.c - test_register_symmetric.c with all pairs of its surfaces.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 600
 */
#define ALL 1
#include "test_register_symmetric.c"

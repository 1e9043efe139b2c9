/*
 * test_register_rotations_nightly.c - test_register_rotations.c with 200 rotations.
 *
 * srnfd-test: nightly
 */
#define ROTATIONS 200
#include "test_register_rotations.c"

/*
 * test_spherical_stress_nightly.c - test_spherical_stress.c with three times as many random meshes.
 *
 * srnfd-test: nightly
 */
#define RANDOM_MESHES 150
#include "test_spherical_stress.c"

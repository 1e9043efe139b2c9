/*
 * test_spherical_stress_nightly.c - test_spherical_stress.c with three times as many random meshes
 * and four times as large hubs.
 *
 * srnfd-test: nightly
 */
#define RANDOM_MESHES 150
#define HUB_VALENCE 100000
#include "test_spherical_stress.c"

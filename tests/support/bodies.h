/*
 * bodies.h - closed surfaces as studies have them, made from a seed: left ventricles with known
 * modes of variation, and small bodies of the solar system, rough and cratered.
 *
 * They stand where real data would, so that a clone alone runs every test: sizes, proportions,
 * roughness and numbers of faces are about those of the surfaces that tests/bench reads. As in
 * meshes.h the caller clears the meshes, and the program ends when memory is short.
 */
#ifndef TESTS_BODIES_H
#define TESTS_BODIES_H

#include "srnf.h"
#include "support/folders.h"

#define BODIES_MODES ((size_t)12)
#define BODIES_ASTEROIDS ((size_t)12)
#define BODIES_BENT ((size_t)7) /* the asteroid that no point sees the whole of */

/* A cup of 101 by 56 mm along x, apex at the positive end, its base closed by a cap: 812 vertices,
   1620 faces. To each vertex scores[k] times the k-th mode is added, in mm: vertices correspond,
   and those of any number of cups have rank 12 about their mean. Standard normal scores move
   them by 3.8 mm rms. */
struct srnf_mesh bodies_cup(const double scores[BODIES_MODES]);

/* The cup of standard normal scores drawn with this seed. */
struct srnf_mesh bodies_ventricle(uint64_t seed);

/* The same contracted: shorter, much narrower, twisted about its axis. */
struct srnf_mesh bodies_contracted(uint64_t seed);

/* One of BODIES_ASTEROIDS: 2562 vertices and 5120 faces, about 1 in radius, away from the origin in
   a pose of its own; star-shaped but for BODIES_BENT. */
struct srnf_mesh bodies_asteroid(size_t index);

/* "ventricle 17", "contracted 3" or "asteroid 5"; false for any other name. */
bool bodies_make(const char *name, struct srnf_mesh *mesh);

/* Names of the files of a folder, where `what` has a slash, or of as many bodies: "asteroid 0" and
   on. To be freed one by one. */
size_t bodies_list(const char *what, size_t made, char *names[FOLDERS_FILES_MAX]);

/* A body by its name, a file by its path; false when there is neither. */
bool bodies_load(const char *name, struct srnf_mesh *mesh);

#endif

/*
 * correspondence.h - surfaces from meshes whose vertices correspond, with the correspondence kept.
 */
#ifndef TESTS_CORRESPONDENCE_H
#define TESTS_CORRESPONDENCE_H

#include "srnf.h"

/*
 * The rays from the best centre of the average mesh meet it in one face each; every surface is the
 * same combination of the vertices of its own mesh there. A linear map from vertices to surfaces:
 * what is added to vertices is added to the surface.
 *   sht     [in]  degree and grid
 *   meshes  [in]  n meshes of the same faces
 *   unit    [in]  what becomes 1: the coordinates are divided by it
 *   f       [out] n times double[3][(L+1)^2]
 * False when the average is not star-shaped. Ends the program when memory is short.
 */
bool correspondence_surfaces(const struct srnf_sht *sht, size_t n, const struct srnf_mesh *meshes,
                             double unit, double *const *f);

#endif

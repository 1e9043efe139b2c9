/*
 * triangulations.h - closed triangulations of genus zero that are hard on algorithms over meshes:
 * vertices of very large and very small valence, random connectivity, long and winding tubes.
 *
 * As in meshes.h, whose meshes these are: the caller clears them, faces are counter-clockwise from
 * outside, and the program ends when memory is short.
 */
#ifndef TESTS_TRIANGULATIONS_H
#define TESTS_TRIANGULATIONS_H

#include "srnf.h"
#include "support/random.h"

/* Two apexes over and under a rim of this many vertices (3 or more) on the unit circle. */
struct srnf_mesh triangulations_bipyramid(size_t rim);

/* One apex of this valence (3 or more) over a polygon whose underside is cut in a zigzag. */
struct srnf_mesh triangulations_fan(size_t valence);

/* n vertices (4 or more) on the unit sphere: a tetrahedron, then each vertex over the middle of a
   face drawn at random, so that many have valence 3. newest: only faces of the vertex before it
   are drawn, so that the vertices nest. */
struct srnf_mesh triangulations_stacked(size_t n, bool newest, struct test_random *random);

/* A tube of circles about a path: rings circles of sides vertices, closed by a vertex at each
   end. path and radius take t in [0, 1]. */
struct srnf_mesh triangulations_tube(void (*path)(double t, double x[3]),
                                     double (*radius)(double t), size_t rings, size_t sides);

/* Each face cut into four at the middles of its edges; the mesh must be closed. */
struct srnf_mesh triangulations_subdivided(const struct srnf_mesh *mesh);

/* Replaces edges drawn at random by the other diagonal of their two faces, in place, `tries` times
   where that leaves a triangulation. Positions stay. */
void triangulations_flip_edges(struct srnf_mesh *mesh, size_t tries, struct test_random *random);

/* Numbers vertices and faces anew at random, and turns each face's first corner; new_index
   [n_vertices] or NULL tells where each vertex has gone. */
void triangulations_renumber(struct srnf_mesh *mesh, uint32_t *new_index,
                             struct test_random *random);

/* Each coordinate of each vertex plus a normal number of this deviation. */
void triangulations_jitter(struct srnf_mesh *mesh, double deviation, struct test_random *random);

#endif

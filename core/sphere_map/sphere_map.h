/*
 * sphere_map.h - what the files of the spherical parameterization share.
 *
 * The scheme is progressive: E. Praun and H. Hoppe, "Spherical parametrization and remeshing",
 * SIGGRAPH 2003; X. Hu, X.-M. Fu, L. Liu, "Advanced hierarchical spherical parameterizations", IEEE
 * TVCG 2018. The mesh is collapsed to a tetrahedron, which is put on the sphere; the vertices come
 * back in reverse order, each placed where the star energy of its neighbourhood is least, with
 * sweeps of relaxation on the way. Every step keeps every spherical triangle oriented, so there is
 * nothing to untangle.
 */
#ifndef SRNF_SPHERE_MAP_INTERNAL_H
#define SRNF_SPHERE_MAP_INTERNAL_H

#include "mesh/mesh_geometry.h"

struct hub; /* hubs.c */

/* Neighbours of a vertex, counter-clockwise seen from outside; faces are (v, at[i], at[i + 1]). Of
   a hub, which few are, `at` is behind what changed: spherical_ring_read. */
struct ring {
    uint32_t *at;
    uint32_t count, capacity;
    struct hub *hub;
};

/* Memory for rings that grow: chunks that are freed together. */
struct ring_pool {
    struct ring_chunk *chunks;
};

struct spherical {
    const struct srnf_mesh *mesh;
    size_t n;           /* vertices */
    double *positions;  /* [n][3], the mesh about its centre in units of its diagonal */
    double *points;     /* [n][3] on the unit sphere, valid for vertices that are present */
    struct ring *rings; /* of the vertices that are present */
    bool *present;
    size_t n_present;
    struct ring_pool pool;
    struct hub *hubs; /* of all rings that have one */
    double
        floor_edge; /* triangles with a longest edge below this count as equilateral of that side */
    double sliver;  /* least height of a triangle, relative to its longest edge */
    double quality; /* weight of the shape of triangles against the quadric error in collapses */
    double total_area; /* of the triangles of the present level, by the robust metric */
    uint32_t *record;  /* of the collapses: v, u, count, ring of v from u on */
    size_t record_size, record_capacity;
    double *star; /* scratch for one star, grown by star_room */
    size_t star_capacity;
    const struct srnf_context *context;
};

/* accept.c: refuses what is no connected triangulation of the sphere. */
SRNF_CHECKED int spherical_accept(const struct srnf_mesh *mesh, struct srnf_error *error);

/* rings.c */
SRNF_CHECKED int spherical_rings_build(struct spherical *s);
void spherical_pool_clear(struct ring_pool *pool);
/* Position of a vertex among count entries; count when it is not there. */
uint32_t spherical_entry(const uint32_t *at, uint32_t count, uint32_t vertex);
/* ring->at as it is now, until the ring changes. */
const uint32_t *spherical_ring_read(struct ring *ring);
bool spherical_ring_has(const struct ring *ring, uint32_t vertex);
uint32_t spherical_ring_first(const struct ring *ring);
/* Of a neighbour, by what was none before. */
void spherical_ring_replace(struct spherical *s, struct ring *ring, uint32_t old, uint32_t vertex);
void spherical_ring_remove(struct spherical *s, struct ring *ring, uint32_t vertex);
/* Before or after the neighbour `place`. Errors: SRNF_ENOMEM. */
SRNF_CHECKED int spherical_ring_insert(struct spherical *s, struct ring *ring, uint32_t place,
                                       bool after, uint32_t vertex);
static inline uint32_t spherical_ring_get(const struct ring *ring, uint32_t i)
{
    return ring->at[i < ring->count ? i : i - ring->count];
}

/* hubs.c: for rings.c, but for the first two */
void spherical_hubs_clear(struct spherical *s);
/* The ring's array alone again. */
void spherical_hub_leave(struct ring *ring);
/* Where the ring is large enough and has none, and there is memory. */
void spherical_hub_make(struct spherical *s, struct ring *ring);
void spherical_hub_write(struct ring *ring);
bool spherical_hub_has(const struct hub *hub, uint32_t vertex);
uint32_t spherical_hub_first(const struct hub *hub);
void spherical_hub_replace(struct hub *hub, uint32_t old, uint32_t vertex);
void spherical_hub_remove(struct spherical *s, struct ring *ring, uint32_t vertex);
SRNF_CHECKED int spherical_hub_insert(struct hub *hub, uint32_t place, bool after, uint32_t vertex);

/* metric.c: cotangents at a, b, c and the area of the triangle, robust to slivers. */
struct triangle_metric {
    double cot[3], area;
};
void spherical_metric(const struct spherical *s, const double *a, const double *b, const double *c,
                      struct triangle_metric *metric);

/* distortion.c */
/* Positions about the centre of the bounding box, in units of its diagonal, and floor_edge. Errors:
   SRNF_EDEGENERATE (no area). */
SRNF_CHECKED int spherical_normalize(struct spherical *s);
/* Of a map of the normalized mesh; leaves flipped alone. */
void spherical_measure(const struct spherical *s, const double *points,
                       struct srnf_distortion *distortion);
/* Of any map, flips counted exactly: points are unit vectors, [n_vertices][3]. Errors: as
   spherical_normalize, SRNF_ENOMEM. */
SRNF_CHECKED int spherical_distortion(const struct srnf_mesh *mesh, const double *points,
                                      struct srnf_distortion *distortion);

/* collapse.c: down to a tetrahedron; fills the record. */
SRNF_CHECKED int spherical_collapse(struct spherical *s);

/* vertex_star.c */
/* Loads the star of v: for each face the opposite edge on the sphere and the metric. */
SRNF_CHECKED int spherical_star_load(struct spherical *s, uint32_t v);
/* Energy of the loaded star with its centre at p; infinite when a triangle is not positively
   oriented. */
double spherical_star_energy(const struct spherical *s, uint32_t v, const double p[3]);
/* One guarded Newton step of v on the loaded star; returns the relative gain, 0 when it stays. */
double spherical_star_step(struct spherical *s, uint32_t v);

/* insert.c: puts the last vertex of the record back and places it. */
SRNF_CHECKED int spherical_insert(struct spherical *s);
/* relax.c: active-set Gauss-Seidel sweeps over all present vertices. */
SRNF_CHECKED int spherical_relax(struct spherical *s, size_t max_sweeps);

/* verify.c */
/* Sign of det(a, b, c), exact. */
int spherical_orientation(const double a[3], const double b[3], const double c[3]);
/* Every face positively oriented and the solid angles sum to 4 pi; counts the flipped faces. */
bool spherical_verify(const struct srnf_mesh *mesh, const double *points, size_t *flipped);

/* sample.c: the mesh at every node of the grid, values double[3][n_theta][n_phi]. points
   as of srnf_spherical_map. Errors: SRNF_ENUMERIC (the map leaves a node uncovered),
   SRNF_ENOMEM. */
SRNF_CHECKED int spherical_sample(const struct srnf_mesh *mesh, const double *points,
                                  const struct srnf_grid *grid, const struct srnf_context *context,
                                  double *values);

#endif

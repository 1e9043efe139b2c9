/*
 * mesh_geometry.h - what the files of core/mesh and core/surface/fit.c share beyond srnf.h:
 * vectors, corners of faces, a stable sort, the topology of a mesh and its measures.
 */
#ifndef SRNF_MESH_MESH_GEOMETRY_H
#define SRNF_MESH_MESH_GEOMETRY_H

#include "internal.h"

#include <math.h>

/* Corners (three per face) are numbered in 31 bits. */
#define SRNF_MESH_FACES_MAX ((size_t)INT32_MAX / 3)
#define SRNF_MESH_VERTICES_MAX ((size_t)INT32_MAX)

/* Coordinates beyond this, and diagonals below its inverse, are not measured: their volumes would
   leave the range of a double. */
#define SRNF_MESH_COORDINATE_MAX 1e100

/* Whether indices are within range and coordinates finite (prepare.c). */
bool mesh_is_finite(const struct srnf_mesh *mesh);

/* Also where sanitizers make such a function longer than what a compiler inlines: there, calls of
   them took a tenth of an encoding. */
#define VECTOR_INLINE static inline __attribute__((always_inline))

VECTOR_INLINE void vector_subtract(const double a[3], const double b[3], double out[3])
{
    out[0] = a[0] - b[0];
    out[1] = a[1] - b[1];
    out[2] = a[2] - b[2];
}

VECTOR_INLINE double vector_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

VECTOR_INLINE void vector_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

VECTOR_INLINE double vector_norm(const double a[3])
{
    return sqrt(vector_dot(a, a));
}

/* Unlike fmin and fmax these are one instruction; where a is not a number they return b. */
VECTOR_INLINE double smaller(double a, double b)
{
    return a < b ? a : b;
}

VECTOR_INLINE double larger(double a, double b)
{
    return a > b ? a : b;
}

VECTOR_INLINE const double *mesh_corner(const struct srnf_mesh *mesh, size_t face, size_t corner)
{
    return mesh->vertices + 3 * (size_t)mesh->faces[3 * face + corner];
}

/* Everything below asks the context, which may be NULL, every few thousand faces. What is told to
   stop leaves its result unfinished, though safe to free: who calls it asks, too. Those that
   return a status say SRNF_ECANCELED. */

/* Sorts order[n] by less, stably, with as much scratch: bottom-up merging, O(n log n) for any
   input. (qsort allocates behind our back and promises neither order of equals nor time.) */
void srnf_sort_order(uint32_t *order, uint32_t *scratch, size_t n,
                     bool (*less)(const void *subject, uint32_t a, uint32_t b), const void *subject,
                     const struct srnf_context *context);

/* Edges of one kind of trouble: how many, and the first of the lowest face that has one. */
struct srnf_edge_finding {
    size_t count;
    uint32_t face, from, to;
};

/* Combinatorics of a mesh. Faces that name a vertex twice are counted and otherwise left out: their
   neighbours then meet each other, as if the face had been collapsed. */
struct srnf_topology {
    size_t vertices, edges, faces;        /* that take part */
    struct srnf_edge_finding boundary;    /* one face */
    struct srnf_edge_finding crowded;     /* three faces or more */
    struct srnf_edge_finding disagreeing; /* two faces, both along the edge in the same direction */
    bool orientable;                      /* turning some faces would make all pairs agree */
    size_t split_vertices;                /* whose faces form several fans */
    uint32_t first_split_vertex;
    size_t components;             /* joined through shared vertices */
    uint32_t first_face;           /* that takes part */
    uint32_t first_face_elsewhere; /* lowest face outside the component of that one */
    size_t degenerate_faces;
    uint32_t first_degenerate_face;
};

/* Cost O(V + F a(F)), memory 40 bytes per face at the most. Indices must be in range. Errors:
   SRNF_ENOMEM, SRNF_ECANCELED. */
SRNF_CHECKED int srnf_topology_analyse(const struct srnf_mesh *mesh,
                                       const struct srnf_context *context,
                                       struct srnf_topology *topology);

/* Area, signed volume, area centroid, bounding-box diagonal and centre. Everything is computed
   about the centre of the bounding box in units of its diagonal, so that size and place do not cost
   digits. */
struct srnf_mesh_measures {
    double area, volume, diagonal;
    double centroid[3], center[3];
    double relative_area, relative_volume; /* for a diagonal of 1 */
    double coarseness;                     /* of struct srnf_mesh_report; 0 without faces */
    bool out_of_range; /* coordinates beyond SRNF_MESH_COORDINATE_MAX: all is 0 */
};
void srnf_mesh_measure(const struct srnf_mesh *mesh, const struct srnf_context *context,
                       struct srnf_mesh_measures *measures);

/* The corner on the other side of each corner's edge: opposite[3 n_faces]. boundary where the edge
   has one face, crowded where it has more than two or the face is degenerate. Errors: SRNF_ENOMEM,
   SRNF_ECANCELED. */
SRNF_CHECKED int srnf_topology_opposites(const struct srnf_mesh *mesh,
                                         const struct srnf_context *context, uint32_t boundary,
                                         uint32_t crowded, uint32_t *opposite);

/* The first corner of the fan of faces that each corner belongs to: fans[3 n_faces]. Errors:
   SRNF_ENOMEM, SRNF_ECANCELED. */
SRNF_CHECKED int srnf_topology_fans(const struct srnf_mesh *mesh,
                                    const struct srnf_context *context, uint32_t *fans);

/* The numbers that what is left of a mesh had in the file: vertices[n_vertices] (the first of
   equal points), faces[n_faces]. */
struct srnf_mesh_origin {
    uint32_t *vertices, *faces;
};

/* Moves the vertices with keep[i] to the front and renames the corners of all faces: rename[i] is
   the new number of a kept vertex, and of a vertex that is not kept the (old) number of an earlier
   one that stands for it. */
void srnf_repair_compact(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                         const struct srnf_context *context, const bool *keep, uint32_t *rename);

/* Repairs (repair.c), for srnf_mesh_prepare; each returns SRNF_OK, SRNF_ENOMEM or SRNF_ECANCELED.
   Survivors keep their order; origin goes along with vertices and faces. */
SRNF_CHECKED int srnf_repair_merge_vertices(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                                            const struct srnf_context *context, size_t *merged);
SRNF_CHECKED int srnf_repair_drop_unreferenced(struct srnf_mesh *mesh,
                                               struct srnf_mesh_origin *origin,
                                               const struct srnf_context *context, size_t *dropped);
SRNF_CHECKED int srnf_repair_drop_faces(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                                        const struct srnf_context *context,
                                        struct srnf_mesh_repairs *repairs);
/* fold.c: of n pairs of faces back to back, none of which keep has, keeps one where the surface has
   a hole without it. */
SRNF_CHECKED int srnf_repair_keep_folded(const struct srnf_mesh *mesh, const uint32_t (*pairs)[2],
                                         size_t n, const struct srnf_context *context, bool *keep,
                                         struct srnf_mesh_repairs *repairs);
SRNF_CHECKED int srnf_repair_split_fans(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                                        const struct srnf_context *context, size_t *split);
void srnf_repair_flip_faces(struct srnf_mesh *mesh);

/* report.c: the report of a mesh after its repairs, which turns it if it looks inwards and drops
   vertices without faces. Problems name faces and vertices by their origin. report: [in] repairs so
   far, [out] all. Errors: SRNF_ENOMEM, SRNF_ECANCELED. */
SRNF_CHECKED int srnf_mesh_examine(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                                   const struct srnf_context *context,
                                   struct srnf_mesh_report *report);

#endif

/*
 * encode.h - what the driver of encoding and its routes share.
 *
 * A route gives the coefficients of the mesh in a frame of its own (the origin moved, nothing
 * turned or scaled) and says how its map to the sphere distorts. encode.c does the rest.
 */
#ifndef SRNF_SURFACE_ENCODE_H
#define SRNF_SURFACE_ENCODE_H

#include "internal.h"

/* Rows of the grid that a mesh is sampled on, against the working grid: real meshes are rougher
   than the degree, and the finer grid folds less of that roughness into the coefficients. */
#define ENCODE_OVERSAMPLING ((size_t)2)

struct encode_task {
    const struct srnf_mesh *mesh;
    const struct srnf_mesh_report *report;
    const struct srnf_encode_options *options;
    const struct srnf_context *context;
    const struct srnf_index *index; /* over the mesh */
    const struct srnf_sht *sht;     /* working grid of options->degree */
    const struct srnf_star *star;   /* of the centre given, otherwise the kernel's */
    struct srnf_error *error;       /* never NULL */
};

/* What a route fills in. */
struct encode_result {
    double *coefficients; /* [3][(L+1)^2], allocated by the driver */
    double frame[3];      /* origin of the coefficients in the frame of the mesh */
    struct srnf_distortion distortion;
};

SRNF_CHECKED int encode_star(const struct encode_task *task, struct encode_result *result);
SRNF_CHECKED int encode_area(const struct encode_task *task, struct encode_result *result);
SRNF_CHECKED int encode_given(const struct encode_task *task, struct encode_result *result);

/* encode_given.c: the unit vectors of the route, double[n_vertices][3]. */
SRNF_CHECKED int encode_given_points(const struct encode_task *task, double *points);

/* encode_map.c: the mesh through a map to the sphere, points [n_vertices][3] unit vectors that are
   a bijection; sets coefficients and frame. */
SRNF_CHECKED int encode_through_map(const struct encode_task *task, const double *points,
                                    struct encode_result *result);

#endif

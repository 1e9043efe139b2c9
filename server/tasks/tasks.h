/*
 * tasks.h - kinds of tasks: parts of a job that any machine with the same build can compute.
 *
 * A task is a pure function from bytes to bytes. Its inputs are the text of what is asked for and
 * contents: blocks of bytes that several tasks share, as the coefficients of a surface. The inputs
 * name each content by the hexadecimal digits of its SHA-256, so that whoever computes the task can
 * keep contents and tell whether they are what was meant. The same function runs here and on a
 * worker, and machines of one numeric build compute the same bits.
 *
 * Numbers in inputs and results are eight bytes each, least significant first.
 */
#ifndef SRNFD_TASKS_H
#define SRNFD_TASKS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "srnf.h"

#define TASKS_DIGEST_SIZE 65 /* 64 hexadecimal digits and a zero */
#define TASKS_INPUTS_MAX ((size_t)64 << 10)
#define TASKS_RESULT_MAX ((size_t)16 << 20)
#define TASKS_CONTENTS_MAX 512 /* of one task */

/* Bytes that are malloc's: free. */
struct tasks_bytes {
    unsigned char *bytes;
    size_t size;
};

struct tasks_content {
    char digest[TASKS_DIGEST_SIZE];
    const void *bytes;
    size_t size;
};

struct tasks_kind {
    const char *name;
    /* Computes the task. contents: those of the inputs, in the order in which tasks_contents tells
       them. Errors: SRNF_EINVAL (bytes that are no such inputs or contents), SRNF_ENOMEM,
       SRNF_ECANCELED, and those of the computation. */
    int (*run)(const void *inputs, size_t size, const struct tasks_content *contents,
               size_t n_contents, const struct srnf_context *context, struct tasks_bytes *result,
               struct srnf_error *error);
    /* Whether the bytes can be the result of these inputs. */
    bool (*check)(const void *inputs, size_t size, const void *result, size_t result_size);
    /* Whether a result that was checked can be that of these contents too; NULL: any can. */
    bool (*possible)(const void *inputs, size_t size, const struct tasks_content *contents,
                     size_t n_contents, const void *result, size_t result_size);
};

/* Doubles as bytes [8 * count], with all their bits. */
void tasks_put_doubles(unsigned char *bytes, const double *values, size_t count);

#define TASKS_KINDS_MAX 8
/* NULL: there is no such kind. */
const struct tasks_kind *tasks_kind_find(const char *name);
/* Those that there are, from 0 on; NULL beyond the last. */
const struct tasks_kind *tasks_kind_at(size_t index);

/* ---- pairs: distances of pairs of surfaces (pairs.c) ----------------------------------------- */

#define TASKS_PAIRS "pairs"

/* What is asked for. The distances are those of srnf_metric_distances on the working grid. */
struct tasks_pairs {
    size_t degree;
    enum srnf_metric metric;
    struct srnf_register_options registration;
    size_t n_surfaces;  /* 1 .. TASKS_CONTENTS_MAX; each content is double[3][(degree+1)^2] */
    size_t n_pairs;     /* at least 1 */
    size_t (*pairs)[2]; /* [n_pairs] into the surfaces */
};

/* As bytes. Errors: SRNF_ENOMEM, SRNF_ELIMIT (more than TASKS_INPUTS_MAX). */
SRNF_CHECKED int tasks_pairs_write(const struct tasks_pairs *pairs, struct tasks_bytes *inputs);
/* The distances [n_pairs] of a result that was checked. */
void tasks_pairs_distances(const void *result, size_t n_pairs, double *distances);

/* ---- searches: registrations of surfaces to a field (searches.c) ----------------------------- */

#define TASKS_SEARCHES "searches"

/* What is asked for: srnf_register_to_field_landmarks of each surface, on a Gauss-Legendre grid.
   The first content is the field, double[3][n_theta][n_phi], the others are surfaces,
   double[3][(degree+1)^2]. */
struct tasks_searches {
    size_t degree, n_theta, n_phi;
    double norm2;
    struct srnf_register_options registration;
    size_t n;             /* surfaces, 1 .. TASKS_CONTENTS_MAX - 1 */
    size_t n_landmarks;   /* 0: none guide, and what follows is of no meaning */
    double weight;        /* of the landmarks, or INFINITY */
    const double *fixed;  /* [n_landmarks][3] */
    const double *moving; /* [n][n_landmarks][3] */
};
/* Surfaces that a task with so many landmarks may have at most. */
size_t tasks_searches_most(size_t n_landmarks);

/* As bytes. Errors: SRNF_ENOMEM, SRNF_ELIMIT (n, n_landmarks). */
SRNF_CHECKED int tasks_searches_write(const struct tasks_searches *searches,
                                      struct tasks_bytes *inputs);
/* Calls take or fail for each of the n surfaces of a result, in their order (struct
   srnf_field_search); fail NULL: that a surface failed is no result.
   Errors: SRNF_EINVAL (no result of n surfaces), SRNF_ENOMEM, what take and fail return. */
SRNF_CHECKED int tasks_searches_read(
    const void *result, size_t size, size_t n,
    int (*take)(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp),
    int (*fail)(void *argument, size_t i, const struct srnf_error *why), void *argument);

/* ---- encodings: surfaces of prepared meshes (encodings.c) ------------------------------------ */

#define TASKS_ENCODINGS "encodings"
#define TASKS_ENCODINGS_MAX ((size_t)128) /* meshes of one task */

/* What is asked for: srnf_encode of a mesh without problems. */
struct tasks_encoding {
    struct srnf_encode_options options; /* without sphere and kernel */
    bool has_sphere, kernel_known;
    struct srnf_star kernel;
    double centroid[3], volume, area; /* of the mesh's report: all that encoding reads of it */
    size_t n_vertices[2], n_faces[2]; /* of the mesh and its sphere */
};
/* What became of it. */
struct tasks_encoded {
    int status; /* SRNF_OK, or why it cannot be encoded, with the error */
    struct srnf_encoded encoded;
    struct srnf_error error;
};

/* As bytes. Errors: SRNF_ENOMEM, SRNF_ELIMIT (n). */
SRNF_CHECKED int tasks_encodings_write(size_t n, const struct tasks_encoding *encodings,
                                       struct tasks_bytes *inputs);
/* A mesh as the bytes of a content, of this size. */
size_t tasks_mesh_size(const struct srnf_mesh *mesh);
void tasks_put_mesh(unsigned char *bytes, const struct srnf_mesh *mesh);
/* What became of n meshes; coefficients are the caller's (srnf_free). Errors: SRNF_EINVAL (no
   result of n meshes), SRNF_ENOMEM; then there are none. */
SRNF_CHECKED int tasks_encodings_read(const void *result, size_t size, size_t n,
                                      struct tasks_encoded *found);

#endif

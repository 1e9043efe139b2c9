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
};

/* Doubles as bytes [8 * count], with all their bits. */
void tasks_put_doubles(unsigned char *bytes, const double *values, size_t count);

/* NULL: there is no such kind. */
const struct tasks_kind *tasks_kind_find(const char *name);

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

#endif

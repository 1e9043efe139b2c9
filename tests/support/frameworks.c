/*
 * frameworks.c - the operations of both frameworks, timed and compared.
 *
 * Every operation answers with a field on the grid: Q of the mean, of the surface that a transfer
 * ends at, or Q_* of the vector where it arrives. Those of both frameworks are compared there.
 */
#include "support/frameworks.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "support/compare.h"
#include "support/shapes.h"
#include "support/timing.h"

#define TRANSPORT_SEGMENTS ((size_t)16)

struct frameworks {
    const struct srnf_sht *sht;
    size_t n, count, values; /* count = 3 (L+1)^2, values = 3 P */
    const double *const *surfaces;
    void *workspace;
};

/* One answer; field is where it ends. */
struct answer {
    double *field;
    double size, transforms;
    bool converged;
};

static void must(int status, const char *what)
{
    if (status < 0) {
        (void)fprintf(stderr, "frameworks: %s: %s\n", what, srnf_strerror(status));
        exit(2);
    }
}

static const double *surface(const struct frameworks *f, size_t i)
{
    return f->surfaces[i % f->n];
}

/* ---- In the space of SRNFs ------------------------------------------------------------------- */

static void srnf_mean_of(const struct frameworks *f, size_t i, struct answer *a)
{
    struct srnf_mean mean;

    (void)i;
    must(srnf_karcher_mean(f->sht, f->n, f->surfaces, NULL, NULL, &mean, NULL), "mean");
    srnf_field(f->sht, mean.coefficients, a->field, f->workspace);
    srnf_mean_clear(&mean);
}

static void srnf_transport_of(const struct frameworks *f, size_t i, struct answer *a)
{
    struct srnf_tangent tangent;

    must(srnf_velocity_toward(f->sht, surface(f, i), surface(f, i + 1), a->field), "velocity");
    must(srnf_transport(f->sht, surface(f, i + 2), a->field, NULL, &tangent, NULL), "transport");
    srnf_field_differential(f->sht, surface(f, i + 2), tangent.coefficients, a->field,
                            f->workspace);
    a->transforms = tangent.transforms;
    srnf_tangent_clear(&tangent);
}

static void srnf_transfer_of(const struct frameworks *f, size_t i, struct answer *a)
{
    struct srnf_transferred moved;

    must(srnf_transfer(f->sht, surface(f, i), surface(f, i + 1), surface(f, i + 2),
                       SRNF_TRANSFER_ABSOLUTE, NULL, &moved, NULL),
         "transfer");
    srnf_field(f->sht, moved.coefficients, a->field, f->workspace);
    a->transforms = moved.transforms;
    srnf_transferred_clear(&moved);
}

/* ---- In the pulled-back metric --------------------------------------------------------------- */

static void pullback_mean_by(const struct frameworks *f, enum srnf_pullback_mean_method method,
                             struct answer *a)
{
    struct srnf_pullback_mean_options options = srnf_pullback_mean_defaults(method);
    struct srnf_pullback_mean mean;

    must(srnf_pullback_mean(f->sht, f->n, f->surfaces, &options, NULL, &mean, NULL),
         "pulled-back mean");
    srnf_field(f->sht, mean.coefficients, a->field, f->workspace);
    a->size = sqrt(mean.variance);
    a->transforms = mean.transforms;
    a->converged = mean.converged;
    srnf_pullback_mean_clear(&mean);
}

static void pullback_graph_of(const struct frameworks *f, size_t i, struct answer *a)
{
    (void)i;
    pullback_mean_by(f, SRNF_PULLBACK_MEAN_GRAPH, a);
}

static void pullback_steps_of(const struct frameworks *f, size_t i, struct answer *a)
{
    (void)i;
    pullback_mean_by(f, SRNF_PULLBACK_MEAN_LOG_EXP, a);
}

static void pullback_transport_of(const struct frameworks *f, size_t i, struct answer *a)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    double *velocity = shapes_doubles(f->count);
    struct srnf_pullback_transported moved;
    struct srnf_pullback_log_figures log;
    struct srnf_pullback_geodesic path;

    options.segments = TRANSPORT_SEGMENTS;
    options.compare = false;
    must(srnf_pullback_log(f->sht, surface(f, i), surface(f, i + 1), &options, NULL, velocity, &log,
                           NULL),
         "logarithm");
    must(srnf_pullback_geodesic(f->sht, surface(f, i), surface(f, i + 2), &options, NULL, &path,
                                NULL),
         "path");
    must(srnf_pullback_transport(f->sht, options.segments, path.coefficients, velocity, NULL,
                                 &moved, NULL),
         "pulled-back transport");
    srnf_field_differential(f->sht, surface(f, i + 2), moved.vector, a->field, f->workspace);
    a->size = moved.norm;
    a->transforms = log.transforms + path.transforms + moved.transforms;
    a->converged = path.converged;
    srnf_free(moved.vector);
    srnf_pullback_geodesic_clear(&path);
    srnf_free(velocity);
}

static void pullback_transfer_of(const struct frameworks *f, size_t i, struct answer *a)
{
    struct srnf_pullback_transfer moved;

    must(srnf_pullback_transfer(f->sht, surface(f, i), surface(f, i + 1), surface(f, i + 2), NULL,
                                NULL, &moved, NULL),
         "pulled-back transfer");
    srnf_field(f->sht, moved.coefficients, a->field, f->workspace);
    a->size = moved.deformation;
    a->transforms = moved.transforms;
    a->converged = moved.converged;
    srnf_pullback_transfer_clear(&moved);
}

/* ---- Side by side ---------------------------------------------------------------------------- */

static const struct {
    const char *operation;
    void (*srnf)(const struct frameworks *f, size_t i, struct answer *a);
    void (*pullback)(const struct frameworks *f, size_t i, struct answer *a);
    bool of_all; /* there is one answer */
} operations[] = {
    {"mean", srnf_mean_of, pullback_graph_of, true},
    {"mean, log-exp", srnf_mean_of, pullback_steps_of, true},
    {"transport", srnf_transport_of, pullback_transport_of, false},
    {"transfer", srnf_transfer_of, pullback_transfer_of, false},
};
_Static_assert(sizeof operations / sizeof operations[0] == FRAMEWORKS_ROWS, "a row each");

/* Adds one answer to the row. */
static void compare(const struct frameworks *f, size_t k, size_t i, size_t repeats, size_t answers,
                    double *fields, struct frameworks_row *row)
{
    struct answer ours = {.field = fields};
    struct answer other = {.field = fields + f->values};
    double least = INFINITY;
    double start;

    for (size_t r = 0; r < repeats; r++) {
        start = timing_cpu();
        operations[k].srnf(f, i, &ours);
        least = compare_min(least, timing_cpu() - start);
    }
    start = timing_cpu();
    operations[k].pullback(f, i, &other);
    row->seconds_pullback += (timing_cpu() - start) / (double)answers;
    row->seconds_srnf += least / (double)answers;
    row->transforms_srnf += ours.transforms / (double)answers;
    row->transforms_pullback += other.transforms / (double)answers;
    for (size_t v = 0; v < f->values; v++) {
        fields[v] -= fields[f->values + v];
    }
    row->distance =
        compare_max(row->distance, sqrt(srnf_inner_product(srnf_sht_grid(f->sht), fields, fields)));
    row->size = compare_max(row->size, other.size);
    row->converged = row->converged && other.converged;
}

void frameworks_compare(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                        size_t answers, size_t repeats, struct frameworks_row *rows)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct frameworks f = {.sht = sht,
                           .n = n,
                           .count = 3 * srnf_coefficient_count(srnf_sht_degree(sht)),
                           .values = 3 * grid->n_theta * grid->n_phi,
                           .surfaces = surfaces,
                           .workspace = srnf_alloc(1, srnf_surface_workspace_size(sht))};
    double *fields = shapes_doubles(2 * f.values);

    must(f.workspace ? 0 : SRNF_ENOMEM, "memory");
    for (size_t k = 0; k < FRAMEWORKS_ROWS; k++) {
        size_t n_answers = operations[k].of_all ? 1 : answers;

        rows[k] = (struct frameworks_row){.operation = operations[k].operation, .converged = true};
        for (size_t i = 0; i < n_answers; i++) {
            compare(&f, k, i, repeats, n_answers, fields, &rows[k]);
        }
        rows[k].ratio = rows[k].seconds_pullback / rows[k].seconds_srnf;
    }
    srnf_free(fields);
    srnf_free(f.workspace);
}

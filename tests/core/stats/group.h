/*
 * group.h - groups of surfaces for the tests of core/stats, and the contexts they are run in.
 *
 * Everything here ends the program when memory is short.
 */
#ifndef TESTS_STATS_GROUP_H
#define TESTS_STATS_GROUP_H

#include "core/figures.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "stats/stats.h"
#include "support/bodies.h"
#include "support/meshes.h"
#include "support/parallel.h"
#include "support/timing.h"

#define GROUP_MAX ((size_t)128)

struct group {
    struct srnf_sht *sht;
    const struct srnf_grid *grid;
    size_t degree, each, count, points; /* each = (L+1)^2, count = 3 each, points = P */
    size_t n;
    double *f[GROUP_MAX];
    const double *surfaces[GROUP_MAX]; /* the same, as the library takes them */
    double log_scale[GROUP_MAX];       /* of what was scaled to unit area */
};

static inline void group_open(struct group *g, size_t degree, size_t n)
{
    *g = (struct group){.degree = degree, .n = n};
    assert_true(n <= GROUP_MAX);
    assert_int_equal(srnf_sht_create(&g->sht, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0), SRNF_OK);
    g->grid = srnf_sht_grid(g->sht);
    g->each = srnf_coefficient_count(degree);
    g->count = 3 * g->each;
    g->points = g->grid->n_theta * g->grid->n_phi;
    for (size_t i = 0; i < n; i++) {
        g->f[i] = shapes_doubles(g->count);
        g->surfaces[i] = g->f[i];
    }
}

static inline void group_close(struct group *g)
{
    for (size_t i = 0; i < g->n; i++) {
        srnf_free(g->f[i]);
    }
    srnf_sht_destroy(g->sht);
}

/* Stars about one centre: (1 - spread) of one random star and spread of another, each scaled to
   unit area. */
static inline void group_open_stars(struct group *g, size_t degree, size_t n, double spread)
{
    struct shapes_surface base;
    struct shapes_surface own;

    group_open(g, degree, n);
    shapes_open(&base, degree);
    shapes_open(&own, degree);
    shapes_fill_random_star(&base, 1000, NULL);
    for (size_t i = 0; i < n; i++) {
        struct srnf_surface_measures measures;

        shapes_fill_random_star(&own, i + 1, NULL);
        for (size_t k = 0; k < g->count; k++) {
            g->f[i][k] = (1.0 - spread) * base.f[k] + spread * own.f[k];
        }
        srnf_surface_measure(g->sht, g->f[i], &measures, own.workspace);
        for (size_t k = 0; k < g->count; k++) {
            g->f[i][k] /= sqrt(measures.area);
        }
        g->log_scale[i] = 0.5 * log(measures.area);
    }
    shapes_close(&own);
    shapes_close(&base);
}

/* Makes the mesh the i-th surface of the group, by a route, and clears it. */
static inline void group_encode(struct group *g, size_t i, struct srnf_mesh *mesh,
                                enum srnf_parameterization route)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;

    options.degree = g->degree;
    options.parameterization = route;
    assert_int_equal(srnf_mesh_prepare(mesh, false, &report), SRNF_OK);
    assert_int_equal(srnf_encode(mesh, &report, &options, NULL, &encoded, NULL), SRNF_OK);
    memcpy(g->f[i], encoded.coefficients, g->count * sizeof(double));
    g->log_scale[i] = log(encoded.scale);
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(mesh);
}

/* Left ventricles of bodies.h, seeds 0 to n - 1, each in the radial parameterization of its own. */
static inline void group_open_ventricles(struct group *g, size_t degree, size_t n)
{
    group_open(g, degree, n);
    for (size_t i = 0; i < n; i++) {
        struct srnf_mesh mesh = bodies_ventricle(i);

        group_encode(g, i, &mesh, SRNF_PARAMETERIZATION_STAR);
    }
}

/* A mean like none of the surfaces: low harmonics with noise, from which searches for those end
   near them at best. */
static inline void group_spoil_mean(const struct group *g, double *mean, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);

    for (size_t k = 0; k < g->count; k++) {
        if (k % g->each > 3 && k % g->each < 16) {
            mean[k] = test_random_normal(&random);
        }
    }
}

static inline double group_least(size_t n, const double *values)
{
    double least = values[0];

    for (size_t k = 1; k < n; k++) {
        least = values[k] < least || isnan(values[k]) ? values[k] : least;
    }
    return least;
}

/* ---- Contexts -------------------------------------------------------------------------------- */

/* What a context's callbacks see. */
struct group_watch {
    size_t threads;         /* 0: from the last index to the first, on the caller's */
    atomic_size_t reports;  /* calls of progress */
    atomic_size_t bodies;   /* indexes of parallel loops that have been run */
    size_t cancel_after;    /* that many bodies; SIZE_MAX: never */
    _Atomic double highest; /* fraction reported */
};

static inline void group_progress(void *user, double fraction, const char *message)
{
    struct group_watch *watch = user;
    double highest = atomic_load(&watch->highest);

    assert_non_null(message);
    assert_true(fraction >= 0.0 && fraction <= 1.0);
    atomic_fetch_add(&watch->reports, 1);
    while (fraction > highest &&
           !atomic_compare_exchange_weak(&watch->highest, &highest, fraction)) {
    }
}

static inline bool group_canceled(void *user)
{
    struct group_watch *watch = user;

    return atomic_load(&watch->bodies) >= watch->cancel_after;
}

struct group_loop {
    struct group_watch *watch;
    void (*body)(void *argument, size_t index);
    void *argument;
};

static inline void group_body(void *argument, size_t index)
{
    struct group_loop *loop = argument;

    loop->body(loop->argument, index);
    atomic_fetch_add(&loop->watch->bodies, 1);
}

static inline void group_parallel_for(void *user, size_t count,
                                      void (*body)(void *argument, size_t index), void *argument)
{
    struct group_watch *watch = user;
    struct group_loop loop = {watch, body, argument};

    if (watch->threads == 0) {
        parallel_backwards(NULL, count, group_body, &loop);
    } else {
        parallel_spread(watch->threads, count, group_body, &loop);
    }
}

static inline double group_seconds(void *user)
{
    (void)user;
    return timing_monotonic();
}

static inline struct srnf_context group_context(struct group_watch *watch, size_t threads)
{
    watch->threads = threads;
    watch->cancel_after = SIZE_MAX;
    atomic_init(&watch->reports, 0);
    atomic_init(&watch->bodies, 0);
    atomic_init(&watch->highest, 0.0);
    return (struct srnf_context){.user = watch,
                                 .progress = group_progress,
                                 .canceled = group_canceled,
                                 .parallel_for = group_parallel_for,
                                 .seconds = group_seconds};
}

/* How the same work is spread in tests of independence; 0: see struct group_watch. */
static const size_t group_threads[] = {1, 2, 8, 0};
#define GROUP_SPREADS (sizeof group_threads / sizeof group_threads[0])

#endif

/*
 * bench_neighbours.c - how many pairs of left ventricles the lower bound of core/stats/neighbours.c
 * spares the search for the k nearest neighbours, of each size made one and of their own sizes.
 *
 * Of the hundred real ones every pair is registered: a pair is spared where its bound is above the
 * k-th least distance of both. Of 2,000 samples of their principal components, whose two million
 * pairs would take a day, those of some members with all others are registered. There a pair is
 * spared by its member alone (more than the search spares, which asks both), and by it and the
 * others of the members in turn.
 *
 * Skips, saying so, where the data are not there. Seconds are from start to end, on two threads.
 */
#include <fftw3.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/ventricles.h"

#define N ((size_t)100)
#define DEGREE 15
#define SAMPLES ((size_t)2000)
#define MEMBERS ((size_t)4) /* of the samples, whose pairs are registered */
#define THREADS ((size_t)2)

static const size_t wanted[] = {1, 3, 10};
#define WANTED (sizeof wanted / sizeof wanted[0])

static void must(int status)
{
    if (status < 0) {
        (void)fprintf(stderr, "bench_neighbours: %s\n", srnf_strerror(status));
        exit(2);
    }
}

struct crowd {
    const struct srnf_sht *sht;
    size_t n, count;
    double *memory; /* [n][count] */
    const double **surfaces;
    double *features; /* [n][STATS_NEIGHBOUR_FEATURES] */
    double *matrix;   /* [n][n], (i, j) with i < j, where they are measured */
};

static void open_crowd(struct crowd *c, const struct srnf_sht *sht, size_t n, size_t count)
{
    *c = (struct crowd){.sht = sht,
                        .n = n,
                        .count = count,
                        .memory = shapes_doubles(n * count),
                        .surfaces = calloc(n, sizeof *c->surfaces),
                        .features = shapes_doubles(n * STATS_NEIGHBOUR_FEATURES),
                        .matrix = shapes_doubles(n * n)};
    must(c->surfaces ? SRNF_OK : SRNF_ENOMEM);
    for (size_t i = 0; i < n; i++) {
        c->surfaces[i] = c->memory + i * count;
    }
}

static void close_crowd(struct crowd *c)
{
    srnf_free(c->memory);
    free((void *)c->surfaces);
    srnf_free(c->features);
    srnf_free(c->matrix);
}

static double distance(const struct crowd *c, size_t i, size_t j)
{
    return c->matrix[i < j ? i * c->n + j : j * c->n + i];
}

static double bound(const struct crowd *c, size_t i, size_t j)
{
    return stats_neighbour_bound(c->features + i * STATS_NEIGHBOUR_FEATURES,
                                 c->features + j * STATS_NEIGHBOUR_FEATURES);
}

/* Pairs of the first members with all others; returns how many. */
static size_t measure(struct crowd *c, size_t members)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    const struct stats_registered asked = {c->sht, c->n, c->surfaces, &options, 0, 0};
    const struct stats_progress quiet = {0};
    struct group_watch watch;
    const struct srnf_context context = group_context(&watch, THREADS);
    size_t *pairs = calloc(c->n * members, sizeof *pairs), count = 0;
    double start = timing_monotonic();

    must(pairs ? SRNF_OK : SRNF_ENOMEM);
    for (size_t i = 0; i < c->n; i++) {
        must(stats_neighbour_features(c->sht, c->surfaces[i],
                                      c->features + i * STATS_NEIGHBOUR_FEATURES));
        for (size_t j = 0; j < i && j < members; j++) {
            pairs[count++] = i * (i - 1) / 2 + j;
        }
    }
    options.symmetric = true;
    must(stats_registered_distances(&asked, count, pairs, quiet, &context, c->matrix, NULL));
    printf("  %zu pairs in %.0f s\n", count, timing_monotonic() - start);
    free(pairs);
    return count;
}

static int compare_numbers(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

static double nearest(const struct crowd *c, size_t i, size_t k)
{
    double *row = shapes_doubles(c->n), value;
    size_t count = 0;

    for (size_t j = 0; j < c->n; j++) {
        if (j != i) {
            row[count++] = distance(c, i, j);
        }
    }
    qsort(row, count, sizeof *row, compare_numbers);
    value = row[k - 1];
    srnf_free(row);
    return value;
}

/* Shares of the pairs of the first members with all others. */
static void tell(const struct crowd *c, size_t members)
{
    for (size_t w = 0; w < WANTED; w++) {
        double *reach = shapes_doubles(members), pairs = 0.0, own = 0.0, both = 0.0;

        for (size_t i = 0; i < members; i++) {
            reach[i] = nearest(c, i, wanted[w]);
        }
        for (size_t i = 0; i < members; i++) {
            for (size_t j = 0; j < c->n; j++) {
                double other = reach[j < members ? j : (i + j) % members];

                if (j != i) {
                    pairs += 1.0;
                    own += bound(c, i, j) > reach[i];
                    both += bound(c, i, j) > reach[i] && bound(c, i, j) > other;
                }
            }
        }
        printf("  k = %2zu: spared by one member %5.1f %%, by both %5.1f %%\n", wanted[w],
               100.0 * own / pairs, 100.0 * both / pairs);
        srnf_free(reach);
    }
}

/* How near bounds are to distances. */
static void tell_bounds(const struct crowd *c, size_t members)
{
    double *shares = shapes_doubles(members * c->n);
    size_t count = 0;

    for (size_t i = 0; i < members; i++) {
        for (size_t j = i + 1; j < c->n; j++) {
            shares[count++] = bound(c, i, j) / distance(c, i, j);
        }
    }
    qsort(shares, count, sizeof *shares, compare_numbers);
    printf("  bound over distance: median %.2f, nine tenths below %.2f, largest %.2f\n",
           shares[count / 2], shares[count * 9 / 10], shares[count - 1]);
    srnf_free(shares);
}

static void bench_real(const struct group *g, bool sizes)
{
    struct crowd c;

    open_crowd(&c, g->sht, g->n, g->count);
    for (size_t i = 0; i < g->n; i++) {
        double scale = sizes ? exp(g->log_scale[i] - g->log_scale[0]) : 1.0;

        for (size_t k = 0; k < g->count; k++) {
            c.memory[i * g->count + k] = scale * g->f[i][k];
        }
    }
    printf("%zu left ventricles, %s\n", g->n, sizes ? "of their own sizes" : "of unit area");
    (void)measure(&c, g->n);
    tell_bounds(&c, g->n);
    tell(&c, g->n);
    close_crowd(&c);
}

/* Surfaces of random scores, each inverted from the mean. */
static void draw(const struct group *g, struct crowd *c)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_invert_options invert = srnf_invert_options_defaults();
    double *q = shapes_doubles(3 * g->points), *scores;
    struct srnf_mean mean;
    struct srnf_pca pca;

    registration.common_pose = true;
    options.registration = &registration;
    must(srnf_karcher_mean(g->sht, g->n, g->surfaces, &options, NULL, &mean, NULL));
    must(srnf_pca_fit(g->grid, g->n, mean.mean_q, mean.registered_q, 0, &pca));
    scores = shapes_doubles(c->n * pca.components);
    srnf_pca_sample(&pca, 16, c->n, pca.components, scores);
    invert.initial = SRNF_INITIAL_SURFACE;
    invert.surface = mean.coefficients;
    invert.tolerance = 1e-6;
    invert.certify = false;
    for (size_t i = 0; i < c->n; i++) {
        struct srnf_inversion found;

        srnf_pca_reconstruct(g->grid, &pca, mean.mean_q, scores + i * pca.components, q);
        must(srnf_invert(g->sht, q, &invert, NULL, &found, NULL));
        memcpy(c->memory + i * c->count, found.coefficients, c->count * sizeof(double));
        srnf_inversion_clear(&found);
    }
    srnf_free(scores);
    srnf_free(q);
    srnf_pca_clear(&pca);
    srnf_mean_clear(&mean);
}

static void bench_samples(const struct group *g)
{
    struct crowd c;

    open_crowd(&c, g->sht, SAMPLES, g->count);
    draw(g, &c);
    printf("%zu samples of their components, %zu members with all others\n", SAMPLES, MEMBERS);
    (void)measure(&c, MEMBERS);
    tell_bounds(&c, MEMBERS);
    tell(&c, MEMBERS);
    close_crowd(&c);
}

int main(void)
{
    struct group g;

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    if (!ventricles_open(&g, DEGREE, N, SRNF_PARAMETERIZATION_STAR)) {
        return EXIT_SUCCESS;
    }
    bench_real(&g, false);
    bench_real(&g, true);
    bench_samples(&g);
    group_close(&g);
    return EXIT_SUCCESS;
}

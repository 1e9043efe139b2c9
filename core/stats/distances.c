/*
 * distances.c - the symmetric matrix of distances between surfaces.
 *
 * As parameterized: d(i, j) = ||Q(f_i) - Q(f_j)||, a metric; each SRNF, or square-root map, is
 * computed once.
 * Registered: the distance of srnf_register in symmetric mode, equal for (i, j) and (j, i) by
 * construction; the triangle inequality then holds up to the local minima of registration.
 *
 * Every unordered pair is one task; it writes its own entry, so that the result does not depend on
 * who computes what. Cost: n (n - 1) / 2 registrations (registered.c), or that many passes over two
 * fields; the SRNFs of all surfaces are held at once only where nothing is registered: 24 n P
 * bytes.
 */
#include "stats.h"

#include <math.h>

struct distances {
    const struct srnf_sht *sht;
    const double *q; /* [n][3][P] */
    size_t n;
    double *matrix;
};

void srnf_pair(size_t index, size_t *i, size_t *j)
{
    size_t upper = (size_t)((1.0 + sqrt(1.0 + 8.0 * (double)index)) / 2.0);

    while (upper * (upper - 1) / 2 > index) {
        upper--;
    }
    while (upper * (upper + 1) / 2 <= index) {
        upper++;
    }
    *j = upper;
    *i = index - upper * (upper - 1) / 2;
}

static int measure_pair(void *argument, size_t index, const struct srnf_context *context,
                        struct srnf_error *error)
{
    struct distances *d = argument;
    const struct srnf_grid *grid = srnf_sht_grid(d->sht);
    size_t size = 3 * stats_points(grid);
    size_t i, j;

    (void)context;
    (void)error;
    srnf_pair(index, &i, &j);
    d->matrix[i * d->n + j] = sqrt(stats_distance2(grid, d->q + i * size, d->q + j * size));
    return SRNF_OK;
}

static int measure_fields(const struct srnf_sht *sht, enum srnf_representation representation,
                          size_t n, const double *const *surfaces, size_t pairs,
                          const struct stats_progress progress, const struct srnf_context *context,
                          double *matrix, struct srnf_error *error)
{
    struct distances d = {.sht = sht, .n = n, .matrix = matrix};
    size_t size = 3 * stats_points(srnf_sht_grid(sht)), all;
    double *q = NULL;
    int status;

    if (__builtin_mul_overflow(n, size, &all) || !(q = srnf_alloc(all, sizeof(double)))) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "no memory for the fields of %zu surfaces", n);
    }
    d.q = q;
    status = stats_represent(sht, representation, n, surfaces, context, q, error);
    status = status ? status : stats_run(context, pairs, measure_pair, &d, progress, error);
    srnf_free(q);
    return status;
}

int stats_field_distances(const struct srnf_sht *sht, enum srnf_representation representation,
                          size_t n, const double *const *surfaces,
                          const struct srnf_register_options *options,
                          const struct srnf_context *context, double *matrix,
                          struct srnf_error *error)
{
    const struct stats_progress progress = {0.0, 1.0, "measuring distances"};
    size_t pairs;
    int status = stats_check_surfaces(sht, n, surfaces, error);

    if (status == SRNF_OK && __builtin_mul_overflow(n, n, &pairs)) {
        status = srnf_fail(error, SRNF_ELIMIT, -1, "%zu surfaces have too many pairs", n);
    }
    if (status) {
        return status;
    }
    pairs = n % 2 == 0 ? n / 2 * (n - 1) : (n - 1) / 2 * n;
    if (options) {
        struct srnf_register_options symmetric = *options;
        struct stats_registered asked = {sht, n, surfaces, &symmetric, 0, 0};

        symmetric.symmetric = true;
        symmetric.representation = representation;
        asked.series = stats_series(sht, STATS_KEPT_DISTANCES, n, surfaces, &symmetric);
        status = stats_registered_distances(&asked, pairs, NULL, progress, context, matrix, error);
    } else {
        status = measure_fields(sht, representation, n, surfaces, pairs, progress, context, matrix,
                                error);
    }
    for (size_t i = 0; i < n; i++) {
        matrix[i * n + i] = 0.0;
        for (size_t j = 0; j < i; j++) {
            matrix[i * n + j] = matrix[j * n + i];
        }
    }
    return status;
}

int srnf_distances(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                   const struct srnf_register_options *options, const struct srnf_context *context,
                   double *matrix, struct srnf_error *error)
{
    return stats_field_distances(sht, options ? options->representation : SRNF_REPRESENTATION_SRNF,
                                 n, surfaces, options, context, matrix, error);
}

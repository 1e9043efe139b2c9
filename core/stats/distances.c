/*
 * distances.c - the symmetric matrix of distances between surfaces.
 *
 * As parameterized: d(i, j) = ||Q(f_i) - Q(f_j)||, a metric; each SRNF, or square-root map, is
 * computed once.
 * Registered: the distance of srnf_register in symmetric mode, equal for (i, j) and (j, i) by
 * construction; the triangle inequality then holds up to the local minima of registration.
 *
 * Every unordered pair is one task; it writes its two entries, so that the result does not depend
 * on who computes what. Cost: n (n - 1) / 2 registrations, or that many passes over two fields; the
 * SRNFs of all surfaces are held at once only where nothing is registered: 24 n P bytes.
 */
#include "registration/registration.h"
#include "stats.h"

#include <math.h>

struct distances {
    const struct srnf_sht *sht;
    const double *const *surfaces;
    const struct srnf_register_options *options; /* NULL: as parameterized */
    const double *q;                             /* [n][3][P], then */
    uint64_t series;                             /* of registered ones (kept.c) */
    size_t n;
    double *matrix;
};

void stats_pair(size_t index, size_t *i, size_t *j)
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

static int measure(const struct distances *d, size_t i, size_t j,
                   const struct srnf_context *context, double *distance, struct srnf_error *error)
{
    size_t size = 3 * stats_points(srnf_sht_grid(d->sht));

    if (!d->options) {
        *distance = sqrt(stats_distance2(srnf_sht_grid(d->sht), d->q + i * size, d->q + j * size));
        return SRNF_OK;
    }
    return registration_distance(d->sht, d->surfaces[i], d->surfaces[j], d->options, context,
                                 distance, error);
}

static int measure_pair(void *argument, size_t index, const struct srnf_context *context,
                        struct srnf_error *error)
{
    struct distances *d = argument;
    double distance = 0.0;
    size_t i;
    size_t j;
    int status;

    stats_pair(index, &i, &j);
    if (d->options && stats_recall(context, d->series, index, 1, &distance) && distance >= 0.0) {
        status = SRNF_OK;
    } else {
        status = measure(d, i, j, context, &distance, error);
        if (d->options && status >= 0) {
            stats_keep(context, d->series, index, 1, &distance);
        }
    }
    d->matrix[i * d->n + j] = distance;
    d->matrix[j * d->n + i] = distance;
    return status;
}

int stats_field_distances(const struct srnf_sht *sht, enum srnf_representation representation,
                          size_t n, const double *const *surfaces,
                          const struct srnf_register_options *options,
                          const struct srnf_context *context, double *matrix,
                          struct srnf_error *error)
{
    struct srnf_register_options symmetric;
    struct distances d = {.sht = sht, .surfaces = surfaces, .n = n, .matrix = matrix};
    size_t size = 3 * stats_points(srnf_sht_grid(sht));
    double *q = NULL;
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
        symmetric = *options;
        symmetric.symmetric = true;
        symmetric.representation = representation;
        d.options = &symmetric;
        d.series = stats_series(sht, STATS_KEPT_DISTANCES, n, surfaces, &symmetric);
    } else {
        size_t all;

        if (__builtin_mul_overflow(n, size, &all) || !(q = srnf_alloc(all, sizeof(double)))) {
            return srnf_fail(error, SRNF_ENOMEM, -1, "no memory for the fields of %zu surfaces", n);
        }
        d.q = q;
        status = stats_represent(sht, representation, n, surfaces, context, q, error);
    }
    for (size_t i = 0; i < n; i++) {
        matrix[i * n + i] = 0.0;
    }
    if (status == SRNF_OK) {
        status = stats_run(context, pairs, measure_pair, &d,
                           (struct stats_progress){0.0, 1.0, "measuring distances"}, error);
    }
    srnf_free(q);
    return status;
}

int srnf_distances(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                   const struct srnf_register_options *options, const struct srnf_context *context,
                   double *matrix, struct srnf_error *error)
{
    return stats_field_distances(sht, options ? options->representation : SRNF_REPRESENTATION_SRNF,
                                 n, surfaces, options, context, matrix, error);
}

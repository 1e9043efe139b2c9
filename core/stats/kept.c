/*
 * kept.c - parts that an earlier attempt at the same computation has left (srnf_context.recall).
 *
 * A series is named by a digest, FNV-1a of 64 bits, of all that its parts are computed from: what
 * they are, degree and grid, options, and every coefficient of every surface. So a part is taken
 * only for what it was computed for; what is not finite is not taken at all.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

#define FNV_PRIME UINT64_C(1099511628211)

uint64_t stats_hash(uint64_t hash, uint64_t x)
{
    for (unsigned shift = 0; shift < 64; shift += 8) {
        hash = (hash ^ ((x >> shift) & 0xff)) * FNV_PRIME;
    }
    return hash;
}

static uint64_t hash_double(uint64_t hash, double x)
{
    uint64_t bits;

    memcpy(&bits, &x, sizeof bits);
    return stats_hash(hash, bits);
}

uint64_t stats_hash_doubles(uint64_t hash, size_t count, const double *x)
{
    for (size_t k = 0; k < count; k++) {
        hash = hash_double(hash, x[k]);
    }
    return hash;
}

uint64_t stats_series(const struct srnf_sht *sht, uint64_t what, size_t n,
                      const double *const *surfaces, const struct srnf_register_options *options)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    uint64_t hash = stats_hash(STATS_HASH_START, what);

    hash = stats_hash(hash, srnf_sht_degree(sht));
    hash = stats_hash(hash, (uint64_t)grid->kind);
    hash = stats_hash(hash, grid->n_theta);
    hash = stats_hash(hash, grid->n_phi);
    hash = stats_hash(hash, (uint64_t)options->representation);
    hash = stats_hash(hash, options->degree);
    hash = stats_hash(hash, options->max_steps);
    hash = stats_hash(hash, (uint64_t)options->start);
    hash =
        stats_hash(hash, (uint64_t)options->rotation | (uint64_t)options->reparameterization << 1 |
                             (uint64_t)options->common_pose << 2 |
                             (uint64_t)options->symmetric << 3 | (uint64_t)options->exact << 4);
    hash = hash_double(hash, options->penalty_jacobian);
    hash = hash_double(hash, options->penalty_displacement);
    hash = stats_hash(hash, n);
    for (size_t i = 0; i < n; i++) {
        hash = stats_hash_doubles(hash, count, surfaces[i]);
    }
    return hash;
}

bool stats_recall(const struct srnf_context *context, uint64_t series, size_t index, size_t count,
                  double *values)
{
    if (!context || !context->recall ||
        !context->recall(context->user, series, index, count, values)) {
        return false;
    }
    for (size_t k = 0; k < count; k++) {
        if (!isfinite(values[k])) {
            return false;
        }
    }
    return true;
}

void stats_keep(const struct srnf_context *context, uint64_t series, size_t index, size_t count,
                const double *values)
{
    if (context && context->keep && !srnf_is_canceled(context)) {
        context->keep(context->user, series, index, count, values);
    }
}

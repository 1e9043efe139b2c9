/*
 * kept.c - numbers that an earlier attempt at the same computation has left (srnf_context.recall).
 *
 * A series is named by a digest, FNV-1a of 64 bits, of all that its numbers are computed from: what
 * they are, degree and grid, options, and every coefficient of every surface. So a number is taken
 * only for what it was computed for; what is no distance is not taken at all.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

#define FNV_START UINT64_C(14695981039346656037)
#define FNV_PRIME UINT64_C(1099511628211)

static uint64_t hash_u64(uint64_t hash, uint64_t x)
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
    return hash_u64(hash, bits);
}

uint64_t stats_series(const struct srnf_sht *sht, uint64_t what, size_t n,
                      const double *const *surfaces, const struct srnf_register_options *options)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    uint64_t hash = hash_u64(FNV_START, what);

    hash = hash_u64(hash, srnf_sht_degree(sht));
    hash = hash_u64(hash, (uint64_t)grid->kind);
    hash = hash_u64(hash, grid->n_theta);
    hash = hash_u64(hash, grid->n_phi);
    hash = hash_u64(hash, (uint64_t)options->representation);
    hash = hash_u64(hash, options->degree);
    hash = hash_u64(hash, options->max_steps);
    hash = hash_u64(hash, (uint64_t)options->start);
    hash = hash_u64(hash, (uint64_t)options->rotation | (uint64_t)options->reparameterization << 1 |
                              (uint64_t)options->common_pose << 2 |
                              (uint64_t)options->symmetric << 3 | (uint64_t)options->exact << 4);
    hash = hash_double(hash, options->penalty_jacobian);
    hash = hash_double(hash, options->penalty_displacement);
    hash = hash_u64(hash, n);
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < count; k++) {
            hash = hash_double(hash, surfaces[i][k]);
        }
    }
    return hash;
}

bool stats_recall(const struct srnf_context *context, uint64_t series, size_t index,
                  double *distance)
{
    double value = -1.0;

    if (!context || !context->recall || !context->recall(context->user, series, index, &value) ||
        !(value >= 0.0) || isinf(value)) {
        return false;
    }
    *distance = value;
    return true;
}

void stats_keep(const struct srnf_context *context, uint64_t series, size_t index, double distance)
{
    if (context && context->keep) {
        context->keep(context->user, series, index, distance);
    }
}

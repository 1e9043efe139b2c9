/*
 * maps.h - maps of a local statistic and their p-values by permutation.
 */
#ifndef SRNF_STATS_MAPS_H
#define SRNF_STATS_MAPS_H

#include <stdatomic.h>

#include "stats.h"

/* Relative: what counts as the same statistic. Relabellings that change nothing only give the
   observed value again, but for rounding. */
#define STATS_TIE 1e-9
static inline bool stats_as_large(double value, double observed)
{
    return value >= observed * (1.0 - STATS_TIE);
}

/* b' E^(-1) b by Cholesky; 0 where E is singular. e: xx xy xz yy yz zz. */
double stats_quadratic_form(const double e[6], const double b[3]);

struct stats_map {
    size_t points;
    const double *root;             /* [P] of each node's share of the area: stats_embedding */
    const double *statistic;        /* [P] */
    double *p, *significance, *fdr; /* [P] filled: as in struct srnf_comparison */
};

/*
 * The p-values of a map.
 *   m        [in]     permutations
 *   largest  [in/out] [m + 1] largest statistic of each, the observed first; the others are sorted
 *   count    [in]     [P] permutations with as large a statistic at the node
 *   max_p    [out]    p of the largest statistic
 * Errors: SRNF_ENOMEM.
 */
SRNF_CHECKED int stats_map_conclude(const struct stats_map *map, size_t m, double *largest,
                                    const atomic_uint *count, double *max_p);

#endif

/*
 * twins.h - members of a group that are far nearer to each other than the others: scans of one
 * subject that count as two. (core/stats)
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_TWINS_H
#define SRNF_PUBLIC_TWINS_H

#include "srnf/base.h"
#include "srnf/sphere.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* Part of the lower quartile of distances below which a pair is one of twins; core/README.md has
   what it was measured by. */
#define SRNF_TWINS_SHARE 0.25
/* Pairs below which there is no quartile to speak of. */
#define SRNF_TWINS_PAIRS 6

struct srnf_twins {
    size_t count;         /* pairs that are far nearer than the others */
    size_t first, second; /* the nearest pair, first < second */
    double nearest;       /* its distance */
    double quartile; /* a quarter of the pairs of different subjects, in one class, is nearer; */
    double median;   /* and half of them; 0 where there are too few */
};

/*
 * The distances between registered SRNFs as they stand, by their Gram matrix (core/stats/twins.c).
 *   registered_q  [in] double[n][3][n_theta][n_phi]
 *   distances     [out] double[n][n]
 * Distances below about 1e-8 of the norms are rounding. Errors: SRNF_EINVAL (n is 0 or above
 * 30000), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_twins_distances(const struct srnf_grid *grid, size_t n,
                                      const double *registered_q, double *distances);

/*
 * The pairs of different subjects whose distance is below SRNF_TWINS_SHARE of their lower quartile
 * and too small to come by chance (core/stats/twins.c); where the quartile is of fewer than
 * SRNF_TWINS_PAIRS pairs, none.
 *   distances  [in] double[n][n], symmetric; entries that are not finite count for nothing
 *   subjects   [in] [n] numbers, the same for members of one subject; NULL: each its own
 *   classes    [in] [n] numbers: the quartile is of the pairs of one class; NULL: of all
 *   twins      [out] all zero where there are no pairs
 * Errors: SRNF_EINVAL (n above 30000), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_twins_find(size_t n, const double *distances, const size_t *subjects,
                                 const size_t *classes, struct srnf_twins *twins);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

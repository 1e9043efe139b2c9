/*
 * parts.h - several structures of each subject together: joint principal components (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_PARTS_H
#define SRNF_PUBLIC_PARTS_H

#include "srnf/stats.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

#define SRNF_PARTS_MAX ((size_t)32)

/* The same structure of each of n subjects, registered to its own mean. */
struct srnf_part {
    const double *mean_q;       /* [3][n_theta][n_phi] */
    const double *registered_q; /* [n][3][n_theta][n_phi] */
    double weight;              /* above 0: of its squared distances in those of subjects */
};

/* Joint components: one score of a subject for each, one mode of each part. */
struct srnf_joint_pca {
    size_t n, parts, components;
    double *eigenvalues; /* [components] variances (divided by n - 1), decreasing, above rounding */
    double *explained;   /* [components] shares of total_variance */
    double total_variance;  /* weighted: the sum of part_variances and of position_variance */
    double *part_variances; /* [parts] */
    double position_variance;
    double *scores; /* [n][components] */
    double *shares; /* [components][parts + 1] of each mode, its last of the positions: sum 1 */
    double *modes;  /* [components][parts][3][n_theta][n_phi]: a subject's q of a part is mean_q +
                       sum of score times this */
    double *positions; /* [components][parts][3] the same of positions; NULL without them */
};
void srnf_joint_pca_clear(struct srnf_joint_pca *joint);

/*
 * Principal components of subjects of several parts: of the vectors (sqrt(w_1) q_1, .., sqrt(w_P)
 * q_P, sqrt(w) x), x the positions of the parts, in L2 (core/stats/parts.c). Weights times c give
 * the scores and the roots of the eigenvalues times sqrt(c), and the modes divided by it. One part
 * of weight 1 is srnf_pca_fit, to the last bit.
 *   grid             [in] of all fields
 *   n                [in] subjects, 2 .. 30000
 *   parts            [in] [n_parts], n_parts 1 .. SRNF_PARTS_MAX
 *   positions        [in] double[n][n_parts][3], relative to each other in any way that is the same
 *                    for all subjects, such as to their mean; or NULL: without relative positions
 *   position_weight  [in] above 0, with positions
 *   max_components   [in] 0: all above rounding
 * Errors: SRNF_EINVAL (counts, a weight, numbers that are not finite), SRNF_ENOMEM, SRNF_ENUMERIC,
 * SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_joint_pca_fit(const struct srnf_grid *grid, size_t n, size_t n_parts,
                                    const struct srnf_part *parts, const double *positions,
                                    double position_weight, size_t max_components,
                                    const struct srnf_context *context,
                                    struct srnf_joint_pca *joint);

/*
 * The fields that scores stand for: q_p = mean_q + sum_k scores[k] mode_kp.
 *   scores  [in]  double[components]
 *   part    [in]  below parts
 *   q       [out] double[3][n_theta][n_phi]
 */
void srnf_joint_pca_reconstruct(const struct srnf_grid *grid, const struct srnf_joint_pca *joint,
                                const struct srnf_part *parts, const double *scores, size_t part,
                                double *q);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

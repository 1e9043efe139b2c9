/*
 * parts.h - several structures of each subject together: joint principal components (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_PARTS_H
#define SRNF_PUBLIC_PARTS_H

#include "srnf/stats.h"
#include "srnf/typicality.h"

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

/* ---- Stacked fields -------------------------------------------------------------------------- */

/* Several fields as one (core/stats/stack.c): a field [3][grid.n_theta][grid.n_phi] on a grid with
   the rows of all parts, whose products are those of subjects. Of grid nothing but its sizes and
   its weight means anything. */
struct srnf_stack {
    const struct srnf_grid *own; /* of each part; borrowed */
    struct srnf_grid grid;
    size_t parts;
    bool positions;
    double *weight; /* of grid, owned */
};

/*
 *   weights          [in]  [n_parts] above 0
 *   position_weight  [in]  above 0, or 0: without positions
 *   stack            [out] to be cleared by srnf_stack_clear in any case
 * Errors: SRNF_EINVAL (counts, a weight), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_stack_open(const struct srnf_grid *own, size_t n_parts, const double *weights,
                                 double position_weight, struct srnf_stack *stack);
void srnf_stack_clear(struct srnf_stack *stack);

/* field: [3][own.n_theta][own.n_phi]; positions: [parts][3], of a stack that has them. What stacked
   holds beside the part stays. */
void srnf_stack_put(const struct srnf_stack *stack, size_t part, const double *field,
                    double *stacked);
void srnf_stack_take(const struct srnf_stack *stack, size_t part, const double *stacked,
                     double *field);
void srnf_stack_put_positions(const struct srnf_stack *stack, const double *positions,
                              double *stacked);
void srnf_stack_take_positions(const struct srnf_stack *stack, const double *stacked,
                               double *positions);
/* The weighted product of what two stacked fields have in a part, or, part being parts, of their
   positions. These add up to srnf_inner_product on grid. */
double srnf_stack_product(const struct srnf_stack *stack, size_t part, const double *a,
                          const double *b);

/* ---- To be kept ------------------------------------------------------------------------------ */

#define SRNF_JOINT_CALIBRATED_MIN ((size_t)3) /* subjects */

/* Joint components as stacked fields, for a stack of the same weights, with what they say of the
   subjects that they are made of. */
struct srnf_joint_model {
    size_t n_theta;                      /* rows of a stacked field; n_phi is that of the parts */
    double *mean_q;                      /* [3][n_theta][n_phi] */
    double *modes;                       /* [components][3][n_theta][n_phi] */
    double *residuals, *distances;       /* [n] of the subjects; one allocation */
    struct srnf_calibration calibration; /* n 0 below SRNF_JOINT_CALIBRATED_MIN subjects */
};
void srnf_joint_model_clear(struct srnf_joint_model *model);
/*
 * Of what srnf_joint_pca_fit made of the same parts and positions.
 *   context  [in]  as for srnf_calibrate
 *   model    [out] freed with srnf_joint_model_clear; empty on error
 * Errors: as srnf_joint_pca_fit and srnf_calibrate.
 */
SRNF_CHECKED int srnf_joint_model_make(const struct srnf_grid *grid,
                                       const struct srnf_joint_pca *joint,
                                       const struct srnf_part *parts, const double *positions,
                                       double position_weight, const struct srnf_context *context,
                                       struct srnf_joint_model *model);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

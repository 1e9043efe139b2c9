/*
 * norms.h - what the files of the norms share: linear predictions of members that are left out.
 */
#ifndef SRNF_STATS_NORMS_H
#define SRNF_STATS_NORMS_H

#include "stats.h"
#include "subjects.h"
#include "srnf/norms.h"

#define NORMS_GROUPS ((size_t)5) /* of subjects, for the check */
#define NORMS_NONE SIZE_MAX      /* a subject, or group, that is none: nobody is left out */

struct norms {
    const struct srnf_sht *sht;
    const struct srnf_grid *grid; /* of fields */
    const struct srnf_norm_model *model;
    const struct srnf_context *context;
    struct subjects subjects;
    double *weights; /* [n] 1 / members of its subject */
    size_t n, points;
};

/* ---- norms_fold.c ---------------------------------------------------------------------------- */

/* A linear model of the members that are in a fold. */
struct norms_fold {
    size_t n, p, members; /* all; coefficients; those inside */
    bool *inside;         /* [n] */
    double *basis;        /* [p][n] orthonormal, 0 outside */
    double *shift;        /* [p] what is taken off a column */
    double *r;            /* [p][p] upper: x - shift = sum over k of r[k] basis_k */
};
/* Fits the design to all members but those of a group and of a subject. SRNF_EINVAL: too few are
   left, or a column follows. Cleared in any case. */
SRNF_CHECKED int norms_fold_open(struct norms_fold *fold, const struct norms *norms, size_t group,
                                 size_t subject, struct srnf_error *error);
void norms_fold_clear(struct norms_fold *fold);
/* The weights of the members in the prediction at x, [columns], NULL without columns: a [n]. u: [p]
   of scratch. Returns the leverage, the sum of their squares. */
double norms_fold_predict(const struct norms_fold *fold, const double *x, double *u, double *a);
static inline size_t norms_fold_freedom(const struct norms_fold *fold)
{
    return fold->members - fold->p;
}
/* The group of the check that a subject is in. */
static inline size_t norms_group(size_t subject)
{
    return subject % NORMS_GROUPS;
}
/* The covariates of a member. */
static inline const double *norms_row(const struct norms *norms, size_t member)
{
    return norms->model->columns ? norms->model->values + member * norms->model->columns : NULL;
}

/* ---- norms_traits.c, norms_check.c, norms_map.c ---------------------------------------------- */

/* A deviation to be described: scores on all components, and the square of what is outside. */
struct norms_target {
    const double *scores, *x; /* [components]; [columns] or NULL */
    double outside2;
};
/* Traits of `count` targets about the fold: values[t * stride + i]. */
SRNF_CHECKED int norms_describe(const struct norms *norms, const struct norms_fold *fold,
                                size_t counted, size_t count, const struct norms_target *targets,
                                size_t stride, double *values);
/* The same of the members of a subject. at: [n], of those alone. */
SRNF_CHECKED int norms_describe_subject(const struct norms *norms, size_t group, size_t subject,
                                        size_t counted, double *values, struct srnf_error *error);
/* Components that the Mahalanobis distance counts, of the deviations in a fold of all. */
SRNF_CHECKED int norms_count(const struct norms *norms, const struct norms_fold *fold,
                             size_t *counted);

/* norms_augment.c: the same of all members, each left out of all others and one more surface. at:
   [columns] of that. values: [SRNF_NORM_TRAITS][n]. */
SRNF_CHECKED int norms_values_with(const struct norms *norms, const double *q, const double *at,
                                   size_t counted, struct stats_progress progress, double *values,
                                   struct srnf_error *error);

SRNF_CHECKED int norms_check(const struct norms *norms, size_t counted,
                             struct stats_progress progress, struct srnf_norm_check *check,
                             struct srnf_error *error);
SRNF_CHECKED int norms_map(const struct norms *norms, const double *q,
                           const struct srnf_norm_options *options, struct stats_progress progress,
                           struct srnf_score *score, struct srnf_error *error);

/* Rank among the members of other subjects than `left_out`, or of all. */
SRNF_CHECKED int norms_rank(const struct norms *norms, const double *values, size_t left_out,
                            double value, struct srnf_norm_rank *rank);

#endif

/*
 * norms.h - how odd a surface is beside the members of a model: norms (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * A surface is never compared with how a model fits its own members, which is too well: every
 * member is judged by the others alone, left out with all of its subject, and the surface among the
 * values that come of it. Covariates may say what is to be expected of each: then deviations are
 * those from a linear prediction, which is fitted without the one that it judges.
 */
#ifndef SRNF_PUBLIC_NORMS_H
#define SRNF_PUBLIC_NORMS_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/stats.h"
#include "srnf/typicality.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* A value among the same values of members, each subject counting once. */
struct srnf_norm_rank {
    double value;
    double percentile; /* 0 .. 100: (below + half of the equal ones + 1/2) / (subjects + 1). Of
                           another one of the group it is uniform */
    double
        interval[2]; /* 95 %, Wilson's, of the percentile among all others, judged by this model */
    double as_odd;   /* subjects with a value as large */
    double p_value;  /* (1 + as_odd) / (1 + subjects): at most a with the probability a */
};

/*
 *   values   [in] [n], finite
 *   weights  [in] [n] 1 / members of its subject, or NULL: 1 each
 * Errors: SRNF_EINVAL (no values, a weight that is none, a value that is not finite).
 */
SRNF_CHECKED int srnf_norm_rank(size_t n, const double *values, const double *weights, double value,
                                struct srnf_norm_rank *rank);

/*
 * The same of several traits at once: of each member and of the surface the largest of the ranks
 * that its values have among all n + 1 of them, and where that stands. All are treated alike, so
 * that the percentile is uniform however the traits depend on each other.
 *   values  [in] [traits][n]
 *   own     [in] [traits]
 * Errors: as srnf_norm_rank, SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_norm_rank_together(size_t n, size_t traits, const double *values,
                                         const double *weights, const double *own,
                                         struct srnf_norm_rank *rank);

/* Kolmogorov's distance of n percentiles, 0 .. 100, from uniform ones, and its p by M. Stephens'
   approximation (JRSS B 1970). Errors: SRNF_EINVAL (n is 0), SRNF_ENOMEM. */
SRNF_CHECKED int srnf_norm_uniform(size_t n, const double *percentiles, double *distance,
                                   double *p_value);

#define SRNF_NORM_TRAITS 3 /* SRNF_TRAIT_RESIDUAL, SRNF_TRAIT_DISTANCE, SRNF_TRAIT_MAHALANOBIS */
#define SRNF_NORM_CHECKS 3 /* residual, Mahalanobis and both together */

struct srnf_norm_model {
    const struct srnf_grid *grid; /* of fields; NULL: that of the transform. Another one, as that of
                                     a stack of parts, has no map */
    const struct srnf_pca *pca;
    const double *mean;                         /* [3][(L+1)^2] the mean surface */
    const double *mean_q;                       /* [3][n_theta][n_phi] */
    const size_t *subjects;                     /* [n] as in srnf/subjects.h, or NULL */
    const struct srnf_calibration *calibration; /* of the model; not needed with columns */
    bool complete;        /* the components hold all variance of the members: see srnf_score */
    size_t columns;       /* of covariates, without the constant; may be 0 */
    const double *values; /* [n][columns] of the members */
};

struct srnf_norm_options {
    const double *at; /* [columns] covariates of the surface */
    size_t member;    /* the member that the surface is; n, or more: none */
    bool map, check;  /* what else is wanted; both default true */
};
struct srnf_norm_options srnf_norm_options_defaults(void);

/* Percentiles of members that five models of four fifths of the subjects have not seen. */
struct srnf_norm_check {
    size_t n;            /* subjects, one value each; 0: not made */
    double *percentiles; /* [SRNF_NORM_CHECKS][n] */
    double distance[SRNF_NORM_CHECKS], p_value[SRNF_NORM_CHECKS]; /* from uniform ones */
};

struct srnf_score {
    size_t n, subjects;                            /* of the model */
    size_t compared;                               /* subjects that the surface was compared with */
    size_t counted;                                /* components of the Mahalanobis distance */
    struct srnf_norm_rank trait[SRNF_NORM_TRAITS]; /* by enum srnf_trait */
    struct srnf_norm_rank overall; /* residual and Mahalanobis together; its value is their rank */
    struct srnf_norm_check check;
    /* The map; n_points 0: not made. Lengths in the unit of the surfaces. */
    size_t n_points;
    double *coefficients; /* [3][(L+1)^2] the surface as it is registered */
    double *deviation;    /* [P] along the outward normal of the mean, from what is expected */
    double *spread;       /* [P] standard deviation of that in members that are left out */
    double *z;            /* [P] deviation / spread */
    double *significance; /* [P] (1 + subjects with such a |z| anywhere) / (1 + subjects) */
    struct srnf_norm_rank largest; /* of |z| over the surface */
};
void srnf_score_clear(struct srnf_score *score);

/*
 * Scores of oddness of a surface.
 *   sht    [in]  degree and grid of the model
 *   q      [in]  double[3][n_theta][n_phi], registered to mean_q as the members are
 *   score  [out] freed with srnf_score_clear; untouched on error
 * Without columns residual, distance and Mahalanobis distance are those of srnf_typicality_of. With
 * columns they are those of the deviation from the prediction (core/stats/norms_traits.c), which
 * needs all components of the members: complete. So does the check. Members are left out of all
 * others and the surface, which is so treated as they are (core/stats/norms_augment.c); where it is
 * a member itself, or, without columns, in a model that is not complete or has more than
 * SRNF_NORM_CHECK_MAX subjects, out of the others, as the calibration has it.
 * The check is made for up to SRNF_NORM_CHECK_MAX subjects.
 * Cost: for up to so many subjects, or with columns, and five times that for the check, an
 * eigenproblem of size n for each subject; for the map n + 1 inversions, which are kept
 * (srnf_context.keep).
 * Errors: SRNF_EINVAL (fewer than 4 subjects beside the columns; columns that follow from those
 * before them, also without one of the subjects: element is its number; neither complete nor a
 * calibration; values that are not finite), SRNF_EDEGENERATE (a mean without area), SRNF_ENOMEM,
 * SRNF_ENUMERIC, SRNF_ECANCELED.
 */
#define SRNF_NORM_CHECK_MAX ((size_t)150)
#define SRNF_NORM_CHECK_MIN ((size_t)10)
SRNF_CHECKED int srnf_score(const struct srnf_sht *sht, const struct srnf_norm_model *model,
                            const double *q, const struct srnf_norm_options *options,
                            const struct srnf_context *context, struct srnf_score *score,
                            struct srnf_error *error);

/*
 * The map alone, with n, subjects and compared: of a part of a model of several structures, whose
 * modes are what those of the model have of it.
 *   score  [out] freed with srnf_score_clear; untouched on error
 * Errors: as srnf_score.
 */
SRNF_CHECKED int srnf_norm_map(const struct srnf_sht *sht, const struct srnf_norm_model *model,
                               const double *q, const struct srnf_norm_options *options,
                               const struct srnf_context *context, struct srnf_score *score,
                               struct srnf_error *error);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

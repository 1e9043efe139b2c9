/*
 * typicality.h - is a surface like those that a model was made from? (core/stats)
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * The subjects that a model was fitted to are no reference for how far from it another surface may
 * be: all of their deviations are in it, and their residuals are rounding. Their leave-one-out
 * values are one: what each subject has in the model of the others. A surface is judged by four
 * numbers, each against its like (srnf_typicality_of).
 */
#ifndef SRNF_PUBLIC_TYPICALITY_H
#define SRNF_PUBLIC_TYPICALITY_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/stats.h"
#include "srnf/classify.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum srnf_trait {
    SRNF_TRAIT_RESIDUAL = 0,    /* norm of what the components cannot represent */
    SRNF_TRAIT_DISTANCE = 1,    /* to the mean SRNF */
    SRNF_TRAIT_MAHALANOBIS = 2, /* of the first scores (srnf_mahalanobis_components) */
    SRNF_TRAIT_ANGLE = 3,       /* by which it is turned against the mean, radians */
    SRNF_TRAIT_NEAREST = 4,     /* distance to the nearest of the others */
};
#define SRNF_CALIBRATION_TRAITS 4 /* that a model is calibrated in: the first four */

/* Leave-one-out values of the members of a model, each left out with all of its subject. */
struct srnf_calibration {
    size_t n;       /* members */
    double *values; /* [SRNF_CALIBRATION_TRAITS][n] by enum srnf_trait */
};
void srnf_calibration_clear(struct srnf_calibration *calibration);

/*
 * What each member has in the model of those of other subjects: mean, components and their number
 * are fitted without its subject, registrations are kept (core/README.md says what that costs).
 * All from the scores; no field is fitted again (core/stats/calibrate.c).
 *   pca           [in] as srnf_pca_fit makes it of the next two
 *   mean_q        [in] double[3][n_theta][n_phi], the mean of registered_q
 *   registered_q  [in] double[n][3][n_theta][n_phi]
 *   subjects      [in] [n] as in srnf/subjects.h, or NULL; three subjects at least
 *   context       [in] asked after each subject, and for threads; or NULL
 *   calibration   [out] freed with srnf_calibration_clear; untouched on error
 * A model of fewer components than there are keeps as many in each fold; one of all, all. Residuals
 * below 1e-9 of the mean's norm are rounding, and are raised to that.
 * Cost: the products of srnf_pca_fit and an eigenproblem of size n; for a subject of one member
 * about ten times n^2 divisions, for one of several an eigenproblem of size n. Memory: 3 n^2, and
 * n^2 for each thread where subjects have several members.
 * Errors: SRNF_EINVAL (fewer than 3 subjects, a number of one that is not below n, values that are
 * not finite), SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_calibrate(const struct srnf_grid *grid, const struct srnf_pca *pca,
                                const double *mean_q, const double *registered_q,
                                const size_t *subjects, const struct srnf_context *context,
                                struct srnf_calibration *calibration);

/* Components that a Mahalanobis distance counts: the fewest with 95 % of the variance of those
   kept, but no more than a quarter of n - 1, as the variances of the last ones are hardly known.
   n: subjects, however many members they have. eigenvalues: [components], decreasing; at least 1,
   or 0 where there are none. */
size_t srnf_mahalanobis_components(size_t n, size_t components, const double *eigenvalues);
/* Root of the sum over the first `components` of score^2 / eigenvalue. */
double srnf_mahalanobis(size_t components, const double *eigenvalues, const double *scores);

/*
 * The angle, 0 .. pi, of the rotation O of the values that brings q nearest to a mean SRNF: the
 * minimum over O of ||mean_q - O q||, in closed form. A warp of the domain plays no part.
 *   rotation  [out] O, row-major; optional
 */
double srnf_pose_angle(const struct srnf_grid *grid, const double *mean_q, const double *q,
                       double rotation[9]);
/* The same for each of n fields against the mean of those of other subjects.
   q: [n][3][n_theta][n_phi]; subjects: [n] as in srnf/subjects.h, or NULL; two subjects at least.
   Errors: SRNF_EINVAL (fewer subjects, a number of one that is not below n), SRNF_ENOMEM. */
SRNF_CHECKED int srnf_pose_angles(const struct srnf_grid *grid, size_t n, const double *q,
                                  const size_t *subjects, double *angles);

struct srnf_typicality {
    double value;
    double limit;      /* beyond which a member falls with the probability alpha; INFINITY where the
                     references are too few, or too far apart, to set one: then nothing is far */
    double percentile; /* 0 .. 100: share of the reference values that are below */
    double percentile_interval[2]; /* 95 %, Wilson's, of that among all others, by this model */
    bool far;                      /* value > limit */
};

/* Probability with which a trait of a member is beyond its limit: of a surface that is judged by a
   model, and of each member of a group that are judged by one another. */
#define SRNF_TYPICAL_ALPHA 0.005
#define SRNF_TYPICAL_ALPHA_GROUP 0.001

/*
 * A value against reference values of members of a group. The reference is taken as normal after a
 * transformation: log for residuals and distances, the power 2/3 for Mahalanobis distances and
 * angles, which are roots of sums of a few squares (E. Wilson, M. Hilferty, PNAS 1931). With centre
 * m and scale s of Huber's proposal 2, for which values beyond 1.5 s of m are drawn in to there
 * (core/stats/typicality.c), so that a few strange references change little, the limit is the
 * prediction limit
 *
 *     m + t s sqrt(1 + 1.05 / n),
 *
 * t the upper quantile alpha of Student's distribution with .88 (n - 1) degrees of freedom: about
 * what the scale is worth. Deviations below 5 % and angles below a degree are never far. In normal
 * data .41 to .48 % of members are beyond the limit of alpha = .005 with 6 to 50 references, and
 * .04 to .09 % beyond that of .001; with 4 fewer (test_typicality.c prints these figures). Of
 * groups of 6, 14 and 30 left ventricles .04, .07 and .03 % of members are beyond the limit of
 * .001, and a nucleus of the brain among them is so in 66, 95 and 100 % of the groups.
 *
 * Values of the same subject are not independent. With weights, 1 / m for each of the m values of a
 * subject, medians and percentile are weighted ones, each subject counting once, and n in the limit
 * and the interval is the number of subjects, the sum of the weights: what several values of a
 * subject tell beyond one is not counted on, which makes both too wide rather than too narrow.
 *   values   [in] [n], not negative
 *   weights  [in] [n], positive, of 3 subjects at least; NULL: 1 each
 *   alpha    [in] 0 < alpha < .5
 * Errors: SRNF_EINVAL, SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_typicality_of(enum srnf_trait trait, size_t n, const double *values,
                                    const double *weights, double value, double alpha,
                                    struct srnf_typicality *result);

struct srnf_folds;

/* Members of a comparison, each judged by the others' values in their own folds. */
struct srnf_folds_typicality {
    size_t n, traits;
    enum srnf_trait trait[3];         /* residual, distance and Mahalanobis, or nearest alone */
    struct srnf_typicality *verdicts; /* [n][traits] */
};
void srnf_folds_typicality_clear(struct srnf_folds_typicality *typicality);

/*
 * Where the metric has scores: residual beyond them, distance to the mean of the training members
 * and Mahalanobis distance of each member in the fold that left it out. Otherwise its distance to
 * the nearest training member. Labels enter nowhere: what is far is foreign to all classes. Its
 * references are the values of the members of other subjects, each subject counting once; where
 * those are fewer than three subjects the limit is INFINITY.
 *   typicality  [out] freed with srnf_folds_typicality_clear; untouched on error
 * Cost: n^2 (components + log n). Errors: SRNF_EINVAL (fewer than 4 members, alpha), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_folds_typicality(const struct srnf_folds *comparison, double alpha,
                                       struct srnf_folds_typicality *typicality);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

/*
 * groups.h - judging a model of a group, and comparing two groups (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that. Both start from what
 * srnf_karcher_mean returns: surfaces that are registered to their mean, so that equal points of
 * the sphere are corresponding points.
 *
 * SURFACE DISTANCE, used by both: the root of the mean square distance of corresponding points,
 *
 *     d(f, g)^2 = min over t of  integral |f - g - t|^2 dA / A,
 *
 * dA and A the area element and the area of the mean surface. It is a length in the unit of the
 * surfaces (for surfaces of area 1, the root of that area) and does not depend on how the mean is
 * parameterized.
 */
#ifndef SRNF_PUBLIC_GROUPS_H
#define SRNF_PUBLIC_GROUPS_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/subjects.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* A curve over the number of components: entry k - 1 belongs to the first k of them. */
struct srnf_curve {
    double *value;          /* [components] */
    double *standard_error; /* [components] */
};

struct srnf_quality_options {
    size_t components; /* curves run from 1 to this, at most one less than the members that are left
                          without a subject; 0: all that there are */
    size_t samples;    /* drawn for the specificity, 2 .. 100000; default 1000 */
    uint64_t seed;     /* of the samples; default 0 */
    const size_t *subjects; /* [n] as in srnf/subjects.h; default NULL */
};
struct srnf_quality_options srnf_quality_options_defaults(void);

struct srnf_quality {
    size_t n, components;
    size_t subjects;                          /* whose members the n are */
    struct srnf_curve compactness;            /* share of the variance, 0 .. 1 */
    struct srnf_curve generalisation;         /* surface distance */
    struct srnf_curve specificity;            /* surface distance */
    struct srnf_curve generalisation_elastic; /* the same in the L2 norm of SRNFs */
    struct srnf_curve specificity_elastic;
};
void srnf_quality_clear(struct srnf_quality *quality);

/*
 * How good a linear model of a group is (R. H. Davies, C. J. Twining, T. F. Cootes, J. C.
 * Waterton, C. J. Taylor, "A minimum description length approach to statistical shape modeling",
 * IEEE TMI 21, 2002; M. Styner et al., IPMI 2003):
 *
 *   compactness     share of the total variance in the first k components. Its standard error is
 *                   the first-order one of normal data, where an eigenvalue has the variance
 *                   2 lambda^2 / (S - 1), for S subjects
 *   generalisation  how well a subject is described that the model has not seen: each is left out
 *                   in turn with all its members, mean and components are fitted to the others,
 *                   and the distance between a member and its reconstruction from k scores is
 *                   averaged over members. The registration stays that of all. The standard error
 *                   allows for dependence within subjects: the root of
 *                   S / (S - 1) sum_s (sum of member - average over the members of s)^2 / n^2
 *   specificity     how like the subjects the model's own shapes are: surfaces with normal scores
 *                   in the first k components are drawn, and the distance to the nearest subject is
 *                   averaged over them
 *
 * Every q is inverted to a surface for that, each from the one with a component less.
 *   sht           [in]  degree and grid
 *   mean          [in]  double[3][(L+1)^2] the mean surface
 *   mean_q        [in]  double[3][n_theta][n_phi], the mean of registered_q
 *   registered_q  [in]  double[n][3][n_theta][n_phi], n >= 3
 *   quality       [out] freed with srnf_quality_clear; untouched on error
 * Cost: (n + samples) components inversions, in parallel; n eigenproblems of size n - 1. Memory: 48
 * bytes a node for each member, 48 for each task at work, and n^2.
 * Errors: SRNF_EINVAL (a number out of range, data that are not finite, fewer than three subjects),
 * SRNF_EDEGENERATE (surfaces
 * that do not differ, a mean without area), SRNF_ENOMEM, SRNF_ENUMERIC, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_model_quality(const struct srnf_sht *sht, size_t n, const double *mean,
                                    const double *mean_q, const double *registered_q,
                                    const struct srnf_quality_options *options,
                                    const struct srnf_context *context,
                                    struct srnf_quality *quality, struct srnf_error *error);

struct srnf_compare_options {
    size_t permutations;    /* 1 .. 10,000,000; default 10,000 */
    uint64_t seed;          /* of the permutations; default 0 */
    const size_t *subjects; /* [n] as in srnf/subjects.h; default NULL */
    /* [n][3][(L+1)^2] surfaces whose SRNFs the fields are, or nearly are: theirs are searched from
       these on. NULL, the default: from the mean on, which may be too far from surfaces in other
       poses. */
    const double *const *surfaces;
};
struct srnf_compare_options srnf_compare_options_defaults(void);

struct srnf_comparison {
    size_t n, subjects;                /* members, and whose they are */
    struct srnf_permutation_test test; /* least is that of p_value and of the map */
    bool asymptotic;                   /* covariates: p has its level in large samples only */
    double distance; /* of the groups' means, in the L2 norm of SRNFs, covariates regressed out */
    double distance_interval[2]; /* 95 %; NAN: subjects are too few or equal (intervals.c) */
    double spread[2]; /* root mean square distance of a subject from its group's mean, unbiased */
    double inflation; /* variance of the means' difference with these, over that with one spread for
                         all, which p rests on: above 1 p is too small for the means alone */
    double p_value;   /* of F, that distance over what is left of all others */
    double max_p_value; /* of the largest local statistic: the least of significance */
    /* The map, on the grid: double[n_theta][n_phi]. */
    double *statistic;    /* Hotelling's T^2 */
    double *p;            /* by permutation, of this point alone */
    double *significance; /* corrected for all points by the largest statistic */
    double *fdr;          /* least false discovery rate, by area, at which the point is reported */
    double *effect;       /* length of the mean displacement from group 0 to group 1 */
    double *normal;       /* its part along the outward normal of the mean surface */
};
void srnf_comparison_clear(struct srnf_comparison *comparison);

/*
 * Whether two groups differ, and where: permutation tests of the difference of the group means,
 * covariates regressed out (formulae in core/stats/compare.c). Members of a subject are averaged
 * first, covariates too: subjects are what is compared and exchanged.
 *   mean, registered_q  [in] as for srnf_model_quality, n >= 4
 *   group         [in]  [n] 0 or 1, the same for all members of a subject; two subjects of each
 *   n_covariates  [in]  columns of covariates, may be 0
 *   covariates    [in]  double[n][n_covariates], real numbers of any unit; or NULL
 *   comparison    [out] freed with srnf_comparison_clear; untouched on error
 * Equal seeds give equal results, on any number of threads. Relabellings are different where they
 * give a subject another group or other covariates. Without covariates the test has its level with
 * any number of subjects; with them (asymptotic) only in the limit of many, since their part is
 * estimated from the same data. That holds also where all relabellings were taken.
 * Cost: n inversions, permutations (1 + n_covariates) n 3 P multiply-adds (one dgemm). Memory: 48
 * bytes a node and subject, some megabytes a thread.
 * Errors: SRNF_EINVAL (as above; a subject in both groups; too few subjects for a covariance of the
 * residuals; covariates that depend on one another or determine the group), and as
 * srnf_model_quality.
 */
SRNF_CHECKED int srnf_compare_groups(const struct srnf_sht *sht, size_t n, const double *mean,
                                     const double *registered_q, const int *group,
                                     size_t n_covariates, const double *covariates,
                                     const struct srnf_compare_options *options,
                                     const struct srnf_context *context,
                                     struct srnf_comparison *comparison, struct srnf_error *error);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

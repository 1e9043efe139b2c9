/*
 * regress.h - linear models of shape: how surfaces depend on covariates (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * SRNFs are vectors, so that with a row x_i of a design (the constant and the covariates) for each
 * subject
 *
 *     q_i = B x_i + error,
 *
 * every coefficient, a column of B, is a field, and every prediction B x is inverted to a surface.
 */
#ifndef SRNF_PUBLIC_REGRESS_H
#define SRNF_PUBLIC_REGRESS_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/subjects.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* Two models, one within the other: is the larger one better? The constant is in both. */
struct srnf_nested {
    size_t reduced, tested; /* columns of each; those of tested that follow are left out */
    const double *nuisance; /* [n][reduced], what is in both */
    const double *columns;  /* [n][tested], what the larger one has beside them */
};

struct srnf_regress_design {
    size_t columns;       /* without the constant, which is always there */
    const double *values; /* [n][columns] */
    size_t tests;
    const struct srnf_nested *nested; /* [tests] */
    size_t points;                    /* at which surfaces are predicted */
    const double *at;                 /* [points][columns] */
};

struct srnf_regress_options {
    size_t permutations;           /* 1 .. 10,000,000; default 10,000 */
    size_t bootstraps;             /* 100 .. 100,000; default 1000 */
    uint64_t seed;                 /* of both; default 0 */
    const size_t *subjects;        /* [n] as in srnf/subjects.h; default NULL */
    const double *const *surfaces; /* [n] as in struct srnf_compare_options; default NULL */
};
struct srnf_regress_options srnf_regress_options_defaults(void);

/* A share of the variance, which noise makes larger, with its 95 % interval by bootstrap, which is
   free of that and holds the value; NAN where the model leaves nothing. */
struct srnf_share {
    double value, interval[2];
};

struct srnf_regression_test {
    size_t degrees;         /* of freedom that the test has: columns that do not follow */
    size_t freedom;         /* of the residuals of the larger model */
    double f;               /* (explained / degrees) / (residual / freedom) */
    double p_value;         /* of that */
    struct srnf_share r2;   /* what the tested explain, of the variance of all subjects */
    struct srnf_share part; /* of what the reduced model leaves */
    double max_p_value;     /* of the largest local statistic: the least of significance */
    double least;           /* the smallest p that the test can give */
    double *statistic, *p, *significance, *fdr; /* [P], as in struct srnf_comparison */
    double *diagonal; /* [subjects] of the projection on what is tested: their part in it */
};

struct srnf_predicted_shape {
    double *coefficients;   /* [3][(L+1)^2] the surface */
    double relative_energy; /* what of the SRNF is lost: 0 where the surface exists */
    double leverage;        /* squared standard error over residual variance */
    double *standard_error; /* [P] of the displacement along the mean's normal */
    double *confidence; /* [P] half the width of a 95 % region that holds at all nodes together */
};

struct srnf_regression {
    size_t n, subjects, columns, tests, points;
    size_t freedom;                    /* subjects less the coefficients */
    struct srnf_permutation_test test; /* least is that of each test */
    double variance;                   /* mean squared distance of subjects, with n - 1 */
    double residual_variance;          /* with freedom: squared L2 norm of SRNFs */
    /* 95 %, of both and of norms; NAN: subjects are too few or equal (core/stats/intervals.c) */
    double variance_interval[2], residual_interval[2];
    double *norm_intervals; /* [columns + 1][2] */
    double *coefficients;   /* [columns + 1][3][P] fields, the constant first */
    double *norms;          /* [columns + 1] of them in L2 */
    /* The displacement of the nodes that a unit of each column means: */
    double *effect;         /* [columns][P] its length */
    double *normal;         /* [columns][P] along the outward normal of the mean */
    double *standard_error; /* [columns][P] of normal */
    double *squares, *rest; /* [subjects] of their residuals, and the degrees of freedom of those */
    struct srnf_regression_test *test_of;   /* [tests] */
    struct srnf_predicted_shape *predicted; /* [points] */
};
void srnf_regression_clear(struct srnf_regression *regression);

/*
 * Least squares of SRNFs on a design, with permutation tests of nested models and their maps,
 * shares of the variance, and predicted surfaces (formulae in core/stats/regress.c). Members of a
 * subject are averaged first, and so are their rows of the design.
 *   mean, registered_q  [in] as for srnf_model_quality
 *   regression          [out] freed with srnf_regression_clear; untouched on error
 * Equal seeds give equal results, on any number of threads. Every test is that of D. Freedman and
 * D. Lane (1983), whose level holds in the limit of many subjects; exactly, where the reduced model
 * is the constant.
 * Cost: n inversions; for each test permutations columns n 3 P multiply-adds (dgemm); one inversion
 * for each prediction. Memory: 32 bytes a node and subject, some megabytes a thread.
 * Errors: SRNF_EINVAL (a number out of range, data that are not finite, too few subjects, a column
 * that is constant or follows from those before it: element is its number; a test of columns that
 * follow from the others), SRNF_EDEGENERATE (a mean without area), SRNF_ENOMEM, SRNF_ENUMERIC,
 * SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_regress(const struct srnf_sht *sht, size_t n, const double *mean,
                              const double *registered_q, const struct srnf_regress_design *design,
                              const struct srnf_regress_options *options,
                              const struct srnf_context *context,
                              struct srnf_regression *regression, struct srnf_error *error);

/*
 * How far the subjects of each group are from what a model has for them, and the variance of what a
 * test finds with these spreads over that with one for all, which a p by permutation rests on:
 * above 1 p is too small for the means alone.
 *   group             [in]  [n] below groups
 *   squares, freedom  [in]  [n] of the residuals, and their degrees of freedom
 *   weights           [in]  [n] the part of each in the variance of what is tested
 *   spread            [out] [groups] root mean squares, unbiased
 */
double srnf_spreads(size_t n, size_t groups, const size_t *group, const double *squares,
                    const double *freedom, const double *weights, double *spread);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

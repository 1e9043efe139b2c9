/*
 * covariates.h - what the covariates of a comparison leave of each other and of the groups.
 * (core/stats)
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_COVARIATES_H
#define SRNF_PUBLIC_COVARIATES_H

#include "srnf/base.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum srnf_covariate {
    SRNF_COVARIATE_FREE = 0,
    SRNF_COVARIATE_CONSTANT, /* the same for all members, to ten digits */
    SRNF_COVARIATE_FOLLOWS,  /* a sum of multiples of a constant and those before it */
};

/*
 * Whether each covariate says something that those before it do not: 1e-8 of its length about its
 * mean is left, which rounding does not leave.
 *   values    [in]  double[m][n], m covariates of n members
 *   verdicts  [out] [m]
 * Cost: m^2 n. Errors: SRNF_EINVAL (n is 0), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_covariates_check(size_t m, size_t n, const double *values,
                                       enum srnf_covariate *verdicts);

/*
 * Variance inflation of the difference of two groups by covariates that are regressed out (D.
 * Marquardt 1970): by so much its variance is larger than without them; 1 over it is the tolerance,
 * the part of the group's variance between subjects that constant and covariates do not explain.
 * How far covariates follow each other does not matter. Members are averaged over their subjects.
 *   subjects    [in]  [n] numbers below n; that of a subject is its first member's
 *   group       [in]  [n] 0 or 1, the same for members of one subject
 *   covariates  [in]  double[n][m]
 *   inflation   [out] at least 1; INFINITY where nothing is left of the group
 *   closest     [out] the covariate that is most like the group; 0 where m is
 * Cost: m^2 n. Errors: SRNF_EINVAL (n is 0), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_covariates_inflation(size_t n, const size_t *subjects, const int *group,
                                           size_t m, const double *covariates, double *inflation,
                                           size_t *closest);

enum srnf_column {
    SRNF_COLUMN_OUT = 0,
    SRNF_COLUMN_OF_TERM,
    SRNF_COLUMN_BESIDE,
};

/*
 * Generalized variance inflation of a term of a linear model by columns beside it (J. Fox and G.
 * Monette, "Generalized collinearity diagnostics", 1992): by so much the volume of the squared
 * confidence region of its coefficients is larger than if the others were uncorrelated with it, to
 * the power of 1 over their number; of one column the usual factor. How levels are coded does not
 * matter, nor how far the columns beside follow each other. Members are averaged over their
 * subjects.
 *   subjects   [in]  [n] numbers below n; that of a subject is its first member's
 *   values     [in]  double[n][m], columns without the constant
 *   roles      [in]  [m] of each column; of several of the term that follow from each other those
 *                    that do are left out
 *   inflation  [out] at least 1 but for rounding, 1 of a term without columns; INFINITY where
 *                    nothing is left of a column
 * Cost: m^2 n. Errors: SRNF_EINVAL (n is 0), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_term_inflation(size_t n, const size_t *subjects, size_t m,
                                     const double *values, const enum srnf_column *roles,
                                     double *inflation);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

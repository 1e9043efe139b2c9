/*
 * covariates.h - the covariates of a comparison: read by name, and judged by what they
 * leave of the groups.
 */
#ifndef SRNFD_TOOLKIT_COVARIATES_H
#define SRNFD_TOOLKIT_COVARIATES_H

#include "toolkit/table.h"

#define COVARIATES_INFLATION_WARNED 10.0 /* the usual rule of thumb */

/* Beyond this, products of covariates and their squares are beyond double precision. */
#define COVARIATE_MOST 1e50
#define COVARIATE_TAKEN "numbers from -1e50 to 1e50 are taken"
bool covariate_takes(double value);
/* What to do about one that is this text, for the end of a problem. */
const char *covariate_text_advice(const char *text);

/* Coefficients are of the size of 1 / the spread, and their squares are beyond double precision
   where it is smaller, or larger, than that. */
#define COVARIATE_SPREAD_LEAST 1e-100
#define COVARIATE_SPREAD_MOST 1e100
#define COVARIATE_SPREAD \
    "differences from 1e-100 to 1e100 are taken: give the covariate in another unit"
/* The largest difference from the first. values: [n], n > 0 */
double covariate_spread(size_t n, const double *values);
/* Also no difference at all, which is told otherwise. */
bool covariate_spread_takes(double spread);
/* Where a problem with a covariate, number i, is told: where it was named, or else the cohort. */
void covariate_pointer(const struct process_inputs *inputs, size_t i, char *pointer, size_t size);

/* The input covariates: an array of names, by default none; typed as a json_t *, owned. */
extern const struct input_own covariates_names;

/*
 * The values of covariates, an array of an array of numbers for each; what one lacks is noted as a
 * problem, which says who has none of that name and which names there are. members: as
 * cohort_members gives them.
 */
json_t *covariate_values(struct process_inputs *inputs, const json_t *members, const json_t *names);

/*
 * Notes a problem for each covariate that is the same for all members, or a sum of multiples of a
 * constant and those before it.
 *   names   [in] of the covariates
 *   values  [in] an array of arrays, as covariate_values gives them
 */
void covariates_check(struct process_inputs *inputs, const json_t *names, const json_t *values);

/*
 * Warns (covariates-collinear) where constant and covariates explain nine tenths of the variance of
 * the group or more between subjects: its variance inflation factor is then ten at least.
 *   subjects    [in] [n] numbers below n, the same for members of one subject
 *   group       [in] [n] 0 or 1, the same for members of one subject
 *   covariates  [in] [n][m], m the length of names
 */
void covariates_warn(json_t *warnings, const json_t *names, size_t n, const size_t *subjects,
                     const int *group, const double *covariates);

#endif

/*
 * outliers.h - values of covariates that lie far from all others: codes of what is missing, other
 * units, slips.
 */
#ifndef SRNFD_TOOLKIT_OUTLIERS_H
#define SRNFD_TOOLKIT_OUTLIERS_H

#include "toolkit/process.h"

#define NORMAL_MAD 1.482602218505602 /* standard deviation over median deviation, normal data */

/* Adds the warning covariate-far for each covariate that canonical inputs have of the members of a
   cohort, and of which one is a code for what is missing (toolkit/codes.h), or lies ten standard
   deviations from the median or more; these by the median deviation, so that no value hides itself.
   Numbers that are dates (toolkit/dates.h) have covariate-is-date instead.
   A covariate of which more than half is the same has no such deviation, and is judged by codes
   alone. */
void outliers_warn(struct jobs_run *run, const json_t *inputs, json_t *document);
/* The same of the columns of a formula that are neither products nor levels (toolkit/design.h); and
   column-is-text for each that it takes as levels, though many of its texts are numbers. cohort:
   with subjects and surfaces, and the design. */
void outliers_warn_design(struct jobs_run *run, const json_t *cohort, json_t *document);

/* Column c of a table of rows, or row c of one of columns, into values [n], truth values as 0 and
   1; false where that is not all numbers. */
bool outliers_read(const json_t *table, bool rows, size_t c, size_t n, double *values);

/* Sorts n values; their median, 0 of none. */
double sorted_median(size_t n, double *values);

#endif

/*
 * downdate.h - principal components of a group without one of its subjects, from those of all.
 */
#ifndef SRNF_STATS_DOWNDATE_H
#define SRNF_STATS_DOWNDATE_H

#include "stats.h"

/*
 * What the others say of one subject.
 *   rank    [in]  components of all subjects
 *   values  [in]  [rank] their eigenvalues of the scatter matrix, strictly decreasing, positive
 *   z       [in]  [rank] scores of the subject, none of them 0 (stats_downdate_prepare)
 *   n       [in]  subjects
 *   root    [out] [rank] eigenvalues of the scatter of the others, decreasing; the last is 0 where
 *                 rank is n - 1
 *   score   [out] [rank] the subject's own, without sign, about the mean of the others
 */
void stats_downdate(size_t n, size_t rank, const double *values, const double *z, double *root,
                    double *score);
/* Parts eigenvalues that are equal, and scores from 0, by a few units of rounding. z: [n][rank]. */
void stats_downdate_prepare(size_t n, size_t rank, double *values, double *z);

#endif

/*
 * frameworks.h - the two frameworks side by side: mean, parallel transport and deformation transfer
 * in the space of SRNFs and in the metric that Q pulls back, on the same surfaces (the paper,
 * Table 1).
 */
#ifndef TESTS_FRAMEWORKS_H
#define TESTS_FRAMEWORKS_H

#include "srnf.h"

#define FRAMEWORKS_ROWS ((size_t)4)

struct frameworks_row {
    const char *operation;
    double seconds_srnf, seconds_pullback; /* processor time of one answer, least of the repeats */
    double ratio;                          /* the second divided by the first */
    double distance; /* between the two answers, in L2 of their fields: largest over the answers */
    double size;     /* of what is compared: root of the variance, norm, length; largest too */
    double transforms_srnf, transforms_pullback; /* of one answer; 0 where they are not counted */
    bool converged;                              /* pulled back: every answer */
};

/*
 * Fills the rows: mean of all surfaces (by the graph, and by the steps of the paper), transport of
 * the vector from surface i toward i + 1 to i + 2, transfer of the deformation between the first
 * two to the third, for `answers` of the i in turn.
 *   surfaces  [in] n >= 3 pointers to double[3][(L+1)^2], registered to each other
 *   answers   [in] 1 .. n
 *   repeats   [in] of the timing in the space of SRNFs, which is short; once for the other
 *   rows      [out] FRAMEWORKS_ROWS
 * Ends the program where something fails.
 */
void frameworks_compare(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                        size_t answers, size_t repeats, struct frameworks_row *rows);

#endif

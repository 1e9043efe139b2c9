/*
 * seconds.h - how long the parts of a job take, in seconds of one processor: what the queue
 * is ordered by (toolkit/seconds.c), and what weighs the phases of a job's progress.
 *
 * Measured as the processor time of a daemon with one worker, for jobs of one kind on the
 * subcortical meshes of tests/data, on a machine of 2026 that had much else to do; alone it is two
 * thirds of that. Between the degrees that were measured it goes with powers of the degree. Pairs
 * of ventricles are registered in a third of the time of those, and expected are seven tenths of
 * it. That is right within a factor of three; tests/bench/bench_estimates.sh compares.
 *
 *   degree                              8      15      23      31      63     127
 *   encoding                         0.03    0.04            0.05    0.27     1.8
 *   registration                     0.16    0.17    0.23    0.28    0.8     8 to 15
 *   inversion, from nothing          0.01    0.05    0.2     0.6     2.4    24
 *   2,000 permutations of a Gaussian classifier, 12 subjects of two classes: 0.08
 *   folds of 12 subjects at degree 15: 2 with registration, and 2 by closest points (icp)
 */
#ifndef SRNFD_COMPUTE_SECONDS_H
#define SRNFD_COMPUTE_SECONDS_H

#include <stddef.h>

#include "srnf.h"

/* Of so many meshes, with so many faces together. */
double seconds_of_encodings(double degree, double meshes, double faces);
/* Of one surface to another, one way. */
double seconds_of_registration(double degree);
/* Of two, searched both ways (symmetric) or one. */
double seconds_of_pair(double degree, bool symmetric);
double seconds_of_inversion(double degree);
/* Each of n subjects compared with the others in a fold of its own. */
double seconds_of_folds(enum srnf_metric metric, double n, double degree);
double seconds_of_label_permutations(bool gauss, double n, double classes, double permutations);

/* How many of `count` like things, of so many seconds each, make a task for a worker: a second of
   work, but no more than leaves workers enough tasks to share. At least 1, at most `most`. */
size_t seconds_block(double each, size_t count, size_t most);

#endif

/*
 * seconds.c - powers through what was measured.
 */
#include "compute/seconds.h"

#include <math.h>

#define FACE_SECONDS 20e-6
/* Of a pair: the triangulations are the same at every degree, and sums over coefficients short. */
#define ICP_SECONDS 0.022
#define COEFFICIENT_SECONDS 20e-6
#define FEATURES_MAX 20.0 /* principal components that a classifier chooses among */
#define TASK_SECONDS 1.0
#define TASKS_LEAST ((size_t)64) /* that blocks leave where there are so many things */

double seconds_of_encodings(double degree, double meshes, double faces)
{
    return meshes * (0.02 + 1.8 * pow(degree / 127.0, 2.8)) + FACE_SECONDS * faces;
}

double seconds_of_registration(double degree)
{
    return 0.07 + 0.07 * pow(degree / 31.0, 2.0) + 6.0 * pow(degree / 127.0, 5.0);
}

/* Both ways take 1.3 to 2.0 times as long as one (tests/bench/bench_objectives.c). */
double seconds_of_pair(double degree, bool symmetric)
{
    return (symmetric ? 1.75 : 1.0) * seconds_of_registration(degree);
}

double seconds_of_inversion(double degree)
{
    return 0.5 * pow(degree / 31.0, 2.5);
}

double seconds_of_folds(enum srnf_metric metric, double n, double degree)
{
    if (metric == SRNF_METRIC_SRNF || metric == SRNF_METRIC_SRM) {
        return 1.1 * n * seconds_of_registration(degree);
    }
    return (metric == SRNF_METRIC_ICP ? ICP_SECONDS : COEFFICIENT_SECONDS) * n * (n - 1.0) / 2.0;
}

double seconds_of_label_permutations(bool gauss, double n, double classes, double permutations)
{
    double features = fmin(FEATURES_MAX, n);

    return permutations * (gauss ? 1.4e-9 * n * n * classes * features * features : 1e-9 * n * n);
}

size_t seconds_block(double each, size_t count, size_t most)
{
    size_t shared = count / TASKS_LEAST;

    most = most < shared ? most : shared;
    return (size_t)fmax(1.0, fmin(TASK_SECONDS / each, (double)most));
}

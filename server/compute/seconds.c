/*
 * seconds.c - powers through what was measured.
 */
#include "compute/seconds.h"

#include <math.h>

#define FACE_SECONDS 20e-6
#define FEATURES_MAX 20.0 /* principal components that a classifier chooses among */

double seconds_of_encodings(double degree, double meshes, double faces)
{
    return meshes * (0.02 + 1.8 * pow(degree / 127.0, 2.8)) + FACE_SECONDS * faces;
}

double seconds_of_registration(double degree)
{
    return 0.25 + pow(degree / 31.0, 1.2);
}

double seconds_of_inversion(double degree)
{
    return 0.5 * pow(degree / 31.0, 2.5);
}

double seconds_of_folds(enum srnf_metric metric, double n, double degree)
{
    return metric == SRNF_METRIC_SRNF || metric == SRNF_METRIC_SRM
               ? 1.1 * n * seconds_of_registration(degree)
               : 0.001 * n * n;
}

double seconds_of_label_permutations(bool gauss, double n, double classes, double permutations)
{
    double features = fmin(FEATURES_MAX, n);

    return permutations * (gauss ? 1.4e-9 * n * n * classes * features * features : 1e-9 * n * n);
}

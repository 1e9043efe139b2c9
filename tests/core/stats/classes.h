/*
 * classes.h - comparisons with planted scores, for the tests and benchmarks of classifiers.
 *
 * Scores are normal and the same in every fold, as if nothing had to be fitted; class c is moved by
 * c times a shift along the first feature. Distances are Euclidean in the scores.
 */
#ifndef TESTS_STATS_CLASSES_H
#define TESTS_STATS_CLASSES_H

#include "group.h"

static inline void classes_clear(struct srnf_folds *c)
{
    srnf_folds_clear(c);
}

static inline struct srnf_folds classes_open(size_t n, size_t components, double shift,
                                             const size_t *labels, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    struct srnf_folds c = {.n = n, .components = components};

    c.scores = shapes_doubles(n * n * components);
    c.distances = shapes_doubles(n * n);
    c.spread = shapes_doubles(n);
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < components; k++) {
            c.scores[i * components + k] =
                test_random_normal(&random) + (k == 0 ? shift * (double)labels[i] : 0.0);
        }
    }
    for (size_t i = 0; i < n; i++) {
        if (i > 0) {
            memcpy(c.scores + i * n * components, c.scores, n * components * sizeof(double));
        }
        c.spread[i] = 1.0;
        for (size_t j = 0; j < n; j++) {
            double square = 0.0;

            for (size_t k = 0; k < components; k++) {
                double d = c.scores[i * components + k] - c.scores[j * components + k];

                square += d * d;
            }
            c.distances[i * n + j] = sqrt(square);
        }
    }
    return c;
}

/* first of class 0 and then the others, of class 1. */
static inline void classes_two(size_t n, size_t first, size_t *labels)
{
    for (size_t i = 0; i < n; i++) {
        labels[i] = i >= first;
    }
}

#endif

/*
 * measured.h - both sides of subjects, some measured repeatedly, as fields that are drawn outright:
 * for the tests of paired_measured.c.
 */
#ifndef TESTS_STATS_MEASURED_H
#define TESTS_STATS_MEASURED_H

#include "group.h"
#include "srnf/paired.h"

#define MEASURED_DEGREE 4
#define MEASURED_PATTERNS ((size_t)12) /* fields of which all are made */

struct measured_plan {
    size_t subjects;
    bool unequal;       /* 1 to 3 measurements of each side, or 2 */
    double directional; /* along one pattern */
    double fluctuating; /* standard deviation of a side's difference, along each pattern */
    double error;       /* of a measurement, along each */
    uint64_t seed;
};

struct measured {
    struct group g; /* its sphere alone */
    size_t n, size;
    double *q, *sizes, *patterns;
    size_t *subjects;
    int *side;
    struct srnf_measurements given;
};

static inline size_t measured_times(const struct measured_plan *plan, size_t subject, int side)
{
    return plan->unequal ? 1 + (subject + (size_t)side) % 3 : 2;
}

static inline void measured_fill(struct measured *m, const struct measured_plan *plan)
{
    struct test_random random = test_random_seed(plan->seed);
    double own[MEASURED_PATTERNS];
    double apart[MEASURED_PATTERNS];
    double wrong[MEASURED_PATTERNS];
    size_t at = 0;

    test_random_normals(&random, MEASURED_PATTERNS * m->size, m->patterns);
    for (size_t s = 0; s < plan->subjects; s++) {
        size_t first = at;

        test_random_normals(&random, MEASURED_PATTERNS, own);
        test_random_normals(&random, MEASURED_PATTERNS, apart);
        for (int side = 0; side < 2; side++) {
            for (size_t t = 0; t < measured_times(plan, s, side); t++, at++) {
                m->subjects[at] = first;
                m->side[at] = side;
                m->sizes[at] = 1.0;
                test_random_normals(&random, MEASURED_PATTERNS, wrong);
                for (size_t k = 0; k < MEASURED_PATTERNS; k++) {
                    double half = side ? 0.5 : -0.5;
                    double part = own[k] + half * plan->fluctuating * apart[k] +
                                  plan->error * wrong[k] +
                                  (k == 0 ? half * plan->directional : 0.0);

                    for (size_t p = 0; p < m->size; p++) {
                        m->q[at * m->size + p] += part * m->patterns[k * m->size + p];
                    }
                }
            }
        }
    }
}

static inline void measured_open(struct measured *m, const struct measured_plan *plan)
{
    *m = (struct measured){.n = 0};
    for (size_t s = 0; s < plan->subjects; s++) {
        m->n += measured_times(plan, s, 0) + measured_times(plan, s, 1);
    }
    group_open(&m->g, MEASURED_DEGREE, 0);
    m->size = 3 * m->g.points;
    m->q = shapes_doubles(m->n * m->size);
    m->sizes = shapes_doubles(m->n);
    m->patterns = shapes_doubles(MEASURED_PATTERNS * m->size);
    m->subjects = srnf_alloc(m->n, sizeof *m->subjects);
    m->side = srnf_alloc(m->n, sizeof *m->side);
    assert_true(m->subjects && m->side);
    measured_fill(m, plan);
    m->given = (struct srnf_measurements){m->n, m->q, m->sizes, m->subjects, m->side};
}

static inline void measured_close(struct measured *m)
{
    srnf_free(m->q);
    srnf_free(m->sizes);
    srnf_free(m->patterns);
    srnf_free(m->subjects);
    srnf_free(m->side);
    group_close(&m->g);
}

static inline int measured_test(const struct measured *m, size_t permutations, uint64_t seed,
                                const struct srnf_context *context, struct srnf_asymmetry_test *out)
{
    struct srnf_paired_options options = srnf_paired_options_defaults();

    options.permutations = permutations;
    options.bootstraps = 200;
    options.seed = seed;
    return srnf_test_asymmetry(m->g.sht, &m->given, &options, context, out, NULL);
}

#endif

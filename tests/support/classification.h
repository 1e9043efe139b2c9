/*
 * classification.h - the table of classifiers (the paper, Table 2) as the benchmark and the report
 * share it: its methods, planted cohorts whose difference is known, and what shuffled labels give.
 *
 * Functions return the status of the core's function that failed, or SRNF_OK.
 */
#ifndef TESTS_CLASSIFICATION_H
#define TESTS_CLASSIFICATION_H

#include "srnf.h"

#define CLASSIFICATION_METHODS ((size_t)7)
#define CLASSIFICATION_METRICS ((size_t)5)

struct classification_method {
    const char *name;
    enum srnf_metric metric;
    bool gauss;
};
/* srnf-gauss first. */
extern const struct classification_method classification_methods[CLASSIFICATION_METHODS];

/* srnf_classify_gauss or srnf_classify_nearest, for two classes. */
SRNF_CHECKED int classification_run(size_t method, const struct srnf_folds *comparison,
                                    const size_t *labels,
                                    const struct srnf_classify_options *options,
                                    const struct srnf_context *context,
                                    struct srnf_classification *result, struct srnf_error *error);

/* What the folds of a Gaussian classifier chose. */
struct classification_choice {
    size_t least, most; /* components */
    size_t pooled;      /* folds with one covariance for both classes */
};
/* All 0 for a nearest neighbour. */
struct classification_choice classification_choice_of(const struct srnf_classification *result);

/* ---- Shuffled labels ------------------------------------------------------------------------- */

#define CLASSIFICATION_SHUFFLES ((size_t)100)

struct classification_chance {
    double mean, half; /* mean accuracy over the shuffles, and half its 95 % interval */
    bool at_chance;
};
/* The labels shuffled by seed; out [n]. */
void classification_shuffle(uint64_t seed, size_t n, const size_t *labels, size_t *out);
/* The interval takes the seeds as independent and their spread as it is found. Chance is
   (n_c - 1) / (n - 1) for a nearest neighbour among n_c equally many of two classes. It is left
   where the mean lies outside what one of seven methods at chance would leave in 5 of 100 runs. */
SRNF_CHECKED int classification_chance(size_t method, const struct srnf_folds *comparison,
                                       const size_t *labels, const struct srnf_context *context,
                                       struct classification_chance *chance,
                                       struct srnf_error *error);

/* ---- Planted cohorts ------------------------------------------------------------------------- */

#define CLASSIFICATION_PLANTED_A ((size_t)19)
#define CLASSIFICATION_PLANTED_B ((size_t)15)
#define CLASSIFICATION_PLANTED (CLASSIFICATION_PLANTED_A + CLASSIFICATION_PLANTED_B)
#define CLASSIFICATION_PLANTED_DEGREE ((size_t)8)

struct classification_cohort {
    struct srnf_sht *sht;
    double *surfaces[CLASSIFICATION_PLANTED];
    size_t labels[CLASSIFICATION_PLANTED];
};

/* Stars about one centre: 0.8 of one star and 0.2 of one of their own, scaled to unit area. Those
   of the second class are then moved toward another star by the part `effect`, 0 .. 1. Ends the
   program when memory is short. */
void classification_plant(struct classification_cohort *cohort, double effect);
void classification_clear(struct classification_cohort *cohort);

/* How planted cohorts are registered: in their common pose, warps of degree 6. */
struct srnf_folds_options classification_planted_options(void);

SRNF_CHECKED int classification_compare(const struct classification_cohort *cohort,
                                        enum srnf_metric metric, const struct srnf_context *context,
                                        struct srnf_folds *comparison, struct srnf_error *error);

/* p-values, each of 99 permutations, of `count` labellings of a cohort that mean nothing. */
SRNF_CHECKED int classification_null(size_t method, const struct srnf_folds *comparison,
                                     const size_t *labels, size_t count,
                                     const struct srnf_context *context, double *p_values,
                                     struct srnf_error *error);

#endif

/*
 * classification.c - methods, shuffled labels and planted cohorts of the table of classifiers.
 */
#include "support/classification.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "support/compare.h"
#include "support/shapes.h"

#define SPREAD 0.2 /* of planted cohorts: a member's own part */
#define CENTRE 1000
#define TOWARD 777
/* Of Student's distribution with 99 degrees of freedom: 95 %, and .05 of seven methods. */
#define T_99 1.984
#define T_99_OF_SEVEN 2.747
#define NULL_PERMUTATIONS ((size_t)99)

const struct classification_method classification_methods[CLASSIFICATION_METHODS] = {
    {"srnf-gauss", SRNF_METRIC_SRNF, true},       {"srnf-nn", SRNF_METRIC_SRNF, false},
    {"srm-gauss", SRNF_METRIC_SRM, true},         {"srm-nn", SRNF_METRIC_SRM, false},
    {"harmonic-nn", SRNF_METRIC_HARMONIC, false}, {"icp-nn", SRNF_METRIC_ICP, false},
    {"spharm-pdm", SRNF_METRIC_SPHARM, false},
};

int classification_run(size_t method, const struct srnf_folds *comparison, const size_t *labels,
                       const struct srnf_classify_options *options,
                       const struct srnf_context *context, struct srnf_classification *result,
                       struct srnf_error *error)
{
    return (classification_methods[method].gauss ? srnf_classify_gauss : srnf_classify_nearest)(
        comparison, labels, 2, options, context, result, error);
}

struct classification_choice classification_choice_of(const struct srnf_classification *result)
{
    struct classification_choice choice = {0, 0, 0};

    for (size_t i = 0; result->components && i < result->n; i++) {
        size_t k = result->components[i];

        choice.least = i == 0 || k < choice.least ? k : choice.least;
        choice.most = k > choice.most ? k : choice.most;
        choice.pooled += result->pooled[i];
    }
    return choice;
}

/* ---- Shuffled labels ------------------------------------------------------------------------- */

void classification_shuffle(uint64_t seed, size_t n, const size_t *labels, size_t *out)
{
    size_t *permutation = srnf_alloc(n, sizeof *permutation);

    if (!permutation) {
        (void)fprintf(stderr, "classification: out of memory\n");
        exit(2);
    }
    srnf_permutation(seed, 0, n, permutation);
    for (size_t i = 0; i < n; i++) {
        out[i] = labels[permutation[i]];
    }
    srnf_free(permutation);
}

int classification_chance(size_t method, const struct srnf_folds *comparison, const size_t *labels,
                          const struct srnf_context *context, struct classification_chance *chance,
                          struct srnf_error *error)
{
    const double count = (double)CLASSIFICATION_SHUFFLES;
    struct srnf_classify_options options = srnf_classify_options_defaults();
    size_t *shuffled = srnf_alloc(comparison->n, sizeof *shuffled);
    double sum = 0.0;
    double square = 0.0;
    double error_of_mean;
    int status = shuffled ? SRNF_OK : SRNF_ENOMEM;

    options.relabellings = 0; /* they are for the interval of the accuracy, which is not asked */
    for (size_t seed = 0; seed < CLASSIFICATION_SHUFFLES && status >= 0; seed++) {
        struct srnf_classification r;

        classification_shuffle(1000 + seed, comparison->n, labels, shuffled);
        status = classification_run(method, comparison, shuffled, &options, context, &r, error);
        if (status >= 0) {
            sum += r.accuracy / count;
            square += r.accuracy * r.accuracy / count;
            srnf_classification_clear(&r);
        }
    }
    error_of_mean = sqrt(compare_max(0.0, square - sum * sum) / (count - 1.0));
    chance->mean = sum;
    chance->half = T_99 * error_of_mean;
    chance->at_chance =
        fabs(sum - 0.5) <= T_99_OF_SEVEN * error_of_mean + 0.5 / (double)(comparison->n - 1);
    srnf_free(shuffled);
    return status;
}

/* ---- Planted cohorts ------------------------------------------------------------------------- */

void classification_plant(struct classification_cohort *cohort, double effect)
{
    struct shapes_surface base;
    struct shapes_surface own;
    struct shapes_surface other;

    shapes_open(&base, CLASSIFICATION_PLANTED_DEGREE);
    shapes_open(&own, CLASSIFICATION_PLANTED_DEGREE);
    shapes_open(&other, CLASSIFICATION_PLANTED_DEGREE);
    shapes_fill_random_star(&base, CENTRE, NULL);
    shapes_fill_random_star(&other, TOWARD, NULL);
    for (size_t i = 0; i < CLASSIFICATION_PLANTED; i++) {
        struct srnf_surface_measures measures;
        double *f = shapes_doubles(own.count);
        double part = i >= CLASSIFICATION_PLANTED_A ? effect : 0.0;

        shapes_fill_random_star(&own, i + 1, NULL);
        for (size_t k = 0; k < own.count; k++) {
            f[k] = (1.0 - SPREAD) * base.f[k] + SPREAD * own.f[k];
        }
        srnf_surface_measure(own.sht, f, &measures, own.workspace);
        for (size_t k = 0; k < own.count; k++) {
            f[k] = (1.0 - part) * f[k] / sqrt(measures.area) + part * other.f[k];
        }
        cohort->surfaces[i] = f;
        cohort->labels[i] = i >= CLASSIFICATION_PLANTED_A;
    }
    cohort->sht = base.sht;
    base.sht = NULL; /* kept by the cohort */
    shapes_close(&other);
    shapes_close(&own);
    shapes_close(&base);
}

void classification_clear(struct classification_cohort *cohort)
{
    for (size_t i = 0; i < CLASSIFICATION_PLANTED; i++) {
        srnf_free(cohort->surfaces[i]);
    }
    srnf_sht_destroy(cohort->sht);
}

struct srnf_folds_options classification_planted_options(void)
{
    struct srnf_folds_options options = srnf_folds_options_defaults();

    options.registration.common_pose = true;
    options.registration.degree = 6;
    return options;
}

int classification_compare(const struct classification_cohort *cohort, enum srnf_metric metric,
                           const struct srnf_context *context, struct srnf_folds *comparison,
                           struct srnf_error *error)
{
    struct srnf_folds_options options = classification_planted_options();

    return srnf_folds_compare(cohort->sht, metric, CLASSIFICATION_PLANTED,
                              (const double *const *)cohort->surfaces, &options, context,
                              comparison, error);
}

int classification_null(size_t method, const struct srnf_folds *comparison, const size_t *labels,
                        size_t count, const struct srnf_context *context, double *p_values,
                        struct srnf_error *error)
{
    size_t *shuffled = srnf_alloc(comparison->n, sizeof *shuffled);
    int status = shuffled ? SRNF_OK : SRNF_ENOMEM;

    for (size_t s = 0; s < count && status >= 0; s++) {
        struct srnf_classify_options options = srnf_classify_options_defaults();
        struct srnf_classification r;

        options.permutations = NULL_PERMUTATIONS;
        options.seed = s;
        classification_shuffle(5000 + s, comparison->n, labels, shuffled);
        status = classification_run(method, comparison, shuffled, &options, context, &r, error);
        if (status >= 0) {
            p_values[s] = r.p_value;
            srnf_classification_clear(&r);
        }
    }
    srnf_free(shuffled);
    return status;
}

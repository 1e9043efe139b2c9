/*
 * bench_classify.c - classification with leave-one-out validation (the paper, Table 2): every
 * method on a hundred real left ventricles, 50 asymptomatic and 50 after infarction, by shape alone
 * and by shape with size; the same under shuffled labels; what refitting the registrations inside
 * the folds changes; and planted cohorts of 19 and 15 whose difference grows.
 *
 *   bench_classify [N [METRIC [ROUTE]]]
 *
 * N ventricles, 12 to 100, as many of either group; default 100; of the methods only those of srnf,
 * srm, harmonic, icp or spharm, or all; encoded by the route area, or star.
 *
 * Degree 15, registration by default options. Times are elapsed, on two threads.
 *
 * Exit status: 0 if, with all hundred, srnf-gauss by shape alone reaches REQUIRED with components
 * chosen inside the folds, and every method is at chance under shuffled labels; 1 otherwise.
 * Without the data only the planted cohorts are run.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <fftw3.h>

#include "bench/ventricles.h"
#include "support/classification.h"

#define DEGREE 15
#define ALL ((size_t)100)
#define REQUIRED 0.78
#define PERMUTATIONS ((size_t)199)
#define NULLS ((size_t)40) /* labellings without an effect */
#define METHODS CLASSIFICATION_METHODS
#define METRICS CLASSIFICATION_METRICS

static void give_up(const char *what, const struct srnf_error *error)
{
    (void)fprintf(stderr, "bench_classify: %s: %s\n", what, error->message);
    exit(2);
}

static void classify(size_t method, const struct srnf_folds *comparison, const size_t *labels,
                     const struct srnf_classify_options *options,
                     const struct srnf_context *context, struct srnf_classification *result)
{
    struct srnf_error error = {0};

    if (classification_run(method, comparison, labels, options, context, result, &error)) {
        give_up(classification_methods[method].name, &error);
    }
}

static void compare(const struct group *g, enum srnf_metric metric,
                    const struct srnf_folds_options *options, const struct srnf_context *context,
                    struct srnf_folds *out)
{
    struct srnf_error error = {0};

    if (srnf_folds_compare(g->sht, metric, g->n, g->surfaces, options, context, out, &error)) {
        give_up(srnf_metric_name(metric), &error);
    }
}

/* ---- Table 2 --------------------------------------------------------------------------------- */

static double print_row(size_t method, const struct group *g, const struct srnf_folds *comparison,
                        const size_t *labels, const struct srnf_context *context)
{
    double shape = 0.0;

    printf("%-12s", classification_methods[method].name);
    for (size_t with_size = 0; with_size < 2; with_size++) {
        struct srnf_classify_options options = srnf_classify_options_defaults();
        struct srnf_classification r;

        options.log_scale = with_size ? g->log_scale : NULL;
        options.permutations = PERMUTATIONS;
        options.seed = 1;
        classify(method, comparison, labels, &options, context, &r);
        printf("  %.2f [%.2f, %.2f] p %.3f", r.accuracy, r.interval[0], r.interval[1], r.p_value);
        if (r.components) {
            struct classification_choice choice = classification_choice_of(&r);

            printf(" k %2zu..%2zu pooled %3zu", choice.least, choice.most, choice.pooled);
        } else {
            printf("%21s", "");
        }
        shape = with_size ? shape : r.accuracy;
        srnf_classification_clear(&r);
    }
    printf("\n");
    return shape;
}

/* Mean accuracy over shuffled labels; true where it is at chance. */
static bool print_chance(size_t method, const struct srnf_folds *comparison, const size_t *labels,
                         const struct srnf_context *context)
{
    struct classification_chance chance;
    struct srnf_error error = {0};

    if (classification_chance(method, comparison, labels, context, &chance, &error)) {
        give_up(classification_methods[method].name, &error);
    }
    printf("%-12s  %.3f +- %.3f%s\n", classification_methods[method].name, chance.mean, chance.half,
           chance.at_chance ? "" : "  - NOT AT CHANCE");
    return chance.at_chance;
}

static bool is_wanted(enum srnf_metric metric, const char *only)
{
    return !only || strcmp(only, "all") == 0 || strcmp(only, srnf_metric_name(metric)) == 0;
}

static bool table(size_t n, const char *only, enum srnf_parameterization route)
{
    struct group g;
    struct group_watch watch;
    struct srnf_context context = group_context(&watch, 2);
    struct srnf_folds comparisons[METRICS] = {{0}};
    size_t labels[GROUP_MAX];
    bool met = true;

    if (!ventricles_open(&g, DEGREE, n, route)) {
        return true;
    }
    for (size_t i = 0; i < n; i++) {
        labels[i] = i % 2; /* names are taken in turn from both groups */
    }
    printf("%zu left ventricles, degree %d\n\n", n, DEGREE);
    for (size_t m = 0; m < METRICS; m++) {
        double start = timing_monotonic();

        if (is_wanted((enum srnf_metric)m, only)) {
            compare(&g, (enum srnf_metric)m, NULL, &context, &comparisons[m]);
            printf("%-9s compared in %7.1f s\n", srnf_metric_name((enum srnf_metric)m),
                   timing_monotonic() - start);
            (void)fflush(stdout);
        }
    }
    printf("\n%-12s  %-48s  %s\n", "", "shape", "shape and size");
    for (size_t m = 0; m < METHODS; m++) {
        double accuracy;

        if (!is_wanted(classification_methods[m].metric, only)) {
            continue;
        }
        accuracy =
            print_row(m, &g, &comparisons[classification_methods[m].metric], labels, &context);
        if (m == 0 && n == ALL && accuracy < REQUIRED) {
            printf("srnf-gauss: required %.2f - NOT MET\n", REQUIRED);
            met = false;
        }
    }
    printf("\nmean accuracy over %zu shuffled labellings, 95 %% interval\n",
           CLASSIFICATION_SHUFFLES);
    for (size_t m = 0; m < METHODS; m++) {
        if (is_wanted(classification_methods[m].metric, only)) {
            met =
                print_chance(m, &comparisons[classification_methods[m].metric], labels, &context) &&
                met;
        }
    }
    for (size_t m = 0; m < METRICS; m++) {
        srnf_folds_clear(&comparisons[m]);
    }
    group_close(&g);
    return met;
}

/* ---- Planted cohorts ------------------------------------------------------------------------- */

static void compare_planted(const struct classification_cohort *cohort, size_t method,
                            const struct srnf_context *context, struct srnf_folds *out)
{
    struct srnf_error error = {0};

    if (classification_compare(cohort, classification_methods[method].metric, context, out,
                               &error)) {
        give_up(classification_methods[method].name, &error);
    }
}

static void planted(void)
{
    static const double effects[] = {0.0, 0.02, 0.04, 0.08, 0.16};
    static const size_t shown[] = {0, 1, 4, 6}; /* methods */
    struct group_watch watch;
    struct srnf_context context = group_context(&watch, 2);

    printf("\nplanted cohorts of %zu and %zu: accuracy (p) as the effect grows\n\neffect",
           CLASSIFICATION_PLANTED_A, CLASSIFICATION_PLANTED_B);
    for (size_t k = 0; k < sizeof shown / sizeof shown[0]; k++) {
        printf("  %-12s", classification_methods[shown[k]].name);
    }
    printf("\n");
    for (size_t e = 0; e < sizeof effects / sizeof effects[0]; e++) {
        struct classification_cohort cohort;

        classification_plant(&cohort, effects[e]);
        printf("%6.2f", effects[e]);
        for (size_t k = 0; k < sizeof shown / sizeof shown[0]; k++) {
            struct srnf_classify_options classifier = srnf_classify_options_defaults();
            struct srnf_folds comparison;
            struct srnf_classification r;

            classifier.permutations = PERMUTATIONS;
            compare_planted(&cohort, shown[k], &context, &comparison);
            classify(shown[k], &comparison, cohort.labels, &classifier, &context, &r);
            printf("  %.2f (%.3f)", r.accuracy, r.p_value);
            srnf_classification_clear(&r);
            srnf_folds_clear(&comparison);
        }
        printf("\n");
        (void)fflush(stdout);
        classification_clear(&cohort);
    }
}

/* p-values under labels that mean nothing: how many lie below each level. */
static void nulls(void)
{
    static const size_t shown[] = {0, 1, 4};
    static const double levels[] = {0.1, 0.25, 0.5, 0.75};
    struct classification_cohort cohort;
    struct group_watch watch;
    struct srnf_context context = group_context(&watch, 2);

    classification_plant(&cohort, 0.0);
    printf("\np-values of %zu labellings without effect: share at or below .1, .25, .5, .75\n",
           NULLS);
    for (size_t k = 0; k < sizeof shown / sizeof shown[0]; k++) {
        struct srnf_error error = {0};
        struct srnf_folds comparison;
        double p[NULLS];

        compare_planted(&cohort, shown[k], &context, &comparison);
        if (classification_null(shown[k], &comparison, cohort.labels, NULLS, &context, p, &error)) {
            give_up(classification_methods[shown[k]].name, &error);
        }
        printf("%-12s", classification_methods[shown[k]].name);
        for (size_t l = 0; l < sizeof levels / sizeof levels[0]; l++) {
            size_t below = 0;

            for (size_t s = 0; s < NULLS; s++) {
                below += p[s] <= levels[l];
            }
            printf("  %.2f", (double)below / (double)NULLS);
        }
        printf("\n");
        srnf_folds_clear(&comparison);
    }
    classification_clear(&cohort);
}

int main(int argc, char **argv)
{
    size_t n = argc > 1 ? strtoul(argv[1], NULL, 10) : ALL;
    double start = timing_monotonic();
    bool met;

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    met = table(n < 12    ? 12
                : n > ALL ? ALL
                          : n / 2 * 2,
                argc > 2 ? argv[2] : NULL,
                argc > 3 && strcmp(argv[3], "star") == 0 ? SRNF_PARAMETERIZATION_STAR
                                                         : SRNF_PARAMETERIZATION_AREA);
    if (argc < 3) {
        planted();
        nulls();
    }
    printf("\n%.0f s in all\n", timing_monotonic() - start);
    return met ? EXIT_SUCCESS : EXIT_FAILURE;
}

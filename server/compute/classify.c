/*
 * classify.c - one comparison after the other, each followed by the classifiers that read
 * it. Only one comparison is in memory at a time.
 *
 * What the comparisons register is kept for a later attempt. The classifiers are not: they are
 * computed again from it.
 *
 * The progress of a job goes through its stages, comparisons and permutations, each with the part
 * of the whole that it is expected to take (seconds.h).
 */
#include "compute/classify.h"

#include "compute/seconds.h"

#include <math.h>

const struct compute_classify_method compute_classify_methods[] = {
    {"srnf-gauss", SRNF_METRIC_SRNF, true},       {"srnf-nn", SRNF_METRIC_SRNF, false},
    {"srm-gauss", SRNF_METRIC_SRM, true},         {"srm-nn", SRNF_METRIC_SRM, false},
    {"harmonic-nn", SRNF_METRIC_HARMONIC, false}, {"icp-nn", SRNF_METRIC_ICP, false},
    {"spharm-pdm", SRNF_METRIC_SPHARM, false},    {NULL, SRNF_METRIC_SRNF, false},
};
_Static_assert(sizeof compute_classify_methods / sizeof compute_classify_methods[0] ==
                   COMPUTE_CLASSIFY_METHODS + 1,
               "the table has as many methods as its header says");
#define METRICS (SRNF_METRIC_SPHARM + 1)

/* A part of the run's progress; all else is handed on. */
struct stage {
    const struct srnf_context *inner;
    double from, to;  /* of the whole, 0 .. 1 */
    double done, all; /* seconds that are expected of what is over, and of everything */
};

static void stage_progress(void *user, double fraction, const char *message)
{
    const struct stage *stage = user;

    stage->inner->progress(stage->inner->user, stage->from + fraction * (stage->to - stage->from),
                           message);
}

static bool stage_canceled(void *user)
{
    const struct stage *stage = user;

    return stage->inner->canceled(stage->inner->user);
}

static void stage_parallel_for(void *user, size_t count, void (*body)(void *, size_t),
                               void *argument)
{
    const struct stage *stage = user;

    stage->inner->parallel_for(stage->inner->user, count, body, argument);
}

static bool stage_recall(void *user, uint64_t series, uint64_t index, size_t count, double *values)
{
    const struct stage *stage = user;

    return stage->inner->recall(stage->inner->user, series, index, count, values);
}

static void stage_keep(void *user, uint64_t series, uint64_t index, size_t count,
                       const double *values)
{
    const struct stage *stage = user;

    stage->inner->keep(stage->inner->user, series, index, count, values);
}

/* The next stage begins, of so many seconds. */
static struct srnf_context enter(struct stage *stage, double seconds)
{
    struct srnf_context context = *stage->inner;

    stage->from = stage->done / stage->all;
    stage->done += seconds;
    stage->to = stage->done / stage->all;
    context.user = stage;
    context.progress = stage_progress;
    context.canceled = stage_canceled;
    context.parallel_for = stage_parallel_for;
    context.seconds = NULL;
    context.recall = stage->inner->recall ? stage_recall : NULL;
    context.keep = stage->inner->keep ? stage_keep : NULL;
    return context;
}

static double seconds_of_comparison(const struct compute_classify_inputs *inputs,
                                    enum srnf_metric metric)
{
    return seconds_of_folds(metric, (double)inputs->group->n, (double)inputs->group->degree);
}

static double seconds_of_method(const struct compute_classify_inputs *inputs, bool gauss)
{
    return seconds_of_label_permutations(gauss, (double)inputs->group->n, (double)inputs->n_classes,
                                         (double)inputs->classifier.permutations);
}

static bool is_wanted(const struct compute_classify_inputs *inputs, enum srnf_metric metric)
{
    for (size_t m = 0; m < inputs->n_methods; m++) {
        if (inputs->methods[m]->metric == metric) {
            return true;
        }
    }
    return false;
}

static double seconds_of_all(const struct compute_classify_inputs *inputs)
{
    double seconds = 0.0;

    for (size_t i = 0; i < METRICS; i++) {
        seconds += is_wanted(inputs, (enum srnf_metric)i)
                       ? seconds_of_comparison(inputs, (enum srnf_metric)i)
                       : 0.0;
    }
    for (size_t m = 0; m < inputs->n_methods; m++) {
        seconds += seconds_of_method(inputs, inputs->methods[m]->gauss);
    }
    return seconds;
}

/* The classifiers of one metric. */
static int classify_all(struct stage *stage, const struct compute_classify_inputs *inputs,
                        enum srnf_metric metric, const struct srnf_folds *comparison,
                        const struct srnf_classify_options *options,
                        struct srnf_classification *results,
                        struct srnf_folds_typicality *typicality, struct jobs_result *result)
{
    struct srnf_error error = {0};
    int status = 0;

    for (size_t m = 0; m < inputs->n_methods && status == 0; m++) {
        const struct compute_classify_method *method = inputs->methods[m];

        if (method->metric == metric) {
            struct srnf_context context = enter(stage, seconds_of_method(inputs, method->gauss));

            status = (method->gauss ? srnf_classify_gauss : srnf_classify_nearest)(
                comparison, inputs->labels, inputs->n_classes, options, &context, &results[m],
                &error);
            if (status) {
                (void)compute_fail(result, status, &error, method->name);
                break;
            }
            status = srnf_folds_typicality(comparison, SRNF_TYPICAL_ALPHA_GROUP, &typicality[m]);
            if (status) {
                (void)compute_fail(result, status, NULL, "comparing members with each other");
            }
        }
    }
    return status;
}

/* The distance of two members is the lesser of those in the folds that leave one of them out. */
static void keep_pairs(const struct srnf_folds *comparison, double *pairs)
{
    size_t n = comparison->n;

    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            pairs[i * n + j] =
                fmin(comparison->distances[i * n + j], comparison->distances[j * n + i]);
        }
    }
}

static int compare_all(struct jobs_run *run, const struct compute_classify_inputs *inputs,
                       const struct srnf_sht *sht, const struct srnf_classify_options *options,
                       struct srnf_classification *results,
                       struct srnf_folds_typicality *typicality, struct jobs_result *result)
{
    struct stage stage = {.inner = jobs_run_context(run), .all = seconds_of_all(inputs)};
    bool kept = false;
    int status = 0;

    for (size_t i = 0; i < METRICS && status == 0; i++) {
        enum srnf_metric metric = (enum srnf_metric)i;
        struct srnf_context context;
        struct srnf_folds comparison;
        struct srnf_error error = {0};

        if (!is_wanted(inputs, metric)) {
            continue;
        }
        context = enter(&stage, seconds_of_comparison(inputs, metric));
        status = srnf_folds_compare(sht, metric, inputs->group->n, inputs->group->surfaces,
                                    &inputs->comparison, &context, &comparison, &error);
        if (status) {
            (void)compute_fail(result, status, &error, "comparing the surfaces");
        } else {
            if (inputs->pairs && !kept) {
                keep_pairs(&comparison, inputs->pairs);
                kept = true;
            }
            status = classify_all(&stage, inputs, metric, &comparison, options, results, typicality,
                                  result);
            srnf_folds_clear(&comparison);
        }
    }
    return status;
}

/* log of the size of each surface: its own, times what multiplies it back. */
static int measure_sizes(const struct compute_classify_inputs *inputs, const struct srnf_sht *sht,
                         double *log_scale, struct jobs_result *result)
{
    size_t count = 3 * srnf_coefficient_count(inputs->group->degree);
    double *normalized = srnf_alloc(count, sizeof(double));
    int status = normalized ? 0 : SRNF_ENOMEM;

    for (size_t i = 0; i < inputs->group->n && status == 0; i++) {
        status = srnf_normalize(sht, inputs->group->surfaces[i], normalized, &log_scale[i]);
        log_scale[i] += log(inputs->scales[i]);
    }
    srnf_free(normalized);
    return status ? compute_fail(result, status, NULL, "measuring the surfaces") : 0;
}

int compute_classify(struct jobs_run *run, const struct compute_classify_inputs *inputs,
                     struct srnf_classification *results, struct srnf_folds_typicality *typicality,
                     struct jobs_result *result)
{
    struct jobs *jobs = jobs_run_jobs(run);
    struct srnf_classify_options options = inputs->classifier;
    const struct srnf_sht *sht = NULL;
    double *log_scale = srnf_alloc(inputs->group->n, sizeof(double));
    int status = log_scale ? jobs_transform_acquire(jobs, inputs->group->degree,
                                                    SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht)
                           : SRNF_ENOMEM;

    for (size_t m = 0; m < inputs->n_methods; m++) {
        results[m] = (struct srnf_classification){0};
        typicality[m] = (struct srnf_folds_typicality){0};
    }
    if (status) {
        srnf_free(log_scale);
        return compute_fail(result, status, NULL, "preparing the classification");
    }
    jobs_run_keep_parts(run);
    if (inputs->scales) {
        status = measure_sizes(inputs, sht, log_scale, result);
        options.log_scale = log_scale;
    }
    status = status ? status : compare_all(run, inputs, sht, &options, results, typicality, result);
    jobs_transform_release(jobs, sht);
    srnf_free(log_scale);
    return status;
}

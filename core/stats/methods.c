/*
 * methods.c - one comparison after the other, each followed by the classifiers that read it.
 *
 * What the comparisons register is kept for a later attempt (srnf_context.keep). The classifiers
 * are not: they are computed again from it.
 */
#include "stats.h"

#include <math.h>

#define METRICS (SRNF_METRIC_SPHARM + 1)

/* ---- Comparisons and classifiers ------------------------------------------------------------- */

/* The first method by a metric, or NULL. */
static const struct srnf_method *method_by(const struct srnf_methods_inputs *inputs,
                                           enum srnf_metric metric)
{
    for (size_t m = 0; m < inputs->n_methods; m++) {
        if (inputs->methods[m].metric == metric) {
            return &inputs->methods[m];
        }
    }
    return NULL;
}

static double cost_of_all(const struct srnf_methods_inputs *inputs)
{
    double cost = 0.0;

    for (size_t i = 0; i < METRICS; i++) {
        const struct srnf_method *method = method_by(inputs, (enum srnf_metric)i);

        cost += method ? method->comparison_cost : 0.0;
    }
    for (size_t m = 0; m < inputs->n_methods; m++) {
        cost += inputs->methods[m].classifier_cost;
    }
    return cost;
}

/* The classifiers of one metric. */
static int classify(struct stats_part *part, const struct srnf_methods_inputs *inputs,
                    enum srnf_metric metric, const struct srnf_folds *comparison,
                    const struct srnf_classify_options *options,
                    struct srnf_classification *results, struct srnf_folds_typicality *typicality,
                    const char **step, struct srnf_error *error)
{
    int status = SRNF_OK;

    for (size_t m = 0; m < inputs->n_methods && status == SRNF_OK; m++) {
        const struct srnf_method *method = &inputs->methods[m];
        struct srnf_context context;

        if (method->metric != metric) {
            continue;
        }
        *step = method->name;
        context = stats_part_enter(part, method->classifier_cost);
        status = (method->gauss ? srnf_classify_gauss : srnf_classify_nearest)(
            comparison, inputs->labels, inputs->n_classes, options, &context, &results[m], error);
        if (status == SRNF_OK) {
            *step = "comparing members with each other";
            status = srnf_folds_typicality(comparison, inputs->alpha, &typicality[m]);
            if (status) {
                (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
            }
        }
    }
    return status;
}

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

/* log of the size of each surface: its own, times what multiplies it back. */
static int measure_sizes(const struct srnf_sht *sht, const struct srnf_methods_inputs *inputs,
                         double *log_scale, struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    double *normalized = srnf_alloc(count, sizeof(double));
    int status = normalized ? SRNF_OK : SRNF_ENOMEM;

    for (size_t i = 0; i < inputs->n && status == SRNF_OK; i++) {
        if (!(inputs->scales[i] > 0.0) || !isfinite(inputs->scales[i])) {
            status = SRNF_EINVAL;
            break;
        }
        status = srnf_normalize(sht, inputs->surfaces[i], normalized, &log_scale[i]);
        log_scale[i] += log(inputs->scales[i]);
    }
    srnf_free(normalized);
    return status
               ? srnf_fail(error, status, -1, "%s",
                           status == SRNF_EINVAL ? "a scale is not above 0" : srnf_strerror(status))
               : SRNF_OK;
}

int srnf_classify_by_methods(const struct srnf_sht *sht, const struct srnf_methods_inputs *inputs,
                             const struct srnf_context *context,
                             struct srnf_classification *results,
                             struct srnf_folds_typicality *typicality, double *pairs,
                             const char **step, struct srnf_error *error)
{
    struct srnf_classify_options options = inputs->classifier;
    struct stats_part part = {.whole = context, .all = cost_of_all(inputs)};
    double *log_scale = inputs->scales ? srnf_alloc(inputs->n, sizeof(double)) : NULL;
    int status = SRNF_OK;

    for (size_t m = 0; m < inputs->n_methods; m++) {
        results[m] = (struct srnf_classification){0};
        typicality[m] = (struct srnf_folds_typicality){0};
    }
    options.log_scale = log_scale;
    *step = "measuring the surfaces";
    if (inputs->scales) {
        status = log_scale ? measure_sizes(sht, inputs, log_scale, error)
                           : srnf_fail(error, SRNF_ENOMEM, -1, "%s", srnf_strerror(SRNF_ENOMEM));
    }
    for (size_t i = 0; i < METRICS && status == SRNF_OK; i++) {
        enum srnf_metric metric = (enum srnf_metric)i;
        const struct srnf_method *method = method_by(inputs, metric);
        struct srnf_context own;
        struct srnf_folds comparison;

        if (!method) {
            continue;
        }
        *step = "comparing the surfaces";
        own = stats_part_enter(&part, method->comparison_cost);
        status = srnf_folds_compare(sht, metric, inputs->n, inputs->surfaces, &inputs->comparison,
                                    &own, &comparison, error);
        if (status == SRNF_OK) {
            if (pairs) {
                keep_pairs(&comparison, pairs);
                pairs = NULL;
            }
            status = classify(&part, inputs, metric, &comparison, &options, results, typicality,
                              step, error);
            srnf_folds_clear(&comparison);
        }
    }
    srnf_free(log_scale);
    return status;
}

/*
 * assessment.c - what predictions are worth, as JSON (srnf/train.h).
 */
#include "toolkit/assessment.h"

#include <math.h>
#include <stdio.h>

#include "api/warnings.h"

json_t *assessment_rate(const struct srnf_rate *rate)
{
    return json_pack("{s:o, s:[o, o]}", "value", json_finite(rate->value), "interval",
                     json_finite(rate->interval[0]), json_finite(rate->interval[1]));
}

json_t *assessment_rates(const struct srnf_rate *rates, size_t n, const char *const *classes)
{
    json_t *object = json_object();

    for (size_t c = 0; c < n; c++) {
        (void)json_object_set_new(object, classes[c], assessment_rate(&rates[c]));
    }
    return object;
}

json_t *assessment_by_class(const double *values, size_t n, const char *const *classes)
{
    json_t *object = json_object();

    for (size_t c = 0; c < n; c++) {
        (void)json_object_set_new(object, classes[c], json_finite(values[c]));
    }
    return object;
}

static json_t *bins_json(const struct srnf_reliability *bins)
{
    json_t *array = json_array();

    for (size_t b = 0; b < SRNF_RELIABILITY_BINS; b++) {
        const struct srnf_reliability *bin = &bins[b];
        bool any = bin->members > 0;

        (void)json_array_append_new(
            array,
            json_pack("{s:f, s:f, s:I, s:o, s:o, s:o}", "from", (double)b / SRNF_RELIABILITY_BINS,
                      "to", (double)(b + 1) / SRNF_RELIABILITY_BINS, "members",
                      (json_int_t)bin->members, "meanProbability",
                      any ? json_finite(bin->mean) : json_null(), "observed",
                      any ? json_finite(bin->observed) : json_null(), "interval",
                      any ? json_vector(bin->interval, 2) : json_null()));
    }
    return array;
}

static json_t *confusion_json(const struct srnf_assessment *a)
{
    json_t *confusion = json_array();

    for (size_t c = 0; c < a->classes; c++) {
        json_t *row = json_array();

        for (size_t d = 0; d < a->classes; d++) {
            (void)json_array_append_new(row,
                                        json_integer((json_int_t)a->confusion[c * a->classes + d]));
        }
        (void)json_array_append_new(confusion, row);
    }
    return confusion;
}

static json_t *interval_json(const double interval[2])
{
    return isnan(interval[0]) ? json_null() : json_vector(interval, 2);
}

static json_t *scores_json(const struct srnf_scores *of)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "brier", json_finite(of->brier),
                     "brierInterval", interval_json(of->brier_interval), "brierReference",
                     json_finite(of->brier_reference), "logLoss", json_finite(of->log_loss),
                     "logLossInterval", interval_json(of->log_loss_interval), "logLossReference",
                     json_finite(of->log_loss_reference));
}

json_t *assessment_json(const struct srnf_assessment *a, const char *const *classes)
{
    json_t *calibration = json_object(), *scores = scores_json(&a->scores);
    json_t *document =
        json_pack("{s:I, s:I, s:I, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "members", (json_int_t)a->n,
                  "subjects", (json_int_t)a->subjects, "correct", (json_int_t)a->correct,
                  "accuracy", assessment_rate(&a->accuracy), "effectiveCount",
                  json_finite(a->effective), "balancedAccuracy", assessment_rate(&a->balanced),
                  "sensitivity", assessment_rates(a->sensitivity, a->classes, classes), "auc",
                  assessment_rates(a->auc, a->classes, classes), "chance", json_finite(a->chance),
                  "majorityRate", json_finite(a->majority));

    (void)json_object_update(document, scores);
    (void)json_object_set_new(document, "unweighted", scores_json(&a->unweighted));
    (void)json_object_set_new(document, "confusion", confusion_json(a));
    json_decref(scores);
    for (size_t c = 0; c < a->classes; c++) {
        (void)json_object_set_new(calibration, classes[c],
                                  bins_json(a->reliability + c * SRNF_RELIABILITY_BINS));
    }
    (void)json_object_set_new(document, "calibration", calibration);
    return document;
}

/* ---- Doubts ---------------------------------------------------------------------------------- */

/* The class that all are told as; n: there are several. */
static size_t only_class(size_t n, const size_t *confusion)
{
    size_t named = 0, only = n;

    for (size_t c = 0; c < n; c++) {
        size_t count = 0;

        for (size_t label = 0; label < n; label++) {
            count += confusion[label * n + c];
        }
        named += count > 0;
        only = count > 0 ? c : only;
    }
    return named == 1 ? only : n;
}

void assessment_warn(json_t *warnings, const char *method, size_t n, const size_t *confusion,
                     const struct srnf_rate *balanced, const char *const *classes)
{
    size_t only = only_class(n, confusion);
    double chance = 1.0 / (double)n;
    char by[80] = "";
    json_t *figures;

    if (only == n && balanced->interval[0] > chance) {
        return;
    }
    figures =
        json_pack("{s:o, s:f}", "balancedAccuracy", assessment_rate(balanced), "chance", chance);
    if (method) {
        (void)snprintf(by, sizeof by, " by %.60s", method);
        (void)json_object_set_new(figures, "method", json_string(method));
    }
    if (only < n) {
        (void)json_object_set_new(figures, "class", json_string(classes[only]));
        warning_add(warnings, "names-one-class", figures,
                    "All members that were left out are told as \"%.60s\"%s, whatever their shape: "
                    "the accuracy is the share of that class (majorityRate) and says nothing; "
                    "balancedAccuracy is that of chance, %.3g. Do not use it to tell classes: take "
                    "more subjects of the smaller classes, or as many of each; in train, equal "
                    "priors keep a class from winning by its share alone.",
                    classes[only], by, chance);
        return;
    }
    warning_add(warnings, "not-above-chance", figures,
                "The balanced accuracy%s, %.3g, with an interval from %.3g to %.3g, may be that of "
                "chance, %.3g: that it tells the classes has not been shown, however high the "
                "accuracy is. Take more subjects, of the smaller classes first, or another method.",
                by, balanced->value, balanced->interval[0], balanced->interval[1], chance);
}

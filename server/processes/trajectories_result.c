/*
 * trajectories_result.c - the result of the process trajectories: the document of regress, about
 * slopes, with their mean and what each subject's is beside the others'.
 */
#include "processes/trajectories.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/warnings.h"
#include "toolkit/permutation_test.h"

/* Maps of the mean slope, the first four times the scale; count 0: no memory. */
static struct store_maps slope_maps(const struct group_mean *mean, const struct srnf_paired *slope,
                                    double scale)
{
    const struct {
        const char *name;
        const double *values;
        double factor;
    } rows[] = {{"effect", slope->effect, scale},
                {"normalEffect", slope->normal, scale},
                {"standardError", slope->standard_error, scale},
                {"confidence", slope->confidence, scale},
                {"significance", slope->significance, 1.0},
                {"fdr", slope->fdr, 1.0},
                {"pointwiseP", slope->p, 1.0},
                {"statistic", slope->statistic, 1.0}};
    size_t count = sizeof rows / sizeof rows[0];
    size_t points = mean->outputs.n_theta * mean->outputs.n_phi;
    struct store_maps maps = {.n_theta = (int64_t)mean->outputs.n_theta,
                              .n_phi = (int64_t)mean->outputs.n_phi,
                              .values = malloc(count * points * sizeof(double))};

    for (size_t k = 0; maps.values && k < count; k++) {
        (void)snprintf(maps.names[k], sizeof maps.names[k], "%s", rows[k].name);
        for (size_t p = 0; p < points; p++) {
            maps.values[k * points + p] = rows[k].values[p] * rows[k].factor;
        }
    }
    maps.count = maps.values ? count : 0;
    return maps;
}

static json_t *slope_json(const struct srnf_paired *slope, size_t points, double scale)
{
    double fdr = 1.0, effect = 0.0, confidence = 0.0;
    json_t *object =
        json_pack("{s:o, s:o, s:o, s:o, s:o}", "rate", json_estimate(&slope->change, scale),
                  "variation", json_estimate(&slope->fluctuating, scale), "individual",
                  json_estimate(&slope->individual, scale), "share",
                  json_estimate(&slope->share, 1.0), "distance", json_finite(slope->norm * scale));

    (void)json_object_set_new(object, "distanceInterval",
                              json_pack("[o, o]", json_finite(slope->norm_interval[0] * scale),
                                        json_finite(slope->norm_interval[1] * scale)));
    permutation_set_p(object, "pValue", slope->p_value, &slope->test);
    permutation_set_p(object, "leastSignificance", slope->max_p_value, &slope->test);
    permutation_set_test(object, &slope->test);
    for (size_t p = 0; p < points; p++) {
        fdr = fmin(fdr, slope->fdr[p]);
        effect = fmax(effect, slope->effect[p]);
        confidence = fmax(confidence, slope->confidence[p]);
    }
    (void)json_object_set_new(object, "leastFdr", json_finite(fdr));
    (void)json_object_set_new(object, "largestEffect", json_finite(effect * scale));
    (void)json_object_set_new(object, "largestConfidence", json_finite(confidence * scale));
    return object;
}

static json_t *field_json(const double *values, size_t points, double scale)
{
    double *scaled = srnf_alloc(points, sizeof *scaled);
    json_t *array;

    for (size_t p = 0; scaled && p < points; p++) {
        scaled[p] = values[p] * scale;
    }
    array = scaled ? json_vector(scaled, points) : NULL;
    srnf_free(scaled);
    return array;
}

/* Subjects are numbered as their first members come. */
static json_t *subjects_json(const struct trajectories *asked,
                             const struct srnf_trajectories *found, size_t points, double scale)
{
    const struct group_input *group = &asked->model.group;
    const json_t *names = json_object_get(group->cohort, "subjects");
    const struct srnf_paired *slope = &found->slope;
    json_t *array = json_array();

    for (size_t i = 0, k = 0; i < group->n; i++) {
        const struct srnf_subject_trajectory *s = &found->subject[k];
        json_t *one;

        if (group->subjects[i] != i) {
            continue;
        }
        one = json_pack("{s:O, s:I, s:[f, f], s:o, s:o, s:o, s:o}", "subject",
                        json_array_get(names, i), "visits", (json_int_t)s->visits, "times",
                        s->first, s->last, "weight", json_finite(s->weight), "speed",
                        json_finite(s->speed), "speedPercentile", json_finite(s->faster.percentile),
                        "oddness", json_finite(s->odd.value));
        (void)json_object_set_new(one, "speedPercentileInterval",
                                  json_vector(s->faster.interval, 2));
        (void)json_object_set_new(one, "percentile", json_finite(s->odd.percentile));
        (void)json_object_set_new(one, "percentileInterval", json_vector(s->odd.interval, 2));
        (void)json_object_set_new(one, "length", json_finite(slope->length[k] * scale));
        (void)json_object_set_new(one, "along", json_finite(slope->along[k] * scale));
        (void)json_object_set_new(one, "deviation", json_finite(slope->deviation[k] * scale));
        (void)json_object_set_new(one, "distance", json_finite(slope->distance[k] * scale));
        if (asked->model.fields) {
            (void)json_object_set_new(one, "field",
                                      field_json(slope->normals + k * points, points, scale));
        }
        (void)json_array_append_new(array, one);
        k++;
    }
    return array;
}

json_t *trajectories_document(struct jobs_run *run, const struct trajectories *asked,
                              const struct group_mean *mean, const struct srnf_trajectories *found,
                              struct jobs_result *result)
{
    size_t points = mean->outputs.n_theta * mean->outputs.n_phi;
    double scale = mean_scale(run, mean);
    struct store_maps maps = slope_maps(mean, &found->slope, scale);
    const struct regress_more more = {.process = "trajectories",
                                      .title = "mean of trajectories",
                                      .maps = &maps,
                                      .slopes = found->slope_at,
                                      .weighted = found->weighted};
    json_t *document = NULL;

    if (maps.count == 0) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "keeping the maps");
    } else {
        document = regress_document(run, &asked->model, mean, &found->model, &more, result);
    }
    store_maps_clear(&maps);
    if (!document) {
        return NULL;
    }
    (void)json_object_set_new(document, "slope", slope_json(&found->slope, points, scale));
    (void)json_object_set_new(document, "reference", json_finite(found->reference));
    (void)json_object_set_new(document, "weighted", json_boolean(found->weighted));
    (void)json_object_set_new(document, "within",
                              found->freedom ? json_finite(found->within) : json_null());
    (void)json_object_set_new(
        document, "withinInterval",
        isfinite(found->within_interval[0]) ? json_vector(found->within_interval, 2) : json_null());
    (void)json_object_set_new(document, "between", json_finite(found->between));
    (void)json_object_set_new(document, "betweenInterval", json_vector(found->between_interval, 2));
    (void)json_object_set_new(document, "perSubject", subjects_json(asked, found, points, scale));
    if (!json_object_get(document, "model")) {
        (void)json_object_set_new(document, "model", json_null());
    }
    permutation_warn(warnings_of(document), &found->slope.test, "slope.pValue cannot be");
    trajectories_warn(run, asked, found, document);
    return document;
}

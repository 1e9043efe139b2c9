/*
 * model_intervals.c - see model_intervals.h. Nothing of it is stored: models of older builds have
 * intervals as well.
 */
#include "api/model_intervals.h"

#include <math.h>

#include "api/json_memory.h"
#include "api/json_numbers.h"

/* Whether a subject has several members: they are not independent. */
static bool has_repeated(const json_t *subjects)
{
    json_t *seen = json_object(), *subject;
    bool repeated = false;
    size_t i;

    json_array_foreach(subjects, i, subject)
    {
        const char *name = json_string_value(subject);

        repeated = repeated || (name && json_object_get(seen, name));
        if (name) {
            (void)json_object_set(seen, name, subject);
        }
    }
    json_decref(seen);
    return repeated;
}

static json_t *interval_or_null(const double interval[2])
{
    return !isnan(interval[0]) ? json_vector(interval, 2) : json_null();
}

static void set_total(json_t *record, const struct srnf_pca *pca, const json_t *distances)
{
    double *values = srnf_alloc(pca->n, sizeof *values);
    double interval[2] = {NAN, NAN};

    if (!values) {
        json_memory_fail();
    }
    if (values && json_array_size(distances) == pca->n) {
        for (size_t i = 0; i < pca->n; i++) {
            values[i] = json_number_value(json_array_get(distances, i));
        }
        srnf_pca_total_interval(pca, values, interval);
    }
    (void)json_object_set_new(record, "totalVarianceInterval", interval_or_null(interval));
    srnf_free(values);
}

void model_set_intervals(json_t *record, size_t n, size_t components, double *eigenvalues,
                         double *scores)
{
    const json_t *made = json_object_get(record, "madeFrom");
    const struct srnf_pca pca = {.n = n,
                                 .components = components,
                                 .eigenvalues = eigenvalues,
                                 .scores = scores,
                                 .total_variance =
                                     json_number_value(json_object_get(record, "totalVariance"))};
    bool repeated = has_repeated(json_object_get(made, "subjects"));
    json_t *values = json_array(), *explained = json_array();

    for (size_t k = 0; k < pca.components; k++) {
        double of_value[2] = {NAN, NAN}, of_share[2] = {NAN, NAN};

        if (!repeated) {
            srnf_pca_interval(&pca, k, of_value, of_share);
        }
        (void)json_array_append_new(values, interval_or_null(of_value));
        (void)json_array_append_new(explained, interval_or_null(of_share));
    }
    (void)json_object_set_new(record, "eigenvalueIntervals", values);
    (void)json_object_set_new(record, "explainedIntervals", explained);
    set_total(record, &pca, repeated ? NULL : json_object_get(made, "distances"));
}

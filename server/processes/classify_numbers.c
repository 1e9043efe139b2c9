/*
 * classify_numbers.c - what counts beside shape where members are classified: their sizes, and
 * covariates of the cohort.
 */
#include "processes/classify.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/covariates.h"

void classify_set_covariates(struct process_inputs *given)
{
    const json_t *names = json_object_get(given->canonical, "covariates");
    json_t *cohort = json_object_get(given->canonical, "cohort"), *values;
    json_t *members = json_array_size(names) ? group_stored_members(given) : NULL;

    if (!members) {
        return;
    }
    values = covariate_values(given, members, names);
    if (json_array_size(values) == json_array_size(names)) {
        covariates_check(given, names, values);
    }
    (void)json_object_set_new(cohort, "values", values);
    json_decref(members);
}

bool classify_check_count(struct process_inputs *given, size_t numbers)
{
    size_t covariates = json_array_size(json_object_get(given->canonical, "covariates"));

    if (numbers > SRNF_FEATURES_MAX) {
        problem_add(given->list, "/inputs/covariates",
                    "has %zu names, which with the sizes are %zu numbers beside shape; at most %zu "
                    "are taken",
                    covariates, numbers, SRNF_FEATURES_MAX);
        return false;
    }
    return true;
}

json_t *classify_number_names(bool with_size, const json_t *parts, const json_t *covariates)
{
    json_t *names = json_array();

    if (with_size && !parts) {
        (void)json_array_append_new(names, json_string("size"));
    }
    for (size_t p = 0; with_size && p < json_array_size(parts); p++) {
        (void)json_array_append_new(
            names, json_sprintf("size of %s", json_string_value(json_array_get(parts, p))));
    }
    for (size_t k = 0; k < json_array_size(covariates); k++) {
        (void)json_array_append(names, json_array_get(covariates, k));
    }
    return names;
}

int classify_numbers(struct jobs_run *run, const struct srnf_sht *sht,
                     const struct group_input *members, const struct compute_group *group, size_t n,
                     size_t sizes, const json_t *values, double **numbers)
{
    size_t count = sizes + json_array_size(values);
    double *normalized = srnf_alloc(srnf_coefficient_count(group->degree), 3 * sizeof(double));
    int status = normalized ? SRNF_OK : SRNF_ENOMEM;

    *numbers = srnf_alloc(n * count + 1, sizeof(double));
    status = *numbers ? status : SRNF_ENOMEM;
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        double *own = *numbers + i * count;

        for (size_t p = 0; p < sizes && status == SRNF_OK; p++) {
            size_t member = p * n + i;

            status = srnf_normalize(sht, group->surfaces[member], normalized, &own[p]);
            own[p] += log(process_scale(run, members->ids[member], group->scales[member]));
        }
        for (size_t k = sizes; k < count; k++) {
            own[k] = json_number_value(json_array_get(json_array_get(values, k - sizes), i));
        }
    }
    srnf_free(normalized);
    return status;
}

/* Whether number k of `count` is the same in all members of each class. */
static bool is_constant(size_t n, const double *numbers, size_t count, size_t k,
                        const size_t *labels)
{
    for (size_t i = 0; i < n; i++) {
        size_t first = 0;

        while (labels[first] != labels[i]) {
            first++;
        }
        if (numbers[i * count + k] < numbers[first * count + k] ||
            numbers[i * count + k] > numbers[first * count + k]) {
            return false;
        }
    }
    return true;
}

void classify_name_constant(const json_t *covariates, size_t sizes, size_t n, const double *numbers,
                            const size_t *labels, struct jobs_result *result)
{
    size_t count = sizes + json_array_size(covariates), length = strlen(result->problem_detail);

    for (size_t k = sizes; numbers && k < count; k++) {
        if (is_constant(n, numbers, count, k, labels)) {
            (void)snprintf(result->problem_detail + length, sizeof result->problem_detail - length,
                           ". \"%.60s\" is the same in all members of each label, so that it does "
                           "not vary within them and tells the label by itself: leave it out of "
                           "covariates, or take the method srnf-nn",
                           json_string_value(json_array_get(covariates, k - sizes)));
            return;
        }
    }
}

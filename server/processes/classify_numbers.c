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

/* Whether member i is of the subject of member `out`. */
static bool is_left_out(const struct classify_constants *in, size_t i, size_t out)
{
    return out < in->n && (in->subjects ? in->subjects[i] == in->subjects[out] : i == out);
}

/* Whether number k of `count` is the same in all members of each class but those of the subject
   left out: of those, the member with number `out`, or n of none. */
static bool is_constant(const struct classify_constants *in, size_t count, size_t k, size_t out)
{
    for (size_t i = 0; i < in->n; i++) {
        size_t first = 0;

        if (is_left_out(in, i, out)) {
            continue;
        }
        while (in->labels[first] != in->labels[i] || is_left_out(in, first, out)) {
            first++;
        }
        if (in->numbers[i * count + k] < in->numbers[first * count + k] ||
            in->numbers[i * count + k] > in->numbers[first * count + k]) {
            return false;
        }
    }
    return true;
}

void classify_name_constant(const struct classify_constants *in, const struct srnf_error *error,
                            struct jobs_result *result)
{
    size_t count = in->sizes + json_array_size(in->covariates);
    size_t length = strlen(result->problem_detail);
    size_t out =
        error->element >= 0 && (size_t)error->element < in->n ? (size_t)error->element : in->n;

    for (size_t k = in->sizes; in->numbers && k < count; k++) {
        bool all = is_constant(in, count, k, in->n);

        if (all || is_constant(in, count, k, out)) {
            (void)snprintf(result->problem_detail + length, sizeof result->problem_detail - length,
                           ". \"%.60s\" is the same in all members of each label%s, so that it "
                           "does not vary within them and tells the label by itself: leave it out "
                           "of covariates, or take the method srnf-nn",
                           json_string_value(json_array_get(in->covariates, k - in->sizes)),
                           all ? "" : " but that subject");
            return;
        }
    }
}

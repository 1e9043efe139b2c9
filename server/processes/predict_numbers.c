/*
 * predict_numbers.c - what counts beside shape where a classifier is asked: sizes and covariates of
 * the surfaces, which must all be there.
 */
#include "processes/predict.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/warnings.h"
#include "processes/classify_parts.h"
#include "text.h"
#include "toolkit/covariates.h"

/* ---- Inputs ---------------------------------------------------------------------------------- */

static void read_covariates(struct process_inputs *given, const struct process_input *input)
{
    json_t *value = json_object_get(given->given, input->name), *one;
    json_t *canonical = value && !json_is_null(value) ? json_array() : json_null();
    char pointer[64];
    size_t i;

    if (!json_is_null(canonical) && !json_is_array(value)) {
        problem_add(given->list, "/inputs/covariates",
                    "must be null or an array with an object of covariates for each surface");
    }
    json_array_foreach(value, i, one)
    {
        const char *name;
        json_t *number, *own = json_object();

        (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", i);
        if (!json_is_object(one)) {
            problem_add(given->list, pointer, "must be an object of covariates and numbers");
        }
        json_object_foreach(one, name, number)
        {
            if (!json_is_number(number) && !json_is_boolean(number)) {
                problem_add(given->list, pointer, "\"%.60s\" must be a number, true or false",
                            name);
            } else if (!covariate_takes(json_number_value(number))) {
                problem_add(given->list, pointer, "\"%.60s\" is %.6g; " COVARIATE_TAKEN, name,
                            json_number_value(number));
            }
            (void)json_object_set_new(own, name,
                                      json_is_number(number)
                                          ? json_real(json_number_value(number) + 0.0)
                                          : json_real(json_is_true(number) ? 1.0 : 0.0));
        }
        (void)json_array_append_new(canonical, own);
    }
    (void)json_object_set_new(given->canonical, input->name, canonical);
}

static bool type_covariates(const json_t *value, void *member)
{
    *(json_t **)member = json_deep_copy(value);
    return *(json_t **)member != NULL;
}

static void clear_covariates(void *member)
{
    json_decref(*(json_t **)member);
    *(json_t **)member = NULL;
}

const struct input_own predict_covariates = {
    .schema =
        "\"type\":[\"array\",\"null\"],\"items\":{\"type\":\"object\","
        "\"additionalProperties\":{\"oneOf\":[{\"type\":\"number\"},{\"type\":\"boolean\"}]}},"
        "\"default\":null",
    .read = read_covariates,
    .type = type_covariates,
    .clear = clear_covariates,
};

/* ---- What holds between them ----------------------------------------------------------------- */

/* The names of the classifier's covariates, in its order (new reference). */
static json_t *covariate_names(const json_t *names, size_t sizes)
{
    json_t *own = json_array();

    for (size_t k = sizes; k < json_array_size(names); k++) {
        (void)json_array_append(own, json_array_get(names, k));
    }
    return own;
}

static bool has_name(const json_t *names, const char *name)
{
    const json_t *one;
    size_t i;

    json_array_foreach(names, i, one)
    {
        if (strcmp(json_string_value(one), name) == 0) {
            return true;
        }
    }
    return false;
}

/* Each surface must have those and no others. */
static void check_given(struct process_inputs *given, const json_t *names, size_t n)
{
    const json_t *all = json_object_get(given->canonical, "covariates"), *one, *name;
    bool several = json_is_array(json_object_get(given->canonical, "parts"));
    char pointer[64];
    size_t i, k;

    if (json_array_size(all) != n) {
        problem_add(given->list, "/inputs/covariates",
                    "has objects of covariates for %zu %s; there %s %zu, and the classifier "
                    "needs %zu covariate%s of each, \"%.60s\" first",
                    json_array_size(all), several ? "subjects" : "surfaces", n == 1 ? "is" : "are",
                    n, json_array_size(names), plural(json_array_size(names)),
                    json_string_value(json_array_get(names, 0)));
        return;
    }
    json_array_foreach(all, i, one)
    {
        const char *surplus = NULL, *key;
        json_t *value;
        size_t found = 0;

        json_object_foreach((json_t *)(uintptr_t)one, key, value)
        {
            surplus = surplus || has_name(names, key) ? surplus : key;
        }
        (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", i);
        json_array_foreach(names, k, name)
        {
            if (json_object_get(one, json_string_value(name))) {
                found++;
            } else {
                problem_add(given->list, pointer, "has no \"%.60s\", which the classifier takes",
                            json_string_value(name));
            }
        }
        if (found == json_array_size(names) && json_object_size(one) > found) {
            problem_add(given->list, pointer,
                        "has %zu covariates; the classifier takes %zu of them, and not \"%.60s\": "
                        "leave it out",
                        json_object_size(one), found, surplus ? surplus : "");
        }
    }
}

void predict_check_covariates(struct process_inputs *given, const struct store_model *model)
{
    json_t *record = json_loads(model->record ? model->record : "{}", 0, NULL);
    const json_t *features = json_object_get(json_object_get(record, "classifier"), "features");
    size_t several = json_array_size(json_object_get(record, "parts"));
    size_t n_parts = several ? several : 1;
    size_t n = json_array_size(json_object_get(given->canonical, "surfaces")) / n_parts;
    json_t *names = covariate_names(json_object_get(features, "names"),
                                    json_is_true(json_object_get(features, "size")) ? n_parts : 0);
    json_t *cohort = json_object_get(given->canonical, "cohort"), *members = NULL;
    bool told = !json_is_null(json_object_get(given->canonical, "covariates"));

    if (told && (json_array_size(names) == 0 || json_is_object(cohort))) {
        problem_add(given->list, "/inputs/covariates",
                    json_is_object(cohort)
                        ? "must be left out: the members of a cohort have their own"
                        : "must be left out: the classifier takes none");
    } else if (json_array_size(names) > 0 && json_is_object(cohort) && several) {
        (void)classify_parts_values(given, names, n);
    } else if (json_array_size(names) > 0 && json_is_object(cohort)) {
        members = group_stored_members(given);
        if (members) {
            (void)json_object_set_new(cohort, "values", covariate_values(given, members, names));
        }
        json_decref(members);
    } else if (json_array_size(names) > 0) {
        check_given(given, names, n);
    }
    json_decref(names);
    json_decref(record);
}

/* ---- Running --------------------------------------------------------------------------------- */

int predict_load_numbers(struct jobs_run *run, const struct predict *predict,
                         const struct kept *kept, const struct srnf_sht *sht,
                         const struct compute_group *group, double **numbers,
                         struct jobs_result *result)
{
    json_t *names = covariate_names(kept->feature_names, kept->sizes), *values;
    const json_t *name, *one;
    size_t k, i;
    int status;

    if (json_is_array(predict->covariates)) {
        values = json_array();
        json_array_foreach(names, k, name)
        {
            json_t *column = json_array();

            json_array_foreach(predict->covariates, i, one)
            {
                (void)json_array_append(column, json_object_get(one, json_string_value(name)));
            }
            (void)json_array_append_new(values, column);
        }
    } else {
        values = json_incref(json_object_get(predict->group.cohort, "values"));
    }
    status =
        json_array_size(values) == json_array_size(names)
            ? classify_numbers(run, sht, &predict->group, group,
                               group->n / kept->model.joint.n_parts, kept->sizes, values, numbers)
            : SRNF_EINVAL;
    json_decref(values);
    json_decref(names);
    return status ? compute_fail(result, status, NULL, "reading the numbers beside shape") : 0;
}

/* ---- Results --------------------------------------------------------------------------------- */

/* Sizes are told as lengths, as elsewhere. */
static double shown(const struct kept *kept, size_t k, double number)
{
    return k < kept->sizes ? exp(number) : number;
}

/* What a length has to be multiplied by to lie among those of the members, where it is another unit
   of them; 0: it is none. Logarithms of lengths. */
static double unit_of(double value, double lowest, double highest)
{
    static const double units[] = {1000.0, 100.0, 25.4, 10.0};
    const double room = log(1.2); /* a new one may well be a little larger than all */

    for (size_t k = 0; k < 2 * sizeof units / sizeof units[0]; k++) {
        double factor = k % 2 ? 1.0 / units[k / 2] : units[k / 2];
        double there = value + log(factor);

        if (there >= lowest - room && there <= highest + room) {
            return factor;
        }
    }
    return 0.0;
}

/* A surface in metres where those of the members were in millimetres. */
static void warn_unit(const struct kept *kept, const char *covariate, const double range[3],
                      double factor, size_t i, const char *name, json_t *warnings)
{
    double value = exp(range[0]), lowest = exp(range[1]), highest = exp(range[2]);

    warning_add(
        warnings, "extrapolated",
        json_pack("{s:I, s:s, s:f, s:f, s:f, s:f}", "index", (json_int_t)i, "covariate", covariate,
                  "value", value, "lowest", lowest, "highest", highest, "factor", factor),
        "%s %zu (%.60s) has %.60s = %.6g, where the members that the classifier was trained "
        "on have %.6g to %.6g. Times %.6g it would lie among them: is its mesh in another "
        "unit? Then its label and its probabilities say nothing; scale it to theirs.",
        predict_what(kept), i, name, covariate, value, lowest, highest, factor);
}

json_t *predict_numbers_json(const struct kept *kept, const double *numbers, size_t i,
                             const char *name, json_t *warnings)
{
    size_t count = kept->classifier.features;
    json_t *object = count > 0 ? json_object() : json_null();

    for (size_t k = 0; k < count; k++) {
        const char *covariate = json_string_value(json_array_get(kept->feature_names, k));
        double value = numbers[i * count + k], lowest = INFINITY, highest = -INFINITY, factor;

        for (size_t m = 0; m < kept->model.pca.n; m++) {
            lowest = fmin(lowest, kept->numbers[m * count + k]);
            highest = fmax(highest, kept->numbers[m * count + k]);
        }
        factor = k < kept->sizes && (value < lowest || value > highest)
                     ? unit_of(value, lowest, highest)
                     : 0.0;
        if (factor > 0.0) {
            const double range[3] = {value, lowest, highest};

            warn_unit(kept, covariate, range, factor, i, name, warnings);
        } else if (value < lowest || value > highest) {
            warning_add(warnings, "extrapolated",
                        json_pack("{s:I, s:s, s:f, s:f, s:f}", "index", (json_int_t)i, "covariate",
                                  covariate, "value", shown(kept, k, value), "lowest",
                                  shown(kept, k, lowest), "highest", shown(kept, k, highest)),
                        "%s %zu (%.60s) has %.60s = %.6g, beyond the members that the "
                        "classifier was trained on, who have %.6g to %.6g.",
                        predict_what(kept), i, name, covariate, shown(kept, k, value),
                        shown(kept, k, lowest), shown(kept, k, highest));
        }
        (void)json_object_set_new(object, covariate, json_finite(shown(kept, k, value)));
    }
    return object;
}

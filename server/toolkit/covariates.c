/*
 * covariates.c - see covariates.h.
 *
 * Columns are made orthogonal one after another (Gram and Schmidt, twice each). What is left of a
 * column, over what it had about its mean, is its tolerance; 1 over that is the variance inflation
 * factor (Marquardt 1970): by so much the variance of its effect is larger than without the
 * others. Only that of the group matters to the test; covariates may follow each other as they
 * like, as long as none of them adds nothing at all.
 */
#include "toolkit/covariates.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/cohorts.h"
#include "api/warnings.h"

#define NAMES_SHOWN 240
#define DEPENDENT 1e-8        /* of a column's length: rounding */
#define INFLATION_WARNED 10.0 /* the usual rule of thumb */

/* The names of all covariates that any member has, for a sentence. */
static void list_names(const json_t *members, char text[NAMES_SHOWN])
{
    json_t *seen = json_object();
    const char *name;
    json_t *value;
    size_t used = 0;

    for (size_t i = 0; i < json_array_size(members); i++) {
        json_t *all = json_object_get(json_array_get(members, i), "covariates");

        (void)json_object_update_missing(seen, all);
    }
    text[0] = '\0';
    json_object_foreach(seen, name, value)
    {
        int more = snprintf(text + used, NAMES_SHOWN - used, "%s\"%.40s\"", used ? ", " : "", name);

        if (more < 0 || (size_t)more >= NAMES_SHOWN - used) {
            text[used] = '\0';
            break;
        }
        used += (size_t)more;
    }
    json_decref(seen);
}

static void refuse_value(struct process_inputs *inputs, const json_t *members, size_t i,
                         const json_t *value, const char *name, const char *pointer)
{
    char there[NAMES_SHOWN];

    if (value && !json_is_null(value)) {
        problem_add(inputs->list, pointer,
                    "\"%.60s\" of member %zu of the cohort is not a number, true or false", name,
                    i);
        return;
    }
    list_names(members, there);
    problem_add(inputs->list, pointer, "member %zu of the cohort has no covariate \"%.60s\"; %s%s",
                i, name, there[0] ? "the cohort has " : "the cohort has none", there);
}

/* Those of one name, of all members; NULL with a problem noted at the pointer. */
static json_t *read_values(struct process_inputs *inputs, const json_t *members, const char *name,
                           const char *pointer)
{
    json_t *values = json_array();

    for (size_t i = 0; i < json_array_size(members); i++) {
        const json_t *all = json_object_get(json_array_get(members, i), "covariates");
        const json_t *value = json_object_get(all, name);

        if (json_is_boolean(value)) {
            (void)json_array_append_new(values, json_real(json_is_true(value) ? 1.0 : 0.0));
        } else if (json_is_number(value)) {
            (void)json_array_append_new(values, json_real(json_number_value(value) + 0.0));
        } else {
            refuse_value(inputs, members, i, value, name, pointer);
            json_decref(values);
            return NULL;
        }
    }
    return values;
}

json_t *covariate_values(struct process_inputs *inputs, const json_t *members, const json_t *names)
{
    json_t *values = json_array();
    char pointer[64];

    for (size_t i = 0; i < json_array_size(names); i++) {
        json_t *one;

        (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", i);
        one = read_values(inputs, members, json_string_value(json_array_get(names, i)), pointer);
        if (one) {
            (void)json_array_append_new(values, one);
        }
    }
    return values;
}

/* ---- The input ------------------------------------------------------------------------------- */

static void read_names(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *given = json_object_get(inputs->given, input->name);
    json_t *names = json_array();
    char pointer[64];

    if (given && !json_is_array(given)) {
        problem_add(inputs->list, "/inputs/covariates", "must be an array of names");
    }
    if (json_array_size(given) > COHORT_COVARIATES_MAX) {
        problem_add(inputs->list, "/inputs/covariates", "has %zu names; at most %d are taken",
                    json_array_size(given), COHORT_COVARIATES_MAX);
        given = NULL;
    }
    for (size_t i = 0; i < json_array_size(given); i++) {
        const char *name = json_string_value(json_array_get(given, i));

        if (!name) {
            (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", i);
            problem_add(inputs->list, pointer, "must be the name of a covariate");
        }
        (void)json_array_append_new(names, json_string(name ? name : ""));
    }
    (void)json_object_set_new(inputs->canonical, input->name, names);
}

static bool type_names(const json_t *value, void *member)
{
    *(json_t **)member = json_is_array(value) ? json_deep_copy(value) : NULL;
    return *(json_t **)member != NULL;
}

static void clear_names(void *member)
{
    json_decref(*(json_t **)member);
}

const struct input_own covariates_names = {
    .schema = "\"type\":\"array\",\"maxItems\":" PROCESS_TEXT(
        COHORT_COVARIATES_MAX) ",\"items\":{\"type\":\"string\"},\"default\":[]",
    .read = read_names,
    .type = type_names,
    .clear = clear_names,
};

/* ---- What they leave of the groups ----------------------------------------------------------- */

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Takes the parts along m orthonormal columns away from a column. Returns the length left. */
static double reduce(size_t n, const double *basis, size_t m, double *column)
{
    for (int pass = 0; pass < 2; pass++) {
        for (size_t j = 0; j < m; j++) {
            double along = dot(n, basis + j * n, column);

            for (size_t i = 0; i < n; i++) {
                column[i] -= along * basis[j * n + i];
            }
        }
    }
    return sqrt(dot(n, column, column));
}

static void scale(size_t n, double factor, double *column)
{
    for (size_t i = 0; i < n; i++) {
        column[i] *= factor;
    }
}

void covariates_check(struct process_inputs *inputs, const json_t *names, const json_t *values)
{
    size_t m = json_array_size(values), n = json_array_size(json_array_get(values, 0)), kept = 1;
    double *basis = n ? srnf_alloc((m + 1) * n, sizeof *basis) : NULL;

    for (size_t i = 0; basis && i < n; i++) {
        basis[i] = 1.0 / sqrt((double)n);
    }
    for (size_t j = 0; basis && j < m; j++) {
        const char *name = json_string_value(json_array_get(names, j));
        double *column = basis + kept * n, largest = 0.0, left, about_mean;
        char pointer[64];

        for (size_t i = 0; i < n; i++) {
            column[i] = json_number_value(json_array_get(json_array_get(values, j), i));
            largest = fmax(largest, fabs(column[i]));
        }
        scale(n, largest > 0.0 ? 1.0 / largest : 1.0, column);
        about_mean = reduce(n, basis, 1, column);
        left = reduce(n, basis, kept, column);
        (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", j);
        if (!(about_mean > DEPENDENT)) {
            problem_add(inputs->list, pointer,
                        "\"%.60s\" is the same for all members: leave it out", name ? name : "");
        } else if (!(left > DEPENDENT * about_mean)) {
            problem_add(inputs->list, pointer,
                        "\"%.60s\" follows from the covariates before it: leave it out",
                        name ? name : "");
        } else {
            scale(n, 1.0 / left, column);
            kept++;
        }
    }
    srnf_free(basis);
}

/* Columns of subjects: the mean of covariate j, or the group where j is m, over the members of
   each. Those of members that are not the first of their subject stay 0. */
static void fill_column(size_t n, size_t m, size_t j, const size_t *subjects, const int *group,
                        const double *covariates, double *count, double *column)
{
    memset(column, 0, n * sizeof *column);
    memset(count, 0, n * sizeof *count);
    for (size_t i = 0; i < n; i++) {
        column[subjects[i]] += j == m ? (double)group[i] : covariates[i * m + j];
        count[subjects[i]] += 1.0;
    }
    for (size_t i = 0; i < n; i++) {
        column[i] = count[i] > 0.0 ? column[i] / count[i] : 0.0;
    }
}

void covariates_warn(json_t *warnings, const json_t *names, size_t n, const size_t *subjects,
                     const int *group, const double *covariates)
{
    size_t m = json_array_size(names), kept = 1, closest = 0;
    double *basis = m ? srnf_alloc((m + 4) * n, sizeof *basis) : NULL;
    double *target = basis ? basis + (m + 1) * n : NULL, *count = basis ? target + n : NULL;
    double *centred = basis ? count + n : NULL, largest = 0.0, length, left;
    size_t n_subjects = 0;

    if (!basis) {
        return;
    }
    for (size_t i = 0; i < n; i++) {
        n_subjects += subjects[i] == i;
    }
    for (size_t i = 0; i < n; i++) {
        basis[i] = subjects[i] == i ? 1.0 / sqrt((double)n_subjects) : 0.0;
    }
    fill_column(n, m, m, subjects, group, covariates, count, centred);
    length = reduce(n, basis, 1, centred);
    memcpy(target, centred, n * sizeof *target);
    for (size_t j = 0; j < m; j++) {
        double *column = basis + kept * n, about_mean, alike;

        fill_column(n, m, j, subjects, group, covariates, count, column);
        about_mean = reduce(n, basis, 1, column);
        alike = about_mean > 0.0 ? fabs(dot(n, column, centred)) / about_mean : 0.0;
        closest = alike > largest ? j : closest;
        largest = fmax(largest, alike);
        left = reduce(n, basis, kept, column);
        if (left > DEPENDENT * about_mean) {
            scale(n, 1.0 / left, column);
            kept++;
        }
    }
    left = reduce(n, basis, kept, target);
    if (left > 0.0 && (length / left) * (length / left) >= INFLATION_WARNED) {
        const char *name = json_string_value(json_array_get(names, closest));
        double inflation = (length / left) * (length / left);

        warning_add(
            warnings, "covariates-collinear",
            json_pack("{s:s, s:f, s:f}", "covariate", name ? name : "", "inflation", inflation,
                      "tolerance", 1.0 / inflation),
            "The covariates all but tell the groups, \"%.60s\" most of all: with them the "
            "variance of the groups' difference is %.3g times what it is without "
            "(tolerance %.3g). What is left to compare rests on few subjects; leave it out, "
            "or take subjects in whom it does not go with the group.",
            name ? name : "", inflation, 1.0 / inflation);
    }
    srnf_free(basis);
}

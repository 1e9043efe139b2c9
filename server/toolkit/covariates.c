/*
 * covariates.c - see covariates.h. The formulas are those of core/stats/covariates.c.
 */
#include "toolkit/covariates.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/cohorts.h"
#include "api/warnings.h"
#include "toolkit/group.h"

#define NAMES_SHOWN 240

/* The names of all covariates that any member has, for a sentence. */
static void list_names(const json_t *members, char text[NAMES_SHOWN])
{
    json_t *seen = json_object();

    for (size_t i = 0; i < json_array_size(members); i++) {
        json_t *all = json_object_get(json_array_get(members, i), "covariates");

        (void)json_object_update_missing(seen, all);
    }
    cohort_list_names(seen, text, NAMES_SHOWN);
    json_decref(seen);
}

/* Whether a text is a number all the same: one of a column that has other texts, too. */
static bool looks_like_number(const char *text)
{
    char *end;

    (void)strtod(text, &end);
    return end != text && !*end;
}

const char *covariate_text_advice(const char *text)
{
    return looks_like_number(text)
               ? "send it as a number, without the quotes"
               : "code two levels as 0 and 1; formulas, as that of regress, take texts as levels";
}

/* A covariate that is a text: names the first member whose text cannot be read as a number, or
   else member i. */
static void refuse_text(struct process_inputs *inputs, const json_t *members, size_t i,
                        const char *name, const char *pointer)
{
    const char *text = NULL, *id;

    for (size_t k = i; k < json_array_size(members); k++) {
        const json_t *all = json_object_get(json_array_get(members, k), "covariates");

        text = json_string_value(json_object_get(all, name));
        if (text && !looks_like_number(text)) {
            i = k;
            break;
        }
    }
    id = json_string_value(json_object_get(json_array_get(members, i), "id"));
    text = json_string_value(
        json_object_get(json_object_get(json_array_get(members, i), "covariates"), name));
    problem_add(
        inputs->list, pointer,
        "\"%.60s\" of member %zu of the cohort (%.40s) is the text \"%.60s\", not a number, "
        "true or false: %s",
        name, i, id ? id : "", text ? text : "", covariate_text_advice(text ? text : ""));
}

static void refuse_value(struct process_inputs *inputs, const json_t *members, size_t i,
                         const json_t *value, const char *name, const char *pointer)
{
    char there[NAMES_SHOWN], who[GROUP_MEMBER_TEXT];

    if (value && !json_is_null(value)) {
        refuse_text(inputs, members, i, name, pointer);
        return;
    }
    list_names(members, there);
    group_member_text(inputs, members, i, who);
    problem_add(inputs->list, pointer, "%s of the cohort has no covariate \"%.60s\"; %s%s", who,
                name, there[0] ? "the cohort has " : "the cohort has none", there);
}

bool covariate_takes(double value)
{
    return fabs(value) <= COVARIATE_MOST;
}

double covariate_spread(size_t n, const double *values)
{
    double spread = 0.0;

    for (size_t i = 1; i < n; i++) {
        spread = fmax(spread, fabs(values[i] - values[0]));
    }
    return spread;
}

bool covariate_spread_takes(double spread)
{
    return spread <= 0.0 || (spread >= COVARIATE_SPREAD_LEAST && spread <= COVARIATE_SPREAD_MOST);
}

static void refuse_size(struct process_inputs *inputs, const json_t *members, size_t i,
                        const json_t *value, const char *name, const char *pointer)
{
    char who[GROUP_MEMBER_TEXT];

    group_member_text(inputs, members, i, who);
    problem_add(inputs->list, pointer, "\"%.60s\" of %s of the cohort is %.6g; " COVARIATE_TAKEN,
                name, who, json_number_value(value));
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
            if (!covariate_takes(json_number_value(value))) {
                refuse_size(inputs, members, i, value, name, pointer);
                json_decref(values);
                return NULL;
            }
        } else {
            refuse_value(inputs, members, i, value, name, pointer);
            json_decref(values);
            return NULL;
        }
    }
    return values;
}

void covariate_pointer(const struct process_inputs *inputs, size_t i, char *pointer, size_t size)
{
    if (json_array_size(json_object_get(inputs->canonical, "covariates")) > i) {
        (void)snprintf(pointer, size, "/inputs/covariates/%zu", i);
    } else { /* what the model asks of the cohort */
        (void)snprintf(pointer, size, "/inputs/cohort");
    }
}

json_t *covariate_values(struct process_inputs *inputs, const json_t *members, const json_t *names)
{
    json_t *values = json_array();
    char pointer[64];

    for (size_t i = 0; i < json_array_size(names); i++) {
        json_t *one;

        covariate_pointer(inputs, i, pointer, sizeof pointer);
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

/* The first of those before covariate j that alone tells it; j where it takes several. */
static size_t told_by(size_t n, const double *columns, size_t j, double *pair)
{
    enum srnf_covariate verdicts[2] = {SRNF_COVARIATE_FREE, SRNF_COVARIATE_FREE};

    memcpy(pair + n, columns + j * n, n * sizeof *pair);
    for (size_t k = 0; k < j; k++) {
        memcpy(pair, columns + k * n, n * sizeof *pair);
        if (srnf_covariates_check(2, n, pair, verdicts) == 0 &&
            verdicts[1] == SRNF_COVARIATE_FOLLOWS) {
            return k;
        }
    }
    return j;
}

static void tell_of(struct process_inputs *inputs, const char *pointer, const char *name,
                    const char *by)
{
    if (by) {
        problem_add(inputs->list, pointer,
                    "\"%.60s\" follows from \"%.60s\": leave one of them out", name, by);
    } else {
        problem_add(inputs->list, pointer,
                    "\"%.60s\" follows from those before it together: leave it out", name);
    }
}

void covariates_check(struct process_inputs *inputs, const json_t *names, const json_t *values)
{
    size_t m = json_array_size(values), n = json_array_size(json_array_get(values, 0));
    double *columns = m > 0 && n > 0 ? srnf_alloc((m + 2) * n, sizeof *columns) : NULL;
    enum srnf_covariate *verdicts = columns ? srnf_alloc(m, sizeof *verdicts) : NULL;

    for (size_t k = 0; verdicts && k < m * n; k++) {
        columns[k] = json_number_value(json_array_get(json_array_get(values, k / n), k % n));
    }
    if (!verdicts || srnf_covariates_check(m, n, columns, verdicts)) {
        goto out; /* without memory the comparison itself says so */
    }
    for (size_t j = 0; j < m; j++) {
        const char *name = json_string_value(json_array_get(names, j)), *by;
        char pointer[64];
        double spread = covariate_spread(n, columns + j * n);
        size_t first;

        (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", j);
        if (!covariate_spread_takes(spread)) {
            problem_add(inputs->list, pointer,
                        "the numbers of \"%.60s\" differ by %.3g at most, and " COVARIATE_SPREAD,
                        name ? name : "", spread);
        } else if (verdicts[j] == SRNF_COVARIATE_CONSTANT && spread > 0.0) {
            problem_add(inputs->list, pointer,
                        "\"%.60s\" hardly differs between members, by %.3g at most about %.10g: "
                        "give it less that number in the cohort, or leave it out",
                        name ? name : "", spread, columns[j * n]);
        } else if (verdicts[j] == SRNF_COVARIATE_CONSTANT) {
            problem_add(inputs->list, pointer,
                        "\"%.60s\" is the same for all members: leave it out", name ? name : "");
        } else if (verdicts[j] == SRNF_COVARIATE_FOLLOWS) {
            first = told_by(n, columns, j, columns + m * n);
            by = json_string_value(json_array_get(names, first));
            tell_of(inputs, pointer, name ? name : "", first < j && by ? by : NULL);
        }
    }
out:
    srnf_free(verdicts);
    srnf_free(columns);
}

void covariates_warn(json_t *warnings, const json_t *names, size_t n, const size_t *subjects,
                     const int *group, const double *covariates)
{
    size_t m = json_array_size(names), closest;
    double inflation;

    if (m > 0 &&
        srnf_covariates_inflation(n, subjects, group, m, covariates, &inflation, &closest) == 0 &&
        inflation >= COVARIATES_INFLATION_WARNED && isfinite(inflation)) {
        const char *name = json_string_value(json_array_get(names, closest));

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
}

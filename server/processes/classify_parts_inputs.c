/*
 * classify_parts_inputs.c - what must hold between the inputs of classify-parts, and what the
 * subjects are: their labels and covariates, which their members share.
 */
#include "processes/classify_parts.h"

#include <stdio.h>
#include <string.h>

#include "api/cohorts.h"
#include "toolkit/covariates.h"

#define COPIES 12 /* fields that are held for each surface */
#define SUBJECTS_MIN 3
#define NAMES_SHOWN 240

/* Labels of the subjects, which all their members share; false with a problem noted. */
static bool set_labels(struct process_inputs *given, size_t n)
{
    json_t *cohort = json_object_get(given->canonical, "cohort");
    const json_t *labels = json_object_get(cohort, "labels");
    json_t *own = json_array();

    for (size_t i = 0; i < json_array_size(labels); i++) {
        const json_t *first = json_array_get(labels, i % n), *label = json_array_get(labels, i);

        if (!json_is_string(label) || !json_equal(first, label)) {
            const json_t *subject = json_array_get(json_object_get(cohort, "subjects"), i);

            problem_add(given->list, "/inputs/cohort",
                        json_is_string(label)
                            ? "subject \"%.60s\" has members of different labels: give all its "
                              "parts one, or others of them another subject"
                            : "subject \"%.60s\" has a member without a label: give all its parts "
                              "the same",
                        json_string_value(subject));
            json_decref(own);
            return false;
        }
        if (i < n) {
            (void)json_array_append(own, json_array_get(labels, i));
        }
    }
    (void)json_object_set_new(cohort, "subjectLabels", own);
    return true;
}

static bool says_nothing(const json_t *value)
{
    return !value || json_is_null(value);
}

static bool agree(const json_t *a, const json_t *b)
{
    if (says_nothing(a) || says_nothing(b)) {
        return true;
    }
    return json_is_number(a) && json_is_number(b) ? json_number_value(a) == json_number_value(b)
                                                  : json_equal(a, b);
}

/* What another member says of its subject and was not said so far. */
static void fill_in(json_t *known, json_t *own)
{
    const char *name;
    json_t *value;

    json_object_foreach(own, name, value)
    {
        if (says_nothing(json_object_get(known, name))) {
            (void)json_object_set(known, name, value);
        }
    }
}

/* What the members of each subject say of it, [n]; NULL with a problem noted. */
static json_t *gather(struct process_inputs *given, const json_t *names, size_t n)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    json_t *members = group_stored_members(given), *by_subject = json_object(),
           *list = json_array();
    bool good = members != NULL;

    for (size_t i = 0; good && i < json_array_size(members); i++) {
        const json_t *member = json_array_get(members, i);
        const char *subject = json_string_value(json_object_get(member, "subject"));
        json_t *own = json_object_get(member, "covariates");
        json_t *known = json_object_get(by_subject, subject ? subject : "");

        for (size_t k = 0; known && good && k < json_array_size(names); k++) {
            const char *name = json_string_value(json_array_get(names, k));
            const json_t *value = json_object_get(own, name);
            const json_t *before = json_object_get(known, name);

            good = agree(value, before);
            if (!good) {
                problem_add(given->list, "/inputs/covariates",
                            "\"%.60s\" differs between the members of subject \"%.60s\", which are "
                            "parts of one: give all the same, or only one of them",
                            name, subject);
            }
        }
        if (known) {
            fill_in(known, own);
        } else {
            (void)json_object_set_new(by_subject, subject ? subject : "",
                                      own ? json_copy(own) : json_object());
        }
    }
    for (size_t i = 0; good && i < n; i++) {
        const char *subject =
            json_string_value(json_array_get(json_object_get(cohort, "subjects"), i));

        (void)json_array_append_new(list, json_pack("{s:s, s:O}", "id", subject, "covariates",
                                                    json_object_get(by_subject, subject)));
    }
    json_decref(members);
    json_decref(by_subject);
    if (!good) {
        json_decref(list);
        return NULL;
    }
    return list;
}

/* The names of what any subject has, for a sentence. */
static void list_names(const json_t *subjects, char text[NAMES_SHOWN])
{
    json_t *seen = json_object(), *subject;
    size_t i;

    json_array_foreach(subjects, i, subject)
    {
        (void)json_object_update_missing(seen, json_object_get(subject, "covariates"));
    }
    cohort_list_names(seen, text, NAMES_SHOWN);
    json_decref(seen);
}

/* Whether each subject has a number of that name; otherwise a problem that names one. */
static bool check_value(struct process_inputs *given, const json_t *subjects, const char *name,
                        size_t k)
{
    char pointer[64], there[NAMES_SHOWN];
    json_t *subject;
    size_t i;

    covariate_pointer(given, k, pointer, sizeof pointer);
    json_array_foreach(subjects, i, subject)
    {
        const char *id = json_string_value(json_object_get(subject, "id"));
        const json_t *value = json_object_get(json_object_get(subject, "covariates"), name);

        if (says_nothing(value)) {
            list_names(subjects, there);
            problem_add(given->list, pointer, "subject \"%.60s\" has no covariate \"%.60s\"; %s%s",
                        id, name, there[0] ? "the cohort has " : "the cohort has none", there);
            return false;
        }
        if (json_is_string(value)) {
            problem_add(
                given->list, pointer,
                "\"%.60s\" of subject \"%.60s\" is the text \"%.60s\", not a number, true or "
                "false: %s",
                name, id, json_string_value(value),
                covariate_text_advice(json_string_value(value)));
            return false;
        }
    }
    return true;
}

bool classify_parts_values(struct process_inputs *given, const json_t *names, size_t n)
{
    json_t *subjects = gather(given, names, n);
    bool good = subjects != NULL;

    for (size_t k = 0; good && k < json_array_size(names); k++) {
        good = check_value(given, subjects, json_string_value(json_array_get(names, k)), k);
    }
    if (good) {
        (void)json_object_set_new(json_object_get(given->canonical, "cohort"), "values",
                                  covariate_values(given, subjects, names));
    }
    json_decref(subjects);
    return good;
}

/* Those of the input covariates, which must each tell something. */
static bool set_values(struct process_inputs *given, size_t n)
{
    const json_t *names = json_object_get(given->canonical, "covariates");

    if (!classify_parts_values(given, names, n)) {
        return false;
    }
    if (!given->list->errors) {
        const json_t *cohort = json_object_get(given->canonical, "cohort");

        covariates_check(given, names, json_object_get(cohort, "values"));
    }
    return !given->list->errors;
}

size_t classify_parts_count(const json_t *canonical)
{
    const json_t *cohort = json_object_get(canonical, "cohort");
    bool sizes = inputs_chose(canonical, "scale", "shape-and-size");

    return json_array_size(json_object_get(canonical, "covariates")) +
           (sizes ? json_array_size(json_object_get(cohort, "parts")) : 0);
}

bool classify_parts_classes(const json_t *cohort, struct classify_classes *classes)
{
    json_t *view = json_pack("{s:O}", "labels", json_object_get(cohort, "subjectLabels"));
    size_t missing = 0;
    bool found = view && classify_classes_find(view, NULL, classes, &missing);

    json_decref(view); /* the names are borrowed from the labels of the cohort */
    return found;
}

static void check_folds(struct process_inputs *given, const struct classify_classes *classes)
{
    long components = (long)json_integer_value(json_object_get(given->canonical, "components"));
    size_t numbers = classify_parts_count(given->canonical);
    size_t features = (components ? (size_t)components : 1) + numbers;
    size_t freedom = inputs_chose(given->canonical, "covariance", "class")
                         ? classes->subjects[classes->smallest] - 2
                         : classes->determined;

    if (classify_check_count(given, numbers) && features > freedom) {
        problem_add(given->list, components ? "/inputs/components" : "/inputs/covariance",
                    "asks for a covariance of %zu features, sizes and covariates counted; the "
                    "training subjects of a fold determine one of %zu",
                    features, freedom);
    }
}

static void check_methods(struct process_inputs *given)
{
    const json_t *name;
    size_t i;

    json_array_foreach(json_object_get(given->canonical, "method"), i, name)
    {
        const struct srnf_method *method = classify_method_find(json_string_value(name));

        if (method && method->metric != SRNF_METRIC_SRNF && method->metric != SRNF_METRIC_SRM) {
            problem_add(given->list, "/inputs/method",
                        "%s has no joint comparison: take srnf-gauss, srnf-nn, srm-gauss or srm-nn",
                        method->name);
        }
    }
}

void classify_parts_complete_by(struct process_inputs *given, size_t copies, size_t least,
                                classify_check_folds *check)
{
    json_t *cohort = json_object_get(given->canonical, "cohort");
    size_t members = json_array_size(json_object_get(cohort, "surfaces"));
    long degree = inputs_integer(given, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, given->degree);
    json_t *view;
    size_t n;

    inputs_check_memory(given, members, degree, copies, 0.0);
    if (!given->list->errors) {
        pca_parts_complete(given);
    }
    if (given->answered || given->list->errors) {
        return;
    }
    n = members / json_array_size(json_object_get(cohort, "parts"));
    if (set_labels(given, n) && set_values(given, n)) {
        view =
            json_pack("{s:O, s:n}", "labels", json_object_get(cohort, "subjectLabels"), "subjects");
        classify_classes_check(given, view, least, check);
        json_decref(view);
    }
}

void classify_parts_complete(struct process_inputs *given)
{
    check_methods(given);
    classify_parts_complete_by(given, COPIES, SUBJECTS_MIN, check_folds);
}

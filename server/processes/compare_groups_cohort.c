/*
 * compare_groups_cohort.c - the cohort of the process compare-groups: its two labels, the group of
 * each member, and the covariates.
 */
#include "processes/compare_groups.h"

#include <stdio.h>
#include <string.h>

#include "text.h"
#include "toolkit/covariates.h"

/* The constant, the group, and what a covariance of displacements in space needs. */
#define SUBJECTS_MIN(covariates) ((covariates) + 5)
/* Inflation of the variance from which on srnf_compare_groups refuses: 1e-8 of the length is
   left. */
#define DETERMINED 1e16

#define WHY_NOT_COMPARED                                                                          \
    "compare-groups compares groups of different subjects: members of one subject are averaged, " \
    "and whole subjects exchange their labels. Take members of one label of each subject. Two "   \
    "visits of each subject, told apart by their time, are compared by change."

/* ---- Typed ----------------------------------------------------------------------------------- */

static bool type_cohort(const json_t *value, void *member)
{
    struct compared *compared = member;
    const json_t *group = json_object_get(value, "group");
    const json_t *columns = json_object_get(value, "covariates");
    size_t n = json_array_size(group), m = json_array_size(columns);

    compared->n_covariates = m;
    compared->which = srnf_alloc(n ? n : 1, sizeof *compared->which);
    compared->covariates = srnf_alloc(n * m > 0 ? n * m : 1, sizeof *compared->covariates);
    if (!compared->which || !compared->covariates || !group_type_members(value, &compared->group) ||
        compared->group.n != n) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        compared->which[i] = (int)json_integer_value(json_array_get(group, i));
        for (size_t j = 0; j < m; j++) {
            compared->covariates[i * m + j] =
                json_number_value(json_array_get(json_array_get(columns, j), i));
        }
    }
    return true;
}

static void clear_cohort(void *member)
{
    struct compared *compared = member;

    group_input_clear(&compared->group);
    srnf_free(compared->which);
    srnf_free(compared->covariates);
}

const struct input_own compare_groups_cohort = {
    .schema = GROUP_MEMBERS_SCHEMA,
    .refers = true,
    .read = group_read_members,
    .type = type_cohort,
    .clear = clear_cohort,
};

/* ---- Canonical ------------------------------------------------------------------------------- */

/* The two labels, in the order of strcmp; false with a problem noted. */
static bool find_labels(struct process_inputs *given, const json_t *members, const char *labels[2])
{
    size_t found = 0;
    char who[GROUP_MEMBER_TEXT];

    for (size_t i = 0; i < json_array_size(members); i++) {
        const char *label = json_string_value(json_object_get(json_array_get(members, i), "label"));
        bool known = false;

        if (!label) {
            group_member_text(given, members, i, who);
            problem_add(given->list, "/inputs/cohort", "%s has no label", who);
            return false;
        }
        for (size_t k = 0; k < found; k++) {
            known = known || strcmp(label, labels[k]) == 0;
        }
        if (!known && found == 2) {
            problem_add(given->list, "/inputs/cohort",
                        "has more than two labels: \"%.60s\", \"%.60s\", \"%.60s\"", labels[0],
                        labels[1], label);
            return false;
        }
        if (!known) {
            labels[found++] = label;
        }
    }
    if (found < 2) {
        problem_add(given->list, "/inputs/cohort", "has one label only: \"%.60s\"",
                    found ? labels[0] : "");
        return false;
    }
    if (strcmp(labels[0], labels[1]) > 0) {
        const char *swap = labels[0];
        labels[0] = labels[1];
        labels[1] = swap;
    }
    return true;
}

/* labels, and the group of each member; each must have two subjects at least. */
static bool set_groups(struct process_inputs *given, const json_t *members, json_t *cohort)
{
    const char *labels[2] = {NULL, NULL};
    json_t *group = json_array();
    size_t count[2] = {0, 0}, members_of[2] = {0, 0}, n = json_array_size(members), subjects, most;
    size_t *numbers;

    if (!find_labels(given, members, labels)) {
        json_decref(group);
        return false;
    }
    for (size_t i = 0; i < json_array_size(members); i++) {
        const json_t *label = json_object_get(json_array_get(members, i), "label");
        int which = strcmp(json_string_value(label), labels[1]) == 0;

        members_of[which]++;
        (void)json_array_append_new(group, json_integer(which));
    }
    numbers = group_subject_numbers(json_object_get(cohort, "subjects"), n, &subjects, &most);
    for (size_t i = 0; numbers && i < n; i++) {
        if (numbers[i] == i) { /* the first of its subject, whose members have one label */
            count[json_integer_value(json_array_get(group, i))]++;
        }
    }
    srnf_free(numbers);
    (void)json_object_set_new(cohort, "groups", json_pack("[s, s]", labels[0], labels[1]));
    (void)json_object_set_new(cohort, "group", group);
    (void)json_object_set_new(cohort, "sizes",
                              json_pack("{s:[I, I], s:[I, I]}", "members",
                                        (json_int_t)members_of[0], (json_int_t)members_of[1],
                                        "subjects", (json_int_t)count[0], (json_int_t)count[1]));
    if (!group_check_labels(given, json_object_get(cohort, "subjects"),
                            json_object_get(cohort, "labels"), WHY_NOT_COMPARED)) {
        return false;
    }
    if (count[0] < 2 || count[1] < 2) {
        problem_add(
            given->list, "/inputs/cohort",
            "has %zu subject%s of label \"%.60s\" and %zu of \"%.60s\"; each group needs two",
            count[0], plural(count[0]), labels[0], count[1], labels[1]);
        return false;
    }
    return true;
}

/* Values of the covariates into the cohort. */
static void set_covariates(struct process_inputs *given, const json_t *members, json_t *cohort)
{
    const json_t *names = json_object_get(given->canonical, "covariates");
    json_t *values = covariate_values(given, members, names);

    if (json_array_size(values) == json_array_size(names)) {
        covariates_check(given, names, values);
    }
    (void)json_object_set_new(cohort, "covariates", values);
}

static void check_subjects(struct process_inputs *given, const json_t *cohort)
{
    const json_t *sizes = json_object_get(json_object_get(cohort, "sizes"), "subjects");
    size_t covariates = json_array_size(json_object_get(given->canonical, "covariates"));
    size_t subjects = 0;
    char with[48] = "a comparison";

    for (size_t i = 0; i < json_array_size(sizes); i++) {
        subjects += (size_t)json_integer_value(json_array_get(sizes, i));
    }
    if (covariates > 0) {
        (void)snprintf(with, sizeof with, "%zu covariate%s", covariates, plural(covariates));
    }
    if (subjects < SUBJECTS_MIN(covariates)) {
        problem_add(given->list, "/inputs/cohort",
                    "has %zu subject%s, too few for %s: %zu are needed", subjects, plural(subjects),
                    with, SUBJECTS_MIN(covariates));
    }
}

/* Covariates that determine the group leave no difference that could be told apart from theirs. */
static void check_groups_left(struct process_inputs *given, const json_t *cohort)
{
    const json_t *names = json_object_get(given->canonical, "covariates");
    const json_t *columns = json_object_get(cohort, "covariates");
    const json_t *group = json_object_get(cohort, "group");
    size_t n = json_array_size(group), m = json_array_size(names), closest = 0, subjects, most;
    size_t *numbers =
        group_subject_numbers(json_object_get(cohort, "subjects"), n, &subjects, &most);
    int *which = srnf_alloc(n, sizeof *which);
    double *values = srnf_alloc(n * m + 1, sizeof(double)), inflation = 1.0;
    char pointer[64];

    if (!numbers || !which || !values) {
        json_memory_fail();
    } else if (json_array_size(columns) == m) {
        for (size_t k = 0; k < n * m; k++) {
            values[k] = json_number_value(json_array_get(json_array_get(columns, k % m), k / m));
        }
        for (size_t i = 0; i < n; i++) {
            which[i] = (int)json_integer_value(json_array_get(group, i));
        }
        if (srnf_covariates_inflation(n, numbers, which, m, values, &inflation, &closest)) {
            json_memory_fail();
        }
    }
    if (!(inflation < DETERMINED)) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", closest);
        problem_add(given->list, pointer,
                    "\"%.60s\" %s the label: no difference of the groups can be told apart from "
                    "theirs",
                    json_string_value(json_array_get(names, closest)),
                    m > 1 ? "and the other covariates determine" : "determines");
    }
    srnf_free(numbers);
    srnf_free(which);
    srnf_free(values);
}

void compare_groups_describe(struct process_inputs *given)
{
    json_t *cohort = json_object_get(given->canonical, "cohort");
    json_t *members = group_stored_members(given);

    if (set_groups(given, members, cohort)) {
        set_covariates(given, members, cohort);
        check_subjects(given, cohort);
        if (!given->list->errors) {
            check_groups_left(given, cohort);
        }
    }
    json_decref(members);
}

/*
 * regress_inputs.c - the inputs of the process regress that have a shape of their own: the formula,
 * the points at which surfaces are predicted, and the cohort with the design that both make of its
 * covariates.
 */
#include "processes/regress.h"

#include <stdio.h>

/* ---- The formula ----------------------------------------------------------------------------- */

static void read_formula(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    const char *text = json_string_value(value);
    struct formula *formula = srnf_alloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];

    if (!formula) {
        json_memory_fail();
    } else if (!text) {
        problem_add(inputs->list, "/inputs/formula", "%s a formula, as shape ~ age + sex",
                    value && !json_is_null(value) ? "must be" : "is required:");
    } else if (!formula_parse(text, formula, problem)) {
        problem_add(inputs->list, "/inputs/formula", "%s", problem);
    } else {
        (void)json_object_set_new(inputs->canonical, input->name, json_string(text));
    }
    srnf_free(formula);
}

static bool type_formula(const json_t *value, void *member)
{
    (void)member; /* what the computation needs of it is in the design */
    return json_is_string(value);
}

const struct input_own regress_formula = {
    .schema = "\"type\":\"string\",\"minLength\":3,\"maxLength\":" PROCESS_TEXT(FORMULA_TEXT_MAX),
    .read = read_formula,
    .type = type_formula,
};

/* ---- Points ---------------------------------------------------------------------------------- */

static void read_at(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *given = json_object_get(inputs->given, input->name);
    json_t *points = json_array();
    char pointer[64];

    if (given && !json_is_array(given)) {
        problem_add(inputs->list, "/inputs/at", "must be an array of objects");
    } else if (json_array_size(given) > DESIGN_AT_MAX) {
        problem_add(inputs->list, "/inputs/at", "has %zu points; at most %d are taken",
                    json_array_size(given), DESIGN_AT_MAX);
        given = NULL;
    }
    for (size_t k = 0; k < json_array_size(given); k++) {
        json_t *point = json_array_get(given, k);

        if (!json_is_object(point)) {
            (void)snprintf(pointer, sizeof pointer, "/inputs/at/%zu", k);
            problem_add(inputs->list, pointer, "must be an object of covariates and their values");
        }
        (void)json_array_append_new(points, json_deep_copy(point));
    }
    (void)json_object_set_new(inputs->canonical, input->name, points);
}

static bool type_at(const json_t *value, void *member)
{
    (void)member;
    return json_is_array(value);
}

const struct input_own regress_at = {
    .schema = "\"type\":\"array\",\"maxItems\":" PROCESS_TEXT(
        DESIGN_AT_MAX) ",\"items\":{\"type\":\"object\"},\"default\":[]",
    .read = read_at,
    .type = type_at,
};

/* ---- The cohort ------------------------------------------------------------------------------ */

static bool type_cohort(const json_t *value, void *member)
{
    struct regress *asked = (void *)((char *)member - offsetof(struct regress, group));

    return group_type_members(value, &asked->group) &&
           design_type(json_object_get(value, "design"), asked->group.n, &asked->design);
}

static void clear_cohort(void *member)
{
    struct regress *asked = (void *)((char *)member - offsetof(struct regress, group));

    group_input_clear(&asked->group);
    design_clear(&asked->design);
}

/* The numbers of the design are made of the cohort and the formula, which the result names. */
static void echo_cohort(json_t *cohort)
{
    json_t *design = json_object_get(cohort, "design");

    (void)json_object_del(design, "rows");
    (void)json_object_del(design, "atRows");
    (void)json_object_del(design, "tests");
    (void)json_object_del(design, "mixed");
    (void)json_object_del(design, "alike");
    (void)json_object_del(design, "missing");
}

const struct input_own regress_cohort = {
    .schema = GROUP_MEMBERS_SCHEMA,
    .refers = true,
    .read = group_read_members,
    .type = type_cohort,
    .clear = clear_cohort,
    .echo = echo_cohort,
};

void regress_describe(struct process_inputs *given)
{
    json_t *cohort = json_object_get(given->canonical, "cohort"), *members;
    const char *text = json_string_value(json_object_get(given->canonical, "formula"));
    struct formula *formula = srnf_alloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];

    members = group_stored_members(given);
    if (!formula) {
        json_memory_fail();
    } else if (!given->answered && text && formula_parse(text, formula, problem)) {
        design_describe(given, formula, members, cohort, json_object_get(given->canonical, "at"),
                        "/inputs/at/");
    }
    srnf_free(formula);
    json_decref(members);
}

/*
 * paired_inputs.c - the inputs of change and asymmetry that have a shape of their own, as they are
 * typed.
 */
#include "processes/paired.h"

#include <math.h>
#include <stdio.h>

const char *const paired_scales[] = {"shape-and-size", "shape", NULL};

static size_t *type_places(const json_t *places, size_t n)
{
    size_t *typed = srnf_alloc(n ? n : 1, sizeof *typed);

    for (size_t i = 0; typed && i < n; i++) {
        typed[i] = (size_t)json_integer_value(json_array_get(places, i));
    }
    return typed;
}

static bool type_cohort(const json_t *value, void *member)
{
    struct paired *asked = (void *)((char *)member - offsetof(struct paired, group));

    asked->n = json_array_size(json_object_get(value, "first"));
    asked->first = type_places(json_object_get(value, "first"), asked->n);
    asked->second = type_places(json_object_get(value, "second"), asked->n);
    if (json_object_get(value, "firstCount")) {
        asked->first_count = type_places(json_object_get(value, "firstCount"), asked->n);
        asked->second_count = type_places(json_object_get(value, "secondCount"), asked->n);
        if (!asked->first_count || !asked->second_count) {
            return false;
        }
    }
    asked->turned = json_is_true(json_object_get(value, "turned"));
    if (!asked->first || !asked->second || !group_type_members(value, &asked->group)) {
        return false;
    }
    for (size_t i = 0; asked->turned && i < asked->group.n; i++) {
        asked->group.mirrored.member[i] = !asked->group.mirrored.member[i];
    }
    return true;
}

static void clear_cohort(void *member)
{
    struct paired *asked = (void *)((char *)member - offsetof(struct paired, group));

    group_input_clear(&asked->group);
    srnf_free(asked->first);
    srnf_free(asked->second);
    srnf_free(asked->first_count);
    srnf_free(asked->second_count);
}

const struct input_own paired_cohort = {
    .schema = GROUP_MEMBERS_SCHEMA,
    .refers = true,
    .read = group_read_members,
    .type = type_cohort,
    .clear = clear_cohort,
};

static void read_time(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    char pointer[64];

    if (!value || json_is_null(value)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
    } else if (json_is_number(value) && isfinite(json_number_value(value))) {
        (void)json_object_set_new(inputs->canonical, input->name,
                                  json_real(json_number_value(value) + 0.0));
    } else {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s", input->name);
        problem_add(inputs->list, pointer, "must be a number, a time of members, or null");
    }
}

/* The computation has the places of the members. */
static bool type_time(const json_t *value, void *member)
{
    (void)member;
    return json_is_number(value) || json_is_null(value);
}

const struct input_own paired_time = {
    .schema = "\"type\":[\"number\",\"null\"],\"default\":null",
    .read = read_time,
    .type = type_time,
};

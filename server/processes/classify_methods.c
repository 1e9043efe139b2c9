/*
 * classify_methods.c - the inputs method and components of the process classify.
 */
#include "processes/classify.h"

#include <math.h>
#include <string.h>

/* The first is the default. */
static const struct srnf_method methods[CLASSIFY_METHODS] = {
    {.name = "srnf-gauss", .metric = SRNF_METRIC_SRNF, .gauss = true},
    {.name = "srnf-nn", .metric = SRNF_METRIC_SRNF},
    {.name = "srm-gauss", .metric = SRNF_METRIC_SRM, .gauss = true},
    {.name = "srm-nn", .metric = SRNF_METRIC_SRM},
    {.name = "harmonic-nn", .metric = SRNF_METRIC_HARMONIC},
    {.name = "icp-nn", .metric = SRNF_METRIC_ICP},
    {.name = "spharm-pdm", .metric = SRNF_METRIC_SPHARM},
};
#define METHODS_SCHEMA                                                                 \
    "[\"srnf-gauss\",\"srnf-nn\",\"srm-gauss\",\"srm-nn\",\"harmonic-nn\",\"icp-nn\"," \
    "\"spharm-pdm\"]"

struct typicality_method classify_method_named(const struct srnf_method *method)
{
    return (struct typicality_method){.name = method->name,
                                      .registers = method->metric != SRNF_METRIC_HARMONIC &&
                                                   method->metric != SRNF_METRIC_SPHARM};
}

const struct srnf_method *classify_method_find(const char *name)
{
    for (size_t m = 0; name && m < CLASSIFY_METHODS; m++) {
        if (strcmp(methods[m].name, name) == 0) {
            return &methods[m];
        }
    }
    return NULL;
}

/* One name or an array of different ones; canonical: the array. */
static void read_methods(struct process_inputs *given, const struct process_input *input)
{
    const json_t *value = json_object_get(given->given, input->name);
    json_t *list = json_array(), *names;

    if (!value) {
        names = json_pack("[s]", methods[0].name);
    } else {
        names = json_is_array(value) ? json_deep_copy(value) : json_pack("[O]", value);
    }
    for (size_t i = 0; i < json_array_size(names); i++) {
        const char *name = json_string_value(json_array_get(names, i));
        bool again = false;

        for (size_t j = 0; name && j < json_array_size(list); j++) {
            again = again || strcmp(json_string_value(json_array_get(list, j)), name) == 0;
        }
        if (!classify_method_find(name) || again) {
            problem_add(given->list, "/inputs/method",
                        again ? "names a method twice"
                              : "must be srnf-gauss, srnf-nn, srm-gauss, srm-nn, harmonic-nn, "
                                "icp-nn or spharm-pdm, or a list of them");
            break;
        }
        (void)json_array_append_new(list, json_string(name));
    }
    if (json_array_size(names) == 0) {
        problem_add(given->list, "/inputs/method", "names no method");
    }
    json_decref(names);
    (void)json_object_set_new(given->canonical, input->name, list);
}

static bool type_methods(const json_t *value, void *member)
{
    struct classify_methods *typed = member;

    typed->n = json_array_size(value);
    for (size_t m = 0; m < typed->n && m < CLASSIFY_METHODS; m++) {
        const struct srnf_method *method =
            classify_method_find(json_string_value(json_array_get(value, m)));

        if (!method) {
            return false;
        }
        typed->list[m] = *method;
    }
    return typed->n >= 1 && typed->n <= CLASSIFY_METHODS;
}

/* "auto" or a number. */
static void read_components(struct process_inputs *given, const struct process_input *input)
{
    const json_t *value = json_object_get(given->given, input->name);
    const char *text = json_string_value(value);
    double number = json_number_value(value);

    if (!value || (text && strcmp(text, "auto") == 0)) {
        (void)json_object_set_new(given->canonical, input->name, json_string("auto"));
    } else if (!json_is_number(value) || floor(number) != number ||
               !(number >= 1.0 && number <= PROCESS_CLASSIFY_COMPONENTS_MAX)) {
        problem_add(given->list, "/inputs/components", "must be \"auto\" or a number from 1 to %d",
                    PROCESS_CLASSIFY_COMPONENTS_MAX);
    } else {
        (void)json_object_set_new(given->canonical, input->name, json_integer((json_int_t)number));
    }
}

static bool type_components(const json_t *value, void *member)
{
    *(long *)member = (long)json_integer_value(value); /* 0: auto */
    return true;
}

const struct input_own classify_method_own = {
    .schema = "\"oneOf\":[{\"enum\":" METHODS_SCHEMA "},{\"type\":\"array\",\"minItems\":1,"
              "\"uniqueItems\":true,\"items\":{\"enum\":" METHODS_SCHEMA
              "}}],\"default\":[\"srnf-gauss\"]",
    .read = read_methods,
    .type = type_methods,
};
const struct input_own classify_components_own = {
    .schema =
        "\"oneOf\":[{\"enum\":[\"auto\"]},{\"type\":\"integer\",\"minimum\":1,"
        "\"maximum\":" PROCESS_TEXT(PROCESS_CLASSIFY_COMPONENTS_MAX) "}],\"default\":\"auto\"",
    .read = read_components,
    .type = type_components,
};

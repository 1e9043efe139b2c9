/*
 * table.c - what follows from the table of a process: validation and canonical form, JSON
 * Schema, the typed inputs.
 *
 * Inputs are read in two rounds: first what can be judged by itself, then what refers to the store,
 * which is looked up only if nothing else is wrong. So a client hears of all mistakes in one form
 * before it hears that an id is not there.
 */
#include "toolkit/table.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "toolkit/group.h"
#include "store/model.h"

#define DIALECT "https://json-schema.org/draft/2020-12/schema"

static bool is_reference(const struct process_input *input)
{
    enum input_kind kind = input->kind;

    return kind == INPUT_MESH || kind == INPUT_SURFACE || kind == INPUT_MODEL ||
           (kind == INPUT_OWN && input->own->refers);
}

/* Whether the inputs, given or canonical, have something else in the stead of this one. */
static bool is_replaced(const struct process_input *input, const json_t *inputs)
{
    const json_t *other = input->unless ? json_object_get(inputs, input->unless) : NULL;

    return other && !json_is_null(other);
}

/* ---- Validation ------------------------------------------------------------------------------ */

static void read_replaced(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *given = json_object_get(inputs->given, input->name);
    char pointer[64];

    if (given && !json_is_null(given)) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s", input->name);
        problem_add(inputs->list, pointer, "must be left out where %s is given", input->unless);
    }
    (void)json_object_set_new(inputs->canonical, input->name, json_null());
}

static void read_input(struct process_inputs *inputs, const struct process_input *input)
{
    const struct input_numbers *numbers = input->numbers;
    bool absent = !json_object_get(inputs->given, input->name);

    if (absent && input->derived) {
        return;
    }
    switch (input->kind) {
    case INPUT_INTEGER:
        if (input->nullable) {
            (void)inputs_integer_or_null(inputs, input->name, (long)input->lowest,
                                         (long)input->highest);
        } else {
            (void)inputs_integer(inputs, input->name, (long)input->lowest, (long)input->highest,
                                 (long)input->fallback);
        }
        break;
    case INPUT_REAL:
        (void)inputs_real(inputs, input->name, input->lowest, input->highest, input->fallback);
        break;
    case INPUT_BOOLEAN:
        (void)inputs_boolean(inputs, input->name, input->fallback != 0.0);
        break;
    case INPUT_CHOICE:
        (void)inputs_choice(inputs, input->name, input->choices);
        break;
    case INPUT_NUMBERS:
        inputs_numbers(inputs, input->name, input->most, input->highest, numbers->n,
                       numbers->values);
        break;
    case INPUT_OWN:
        input->own->read(inputs, input);
        break;
    case INPUT_MESH:
    case INPUT_SURFACE:
    case INPUT_MODEL:
        break;
    }
}

static void read_reference(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    struct store_model model;
    long degree;

    if (input->kind == INPUT_OWN) {
        input->own->read(inputs, input);
    } else if (input->nullable && (!value || json_is_null(value))) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
    } else if (input->kind == INPUT_MESH) {
        (void)inputs_mesh(inputs, input->name);
    } else if (input->kind == INPUT_SURFACE) {
        (void)inputs_surface(inputs, input->name, &degree);
    } else if (inputs_model(inputs, input->model_kind, &model)) {
        store_model_clear(&model);
    }
}

/* What inputs_open takes: the names, ended by NULL. */
static bool open_inputs(struct process_inputs *inputs, const struct process_table *table,
                        struct api_call *call, const json_t *given, struct problem_list *list)
{
    const char *names[32];
    size_t n = 0;

    for (; table->inputs[n].name; n++) {
        assert(n + 1 < sizeof names / sizeof names[0]);
        names[n] = table->inputs[n].name;
    }
    names[n] = NULL;
    return inputs_open(inputs, call, given, list, names);
}

json_t *table_canonicalize(const struct process_table *table, struct api_call *call,
                           const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;

    if (!open_inputs(&inputs, table, call, given, list)) {
        return NULL;
    }
    for (const struct process_input *input = table->inputs; input->name; input++) {
        if (is_replaced(input, given)) {
            read_replaced(&inputs, input);
        } else if (!is_reference(input)) {
            read_input(&inputs, input);
        }
    }
    if (table->check) {
        table->check(&inputs);
    }
    for (const struct process_input *input = table->inputs; input->name; input++) {
        inputs.shape_only = list->errors != NULL;
        if (is_reference(input) && !is_replaced(input, given) && !inputs.answered) {
            read_reference(&inputs, input);
        }
    }
    if (table->complete && !list->errors && !inputs.answered) {
        table->complete(&inputs);
    }
    return inputs_canonical(&inputs);
}

/* ---- Schemas --------------------------------------------------------------------------------- */

/* The members of a fragment, or an empty object where there is no memory. */
static json_t *fragment(const char *members)
{
    size_t length = strlen(members);
    char *text = malloc(length + 3);
    json_t *schema = NULL;

    if (text) {
        text[0] = '{';
        memcpy(text + 1, members, length);
        memcpy(text + length + 1, "}", 2);
        schema = json_loads(text, 0, NULL);
    }
    free(text);
    return schema ? schema : json_object();
}

/* A limit as people write it: whole numbers without a point. */
static json_t *limit(double value, bool whole)
{
    return whole || value == (double)(json_int_t)value ? json_integer((json_int_t)value)
                                                       : json_real(value);
}

static json_t *id_schema(const struct process_input *input)
{
    const char *pattern = input->kind == INPUT_MESH      ? PROCESS_MESH_PATTERN
                          : input->kind == INPUT_SURFACE ? PROCESS_SURFACE_PATTERN
                                                         : PROCESS_MODEL_PATTERN;

    json_t *schema;

    if (!input->nullable) {
        return json_pack("{s:s, s:s}", "type", "string", "pattern", pattern);
    }
    schema = json_pack("{s:[s,s], s:s}", "type", "string", "null", "pattern", pattern);
    if (!input->unless) { /* otherwise it or the other must be given */
        (void)json_object_set_new(schema, "default", json_null());
    }
    return schema;
}

static json_t *number_schema(const struct process_input *input)
{
    bool whole = input->kind == INPUT_INTEGER;
    const char *type = whole ? "integer" : "number";
    json_t *schema = json_object();

    (void)json_object_set_new(
        schema, "type", input->nullable ? json_pack("[s,s]", type, "null") : json_string(type));
    if (input->open) {
        (void)json_object_set_new(schema, "exclusiveMinimum", limit(input->lowest - 1.0, whole));
    } else {
        (void)json_object_set_new(schema, "minimum", limit(input->lowest, whole));
    }
    (void)json_object_set_new(schema, "maximum", limit(input->highest, whole));
    if (input->nullable) {
        (void)json_object_set_new(schema, "default", json_null());
    } else if (!input->derived) {
        (void)json_object_set_new(schema, "default", limit(input->fallback, whole));
    }
    return schema;
}

static json_t *numbers_schema(const struct process_input *input)
{
    json_t *item =
        json_pack("{s:s, s:o, s:o}", "type", "number", "minimum", limit(-input->highest, false),
                  "maximum", limit(input->highest, false));

    return json_pack("{s:s, s:i, s:I, s:o, s:o}", "type", "array", "minItems", 1, "maxItems",
                     (json_int_t)input->most, "items", item, "default",
                     json_vector(input->numbers->values, input->numbers->n));
}

static json_t *choice_schema(const struct process_input *input)
{
    json_t *choices = json_array();

    for (size_t i = 0; input->choices[i]; i++) {
        (void)json_array_append_new(choices, json_string(input->choices[i]));
    }
    return json_pack("{s:o, s:s}", "enum", choices, "default", input->choices[0]);
}

static json_t *input_schema(const struct process_input *input)
{
    switch (input->kind) {
    case INPUT_INTEGER:
    case INPUT_REAL:
        return number_schema(input);
    case INPUT_BOOLEAN:
        return json_pack("{s:s, s:b}", "type", "boolean", "default", input->fallback != 0.0);
    case INPUT_CHOICE:
        return choice_schema(input);
    case INPUT_NUMBERS:
        return numbers_schema(input);
    case INPUT_OWN:
        return fragment(input->own->schema);
    case INPUT_MESH:
    case INPUT_SURFACE:
    case INPUT_MODEL:
        break;
    }
    return id_schema(input);
}

static json_t *described(json_t *schema, const char *text)
{
    (void)json_object_set_new(schema, "description", json_string(text));
    return schema;
}

json_t *table_inputs_schema(const struct process_table *table)
{
    json_t *properties = json_object(), *required = json_array();

    for (const struct process_input *input = table->inputs; input->name; input++) {
        (void)json_object_set_new(properties, input->name,
                                  described(input_schema(input), input->text));
        if (input->required) {
            (void)json_array_append_new(required, json_string(input->name));
        }
    }
    return json_pack("{s:s, s:s, s:b, s:o, s:o}", "$schema", DIALECT, "type", "object",
                     "additionalProperties", 0, "required", required, "properties", properties);
}

/* What every result has beside its inputs and its own members. */
static const struct process_output common_outputs[] = {
    {"warnings",
     OUTPUT_ARRAY ",\"items\":{\"type\":\"object\",\"required\":[\"code\",\"detail\"],"
                  "\"properties\":{\"code\":{" OUTPUT_STRING "},\"detail\":{" OUTPUT_STRING "},"
                  "\"figures\":{" OUTPUT_OBJECT "}}}",
     "Reasons to doubt a number of this result: a stable code, a sentence, and the figures behind "
     "it. Empty: nothing was found."},
    {"numericBuild", OUTPUT_STRING, "What made the numbers."},
    {NULL, NULL, NULL},
};

/* Whether the result has an input in a shorter form. */
static bool shortens(const struct process_table *table)
{
    bool any = false;

    for (const struct process_input *input = table->inputs; input->name; input++) {
        any = any || (input->kind == INPUT_OWN && input->own->echo);
    }
    return any;
}

json_t *table_outputs_schema(const struct process_table *table)
{
    const struct process_output echoed[] = {
        {"inputs", OUTPUT_OBJECT,
         shortens(table) ? "Every option after defaulting; q by its digest."
                         : "Every option after defaulting."},
        {NULL, NULL, NULL},
    };
    const struct process_output *const lists[] = {table->outputs, echoed, common_outputs};
    json_t *properties = json_object();

    for (size_t i = 0; i < 3; i++) {
        for (const struct process_output *output = lists[i]; output->name; output++) {
            (void)json_object_set_new(properties, output->name,
                                      described(fragment(output->schema), output->text));
        }
    }
    return json_pack("{s:s, s:s, s:o}", "$schema", DIALECT, "type", "object", "properties",
                     properties);
}

/* ---- Typed inputs ---------------------------------------------------------------------------- */

static bool type_id(const json_t *value, char id[STORE_ID_MAX])
{
    const char *text = json_string_value(value);

    if (text && strlen(text) < STORE_ID_MAX) {
        memcpy(id, text, strlen(text) + 1);
        return true;
    }
    return json_is_null(value);
}

static bool type_choice(const json_t *value, const char *const *choices, int *place)
{
    const char *text = json_string_value(value);

    for (int i = 0; text && choices[i]; i++) {
        if (strcmp(text, choices[i]) == 0) {
            *place = i;
            return true;
        }
    }
    return false;
}

static bool type_numbers(const json_t *value, struct input_numbers *numbers)
{
    numbers->n = json_array_size(value);
    for (size_t i = 0; i < numbers->n && i < INPUTS_NUMBERS_MAX; i++) {
        numbers->values[i] = json_number_value(json_array_get(value, i));
    }
    return numbers->n > 0 && numbers->n <= INPUTS_NUMBERS_MAX;
}

static bool type_input(const struct process_input *input, const json_t *value, void *member)
{
    switch (input->kind) {
    case INPUT_INTEGER:
        *(long *)member = (long)json_integer_value(value);
        break;
    case INPUT_REAL:
        *(double *)member = json_number_value(value);
        break;
    case INPUT_BOOLEAN:
        *(bool *)member = json_is_true(value);
        break;
    case INPUT_CHOICE:
        return type_choice(value, input->choices, member);
    case INPUT_NUMBERS:
        return type_numbers(value, member);
    case INPUT_MESH:
    case INPUT_SURFACE:
    case INPUT_MODEL:
        return type_id(value, member);
    case INPUT_OWN:
        return input->own->type(value, member);
    }
    return true;
}

bool table_type(const struct process_table *table, const json_t *canonical, void *typed)
{
    bool whole = true;

    memset(typed, 0, table->size);
    for (const struct process_input *input = table->inputs; input->name; input++) {
        const json_t *value = json_object_get(canonical, input->name);

        whole = value &&
                (is_replaced(input, canonical) ||
                 type_input(input, value, (char *)typed + input->member)) &&
                whole;
    }
    return whole;
}

void table_clear(const struct process_table *table, void *typed)
{
    for (const struct process_input *input = table->inputs; input->name; input++) {
        if (input->kind == INPUT_OWN && input->own->clear) {
            input->own->clear((char *)typed + input->member);
        }
    }
}

/* Canonical inputs as the result has them. */
static void echo(const struct process_table *table, json_t *inputs)
{
    for (const struct process_input *input = table->inputs; input->name; input++) {
        if (input->kind == INPUT_OWN && input->own->echo) {
            input->own->echo(json_object_get(inputs, input->name));
        }
    }
}

void table_run(struct jobs_run *run, void *user, const char *text, struct jobs_result *result)
{
    const struct process_table *table = jobs_run_definition(run);
    json_t *inputs = process_parse(text, result), *document;
    void *typed = srnf_alloc(1, table->size);

    (void)user;
    if (inputs && (!typed || !table_type(table, inputs, typed))) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    } else if (inputs) {
        document = table->run(run, typed, result);
        if (document) {
            echo(table, inputs);
            process_finish(run, document, inputs, result);
        } else if (!result->problem_code && json_memory_failed()) {
            process_fail_document(result, "writing the results");
        }
    }
    if (typed) {
        table_clear(table, typed);
    }
    srnf_free(typed);
    json_decref(inputs);
}

/*
 * test_process_schemas.c - what the processes' schemas promise is what their validation does: for
 * every input of every process, its default is what absence means, its limits are the last values
 * that are taken, each word of an enumeration is known, other types are refused, null is taken
 * where it is a type and nowhere else, and nothing else is an input.
 * srnfd-test: once (what inputs mean does not depend on the build)
 */
#include "server/toolkit/process_fixture.h"

#include "toolkit/table.h"

/* Inputs with nothing optional of the processes whose tables do not tell them: @ is a surface,
   # the classifier. */
static const struct {
    const char *process, *text;
} least[] = {
    {"encode", "{\"mesh\":\"" GOOD_MESH "\"}"}, /* or a cohort */
    {"invert", "{\"srnf\":{\"surface\":\"@\"}}"},
    {"evaluate-model", "{\"surfaces\":[\"@\",\"@\",\"@\"]}"},
    {"compare-groups", "{\"cohort\":\"patients\"}"},
    {"regress", "{\"cohort\":\"patients\",\"formula\":\"shape ~ age\"}"},
    {"train", "{\"cohort\":\"trained\"}"},
    {"train-parts", "{\"cohort\":\"structures\"}"},
    {"predict", "{\"model\":\"#\",\"surfaces\":[\"@\"]}"},
    {"project", "{\"model\":\"%\",\"surface\":\"@\"}"},
    {"score", "{\"model\":\"%\",\"surface\":\"@\"}"},
    {"change", "{\"cohort\":\"pairs\"}"},
    {"asymmetry", "{\"cohort\":\"pairs\"}"},
    {"pca-parts", "{\"cohort\":\"pairs\"}"},
    {"classify-parts", "{\"cohort\":\"pairs\"}"},
    {"trajectories", "{\"cohort\":\"pairs\"}"},
    {"shoot", "{\"surface\":\"@\",\"velocity\":{\"toward\":\"@\"}}"},
    {"transport", "{\"from\":\"@\",\"to\":\"@\",\"vector\":{\"toward\":\"@\"}}"},
    {"classify", "{\"cohort\":\"patients\"}"},
    {"extract", "{\"volume\":\"" VOLUME "\",\"labels\":[1]}"},
    {"repair", "{\"mesh\":\"" GOOD_MESH "\"}"}, /* whatever its problems */
    {"mirror", "{\"mesh\":\"" GOOD_MESH "\"}"},
    {"report", "{\"jobs\":[\"" DONE_JOB "\"]}"},
};

/* What a table requires: the mesh, surface or model of the fixture; of a group as many surfaces as
   it has at least. */
static json_t *required_inputs(const struct fixture *fixture, const struct process_table *table)
{
    json_t *inputs = json_object();

    for (const struct process_input *input = table->inputs; input->name; input++) {
        if (strcmp(input->name, "surfaces") == 0) {
            json_t *surfaces = json_array();

            while (json_array_size(surfaces) < PROCESS_GROUP_MIN ||
                   (double)json_array_size(surfaces) < input->lowest) {
                assert_int_equal(json_array_append_new(surfaces, json_string(fixture->surface)), 0);
            }
            assert_int_equal(json_object_set_new(inputs, input->name, surfaces), 0);
        } else if (input->required) {
            const char *id = input->kind == INPUT_MESH      ? GOOD_MESH
                             : input->kind == INPUT_SURFACE ? fixture->surface
                             : input->kind == INPUT_MODEL   ? fixture->model
                                                            : NULL;

            if (!id) {
                fail_msg("%s is required, and not among the least inputs here", input->name);
            }
            assert_int_equal(json_object_set_new(inputs, input->name, json_string(id)), 0);
        }
    }
    return inputs;
}

static json_t *least_inputs(const struct fixture *fixture, const char *process)
{
    const struct api api = {.config.processes = &processes};
    char text[512];

    for (size_t i = 0; i < sizeof least / sizeof least[0]; i++) {
        if (strcmp(least[i].process, process) == 0) {
            expand(fixture, least[i].text, text, sizeof text);
            return json_loads(text, 0, NULL);
        }
    }
    return required_inputs(fixture, api_process_find(&api, process)->table);
}

/* The least inputs with one more; value is taken over. */
static struct outcome with(struct fixture *fixture, const char *process, const char *name,
                           json_t *value)
{
    json_t *inputs = least_inputs(fixture, process);
    struct outcome outcome;

    assert_int_equal(json_object_set_new(inputs, name, value), 0);
    outcome = canonical_outcome(fixture, process, inputs);
    json_decref(inputs);
    return outcome;
}

static void expect(struct fixture *fixture, const char *process, const char *name, json_t *value,
                   bool accepted)
{
    char *text = json_dumps(value, JSON_ENCODE_ANY);
    struct outcome outcome = with(fixture, process, name, value);

    if ((outcome.canonical != NULL) != accepted) {
        fail_msg("%s: %s = %s is %s", process, name, text, accepted ? "refused" : "accepted");
    }
    free(text);
    outcome_clear(&outcome);
}

static void check_default(struct fixture *fixture, const char *process, const char *name,
                          const json_t *fallback)
{
    json_t *inputs = least_inputs(fixture, process);
    struct outcome outcome = canonical_outcome(fixture, process, inputs);
    const json_t *value = json_object_get(outcome.canonical, name);

    if (json_is_number(fallback)) {
        assert_true(json_number_value(value) == json_number_value(fallback));
    } else if (!json_equal(value, fallback)) {
        fail_msg("%s: the default of %s is not what absence means", process, name);
    }
    outcome_clear(&outcome);
    json_decref(inputs);
}

static bool is_whole(const json_t *schema)
{
    const json_t *type = json_object_get(schema, "type");

    type = json_is_array(type) ? json_array_get(type, 0) : type;
    return json_string_value(type) && strcmp(json_string_value(type), "integer") == 0;
}

static void check_limits(struct fixture *fixture, const char *process, const char *name,
                         const json_t *schema)
{
    const json_t *minimum = json_object_get(schema, "minimum");
    const json_t *maximum = json_object_get(schema, "maximum");
    double low = json_number_value(minimum), high = json_number_value(maximum);

    assert_non_null(minimum);
    assert_non_null(maximum);
    if (is_whole(schema)) {
        expect(fixture, process, name, json_integer((json_int_t)low), true);
        expect(fixture, process, name, json_integer((json_int_t)high), true);
        expect(fixture, process, name, json_integer((json_int_t)low - 1), false);
        expect(fixture, process, name, json_integer((json_int_t)high + 1), false);
        expect(fixture, process, name, json_real(low + 0.5), false);
        expect(fixture, process, name, json_real(1e300), false);
    } else {
        expect(fixture, process, name, json_real(low), true);
        expect(fixture, process, name, json_real(high), true);
        expect(fixture, process, name, json_real(low - 1e-3 * (high - low)), false);
        expect(fixture, process, name, json_real(high * 1.001), false);
    }
    expect(fixture, process, name, json_string("7"), false);
    expect(fixture, process, name, json_true(), false);
}

/* How many are accepted follows from other inputs; more than the maximum never are. */
static void check_open_limits(struct fixture *fixture, const char *process, const char *name,
                              const json_t *schema)
{
    json_int_t low = json_integer_value(json_object_get(schema, "exclusiveMinimum"));

    if (!json_is_integer(json_object_get(schema, "maximum"))) {
        fail_msg("%s: %s has no maximum", process, name);
    }
    expect(fixture, process, name, json_integer(low), false);
    expect(fixture, process, name,
           json_integer(json_integer_value(json_object_get(schema, "maximum")) + 1), false);
}

/* Each word is accepted, or asks for another input; others are refused. */
static void check_words(struct fixture *fixture, const char *process, const char *name,
                        const json_t *words)
{
    for (size_t i = 0; i < json_array_size(words); i++) {
        const char *word = json_string_value(json_array_get(words, i));
        struct outcome outcome = with(fixture, process, name, json_string(word));
        const json_t *error = json_array_get(outcome.errors, 0);

        if (!outcome.canonical) {
            const char *detail = json_string_value(json_object_get(error, "detail"));
            assert_non_null(detail);
            assert_non_null(strstr(detail, "is required"));
        }
        outcome_clear(&outcome);
    }
    expect(fixture, process, name, json_string("something-else"), false);
    expect(fixture, process, name, json_integer(1), false);
}

/* Whether null is among the types, or those of a form that it may have. */
static bool is_nullable(const json_t *schema)
{
    const json_t *types = json_object_get(schema, "type"),
                 *forms = json_object_get(schema, "oneOf");
    bool nullable = false;

    for (size_t i = 0; i < json_array_size(types); i++) {
        nullable |= strcmp(json_string_value(json_array_get(types, i)), "null") == 0;
    }
    for (size_t i = 0; i < json_array_size(forms); i++) {
        nullable |= is_nullable(json_array_get(forms, i));
    }
    return nullable;
}

/* Where null is a type it means what absence does, be that a default or a refusal; elsewhere it is
   refused. */
static void check_null(struct fixture *fixture, const char *process, const char *name,
                       const json_t *schema)
{
    json_t *inputs = least_inputs(fixture, process);
    struct outcome absent, null = with(fixture, process, name, json_null());
    bool nullable = is_nullable(schema);

    (void)json_object_del(inputs, name);
    absent = canonical_outcome(fixture, process, inputs);
    if (nullable
            ? !json_equal(null.canonical, absent.canonical) && (null.canonical || absent.canonical)
            : null.canonical != NULL) {
        fail_msg("%s: %s = null is %s", process, name, null.canonical ? "accepted" : "refused");
    }
    outcome_clear(&null);
    outcome_clear(&absent);
    json_decref(inputs);
}

static void check_input(struct fixture *fixture, const char *process, const char *name,
                        const json_t *schema)
{
    const json_t *fallback = json_object_get(schema, "default");

    assert_non_null(json_string_value(json_object_get(schema, "description")));
    if (fallback) {
        check_default(fixture, process, name, fallback);
    }
    if (json_object_get(schema, "minimum")) {
        check_limits(fixture, process, name, schema);
    } else if (json_object_get(schema, "exclusiveMinimum")) {
        check_open_limits(fixture, process, name, schema);
    }
    check_null(fixture, process, name, schema);
    if (json_object_get(schema, "enum")) {
        check_words(fixture, process, name, json_object_get(schema, "enum"));
    }
}

static void test_inputs(void **state)
{
    for (size_t p = 0; processes.rows[p]; p++) {
        const struct api_process *process = processes.rows[p];
        json_t *schema = processes.inputs_schema(process->table);
        json_t *properties = json_object_get(schema, "properties"), *property;
        const char *name;

        assert_non_null(schema);
        assert_true(json_is_false(json_object_get(schema, "additionalProperties")));
        json_object_foreach(properties, name, property)
        {
            check_input(*state, process->id, name, property);
        }
        json_decref(schema);
    }
}

/* Canonical inputs hold every input of the schema, whatever was sent. */
static void test_complete(void **state)
{
    for (size_t p = 0; processes.rows[p]; p++) {
        const struct api_process *process = processes.rows[p];
        json_t *schema = processes.inputs_schema(process->table);
        json_t *properties = json_object_get(schema, "properties"), *property;
        json_t *inputs = least_inputs(*state, process->id);
        struct outcome outcome = canonical_outcome(*state, process->id, inputs);
        const char *name;

        assert_int_equal(json_object_size(outcome.canonical), json_object_size(properties));
        json_object_foreach(properties, name, property)
        {
            assert_non_null(json_object_get(outcome.canonical, name));
        }
        outcome_clear(&outcome);
        json_decref(inputs);
        json_decref(schema);
    }
}

static void test_unknown_and_missing(void **state)
{
    for (size_t p = 0; processes.rows[p]; p++) {
        const struct api_process *process = processes.rows[p];
        json_t *schema = processes.inputs_schema(process->table);
        json_t *required = json_object_get(schema, "required"), *array = json_array();
        struct outcome outcome = with(*state, process->id, "a~b/c", json_integer(1));

        assert_true(has_error(&outcome, "/inputs/a~0b~1c"));
        outcome_clear(&outcome);
        for (size_t i = 0; i < json_array_size(required); i++) {
            const char *name = json_string_value(json_array_get(required, i));
            json_t *inputs = least_inputs(*state, process->id);
            char pointer[80];

            (void)snprintf(pointer, sizeof pointer, "/inputs/%s", name);
            (void)json_object_del(inputs, name);
            outcome = canonical_outcome(*state, process->id, inputs);
            assert_true(has_error(&outcome, pointer));
            outcome_clear(&outcome);
            json_decref(inputs);
        }
        outcome = canonical_outcome(*state, process->id, array);
        assert_true(has_error(&outcome, "/inputs"));
        outcome_clear(&outcome);
        json_decref(array);
        json_decref(schema);
    }
}

static void test_outputs(void **state)
{
    const struct api api = {.config.processes = &processes};

    (void)state;
    for (size_t p = 0; processes.rows[p]; p++) {
        const struct api_process *process = processes.rows[p];
        json_t *schema = processes.outputs_schema(process->table);
        json_t *properties = json_object_get(schema, "properties");

        assert_true(json_object_size(properties) > 2);
        assert_non_null(json_object_get(properties, "inputs"));
        assert_non_null(json_object_get(properties, "numericBuild"));
        assert_non_null(json_object_get(properties, "warnings"));
        assert_non_null(process->title);
        assert_non_null(process->description);
        json_decref(schema);
    }
    assert_null(api_process_find(&api, "no-such-process"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_inputs),
        cmocka_unit_test(test_complete),
        cmocka_unit_test(test_unknown_and_missing),
        cmocka_unit_test(test_outputs),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}

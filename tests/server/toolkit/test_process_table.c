/*
 * test_process_table.c - what follows from the declaration of a process, tried on one made up here:
 * canonical inputs, their problems, the typed inputs and the schemas of each kind of input.
 */
#include "toolkit/table.h"

#include "server/toolkit/process_fixture.h"

struct tea {
    char surface[STORE_ID_MAX], mesh[STORE_ID_MAX], model[STORE_ID_MAX];
    long cups, spoons, cubes;
    double warmth;
    bool milk, cup;
    int kind, lemon;
    struct input_numbers times;
    char *guest; /* owned */
};

static void read_guest(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);

    if (json_is_string(value)) {
        (void)json_object_set_new(inputs->canonical, input->name,
                                  json_string(json_string_value(value)));
    } else {
        problem_add(inputs->list, "/inputs/guest", "must be a name");
    }
}

static bool type_guest(const json_t *value, void *member)
{
    *(char **)member = strdup(json_string_value(value));
    return *(char **)member != NULL;
}

static void echo_guest(json_t *value)
{
    (void)value;
}

static void clear_guest(void *member)
{
    free(*(char **)member);
}

/* A surface, or none. */
static void read_cup(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    long degree;
    const char *id = value ? inputs_surface_at(inputs, value, "/inputs/cup", &degree) : NULL;

    if (id || !value) {
        (void)json_object_set_new(inputs->canonical, input->name,
                                  id ? json_string(id) : json_null());
    }
}

static bool type_cup(const json_t *value, void *member)
{
    *(bool *)member = json_is_string(value);
    return true;
}

/* Green tea has no milk. */
static void check(struct process_inputs *inputs)
{
    const char *kind = json_string_value(json_object_get(inputs->canonical, "kind"));

    if (kind && strcmp(kind, "green") == 0 &&
        json_is_true(json_object_get(inputs->canonical, "milk"))) {
        problem_add(inputs->list, "/inputs/milk", "must be false with green tea");
    }
}

/* Cups, where absent, are two for each spoon; and no more than ten. */
static void complete(struct process_inputs *inputs)
{
    long spoons = (long)json_integer_value(json_object_get(inputs->canonical, "spoons"));

    (void)inputs_integer(inputs, "cups", 1, 10, 2 * spoons);
}

static const char *const kinds[] = {"black", "green", NULL};
static const char *const lemons[] = {"none", "slice", NULL};
static const struct input_numbers times = {2, {0.5, 1.0}};
static const struct input_own guest = {
    .schema = "\"type\":\"string\",\"maxLength\":9",
    .read = read_guest,
    .type = type_guest,
    .clear = clear_guest,
    .echo = echo_guest,
};
static const struct input_own cup = {
    .schema = OUTPUT_STRING,
    .read = read_cup,
    .type = type_cup,
    .refers = true,
};
#define AT(member) offsetof(struct tea, member)
static const struct process_input inputs[] = {
    {"surface", INPUT_SURFACE, AT(surface), "A surface.", .required = true},
    {"mesh", INPUT_MESH, AT(mesh), "A mesh, or none.", .nullable = true},
    {"model", INPUT_MODEL, AT(model), "A model.", .required = true},
    {"cups", INPUT_INTEGER, AT(cups), "Cups.", .lowest = 1, .highest = 10, .open = true,
     .derived = true},
    {"spoons", INPUT_INTEGER, AT(spoons), "Spoons.", .lowest = 1, .highest = 9, .fallback = 2},
    {"cubes", INPUT_INTEGER, AT(cubes), "Cubes.", .lowest = 1, .highest = 4, .nullable = true},
    {"warmth", INPUT_REAL, AT(warmth), "In kelvin.", .lowest = 273.5, .highest = 373,
     .fallback = 350},
    {"milk", INPUT_BOOLEAN, AT(milk), "With milk.", .fallback = 1},
    {"kind", INPUT_CHOICE, AT(kind), "Of tea.", .choices = kinds},
    {"times", INPUT_NUMBERS, AT(times), "In hours.", .highest = 12, .most = 3, .numbers = &times},
    {"guest", INPUT_OWN, AT(guest), "Whose.", .required = true, .own = &guest},
    {"cup", INPUT_OWN, AT(cup), "A cup.", .own = &cup},
    {"lemon", INPUT_CHOICE, AT(lemon), "Not with the mesh.", .choices = lemons, .unless = "mesh"},
    {.name = NULL},
};
static const struct process_output outputs[] = {
    {"pot", OUTPUT_NUMBER_OR_NULL, "Litres."},
    {NULL, NULL, NULL},
};
static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct tea),
    .check = check,
    .complete = complete,
};

static double minutes(const struct api_work *work, const json_t *canonical)
{
    (void)work;
    return 60.0 * (double)json_integer_value(json_object_get(canonical, "cups"));
}

static const struct api_process process = {.id = "tea", .table = &table, .seconds = minutes};

static struct outcome brew(void **state, const char *text)
{
    char whole[1024];
    struct outcome outcome;
    json_t *given;

    expand(*state, text, whole, sizeof whole);
    given = json_loads(whole, 0, NULL);
    assert_non_null(given);
    outcome = canonical_outcome_as(*state, &process, given);
    json_decref(given);
    return outcome;
}

#define LEAST "\"surface\":\"@\",\"model\":\"%\",\"guest\":\"Ada\""

static void test_defaults_are_filled(void **state)
{
    struct outcome outcome = brew(state, "{" LEAST "}");
    json_t *wanted = json_pack(
        "{s:s, s:n, s:s, s:i, s:i, s:n, s:f, s:b, s:s, s:[f,f], s:s, s:n, s:s}", "surface",
        ((struct fixture *)*state)->surface, "mesh", "model", ((struct fixture *)*state)->model,
        "cups", 4, "spoons", 2, "cubes", "warmth", 350.0, "milk", 1, "kind", "black", "times", 0.5,
        1.0, "guest", "Ada", "cup", "lemon", "none");

    assert_true(json_equal(outcome.canonical, wanted));
    assert_true(outcome.seconds == 240.0);
    json_decref(wanted);
    outcome_clear(&outcome);
}

static void test_typed(void **state)
{
    struct fixture *fixture = *state;
    struct outcome outcome =
        brew(state, "{" LEAST ",\"mesh\":\"" GOOD_MESH "\",\"cups\":9,\"spoons\":7.0,\"cubes\":4,"
                    "\"warmth\":300,\"milk\":false,\"kind\":\"green\",\"times\":[3,-0.0,12]}");
    struct tea tea;

    assert_true(table_type(&table, outcome.canonical, &tea));
    assert_string_equal(tea.surface, fixture->surface);
    assert_string_equal(tea.mesh, GOOD_MESH);
    assert_string_equal(tea.model, fixture->model);
    assert_int_equal(tea.cups, 9);
    assert_int_equal(tea.spoons, 7);
    assert_int_equal(tea.cubes, 4);
    assert_true(tea.warmth == 300.0);
    assert_false(tea.milk);
    assert_int_equal(tea.kind, 1);
    assert_int_equal(tea.times.n, 3);
    assert_true(tea.times.values[0] == 3.0 && tea.times.values[2] == 12.0);
    assert_string_equal(tea.guest, "Ada");
    table_clear(&table, &tea);
    outcome_clear(&outcome);
}

/* Of two inputs one takes the other's place: that is null then, and zero when typed. */
static void test_typed_without_what_is_replaced(void **state)
{
    static const char *const texts[] = {
        "{" LEAST ",\"mesh\":\"" GOOD_MESH "\"}",
        "{" LEAST ",\"mesh\":\"" GOOD_MESH "\",\"lemon\":null}",
    };
    struct tea tea;

    for (size_t i = 0; i < 2; i++) {
        struct outcome outcome = brew(state, texts[i]);

        assert_true(json_is_null(json_object_get(outcome.canonical, "lemon")));
        assert_true(table_type(&table, outcome.canonical, &tea));
        assert_int_equal(tea.lemon, 0);
        table_clear(&table, &tea);
        outcome_clear(&outcome);
    }
}

/* null where there is none; and text that is not of this table, as an older version may have left,
   is refused. */
static void test_typed_of_old(void **state)
{
    struct outcome outcome = brew(state, "{" LEAST "}");
    struct tea tea;

    assert_true(table_type(&table, outcome.canonical, &tea));
    assert_string_equal(tea.mesh, "");
    assert_int_equal(tea.cubes, 0);
    table_clear(&table, &tea);
    assert_int_equal(json_object_del(outcome.canonical, "warmth"), 0);
    assert_false(table_type(&table, outcome.canonical, &tea));
    table_clear(&table, &tea);
    (void)json_object_set_new(outcome.canonical, "warmth", json_real(300.0));
    (void)json_object_set_new(outcome.canonical, "kind", json_string("white"));
    assert_false(table_type(&table, outcome.canonical, &tea));
    table_clear(&table, &tea);
    outcome_clear(&outcome);
}

static void test_each_input_is_checked(void **state)
{
    static const struct {
        const char *text, *pointer;
    } wrong[] = {
        {"\"surface\":\"surf-1\",\"model\":\"%\",\"guest\":\"Ada\"", "/inputs/surface"},
        {"\"surface\":\"@\",\"guest\":\"Ada\"", "/inputs/model"},
        {LEAST ",\"mesh\":\"@\"", "/inputs/mesh"},
        {"\"surface\":\"@\",\"model\":\"%\"", "/inputs/guest"},
        {LEAST ",\"spoons\":10", "/inputs/spoons"},
        {LEAST ",\"spoons\":null", "/inputs/spoons"},
        {LEAST ",\"cups\":11", "/inputs/cups"},
        {LEAST ",\"spoons\":9,\"cups\":0", "/inputs/cups"},
        {LEAST ",\"cubes\":0", "/inputs/cubes"},
        {LEAST ",\"warmth\":273", "/inputs/warmth"},
        {LEAST ",\"milk\":1", "/inputs/milk"},
        {LEAST ",\"kind\":\"white\"", "/inputs/kind"},
        {LEAST ",\"times\":[1,2,3,4]", "/inputs/times"},
        {LEAST ",\"times\":[13]", "/inputs/times"},
        {LEAST ",\"lemon\":\"rind\"", "/inputs/lemon"},
        {LEAST ",\"mesh\":\"" GOOD_MESH "\",\"lemon\":\"slice\"", "/inputs/lemon"},
        {LEAST ",\"sugar\":1", "/inputs/sugar"},
        {LEAST ",\"cup\":7", "/inputs/cup"},
        {LEAST ",\"cup\":\"" ABSENT_SURFACE "\",\"kind\":\"green\"", "/inputs/milk"},
    };

    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        char text[400];
        struct outcome outcome;

        (void)snprintf(text, sizeof text, "{%s}", wrong[i].text);
        outcome = brew(state, text);
        if (!has_error(&outcome, wrong[i].pointer) || json_array_size(outcome.errors) != 1) {
            fail_msg("%s is not refused at %s alone", text, wrong[i].pointer);
        }
        outcome_clear(&outcome);
    }
}

/* All mistakes at once; what is not there is told only when everything else is right. */
static void test_references_come_last(void **state)
{
    struct outcome outcome =
        brew(state, "{\"surface\":\"" ABSENT_SURFACE "\",\"model\":7,\"guest\":1,\"milk\":2}");

    assert_int_equal(json_array_size(outcome.errors), 3);
    assert_true(has_error(&outcome, "/inputs/model") && has_error(&outcome, "/inputs/guest") &&
                has_error(&outcome, "/inputs/milk"));
    outcome_clear(&outcome);
    outcome = brew(state, "{\"surface\":\"" ABSENT_SURFACE "\",\"model\":\"%\",\"guest\":\"Ada\"}");
    assert_int_equal(outcome.status, 404);
    assert_string_equal(outcome.code, "no-such-surface");
    outcome_clear(&outcome);
    outcome = brew(state, "{" LEAST ",\"cup\":\"" ABSENT_SURFACE "\"}");
    assert_string_equal(outcome.code, "no-such-surface");
    outcome_clear(&outcome);
}

static void expect_schema(json_t *properties, const char *name, const char *wanted)
{
    json_t *expected = json_loads(wanted, 0, NULL);

    assert_non_null(expected);
    if (!json_equal(json_object_get(properties, name), expected)) {
        fail_msg("%s: %s", name, json_dumps(json_object_get(properties, name), 0));
    }
    json_decref(expected);
}

static void test_schemas(void **state)
{
    json_t *schema = processes.inputs_schema(process.table),
           *results = processes.outputs_schema(process.table);
    json_t *properties = json_object_get(schema, "properties");
    json_t *required = json_pack("[s,s,s]", "surface", "model", "guest");
    (void)state;

    assert_true(json_equal(json_object_get(schema, "required"), required));
    assert_true(json_is_false(json_object_get(schema, "additionalProperties")));
    expect_schema(properties, "mesh",
                  "{\"type\":[\"string\",\"null\"],\"pattern\":\"^mesh-[0-9a-f]{32}$\","
                  "\"default\":null,\"description\":\"A mesh, or none.\"}");
    expect_schema(properties, "cups",
                  "{\"type\":\"integer\",\"exclusiveMinimum\":0,\"maximum\":10,"
                  "\"description\":\"Cups.\"}");
    expect_schema(properties, "cubes",
                  "{\"type\":[\"integer\",\"null\"],\"minimum\":1,\"maximum\":4,\"default\":null,"
                  "\"description\":\"Cubes.\"}");
    expect_schema(properties, "warmth",
                  "{\"type\":\"number\",\"minimum\":273.5,\"maximum\":373,\"default\":350,"
                  "\"description\":\"In kelvin.\"}");
    expect_schema(properties, "kind",
                  "{\"enum\":[\"black\",\"green\"],\"default\":\"black\",\"description\":\"Of "
                  "tea.\"}");
    expect_schema(properties, "times",
                  "{\"type\":\"array\",\"minItems\":1,\"maxItems\":3,\"items\":{\"type\":"
                  "\"number\",\"minimum\":-12,\"maximum\":12},\"default\":[0.5,1.0],"
                  "\"description\":\"In hours.\"}");
    expect_schema(properties, "guest",
                  "{\"type\":\"string\",\"maxLength\":9,\"description\":\"Whose.\"}");
    properties = json_object_get(results, "properties");
    assert_int_equal(json_object_size(properties), 4);
    expect_schema(properties, "inputs",
                  "{\"type\":\"object\",\"description\":\"Every option after defaulting; q by "
                  "its digest.\"}");
    expect_schema(properties, "pot",
                  "{\"type\":[\"number\",\"null\"],\"description\":\"Litres.\"}");
    json_decref(required);
    json_decref(results);
    json_decref(schema);
}

/* A name that stands twice in a table would hide an input. */
static void test_names_are_unique(void **state)
{
    (void)state;
    for (size_t p = 0; processes.rows[p]; p++) {
        const struct process_table *other = processes.rows[p]->table;

        for (size_t i = 0; other && other->inputs[i].name; i++) {
            for (size_t j = 0; j < i; j++) {
                assert_string_not_equal(other->inputs[i].name, other->inputs[j].name);
            }
        }
        for (size_t i = 0; other && other->outputs[i].name; i++) {
            for (size_t j = 0; j < i; j++) {
                assert_string_not_equal(other->outputs[i].name, other->outputs[j].name);
            }
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults_are_filled),
        cmocka_unit_test(test_typed),
        cmocka_unit_test(test_typed_without_what_is_replaced),
        cmocka_unit_test(test_typed_of_old),
        cmocka_unit_test(test_each_input_is_checked),
        cmocka_unit_test(test_references_come_last),
        cmocka_unit_test(test_schemas),
        cmocka_unit_test(test_names_are_unique),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}

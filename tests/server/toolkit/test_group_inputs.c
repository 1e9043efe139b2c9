/*
 * test_group_inputs.c - a group as inputs of a table, tried on two made up here: one that takes
 * surfaces or a cohort, and one that needs what the cohort says of its members.
 */
#include "toolkit/group.h"

#include "server/toolkit/process_fixture.h"

struct party {
    struct group_input group;
    long cake;
};

static const struct process_input of_all[] = {
    GROUP_INPUTS(party),
    {"cake", INPUT_INTEGER, offsetof(struct party, cake), "Pieces.", .lowest = 1, .highest = 9,
     .fallback = 2},
    {.name = NULL},
};
static const struct process_input of_members[] = {
    GROUP_MEMBERS_INPUTS(party, "Who comes."),
    {.name = NULL},
};
static const struct process_output outputs[] = {{NULL, NULL, NULL}};
static const struct process_table all = {
    .inputs = of_all, .outputs = outputs, .size = sizeof(struct party)};
static const struct process_table members = {
    .inputs = of_members, .outputs = outputs, .size = sizeof(struct party)};

static double at_once(const struct api_work *work, const json_t *canonical)
{
    (void)work;
    (void)canonical;
    return 0.0;
}

static const struct api_process party = {.id = "party", .table = &all, .seconds = at_once};
static const struct api_process guests = {.id = "guests", .table = &members, .seconds = at_once};

static struct outcome invite(void **state, const struct api_process *process, const char *text)
{
    char whole[512];
    struct outcome outcome;
    json_t *given;

    expand(*state, text, whole, sizeof whole);
    given = json_loads(whole, 0, NULL);
    assert_non_null(given);
    outcome = canonical_outcome_as(*state, process, given);
    json_decref(given);
    return outcome;
}

static void test_surfaces(void **state)
{
    struct fixture *fixture = *state;
    struct outcome outcome = invite(
        state, &party, "{\"surfaces\":[\"@\",\"" GOOD_MESH "\",\"@\"],\"mixedRoutes\":true}");
    struct party typed;

    assert_true(json_is_null(json_object_get(outcome.canonical, "cohort")));
    assert_true(table_type(&all, outcome.canonical, &typed));
    assert_int_equal(typed.group.n, 3);
    assert_string_equal(typed.group.ids[0], fixture->surface);
    assert_string_equal(typed.group.ids[1], GOOD_MESH);
    assert_int_equal(typed.group.n_subjects, 3); /* each its own */
    assert_int_equal(typed.group.largest, 1);
    assert_int_equal(typed.group.subjects[2], 2);
    assert_true(typed.group.mixed_routes);
    assert_false(typed.group.mirrored.member[0]);
    assert_null(typed.group.cohort);
    assert_int_equal(json_array_size(typed.group.surfaces), 3);
    table_clear(&all, &typed);
    assert_null(typed.group.ids);
    outcome_clear(&outcome);
}

static void expect_group(const struct fixture *fixture, const struct process_table *table,
                         const json_t *canonical)
{
    struct party typed;

    assert_true(table_type(table, canonical, &typed));
    assert_int_equal(typed.group.n, 2);
    assert_string_equal(typed.group.ids[0], fixture->surface);
    assert_int_equal(typed.group.n_subjects, 2);
    assert_false(typed.group.mixed_routes);
    assert_string_equal(json_string_value(json_object_get(typed.group.cohort, "name")), "group");
    assert_int_equal(json_array_size(typed.group.surfaces), 2);
    table_clear(table, &typed);
}

/* The same members by both ways; where the cohort is the only one, they stand in it. */
static void test_cohort(void **state)
{
    struct outcome outcome = invite(state, &party, "{\"cohort\":\"group\"}");

    expect_group(*state, &all, outcome.canonical);
    outcome_clear(&outcome);
    outcome = invite(state, &guests, "{\"cohort\":\"group\"}");
    assert_null(json_object_get(outcome.canonical, "surfaces"));
    expect_group(*state, &members, outcome.canonical);
    outcome_clear(&outcome);
}

/* Members that share a subject count as one, and mirror is theirs one by one. */
static void test_typed_members(void **state)
{
    json_t *canonical = json_pack("{s:b, s:{s:[s,s,s], s:[s,n,s], s:[b,b,n]}}", "mixedRoutes", 0,
                                  "cohort", "surfaces", GOOD_MESH, OPEN_MESH, GOOD_MESH, "subjects",
                                  "Ada", "Ada", "mirrored", 0, 1);
    struct party typed;

    (void)state;
    assert_true(table_type(&members, canonical, &typed));
    assert_int_equal(typed.group.n_subjects, 2);
    assert_int_equal(typed.group.largest, 2);
    assert_int_equal(typed.group.subjects[2], 0);
    assert_false(typed.group.mirrored.member[0]);
    assert_true(typed.group.mirrored.member[1]);
    table_clear(&members, &typed);
    json_decref(canonical);
}

/* Text that is not of this table, as another version may have left. */
static void test_typed_of_others(void **state)
{
    static const char *const of_all_texts[] = {
        "{\"surfaces\":null,\"cohort\":null,\"mixedRoutes\":false,\"cake\":1}",
        "{\"surfaces\":[],\"cohort\":null,\"mixedRoutes\":false,\"cake\":1}",
        "{\"surfaces\":[\"a\",\"b\"],\"cohort\":\"group\",\"mixedRoutes\":false,\"cake\":1}",
        "{\"surfaces\":[\"a\",\"b\"],\"mixedRoutes\":false,\"cake\":1}",
    };
    struct party typed;
    json_t *canonical;

    (void)state;
    for (size_t i = 0; i < sizeof of_all_texts / sizeof of_all_texts[0]; i++) {
        canonical = json_loads(of_all_texts[i], 0, NULL);
        assert_false(table_type(&all, canonical, &typed));
        table_clear(&all, &typed);
        json_decref(canonical);
    }
    canonical = json_loads("{\"cohort\":{\"name\":\"group\"},\"mixedRoutes\":false}", 0, NULL);
    assert_false(table_type(&members, canonical, &typed));
    table_clear(&members, &typed);
    json_decref(canonical);
}

static void expect_error(void **state, const struct api_process *process, const char *text,
                         const char *pointer)
{
    struct outcome outcome = invite(state, process, text);

    if (!has_error(&outcome, pointer) || json_array_size(outcome.errors) != 1) {
        fail_msg("%s is not refused at %s alone", text, pointer);
    }
    outcome_clear(&outcome);
}

static void test_refused(void **state)
{
    struct outcome outcome;

    expect_error(state, &party, "{}", "/inputs/surfaces");
    expect_error(state, &party, "{\"surfaces\":[\"@\",\"@\"],\"cohort\":\"group\"}",
                 "/inputs/cohort");
    expect_error(state, &party, "{\"surfaces\":[\"@\"]}", "/inputs/surfaces");
    expect_error(state, &party, "{\"surfaces\":[\"@\",7]}", "/inputs/surfaces/1");
    expect_error(state, &party, "{\"cohort\":\"a/b\"}", "/inputs/cohort");
    expect_error(state, &party, "{\"cohort\":\"group\",\"mixedRoutes\":2}", "/inputs/mixedRoutes");
    expect_error(state, &guests, "{}", "/inputs/cohort");
    expect_error(state, &guests, "{\"cohort\":\"group\",\"surfaces\":[\"@\",\"@\"]}",
                 "/inputs/surfaces");
    outcome = invite(state, &guests, "{\"cohort\":\"another\"}");
    assert_string_equal(outcome.code, "no-such-cohort");
    outcome_clear(&outcome);
}

/* All that is wrong in form is told at once, and nothing is looked up. */
static void test_refers_last(void **state)
{
    struct outcome outcome =
        invite(state, &party, "{\"surfaces\":[\"" ABSENT_SURFACE "\",\"mesh-1\",8],\"cake\":10}");

    assert_int_equal(json_array_size(outcome.errors), 3);
    assert_true(has_error(&outcome, "/inputs/surfaces/1") && has_error(&outcome, "/inputs/cake"));
    outcome_clear(&outcome);
    outcome = invite(state, &party, "{\"cohort\":\"another\",\"cake\":10}");
    assert_int_equal(json_array_size(outcome.errors), 1);
    outcome_clear(&outcome);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_surfaces),      cmocka_unit_test(test_cohort),
        cmocka_unit_test(test_typed_members), cmocka_unit_test(test_typed_of_others),
        cmocka_unit_test(test_refused),       cmocka_unit_test(test_refers_last),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}

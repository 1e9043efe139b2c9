/*
 * The order of the queue within an owner's turn: short jobs before long ones, but nobody overtaken
 * without end; claims of express jobs alone; and that the places which are told are those in which
 * jobs are claimed.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "fixture.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/holdings.h"

#define JOBS 60

static void insert(struct store *store, const char *owner, int number, int64_t expected_ms,
                   bool express, size_t running)
{
    char process[] = "encode", inputs[64], empty[] = "";
    const struct store_job_limits limits = {.running = running};
    struct store_job job = {.process = process,
                            .inputs = inputs,
                            .message = empty,
                            .numeric_build = empty,
                            .created_ms = 1000 + 10 * number,
                            .expected_ms = expected_ms,
                            .express = express};

    snprintf(inputs, sizeof inputs, "{\"number\":%d}", number);
    snprintf(job.id, sizeof job.id, "job-%08d", number);
    snprintf(job.owner, sizeof job.owner, "%s", owner);
    store_sha256_hex(job.digest, inputs, strlen(inputs));
    assert_int_equal(store_job_insert(store, &job, &limits, NULL, NULL), STORE_OK);
}

static void claims(struct store *store, int number)
{
    struct store_job job;
    char wanted[STORE_ID_MAX];

    snprintf(wanted, sizeof wanted, "job-%08d", number);
    assert_int_equal(store_job_claim(store, &job), STORE_OK);
    assert_string_equal(job.id, wanted);
    store_job_clear(&job);
}

/* Job 0 would take 100 ms: it is overtaken by short jobs that come within 100 ms, by no more. */
static void short_jobs_go_first_and_none_starves(void **state)
{
    struct fixture *fixture = *state;

    insert(fixture->store, "ada", 0, 100, false, 0);
    insert(fixture->store, "ada", 1, 5000, false, 0);
    for (int i = 2; i < 20; i++) {
        insert(fixture->store, "ada", i, 1, true, 0);
    }
    for (int i = 2; i < 10; i++) {
        claims(fixture->store, i); /* due at 1001 + 10 i, before 1100 */
    }
    claims(fixture->store, 0);
    for (int i = 10; i < 20; i++) {
        claims(fixture->store, i);
    }
    claims(fixture->store, 1);
}

static void what_is_expected_is_kept(void **state)
{
    struct fixture *fixture = *state;
    struct store_job job;

    insert(fixture->store, "ada", 0, 1234, false, 0);
    insert(fixture->store, "ada", 1, 12, true, 0);
    assert_int_equal(store_job_get(fixture->store, "job-00000000", &job), STORE_OK);
    assert_int_equal(job.expected_ms, 1234);
    assert_false(job.express);
    store_job_clear(&job);
    assert_int_equal(store_job_get(fixture->store, "job-00000001", &job), STORE_OK);
    assert_int_equal(job.expected_ms, 12);
    assert_true(job.express);
    store_job_clear(&job);
}

static void express_claims_take_express_jobs_in_turn(void **state)
{
    static const char *const order[] = {"ada", "ben", "ada"};
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct store_job job;

    insert(store, "ada", 0, 90000, false, 0);
    assert_int_equal(store_job_claim_express(store, NULL, &job), STORE_NOT_FOUND);
    insert(store, "ada", 1, 100, true, 0);
    insert(store, "ada", 2, 100, true, 0);
    insert(store, "ben", 3, 100, true, 0);
    insert(store, "cleo", 4, 90000, false, 0);
    for (size_t i = 0; i < 3; i++) {
        assert_int_equal(store_job_claim_express(store, NULL, &job), STORE_OK);
        assert_string_equal(job.owner, order[i]);
        assert_true(job.express);
        assert_int_equal(job.status, STORE_JOB_RUNNING);
        store_job_clear(&job);
    }
    assert_int_equal(store_job_claim_express(store, NULL, &job), STORE_NOT_FOUND);
}

/* An express job counts among those that its owner may have running. */
static void express_claims_keep_to_limits(void **state)
{
    struct fixture *fixture = *state;
    struct store_job job;

    insert(fixture->store, "ada", 0, 90000, false, 1);
    claims(fixture->store, 0);
    insert(fixture->store, "ada", 1, 100, true, 1);
    assert_int_equal(store_job_claim_express(fixture->store, NULL, &job), STORE_CONFLICT);
    assert_int_equal(store_job_transition(fixture->store, "job-00000000", 1, STORE_JOB_FAILED, NULL,
                                          "not-converged", "It did not."),
                     STORE_OK);
    assert_int_equal(store_job_claim_express(fixture->store, NULL, &job), STORE_OK);
    store_job_clear(&job);
}

/* Whoever holds the lane is passed over, unless there is nobody else. */
static void express_claims_pass_an_owner_over(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct store_job job;

    insert(store, "ada", 0, 100, true, 0);
    insert(store, "ada", 1, 100, true, 0);
    assert_int_equal(store_job_claim_express(store, "ada", &job), STORE_OK);
    assert_string_equal(job.id, "job-00000000");
    store_job_clear(&job);
    insert(store, "ben", 2, 100, true, 0);
    assert_int_equal(store_job_claim_express(store, "ada", &job), STORE_OK);
    assert_string_equal(job.owner, "ben");
    store_job_clear(&job);
    assert_int_equal(store_job_claim_express(store, "ada", &job), STORE_CONFLICT);
    assert_int_equal(store_job_claim_express(store, "ben", &job), STORE_OK);
    assert_string_equal(job.id, "job-00000001");
    store_job_clear(&job);
}

struct places {
    char (*at)[STORE_ID_MAX];
    size_t count, until;
};

static bool compare_place(void *user, const char *id, size_t position)
{
    struct places *places = user;

    assert_int_equal(position, ++places->count);
    assert_true(position < JOBS);
    assert_string_equal(id, places->at[position]);
    return position < places->until;
}

static void places_are_the_order_of_claims(void **state)
{
    static const char *const owners[] = {"ada", "ada", "ben", "cleo", "ada", "ben"};
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char at[JOBS + 1][STORE_ID_MAX] = {""};
    struct places all;
    struct store_job job;
    size_t position;

    for (int i = 0; i < JOBS; i++) { /* expected times and owners in no order */
        insert(store, owners[i * i % 6], i, (i * 7919) % 500, false, 0);
    }
    claims(store, 0); /* so that not all owners have had the same turns */
    for (int i = 0; i < JOBS; i++) {
        char id[STORE_ID_MAX];

        snprintf(id, sizeof id, "job-%08d", i);
        assert_int_equal(store_job_position(store, id, &position), STORE_OK);
        assert_true(position < JOBS);
        assert_true((position == 0) == (i == 0)); /* it runs */
        assert_string_equal(at[position], "");    /* nobody else is there */
        memcpy(at[position], id, sizeof id);
    }
    all = (struct places){.at = at, .until = JOBS};
    assert_int_equal(store_job_places(store, compare_place, &all), STORE_OK);
    assert_int_equal(all.count, JOBS - 1);
    all = (struct places){.at = at, .until = 3};
    assert_int_equal(store_job_places(store, compare_place, &all), STORE_OK);
    assert_int_equal(all.count, 3);
    for (size_t next = 1; next < JOBS; next++) {
        assert_int_equal(store_job_claim(store, &job), STORE_OK);
        assert_string_equal(job.id, at[next]);
        store_job_clear(&job);
    }
    assert_int_equal(store_job_position(store, "job-00000001", &position), STORE_OK);
    assert_int_equal(position, 0);
    all = (struct places){.at = at, .until = JOBS};
    assert_int_equal(store_job_places(store, compare_place, &all), STORE_OK);
    assert_int_equal(all.count, 0);
    assert_int_equal(store_job_position(store, "job-of-nobody", &position), STORE_OK);
    assert_int_equal(position, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(short_jobs_go_first_and_none_starves, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(what_is_expected_is_kept, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(express_claims_take_express_jobs_in_turn, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(express_claims_keep_to_limits, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(express_claims_pass_an_owner_over, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(places_are_the_order_of_claims, fixture_setup,
                                        fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * How jobs move: every pair of states through every door, the guard by attempt, the order of the
 * queue, recovery.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "fixture.h"
#include "store/job.h"

#define N_STATES 5

static int move(struct store *store, const char *id, int64_t attempt, enum store_job_status to)
{
    return store_job_transition(store, id, attempt, to, to == STORE_JOB_SUCCESSFUL ? "{}" : NULL,
                                to == STORE_JOB_FAILED ? "not-converged" : NULL,
                                to == STORE_JOB_FAILED ? "It did not." : NULL);
}

/* A job in this state; *attempt is its attempt. Other jobs must not be waiting. */
static void make_job(struct store *store, int number, enum store_job_status state,
                     char id[STORE_ID_MAX], int64_t *attempt)
{
    struct store_job job;

    assert_int_equal(fixture_insert_job(store, number, id), STORE_OK);
    *attempt = 0;
    if (state != STORE_JOB_ACCEPTED) {
        assert_int_equal(store_job_claim(store, &job), STORE_OK);
        assert_string_equal(job.id, id);
        assert_int_equal(job.status, STORE_JOB_RUNNING);
        *attempt = job.attempt;
        store_job_clear(&job);
        if (state != STORE_JOB_RUNNING) {
            assert_int_equal(move(store, id, *attempt, state), STORE_OK);
        }
    }
    assert_int_equal(fixture_status(store, id), state);
}

static void every_pair_of_states(void **state)
{
    /* [from][to]; written from the picture of an OGC job's life, not from the code */
    static const bool allowed[N_STATES][N_STATES] = {
        [STORE_JOB_ACCEPTED] = {[STORE_JOB_DISMISSED] = true},
        [STORE_JOB_RUNNING] = {[STORE_JOB_ACCEPTED] = true,
                               [STORE_JOB_SUCCESSFUL] = true,
                               [STORE_JOB_FAILED] = true,
                               [STORE_JOB_DISMISSED] = true},
    };
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    int number = 0;

    for (int from = 0; from < N_STATES; from++) {
        for (int to = 0; to < N_STATES; to++) {
            char id[STORE_ID_MAX];
            int64_t attempt;
            int status;

            make_job(store, number++, (enum store_job_status)from, id, &attempt);
            status = move(store, id, attempt, (enum store_job_status)to);
            assert_int_equal(status, allowed[from][to] ? STORE_OK : STORE_CONFLICT);
            assert_int_equal(fixture_status(store, id), allowed[from][to] ? to : from);
            if (fixture_status(store, id) == STORE_JOB_ACCEPTED) {
                assert_int_equal(move(store, id, attempt, STORE_JOB_DISMISSED), STORE_OK);
            }
        }
    }
}

static void another_attempt_is_refused(void **state)
{
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX];
    int64_t attempt;

    make_job(fixture->store, 0, STORE_JOB_RUNNING, id, &attempt);
    assert_int_equal(attempt, 1);
    assert_int_equal(move(fixture->store, id, 0, STORE_JOB_SUCCESSFUL), STORE_CONFLICT);
    assert_int_equal(move(fixture->store, id, 2, STORE_JOB_SUCCESSFUL), STORE_CONFLICT);
    assert_int_equal(move(fixture->store, id, 1, STORE_JOB_SUCCESSFUL), STORE_OK);
    assert_int_equal(move(fixture->store, id, 1, STORE_JOB_SUCCESSFUL), STORE_CONFLICT);
}

static void results_and_problems_belong_to_their_states(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct store_job job;
    char id[STORE_ID_MAX];
    int64_t attempt;

    make_job(store, 0, STORE_JOB_RUNNING, id, &attempt);
    assert_int_equal(store_job_transition(store, id, 1, STORE_JOB_SUCCESSFUL, NULL, NULL, NULL),
                     STORE_CONFLICT);
    assert_int_equal(store_job_transition(store, id, 1, STORE_JOB_FAILED, NULL, NULL, NULL),
                     STORE_CONFLICT);
    assert_int_equal(store_job_transition(store, id, 1, STORE_JOB_DISMISSED, "{}", NULL, NULL),
                     STORE_CONFLICT);
    assert_int_equal(move(store, id, 1, STORE_JOB_FAILED), STORE_OK);
    assert_int_equal(store_job_get(store, id, &job), STORE_OK);
    assert_string_equal(job.problem_code, "not-converged");
    assert_string_equal(job.problem_detail, "It did not.");
    assert_true(job.finished_ms >= job.started_ms && job.started_ms > 0);
    store_job_clear(&job);
}

static void the_oldest_is_claimed_first(void **state)
{
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX], wanted[STORE_ID_MAX];
    struct store_job job;

    for (int i = 9; i >= 0; i--) {
        assert_int_equal(fixture_insert_job(fixture->store, i, id), STORE_OK);
    }
    for (int i = 0; i < 10; i++) {
        assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
        snprintf(wanted, sizeof wanted, "job-%08d", i);
        assert_string_equal(job.id, wanted);
        assert_string_equal(job.process, "encode");
        assert_string_equal(job.numeric_build, "test build");
        assert_int_equal(job.attempt, 1);
        store_job_clear(&job);
    }
    assert_int_equal(store_job_claim(fixture->store, &job), STORE_NOT_FOUND);
}

static void cancel_in_each_state(void **state)
{
    static const enum store_job_status after[] = {
        [STORE_JOB_ACCEPTED] = STORE_JOB_DISMISSED,    [STORE_JOB_RUNNING] = STORE_JOB_RUNNING,
        [STORE_JOB_SUCCESSFUL] = STORE_JOB_SUCCESSFUL, [STORE_JOB_FAILED] = STORE_JOB_FAILED,
        [STORE_JOB_DISMISSED] = STORE_JOB_DISMISSED,
    };
    struct fixture *fixture = *state;

    for (int from = 0; from < N_STATES; from++) {
        struct store_job job;
        char id[STORE_ID_MAX];
        int64_t attempt;

        make_job(fixture->store, from, (enum store_job_status)from, id, &attempt);
        for (int again = 0; again < 2; again++) {
            assert_int_equal(store_job_request_cancel(fixture->store, id, &job), STORE_OK);
            assert_int_equal(job.status, after[from]);
            assert_int_equal(job.cancel_requested, from == STORE_JOB_ACCEPTED ||
                                                       from == STORE_JOB_RUNNING ||
                                                       from == STORE_JOB_DISMISSED);
            store_job_clear(&job);
        }
    }
}

static void only_ended_jobs_are_deleted(void **state)
{
    struct fixture *fixture = *state;

    for (int from = 0; from < N_STATES; from++) {
        bool ended = from != STORE_JOB_ACCEPTED && from != STORE_JOB_RUNNING;
        struct store_job job;
        char id[STORE_ID_MAX];
        int64_t attempt;
        int status;

        make_job(fixture->store, from, (enum store_job_status)from, id, &attempt);
        assert_int_equal(store_job_delete(fixture->store, id), ended ? STORE_OK : STORE_CONFLICT);
        status = store_job_get(fixture->store, id, &job);
        assert_int_equal(status, ended ? STORE_NOT_FOUND : STORE_OK);
        store_job_clear(&job);
        if (from == STORE_JOB_ACCEPTED) {
            assert_int_equal(move(fixture->store, id, 0, STORE_JOB_DISMISSED), STORE_OK);
        }
    }
}

/* A job that ran when the daemon died waits again; after the third death no ordinary claim finds
   it, and after one more it has failed. */
static void recovery_counts_deaths(void **state)
{
    struct fixture *fixture = *state;
    struct store_job job;
    char id[STORE_ID_MAX];
    size_t requeued, failed, alone;

    assert_int_equal(fixture_insert_job(fixture->store, 0, id), STORE_OK);
    for (int death = 1; death <= 4; death++) {
        assert_int_equal(store_job_count_alone(fixture->store, &alone), STORE_OK);
        assert_int_equal(alone, death > 3);
        if (death > 3) {
            assert_int_equal(store_job_claim(fixture->store, &job), STORE_NOT_FOUND);
            assert_int_equal(store_job_claim_express(fixture->store, NULL, &job), STORE_NOT_FOUND);
            assert_int_equal(store_job_claim_alone(fixture->store, &job), STORE_OK);
        } else {
            assert_int_equal(store_job_claim_alone(fixture->store, &job), STORE_NOT_FOUND);
            assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
        }
        assert_int_equal(job.attempt, death);
        store_job_clear(&job);
        fixture_reopen(fixture);
        assert_int_equal(store_job_recover(fixture->store, 3, NULL, &requeued, &failed), STORE_OK);
        assert_int_equal(requeued, death < 4);
        assert_int_equal(failed, death == 4);
    }
    assert_int_equal(store_job_get(fixture->store, id, &job), STORE_OK);
    assert_int_equal(job.status, STORE_JOB_FAILED);
    assert_string_equal(job.problem_code, "attempts-exhausted");
    assert_non_null(strstr(job.problem_detail, "died 4 times"));
    store_job_clear(&job);
}

/* A daemon that stops by itself puts back what runs: no death is counted. */
static void putting_back_is_no_death(void **state)
{
    struct fixture *fixture = *state;
    struct store_job job;
    char id[STORE_ID_MAX];
    size_t alone;

    assert_int_equal(fixture_insert_job(fixture->store, 0, id), STORE_OK);
    for (int i = 0; i < 5; i++) {
        assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
        assert_int_equal(job.attempt, i + 1);
        assert_int_equal(move(fixture->store, id, job.attempt, STORE_JOB_ACCEPTED), STORE_OK);
        store_job_clear(&job);
    }
    assert_int_equal(store_job_count_alone(fixture->store, &alone), STORE_OK);
    assert_int_equal(alone, 0);
}

static void recovery_dismisses_what_was_being_cancelled(void **state)
{
    struct fixture *fixture = *state;
    struct store_job job;
    char id[STORE_ID_MAX];
    int64_t attempt;
    size_t requeued, failed;

    make_job(fixture->store, 0, STORE_JOB_RUNNING, id, &attempt);
    assert_int_equal(store_job_request_cancel(fixture->store, id, &job), STORE_OK);
    store_job_clear(&job);
    assert_int_equal(store_job_recover(fixture->store, 3, NULL, &requeued, &failed), STORE_OK);
    assert_int_equal(requeued + failed, 0);
    assert_int_equal(fixture_status(fixture->store, id), STORE_JOB_DISMISSED);
}

/* What store_job_find answers: live and successful jobs, but none that is being cancelled. */
static void find_by_digest_in_each_state(void **state)
{
    static const bool found[] = {true, true, true, false, false};
    struct fixture *fixture = *state;
    struct store_job job, other;

    for (int from = 0; from < N_STATES; from++) {
        char id[STORE_ID_MAX];
        int64_t attempt;

        make_job(fixture->store, from, (enum store_job_status)from, id, &attempt);
        assert_int_equal(store_job_get(fixture->store, id, &job), STORE_OK);
        assert_int_equal(store_job_find(fixture->store, job.digest, &other),
                         found[from] ? STORE_OK : STORE_NOT_FOUND);
        store_job_clear(&other);
        if (from == STORE_JOB_RUNNING) {
            assert_int_equal(store_job_request_cancel(fixture->store, id, &other), STORE_OK);
            store_job_clear(&other);
            assert_int_equal(store_job_find(fixture->store, job.digest, &other), STORE_NOT_FOUND);
        } else if (from == STORE_JOB_ACCEPTED) {
            assert_int_equal(move(fixture->store, id, 0, STORE_JOB_DISMISSED), STORE_OK);
        }
        store_job_clear(&job);
    }
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(every_pair_of_states),
        TEST(another_attempt_is_refused),
        TEST(results_and_problems_belong_to_their_states),
        TEST(the_oldest_is_claimed_first),
        TEST(cancel_in_each_state),
        TEST(only_ended_jobs_are_deleted),
        TEST(recovery_counts_deaths),
        TEST(putting_back_is_no_death),
        TEST(recovery_dismisses_what_was_being_cancelled),
        TEST(find_by_digest_in_each_state),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * The cache of transforms: one per kind for all who ask, errors passed on, the unused ones leave
 * beyond sixteen, those in use never.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fftw3.h>
#include <pthread.h>
#include <stdatomic.h>

#include "../store/fixture.h"
#include "jobs/jobs.h"

struct world {
    struct fixture *fixture;
    struct jobs *jobs;
};

static int setup(void **state)
{
    static const struct jobs_process none[] = {{NULL, NULL, NULL}};
    struct world *world = calloc(1, sizeof *world);
    struct jobs_config config = {.workers = 1, .table = none};
    void *fixture;

    fixture_setup(&fixture);
    world->fixture = fixture;
    config.store = world->fixture->store;
    assert_int_equal(jobs_open(&world->jobs, &config), JOBS_OK);
    *state = world;
    return 0;
}

static int teardown(void **state)
{
    struct world *world = *state;
    void *fixture = world->fixture;

    jobs_close(world->jobs, 1.0);
    fixture_teardown(&fixture);
    free(world);
    return 0;
}

static const struct srnf_sht *acquire(struct world *world, size_t degree, size_t n_theta,
                                      size_t n_phi)
{
    const struct srnf_sht *sht = NULL;

    assert_int_equal(
        jobs_transform_acquire(world->jobs, degree, SRNF_GRID_GAUSS_LEGENDRE, n_theta, n_phi, &sht),
        SRNF_OK);
    assert_non_null(sht);
    assert_int_equal(srnf_sht_degree(sht), degree);
    return sht;
}

static void one_for_all_ways_of_asking(void **state)
{
    struct world *world = *state;
    const struct srnf_sht *a = acquire(world, 10, 0, 0), *b = acquire(world, 10, 0, 0),
                          *c = acquire(world, 10, srnf_working_rows(10), 0),
                          *d = acquire(world, 10, 20, 0);

    assert_ptr_equal(a, b);
    assert_ptr_equal(a, c);
    assert_ptr_not_equal(a, d);
    assert_int_equal(srnf_sht_grid(d)->n_theta, 20);
    jobs_transform_release(world->jobs, a);
    jobs_transform_release(world->jobs, b);
    jobs_transform_release(world->jobs, c);
    jobs_transform_release(world->jobs, d);
    assert_ptr_equal(acquire(world, 10, 0, 0), a); /* kept while unused */
    jobs_transform_release(world->jobs, a);
    jobs_transform_release(world->jobs, NULL);
}

static void errors_are_passed_on(void **state)
{
    struct world *world = *state;
    const struct srnf_sht *sht;

    for (int again = 0; again < 2; again++) {
        assert_int_equal(
            jobs_transform_acquire(world->jobs, 10, SRNF_GRID_GAUSS_LEGENDRE, 5, 0, &sht),
            SRNF_EINVAL);
        assert_null(sht);
    }
}

static void those_in_use_stay(void **state)
{
    struct world *world = *state;
    const struct srnf_sht *held[24];

    for (size_t i = 0; i < 24; i++) {
        held[i] = acquire(world, 4 + i, 0, 0);
    }
    for (size_t i = 0; i < 24; i++) {
        assert_int_equal(srnf_sht_degree(held[i]), 4 + i);
        assert_ptr_equal(acquire(world, 4 + i, 0, 0), held[i]);
        jobs_transform_release(world->jobs, held[i]);
    }
    for (size_t i = 0; i < 24; i++) {
        jobs_transform_release(world->jobs, held[i]);
    }
    /* The most recently used are among those that stay. */
    assert_ptr_equal(acquire(world, 27, 0, 0), held[23]);
    jobs_transform_release(world->jobs, held[23]);
}

struct crowd {
    struct jobs *jobs;
    atomic_int errors;
};

static void *crowd_main(void *user)
{
    struct crowd *crowd = user;

    for (size_t i = 0; i < 200; i++) {
        size_t degree = 4 + i * 7 % 25;
        const struct srnf_sht *sht;
        int status =
            jobs_transform_acquire(crowd->jobs, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);

        atomic_fetch_add(&crowd->errors, status != SRNF_OK || srnf_sht_degree(sht) != degree);
        jobs_transform_release(crowd->jobs, sht);
    }
    return NULL;
}

static void a_crowd_shares(void **state)
{
    struct world *world = *state;
    struct crowd crowd = {.jobs = world->jobs};
    pthread_t threads[6];

    for (int i = 0; i < 6; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, crowd_main, &crowd), 0);
    }
    for (int i = 0; i < 6; i++) {
        pthread_join(threads[i], NULL);
    }
    assert_int_equal(crowd.errors, 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(one_for_all_ways_of_asking),
        TEST(errors_are_passed_on),
        TEST(those_in_use_stay),
        TEST(a_crowd_shares),
    };

    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

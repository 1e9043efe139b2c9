/*
 * test_threads.c - two threads share one transform, each with its own workspace, and get to the
 * bit what one thread gets.
 */
#include "fixture.h"
#include "operators.h"

#include <pthread.h>

/* Work of one thread: all operators, over and over, on inputs of its own seed. */
struct worker {
    const struct fixture *fixture;
    void *workspace;
    struct arrays results[OPERATORS];
    struct arrays again;
    size_t repetitions, deviations;
};

static void worker_open(struct worker *worker, const struct fixture *f, uint64_t seed,
                        size_t repetitions)
{
    struct test_random random = test_random_seed(seed);

    worker->fixture = f;
    worker->repetitions = repetitions;
    worker->deviations = 0;
    worker->workspace = srnf_alloc(f->workspace_size, 1);
    assert_non_null(worker->workspace);
    worker->again = arrays_create(f, 3);
    for (size_t o = 0; o < OPERATORS; o++) {
        worker->results[o] = arrays_create(f, 3);
        arrays_fill(&operators[o], f, 3, &random, &worker->results[o]);
        operators[o].apply(f, 3, &worker->results[o], worker->workspace);
    }
}

/* cmocka's assertions belong to the main thread, so deviations are counted. */
static void *worker_run(void *argument)
{
    struct worker *w = argument;
    const struct fixture *f = w->fixture;

    for (size_t repetition = 0; repetition < w->repetitions; repetition++) {
        for (size_t o = 0; o < OPERATORS; o++) {
            const struct arrays *expected = &w->results[o];
            size_t points = 3 * f->points * sizeof(double);
            size_t coefficients = 3 * f->coefficients * sizeof(double);

            arrays_copy_input(&operators[o], f, 3, expected, &w->again);
            operators[o].apply(f, 3, &w->again, w->workspace);
            w->deviations += memcmp(w->again.coefficients, expected->coefficients, coefficients) ||
                             memcmp(w->again.first, expected->first, points) ||
                             memcmp(w->again.second, expected->second, points);
        }
    }
    return NULL;
}

static void worker_close(struct worker *worker)
{
    for (size_t o = 0; o < OPERATORS; o++) {
        arrays_free(&worker->results[o]);
    }
    arrays_free(&worker->again);
    srnf_free(worker->workspace);
}

static void threads_share_a_transform(void **state)
{
    struct worker workers[2];
    pthread_t thread;
    struct fixture f;

    (void)state;
    fixture_open(&f, 31, &grid_shapes[0]);
    for (size_t i = 0; i < 2; i++) {
        worker_open(&workers[i], &f, 21 + i, 100);
    }
    assert_int_equal(pthread_create(&thread, NULL, worker_run, &workers[0]), 0);
    worker_run(&workers[1]);
    assert_int_equal(pthread_join(thread, NULL), 0);
    for (size_t i = 0; i < 2; i++) {
        assert_int_equal(workers[i].deviations, 0);
        worker_close(&workers[i]);
    }
    fixture_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_share_a_transform),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * Tasks of kind "pairs": the bits are those of the whole matrix, however the pairs are cut; what
 * is no such task, content or result is refused; a task that is told to stop yields nothing.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "support/random.h"
#include "support/shapes.h"
#include "tasks/tasks.h"

#include <stdlib.h>
#include <string.h>

#define DEGREE ((size_t)4)
#define N ((size_t)3)
#define COUNT ((size_t)(3 * (DEGREE + 1) * (DEGREE + 1)))
#define SIZE (8 * COUNT)

struct world {
    double surfaces[N][COUNT];
    unsigned char bytes[N][SIZE];
    struct tasks_content contents[N];
    struct srnf_register_options options;
    const struct tasks_kind *kind;
};

static int setup(void **state)
{
    struct world *world = calloc(1, sizeof *world);

    world->kind = tasks_kind_find(TASKS_PAIRS);
    world->options = srnf_register_options_defaults();
    world->options.degree = 3;
    world->options.max_steps = 3;
    world->options.start = SRNF_START_IDENTITY;
    for (size_t i = 0; i < N; i++) {
        struct shapes_surface s;

        shapes_open(&s, DEGREE);
        shapes_fill_random_star(&s, 7 + i, NULL);
        memcpy(world->surfaces[i], s.f, sizeof world->surfaces[i]);
        shapes_close(&s);
        tasks_put_doubles(world->bytes[i], world->surfaces[i], COUNT);
        world->contents[i].bytes = world->bytes[i];
        world->contents[i].size = SIZE;
    }
    *state = world;
    return 0;
}

static int teardown(void **state)
{
    free(*state);
    return 0;
}

static struct tasks_bytes inputs_of(const struct world *world, enum srnf_metric metric,
                                    size_t n_pairs, size_t (*list)[2])
{
    struct tasks_pairs pairs = {.degree = DEGREE,
                                .metric = metric,
                                .registration = world->options,
                                .n_surfaces = N,
                                .n_pairs = n_pairs,
                                .pairs = list};
    struct tasks_bytes inputs;

    assert_int_equal(tasks_pairs_write(&pairs, &inputs), SRNF_OK);
    return inputs;
}

static void bits_are_those_of_the_matrix(void **state)
{
    static const enum srnf_metric metrics[] = {SRNF_METRIC_SRNF, SRNF_METRIC_SRM};
    size_t list[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    const struct world *world = *state;
    const double *surfaces[N] = {world->surfaces[0], world->surfaces[1], world->surfaces[2]};
    struct srnf_sht *sht = NULL;

    assert_int_equal(srnf_sht_create(&sht, DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 0, 0), SRNF_OK);
    for (size_t k = 0; k < 2; k++) {
        struct tasks_bytes inputs = inputs_of(world, metrics[k], 3, list), result;
        double matrix[N * N], distances[3];

        assert_true(srnf_metric_distances(sht, metrics[k], N, surfaces, &world->options, NULL,
                                          matrix, NULL) >= 0);
        assert_true(world->kind->run(inputs.bytes, inputs.size, world->contents, N, NULL, &result,
                                     NULL) >= 0);
        assert_true(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
        assert_true(world->kind->possible(inputs.bytes, inputs.size, world->contents, N,
                                          result.bytes, result.size));
        tasks_pairs_distances(result.bytes, 3, distances);
        for (size_t p = 0; p < 3; p++) {
            double expected = matrix[list[p][0] * N + list[p][1]];

            assert_true(expected > 0.0);
            assert_memory_equal(&distances[p], &expected, sizeof expected);
        }
        distances[1] *= 1000.0;
        tasks_put_doubles(result.bytes, distances, 3);
        assert_true(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
        assert_false(world->kind->possible(inputs.bytes, inputs.size, world->contents, N,
                                           result.bytes, result.size));
        free(inputs.bytes);
        free(result.bytes);
    }
    srnf_sht_destroy(sht);
}

static void refuses(const struct world *world, const void *bytes, size_t size,
                    const struct tasks_content *contents, size_t n_contents)
{
    struct tasks_bytes result;

    assert_int_equal(world->kind->run(bytes, size, contents, n_contents, NULL, &result, NULL),
                     SRNF_EINVAL);
    assert_null(result.bytes);
}

static void what_is_no_task_is_refused(void **state)
{
    struct world *world = *state;
    size_t list[1][2] = {{0, 1}}, outside[1][2] = {{0, N}};
    struct tasks_bytes inputs = inputs_of(world, SRNF_METRIC_SRNF, 1, list);

    assert_null(tasks_kind_find("pairs of shoes"));
    for (size_t size = 0; size < inputs.size; size++) {
        refuses(world, inputs.bytes, size, world->contents, N);
    }
    refuses(world, inputs.bytes, inputs.size, world->contents, N - 1);
    world->contents[1].size -= 8;
    refuses(world, inputs.bytes, inputs.size, world->contents, N);
    world->contents[1].size += 8;
    inputs.bytes[0] ^= 1;
    refuses(world, inputs.bytes, inputs.size, world->contents, N);
    free(inputs.bytes);
    inputs = inputs_of(world, SRNF_METRIC_SRNF, 1, outside);
    refuses(world, inputs.bytes, inputs.size, world->contents, N);
    free(inputs.bytes);
    inputs = inputs_of(world, (enum srnf_metric)77, 1, list);
    refuses(world, inputs.bytes, inputs.size, world->contents, N);
    free(inputs.bytes);
}

static void what_is_too_large_is_refused(void **state)
{
    const struct world *world = *state;
    struct tasks_pairs pairs = {.degree = DEGREE,
                                .registration = world->options,
                                .n_surfaces = N,
                                .n_pairs = TASKS_INPUTS_MAX / 16};
    struct tasks_bytes inputs;

    assert_int_equal(tasks_pairs_write(&pairs, &inputs), SRNF_ELIMIT);
    pairs.n_pairs = 1;
    pairs.n_surfaces = TASKS_CONTENTS_MAX + 1;
    assert_int_equal(tasks_pairs_write(&pairs, &inputs), SRNF_ELIMIT);
}

static void what_is_no_result_is_told(void **state)
{
    const struct world *world = *state;
    size_t list[2][2] = {{0, 1}, {1, 2}};
    struct tasks_bytes inputs = inputs_of(world, SRNF_METRIC_SRNF, 2, list);
    double good[2] = {0.5, 0.0}, below[2] = {0.5, -1e-9}, none[2] = {0.5, 0.0};
    unsigned char bytes[16];

    none[1] /= none[1];
    tasks_put_doubles(bytes, good, 2);
    assert_true(world->kind->check(inputs.bytes, inputs.size, bytes, 16));
    assert_false(world->kind->check(inputs.bytes, inputs.size, bytes, 8));
    tasks_put_doubles(bytes, below, 2);
    assert_false(world->kind->check(inputs.bytes, inputs.size, bytes, 16));
    tasks_put_doubles(bytes, none, 2);
    assert_false(world->kind->check(inputs.bytes, inputs.size, bytes, 16));
    free(inputs.bytes);
}

static bool stops(void *user)
{
    (void)user;
    return true;
}

static void a_task_that_is_stopped_yields_nothing(void **state)
{
    const struct world *world = *state;
    const struct srnf_context context = {.canceled = stops};
    size_t list[1][2] = {{0, 1}};
    struct tasks_bytes inputs = inputs_of(world, SRNF_METRIC_SRNF, 1, list), result;

    assert_int_equal(
        world->kind->run(inputs.bytes, inputs.size, world->contents, N, &context, &result, NULL),
        SRNF_ECANCELED);
    assert_null(result.bytes);
    free(inputs.bytes);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(bits_are_those_of_the_matrix),          TEST(what_is_no_task_is_refused),
        TEST(what_is_too_large_is_refused),          TEST(what_is_no_result_is_told),
        TEST(a_task_that_is_stopped_yields_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_mean_anew.c - the mean of nearly symmetric surfaces does not depend on their poses: members
 * that the first registration has laid the wrong way round are turned once there is a mean. A run
 * that is resumed before or after that ends with the same bits.
 *
 * srnfd-test: no-asan (api/test_standard.sh runs its code)
 */
#include "bumps.h"
#include "support/compare.h"

#include <fftw3.h>

#define DEGREE ((size_t)12)
#define MEMBERS ((size_t)16)
#define POSES ((uint64_t)4)
#define TURNING_POSE ((uint64_t)2) /* in which members are turned */

/* Half of the members have a bump in one place; all have small ones anywhere. */
static struct bumps draw_member(uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    struct bumps bumps = {.centre = {{0.6, 0.7, 0.387}}, .height = {seed % 2 ? 0.12 : 0.0}};

    for (size_t k = 1; k < BUMPS_MAX; k++) {
        bumps_draw(&bumps, k, 0.03, &random);
    }
    return bumps;
}

static void open_posed(struct group *g, uint64_t pose)
{
    struct test_random random = test_random_seed(100 + pose);

    group_open(g, DEGREE, MEMBERS);
    for (size_t i = 0; i < MEMBERS; i++) {
        const struct bumps bumps = draw_member(i + 1);

        bumps_make(g, i, &bumps, &random);
    }
}

static void does_not_depend_on_poses(void **state)
{
    const struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    double least = INFINITY, most = 0.0;

    (void)state;
    options.registration = &registration;
    for (uint64_t pose = 0; pose < POSES; pose++) {
        struct group g;
        struct srnf_mean mean;
        double objective;

        open_posed(&g, pose);
        assert_int_equal(srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &mean, NULL),
                         SRNF_OK);
        objective = mean.history[mean.iterations - 1].objective;
        printf("# poses %d: objective %.3e after %zu iterations, %.3e after the first\n", (int)pose,
               objective, mean.iterations, mean.history[0].objective);
        for (size_t k = 1; k < mean.iterations; k++) {
            assert_true(mean.history[k].objective <= mean.history[k - 1].objective);
        }
        least = compare_min(least, objective);
        most = compare_max(most, objective);
        srnf_mean_clear(&mean);
        group_close(&g);
    }
    figure_below("objectives in other poses", most / least - 1.0, 0.02);
}

/* At rest with its last iteration: a mean whose members have just been turned has not converged. */
static void looks_after_the_last_iteration(void **state)
{
    const struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean;
    struct group g;

    (void)state;
    open_posed(&g, TURNING_POSE);
    options.registration = &registration;
    options.max_iterations = 1;
    options.tolerance = 10.0; /* any change is rest */
    assert_int_equal(srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &mean, NULL),
                     SRNF_WNOT_CONVERGED);
    assert_false(mean.converged);
    assert_int_equal(mean.iterations, 1);
    srnf_mean_clear(&mean);
    group_close(&g);
}

/* ---- Resumed --------------------------------------------------------------------------------- */

#define KEPT ((size_t)20)

struct keeper {
    unsigned char *bytes[KEPT];
    size_t size[KEPT], count;
};

static void keep(void *user, const void *bytes, size_t size)
{
    struct keeper *keeper = user;

    assert_true(keeper->count < KEPT);
    keeper->bytes[keeper->count] = malloc(size);
    assert_non_null(keeper->bytes[keeper->count]);
    memcpy(keeper->bytes[keeper->count], bytes, size);
    keeper->size[keeper->count++] = size;
}

static void goes_on_before_and_after(void **state)
{
    const struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct keeper keeper = {.count = 0};
    struct srnf_mean whole;
    struct group g;

    (void)state;
    open_posed(&g, TURNING_POSE);
    options.registration = &registration;
    options.checkpoint = keep;
    options.checkpoint_user = &keeper;
    assert_int_equal(srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &whole, NULL),
                     SRNF_OK);
    options.checkpoint = NULL;
    assert_true(keeper.count == whole.iterations && whole.iterations > 4);
    for (size_t k = 1; k < keeper.count; k++) {
        struct srnf_mean resumed;

        options.resume = keeper.bytes[k];
        options.resume_size = keeper.size[k];
        assert_int_equal(
            srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &resumed, NULL), SRNF_OK);
        assert_int_equal(resumed.iterations, whole.iterations);
        assert_memory_equal(resumed.mean_q, whole.mean_q, 3 * g.points * sizeof(double));
        assert_memory_equal(resumed.distances, whole.distances, MEMBERS * sizeof(double));
        srnf_mean_clear(&resumed);
    }
    for (size_t k = 0; k < keeper.count; k++) {
        free(keeper.bytes[k]);
    }
    srnf_mean_clear(&whole);
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(does_not_depend_on_poses),
        cmocka_unit_test(looks_after_the_last_iteration),
        cmocka_unit_test(goes_on_before_and_after),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_mean_anew.c - the mean of nearly symmetric surfaces does not depend on their poses: members
 * that the first registration has laid the wrong way round are turned once there is a mean. A run
 * that is resumed before or after that ends with the same bits.
 *
 * srnfd-test: no-asan (api/test_standard.sh runs its code)
 */
#include "group.h"
#include "support/compare.h"

#include <fftw3.h>

#define DEGREE ((size_t)12)
#define MEMBERS ((size_t)16)
#define BUMPS ((size_t)5)
#define POSES ((uint64_t)4)
#define TURNING_POSE ((uint64_t)2) /* in which members are turned */

/* An ellipsoid of three different axes with bumps: the same way round but for these. */
static struct {
    double centre[BUMPS + 1][3], height[BUMPS + 1];
    double turn[9];
} member;

static void bumpy(const double e[3], double parameter, double x[3])
{
    static const double axes[3] = {14.0, 9.0, 7.0};
    double u[3], square = 0.0, factor = 1.0;

    (void)parameter;
    for (size_t c = 0; c < 3; c++) {
        u[c] = figure_dot(3, member.turn + 3 * c, e);
        square += u[c] * u[c] / (axes[c] * axes[c]);
    }
    for (size_t k = 0; k <= BUMPS; k++) {
        factor += member.height[k] * exp(7.0 * (figure_dot(3, u, member.centre[k]) - 1.0));
    }
    for (size_t c = 0; c < 3; c++) {
        x[c] = factor / sqrt(square) * u[c];
    }
}

/* Half of the members have a bump in one place; all have small ones anywhere. */
static void draw_member(uint64_t seed)
{
    static const double place[3] = {0.6, 0.7, 0.387};
    struct test_random random = test_random_seed(seed);

    memcpy(member.centre[0], place, sizeof place);
    member.height[0] = seed % 2 ? 0.12 : 0.0;
    for (size_t k = 1; k <= BUMPS; k++) {
        double length;

        for (size_t c = 0; c < 3; c++) {
            member.centre[k][c] = test_random_normal(&random);
        }
        length = sqrt(figure_dot(3, member.centre[k], member.centre[k]));
        for (size_t c = 0; c < 3; c++) {
            member.centre[k][c] /= length;
        }
        member.height[k] = 0.03 * test_random_normal(&random);
    }
}

static void open_posed(struct group *g, uint64_t pose)
{
    struct test_random random = test_random_seed(100 + pose);
    struct shapes_surface own;

    group_open(g, DEGREE, MEMBERS);
    shapes_open(&own, DEGREE);
    for (size_t i = 0; i < MEMBERS; i++) {
        double rotation[9];

        draw_member(i + 1);
        shapes_random_rotation(&random, member.turn);
        shapes_fill(&own, bumpy, 0.0);
        memcpy(g->f[i], own.f, g->count * sizeof(double));
        shapes_random_rotation(&random, rotation);
        shapes_rotate(rotation, g->each, g->f[i]);
    }
    shapes_close(&own);
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

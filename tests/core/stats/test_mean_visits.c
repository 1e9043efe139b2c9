/*
 * test_mean_visits.c - two visits of a subject lie on the mean as they lie on each other, where
 * each for itself would lie as well another way round; visits of which the mean says otherwise than
 * they do are told of. The bits are the same on any number of threads, and of a resumed run.
 *
 * srnfd-test: no-asan (api/test_standard.sh runs its code)
 */
#include "bumps.h"
#include "support/compare.h"

#include <fftw3.h>

#define DEGREE ((size_t)12)
#define SUBJECTS ((size_t)5)
#define MEMBERS (2 * SUBJECTS)
#define KEPT ((size_t)20)

static const size_t subjects[MEMBERS] = {0, 0, 1, 1, 2, 2, 3, 3, 4, 4};

/* Each subject has bumps of its own, which change a little from the first visit to the second. */
static void open_visits(struct group *g, uint64_t seed)
{
    struct test_random random = test_random_seed(1000 + seed);

    group_open(g, DEGREE, MEMBERS);
    for (size_t i = 0; i < MEMBERS; i++) {
        struct test_random own = test_random_seed(1000 * seed + i / 2 + 1);
        struct bumps bumps = {.height = {0.0}};

        for (size_t k = 1; k < BUMPS_MAX; k++) {
            bumps_draw(&bumps, k, 0.02, &own);
        }
        for (size_t k = 1; k < BUMPS_MAX; k++) {
            bumps.height[k] += 0.004 * test_random_normal(&random);
        }
        bumps_make(g, i, &bumps, &random);
    }
}

/* How far the two visits of a subject are apart on the mean, over how far as a pair; the most of
   all subjects. */
static double most_apart(const struct group *g, const struct srnf_mean *mean)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    double most = 0.0;

    options.symmetric = true;
    for (size_t i = 0; i < MEMBERS; i += 2) {
        const double *q = mean->registered_q + i * 3 * g->points;
        struct srnf_registration pair;

        assert_true(srnf_register(g->sht, g->f[i], NULL, g->f[i + 1], &options, NULL, NULL, &pair,
                                  NULL) >= 0);
        most =
            compare_max(most, sqrt(stats_distance2(g->grid, q, q + 3 * g->points)) / pair.distance);
        srnf_registration_clear(&pair);
    }
    return most;
}

static double objective(const struct srnf_mean *mean)
{
    return mean->history[mean->iterations - 1].objective;
}

static void visits_lie_alike(void **state)
{
    static const uint64_t seeds[] = {9, 29};
    const struct srnf_register_options registration = srnf_register_options_defaults();

    (void)state;
    for (size_t k = 0; k < sizeof seeds / sizeof seeds[0]; k++) {
        struct srnf_mean_options options = srnf_mean_options_defaults();
        struct srnf_mean alone, together;
        struct group g;

        open_visits(&g, seeds[k]);
        options.registration = &registration;
        assert_int_equal(
            srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &alone, NULL), SRNF_OK);
        assert_null(alone.apart);
        figure_below("visits near, each by itself", 1.0 / most_apart(&g, &alone), 0.4);
        options.subjects = subjects;
        assert_int_equal(
            srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &together, NULL),
            SRNF_OK);
        figure_below("visits apart", most_apart(&g, &together), 1.1);
        figure_below("objective", objective(&together) / objective(&alone), 1.01);
        for (size_t i = 0; i < MEMBERS; i++) {
            assert_false(together.apart[i]);
        }
        srnf_mean_clear(&together);
        srnf_mean_clear(&alone);
        group_close(&g);
    }
}

/* ---- Told of --------------------------------------------------------------------------------- */

/* All have the bump of the mean, and the two visits of one subject a higher one of its own: on the
   same side and, half a turn about the long axis off, on the other. That lies on itself by its own
   bump, and on the mean by the mean's. */
static void what_stays_apart_is_told(void **state)
{
    static const double mean_at[3] = {0.8, 0.55, 0.24}, own_at[3] = {-0.2, 0.55, -0.81};
    const struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct test_random random = test_random_seed(5);
    struct srnf_mean mean;
    struct group g;

    (void)state;
    group_open(&g, DEGREE, MEMBERS);
    for (size_t i = 0; i < MEMBERS; i++) {
        struct bumps bumps = {.height = {0.1, i < 2 ? 0.125 : 0.0}};

        for (size_t c = 0; c < 3; c++) {
            bumps.centre[0][c] = mean_at[c];
            bumps.centre[1][c] = i == 1 && c > 0 ? -own_at[c] : own_at[c];
        }
        bumps_make(&g, i, &bumps, &random);
    }
    options.registration = &registration;
    options.subjects = subjects;
    assert_int_equal(srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &mean, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < MEMBERS; i++) {
        assert_true(mean.apart[i] == (i < 2));
    }
    srnf_mean_clear(&mean);
    group_close(&g);
}

/* ---- The same bits --------------------------------------------------------------------------- */

#define SEED_MOVED ((uint64_t)29) /* of which visits are moved */

struct keeper {
    struct group_watch watch; /* first: contexts see it */
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

static void assert_same(const struct group *g, const struct srnf_mean *a, const struct srnf_mean *b)
{
    assert_int_equal(a->iterations, b->iterations);
    assert_memory_equal(a->mean_q, b->mean_q, 3 * g->points * sizeof(double));
    assert_memory_equal(a->registered_q, b->registered_q, MEMBERS * 3 * g->points * sizeof(double));
    assert_memory_equal(a->apart, b->apart, MEMBERS * sizeof(bool));
}

static void the_same_bits_on_threads_and_resumed(void **state)
{
    const struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct keeper keeper = {.count = 0};
    struct srnf_context context = group_context(&keeper.watch, 8);
    struct srnf_mean whole, again;
    struct group g;

    (void)state;
    open_visits(&g, SEED_MOVED);
    options.registration = &registration;
    options.subjects = subjects;
    options.checkpoint = keep;
    options.checkpoint_user = &keeper;
    assert_int_equal(srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &whole, NULL),
                     SRNF_OK);
    options.checkpoint = NULL;
    assert_int_equal(keeper.count, whole.iterations);
    assert_int_equal(
        srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, &context, &again, NULL), SRNF_OK);
    assert_same(&g, &whole, &again);
    srnf_mean_clear(&again);
    for (size_t k = 1; k < keeper.count; k++) {
        options.resume = keeper.bytes[k];
        options.resume_size = keeper.size[k];
        assert_int_equal(
            srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &again, NULL), SRNF_OK);
        assert_same(&g, &whole, &again);
        srnf_mean_clear(&again);
    }
    options.subjects = NULL;
    assert_int_equal(srnf_karcher_mean(g.sht, MEMBERS, g.surfaces, &options, NULL, &again, NULL),
                     SRNF_EINVAL); /* a checkpoint of other subjects */
    for (size_t k = 0; k < keeper.count; k++) {
        free(keeper.bytes[k]);
    }
    srnf_mean_clear(&whole);
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(visits_lie_alike),
        cmocka_unit_test(what_stays_apart_is_told),
        cmocka_unit_test(the_same_bits_on_threads_and_resumed),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_register_rotations.c - real surfaces in another pose: a rotation of the domain and one of
 * the values, both random, are found again. Common pose, equal surfaces, warm start.
 * srnfd-test: slow
 * srnfd-test: no-asan (test_register_known.c and api/test_standard.sh run its code)
 */
#include "registrations.h"

#define DEGREE 15
#define LIMIT 1e-8 /* of the squared distance, at unit area */
/* test_register_rotations_nightly.c has 200. */
#ifndef ROTATIONS
#define ROTATIONS (FIGURES_SLOW ? 12 : 48)
#endif
#define ELASTIC_EVERY 24 /* of these one in so many starts from the tournament, in exact mode */

static const char *const surfaces[] = {
    REGISTRATIONS_LOCAL "L_thalamus.ply",
    REGISTRATIONS_LOCAL "R_thalamus.ply",
    REGISTRATIONS_LOCAL "L_pallidum.ply",
    REGISTRATIONS_LOCAL "R_pallidum.ply",
    REGISTRATIONS_LOCAL "L_amygdala.ply",
    "ventricle 0",
    "ventricle 5",
    "asteroid 1",
    "asteroid 2",
    "asteroid 8",
    "asteroid 9",
    "asteroid 4",
};
#define SURFACES (sizeof surfaces / sizeof surfaces[0])

/* The turned surface has the exact degree of the original: no truncation is in the way. */
static double recover(const struct shapes_surface *s, struct test_random *random, bool elastic)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;
    struct srnf_warp turn;
    double rotation[9];
    double *f = shapes_doubles(s->count);
    double distance2;

    options.exact = elastic;
    options.reparameterization = elastic;
    options.start = elastic ? SRNF_START_TOURNAMENT : SRNF_START_RIGID;
    registrations_warp(random, 1.0, &turn);
    shapes_random_rotation(random, rotation);
    registrations_resample(s, &turn, rotation, f);
    registrations_run(s, NULL, f, &options, &r);
    distance2 = r.distance * r.distance;
    assert_true(r.distance <= r.distance_before);
    srnf_registration_clear(&r);
    srnf_warp_clear(&turn);
    srnf_free(f);
    return distance2;
}

static void finds_every_rotation(void **state)
{
    struct test_random random = test_random_seed(11);
    size_t done = 0;
    (void)state;

    for (size_t k = 0; k < SURFACES; k++) {
        struct shapes_surface s;
        size_t from = k * ROTATIONS / SURFACES;
        size_t to = (k + 1) * ROTATIONS / SURFACES;
        double worst = 0.0;

        assert_true(registrations_open(&s, DEGREE, surfaces[k]));
        for (size_t i = from; i < to; i++) {
            worst =
                compare_max(worst, recover(&s, &random, i % ELASTIC_EVERY == ELASTIC_EVERY - 1));
            done++;
        }
        figure_below(surfaces[k], worst, LIMIT);
        shapes_close(&s);
    }
    printf("# %zu pairs of rotations\n", done);
    assert_true(done > 0);
}

static void common_pose_turns_nothing(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct shapes_surface a;
    struct shapes_surface b;
    struct srnf_registration r;
    (void)state;

    assert_true(registrations_open(&a, DEGREE, surfaces[0]));
    assert_true(registrations_open(&b, DEGREE, surfaces[2]));
    options.common_pose = true;
    registrations_run(&a, NULL, b.f, &options, &r);
    for (size_t i = 0; i < 9; i++) {
        assert_true(r.rotation[i] == (i % 4 == 0 ? 1.0 : 0.0));
    }
    assert_int_equal(r.warp.links[0].kind, SRNF_WARP_ROTATION);
    for (size_t i = 0; i < 9; i++) {
        assert_true(r.warp.links[0].values[i] == (i % 4 == 0 ? 1.0 : 0.0));
    }
    assert_true(r.distance < r.distance_before);
    srnf_registration_clear(&r);
    shapes_close(&a);
    shapes_close(&b);
}

static void equal_surfaces_need_no_step(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct shapes_surface a;
    struct srnf_registration r;
    (void)state;

    assert_true(registrations_open(&a, DEGREE, surfaces[0]));
    options.start = SRNF_START_IDENTITY;
    registrations_run(&a, NULL, a.f, &options, &r);
    figure_below("distance^2 of a surface to itself", r.distance * r.distance, 1e-24);
    assert_int_equal(r.iterations, 0);
    srnf_registration_clear(&r);
    shapes_close(&a);
}

/* A warm start goes on from the chain: never worse, and much shorter than a search. */
static void warm_start_goes_on(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct shapes_surface a;
    struct shapes_surface b;
    struct srnf_registration cold;
    struct srnf_registration warm;
    (void)state;

    assert_true(registrations_open(&a, DEGREE, surfaces[0]));
    assert_true(registrations_open(&b, DEGREE, surfaces[2]));
    registrations_run(&a, NULL, b.f, &options, &cold);
    assert_int_equal(srnf_register(a.sht, a.f, NULL, b.f, &options, &cold, NULL, &warm, NULL),
                     SRNF_OK);
    printf("# objective %.8f in %zu steps, then %.8f in %zu\n", cold.objective, cold.iterations,
           warm.objective, warm.iterations);
    assert_true(warm.objective <= cold.objective);
    assert_true(warm.iterations < cold.iterations / 4);
    assert_true(warm.warp.n_links >= cold.warp.n_links);
    srnf_registration_clear(&cold);
    srnf_registration_clear(&warm);
    shapes_close(&a);
    shapes_close(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finds_every_rotation),
        cmocka_unit_test(common_pose_turns_nothing),
        cmocka_unit_test(equal_surfaces_need_no_step),
        cmocka_unit_test(warm_start_goes_on),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_certificate.c - what an inversion says about its own result where q is exact: the
 * certificate of uniqueness, and the bound on the surface error beside the true error.
 * test_bound.c has the same with noise.
 * srnfd-test: slow
 * srnfd-test: release-only
 * Under the sanitizers test_bound.c and test_invert_contract.c run the same code.
 */
#include "inversions.h"

#define STRIDE (FIGURES_SLOW ? 4 : 1)

static void print_certificate(const struct srnf_certificate *c)
{
    printf("#   T: %.1e at the result, then %.1e, threshold %.1e: %s\n", c->residual,
           c->second_eigenvalue, c->threshold,
           !c->computed ? "not computed" : (c->unique ? "unique" : "says nothing"));
}

/* The certificate speaks on the bodies with arms, and on them alone: a surface whose Gauss map is
   one-to-one has neighbours with the same normals. */
static void speaks_where_it_can(void **state)
{
    struct test_random random = test_random_seed(1);
    (void)state;

    for (size_t k = 0; k < shapes_case_count; k += STRIDE) {
        const struct shapes_case *which = &shapes_cases[k];
        struct srnf_inversion result;
        struct shapes_surface s;
        double error;

        shapes_open_case(&s, which);
        shapes_move(&s, &random);
        assert_int_equal(inversion_run(&s, 1e-12, true, NULL, &result), SRNF_OK);
        error = inversion_error(which->name, &s, &result);
        print_certificate(&result.certificate);
        assert_true(error <= result.surface_error_bound);
        assert_true(error <= 1e-5);
        assert_true(result.smallest_singular_value > 0.0);
        assert_true(result.certificate.computed);
        assert_true(result.certificate.unique == which->unique);
        if (which->unique) {
            assert_true(result.certificate.second_eigenvalue > result.certificate.threshold);
            assert_true(result.certificate.threshold >= 100.0 * result.certificate.residual);
        } else {
            assert_true(result.certificate.second_eigenvalue < result.certificate.threshold);
        }
        srnf_inversion_clear(&result);
        shapes_close(&s);
    }
}

/* Above degree 31 the matrix is too large, and nothing is said; the bound is there all the same. */
static void is_silent_above_its_degree(void **state)
{
    struct srnf_inversion result;
    struct shapes_surface s;
    (void)state;

    shapes_open(&s, 34);
    shapes_fill(&s, shapes_bumpy, 0.0);
    assert_int_equal(inversion_run(&s, 1e-12, true, s.f, &result), SRNF_OK);
    assert_true(inversion_error("bumpy star", &s, &result) <= result.surface_error_bound);
    assert_false(result.certificate.computed || result.certificate.unique);
    srnf_inversion_clear(&result);
    shapes_close(&s);
}

/* Writes a start into f: close by (a tenth of the surface, smooth), or a sphere turned anyhow. */
static void another_start(const struct shapes_surface *s, bool near, struct test_random *random,
                          double *f)
{
    double rotation[9];
    double size = figure_norm(s->count, s->f);
    double norm;

    memset(f, 0, s->count * sizeof *f);
    for (size_t l = 1; near && l <= 6; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            for (size_t c = 0; c < 3; c++) {
                f[c * s->each + i] = test_random_normal(random) / (double)(l * (l + 1));
            }
        }
    }
    if (!near) {
        f[3] = f[s->each + 1] = f[2 * s->each + 2] = 1.0;
        shapes_random_rotation(random, rotation);
        shapes_rotate(rotation, s->each, f);
    }
    norm = figure_norm(s->count, f);
    for (size_t i = 0; i < s->count; i++) {
        f[i] = near ? s->f[i] + 0.1 * size / norm * f[i] : size / norm * f[i];
    }
}

/* A surface that is certified unique must be what every other start ends in, if it ends in a
   solution at all. */
static void certified_surfaces_are_reached_from_elsewhere(void **state)
{
    const char *const names[] = {"3 arms", "5 arms", "8 arms", "12 arms"};
    struct test_random random = test_random_seed(2);
    (void)state;

    for (size_t k = 0; k < sizeof names / sizeof names[0]; k += STRIDE) {
        struct shapes_surface s;
        double *start;
        size_t reached[2] = {0, 0};
        double worst = 0.0;

        shapes_open_case(&s, shapes_find(names[k]));
        start = shapes_doubles(s.count);
        for (size_t i = 0; i < 4; i++) {
            struct srnf_inversion result;
            bool near = i % 2 == 0;

            another_start(&s, near, &random, start);
            if (inversion_run(&s, 1e-14, false, start, &result) == SRNF_OK) {
                reached[near]++;
                worst = compare_max(worst, shapes_distance(s.degree, result.coefficients, s.f));
            }
            srnf_inversion_clear(&result);
        }
        printf("# %s: solved from %zu of 2 neighbours and %zu of 2 turned spheres, largest error "
               "%.1e\n",
               names[k], reached[1], reached[0], worst);
        assert_int_equal(reached[1], 2);
        assert_true(worst <= 1e-5);
        srnf_free(start);
        shapes_close(&s);
    }
}

/* With less and less noise: what is certified stands above a hundred times the noise, always. */
static void certificate_knows_the_noise(void **state)
{
    struct test_random random = test_random_seed(4);
    (void)state;

    for (int exponent = 9; exponent >= 3; exponent--) {
        struct srnf_inversion result;
        struct shapes_surface s;
        double error;

        shapes_open_case(&s, shapes_find("12 arms"));
        shapes_add_noise(&s, pow(10.0, -exponent), &random);
        (void)inversion_run(&s, 1e-12, true, NULL, &result);
        printf("# noise 1e-%d:\n", exponent);
        error = inversion_error("12 arms", &s, &result);
        print_certificate(&result.certificate);
        assert_true(error <= result.surface_error_bound);
        if (result.certificate.unique) {
            assert_true(result.certificate.second_eigenvalue >
                        100.0 * (result.certificate.residual + result.relative_energy));
        }
        assert_true(exponent > 4 || !result.certificate.unique);
        srnf_inversion_clear(&result);
        shapes_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(speaks_where_it_can),
        cmocka_unit_test(is_silent_above_its_degree),
        cmocka_unit_test(certified_surfaces_are_reached_from_elsewhere),
        cmocka_unit_test(certificate_knows_the_noise),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

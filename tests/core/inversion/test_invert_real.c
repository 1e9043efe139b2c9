/*
 * test_invert_real.c - thalami and pallida, encoded by star at degree 31, whose SRNFs are inverted
 * from the unit sphere. The paper reports relative energies of 9.0e-4 (thalamus) and 6.9e-4
 * (pallidum) with 200 harmonics.
 * srnfd-test: slow
 * srnfd-test: release-only
 * It measures accuracy; under the sanitizers test_invert.c runs the same code.
 */
#include "inversions.h"

#define DEGREE 31

static const struct {
    const char *name;
    double paper; /* relative energy */
} structures[] = {
    {"L_thalamus", 9.0e-4},
    {"R_thalamus", 9.0e-4},
    {"L_pallidum", 6.9e-4},
    {"R_pallidum", 6.9e-4},
};
#define STRUCTURES (sizeof structures / sizeof structures[0])
#define STRIDE (FIGURES_SLOW ? 2 : 1)

static void inverts_brain_structures(void **state)
{
    struct test_random random = test_random_seed(1);
    (void)state;

    for (size_t k = 0; k < STRUCTURES; k += STRIDE) {
        struct shapes_surface s;
        struct srnf_inversion result;

        shapes_open(&s, DEGREE);
        assert_true(shapes_fill_structure(&s, structures[k].name, SRNF_PARAMETERIZATION_STAR));
        shapes_move(&s, &random);
        for (size_t tight = 0; tight < 2; tight++) {
            double tolerance = tight ? 1e-16 : 1e-12;

            assert_int_equal(inversion_run(&s, tolerance, false, NULL, &result), SRNF_OK);
            assert_true(inversion_error(structures[k].name, &s, &result) <= (tight ? 1e-6 : 1e-5));
            assert_true(result.relative_energy <= tolerance);
            assert_true(result.relative_energy < structures[k].paper);
            srnf_inversion_clear(&result);
        }
        printf("#   the paper: E %.1e\n", structures[k].paper);
        shapes_close(&s);
    }
}

/* The bound, and the certificate where q is exact. */
static void tells_how_well_it_did(void **state)
{
    const double noise[] = {0.0, 1e-3, 1e-2};
    struct test_random random = test_random_seed(2);
    (void)state;

    for (size_t k = 0; k < STRUCTURES; k += STRIDE) {
        for (size_t a = 0; a < 3; a++) {
            struct shapes_surface s;
            struct srnf_inversion result;
            const struct srnf_certificate *c = &result.certificate;
            double error;

            shapes_open(&s, DEGREE);
            assert_true(shapes_fill_structure(&s, structures[k].name, SRNF_PARAMETERIZATION_STAR));
            shapes_add_noise(&s, noise[a], &random);
            (void)inversion_run(&s, compare_max(1e-12, noise[a] * noise[a]), true, NULL, &result);
            printf("# noise %.0e:\n", noise[a]);
            error = inversion_error(structures[k].name, &s, &result);
            assert_true(error <= result.surface_error_bound);
            assert_true(c->computed == (noise[a] == 0.0));
            assert_true(c->unique == c->computed); /* their folds tie the surface together */
            assert_true(!c->unique || c->second_eigenvalue > c->threshold);
            if (c->computed) {
                printf("#   T: %.1e at the result, then %.1e, threshold %.1e: %s\n", c->residual,
                       c->second_eigenvalue, c->threshold, c->unique ? "unique" : "says nothing");
            }
            srnf_inversion_clear(&result);
            shapes_close(&s);
        }
    }
}

/* Radial surfaces: the closed form is exact, and what the library takes when it may choose. */
static void closed_form_is_exact_on_encoded_stars(void **state)
{
    (void)state;
    for (size_t k = 0; k < STRUCTURES; k++) {
        struct shapes_surface s;
        double *f;
        double relative;
        double error;

        shapes_open(&s, DEGREE);
        f = shapes_doubles(s.count);
        assert_true(shapes_fill_structure(&s, structures[k].name, SRNF_PARAMETERIZATION_STAR));
        srnf_invert_closed_form(s.sht, s.q, f, &relative, s.workspace);
        error = shapes_distance(s.degree, f, s.f);
        printf("# %s, closed form: E %.1e, error %.1e\n", structures[k].name, relative, error);
        assert_true(relative <= 1e-24 && error <= 1e-12);
        srnf_free(f);
        shapes_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inverts_brain_structures),
        cmocka_unit_test(tells_how_well_it_did),
        cmocka_unit_test(closed_form_is_exact_on_encoded_stars),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

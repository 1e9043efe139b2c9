/*
 * test_bound.c - the bound on the surface error beside the true error, with white noise on the grid
 * of relative norm 1e-3 and 1e-2 in q; and no certificate then.
 * srnfd-test: slow
 * srnfd-test: no-asan (api/test_processes.sh runs its code)
 */
#include "inversions.h"

#define STRIDE (FIGURES_SLOW ? 5 : 1)

static void check_bound(const struct shapes_case *which, double amplitude, double tolerance,
                        struct test_random *random)
{
    struct srnf_inversion result;
    struct shapes_surface s;
    double error;

    shapes_open_case(&s, which);
    shapes_add_noise(&s, amplitude, random);
    (void)inversion_run(&s, tolerance, true, NULL, &result);
    printf("# noise %.0e:\n", amplitude);
    error = inversion_error(which->name, &s, &result);
    assert_false(result.certificate.computed || result.certificate.unique);
    assert_true(error <= result.surface_error_bound);
    assert_true(result.relative_energy <= 1.01 * amplitude * amplitude);
    srnf_inversion_clear(&result);
    shapes_close(&s);
}

/* Inverted as far as the noise goes: the truth itself has this energy. */
static void holds_at_the_level_of_the_noise(void **state)
{
    const double amplitudes[] = {1e-3, 1e-2};
    struct test_random random = test_random_seed(1);
    (void)state;

    for (size_t k = 0; k < shapes_case_count; k += STRIDE) {
        for (size_t a = 0; a < 2; a++) {
            check_bound(&shapes_cases[k], amplitudes[a], amplitudes[a] * amplitudes[a], &random);
        }
    }
}

/* Inverted to the minimum, which fits some of the noise too. */
static void holds_at_the_minimum(void **state)
{
    const char *const names[] = {"bumpy star", "ellipsoid", "bent capsule", "4 arms", "12 arms"};
    struct test_random random = test_random_seed(2);
    (void)state;

    for (size_t k = 0; k < sizeof names / sizeof names[0]; k += STRIDE) {
        check_bound(shapes_find(names[k]), 1e-3, 1e-12, &random);
        check_bound(shapes_find(names[k]), 1e-2, 1e-12, &random);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(holds_at_the_level_of_the_noise),
        cmocka_unit_test(holds_at_the_minimum),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

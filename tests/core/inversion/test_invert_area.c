/*
 * test_invert_area.c - structures that no point sees whole, encoded by the route area at degree 31,
 * whose SRNFs are inverted from the unit sphere: what the closed form cannot do.
 *
 * srnfd-test: timeout 300
 * srnfd-test: no-asan (api/test_processes.sh and core/srnf/test_shape_memory.c run its code)
 */
#include "inversions.h"

#define DEGREE 31

static const char *const structures[] = {"L_putamen", "R_putamen",     "L_caudate",
                                         "R_caudate", "L_hippocampus", "R_hippocampus"};
#define STRUCTURES (sizeof structures / sizeof structures[0])
#define STRIDE (FIGURES_SLOW ? 4 : 1)

static void inverts_from_the_sphere(void **state)
{
    struct test_random random = test_random_seed(1);
    (void)state;

    for (size_t k = 0; k < STRUCTURES; k += STRIDE) {
        struct shapes_surface s;
        struct srnf_inversion result;
        double *f;
        double closed;
        double error;

        shapes_open(&s, DEGREE);
        assert_true(shapes_fill_structure(&s, structures[k], SRNF_PARAMETERIZATION_AREA));
        f = shapes_doubles(s.count);
        srnf_invert_closed_form(s.sht, s.q, f, &closed, s.workspace);
        srnf_free(f);
        shapes_move(&s, &random);
        assert_int_equal(inversion_run(&s, 1e-12, false, NULL, &result), SRNF_OK);
        error = inversion_error(structures[k], &s, &result);
        printf("#   the closed form: E %.1e\n", closed);
        assert_true(result.relative_energy <= 1e-12);
        assert_true(closed > 1e-2);
        assert_true(error <= 1e-5);
        srnf_inversion_clear(&result);
        shapes_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(inverts_from_the_sphere)};

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

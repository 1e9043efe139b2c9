/*
 * test_libsharp.c - the transforms against libsharp, an independent implementation: values, both
 * derivatives, analysis and the adjoint, with random coefficients. The mapping between the two
 * bases is in support/libsharp.h.
 */
#include "fixture.h"
#include "support/libsharp.h"

#define TOLERANCE 1e-12

static const size_t degrees[] = {4, 15, 31, 63, 127};
#define DEGREES (sizeof degrees / sizeof degrees[0])

typedef void comparison(const struct fixture *f, struct test_random *random);

/* All degrees on all grids. */
static void compare_everywhere(comparison *compare, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);

    for (size_t s = 0; s < GRID_SHAPES; s++) {
        for (size_t i = 0; i < DEGREES; i++) {
            struct fixture f;

            fixture_open(&f, degrees[i], &grid_shapes[s]);
            compare(&f, &random);
            fixture_close(&f);
        }
    }
}

static void compare_synthesis(const struct fixture *f, struct test_random *random)
{
    double *c = fixture_normals(random, f->coefficients);
    double *ours = fixture_doubles(f->points);
    double *theirs = fixture_doubles(f->points);
    struct libsharp sharp;

    libsharp_open(&sharp, f->degree, f->grid, false);
    libsharp_from_coefficients(&sharp, c);
    libsharp_run(&sharp, SHARP_ALM2MAP, theirs, NULL);
    srnf_sht_synthesis(f->sht, 1, c, ours, f->workspace);
    assert_at_most(compare_relative(f->points, ours, theirs), TOLERANCE);
    libsharp_close(&sharp);
    srnf_free(c);
    srnf_free(ours);
    srnf_free(theirs);
}

static void compare_gradient(const struct fixture *f, struct test_random *random)
{
    double *c = fixture_normals(random, f->coefficients);
    double *ours = fixture_doubles(2 * f->points);
    double *theirs = fixture_doubles(2 * f->points);
    struct libsharp sharp;

    libsharp_open(&sharp, f->degree, f->grid, false);
    libsharp_from_coefficients(&sharp, c);
    libsharp_run(&sharp, SHARP_ALM2MAP_DERIV1, theirs, theirs + f->points);
    srnf_sht_gradient(f->sht, 1, c, ours, ours + f->points, f->workspace);
    assert_at_most(compare_relative(f->points, ours, theirs), TOLERANCE);
    assert_at_most(compare_relative(f->points, ours + f->points, theirs + f->points), TOLERANCE);
    libsharp_close(&sharp);
    srnf_free(c);
    srnf_free(ours);
    srnf_free(theirs);
}

/* The fields are random at every node, not band-limited: the sums must agree for any input. */
static void compare_sums(const struct fixture *f, struct test_random *random, bool weighted)
{
    double *field = fixture_normals(random, f->points);
    double *ours = fixture_doubles(f->coefficients);
    double *theirs = fixture_doubles(f->coefficients);
    struct libsharp sharp;

    libsharp_open(&sharp, f->degree, f->grid, weighted);
    libsharp_run(&sharp, SHARP_MAP2ALM, field, NULL);
    libsharp_to_coefficients(&sharp, theirs);
    (weighted ? srnf_sht_analysis : srnf_sht_synthesis_adjoint)(f->sht, 1, field, ours,
                                                                f->workspace);
    assert_at_most(compare_relative(f->coefficients, ours, theirs), TOLERANCE);
    libsharp_close(&sharp);
    srnf_free(field);
    srnf_free(ours);
    srnf_free(theirs);
}

static void compare_analysis(const struct fixture *f, struct test_random *random)
{
    compare_sums(f, random, true);
}

static void compare_adjoint(const struct fixture *f, struct test_random *random)
{
    compare_sums(f, random, false);
}

static void values_agree(void **state)
{
    (void)state;
    compare_everywhere(compare_synthesis, 51);
}

static void derivatives_agree(void **state)
{
    (void)state;
    compare_everywhere(compare_gradient, 52);
}

static void analyses_agree(void **state)
{
    (void)state;
    compare_everywhere(compare_analysis, 53);
}

static void adjoints_agree(void **state)
{
    (void)state;
    compare_everywhere(compare_adjoint, 54);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_agree),
        cmocka_unit_test(derivatives_agree),
        cmocka_unit_test(analyses_agree),
        cmocka_unit_test(adjoints_agree),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

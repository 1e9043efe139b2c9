/*
 * test_place.c - surfaces at other degrees and places, their measures, and how far one is from the
 * truth.
 */
#include "core/figures.h"

#define DEGREE ((size_t)9)

static bool always(void *user)
{
    (void)user;
    return true;
}

static void degrees_are_cut_and_filled(void **state)
{
    struct shapes_surface s;
    double *up, *back, *low;
    (void)state;

    shapes_open(&s, DEGREE);
    shapes_fill_random_star(&s, 3, NULL);
    up = shapes_doubles(3 * srnf_coefficient_count(12));
    back = shapes_doubles(s.count);
    low = shapes_doubles(3 * srnf_coefficient_count(4));
    for (size_t i = 0; i < 3 * srnf_coefficient_count(12); i++) {
        up[i] = 7.0;
    }
    srnf_surface_change_degree(DEGREE, s.f, 12, up);
    for (size_t k = 0; k < 3; k++) {
        for (size_t i = 0; i < srnf_coefficient_count(12); i++) {
            assert_true(up[k * srnf_coefficient_count(12) + i] ==
                        (i < s.each ? s.f[k * s.each + i] : 0.0));
        }
    }
    srnf_surface_change_degree(12, up, DEGREE, back);
    assert_memory_equal(back, s.f, s.count * sizeof(double));
    srnf_surface_change_degree(DEGREE, s.f, 4, low);
    for (size_t k = 0; k < 3; k++) {
        assert_memory_equal(low + k * 25, s.f + k * s.each, 25 * sizeof(double));
    }
    srnf_free(up);
    srnf_free(back);
    srnf_free(low);
    shapes_close(&s);
}

static void measures_of_several_and_moved(void **state)
{
    const struct srnf_context canceled = {.canceled = always};
    const double target[3] = {4.0, -2.0, 0.25};
    struct srnf_surface_measures measures[2], one;
    struct shapes_surface s;
    double *two;
    (void)state;

    shapes_open(&s, DEGREE);
    shapes_fill_random_star(&s, 3, NULL);
    two = shapes_doubles(2 * s.count);
    memcpy(two, s.f, s.count * sizeof(double));
    for (size_t i = 0; i < s.count; i++) {
        two[s.count + i] = 2.0 * s.f[i];
    }
    assert_int_equal(srnf_surfaces_measure(s.sht, 2, two, NULL, measures), SRNF_OK);
    srnf_surface_measure(s.sht, s.f, &one, s.workspace);
    assert_memory_equal(&measures[0], &one, sizeof one);
    assert_true(fabs(measures[1].area - 4.0 * one.area) <= 1e-13);
    srnf_surface_move(DEGREE, two + s.count, &measures[1], target);
    srnf_surface_measure(s.sht, two + s.count, &one, s.workspace);
    for (size_t k = 0; k < 3; k++) {
        assert_true(measures[1].centroid[k] == target[k]);
        assert_true(fabs(one.centroid[k] - target[k]) <= 1e-13);
    }
    assert_true(fabs(one.area - measures[1].area) <= 1e-13);
    assert_int_equal(srnf_surfaces_measure(s.sht, 2, two, &canceled, measures), SRNF_ECANCELED);
    srnf_free(two);
    shapes_close(&s);
}

/* Wherever it is and whichever sign the truth has; and by as much as a coefficient is off. */
static void errors_leave_places_and_signs_out(void **state)
{
    struct srnf_surface_measures measures;
    struct shapes_surface s;
    double *other;
    (void)state;

    shapes_open(&s, DEGREE);
    shapes_fill_random_star(&s, 3, NULL);
    other = shapes_doubles(s.count);
    for (size_t i = 0; i < s.count; i++) {
        other[i] = s.f[i];
        s.f[i] *= -1.0;
    }
    srnf_surface_measure(s.sht, s.f, &measures, s.workspace);
    assert_true(measures.volume < 0.0);
    other[s.each] += 5.0; /* l = 0 of y */
    assert_true(srnf_surface_error(DEGREE, s.f, &measures, other) == 0.0);
    other[s.each + 7] += 0.03;
    measures.area = 4.0;
    assert_true(fabs(srnf_surface_error(DEGREE, s.f, &measures, other) - 0.015) <= 1e-15);
    srnf_free(other);
    shapes_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(degrees_are_cut_and_filled),
        cmocka_unit_test(measures_of_several_and_moved),
        cmocka_unit_test(errors_leave_places_and_signs_out),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

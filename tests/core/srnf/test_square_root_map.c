/*
 * test_square_root_map.c - square-root maps q = |n|^(1/2) f: on the grid and at points, their
 * derivative, that warps act on them isometrically, and that registration by them undoes a warp.
 *
 * srnfd-test: no-asan (api/test_standard.sh and core/registration/test_tabulated.c run its code)
 */
#include "core/registration/registrations.h"

#define DEGREE 12
#define N ((size_t)40)

/* Samples of the square-root map of s at points. */
static void sample(const struct shapes_surface *s, size_t n, const double *points,
                   struct samples *samples)
{
    struct moving moving;

    assert_int_equal(moving_create(&moving, s->degree, s->f, s->degree, NULL), SRNF_OK);
    moving.representation = SRNF_REPRESENTATION_SRM;
    assert_int_equal(samples_create(samples, n), SRNF_OK);
    moving_evaluate(&moving, points, samples);
    moving_clear(&moving);
}

/* |q|^2 = |n| |f|^2, q along f; and the norm of q is the second moment of the area. */
static void is_what_it_is_defined_as(void **state)
{
    struct shapes_surface s;
    double *q;
    double *x;
    double *points;
    double worst = 0.0;
    struct samples samples;

    (void)state;
    shapes_open(&s, DEGREE);
    shapes_fill(&s, shapes_bumpy, 0.0);
    q = shapes_doubles(3 * s.points);
    x = shapes_doubles(3 * s.points);
    points = shapes_doubles(4 * s.points);
    srnf_square_root_map(s.sht, s.f, q, s.workspace);
    srnf_sht_synthesis(s.sht, 3, s.f, x, s.workspace);
    registration_nodes(s.grid, points, points + 3 * s.points);
    sample(&s, s.points, points, &samples);
    for (size_t i = 0; i < s.points; i++) {
        double area = 0.0; /* |n| = |SRNF|^2 */

        for (size_t k = 0; k < 3; k++) {
            area += s.q[k * s.points + i] * s.q[k * s.points + i];
        }
        for (size_t k = 0; k < 3; k++) {
            double wanted = sqrt(area) * x[k * s.points + i];

            worst = compare_max(worst, fabs(q[k * s.points + i] - wanted));
            worst = compare_max(worst, fabs(samples.q[3 * i + k] - wanted));
        }
    }
    figure_below("square-root map on the grid and at its nodes", worst, 1e-12);
    samples_clear(&samples);
    srnf_free(points);
    srnf_free(x);
    srnf_free(q);
    shapes_close(&s);
}

/* Central differences along both tangents, at two widths: of second order. */
static void derivative_agrees_with_differences(void **state)
{
    static const double widths[2] = {2e-3, 1e-3};
    struct shapes_surface s;
    struct test_random random = test_random_seed(5);
    double points[3 * N];
    struct samples here;
    double errors[2] = {0.0, 0.0};

    (void)state;
    shapes_open(&s, DEGREE);
    shapes_fill(&s, shapes_bumpy, 0.0);
    for (size_t i = 0; i < N; i++) {
        test_random_direction(&random, points + 3 * i);
    }
    sample(&s, N, points, &here);
    for (size_t w = 0; w < 2; w++) {
        for (size_t b = 0; b < 2; b++) {
            const double *tangent = b ? here.t2 : here.t1;
            const double *derivative = b ? here.q_2 : here.q_1;
            double moved[6 * N];
            struct samples there;

            for (size_t i = 0; i < 3 * N; i++) {
                moved[i] = cos(widths[w]) * points[i] + sin(widths[w]) * tangent[i];
                moved[3 * N + i] = cos(widths[w]) * points[i] - sin(widths[w]) * tangent[i];
            }
            sample(&s, 2 * N, moved, &there);
            for (size_t i = 0; i < 3 * N; i++) {
                double difference = (there.q[i] - there.q[3 * N + i]) / (2.0 * widths[w]);

                errors[w] = compare_max(errors[w], fabs(difference - derivative[i]));
            }
            samples_clear(&there);
        }
    }
    printf("# errors %.2e, %.2e\n", errors[0], errors[1]);
    assert_true(errors[0] / errors[1] >= 3.6 && errors[0] / errors[1] <= 4.4);
    assert_true(errors[1] <= 1e-3);
    samples_clear(&here);
    shapes_close(&s);
}

/* A surface against its own warp: registration by square-root maps finds the warp. */
static void registration_undoes_a_warp(void **state)
{
    static const double still[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    struct test_random random = test_random_seed(8);
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;
    struct srnf_warp warp;
    struct shapes_surface s;
    double *moving;
    double *q;
    double norm;
    double rotation[9];

    (void)state;
    shapes_open(&s, 20);
    shapes_fill(&s, shapes_bumpy, 0.0);
    q = shapes_doubles(3 * s.points);
    moving = shapes_doubles(s.count);
    registrations_warp(&random, 0.7, &warp);
    shapes_random_rotation(&random, rotation);
    registrations_resample(&s, &warp, FIGURES_SLOW ? still : rotation, moving);
    srnf_square_root_map(s.sht, s.f, q, s.workspace);
    norm = sqrt(srnf_inner_product(s.grid, q, q));
    options.representation = SRNF_REPRESENTATION_SRM;
    options.start = SRNF_START_RIGID;
    options.penalty_jacobian = options.penalty_displacement = 0.0;
    registrations_run(&s, NULL, moving, &options, &r);
    printf("# distance before %.3e, after %.3e, J %.2f to %.2f\n", r.distance_before / norm,
           r.distance / norm, r.min_jacobian, r.max_jacobian);
    assert_true(r.distance <= 0.02 * r.distance_before);
    assert_true(r.min_jacobian > 0.0);
    /* The field that is reported is the square-root map of the registered surface. */
    assert_true(r.truncation_error <= 0.02);
    /* And its norm that of the surface: the action is an isometry. */
    srnf_square_root_map(s.sht, moving, q, s.workspace);
    assert_true(fabs(sqrt(srnf_inner_product(s.grid, r.q, r.q) / srnf_inner_product(s.grid, q, q)) -
                     1.0) <= 1e-3);
    srnf_registration_clear(&r);
    srnf_warp_clear(&warp);
    srnf_free(moving);
    srnf_free(q);
    shapes_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(is_what_it_is_defined_as),
        cmocka_unit_test(derivative_agrees_with_differences),
        cmocka_unit_test(registration_undoes_a_warp),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_pullback_exp.c - exponential and logarithm of the pulled-back metric: inverse to each other,
 * straight where the geodesic is, at constant speed, the same bits in every run; cancellation and
 * wrong arguments.
 */
#include "pullbacks.h"

#define DEGREE 9

static void shoot(const struct shapes_surface *s, const double *velocity, size_t segments,
                  struct srnf_pullback_shot *shot)
{
    assert_int_equal(srnf_pullback_exp(s->sht, s->f, velocity, segments, NULL, shot, NULL),
                     SRNF_OK);
    assert_int_equal(shot->steps, segments + 1);
    assert_memory_equal(shot->coefficients, s->f, s->count * sizeof(double));
}

static void open_number(struct pullback_pair *p, size_t k)
{
    if (k == 0) {
        pullback_open_stars(p, DEGREE);
    } else {
        pullback_open_bodies(p, DEGREE, "bumpy star", "ellipsoid");
    }
}

static void exponential_inverts_the_logarithm(void **state)
{
    const size_t segments[] = {4, 8, 15};
    (void)state;

    for (size_t k = 0; k < 6; k++) {
        struct srnf_pullback_options options = srnf_pullback_options_defaults();
        const size_t m = segments[k % 3];
        struct srnf_pullback_geodesic g;
        struct srnf_pullback_shot shot;
        struct pullback_pair p;
        double *velocity;
        struct srnf_pullback_log_figures figures;
        double worst = 0.0;

        open_number(&p, k / 3);
        velocity = shapes_doubles(p.from.count);
        options.segments = m;
        assert_int_equal(srnf_pullback_log(p.from.sht, p.from.f, p.to.f, &options, NULL, velocity,
                                           &figures, NULL),
                         SRNF_OK);
        shoot(&p.from, velocity, m, &shot);
        printf("# m = %zu: %zu Newton steps, %.0f U\n", m, shot.iterations, shot.transforms);
        figure_below("end of exp(log), distance of the fields",
                     pullback_chord(&p.from, shot.coefficients + m * p.from.count, p.to.f), 1e-7);
        figure_below("length", fabs(shot.path.length / figures.path.length - 1.0), 1e-7);
        options.gradient = 1e-9;
        options.compare = false;
        assert_int_equal(
            srnf_pullback_geodesic(p.from.sht, p.from.f, p.to.f, &options, NULL, &g, NULL),
            SRNF_OK);
        for (size_t i = 0; i <= m; i++) {
            worst = compare_max(worst, shapes_distance(DEGREE, g.coefficients + i * p.from.count,
                                                       shot.coefficients + i * p.from.count));
            assert_true(fabs(shot.times[i] - g.times[i]) < 1e-15);
        }
        figure_below("path, surfaces apart", worst, 1e-6);
        srnf_pullback_geodesic_clear(&g);
        srnf_pullback_shot_clear(&shot);
        srnf_free(velocity);
        pullback_close(&p);
    }
}

static void logarithm_inverts_the_exponential(void **state)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct test_random random = test_random_seed(3);
    struct shapes_surface s;
    struct srnf_pullback_shot shot;
    double *velocity;
    double *back;
    (void)state;

    shapes_open(&s, DEGREE);
    shapes_fill_random_star(&s, 5, NULL);
    velocity = shapes_doubles(2 * s.count);
    back = velocity + s.count;
    test_random_normals(&random, s.count, velocity);
    for (size_t i = 0; i < s.count; i++) {
        velocity[i] *= 0.03 / (1.0 + (double)(i % s.each));
    }
    shoot(&s, velocity, options.segments, &shot);
    assert_int_equal(srnf_pullback_log(s.sht, s.f, shot.coefficients + options.segments * s.count,
                                       &options, NULL, back, NULL, NULL),
                     SRNF_OK);
    figure_below("log(exp(v)) - v", compare_difference(s.count, velocity, back),
                 1e-7 * figure_norm(s.count, velocity));
    figure_below("speed variation", shot.path.speed_variation, 1e-3);
    srnf_pullback_shot_clear(&shot);
    srnf_free(velocity);
    shapes_close(&s);
}

/* Q(c f) = c Q(f): from f along f itself the path goes straight; translations always do. */
static void straight_where_the_geodesic_is(void **state)
{
    struct srnf_pullback_shot shot;
    struct shapes_surface s;
    double *velocity;
    double worst = 0.0;
    (void)state;

    shapes_open(&s, DEGREE);
    shapes_fill(&s, shapes_capsule, 4.0);
    velocity = shapes_doubles(s.count);
    shoot(&s, velocity, 5, &shot);
    for (size_t k = 0; k <= 5; k++) {
        worst =
            compare_max(worst, compare_difference(s.count, s.f, shot.coefficients + k * s.count));
    }
    figure_below("no velocity, no way", worst, 1e-15);
    srnf_pullback_shot_clear(&shot);
    for (size_t i = 0; i < s.count; i++) {
        velocity[i] = 0.7 * s.f[i];
    }
    velocity[s.each] = 2.0;
    shoot(&s, velocity, 7, &shot);
    worst = 0.0;
    for (size_t k = 0; k <= 7; k++) {
        for (size_t i = 0; i < s.count; i++) {
            double truth = s.f[i] + shot.times[k] * velocity[i];

            worst = compare_max(worst, fabs(shot.coefficients[k * s.count + i] - truth));
        }
    }
    figure_below("growing and moving", worst, 1e-10);
    figure_below("speed variation", shot.path.speed_variation, 1e-12);
    srnf_pullback_shot_clear(&shot);
    srnf_free(velocity);
    shapes_close(&s);
}

/* Twice the velocity in twice the segments goes the same way, twice as far. */
static void goes_on(void **state)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_shot once;
    struct srnf_pullback_shot twice;
    struct pullback_pair p;
    double *velocity;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    velocity = shapes_doubles(p.from.count);
    options.segments = 6;
    assert_int_equal(
        srnf_pullback_log(p.from.sht, p.from.f, p.to.f, &options, NULL, velocity, NULL, NULL),
        SRNF_OK);
    for (size_t i = 0; i < p.from.count; i++) {
        velocity[i] *= 0.5;
    }
    shoot(&p.from, velocity, 3, &once);
    for (size_t i = 0; i < p.from.count; i++) {
        velocity[i] *= 2.0;
    }
    shoot(&p.from, velocity, 6, &twice);
    figure_below("first half",
                 compare_difference(4 * p.from.count, once.coefficients, twice.coefficients),
                 1e-14);
    srnf_pullback_shot_clear(&twice);
    srnf_pullback_shot_clear(&once);
    srnf_free(velocity);
    pullback_close(&p);
}

static int run_exp(void *argument, const struct srnf_context *context)
{
    const struct pullback_pair *p = argument;
    struct srnf_pullback_shot shot;
    struct srnf_error error = {0};
    double *velocity = shapes_doubles(p->from.count);
    int status;

    for (size_t i = 0; i < p->from.count; i++) {
        velocity[i] = p->to.f[i] - p->from.f[i];
    }
    status = srnf_pullback_exp(p->from.sht, p->from.f, velocity, 6, context, &shot, &error);
    if (status < 0) {
        assert_int_equal(error.status, status);
        assert_null(shot.coefficients);
    }
    srnf_pullback_shot_clear(&shot);
    srnf_free(velocity);
    return status;
}

/* A velocity that takes the surface through a point: nothing there is differentiable. */
static void tells_where_it_cannot_go(void **state)
{
    struct srnf_pullback_shot shot;
    struct shapes_surface s;
    double *velocity;
    int status;
    (void)state;

    shapes_open(&s, DEGREE);
    shapes_fill_random_star(&s, 5, NULL);
    velocity = shapes_doubles(s.count);
    for (size_t i = 0; i < s.count; i++) {
        velocity[i] = -2.0 * s.f[i];
    }
    status = srnf_pullback_exp(s.sht, s.f, velocity, 9, NULL, &shot, NULL);
    assert_int_equal(status, SRNF_WNOT_CONVERGED);
    assert_true(shot.residual > 1e-8);
    assert_true(compare_finite(10 * s.count, shot.coefficients));
    srnf_pullback_shot_clear(&shot);
    srnf_free(velocity);
    shapes_close(&s);
}

static void refuses_wrong_arguments(void **state)
{
    const size_t segments[] = {0, 1, 101};
    struct srnf_pullback_shot shot;
    struct srnf_error error = {0};
    struct pullback_pair p;
    struct srnf_pullback_log_figures figures;
    (void)state;

    pullback_open_stars(&p, 6);
    pullback_check_cancellation(run_exp, &p);
    for (size_t k = 0; k < 3; k++) {
        assert_int_equal(
            srnf_pullback_exp(p.from.sht, p.from.f, p.to.f, segments[k], NULL, &shot, &error),
            SRNF_EINVAL);
        assert_non_null(strstr(error.message, "segments"));
    }
    p.to.f[3] = NAN;
    assert_int_equal(srnf_pullback_exp(p.from.sht, p.from.f, p.to.f, 4, NULL, &shot, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "velocity"));
    assert_int_equal(srnf_pullback_exp(p.from.sht, p.to.f, p.from.f, 4, NULL, &shot, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "surface"));
    assert_int_equal(
        srnf_pullback_log(p.from.sht, p.from.f, p.to.f, NULL, NULL, p.from.f, &figures, &error),
        SRNF_EINVAL);
    p.to.f[3] = 1e200;
    assert_int_equal(srnf_pullback_exp(p.from.sht, p.to.f, p.from.f, 4, NULL, &shot, &error),
                     SRNF_ENUMERIC);
    assert_null(shot.coefficients);
    pullback_close(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exponential_inverts_the_logarithm),
        cmocka_unit_test(logarithm_inverts_the_exponential),
        cmocka_unit_test(straight_where_the_geodesic_is),
        cmocka_unit_test(goes_on),
        cmocka_unit_test(tells_where_it_cannot_go),
        cmocka_unit_test(refuses_wrong_arguments),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

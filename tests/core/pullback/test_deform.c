/*
 * test_deform.c - shooting, transport and transfer between surfaces as they lie in space, in both
 * metrics: ends that are known, places and sizes, what is registered first, and what is refused.
 */
#include "pullbacks.h"

#define DEGREE ((size_t)6)

static const struct srnf_deform_options flat = {.pullback = false}, curved = {.pullback = true};
static const struct srnf_deform_options *const metrics[] = {&flat, &curved};

/* Two stars that lie somewhere, of sizes of their own. */
static void open_pair(struct pullback_pair *p)
{
    pullback_open_stars(p, DEGREE);
    for (size_t i = 0; i < p->from.count; i++) {
        p->to.f[i] = 0.6 * p->from.f[i] + 0.5 * p->to.f[i];
    }
    for (size_t k = 0; k < 3; k++) {
        p->from.f[k * p->from.each] = 0.3 * (double)k;
        p->to.f[k * p->from.each] = 1.0 - (double)k;
    }
}

static void check_measures(const struct shapes_surface *s, const double *f,
                           const struct srnf_surface_measures *told)
{
    struct srnf_surface_measures measures;

    srnf_surface_measure(s->sht, f, &measures, s->workspace);
    assert_true(fabs(told->area - measures.area) <= 1e-12 * measures.area);
    assert_true(compare_difference(3, told->centroid, measures.centroid) <= 1e-12);
}

/* A velocity leads to the surface that it is toward, place included; half way, and backwards, the
   centroid is on the line. */
static void shoots_toward(void **state)
{
    const double times[] = {1.0, 0.0, -0.5};
    struct pullback_pair p;
    (void)state;

    open_pair(&p);
    for (size_t m = 0; m < 2; m++) {
        const struct srnf_velocity velocity = {.toward = p.to.f};
        struct srnf_surface_measures from, to;
        struct srnf_deform_shoot r;

        assert_int_equal(srnf_deform_shoot(p.from.sht, p.from.f, &velocity, 3, times, metrics[m],
                                           NULL, &r, NULL),
                         SRNF_OK);
        figure_below("the surface toward",
                     compare_difference(p.to.count, r.shot.coefficients, p.to.f), 1e-5);
        figure_below("the surface itself",
                     compare_difference(p.to.count, r.shot.coefficients + p.to.count, p.from.f),
                     1e-12);
        srnf_surface_measure(p.from.sht, p.from.f, &from, p.from.workspace);
        srnf_surface_measure(p.from.sht, p.to.f, &to, p.from.workspace);
        for (size_t k = 0; k < 3; k++) {
            assert_true(fabs(r.measures[2].centroid[k] -
                             (1.5 * from.centroid[k] - 0.5 * to.centroid[k])) <= 1e-12);
        }
        for (size_t i = 0; i < 3; i++) {
            check_measures(&p.from, r.shot.coefficients + i * p.to.count, &r.measures[i]);
        }
        assert_true(r.shot.energy[0] < 1e-10 && r.shot.energy[2] > 1e-8);
        assert_null(r.toward.coefficients);
        assert_int_equal(r.paths.n, m == 0 ? 0 : 3);
        if (m == 1) {
            assert_true(r.paths.converged && r.paths.toward.converged);
            assert_int_equal(r.paths.shots[0].segments, SRNF_DEFORM_SEGMENTS);
            assert_int_equal(r.paths.shots[1].segments, 0);
            assert_true(
                fabs(r.paths.shots[0].figures.length / r.paths.toward.figures.length - 1.0) < 1e-5);
        }
        srnf_deform_shoot_clear(&r);
    }
    pullback_close(&p);
}

/* The motion of the points along themselves, and a translation with it: it grows and goes, however
   the velocity is told. */
static void grows_and_goes(void **state)
{
    const double times[] = {0.25, -0.5, 1.5};
    struct pullback_pair p;
    double *motion, *field;
    (void)state;

    open_pair(&p);
    motion = shapes_doubles(p.from.count);
    field = shapes_doubles(3 * p.from.points);
    memcpy(motion, p.from.f, p.from.count * sizeof(double));
    for (size_t k = 0; k < 3; k++) {
        motion[k * p.from.each] = k == 0 ? 1.0 : 0.0;
    }
    srnf_field_differential(p.from.sht, p.from.f, motion, field, p.from.workspace);
    for (size_t m = 0; m < 4; m++) {
        const struct srnf_velocity velocity = {.motion = m < 2 ? motion : NULL, .field = field};
        struct srnf_surface_measures from;
        struct srnf_deform_shoot r;

        assert_int_equal(srnf_deform_shoot(p.from.sht, p.from.f, &velocity, 3, times,
                                           metrics[m % 2], NULL, &r, NULL),
                         SRNF_OK);
        srnf_surface_measure(p.from.sht, p.from.f, &from, p.from.workspace);
        for (size_t i = 0; i < 3; i++) {
            double growth = 1.0 + times[i];
            double drift = m < 2 ? times[i] / sqrt(4.0 * SRNF_PI) : 0.0;

            figure_below("area", fabs(r.measures[i].area / (growth * growth * from.area) - 1.0),
                         1e-7);
            assert_true(fabs(r.measures[i].centroid[0] - from.centroid[0] - drift) <= 1e-12);
            assert_true(fabs(r.measures[i].centroid[1] - from.centroid[1]) <= 1e-12);
        }
        if (m % 2 == 1) { /* segments for each unit of time begun */
            assert_int_equal(r.paths.toward.segments, 0);
            assert_int_equal(r.paths.shots[0].segments, SRNF_DEFORM_SEGMENTS);
            assert_int_equal(r.paths.shots[2].segments, 2 * SRNF_DEFORM_SEGMENTS);
        }
        srnf_deform_shoot_clear(&r);
    }
    srnf_free(field);
    srnf_free(motion);
    pullback_close(&p);
}

/* A turned copy is laid on the surface first: then there is nothing left to go. */
static void registers_first(void **state)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    const struct srnf_deform_options options = {.registration = &registration};
    const double half[9] = {-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0}, one = 1.0;
    struct srnf_deform_shoot r;
    struct pullback_pair p;
    struct srnf_velocity velocity;
    (void)state;

    open_pair(&p);
    registration.reparameterization = false;
    for (size_t i = 0; i < p.from.each; i++) { /* R f, which is its own inverse */
        for (size_t k = 0; k < 3; k++) {
            p.to.f[k * p.from.each + i] = half[4 * k] * p.from.f[k * p.from.each + i];
        }
    }
    velocity = (struct srnf_velocity){.toward = p.to.f};
    assert_int_equal(
        srnf_deform_shoot(p.from.sht, p.from.f, &velocity, 1, &one, &options, NULL, &r, NULL),
        SRNF_OK);
    figure_below("distance", r.toward.distance, 1e-6);
    figure_below("a turned copy", compare_difference(p.from.count, r.shot.coefficients, p.from.f),
                 1e-5);
    srnf_deform_shoot_clear(&r);
    pullback_close(&p);
}

/* Carried nowhere a vector toward a surface leads there; elsewhere its centroid goes along, and its
   translation stays. */
static void transports(void **state)
{
    struct srnf_deform_transport r;
    struct pullback_pair p;
    (void)state;

    open_pair(&p);
    for (size_t m = 0; m < 2; m++) {
        struct srnf_velocity vector = {.toward = p.to.f};

        assert_int_equal(srnf_deform_transport(p.from.sht, p.from.f, p.from.f, &vector, metrics[m],
                                               NULL, &r, NULL),
                         SRNF_OK);
        figure_below("the surface toward",
                     compare_difference(p.to.count, r.shot.coefficients, p.to.f), 1e-5);
        check_measures(&p.from, r.shot.coefficients, &r.measures);
        srnf_deform_transport_clear(&r);

        vector = (struct srnf_velocity){.motion = p.from.f};
        assert_int_equal(srnf_deform_transport(p.from.sht, p.from.f, p.to.f, &vector, metrics[m],
                                               NULL, &r, NULL),
                         SRNF_OK);
        for (size_t k = 0; k < 3; k++) {
            size_t i = k * p.from.each;

            assert_true(r.tangent.coefficients[i] == p.from.f[i]);
        }
        if (m == 0) { /* the field is the same there */
            double *field = shapes_doubles(3 * p.from.points);

            srnf_field_differential(p.from.sht, p.from.f, p.from.f, field, p.from.workspace);
            assert_true(compare_difference(3 * p.from.points, r.velocity, field) <= 1e-15);
            srnf_free(field);
        } else {
            assert_true(fabs(r.paths.norm / r.paths.norm_from - 1.0) < 1e-3);
            assert_int_equal(r.paths.along.segments, SRNF_DEFORM_TRANSPORT_SEGMENTS);
            assert_true(r.paths.converged);
        }
        srnf_deform_transport_clear(&r);
    }
    pullback_close(&p);
}

/* On the source it is the deformed surface, its place and, by ratio or in one unit, its size. */
static void transfers(void **state)
{
    const double scales[3] = {2.0, 3.0, 2.0};
    struct srnf_deform_transfer r;
    struct pullback_pair p;
    double *wanted;
    (void)state;

    open_pair(&p);
    wanted = shapes_doubles(p.from.count);
    for (size_t m = 0; m < 4; m++) {
        const double *surfaces[3] = {p.from.f, p.to.f, p.from.f};
        enum srnf_transfer_size size = m < 2 ? SRNF_TRANSFER_RATIO : SRNF_TRANSFER_ABSOLUTE;
        struct srnf_surface_measures from, reached;

        assert_int_equal(srnf_deform_transfer(p.from.sht, surfaces, scales, size, metrics[m % 2],
                                              NULL, &r, NULL),
                         SRNF_OK);
        for (size_t i = 0; i < p.from.count; i++) {
            wanted[i] = p.to.f[i] * scales[1] / r.scale;
        }
        figure_below("the deformed surface",
                     compare_difference(p.from.count, r.transferred.coefficients, wanted), 1e-5);
        srnf_surface_measure(p.from.sht, p.from.f, &from, p.from.workspace);
        srnf_surface_measure(p.from.sht, r.transferred.coefficients, &reached, p.from.workspace);
        if (size == SRNF_TRANSFER_RATIO) { /* the size is in the scale */
            assert_true(fabs(reached.area / from.area - 1.0) < 1e-6);
        } else {
            assert_true(r.scale == scales[2]);
        }
        check_measures(&p.from, r.transferred.coefficients, &r.measures);
        srnf_deform_transfer_clear(&r);
    }
    srnf_free(wanted);
    pullback_close(&p);
}

static int run_shoot(void *argument, const struct srnf_context *context)
{
    const struct pullback_pair *p = argument;
    const struct srnf_velocity velocity = {.toward = p->to.f};
    const double one = 1.0;
    struct srnf_deform_shoot r;
    int status =
        srnf_deform_shoot(p->from.sht, p->from.f, &velocity, 1, &one, &curved, context, &r, NULL);

    assert_true((status < 0) == (r.shot.coefficients == NULL));
    srnf_deform_shoot_clear(&r);
    return status;
}

static void refuses(void **state)
{
    const double late = 11.0, one = 1.0, none[3] = {1.0, 0.0, 1.0}, scales[3] = {1.0, 1.0, 1.0};
    struct srnf_velocity velocity = {.motion = NULL};
    struct srnf_error error = {0};
    struct srnf_deform_shoot shot;
    struct srnf_deform_transport moved;
    struct srnf_deform_transfer transferred;
    struct pullback_pair p;
    const double *surfaces[3];
    (void)state;

    open_pair(&p);
    pullback_check_cancellation(run_shoot, &p);
    surfaces[0] = surfaces[1] = surfaces[2] = p.from.f;
    assert_int_equal(
        srnf_deform_shoot(p.from.sht, p.from.f, &velocity, 1, &one, &flat, NULL, &shot, &error),
        SRNF_EINVAL);
    assert_non_null(strstr(error.message, "no velocity"));
    velocity.motion = p.from.f;
    for (size_t m = 0; m < 2; m++) {
        assert_int_equal(srnf_deform_shoot(p.from.sht, p.from.f, &velocity, 1, &late, metrics[m],
                                           NULL, &shot, &error),
                         SRNF_EINVAL);
        assert_string_equal(shot.step, "shooting");
        assert_non_null(strstr(error.message, "time"));
    }
    assert_int_equal(srnf_deform_transfer(p.from.sht, surfaces, none, SRNF_TRANSFER_RATIO, &flat,
                                          NULL, &transferred, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "scale"));
    p.to.f[3] = NAN;
    surfaces[1] = velocity.motion = p.to.f;
    assert_int_equal(srnf_deform_transfer(p.from.sht, surfaces, scales, SRNF_TRANSFER_RATIO, &flat,
                                          NULL, &transferred, &error),
                     SRNF_EINVAL);
    assert_int_equal(srnf_deform_transport(p.from.sht, p.from.f, p.from.f, &velocity, &flat, NULL,
                                           &moved, &error),
                     SRNF_EINVAL);
    assert_string_equal(moved.step, "preparing the surfaces");
    assert_non_null(strstr(error.message, "velocity"));
    velocity = (struct srnf_velocity){.toward = p.to.f};
    assert_int_equal(srnf_deform_transport(p.from.sht, p.from.f, p.from.f, &velocity, &flat, NULL,
                                           &moved, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "surface"));
    memset(p.to.f, 0, p.to.count * sizeof(double));
    for (size_t m = 0; m < 2; m++) {
        assert_int_equal(srnf_deform_transfer(p.from.sht, surfaces, scales, SRNF_TRANSFER_RATIO,
                                              metrics[m], NULL, &transferred, &error),
                         SRNF_EDEGENERATE);
        assert_string_equal(transferred.step, "transferring the deformation");
        assert_null(transferred.transferred.coefficients);
    }
    pullback_close(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shoots_toward),   cmocka_unit_test(grows_and_goes),
        cmocka_unit_test(registers_first), cmocka_unit_test(transports),
        cmocka_unit_test(transfers),       cmocka_unit_test(refuses),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

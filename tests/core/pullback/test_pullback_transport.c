/*
 * test_pullback_transport.c - parallel transport in the pulled-back metric: linear, an isometry up
 * to its order, there and back, the identity where nothing moves; and transfer, which gives the
 * deformed surface back when target and source are one.
 */
#include "pullbacks.h"

#define DEGREE 9

/* A geodesic of m segments. */
static struct srnf_pullback_geodesic path_of(const struct pullback_pair *p, size_t m)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_geodesic g;

    options.segments = m;
    options.gradient = 1e-7;
    options.compare = false;
    assert_int_equal(
        srnf_pullback_geodesic(p->from.sht, p->from.f, p->to.f, &options, NULL, &g, NULL), SRNF_OK);
    return g;
}

static double *vector_of(const struct shapes_surface *s, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    double *v = shapes_doubles(s->count);

    test_random_normals(&random, s->count, v);
    for (size_t i = 0; i < s->count; i++) {
        v[i] *= 0.3 / (1.0 + (double)(i % s->each));
    }
    return v;
}

static struct srnf_pullback_transported transport(const struct shapes_surface *s, size_t m,
                                                  const double *path, const double *v)
{
    struct srnf_pullback_transported moved;

    assert_int_equal(srnf_pullback_transport(s->sht, m, path, v, NULL, &moved, NULL), SRNF_OK);
    return moved;
}

/* ||Q_*f(a) - Q_*f(b)|| */
static double apart_at(const struct shapes_surface *s, const double *f, const double *a,
                       const double *b)
{
    double *w = shapes_doubles(6 * s->points);
    double distance;

    srnf_field_differential(s->sht, f, a, w, s->workspace);
    srnf_field_differential(s->sht, f, b, w + 3 * s->points, s->workspace);
    distance = pullback_apart(s, w, w + 3 * s->points);
    srnf_free(w);
    return distance;
}

/* The norm is kept to third order, the vector to second: against 32 segments. */
static void converges_with_segments(void **state)
{
    double norms[3];
    double errors[3];
    struct srnf_pullback_transported moved[4];
    struct pullback_pair p;
    double *v;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    v = vector_of(&p.from, 1);
    for (size_t k = 0; k < 4; k++) {
        size_t m = (size_t)4 << k;
        struct srnf_pullback_geodesic g = path_of(&p, m);

        moved[k] = transport(&p.from, m, g.coefficients, v);
        printf("# m = %zu: norm %.9f to %.9f, %.0f U\n", m, moved[k].norm_from, moved[k].norm,
               moved[k].transforms);
        srnf_pullback_geodesic_clear(&g);
    }
    for (size_t k = 0; k < 3; k++) {
        norms[k] = fabs(moved[k].norm / moved[k].norm_from - 1.0);
        errors[k] = apart_at(&p.from, p.to.f, moved[k].vector, moved[3].vector) / moved[3].norm;
    }
    figure_order("norm", 3, norms, 2.0, 2.6, 0.8, 1e-9, 2);
    figure_below("norm, m = 16", norms[2], 1e-4);
    figure_order("vector", 3, errors, 2.0, 2.1, 0.6, 1e-9, 2);
    figure_below("vector, m = 16", errors[2], 3e-3);
    for (size_t k = 0; k < 4; k++) {
        srnf_free(moved[k].vector);
    }
    srnf_free(v);
    pullback_close(&p);
}

static void is_linear_and_keeps_products(void **state)
{
    struct srnf_pullback_transported a;
    struct srnf_pullback_transported b;
    struct srnf_pullback_transported both;
    struct srnf_pullback_geodesic g;
    struct pullback_pair p;
    double *v;
    double *w;
    double *sum;
    double *fields;
    double before;
    double after;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    g = path_of(&p, 8);
    v = vector_of(&p.from, 1);
    w = vector_of(&p.from, 2);
    sum = shapes_doubles(p.from.count);
    fields = shapes_doubles(6 * p.from.points);
    a = transport(&p.from, 8, g.coefficients, v);
    b = transport(&p.from, 8, g.coefficients, w);
    for (size_t i = 0; i < p.from.count; i++) {
        sum[i] = v[i] - 2.0 * w[i];
    }
    both = transport(&p.from, 8, g.coefficients, sum);
    for (size_t i = 0; i < p.from.count; i++) {
        sum[i] = a.vector[i] - 2.0 * b.vector[i];
    }
    figure_below("linearity", compare_difference(p.from.count, both.vector, sum), 1e-8);
    srnf_field_differential(p.from.sht, p.from.f, v, fields, p.from.workspace);
    srnf_field_differential(p.from.sht, p.from.f, w, fields + 3 * p.from.points, p.from.workspace);
    before = srnf_inner_product(p.from.grid, fields, fields + 3 * p.from.points);
    srnf_field_differential(p.from.sht, p.to.f, a.vector, fields, p.from.workspace);
    srnf_field_differential(p.from.sht, p.to.f, b.vector, fields + 3 * p.from.points,
                            p.from.workspace);
    after = srnf_inner_product(p.from.grid, fields, fields + 3 * p.from.points);
    figure_below("inner product", fabs(after - before) / (a.norm * b.norm), 1e-3);
    for (size_t c = 0; c < 3; c++) { /* translations are carried along */
        assert_true(a.vector[c * p.from.each] == v[c * p.from.each]);
    }
    srnf_free(both.vector);
    srnf_free(b.vector);
    srnf_free(a.vector);
    srnf_free(fields);
    srnf_free(sum);
    srnf_free(w);
    srnf_free(v);
    srnf_pullback_geodesic_clear(&g);
    pullback_close(&p);
}

/* Along the path and back, along no path, and along a path that only grows. */
static void comes_back(void **state)
{
    struct srnf_pullback_transported there;
    struct srnf_pullback_transported back;
    struct srnf_pullback_geodesic g;
    struct pullback_pair p;
    double *reversed;
    double *v;
    double scale;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    v = vector_of(&p.from, 4);
    g = path_of(&p, 8);
    reversed = shapes_doubles(9 * p.from.count);
    for (size_t k = 0; k <= 8; k++) {
        memcpy(reversed + k * p.from.count, g.coefficients + (8 - k) * p.from.count,
               p.from.count * sizeof(double));
    }
    there = transport(&p.from, 8, g.coefficients, v);
    back = transport(&p.from, 8, reversed, there.vector);
    figure_below("there and back, relative",
                 apart_at(&p.from, p.from.f, v, back.vector) / there.norm_from, 1e-2);
    srnf_free(there.vector);
    srnf_free(back.vector);
    for (size_t k = 0; k <= 8; k++) {
        for (size_t i = 0; i < p.from.count; i++) {
            reversed[k * p.from.count + i] = p.from.f[i];
        }
    }
    there = transport(&p.from, 8, reversed, v);
    figure_below("along no path", compare_difference(p.from.count, v, there.vector), 1e-7);
    srnf_free(there.vector);
    for (size_t k = 0; k <= 8; k++) {
        scale = 1.0 + 0.1 * (double)k;
        for (size_t i = 0; i < p.from.count; i++) {
            reversed[k * p.from.count + i] = scale * p.from.f[i];
        }
    }
    /* Tangent spaces of f and c f are one, since Q_* does not know c. */
    there = transport(&p.from, 8, reversed, v);
    figure_below("along a growing path", compare_difference(p.from.count, v, there.vector), 1e-7);
    srnf_free(there.vector);
    srnf_free(reversed);
    srnf_free(v);
    srnf_pullback_geodesic_clear(&g);
    pullback_close(&p);
}

/* A geodesic transports its own velocity: to that at its end, up to the order of both. */
static void carries_the_velocity_of_a_geodesic(void **state)
{
    double errors[3];
    struct pullback_pair p;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    for (size_t k = 0; k < 3; k++) {
        size_t m = (size_t)4 << k;
        struct srnf_pullback_geodesic g = path_of(&p, m);
        double *velocities = shapes_doubles(2 * p.from.count);
        struct srnf_pullback_transported moved;

        for (size_t i = 0; i < p.from.count; i++) {
            const double *f = g.coefficients + i;

            velocities[i] = (double)m * (f[p.from.count] - f[0]);
            velocities[p.from.count + i] =
                (double)m * (f[m * p.from.count] - f[(m - 1) * p.from.count]);
        }
        moved = transport(&p.from, m, g.coefficients, velocities);
        errors[k] = apart_at(&p.from, p.to.f, moved.vector, velocities + p.from.count) / moved.norm;
        srnf_free(moved.vector);
        srnf_free(velocities);
        srnf_pullback_geodesic_clear(&g);
    }
    figure_order("velocity at the end", 3, errors, 2.0, 1.0, 0.3, 1e-9, 2);
    pullback_close(&p);
}

/* ---- Transfer -------------------------------------------------------------------------------- */

static void transfers(void **state)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transfer transfer;
    struct pullback_pair p;
    struct pullback_pair q;
    double worst = 0.0;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    options.segments = 6;
    assert_int_equal(srnf_pullback_transfer(p.from.sht, p.from.f, p.to.f, p.from.f, &options, NULL,
                                            &transfer, NULL),
                     SRNF_OK);
    figure_below("target = source, surface apart",
                 shapes_distance(DEGREE, transfer.coefficients, p.to.f), 1e-5);
    assert_true(transfer.distance < 1e-12 && transfer.converged);
    assert_true(fabs(transfer.deformation / pullback_chord(&p.from, p.from.f, p.to.f) - 1.0) <
                0.05);
    srnf_pullback_transfer_clear(&transfer);

    /* From f to 1.3 f, for 2 f: the same tangent space, so 2.3 f. */
    pullback_open_stars(&q, DEGREE);
    for (size_t i = 0; i < p.from.count; i++) {
        p.to.f[i] = 1.3 * p.from.f[i];
        q.to.f[i] = 2.0 * p.from.f[i];
    }
    assert_int_equal(srnf_pullback_transfer(p.from.sht, p.from.f, p.to.f, q.to.f, &options, NULL,
                                            &transfer, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < p.from.count; i++) {
        worst = compare_max(worst, fabs(transfer.coefficients[i] - 2.3 * p.from.f[i]));
    }
    figure_below("growth for a larger target", worst, 1e-7);
    figure_below("norm", fabs(transfer.norm / transfer.norm_from - 1.0), 1e-8);
    srnf_pullback_transfer_clear(&transfer);
    pullback_close(&q);
    pullback_close(&p);
}

/* One step is too few for the geodesics: the deformation is a result that says so. */
static void says_when_a_transfer_has_not_converged(void **state)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transfer transfer;
    struct pullback_pair p;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    options.segments = 4;
    options.max_iterations = 1;
    assert_int_equal(srnf_pullback_transfer(p.from.sht, p.from.f, p.to.f, p.to.f, &options, NULL,
                                            &transfer, NULL),
                     SRNF_WNOT_CONVERGED);
    assert_false(transfer.converged);
    assert_true(compare_finite(p.from.count, transfer.coefficients));
    srnf_pullback_transfer_clear(&transfer);
    pullback_close(&p);
}

static int run_transfer(void *argument, const struct srnf_context *context)
{
    const struct pullback_pair *p = argument;
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transfer transfer;
    struct srnf_error error = {0};
    int status;

    options.segments = 4;
    status = srnf_pullback_transfer(p->from.sht, p->from.f, p->to.f, p->to.f, &options, context,
                                    &transfer, &error);
    if (status < 0) {
        assert_int_equal(error.status, status);
        assert_null(transfer.coefficients);
    }
    srnf_pullback_transfer_clear(&transfer);
    return status;
}

static int run_transport(void *argument, const struct srnf_context *context)
{
    const struct pullback_pair *p = argument;
    struct srnf_pullback_transported moved;
    struct srnf_error error = {0};
    double *path = shapes_doubles(7 * p->from.count);
    int status;

    for (size_t k = 0; k <= 6; k++) {
        pullback_mix(p->from.count, (double)k / 6.0, p->from.f, p->to.f, path + k * p->from.count);
    }
    status = srnf_pullback_transport(p->from.sht, 6, path, p->to.f, context, &moved, &error);
    if (status < 0) {
        assert_int_equal(error.status, status);
        assert_null(moved.vector);
    }
    srnf_free(moved.vector);
    srnf_free(path);
    return status;
}

static void refuses_wrong_arguments(void **state)
{
    const size_t segments[] = {0, 1, 3, 102};
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transported moved;
    struct srnf_pullback_transfer transfer;
    struct srnf_error error = {0};
    struct pullback_pair p;
    double *path;
    (void)state;

    pullback_open_stars(&p, 6);
    pullback_check_cancellation(run_transport, &p);
    pullback_check_cancellation(run_transfer, &p);
    path = shapes_doubles(104 * p.from.count);
    for (size_t k = 0; k < 4; k++) {
        assert_int_equal(
            srnf_pullback_transport(p.from.sht, segments[k], path, p.to.f, NULL, &moved, &error),
            SRNF_EINVAL);
        assert_non_null(strstr(error.message, "segments"));
        options.segments = segments[k];
        assert_int_equal(srnf_pullback_transfer(p.from.sht, p.from.f, p.to.f, p.from.f, &options,
                                                NULL, &transfer, &error),
                         SRNF_EINVAL);
        assert_non_null(strstr(error.message, "segments"));
    }
    path[p.from.count + 1] = NAN;
    assert_int_equal(srnf_pullback_transport(p.from.sht, 2, path, p.to.f, NULL, &moved, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "path"));
    path[p.from.count + 1] = 0.0;
    p.to.f[1] = NAN;
    assert_int_equal(srnf_pullback_transport(p.from.sht, 2, path, p.to.f, NULL, &moved, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "vector"));
    assert_int_equal(srnf_pullback_transfer(p.from.sht, p.from.f, p.from.f, p.to.f, NULL, NULL,
                                            &transfer, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "target"));
    srnf_free(path);
    pullback_close(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(converges_with_segments),
        cmocka_unit_test(is_linear_and_keeps_products),
        cmocka_unit_test(comes_back),
        cmocka_unit_test(carries_the_velocity_of_a_geodesic),
        cmocka_unit_test(transfers),
        cmocka_unit_test(says_when_a_transfer_has_not_converged),
        cmocka_unit_test(refuses_wrong_arguments),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

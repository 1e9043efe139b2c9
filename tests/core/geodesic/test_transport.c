/*
 * test_transport.c - parallel transport and deformation transfer: what is constant, what is exact,
 * what is lost, and what registration does to vectors.
 */
#include "core/figures.h"

#define DEGREE 15

static void open_star(struct shapes_surface *s, uint64_t seed)
{
    shapes_open(s, DEGREE);
    shapes_fill_random_star(s, seed, NULL);
}

/* A smooth random vector: coefficients that fall with l, no translation. */
static double *random_vector(const struct shapes_surface *s, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    double *w = shapes_doubles(s->count);

    for (size_t i = 0; i < s->count; i++) {
        double l = floor(sqrt((double)(i % s->each)));

        w[i] = l > 0.0 ? test_random_normal(&random) / (l * l) : 0.0;
    }
    return w;
}

static double *push(const struct shapes_surface *s, const double *w)
{
    double *v = shapes_doubles(3 * s->points);

    srnf_field_differential(s->sht, s->f, w, v, s->workspace);
    return v;
}

static struct srnf_tangent pull(const struct shapes_surface *s, const double *v)
{
    struct srnf_tangent tangent;

    assert_int_equal(srnf_transport(s->sht, s->f, v, NULL, &tangent, NULL), SRNF_OK);
    assert_true(tangent.converged && tangent.iterations > 0 && tangent.transforms > 0.0);
    return tangent;
}

/* The vector stays what it is on the way, so that going back to where it came from returns it; the
   same holds for its sum and multiples. */
static void there_and_back(void **state)
{
    struct shapes_surface a;
    struct shapes_surface b;
    double *w;
    double *v;
    struct srnf_tangent there;
    struct srnf_tangent back;
    (void)state;

    open_star(&a, 1);
    open_star(&b, 2);
    w = random_vector(&a, 3);
    v = push(&a, w);
    there = pull(&b, v);
    back = pull(&a, v);
    figure_below("there and back, relative",
                 compare_difference(a.count, w, back.coefficients) / figure_norm(a.count, w), 1e-9);
    figure_below("what no motion of its own surface gives", back.residual / back.norm, 1e-9);
    printf("# what no motion of another surface gives: %.3f of the vector\n",
           there.residual / there.norm);
    assert_true(there.residual > 1e-3 * there.norm); /* two surfaces, two images */
    assert_true(there.norm == back.norm);
    srnf_tangent_clear(&back);
    srnf_tangent_clear(&there);
    srnf_free(v);
    srnf_free(w);
    shapes_close(&b);
    shapes_close(&a);
}

/* The residual is orthogonal to every motion of the surface, so that squares add up. */
static void nearest_motion(void **state)
{
    struct shapes_surface a;
    struct shapes_surface b;
    double *w;
    double *v;
    double *own;
    double *other;
    double *image;
    double part;
    struct srnf_tangent there;
    (void)state;

    open_star(&a, 1);
    open_star(&b, 2);
    w = random_vector(&a, 3);
    v = push(&a, w);
    there = pull(&b, v);
    image = push(&b, there.coefficients);
    part = srnf_inner_product(b.grid, image, image);
    assert_true(fabs(part + there.residual * there.residual - there.norm * there.norm) <=
                1e-10 * there.norm * there.norm);
    own = random_vector(&b, 4);
    other = push(&b, own);
    for (size_t i = 0; i < 3 * b.points; i++) {
        image[i] -= v[i];
    }
    figure_below("angle of the residual with another motion",
                 fabs(srnf_inner_product(b.grid, image, other)) /
                     sqrt(srnf_inner_product(b.grid, image, image) *
                          srnf_inner_product(b.grid, other, other)),
                 1e-9);
    srnf_tangent_clear(&there);
    srnf_free(image);
    srnf_free(other);
    srnf_free(own);
    srnf_free(v);
    srnf_free(w);
    shapes_close(&b);
    shapes_close(&a);
}

/* The inversion of Q(f) + eps v, of which it is the limit; the error falls like eps. */
static void limit_of_small_steps(void **state)
{
    const double eps[] = {4e-2, 1e-2, 2.5e-3};
    struct shapes_surface a;
    struct shapes_surface b;
    double *w;
    double *v;
    double errors[3];
    struct srnf_tangent there;
    (void)state;

    open_star(&a, 1);
    open_star(&b, 2);
    w = random_vector(&a, 3);
    v = push(&a, w);
    there = pull(&b, v);
    for (size_t k = 0; k < 3; k++) {
        double t = eps[k] / there.norm;
        struct srnf_shot shot;

        assert_int_equal(srnf_shoot(b.sht, b.f, v, 1, &t, NULL, &shot, NULL), SRNF_OK);
        for (size_t i = 0; i < b.count; i++) {
            shot.coefficients[i] = (shot.coefficients[i] - b.f[i]) / t;
        }
        errors[k] = shapes_distance(DEGREE, shot.coefficients, there.coefficients) /
                    figure_norm(b.count, there.coefficients);
        srnf_shot_clear(&shot);
    }
    figure_order("motion by small steps", 3, errors, 4.0, 1.0, 0.5, 0.0, 2);
    srnf_tangent_clear(&there);
    srnf_free(v);
    srnf_free(w);
    shapes_close(&b);
    shapes_close(&a);
}

/* ---- Transfer -------------------------------------------------------------------------------- */

struct family {
    struct shapes_surface source, deformed, target;
};

static void open_family(struct family *x)
{
    open_star(&x->source, 1);
    open_star(&x->deformed, 2);
    open_star(&x->target, 3);
    for (size_t i = 0; i < x->source.count; i++) { /* a deformation, not another body */
        x->deformed.f[i] = 0.9 * (0.7 * x->source.f[i] + 0.3 * x->deformed.f[i]);
        x->source.f[i] *= 1.25;
        x->deformed.f[i] *= 1.25;
    }
    shapes_update(&x->source);
    shapes_update(&x->deformed);
}

static void close_family(struct family *x)
{
    shapes_close(&x->target);
    shapes_close(&x->deformed);
    shapes_close(&x->source);
}

static struct srnf_transferred transfer(const struct family *x, const struct shapes_surface *target,
                                        enum srnf_transfer_size size)
{
    struct srnf_transferred result;

    assert_int_equal(srnf_transfer(x->source.sht, x->source.f, x->deformed.f, target->f, size, NULL,
                                   &result, NULL),
                     SRNF_OK);
    return result;
}

static const enum srnf_transfer_size sizes[] = {SRNF_TRANSFER_RATIO, SRNF_TRANSFER_ABSOLUTE};

static double size_of(const struct shapes_surface *s, const double *f)
{
    struct srnf_surface_measures measures;

    srnf_surface_measure(s->sht, f, &measures, s->workspace);
    return sqrt(measures.area);
}

static void onto_the_source_gives_the_deformed_surface(void **state)
{
    struct family x;
    (void)state;

    open_family(&x);
    x.deformed.f[0] += 0.2; /* where it has gone, too */
    for (size_t k = 0; k < 2; k++) {
        struct srnf_transferred result = transfer(&x, &x.source, sizes[k]);

        assert_true(result.relative_energy < 1e-25);
        assert_true(fabs(result.size_ratio * size_of(&x.source, x.source.f) /
                             size_of(&x.source, x.deformed.f) -
                         1.0) < 1e-12);
        figure_below("the deformed surface",
                     compare_difference(x.source.count, result.coefficients, x.deformed.f), 1e-12);
        srnf_transferred_clear(&result);
    }
    close_family(&x);
}

static void no_deformation_gives_the_target(void **state)
{
    struct family x;
    (void)state;

    open_family(&x);
    memcpy(x.deformed.f, x.source.f, x.source.count * sizeof(double));
    for (size_t k = 0; k < 2; k++) {
        struct srnf_transferred result = transfer(&x, &x.target, sizes[k]);

        figure_below("the target",
                     compare_difference(x.target.count, result.coefficients, x.target.f), 1e-12);
        srnf_transferred_clear(&result);
    }
    close_family(&x);
}

/* A change of size alone is carried as a ratio, or as so many units. */
static void growing_is_carried(void **state)
{
    struct family x;
    (void)state;

    open_family(&x);
    for (size_t i = 0; i < x.source.count; i++) {
        x.deformed.f[i] = 1.5 * x.source.f[i];
    }
    for (size_t k = 0; k < 2; k++) {
        struct srnf_transferred result = transfer(&x, &x.target, sizes[k]);
        double grown = size_of(&x.target, result.coefficients) / size_of(&x.target, x.target.f);

        assert_true(fabs(result.size_ratio - 1.5) < 1e-12);
        if (sizes[k] == SRNF_TRANSFER_RATIO) {
            for (size_t i = 0; i < x.target.count; i++) {
                result.coefficients[i] -= 1.5 * x.target.f[i];
            }
            figure_below("the target grown", figure_norm(x.target.count, result.coefficients),
                         1e-12);
        } else {
            assert_true(grown > 1.51); /* half of a source that is larger than the target */
        }
        srnf_transferred_clear(&result);
    }
    close_family(&x);
}

/* In one unit, Q(result) - Q(target) is Q(deformed) - Q(source) up to the energy. */
static void carries_the_difference(void **state)
{
    struct family x;
    struct srnf_transferred result;
    double *q;
    double energy;
    (void)state;

    open_family(&x);
    q = shapes_doubles(3 * x.target.points);
    result = transfer(&x, &x.target, SRNF_TRANSFER_ABSOLUTE);
    for (size_t i = 0; i < 3 * x.target.points; i++) {
        q[i] = x.target.q[i] + x.deformed.q[i] - x.source.q[i];
    }
    energy = srnf_energy(x.target.sht, result.coefficients, q, NULL, x.target.workspace);
    assert_true(fabs(energy / result.energy - 1.0) < 1e-9);
    figure_below("relative energy", result.relative_energy, 1e-2);
    srnf_transferred_clear(&result);
    srnf_free(q);
    close_family(&x);
}

/* Subjects in units of their own: the answer goes along with the target, and its size with the
   ratio. */
static void goes_along_with_units(void **state)
{
    struct family x;
    struct srnf_transferred plain;
    struct srnf_transferred scaled;
    (void)state;

    open_family(&x);
    plain = transfer(&x, &x.target, SRNF_TRANSFER_RATIO);
    assert_true(fabs(size_of(&x.target, plain.coefficients) / size_of(&x.target, x.target.f) -
                     plain.size_ratio) < 1e-12);
    for (size_t i = 0; i < x.source.count; i++) {
        x.source.f[i] *= 30.0;
        x.deformed.f[i] *= 30.0;
        x.target.f[i] *= 2.0;
        plain.coefficients[i] *= 2.0;
    }
    scaled = transfer(&x, &x.target, SRNF_TRANSFER_RATIO);
    figure_below("in other units", shapes_distance(DEGREE, plain.coefficients, scaled.coefficients),
                 1e-6);
    srnf_transferred_clear(&scaled);
    srnf_transferred_clear(&plain);
    close_family(&x);
}

/* What shooting from the target along the transported velocity gives: Algorithm 6 in two steps. */
static void is_transport_and_shooting(void **state)
{
    const double one = 1.0;
    struct family x;
    struct srnf_transferred result;
    struct srnf_shot shot;
    double *v;
    (void)state;

    open_family(&x);
    v = shapes_doubles(3 * x.target.points);
    assert_int_equal(srnf_velocity_toward(x.source.sht, x.source.f, x.deformed.f, v), SRNF_OK);
    result = transfer(&x, &x.target, SRNF_TRANSFER_ABSOLUTE);
    assert_int_equal(srnf_shoot(x.target.sht, x.target.f, v, 1, &one, NULL, &shot, NULL), SRNF_OK);
    assert_true(fabs(shot.energy[0] / result.energy - 1.0) < 1e-3);
    figure_below("transfer and shooting",
                 shapes_distance(DEGREE, shot.coefficients, result.coefficients), 2e-3);
    srnf_shot_clear(&shot);
    srnf_transferred_clear(&result);
    srnf_free(v);
    close_family(&x);
}

/* ---- Registration ---------------------------------------------------------------------------- */

/* What is laid along is O w o gamma: of the moving surface itself, its registered coefficients;
   linear; and the differential goes along with it. */
static void registration_takes_vectors_along(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration registration;
    struct shapes_surface a;
    struct shapes_surface b;
    struct shapes_surface moved;
    double *w;
    double *laid;
    double *v;
    double *image;
    double expected;
    double got;
    (void)state;

    open_star(&a, 1);
    open_star(&b, 2);
    open_star(&moved, 2);
    options.start = SRNF_START_RIGID;
    options.degree = 4;
    assert_int_equal(
        srnf_register(a.sht, a.f, NULL, b.f, &options, NULL, NULL, &registration, NULL), SRNF_OK);
    assert_int_equal(srnf_registration_apply(a.sht, &registration, b.f, NULL, moved.f), SRNF_OK);
    assert_memory_equal(moved.f, registration.coefficients, a.count * sizeof(double));
    w = random_vector(&b, 5);
    laid = shapes_doubles(b.count);
    assert_int_equal(srnf_registration_apply(a.sht, &registration, w, NULL, laid), SRNF_OK);
    v = push(&b, w);
    image = push(&moved, laid);
    expected = sqrt(srnf_inner_product(b.grid, v, v));
    got = sqrt(srnf_inner_product(b.grid, image, image));
    figure_below("change of the norm of a vector", fabs(got / expected - 1.0), 2e-2);
    for (size_t i = 0; i < b.count; i++) {
        w[i] = 2.0 * b.f[i] - 3.0 * w[i];
    }
    assert_int_equal(srnf_registration_apply(a.sht, &registration, w, NULL, w),
                     SRNF_OK); /* in place */
    for (size_t i = 0; i < b.count; i++) {
        assert_true(fabs(w[i] - 2.0 * moved.f[i] + 3.0 * laid[i]) < 1e-12);
    }
    srnf_free(image);
    srnf_free(v);
    srnf_free(laid);
    srnf_free(w);
    srnf_registration_clear(&registration);
    shapes_close(&moved);
    shapes_close(&b);
    shapes_close(&a);
}

/* ---- Wrong arguments ------------------------------------------------------------------------- */

static bool stop_at_once(void *user)
{
    (void)user;
    return true;
}

static void refuses_wrong_arguments(void **state)
{
    const struct srnf_context context = {.canceled = stop_at_once};
    struct family x;
    struct srnf_transferred result;
    struct srnf_tangent tangent;
    struct srnf_error error = {0};
    const char *const words[] = {"source", "deformed", "target"};
    (void)state;

    open_family(&x);
    assert_int_equal(
        srnf_transport(x.source.sht, x.source.f, x.target.q, &context, &tangent, &error),
        SRNF_ECANCELED);
    assert_null(tangent.coefficients);
    assert_int_equal(srnf_transfer(x.source.sht, x.source.f, x.deformed.f, x.target.f,
                                   SRNF_TRANSFER_RATIO, &context, &result, &error),
                     SRNF_ECANCELED);
    assert_null(result.coefficients);
    for (size_t k = 0; k < 3; k++) {
        double *f = k == 0 ? x.source.f : k == 1 ? x.deformed.f : x.target.f;
        double kept = f[4];

        f[4] = NAN;
        error = (struct srnf_error){0};
        assert_int_equal(srnf_transfer(x.source.sht, x.source.f, x.deformed.f, x.target.f,
                                       SRNF_TRANSFER_RATIO, NULL, &result, &error),
                         SRNF_EINVAL);
        assert_int_equal(error.element, 4);
        assert_non_null(strstr(error.message, words[k]));
        f[4] = kept;
        memset(f, 0, x.source.count * sizeof(double));
        assert_int_equal(srnf_transfer(x.source.sht, x.source.f, x.deformed.f, x.target.f,
                                       SRNF_TRANSFER_RATIO, NULL, &result, &error),
                         SRNF_EDEGENERATE);
        assert_null(result.coefficients);
        close_family(&x);
        open_family(&x);
    }
    x.target.q[2] = INFINITY;
    assert_int_equal(srnf_transport(x.source.sht, x.source.f, x.target.q, NULL, &tangent, &error),
                     SRNF_EINVAL);
    assert_int_equal(error.element, 2);
    close_family(&x);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(there_and_back),
        cmocka_unit_test(nearest_motion),
        cmocka_unit_test(limit_of_small_steps),
        cmocka_unit_test(onto_the_source_gives_the_deformed_surface),
        cmocka_unit_test(no_deformation_gives_the_target),
        cmocka_unit_test(growing_is_carried),
        cmocka_unit_test(carries_the_difference),
        cmocka_unit_test(goes_along_with_units),
        cmocka_unit_test(is_transport_and_shooting),
        cmocka_unit_test(registration_takes_vectors_along),
        cmocka_unit_test(refuses_wrong_arguments),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

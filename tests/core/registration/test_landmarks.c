/*
 * test_landmarks.c - registration that is guided by landmarks: they are met exactly, or the nearer
 * the more they weigh; a known warp is found from a few of its points; the correction of a step is
 * the minimum that it claims to be; what cannot be met, or is no set of landmarks, is told by name.
 * srnfd-test: slow
 */
#include "registrations.h"
#include "registration/landmarks.h"
#include "support/refusing.h"

#define DEGREE (FIGURES_SLOW ? 7 : 10)
#define COUNT 6
#define EXACT 1e-9 /* radians; 1e-6 is promised */
#define assert_below(a, b) assert_true((a) < (b))
#define assert_above(a, b) assert_true((a) > (b))
#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

/* Points spread over the sphere, each moved by a normal vector of that size. */
static void spread(struct test_random *random, size_t n, double size, double *points)
{
    for (size_t i = 0; i < n; i++) {
        double z = 1.0 - (2.0 * (double)i + 1.0) / (double)n;
        double phi = 2.399963229728653 * (double)i;
        double *p = points + 3 * i;
        double length;

        p[0] = sqrt(1.0 - z * z) * cos(phi);
        p[1] = sqrt(1.0 - z * z) * sin(phi);
        p[2] = z;
        for (size_t k = 0; k < 3; k++) {
            p[k] += size * test_random_normal(random);
        }
        length = sqrt(vector_dot(p, p));
        for (size_t k = 0; k < 3; k++) {
            p[k] /= length;
        }
    }
}

struct scene {
    struct shapes_surface a, b;
    double fixed[3 * COUNT], moving[3 * COUNT];
    struct srnf_landmarks landmarks;
};

static void scene_open(struct scene *s, double weight)
{
    struct test_random random = test_random_seed(11);

    shapes_open(&s->a, DEGREE);
    shapes_open(&s->b, DEGREE);
    shapes_fill(&s->a, shapes_ellipsoid, 1.7);
    shapes_fill(&s->b, shapes_bumpy, 0.0);
    spread(&random, COUNT, 0.0, s->fixed);
    spread(&random, COUNT, 0.1, s->moving);
    s->landmarks = (struct srnf_landmarks){COUNT, s->fixed, s->moving, weight};
}

static void scene_close(struct scene *s)
{
    shapes_close(&s->a);
    shapes_close(&s->b);
}

/* Registers b to a; returns the root of the mean squared angle that is left. */
static double run(const struct scene *s, const struct srnf_register_options *options,
                  const struct srnf_landmarks *landmarks, struct srnf_registration *r)
{
    struct srnf_error error = {0};
    double angles[SRNF_LANDMARKS_MAX];
    double sum = 0.0;
    int status = srnf_register_landmarks(s->a.sht, s->a.f, NULL, s->b.f, options, landmarks, NULL,
                                         NULL, r, &error);

    if (status != SRNF_OK) {
        fail_msg("registration: %s, %s", srnf_strerror(status), error.message);
    }
    assert_int_equal(srnf_landmarks_measure(&r->warp, &s->landmarks, angles), SRNF_OK);
    for (size_t i = 0; i < s->landmarks.n; i++) {
        sum += angles[i] * angles[i] / (double)s->landmarks.n;
    }
    return sqrt(sum);
}

static void meets_them_exactly(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct scene s;
    (void)state;

    scene_open(&s, INFINITY);
    for (int way = FIGURES_SLOW ? 1 : 0; way < (FIGURES_SLOW ? 3 : 4); way++) {
        struct srnf_registration r;
        double most;

        options.symmetric = way == 1;
        options.common_pose = way == 2;
        options.start = way == 3 ? SRNF_START_RIGID : SRNF_START_TOURNAMENT;
        most = run(&s, &options, &s.landmarks, &r);
        printf("# way %d: residual %.2g, distance %.4f, J %.3f to %.3f\n", way, most, r.distance,
               r.min_jacobian, r.max_jacobian);
        assert_below(most, EXACT);
        assert_above(r.min_jacobian, 0.02);
        assert_below(r.distance, r.distance_before);
        srnf_registration_clear(&r);
    }
    scene_close(&s);
}

/* The same scene from the other side. */
static struct scene turned_round(struct scene *s)
{
    struct scene t = *s;

    t.a = s->b;
    t.b = s->a;
    t.landmarks.fixed = s->moving;
    t.landmarks.moving = s->fixed;
    return t;
}

/* (a, b) and (b, a) both ways: one distance, and each warp the inverse of the other. */
static void is_symmetric(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration there, back;
    struct scene s, t;
    (void)state;

    if (FIGURES_SLOW) { /* one of the ways above is this */
        skip();
    }
    options.symmetric = true;
    scene_open(&s, INFINITY);
    assert_below(run(&s, &options, &s.landmarks, &there), EXACT);
    t = turned_round(&s);
    assert_below(run(&t, &options, &t.landmarks, &back), EXACT);
    assert_true(there.distance == back.distance);
    srnf_registration_clear(&there);
    srnf_registration_clear(&back);
    scene_close(&s);
}

/* Whichever start of a way is the best one, of landmarks or of the surfaces: what rotations cost
   and what else there is are known, of both ways the lesser. */
static void tells_of_rotations(void **state)
{
    static const double weights[] = {1.0, 0.1, 0.01, 0.001};
    struct srnf_register_options options = srnf_register_options_defaults();
    struct test_random random = test_random_seed(21);
    struct scene s;
    (void)state;

    options.degree = 6;
    scene_open(&s, 1.0);
    for (size_t k = 0; k < sizeof weights / sizeof weights[0]; k += FIGURES_SLOW ? 3 : 1) {
        struct srnf_registration there, back, both;
        struct scene t;

        s.landmarks.weight = weights[k];
        spread(&random, COUNT, 0.5, s.moving);
        t = turned_round(&s);
        options.symmetric = false;
        (void)run(&s, &options, &s.landmarks, &there);
        (void)run(&t, &options, &t.landmarks, &back);
        options.symmetric = true;
        (void)run(&s, &options, &s.landmarks, &both);
        printf("# weight %g: curvature %.4f there, %.4f back, %.4f both ways\n", weights[k],
               there.rotational_curvature, back.rotational_curvature, both.rotational_curvature);
        assert_true(there.rotations_searched && back.rotations_searched && both.rotations_searched);
        assert_above(both.rotational_curvature, 0.01);
        assert_true(both.rotational_curvature ==
                    compare_min(there.rotational_curvature, back.rotational_curvature));
        assert_above(both.ambiguity_objective, 0.0);
        assert_true(both.ambiguity_objective ==
                    compare_min(there.ambiguity_objective, back.ambiguity_objective));
        srnf_registration_clear(&there);
        srnf_registration_clear(&back);
        srnf_registration_clear(&both);
    }
    scene_close(&s);
}

/* What is left falls as the weight grows, from what nobody asked for to 0, and distance rises. */
static void weighs_them(void **state)
{
    static const double weights[] = {1e-9, 0.1, 1.0, 100.0, INFINITY};
    const struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r, plain;
    double before = INFINITY;
    struct scene s;
    (void)state;

    scene_open(&s, 1.0);
    (void)run(&s, &options, NULL, &plain);
    for (size_t k = 0; k < sizeof weights / sizeof weights[0]; k += FIGURES_SLOW ? 2 : 1) {
        double most;

        s.landmarks.weight = weights[k];
        most = run(&s, &options, &s.landmarks, &r);
        printf("# weight %g: residual %.3g, distance %.4f (%.4f without)\n", weights[k], most,
               r.distance, plain.distance);
        assert_below(most, before);
        if (k == 0) {
            assert_near(r.distance, plain.distance, 0.02 * plain.distance);
        }
        before = most;
        srnf_registration_clear(&r);
    }
    assert_below(before, EXACT);
    srnf_registration_clear(&plain);
    scene_close(&s);
}

/* However much they weigh, and however far they are: they are gone to step by step. */
static void weighs_much(void **state)
{
    static const double weights[] = {1.0, 1e3, 1e6, INFINITY};
    static const double limits[] = {0.1, 1e-3, 1e-6, EXACT}; /* radians */
    const struct srnf_register_options options = srnf_register_options_defaults();
    struct test_random random = test_random_seed(12);
    double before = INFINITY;
    struct scene s;
    (void)state;

    scene_open(&s, 1.0);
    spread(&random, COUNT, 0.5, s.moving);
    for (size_t k = 0; k < sizeof weights / sizeof weights[0]; k += FIGURES_SLOW ? 2 : 1) {
        struct srnf_registration r;
        double most;

        s.landmarks.weight = weights[k];
        most = run(&s, &options, &s.landmarks, &r);
        printf("# weight %g: residual %.3g, distance %.4f, %s\n", weights[k], most, r.distance,
               srnf_register_stop_name(r.stopped));
        assert_below(most, before);
        assert_below(most, limits[k]);
        before = most;
        srnf_registration_clear(&r);
    }
    scene_close(&s);
}

/* A known warp in any pose: its own landmarks lead to it, and to points that were held out. */
static void finds_a_warp(void **state)
{
    const struct srnf_register_options options = srnf_register_options_defaults();
    struct test_random random = test_random_seed(5);
    struct srnf_registration r;
    struct srnf_warp warp;
    double rotation[9], left[3 * COUNT], images[3 * COUNT], held[3 * COUNT], away[3 * COUNT];
    struct scene s;
    (void)state;

    scene_open(&s, INFINITY);
    shapes_random_rotation(&random, rotation);
    registrations_warp(&random, 0.6, &warp);
    /* The template is the moving surface, warped: the warp takes its points to those of b. */
    registrations_resample(&s.b, &warp, rotation, s.a.f);
    spread(&random, COUNT, 0.3, held);
    assert_int_equal(srnf_warp_apply(&warp, COUNT, s.fixed, images, NULL), SRNF_OK);
    assert_int_equal(srnf_warp_apply(&warp, COUNT, held, away, NULL), SRNF_OK);
    s.landmarks.moving = images;
    assert_below(run(&s, &options, &s.landmarks, &r), EXACT);
    assert_int_equal(srnf_warp_apply(&r.warp, COUNT, held, left, NULL), SRNF_OK);
    for (size_t i = 0; i < COUNT; i++) {
        assert_below(landmarks_angle(left + 3 * i, away + 3 * i), 0.1);
    }
    assert_below(r.distance, 0.1 * r.distance_before);
    srnf_registration_clear(&r);
    srnf_warp_clear(&warp);
    scene_close(&s);
}

/* One landmark leaves the turn about it open, two opposite ones too: any pose is found. */
static void turns_about_one(void **state)
{
    const struct srnf_register_options options = srnf_register_options_defaults();
    struct test_random random = test_random_seed(8);
    (void)state;

    for (size_t n = 1; n <= 2; n++) {
        struct srnf_warp turn = {0};
        struct srnf_registration r;
        double rotation[9], images[6];
        struct scene s;

        scene_open(&s, INFINITY);
        shapes_random_rotation(&random, rotation);
        assert_int_equal(warp_append(&turn, SRNF_WARP_ROTATION, 0, rotation), SRNF_OK);
        registrations_resample(&s.b, &turn, rotation, s.a.f);
        for (size_t k = 0; k < 3; k++) {
            s.fixed[3 + k] = -s.fixed[k];
        }
        assert_int_equal(srnf_warp_apply(&turn, 2, s.fixed, images, NULL), SRNF_OK);
        s.landmarks.n = n;
        s.landmarks.moving = images;
        assert_below(run(&s, &options, &s.landmarks, &r), EXACT);
        assert_below(r.distance, 1e-3);
        srnf_registration_clear(&r);
        srnf_warp_clear(&turn);
        scene_close(&s);
    }
}

/* ---- The correction of a step ---------------------------------------------------------------- */

/* M = diag. */
static bool solve_diagonal(void *system, const double *rhs, double *out)
{
    const double *diagonal = system;

    for (size_t i = 0; i < registration_unknowns(4); i++) {
        out[i] = rhs[i] / diagonal[i];
    }
    return true;
}

/* The rows are the derivative of the points along a step, and the corrected step is a stationary
   point of c'Mc - 2 <rhs, c> + nu |A c - r|^2; its promise is the model's fall. */
static void corrects_to_the_minimum(void **state)
{
    enum { UNKNOWNS = 2 * 24 + 3 };
    struct test_random random = test_random_seed(3);
    struct srnf_warp none = {0};
    double diagonal[UNKNOWNS], rhs[UNKNOWNS], step[UNKNOWNS], potentials[50];
    double promise, expected = 0.0, fall = 0.0;
    struct landmark_track t;
    struct scene s;
    (void)state;

    scene_open(&s, 2.5);
    assert_int_equal(landmark_track_create(&t, &s.landmarks, &none, 4, NULL), SRNF_OK);
    landmark_track_linearize(&t);
    for (size_t i = 0; i < UNKNOWNS; i++) {
        diagonal[i] = 1.0 + test_random_normal(&random) * test_random_normal(&random) * 0.1;
        diagonal[i] = diagonal[i] > 0.1 ? diagonal[i] : 0.1;
        rhs[i] = 0.1 * test_random_normal(&random);
        step[i] = rhs[i] / diagonal[i];
    }
    assert_true(landmark_track_correct(&t, solve_diagonal, diagonal, 1.0, step, &promise));
    for (size_t i = 0; i < UNKNOWNS; i++) {
        double derivative = diagonal[i] * step[i] - rhs[i];

        for (size_t k = 0; k < 2 * (size_t)COUNT; k++) {
            const double *row = t.rows + k * UNKNOWNS;

            derivative += t.weight * row[i] * (linear_dot(UNKNOWNS, row, step) - t.residual[k]);
        }
        assert_near(derivative, 0.0, 1e-12);
        fall += (2.0 * rhs[i] - diagonal[i] * step[i]) * step[i];
    }
    for (size_t k = 0; k < 2 * (size_t)COUNT; k++) {
        double left = linear_dot(UNKNOWNS, t.rows + k * UNKNOWNS, step) - t.residual[k];

        fall += t.weight * (t.residual[k] * t.residual[k] - left * left);
    }
    expected = linear_dot(UNKNOWNS, rhs, step) + promise;
    assert_near(expected, fall, 1e-12);
    /* A small step moves the points as the rows say. */
    linear_scale(UNKNOWNS, 1e-5, step);
    registration_potentials(&t.fields, step, potentials);
    (void)landmark_track_try(&t, potentials);
    for (size_t j = 0; j < COUNT; j++) {
        double moved = landmarks_angle(t.at + 3 * j, t.next + 3 * j);
        double along = linear_dot(UNKNOWNS, t.rows + 2 * j * UNKNOWNS, step);
        double across = linear_dot(UNKNOWNS, t.rows + (2 * j + 1) * UNKNOWNS, step);

        assert_near(moved, sqrt(along * along + across * across), 1e-12);
    }
    landmark_track_clear(&t);
    scene_close(&s);
}

/* ---- What is refused ------------------------------------------------------------------------- */

static void refuses(const struct scene *s, const struct srnf_register_options *options,
                    const struct srnf_landmarks *landmarks, int64_t element, const char *word)
{
    struct srnf_registration r;
    struct srnf_error error = {0};

    assert_int_equal(srnf_register_landmarks(s->a.sht, s->a.f, NULL, s->b.f, options, landmarks,
                                             NULL, NULL, &r, &error),
                     SRNF_EINVAL);
    assert_int_equal(error.element, element);
    assert_non_null(strstr(error.message, word));
    assert_null(r.coefficients);
}

static void refuses_what_is_wrong(void **state)
{
    const struct srnf_register_options good = srnf_register_options_defaults();
    struct srnf_register_options bad = good;
    struct srnf_landmarks wrong;
    struct scene s;
    (void)state;

    scene_open(&s, 1.0);
    wrong = s.landmarks;
    wrong.n = 0;
    refuses(&s, &good, &wrong, -1, "0 landmarks");
    assert_int_equal(srnf_landmarks_check(&wrong, 12, NULL), SRNF_EINVAL);
    assert_int_equal(srnf_landmarks_check(&s.landmarks, 12, NULL), SRNF_OK);
    wrong.n = SRNF_LANDMARKS_MAX + 1;
    refuses(&s, &good, &wrong, -1, "65 landmarks");
    wrong = s.landmarks;
    wrong.weight = 0.0;
    refuses(&s, &good, &wrong, -1, "weight");
    wrong.weight = NAN;
    refuses(&s, &good, &wrong, -1, "weight");
    bad.degree = 2;
    refuses(&s, &bad, &s.landmarks, -1, "degree 2");
    bad = good;
    bad.exact = true;
    refuses(&s, &bad, &s.landmarks, -1, "exact");
    bad = good;
    bad.reparameterization = false;
    refuses(&s, &bad, &s.landmarks, -1, "reparameterization");
    memcpy(s.moving + 9, s.moving, 3 * sizeof(double));
    refuses(&s, &good, &s.landmarks, 3, "0 and 3 of the moving surface coincide");
    s.moving[9] += 1.0;
    refuses(&s, &good, &s.landmarks, 3, "no unit vector");
    s.moving[9] = NAN;
    refuses(&s, &good, &s.landmarks, 3, "no unit vector");
    scene_close(&s);
}

/* Points all over the sphere, to their mirror images: nothing that keeps orientation does that
   without pinching. */
static void tells_what_cannot_be_met(void **state)
{
    enum { MANY = 40 };
    const struct srnf_register_options options = srnf_register_options_defaults();
    struct test_random random = test_random_seed(2);
    double fixed[3 * MANY], mirrored[3 * MANY];
    const struct srnf_landmarks landmarks = {MANY, fixed, mirrored, INFINITY};
    struct srnf_registration r;
    struct srnf_error error = {0};
    struct scene s;
    (void)state;

    scene_open(&s, INFINITY);
    spread(&random, MANY, 0.0, fixed);
    memcpy(mirrored, fixed, sizeof fixed);
    for (size_t i = 0; i < MANY; i++) {
        mirrored[3 * i] = -mirrored[3 * i];
    }
    assert_int_equal(srnf_register_landmarks(s.a.sht, s.a.f, NULL, s.b.f, &options, &landmarks,
                                             NULL, NULL, &r, &error),
                     SRNF_EUNMATCHED);
    assert_in_range(error.element, 0, MANY - 1);
    assert_non_null(strstr(error.message, "keeps orientation"));
    assert_null(r.coefficients);
    scene_close(&s);
}

/* ---- Memory ---------------------------------------------------------------------------------- */

static const struct scene *refused;

static int run_refused(void)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;
    int status;

    options.degree = 4;
    options.start = SRNF_START_RIGID;
    status = srnf_register_landmarks(refused->a.sht, refused->a.f, NULL, refused->b.f, &options,
                                     &refused->landmarks, NULL, NULL, &r, NULL);
    srnf_registration_clear(&r);
    return status;
}

static void survives_refusals(void **state)
{
    struct scene s;
    (void)state;

    scene_open(&s, INFINITY);
    refused = &s;
    refusing_sweep("landmarks", run_refused, 10,
                   refusing_count("landmarks", run_refused) / (FIGURES_SLOW ? 5 : 20) + 1);
    scene_close(&s);
    assert_int_equal(refusing.alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(meets_them_exactly),    cmocka_unit_test(is_symmetric),
        cmocka_unit_test(tells_of_rotations),    cmocka_unit_test(weighs_them),
        cmocka_unit_test(weighs_much),           cmocka_unit_test(finds_a_warp),
        cmocka_unit_test(turns_about_one),       cmocka_unit_test(corrects_to_the_minimum),
        cmocka_unit_test(refuses_what_is_wrong), cmocka_unit_test(tells_what_cannot_be_met),
        cmocka_unit_test(survives_refusals),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

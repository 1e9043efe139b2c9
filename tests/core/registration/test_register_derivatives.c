/*
 * test_register_derivatives.c - the pieces of registration against differences and against theory:
 * gradient of each term, Gauss-Newton matrix, its matrix-free twin, the Jacobian of warps, isometry
 * of the action, inverse chains, replay.
 *
 * srnfd-test: no-asan (api/test_standard.sh and core/test_every_allocation.c run its code)
 */
#include "registrations.h"
#include "registration/exact.h"

#define DEGREE 12
#define FIELDS 6

/* Two surfaces, a warp between them, and everything a step needs. */
struct bench {
    struct shapes_surface a, b;
    struct moving moving;
    struct problem problem;
    struct warp warp;
    struct samples samples;
    struct level level;
    double *memory;
    double rotation[9];
};

static void open_bench(struct bench *t, const struct penalty *penalty, double least)
{
    struct test_random random = test_random_seed(41);
    struct srnf_warp chain;
    size_t n;

    shapes_open(&t->a, DEGREE);
    shapes_open(&t->b, DEGREE);
    shapes_fill(&t->a, shapes_ellipsoid, 1.7);
    shapes_fill(&t->b, shapes_bumpy, 0.0);
    n = t->a.points;
    t->memory = shapes_doubles(7 * n);
    registration_nodes(t->a.grid, t->memory, t->memory + 3 * n);
    for (size_t i = 0; i < 3 * n; i++) {
        t->memory[4 * n + i] = t->a.q[i % 3 * n + i / 3];
    }
    assert_int_equal(moving_create(&t->moving, DEGREE, t->b.f, DEGREE, NULL), SRNF_OK);
    t->problem =
        (struct problem){.target = {.n = n,
                                    .points = t->memory,
                                    .weight = t->memory + 3 * n,
                                    .q = t->memory + 4 * n,
                                    .norm2 = srnf_inner_product(t->a.grid, t->a.q, t->a.q)},
                         .moving = &t->moving,
                         .penalty = *penalty,
                         .free_rotation = true};
    registrations_warp(&random, least, &chain);
    assert_int_equal(warp_create(&t->warp, &t->problem.target), SRNF_OK);
    assert_int_equal(warp_replay(&t->warp, &t->problem.target, &chain, NULL), SRNF_OK);
    srnf_warp_clear(&chain);
    assert_int_equal(samples_create(&t->samples, n), SRNF_OK);
    assert_int_equal(level_create(&t->level, &t->problem, FIELDS), SRNF_OK);
    registration_objective(&t->problem, &t->warp, &t->samples, t->rotation);
}

static void close_bench(struct bench *t)
{
    level_clear(&t->level);
    samples_clear(&t->samples);
    warp_clear(&t->warp);
    moving_clear(&t->moving);
    srnf_free(t->memory);
    shapes_close(&t->a);
    shapes_close(&t->b);
}

/* A random direction of the fields; unknowns to potentials. */
static void direction(const struct bench *t, double *unknowns, double *potentials)
{
    struct test_random random = test_random_seed(42);
    size_t count = t->level.fields.count;

    memset(potentials, 0, 2 * count * sizeof *potentials);
    for (size_t i = 0; i < registration_unknowns(FIELDS); i++) {
        unknowns[i] = i < 2 * (count - 1) ? test_random_normal(&random) / 10.0 : 0.0;
    }
    for (size_t i = 1; i < count; i++) {
        potentials[i] = t->level.fields.scale[i] * unknowns[i - 1];
        potentials[count + i] = t->level.fields.scale[i] * unknowns[count + i - 2];
    }
}

/* The warp moved by h times the potentials; warp and samples of t stay. */
static void moved(const struct bench *t, const double *potentials, double h, double *points,
                  double *jacobian)
{
    size_t n = t->warp.n;
    size_t count = 2 * t->level.fields.count;
    double *scratch = shapes_doubles(FIELDS_SCRATCH * n + count);
    double *scaled = scratch + FIELDS_SCRATCH * n;

    for (size_t i = 0; i < count; i++) {
        scaled[i] = h * potentials[i];
    }
    (void)fields_apply(&t->level.fields, scaled, n, t->warp.points, t->warp.jacobian, points,
                       jacobian, scratch);
    srnf_free(scratch);
}

static double objective_at(struct bench *t, const double *potentials, double h)
{
    struct warp trial = t->warp;
    struct samples samples;
    double ignored[9];

    trial.points = shapes_doubles(4 * t->warp.n);
    trial.jacobian = trial.points + 3 * t->warp.n;
    moved(t, potentials, h, trial.points, trial.jacobian);
    assert_int_equal(samples_create(&samples, t->warp.n), SRNF_OK);
    registration_objective(&t->problem, &trial, &samples, ignored);
    samples_clear(&samples);
    srnf_free(trial.points);
    return trial.objective;
}

static void gradient_agrees_with_differences(void **state)
{
    static const struct {
        const char *name;
        struct penalty penalty;
    } terms[] = {{"data", {0.0, 0.0}},
                 {"data and Jacobian penalty", {0.3, 0.0}},
                 {"data and displacement penalty", {0.0, 1.0}},
                 {"all", {0.003, 0.01}}};
    (void)state;

    for (size_t k = 0; k < sizeof terms / sizeof terms[0]; k++) {
        struct bench t;
        double unknowns[2 * (FIELDS + 1) * (FIELDS + 1) + 3];
        double gradient[2 * (FIELDS + 1) * (FIELDS + 1) + 3];
        double potentials[2 * (FIELDS + 1) * (FIELDS + 1)];
        double errors[5];
        double slope;

        open_bench(&t, &terms[k].penalty, 0.6);
        direction(&t, unknowns, potentials);
        assert_int_equal(registration_gradient(&t.problem, &t.level, &t.warp, &t.samples,
                                               t.rotation, gradient, NULL),
                         SRNF_OK);
        slope = -2.0 * figure_dot(registration_unknowns(FIELDS), gradient, unknowns);
        for (size_t j = 0; j < 5; j++) {
            double h = 0.1 / (double)(1 << j);
            double difference =
                (objective_at(&t, potentials, h) - objective_at(&t, potentials, -h)) / (2.0 * h);

            errors[j] = fabs(difference - slope) / fabs(slope);
        }
        figure_order(terms[k].name, 5, errors, 2.0, 2.0, 0.25, 1e-10, 3);
        close_bench(&t);
    }
}

/* c' H c = ||d residual||^2, at the identity and, since the action is isometric, at any warp. */
static void matrix_is_that_of_the_residual(void **state)
{
    const double warps[] = {1.0, 0.6};
    const struct penalty none = {0.0, 0.0};
    (void)state;

    for (size_t k = 0; k < 2; k++) {
        struct bench t;
        struct samples s;
        double unknowns[2 * (FIELDS + 1) * (FIELDS + 1) + 3];
        double potentials[2 * (FIELDS + 1) * (FIELDS + 1)];
        size_t u = registration_unknowns(FIELDS);
        double expected = 0.0;
        double measured = 0.0;
        double *side[2];
        double *points;
        size_t n;

        open_bench(&t, &none, warps[k]);
        n = t.warp.n;
        points = shapes_doubles(10 * n);
        side[0] = points + 4 * n;
        side[1] = points + 7 * n;
        direction(&t, unknowns, potentials);
        assert_int_equal(samples_create(&s, n), SRNF_OK);
        for (size_t j = 0; j < 2; j++) {
            moved(&t, potentials, j ? 1e-4 : -1e-4, points, points + 3 * n);
            moving_evaluate(&t.moving, points, &s);
            for (size_t i = 0; i < 3 * n; i++) {
                side[j][i] = sqrt(points[3 * n + i / 3]) * s.q[i];
            }
        }
        for (size_t i = 0; i < 3 * n; i++) {
            double d = (side[1][i] - side[0][i]) / 2e-4;

            measured += t.problem.target.weight[i / 3] * d * d / t.problem.target.norm2;
        }
        for (size_t i = 0; i < u; i++) {
            for (size_t j = 0; j < u; j++) {
                expected +=
                    unknowns[i] * unknowns[j] * t.level.matrix[i < j ? i * u + j : j * u + i];
            }
        }
        figure_below(k ? "at a warp" : "at the identity", fabs(measured / expected - 1.0),
                     k ? 1e-3 : 1e-5);
        samples_clear(&s);
        srnf_free(points);
        close_bench(&t);
    }
}

/* The matrix-free product is the same matrix, and its two halves are adjoint. */
static void tangent_is_the_matrix(void **state)
{
    const struct penalty none = {0.0, 0.0};
    struct test_random random = test_random_seed(43);
    struct bench t;
    struct tangent g;
    struct samples s;
    size_t u = registration_unknowns(FIELDS);
    double *x;
    double *y;
    double direct = 0.0;
    double product = 0.0;
    double expected = 0.0;
    (void)state;

    open_bench(&t, &none, 1.0);
    assert_int_equal(tangent_create(&g, FIELDS, 30, 60), SRNF_OK);
    assert_int_equal(samples_create(&s, g.n), SRNF_OK);
    moving_evaluate(&t.moving, g.points, &s);
    memcpy(g.q, s.q, 3 * g.n * sizeof(double));
    memcpy(g.q_theta, s.q_1, 3 * g.n * sizeof(double));
    memcpy(g.q_phi, s.q_2, 3 * g.n * sizeof(double));
    tangent_prepare(&g, t.problem.target.norm2);
    x = shapes_doubles(2 * g.unknowns);
    y = x + g.unknowns;
    test_random_normals(&random, g.unknowns, x);
    x[0] = x[g.count] = 0.0;
    tangent_apply(&g, x);
    for (size_t i = 0; i < 3 * g.n; i++) {
        direct += g.weight[i / 3] * g.image[i] * g.image[i] / g.norm2;
    }
    tangent_transpose(&g, y);
    product = figure_dot(g.unknowns, x, y);
    for (size_t i = 0; i < u; i++) {
        for (size_t j = 0; j < u; j++) {
            /* Entries l = 0 have no place in the assembled matrix. */
            size_t at_i = i + 1 + (i >= g.count - 1);
            size_t at_j = j + 1 + (j >= g.count - 1);

            expected += x[at_i] * x[at_j] * t.level.matrix[i < j ? i * u + j : j * u + i];
        }
    }
    figure_below("adjoint", fabs(product / direct - 1.0), 1e-12);
    figure_below("against the assembled matrix", fabs(direct / expected - 1.0), 1e-6);
    srnf_free(x);
    samples_clear(&s);
    tangent_clear(&g);
    close_bench(&t);
}

static void warps_keep_the_area_of_the_sphere(void **state)
{
    struct test_random random = test_random_seed(44);
    struct srnf_sht *sht;
    double *points;
    double *weight;
    double *jacobian;
    size_t n;
    (void)state;

    assert_int_equal(srnf_sht_create(&sht, 1, SRNF_GRID_GAUSS_LEGENDRE, 64, 128), SRNF_OK);
    n = srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
    points = shapes_doubles(8 * n);
    weight = points + 6 * n;
    jacobian = points + 7 * n;
    registration_nodes(srnf_sht_grid(sht), points, weight);
    for (size_t k = 0; k < 5; k++) {
        struct srnf_warp warp;
        double sum = 0.0;

        registrations_warp(&random, 0.7, &warp);
        assert_int_equal(srnf_warp_apply(&warp, n, points, points + 3 * n, jacobian), SRNF_OK);
        for (size_t i = 0; i < n; i++) {
            sum += weight[i] * jacobian[i];
        }
        figure_below("integral of J - 4 pi", fabs(sum - 4.0 * acos(-1.0)), 1e-12);
        srnf_warp_clear(&warp);
    }
    srnf_free(points);
    srnf_sht_destroy(sht);
}

static void action_is_an_isometry(void **state)
{
    const size_t rows[] = {16, 24, 36, 54};
    double previous = INFINITY;
    (void)state;

    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        struct test_random random = test_random_seed(45);
        struct shapes_surface s;
        struct shapes_surface fine;
        struct srnf_warp warp;
        double turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        double area[2];
        double *q;

        /* One surface of degree 8; the grids of higher degrees serve as finer and finer rules. */
        shapes_open(&s, 8);
        shapes_fill(&s, shapes_bumpy, 0.0);
        shapes_open(&fine, 2 * rows[k] / 3 - 1);
        for (size_t c = 0; c < 3; c++) {
            memcpy(fine.f + c * fine.each, s.f + c * s.each, s.each * sizeof(double));
        }
        shapes_update(&fine);
        q = shapes_doubles(3 * fine.points);
        registrations_warp(&random, 0.7, &warp);
        registrations_act(&fine, &warp, turn, q);
        area[0] = srnf_inner_product(fine.grid, fine.q, fine.q);
        area[1] = srnf_inner_product(fine.grid, q, q);
        printf("# %zu rows: | ||(q, gamma)||^2 - ||q||^2 | = %.1e\n", rows[k],
               fabs(area[1] - area[0]));
        assert_true(fabs(area[1] - area[0]) <= compare_max(0.5 * previous, 1e-10));
        previous = fabs(area[1] - area[0]);
        srnf_warp_clear(&warp);
        srnf_free(q);
        shapes_close(&fine);
        shapes_close(&s);
    }
    assert_true(previous <= 1e-8);
}

static void inverse_chain_undoes(void **state)
{
    struct test_random random = test_random_seed(46);
    struct bench t;
    const struct penalty none = {0.0, 0.0};
    double *there;
    double *back;
    size_t n;
    (void)state;

    open_bench(&t, &none, 1.0);
    n = t.warp.n;
    there = shapes_doubles(8 * n);
    back = there + 4 * n;
    for (size_t k = 0; k < 6; k++) {
        struct srnf_warp warp;
        struct srnf_warp second;
        struct srnf_warp inverse = {0};
        double worst = 0.0;
        double product = 0.0;

        registrations_warp(&random, 0.5, &warp);
        registrations_warp(&random, 0.7, &second);
        assert_int_equal(
            warp_append(&warp, SRNF_WARP_EXP, second.links[1].degree, second.links[1].values),
            SRNF_OK);
        assert_int_equal(warp_invert(&warp, &inverse), SRNF_OK);
        assert_int_equal(srnf_warp_apply(&warp, n, t.problem.target.points, there, there + 3 * n),
                         SRNF_OK);
        assert_int_equal(srnf_warp_apply(&inverse, n, there, back, back + 3 * n), SRNF_OK);
        worst = compare_difference(3 * n, back, t.problem.target.points);
        for (size_t i = 0; i < n; i++) {
            product = compare_max(product, fabs(there[3 * n + i] * back[3 * n + i] - 1.0));
        }
        figure_below("inverse of the chain", worst, 1e-10);
        figure_below("product of the Jacobians - 1", product, 1e-9);
        srnf_warp_clear(&warp);
        srnf_warp_clear(&second);
        srnf_warp_clear(&inverse);
    }
    srnf_free(there);
    close_bench(&t);
}

/* What a registration reports is what its chain gives, and no worse than where it began. */
static void chain_replays_the_result(void **state)
{
    const bool exact[] = {false, true};
    struct bench t;
    const struct penalty none = {0.0, 0.0};
    (void)state;

    open_bench(&t, &none, 1.0);
    for (size_t k = 0; k < 2; k++) {
        struct srnf_register_options options = srnf_register_options_defaults();
        struct srnf_registration rigid;
        struct srnf_registration r;
        double *points = shapes_doubles(4 * t.warp.n);

        options.start = SRNF_START_RIGID;
        options.exact = exact[k];
        registrations_run(&t.a, NULL, t.b.f, &options, &r);
        options.reparameterization = false;
        registrations_run(&t.a, NULL, t.b.f, &options, &rigid);
        assert_true(r.objective <= rigid.objective);
        assert_int_equal(srnf_warp_apply(&r.warp, t.warp.n, t.problem.target.points, points,
                                         points + 3 * t.warp.n),
                         SRNF_OK);
        figure_below("points", compare_difference(3 * t.warp.n, points, r.points), 1e-12);
        figure_below("Jacobian", compare_difference(t.warp.n, points + 3 * t.warp.n, r.jacobian),
                     1e-11);
        srnf_free(points);
        srnf_registration_clear(&rigid);
        srnf_registration_clear(&r);
    }
    close_bench(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gradient_agrees_with_differences),
        cmocka_unit_test(matrix_is_that_of_the_residual),
        cmocka_unit_test(tangent_is_the_matrix),
        cmocka_unit_test(warps_keep_the_area_of_the_sphere),
        cmocka_unit_test(action_is_an_isometry),
        cmocka_unit_test(inverse_chain_undoes),
        cmocka_unit_test(chain_replays_the_result),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

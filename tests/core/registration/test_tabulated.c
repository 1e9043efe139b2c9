/*
 * test_tabulated.c - every piece of registration by tables against the same piece computed
 * directly: the moving field and its derivatives, steps, objective, gradient, Gauss-Newton matrix,
 * solutions, rotations; for SRNFs and square-root maps, next to the poles too. And chains of many
 * steps as one.
 */
#include "registrations.h"
#include "registration/tournament.h"

#define DEGREE 15
#define FIELDS 8

struct bench {
    struct shapes_surface a, b;
    double *memory;
    struct problem problem;
    struct moving moving;
    struct warp warp;
    struct samples samples;
    struct level level;
    double displacement[9];
    /* the same by tables */
    struct tabulated_target target;
    struct tabulated_moving table;
    struct tabulated_problem tabulated;
    struct cloud cloud;
};

/* Points as the warp left them, put into the cloud. */
static void copy_points(struct bench *t)
{
    for (size_t i = 0; i < t->cloud.n; i++) {
        size_t at = i < t->warp.n ? i : t->warp.n - 1;

        for (size_t c = 0; c < 3; c++) {
            t->cloud.point[c][i] = t->warp.points[3 * at + c];
        }
        t->cloud.jacobian[i] = t->warp.jacobian[at];
    }
}

static void open_bench(struct bench *t, enum srnf_representation representation, size_t order,
                       double fineness, bool free_rotation)
{
    const struct penalty penalty = {0.003, 0.01};
    struct test_random random = test_random_seed(97);
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
    t->moving.representation = representation;
    t->problem =
        (struct problem){.target = {.n = n,
                                    .points = t->memory,
                                    .weight = t->memory + 3 * n,
                                    .q = t->memory + 4 * n,
                                    .norm2 = srnf_inner_product(t->a.grid, t->a.q, t->a.q)},
                         .moving = &t->moving,
                         .penalty = penalty,
                         .free_rotation = free_rotation};
    registrations_warp(&random, 0.5, &chain);
    assert_int_equal(warp_create(&t->warp, &t->problem.target), SRNF_OK);
    assert_int_equal(warp_replay(&t->warp, &t->problem.target, &chain, NULL), SRNF_OK);
    srnf_warp_clear(&chain);
    assert_int_equal(samples_create(&t->samples, n), SRNF_OK);
    assert_int_equal(level_create(&t->level, &t->problem, FIELDS), SRNF_OK);
    registration_objective(&t->problem, &t->warp, &t->samples, t->displacement);
    assert_int_equal(tabulated_target_create(&t->target, &t->problem.target), SRNF_OK);
    assert_int_equal(tabulated_moving_create(&t->table, representation, DEGREE, t->b.f, DEGREE,
                                             order, fineness, NULL),
                     SRNF_OK);
    t->tabulated = (struct tabulated_problem){&t->target, &t->table, penalty, free_rotation};
    assert_int_equal(cloud_create(&t->cloud, t->target.n), SRNF_OK);
    cloud_rotate(&t->cloud, &t->target, (const double[]){1, 0, 0, 0, 1, 0, 0, 0, 1});
    copy_points(t);
    cloud_evaluate(&t->table, &t->cloud);
    cloud_measure(&t->tabulated, &t->cloud);
}

static void close_bench(struct bench *t)
{
    cloud_clear(&t->cloud);
    tabulated_moving_clear(&t->table);
    tabulated_target_clear(&t->target);
    level_clear(&t->level);
    samples_clear(&t->samples);
    warp_clear(&t->warp);
    moving_clear(&t->moving);
    srnf_free(t->memory);
    shapes_close(&t->a);
    shapes_close(&t->b);
}

/* Largest difference of an array of the cloud and one of the samples, relative to the largest. */
static double field_error(const struct bench *t, double *const tabulated[3], const double *direct)
{
    double most = 0.0;
    double error = 0.0;

    for (size_t i = 0; i < 3 * t->warp.n; i++) {
        most = compare_max(most, fabs(direct[i]));
        error = compare_max(error, fabs(direct[i] - tabulated[i % 3][i / 3]));
    }
    return error / most;
}

static void moving_field_is_the_direct_one(void **state)
{
    static const struct {
        size_t order;
        double fineness, value, derivative;
    } cases[] = {{4, 2.0, 1e-3, 1e-2}, {6, 5.0 / 3.0, 3e-5, 3e-4}, {8, 3.0, 1e-8, 1e-7}};

    (void)state;
    for (size_t k = 0; k < 6; k++) {
        struct bench t;
        enum srnf_representation what = k % 2 ? SRNF_REPRESENTATION_SRM : SRNF_REPRESENTATION_SRNF;

        open_bench(&t, what, cases[k / 2].order, cases[k / 2].fineness, true);
        figure_below("q", field_error(&t, t.cloud.q, t.samples.q), cases[k / 2].value);
        figure_below("q_1", field_error(&t, t.cloud.q_1, t.samples.q_1), cases[k / 2].derivative);
        figure_below("q_2", field_error(&t, t.cloud.q_2, t.samples.q_2), cases[k / 2].derivative);
        close_bench(&t);
    }
}

/* Points at 1e-16 to .1 from both poles, and on them. */
static void poles_are_points_like_others(void **state)
{
    enum { POINTS = 4 * 18 };
    struct bench t;
    struct samples direct;
    struct cloud cloud;
    double points[3 * POINTS];

    (void)state;
    open_bench(&t, SRNF_REPRESENTATION_SRNF, 8, 3.0, true);
    assert_int_equal(samples_create(&direct, POINTS), SRNF_OK);
    assert_int_equal(cloud_create(&cloud, POINTS), SRNF_OK);
    for (size_t i = 0; i < POINTS; i++) {
        double theta = i / 4 == 17 ? 0.0 : pow(10.0, -(double)(i / 4));
        double phi = i / 4 == 17 ? 0.0 : 1.3 * (double)(i % 4);

        points[3 * i] = sin(theta) * cos(phi);
        points[3 * i + 1] = sin(theta) * sin(phi);
        points[3 * i + 2] = i % 2 ? -cos(theta) : cos(theta);
        for (size_t c = 0; c < 3; c++) {
            cloud.point[c][i] = points[3 * i + c];
        }
    }
    moving_evaluate(&t.moving, points, &direct);
    cloud_evaluate(&t.table, &cloud);
    t.warp.n = POINTS;
    figure_below("q", field_error(&t, cloud.q, direct.q), 3e-8);
    figure_below("q_1", field_error(&t, cloud.q_1, direct.q_1), 1e-6);
    figure_below("q_2", field_error(&t, cloud.q_2, direct.q_2), 1e-6);
    cloud_clear(&cloud);
    samples_clear(&direct);
    close_bench(&t);
}

static void random_step(double size, double *unknowns, struct bench *t, double *potentials)
{
    struct test_random random = test_random_seed(98);

    for (size_t i = 0; i < registration_unknowns(FIELDS); i++) {
        unknowns[i] = size * test_random_normal(&random);
    }
    registration_potentials(&t->level.fields, unknowns, potentials);
}

static void steps_are_the_direct_ones(void **state)
{
    static const struct {
        size_t order, rows;
        double point;
    } cases[] = {{4, 24, 1e-3}, {6, 32, 3e-5}, {8, 40, 1e-6}, {8, 80, 1e-8}};
    double unknowns[2 * (FIELDS + 1) * (FIELDS + 1) + 3];
    double potentials[2 * (FIELDS + 1) * (FIELDS + 1)];

    (void)state;
    for (size_t k = 0; k < 4; k++) {
        struct bench t;
        struct tabulated_fields fields;
        struct cloud after;
        double *scratch;
        double least, error = 0.0, jacobian = 0.0;

        open_bench(&t, SRNF_REPRESENTATION_SRNF, 6, 2.0, true);
        random_step(0.02, unknowns, &t, potentials);
        scratch = shapes_doubles((FIELDS_SCRATCH + 4) * t.warp.n);
        least = fields_apply(&t.level.fields, potentials, t.warp.n, t.warp.points, t.warp.jacobian,
                             scratch, scratch + 3 * t.warp.n, scratch + 4 * t.warp.n);
        assert_int_equal(tabulated_fields_create(&fields, FIELDS, cases[k].order, cases[k].rows),
                         SRNF_OK);
        assert_int_equal(cloud_create(&after, t.cloud.n), SRNF_OK);
        tabulated_fields_fill(&fields, potentials);
        figure_below("least Jacobian", fabs(cloud_move(&fields.table, &t.cloud, &after) - least),
                     20.0 * cases[k].point);
        for (size_t i = 0; i < t.warp.n; i++) {
            for (size_t c = 0; c < 3; c++) {
                error = compare_max(error, fabs(after.point[c][i] - scratch[3 * i + c]));
            }
            jacobian =
                compare_max(jacobian, fabs(after.jacobian[i] / scratch[3 * t.warp.n + i] - 1.0));
        }
        figure_below("points", error, cases[k].point);
        figure_below("Jacobians", jacobian, 20.0 * cases[k].point);
        cloud_clear(&after);
        tabulated_fields_clear(&fields);
        srnf_free(scratch);
        close_bench(&t);
    }
}

/* Points all over the sphere, and next to the poles. */
static void scatter(struct test_random *random, size_t n, double *points)
{
    for (size_t i = 0; i < n; i++) {
        double square = 0.0;

        for (size_t c = 0; c < 3; c++) {
            points[3 * i + c] = test_random_normal(random);
            points[3 * i + c] *= c < 2 && i % 10 == 0 ? pow(10.0, -(double)(i / 10 % 18)) : 1.0;
            square += points[3 * i + c] * points[3 * i + c];
        }
        for (size_t c = 0; c < 3; c++) {
            points[3 * i + c] /= sqrt(square);
        }
    }
}

/* Largest differences of points and Jacobians that tables moved and those moved directly. */
static void fine_errors(size_t degree, bool inverse, double *apart, double *areas)
{
    enum { POINTS = 2001 };
    struct test_random random = test_random_seed(980 + degree);
    size_t count = srnf_coefficient_count(degree);
    double *potentials = shapes_doubles(2 * count + (FIELDS_INVERSE + 8) * POINTS);
    double *points = potentials + 2 * count;
    double *moved = points + 4 * POINTS;
    struct fine_steps fine;

    for (size_t l = 1; l <= degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            potentials[i] = 0.1 * test_random_normal(&random) / pow((double)l, 3.0);
            potentials[count + i] = 0.1 * test_random_normal(&random) / pow((double)l, 3.0);
        }
    }
    scatter(&random, POINTS, points);
    for (size_t i = 0; i < POINTS; i++) {
        points[3 * POINTS + i] = 1.0;
    }
    memcpy(moved, points, 4 * POINTS * sizeof *moved);
    assert_int_equal(fine_steps_create(&fine, degree, NULL), SRNF_OK);
    assert_int_equal(
        fine_steps_apply(&fine, potentials, inverse, NULL, POINTS, moved, moved + 3 * POINTS),
        SRNF_OK);
    if (inverse) {
        assert_int_equal(fields_apply_inverse(&fine.direct, potentials, POINTS, points,
                                              points + 3 * POINTS, moved + 4 * POINTS),
                         SRNF_OK);
    } else {
        assert_true(fields_apply(&fine.direct, potentials, POINTS, points, points + 3 * POINTS,
                                 points, points + 3 * POINTS, moved + 4 * POINTS) > 0.0);
    }
    *apart = compare_difference(3 * POINTS, moved, points);
    *areas = compare_difference(POINTS, moved + 3 * POINTS, points + 3 * POINTS);
    fine_steps_clear(&fine);
    srnf_free(potentials);
}

static void fine_steps_are_the_direct_ones(void **state)
{
    static const size_t degrees[] = {2, 5, 8, 12, 20, 33};

    (void)state;
    for (size_t k = 0; k < 2 * sizeof degrees / sizeof degrees[0]; k++) {
        double apart, areas;

        fine_errors(degrees[k / 2], k % 2, &apart, &areas);
        figure_below("points", apart, 1e-13);
        figure_below("Jacobians", areas, 1e-11);
    }
}

/* A step that leads beyond half a great circle is none. */
static void long_steps_are_refused(void **state)
{
    double unknowns[2 * (FIELDS + 1) * (FIELDS + 1) + 3] = {0};
    double potentials[2 * (FIELDS + 1) * (FIELDS + 1)];
    struct tabulated_fields fields;
    struct bench t;
    struct cloud after;

    (void)state;
    open_bench(&t, SRNF_REPRESENTATION_SRNF, 6, 2.0, true);
    unknowns[1] = 20.0;
    registration_potentials(&t.level.fields, unknowns, potentials);
    assert_int_equal(tabulated_fields_create(&fields, FIELDS, 6, 32), SRNF_OK);
    assert_int_equal(cloud_create(&after, t.cloud.n), SRNF_OK);
    tabulated_fields_fill(&fields, potentials);
    assert_true(cloud_move(&fields.table, &t.cloud, &after) < 0.0);
    cloud_clear(&after);
    tabulated_fields_clear(&fields);
    close_bench(&t);
}

static void objective_and_gradient_are_the_direct_ones(void **state)
{
    (void)state;
    for (size_t k = 0; k < 4; k++) {
        size_t unknowns = registration_unknowns(FIELDS);
        double *direct = shapes_doubles(2 * unknowns);
        double *rhs = direct + unknowns;
        struct tabulated_fields fields;
        struct bench t;
        double torque[3];
        double curvature, error = 0.0, most = 0.0;

        open_bench(&t, k & 1 ? SRNF_REPRESENTATION_SRM : SRNF_REPRESENTATION_SRNF, 8, 3.0, k & 2);
        figure_below("energy", fabs(t.cloud.energy / t.warp.energy - 1.0), 1e-7);
        figure_below("objective", fabs(t.cloud.objective / t.warp.objective - 1.0), 1e-7);
        assert_int_equal(registration_gradient(&t.problem, &t.level, &t.warp, &t.samples,
                                               t.displacement, direct, &curvature),
                         SRNF_OK);
        assert_int_equal(tabulated_fields_create(&fields, FIELDS, 8, 56), SRNF_OK);
        figure_below(
            "curvature",
            fabs(cloud_load(&t.tabulated, &t.cloud, &fields.table, torque) / curvature - 1.0),
            1e-12);
        tabulated_fields_transpose(&fields, torque, rhs);
        for (size_t i = 0; i < unknowns; i++) {
            most = compare_max(most, fabs(direct[i]));
            error = compare_max(error, fabs(rhs[i] - direct[i]));
        }
        figure_below("gradient", error / most, 1e-6);
        tabulated_fields_clear(&fields);
        srnf_free(direct);
        close_bench(&t);
    }
}

/* A warp that folds the sphere over, or points that are no numbers, must not look like a match. */
static void folded_points_never_win(void **state)
{
    const double values[] = {-1.0, NAN};
    (void)state;

    for (size_t i = 0; i < 2; i++) {
        struct bench t;

        open_bench(&t, SRNF_REPRESENTATION_SRNF, 6, 4.0, true);
        cloud_evaluate(&t.table, &t.cloud);
        t.cloud.jacobian[5] = values[i];
        cloud_measure(&t.tabulated, &t.cloud);
        assert_true(t.cloud.energy == INFINITY && t.cloud.objective == INFINITY);
        close_bench(&t);
    }
}

/* Fields that are no numbers have no best rotation. */
static void no_rotation_is_no_start(void **state)
{
    double first[3 * SCREEN_COUNT] = {NAN}, second[3 * SCREEN_COUNT] = {1.0};
    struct start_rotation starts[4];
    int status;
    (void)state;

    assert_int_equal(registration_screen(first, second, 4, starts, &status), 0);
    assert_int_equal(status, SRNF_ENUMERIC);
}

static void matrix_and_solutions_are_the_direct_ones(void **state)
{
    size_t k = registration_unknowns(FIELDS);
    double *memory = shapes_doubles(k * k + 4 * k);
    double *rhs = memory + k * k;
    double *step = rhs + k;
    struct test_random random = test_random_seed(99);
    struct tabulated_level level;
    struct bench t;
    double error = 0.0, most = 0.0, expected, residual = 0.0, size = 0.0;

    (void)state;
    open_bench(&t, SRNF_REPRESENTATION_SRNF, 6, 2.0, true);
    assert_int_equal(tabulated_matrix(&t.table, FIELDS, NULL, memory), SRNF_OK);
    assert_int_equal(tabulated_level_create(&level, FIELDS, FIELDS, memory, t.problem.target.norm2,
                                            t.problem.penalty.displacement, true),
                     SRNF_OK);
    memcpy(memory, level.matrix, k * k * sizeof *memory);
    for (size_t j = 0; j < k; j++) {
        for (size_t i = j; i < k; i++) {
            most = compare_max(most, fabs(t.level.matrix[j * k + i]));
            error = compare_max(error, fabs(memory[j * k + i] - t.level.matrix[j * k + i]));
        }
    }
    figure_below("matrix", error / most, 2e-3); /* its grid is coarser */
    test_random_normals(&random, k, rhs);
    for (size_t round = 0; round < 40; round++) { /* more rungs than slots, and back again */
        double lambda = pow(1.25, (double)(round < 20 ? round : 40 - round)) * 1e-3;

        assert_true(tabulated_level_solve(&level, lambda, 0.01, rhs, step, &expected));
    }
    /* (H + s eigen) step - rhs, s on the rung: recovered from the first component. */
    {
        double s = 0.0;

        for (size_t i = 0; i < k; i++) {
            double sum = -rhs[i];

            for (size_t j = 0; j < k; j++) {
                sum += memory[i < j ? i * k + j : j * k + i] * step[j];
            }
            s = i == 0 ? -sum / (level.eigen[0] * step[0]) : s;
            residual = compare_max(residual, fabs(sum + s * level.eigen[i] * step[i]));
            size = compare_max(size, fabs(rhs[i]));
        }
        figure_below("rung", fabs(log(s / (1e-3 * 1.25 * level.scale + 0.01))), 0.12);
    }
    figure_below("residual", residual / size, 1e-9);
    assert_true(expected > 0.0);
    tabulated_level_clear(&level);
    srnf_free(memory);
    close_bench(&t);
}

static void closest_rotations_are_those_of_the_decomposition(void **state)
{
    struct test_random random = test_random_seed(100);

    (void)state;
    for (size_t k = 0; k < 2000; k++) {
        double b[9], direct[9], quick[9];
        double trace;

        test_random_normals(&random, 9, b);
        if (k % 4 == 1) { /* nearly a rotation */
            shapes_random_rotation(&random, b);
        } else if (k % 4 == 2) { /* rank 1 and a little */
            for (size_t i = 3; i < 9; i++) {
                b[i] = b[i % 3] * (double)(i / 3) + 1e-3 * b[i];
            }
        }
        trace = registration_closest_rotation(b, direct);
        assert_true(fabs(tabulated_closest_rotation(b, quick) - trace) <= 1e-12 * (1.0 + trace));
        assert_true(compare_difference(9, quick, direct) <= 1e-6);
        trace = 0.0;
        for (size_t i = 0; i < 9; i++) {
            trace += quick[i] * b[i] - direct[i] * b[i];
        }
        assert_true(fabs(trace) <= 1e-10);
    }
    {
        const double zero[9] = {0.0};
        double rotation[9];

        assert_true(tabulated_closest_rotation(zero, rotation) == 0.0);
        assert_true(rotation[0] == 1.0 && rotation[1] == 0.0);
    }
    /* LAPACK's decomposition of a matrix with an infinite number does not end. */
    for (size_t i = 0; i < 9; i++) {
        double b[9] = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0};
        double rotation[9];

        b[i] = INFINITY;
        assert_true(registration_closest_rotation(b, rotation) == 0.0);
        assert_true(rotation[0] == 1.0 && rotation[1] == 0.0);
    }
}

/* A surface pulled back along gamma, at the points of delta, is the surface at those of gamma o
   delta: energy, penalties, and their derivative, here against differences. */
static void pulled_surfaces_are_those_at_the_warped_points(void **state)
{
    (void)state;
    for (size_t k = 0; k < 4; k++) {
        enum srnf_representation representation =
            k & 1 ? SRNF_REPRESENTATION_SRM : SRNF_REPRESENTATION_SRNF;
        const double h = 1e-5;
        double unknowns[2 * (FIELDS + 1) * (FIELDS + 1) + 3];
        double potentials[2 * (FIELDS + 1) * (FIELDS + 1)];
        double rhs[2 * (FIELDS + 1) * (FIELDS + 1) + 3];
        double torque[3], objective[2], slope, predicted = 0.0;
        struct srnf_warp gamma = {0};
        struct tabulated_moving pulled;
        struct tabulated_problem problem;
        struct tabulated_fields fields;
        struct cloud cloud;
        struct bench t;

        open_bench(&t, representation, 8, 3.0, k & 2);
        random_step(0.01, unknowns, &t, potentials);
        assert_int_equal(warp_append(&gamma, SRNF_WARP_ROTATION, 0, t.warp.chain.links[0].values),
                         SRNF_OK);
        assert_int_equal(warp_append(&gamma, SRNF_WARP_EXP, FIELDS, potentials), SRNF_OK);
        assert_int_equal(tabulated_moving_pull(&pulled, &t.table, &gamma, NULL, NULL), SRNF_OK);
        problem = t.tabulated;
        problem.moving = &pulled;
        assert_int_equal(cloud_create(&cloud, t.cloud.n), SRNF_OK);
        memcpy(cloud.memory, t.cloud.memory, CLOUD_ARRAYS * t.cloud.n * sizeof(double));
        memcpy(cloud.rotation, t.cloud.rotation, sizeof cloud.rotation);
        memcpy(cloud.displacement, t.cloud.displacement, sizeof cloud.displacement);
        cloud_evaluate(&pulled, &cloud);
        cloud_measure(&problem, &cloud);
        assert_int_equal(cloud_follow(&t.cloud, &gamma, &follow_table, NULL, NULL), SRNF_OK);
        cloud_evaluate(&t.table, &t.cloud);
        cloud_measure(&t.tabulated, &t.cloud);
        figure_below("energy", fabs(cloud.energy / t.cloud.energy - 1.0), 1e-6);
        figure_below("objective", fabs(cloud.objective / t.cloud.objective - 1.0), 1e-6);
        assert_int_equal(tabulated_fields_create(&fields, FIELDS, 8, 56), SRNF_OK);
        (void)cloud_load(&problem, &cloud, &fields.table, torque);
        tabulated_fields_transpose(&fields, torque, rhs);
        for (size_t side = 0; side < 2; side++) {
            random_step(side ? -h : h, unknowns, &t, potentials);
            tabulated_fields_fill(&fields, potentials);
            assert_true(cloud_move(&fields.table, &cloud, &t.cloud) > 0.0);
            cloud_evaluate(&pulled, &t.cloud);
            cloud_measure(&problem, &t.cloud);
            objective[side] = t.cloud.objective;
        }
        for (size_t i = 0; i + 3 < registration_unknowns(FIELDS); i++) {
            predicted += 2.0 * rhs[i] * unknowns[i]; /* unknowns are those of -h */
        }
        slope = objective[0] - objective[1];
        printf("# difference %.6e, derivative %.6e\n", slope, 2.0 * predicted);
        figure_below("derivative", fabs(slope / (2.0 * predicted) - 1.0), 1e-3);
        cloud_clear(&cloud);
        tabulated_fields_clear(&fields);
        tabulated_moving_clear(&pulled);
        srnf_warp_clear(&gamma);
        close_bench(&t);
    }
}

/* The steps end where the direct ones end. */
static void optimum_is_the_direct_one(void **state)
{
    const struct schedule schedule = {200, 1e-4};
    struct tabulated_fields fields;
    struct tabulated_level level;
    struct bench t;
    struct cloud spare;
    enum srnf_register_stop stopped;
    size_t steps[2] = {0, 0};

    (void)state;
    open_bench(&t, SRNF_REPRESENTATION_SRNF, 6, 5.0 / 3.0, true);
    assert_int_equal(registration_optimize(&t.problem, &t.level, &schedule, NULL, &t.warp,
                                           &t.samples, &steps[0]),
                     SRNF_OK);
    assert_int_equal(tabulated_fields_create(&fields, FIELDS, 8, 40), SRNF_OK);
    assert_int_equal(tabulated_level_create(&level, FIELDS, FIELDS, t.level.matrix, 1.0, 0.0, true),
                     SRNF_OK);
    assert_int_equal(cloud_create(&spare, t.cloud.n), SRNF_OK);
    {
        struct tabulated_optimizer o = {&t.tabulated, &fields, &level, &spare,
                                        NULL,         NULL,    NULL,   0.0};
        struct srnf_warp chain = {0};

        assert_int_equal(tabulated_optimize(&o, &schedule, &t.cloud, &chain, &stopped, &steps[1]),
                         SRNF_OK);
        assert_true(chain.n_links > 3);
        srnf_warp_clear(&chain);
    }
    printf("# %zu and %zu steps\n", steps[0], steps[1]);
    figure_below("objective", fabs(t.cloud.objective / t.warp.objective - 1.0), 1e-2);
    cloud_clear(&spare);
    tabulated_level_clear(&level);
    tabulated_fields_clear(&fields);
    close_bench(&t);
}

/* The chain of the bench, with a rotation before it or the identity, and some steps more. */
static void many_steps(struct bench *t, bool still, size_t steps, double size,
                       struct srnf_warp *chain)
{
    static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double unknowns[2 * (FIELDS + 1) * (FIELDS + 1) + 3];
    double potentials[2 * (FIELDS + 1) * (FIELDS + 1)];

    *chain = (struct srnf_warp){0};
    assert_int_equal(
        warp_append(chain, SRNF_WARP_ROTATION, 0, still ? identity : t->warp.chain.links[0].values),
        SRNF_OK);
    assert_int_equal(warp_append(chain, SRNF_WARP_EXP, t->warp.chain.links[1].degree,
                                 t->warp.chain.links[1].values),
                     SRNF_OK);
    for (size_t k = 0; k < steps; k++) {
        random_step(size, unknowns, t, potentials);
        assert_int_equal(warp_append(chain, SRNF_WARP_EXP, FIELDS, potentials), SRNF_OK);
    }
    cloud_rotate(&t->cloud, &t->target, identity);
    assert_int_equal(cloud_follow(&t->cloud, chain, &follow_table, NULL, NULL), SRNF_OK);
    cloud_evaluate(&t->table, &t->cloud);
    cloud_measure(&t->tabulated, &t->cloud);
}

/* Largest distance of two chains at n points, and of the second followed there and back. */
static void compare_chains(const struct srnf_warp *a, const struct srnf_warp *b, size_t n,
                           const double *points, double *apart, double *back)
{
    double *memory = shapes_doubles(9 * n);
    struct srnf_warp inverse = {0};

    assert_int_equal(srnf_warp_apply(a, n, points, memory, NULL), SRNF_OK);
    assert_int_equal(srnf_warp_apply(b, n, points, memory + 3 * n, NULL), SRNF_OK);
    assert_int_equal(warp_invert(b, &inverse), SRNF_OK);
    assert_int_equal(srnf_warp_apply(&inverse, n, memory + 3 * n, memory + 6 * n, NULL), SRNF_OK);
    *apart = *back = 0.0;
    for (size_t i = 0; i < 3 * n; i++) {
        *apart = compare_max(*apart, fabs(memory[i] - memory[3 * n + i]));
        *back = compare_max(*back, fabs(points[i] - memory[6 * n + i]));
    }
    srnf_warp_clear(&inverse);
    srnf_free(memory);
}

/* A chain of many steps, and what is left of it once it was refitted. */
struct refit {
    struct bench bench;
    struct nodes_of grid;
    struct cloud spare;
    struct srnf_warp before, chain;
    double objective;
};

static void open_refit(struct refit *r, int still, size_t steps, double step)
{
    struct bench *t = &r->bench;

    open_bench(t, SRNF_REPRESENTATION_SRNF, 8, 3.0, !still);
    r->grid = (struct nodes_of){t->a.grid->kind, t->a.grid->n_theta, t->a.grid->n_phi};
    assert_int_equal(cloud_create(&r->spare, t->cloud.n), SRNF_OK);
    many_steps(t, still, steps, step, &r->before);
    many_steps(t, still, steps, step, &r->chain);
    r->objective = t->cloud.objective;
}

static void refit(struct refit *r, double worse, size_t links)
{
    const struct refit_terms terms = {20, worse, &follow_table};
    struct bench *t = &r->bench;

    assert_int_equal(
        warp_refit(&t->tabulated, &r->grid, &terms, NULL, &t->cloud, &r->spare, &r->chain),
        SRNF_OK);
    assert_int_equal(r->chain.n_links, links);
}

/* The chain is near to what it was, by the objective and by where it leads, and has an inverse. */
static void close_refit(struct refit *r, int still, double worse, double far)
{
    struct bench *t = &r->bench;
    double apart, back;

    assert_int_equal(warp_is_still(&r->chain), still);
    figure_below("objective", fabs(t->cloud.objective / r->objective - 1.0), worse);
    compare_chains(&r->before, &r->chain, t->warp.n, t->problem.target.points, &apart, &back);
    figure_below("apart", apart, far);
    figure_below("there and back", back, 1e-10);
    srnf_warp_clear(&r->before);
    srnf_warp_clear(&r->chain);
    cloud_clear(&r->spare);
    close_bench(t);
}

static void many_steps_become_one(void **state)
{
    (void)state;
    for (int still = 0; still < 2; still++) {
        struct refit r;

        open_refit(&r, still, 3, 0.01);
        refit(&r, -1.0, 5); /* none is better than it was by a whole */
        assert_true(r.bench.cloud.objective == r.objective);
        refit(&r, 0.01, 2);
        assert_int_equal(r.chain.links[still].kind, SRNF_WARP_EXP);
        close_refit(&r, still, 0.01, 0.02);
    }
}

/* Where one step would fold, each half of the chain is one. */
static void steps_too_long_for_one_become_two(void **state)
{
    (void)state;
    for (int still = 0; still < 2; still++) {
        struct refit r;

        open_refit(&r, still, 12, 0.003);
        refit(&r, 0.02, still ? 3 : 4);
        close_refit(&r, still, 0.02, 0.05);
    }
}

/* The inverse of a quadratic's matrix, as far as pairs of steps and changes tell: what the last
   step changed leads to that step, whatever stands for the rest. */
static void pairs_of_steps_are_met(void **state)
{
    enum { N = 12, STEPS = 8 };
    struct test_random random = test_random_seed(5);
    const double nothing[N] = {0.0};
    double step[N], change[N], ahead[N], out[N];
    double worst = 0.0, size = 0.0;
    struct secant secant;

    (void)state;
    assert_int_equal(secant_create(&secant, N), SRNF_OK);
    for (size_t k = 0; k < STEPS; k++) {
        for (size_t i = 0; i < N; i++) {
            step[i] = test_random_normal(&random);
            change[i] = (1.0 + (double)i) * step[i];
        }
        secant_add(&secant, step, change, nothing);
    }
    assert_int_equal(secant.count, SECANT_PAIRS);
    memcpy(out, change, sizeof out);
    secant_before(&secant, out);
    linear_scale(N, 0.25, out);
    secant_after(&secant, out);
    for (size_t i = 0; i < N; i++) {
        worst = compare_max(worst, fabs(out[i] - step[i]));
        size = compare_max(size, fabs(step[i]));
        ahead[i] = -change[i];
    }
    figure_below("last pair", worst / size, 1e-12);
    secant_forget(&secant);
    secant_add(&secant, step, ahead, nothing); /* not convex */
    assert_int_equal(secant.count, 0);
    secant_clear(&secant);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(moving_field_is_the_direct_one),
        cmocka_unit_test(poles_are_points_like_others),
        cmocka_unit_test(steps_are_the_direct_ones),
        cmocka_unit_test(fine_steps_are_the_direct_ones),
        cmocka_unit_test(long_steps_are_refused),
        cmocka_unit_test(objective_and_gradient_are_the_direct_ones),
        cmocka_unit_test(folded_points_never_win),
        cmocka_unit_test(no_rotation_is_no_start),
        cmocka_unit_test(matrix_and_solutions_are_the_direct_ones),
        cmocka_unit_test(closest_rotations_are_those_of_the_decomposition),
        cmocka_unit_test(pulled_surfaces_are_those_at_the_warped_points),
        cmocka_unit_test(optimum_is_the_direct_one),
        cmocka_unit_test(many_steps_become_one),
        cmocka_unit_test(steps_too_long_for_one_become_two),
        cmocka_unit_test(pairs_of_steps_are_met),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

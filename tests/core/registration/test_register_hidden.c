/*
 * test_register_hidden.c - no warp hides a part of the moving surface between the nodes: the
 * integral of its Jacobian is the area of the sphere, on finer grids too, of pairs that differ
 * much; and the mean of a group of two kinds is told of as it was found. Stiff penalties do
 * not lose the rigid start, and whoever goes on from a registration never loses what it has.
 */
#include "core/stats/group.h"
#include "registration/registration.h"

#define DEGREE 8

/* Sum of the Jacobian over a grid of that many rows, relative to the sphere's area, less 1. */
static double area_error(const struct srnf_warp *chain, size_t rows)
{
    struct srnf_sht *sht;
    const struct srnf_grid *grid;
    double *nodes, sum = 0.0;
    size_t n;

    assert_int_equal(srnf_sht_create(&sht, 4, SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows), SRNF_OK);
    grid = srnf_sht_grid(sht);
    n = grid->n_theta * grid->n_phi;
    nodes = shapes_doubles(8 * n);
    registration_nodes(grid, nodes, nodes + 3 * n);
    assert_int_equal(warp_apply(chain, NULL, n, nodes, nodes + 4 * n, nodes + 7 * n), SRNF_OK);
    for (size_t k = 0; k < n; k++) {
        sum += nodes[3 * n + k] * nodes[7 * n + k];
    }
    srnf_free(nodes);
    srnf_sht_destroy(sht);
    return fabs(sum / (4.0 * SRNF_PI) - 1.0);
}

static void open_structure(struct shapes_surface *s, const char *name, size_t degree)
{
    shapes_open(s, degree);
    assert_true(shapes_fill_structure(s, name, SRNF_PARAMETERIZATION_AREA));
    shapes_update(s);
}

static void warps_keep_all_area(void **state)
{
    static const char *const pairs[][2] = {
        {"L_thalamus", "L_hippocampus"}, {"R_thalamus", "L_putamen"}, {"L_thalamus", "R_thalamus"}};
    (void)state;

    for (size_t k = 0; k < sizeof pairs / sizeof pairs[0]; k++) {
        struct srnf_register_options options = srnf_register_options_defaults();
        struct srnf_registration r;
        struct shapes_surface a, b;
        double coarse, fine;

        open_structure(&a, pairs[k][0], DEGREE);
        open_structure(&b, pairs[k][1], DEGREE);
        assert_int_equal(srnf_register(a.sht, a.f, a.q, b.f, &options, NULL, NULL, &r, NULL),
                         SRNF_OK);
        coarse = area_error(&r.warp, 48);
        fine = area_error(&r.warp, 96);
        printf("# %s, %s: distance %.4f, of the area %.1e and %.1e\n", pairs[k][0], pairs[k][1],
               r.distance, coarse, fine);
        assert_true(coarse < 0.015);
        assert_true(fine < 0.01);
        srnf_registration_clear(&r);
        shapes_close(&a);
        shapes_close(&b);
    }
}

/* Of the mean's loop and of what is handed over, on two grids: they differ by quadrature alone. */
static void means_of_two_kinds_are_as_found(void **state)
{
    static const char *const names[] = {"L_thalamus", "R_thalamus", "L_hippocampus",
                                        "R_hippocampus"};
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean;
    struct group g;
    double sum = 0.0, variance;
    (void)state;

    group_open(&g, DEGREE, 4);
    for (size_t i = 0; i < g.n; i++) {
        struct shapes_surface s;

        open_structure(&s, names[i], DEGREE);
        memcpy(g.f[i], s.f, g.count * sizeof(double));
        shapes_close(&s);
    }
    options.registration = &registration;
    options.max_iterations = 6;
    assert_true(srnf_karcher_mean(g.sht, g.n, g.surfaces, &options, NULL, &mean, NULL) >= 0);
    variance = mean.history[mean.iterations - 1].variance;
    for (size_t i = 0; i < g.n; i++) {
        sum += mean.distances[i] * mean.distances[i] / (double)g.n;
    }
    printf("# variance %.5f, of what is handed over %.5f\n", variance, sum);
    assert_true(fabs(sum / variance - 1.0) < 0.15);
    srnf_mean_clear(&mean);
    group_close(&g);
}

/* Stiff displacements hold what the screening has not refined. */
static void rigid_starts_are_not_lost(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r, rigid;
    struct shapes_surface a, b;
    (void)state;

    open_structure(&a, "L_thalamus", DEGREE);
    options.penalty_jacobian = options.penalty_displacement = 1000.0;
    for (size_t k = 0; k < 2; k++) {
        open_structure(&b, k ? "R_thalamus" : "L_thalamus", DEGREE);
        options.start = SRNF_START_TOURNAMENT;
        assert_int_equal(srnf_register(a.sht, a.f, a.q, b.f, &options, NULL, NULL, &r, NULL),
                         SRNF_OK);
        options.start = SRNF_START_RIGID;
        assert_int_equal(srnf_register(a.sht, a.f, a.q, b.f, &options, NULL, NULL, &rigid, NULL),
                         SRNF_OK);
        printf("# with stiff penalties %.5f, from the rigid start %.5f\n", r.distance,
               rigid.distance);
        assert_true(r.objective <= 1.001 * rigid.objective);
        assert_true(r.distance < (k ? 0.3 : 0.01));
        srnf_registration_clear(&r);
        srnf_registration_clear(&rigid);
        shapes_close(&b);
    }
    shapes_close(&a);
}

/* Warps so steep that the table of the pulled surface takes them for worse than they are. */
static void going_on_does_not_raise_the_objective(void **state)
{
    static const char *const pairs[][2] = {{"L_pallidum", "R_hippocampus"},
                                           {"L_thalamus", "L_hippocampus"}};
    struct srnf_register_options options = srnf_register_options_defaults();
    (void)state;

    for (size_t k = 0; k < sizeof pairs / sizeof pairs[0]; k++) {
        struct srnf_registration r, next;
        struct shapes_surface a, b;

        open_structure(&a, pairs[k][0], 15);
        open_structure(&b, pairs[k][1], 15);
        assert_int_equal(srnf_register(a.sht, a.f, a.q, b.f, &options, NULL, NULL, &r, NULL),
                         SRNF_OK);
        assert_int_equal(srnf_register(a.sht, a.f, a.q, b.f, &options, &r, NULL, &next, NULL),
                         SRNF_OK);
        printf("# %s, %s: objective %.5f, gone on %.5f\n", pairs[k][0], pairs[k][1], r.objective,
               next.objective);
        assert_true(next.objective <= 1.0001 * r.objective);
        srnf_registration_clear(&r);
        srnf_registration_clear(&next);
        shapes_close(&a);
        shapes_close(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(warps_keep_all_area),
        cmocka_unit_test(means_of_two_kinds_are_as_found),
        cmocka_unit_test(rigid_starts_are_not_lost),
        cmocka_unit_test(going_on_does_not_raise_the_objective),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

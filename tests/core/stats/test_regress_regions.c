/*
 * test_regress_regions.c - how often the region of confidence of a prediction of a linear model
 * holds what was planted, at all nodes together.
 */
#include "group.h"
#include "stats/regress.h"

#define NOISE_DEGREE 3
#define NOISE ((size_t)(NOISE_DEGREE + 1) * (NOISE_DEGREE + 1))

/* Places along the normal at one point of the line, where nothing is planted: whether the region
   of confidence holds 0 all over the sphere. */
static bool region_holds(const struct group *g, const double *sphere, const double *nodes,
                         uint64_t seed)
{
    enum { ROWS = 20 };
    const double at = 1.0;
    const struct srnf_regress_design design = {.columns = 1, .points = 1, .at = &at};
    struct test_random random = test_random_seed(seed);
    struct srnf_regression out = {0};
    size_t n = g->n;
    size_t size = 3 * g->points;
    double *given = shapes_doubles(n * size);
    double *off = shapes_doubles(g->points);
    double x[ROWS], mean = 0.0, spread = 0.0;
    struct regress_run run = {.sht = g->sht, .n = n, .points = g->points, .permutations = 1};
    bool holds = true;

    assert_true(n <= ROWS);
    run.bootstraps = 400;
    run.seed = seed;
    run.design = &design;
    run.values = x;
    run.q = given;
    run.vectors = shapes_doubles(n * size);
    run.embedded = run.no_surfaces = true;
    run.out = &out;
    test_random_normals(&random, n, x);
    for (size_t i = 0; i < n; i++) {
        double noise[3 * NOISE];

        test_random_normals(&random, 3 * NOISE, noise);
        assert_int_equal(srnf_harmonics_at_points(NOISE_DEGREE, 3, noise, g->points, nodes,
                                                  given + i * size, NULL),
                         SRNF_OK);
        mean += x[i] / (double)n;
    }
    memcpy(run.vectors, given, n * size * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        spread += (x[i] - mean) * (x[i] - mean);
    }
    for (size_t k = 0; k < n * size; k++) {
        size_t i = k / size, p = k % g->points, c = k % size / g->points;
        double weight = 1.0 / (double)n + (at - mean) * (x[i] - mean) / spread;

        off[p] += weight * given[k] * nodes[3 * p + c];
    }
    assert_int_equal(regress_compute(&run, sphere, NULL, NULL), SRNF_OK);
    for (size_t p = 0; p < g->points; p++) {
        holds = holds && fabs(off[p]) <= out.predicted[0].confidence[p] * run.embedding.root[p];
    }
    regress_close(&run);
    srnf_regression_clear(&out);
    srnf_free(given);
    srnf_free(off);
    return holds;
}

/* At all nodes together, with few subjects, whose spread at a node is not well known. */
static void regions_of_predictions_hold(void **state)
{
    enum { STUDIES = 60 };

    (void)state;
    figures_count_unsanitized();
    for (size_t n = 12; n <= 20; n += 8) {
        struct group g;
        size_t missed = 0;
        double *nodes, *r, *sphere;
        void *workspace;

        group_open(&g, 3, n);
        nodes = shapes_doubles(3 * g.points);
        r = shapes_doubles(3 * g.points);
        sphere = shapes_doubles(g.count);
        workspace = srnf_alloc(1, srnf_surface_workspace_size(g.sht));
        assert_non_null(workspace);
        stats_nodes(g.grid, nodes);
        for (size_t k = 0; k < 3 * g.points; k++) {
            r[k] = nodes[3 * (k % g.points) + k / g.points];
        }
        srnf_sht_analysis(g.sht, 3, r, sphere, workspace);
        for (size_t study = 0; study < STUDIES; study++) {
            missed += !region_holds(&g, sphere, nodes, 1000 * n + study);
        }
        printf("# predictions from %zu subjects: of %d regions %zu missed\n", n, STUDIES, missed);
        assert_in_range(missed, 0, 9); /* Binomial(60, .05): beyond with a chance of 1e-3 */
        srnf_free(workspace);
        srnf_free(sphere);
        srnf_free(r);
        srnf_free(nodes);
        group_close(&g);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(regions_of_predictions_hold),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

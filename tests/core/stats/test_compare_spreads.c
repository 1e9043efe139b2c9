/*
 * test_compare_spreads.c - how far the subjects of two groups scatter, and what that makes of p.
 */
#include "group.h"
#include "srnf/groups.h"

#define N ((size_t)40)

/* Ellipsoids with noise in three coefficients, of those in group 0 so many times as far. */
static void compare(size_t n_wide, double times, size_t n_covariates, struct srnf_comparison *out)
{
    struct srnf_compare_options options = srnf_compare_options_defaults();
    struct test_random random = test_random_seed(11);
    struct group g;
    int group[N];
    double covariate[N], *mean, *q;
    void *workspace;

    group_open(&g, 4, N);
    mean = shapes_doubles(g.count);
    q = shapes_doubles(N * 3 * g.points);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(g.sht));
    assert_non_null(workspace);
    test_random_normals(&random, N, covariate);
    for (size_t i = 0; i < N; i++) {
        double noise[3];

        group[i] = i >= n_wide;
        test_random_normals(&random, 3, noise);
        g.f[i][3] = 2.4;
        g.f[i][g.each + 1] = 2.0;
        g.f[i][2 * g.each + 2] = 1.6;
        for (size_t k = 0; k < 3; k++) {
            g.f[i][k * g.each + 6] = 0.03 * noise[k] * (i < n_wide ? times : 1.0);
        }
        srnf_field(g.sht, g.f[i], q + i * 3 * g.points, workspace);
        for (size_t k = 0; k < g.count; k++) {
            mean[k] += g.f[i][k] / (double)N;
        }
    }
    options.permutations = 9;
    assert_int_equal(srnf_compare_groups(g.sht, N, mean, q, group, n_covariates, covariate,
                                         &options, NULL, out, NULL),
                     SRNF_OK);
    srnf_free(workspace);
    srnf_free(mean);
    srnf_free(q);
    group_close(&g);
}

/* s^2 / n of either group over the same with one s for all. */
static void spreads_are_told(void **state)
{
    (void)state;
    for (size_t covariates = 0; covariates < 2; covariates++) {
        struct srnf_comparison even, few, many;

        compare(20, 1.0, covariates, &even);
        compare(8, 2.0, covariates, &few);
        compare(32, 2.0, covariates, &many);
        printf(
            "# spreads %.3f and %.3f, inflation %.2f; of few %.3f and %.3f, %.2f; of many %.3f and "
            "%.3f, %.2f\n",
            even.spread[0], even.spread[1], even.inflation, few.spread[0], few.spread[1],
            few.inflation, many.spread[0], many.spread[1], many.inflation);
        assert_true(even.spread[0] > 0.7 * even.spread[1] && even.spread[0] < 1.4 * even.spread[1]);
        assert_true(even.inflation > 0.95 && even.inflation < 1.05);
        assert_true(few.spread[0] > 1.4 * few.spread[1] && few.spread[0] < 2.8 * few.spread[1]);
        assert_true(few.inflation > 1.5 && few.inflation < 3.0);
        assert_true(many.inflation < 0.7 && many.inflation > 0.3);
        srnf_comparison_clear(&even);
        srnf_comparison_clear(&few);
        srnf_comparison_clear(&many);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spreads_are_told),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

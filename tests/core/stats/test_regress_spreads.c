/*
 * test_regress_spreads.c - groups of one mean whose subjects scatter unequally: shares of the
 * variance are no surer of a difference than their test may be.
 */
#include "group.h"
#include "srnf/regress.h"

#define N ((size_t)32)
#define STUDIES 60

/* Ellipsoids with noise in twelve coefficients, of the first n_wide so many times as far. */
static void regress(size_t n_wide, double times, uint64_t seed, struct srnf_regression *out)
{
    struct srnf_regress_options options = srnf_regress_options_defaults();
    struct test_random random = test_random_seed(seed);
    double group[N], *mean, *q;
    const struct srnf_nested nested = {0, 1, NULL, group};
    const struct srnf_regress_design design = {
        .columns = 1, .values = group, .tests = 1, .nested = &nested};
    struct group g;
    void *workspace;

    group_open(&g, 4, N);
    mean = shapes_doubles(g.count);
    q = shapes_doubles(N * 3 * g.points);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(g.sht));
    assert_non_null(workspace);
    for (size_t i = 0; i < N; i++) {
        double noise[12];

        group[i] = i < n_wide ? 1.0 : 0.0;
        test_random_normals(&random, 12, noise);
        g.f[i][3] = 2.4;
        g.f[i][g.each + 1] = 2.0;
        g.f[i][2 * g.each + 2] = 1.6;
        for (size_t k = 0; k < 12; k++) {
            g.f[i][k % 3 * g.each + 4 + k / 3] += 0.01 * noise[k] * (i < n_wide ? times : 1.0);
        }
        srnf_field(g.sht, g.f[i], q + i * 3 * g.points, workspace);
        for (size_t k = 0; k < g.count; k++) {
            mean[k] += g.f[i][k] / (double)N;
        }
    }
    options.permutations = 1;
    options.bootstraps = 200;
    options.seed = seed;
    options.surfaces = g.surfaces;
    assert_int_equal(srnf_regress(g.sht, N, mean, q, &design, &options, NULL, out, NULL), SRNF_OK);
    srnf_free(workspace);
    srnf_free(mean);
    srnf_free(q);
    group_close(&g);
}

/* A share of nothing: how many intervals begin above 0. */
static size_t count_claims(size_t n_wide, double times)
{
    size_t above = 0;

    for (uint64_t seed = 1; seed <= STUDIES; seed++) {
        struct srnf_regression out;

        regress(n_wide, times, seed, &out);
        assert_true(isfinite(out.test_of[0].part.interval[0]));
        assert_true(out.test_of[0].r2.interval[0] >= 0.0 && out.test_of[0].r2.interval[1] <= 1.0);
        assert_true((out.test_of[0].r2.interval[0] > 0.0) ==
                    (out.test_of[0].part.interval[0] > 0.0));
        above += out.test_of[0].r2.interval[0] > 0.0;
        srnf_regression_clear(&out);
    }
    return above;
}

static void shares_of_equal_means_begin_at_0(void **state)
{
    size_t even, few, many;

    (void)state;
    figures_count_unsanitized();
    even = count_claims(16, 1.0);
    few = count_claims(8, 3.0);
    many = count_claims(24, 3.0);
    printf("# shares told above 0 of %d cohorts of equal means: 16 of 32 as the others %zu, 8 "
           "three times as wide %zu, 24 three times as wide %zu\n",
           STUDIES, even, few, many);
    /* Binomial(60, .05): beyond with a chance of .01 */
    assert_in_range(even, 0, 7);
    assert_in_range(few, 0, 7);
    assert_in_range(many, 0, 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shares_of_equal_means_begin_at_0),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

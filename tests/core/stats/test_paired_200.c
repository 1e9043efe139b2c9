/*
 * test_paired_200.c - 200 studies of 12 subjects whose visits are alike: how often a change is
 * found at the level .05, over the whole surface and on the map; and of 200 with a change how often
 * the region of confidence and the interval of its size hold it.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 3600
 */
#include "visits.h"

#define RUNS ((size_t)200)
#define N ((size_t)12)

static int differ(const struct visits *v, uint64_t seed, struct srnf_paired *out)
{
    struct srnf_paired_options options = srnf_paired_options_defaults();

    options.permutations = 199;
    options.bootstraps = 500;
    options.seed = seed;
    return srnf_paired_differences(v->g.sht, &v->pairs, &options, NULL, out, NULL);
}

static void no_change_is_found_at_the_level(void **state)
{
    size_t global = 0;
    size_t local = 0;
    size_t reported = 0;
    size_t outside = 0;

    (void)state;
    for (size_t run = 0; run < RUNS; run++) {
        struct visits v;
        struct srnf_paired out;
        bool beyond = false;

        visits_open(&v, N, 0.0, 0.05, 1000 + run);
        assert_int_equal(differ(&v, run, &out), SRNF_OK);
        global += out.p_value <= 0.05;
        local += out.max_p_value <= 0.05;
        reported += group_least(v.g.points, out.fdr) <= 0.05;
        for (size_t p = 0; p < v.g.points; p++) {
            beyond = beyond || fabs(out.normal[p]) > out.confidence[p];
        }
        outside += beyond;
        srnf_paired_clear(&out);
        visits_close(&v);
    }
    printf(
        "# %zu studies without change: %zu found, %zu on the map, %zu by false discovery rate, 0 "
        "outside of the region %zu\n",
        RUNS, global, local, reported, outside);
    /* Binomial(200, .05): above 20 with a chance of 1e-3, below 2 as well. */
    assert_true(global >= 2 && global <= 20);
    assert_true(local >= 2 && local <= 20);
    assert_true(reported <= 20); /* any discovery is a false one, where there is nothing */
    assert_true(outside <= 30);  /* a bootstrap of 12 subjects */
}

static void power_grows_with_the_change(void **state)
{
    size_t before = 0;

    (void)state;
    for (size_t step = 1; step <= 3; step++) {
        size_t found = 0;

        for (size_t run = 0; run < 60; run++) {
            struct visits v;
            struct srnf_paired out;

            visits_open(&v, N, 0.02 * (double)step, 0.03, 3000 + run);
            assert_int_equal(differ(&v, run, &out), SRNF_OK);
            found += out.p_value <= 0.05;
            srnf_paired_clear(&out);
            visits_close(&v);
        }
        printf("# growth %.2f: found in %zu of 60\n", 0.02 * (double)step, found);
        assert_true(found >= before);
        before = found;
    }
    assert_true(before >= 50);
}

/* The change of ellipsoids without noise. */
static double change_of(double growth)
{
    struct visits v;
    struct srnf_paired out;
    void *workspace;
    double value;

    visits_open(&v, SRNF_PAIRS_MIN, 0.0, 0.0, 1);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(v.g.sht));
    assert_non_null(workspace);
    memset(v.mean, 0, v.g.count * sizeof(double));
    for (size_t i = 0; i < 2 * v.n; i++) {
        double *f = v.g.f[i];

        memset(f, 0, v.g.count * sizeof(double));
        f[3] = 2.4;
        f[v.g.each + 1] = 2.0;
        f[2 * v.g.each + 2] = 1.6 + (i < v.n ? 0.0 : growth);
        srnf_field(v.g.sht, f, v.q + i * v.size, workspace);
        for (size_t k = 0; k < v.g.count; k++) {
            v.mean[k] += f[k] / (double)(2 * v.n);
        }
    }
    assert_int_equal(differ(&v, 0, &out), SRNF_OK);
    value = out.change.value;
    srnf_paired_clear(&out);
    visits_close(&v);
    srnf_free(workspace);
    return value;
}

static void few_subjects_hold_the_size(void **state)
{
    static const double growths[] = {0.0, 0.1, 0.3};

    (void)state;
    for (size_t k = 0; k < 3; k++) {
        double truth = change_of(growths[k]);
        size_t missed = 0;

        for (size_t run = 0; run < RUNS; run++) {
            struct visits v;
            struct srnf_paired out;

            visits_open(&v, 6, growths[k], 0.05, 5000 + run);
            assert_int_equal(differ(&v, run, &out), SRNF_OK);
            missed += !(out.change.interval[0] <= truth && truth <= out.change.interval[1]);
            srnf_paired_clear(&out);
            visits_close(&v);
        }
        printf("# 6 subjects, growth %.1f: %zu of %zu intervals of its size miss it\n", growths[k],
               missed, RUNS);
        assert_true(missed <= 20); /* of 95 %: above 20 with a chance of 1e-3 */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_change_is_found_at_the_level),
        cmocka_unit_test(power_grows_with_the_change),
        cmocka_unit_test(few_subjects_hold_the_size),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

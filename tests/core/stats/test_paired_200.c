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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_change_is_found_at_the_level),
        cmocka_unit_test(power_grows_with_the_change),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_trajectories_200.c - 200 studies of 12 subjects whose slopes have nothing in common and do
 * not depend on the group: how often the mean slope and the group are found at the level .05, over
 * the whole surface and on the map, where all subjects have the same visits, where they have not,
 * and where one has two only, close together; and how often the intervals of the variances miss.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 3600
 */
#include "lines.h"

#define RUNS ((size_t)200)
#define N ((size_t)12)

#define KINDS 3
static const char *const names[KINDS] = {"equal", "different", "equal but for a brief subject's"};

/* A variance of each study with its interval. */
struct variances {
    double value[RUNS], interval[RUNS][2];
};

/* Those that miss the mean of all, which are not biased. */
static size_t count_missed(const struct variances *v, const char *name)
{
    size_t above = 0;
    size_t below = 0;
    double mean = 0.0;

    for (size_t run = 0; run < RUNS; run++) {
        mean += v->value[run] / (double)RUNS;
    }
    for (size_t run = 0; run < RUNS; run++) {
        above += v->interval[run][0] > mean;
        below += v->interval[run][1] < mean;
    }
    printf("# variance %s: %zu intervals above the mean, %zu below\n", name, above, below);
    assert_true(above <= 12 && below <= 12); /* Binomial(200, .025): more with a chance of 1e-3 */
    return above + below;
}

static void nothing_is_found_at_the_level(void **state)
{
    (void)state;
    for (size_t kind = 0; kind < KINDS; kind++) {
        static struct variances within, between;
        size_t slope = 0;
        size_t slope_map = 0;
        size_t group = 0;
        size_t group_map = 0;
        size_t reported[2] = {0, 0}; /* any node by false discovery rate */

        for (size_t run = 0; run < RUNS; run++) {
            const struct lines_plan plan = {N, kind == 1, 0.0, 0.0, 0.1, 0.02, 1000 + run};
            struct lines l;
            struct srnf_trajectories out;

            lines_open_brief(&l, &plan, kind == 2 ? 0.05 : 0.0);
            lines_group(&l);
            l.design.points = 0;
            assert_int_equal(lines_fit(&l, 199, run, NULL, &out), SRNF_OK);
            slope += out.slope.p_value <= 0.05;
            slope_map += out.slope.max_p_value <= 0.05;
            group += out.model.test_of[0].p_value <= 0.05;
            group_map += out.model.test_of[0].max_p_value <= 0.05;
            reported[0] += group_least(l.g.points, out.slope.fdr) <= 0.05;
            reported[1] += group_least(l.g.points, out.model.test_of[0].fdr) <= 0.05;
            within.value[run] = out.within;
            between.value[run] = out.between;
            memcpy(within.interval[run], out.within_interval, sizeof out.within_interval);
            memcpy(between.interval[run], out.between_interval, sizeof out.between_interval);
            srnf_trajectories_clear(&out);
            lines_close(&l);
        }
        printf("# %zu studies, %s visits: mean slope %zu, on the map %zu, by false discovery rate "
               "%zu; group %zu, %zu, %zu\n",
               RUNS, names[kind], slope, slope_map, reported[0], group, group_map, reported[1]);
        /* Binomial(200, .05): above 20 with a chance of 1e-3, below 2 as well. */
        assert_true(slope >= 2 && slope <= 20 && slope_map >= 2 && slope_map <= 20);
        assert_true(group >= 2 && group <= 20 && group_map >= 2 && group_map <= 20);
        assert_true(count_missed(&within, "within") <= 20);
        assert_true(count_missed(&between, "between") <= 20);
        assert_true(reported[0] <= 20 && reported[1] <= 20);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_found_at_the_level),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

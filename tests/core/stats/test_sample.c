/*
 * test_sample.c - random scores: the generator against published answers, the logarithm against the
 * C library, and the distribution, with fixed seeds.
 */
#include "group.h"

#define COUNT ((size_t)20000)
#define COMPONENTS ((size_t)5)

/* Known answers of Philox 4x32-10 as they are distributed with Random123. */
static void philox_gives_the_known_answers(void **state)
{
    static const struct {
        uint32_t counter[4], key[2], answer[4];
    } known[] = {
        {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
        {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
         {0xffffffff, 0xffffffff},
         {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
        {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
         {0xa4093822, 0x299f31d0},
         {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
    };

    (void)state;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        uint32_t out[4];

        stats_philox(known[i].counter, known[i].key, out);
        assert_memory_equal(out, known[i].answer, sizeof out);
    }
}

static void logarithm_is_right(void **state)
{
    struct test_random random = test_random_seed(5);
    double worst = 0.0;

    (void)state;
    assert_true(stats_log(1.0) == 0.0);
    for (size_t i = 0; i < 200000; i++) {
        double x = test_random_uniform(&random, 0.0, 1.0);

        x = i % 2 ? x : pow(x, 20.0);
        if (x > 0.0 && x < 1.0) {
            worst = compare_max(worst, fabs(stats_log(x) / log(x) - 1.0));
        }
    }
    figure_below("relative error of the logarithm", worst, 1e-15);
}

static struct srnf_pca model(double *eigenvalues)
{
    for (size_t k = 0; k < COMPONENTS; k++) {
        eigenvalues[k] = pow(0.3, (double)k);
    }
    return (struct srnf_pca){.n = 10, .components = COMPONENTS, .eigenvalues = eigenvalues};
}

/* Moments of the standardized scores against those of the normal distribution, each within five of
   its standard errors; the largest distance of the empirical distribution from the normal one,
   sqrt(n) D, against its 99.9 % point. */
static void scores_are_normal(void **state)
{
    double eigenvalues[COMPONENTS];
    struct srnf_pca pca = model(eigenvalues);
    double *scores = shapes_doubles(COUNT * COMPONENTS);
    double *x = shapes_doubles(COUNT);
    double n = (double)COUNT;

    (void)state;
    srnf_pca_sample(&pca, 7, COUNT, COMPONENTS, scores);
    for (size_t k = 0; k < COMPONENTS; k++) {
        double moment[5] = {0};
        double largest = 0.0;

        for (size_t i = 0; i < COUNT; i++) {
            x[i] = scores[i * COMPONENTS + k] / sqrt(eigenvalues[k]);
            for (int m = 1; m <= 4; m++) {
                moment[m] += pow(x[i], m) / n;
            }
        }
        assert_true(fabs(moment[1]) <= 5.0 * sqrt(1.0 / n));
        assert_true(fabs(moment[2] - 1.0) <= 5.0 * sqrt(2.0 / n));
        assert_true(fabs(moment[3]) <= 5.0 * sqrt(15.0 / n));
        assert_true(fabs(moment[4] - 3.0) <= 5.0 * sqrt(96.0 / n));
        qsort(x, COUNT, sizeof *x, compare_order);
        for (size_t i = 0; i < COUNT; i++) {
            double p = 0.5 * erfc(-x[i] / sqrt(2.0));

            largest = compare_max(largest, compare_max(p - (double)i / n, (double)(i + 1) / n - p));
        }
        figure_below("Kolmogorov-Smirnov statistic", sqrt(n) * largest, 1.95);
    }
    srnf_free(x);
    srnf_free(scores);
}

static void components_and_samples_are_independent(void **state)
{
    double eigenvalues[COMPONENTS];
    struct srnf_pca pca = model(eigenvalues);
    double *scores = shapes_doubles(COUNT * COMPONENTS);
    double worst = 0.0;
    double n = (double)COUNT;

    (void)state;
    srnf_pca_sample(&pca, 8, COUNT, COMPONENTS, scores);
    for (size_t a = 0; a < COMPONENTS; a++) {
        for (size_t b = 0; b < COMPONENTS; b++) {
            for (size_t lag = a > b ? 0 : 1; lag < 3; lag++) {
                double sum = 0.0;

                for (size_t i = 0; i + lag < COUNT; i++) {
                    sum += scores[i * COMPONENTS + a] * scores[(i + lag) * COMPONENTS + b];
                }
                worst = compare_max(worst, fabs(sum / sqrt(n * eigenvalues[a] * eigenvalues[b])));
            }
        }
    }
    figure_below("largest correlation, in standard errors", worst, 5.0);
    srnf_free(scores);
}

/* Sample i, component k is one number, whatever else is asked for; other seeds give others. */
static void a_score_depends_on_its_place_alone(void **state)
{
    double eigenvalues[COMPONENTS];
    struct srnf_pca pca = model(eigenvalues);
    double all[20 * COMPONENTS];

    (void)state;
    srnf_pca_sample(&pca, 9, 20, COMPONENTS, all);
    for (size_t components = 1; components <= COMPONENTS; components++) {
        double some[10 * COMPONENTS];
        double other[10 * COMPONENTS];

        srnf_pca_sample(&pca, 9, 10, components, some);
        srnf_pca_sample(&pca, 10, 10, components, other);
        for (size_t i = 0; i < 10; i++) {
            for (size_t k = 0; k < components; k++) {
                assert_true(some[i * components + k] == all[i * COMPONENTS + k]);
                assert_true(other[i * components + k] != all[i * COMPONENTS + k]);
            }
        }
    }
}

static void components_beyond_the_model_are_zero(void **state)
{
    double eigenvalues[COMPONENTS];
    struct srnf_pca pca = model(eigenvalues);
    double scores[3 * (COMPONENTS + 2)];

    (void)state;
    srnf_pca_sample(&pca, UINT64_MAX, 3, COMPONENTS + 2, scores);
    for (size_t i = 0; i < 3 * (COMPONENTS + 2); i++) {
        assert_true((scores[i] != 0.0) == (i % (COMPONENTS + 2) < COMPONENTS));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(philox_gives_the_known_answers),
        cmocka_unit_test(logarithm_is_right),
        cmocka_unit_test(scores_are_normal),
        cmocka_unit_test(components_and_samples_are_independent),
        cmocka_unit_test(a_score_depends_on_its_place_alone),
        cmocka_unit_test(components_beyond_the_model_are_zero),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

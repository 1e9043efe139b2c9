/*
 * test_pca_intervals.c - intervals of principal components: how often they hold what groups were
 * drawn from, where there are none, and groups that tell nothing. test_pca_intervals_200.c has more
 * spectra.
 */
#include "spectra.h"

#define STUDIES ((size_t)200)
/* Of 200 at one in twenty exceeded by chance once in 3000. */
#define MISSED_MAX ((size_t)21)

static void what_is_planted_is_held(void **state)
{
    static const struct spectrum spectra[] = {
        {"three that stand out", 100, {20.0, 8.0, 3.0}, 0.1, 0.0, 0, false},
        {"the same, four kept", 100, {20.0, 8.0, 3.0}, 0.1, 0.0, 4, false},
        {"k^-2", 60, {0.0}, 1.0, 2.0, 0, false},
        {"k^-2, wide tails", 60, {0.0}, 1.0, 2.0, 0, true},
    };
    static const size_t sizes[] = {20, 40};
    struct test_random random = test_random_seed(17);

    (void)state;
    for (size_t s = 0; s < 2 * sizeof spectra / sizeof spectra[0]; s++) {
        const struct spectrum *of = &spectra[s / 2];
        struct spectra_missed missed = {.total = 0};

        for (size_t study = 0; study < STUDIES; study++) {
            spectrum_study(of, sizes[s % 2], &random, &missed);
        }
        printf("# %s, %zu members: of %zu total variances missed %zu\n", of->name, sizes[s % 2],
               STUDIES, missed.total);
        assert_in_range(missed.total, 0, MISSED_MAX);
        for (size_t k = 0; k < SPECTRA_COUNTED; k++) {
            printf("#   component %zu: given %zu, missed %zu, of shares %zu\n", k + 1,
                   missed.given[k], missed.missed[k], missed.shares[k]);
            assert_in_range(missed.missed[k], 0, MISSED_MAX);
            assert_in_range(missed.shares[k], 0, MISSED_MAX);
        }
        assert_in_range(missed.given[0], STUDIES * 9 / 10, STUDIES);
    }
}

/* Directions that all vary alike have no components. */
static void noise_has_no_intervals(void **state)
{
    static const struct spectrum noise = {"noise", 150, {0.0}, 1.0, 0.0, 0, false};
    struct test_random random = test_random_seed(2);
    struct spectra_missed missed = {.total = 0};

    (void)state;
    for (size_t study = 0; study < STUDIES; study++) {
        spectrum_study(&noise, 20, &random, &missed);
    }
    printf("# of noise given %zu, %zu, %zu\n", missed.given[0], missed.given[1], missed.given[2]);
    assert_in_range(missed.given[0] + missed.given[1] + missed.given[2], 0, STUDIES / 20);
    assert_in_range(missed.total, 0, MISSED_MAX);
}

/* Two of the same variance are told apart by no group: the interval of each holds both. */
static void equal_ones_are_held_together(void **state)
{
    static const struct spectrum pair = {"a pair", 60, {4.0, 4.0, 0.2}, 0.02, 0.0, 0, false};
    struct test_random random = test_random_seed(9);
    struct spectra_missed missed = {.total = 0};

    (void)state;
    for (size_t study = 0; study < STUDIES; study++) {
        spectrum_study(&pair, 30, &random, &missed);
    }
    printf("# of a pair given %zu and %zu, missed %zu and %zu\n", missed.given[0], missed.given[1],
           missed.missed[0], missed.missed[1]);
    assert_in_range(missed.missed[0], 0, MISSED_MAX);
    assert_in_range(missed.missed[1], 0, MISSED_MAX);
    assert_in_range(missed.given[0], STUDIES * 9 / 10, STUDIES);
}

static void expect_none(const struct srnf_pca *pca, size_t k)
{
    double interval[2] = {0.0, 0.0}, share[2] = {0.0, 0.0};

    srnf_pca_interval(pca, k, interval, share);
    assert_true(isnan(interval[0]) && isnan(interval[1]) && isnan(share[0]) && isnan(share[1]));
}

static void what_tells_nothing(void **state)
{
    static const struct spectrum clear = {"clear", 30, {9.0, 1.0, 0.1}, 0.001, 0.0, 0, false};
    static const struct spectrum line = {"one direction", 1, {2.0}, 1.0, 0.0, 0, false};
    struct test_random random = test_random_seed(4);
    double distances[SPECTRA_MEMBERS], interval[2], share[2];
    struct srnf_pca pca;

    (void)state;
    spectrum_group(&clear, 9, &random, &pca, distances);
    expect_none(&pca, 0);
    srnf_pca_total_interval(&pca, distances, interval);
    assert_true(interval[0] > 0.0 && interval[1] > interval[0] && isfinite(interval[1]));
    srnf_pca_clear(&pca);
    spectrum_group(&clear, 3, &random, &pca, distances);
    srnf_pca_total_interval(&pca, distances, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    srnf_pca_clear(&pca);
    spectrum_group(&clear, 20, &random, &pca, distances);
    expect_none(&pca, 18); /* the last of all */
    expect_none(&pca, 19);
    pca.total_variance = 0.0;
    expect_none(&pca, 0);
    srnf_pca_total_interval(&pca, distances, interval);
    assert_true(isnan(interval[0]));
    srnf_pca_clear(&pca);
    spectrum_group(&line, 20, &random, &pca, distances); /* is all of the variance */
    srnf_pca_interval(&pca, 0, interval, share);
    assert_true(interval[0] < pca.eigenvalues[0] && pca.eigenvalues[0] < interval[1]);
    assert_true(share[0] >= 1.0 - 1e-9 && share[1] <= 1.0);
    srnf_pca_clear(&pca);
    pca = (struct srnf_pca){.n = 20};
    expect_none(&pca, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_planted_is_held),
        cmocka_unit_test(noise_has_no_intervals),
        cmocka_unit_test(equal_ones_are_held_together),
        cmocka_unit_test(what_tells_nothing),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

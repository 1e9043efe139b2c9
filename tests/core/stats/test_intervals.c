/*
 * test_intervals.c - intervals of norms and variances of linear models: how often they hold what
 * was planted, how often they claim what is noise, and data that tell nothing.
 */
#include "group.h"
#include "stats/intervals.h"

#include <cblas.h>

#define SUBJECTS_MAX ((size_t)24)
#define DIMENSIONS ((size_t)12)
#define MANY ((size_t)40) /* dimensions of noise beside several columns */
#define COLUMNS_MAX ((size_t)6)
#define STUDIES ((size_t)400)
#define MISSED_MAX ((size_t)36)  /* one in twenty, exceeded by chance once in 3000 */
#define CLAIMED_MAX ((size_t)20) /* one in forty, exceeded by chance once in 700 */

struct planted {
    size_t n;
    double part;    /* of the n in the second group; 0: one group, whose mean it is */
    double decline; /* variances are 1 / k^decline */
    double signal;  /* |beta|^2 over tr C, along the first dimension */
};

struct told {
    double truth, variance;
    double norm[2], spread[2];
};

/* Basis, weights of the estimate; returns the columns of the basis. */
static size_t open_design(const struct planted *p, double *basis, double *weights)
{
    size_t second = (size_t)round(p->part * (double)p->n);
    double first = (double)(p->n - second);

    for (size_t i = 0; i < p->n; i++) {
        bool late = i < second;

        basis[i] = 1.0 / sqrt((double)p->n);
        weights[i] = late ? 1.0 / (double)second : (second ? -1.0 : 1.0) / first;
    }
    if (second) {
        double length = sqrt(1.0 / (double)second + 1.0 / first);

        for (size_t i = 0; i < p->n; i++) {
            basis[p->n + i] = weights[i] / length;
        }
    }
    return second ? 2 : 1;
}

static struct told run_study(const struct planted *p, struct test_random *random)
{
    double basis[2 * SUBJECTS_MAX], weights[SUBJECTS_MAX], along[SUBJECTS_MAX];
    double y[SUBJECTS_MAX * DIMENSIONS], b[DIMENSIONS] = {0.0}, gram[SUBJECTS_MAX * SUBJECTS_MAX];
    size_t n = p->n, count = open_design(p, basis, weights);
    double noise = 0.0, square = 0.0, left = 0.0;
    struct intervals intervals;
    struct told told = {.variance = 0.0};

    for (size_t k = 0; k < DIMENSIONS; k++) {
        told.variance += pow((double)(k + 1), -p->decline);
    }
    for (size_t i = 0; i < n; i++) {
        noise += weights[i] * weights[i] * told.variance;
    }
    told.truth = sqrt(p->signal * noise);
    for (size_t k = 0; k < n * DIMENSIONS; k++) {
        size_t of = k % DIMENSIONS;

        y[k] = pow((double)(of + 1), -0.5 * p->decline) * test_random_normal(random);
        y[k] += of == 0 && weights[k / DIMENSIONS] > 0.0 ? told.truth : 0.0;
        b[of] += weights[k / DIMENSIONS] * y[k];
    }
    for (size_t k = 0; k < DIMENSIONS; k++) {
        square += b[k] * b[k];
    }
    for (size_t i = 0; i < n; i++) {
        along[i] = 0.0;
        for (size_t k = 0; k < DIMENSIONS; k++) {
            along[i] += y[i * DIMENSIONS + k] * b[k];
        }
    }
    assert_int_equal(stats_gram(n, DIMENSIONS, y, gram, NULL), SRNF_OK);
    assert_int_equal(intervals_open(&intervals, n, count, basis, gram), SRNF_OK);
    intervals_norm(&intervals, weights, along, square, told.norm);
    for (size_t i = 0; i < n; i++) {
        left += intervals.gram[i * n + i] / (double)(n - count);
    }
    intervals_variance(&intervals, left, told.spread);
    assert_true(isnan(told.norm[0]) ||
                (told.norm[0] <= sqrt(square) && told.norm[1] >= sqrt(square)));
    assert_true(told.spread[0] <= left && told.spread[1] >= left);
    intervals_close(&intervals);
    return told;
}

/* One or two groups, of few or more subjects, noise in one direction mostly or in many, signals
   from none on. */
static void what_is_planted_is_held(void **state)
{
    static const size_t sizes[] = {6, 10, 24};
    struct test_random random = test_random_seed(41);

    (void)state;
    for (size_t k = 0; k < 3 * 2 * 2 * 4; k++) {
        const struct planted p = {.n = sizes[k % 3],
                                  .part = k / 3 % 2 ? 0.5 : 0.0,
                                  .decline = k / 6 % 2 ? 2.0 : 0.5,
                                  .signal = (double[]){0.0, 1.0, 4.0, 25.0}[k / 12]};
        size_t missed = 0;
        size_t spread = 0;

        for (size_t study = 0; study < STUDIES; study++) {
            struct told t = run_study(&p, &random);

            missed += !(t.norm[0] <= t.truth && t.truth <= t.norm[1]);
            spread += !(t.spread[0] <= t.variance && t.variance <= t.spread[1]);
        }
        printf("# %zu subjects, %s, variances 1 / k^%.1f, signal %.0f: of %zu norms missed %zu, "
               "of variances %zu\n",
               p.n, p.part > 0.0 ? "two groups" : "one", p.decline, p.signal, STUDIES, missed,
               spread);
        assert_in_range(missed, 0, MISSED_MAX);
        assert_in_range(spread, 0, MISSED_MAX);
    }
}

/* Whether the interval of a coefficient of noise begins above 0, beside other columns. */
static bool noise_is_claimed(size_t n, size_t columns, double decline, struct test_random *random)
{
    double basis[COLUMNS_MAX * SUBJECTS_MAX], gram[SUBJECTS_MAX * SUBJECTS_MAX];
    double weights[SUBJECTS_MAX], along[SUBJECTS_MAX] = {0.0}, interval[2];
    double y[SUBJECTS_MAX * MANY], b[MANY] = {0.0}, square = 0.0, length = 0.0;
    struct intervals intervals;

    for (size_t k = 0; k <= columns; k++) {
        double *v = basis + k * n;

        test_random_normals(random, n, v);
        for (size_t i = 0; i < n; i++) {
            v[i] = k ? v[i] : 1.0;
        }
        for (size_t m = 0; m < k; m++) {
            cblas_daxpy((int)n, -cblas_ddot((int)n, v, 1, basis + m * n, 1), basis + m * n, 1, v,
                        1);
        }
        length = cblas_dnrm2((int)n, v, 1);
        cblas_dscal((int)n, 1.0 / length, v, 1);
    }
    for (size_t i = 0; i < n; i++) {
        weights[i] = basis[columns * n + i] / length; /* of the last column */
    }
    for (size_t k = 0; k < n * MANY; k++) {
        y[k] = pow((double)(k % MANY + 1), -0.5 * decline) * test_random_normal(random);
        b[k % MANY] += weights[k / MANY] * y[k];
    }
    for (size_t k = 0; k < n * MANY; k++) {
        along[k / MANY] += y[k] * b[k % MANY];
    }
    for (size_t k = 0; k < MANY; k++) {
        square += b[k] * b[k];
    }
    assert_int_equal(stats_gram(n, MANY, y, gram, NULL), SRNF_OK);
    assert_int_equal(intervals_open(&intervals, n, columns + 1, basis, gram), SRNF_OK);
    intervals_norm(&intervals, weights, along, square, interval);
    intervals_close(&intervals);
    assert_true(isnan(interval[0]) || (interval[0] >= 0.0 && interval[1] >= sqrt(square)));
    return interval[0] > 0.0;
}

/* Few degrees of freedom, as a column of numbers rests on the few subjects far from its mean. */
static void noise_in_few_subjects_is_not_claimed(void **state)
{
    static const size_t sizes[][2] = {{12, 1}, {12, 2}, {14, 3}, {16, 5}};
    struct test_random random = test_random_seed(43);

    (void)state;
    for (size_t k = 0; k < 4 * 3; k++) {
        const size_t *of = sizes[k % 4];
        double decline = (double)(k / 4) / 2.0;
        size_t claimed = 0;

        for (size_t study = 0; study < STUDIES; study++) {
            claimed += noise_is_claimed(of[0], of[1], decline, &random);
        }
        printf("# %zu subjects, %zu columns, variances 1 / k^%.1f: of %zu of noise claimed %zu\n",
               of[0], of[1], decline, STUDIES, claimed);
        assert_in_range(claimed, 0, CLAIMED_MAX);
    }
}

/* What has one direction, of few degrees of freedom, varies most. */
static void noise_in_one_direction_is_not_claimed(void **state)
{
    static const size_t sizes[][2] = {{10, 1}, {12, 1}, {12, 2}, {14, 2}};
    struct test_random random = test_random_seed(47);
    size_t claimed = 0;

    (void)state;
    for (size_t k = 0; k < 4 * STUDIES; k++) {
        const size_t *of = sizes[k % 4];

        claimed += noise_is_claimed(of[0], of[1], 8.0, &random);
    }
    printf("# noise in one direction: of %zu claimed %zu\n", 4 * STUDIES, claimed);
    assert_in_range(claimed, 10, 58); /* Binomial(1600, .025): beyond with a chance of 4e-3 */
}

/* A group of one subject: its value is fitted, and nothing tells how far others would be off. */
static void one_subject_tells_nothing(void **state)
{
    const struct planted one = {.n = 16, .part = 1.0 / 16.0, .decline = 0.7};
    struct test_random random = test_random_seed(6);
    struct told told = run_study(&one, &random);

    (void)state;
    assert_true(isnan(told.norm[0]) && isnan(told.norm[1]));
    assert_true(told.spread[0] > 0.0 && told.spread[1] > told.spread[0]);
}

/* A group of two subjects tells too little; subjects that are equal, and an estimate that is none,
   as of two groups of the same subjects, tell nothing: no one drew them. */
static void what_tells_nothing(void **state)
{
    const struct planted few = {.n = 8, .part = 0.25, .decline = 1.0};
    struct test_random random = test_random_seed(5);
    struct told told = run_study(&few, &random);
    double basis[6], weights[6], gram[36], along[6], interval[2];
    struct intervals intervals;

    (void)state;
    assert_true(isnan(told.norm[0]) && isnan(told.norm[1]));
    for (size_t k = 0; k < 36; k++) {
        gram[k] = 4.0;
        basis[k % 6] = 1.0 / sqrt(6.0);
        weights[k % 6] = 1.0 / 6.0;
        along[k % 6] = 4.0;
    }
    assert_int_equal(intervals_open(&intervals, 6, 1, basis, gram), SRNF_OK);
    intervals_norm(&intervals, weights, along, 4.0, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    intervals_ratio(&intervals, weights, along, 4.0, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    intervals_norm(&intervals, weights, along, (double)NAN, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    intervals_variance(&intervals, 0.0, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    intervals_close(&intervals);
    for (size_t k = 0; k < 36; k++) {
        gram[k] = k / 6 % 2 == k % 2 ? 1.0 : -1.0; /* as many here as there: their mean is 0 */
        along[k % 6] = 0.0;
    }
    assert_int_equal(intervals_open(&intervals, 6, 1, basis, gram), SRNF_OK);
    intervals_norm(&intervals, weights, along, 1e-32, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    intervals_norm(&intervals, weights, along, 1e-4, interval);
    assert_true(interval[0] == 0.0 && interval[1] > 0.0);
    intervals_close(&intervals);
    assert_int_equal(intervals_open(&intervals, 3, 1, basis, gram), SRNF_OK);
    intervals_variance(&intervals, 1.0, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    intervals_close(&intervals);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_planted_is_held),
        cmocka_unit_test(noise_in_few_subjects_is_not_claimed),
        cmocka_unit_test(noise_in_one_direction_is_not_claimed),
        cmocka_unit_test(one_subject_tells_nothing),
        cmocka_unit_test(what_tells_nothing),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_covariates.c - covariates that say nothing beside the others, and what they leave of the
 * groups: the variance inflation is that of the textbook, 1 / (1 - R^2).
 */
#include "group.h"
#include "support/random.h"

#define N ((size_t)20)
#define M ((size_t)4)

static void what_follows_is_found(void **state)
{
    struct test_random random = test_random_seed(3);
    enum srnf_covariate verdicts[M];
    double values[M * N];

    (void)state;
    for (size_t i = 0; i < N; i++) {
        values[i] = 1e6 + 1e4 * test_random_normal(&random);
        values[N + i] = 7.0;
        values[2 * N + i] = 1e-3 * test_random_normal(&random);
        values[3 * N + i] = 5.0 - 2.0 * values[i] + 1e7 * values[2 * N + i];
    }
    assert_int_equal(srnf_covariates_check(M, N, values, verdicts), SRNF_OK);
    assert_int_equal(verdicts[0], SRNF_COVARIATE_FREE);
    assert_int_equal(verdicts[1], SRNF_COVARIATE_CONSTANT);
    assert_int_equal(verdicts[2], SRNF_COVARIATE_FREE);
    assert_int_equal(verdicts[3], SRNF_COVARIATE_FOLLOWS);
    values[3 * N] += 1.0;
    assert_int_equal(srnf_covariates_check(M, N, values, verdicts), SRNF_OK);
    assert_int_equal(verdicts[3], SRNF_COVARIATE_FREE);
    assert_int_equal(srnf_covariates_check(M, 0, values, verdicts), SRNF_EINVAL);
}

/* Far from 0, as dates and identifiers are, a covariate keeps its digits; what follows is found. */
static void a_covariate_far_from_0_counts(void **state)
{
    struct test_random random = test_random_seed(4);
    enum srnf_covariate verdicts[M];
    double values[M * N];

    (void)state;
    for (size_t i = 0; i < N; i++) {
        values[i] = 1e9 + (double)i;
        values[N + i] = (double)i;
        values[2 * N + i] = 1e9 + test_random_normal(&random);
        values[3 * N + i] = i % 2 ? 0.3 : 0.1 + 0.2;
    }
    assert_int_equal(srnf_covariates_check(M, N, values, verdicts), SRNF_OK);
    assert_int_equal(verdicts[0], SRNF_COVARIATE_FREE);
    assert_int_equal(verdicts[1], SRNF_COVARIATE_FOLLOWS);
    assert_int_equal(verdicts[2], SRNF_COVARIATE_FREE);
    assert_int_equal(verdicts[3], SRNF_COVARIATE_CONSTANT);
}

/* One covariate x: R is its correlation with the group. */
static double by_correlation(const double *x, const int *group)
{
    double mx = 0.0, mg = 0.0, xx = 0.0, gg = 0.0, xg = 0.0;

    for (size_t i = 0; i < N; i++) {
        mx += x[i] / (double)N;
        mg += group[i] / (double)N;
    }
    for (size_t i = 0; i < N; i++) {
        xx += (x[i] - mx) * (x[i] - mx);
        gg += (group[i] - mg) * (group[i] - mg);
        xg += (x[i] - mx) * (group[i] - mg);
    }
    return 1.0 / (1.0 - xg * xg / (xx * gg));
}

static void inflation_is_that_of_the_textbook(void **state)
{
    struct test_random random = test_random_seed(5);
    size_t subjects[N], twice[2 * N], closest;
    double x[N], both[2 * N], members[2 * N], inflation;
    int group[N], groups[2 * N];

    (void)state;
    for (size_t i = 0; i < N; i++) {
        subjects[i] = i;
        group[i] = i % 3 == 0;
        x[i] = group[i] + 0.3 * test_random_normal(&random);
        both[2 * i] = test_random_normal(&random);
        both[2 * i + 1] = x[i];
    }
    assert_int_equal(srnf_covariates_inflation(N, subjects, group, 1, x, &inflation, &closest),
                     SRNF_OK);
    assert_true(fabs(inflation / by_correlation(x, group) - 1.0) < 1e-12);
    assert_true(inflation > 2.0);
    assert_int_equal(closest, 0);
    /* Two members of each subject say no more than their mean. */
    for (size_t i = 0; i < N; i++) {
        for (size_t k = 0; k < 2; k++) {
            twice[2 * i + k] = 2 * i;
            groups[2 * i + k] = group[i];
            members[2 * i + k] = x[i] + (k ? 3.0 : -3.0);
        }
    }
    assert_int_equal(
        srnf_covariates_inflation(2 * N, twice, groups, 1, members, &inflation, &closest), SRNF_OK);
    assert_true(fabs(inflation / by_correlation(x, group) - 1.0) < 1e-12);
    assert_int_equal(srnf_covariates_inflation(N, subjects, group, 2, both, &inflation, &closest),
                     SRNF_OK);
    assert_true(inflation >= by_correlation(x, group) * (1.0 - 1e-12));
    assert_int_equal(closest, 1);
    assert_int_equal(srnf_covariates_inflation(N, subjects, group, 0, x, &inflation, &closest),
                     SRNF_OK);
    assert_true(fabs(inflation - 1.0) < 1e-12);
    for (size_t i = 0; i < N; i++) {
        x[i] = 2.0 - 3.0 * group[i];
    }
    assert_int_equal(srnf_covariates_inflation(N, subjects, group, 1, x, &inflation, &closest),
                     SRNF_OK);
    assert_true(inflation > 1e15);
    assert_int_equal(srnf_covariates_inflation(0, subjects, group, 1, x, &inflation, &closest),
                     SRNF_EINVAL);
}

/* The determinant of a correlation matrix, by elimination. */
static double determinant(size_t m, double matrix[3][3])
{
    double product = 1.0;

    for (size_t k = 0; k < m; k++) {
        product *= matrix[k][k];
        for (size_t i = k + 1; i < m; i++) {
            for (size_t j = k + 1; j < m; j++) {
                matrix[i][j] -= matrix[i][k] * matrix[k][j] / matrix[k][k];
            }
        }
    }
    return product;
}

static double correlation(const double *x, const double *y)
{
    double mx = 0.0, my = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;

    for (size_t i = 0; i < N; i++) {
        mx += x[i] / (double)N;
        my += y[i] / (double)N;
    }
    for (size_t i = 0; i < N; i++) {
        xx += (x[i] - mx) * (x[i] - mx);
        yy += (y[i] - my) * (y[i] - my);
        xy += (x[i] - mx) * (y[i] - my);
    }
    return xy / sqrt(xx * yy);
}

/* det R_own det R_others / det R of two own columns and one other, its square root. */
static double by_determinants(double x[3][N])
{
    double all[3][3], own[3][3];

    for (size_t i = 0; i < 9; i++) {
        all[i / 3][i % 3] = own[i / 3][i % 3] = correlation(x[i / 3], x[i % 3]);
    }
    return sqrt(determinant(2, own) / determinant(3, all));
}

static void inflation_of_a_term_is_that_of_the_textbook(void **state)
{
    static const enum srnf_column of_two[] = {SRNF_COLUMN_OF_TERM, SRNF_COLUMN_OF_TERM,
                                              SRNF_COLUMN_BESIDE};
    static const enum srnf_column of_one[] = {SRNF_COLUMN_OF_TERM, SRNF_COLUMN_OUT,
                                              SRNF_COLUMN_BESIDE};
    static const enum srnf_column of_none[] = {SRNF_COLUMN_OUT, SRNF_COLUMN_OUT,
                                               SRNF_COLUMN_BESIDE};
    struct test_random random = test_random_seed(6);
    size_t subjects[2 * N];
    double x[3][N], rows[2 * N * 3], inflation, r;

    (void)state;
    for (size_t i = 0; i < N; i++) {
        x[0][i] = 1e6 + test_random_normal(&random);
        x[1][i] = i % 3 == 1;
        x[2][i] = x[0][i] - 1e6 + 2.0 * x[1][i] + 0.2 * test_random_normal(&random);
        for (size_t k = 0; k < 2; k++) { /* two members of each subject */
            subjects[2 * i + k] = 2 * i;
            for (size_t j = 0; j < 3; j++) {
                rows[(2 * i + k) * 3 + j] = x[j][i] + (k ? 1.0 : -1.0);
            }
        }
    }
    assert_int_equal(srnf_term_inflation(2 * N, subjects, 3, rows, of_two, &inflation), SRNF_OK);
    assert_true(fabs(inflation / by_determinants(x) - 1.0) < 1e-7);
    assert_true(inflation > 3.0);
    r = correlation(x[0], x[2]);
    assert_int_equal(srnf_term_inflation(2 * N, subjects, 3, rows, of_one, &inflation), SRNF_OK);
    assert_true(fabs(inflation * (1.0 - r * r) - 1.0) < 1e-7);
    assert_int_equal(srnf_term_inflation(2 * N, subjects, 3, rows, of_none, &inflation), SRNF_OK);
    assert_true(fabs(inflation - 1.0) < 1e-12);
    for (size_t i = 0; i < 2 * N; i++) {
        rows[3 * i + 2] = 2.0 - 3.0 * rows[3 * i];
    }
    assert_int_equal(srnf_term_inflation(2 * N, subjects, 3, rows, of_one, &inflation), SRNF_OK);
    assert_true(isinf(inflation));
    assert_int_equal(srnf_term_inflation(0, subjects, 3, rows, of_one, &inflation), SRNF_EINVAL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_follows_is_found),
        cmocka_unit_test(a_covariate_far_from_0_counts),
        cmocka_unit_test(inflation_is_that_of_the_textbook),
        cmocka_unit_test(inflation_of_a_term_is_that_of_the_textbook),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

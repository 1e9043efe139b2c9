/*
 * test_pca.c - principal components: orthonormal modes, variances, scores, projection and
 * reconstruction, rank, signs; samples projected back have the covariance they were drawn from.
 */
#include "group.h"

#define DEGREE 7
#define N ((size_t)9)
#define RANK ((size_t)4)
#define SAMPLES ((size_t)4000)

struct model {
    struct group g;
    struct srnf_mean mean;
    struct srnf_pca pca;
};

static void open_model(struct model *m, size_t max_components)
{
    group_open_stars(&m->g, DEGREE, N, 0.3);
    assert_int_equal(srnf_karcher_mean(m->g.sht, N, m->g.surfaces, NULL, NULL, &m->mean, NULL),
                     SRNF_OK);
    assert_int_equal(
        srnf_pca_fit(m->g.grid, N, m->mean.mean_q, m->mean.registered_q, max_components, &m->pca),
        SRNF_OK);
}

static void close_model(struct model *m)
{
    srnf_pca_clear(&m->pca);
    srnf_mean_clear(&m->mean);
    group_close(&m->g);
}

static void modes_are_orthonormal(void **state)
{
    struct model m;
    double worst = 0.0;

    (void)state;
    open_model(&m, 0);
    assert_int_equal(m.pca.components, N - 1); /* the mean is their average */
    for (size_t a = 0; a < N - 1; a++) {
        for (size_t b = 0; b < N - 1; b++) {
            double along = srnf_inner_product(m.g.grid, m.pca.modes + a * 3 * m.g.points,
                                              m.pca.modes + b * 3 * m.g.points);

            worst = compare_max(worst, fabs(along - (a == b ? 1.0 : 0.0)));
        }
    }
    figure_below("modes off orthonormal", worst, 1e-14);
    close_model(&m);
}

/* Of all members at once what srnf_pca_project says of each; nothing is left where all components
   are kept. */
static void residuals_are_those_of_each(void **state)
{
    struct model m;
    double residuals[N];
    double scores[RANK];
    double residual;
    bool complete;

    (void)state;
    open_model(&m, RANK);
    assert_true(srnf_pca_kept_variance(&m.pca, m.pca.total_variance, &complete) <
                m.pca.total_variance);
    assert_false(complete);
    assert_int_equal(
        srnf_pca_residuals(m.g.grid, &m.pca, m.mean.mean_q, N, m.mean.registered_q, residuals),
        SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        srnf_pca_project(m.g.grid, &m.pca, m.mean.mean_q, m.mean.registered_q + i * 3 * m.g.points,
                         scores, &residual);
        assert_true(residuals[i] == residual && residual > 1e-6);
    }
    close_model(&m);
    open_model(&m, 0);
    assert_true(fabs(srnf_pca_kept_variance(&m.pca, m.pca.total_variance, &complete) /
                         m.pca.total_variance -
                     1.0) < 1e-12);
    assert_true(complete);
    assert_int_equal(
        srnf_pca_residuals(m.g.grid, &m.pca, m.mean.mean_q, N, m.mean.registered_q, residuals),
        SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        assert_true(residuals[i] < 1e-12);
    }
    close_model(&m);
}

static void eigenvalues_are_the_variances(void **state)
{
    struct model m;
    double total = 0.0;
    double explained = 0.0;

    (void)state;
    open_model(&m, 0);
    for (size_t a = 0; a < N - 1; a++) {
        assert_true(m.pca.eigenvalues[a] > 0.0);
        assert_true(a == 0 || m.pca.eigenvalues[a] <= m.pca.eigenvalues[a - 1]);
        total += m.pca.eigenvalues[a];
        explained += m.pca.explained[a];
        for (size_t b = 0; b < N - 1; b++) {
            double covariance = 0.0;
            double sum = 0.0;

            for (size_t i = 0; i < N; i++) {
                covariance +=
                    m.pca.scores[i * (N - 1) + a] * m.pca.scores[i * (N - 1) + b] / (double)(N - 1);
                sum += m.pca.scores[i * (N - 1) + a];
            }
            assert_true(fabs(covariance - (a == b ? m.pca.eigenvalues[a] : 0.0)) <=
                        1e-13 * m.pca.eigenvalues[0]);
            assert_true(fabs(sum) <= 1e-12);
        }
    }
    assert_true(fabs(total / m.pca.total_variance - 1.0) <= 1e-13);
    assert_true(fabs(explained - 1.0) <= 1e-13);
    /* The mean divides by n, the components by n - 1. */
    assert_true(fabs(m.mean.history[0].variance * (double)N / (double)(N - 1) - total) <=
                1e-13 * total);
    close_model(&m);
}

/* Of each run of members, as rounding may have it: the trace is summed in another order. */
static void no_share_is_above_one(void **state)
{
    struct model m;

    (void)state;
    open_model(&m, 1);
    for (size_t first = 0; first + 2 <= N; first++) {
        for (size_t n = 2; first + n <= N; n++) {
            const double *q = m.mean.registered_q + first * 3 * m.g.points;
            double *mean = shapes_doubles(3 * m.g.points);
            struct srnf_pca pca;
            double sum = 0.0;

            stats_average(m.g.grid, n, q, mean);
            assert_int_equal(srnf_pca_fit(m.g.grid, n, mean, q, n - 1, &pca), SRNF_OK);
            for (size_t k = 0; k < pca.components; k++) {
                sum += pca.eigenvalues[k];
                assert_true(sum / pca.total_variance <= 1.0);
                assert_true(pca.explained[k] <= 1.0);
            }
            srnf_pca_clear(&pca);
            srnf_free(mean);
        }
    }
    close_model(&m);
}

static void signs_are_fixed(void **state)
{
    struct model m;
    struct srnf_pca again;

    (void)state;
    open_model(&m, 0);
    assert_true(compare_finite(N * m.pca.components, m.pca.scores));
    for (size_t k = 0; k < m.pca.components; k++) {
        double largest = 0.0;

        for (size_t i = 0; i < N; i++) {
            double s = m.pca.scores[i * m.pca.components + k];

            largest = fabs(s) > fabs(largest) ? s : largest;
        }
        assert_true(largest > 0.0);
    }
    assert_int_equal(srnf_pca_fit(m.g.grid, N, m.mean.mean_q, m.mean.registered_q, RANK, &again),
                     SRNF_OK);
    assert_int_equal(again.components, RANK);
    assert_memory_equal(again.modes, m.pca.modes, RANK * 3 * m.g.points * sizeof(double));
    assert_true(again.total_variance == m.pca.total_variance);
    srnf_pca_clear(&again);
    close_model(&m);
}

static void a_training_subject_has_its_own_scores(void **state)
{
    struct model m;

    (void)state;
    open_model(&m, 0);
    for (size_t i = 0; i < N; i++) {
        const double *q = m.mean.registered_q + i * 3 * m.g.points;
        double scores[N];
        double residual = NAN;
        double *back = shapes_doubles(3 * m.g.points);

        srnf_pca_project(m.g.grid, &m.pca, m.mean.mean_q, q, scores, &residual);
        for (size_t k = 0; k < m.pca.components; k++) {
            assert_true(scores[k] == m.pca.scores[i * m.pca.components + k]);
        }
        assert_true(residual <= 1e-13);
        srnf_pca_reconstruct(m.g.grid, &m.pca, m.mean.mean_q, scores, back);
        assert_true(compare_difference(3 * m.g.points, back, q) <= 1e-12);
        srnf_free(back);
    }
    close_model(&m);
}

/* Pythagoras: |q - mean|^2 = |scores|^2 + residual^2, with what the modes span left out. */
static void the_residual_is_what_is_left(void **state)
{
    struct test_random random = test_random_seed(3);
    struct model m;
    double *q;
    double *back;
    double scores[RANK];
    double residual = NAN;
    double square = 0.0;

    (void)state;
    open_model(&m, RANK);
    q = shapes_doubles(3 * m.g.points);
    back = shapes_doubles(3 * m.g.points);
    test_random_normals(&random, 3 * m.g.points, q);
    srnf_pca_project(m.g.grid, &m.pca, m.mean.mean_q, q, scores, &residual);
    for (size_t k = 0; k < RANK; k++) {
        square += scores[k] * scores[k];
    }
    square += residual * residual;
    assert_true(fabs(square / stats_distance2(m.g.grid, q, m.mean.mean_q) - 1.0) <= 1e-13);
    srnf_pca_reconstruct(m.g.grid, &m.pca, m.mean.mean_q, scores, back);
    assert_true(fabs(sqrt(stats_distance2(m.g.grid, q, back)) / residual - 1.0) <= 1e-13);
    srnf_free(back);
    srnf_free(q);
    close_model(&m);
}

/* Fields in a space of RANK dimensions: no more components than that; equal ones: none. */
static void finds_the_rank(void **state)
{
    struct test_random random = test_random_seed(4);
    struct model m;
    struct srnf_pca pca;
    size_t size;
    double *q;
    double *mean;

    (void)state;
    open_model(&m, RANK);
    size = 3 * m.g.points;
    q = shapes_doubles(N * size);
    mean = shapes_doubles(size);
    for (size_t i = 0; i < N; i++) {
        double scores[RANK];

        test_random_normals(&random, RANK, scores);
        srnf_pca_reconstruct(m.g.grid, &m.pca, m.mean.mean_q, scores, q + i * size);
    }
    stats_average(m.g.grid, N, q, mean);
    assert_int_equal(srnf_pca_fit(m.g.grid, N, mean, q, 0, &pca), SRNF_OK);
    assert_int_equal(pca.components, RANK);
    srnf_pca_clear(&pca);
    for (size_t i = 0; i < N; i++) {
        memcpy(q + i * size, m.mean.mean_q, size * sizeof(double));
    }
    stats_average(m.g.grid, N, q, mean);
    assert_int_equal(srnf_pca_fit(m.g.grid, N, mean, q, 0, &pca), SRNF_OK);
    assert_int_equal(pca.components, 0);
    srnf_pca_clear(&pca);
    srnf_free(mean);
    srnf_free(q);
    close_model(&m);
}

/* Drawn, reconstructed, projected: the covariance of what comes back is diag(eigenvalues), each
   entry within five of its standard errors. */
static void samples_have_the_covariance_of_the_model(void **state)
{
    struct model m;
    double *drawn;
    double *back;
    double *q;
    double worst = 0.0;

    (void)state;
    open_model(&m, RANK);
    drawn = shapes_doubles(SAMPLES * RANK);
    back = shapes_doubles(SAMPLES * RANK);
    q = shapes_doubles(3 * m.g.points);
    srnf_pca_sample(&m.pca, 11, SAMPLES, RANK, drawn);
    for (size_t i = 0; i < SAMPLES; i++) {
        srnf_pca_reconstruct(m.g.grid, &m.pca, m.mean.mean_q, drawn + i * RANK, q);
        srnf_pca_project(m.g.grid, &m.pca, m.mean.mean_q, q, back + i * RANK, NULL);
    }
    assert_true(compare_difference(SAMPLES * RANK, drawn, back) <= 1e-13);
    for (size_t a = 0; a < RANK; a++) {
        for (size_t b = 0; b <= a; b++) {
            double scale = sqrt(m.pca.eigenvalues[a] * m.pca.eigenvalues[b]);
            double error = sqrt((a == b ? 2.0 : 1.0) / (double)SAMPLES);
            double sum = 0.0;

            for (size_t i = 0; i < SAMPLES; i++) {
                sum += back[i * RANK + a] * back[i * RANK + b] / (double)SAMPLES;
            }
            worst = compare_max(worst, fabs(sum / scale - (a == b ? 1.0 : 0.0)) / error);
        }
    }
    figure_below("covariance off the model, in standard errors", worst, 5.0);
    srnf_free(q);
    srnf_free(back);
    srnf_free(drawn);
    close_model(&m);
}

/* ---- The largest components of a large group ------------------------------------------------- */

#define MANY ((size_t)100)
#define LARGEST ((size_t)12)

/* Fields without much structure: a slope of variances that no few components exhaust. mean_q:
   their average. */
static double *open_many(const struct group *g, double *mean_q)
{
    struct test_random random = test_random_seed(5);
    size_t size = 3 * g->points;
    double *q = shapes_doubles(MANY * size);

    for (size_t i = 0; i < MANY * size; i++) {
        q[i] = test_random_uniform(&random, -1.0, 1.0) / (1.0 + 0.2 * (double)(i % size));
    }
    stats_average(g->grid, MANY, q, mean_q);
    return q;
}

/* As many as there are: those of the Gram matrix. */
static void the_largest_are_those_of_the_gram_matrix(void **state)
{
    double bounds[MANY], values = 0.0, kept = 0.0;
    struct srnf_pca gram, largest;
    struct group g;
    double *mean_q, *q;

    (void)state;
    group_open_stars(&g, DEGREE, 1, 0.0);
    mean_q = shapes_doubles(3 * g.points);
    q = open_many(&g, mean_q);
    assert_int_equal(srnf_pca_fit(g.grid, MANY, mean_q, q, LARGEST, &gram), SRNF_OK);
    assert_int_equal(srnf_pca_fit_largest(g.grid, MANY, mean_q, q, LARGEST, NULL, &largest, bounds),
                     SRNF_OK);
    assert_int_equal(largest.components, LARGEST);
    assert_true(fabs(largest.total_variance / gram.total_variance - 1.0) <= 1e-13);
    for (size_t k = 0; k < LARGEST; k++) {
        values = compare_max(values, fabs(largest.eigenvalues[k] / gram.eigenvalues[k] - 1.0));
        for (size_t i = 0; i < MANY; i++) {
            kept = compare_max(
                kept, fabs(largest.scores[i * LARGEST + k] - gram.scores[i * LARGEST + k]) /
                          sqrt(gram.eigenvalues[0]));
        }
        assert_true(bounds[k] <= 1e-12 * gram.eigenvalues[0]);
    }
    figure_below("eigenvalues off those of the Gram matrix", values, 1e-10);
    figure_below("scores off those of the Gram matrix", kept, 1e-10);
    srnf_pca_clear(&gram);
    srnf_pca_clear(&largest);
    srnf_free(q);
    srnf_free(mean_q);
    group_close(&g);
}

/* All of few, in one round; and the bounds hold there too, to rounding. */
static void the_largest_may_be_all(void **state)
{
    double bounds[N];
    struct srnf_pca largest;
    struct model m;

    (void)state;
    open_model(&m, 0);
    assert_int_equal(srnf_pca_fit_largest(m.g.grid, N, m.mean.mean_q, m.mean.registered_q, N, NULL,
                                          &largest, bounds),
                     SRNF_OK);
    assert_int_equal(largest.components, N - 1);
    for (size_t k = 0; k < N - 1; k++) {
        assert_true(fabs(largest.eigenvalues[k] - m.pca.eigenvalues[k]) <=
                    bounds[k] + 1e-12 * m.pca.eigenvalues[0]);
    }
    srnf_pca_clear(&largest);
    close_model(&m);
}

/* Fields without any structure, whose eigenvalues lie so near that forty rounds do not settle: each
   value is off an eigenvalue by no more than its bound says, which is far above rounding here, and
   above none that it stands for. */
static void bounds_hold_where_nothing_settles(void **state)
{
    double bounds[LARGEST], tightest = 0.0, widest = 0.0;
    struct test_random random = test_random_seed(7);
    struct srnf_pca gram, largest;
    struct group g;
    double *mean_q, *q;

    (void)state;
    group_open_stars(&g, DEGREE, 1, 0.0);
    mean_q = shapes_doubles(3 * g.points);
    q = shapes_doubles(MANY * 3 * g.points);
    for (size_t i = 0; i < MANY * 3 * g.points; i++) {
        q[i] = test_random_uniform(&random, -1.0, 1.0);
    }
    stats_average(g.grid, MANY, q, mean_q);
    assert_int_equal(srnf_pca_fit(g.grid, MANY, mean_q, q, 0, &gram), SRNF_OK);
    assert_int_equal(srnf_pca_fit_largest(g.grid, MANY, mean_q, q, LARGEST, NULL, &largest, bounds),
                     SRNF_OK);
    assert_int_equal(largest.components, LARGEST);
    for (size_t k = 0; k < LARGEST; k++) {
        double off = INFINITY;

        for (size_t j = 0; j < gram.components; j++) {
            off = compare_min(off, fabs(largest.eigenvalues[k] - gram.eigenvalues[j]));
        }
        assert_true(off <= bounds[k] + 1e-13 * gram.eigenvalues[0]);
        assert_true(largest.eigenvalues[k] <= gram.eigenvalues[k] * (1.0 + 1e-13));
        tightest = compare_max(tightest, off / bounds[k]);
        widest = compare_max(widest, bounds[k] / gram.eigenvalues[0]);
    }
    printf("# bounds up to %.1e of the largest eigenvalue; off by up to %.2f of a bound\n", widest,
           tightest);
    assert_true(widest > 1e-6);
    srnf_pca_clear(&gram);
    srnf_pca_clear(&largest);
    srnf_free(q);
    srnf_free(mean_q);
    group_close(&g);
}

static void the_largest_do_not_depend_on_threads(void **state)
{
    struct srnf_pca first = {0};
    double bounds[LARGEST];
    struct group g;
    double *mean_q, *q;

    (void)state;
    group_open_stars(&g, DEGREE, 1, 0.0);
    mean_q = shapes_doubles(3 * g.points);
    q = open_many(&g, mean_q);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        struct srnf_pca pca;

        assert_int_equal(
            srnf_pca_fit_largest(g.grid, MANY, mean_q, q, LARGEST, &context, &pca, bounds),
            SRNF_OK);
        if (s == 0) {
            first = pca;
            continue;
        }
        assert_memory_equal(pca.scores, first.scores, MANY * LARGEST * sizeof(double));
        assert_memory_equal(pca.modes, first.modes, LARGEST * 3 * g.points * sizeof(double));
        srnf_pca_clear(&pca);
    }
    srnf_pca_clear(&first);
    srnf_free(q);
    srnf_free(mean_q);
    group_close(&g);
}

static void refuses_what_it_cannot_take(void **state)
{
    double bounds[N + 1];
    struct model m;
    struct srnf_pca pca;

    (void)state;
    open_model(&m, RANK);
    assert_int_equal(srnf_pca_fit(m.g.grid, 1, m.mean.mean_q, m.mean.registered_q, 0, &pca),
                     SRNF_EINVAL);
    assert_int_equal(srnf_pca_fit_largest(m.g.grid, 1, m.mean.mean_q, m.mean.registered_q, 1, NULL,
                                          &pca, bounds),
                     SRNF_EINVAL);
    assert_int_equal(srnf_pca_fit_largest(m.g.grid, N, m.mean.mean_q, m.mean.registered_q, N + 1,
                                          NULL, &pca, bounds),
                     SRNF_EINVAL);
    m.mean.registered_q[17] = INFINITY;
    assert_int_equal(srnf_pca_fit_largest(m.g.grid, N, m.mean.mean_q, m.mean.registered_q, 2, NULL,
                                          &pca, bounds),
                     SRNF_EINVAL);
    assert_null(pca.modes);
    assert_int_equal(srnf_pca_fit(m.g.grid, N, m.mean.mean_q, m.mean.registered_q, 0, &pca),
                     SRNF_EINVAL);
    assert_null(pca.modes);
    close_model(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(modes_are_orthonormal),
        cmocka_unit_test(residuals_are_those_of_each),
        cmocka_unit_test(eigenvalues_are_the_variances),
        cmocka_unit_test(no_share_is_above_one),
        cmocka_unit_test(signs_are_fixed),
        cmocka_unit_test(a_training_subject_has_its_own_scores),
        cmocka_unit_test(the_residual_is_what_is_left),
        cmocka_unit_test(finds_the_rank),
        cmocka_unit_test(samples_have_the_covariance_of_the_model),
        cmocka_unit_test(the_largest_are_those_of_the_gram_matrix),
        cmocka_unit_test(the_largest_may_be_all),
        cmocka_unit_test(bounds_hold_where_nothing_settles),
        cmocka_unit_test(the_largest_do_not_depend_on_threads),
        cmocka_unit_test(refuses_what_it_cannot_take),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_quality.c - compactness, generalisation and specificity against their definitions, each done
 * the long way with the public functions; and what every long computation promises.
 */
#include "group.h"

#define DEGREE 6
#define N ((size_t)6)
#define K ((size_t)3)
#define SAMPLES ((size_t)12)
#define SEED 20

struct judged {
    struct group g;
    struct srnf_mean mean;
};

static void open_judged(struct judged *j)
{
    group_open_stars(&j->g, DEGREE, N, 0.3);
    assert_int_equal(srnf_karcher_mean(j->g.sht, N, j->g.surfaces, NULL, NULL, &j->mean, NULL),
                     SRNF_OK);
}

static void close_judged(struct judged *j)
{
    srnf_mean_clear(&j->mean);
    group_close(&j->g);
}

static int judge(const struct judged *j, size_t n, const struct srnf_quality_options *options,
                 const struct srnf_context *context, struct srnf_quality *quality,
                 struct srnf_error *error)
{
    return srnf_model_quality(j->g.sht, n, j->mean.coefficients, j->mean.mean_q,
                              j->mean.registered_q, options, context, quality, error);
}

static struct srnf_quality_options few(void)
{
    struct srnf_quality_options options = srnf_quality_options_defaults();

    options.components = K;
    options.samples = SAMPLES;
    options.seed = SEED;
    return options;
}

/* The surface of a q, searched from the mean surface: values on the grid, double[3][P]. */
static void surface_of(const struct judged *j, const double *q, double *values)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion inversion;
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(j->g.sht, 3));

    assert_non_null(workspace);
    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = j->mean.coefficients;
    options.certify = false;
    assert_true(srnf_invert(j->g.sht, q, &options, NULL, &inversion, NULL) >= 0);
    srnf_sht_synthesis(j->g.sht, 3, inversion.coefficients, values, workspace);
    srnf_inversion_clear(&inversion);
    srnf_free(workspace);
}

/* Surface distance by its definition: area weights of the mean, best translation. */
static double surface_distance(const struct judged *j, const double *a, const double *b)
{
    double *q = shapes_doubles(3 * j->g.points);
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(j->g.sht));
    double shift[3] = {0.0, 0.0, 0.0};
    double area = 0.0;
    double sum = 0.0;

    assert_non_null(workspace);
    srnf_field(j->g.sht, j->mean.coefficients, q, workspace);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t p = 0; p < j->g.points; p++) {
            double weight = 0.0;

            for (size_t c = 0; c < 3; c++) {
                weight += q[c * j->g.points + p] * q[c * j->g.points + p];
            }
            weight *= j->g.grid->weight[p / j->g.grid->n_phi];
            area += pass == 0 ? weight : 0.0;
            for (size_t c = 0; c < 3; c++) {
                double d = a[c * j->g.points + p] - b[c * j->g.points + p];

                if (pass == 0) {
                    shift[c] += weight * d;
                } else {
                    sum += weight * (d - shift[c] / area) * (d - shift[c] / area);
                }
            }
        }
    }
    srnf_free(workspace);
    srnf_free(q);
    return sqrt(sum / area);
}

/* Every subject twice, the second time the same: generalisation, its error and the share of the
   variance are those of one of each, and so is the error of that. */
static void repeated_subjects_count_once(void **state)
{
    struct srnf_quality_options options = few();
    struct srnf_quality once;
    struct srnf_quality twice;
    struct srnf_error error = {0};
    size_t subjects[2 * N];
    double worst = 0.0;
    struct judged j;
    size_t size;
    double *q;

    (void)state;
    open_judged(&j);
    size = 3 * j.g.points;
    q = shapes_doubles(2 * N * size);
    for (size_t i = 0; i < 2 * N; i++) {
        subjects[i] = i % N;
        memcpy(q + i * size, j.mean.registered_q + i % N * size, size * sizeof(double));
    }
    options.samples = 2;
    assert_int_equal(judge(&j, N, &options, NULL, &once, NULL), SRNF_OK);
    options.subjects = subjects;
    assert_int_equal(srnf_model_quality(j.g.sht, 2 * N, j.mean.coefficients, j.mean.mean_q, q,
                                        &options, NULL, &twice, NULL),
                     SRNF_OK);
    assert_int_equal(twice.n, 2 * N);
    assert_int_equal(twice.subjects, N);
    for (size_t k = 0; k < K; k++) {
        const double d[] = {
            twice.generalisation.value[k] / once.generalisation.value[k],
            twice.generalisation.standard_error[k] / once.generalisation.standard_error[k],
            twice.generalisation_elastic.value[k] / once.generalisation_elastic.value[k],
            twice.compactness.value[k] / once.compactness.value[k],
            twice.compactness.standard_error[k] / once.compactness.standard_error[k],
        };

        for (size_t i = 0; i < sizeof d / sizeof d[0]; i++) {
            worst = compare_max(worst, fabs(d[i] - 1.0));
        }
    }
    figure_below("curves with subjects twice, relative", worst, 1e-6);
    srnf_quality_clear(&twice);
    options.components = 2 * N - 2;
    assert_int_equal(srnf_model_quality(j.g.sht, 2 * N, j.mean.coefficients, j.mean.mean_q, q,
                                        &options, NULL, &twice, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "at most"));
    for (size_t i = 0; i < 2 * N; i++) {
        subjects[i] = i % 2;
    }
    options.components = 1;
    assert_int_equal(srnf_model_quality(j.g.sht, 2 * N, j.mean.coefficients, j.mean.mean_q, q,
                                        &options, NULL, &twice, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "2 subjects"));
    srnf_quality_clear(&once);
    srnf_free(q);
    close_judged(&j);
}

static void compactness_is_the_share_of_variance(void **state)
{
    struct srnf_quality_options options = few();
    struct judged j;
    struct srnf_quality quality;
    struct srnf_pca pca;
    double share = 0.0;

    (void)state;
    open_judged(&j);
    assert_int_equal(judge(&j, N, &options, NULL, &quality, NULL), SRNF_OK);
    assert_int_equal(srnf_pca_fit(j.g.grid, N, j.mean.mean_q, j.mean.registered_q, 0, &pca),
                     SRNF_OK);
    assert_int_equal(quality.n, N);
    assert_int_equal(quality.components, K);
    for (size_t k = 0; k < K; k++) {
        double before = k > 0 ? quality.compactness.value[k - 1] : 0.0;
        double step = 1e-6;
        double variance = 0.0;

        share += pca.explained[k];
        assert_true(fabs(quality.compactness.value[k] - share) < 1e-13);
        assert_true(quality.compactness.value[k] > before && share < 1.0);
        /* The first-order error by differences of the share in each eigenvalue. */
        for (size_t i = 0; i < pca.components; i++) {
            double moved = step * pca.eigenvalues[i];
            double total = pca.total_variance + moved;
            double slope =
                ((share * pca.total_variance + (i <= k ? moved : 0.0)) / total - share) / step;

            variance += 2.0 * slope * slope / (double)(N - 1);
        }
        assert_true(fabs(quality.compactness.standard_error[k] / sqrt(variance) - 1.0) < 1e-4);
    }
    srnf_pca_clear(&pca);
    srnf_quality_clear(&quality);
    close_judged(&j);
}

/* Fits the model to all but one, projects that one, and measures what k components leave. */
static void leave_out(const struct judged *j, size_t out, size_t k, double *surface,
                      double *elastic)
{
    size_t size = 3 * j->g.points;
    double *others = shapes_doubles((N - 1) * size);
    double *mean_q = shapes_doubles(size);
    double *q = shapes_doubles(size);
    double *values = shapes_doubles(2 * size);
    double scores[N];
    struct srnf_pca pca;

    for (size_t i = 0, at = 0; i < N; i++) {
        if (i != out) {
            memcpy(others + at++ * size, j->mean.registered_q + i * size, size * sizeof(double));
        }
    }
    stats_average(j->g.grid, N - 1, others, mean_q);
    assert_int_equal(srnf_pca_fit(j->g.grid, N - 1, mean_q, others, k, &pca), SRNF_OK);
    srnf_pca_project(j->g.grid, &pca, mean_q, j->mean.registered_q + out * size, scores, elastic);
    srnf_pca_reconstruct(j->g.grid, &pca, mean_q, scores, q);
    surface_of(j, q, values);
    surface_of(j, j->mean.registered_q + out * size, values + size);
    *surface = surface_distance(j, values, values + size);
    srnf_pca_clear(&pca);
    srnf_free(values);
    srnf_free(q);
    srnf_free(mean_q);
    srnf_free(others);
}

static void check_average(const double *x, size_t m, double value, double standard_error,
                          double tolerance)
{
    double mean = 0.0;
    double square = 0.0;

    for (size_t i = 0; i < m; i++) {
        mean += x[i] / (double)m;
    }
    for (size_t i = 0; i < m; i++) {
        square += (x[i] - mean) * (x[i] - mean);
    }
    assert_true(fabs(value / mean - 1.0) < tolerance);
    assert_true(fabs(standard_error / sqrt(square / (double)(m * (m - 1))) - 1.0) <
                10.0 * tolerance);
}

static void generalisation_is_leave_one_out(void **state)
{
    struct srnf_quality_options options = few();
    struct judged j;
    struct srnf_quality quality;

    (void)state;
    open_judged(&j);
    assert_int_equal(judge(&j, N, &options, NULL, &quality, NULL), SRNF_OK);
    for (size_t k = 0; k < K; k++) {
        double surface[N];
        double elastic[N];

        for (size_t i = 0; i < N; i++) {
            leave_out(&j, i, k + 1, &surface[i], &elastic[i]);
        }
        printf("# %zu components: generalisation %.4f +- %.4f, elastic %.4f; specificity %.4f +- "
               "%.4f\n",
               k + 1, quality.generalisation.value[k], quality.generalisation.standard_error[k],
               quality.generalisation_elastic.value[k], quality.specificity.value[k],
               quality.specificity.standard_error[k]);
        check_average(elastic, N, quality.generalisation_elastic.value[k],
                      quality.generalisation_elastic.standard_error[k], 1e-9);
        /* Two searches from different starts end at the same surface up to their tolerance. */
        check_average(surface, N, quality.generalisation.value[k],
                      quality.generalisation.standard_error[k], 1e-3);
        assert_true(k == 0 || quality.generalisation_elastic.value[k] <=
                                  quality.generalisation_elastic.value[k - 1]);
    }
    srnf_quality_clear(&quality);
    close_judged(&j);
}

static void specificity_is_the_nearest_subject(void **state)
{
    struct srnf_quality_options options = few();
    size_t k = K; /* with all components that are asked for */
    double surface[SAMPLES];
    double elastic[SAMPLES];
    double scores[SAMPLES * K];
    struct judged j;
    struct srnf_quality quality;
    struct srnf_pca pca;
    double *values;
    size_t size;

    (void)state;
    open_judged(&j);
    size = 3 * j.g.points;
    values = shapes_doubles(3 * size);
    assert_int_equal(judge(&j, N, &options, NULL, &quality, NULL), SRNF_OK);
    assert_int_equal(srnf_pca_fit(j.g.grid, N, j.mean.mean_q, j.mean.registered_q, k, &pca),
                     SRNF_OK);
    srnf_pca_sample(&pca, SEED, SAMPLES, K, scores);
    for (size_t s = 0; s < SAMPLES; s++) {
        double *q = values + 2 * size;

        srnf_pca_reconstruct(j.g.grid, &pca, j.mean.mean_q, scores + s * K, q);
        surface_of(&j, q, values);
        surface[s] = elastic[s] = INFINITY;
        for (size_t i = 0; i < N; i++) {
            const double *own = j.mean.registered_q + i * size;

            elastic[s] = compare_min(elastic[s], sqrt(stats_distance2(j.g.grid, q, own)));
            surface_of(&j, own, values + size);
            surface[s] = compare_min(surface[s], surface_distance(&j, values, values + size));
        }
    }
    check_average(elastic, SAMPLES, quality.specificity_elastic.value[K - 1],
                  quality.specificity_elastic.standard_error[K - 1], 1e-9);
    check_average(surface, SAMPLES, quality.specificity.value[K - 1],
                  quality.specificity.standard_error[K - 1], 1e-3);
    srnf_pca_clear(&pca);
    srnf_quality_clear(&quality);
    srnf_free(values);
    close_judged(&j);
}

static bool equal_curves(const struct srnf_curve *a, const struct srnf_curve *b)
{
    return memcmp(a->value, b->value, K * sizeof(double)) == 0 &&
           memcmp(a->standard_error, b->standard_error, K * sizeof(double)) == 0;
}

static void results_do_not_depend_on_threads(void **state)
{
    struct srnf_quality_options options = few();
    struct judged j;
    struct srnf_quality alone;

    (void)state;
    open_judged(&j);
    assert_int_equal(judge(&j, N, &options, NULL, &alone, NULL), SRNF_OK);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        struct srnf_quality quality;

        assert_int_equal(judge(&j, N, &options, &context, &quality, NULL), SRNF_OK);
        assert_true(equal_curves(&alone.compactness, &quality.compactness));
        assert_true(equal_curves(&alone.generalisation, &quality.generalisation));
        assert_true(equal_curves(&alone.specificity, &quality.specificity));
        assert_true(equal_curves(&alone.generalisation_elastic, &quality.generalisation_elastic));
        assert_true(equal_curves(&alone.specificity_elastic, &quality.specificity_elastic));
        assert_true(atomic_load(&watch.reports) >= N + N + SAMPLES);
        assert_true(atomic_load(&watch.highest) > 0.999);
        srnf_quality_clear(&quality);
    }
    srnf_quality_clear(&alone);
    close_judged(&j);
}

static void stops_when_asked(void **state)
{
    struct srnf_quality_options options = few();
    struct judged j;

    (void)state;
    open_judged(&j);
    for (size_t after = 0; after < 2 * N + SAMPLES; after += 5) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, 2);
        struct srnf_quality quality = {0};

        watch.cancel_after = after;
        assert_int_equal(judge(&j, N, &options, &context, &quality, NULL), SRNF_ECANCELED);
        assert_null(quality.compactness.value);
    }
    close_judged(&j);
}

static void wrong_input_is_refused(void **state)
{
    static const struct {
        size_t n, components, samples;
        const char *says;
    } wrong[] = {{2, 0, 10, "2 surfaces"},
                 {N, N - 1, 10, "components is 5"},
                 {N, 2, 1, "samples is 1"},
                 {N, 2, 100001, "samples is 100001"}};
    struct srnf_quality_options options = few();
    struct srnf_quality quality = {0};
    struct srnf_error error = {0};
    struct judged j;

    (void)state;
    open_judged(&j);
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        options.components = wrong[i].components;
        options.samples = wrong[i].samples;
        assert_int_equal(judge(&j, wrong[i].n, &options, NULL, &quality, &error), SRNF_EINVAL);
        assert_non_null(strstr(error.message, wrong[i].says));
    }
    options = few();
    j.mean.registered_q[5] = NAN;
    assert_int_equal(judge(&j, N, &options, NULL, &quality, &error), SRNF_EINVAL);
    for (size_t i = 0; i < N; i++) { /* all the same */
        memcpy(j.mean.registered_q + i * 3 * j.g.points, j.mean.mean_q,
               3 * j.g.points * sizeof(double));
    }
    assert_int_equal(judge(&j, N, &options, NULL, &quality, &error), SRNF_EDEGENERATE);
    assert_non_null(strstr(error.message, "do not differ"));
    assert_null(quality.compactness.value);
    close_judged(&j);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(repeated_subjects_count_once),
        cmocka_unit_test(compactness_is_the_share_of_variance),
        cmocka_unit_test(generalisation_is_leave_one_out),
        cmocka_unit_test(specificity_is_the_nearest_subject),
        cmocka_unit_test(results_do_not_depend_on_threads),
        cmocka_unit_test(stops_when_asked),
        cmocka_unit_test(wrong_input_is_refused),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

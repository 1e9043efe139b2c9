/*
 * test_classify_allocation.c - metrics, comparisons and classifiers when memory runs out: each
 * allocation in turn is refused; the call fails cleanly and nothing leaks.
 * srnfd-test: slow
 */
#include "classes.h"
#include "support/refusing.h"

#define N ((size_t)7)
#define COMPARED ((size_t)4)
#define DEGREE 5
#define EACH (FIGURES_SLOW ? (size_t)60 : (size_t)200) /* refused one by one, before strides */

/* What the runs work on. */
static struct group g;
static struct srnf_folds planted;
static struct srnf_folds_options options;
static struct srnf_register_options registration;
static size_t labels[N];
static enum srnf_metric metric;

static int run_metric(void)
{
    double matrix[9];

    return srnf_metric_distances(g.sht, metric, 3, g.surfaces, &registration, NULL, matrix, NULL);
}

static int run_comparison(void)
{
    struct srnf_folds c;
    int status = srnf_folds_compare(g.sht, metric, COMPARED, g.surfaces, &options, NULL, &c, NULL);

    if (status >= 0) {
        srnf_folds_clear(&c);
    }
    assert_null(c.distances);
    return status;
}

/* Two parts of planted products, of which two members are of one subject. */
static int run_join(void)
{
    static const double weights[] = {1.0, 2.0};
    static double values[N * N];
    static double *products[N] = {values};
    static size_t templates[N], subjects[N] = {0, 0, 1, 2, 3, 4, 5};
    const struct srnf_folds parts[2] = {
        {.n = N, .subjects = subjects, .templates = templates, .products = products},
        {.n = N, .subjects = subjects, .templates = templates, .products = products}};
    struct srnf_folds joint;
    int status;

    for (size_t k = 0; k < N * N; k++) {
        values[k] = (k % (N + 1) == 0) + 0.1 * (double)((k % N + 1) * (k / N + 1));
    }
    status = srnf_folds_join(2, parts, weights, NULL, 0.0, 3, NULL, &joint, NULL);
    if (status >= 0) {
        srnf_folds_clear(&joint);
    }
    assert_null(joint.scores);
    return status;
}

static int run_classifier(bool gauss)
{
    static const double size[N] = {0.0, 1.0, 0.3, 0.7, 0.2, 0.1, 0.5};
    struct srnf_classify_options o = srnf_classify_options_defaults();
    struct srnf_classification r;
    int status;

    o.permutations = 3;
    o.relabellings = 2;
    o.log_scale = size;
    status = (gauss ? srnf_classify_gauss : srnf_classify_nearest)(&planted, labels, 2, &o, NULL,
                                                                   &r, NULL);
    if (status >= 0) {
        srnf_classification_clear(&r);
    }
    assert_null(r.predicted);
    return status;
}

/* Two methods that share a metric, with sizes. */
static int run_methods(void)
{
    static const struct srnf_method methods[] = {
        {.name = "one", .metric = SRNF_METRIC_HARMONIC},
        {.name = "other", .metric = SRNF_METRIC_HARMONIC},
    };
    static const double scales[N] = {1.0, 2.0, 1.0, 3.0, 1.0, 2.0, 1.0};
    struct srnf_methods_inputs inputs = {.n = N,
                                         .surfaces = g.surfaces,
                                         .scales = scales,
                                         .labels = labels,
                                         .n_classes = 2,
                                         .n_methods = 2,
                                         .methods = methods,
                                         .comparison = srnf_folds_options_defaults(),
                                         .classifier = srnf_classify_options_defaults(),
                                         .alpha = 0.05};
    struct srnf_classification results[2];
    struct srnf_folds_typicality typicality[2];
    const char *step = NULL;
    int status;

    inputs.classifier.relabellings = 1;
    status = srnf_classify_by_methods(g.sht, &inputs, NULL, results, typicality, NULL, &step, NULL);

    assert_non_null(step);
    for (size_t m = 0; m < 2; m++) {
        srnf_classification_clear(&results[m]);
        srnf_folds_typicality_clear(&typicality[m]);
    }
    return status;
}

static int run_counts(void)
{
    size_t counts[2], determined;

    return srnf_class_subjects(N, labels, NULL, 2, counts, &determined);
}

static int run_gauss(void)
{
    return run_classifier(true);
}

static int run_nearest(void)
{
    return run_classifier(false);
}

static void metrics_survive(void **state)
{
    (void)state;
    for (metric = SRNF_METRIC_HARMONIC; metric <= SRNF_METRIC_SPHARM; metric++) {
        refusing_sweep(srnf_metric_name(metric), run_metric, FIGURES_SLOW ? 12 : EACH, 7);
    }
}

static void comparisons_survive(void **state)
{
    (void)state;
    metric = SRNF_METRIC_SRM;
    refusing_sweep("comparison", run_comparison, EACH, 31);
    metric = SRNF_METRIC_HARMONIC;
    refusing_sweep("comparison without scores", run_comparison, FIGURES_SLOW ? 4 : EACH, 1);
}

static void classifiers_survive(void **state)
{
    (void)state;
    refusing_sweep("Gauss", run_gauss, EACH, 1);
    refusing_sweep("nearest", run_nearest, EACH, 1);
    planted.subjects = (size_t[N]){0, 0, 1, 2, 3, 4, 5};
    refusing_sweep("Gauss with a subject twice", run_gauss, EACH, 1);
    planted.subjects = NULL;
    refusing_sweep("methods with sizes", run_methods, 20, 7);
    refusing_sweep("subjects of classes", run_counts, EACH, 1);
    refusing_sweep("parts that are joined", run_join, EACH, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(metrics_survive),
        cmocka_unit_test(comparisons_survive),
        cmocka_unit_test(classifiers_survive),
    };
    int failed;

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    classes_two(N, 4, labels);
    group_open_stars(&g, DEGREE, N, 0.3);
    planted = classes_open(N, 2, 1.0, labels, 2);
    options = srnf_folds_options_defaults();
    options.registration.degree = 2;
    options.registration.common_pose = true;
    options.rounds = 2;
    registration = options.registration;
    failed = cmocka_run_group_tests(tests, NULL, NULL);
    classes_clear(&planted);
    group_close(&g);
    return failed;
}

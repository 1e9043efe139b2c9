/*
 * test_methods.c - classification by several methods at once against the same done one by one, its
 * progress, what is counted of classes, and what is refused.
 */
#include "group.h"

#define N ((size_t)8)
#define DEGREE 5

static const struct srnf_method methods[] = {
    {"spharm", SRNF_METRIC_SPHARM, false, 1.0, 0.5},
    {"harmonic", SRNF_METRIC_HARMONIC, false, 4.0, 0.5},
    {"spharm again", SRNF_METRIC_SPHARM, false, 1.0, 2.0},
};
#define METHODS (sizeof methods / sizeof methods[0])

static const size_t labels[N] = {0, 0, 0, 0, 1, 1, 1, 1};

/* Stars, the second half of them flattened. */
static void open_classes(struct group *g)
{
    group_open_stars(g, DEGREE, N, 0.2);
    for (size_t i = N / 2; i < N; i++) {
        for (size_t k = 0; k < g->each; k++) {
            g->f[i][2 * g->each + k] *= 0.6;
        }
    }
}

static struct srnf_methods_inputs inputs_of(const struct group *g, const double *scales)
{
    struct srnf_methods_inputs inputs = {.n = N,
                                         .surfaces = g->surfaces,
                                         .scales = scales,
                                         .labels = labels,
                                         .n_classes = 2,
                                         .n_methods = METHODS,
                                         .methods = methods,
                                         .comparison = srnf_folds_options_defaults(),
                                         .classifier = srnf_classify_options_defaults(),
                                         .alpha = 0.05};

    inputs.classifier.permutations = 5;
    return inputs;
}

struct answer {
    struct srnf_classification results[METHODS];
    struct srnf_folds_typicality typicality[METHODS];
    double pairs[N * N];
    const char *step;
    struct srnf_error error;
};

static int run(const struct group *g, const struct srnf_methods_inputs *inputs,
               const struct srnf_context *context, struct answer *answer)
{
    return srnf_classify_by_methods(g->sht, inputs, context, answer->results, answer->typicality,
                                    answer->pairs, &answer->step, &answer->error);
}

static void clear(struct answer *answer)
{
    for (size_t m = 0; m < METHODS; m++) {
        srnf_classification_clear(&answer->results[m]);
        srnf_folds_typicality_clear(&answer->typicality[m]);
    }
}

static void same_as_one_by_one(void **state)
{
    double scales[N], log_scale[N];
    struct srnf_methods_inputs inputs;
    struct answer answer;
    struct group g;
    (void)state;

    open_classes(&g);
    for (size_t i = 0; i < N; i++) {
        double *normalized = shapes_doubles(g.count);

        scales[i] = 1.0 + (double)i;
        assert_int_equal(srnf_normalize(g.sht, g.f[i], normalized, &log_scale[i]), SRNF_OK);
        log_scale[i] += log(scales[i]);
        srnf_free(normalized);
    }
    inputs = inputs_of(&g, scales);
    assert_int_equal(run(&g, &inputs, NULL, &answer), SRNF_OK);
    for (size_t m = 0; m < METHODS; m++) {
        struct srnf_classify_options options = inputs.classifier;
        struct srnf_classification alone;
        struct srnf_folds folds;

        options.log_scale = log_scale;
        assert_int_equal(srnf_folds_compare(g.sht, methods[m].metric, N, g.surfaces,
                                            &inputs.comparison, NULL, &folds, NULL),
                         SRNF_OK);
        assert_int_equal(srnf_classify_nearest(&folds, labels, 2, &options, NULL, &alone, NULL),
                         SRNF_OK);
        assert_true(compare_difference(2 * N, alone.evidence, answer.results[m].evidence) == 0.0);
        assert_true(alone.p_value == answer.results[m].p_value);
        assert_int_equal(alone.correct, answer.results[m].correct);
        assert_int_equal(answer.typicality[m].n, N);
        for (size_t i = 0; methods[m].metric == SRNF_METRIC_HARMONIC && i < N * N; i++) {
            size_t other = i % N * N + i / N; /* the first metric, though the second method */

            assert_true(answer.pairs[i] <= folds.distances[i]);
            assert_true(answer.pairs[i] == folds.distances[i] ||
                        answer.pairs[i] == folds.distances[other]);
        }
        srnf_classification_clear(&alone);
        srnf_folds_clear(&folds);
    }
    assert_int_equal(answer.results[1].correct, N);
    clear(&answer);
    group_close(&g);
}

/* Never back, and to the end; canceled, it says so. */
static double reached;
static void forward(void *user, double fraction, const char *message)
{
    (void)user;
    assert_non_null(message);
    assert_true(fraction >= reached - 1e-12 && fraction <= 1.0 + 1e-12);
    reached = fraction;
}

static bool is_over(void *user)
{
    return reached > *(const double *)user;
}

static void tells_progress(void **state)
{
    double end = 2.0;
    const struct srnf_context context = {.user = &end, .progress = forward, .canceled = is_over};
    struct srnf_methods_inputs inputs;
    struct answer answer;
    struct group g;
    (void)state;

    open_classes(&g);
    inputs = inputs_of(&g, NULL);
    reached = 0.0;
    assert_int_equal(run(&g, &inputs, &context, &answer), SRNF_OK);
    assert_true(fabs(reached - 1.0) < 1e-12);
    clear(&answer);
    reached = 0.0;
    end = 0.6; /* the comparison by harmonic is 4 of 8 */
    assert_int_equal(run(&g, &inputs, &context, &answer), SRNF_ECANCELED);
    assert_string_equal(answer.step, "comparing the surfaces");
    clear(&answer);
    group_close(&g);
}

static void counts_subjects(void **state)
{
    const size_t own[N] = {0, 0, 2, 3, 4, 5, 6, 7}, across[N] = {0, 1, 2, 3, 0, 1, 2, 3};
    const size_t wrong[N] = {0, 0, 0, 0, 1, 1, 1, 2}, beyond[N] = {0, 1, 2, 3, 4, 5, 6, N};
    size_t counts[2], determined;
    (void)state;

    assert_int_equal(srnf_class_subjects(N, labels, NULL, 2, counts, &determined), SRNF_OK);
    assert_true(counts[0] == 4 && counts[1] == 4 && determined == N - 2 - 1);
    assert_int_equal(srnf_class_subjects(N, labels, own, 2, counts, &determined), SRNF_OK);
    assert_true(counts[0] == 3 && counts[1] == 4 && determined == N - 1 - 2 - 1);
    assert_int_equal(srnf_class_subjects(N, labels, across, 2, counts, &determined), SRNF_OK);
    assert_true(counts[0] == 4 && counts[1] == 4 && determined == N - 2 - 2);
    assert_int_equal(srnf_class_subjects(2, labels, NULL, 1, counts, &determined), SRNF_OK);
    assert_int_equal(determined, 0);
    assert_int_equal(srnf_class_subjects(N, wrong, NULL, 2, counts, &determined), SRNF_EINVAL);
    assert_int_equal(srnf_class_subjects(N, labels, beyond, 2, counts, &determined), SRNF_EINVAL);
}

static void refuses(void **state)
{
    const size_t few[N] = {0, 0, 0, 0, 0, 0, 1, 1};
    double scales[N] = {1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0};
    struct srnf_methods_inputs inputs;
    struct answer answer;
    struct group g;
    (void)state;

    open_classes(&g);
    inputs = inputs_of(&g, scales);
    assert_int_equal(run(&g, &inputs, NULL, &answer), SRNF_EINVAL);
    assert_string_equal(answer.step, "measuring the surfaces");
    clear(&answer);
    inputs.scales = NULL;
    inputs.labels = few;
    assert_int_equal(run(&g, &inputs, NULL, &answer), SRNF_EINVAL);
    assert_string_equal(answer.step, "harmonic");
    clear(&answer);
    group_close(&g);
}

struct asked {
    size_t times, surfaces;
    double from, to;
};

static int decline(void *user, const struct srnf_field_search *search, struct srnf_error *error)
{
    struct asked *asked = user;

    (void)error;
    asked->times++;
    asked->surfaces += search->n;
    asked->from = compare_min(asked->from, search->from);
    asked->to = compare_max(asked->to, search->to);
    return SRNF_SEARCH_HERE;
}

/* Registrations are offered to the caller's other machines, with their share of the progress. */
static void offers_what_it_registers(void **state)
{
    static const struct srnf_method two[] = {{"srnf", SRNF_METRIC_SRNF, false, 3.0, 0.5},
                                             {"spharm", SRNF_METRIC_SPHARM, false, 1.0, 0.5}};
    struct asked asked = {.from = 1.0};
    const struct srnf_context context = {.user = &asked, .search = decline};
    struct srnf_methods_inputs inputs;
    struct answer answer;
    struct group g;

    (void)state;
    open_classes(&g);
    inputs = inputs_of(&g, NULL);
    inputs.methods = two;
    inputs.n_methods = 2;
    inputs.comparison.registration.degree = 3;
    inputs.comparison.registration.max_steps = 1;
    inputs.comparison.registration.start = SRNF_START_RIGID;
    assert_int_equal(run(&g, &inputs, &context, &answer), SRNF_OK);
    assert_true(asked.times > 0);
    assert_int_equal(asked.surfaces, N * asked.times);
    assert_true(asked.from >= 0.0 && asked.from < asked.to);
    assert_true(asked.to <= 3.0 / 5.0);
    for (size_t m = 0; m < 2; m++) {
        srnf_classification_clear(&answer.results[m]);
        srnf_folds_typicality_clear(&answer.typicality[m]);
    }
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_as_one_by_one),
        cmocka_unit_test(offers_what_it_registers),
        cmocka_unit_test(tells_progress),
        cmocka_unit_test(counts_subjects),
        cmocka_unit_test(refuses),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

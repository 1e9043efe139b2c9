/*
 * test_folds.c - comparisons that leave one subject out: what a fold knows of the subject left
 * out, scores against distances, sizes and threads that must not matter, and wrong arguments.
 *
 * srnfd-test: timeout 300
 * srnfd-test: slow
 * srnfd-test: no-asan (test_classify_allocation.c and api/test_standard.sh run its code)
 */
#include "group.h"

#include <fftw3.h>

#define DEGREE 5
#define N ((size_t)7)

static struct srnf_folds_options options;

static struct srnf_folds compare(const struct group *g, enum srnf_metric metric,
                                 enum srnf_refit refit)
{
    struct srnf_folds c;
    struct srnf_error error = {0};

    options.refit = refit;
    if (srnf_folds_compare(g->sht, metric, g->n, g->surfaces, &options, NULL, &c, &error)) {
        fail_msg("%s: %s", srnf_metric_name(metric), error.message);
    }
    return c;
}

/* Inner product of the scores of two subjects in a fold: what no choice of signs changes. */
static double product(const struct srnf_folds *c, size_t fold, size_t i, size_t j)
{
    const double *s = c->scores + fold * c->n * c->components;
    double sum = 0.0;

    for (size_t k = 0; k < c->components; k++) {
        sum += s[i * c->components + k] * s[j * c->components + k];
    }
    return sum;
}

/* Largest change of what the fold of subject `out` says of its training subjects, relative. */
static double change(const struct srnf_folds *a, const struct srnf_folds *b, size_t out)
{
    double worst = 0.0;
    double scale = 0.0;

    for (size_t i = 0; i < a->n; i++) {
        for (size_t j = 0; j < a->n && i != out; j++) {
            if (j != out) {
                double d = product(a, out, i, j) - product(b, out, i, j);

                worst = compare_max(worst, fabs(d));
                scale = compare_max(scale, fabs(product(a, out, i, j)));
            }
        }
    }
    return worst / scale;
}

/*
 * Nothing of the subject left out may be in its fold. It is replaced by quite another shape: what
 * the fold says of its training subjects stays the same to the last bit where it is refitted, and
 * does not where the registrations are shared.
 */
static void the_subject_left_out_leaves_no_trace(void **state)
{
    struct group g;
    struct shapes_surface other;

    (void)state;
    shapes_open(&other, DEGREE);
    shapes_fill(&other, shapes_ellipsoid, 2.0);
    for (size_t metric = 0; metric < 2; metric++) {
        struct srnf_folds before[2];
        double moved[2];

        group_open_stars(&g, DEGREE, N, 0.4);
        for (size_t refit = 0; refit < 2; refit++) {
            before[refit] = compare(&g, (enum srnf_metric)metric, (enum srnf_refit)refit);
        }
        memcpy(g.f[3], other.f, g.count * sizeof(double));
        for (size_t refit = 0; refit < 2; refit++) {
            struct srnf_folds after = compare(&g, (enum srnf_metric)metric, (enum srnf_refit)refit);

            moved[refit] = change(&before[refit], &after, 3);
            srnf_folds_clear(&after);
            srnf_folds_clear(&before[refit]);
        }
        printf("# %s: refitted %.2e, shared %.2e\n", srnf_metric_name((enum srnf_metric)metric),
               moved[SRNF_REFIT_FOLD], moved[SRNF_REFIT_SHARED]);
        assert_true(moved[SRNF_REFIT_FOLD] == 0.0);
        assert_true(moved[SRNF_REFIT_SHARED] >= 1e-4);
        group_close(&g);
    }
    shapes_close(&other);
}

/* Largest change of what a fold says of the members but those of subject `out`. */
static double change_of_others(const struct srnf_folds *a, const struct srnf_folds *b, size_t fold,
                               const size_t *subjects, size_t out)
{
    double worst = 0.0;
    double scale = 0.0;

    for (size_t i = 0; i < a->n; i++) {
        for (size_t j = 0; j < a->n; j++) {
            if (subjects[i] != out && subjects[j] != out) {
                double p = product(a, fold, i, j);
                double d = fabs(p - product(b, fold, i, j));

                worst = compare_max(worst, d);
                scale = compare_max(scale, fabs(p));
            }
        }
    }
    assert_true(isfinite(worst) && scale > 0.0);
    return worst / scale;
}

/*
 * Both members of a subject are replaced by other shapes: in the folds of both nothing of the
 * others changes, to the last bit, with one round and with two. In the fold of a subject of one
 * member it does, and it would if only one of the two were left out.
 */
static void a_subject_of_two_members_leaves_no_trace(void **state)
{
    const size_t subjects[N] = {4, 1, 1, 0, 5, 6, 4}; /* whose numbers do not matter */
    struct srnf_folds_options kept = options;
    struct shapes_surface other;

    (void)state;
    shapes_open(&other, DEGREE);
    for (size_t rounds = 1; rounds <= 2; rounds++) {
        struct srnf_folds before;
        struct srnf_folds after;
        struct group g;

        options.subjects = subjects;
        options.rounds = rounds;
        group_open_stars(&g, DEGREE, N, 0.4);
        before = compare(&g, SRNF_METRIC_SRNF, SRNF_REFIT_FOLD);
        assert_int_equal(before.components, N - 3);
        shapes_fill(&other, shapes_ellipsoid, 2.0);
        memcpy(g.f[0], other.f, g.count * sizeof(double));
        shapes_fill(&other, shapes_ellipsoid, 1.5);
        memcpy(g.f[6], other.f, g.count * sizeof(double));
        after = compare(&g, SRNF_METRIC_SRNF, SRNF_REFIT_FOLD);
        assert_true(change_of_others(&before, &after, 0, subjects, 4) == 0.0);
        assert_true(change_of_others(&before, &after, 6, subjects, 4) == 0.0);
        assert_true(change_of_others(&before, &after, 3, subjects, 4) >= 1e-4);
        assert_true(before.spread[0] == after.spread[0] && before.spread[6] == after.spread[6]);
        assert_memory_equal(after.scores, after.scores + 6 * N * after.components,
                            N * after.components * sizeof(double));
        srnf_folds_clear(&after);
        srnf_folds_clear(&before);

        options.subjects = NULL; /* only one of the two is left out: the other one is a trace */
        before = compare(&g, SRNF_METRIC_SRNF, SRNF_REFIT_FOLD);
        shapes_fill(&other, shapes_ellipsoid, 1.2);
        memcpy(g.f[6], other.f, g.count * sizeof(double));
        after = compare(&g, SRNF_METRIC_SRNF, SRNF_REFIT_FOLD);
        assert_true(change_of_others(&before, &after, 0, subjects, 4) >= 1e-4);
        srnf_folds_clear(&after);
        srnf_folds_clear(&before);
        group_close(&g);
    }
    options = kept;
    shapes_close(&other);
}

/* With all components, distances between training subjects are those of their scores; the one left
   out is farther than its scores say, by what the components cannot represent. */
static void scores_span_the_training_subjects(void **state)
{
    struct group g;
    struct srnf_folds c;
    double worst = 0.0;

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.4);
    c = compare(&g, SRNF_METRIC_SRNF, SRNF_REFIT_FOLD);
    assert_int_equal(c.components, N - 2);
    for (size_t fold = 0; fold < N; fold++) {
        double sum = 0.0;
        double mean = 0.0;

        for (size_t i = 0; i < N; i++) {
            double own = product(&c, fold, i, i) + product(&c, fold, fold, fold) -
                         2.0 * product(&c, fold, i, fold);

            assert_true(c.distances[fold * N + i] >= sqrt(compare_max(0.0, own)) * (1.0 - 1e-9));
            for (size_t j = 0; j < i && i != fold; j++) {
                if (j != fold) {
                    sum += product(&c, fold, i, i) + product(&c, fold, j, j) -
                           2.0 * product(&c, fold, i, j);
                }
            }
        }
        worst = compare_max(worst, fabs(sqrt(sum / 15.0) / c.spread[fold] - 1.0));
        for (size_t k = 0; k < c.components; k++) {
            mean = 0.0;
            for (size_t i = 0; i < N; i++) {
                mean += i == fold ? 0.0 : c.scores[(fold * N + i) * c.components + k];
            }
            worst = compare_max(worst, fabs(mean) / c.spread[fold]);
        }
    }
    figure_below("spread from scores, and their mean", worst, 1e-10);
    srnf_folds_clear(&c);
    group_close(&g);
}

/* Size and place of the subjects, and how folds are spread, change nothing. */
static void sizes_and_threads_do_not_matter(void **state)
{
    struct group g;
    struct srnf_folds first;

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.4);
    first = compare(&g, SRNF_METRIC_SRNF, SRNF_REFIT_FOLD);
    for (size_t t = 0; t < GROUP_SPREADS; t++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[t]);
        struct srnf_folds c;

        assert_int_equal(srnf_folds_compare(g.sht, SRNF_METRIC_SRNF, N, g.surfaces, &options,
                                            &context, &c, NULL),
                         SRNF_OK);
        assert_memory_equal(c.scores, first.scores, N * N * c.components * sizeof(double));
        assert_memory_equal(c.distances, first.distances, N * N * sizeof(double));
        assert_true(atomic_load(&watch.reports) > 0);
        srnf_folds_clear(&c);
        watch.cancel_after = 2;
        assert_int_equal(srnf_folds_compare(g.sht, SRNF_METRIC_SRNF, N, g.surfaces, &options,
                                            &context, &c, NULL),
                         SRNF_ECANCELED);
        assert_null(c.distances);
    }
    for (size_t k = 0; k < g.count; k++) {
        g.f[2][k] = 3.0 * g.f[2][k] + (k == 0 ? 1.0 : 0.0);
    }
    for (size_t metric = 0; metric <= SRNF_METRIC_SPHARM; metric += 2) {
        struct srnf_folds c = compare(&g, (enum srnf_metric)metric, SRNF_REFIT_FOLD);
        double worst = 0.0;

        if (metric == SRNF_METRIC_SRNF) {
            for (size_t i = 0; i < N * N; i++) {
                worst = compare_max(worst, fabs(c.distances[i] - first.distances[i]));
            }
            figure_below("distances with one subject three times as large", worst, 1e-8);
        } else {
            double matrix[N * N];
            const double *surfaces[N];
            double *normal = shapes_doubles(N * g.count);

            for (size_t i = 0; i < N; i++) {
                assert_int_equal(srnf_normalize(g.sht, g.f[i], normal + i * g.count, NULL),
                                 SRNF_OK);
                surfaces[i] = normal + i * g.count;
            }
            assert_int_equal(srnf_metric_distances(g.sht, (enum srnf_metric)metric, N, surfaces,
                                                   &options.registration, NULL, matrix, NULL),
                             SRNF_OK);
            assert_memory_equal(c.distances, matrix, sizeof matrix);
            assert_null(c.scores);
            srnf_free(normal);
        }
        srnf_folds_clear(&c);
    }
    srnf_folds_clear(&first);
    group_close(&g);
}

static void refused(const struct group *g, size_t n, const char *word)
{
    struct srnf_folds c;
    struct srnf_error error = {0};

    assert_int_equal(
        srnf_folds_compare(g->sht, SRNF_METRIC_SRNF, n, g->surfaces, &options, NULL, &c, &error),
        SRNF_EINVAL);
    assert_non_null(strstr(error.message, word));
    assert_null(c.distances);
}

static void wrong_arguments_are_refused(void **state)
{
    struct srnf_folds_options kept = options;
    struct group g;

    (void)state;
    group_open_stars(&g, DEGREE, 4, 0.4);
    refused(&g, 2, "2 surfaces");
    options.rounds = 0;
    refused(&g, 4, "rounds");
    options = kept;
    options.max_components = 65;
    refused(&g, 4, "max_components");
    options = kept;
    options.registration.exact = true;
    refused(&g, 4, "exact");
    options = kept;
    options.registration.degree = 0;
    refused(&g, 4, "degree");
    options = kept;
    options.subjects = (const size_t[]){1, 1, 2, 1};
    refused(&g, 4, "2 subjects");
    options.subjects = (const size_t[]){0, 1, 4, 3};
    refused(&g, 4, "subject 4 of member 2");
    options = kept;
    g.f[1][3] = NAN;
    refused(&g, 4, "surface 1");
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_subject_left_out_leaves_no_trace),
        cmocka_unit_test(a_subject_of_two_members_leaves_no_trace),
        cmocka_unit_test(scores_span_the_training_subjects),
        cmocka_unit_test(sizes_and_threads_do_not_matter),
        cmocka_unit_test(wrong_arguments_are_refused),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    options = srnf_folds_options_defaults();
    options.registration.degree = 3;
    options.registration.common_pose = true;
    options.rounds = 2;
    return cmocka_run_group_tests(tests, NULL, NULL);
}

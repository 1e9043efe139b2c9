/*
 * Distances that an earlier attempt has left: each registered pair is offered to be kept once, what
 * is recalled is taken as it is, what is no distance is computed, and a series changes with all
 * that its distances are computed from.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "group.h"

#define N 4
#define MEMBERS 6
#define SAMPLES 5
#define PAIRS (N * (N - 1) / 2)

struct attempt {
    uint64_t series;
    double values[PAIRS];
    bool there[PAIRS]; /* to be recalled */
    int kept[PAIRS], asked;
    bool strange; /* a series or an index that cannot be */
};

static bool recall(void *user, uint64_t series, uint64_t index, size_t count, double *value)
{
    struct attempt *attempt = user;

    attempt->asked++;
    attempt->strange = attempt->strange || count != 1;
    if (index >= PAIRS || !attempt->there[index] || series != attempt->series) {
        return false;
    }
    *value = attempt->values[index];
    return true;
}

static void keep(void *user, uint64_t series, uint64_t index, size_t count, const double *value)
{
    struct attempt *attempt = user;

    attempt->strange = attempt->strange || count != 1 || index >= PAIRS ||
                       (attempt->series != 0 && attempt->series != series);
    if (index < PAIRS) {
        attempt->series = series;
        attempt->values[index] = *value;
        attempt->kept[index]++;
    }
}

static void measure(const struct group *g, const struct srnf_register_options *options,
                    struct attempt *attempt, double matrix[N * N])
{
    const struct srnf_context context = {.user = attempt, .recall = recall, .keep = keep};
    struct srnf_error error;

    assert_int_equal(srnf_distances(g->sht, N, g->surfaces, options, &context, matrix, &error),
                     SRNF_OK);
    assert_false(attempt->strange);
}

static void pairs_are_kept_and_recalled(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct attempt first = {.series = 0}, second, third;
    double whole[N * N], again[N * N];
    struct group g;

    (void)state;
    options.reparameterization = false; /* quick */
    group_open_stars(&g, 4, N, 0.3);
    measure(&g, &options, &first, whole);
    for (size_t k = 0; k < PAIRS; k++) {
        size_t i, j;

        assert_int_equal(first.kept[k], 1);
        srnf_pair(k, &i, &j);
        assert_memory_equal(&first.values[k], &whole[i * N + j], sizeof(double));
    }
    /* All but two are recalled, one of them as what it is not, which is believed; and what is no
       distance is not. */
    second = (struct attempt){.series = first.series};
    memcpy(second.values, first.values, sizeof second.values);
    for (size_t k = 1; k < PAIRS; k++) {
        second.there[k] = true;
    }
    second.values[3] = 123.0;
    second.values[4] = NAN;
    second.values[5] = -1.0;
    measure(&g, &options, &second, again);
    assert_int_equal(second.kept[0] + second.kept[4] + second.kept[5], 3);
    assert_int_equal(second.kept[1] + second.kept[2] + second.kept[3], 0);
    assert_true(again[3] == 123.0 && again[3 * N] == 123.0); /* pair 3 is (0, 3) */
    again[3] = again[3 * N] = whole[3];
    assert_memory_equal(again, whole, sizeof whole);
    /* Another series is not mixed in. */
    third = first;
    third.series++;
    memset(third.there, true, sizeof third.there);
    memset(third.values, 0, sizeof third.values);
    memset(third.kept, 0, sizeof third.kept);
    {
        const struct srnf_context context = {.user = &third, .recall = recall};
        struct srnf_error error;

        assert_int_equal(srnf_distances(g.sht, N, g.surfaces, &options, &context, again, &error),
                         SRNF_OK);
    }
    assert_memory_equal(again, whole, sizeof whole);
    group_close(&g);
}

/* As parameterized a distance costs less than to keep it. */
static void only_registered_pairs_are_kept(void **state)
{
    struct attempt attempt = {.series = 0};
    double matrix[N * N];
    struct group g;

    (void)state;
    group_open_stars(&g, 4, N, 0.3);
    measure(&g, NULL, &attempt, matrix);
    assert_int_equal(attempt.asked, 0);
    assert_int_equal(attempt.series, 0);
    group_close(&g);
}

static void a_series_is_of_all_that_it_is_computed_from(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults(), other;
    uint64_t series[16];
    size_t n = 0;
    struct group g;

    (void)state;
    group_open_stars(&g, 4, N, 0.3);
    series[n++] = stats_series(g.sht, 0, N, g.surfaces, &options);
    assert_true(stats_series(g.sht, 0, N, g.surfaces, &options) == series[0]);
    series[n++] = stats_series(g.sht, 1, N, g.surfaces, &options);
    series[n++] = stats_series(g.sht, 0, N - 1, g.surfaces, &options);
#define WITH(member, value) \
    other = options;        \
    other.member = (value); \
    series[n++] = stats_series(g.sht, 0, N, g.surfaces, &other)
    WITH(representation, SRNF_REPRESENTATION_SRM);
    WITH(rotation, !options.rotation);
    WITH(reparameterization, !options.reparameterization);
    WITH(degree, options.degree + 1);
    WITH(penalty_jacobian, 2.0 * options.penalty_jacobian);
    WITH(penalty_displacement, 2.0 * options.penalty_displacement);
    WITH(start, options.start == 0 ? (enum srnf_register_start)1 : (enum srnf_register_start)0);
    WITH(common_pose, !options.common_pose);
    WITH(symmetric, !options.symmetric);
    WITH(exact, !options.exact);
    g.f[N - 1][g.count - 1] = nextafter(g.f[N - 1][g.count - 1], 9.0);
    series[n++] = stats_series(g.sht, 0, N, g.surfaces, &options);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            assert_true(series[i] != series[j]);
        }
    }
    group_close(&g);
}

/* ---- Parts of several numbers ---------------------------------------------------------------- */

#define PARTS_MAX 256

/* All parts that were kept and not given up, and which of them are recalled. */
struct keeper {
    struct {
        uint64_t series, index;
        size_t count;
        double *values;
    } parts[PARTS_MAX];
    size_t n, kept, recalled;
    bool (*there)(size_t part); /* NULL: nothing is recalled */
    const struct keeper *before;
};

static bool recall_part(void *user, uint64_t series, uint64_t index, size_t count, double *values)
{
    struct keeper *keeper = user;
    const struct keeper *before = keeper->before;

    for (size_t k = 0; before && k < before->n; k++) {
        if (before->parts[k].series == series && before->parts[k].index == index &&
            keeper->there(k)) {
            assert_int_equal(before->parts[k].count, count);
            memcpy(values, before->parts[k].values, count * sizeof(double));
            keeper->recalled++;
            return true;
        }
    }
    return false;
}

static void keep_part(void *user, uint64_t series, uint64_t index, size_t count,
                      const double *values)
{
    struct keeper *keeper = user;

    if (count > 0) {
        assert_true(keeper->n < PARTS_MAX);
        keeper->parts[keeper->n].series = series;
        keeper->parts[keeper->n].index = index;
        keeper->parts[keeper->n].count = count;
        keeper->parts[keeper->n].values = shapes_doubles(count);
        memcpy(keeper->parts[keeper->n++].values, values, count * sizeof(double));
        keeper->kept++;
    }
}

static void close_keeper(struct keeper *keeper)
{
    for (size_t k = 0; k < keeper->n; k++) {
        srnf_free(keeper->parts[k].values);
    }
}

static bool is_first_half(size_t part)
{
    return part < MEMBERS / 2;
}

static bool is_any(size_t part)
{
    (void)part;
    return true;
}

static void compare_folds(const struct group *g, struct keeper *keeper, struct srnf_folds *folds)
{
    const struct srnf_context context = {.user = keeper, .recall = recall_part, .keep = keep_part};
    struct srnf_folds_options options = srnf_folds_options_defaults();

    options.registration.degree = 2;
    options.refit = SRNF_REFIT_SHARED; /* one template */
    assert_int_equal(srnf_folds_compare(g->sht, SRNF_METRIC_SRNF, MEMBERS, g->surfaces, &options,
                                        keeper ? &context : NULL, folds, NULL),
                     SRNF_OK);
}

static void expect_folds(const struct srnf_folds *a, const struct srnf_folds *b)
{
    size_t n = a->n;

    assert_memory_equal(a->scores, b->scores, n * n * a->components * sizeof(double));
    assert_memory_equal(a->distances, b->distances, n * n * sizeof(double));
    assert_memory_equal(a->spread, b->spread, n * sizeof(double));
}

/* Each registration to a template is kept, and then their products; with half of the registrations,
   or the products, the folds have the same bits. */
static void registrations_of_folds_go_on(void **state)
{
    struct keeper first = {.n = 0}, half = {.there = is_first_half, .before = &first},
                  all = {.there = is_any, .before = &first};
    struct srnf_folds whole, folds;
    struct group g;

    (void)state;
    group_open_stars(&g, 4, MEMBERS, 0.3);
    compare_folds(&g, NULL, &whole);
    compare_folds(&g, &first, &folds);
    expect_folds(&whole, &folds);
    srnf_folds_clear(&folds);
    assert_int_equal(first.kept, MEMBERS + 1);
    compare_folds(&g, &half, &folds);
    expect_folds(&whole, &folds);
    srnf_folds_clear(&folds);
    assert_int_equal(half.recalled, MEMBERS / 2);
    assert_int_equal(half.kept, MEMBERS - MEMBERS / 2 + 1);
    compare_folds(&g, &all, &folds);
    expect_folds(&whole, &folds);
    srnf_folds_clear(&folds);
    assert_int_equal(all.recalled, 1); /* the products alone */
    assert_int_equal(all.kept, 0);
    srnf_folds_clear(&whole);
    close_keeper(&first);
    close_keeper(&half);
    group_close(&g);
}

static void evaluate(const struct group *g, const double *mean, const double *fields,
                     struct keeper *keeper, struct srnf_quality *quality)
{
    const struct srnf_context context = {.user = keeper, .recall = recall_part, .keep = keep_part};
    struct srnf_quality_options options = srnf_quality_options_defaults();

    options.samples = SAMPLES;
    options.components = 2;
    assert_int_equal(srnf_model_quality(g->sht, MEMBERS, mean, fields + MEMBERS * 3 * g->points,
                                        fields, &options, keeper ? &context : NULL, quality, NULL),
                     SRNF_OK);
}

static void expect_curve(const struct srnf_curve *a, const struct srnf_curve *b)
{
    assert_memory_equal(a->value, b->value, 2 * sizeof(double));
    assert_memory_equal(a->standard_error, b->standard_error, 2 * sizeof(double));
}

static void expect_quality(const struct srnf_quality *a, struct srnf_quality *b)
{
    expect_curve(&a->generalisation, &b->generalisation);
    expect_curve(&a->specificity, &b->specificity);
    expect_curve(&a->generalisation_elastic, &b->generalisation_elastic);
    expect_curve(&a->specificity_elastic, &b->specificity_elastic);
    srnf_quality_clear(b);
}

/* Every member and every sample is kept; and what was kept is not measured again. */
static void the_quality_of_a_model_goes_on(void **state)
{
    struct keeper first = {.n = 0}, half = {.there = is_first_half, .before = &first},
                  all = {.there = is_any, .before = &first};
    struct srnf_quality whole, quality;
    double *fields;
    struct group g;

    (void)state;
    group_open_stars(&g, 4, MEMBERS, 0.3);
    fields = shapes_doubles((MEMBERS + 1) * 3 * g.points);
    assert_int_equal(stats_fields(g.sht, MEMBERS, g.surfaces, NULL, fields, NULL), SRNF_OK);
    stats_average(g.grid, MEMBERS, fields, fields + MEMBERS * 3 * g.points);
    evaluate(&g, g.f[0], fields, NULL, &whole);
    evaluate(&g, g.f[0], fields, &first, &quality);
    expect_quality(&whole, &quality);
    assert_int_equal(first.kept, MEMBERS + SAMPLES);
    evaluate(&g, g.f[0], fields, &half, &quality);
    expect_quality(&whole, &quality);
    assert_int_equal(half.recalled, MEMBERS / 2);
    assert_int_equal(half.kept, MEMBERS + SAMPLES - MEMBERS / 2);
    evaluate(&g, g.f[0], fields, &all, &quality);
    expect_quality(&whole, &quality);
    assert_int_equal(all.recalled, MEMBERS + SAMPLES);
    assert_int_equal(all.kept, 0);
    /* Of other data nothing is taken. */
    fields[0] = nextafter(fields[0], 9.0);
    all.recalled = 0;
    evaluate(&g, g.f[0], fields, &all, &quality);
    assert_int_equal(all.recalled, 0);
    srnf_quality_clear(&quality);
    srnf_quality_clear(&whole);
    close_keeper(&first);
    close_keeper(&half);
    close_keeper(&all);
    srnf_free(fields);
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_are_kept_and_recalled),
        cmocka_unit_test(only_registered_pairs_are_kept),
        cmocka_unit_test(registrations_of_folds_go_on),
        cmocka_unit_test(the_quality_of_a_model_goes_on),
        cmocka_unit_test(a_series_is_of_all_that_it_is_computed_from),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

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

#include "core/stats/group.h"

#define N 4
#define PAIRS (N * (N - 1) / 2)

struct attempt {
    uint64_t series;
    double values[PAIRS];
    bool there[PAIRS]; /* to be recalled */
    int kept[PAIRS], asked;
    bool strange; /* a series or an index that cannot be */
};

static bool recall(void *user, uint64_t series, uint64_t index, double *value)
{
    struct attempt *attempt = user;

    attempt->asked++;
    if (index >= PAIRS || !attempt->there[index] || series != attempt->series) {
        return false;
    }
    *value = attempt->values[index];
    return true;
}

static void keep(void *user, uint64_t series, uint64_t index, double value)
{
    struct attempt *attempt = user;

    attempt->strange =
        attempt->strange || index >= PAIRS || (attempt->series != 0 && attempt->series != series);
    if (index < PAIRS) {
        attempt->series = series;
        attempt->values[index] = value;
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
        stats_pair(k, &i, &j);
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

/* As parameterised a distance costs less than to keep it. */
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_are_kept_and_recalled),
        cmocka_unit_test(only_registered_pairs_are_kept),
        cmocka_unit_test(a_series_is_of_all_that_it_is_computed_from),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

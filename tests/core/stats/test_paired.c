/*
 * test_paired.c - differences within subjects: sign flips against all of them done outright, an
 * exchange of the two surfaces that turns every sign and nothing else, planted changes that are
 * found with their size, rates of false findings; and what every long computation promises.
 */
#include "stats/maps.h"
#include "stats/paired.h"
#include "visits.h"

#include <cblas.h>

static int differ(const struct visits *v, size_t permutations, uint64_t seed,
                  const struct srnf_context *context, struct srnf_paired *out)
{
    struct srnf_paired_options options = srnf_paired_options_defaults();

    options.permutations = permutations;
    options.bootstraps = 200;
    options.seed = seed;
    return srnf_paired_differences(v->g.sht, &v->pairs, &options, context, out, NULL);
}

/* Of 7 subjects all 64 flips, by the fields themselves. */
static void p_is_that_of_all_flips(void **state)
{
    const size_t n = 7;
    struct visits v;
    struct srnf_paired out;
    double observed = 0.0;
    size_t as_far = 0;

    (void)state;
    visits_open(&v, n, 0.02, 0.05, 1);
    assert_int_equal(differ(&v, 100, 0, NULL, &out), SRNF_OK);
    assert_true(out.test.exact);
    assert_int_equal(out.test.permutations, 63);
    for (size_t flip = 0; flip < 64; flip++) {
        double sum = 0.0;

        for (size_t k = 0; k < v.size; k++) {
            double one = 0.0;

            for (size_t i = 0; i < n; i++) {
                double d = v.q[(n + i) * v.size + k] - v.q[i * v.size + k];

                one += i > 0 && (flip >> (i - 1) & 1) ? -d : d;
            }
            sum += v.g.grid->weight[k % v.g.points / v.g.grid->n_phi] * one * one;
        }
        observed = flip == 0 ? sum : observed;
        as_far += stats_as_large(sum, observed);
    }
    printf("# %zu of 64 flips as far, p %.4f\n", as_far, out.p_value);
    figure_below("p off that of all flips", fabs(out.p_value - (double)as_far / 64.0), 1e-12);
    figure_below("norm of the mean, relative", fabs(out.norm / (sqrt(observed) / (double)n) - 1.0),
                 1e-6);
    assert_true(out.p_value >= out.test.least);
    srnf_paired_clear(&out);
    visits_close(&v);
}

/* T^2 and displacements at each node, the long way. */
static void map_is_hotellings(void **state)
{
    const size_t n = 9;
    struct visits v;
    struct srnf_paired out;
    double *mean;
    double *x;
    void *workspace;
    double worst = 0.0;
    double square = 0.0;

    (void)state;
    visits_open(&v, n, 0.1, 0.05, 2);
    for (size_t i = 0; i < n; i++) {
        v.sizes[i] = v.sizes[n + i] = 3.0; /* in another unit */
    }
    assert_int_equal(differ(&v, 9, 0, NULL, &out), SRNF_OK);
    x = shapes_doubles(n * v.size);
    mean = shapes_doubles(v.size);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(v.g.sht));
    assert_non_null(workspace);
    for (size_t i = 0; i < n; i++) {
        double *difference = shapes_doubles(v.g.count);

        for (size_t k = 0; k < v.g.count; k++) {
            bool constant = k % v.g.each == 0; /* nobody knows where a surface is */

            difference[k] = constant ? 0.0 : 3.0 * (v.g.f[n + i][k] - v.g.f[i][k]);
        }
        srnf_sht_synthesis(v.g.sht, 3, difference, x + i * v.size, workspace);
        srnf_free(difference);
    }
    for (size_t k = 0; k < n * v.size; k++) {
        mean[k % v.size] += x[k] / (double)n;
    }
    for (size_t p = 0; p < v.g.points; p++) {
        double length = 0.0;

        for (size_t c = 0; c < 3; c++) {
            length += mean[c * v.g.points + p] * mean[c * v.g.points + p];
        }
        square += length;
        worst = compare_max(worst, fabs(out.effect[p] - sqrt(length)));
    }
    /* The centre is that of areas on the mean surface, not the constant coefficient. */
    figure_below("effect off the mean displacement, of its root mean square",
                 worst / sqrt(square / (double)v.g.points), 0.15);
    for (size_t i = 0; i < n; i++) {
        assert_true(isfinite(out.length[i]) && out.length[i] > 0.0 && out.deviation[i] > 0.0);
        assert_true(fabs(out.along[i]) <= out.length[i] * (1.0 + 1e-12));
    }
    srnf_free(x);
    srnf_free(mean);
    srnf_free(workspace);
    srnf_paired_clear(&out);
    visits_close(&v);
}

/* The same visits the other way round: every difference has the other sign. Registered, too. */
static void exchange_turns_signs_alone(void **state)
{
    (void)state;
    for (size_t registered = 0; registered < 2; registered++) {
        struct srnf_register_options registration = srnf_register_options_defaults();
        struct srnf_paired_options options = srnf_paired_options_defaults();
        struct visits v;
        struct srnf_paired out;
        struct srnf_paired back;
        struct srnf_pairs turned;
        double worst = 0.0;

        visits_open(&v, 5, 0.1, 0.05, 3);
        registration.start = SRNF_START_IDENTITY;
        registration.degree = 3;
        options.registration = registered ? &registration : NULL;
        options.permutations = 100;
        options.bootstraps = 100;
        turned = (struct srnf_pairs){.n = 5,
                                     .mean = v.mean,
                                     .first_q = v.q + 5 * v.size,
                                     .second_q = v.q,
                                     .first_size = v.sizes + 5,
                                     .second_size = v.sizes};
        assert_int_equal(srnf_paired_differences(v.g.sht, &v.pairs, &options, NULL, &out, NULL),
                         SRNF_OK);
        assert_int_equal(srnf_paired_differences(v.g.sht, &turned, &options, NULL, &back, NULL),
                         SRNF_OK);
        for (size_t k = 0; k < 5 * v.g.points; k++) {
            worst = compare_max(worst, fabs(out.normals[k] + back.normals[k]));
        }
        figure_below(registered ? "sum of both, registered" : "sum of both", worst, 1e-12);
        assert_true(out.p_value == back.p_value && out.max_p_value == back.max_p_value);
        srnf_paired_clear(&out);
        srnf_paired_clear(&back);
        visits_close(&v);
    }
}

/* Searches from a mean that is like none of the surfaces end near theirs at best. One that sets out
   from the surface itself is over, so that distances are those of the fields to rounding. */
static void surfaces_that_are_known_are_not_searched(void **state)
{
    const size_t n = 6;
    struct test_random random = test_random_seed(9);
    struct visits v;
    struct srnf_paired out;
    const double *near[12];
    double worst[2] = {0.0, 0.0};

    (void)state;
    visits_open(&v, n, 0.1, 0.05, 9);
    for (size_t i = 0; i < 2 * n; i++) {
        near[i] = v.g.f[i];
    }
    for (size_t k = 0; k < v.g.count; k++) {
        v.mean[k] = k % v.g.each > 3 && k % v.g.each < 16 ? test_random_normal(&random) : v.mean[k];
    }
    for (size_t given = 0; given < 2; given++) {
        v.pairs.first = given ? near : NULL;
        v.pairs.second = given ? near + n : NULL;
        assert_int_equal(differ(&v, 9, 0, NULL, &out), SRNF_OK);
        for (size_t i = 0; i < n; i++) {
            double truth =
                sqrt(stats_distance2(v.g.grid, v.q + i * v.size, v.q + (n + i) * v.size));

            worst[given] = compare_max(worst[given], fabs(out.distance[i] / truth - 1.0));
        }
        srnf_paired_clear(&out);
    }
    printf("# from the mean on: %.3g off\n", worst[0]);
    figure_below("distances off those of the fields, relative", worst[1], 1e-13);
    assert_true(worst[0] > 1e2 * worst[1]);
    visits_close(&v);
}

static void planted_change_is_found_with_its_size(void **state)
{
    const double growth = 0.15;
    struct visits v;
    struct srnf_paired out;
    double *nodes;
    double covered = 0.0;

    (void)state;
    visits_open(&v, 20, growth, 0.02, 4);
    assert_int_equal(differ(&v, 499, 1, NULL, &out), SRNF_OK);
    nodes = shapes_doubles(3 * v.g.points);
    stats_nodes(v.g.grid, nodes);
    assert_true(out.p_value == 1.0 / 500.0 && out.max_p_value == 1.0 / 500.0);
    printf("# change %.4f (%.4f to %.4f), varies by %.4f (%.4f to %.4f), subjects by %.4f\n",
           out.change.value, out.change.interval[0], out.change.interval[1], out.fluctuating.value,
           out.fluctuating.interval[0], out.fluctuating.interval[1], out.individual.value);
    /* The harmonic of z is sqrt(3 / 4 pi) cos(theta). */
    for (size_t p = 0; p < v.g.points; p++) {
        double z = nodes[3 * p + 2];
        double truth = growth * sqrt(3.0 / (4.0 * SRNF_PI)) * fabs(z);

        if (fabs(z) > 0.95) {
            assert_true(fabs(out.normal[p] - truth) < 4.0 * out.standard_error[p] + 0.05 * truth);
            assert_true(out.significance[p] <= 0.05);
            covered += out.confidence[p] > 2.0 * out.standard_error[p];
        }
    }
    assert_true(covered > 0.0);
    assert_true(out.change.interval[0] > 0.0 && out.share.value > 0.3);
    assert_true(out.individual.value > out.fluctuating.value);
    srnf_free(nodes);
    srnf_paired_clear(&out);
    visits_close(&v);
}

/* The error of the mean change falls as the root of the number of subjects. */
static void error_falls_with_subjects(void **state)
{
    const size_t numbers[2] = {8, 32};
    double error[2] = {0.0, 0.0};

    (void)state;
    figures_count_unsanitized();
    for (size_t k = 0; k < 2; k++) {
        for (uint64_t seed = 0; seed < 8; seed++) {
            struct visits v;
            struct srnf_paired out;

            visits_open(&v, numbers[k], 0.0, 0.0, 50 + seed);
            assert_int_equal(differ(&v, 1, 1, NULL, &out), SRNF_OK);
            error[k] += out.norm / 8.0; /* of no change: all of it is error */
            srnf_paired_clear(&out);
            visits_close(&v);
        }
    }
    printf("# error %.4f with 8 subjects, %.4f with 32\n", error[0], error[1]);
    figure_below("ratio of errors off two", fabs(error[0] / error[1] - 2.0), 0.35);
}

static void no_change_is_found_at_the_level(void **state)
{
    const size_t runs = 60;
    size_t global = 0;
    size_t local = 0;

    (void)state;
    figures_count_unsanitized();
    for (size_t run = 0; run < runs; run++) {
        struct visits v;
        struct srnf_paired out;

        visits_open(&v, 10, 0.0, 0.05, 100 + run);
        assert_int_equal(differ(&v, 99, run, NULL, &out), SRNF_OK);
        assert_true(isfinite(out.p_value) && isfinite(out.max_p_value));
        global += out.p_value <= 0.1;
        local += out.max_p_value <= 0.1;
        srnf_paired_clear(&out);
        visits_close(&v);
    }
    printf("# %zu runs at level .1: %zu, map %zu\n", runs, global, local);
    assert_true(global <= 14 && local <= 14); /* Binomial(60, .1): beyond with a chance of 1e-3 */
}

/* ---- What every long computation promises ---------------------------------------------------- */

static void results_do_not_depend_on_threads(void **state)
{
    struct visits v;
    struct srnf_paired alone;
    size_t size;

    (void)state;
    visits_open(&v, 12, 0.02, 0.05, 5);
    size = v.g.points * sizeof(double);
    assert_int_equal(differ(&v, 99, 1, NULL, &alone), SRNF_OK);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        struct srnf_paired out;

        assert_int_equal(differ(&v, 99, 1, &context, &out), SRNF_OK);
        assert_true(out.p_value == alone.p_value);
        assert_memory_equal(out.significance, alone.significance, size);
        assert_memory_equal(out.confidence, alone.confidence, size);
        assert_memory_equal(out.normals, alone.normals, 12 * size);
        assert_memory_equal(&out.change, &alone.change, sizeof out.change);
        assert_true(atomic_load(&watch.highest) > 0.999);
        srnf_paired_clear(&out);
    }
    srnf_paired_clear(&alone);
    visits_close(&v);
}

/* A store of parts, as a job has. */
struct kept {
    double *values[16];
    size_t count, recalled;
};

static bool recall_part(void *user, uint64_t series, uint64_t index, size_t count, double *values)
{
    struct kept *kept = user;

    (void)series;
    if (index >= 16 || !kept->values[index]) {
        return false;
    }
    memcpy(values, kept->values[index], count * sizeof(double));
    kept->recalled++;
    return true;
}

static void keep_part(void *user, uint64_t series, uint64_t index, size_t count,
                      const double *values)
{
    struct kept *kept = user;

    (void)series;
    if (values && index < 8) {
        kept->values[index] = shapes_doubles(count);
        memcpy(kept->values[index], values, count * sizeof(double));
        kept->count++;
    }
}

static void pairs_that_are_done_are_kept(void **state)
{
    struct kept kept = {{NULL}, 0, 0};
    struct srnf_context context = {.user = &kept, .recall = recall_part, .keep = keep_part};
    struct visits v;
    struct srnf_paired first;
    struct srnf_paired second;

    (void)state;
    visits_open(&v, 10, 0.02, 0.05, 6);
    assert_int_equal(differ(&v, 99, 1, &context, &first), SRNF_OK);
    assert_int_equal(kept.count, 8);
    context.keep = NULL;
    assert_int_equal(differ(&v, 99, 1, &context, &second), SRNF_OK);
    assert_int_equal(kept.recalled, 8);
    assert_memory_equal(first.statistic, second.statistic, v.g.points * sizeof(double));
    for (size_t k = 0; k < 8; k++) {
        srnf_free(kept.values[k]);
    }
    srnf_paired_clear(&first);
    srnf_paired_clear(&second);
    visits_close(&v);
}

static void stops_when_asked(void **state)
{
    struct visits v;

    (void)state;
    visits_open(&v, 12, 0.02, 0.05, 7);
    for (size_t after = 0; after < 30; after += 13) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, 2);
        struct srnf_paired out = {0};

        watch.cancel_after = after;
        assert_int_equal(differ(&v, 999, 1, &context, &out), SRNF_ECANCELED);
        assert_null(out.statistic);
    }
    visits_close(&v);
}

static void wrong_input_is_refused(void **state)
{
    struct srnf_paired_options options = srnf_paired_options_defaults();
    struct srnf_paired out = {0};
    struct srnf_error error = {0};
    struct visits v;

    (void)state;
    visits_open(&v, 6, 0.02, 0.05, 8);
    options.permutations = 0;
    assert_int_equal(srnf_paired_differences(v.g.sht, &v.pairs, &options, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "permutations is 0"));
    options = srnf_paired_options_defaults();
    options.bootstraps = 99;
    assert_int_equal(srnf_paired_differences(v.g.sht, &v.pairs, &options, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "bootstraps is 99"));
    v.sizes[2] = 0.0;
    assert_int_equal(srnf_paired_differences(v.g.sht, &v.pairs, NULL, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "a size of pair 2"));
    v.q[v.size] = NAN;
    assert_int_equal(srnf_paired_differences(v.g.sht, &v.pairs, NULL, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "a surface of pair 1"));
    v.pairs.n = 4;
    assert_int_equal(srnf_paired_differences(v.g.sht, &v.pairs, NULL, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "4 pairs; 5 to"));
    assert_null(out.statistic);
    visits_close(&v);
}

/* Of 300 studies of n subjects, whose noise is in one direction or in many, those whose intervals
   do not hold the planted change and its share. signal: the square of the change over what noise
   adds to that of the mean. */
static void miss_changes(size_t n, bool one, double signal, struct test_random *random,
                         size_t missed[2])
{
    const size_t dimensions = 12;
    double gram[12 * 12], y[12 * 12];
    double truth = sqrt(signal * (one ? 1.0 : (double)dimensions) / (double)n);
    struct srnf_paired_options options = srnf_paired_options_defaults();
    double mean[12], share = signal / (signal + (double)n);

    missed[0] = missed[1] = 0;
    options.bootstraps = 100;
    for (size_t study = 0; study < 300; study++) {
        struct srnf_paired out = {.n = n};
        struct paired_run run = {.options = &options, .n = n, .out = &out};

        memset(mean, 0, sizeof mean);
        for (size_t k = 0; k < n * dimensions; k++) {
            y[k] = one && k % dimensions > 0 ? 0.0 : test_random_normal(random);
            y[k] += k % dimensions == 0 ? truth : 0.0;
            mean[k % dimensions] += y[k] / (double)n;
        }
        out.norm = cblas_dnrm2((int)dimensions, mean, 1);
        assert_int_equal(stats_gram(n, dimensions, y, gram, NULL), SRNF_OK);
        run.gram[0] = run.gram[1] = run.gram[2] = gram;
        options.seed = study;
        assert_int_equal(paired_bootstrap(&run, NULL), SRNF_OK);
        assert_true(out.change.interval[0] <= out.change.value &&
                    out.change.value <= out.change.interval[1]);
        assert_true(0.0 <= out.share.interval[0] && out.share.interval[0] <= out.share.value &&
                    out.share.value <= out.share.interval[1] && out.share.interval[1] <= 1.0);
        missed[0] += !(out.change.interval[0] <= truth && truth <= out.change.interval[1]);
        missed[1] += !(out.share.interval[0] <= share && share <= out.share.interval[1]);
    }
}

static void few_subjects_hold_the_change(void **state)
{
    static const size_t sizes[] = {5, 8, 12};
    struct test_random random = test_random_seed(77);
    size_t most = 0;

    (void)state;
    figures_count_unsanitized();
    for (size_t k = 0; k < 3 * 2 * 5; k++) {
        double signal = (double[]){0.0, 1.0, 4.0, 25.0, 100.0}[k / 6];
        size_t missed[2];

        miss_changes(sizes[k % 3], k / 3 % 2, signal, &random, missed);
        printf("# %zu subjects, noise in %s, signal %.0f: of 300 missed %zu, of shares %zu\n",
               sizes[k % 3], k / 3 % 2 ? "one direction" : "many", signal, missed[0], missed[1]);
        most = missed[0] > most ? missed[0] : most;
        most = missed[1] > most ? missed[1] : most;
    }
    assert_in_range(most, 0, 29); /* one in twenty, exceeded by chance once in 2000 */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(p_is_that_of_all_flips),
        cmocka_unit_test(map_is_hotellings),
        cmocka_unit_test(exchange_turns_signs_alone),
        cmocka_unit_test(surfaces_that_are_known_are_not_searched),
        cmocka_unit_test(planted_change_is_found_with_its_size),
        cmocka_unit_test(error_falls_with_subjects),
        cmocka_unit_test(no_change_is_found_at_the_level),
        cmocka_unit_test(results_do_not_depend_on_threads),
        cmocka_unit_test(pairs_that_are_done_are_kept),
        cmocka_unit_test(stops_when_asked),
        cmocka_unit_test(wrong_input_is_refused),
        cmocka_unit_test(few_subjects_hold_the_change),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/*
 * test_regress_200.c - 200 shuffled covariates beside one that does have an effect: how often a
 * number, a level of three and an interaction are found at the level .05, over the whole surface
 * and on the map, how often a pair of the levels is, and how often the share of the variance is
 * told to be more than 0; and how a planted effect and a planted interaction are recovered as
 * subjects become more.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 3600
 */
#include "group.h"
#include "stats/compare.h"

#define DEGREE 4
#define N ((size_t)30)
#define NOISE_DEGREE 3
#define NOISE ((size_t)(NOISE_DEGREE + 1) * (NOISE_DEGREE + 1))
#define RUNS ((size_t)200)
#define TERMS ((size_t)3)
#define PAIRS ((size_t)3)
#define TESTS (TERMS + PAIRS)
#define COLUMNS ((size_t)5) /* age, x, two levels of a site, age times x */
#define SLOPE 0.004

struct study {
    struct group g;
    size_t n;
    double *mean, *q;
    double age[GROUP_MAX];
};

/* Every other member grows faster with age by `more`. */
static void open_study(struct study *a, size_t n, double more, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    double *nodes;
    double *values;
    void *workspace;

    a->n = n;
    group_open(&a->g, DEGREE, n);
    nodes = shapes_doubles(3 * a->g.points);
    values = shapes_doubles(3 * a->g.points);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(a->g.sht));
    assert_non_null(workspace);
    stats_nodes(a->g.grid, nodes);
    a->mean = shapes_doubles(a->g.count);
    a->q = shapes_doubles(n * 3 * a->g.points);
    for (size_t i = 0; i < n; i++) {
        double slope = SLOPE + (i % 2 ? more : 0.0);
        double noise[3 * NOISE];

        a->age[i] = 10.0 * test_random_normal(&random);
        test_random_normals(&random, 3 * NOISE, noise);
        assert_int_equal(
            srnf_harmonics_at_points(NOISE_DEGREE, 3, noise, a->g.points, nodes, values, NULL),
            SRNF_OK);
        for (size_t k = 0; k < 3 * a->g.points; k++) {
            size_t c = k / a->g.points;
            double axis = 1.2 - 0.2 * (double)c + (c == 2 ? slope * a->age[i] : 0.0);

            values[k] = axis * nodes[3 * (k % a->g.points) + c] + 0.02 * values[k];
        }
        srnf_sht_analysis(a->g.sht, 3, values, a->g.f[i], workspace);
        srnf_field(a->g.sht, a->g.f[i], a->q + i * 3 * a->g.points, workspace);
        for (size_t k = 0; k < a->g.count; k++) {
            a->mean[k] += a->g.f[i][k] / (double)n;
        }
    }
    srnf_free(workspace);
    srnf_free(values);
    srnf_free(nodes);
}

static void close_study(struct study *a)
{
    srnf_free(a->q);
    srnf_free(a->mean);
    group_close(&a->g);
}

struct columns {
    double design[COLUMNS * GROUP_MAX];
    double others[TESTS][4 * GROUP_MAX];
    double tested[TESTS][2 * GROUP_MAX];
};
/* Columns of others and of tested. */
static const size_t reduced_of[TESTS] = {3, 3, 4, 4, 4, 4};
static const size_t tested_of[TESTS] = {1, 2, 1, 1, 1, 1};

/* Two levels are one in the smaller model: with columns b and d those of the first level and the
   second, of the first and the third, of the other two. */
static void draw_pairs(size_t i, double b, double d, const double row[3], struct columns *c)
{
    const double merged[PAIRS] = {d, b, b + d};
    const double apart[PAIRS] = {b, d, d};

    for (size_t k = 0; k < PAIRS; k++) {
        double *others = c->others[TERMS + k] + 4 * i;

        memcpy(others, row, 3 * sizeof(double));
        others[3] = merged[k];
        c->tested[TERMS + k][i] = apart[k];
    }
}

/* x and the site are drawn anew; each is tested beside what does not contain it. */
static void draw(const struct study *a, struct test_random *random, uint64_t run, struct columns *c)
{
    uint32_t order[N];

    compare_permutation(900, run + 1, N, order);
    for (size_t i = 0; i < N; i++) {
        double x = test_random_normal(random);
        double b = order[i] % 3 == 1 ? 1.0 : 0.0;
        double d = order[i] % 3 == 2 ? 1.0 : 0.0;
        double product = a->age[i] * x;
        const double row[COLUMNS] = {a->age[i], x, b, d, product};

        memcpy(c->design + COLUMNS * i, row, sizeof row);
        memcpy(c->others[0] + 3 * i, (const double[3]){a->age[i], b, d}, 3 * sizeof(double));
        memcpy(c->tested[0] + i, (const double[1]){x}, sizeof(double));
        memcpy(c->others[1] + 3 * i, (const double[3]){a->age[i], x, product}, 3 * sizeof(double));
        memcpy(c->tested[1] + 2 * i, (const double[2]){b, d}, 2 * sizeof(double));
        memcpy(c->others[2] + 4 * i, (const double[4]){a->age[i], x, b, d}, 4 * sizeof(double));
        memcpy(c->tested[2] + i, (const double[1]){product}, sizeof(double));
        draw_pairs(i, b, d, (const double[3]){a->age[i], x, product}, c);
    }
}

/* Whether Holm's correction finds any of the pairs: the least p is times their number. */
static bool any_pair(const struct srnf_regression *out)
{
    double least = 1.0;

    for (size_t k = TERMS; k < TESTS; k++) {
        least = compare_min(least, out->test_of[k].p_value);
    }
    return least * (double)PAIRS <= 0.05;
}

static void shuffled_covariates(void **state)
{
    static const char *const names[TESTS] = {"number",        "levels",       "interaction",
                                             "first, second", "first, third", "second, third"};
    struct srnf_regress_options options = srnf_regress_options_defaults();
    struct test_random random = test_random_seed(17);
    struct columns *c = calloc(1, sizeof *c);
    struct study a;
    size_t global[TESTS] = {0};
    size_t map[TESTS] = {0};
    size_t reported[TESTS] = {0};
    size_t above[TESTS] = {0};
    size_t pairs = 0;

    (void)state;
    assert_non_null(c);
    open_study(&a, N, 0.0, 12);
    options.permutations = 199;
    options.bootstraps = 200;
    for (size_t run = 0; run < RUNS; run++) {
        struct srnf_nested nested[TESTS];
        struct srnf_regression out;
        const struct srnf_regress_design design = {
            .columns = COLUMNS, .values = c->design, .tests = TESTS, .nested = nested};

        draw(&a, &random, run, c);
        for (size_t t = 0; t < TESTS; t++) {
            nested[t] =
                (struct srnf_nested){reduced_of[t], tested_of[t], c->others[t], c->tested[t]};
        }
        options.seed = run;
        assert_int_equal(srnf_regress(a.g.sht, N, a.mean, a.q, &design, &options, NULL, &out, NULL),
                         SRNF_OK);
        for (size_t t = 0; t < TESTS; t++) {
            global[t] += out.test_of[t].p_value <= 0.05;
            map[t] += out.test_of[t].max_p_value <= 0.05;
            reported[t] += group_least(a.g.points, out.test_of[t].fdr) <= 0.05;
            above[t] += out.test_of[t].part.interval[0] > 0.02;
        }
        pairs += any_pair(&out);
        srnf_regression_clear(&out);
    }
    for (size_t t = 0; t < TESTS; t++) {
        printf(
            "# %s: p <= .05 %zu, map %zu, by false discovery rate %zu, share told above .02: %zu "
            "of %zu\n",
            names[t], global[t], map[t], reported[t], above[t], RUNS);
    }
    printf("# any pair, corrected: %zu of %zu\n", pairs, RUNS);
    assert_true(pairs <= 18);
    for (size_t t = 0; t < TESTS; t++) {
        /* Binomial(200, .05) is from 3 to 18 with a chance of .98. */
        assert_in_range(global[t], 3, 18);
        assert_in_range(map[t], 0, 18);
        assert_in_range(reported[t], 0, 18); /* any discovery is a false one */
        assert_true(above[t] <= 30);
    }
    free(c);
    close_study(&a);
}

/* What an effect that is `planted` times z along the axis moves along the normal of the ellipsoid
   with the axes 1.2, 1 and 0.8: error of the map relative to it, and their correlation. */
static double compare_maps(const struct group *g, const double *map, double planted,
                           double *correlation)
{
    double *nodes = shapes_doubles(3 * g->points);
    double error = 0.0;
    double truth = 0.0;
    double found = 0.0;
    double both = 0.0;

    stats_nodes(g->grid, nodes);
    for (size_t p = 0; p < g->points; p++) {
        double m[3] = {nodes[3 * p] / 1.2, nodes[3 * p + 1], nodes[3 * p + 2] / 0.8};
        double length = sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
        double moved = planted * nodes[3 * p + 2] * m[2] / length;
        double w = g->grid->weight[p / g->grid->n_phi];

        error += w * (map[p] - moved) * (map[p] - moved);
        truth += w * moved * moved;
        found += w * map[p] * map[p];
        both += w * map[p] * moved;
    }
    srnf_free(nodes);
    *correlation = both / sqrt(truth * found);
    return sqrt(error / truth);
}

enum { EFFECT, INTERACTION };

/* Of n members, every other one of another group: the map of a year, or of what it moves more in
   one of the groups. */
static double recovery(size_t n, int what, uint64_t seed, double *correlation)
{
    struct srnf_regress_options options = srnf_regress_options_defaults();
    double design[3 * GROUP_MAX], reduced[2 * GROUP_MAX], tested[GROUP_MAX];
    size_t columns = what == EFFECT ? 1 : 3;
    struct srnf_nested nested = {columns - 1, 1, what == EFFECT ? NULL : reduced, tested};
    const struct srnf_regress_design asked = {
        .columns = columns, .values = design, .tests = 1, .nested = &nested};
    struct study a;
    struct srnf_regression out;
    double error;

    open_study(&a, n, what == EFFECT ? 0.0 : SLOPE, seed);
    for (size_t i = 0; i < n; i++) {
        double group = (double)(i % 2);

        tested[i] = what == EFFECT ? a.age[i] : a.age[i] * group;
        reduced[2 * i] = a.age[i];
        reduced[2 * i + 1] = group;
        for (size_t k = 0; k < columns; k++) {
            design[columns * i + k] = k + 1 == columns ? tested[i] : reduced[2 * i + k];
        }
    }
    options.permutations = 19;
    options.bootstraps = 100;
    assert_int_equal(srnf_regress(a.g.sht, n, a.mean, a.q, &asked, &options, NULL, &out, NULL),
                     SRNF_OK);
    error = compare_maps(&a.g, out.normal + (columns - 1) * a.g.points, SLOPE, correlation);
    srnf_regression_clear(&out);
    close_study(&a);
    return error;
}

/* Four times the subjects, half the error. */
static void what_is_planted_is_recovered(void **state)
{
    static const char *const names[] = {"an effect", "an interaction"};

    (void)state;
    for (int what = EFFECT; what <= INTERACTION; what++) {
        double error[2] = {0.0, 0.0};
        double alike[2] = {0.0, 0.0};

        for (uint64_t seed = 0; seed < 8; seed++) {
            for (size_t k = 0; k < 2; k++) {
                double correlation;

                error[k] += recovery(k ? 96 : 24, what, 100 + 100 * k + seed, &correlation) / 8.0;
                alike[k] += correlation / 8.0;
            }
        }
        printf("# map of %s: relative error %.3f of 24 subjects, %.3f of 96; correlation %.3f, "
               "%.3f\n",
               names[what], error[0], error[1], alike[0], alike[1]);
        assert_true(error[0] / error[1] > 1.5 && error[0] / error[1] < 2.7);
        assert_true(alike[1] > alike[0] && alike[1] > 0.97);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shuffled_covariates),
        cmocka_unit_test(what_is_planted_is_recovered),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

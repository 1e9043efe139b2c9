/*
 * test_compare.c - the comparison of two groups: the local statistic against the textbook's, where
 * a planted difference is found, that equal groups are not told apart more often than the level
 * says, covariates, permutations; and what every long computation promises.
 */
#include "group.h"
#include "stats/compare.h"

#define DEGREE 6
#define N ((size_t)16)
#define PERMUTATIONS ((size_t)199)
#define NOISE_DEGREE 4
#define NOISE ((size_t)(NOISE_DEGREE + 1) * (NOISE_DEGREE + 1))

/* Ellipsoids with noise of low degree, all parameterized alike; those of group 1 have a bump about
   the direction (1, 0, 0). */
struct groups {
    struct group g;
    int group[N];
    double *mean;         /* [3][(L+1)^2] */
    double *registered_q; /* [N][3][P] */
};

static double bump(const double e[3])
{
    return exp(-8.0 * (1.0 - e[0]));
}

static void open_groups(struct groups *a, double height, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    double *nodes;
    double *r;
    void *workspace;

    group_open(&a->g, DEGREE, N);
    nodes = shapes_doubles(3 * a->g.points);
    r = shapes_doubles(3 * a->g.points);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(a->g.sht));
    assert_non_null(workspace);
    stats_nodes(a->g.grid, nodes);
    a->mean = shapes_doubles(a->g.count);
    a->registered_q = shapes_doubles(N * 3 * a->g.points);
    for (size_t i = 0; i < N; i++) {
        double noise[3 * NOISE];
        double *values = shapes_doubles(3 * a->g.points);

        a->group[i] = i % 2 == 1;
        test_random_normals(&random, 3 * NOISE, noise);
        assert_int_equal(
            srnf_harmonics_at_points(NOISE_DEGREE, 3, noise, a->g.points, nodes, values, NULL),
            SRNF_OK);
        for (size_t p = 0; p < a->g.points; p++) {
            const double *e = nodes + 3 * p;
            double radius = 1.0 + (i % 2 == 1 ? height * bump(e) : 0.0);

            for (size_t c = 0; c < 3; c++) {
                size_t k = c * a->g.points + p;

                r[k] = (1.2 - 0.2 * (double)c) * radius * e[c] + 0.01 * values[k];
            }
        }
        srnf_sht_analysis(a->g.sht, 3, r, a->g.f[i], workspace);
        srnf_field(a->g.sht, a->g.f[i], a->registered_q + i * 3 * a->g.points, workspace);
        for (size_t k = 0; k < a->g.count; k++) {
            a->mean[k] += a->g.f[i][k] / (double)N;
        }
        srnf_free(values);
    }
    srnf_free(workspace);
    srnf_free(r);
    srnf_free(nodes);
}

static void close_groups(struct groups *a)
{
    srnf_free(a->registered_q);
    srnf_free(a->mean);
    group_close(&a->g);
}

static int compare(const struct groups *a, const int *group, size_t n_covariates,
                   const double *covariates, size_t permutations, uint64_t seed,
                   const struct srnf_context *context, struct srnf_comparison *out,
                   struct srnf_error *error)
{
    struct srnf_compare_options options = srnf_compare_options_defaults();

    options.permutations = permutations;
    options.seed = seed;
    return srnf_compare_groups(a->g.sht, N, a->mean, a->registered_q, group, n_covariates,
                               covariates, &options, context, out, error);
}

/* Displacements of one node: the subjects' surfaces moved to their centroids by the area of the
   mean, double[N][3]. */
static void displacements(const struct groups *a, size_t node, double *out)
{
    struct stats_embedding embedding;
    double *vector = shapes_doubles(3 * a->g.points);
    void *workspace;

    assert_int_equal(stats_embedding_create(a->g.sht, a->mean, &embedding), SRNF_OK);
    workspace = srnf_alloc(1, stats_embedding_workspace_size(&embedding));
    assert_non_null(workspace);
    for (size_t i = 0; i < N; i++) {
        stats_embed(&embedding, a->g.f[i], vector, workspace);
        for (size_t c = 0; c < 3; c++) {
            out[3 * i + c] = vector[c * a->g.points + node] / embedding.root[node];
        }
    }
    srnf_free(workspace);
    srnf_free(vector);
    stats_embedding_clear(&embedding);
}

/* Searches from a mean that is like none of the surfaces end near them at best; from the surfaces
   themselves they are over, with the effect of the displacements as they are. */
static void surfaces_that_are_known_are_not_searched(void **state)
{
    static const size_t nodes[3] = {0, 31, 77};
    struct srnf_compare_options options = srnf_compare_options_defaults();
    double worst[2] = {0.0, 0.0};
    struct groups a;

    (void)state;
    open_groups(&a, 0.3, 7);
    group_spoil_mean(&a.g, a.mean, 9);
    options.permutations = 19;
    for (size_t known = 0; known < 2; known++) {
        struct srnf_comparison out;

        options.surfaces = known ? a.g.surfaces : NULL;
        assert_int_equal(srnf_compare_groups(a.g.sht, N, a.mean, a.registered_q, a.group, 0, NULL,
                                             &options, NULL, &out, NULL),
                         SRNF_OK);
        for (size_t k = 0; k < 3; k++) {
            double moved[3 * N];
            double square = 0.0;

            displacements(&a, nodes[k], moved);
            for (size_t c = 0; c < 3; c++) {
                double off = 0.0;

                for (size_t i = 0; i < N; i++) {
                    off += moved[3 * i + c] * (a.group[i] ? 2.0 : -2.0) / (double)N;
                }
                square += off * off;
            }
            worst[known] =
                compare_max(worst[known], fabs(out.effect[nodes[k]] / sqrt(square) - 1.0));
        }
        srnf_comparison_clear(&out);
    }
    printf("# from the mean on: %.3g off\n", worst[0]);
    figure_below("effects off those of the surfaces, relative", worst[1], 1e-11);
    assert_true(worst[0] > 1e2 * worst[1]);
    close_groups(&a);
}

/* The average of the fields of a subject has a surface near the average of its surfaces: found from
   there as from the mean. */
static void averages_are_searched_from_averages(void **state)
{
    struct srnf_compare_options options = srnf_compare_options_defaults();
    struct srnf_comparison out[2];
    size_t subjects[N];
    struct groups a;

    (void)state;
    for (size_t i = 0; i < N; i++) {
        subjects[i] = i / 4 * 4 + i % 2;
    }
    open_groups(&a, 0.3, 7);
    options.permutations = 19;
    options.subjects = subjects;
    for (size_t known = 0; known < 2; known++) {
        options.surfaces = known ? a.g.surfaces : NULL;
        assert_int_equal(srnf_compare_groups(a.g.sht, N, a.mean, a.registered_q, a.group, 0, NULL,
                                             &options, NULL, &out[known], NULL),
                         SRNF_OK);
    }
    figure_below("effects from averages off those from the mean",
                 compare_difference(a.g.points, out[0].effect, out[1].effect), 1e-6);
    srnf_comparison_clear(&out[0]);
    srnf_comparison_clear(&out[1]);
    close_groups(&a);
}

/* x = A^(-1) b for three unknowns by Cramer's rule. */
static void solve3(const double a[9], const double b[3], double x[3])
{
    double det = a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) +
                 a[2] * (a[3] * a[7] - a[4] * a[6]);

    for (int c = 0; c < 3; c++) {
        double m[9];

        memcpy(m, a, sizeof m);
        m[c] = b[0];
        m[3 + c] = b[1];
        m[6 + c] = b[2];
        x[c] = (m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                m[2] * (m[3] * m[7] - m[4] * m[6])) /
               det;
    }
}

/* Two-sample T^2 with the pooled covariance, and the difference of the means. */
static double textbook(const struct groups *a, const double *x, double difference[3])
{
    double means[2][3] = {{0}};
    double pooled[9] = {0};
    double solved[3];
    double half = (double)N / 2.0;

    for (size_t i = 0; i < N; i++) {
        for (size_t c = 0; c < 3; c++) {
            means[a->group[i]][c] += x[3 * i + c] / half;
        }
    }
    for (size_t i = 0; i < N; i++) {
        for (size_t c = 0; c < 3; c++) {
            for (size_t d = 0; d < 3; d++) {
                pooled[3 * c + d] += (x[3 * i + c] - means[a->group[i]][c]) *
                                     (x[3 * i + d] - means[a->group[i]][d]) / (double)(N - 2);
            }
        }
    }
    for (size_t c = 0; c < 3; c++) {
        difference[c] = means[1][c] - means[0][c];
    }
    solve3(pooled, difference, solved);
    return half / 2.0 *
           (solved[0] * difference[0] + solved[1] * difference[1] + solved[2] * difference[2]);
}

static void statistic_is_that_of_hotelling(void **state)
{
    struct groups a;
    struct srnf_comparison out;
    double worst = 0.0;
    double worst_effect = 0.0;

    (void)state;
    open_groups(&a, 0.05, 1);
    assert_int_equal(compare(&a, a.group, 0, NULL, 9, 0, NULL, &out, NULL), SRNF_OK);
    for (size_t p = 3; p < a.g.points; p += 29) {
        double x[3 * N];
        double d[3];
        double t2;

        displacements(&a, p, x);
        t2 = textbook(&a, x, d);
        worst = compare_max(worst, fabs(out.statistic[p] / t2 - 1.0));
        worst_effect = compare_max(
            worst_effect, fabs(out.effect[p] - sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])));
        assert_true(fabs(out.normal[p]) <= out.effect[p] * (1.0 + 1e-12));
    }
    /* The comparison works on inverted SRNFs, which are exact to the tolerance of inversion. */
    figure_below("T^2 off the textbook's, relative", worst, 1e-4);
    figure_below("displacement off the difference of means", worst_effect, 1e-6);
    srnf_comparison_clear(&out);
    close_groups(&a);
}

static void planted_difference_is_found_where_it_is(void **state)
{
    struct groups a;
    struct srnf_comparison out;
    double *nodes;
    size_t inside = 0;
    size_t found = 0;
    size_t outside = 0;
    size_t wrong = 0;

    (void)state;
    open_groups(&a, 0.1, 2);
    nodes = shapes_doubles(3 * a.g.points);
    stats_nodes(a.g.grid, nodes);
    assert_int_equal(compare(&a, a.group, 0, NULL, 999, 5, NULL, &out, NULL), SRNF_OK);
    assert_true(out.p_value <= 0.005);
    assert_true(out.max_p_value <= 0.005);
    for (size_t p = 0; p < a.g.points; p++) {
        bool reported = out.significance[p] <= 0.05;

        assert_true(out.significance[p] >= out.max_p_value);
        assert_true(out.p[p] >= 1e-3 && out.p[p] <= out.significance[p]);
        assert_true(out.fdr[p] >= out.p[p] && out.fdr[p] <= 1.0);
        if (nodes[3 * p] > 0.9) {
            inside++;
            found += reported;
            assert_true(out.normal[p] > 0.0); /* outward, as it was planted */
        } else if (nodes[3 * p] < 0.0) {
            outside++;
            wrong += reported;
        }
    }
    printf("# bump: %zu of %zu nodes reported; far side: %zu of %zu\n", found, inside, wrong,
           outside);
    assert_true(found == inside);
    assert_true(wrong * 20 <= outside);
    srnf_comparison_clear(&out);
    srnf_free(nodes);
    close_groups(&a);
}

/* Shuffles of the labels of equal groups: p is uniform, and a map that reports anything at the
   level .05 is as rare as that; also where covariates that say nothing take up much of what few
   subjects leave. */
static void count_found(size_t n_covariates)
{
    const size_t runs = 60;
    struct test_random random = test_random_seed(5);
    double covariates[4 * N];
    struct groups a;
    size_t global = 0;
    size_t local = 0;
    size_t discoveries = 0;
    double sum = 0.0;

    open_groups(&a, 0.0, 3);
    for (size_t run = 0; run < runs; run++) {
        struct srnf_comparison out;
        uint32_t order[N];
        int group[N];
        double least = 1.0;

        compare_permutation(77, run + 1, N, order);
        for (size_t i = 0; i < N; i++) {
            group[i] = a.group[order[i]];
        }
        test_random_normals(&random, 4 * N, covariates);
        assert_int_equal(compare(&a, group, n_covariates, covariates, 99, run, NULL, &out, NULL),
                         SRNF_OK);
        for (size_t p = 0; p < a.g.points; p++) {
            least = compare_min(least, out.fdr[p]);
        }
        assert_true(isfinite(out.p_value) && isfinite(out.max_p_value) && isfinite(least));
        global += out.p_value <= 0.1;
        local += out.max_p_value <= 0.1;
        discoveries += least <= 0.1;
        sum += out.p_value / (double)runs;
        srnf_comparison_clear(&out);
    }
    printf("# %zu shuffles at level .1, %zu covariates: global %zu, map by the maximum %zu, by "
           "discoveries %zu; mean p %.3f\n",
           runs, n_covariates, global, local, discoveries, sum);
    /* Binomial(60, .1) exceeds 14 with a chance of 1e-3; the mean of p has a deviation of .037. */
    assert_true(global <= 14);
    assert_true(local <= 14);
    assert_true(discoveries <= 14);
    assert_true(fabs(sum - 0.5) < 0.13);
    close_groups(&a);
}

static void equal_groups_are_not_told_apart(void **state)
{
    (void)state;
    figures_count_unsanitized();
    count_found(0);
    count_found(4);
}

/* Age makes the bump, and group 1 is older: without age the groups differ, with it they do not. */
static void covariates_are_regressed_out(void **state)
{
    struct test_random random = test_random_seed(8);
    double covariates[2 * N];
    double *plain;
    struct srnf_comparison without;
    struct srnf_comparison with;
    struct groups a;
    struct groups b;

    (void)state;
    open_groups(&a, 0.0, 4);
    open_groups(&b, 0.1, 4); /* the same noise: the bump is the difference */
    plain = shapes_doubles(N * 3 * a.g.points);
    memcpy(plain, a.registered_q, N * 3 * a.g.points * sizeof(double));
    for (size_t i = 0; i < N; i++) {
        double age = 60.0 + 8.0 * (double)(i % 2) + 5.0 * test_random_normal(&random);
        size_t size = 3 * a.g.points;
        size_t bumped = i - i % 2 + 1; /* the next of group 1 */

        covariates[2 * i] = age;
        covariates[2 * i + 1] = 1e6 * test_random_normal(&random);
        for (size_t k = 0; k < size; k++) {
            a.registered_q[i * size + k] +=
                0.1 * (age - 60.0) * (b.registered_q[bumped * size + k] - plain[bumped * size + k]);
        }
    }
    assert_int_equal(compare(&a, a.group, 0, NULL, PERMUTATIONS, 0, NULL, &without, NULL), SRNF_OK);
    assert_int_equal(compare(&a, a.group, 2, covariates, PERMUTATIONS, 0, NULL, &with, NULL),
                     SRNF_OK);
    printf("# p %.3f, with age regressed out %.3f; distance %.4f and %.4f\n", without.p_value,
           with.p_value, without.distance, with.distance);
    assert_true(without.p_value <= 0.02);
    assert_true(with.p_value > 0.02); /* uniform, as nothing but age differs */
    assert_true(with.distance < without.distance);
    srnf_comparison_clear(&without);
    srnf_comparison_clear(&with);
    srnf_free(plain);
    close_groups(&a);
    close_groups(&b);
}

/* With covariates T^2 is that of the linear model: against least squares done the long way. */
static void model_is_that_of_least_squares(void **state)
{
    struct test_random random = test_random_seed(9);
    struct compare_design design;
    double covariates[2 * N];
    double y[N];
    int group[N];
    double fitted = 0.0;
    double along[3] = {0.0, 0.0, 0.0};

    (void)state;
    for (size_t i = 0; i < N; i++) {
        group[i] = i < 5;
        covariates[2 * i] = test_random_normal(&random);
        covariates[2 * i + 1] = 1e5 + test_random_normal(&random) + covariates[2 * i];
        y[i] = 3.0 - 2.0 * covariates[2 * i] + 0.5 * covariates[2 * i + 1] + 7.0 * group[i];
    }
    assert_int_equal(compare_design_create(&design, N, group, 2, covariates, NULL), SRNF_OK);
    assert_int_equal(design.nuisance, 3);
    assert_int_equal(compare_design_freedom(&design), N - 4);
    for (size_t i = 0; i < N; i++) {
        fitted += design.contrast[i] * y[i] / design.squared;
    }
    assert_true(fabs(fitted - 7.0) < 1e-8); /* the coefficient of the group, exactly */
    compare_design_residuals(&design, 1, y);
    for (size_t i = 0; i < N; i++) {
        along[0] += y[i];
        along[1] += y[i] * covariates[2 * i];
        along[2] += y[i] * (covariates[2 * i + 1] - 1e5);
    }
    assert_true(fabs(along[0]) < 1e-9 && fabs(along[1]) < 1e-9 && fabs(along[2]) < 1e-8);
    compare_design_clear(&design);
}

static void results_do_not_depend_on_threads(void **state)
{
    struct groups a;
    struct srnf_comparison alone;

    (void)state;
    open_groups(&a, 0.03, 6);
    assert_int_equal(compare(&a, a.group, 0, NULL, PERMUTATIONS, 1, NULL, &alone, NULL), SRNF_OK);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        struct srnf_comparison out;
        size_t size = a.g.points * sizeof(double);

        assert_int_equal(compare(&a, a.group, 0, NULL, PERMUTATIONS, 1, &context, &out, NULL),
                         SRNF_OK);
        assert_true(out.p_value == alone.p_value && out.max_p_value == alone.max_p_value);
        assert_memory_equal(out.p, alone.p, size);
        assert_memory_equal(out.significance, alone.significance, size);
        assert_memory_equal(out.fdr, alone.fdr, size);
        assert_memory_equal(out.statistic, alone.statistic, size);
        assert_true(atomic_load(&watch.highest) > 0.999);
        srnf_comparison_clear(&out);
    }
    srnf_comparison_clear(&alone);
    close_groups(&a);
}

static void stops_when_asked(void **state)
{
    struct groups a;

    (void)state;
    open_groups(&a, 0.03, 6);
    for (size_t after = 0; after < N + 6; after += 7) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, 2);
        struct srnf_comparison out = {0};

        watch.cancel_after = after;
        assert_int_equal(compare(&a, a.group, 0, NULL, PERMUTATIONS, 1, &context, &out, NULL),
                         SRNF_ECANCELED);
        assert_null(out.statistic);
    }
    close_groups(&a);
}

/* Subjects twice, the second time the same: everything is as with one of each. Covariates are
   averaged: those of two members lie on both sides of their subject's. */
static void repeated_subjects_count_once(void **state)
{
    enum { MEMBERS = 2 * N - 5 };
    struct srnf_compare_options options = srnf_compare_options_defaults();
    struct groups a;
    size_t size;
    size_t subjects[MEMBERS];
    int group[MEMBERS];
    double once[N];
    double twice[MEMBERS];
    double *q;

    (void)state;
    open_groups(&a, 0.03, 11);
    size = 3 * a.g.points;
    q = shapes_doubles(MEMBERS * size);
    for (size_t i = 0; i < MEMBERS; i++) {
        size_t own = i < N ? i : i - N;

        subjects[i] = N - 1 - own; /* numbers and order do not matter */
        group[i] = a.group[own];
        once[own] = sin(3.0 * (double)own);
        twice[i] = once[own];
        memcpy(q + i * size, a.registered_q + own * size, size * sizeof(double));
    }
    for (size_t i = N; i < MEMBERS; i++) {
        twice[i] += 0.5;
        twice[i - N] -= 0.5;
    }
    options.permutations = PERMUTATIONS;
    for (size_t covariates = 0; covariates < 2; covariates++) {
        struct srnf_comparison single;
        struct srnf_comparison both;
        double worst = 0.0;

        options.subjects = NULL;
        assert_int_equal(srnf_compare_groups(a.g.sht, N, a.mean, a.registered_q, a.group,
                                             covariates, once, &options, NULL, &single, NULL),
                         SRNF_OK);
        options.subjects = subjects;
        assert_int_equal(srnf_compare_groups(a.g.sht, MEMBERS, a.mean, q, group, covariates, twice,
                                             &options, NULL, &both, NULL),
                         SRNF_OK);
        assert_int_equal(both.subjects, N);
        assert_int_equal(both.n, MEMBERS);
        assert_true(both.p_value == single.p_value && both.max_p_value == single.max_p_value);
        for (size_t p = 0; p < a.g.points; p++) {
            double d = fabs(both.statistic[p] / single.statistic[p] - 1.0);

            worst = compare_max(worst, d);
        }
        figure_below("T^2 with members twice, relative", worst, 1e-9);
        srnf_comparison_clear(&single);
        srnf_comparison_clear(&both);
    }
    srnf_free(q);
    close_groups(&a);
}

/* Six subjects have 20 divisions in two groups of three: all are taken, and none of them twice. */
static void few_subjects_are_relabelled_in_all_ways(void **state)
{
    struct srnf_compare_options options = srnf_compare_options_defaults();
    const int group[6] = {0, 1, 0, 1, 0, 1};
    struct srnf_comparison out;
    struct srnf_comparison again;
    struct groups a;

    (void)state;
    open_groups(&a, 0.3, 12);
    options.permutations = 500;
    assert_int_equal(srnf_compare_groups(a.g.sht, 6, a.mean, a.registered_q, group, 0, NULL,
                                         &options, NULL, &out, NULL),
                     SRNF_OK);
    assert_true(out.test.exact && out.test.permutations == 19 && out.test.relabellings == 20.0);
    assert_true(fabs(out.test.least - 0.1) < 1e-15);
    assert_true(fabs(out.p_value - 0.1) < 1e-15); /* the largest bump that there can be */
    assert_true(srnf_permutation_at_floor(&out.test, out.p_value));
    options.seed = 77; /* nothing is drawn */
    assert_int_equal(srnf_compare_groups(a.g.sht, 6, a.mean, a.registered_q, group, 0, NULL,
                                         &options, NULL, &again, NULL),
                     SRNF_OK);
    assert_memory_equal(out.p, again.p, a.g.points * sizeof(double));
    srnf_comparison_clear(&out);
    srnf_comparison_clear(&again);
    for (size_t k = 3 * a.g.points; k < 6 * 3 * a.g.points;
         k++) { /* rounding tells nothing apart */
        a.registered_q[k] = a.registered_q[k % (3 * a.g.points)];
    }
    assert_int_equal(srnf_compare_groups(a.g.sht, 6, a.mean, a.registered_q, group, 0, NULL,
                                         &options, NULL, &out, NULL),
                     SRNF_OK);
    assert_true(out.p_value == 1.0);
    srnf_comparison_clear(&out);
    close_groups(&a);
}

/* The order of six with this number, below 720. */
static void order_of_six(size_t number, size_t order[6])
{
    for (size_t i = 0; i < 6; i++) {
        order[i] = number % (i + 1);
        number /= i + 1;
        for (size_t j = 0; j < i; j++) {
            order[j] += order[j] >= order[i];
        }
    }
}

/* p of F over all 720 orders of the residuals of six subjects. */
static double p_of_all_orders(const struct groups *a, const int *group, const double *covariate)
{
    size_t size = 3 * a->g.points;
    double *y = shapes_doubles(6 * size);
    double gram[36];
    struct compare_design design;
    double observed = 0.0;
    size_t as_large = 0;

    assert_int_equal(compare_design_create(&design, 6, group, 1, covariate, NULL), SRNF_OK);
    stats_weight(a->g.grid, 6, a->registered_q, NULL, y);
    compare_design_residuals(&design, size, y);
    assert_int_equal(stats_gram(6, size, y, gram, NULL), SRNF_OK);
    for (size_t number = 720; number-- > 0;) { /* the last number is the identity */
        double sum = 0.0, age = 0.0, all = 0.0, f;
        size_t order[6];

        order_of_six(number, order);
        for (size_t k = 0; k < 36; k++) {
            const double *u = design.basis + 6;

            sum += gram[k] * design.contrast[order[k / 6]] * design.contrast[order[k % 6]];
            age += gram[k] * u[order[k / 6]] * u[order[k % 6]];
            all += k % 7 == 0 ? gram[k] : 0.0;
        }
        sum /= design.squared;
        f = sum / (all - age - sum);
        observed = number == 719 ? f : observed;
        as_large += f >= observed * (1.0 - 1e-9);
    }
    compare_design_clear(&design);
    srnf_free(y);
    return (double)as_large / 720.0;
}

/* With covariates, relabellings are different where groups or covariates are: subjects that share
   both are exchanged to no effect. What always gives the observed value again is counted too. */
static void equal_rows_of_the_design_are_one_kind(void **state)
{
    struct srnf_compare_options options = srnf_compare_options_defaults();
    const int group[6] = {0, 1, 0, 1, 0, 1};
    const struct {
        double covariate[6];
        double relabellings, least;
    } cases[] = {
        /* Two of group 0 and one of group 1 have a: 6! / (2 2). Exchanging names of groups along
           with those of a and b is one relabelling that changes nothing. */
        {{7.0, 7.0, 7.0, -2.0, -2.0, -2.0}, 180.0, 2.0 / 180.0},
        /* The same ages in both groups: names of groups and the direction of age leave all as it
           is. */
        {{31.0, 31.0, 32.0, 32.0, 33.0, 33.0}, 720.0, 4.0 / 720.0},
        /* Nothing in common. */
        {{1.0, 2.0, 4.5, 9.0, 17.0, 30.0}, 720.0, 1.0 / 720.0},
    };
    struct groups a;

    (void)state;
    open_groups(&a, 0.3, 12);
    options.permutations = 800;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        struct srnf_comparison out;

        assert_int_equal(srnf_compare_groups(a.g.sht, 6, a.mean, a.registered_q, group, 1,
                                             cases[k].covariate, &options, NULL, &out, NULL),
                         SRNF_OK);
        assert_true(out.test.exact);
        assert_true(out.test.relabellings == cases[k].relabellings);
        assert_true((double)out.test.permutations == cases[k].relabellings - 1.0);
        figure_below("least p", fabs(out.test.least - cases[k].least), 1e-15);
        figure_below("p without repeats against p of all orders",
                     fabs(out.p_value - p_of_all_orders(&a, group, cases[k].covariate)), 1e-14);
        assert_true(out.p_value >= out.test.least * (1.0 - 1e-12));
        assert_true(out.max_p_value >= out.test.least * (1.0 - 1e-12));
        srnf_comparison_clear(&out);
    }
    options.permutations = 100; /* drawn at random: each may be as far */
    {
        struct srnf_comparison out;

        assert_int_equal(srnf_compare_groups(a.g.sht, 6, a.mean, a.registered_q, group, 1,
                                             cases[0].covariate, &options, NULL, &out, NULL),
                         SRNF_OK);
        assert_true(!out.test.exact && out.test.relabellings == 180.0);
        assert_true(out.test.least == 1.0 / 101.0);
        srnf_comparison_clear(&out);
    }
    close_groups(&a);
}

/* Three members of a subject with one age have that age, to the last bit: its subject and others of
   that age are of one kind. */
static void averages_of_equal_covariates_are_equal(void **state)
{
    enum { MEMBERS = 10 };
    struct srnf_compare_options options = srnf_compare_options_defaults();
    const size_t subjects[MEMBERS] = {0, 1, 2, 3, 4, 5, 0, 0, 3, 3};
    struct srnf_comparison out;
    struct groups a;
    double covariate[MEMBERS];
    int group[MEMBERS];

    (void)state;
    open_groups(&a, 0.3, 12);
    for (size_t i = 0; i < MEMBERS; i++) {
        group[i] = (int)(subjects[i] % 2);
        covariate[i] = subjects[i] < 3 ? 0.1 : 0.7;
    }
    options.permutations = 800;
    options.subjects = subjects;
    assert_int_equal(srnf_compare_groups(a.g.sht, MEMBERS, a.mean, a.registered_q, group, 1,
                                         covariate, &options, NULL, &out, NULL),
                     SRNF_OK);
    assert_true(out.test.exact && out.test.relabellings == 180.0);
    srnf_comparison_clear(&out);
    close_groups(&a);
}

static void wrong_input_is_refused(void **state)
{
    struct groups a;
    struct srnf_comparison out = {0};
    struct srnf_error error = {0};
    struct srnf_compare_options options = srnf_compare_options_defaults();
    double covariates[12 * N];
    int group[N];

    (void)state;
    open_groups(&a, 0.03, 6);
    memset(group, 0, sizeof group);
    assert_int_equal(compare(&a, group, 0, NULL, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "16 and 0 subjects"));
    group[3] = 2;
    assert_int_equal(compare(&a, group, 0, NULL, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_int_equal(error.element, 3);
    assert_int_equal(compare(&a, a.group, 0, NULL, 0, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "permutations is 0"));
    for (size_t i = 0; i < N; i++) {
        covariates[i] = 3.0;
    }
    assert_int_equal(compare(&a, a.group, 1, covariates, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "constant"));
    for (size_t i = 0; i < N; i++) {
        covariates[i] = 5.0 - 2.0 * a.group[i];
    }
    assert_int_equal(compare(&a, a.group, 1, covariates, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "determine the group"));
    covariates[1] = INFINITY;
    assert_int_equal(compare(&a, a.group, 1, covariates, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "not finite"));
    assert_int_equal(compare(&a, a.group, 12, covariates, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "too few"));
    assert_int_equal(srnf_compare_groups(a.g.sht, 3, a.mean, a.registered_q, a.group, 0, NULL, NULL,
                                         NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "3 surfaces"));
    options.subjects = (const size_t[N]){0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 0};
    assert_int_equal(srnf_compare_groups(a.g.sht, N, a.mean, a.registered_q, a.group, 0, NULL,
                                         &options, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "one subject differ"));
    assert_int_equal(error.element, 15);
    a.registered_q[7] = NAN;
    assert_int_equal(compare(&a, a.group, 0, NULL, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_null(out.statistic);
    close_groups(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(surfaces_that_are_known_are_not_searched),
        cmocka_unit_test(averages_are_searched_from_averages),
        cmocka_unit_test(statistic_is_that_of_hotelling),
        cmocka_unit_test(planted_difference_is_found_where_it_is),
        cmocka_unit_test(equal_groups_are_not_told_apart),
        cmocka_unit_test(covariates_are_regressed_out),
        cmocka_unit_test(model_is_that_of_least_squares),
        cmocka_unit_test(results_do_not_depend_on_threads),
        cmocka_unit_test(stops_when_asked),
        cmocka_unit_test(repeated_subjects_count_once),
        cmocka_unit_test(few_subjects_are_relabelled_in_all_ways),
        cmocka_unit_test(equal_rows_of_the_design_are_one_kind),
        cmocka_unit_test(averages_of_equal_covariates_are_equal),
        cmocka_unit_test(wrong_input_is_refused),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

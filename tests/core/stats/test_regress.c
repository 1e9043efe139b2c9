/*
 * test_regress.c - linear models of shape: coefficients against least squares done the long way, F
 * and its permutations against data permuted outright, planted effects that are found with their
 * size, rates of false findings, predictions; and what every long computation promises.
 */
#include "group.h"
#include "stats/compare.h"
#include "stats/maps.h"

#define DEGREE 5
#define N ((size_t)18)
#define NOISE_DEGREE 3
#define NOISE ((size_t)(NOISE_DEGREE + 1) * (NOISE_DEGREE + 1))
#define COLUMNS ((size_t)3) /* age, and two levels of a site with three */

/* Ellipsoids with noise, all parameterized alike; age in decades stretches them along z. */
struct study {
    struct group g;
    double *mean, *q;
    double design[N * COLUMNS];
    double age[N], site[N * 2];
};

static void open_study(struct study *a, double slope, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    double *nodes;
    double *r;
    double *values;
    void *workspace;

    group_open(&a->g, DEGREE, N);
    nodes = shapes_doubles(3 * a->g.points);
    r = shapes_doubles(3 * a->g.points);
    values = shapes_doubles(3 * a->g.points);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(a->g.sht));
    assert_non_null(workspace);
    stats_nodes(a->g.grid, nodes);
    a->mean = shapes_doubles(a->g.count);
    a->q = shapes_doubles(N * 3 * a->g.points);
    for (size_t i = 0; i < N; i++) {
        double noise[3 * NOISE];

        a->age[i] = 50.0 + 10.0 * test_random_normal(&random);
        a->site[2 * i] = i % 3 == 1 ? 1.0 : 0.0;
        a->site[2 * i + 1] = i % 3 == 2 ? 1.0 : 0.0;
        a->design[COLUMNS * i] = a->age[i];
        memcpy(a->design + COLUMNS * i + 1, a->site + 2 * i, 2 * sizeof(double));
        test_random_normals(&random, 3 * NOISE, noise);
        assert_int_equal(
            srnf_harmonics_at_points(NOISE_DEGREE, 3, noise, a->g.points, nodes, values, NULL),
            SRNF_OK);
        for (size_t k = 0; k < 3 * a->g.points; k++) {
            size_t c = k / a->g.points;
            double axis = 1.2 - 0.2 * (double)c + (c == 2 ? slope * (a->age[i] - 50.0) : 0.0);

            r[k] = axis * nodes[3 * (k % a->g.points) + c] + 0.01 * values[k];
        }
        srnf_sht_analysis(a->g.sht, 3, r, a->g.f[i], workspace);
        srnf_field(a->g.sht, a->g.f[i], a->q + i * 3 * a->g.points, workspace);
        for (size_t k = 0; k < a->g.count; k++) {
            a->mean[k] += a->g.f[i][k] / (double)N;
        }
    }
    srnf_free(workspace);
    srnf_free(values);
    srnf_free(r);
    srnf_free(nodes);
}

static void close_study(struct study *a)
{
    srnf_free(a->q);
    srnf_free(a->mean);
    group_close(&a->g);
}

/* Age given the site, and the site given age. */
static void nest(const struct study *a, struct srnf_nested nested[2])
{
    nested[0] = (struct srnf_nested){2, 1, a->site, a->age};
    nested[1] = (struct srnf_nested){1, 2, a->age, a->site};
}

static int regress(const struct study *a, const struct srnf_regress_design *design,
                   size_t permutations, uint64_t seed, const struct srnf_context *context,
                   struct srnf_regression *out, struct srnf_error *error)
{
    struct srnf_regress_options options = srnf_regress_options_defaults();

    options.permutations = permutations;
    options.bootstraps = 200;
    options.seed = seed;
    return srnf_regress(a->g.sht, N, a->mean, a->q, design, &options, context, out, error);
}

/* From a mean that is like none of the surfaces theirs are not found, from themselves they are: the
   intercept and slope of the displacements at a node give its effect. */
static void surfaces_that_are_known_are_not_searched(void **state)
{
    const size_t node = 31;
    struct srnf_regress_options options = srnf_regress_options_defaults();
    struct srnf_regress_design design = {.columns = 1};
    struct stats_embedding embedding;
    struct study a;
    double *vector;
    void *workspace;
    double ages = 0.0;
    double spread = 0.0;
    double slope[3] = {0.0, 0.0, 0.0};
    double worst[2];

    (void)state;
    open_study(&a, 0.01, 5);
    group_spoil_mean(&a.g, a.mean, 9);
    design.values = a.age;
    assert_int_equal(stats_embedding_create(a.g.sht, a.mean, &embedding), SRNF_OK);
    vector = shapes_doubles(3 * a.g.points);
    workspace = srnf_alloc(1, stats_embedding_workspace_size(&embedding));
    assert_non_null(workspace);
    for (size_t i = 0; i < N; i++) {
        ages += a.age[i] / (double)N;
    }
    for (size_t i = 0; i < N; i++) {
        stats_embed(&embedding, a.g.f[i], vector, workspace);
        spread += (a.age[i] - ages) * (a.age[i] - ages);
        for (size_t c = 0; c < 3; c++) {
            slope[c] += (a.age[i] - ages) * vector[c * a.g.points + node] / embedding.root[node];
        }
    }
    options.permutations = 19;
    options.bootstraps = 100;
    for (size_t known = 0; known < 2; known++) {
        struct srnf_regression out;
        double truth =
            sqrt(slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2]) / spread;

        options.surfaces = known ? a.g.surfaces : NULL;
        assert_int_equal(srnf_regress(a.g.sht, N, a.mean, a.q, &design, &options, NULL, &out, NULL),
                         SRNF_OK);
        worst[known] = fabs(out.effect[node] / truth - 1.0);
        srnf_regression_clear(&out);
    }
    printf("# from the mean on: %.3g off\n", worst[0]);
    figure_below("effect off that of the surfaces, relative", worst[1], 1e-11);
    assert_true(worst[0] > 1e2 * worst[1]);
    srnf_free(workspace);
    srnf_free(vector);
    stats_embedding_clear(&embedding);
    close_study(&a);
}

/* Least squares by the normal equations and Gauss elimination: b [p], of x [N][p] and y [N]. */
static void solve(size_t p, const double *x, const double *y, double *b)
{
    double m[5][6] = {{0}};

    for (size_t r = 0; r < p; r++) {
        for (size_t i = 0; i < N; i++) {
            for (size_t c = 0; c < p; c++) {
                m[r][c] += x[i * p + r] * x[i * p + c];
            }
            m[r][p] += x[i * p + r] * y[i];
        }
    }
    for (size_t k = 0; k < p; k++) {
        for (size_t r = 0; r < p; r++) {
            double factor = m[r][k] / m[k][k];

            for (size_t c = k; c <= p && r != k; c++) {
                m[r][c] -= factor * m[k][c];
            }
        }
    }
    for (size_t k = 0; k < p; k++) {
        b[k] = m[k][p] / m[k][k];
    }
}

/* [N][p] with the constant and centred age, so that the normal equations are harmless. */
static void long_design(const struct study *a, double *x)
{
    for (size_t i = 0; i < N; i++) {
        x[4 * i] = 1.0;
        x[4 * i + 1] = a->age[i] - 50.0;
        x[4 * i + 2] = a->site[2 * i];
        x[4 * i + 3] = a->site[2 * i + 1];
    }
}

static void coefficients_are_least_squares(void **state)
{
    struct study a;
    struct srnf_regression out;
    struct srnf_nested nested[2];
    struct srnf_regress_design design = {.columns = COLUMNS, .tests = 2, .nested = nested};
    double x[4 * N];
    double worst = 0.0;
    double largest = 0.0;
    double residual = 0.0;
    size_t size;

    (void)state;
    open_study(&a, 0.003, 1);
    size = 3 * a.g.points;
    nest(&a, nested);
    design.values = a.design;
    long_design(&a, x);
    assert_int_equal(regress(&a, &design, 9, 0, NULL, &out, NULL), SRNF_OK);
    assert_int_equal(out.freedom, N - 4);
    for (size_t k = 0; k < size; k++) {
        double y[N];
        double b[4];
        double square = 0.0;

        for (size_t i = 0; i < N; i++) {
            y[i] = a.q[i * size + k];
        }
        solve(4, x, y, b);
        for (size_t i = 0; i < N; i++) {
            double fit = 0.0;

            for (size_t c = 0; c < 4; c++) {
                fit += b[c] * x[4 * i + c];
            }
            square += (y[i] - fit) * (y[i] - fit);
        }
        residual += a.g.grid->weight[k % a.g.points / a.g.grid->n_phi] * square / (double)(N - 4);
        b[0] -= 50.0 * b[1];
        for (size_t c = 0; c < 4; c++) {
            worst = compare_max(worst, fabs(out.coefficients[c * size + k] - b[c]));
            largest = compare_max(largest, fabs(b[c]));
        }
    }
    figure_below("coefficients off least squares, relative", worst / largest, 1e-12);
    figure_below("residual variance off the long way, relative",
                 fabs(out.residual_variance / residual - 1.0), 1e-11);
    srnf_regression_clear(&out);
    close_study(&a);
}

/* F of two models of weighted data y [N][size], by residual sums of squares the long way. */
static double long_f(const struct study *a, const double *y, const double *x, double *explained)
{
    size_t size = 3 * a->g.points;
    double small = 0.0;
    double large = 0.0;

    for (size_t k = 0; k < size; k++) {
        double w = a->g.grid->weight[k % a->g.points / a->g.grid->n_phi];
        double one[N];
        double b[4];
        double reduced[3 * N];

        for (size_t i = 0; i < N; i++) {
            one[i] = y[i * size + k];
            reduced[3 * i] = x[4 * i];
            reduced[3 * i + 1] = x[4 * i + 2];
            reduced[3 * i + 2] = x[4 * i + 3];
        }
        solve(4, x, one, b);
        for (size_t i = 0; i < N; i++) {
            double r =
                one[i] - b[0] - b[1] * x[4 * i + 1] - b[2] * x[4 * i + 2] - b[3] * x[4 * i + 3];

            large += w * r * r;
        }
        solve(3, reduced, one, b);
        for (size_t i = 0; i < N; i++) {
            double r = one[i] - b[0] - b[1] * reduced[3 * i + 1] - b[2] * reduced[3 * i + 2];

            small += w * r * r;
        }
    }
    *explained = small - large;
    return (small - large) / (large / (double)(N - 4));
}

/* Permuted residuals of the smaller model on its fit: what Freedman and Lane do, outright. */
static void freedman_lane(const struct study *a, const double *x, const uint32_t *order, double *y)
{
    size_t size = 3 * a->g.points;

    for (size_t k = 0; k < size; k++) {
        double one[N];
        double b[4];
        double reduced[3 * N];
        double fit[N];

        for (size_t i = 0; i < N; i++) {
            one[i] = a->q[i * size + k];
            reduced[3 * i] = x[4 * i];
            reduced[3 * i + 1] = x[4 * i + 2];
            reduced[3 * i + 2] = x[4 * i + 3];
        }
        solve(3, reduced, one, b);
        for (size_t i = 0; i < N; i++) {
            fit[i] = b[0] + b[1] * reduced[3 * i + 1] + b[2] * reduced[3 * i + 2];
        }
        /* compare_permutation: entry order[i] of P'v is v[i], so that (P y)[i] = y[order[i]] */
        for (size_t i = 0; i < N; i++) {
            y[i * size + k] = fit[i] + one[order[i]] - fit[order[i]];
        }
    }
}

static void p_is_that_of_permuted_data(void **state)
{
    const size_t permutations = 60;
    struct study a;
    struct srnf_regression out;
    struct srnf_nested nested[2];
    struct srnf_regress_design design = {.columns = COLUMNS, .tests = 2, .nested = nested};
    double x[4 * N];
    double *y;
    double explained;
    double total = 0.0;
    double observed;
    size_t as_far = 0;

    (void)state;
    open_study(&a, 0.0004, 2);
    nest(&a, nested);
    design.values = a.design;
    long_design(&a, x);
    y = shapes_doubles(N * 3 * a.g.points);
    assert_int_equal(regress(&a, &design, permutations, 5, NULL, &out, NULL), SRNF_OK);
    observed = long_f(&a, a.q, x, &explained);
    total = out.variance * (double)(N - 1);
    figure_below("F off the long way, relative", fabs(out.test_of[0].f / observed - 1.0), 1e-9);
    figure_below("r2 off the long way", fabs(out.test_of[0].r2.value - explained / total), 1e-10);
    for (size_t k = 1; k <= permutations; k++) {
        uint32_t order[N];

        compare_permutation(5, k, N, order);
        freedman_lane(&a, x, order, y);
        as_far += stats_as_large(long_f(&a, y, x, &explained), observed);
    }
    printf("# %zu of %zu permutations as far, p %.4f\n", as_far, permutations,
           out.test_of[0].p_value);
    assert_true(as_far > 0 && as_far < permutations);
    figure_below(
        "p off that of permuted data",
        fabs(out.test_of[0].p_value - (1.0 + (double)as_far) / (1.0 + (double)permutations)),
        1e-12);
    srnf_free(y);
    srnf_regression_clear(&out);
    close_study(&a);
}

/* Two groups: T^2, its map and the p-values are those of the comparison. */
static void two_groups_are_those_of_the_comparison(void **state)
{
    struct study a;
    struct srnf_regression out;
    struct srnf_comparison compared;
    struct srnf_compare_options options = srnf_compare_options_defaults();
    struct srnf_nested nested;
    struct srnf_regress_design design = {.columns = 2, .tests = 1, .nested = &nested};
    double values[2 * N];
    double group_column[N];
    int group[N];
    double worst = 0.0;

    (void)state;
    open_study(&a, 0.002, 3);
    for (size_t i = 0; i < N; i++) {
        group[i] = i % 2 == 1;
        group_column[i] = (double)group[i];
        values[2 * i] = a.age[i];
        values[2 * i + 1] = group_column[i];
    }
    design.values = values;
    nested = (struct srnf_nested){1, 1, a.age, group_column};
    options.permutations = 99;
    options.seed = 4;
    assert_int_equal(srnf_compare_groups(a.g.sht, N, a.mean, a.q, group, 1, a.age, &options, NULL,
                                         &compared, NULL),
                     SRNF_OK);
    assert_int_equal(regress(&a, &design, 99, 4, NULL, &out, NULL), SRNF_OK);
    for (size_t p = 0; p < a.g.points; p++) {
        worst = compare_max(worst, fabs(out.test_of[0].statistic[p] / compared.statistic[p] - 1.0));
        worst = compare_max(worst, fabs(out.test_of[0].significance[p] - compared.significance[p]));
        worst = compare_max(worst, fabs(out.test_of[0].fdr[p] - compared.fdr[p]));
        worst = compare_max(worst, fabs(out.effect[a.g.points + p] - compared.effect[p]));
        worst = compare_max(worst, fabs(out.normal[a.g.points + p] - compared.normal[p]));
    }
    figure_below("maps off those of the comparison", worst, 1e-8);
    srnf_comparison_clear(&compared);
    srnf_regression_clear(&out);
    close_study(&a);
}

static void planted_effect_is_found_and_predicted(void **state)
{
    const double at[2 * COLUMNS] = {40.0, 0.0, 0.0, 60.0, 0.0, 0.0};
    struct study a;
    struct srnf_regression out;
    struct srnf_nested nested[2];
    struct srnf_regress_design design = {
        .columns = COLUMNS, .tests = 2, .nested = nested, .points = 2, .at = at};
    double height[2];
    void *workspace;
    double *nodes;
    double *r;

    (void)state;
    open_study(&a, 0.004, 6);
    nest(&a, nested);
    design.values = a.design;
    assert_int_equal(regress(&a, &design, 499, 0, NULL, &out, NULL), SRNF_OK);
    printf("# age: p %.3f, r2 %.3f (%.3f to %.3f); site: p %.3f, r2 %.3f (%.3f to %.3f)\n",
           out.test_of[0].p_value, out.test_of[0].r2.value, out.test_of[0].r2.interval[0],
           out.test_of[0].r2.interval[1], out.test_of[1].p_value, out.test_of[1].r2.value,
           out.test_of[1].r2.interval[0], out.test_of[1].r2.interval[1]);
    assert_true(out.test_of[0].p_value == 1.0 / 500.0);
    assert_true(out.test_of[0].max_p_value <= 0.01);
    assert_int_equal(out.test_of[1].degrees, 2);
    assert_true(out.test_of[0].r2.interval[0] > out.test_of[1].r2.interval[1]);
    assert_true(out.test_of[0].part.value >= out.test_of[0].r2.value);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(a.g.sht));
    nodes = shapes_doubles(3 * a.g.points);
    r = shapes_doubles(3 * a.g.points);
    assert_non_null(workspace);
    stats_nodes(a.g.grid, nodes);
    for (size_t k = 0; k < 2; k++) {
        double z[2] = {0.0, 0.0};

        assert_true(out.predicted[k].relative_energy < 1e-3);
        assert_true(out.predicted[k].leverage > 1.0 / (double)N);
        srnf_sht_synthesis(a.g.sht, 3, out.predicted[k].coefficients, r, workspace);
        for (size_t p = 0; p < a.g.points; p++) {
            z[0] = compare_max(z[0], r[2 * a.g.points + p]);
            z[1] = compare_min(z[1], r[2 * a.g.points + p]);
            assert_true(out.predicted[k].confidence[p] >= 2.0 * out.predicted[k].standard_error[p]);
        }
        height[k] = z[1] < 0.0 ? z[0] - z[1] : NAN;
    }
    /* Each year moves a node by 0.004 times the cosine of its angle; the first is near a pole. */
    figure_below("growth of the predicted height off the truth",
                 fabs((height[1] - height[0]) / (2.0 * 20.0 * 0.004 * nodes[2]) - 1.0), 0.02);
    for (size_t p = 0; p < a.g.points; p++) {
        if (fabs(nodes[3 * p + 2]) > 0.95) {
            assert_true(fabs(out.normal[p] - 0.004 * fabs(nodes[3 * p + 2])) <
                        4.0 * out.standard_error[p]);
            assert_true(out.test_of[0].significance[p] <= 0.05);
        }
    }
    srnf_free(workspace);
    srnf_free(nodes);
    srnf_free(r);
    srnf_regression_clear(&out);
    close_study(&a);
}

/* Shuffled covariates: p of a term beside another that does have an effect. */
static void shuffled_covariates_are_found_at_the_level(void **state)
{
    const size_t runs = 60;
    struct study a;
    size_t global = 0;
    size_t local = 0;
    size_t inside = 0;

    (void)state;
    figures_count_unsanitized();
    open_study(&a, 0.004, 7);
    for (size_t run = 0; run < runs; run++) {
        struct srnf_regression out;
        struct srnf_nested nested = {1, 2, a.age, a.site};
        struct srnf_regress_design design = {.columns = COLUMNS, .tests = 1, .nested = &nested};
        double values[N * COLUMNS];
        double site[N * 2];
        uint32_t order[N];

        compare_permutation(78, run + 1, N, order);
        for (size_t i = 0; i < N; i++) {
            memcpy(site + 2 * i, a.site + 2 * order[i], 2 * sizeof(double));
            values[COLUMNS * i] = a.age[i];
            memcpy(values + COLUMNS * i + 1, site + 2 * i, 2 * sizeof(double));
        }
        nested.columns = site;
        design.values = values;
        assert_int_equal(regress(&a, &design, 99, run, NULL, &out, NULL), SRNF_OK);
        assert_true(isfinite(out.test_of[0].p_value) && isfinite(out.test_of[0].max_p_value));
        global += out.test_of[0].p_value <= 0.1;
        local += out.test_of[0].max_p_value <= 0.1;
        inside += out.test_of[0].part.interval[0] <= 0.01;
        srnf_regression_clear(&out);
    }
    printf("# %zu shuffles at level .1: %zu, map %zu; intervals of the share from 0: %zu\n", runs,
           global, local, inside);
    assert_true(global <= 14 && local <= 14); /* Binomial(60, .1): beyond with a chance of 1e-3 */
    assert_true(inside >= 46);
    close_study(&a);
}

/* Columns of noise, nearly as many as subjects: they explain most of what there is, and of a share
   of theirs nothing is known. */
static void columns_of_noise_have_no_share(void **state)
{
    enum { NOISY = 11, STUDIES = 40 };
    struct study a;
    size_t above = 0;

    (void)state;
    figures_count_unsanitized();
    for (size_t run = 0; run < STUDIES; run++) {
        struct test_random random = test_random_seed(400 + run);
        double values[N * NOISY];
        const struct srnf_nested nested = {0, NOISY, NULL, values};
        const struct srnf_regress_design design = {
            .columns = NOISY, .values = values, .tests = 1, .nested = &nested};
        struct srnf_regression out;

        open_study(&a, 0.0, 900 + run);
        test_random_normals(&random, N * NOISY, values);
        assert_int_equal(regress(&a, &design, 1, run, NULL, &out, NULL), SRNF_OK);
        assert_true(out.test_of[0].r2.value > 0.5);
        assert_true(out.test_of[0].r2.interval[0] >= 0.0 && out.test_of[0].r2.interval[1] <= 1.0);
        above += out.test_of[0].r2.interval[0] > 0.0;
        assert_true((out.test_of[0].r2.interval[0] > 0.0) ==
                    (out.test_of[0].part.interval[0] > 0.0));
        srnf_regression_clear(&out);
        close_study(&a);
    }
    printf("# shares of noise above 0: %zu of %d\n", above, STUDIES);
    assert_in_range(above, 0, 5); /* Binomial(40, .025): beyond with a chance of 3e-4 */
}

/* Of one surface, sent again and again, there is nothing to find: what is left is rounding. */
static void equal_surfaces_tell_nothing(void **state)
{
    struct study a;
    struct srnf_nested nested[2];
    struct srnf_regression out;
    struct srnf_regress_design design = {.columns = COLUMNS, .tests = 2, .nested = nested};

    (void)state;
    open_study(&a, 0.0, 12);
    nest(&a, nested);
    design.values = a.design;
    for (size_t i = 1; i < N; i++) {
        memcpy(a.q + i * 3 * a.g.points, a.q, 3 * a.g.points * sizeof(double));
    }
    memcpy(a.mean, a.g.f[0], a.g.count * sizeof(double));
    assert_int_equal(regress(&a, &design, 19, 5, NULL, &out, NULL), SRNF_OK);
    for (size_t t = 0; t < 2; t++) {
        assert_true(out.test_of[t].p_value == 1.0 && out.test_of[t].max_p_value == 1.0);
        assert_true(isnan(out.test_of[t].r2.interval[0]));
        assert_true(isnan(out.test_of[t].part.interval[1]));
    }
    assert_true(out.variance == 0.0 && isnan(out.variance_interval[0]));
    assert_true(isnan(out.residual_interval[1]) && isnan(out.norm_intervals[2]));
    srnf_regression_clear(&out);
    close_study(&a);
}

static void results_do_not_depend_on_threads(void **state)
{
    const double at[COLUMNS] = {40.0, 1.0, 0.0};
    struct study a;
    struct srnf_regression alone;
    struct srnf_nested nested[2];
    struct srnf_regress_design design = {
        .columns = COLUMNS, .tests = 2, .nested = nested, .points = 1, .at = at};

    (void)state;
    open_study(&a, 0.001, 8);
    nest(&a, nested);
    design.values = a.design;
    assert_int_equal(regress(&a, &design, 99, 1, NULL, &alone, NULL), SRNF_OK);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        struct srnf_regression out;
        size_t size = a.g.points * sizeof(double);

        assert_int_equal(regress(&a, &design, 99, 1, &context, &out, NULL), SRNF_OK);
        for (size_t t = 0; t < 2; t++) {
            assert_true(out.test_of[t].p_value == alone.test_of[t].p_value);
            assert_memory_equal(out.test_of[t].significance, alone.test_of[t].significance, size);
            assert_memory_equal(&out.test_of[t].r2, &alone.test_of[t].r2, sizeof out.test_of[t].r2);
        }
        assert_memory_equal(out.coefficients, alone.coefficients, 4 * 3 * size);
        assert_memory_equal(out.predicted[0].confidence, alone.predicted[0].confidence, size);
        assert_memory_equal(out.predicted[0].coefficients, alone.predicted[0].coefficients,
                            a.g.count * sizeof(double));
        assert_true(atomic_load(&watch.highest) > 0.999);
        srnf_regression_clear(&out);
    }
    srnf_regression_clear(&alone);
    close_study(&a);
}

static void stops_when_asked(void **state)
{
    struct study a;
    struct srnf_nested nested[2];
    struct srnf_regress_design design = {.columns = COLUMNS, .tests = 2, .nested = nested};

    (void)state;
    open_study(&a, 0.001, 8);
    nest(&a, nested);
    design.values = a.design;
    for (size_t after = 0; after < 40; after += 13) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, 2);
        struct srnf_regression out = {0};

        watch.cancel_after = after;
        assert_int_equal(regress(&a, &design, 999, 1, &context, &out, NULL), SRNF_ECANCELED);
        assert_null(out.test_of);
    }
    close_study(&a);
}

/* Members of a subject are averaged: each twice is each once. */
static void repeated_subjects_count_once(void **state)
{
    struct srnf_regress_options options = srnf_regress_options_defaults();
    struct study a;
    struct srnf_regression once;
    struct srnf_regression twice;
    struct srnf_nested nested;
    struct srnf_regress_design design = {.columns = 1, .tests = 1, .nested = &nested};
    size_t subjects[2 * N];
    double values[2 * N];
    double *q;
    size_t size;

    (void)state;
    open_study(&a, 0.001, 9);
    size = 3 * a.g.points;
    q = shapes_doubles(2 * N * size);
    for (size_t i = 0; i < 2 * N; i++) {
        subjects[i] = i % N;
        values[i] = a.age[i % N];
        memcpy(q + i * size, a.q + i % N * size, size * sizeof(double));
    }
    options.permutations = 199;
    options.bootstraps = 100;
    design.values = a.age;
    nested = (struct srnf_nested){0, 1, NULL, a.age};
    assert_int_equal(srnf_regress(a.g.sht, N, a.mean, a.q, &design, &options, NULL, &once, NULL),
                     SRNF_OK);
    options.subjects = subjects;
    design.values = values;
    nested.columns = values;
    assert_int_equal(srnf_regress(a.g.sht, 2 * N, a.mean, q, &design, &options, NULL, &twice, NULL),
                     SRNF_OK);
    assert_int_equal(twice.n, 2 * N);
    assert_int_equal(twice.subjects, N);
    assert_true(twice.test_of[0].p_value == once.test_of[0].p_value);
    figure_below("F of each twice", fabs(twice.test_of[0].f / once.test_of[0].f - 1.0), 1e-12);
    srnf_regression_clear(&once);
    srnf_regression_clear(&twice);
    srnf_free(q);
    close_study(&a);
}

/* 6 subjects of two sites: 20 relabellings, of which two always give what was observed. */
static void few_subjects_are_relabelled_in_all_ways(void **state)
{
    struct srnf_regress_options options = srnf_regress_options_defaults();
    const double site[6] = {0.0, 1.0, 0.0, 1.0, 0.0, 1.0};
    const struct srnf_nested nested = {0, 1, NULL, site};
    const struct srnf_regress_design design = {
        .columns = 1, .values = site, .tests = 1, .nested = &nested};
    struct srnf_regression out;
    struct study a;

    (void)state;
    open_study(&a, 0.001, 10);
    assert_int_equal(srnf_regress(a.g.sht, 6, a.mean, a.q, &design, &options, NULL, &out, NULL),
                     SRNF_OK);
    assert_true(out.test.exact);
    assert_int_equal(out.test.permutations, 19);
    figure_below("least p", fabs(out.test_of[0].least - 0.1), 1e-15);
    assert_true(out.test_of[0].p_value >= 0.1 * (1.0 - 1e-12));
    srnf_regression_clear(&out);
    close_study(&a);
}

static void wrong_input_is_refused(void **state)
{
    struct study a;
    struct srnf_regression out = {0};
    struct srnf_error error = {0};
    struct srnf_nested nested[2];
    struct srnf_regress_design design = {.columns = COLUMNS, .tests = 2, .nested = nested};
    struct srnf_regress_options options = srnf_regress_options_defaults();
    double at[COLUMNS] = {INFINITY, 0.0, 0.0};

    (void)state;
    open_study(&a, 0.001, 11);
    nest(&a, nested);
    design.values = a.design;
    assert_int_equal(regress(&a, &design, 0, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "permutations is 0"));
    options.bootstraps = 99;
    assert_int_equal(srnf_regress(a.g.sht, N, a.mean, a.q, &design, &options, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "bootstraps is 99"));
    assert_int_equal(srnf_regress(a.g.sht, 3, a.mean, a.q, &design, NULL, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "3 surfaces"));
    assert_int_equal(srnf_regress(a.g.sht, 6, a.mean, a.q, &design, NULL, NULL, &out, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "6 subjects are too few for 4 coefficients: 7"));
    nested[1].columns = a.age;
    nested[1].tested = 1;
    assert_int_equal(regress(&a, &design, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "test 1: what is tested follows"));
    assert_int_equal(error.element, 1);
    nest(&a, nested);
    design.points = 1;
    design.at = at;
    assert_int_equal(regress(&a, &design, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "point 0"));
    design.points = 0;
    for (size_t i = 0; i < N; i++) {
        a.design[COLUMNS * i + 1] = 3.0 - 1e6 * a.design[COLUMNS * i];
    }
    assert_int_equal(regress(&a, &design, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "column 1 is constant or follows"));
    a.design[4] = NAN;
    assert_int_equal(regress(&a, &design, 9, 0, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "not finite"));
    assert_null(out.test_of);
    close_study(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(surfaces_that_are_known_are_not_searched),
        cmocka_unit_test(coefficients_are_least_squares),
        cmocka_unit_test(p_is_that_of_permuted_data),
        cmocka_unit_test(two_groups_are_those_of_the_comparison),
        cmocka_unit_test(planted_effect_is_found_and_predicted),
        cmocka_unit_test(shuffled_covariates_are_found_at_the_level),
        cmocka_unit_test(columns_of_noise_have_no_share),
        cmocka_unit_test(equal_surfaces_tell_nothing),
        cmocka_unit_test(results_do_not_depend_on_threads),
        cmocka_unit_test(stops_when_asked),
        cmocka_unit_test(repeated_subjects_count_once),
        cmocka_unit_test(few_subjects_are_relabelled_in_all_ways),
        cmocka_unit_test(wrong_input_is_refused),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

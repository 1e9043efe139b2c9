/*
 * test_norms.c - how odd a surface is beside the members of a model: ranks and their uniformity,
 * values by predictions against those fitted anew, percentiles of others of the same kind, planted
 * bumps that are found where they are; and what every long computation promises.
 *
 * srnfd-test: slow
 */
#include "normals.h"

#define N ((size_t)30)

/* ---- Ranks ----------------------------------------------------------------------------------- */

static void ranks_count_subjects(void **state)
{
    const double values[5] = {1.0, 2.0, 3.0, 3.0, 9.0};
    const double twice[6] = {1.0, 1.0, 2.0, 3.0, 3.0, 9.0};
    const double weights[6] = {0.5, 0.5, 1.0, 1.0, 1.0, 1.0};
    struct srnf_norm_rank rank;
    struct srnf_norm_rank same;

    (void)state;
    assert_int_equal(srnf_norm_rank(5, values, NULL, 3.0, &rank), SRNF_OK);
    figure_below("percentile of a tie", fabs(rank.percentile - 100.0 * 3.5 / 6.0), 1e-12);
    assert_true(rank.as_odd == 3.0 && rank.p_value == 4.0 / 6.0);
    assert_true(rank.interval[0] < rank.percentile && rank.percentile < rank.interval[1]);
    assert_int_equal(srnf_norm_rank(6, twice, weights, 3.0, &same), SRNF_OK);
    figure_below("percentile with a subject twice", fabs(same.percentile - rank.percentile), 1e-12);
    assert_int_equal(srnf_norm_rank(5, values, NULL, 10.0, &rank), SRNF_OK);
    assert_true(rank.p_value == 1.0 / 6.0 && rank.percentile < 100.0);
    assert_int_equal(srnf_norm_rank(0, values, NULL, 1.0, &rank), SRNF_EINVAL);
    assert_int_equal(srnf_norm_rank(5, values, NULL, NAN, &rank), SRNF_EINVAL);
    assert_int_equal(srnf_norm_rank(5, values, (const double[5]){0.0, 1, 1, 1, 1}, 1.0, &rank),
                     SRNF_EINVAL);
}

/* Of 20 values and one more, all drawn alike, each rank is as likely as any other. */
static void ranks_together_are_uniform(void **state)
{
    const size_t runs = 2000;
    struct test_random random = test_random_seed(5);
    double percentiles[2000];
    double distance;
    double p;

    (void)state;
    for (size_t run = 0; run < runs; run++) {
        double values[2 * 20];
        double own[2];
        struct srnf_norm_rank rank;

        for (size_t i = 0; i <= 20; i++) {
            double a = test_random_normal(&random);
            double b = 0.6 * a + 0.8 * test_random_normal(&random); /* the traits go together */

            if (i < 20) {
                values[i] = a;
                values[20 + i] = b;
            } else {
                own[0] = a;
                own[1] = b;
            }
        }
        assert_int_equal(srnf_norm_rank_together(20, 2, values, NULL, own, &rank), SRNF_OK);
        percentiles[run] = rank.percentile;
    }
    assert_int_equal(srnf_norm_uniform(runs, percentiles, &distance, &p), SRNF_OK);
    /* Percentiles of 20 are steps of 1/21, half a step off at most. */
    figure_below("distance of ranks together from uniform ones", distance,
                 1.63 / sqrt(2000.0) + 0.5 / 21.0);
    assert_int_equal(
        srnf_norm_rank_together(20, 0, percentiles, NULL, percentiles, &(struct srnf_norm_rank){0}),
        SRNF_EINVAL);
}

/* Against tabulated values: D of 10 at p = .05 is .409, of 100 .134. */
static void uniformity_has_its_p(void **state)
{
    double even[100];
    double distance;
    double p;

    (void)state;
    for (size_t i = 0; i < 100; i++) {
        even[i] = ((double)i + 0.5) * 0.8704; /* all below 86.6: D = .134 */
    }
    assert_int_equal(srnf_norm_uniform(100, even, &distance, &p), SRNF_OK);
    figure_below("distance", fabs(distance - (1.0 - 0.995 * 0.8704)), 1e-3);
    figure_below("p at the tabulated limit of .05", fabs(p - 0.05), 0.006);
    for (size_t i = 0; i < 10; i++) {
        even[i] = ((double)i + 0.5) * (1.0 - 0.409) * 10.0 / 0.95;
    }
    assert_int_equal(srnf_norm_uniform(10, even, &distance, &p), SRNF_OK);
    assert_true(p > 0.03 && p < 0.08);
    assert_int_equal(srnf_norm_uniform(0, even, &distance, &p), SRNF_EINVAL);
}

/* ---- Values ---------------------------------------------------------------------------------- */

static int score(const struct normals *a, const struct srnf_norm_model *model, const double *q,
                 double age, bool map, bool check, struct srnf_score *out)
{
    struct srnf_norm_options options = srnf_norm_options_defaults();

    options.at = &age;
    options.map = map;
    options.check = check;
    return srnf_score(a->g.sht, model, q, &options, NULL, out, NULL);
}

/* Each of 12 beside the other 11: their ranks are those of 12 values, each once, as if none of them
   were the new one. Surfaces are registered to nothing here. */
static void surface_and_members_are_treated_alike(void **state)
{
    const size_t n = 12;
    struct normals a;

    (void)state;
    normals_open(&a, n, 0.01, 77);
    for (size_t covariates = 0; covariates < 2; covariates++) {
        size_t seen[2][12] = {{0}};

        for (size_t out = 0; out < n; out++) {
            struct srnf_norm_options options = srnf_norm_options_defaults();
            struct srnf_norm_model model = normals_model(&a, covariates == 1);
            struct srnf_pca pca;
            struct srnf_score score;
            double *q = shapes_doubles(n * a.size);
            double age[12];

            for (size_t i = 0; i < n; i++) { /* the last one is the new one */
                size_t from = (out + 1 + i) % n;

                memcpy(q + i * a.size, a.q + from * a.size, a.size * sizeof(double));
                age[i] = a.age[from];
            }
            stats_average(a.g.grid, n - 1, q, a.mean_q);
            assert_int_equal(srnf_pca_fit(a.g.grid, n - 1, a.mean_q, q, 0, &pca), SRNF_OK);
            model.pca = &pca;
            model.calibration = NULL;
            model.values = covariates ? age : NULL;
            options.at = &age[n - 1];
            options.map = options.check = false;
            assert_int_equal(
                srnf_score(a.g.sht, &model, q + (n - 1) * a.size, &options, NULL, &score, NULL),
                SRNF_OK);
            for (size_t t = 0; t < 2; t++) {
                double rank = score.trait[t].percentile * (double)n / 100.0 - 0.5;

                figure_below("rank off a whole number", fabs(rank - round(rank)), 1e-9);
                seen[t][(size_t)round(rank)]++;
            }
            srnf_score_clear(&score);
            srnf_pca_clear(&pca);
            srnf_free(q);
        }
        for (size_t r = 0; r < n; r++) {
            assert_int_equal(seen[SRNF_TRAIT_RESIDUAL][r], 1);
            assert_int_equal(seen[SRNF_TRAIT_DISTANCE][r], 1);
        }
    }
    normals_close(&a);
}

/* Without covariates the deviations from a prediction are those of the calibration. */
/* Fields that are a stack of one part are judged as they are without it; they have no map. */
static void a_stack_of_one_part_is_judged_alike(void **state)
{
    const double weight = 1.0, age = 0.0;
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_score plain, stacked;
    struct srnf_stack stack;

    (void)state;
    normals_open(&a, N, 0.004, 1);
    normals_fit(&a, NULL);
    model = normals_model(&a, false);
    assert_int_equal(score(&a, &model, a.q, age, false, false, &plain), SRNF_OK);
    assert_int_equal(srnf_stack_open(srnf_sht_grid(a.g.sht), 1, &weight, 0.0, &stack), SRNF_OK);
    model.grid = &stack.grid;
    assert_int_equal(score(&a, &model, a.q, age, false, false, &stacked), SRNF_OK);
    for (size_t t = 0; t < SRNF_NORM_TRAITS; t++) {
        assert_true(plain.trait[t].value == stacked.trait[t].value);
        assert_true(plain.trait[t].percentile == stacked.trait[t].percentile);
    }
    srnf_score_clear(&stacked);
    assert_int_equal(score(&a, &model, a.q, age, true, false, &stacked), SRNF_EINVAL);
    srnf_score_clear(&plain);
    srnf_stack_clear(&stack);
    normals_close(&a);
}

static void predictions_by_the_mean_are_the_calibration(void **state)
{
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_norm_options options = srnf_norm_options_defaults();
    double *q;
    double *f;
    double worst = 0.0;

    (void)state;
    normals_open(&a, N, 0.004, 1);
    normals_fit(&a, NULL);
    model = normals_model(&a, false);
    q = shapes_doubles(a.size);
    f = shapes_doubles(a.g.count);
    normals_draw(&a, 3.0, 0.0, f, q);
    options.map = options.check = false;
    for (size_t member = 0; member <= N; member += 3) {
        struct srnf_score by_calibration;
        struct srnf_score by_folds;

        options.member = member;
        model.calibration = &a.calibration;
        assert_int_equal(srnf_score(a.g.sht, &model, q, &options, NULL, &by_calibration, NULL),
                         SRNF_OK);
        model.calibration = NULL;
        assert_int_equal(srnf_score(a.g.sht, &model, q, &options, NULL, &by_folds, NULL), SRNF_OK);
        assert_int_equal(by_folds.counted, by_calibration.counted);
        assert_int_equal(by_folds.compared, member < N ? N - 1 : N);
        for (size_t t = 0; t < SRNF_NORM_TRAITS; t++) {
            worst = compare_max(
                worst, fabs(by_folds.trait[t].value / by_calibration.trait[t].value - 1.0));
            assert_true(by_folds.trait[t].percentile == by_calibration.trait[t].percentile);
        }
        assert_true(by_folds.overall.percentile == by_calibration.overall.percentile);
        srnf_score_clear(&by_calibration);
        srnf_score_clear(&by_folds);
    }
    figure_below("values by folds off those of the calibration, relative", worst, 1e-7);
    srnf_free(q);
    srnf_free(f);
    normals_close(&a);
}

/* The distance from a line through all fields but that of the member, done the long way. */
static double distance_from_line(const struct normals *a, size_t left_out, const double *q,
                                 double age)
{
    double count = 0.0;
    double mean_age = 0.0;
    double square = 0.0;
    double sum = 0.0;

    for (size_t i = 0; i < a->n; i++) {
        count += i != left_out;
        mean_age += i != left_out ? a->age[i] : 0.0;
    }
    mean_age /= count;
    for (size_t i = 0; i < a->n; i++) {
        square += i != left_out ? (a->age[i] - mean_age) * (a->age[i] - mean_age) : 0.0;
    }
    for (size_t k = 0; k < a->size; k++) {
        double mean = 0.0;
        double slope = 0.0;
        double off;

        for (size_t i = 0; i < a->n; i++) {
            double y = a->q[i * a->size + k];

            mean += i != left_out ? y / count : 0.0;
            slope += i != left_out ? y * (a->age[i] - mean_age) / square : 0.0;
        }
        off = q[k] - mean - slope * (age - mean_age);
        sum += a->g.grid->weight[k % a->g.points / a->g.grid->n_phi] * off * off;
    }
    return sqrt(sum);
}

static void covariates_predict(void **state)
{
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_norm_options options = srnf_norm_options_defaults();
    struct srnf_score out;
    double age = 45.0;
    double *q;
    double *f;

    (void)state;
    normals_open(&a, N, 0.01, 2);
    normals_fit(&a, NULL);
    model = normals_model(&a, true);
    q = shapes_doubles(a.size);
    f = shapes_doubles(a.g.count);
    normals_draw(&a, age, 0.0, f, q);
    options.at = &age;
    assert_int_equal(srnf_score(a.g.sht, &model, q, &options, NULL, &out, NULL), SRNF_OK);
    figure_below(
        "distance off that from a line, relative",
        fabs(out.trait[SRNF_TRAIT_DISTANCE].value / distance_from_line(&a, N, q, age) - 1.0), 1e-9);
    printf("# of an old one: percentile %.1f with its age\n", out.overall.percentile);
    assert_true(out.overall.p_value > 0.05 && out.largest.p_value > 0.05);
    srnf_score_clear(&out);
    model.columns = 0;
    assert_int_equal(srnf_score(a.g.sht, &model, q, &options, NULL, &out, NULL), SRNF_OK);
    printf("# and %.1f without\n", out.overall.percentile);
    assert_true(out.trait[SRNF_TRAIT_DISTANCE].p_value < 0.1);
    srnf_score_clear(&out);
    model.columns = 1;
    options.member = 4;
    options.at = &a.age[4];
    options.map = options.check = false;
    assert_int_equal(srnf_score(a.g.sht, &model, a.q + 4 * a.size, &options, NULL, &out, NULL),
                     SRNF_OK);
    figure_below("of a member, off the line of the others, relative",
                 fabs(out.trait[SRNF_TRAIT_DISTANCE].value /
                          distance_from_line(&a, 4, a.q + 4 * a.size, a.age[4]) -
                      1.0),
                 1e-9);
    srnf_score_clear(&out);
    srnf_free(q);
    srnf_free(f);
    normals_close(&a);
}

/* ---- Others of the same kind, and odd ones --------------------------------------------------- */

static void others_have_uniform_percentiles(void **state)
{
    const size_t others =
        FIGURES_SLOW ? 10 : 60; /* how uniform they are is for the release build */
    struct normals a;
    double percentiles[2][60];
    double distance;
    double p;
    double *q;
    double *f;

    (void)state;
    normals_open(&a, 4 * N, 0.004, 3);
    normals_fit(&a, NULL);
    q = shapes_doubles(a.size);
    f = shapes_doubles(a.g.count);
    for (size_t i = 0; i < others; i++) {
        double age = 10.0 * test_random_normal(&a.random);
        struct srnf_norm_model model = normals_model(&a, false);
        struct srnf_score out;

        normals_draw(&a, age, 0.0, f, q);
        assert_int_equal(score(&a, &model, q, age, false, false, &out), SRNF_OK);
        percentiles[0][i] = out.overall.percentile;
        percentiles[1][i] = out.trait[SRNF_TRAIT_RESIDUAL].percentile;
        srnf_score_clear(&out);
    }
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(srnf_norm_uniform(others, percentiles[k], &distance, &p), SRNF_OK);
        printf("# %s: distance %.3f, p %.3f\n", k ? "residual" : "overall", distance, p);
        assert_true(p > 0.005);
    }
    srnf_free(q);
    srnf_free(f);
    normals_close(&a);
}

static void calibration_is_shown(void **state)
{
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_score out;

    (void)state;
    normals_open(&a, 2 * N, 0.004, 4);
    normals_fit(&a, NULL);
    for (size_t covariates = 0; covariates < 2; covariates++) {
        model = normals_model(&a, covariates == 1);
        assert_int_equal(score(&a, &model, a.q, a.age[0], false, true, &out), SRNF_OK);
        assert_int_equal(out.check.n, 2 * N);
        for (size_t c = 0; c < SRNF_NORM_CHECKS; c++) {
            printf("# check %zu: distance %.3f, p %.3f\n", c, out.check.distance[c],
                   out.check.p_value[c]);
            assert_true(out.check.p_value[c] > 0.005);
        }
        srnf_score_clear(&out);
    }
    model.complete = false;
    model.columns = 0;
    assert_int_equal(score(&a, &model, a.q, 0.0, false, true, &out), SRNF_OK);
    assert_int_equal(out.check.n, 0); /* of a model that keeps a part there is none */
    srnf_score_clear(&out);
    normals_close(&a);
}

static void bump_is_found_where_it_is(void **state)
{
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_score out;
    double *q;
    double *f;
    double inside = 0.0;
    double outside = 0.0;

    (void)state;
    normals_open(&a, N, 0.004, 5);
    normals_fit(&a, NULL);
    model = normals_model(&a, true);
    q = shapes_doubles(a.size);
    f = shapes_doubles(a.g.count);
    normals_draw(&a, 5.0, 0.25, f, q);
    assert_int_equal(score(&a, &model, q, 5.0, true, false, &out), SRNF_OK);
    assert_int_equal(out.n_points, a.g.points);
    for (size_t p = 0; p < a.g.points; p++) {
        double x = a.nodes[3 * p];

        assert_true(fabs(out.z[p] * out.spread[p] - out.deviation[p]) <= 1e-12);
        inside = x > 0.9 ? compare_max(inside, out.z[p]) : inside;
        outside = x < 0.0 ? compare_max(outside, fabs(out.z[p])) : outside;
        assert_true(x < 0.95 || out.significance[p] <= 1.0 / 31.0 + 1e-12);
    }
    printf("# largest z: %.1f on the bump, %.1f on the other side; p %.3f\n", inside, outside,
           out.largest.p_value);
    assert_true(inside > 4.0 && outside < inside / 2.0);
    assert_true(out.largest.p_value <= 1.0 / 31.0 + 1e-12);
    assert_true(out.overall.p_value <= 2.0 / 31.0);
    srnf_score_clear(&out);
    srnf_free(q);
    srnf_free(f);
    normals_close(&a);
}

/* The spread is what members have, each left out: 1 + 1/n against (n / (n - 1))^2. */
static void spread_is_that_of_members_left_out(void **state)
{
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_norm_options options = srnf_norm_options_defaults();
    struct srnf_score out;
    double *squares;
    double worst = 0.0;

    (void)state;
    normals_open(&a, 12, 0.004, 6);
    normals_fit(&a, NULL);
    model = normals_model(&a, false);
    squares = shapes_doubles(a.g.points);
    options.check = false;
    for (size_t i = 0; i < 12; i++) {
        options.member = i;
        assert_int_equal(srnf_score(a.g.sht, &model, a.q + i * a.size, &options, NULL, &out, NULL),
                         SRNF_OK);
        assert_int_equal(out.compared, 11);
        for (size_t p = 0; p < a.g.points; p++) {
            squares[p] += out.deviation[p] * out.deviation[p] / 12.0;
        }
        srnf_score_clear(&out);
    }
    options.member = SIZE_MAX;
    assert_int_equal(srnf_score(a.g.sht, &model, a.q, &options, NULL, &out, NULL), SRNF_OK);
    for (size_t p = 0; p < a.g.points; p++) {
        worst = compare_max(worst, fabs(out.spread[p] / sqrt(squares[p]) - 1.0));
    }
    figure_below("spread off the root of the mean square, relative", worst, 1.0 / 144.0);
    srnf_score_clear(&out);
    srnf_free(squares);
    normals_close(&a);
}

/* ---- What every long computation promises ---------------------------------------------------- */

/* Members of a subject are left out together, and count once. */
static void subjects_are_left_out_whole(void **state)
{
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_norm_options options = srnf_norm_options_defaults();
    struct srnf_score out;
    size_t subjects[N];

    (void)state;
    normals_open(&a, N, 0.004, 7);
    for (size_t i = 0; i < N; i++) {
        subjects[i] = i / 2;
        if (i % 2) { /* the same again */
            memcpy(a.q + i * a.size, a.q + (i - 1) * a.size, a.size * sizeof(double));
            a.age[i] = a.age[i - 1];
        }
    }
    normals_fit(&a, subjects);
    model = normals_model(&a, true);
    model.subjects = subjects;
    options.at = &a.age[4];
    options.member = 4;
    assert_int_equal(srnf_score(a.g.sht, &model, a.q + 4 * a.size, &options, NULL, &out, NULL),
                     SRNF_OK);
    assert_int_equal(out.subjects, N / 2);
    assert_int_equal(out.compared, N / 2 - 1);
    printf("# residual %.3g, overall %.1f\n", out.trait[SRNF_TRAIT_RESIDUAL].value,
           out.overall.percentile);
    /* Its double is no help: the residual is none of rounding. */
    assert_true(out.trait[SRNF_TRAIT_RESIDUAL].value > 0.01);
    assert_true(out.trait[SRNF_TRAIT_RESIDUAL].p_value > 1.5 / 15.0 - 1e-9 ||
                out.trait[SRNF_TRAIT_RESIDUAL].as_odd < 1.0);
    srnf_score_clear(&out);
    normals_close(&a);
}

static void results_do_not_depend_on_threads(void **state)
{
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_score alone;
    size_t size;

    (void)state;
    normals_open(&a, 14, 0.004, 8);
    normals_fit(&a, NULL);
    model = normals_model(&a, true);
    size = a.g.points * sizeof(double);
    assert_int_equal(score(&a, &model, a.q, 2.0, true, true, &alone), SRNF_OK);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        struct srnf_norm_options options = srnf_norm_options_defaults();
        struct srnf_score out;
        double age = 2.0;

        options.at = &age;
        assert_int_equal(srnf_score(a.g.sht, &model, a.q, &options, &context, &out, NULL), SRNF_OK);
        assert_memory_equal(out.z, alone.z, size);
        assert_memory_equal(out.significance, alone.significance, size);
        assert_memory_equal(out.trait, alone.trait, sizeof out.trait);
        assert_memory_equal(out.check.percentiles, alone.check.percentiles,
                            SRNF_NORM_CHECKS * out.check.n * sizeof(double));
        assert_true(atomic_load(&watch.highest) > 0.999);
        srnf_score_clear(&out);
    }
    srnf_score_clear(&alone);
    normals_close(&a);
}

static void stops_when_asked(void **state)
{
    struct normals a;
    struct srnf_norm_model model;

    (void)state;
    normals_open(&a, 14, 0.004, 9);
    normals_fit(&a, NULL);
    model = normals_model(&a, true);
    for (size_t after = 0; after < 100; after += 24) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, 2);
        struct srnf_norm_options options = srnf_norm_options_defaults();
        struct srnf_score out = {0};
        double age = 2.0;

        watch.cancel_after = after;
        options.at = &age;
        assert_int_equal(srnf_score(a.g.sht, &model, a.q, &options, &context, &out, NULL),
                         SRNF_ECANCELED);
        assert_null(out.z);
    }
    normals_close(&a);
}

static void wrong_input_is_refused(void **state)
{
    struct normals a;
    struct srnf_norm_model model;
    struct srnf_norm_options options = srnf_norm_options_defaults();
    struct srnf_score out = {0};
    struct srnf_error error = {0};
    double age = NAN;
    double rare[N] = {0.0};

    (void)state;
    normals_open(&a, N, 0.004, 10);
    normals_fit(&a, NULL);
    model = normals_model(&a, true);
    options.at = &age;
    assert_int_equal(srnf_score(a.g.sht, &model, a.q, &options, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "not finite"));
    age = 1.0;
    model.complete = false;
    assert_int_equal(srnf_score(a.g.sht, &model, a.q, &options, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "keeps a part"));
    model.complete = true;
    rare[3] = 1.0; /* without the fourth there is nothing to tell it by */
    model.values = rare;
    assert_int_equal(srnf_score(a.g.sht, &model, a.q, &options, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "column 0 is constant"));
    assert_int_equal(error.element, 0);
    model.columns = N;
    assert_int_equal(srnf_score(a.g.sht, &model, a.q, &options, NULL, &out, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "30 subjects, too few for so many covariates: 34"));
    assert_null(out.z);
    normals_close(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(surface_and_members_are_treated_alike),
        cmocka_unit_test(ranks_count_subjects),
        cmocka_unit_test(ranks_together_are_uniform),
        cmocka_unit_test(uniformity_has_its_p),
        cmocka_unit_test(a_stack_of_one_part_is_judged_alike),
        cmocka_unit_test(predictions_by_the_mean_are_the_calibration),
        cmocka_unit_test(covariates_predict),
        cmocka_unit_test(others_have_uniform_percentiles),
        cmocka_unit_test(calibration_is_shown),
        cmocka_unit_test(bump_is_found_where_it_is),
        cmocka_unit_test(spread_is_that_of_members_left_out),
        cmocka_unit_test(subjects_are_left_out_whole),
        cmocka_unit_test(results_do_not_depend_on_threads),
        cmocka_unit_test(stops_when_asked),
        cmocka_unit_test(wrong_input_is_refused),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

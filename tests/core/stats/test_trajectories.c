/*
 * test_trajectories.c - lines of subjects and the model of their slopes: against the same least
 * squares, flips and permutations done outright, rates of false findings; and what every long
 * computation promises.
 */
#include "lines.h"
#include "stats/maps.h"

#define SUBJECTS_MAX ((size_t)64)

/* ---- The long way ---------------------------------------------------------------------------- */

/* Slopes by the normal equations of each subject, [n][3][P], what is left about the lines, and the
   sums of squares of the times. */
static double find_slopes(const struct lines *l, double *slopes, double *spread, size_t *freedom)
{
    double left = 0.0;
    size_t from = 0;

    *freedom = 0;
    for (size_t i = 0; i < l->n; i++) {
        size_t to = from;
        double sum = 0.0;
        double square = 0.0;
        double count;

        while (to < l->members && l->subjects[to] == from) {
            sum += l->times[to];
            square += l->times[to] * l->times[to];
            to++;
        }
        count = (double)(to - from);
        *freedom += to - from - 2;
        spread[i] = square - sum * sum / count;
        for (size_t k = 0; k < l->size; k++) {
            double y = 0.0;
            double ty = 0.0;
            double level;
            double b;

            for (size_t j = from; j < to; j++) {
                y += l->q[j * l->size + k];
                ty += l->times[j] * l->q[j * l->size + k];
            }
            b = (count * ty - sum * y) / (count * square - sum * sum);
            level = (y - b * sum) / count;
            slopes[i * l->size + k] = b;
            for (size_t j = from; j < to; j++) {
                double off = l->q[j * l->size + k] - level - b * l->times[j];

                left += l->g.grid->weight[k % l->g.points / l->g.grid->n_phi] * off * off;
            }
        }
        from = to;
    }
    return left;
}

static double product(const struct lines *l, const double *a, const double *b)
{
    return srnf_inner_product(l->g.grid, a, b);
}

/* Weighted least squares of slopes on the constant and the group, by the 2 x 2 normal equations;
   returns the weighted squares that are left. x: [2] fields. */
static double solve(const struct lines *l, const double *slopes, const double *w, double *x)
{
    double s = 0.0;
    double sg = 0.0;
    double left = 0.0;
    double *off = shapes_doubles(l->size);

    for (size_t i = 0; i < l->n; i++) {
        s += w[i];
        sg += i % 2 ? w[i] : 0.0;
    }
    for (size_t k = 0; k < l->size; k++) {
        double y = 0.0;
        double yg = 0.0;

        for (size_t i = 0; i < l->n; i++) {
            y += w[i] * slopes[i * l->size + k];
            yg += i % 2 ? w[i] * slopes[i * l->size + k] : 0.0;
        }
        x[k] = (y - yg) / (s - sg);
        x[l->size + k] = yg / sg - x[k];
    }
    for (size_t i = 0; i < l->n; i++) {
        for (size_t k = 0; k < l->size; k++) {
            off[k] = slopes[i * l->size + k] - x[k] - (i % 2 ? x[l->size + k] : 0.0);
        }
        left += w[i] * product(l, off, off);
    }
    srnf_free(off);
    return left;
}

/* The same of a fit: variances, weights, coefficients and F. */
struct expected {
    double within, between, mean_norm, f, share;
    double spread[SUBJECTS_MAX], w[SUBJECTS_MAX];
    double *slopes, *x; /* [n] and [2] fields */
    size_t freedom;
};

/* Weights by the variance between, 1 on average; returns the squares that the model leaves of
   slopes with the weights as they are. */
static double weigh(const struct lines *l, struct expected *e, double between)
{
    double total = 0.0;
    double left;

    for (size_t i = 0; i < l->n; i++) {
        e->w[i] = 1.0 / (between + e->within / e->spread[i]);
        total += e->w[i] / (double)l->n;
    }
    left = solve(l, e->slopes, e->w, e->x);
    for (size_t i = 0; i < l->n; i++) {
        e->w[i] /= total;
    }
    return left;
}

/* The variance between by halving: the squares left are as many as degrees of freedom. */
static void find_weights(const struct lines *l, struct expected *e)
{
    double low = 0.0;
    double high = 1.0;

    e->within = find_slopes(l, e->slopes, e->spread, &e->freedom) / (double)e->freedom;
    assert_true(weigh(l, e, low) > (double)(l->n - 2));
    assert_true(weigh(l, e, high) < (double)(l->n - 2));
    for (size_t k = 0; k < 60; k++) {
        e->between = 0.5 * (low + high);
        if (weigh(l, e, e->between) > (double)(l->n - 2)) {
            low = e->between;
        } else {
            high = e->between;
        }
    }
}

static void expect(const struct lines *l, struct expected *e)
{
    double *mean = shapes_doubles(l->size);
    double *off = shapes_doubles(l->size);
    double total = 0.0;
    double left;

    e->slopes = shapes_doubles(l->n * l->size);
    e->x = shapes_doubles(2 * l->size);
    find_weights(l, e);
    for (size_t k = 0; k < l->n * l->size; k++) {
        mean[k % l->size] += e->w[k / l->size] * e->slopes[k] / (double)l->n;
    }
    e->mean_norm = sqrt(product(l, mean, mean));
    for (size_t i = 0; i < l->n; i++) {
        for (size_t k = 0; k < l->size; k++) {
            off[k] = e->slopes[i * l->size + k] - mean[k];
        }
        total += e->w[i] * product(l, off, off);
    }
    left = solve(l, e->slopes, e->w, e->x);
    e->f = (total - left) / (left / (double)(l->n - 2));
    e->share = (total - left) / total;
    srnf_free(mean);
    srnf_free(off);
}

/* Of balanced visits and of others. */
static void numbers_are_those_of_least_squares(void **state)
{
    (void)state;
    for (size_t unequal = 0; unequal < 2; unequal++) {
        const struct lines_plan plan = {11, unequal, 0.1, 0.05, 0.1, 0.005, 1 + unequal};
        struct lines l;
        struct srnf_trajectories out;
        struct expected e;
        double worst = 0.0;

        lines_open(&l, &plan);
        lines_group(&l);
        assert_int_equal(lines_fit(&l, 9, 1, NULL, &out), SRNF_OK);
        expect(&l, &e);
        assert_int_equal(out.freedom, e.freedom);
        assert_int_equal(out.weighted, unequal);
        figure_below("variance within, relative", fabs(out.within / e.within - 1.0), 1e-10);
        assert_true(out.within_interval[0] < out.within && out.within < out.within_interval[1]);
        assert_true(out.between_interval[0] < out.between && out.between < out.between_interval[1]);
        figure_below("variance between, relative", fabs(out.between / e.between - 1.0), 1e-9);
        for (size_t i = 0; i < l.n; i++) {
            const double *own = e.slopes + i * l.size;
            double length = sqrt(product(&l, own, own));

            worst = compare_max(worst, fabs(out.subject[i].weight - e.w[i]));
            worst = compare_max(worst, fabs(out.slope.distance[i] - length));
        }
        figure_below("weights and lengths of slopes", worst, 1e-10);
        figure_below("length of the mean slope", fabs(out.slope.norm - e.mean_norm), 1e-10);
        figure_below("coefficients", compare_difference(2 * l.size, out.model.coefficients, e.x),
                     1e-10);
        figure_below("F of the group, relative", fabs(out.model.test_of[0].f / e.f - 1.0), 1e-9);
        figure_below("share of the group", fabs(out.model.test_of[0].r2.value - e.share), 1e-10);
        srnf_free(e.slopes);
        srnf_free(e.x);
        srnf_trajectories_clear(&out);
        lines_close(&l);
    }
}

/* Where all have the same visits, what is left of slopes less what visits make of it, as moments
   have it. */
static void equal_visits_leave_the_moments(void **state)
{
    const struct lines_plan plan = {11, false, 0.1, 0.05, 0.1, 0.005, 1};
    struct lines l;
    struct srnf_trajectories out;
    struct expected e;
    double ones[SUBJECTS_MAX];

    (void)state;
    lines_open(&l, &plan);
    lines_group(&l);
    assert_int_equal(lines_fit(&l, 9, 1, NULL, &out), SRNF_OK);
    e.slopes = shapes_doubles(l.n * l.size);
    e.x = shapes_doubles(2 * l.size);
    e.within = find_slopes(&l, e.slopes, e.spread, &e.freedom) / (double)e.freedom;
    for (size_t i = 0; i < l.n; i++) {
        ones[i] = 1.0;
    }
    e.between = solve(&l, e.slopes, ones, e.x) / (double)(l.n - 2) - e.within / e.spread[0];
    figure_below("variance between off that by moments, relative",
                 fabs(out.between / e.between - 1.0), 1e-12);
    assert_false(out.weighted);
    srnf_free(e.slopes);
    srnf_free(e.x);
    srnf_trajectories_clear(&out);
    lines_close(&l);
}

/* Leaves the third visit of the first few subjects alone. */
static void drop_visits(struct lines *l, size_t more)
{
    size_t kept = 0;

    for (size_t i = 0; i < l->members; i++) {
        size_t visit = i % 3;

        if (visit == 2 && i / 3 >= more) {
            continue;
        }
        memmove(l->q + kept * l->size, l->q + i * l->size, l->size * sizeof(double));
        l->times[kept] = l->times[i];
        l->subjects[kept] = kept - visit;
        l->columns[kept++] = l->columns[i];
    }
    l->visits.n = kept;
}

/* One or two visits more than lines need say what V is about, and not how far that is known: T may
   be 0 for all of it. Three begin to say it. */
static void few_visits_leave_the_variances_open(void **state)
{
    const struct lines_plan plan = {12, false, 0.1, 0.0, 0.1, 0.005, 4};

    (void)state;
    for (size_t more = 0; more <= 3; more++) {
        struct srnf_trajectories out;
        struct lines l;

        lines_open(&l, &plan);
        drop_visits(&l, more);
        assert_int_equal(lines_fit(&l, 9, 1, NULL, &out), SRNF_OK);
        assert_int_equal(out.freedom, more);
        assert_true(isfinite(out.within) && (out.within > 0.0) == (more > 0));
        assert_true(isfinite(out.within_interval[0]) == (more == 3));
        assert_true(isfinite(out.within_interval[1]) == (more == 3));
        assert_true(out.between > 0.0 && out.between < out.between_interval[1]);
        assert_true(isfinite(out.between_interval[1]));
        if (more == 1 || more == 2) {
            assert_true(out.between_interval[0] == 0.0);
        }
        srnf_trajectories_clear(&out);
        lines_close(&l);
    }
}

/* Two visits of one of 12 subjects, the nearer together the less its slope says: what is known of
   the others stays. */
static void a_brief_subject_hides_nothing(void **state)
{
    const double spans[6] = {2.0, 0.3, 0.1, 0.02, 1e-4, 1e-9};
    struct srnf_trajectories first = {0};

    (void)state;
    for (size_t k = 0; k < 6; k++) {
        const struct lines_plan plan = {12, false, 0.1, 0.0, 0.1, 0.005, 3};
        struct srnf_trajectories out;
        struct lines l;

        lines_open_brief(&l, &plan, spans[k]);
        lines_group(&l);
        l.design.points = 0;
        assert_int_equal(lines_fit(&l, 9, 1, NULL, &out), SRNF_OK);
        printf("# visits %g apart: between %.3g, %.3g to %.3g; weight %.2g, of others %.3g\n",
               spans[k], out.between, out.between_interval[0], out.between_interval[1],
               out.subject[0].weight, out.subject[1].weight);
        assert_true(out.between_interval[0] > 0.0 && out.between_interval[0] < out.between);
        assert_true(out.between_interval[1] > out.between);
        if (k == 0) {
            first = out;
        } else {
            figure_below("variance between off that of visits apart, relative",
                         fabs(out.between / first.between - 1.0), 0.2);
            figure_below("upper end off the same, relative",
                         fabs(out.between_interval[1] / first.between_interval[1] - 1.0), 0.3);
            assert_true(out.subject[0].weight < 1.0);
            srnf_trajectories_clear(&out);
        }
        lines_close(&l);
    }
    srnf_trajectories_clear(&first);
}

/* Of 7 subjects all 64 flips of slopes with weights, by the fields themselves. */
static void p_is_that_of_all_flips(void **state)
{
    const struct lines_plan plan = {7, true, 0.01, 0.0, 0.03, 0.02, 4};
    struct lines l;
    struct srnf_trajectories out;
    double *slopes;
    double *sum;
    double spread[SUBJECTS_MAX];
    double observed = 0.0;
    size_t as_far = 0;
    size_t freedom;

    (void)state;
    lines_open(&l, &plan);
    slopes = shapes_doubles(l.n * l.size);
    sum = shapes_doubles(l.size);
    assert_int_equal(lines_fit(&l, 100, 0, NULL, &out), SRNF_OK);
    assert_true(out.slope.test.exact && out.weighted);
    (void)find_slopes(&l, slopes, spread, &freedom);
    for (size_t flip = 0; flip < 64; flip++) {
        double square;

        for (size_t k = 0; k < l.size; k++) {
            sum[k] = 0.0;
            for (size_t i = 0; i < l.n; i++) {
                double one = out.subject[i].weight * slopes[i * l.size + k];

                sum[k] += i > 0 && (flip >> (i - 1) & 1) ? -one : one;
            }
        }
        square = product(&l, sum, sum);
        observed = flip == 0 ? square : observed;
        as_far += stats_as_large(square, observed);
    }
    figure_below("p off that of all flips", fabs(out.slope.p_value - (double)as_far / 64.0), 1e-12);
    assert_int_equal(out.model.tests, 0);
    srnf_free(slopes);
    srnf_free(sum);
    srnf_trajectories_clear(&out);
    lines_close(&l);
}

/* Of 7 subjects with the same visits all 35 choices of the faster three. */
static void p_of_groups_is_that_of_all_choices(void **state)
{
    const struct lines_plan plan = {7, false, 0.1, 0.05, 0.03, 0.02, 5};
    struct lines l;
    struct srnf_trajectories out;
    double *slopes;
    double *off;
    double spread[SUBJECTS_MAX];
    double observed;
    size_t as_far = 0;
    size_t all = 0;
    size_t freedom;

    (void)state;
    lines_open(&l, &plan);
    lines_group(&l);
    slopes = shapes_doubles(l.n * l.size);
    off = shapes_doubles(l.size);
    assert_int_equal(lines_fit(&l, 100, 0, NULL, &out), SRNF_OK);
    assert_true(out.model.test.exact);
    (void)find_slopes(&l, slopes, spread, &freedom);
    observed = 0.0;
    for (size_t pass = 0; pass < 2; pass++) {
        for (size_t choice = 0; choice < 128; choice++) {
            double square;
            size_t chosen = 0;

            for (size_t i = 0; i < 7; i++) {
                chosen += choice >> i & 1;
            }
            if (chosen != 3 || (pass == 0 && choice != (2 | 8 | 32))) {
                continue;
            }
            for (size_t k = 0; k < l.size; k++) {
                off[k] = 0.0;
                for (size_t i = 0; i < 7; i++) {
                    off[k] += slopes[i * l.size + k] * (choice >> i & 1 ? 1.0 / 3.0 : -1.0 / 4.0);
                }
            }
            square = product(&l, off, off);
            if (pass == 0) {
                observed = square;
            } else {
                all++;
                as_far += stats_as_large(square, observed);
            }
        }
    }
    assert_int_equal(all, 35);
    figure_below("p off that of all choices",
                 fabs(out.model.test_of[0].p_value - (double)as_far / 35.0), 1e-12);
    srnf_free(slopes);
    srnf_free(off);
    srnf_trajectories_clear(&out);
    lines_close(&l);
}

/* ---- Conditioning ---------------------------------------------------------------------------- */

/* The length of a subject's displacement per unit of time: the line of its embedded surfaces. */
static double find_length(const struct lines *l, size_t from, size_t to)
{
    struct stats_embedding embedding;
    double *vector = shapes_doubles(l->size);
    double *slope = shapes_doubles(l->size);
    double middle = 0.0;
    double spread = 0.0;
    double square = 0.0;
    void *workspace;

    assert_int_equal(stats_embedding_create(l->g.sht, l->mean, &embedding), SRNF_OK);
    workspace = srnf_alloc(1, stats_embedding_workspace_size(&embedding));
    assert_non_null(workspace);
    for (size_t i = from; i < to; i++) {
        middle += l->times[i] / (double)(to - from);
    }
    for (size_t i = from; i < to; i++) {
        stats_embed(&embedding, l->g.f[i], vector, workspace);
        spread += (l->times[i] - middle) * (l->times[i] - middle);
        for (size_t k = 0; k < l->size; k++) {
            slope[k] += (l->times[i] - middle) * vector[k];
        }
    }
    for (size_t k = 0; k < l->size; k++) {
        square += slope[k] * slope[k];
    }
    srnf_free(workspace);
    srnf_free(slope);
    srnf_free(vector);
    stats_embedding_clear(&embedding);
    return sqrt(square) / spread;
}

static void surfaces_that_are_known_are_not_searched(void **state)
{
    const struct lines_plan plan = {6, false, 0.1, 0.05, 0.03, 0.02, 6};
    double worst[2] = {0.0, 0.0};
    struct lines l;

    (void)state;
    lines_open(&l, &plan);
    group_spoil_mean(&l.g, l.mean, 9);
    for (size_t known = 0; known < 2; known++) {
        struct srnf_trajectories out;

        l.visits.near = known ? l.g.surfaces : NULL;
        assert_int_equal(lines_fit(&l, 9, 1, NULL, &out), SRNF_OK);
        for (size_t i = 0; i < l.n; i++) {
            double truth = find_length(&l, 3 * i, 3 * i + 3);

            worst[known] = compare_max(worst[known], fabs(out.slope.length[i] / truth - 1.0));
        }
        srnf_trajectories_clear(&out);
    }
    printf("# from the mean on: %.3g off\n", worst[0]);
    figure_below("lengths off those of the surfaces, relative", worst[1], 1e-11);
    assert_true(worst[0] > 1e2 * worst[1]);
    lines_close(&l);
}

/* ---- Doubts ---------------------------------------------------------------------------------- */

static void exchange_visits(struct lines *l, size_t a, size_t b)
{
    for (size_t k = 0; k < l->size; k++) {
        double swap = l->q[a * l->size + k];

        l->q[a * l->size + k] = l->q[b * l->size + k];
        l->q[b * l->size + k] = swap;
    }
}

/* The last visit of one subject in the place of another's, in each of 20 studies with three visits;
   and 40 sound studies, half of them of subjects who differ no more than their visits do. */
static void exchanged_visits_are_found(void **state)
{
    size_t found = 0;
    size_t wrong = 0;

    (void)state;
    for (size_t run = 0; run < 60; run++) {
        bool sound = run >= 20;
        const struct lines_plan plan = {
            10, sound && run % 2, 0.05, 0.0, 0.02, sound && run % 4 > 1 ? 0.05 : 0.005, 300 + run};
        struct srnf_trajectories out;
        struct lines l;
        size_t second = lines_visits(&plan, 0) + lines_visits(&plan, 1) - 1;

        lines_open(&l, &plan);
        if (!sound) {
            exchange_visits(&l, 0, second);
        }
        assert_int_equal(lines_fit(&l, 9, run, NULL, &out), SRNF_OK);
        if (!sound) {
            bool right = out.exchanges == 1 && l.subjects[out.exchanged[0].members[0]] == 0 &&
                         l.subjects[out.exchanged[0].members[1]] == l.subjects[second];

            found += right;
            assert_true(!right || out.exchanged[0].after[0] < out.exchanged[0].before[0]);
        } else {
            wrong += out.exchanges;
        }
        srnf_trajectories_clear(&out);
        lines_close(&l);
    }
    printf("# exchanged visits: %zu of 20 found, %zu in 40 sound studies\n", found, wrong);
    assert_true(found == 20 && wrong == 0);
}

/* Times in reversed order, and a visit that is another's: both stand out, and nobody else. */
static void reversed_and_stray_visits_stand_out(void **state)
{
    const struct lines_plan plan = {10, false, 0.2, 0.0, 0.02, 0.005, 7};
    struct srnf_trajectories out;
    struct lines l;

    (void)state;
    lines_open(&l, &plan);
    for (size_t i = 6; i < 9; i++) {
        l.times[i] = -l.times[i];
    }
    exchange_visits(&l, 13, 14); /* times mixed up within the subject */
    assert_int_equal(lines_fit(&l, 9, 1, NULL, &out), SRNF_OK);
    for (size_t i = 0; i < l.n; i++) {
        const struct srnf_subject_trajectory *one = &out.subject[i];

        assert_true((one->speed < 0.0) == (i == 2));
        assert_true((one->turned < 0.5) == (i == 2));
        assert_true((one->left > 4.0 * out.subject[0].left) == (i == 4));
    }
    srnf_trajectories_clear(&out);
    lines_close(&l);
}

/* ---- Rates ----------------------------------------------------------------------------------- */

static void nothing_is_found_at_the_level(void **state)
{
    const size_t runs = 40;
    size_t slope = 0;
    size_t map = 0;
    size_t group = 0;
    size_t group_map = 0;

    (void)state;
    figures_count_unsanitized();
    for (size_t run = 0; run < runs; run++) {
        const struct lines_plan plan = {10, run % 2, 0.0, 0.0, 0.05, 0.02, 100 + run};
        struct lines l;
        struct srnf_trajectories out;

        lines_open(&l, &plan);
        lines_group(&l);
        l.design.points = 0;
        assert_int_equal(lines_fit(&l, 99, run, NULL, &out), SRNF_OK);
        slope += out.slope.p_value <= 0.1;
        map += out.slope.max_p_value <= 0.1;
        group += out.model.test_of[0].p_value <= 0.1;
        group_map += out.model.test_of[0].max_p_value <= 0.1;
        srnf_trajectories_clear(&out);
        lines_close(&l);
    }
    printf("# %zu runs at level .1: slope %zu, map %zu, group %zu, map %zu\n", runs, slope, map,
           group, group_map);
    /* Binomial(40, .1): beyond with a chance of 1e-3 */
    assert_true(slope <= 11 && map <= 11 && group <= 11 && group_map <= 11);
}

/* ---- What every long computation promises ---------------------------------------------------- */

static void results_do_not_depend_on_threads(void **state)
{
    const struct lines_plan plan = {10, true, 0.1, 0.05, 0.03, 0.02, 80};
    struct lines l;
    struct srnf_trajectories alone;
    size_t size;

    (void)state;
    lines_open(&l, &plan);
    lines_group(&l);
    size = l.g.points * sizeof(double);
    assert_int_equal(lines_fit(&l, 99, 1, NULL, &alone), SRNF_OK);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        struct srnf_trajectories out;

        assert_int_equal(lines_fit(&l, 99, 1, &context, &out), SRNF_OK);
        assert_true(out.slope.p_value == alone.slope.p_value);
        assert_memory_equal(out.slope.significance, alone.slope.significance, size);
        assert_memory_equal(out.model.test_of[0].statistic, alone.model.test_of[0].statistic, size);
        assert_memory_equal(out.model.predicted[3].confidence, alone.model.predicted[3].confidence,
                            size);
        assert_memory_equal(out.slope_at[3].confidence, alone.slope_at[3].confidence, size);
        assert_true(atomic_load(&watch.highest) > 0.999);
        srnf_trajectories_clear(&out);
    }
    srnf_trajectories_clear(&alone);
    lines_close(&l);
}

static void stops_when_asked(void **state)
{
    const struct lines_plan plan = {10, true, 0.1, 0.05, 0.03, 0.02, 81};
    struct lines l;

    (void)state;
    lines_open(&l, &plan);
    lines_group(&l);
    for (size_t after = 0; after < 60; after += 19) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, 2);
        struct srnf_trajectories out = {0};

        watch.cancel_after = after;
        assert_int_equal(lines_fit(&l, 999, 1, &context, &out), SRNF_ECANCELED);
        assert_null(out.subject);
    }
    lines_close(&l);
}

static void refuse(const struct lines *l, const struct srnf_trajectories_options *options,
                   const char *expected)
{
    struct srnf_trajectories out = {0};
    struct srnf_error error = {0};

    assert_int_equal(
        srnf_fit_trajectories(l->g.sht, &l->visits, &l->design, options, NULL, &out, &error),
        SRNF_EINVAL);
    if (!strstr(error.message, expected)) {
        fail_msg("\"%s\" for \"%s\"", error.message, expected);
    }
    assert_null(out.subject);
}

/* In units of time near either end of what is taken all is the same but for the unit, and times far
   from 0 lose nothing by it. */
static void units_of_time_change_nothing(void **state)
{
    const struct lines_plan plan = {7, true, 0.1, 0.05, 0.3, 0.01, 83};
    const int exponents[3] = {-97, 97, 0};
    const double far[3] = {0.0, 0.0, 1048576.0}; /* whose sums with times are exact */
    struct lines l;
    struct srnf_trajectories out;
    double *times;
    double at[4];

    (void)state;
    lines_open(&l, &plan);
    lines_group(&l);
    times = shapes_doubles(l.members);
    for (size_t i = 0; i < l.members; i++) {
        times[i] = ldexp(floor(ldexp(l.times[i], 20)), -20);
    }
    memcpy(l.times, times, l.members * sizeof(double));
    memcpy(at, l.at_times, sizeof at);
    assert_int_equal(lines_fit(&l, 99, 1, NULL, &out), SRNF_OK);
    assert_true(out.weighted && out.between > 0.0 && out.slope.change.value > 0.0);
    for (size_t k = 0; k < 3; k++) {
        struct srnf_trajectories other;
        double unit = ldexp(1.0, exponents[k]);

        for (size_t i = 0; i < l.members; i++) {
            l.times[i] = (far[k] + times[i]) * unit;
        }
        for (size_t i = 0; i < 4; i++) {
            l.at_times[i] = (far[k] + at[i]) * unit;
        }
        assert_int_equal(lines_fit(&l, 99, 1, NULL, &other), SRNF_OK);
        figure_below("rate off that in another unit, relative",
                     fabs(other.slope.change.value * unit / out.slope.change.value - 1.0), 1e-9);
        figure_below("share off", fabs(other.slope.share.value / out.slope.share.value - 1.0),
                     1e-9);
        figure_below("between off", fabs(other.between * unit * unit / out.between - 1.0), 1e-9);
        figure_below("within off", fabs(other.within / out.within - 1.0), 1e-9);
        figure_below("reference off, of the unit",
                     fabs(other.reference / unit - far[k] - out.reference), 1e-9);
        assert_true(other.slope.p_value == out.slope.p_value);
        assert_true(other.slope.max_p_value == out.slope.max_p_value);
        assert_true(other.model.test_of[0].p_value == out.model.test_of[0].p_value);
        for (size_t p = 0; p < l.g.points; p++) {
            assert_true(other.slope.p[p] == out.slope.p[p]);
        }
        srnf_trajectories_clear(&other);
    }
    srnf_trajectories_clear(&out);
    srnf_free(times);
    lines_close(&l);
}

static void wrong_input_is_refused(void **state)
{
    const struct lines_plan plan = {6, false, 0.1, 0.0, 0.03, 0.02, 82};
    struct srnf_trajectories_options options = srnf_trajectories_options_defaults();
    struct lines l;

    (void)state;
    lines_open(&l, &plan);
    lines_group(&l);
    options.permutations = 0;
    refuse(&l, &options, "permutations is 0");
    options = srnf_trajectories_options_defaults();
    options.bootstraps = 99;
    refuse(&l, &options, "bootstraps is 99");
    l.at_times[1] = NAN;
    refuse(&l, NULL, "point 1 of the predictions");
    l.at_times[1] = 2.0;
    l.times[5] = INFINITY;
    refuse(&l, NULL, "the time of member 5");
    l.times[5] = 1e31;
    refuse(&l, NULL, "member 0 is at the time 0 and member 5 at 1e+31, more than 1e+30 apart");
    l.times[5] = 2.0;
    l.at_times[1] = 3e6;
    refuse(&l, NULL, "the time 3e+06 of point 1 of the predictions is more than 1e+06 times");
    l.at_times[1] = 2.0;
    l.times[4] = l.times[3] = 0.0;
    l.times[5] = 9e-31;
    refuse(&l, NULL, "the subject of member 3 is seen from 0 to 9e-31, less than 1e-30");
    l.times[5] = l.times[4] = l.times[3];
    refuse(&l, NULL, "the subject of member 3 has one time only");
    l.times[5] = 3.0;
    for (size_t i = 0; i < l.members; i++) {
        l.columns[i] = 1.0;
    }
    refuse(&l, NULL, "column 0 is constant");
    l.sizes[2] = 0.0;
    refuse(&l, NULL, "the size of member 2");
    l.sizes[2] = 1.0;
    l.visits.n = 12;
    refuse(&l, NULL, "4 subjects; 5 are needed");
    l.q[0] = NAN;
    refuse(&l, NULL, "the surface of member 0");
    lines_close(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_those_of_least_squares),
        cmocka_unit_test(equal_visits_leave_the_moments),
        cmocka_unit_test(a_brief_subject_hides_nothing),
        cmocka_unit_test(few_visits_leave_the_variances_open),
        cmocka_unit_test(p_is_that_of_all_flips),
        cmocka_unit_test(p_of_groups_is_that_of_all_choices),
        cmocka_unit_test(surfaces_that_are_known_are_not_searched),
        cmocka_unit_test(exchanged_visits_are_found),
        cmocka_unit_test(reversed_and_stray_visits_stand_out),
        cmocka_unit_test(nothing_is_found_at_the_level),
        cmocka_unit_test(results_do_not_depend_on_threads),
        cmocka_unit_test(stops_when_asked),
        cmocka_unit_test(units_of_time_change_nothing),
        cmocka_unit_test(wrong_input_is_refused),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

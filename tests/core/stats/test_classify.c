/*
 * test_classify.c - classifiers on planted scores: likelihoods and the inner choice against a plain
 * computation that fits everything again, invariance, Wilson's interval, permutations, chance under
 * shuffled labels, power and level under planted effects, and what is refused.
 */
#include "classes.h"

#include <lapacke.h>

#define N ((size_t)34) /* 19 and 15, as in the paper's study */
#define FIRST ((size_t)19)
#define COMPONENTS ((size_t)6)

static double accuracy(const struct srnf_folds *c, const size_t *labels, bool gauss,
                       const struct srnf_classify_options *options, double *p_value)
{
    struct srnf_classify_options own = options ? *options : srnf_classify_options_defaults();
    struct srnf_classification r;
    double result;

    own.relabellings = 0; /* intervals are not looked at */
    assert_int_equal(
        (gauss ? srnf_classify_gauss : srnf_classify_nearest)(c, labels, 2, &own, NULL, &r, NULL),
        SRNF_OK);
    result = r.accuracy;
    if (p_value) {
        *p_value = r.p_value;
    }
    srnf_classification_clear(&r);
    return result;
}

/* ---- Likelihoods, plainly -------------------------------------------------------------------- */

struct plain {
    const struct srnf_folds *c;
    const size_t *labels;
    size_t n_classes, features;
    bool pooled;
};

static size_t subject_of(const struct srnf_folds *c, size_t i)
{
    return c->subjects ? c->subjects[i] : i;
}

static bool is_left_out(const struct srnf_folds *c, size_t j, size_t out_a, size_t out_b)
{
    return subject_of(c, j) == subject_of(c, out_a) || subject_of(c, j) == subject_of(c, out_b);
}

/* Degrees of freedom of class k: its members less the sum of the squares of their numbers in each
   subject over them. */
static double plain_freedom(const struct plain *p, size_t k, size_t out_a, size_t out_b)
{
    double members = 0.0;
    double squares = 0.0; /* pairs of members of one subject */

    for (size_t i = 0; i < p->c->n; i++) {
        if (p->labels[i] == k && !is_left_out(p->c, i, out_a, out_b)) {
            members += 1.0;
            for (size_t j = 0; j < p->c->n; j++) {
                squares += p->labels[j] == k && subject_of(p->c, i) == subject_of(p->c, j);
            }
        }
    }
    return members - squares / members;
}

/* Log-likelihood of member i under class k, fitted without the subjects of two members. */
static double plain_likelihood(const struct plain *p, size_t i, size_t k, size_t out_a,
                               size_t out_b)
{
    size_t d = p->features;
    size_t stride = p->c->components;
    double mean[8][8] = {{0.0}};
    double count[8] = {0.0};
    double s[64] = {0.0};
    double x[8];
    double freedom = 0.0;
    double result;

    for (size_t j = 0; j < p->c->n; j++) {
        for (size_t a = 0; a < d && !is_left_out(p->c, j, out_a, out_b); a++) {
            mean[p->labels[j]][a] += p->c->scores[j * stride + a];
            count[p->labels[j]] += a == 0;
        }
    }
    for (size_t j = 0; j < p->c->n; j++) {
        size_t own = p->labels[j];

        if (is_left_out(p->c, j, out_a, out_b) || (!p->pooled && own != k)) {
            continue;
        }
        for (size_t a = 0; a < d; a++) {
            for (size_t b = 0; b < d; b++) {
                s[a * d + b] += (p->c->scores[j * stride + a] - mean[own][a] / count[own]) *
                                (p->c->scores[j * stride + b] - mean[own][b] / count[own]);
            }
        }
    }
    for (size_t c = 0; c < p->n_classes; c++) {
        freedom += p->pooled || c == k ? plain_freedom(p, c, out_a, out_b) : 0.0;
    }
    for (size_t a = 0; a < d; a++) {
        x[a] = p->c->scores[i * stride + a] - mean[k][a] / count[k];
    }
    for (size_t a = 0; a < d * d; a++) {
        s[a] /= freedom;
    }
    if (LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', (int)d, s, (int)d) != 0) {
        return -INFINITY;
    }
    result = -0.5 * (double)d * log(2.0 * SRNF_PI);
    for (size_t a = 0; a < d; a++) {
        result -= log(s[a * d + a]);
    }
    (void)LAPACKE_dtrtrs_work(LAPACK_COL_MAJOR, 'L', 'N', 'N', (int)d, 1, s, (int)d, x, (int)d);
    for (size_t a = 0; a < d; a++) {
        result -= 0.5 * x[a] * x[a];
    }
    return result;
}

static void likelihoods_are_those_of_a_plain_fit(void **state)
{
    size_t labels[N];
    struct srnf_folds c;
    double worst = 0.0;

    (void)state;
    for (size_t i = 0; i < N; i++) {
        labels[i] = i % 3; /* three classes */
    }
    c = classes_open(N, COMPONENTS, 1.0, labels, 3);
    for (size_t pooled = 0; pooled < 2; pooled++) {
        struct srnf_classify_options options = srnf_classify_options_defaults();
        struct plain plain = {&c, labels, 3, 4, pooled};
        struct srnf_classification r;

        options.components = 4;
        options.covariance = pooled ? SRNF_COVARIANCE_POOLED : SRNF_COVARIANCE_CLASS;
        assert_int_equal(srnf_classify_gauss(&c, labels, 3, &options, NULL, &r, NULL), SRNF_OK);
        for (size_t i = 0; i < N; i++) {
            size_t best = 0;

            assert_int_equal(r.components[i], 4);
            assert_int_equal(r.pooled[i], pooled);
            for (size_t k = 0; k < 3; k++) {
                worst = compare_max(
                    worst, fabs(r.evidence[3 * i + k] - plain_likelihood(&plain, i, k, i, i)));
                best = r.evidence[3 * i + k] > r.evidence[3 * i + best] ? k : best;
            }
            assert_int_equal(r.predicted[i], best);
        }
        srnf_classification_clear(&r);
    }
    figure_below("log-likelihoods", worst, 1e-10);
    classes_clear(&c);
}

/* Sum of log posteriors over the training subjects, each left out by a fit of its own. */
static double plain_score(const struct plain *p, size_t left_out)
{
    double score = 0.0;

    for (size_t i = 0; i < p->c->n; i++) {
        double sum = 0.0;
        double own = plain_likelihood(p, i, p->labels[i], left_out, i);

        for (size_t k = 0; k < p->n_classes; k++) {
            sum += exp(plain_likelihood(p, i, k, left_out, i) - own);
        }
        score -= subject_of(p->c, i) == subject_of(p->c, left_out) ? 0.0 : log(sum);
    }
    return score;
}

static void the_inner_choice_is_that_of_refitting(void **state)
{
    size_t labels[N];
    struct srnf_folds c;
    struct srnf_classification r;

    (void)state;
    classes_two(N, FIRST, labels);
    c = classes_open(N, COMPONENTS, 1.5, labels, 4);
    assert_int_equal(srnf_classify_gauss(&c, labels, 2, NULL, NULL, &r, NULL), SRNF_OK);
    for (size_t i = 0; i < N; i += 11) {
        struct plain plain = {&c, labels, 2, r.components[i], r.pooled[i]};
        double chosen = plain_score(&plain, i);

        for (size_t k = 1; k <= COMPONENTS; k++) {
            for (size_t pooled = 0; pooled < 2; pooled++) {
                plain.features = k;
                plain.pooled = pooled;
                assert_true(plain_score(&plain, i) <= chosen + 1e-9);
            }
        }
    }
    srnf_classification_clear(&r);
    classes_clear(&c);
}

/* Members of a subject are left out together, outside and inside the fold, whether they are of one
   class or of several: against fits without them. */
static void subjects_are_left_out_whole(void **state)
{
    size_t labels[N];
    size_t subjects[N];
    double worst = 0.0;

    (void)state;
    for (size_t within = 0; within < 2; within++) {
        struct srnf_folds c;
        struct srnf_classification r;

        for (size_t i = 0; i < N; i++) {
            subjects[i] = i < 30 ? i / 3 : i; /* ten of three, four of one */
            labels[i] = within ? i % 2 : subjects[i] % 2;
        }
        c = classes_open(N, COMPONENTS, 1.5, labels, 4);
        c.subjects = subjects;
        assert_int_equal(srnf_classify_gauss(&c, labels, 2, NULL, NULL, &r, NULL), SRNF_OK);
        assert_int_equal(r.subjects, 14);
        for (size_t i = 0; i < N; i += 7) {
            struct plain plain = {&c, labels, 2, r.components[i], r.pooled[i]};
            double chosen = plain_score(&plain, i);

            for (size_t k = 0; k < 2; k++) {
                double d = fabs(r.evidence[2 * i + k] - plain_likelihood(&plain, i, k, i, i));

                worst = compare_max(worst, d);
            }
            for (size_t k = 1; k <= COMPONENTS - 3; k++) { /* what the fewest subjects determine */
                for (size_t pooled = 0; pooled < 2; pooled++) {
                    plain.features = k;
                    plain.pooled = pooled;
                    assert_true(plain_score(&plain, i) <= chosen + 1e-9);
                }
            }
        }
        srnf_classification_clear(&r);
        c.subjects = NULL;
        classes_clear(&c);
    }
    figure_below("log-likelihoods with repeated subjects", worst, 1e-10);
}

/* Every subject twice, the same scores: the nearest is never the other one, and the accuracy is
   that of one of each, with the interval of as many. */
static void copies_of_a_subject_teach_nothing(void **state)
{
    enum { SUBJECTS = 14 };
    size_t once[SUBJECTS];
    size_t labels[2 * SUBJECTS];
    size_t subjects[2 * SUBJECTS];
    struct srnf_folds a;
    struct srnf_folds b;

    (void)state;
    for (size_t i = 0; i < SUBJECTS; i++) {
        once[i] = i % 2;
    }
    a = classes_open(SUBJECTS, 2, 1.0, once, 21);
    for (size_t i = 0; i < 2 * (size_t)SUBJECTS; i++) {
        labels[i] = once[i / 2];
        subjects[i] = i / 2;
    }
    b = classes_open(2 * SUBJECTS, 2, 0.0, labels, 21);
    for (size_t i = 0; i < 2 * (size_t)SUBJECTS; i++) {
        for (size_t j = 0; j < 2 * (size_t)SUBJECTS; j++) {
            b.distances[2 * i * SUBJECTS + j] = a.distances[i / 2 * SUBJECTS + j / 2];
            memcpy(b.scores + (2 * i * SUBJECTS + j) * 2, a.scores + j / 2 * 2, 2 * sizeof(double));
        }
    }
    b.subjects = subjects;
    for (size_t gauss = 0; gauss < 2; gauss++) {
        struct srnf_classify_options options = srnf_classify_options_defaults();
        struct srnf_classification r;
        struct srnf_classification s;

        options.components = 2;
        options.covariance = SRNF_COVARIANCE_POOLED;
        options.permutations = 99;
        assert_int_equal((gauss ? srnf_classify_gauss
                                : srnf_classify_nearest)(&a, once, 2, &options, NULL, &r, NULL),
                         SRNF_OK);
        assert_int_equal((gauss ? srnf_classify_gauss
                                : srnf_classify_nearest)(&b, labels, 2, &options, NULL, &s, NULL),
                         SRNF_OK);
        assert_true(r.accuracy < 1.0);
        assert_true(s.accuracy == r.accuracy && s.p_value == r.p_value);
        assert_true(s.effective == r.effective && r.effective <= SUBJECTS);
        assert_true(s.interval[0] == r.interval[0] && s.interval[1] == r.interval[1]);
        assert_true(s.majority == 0.5);
        srnf_classification_clear(&s);
        srnf_classification_clear(&r);
        b.subjects = NULL; /* whereas members taken for subjects find each other */
        if (!gauss) {
            assert_true(accuracy(&b, labels, false, NULL, NULL) == 1.0);
        }
        b.subjects = subjects;
    }
    b.subjects = NULL;
    classes_clear(&a);
    classes_clear(&b);
}

/* With few subjects all relabellings are taken, and p is a multiple of one over their number: 2 of
   20 at least where two classes of three exchange names. */
static void few_subjects_are_relabelled_in_all_ways(void **state)
{
    size_t labels[6] = {0, 0, 0, 1, 1, 1};
    size_t subjects[6] = {0, 1, 2, 3, 4, 0};
    struct srnf_folds c = classes_open(6, 1, 50.0, labels, 3);
    struct srnf_classify_options options = srnf_classify_options_defaults();
    struct srnf_classification r;
    struct srnf_error error = {0};
    double interval[2];

    (void)state;
    options.permutations = 999;
    assert_int_equal(srnf_classify_nearest(&c, labels, 2, &options, NULL, &r, NULL), SRNF_OK);
    assert_true(r.test.exact && r.test.permutations == 19 && r.test.relabellings == 20.0);
    assert_true(r.accuracy == 1.0 && fabs(r.p_value - 0.1) < 1e-15);
    assert_true(srnf_permutation_at_floor(&r.test, r.p_value));
    srnf_permutation_interval(&r.test, r.p_value, interval);
    assert_true(interval[0] == r.p_value && interval[1] == r.p_value);
    srnf_classification_clear(&r);

    options.permutations = 9; /* at random: less than all */
    assert_int_equal(srnf_classify_nearest(&c, labels, 2, &options, NULL, &r, NULL), SRNF_OK);
    assert_true(!r.test.exact && r.test.permutations == 9 && r.test.least == 0.1);
    srnf_classification_clear(&r);

    c.subjects = subjects; /* the first and the last, with two labels */
    assert_int_equal(srnf_classify_nearest(&c, labels, 2, &options, NULL, &r, &error), SRNF_EINVAL);
    assert_non_null(strstr(error.message, "within a subject"));
    options.permutations = 0;
    assert_int_equal(srnf_classify_nearest(&c, labels, 2, &options, NULL, &r, NULL), SRNF_OK);
    assert_true(isnan(r.p_value) && r.test.permutations == 0);
    srnf_classification_clear(&r);
    c.subjects = NULL;
    classes_clear(&c);
}

/* Mixing earlier features into later ones, and the units of all, shift every log-likelihood by the
   same number; so does the unit of size. */
static void likelihood_ratios_are_invariant(void **state)
{
    size_t labels[N];
    double size[N];
    struct srnf_folds c;
    struct srnf_classify_options options = srnf_classify_options_defaults();
    struct srnf_classification before;
    struct srnf_classification after;
    double worst = 0.0;

    (void)state;
    classes_two(N, FIRST, labels);
    c = classes_open(N, COMPONENTS, 1.0, labels, 5);
    for (size_t i = 0; i < N; i++) {
        size[i] = sin((double)(7 * i)) + 0.3 * (double)labels[i];
    }
    options.log_scale = size;
    assert_int_equal(srnf_classify_gauss(&c, labels, 2, &options, NULL, &before, NULL), SRNF_OK);
    for (size_t i = 0; i < N * N; i++) {
        double *x = c.scores + i * COMPONENTS;

        for (size_t k = COMPONENTS; k-- > 0;) {
            x[k] = 1e3 * (double)(k + 1) * (x[k] + (k > 0 ? 0.5 * x[k - 1] : 0.0)) - 40.0;
        }
    }
    for (size_t i = 0; i < N; i++) {
        size[i] = 5.0 - 100.0 * size[i];
    }
    assert_int_equal(srnf_classify_gauss(&c, labels, 2, &options, NULL, &after, NULL), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        double ratio = before.evidence[2 * i] - before.evidence[2 * i + 1];

        worst = compare_max(worst, fabs(after.evidence[2 * i] - after.evidence[2 * i + 1] - ratio));
        assert_int_equal(before.components[i], after.components[i]);
    }
    figure_below("log-likelihood ratios", worst, 1e-8);
    srnf_classification_clear(&before);
    srnf_classification_clear(&after);
    classes_clear(&c);
}

/* ---- Nearest --------------------------------------------------------------------------------- */

static void the_nearest_counts(void **state)
{
    size_t labels[N];
    double size[N];
    struct srnf_folds c;
    struct srnf_classify_options options = srnf_classify_options_defaults();
    struct srnf_classification r;
    size_t total = 0;

    (void)state;
    classes_two(N, FIRST, labels);
    c = classes_open(N, COMPONENTS, 1.0, labels, 6);
    assert_int_equal(srnf_classify_nearest(&c, labels, 2, NULL, NULL, &r, NULL), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        size_t nearest = i == 0 ? 1 : 0;

        for (size_t j = 0; j < N; j++) {
            bool closer = c.distances[i * N + j] < c.distances[i * N + nearest];

            nearest = j != i && closer ? j : nearest;
        }
        assert_int_equal(r.predicted[i], labels[nearest]);
        assert_true(r.evidence[2 * i + labels[nearest]] == -c.distances[i * N + nearest]);
        assert_true(r.evidence[2 * i] <= 0.0 && r.evidence[2 * i + 1] <= 0.0);
    }
    for (size_t k = 0; k < 4; k++) {
        total += r.confusion[k];
    }
    assert_int_equal(total, N);
    assert_int_equal(r.confusion[0] + r.confusion[1], FIRST);
    assert_int_equal(r.confusion[0] + r.confusion[3], r.correct);
    assert_true(isnan(r.p_value) && !r.components && !r.pooled);
    srnf_classification_clear(&r);

    /* Size that tells the classes apart decides when its weight is large, and not when it is 0. */
    for (size_t i = 0; i < N; i++) {
        size[i] = (double)labels[i] + 0.001 * (double)i;
    }
    options.log_scale = size;
    options.size_weight = 1000.0;
    assert_true(accuracy(&c, labels, false, &options, NULL) == 1.0);
    options.size_weight = 0.0;
    assert_true(accuracy(&c, labels, false, &options, NULL) ==
                accuracy(&c, labels, false, NULL, NULL));
    classes_clear(&c);
}

/* ---- Statistics ------------------------------------------------------------------------------ */

/* The ends of Wilson's interval are the p with (x / n - p)^2 = z^2 p (1 - p) / n. */
static void wilson_solves_its_equation(void **state)
{
    double z2 = 1.959963984540054 * 1.959963984540054;
    double ends[2];

    (void)state;
    for (size_t n = 1; n <= 100; n += 9) {
        for (size_t x = 0; x <= n; x++) {
            double rate = (double)x / (double)n;

            srnf_wilson_interval(x, n, ends);
            assert_true(ends[0] >= 0.0 && ends[0] <= rate && rate <= ends[1] && ends[1] <= 1.0);
            for (size_t e = 0; e < 2; e++) {
                double d = rate - ends[e];

                assert_true(fabs(d * d - z2 * ends[e] * (1.0 - ends[e]) / (double)n) <= 1e-14);
            }
        }
    }
    srnf_wilson_interval(0, 0, ends);
    assert_true(ends[0] == 0.0 && ends[1] == 1.0);
}

static void permutations_are_uniform(void **state)
{
    size_t counts[4][4] = {{0}};
    size_t p[4];
    size_t again[4];
    double chi2 = 0.0;

    (void)state;
    for (uint64_t i = 0; i < 4000; i++) {
        unsigned seen = 0;

        srnf_permutation(12, i, 4, p);
        srnf_permutation(12, i, 4, again);
        assert_memory_equal(p, again, sizeof p);
        for (size_t k = 0; k < 4; k++) {
            assert_true(p[k] < 4);
            seen |= 1U << p[k];
            counts[k][p[k]]++;
        }
        assert_int_equal(seen, 15);
    }
    for (size_t k = 0; k < 16; k++) {
        double d = (double)counts[k / 4][k % 4] - 1000.0;

        chi2 += d * d / 1000.0;
    }
    figure_below("chi-square of 9 degrees of freedom", chi2, 27.9); /* passed by 1 in 1000 */
}

/* Shuffled labels: right as often as guessing is, within four standard errors over the seeds. */
static void shuffled_labels_are_at_chance(void **state)
{
    enum { SEEDS = 20 };
    size_t labels[N];

    (void)state;
    classes_two(N, FIRST, labels);
    for (size_t gauss = 0; gauss < 2; gauss++) {
        struct srnf_folds c = classes_open(N, COMPONENTS, 3.0, labels, 7);
        double sum = 0.0;
        double square = 0.0;
        double error;
        /* A nearest neighbour has label c with probability (n_c - 1) / (n - 1). */
        double guess = (19.0 * 18.0 + 15.0 * 14.0) / (34.0 * 33.0);

        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            size_t order[N];
            size_t shuffled[N];
            double a;

            srnf_permutation(seed, 1, N, order);
            for (size_t i = 0; i < N; i++) {
                shuffled[i] = labels[order[i]];
            }
            a = accuracy(&c, shuffled, gauss, NULL, NULL);
            sum += a / SEEDS;
            square += a * a / SEEDS;
        }
        error = sqrt((square - sum * sum) / (SEEDS - 1));
        printf("# %s: %.3f +- %.3f\n", gauss ? "Gauss" : "nearest", sum, error);
        assert_true(fabs(sum - (gauss ? 0.5 : guess)) <= 4.0 * error + (gauss ? 0.03 : 0.0));
        assert_true(accuracy(&c, labels, gauss, NULL, NULL) >= 0.85); /* unshuffled: an effect */
        classes_clear(&c);
    }
}

/* From chance to all right as the classes part. */
static void accuracy_rises_with_the_effect(void **state)
{
    static const double shifts[] = {0.0, 1.0, 2.0, 4.0, 12.0};
    size_t labels[N];
    double before[2] = {0.0, 0.0};

    (void)state;
    classes_two(N, FIRST, labels);
    for (size_t s = 0; s < sizeof shifts / sizeof shifts[0]; s++) {
        double mean[2] = {0.0, 0.0};

        for (uint64_t seed = 0; seed < 5; seed++) {
            struct srnf_folds c = classes_open(N, COMPONENTS, shifts[s], labels, 50 + seed);

            for (size_t gauss = 0; gauss < 2; gauss++) {
                mean[gauss] += accuracy(&c, labels, gauss, NULL, NULL) / 5.0;
            }
            classes_clear(&c);
        }
        printf("# shift %4.1f: nearest %.2f, Gauss %.2f\n", shifts[s], mean[0], mean[1]);
        for (size_t gauss = 0; gauss < 2; gauss++) {
            assert_true(s == 0 ? fabs(mean[gauss] - 0.5) <= 0.15
                               : mean[gauss] >= before[gauss] - 0.03);
            before[gauss] = mean[gauss];
        }
    }
    assert_true(before[0] == 1.0 && before[1] == 1.0);
}

/* p-values of cohorts without an effect: Kolmogorov's distance from uniform, p a multiple of 1/40
   and ties conservative, so that only a surplus of small ones is a fault. */
static void p_values_are_uniform_without_effect(void **state)
{
    enum { COHORTS = 60, PERMUTATIONS = 39 };
    size_t labels[N];

    (void)state;
    classes_two(N, FIRST, labels);
    for (size_t gauss = 0; gauss < 2; gauss++) {
        struct srnf_classify_options options = srnf_classify_options_defaults();
        double p[COHORTS];
        double surplus = 0.0;
        double mean = 0.0;

        options.permutations = PERMUTATIONS;
        options.components = gauss ? 3 : 0;
        options.covariance = SRNF_COVARIANCE_POOLED;
        for (uint64_t k = 0; k < COHORTS; k++) {
            struct srnf_folds c = classes_open(N, 3, 0.0, labels, 100 + k);

            options.seed = k;
            (void)accuracy(&c, labels, gauss, &options, &p[k]);
            mean += p[k] / COHORTS;
            classes_clear(&c);
        }
        for (size_t k = 0; k < COHORTS; k++) {
            size_t below = 0;

            for (size_t j = 0; j < COHORTS; j++) {
                below += p[j] <= p[k];
            }
            surplus = compare_max(surplus, (double)below / COHORTS - p[k]);
        }
        printf("# %s: mean %.3f\n", gauss ? "Gauss" : "nearest", mean);
        figure_below("surplus of small p-values", surplus, 0.21); /* passed by 1 in 100 */
        assert_true(mean >= 0.40 && mean <= 0.65);
    }
}

static void threads_do_not_matter(void **state)
{
    size_t labels[N];
    struct srnf_folds c;
    struct srnf_classify_options options = srnf_classify_options_defaults();
    double first = 0.0, effective = 0.0;

    (void)state;
    classes_two(N, FIRST, labels);
    c = classes_open(N, COMPONENTS, 0.7, labels, 8);
    options.permutations = 19;
    for (size_t t = 0; t < GROUP_SPREADS; t++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[t]);
        struct srnf_classification r;

        assert_int_equal(srnf_classify_gauss(&c, labels, 2, &options, &context, &r, NULL), SRNF_OK);
        first = t == 0 ? r.p_value : first;
        effective = t == 0 ? r.effective : effective;
        assert_true(r.p_value == first && r.effective == effective);
        srnf_classification_clear(&r);
        watch.cancel_after = 0;
        assert_int_equal(srnf_classify_gauss(&c, labels, 2, &options, &context, &r, NULL),
                         SRNF_ECANCELED);
        assert_null(r.predicted);
    }
    classes_clear(&c);
}

/* ---- Refusals -------------------------------------------------------------------------------- */

static void refused(const struct srnf_folds *c, const size_t *labels, size_t n_classes,
                    const struct srnf_classify_options *options, const char *word)
{
    struct srnf_classification r;
    struct srnf_error error = {0};

    assert_int_equal(srnf_classify_gauss(c, labels, n_classes, options, NULL, &r, &error),
                     SRNF_EINVAL);
    assert_null(r.predicted);
    assert_non_null(strstr(error.message, word));
}

/* One other number is what size is, to the last bit; several decide like one, do not depend on
   their units, and what is wrong with them is told by name. */
static void other_numbers_count_as_size_does(void **state)
{
    struct srnf_classify_options options = srnf_classify_options_defaults();
    struct srnf_classify_options plain = options;
    size_t labels[N];
    double size[N], numbers[2 * N], many[30 * N] = {0.0};
    struct srnf_folds c;
    struct srnf_classification a, b;

    (void)state;
    classes_two(N, FIRST, labels);
    c = classes_open(N, COMPONENTS, 0.5, labels, 9);
    for (size_t i = 0; i < N; i++) {
        size[i] = sin((double)(7 * i)) + 0.5 * (double)labels[i];
    }
    for (int gauss = 0; gauss < 2; gauss++) {
        int (*classify)(const struct srnf_folds *, const size_t *, size_t,
                        const struct srnf_classify_options *, const struct srnf_context *,
                        struct srnf_classification *, struct srnf_error *) =
            gauss ? srnf_classify_gauss : srnf_classify_nearest;

        options = plain;
        options.log_scale = size;
        assert_int_equal(classify(&c, labels, 2, &options, NULL, &a, NULL), SRNF_OK);
        options = plain;
        options.features = size;
        options.n_features = 1;
        assert_int_equal(classify(&c, labels, 2, &options, NULL, &b, NULL), SRNF_OK);
        assert_memory_equal(a.evidence, b.evidence, 2 * N * sizeof(double));
        srnf_classification_clear(&a);
        srnf_classification_clear(&b);
    }
    /* The classes differ by the difference of two numbers that vary far more together. */
    for (size_t i = 0; i < N; i++) {
        numbers[2 * i] = 10.0 * cos((double)(5 * i)) + 2.0 * (double)labels[i];
        numbers[2 * i + 1] = 10.0 * cos((double)(5 * i)) + 0.3 * sin((double)(3 * i));
    }
    options = plain;
    options.components = 1;
    options.covariance = SRNF_COVARIANCE_POOLED;
    options.features = numbers;
    options.n_features = 2;
    assert_int_equal(srnf_classify_gauss(&c, labels, 2, &options, NULL, &a, NULL), SRNF_OK);
    assert_true(a.accuracy == 1.0);
    assert_int_equal(a.components[0], 1);
    for (size_t i = 0; i < N; i++) {
        numbers[2 * i] = 3.0 - 1e3 * numbers[2 * i];
        numbers[2 * i + 1] = 1e-2 * numbers[2 * i + 1] - 5.0;
    }
    assert_int_equal(srnf_classify_gauss(&c, labels, 2, &options, NULL, &b, NULL), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        figure_below("log-likelihood ratio",
                     fabs(a.evidence[2 * i] - a.evidence[2 * i + 1] - b.evidence[2 * i] +
                          b.evidence[2 * i + 1]),
                     1e-6);
    }
    srnf_classification_clear(&a);
    srnf_classification_clear(&b);
    numbers[2 * 4 + 1] = NAN;
    refused(&c, labels, 2, &options, "feature of member 4");
    options.n_features = SRNF_FEATURES_MAX + 1;
    refused(&c, labels, 2, &options, "features are more than");
    options.features = many;
    options.n_features = 30;
    options.components = COMPONENTS;
    refused(&c, labels, 2, &options, "more than the training subjects determine");
    classes_clear(&c);
}

static void wrong_arguments_are_refused(void **state)
{
    size_t labels[N];
    double size[N] = {0.0};
    struct srnf_classify_options options = srnf_classify_options_defaults();
    struct srnf_folds c;
    double *scores;

    (void)state;
    classes_two(N, FIRST, labels);
    c = classes_open(N, COMPONENTS, 1.0, labels, 9);
    refused(&c, labels, 1, NULL, "classes");
    labels[3] = 2;
    refused(&c, labels, 2, NULL, "subject 3");
    refused(&c, labels, 3, NULL, "class 2 has 1 subjects");
    labels[3] = 0;
    options.components = COMPONENTS + 1;
    refused(&c, labels, 2, &options, "components is 7");
    options.components = 0;
    options.permutations = SIZE_MAX;
    refused(&c, labels, 2, &options, "permutations");
    options.permutations = 0;
    options.size_weight = -1.0;
    refused(&c, labels, 2, &options, "size_weight");
    options.size_weight = 1.0;
    options.covariance = (enum srnf_covariance)3;
    refused(&c, labels, 2, &options, "no covariance 3");
    options.covariance = SRNF_COVARIANCE_AUTO;
    options.log_scale = size;
    size[5] = NAN;
    refused(&c, labels, 2, &options, "subject 5");
    for (size_t i = 3; i < N; i++) {
        labels[i] = 1;
    }
    options = srnf_classify_options_defaults();
    options.covariance = SRNF_COVARIANCE_CLASS;
    options.components = 2;
    refused(&c, labels, 2, &options, "more than the training subjects determine");
    scores = c.scores;
    c.scores = NULL;
    refused(&c, labels, 2, NULL, "no scores");
    c.scores = scores;
    /* A feature that never varies leaves no covariance. */
    options.covariance = SRNF_COVARIANCE_POOLED;
    options.components = 1;
    for (size_t i = 0; i < N * N; i++) {
        c.scores[i * COMPONENTS] = 1.0;
    }
    {
        struct srnf_classification r;

        assert_int_equal(srnf_classify_gauss(&c, labels, 2, &options, NULL, &r, NULL),
                         SRNF_ENUMERIC);
    }
    classes_clear(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(other_numbers_count_as_size_does),
        cmocka_unit_test(likelihoods_are_those_of_a_plain_fit),
        cmocka_unit_test(the_inner_choice_is_that_of_refitting),
        cmocka_unit_test(subjects_are_left_out_whole),
        cmocka_unit_test(copies_of_a_subject_teach_nothing),
        cmocka_unit_test(few_subjects_are_relabelled_in_all_ways),
        cmocka_unit_test(likelihood_ratios_are_invariant),
        cmocka_unit_test(the_nearest_counts),
        cmocka_unit_test(wilson_solves_its_equation),
        cmocka_unit_test(permutations_are_uniform),
        cmocka_unit_test(shuffled_labels_are_at_chance),
        cmocka_unit_test(accuracy_rises_with_the_effect),
        cmocka_unit_test(p_values_are_uniform_without_effect),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(wrong_arguments_are_refused),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

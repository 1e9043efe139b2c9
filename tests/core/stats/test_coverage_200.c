/*
 * test_coverage_200.c - cohorts whose labels do say something: how often the intervals that
 * leaving members out gives of accuracy, balanced accuracy and area under the curve hold what the
 * classifier of all members gets of many others.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 3600
 */
#include "classes.h"
#include "nulls.h"
#include "stats/classify.h"
#include "stats/frozen.h"

#define STUDIES ((size_t)200)
#define FRESH ((size_t)2000)
#define COMPONENTS ((size_t)3)
#define MEMBERS_MAX ((size_t)60)
#define FIGURES ((size_t)3)
#define KEPT ((size_t)100) /* studies of surfaces, which take longer */
#define MISSED 0.09        /* of intervals of 95 %: less in 95 % of series of 100 */

static const char *const names[FIGURES] = {"accuracy", "balanced accuracy", "area"};

struct asked {
    size_t n;
    bool gauss;
    double shift;
};

/* Of each study: what was told with its interval, and what is true of its classifier. */
struct study_of {
    struct srnf_rate told[FIGURES];
    double truth[FIGURES];
};

/* Members that no classifier has seen, of either class as many. */
struct fresh {
    double x[FRESH][COMPONENTS];
    size_t labels[FRESH];
    double evidence[2 * FRESH], lead[FRESH];
};

static void draw_fresh(double shift, struct fresh *fresh)
{
    struct test_random random = test_random_seed(31);

    for (size_t i = 0; i < FRESH; i++) {
        fresh->labels[i] = i % 2;
        for (size_t k = 0; k < COMPONENTS; k++) {
            fresh->x[i][k] = test_random_normal(&random) + (k == 0 && i % 2 ? shift : 0.0);
        }
    }
}

static void judge_gauss(const struct srnf_folds *c, const size_t *labels,
                        const struct srnf_classify_options *options, struct fresh *fresh)
{
    size_t own[MEMBERS_MAX];
    struct srnf_classifier classifier = {0};
    struct frozen_members members = {.n = c->n,
                                     .components = COMPONENTS,
                                     .classes = 2,
                                     .scores = c->scores,
                                     .labels = labels,
                                     .subjects = own};
    double memory[COMPONENTS * (COMPONENTS + 1)];

    for (size_t i = 0; i < c->n; i++) {
        own[i] = i;
    }
    assert_int_equal(frozen_fit_gauss(&members, options, &classifier, NULL), SRNF_OK);
    for (size_t i = 0; i < FRESH; i++) {
        assert_int_equal(
            frozen_likelihoods(&classifier, fresh->x[i], memory, fresh->evidence + 2 * i), SRNF_OK);
    }
    srnf_classifier_clear(&classifier);
}

static void judge_nearest(const struct srnf_folds *c, const size_t *labels, struct fresh *fresh)
{
    for (size_t i = 0; i < FRESH; i++) {
        fresh->evidence[2 * i] = fresh->evidence[2 * i + 1] = -INFINITY;
        for (size_t m = 0; m < c->n; m++) {
            double *best = &fresh->evidence[2 * i + labels[m]], square = 0.0;

            for (size_t k = 0; k < COMPONENTS; k++) {
                double d = fresh->x[i][k] - c->scores[m * COMPONENTS + k];

                square += d * d;
            }
            *best = -sqrt(square) > *best ? -sqrt(square) : *best;
        }
    }
}

static void measure_truth(struct fresh *fresh, double truth[FIGURES])
{
    double right = 0.0;

    assess_leads(FRESH, 2, fresh->evidence, 1, fresh->lead);
    for (size_t i = 0; i < FRESH; i++) {
        right += (fresh->lead[i] > 0.0) == (fresh->labels[i] == 1);
    }
    truth[0] = truth[1] = right / (double)FRESH; /* classes are as large as each other */
    truth[2] = assess_auc(FRESH, fresh->labels, 1, fresh->lead);
}

static void run_study(const struct asked *asked, uint64_t seed, struct fresh *fresh,
                      struct study_of *study)
{
    struct srnf_classify_options options = srnf_classify_options_defaults();
    size_t labels[MEMBERS_MAX];
    struct srnf_classification r;
    struct srnf_folds c;

    for (size_t i = 0; i < asked->n; i++) {
        labels[i] = i % 2;
    }
    options.components = asked->gauss ? COMPONENTS : 0;
    options.covariance = SRNF_COVARIANCE_POOLED;
    c = classes_open(asked->n, COMPONENTS, asked->shift, labels, seed);
    assert_int_equal((asked->gauss ? srnf_classify_gauss : srnf_classify_nearest)(
                         &c, labels, 2, &options, NULL, &r, NULL),
                     SRNF_OK);
    study->told[0] = (struct srnf_rate){r.accuracy, {r.interval[0], r.interval[1]}};
    study->told[1] = r.balanced;
    study->told[2] = r.auc[1];
    srnf_classification_clear(&r);
    if (asked->gauss) {
        judge_gauss(&c, labels, &options, fresh);
    } else {
        judge_nearest(&c, labels, fresh);
    }
    measure_truth(fresh, study->truth);
    classes_clear(&c);
}

/* Intervals that do not hold the truth of their study. */
static void count_missed(const char *what, size_t count, const struct study_of *studies)
{
    double accuracy = 0.0;

    for (size_t s = 0; s < count; s++) {
        accuracy += studies[s].truth[0] / (double)count;
    }
    printf("# %s, accuracy %.3f: of %zu intervals above and below", what, accuracy, count);
    for (size_t k = 0; k < FIGURES; k++) {
        size_t above = 0, below = 0;

        for (size_t s = 0; s < count; s++) {
            above += !(studies[s].told[k].interval[0] <= studies[s].truth[k]);
            below += !(studies[s].told[k].interval[1] >= studies[s].truth[k]);
        }
        printf(", %s %zu and %zu", names[k], above, below);
        assert_true((double)(above + below) <= MISSED * (double)count);
    }
    printf("\n");
    (void)fflush(stdout);
}

/* Scores that are the same in every fold, as of classify. */
static void of_planted_scores(void **state)
{
    static struct fresh fresh;
    static struct study_of studies[STUDIES];

    (void)state;
    for (size_t n = 24; n <= MEMBERS_MAX; n += MEMBERS_MAX - 24) {
        for (int shift = 1; shift <= 3; shift++) {
            for (size_t gauss = 0; gauss < 2; gauss++) {
                struct asked asked = {n, gauss == 1, (double)shift};
                char what[64];

                draw_fresh(asked.shift, &fresh);
                for (size_t s = 0; s < STUDIES; s++) {
                    run_study(&asked, 500 + s, &fresh, &studies[s]);
                }
                (void)snprintf(what, sizeof what, "%s, %zu members %d sd apart",
                               gauss ? "Gauss" : "nearest", n, shift);
                count_missed(what, STUDIES, studies);
            }
        }
    }
}

/* ---- Surfaces, whose classifiers are kept ---------------------------------------------------- */

#define POOLS ((size_t)6)
#define OTHERS (POOLS * NULLS_MEMBERS)

/* The second class is flatter by a share of its third axis. */
static void open_flattened(struct nulls *a, double share, uint64_t seed)
{
    nulls_open(a, 1, seed);
    for (size_t i = 0; i < NULLS_MEMBERS; i++) {
        for (size_t k = 0; k < a->g.each && a->labels[i]; k++) {
            a->g.f[i][2 * a->g.each + k] *= 1.0 - share;
        }
    }
}

/* Surfaces that no classifier was trained on. */
struct others {
    struct nulls pools[POOLS];
    const double *surfaces[OTHERS];
    size_t labels[OTHERS];
    double evidence[2 * OTHERS], probabilities[2 * OTHERS];
    struct srnf_class_prediction predictions[OTHERS];
};

static void open_others(struct others *o, double share)
{
    for (size_t i = 0; i < OTHERS; i++) {
        struct nulls *pool = &o->pools[i / NULLS_MEMBERS];

        if (i % NULLS_MEMBERS == 0) {
            open_flattened(pool, share, 20000 + i);
        }
        o->surfaces[i] = pool->g.f[i % NULLS_MEMBERS];
        o->labels[i] = pool->labels[i % NULLS_MEMBERS];
    }
}

static void close_others(struct others *o)
{
    for (size_t p = 0; p < POOLS; p++) {
        nulls_close(&o->pools[p]);
    }
}

static void read_figures(const struct srnf_assessment *a, struct srnf_rate figures[FIGURES])
{
    figures[0] = a->accuracy;
    figures[1] = a->balanced;
    figures[2] = a->auc[1];
}

static void train_study(const struct nulls *a, bool gauss, struct others *o, struct study_of *study)
{
    static const double priors[2] = {0.5, 0.5};
    struct srnf_train_options options = srnf_train_options_defaults();
    struct srnf_rate truth[FIGURES];
    struct srnf_assessment tested;
    struct srnf_trained trained;

    options.gauss = gauss;
    options.registration.degree = 2;
    options.registration.common_pose = true;
    options.priors = SRNF_PRIORS_EQUAL;
    assert_int_equal(srnf_train(a->g.sht, NULLS_MEMBERS, a->g.surfaces, a->labels, 2, &options,
                                NULL, &trained, NULL),
                     SRNF_OK);
    const struct srnf_frozen frozen = {.classifier = &trained.classifier,
                                       .pca = &trained.pca,
                                       .n_parts = 1,
                                       .target = trained.target,
                                       .mean_q = trained.mean_q,
                                       .labels = a->labels,
                                       .subjects = NULLS_MEMBERS};

    assert_int_equal(srnf_predict(a->g.sht, &frozen, OTHERS, o->surfaces, NULL, NULL,
                                  &options.registration, NULL, NULL, o->predictions, o->evidence,
                                  o->probabilities, NULL),
                     SRNF_OK);
    assert_int_equal(srnf_assess(OTHERS, 2, o->labels, NULL, o->evidence, o->probabilities, priors,
                                 NULL, &tested),
                     SRNF_OK);
    read_figures(&trained.assessment, study->told);
    read_figures(&tested, truth);
    for (size_t k = 0; k < FIGURES; k++) {
        study->truth[k] = truth[k].value;
    }
    srnf_assessment_clear(&tested);
    srnf_trained_clear(&trained);
}

static bool has_enough(const struct nulls *a)
{
    size_t ones = 0;

    for (size_t i = 0; i < NULLS_MEMBERS; i++) {
        ones += a->labels[i];
    }
    return ones >= SRNF_TRAIN_SUBJECTS_MIN && ones + SRNF_TRAIN_SUBJECTS_MIN <= NULLS_MEMBERS;
}

static void of_classifiers_that_are_kept(void **state)
{
    static struct study_of studies[KEPT];
    struct others *o = calloc(1, sizeof *o);

    (void)state;
    assert_non_null(o);
    for (int percent = 4; percent <= 8; percent += 4) {
        double share = 0.01 * (double)percent;

        open_others(o, share);
        for (size_t gauss = 0; gauss < 2; gauss++) {
            char what[64];
            uint64_t seed = 30000;

            for (size_t s = 0; s < KEPT; seed++) {
                struct nulls a;

                open_flattened(&a, share, seed);
                if (has_enough(&a)) {
                    train_study(&a, gauss == 1, o, &studies[s++]);
                }
                nulls_close(&a);
            }
            (void)snprintf(what, sizeof what, "%s, surfaces %d %% flatter",
                           gauss ? "Gauss" : "nearest", percent);
            count_missed(what, KEPT, studies);
        }
        close_others(o);
    }
    free(o);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(of_planted_scores),
        cmocka_unit_test(of_classifiers_that_are_kept),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

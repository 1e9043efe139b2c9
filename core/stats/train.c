/*
 * train.c - a classifier with its nested validation (srnf/train.h).
 *
 * The outer folds are those of srnf_folds_compare, each of one subject, with the evidence that
 * srnf_classify_gauss or srnf_classify_nearest has for it. The calibration of a fold needs evidence
 * for the fold's training members from classifiers that have not seen them: for the Gaussians the
 * fold's training subjects are dealt into ten groups, class by class in the order of the cohort,
 * and each group gets its evidence from mean, components, their number and Gaussians of the other
 * nine, all from the inner products of the fields registered to the fold's template. Nearest
 * neighbours are not fitted: there each subject is left out by itself, also of what numbers beside
 * shape are scaled by (frozen_nearest.c). The classifier of all members is calibrated likewise,
 * with nobody left out. Of several structures each is compared in folds of its own (folds_join.c);
 * all that follows works on the weighted sums of their inner products and on stacked fields.
 */
#include "folds.h"
#include "frozen.h"

#include <math.h>
#include <string.h>

#define GROUPS 10
#define COMPONENTS 20
#define COMPONENTS_MAX 64
#define COST_COMPARISON 0.9 /* of the progress; the validation has the rest */
#define NOBODY SIZE_MAX

struct srnf_train_options srnf_train_options_defaults(void)
{
    return (struct srnf_train_options){.relabellings = SRNF_RELABELLINGS,
                                       .gauss = true,
                                       .registration = srnf_register_options_defaults(),
                                       .feature_weight = 1.0,
                                       .n_parts = 1,
                                       .position_weight = 1.0};
}

void srnf_trained_clear(struct srnf_trained *t)
{
    srnf_free(t->medoids);
    srnf_free(t->pairs);
    srnf_free(t->target);
    srnf_free(t->mean_q);
    srnf_pca_clear(&t->pca);
    srnf_calibration_clear(&t->calibration);
    srnf_free(t->distances);
    srnf_free(t->residuals);
    srnf_free(t->nearest);
    srnf_classifier_clear(&t->classifier);
    srnf_free(t->evidence);
    srnf_free(t->probabilities);
    srnf_free(t->components);
    srnf_assessment_clear(&t->assessment);
    dispersions_clear(&t->dispersions);
    *t = (struct srnf_trained){0};
}

struct training {
    size_t n, classes;
    const size_t *labels;
    const struct srnf_train_options *options;
    struct srnf_classify_options classifier;
    size_t components; /* of scores that are kept */
    struct subjects subjects;
    const double *priors;
    double weights[SRNF_PARTS_MAX];
    struct folds_sum sum;           /* what subjects are compared by */
    struct srnf_folds *parts;       /* of each structure, kept */
    const struct srnf_folds *folds; /* of all together: the one part itself, where it is alone */
    struct srnf_trained *out;
};

/* Of the fold of a member, or of all; NULL without memory. */
static double *products_of(const struct training *t, size_t member)
{
    double *products = srnf_alloc(t->n, t->n * sizeof(double));

    if (products) {
        folds_sum_products(&t->sum, member, products);
    }
    return products;
}

/* ---- The calibration of a fold --------------------------------------------------------------- */

/* The members of one inner fold: who is trained on, in a view without the others. */
struct inner {
    double *scores; /* [n][components] */
    double *distances;
    double *features; /* [n][n_features] of those that are trained on */
    double *x;        /* [n_features + components] of one member, and memory for its likelihoods */
    size_t *given, *labels, *subjects; /* [n] */
    size_t *group;                     /* [subjects] of those that are not left out */
};

static void inner_clear(struct inner *inner)
{
    srnf_free(inner->scores);
    srnf_free(inner->distances);
    srnf_free(inner->features);
    srnf_free(inner->given);
}

static int inner_open(struct inner *inner, const struct training *t)
{
    size_t d = t->components + t->options->n_features;

    inner->scores = srnf_alloc(t->n, t->components * sizeof(double));
    inner->distances = srnf_alloc(t->n * t->n + t->n * t->components, sizeof(double));
    inner->features = srnf_alloc(t->n * t->options->n_features + d * (d + 2), sizeof(double));
    inner->given = srnf_alloc(4 * t->n, sizeof *inner->given);
    if (!inner->scores || !inner->distances || !inner->features || !inner->given) {
        return SRNF_ENOMEM;
    }
    inner->x = inner->features + t->n * t->options->n_features;
    inner->labels = inner->given + t->n;
    inner->subjects = inner->labels + t->n;
    inner->group = inner->subjects + t->n;
    return SRNF_OK;
}

/* The class of a subject: its members have one label. */
static size_t class_of(const struct training *t, size_t subject)
{
    return t->labels[t->subjects.members[t->subjects.start[subject]]];
}

/* Deals the subjects but one, class by class in order, into groups: the one has no part in it. */
static void deal(const struct training *t, size_t left_out, size_t *group)
{
    size_t dealt = 0;

    for (size_t c = 0; c < t->classes; c++) {
        for (size_t s = 0; s < t->subjects.count; s++) {
            if (s != left_out && class_of(t, s) == c) {
                group[s] = dealt++ % GROUPS;
            }
        }
    }
}

static bool is_out(const struct inner *inner, size_t subject, size_t left_out, size_t group)
{
    return subject == left_out || inner->group[subject] == group;
}

/* Scores of all members on the components of those that are not out: they make up one subject. */
static int describe(const struct training *t, const double *products, size_t left_out, size_t group,
                    struct inner *inner)
{
    struct subjects merged = {0};
    size_t out = NOBODY;
    double spread;
    int status;

    for (size_t i = 0; i < t->n; i++) {
        size_t own = t->subjects.of[i];

        inner->given[i] = t->subjects.members[t->subjects.start[own]];
        if (is_out(inner, own, left_out, group)) {
            out = out == NOBODY ? inner->given[i] : out;
            inner->given[i] = out;
        }
    }
    status = subjects_open(&merged, t->n, inner->given, NULL);
    if (status == SRNF_OK) {
        status = fold_describe(&merged, merged.of[out], products, t->components, inner->scores,
                               inner->distances, &spread);
    }
    subjects_clear(&merged);
    return status;
}

/* Those that are trained on, as if there were no others; returns how many. */
static size_t gather(const struct training *t, size_t left_out, size_t group, struct inner *inner,
                     double *scores)
{
    size_t numbers = t->options->n_features;
    size_t count = 0;

    for (size_t s = 0; s < t->subjects.count; s++) {
        size_t first = count;

        for (size_t m = t->subjects.start[s];
             !is_out(inner, s, left_out, group) && m < t->subjects.start[s + 1]; m++) {
            size_t i = t->subjects.members[m];

            memcpy(scores + count * t->components, inner->scores + i * t->components,
                   t->components * sizeof(double));
            for (size_t k = 0; k < numbers; k++) {
                inner->features[count * numbers + k] = t->options->features[i * numbers + k];
            }
            inner->labels[count] = t->labels[i];
            inner->subjects[count++] = first;
        }
    }
    return count;
}

/* Evidence for the members of a group from all others but those left out. */
static int judge_group(const struct training *t, const double *products, size_t left_out,
                       size_t group, struct inner *inner, double *evidence,
                       struct srnf_error *error)
{
    double *scores = inner->distances + t->n * t->n;
    size_t numbers = t->options->n_features;
    struct srnf_classifier classifier = {0};
    struct frozen_members members = {.components = t->components,
                                     .classes = t->classes,
                                     .n_features = numbers,
                                     .scores = scores,
                                     .features = inner->features,
                                     .labels = inner->labels,
                                     .subjects = inner->subjects};
    int status = describe(t, products, left_out, group, inner);

    if (status == SRNF_OK) {
        members.n = gather(t, left_out, group, inner, scores);
        status = frozen_fit_gauss(&members, &t->classifier, &classifier, error);
    }
    for (size_t i = 0; i < t->n && status == SRNF_OK; i++) {
        size_t own = t->subjects.of[i];

        if (own != left_out && inner->group[own] == group) {
            for (size_t k = 0; k < numbers; k++) {
                inner->x[k] = t->options->features[i * numbers + k];
            }
            memcpy(inner->x + numbers, inner->scores + i * t->components,
                   t->components * sizeof(double));
            status = frozen_likelihoods(&classifier, inner->x, inner->x + numbers + t->components,
                                        evidence + i * t->classes);
        }
    }
    srnf_classifier_clear(&classifier);
    return status;
}

static int judge_by_gauss(const struct training *t, const double *products, size_t left_out,
                          const struct srnf_context *context, double *evidence,
                          struct srnf_error *error)
{
    struct inner inner = {0};
    int status = inner_open(&inner, t);

    if (status == SRNF_OK) {
        deal(t, left_out, inner.group);
    }
    for (size_t g = 0; g < GROUPS && status == SRNF_OK; g++) {
        bool any = false;

        for (size_t s = 0; s < t->subjects.count; s++) {
            any = any || (s != left_out && inner.group[s] == g);
        }
        if (srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
        } else if (any) {
            status = judge_group(t, products, left_out, g, &inner, evidence, error);
        }
    }
    inner_clear(&inner);
    return status;
}

static struct frozen_numbers numbers_of(const struct training *t)
{
    return (struct frozen_numbers){t->options->n_features, t->options->features,
                                   t->options->feature_weight};
}

/* The calibration of the fold that leaves a subject out, or of all. */
static int calibrate(const struct training *t, const double *products, size_t left_out,
                     const struct srnf_context *context, struct srnf_platt *platt,
                     struct srnf_error *error)
{
    size_t n = t->n, count = 0;
    double *evidence = srnf_alloc(2 * n * t->classes, sizeof(double));
    double *kept = evidence ? evidence + n * t->classes : NULL;
    size_t *labels = srnf_alloc(2 * n, sizeof *labels);
    int status = evidence && labels ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK && t->options->gauss) {
        status = judge_by_gauss(t, products, left_out, context, evidence, error);
    } else if (status == SRNF_OK) {
        const struct frozen_numbers numbers = numbers_of(t);

        status = frozen_judge_nearest(&t->subjects, products, &numbers, t->labels, t->classes,
                                      left_out, evidence);
    }
    for (size_t s = 0; s < t->subjects.count && status == SRNF_OK; s++) {
        size_t first = count;

        for (size_t m = t->subjects.start[s]; s != left_out && m < t->subjects.start[s + 1]; m++) {
            size_t i = t->subjects.members[m];

            memcpy(kept + count * t->classes, evidence + i * t->classes,
                   t->classes * sizeof(double));
            labels[count] = t->labels[i];
            labels[n + count++] = first;
        }
    }
    if (status == SRNF_OK) {
        status = srnf_platt_fit(count, t->classes, kept, labels, labels + n, platt);
    }
    srnf_free(evidence);
    srnf_free(labels);
    return status;
}

/* ---- Nested validation ----------------------------------------------------------------------- */

static int fold_body(void *argument, size_t subject, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct training *t = argument;
    const struct subjects *s = &t->subjects;
    size_t first = s->members[s->start[subject]];
    struct srnf_platt platt = {0};
    double *products = products_of(t, first);
    int status = products ? calibrate(t, products, subject, context, &platt, error) : SRNF_ENOMEM;

    srnf_free(products);
    for (size_t m = s->start[subject]; m < s->start[subject + 1] && status == SRNF_OK; m++) {
        size_t at = s->members[m] * t->classes;

        srnf_platt_apply(&platt, t->priors, t->out->evidence + at, t->out->probabilities + at);
    }
    srnf_platt_clear(&platt);
    return status;
}

/* The evidence of the outer folds, from the classifiers that classify has. */
static int judge_outer(const struct training *t, const struct srnf_context *context,
                       struct srnf_error *error)
{
    struct srnf_classification found;
    int status = (t->options->gauss ? srnf_classify_gauss : srnf_classify_nearest)(
        t->folds, t->labels, t->classes, &t->classifier, context, &found, error);

    if (status == SRNF_OK) {
        t->out->evidence = found.evidence;
        t->out->components = found.components;
        found.evidence = NULL;
        t->out->dispersions = found.dispersions;
        found.components = NULL;
        found.dispersions = (struct srnf_dispersions){0};
    }
    srnf_classification_clear(&found);
    return status;
}

static int validate(struct training *t, const struct srnf_context *context,
                    struct srnf_error *error)
{
    struct srnf_context quiet = srnf_quiet(context);
    struct stats_progress progress = {0.0, 1.0, "validating"};
    int status = judge_outer(t, &quiet, error);

    t->out->probabilities = srnf_alloc(t->n, t->classes * sizeof(double));
    if (status == SRNF_OK && !t->out->probabilities) {
        status = SRNF_ENOMEM;
    }
    status = status ? status : stats_run(context, t->subjects.count, fold_body, t, progress, error);
    return status ? status
                  : srnf_assess(t->n, t->classes, t->labels, t->subjects.of, t->out->evidence,
                                t->out->probabilities, t->priors, &t->out->dispersions,
                                &t->out->assessment);
}

/* ---- The classifier of all ------------------------------------------------------------------- */

static void find_nearest(const struct training *t, double *nearest)
{
    for (size_t i = 0; i < t->n; i++) {
        nearest[i] = INFINITY;
        for (size_t j = 0; j < t->n; j++) {
            if (t->subjects.of[j] != t->subjects.of[i]) {
                nearest[i] = fmin(nearest[i], t->folds->distances[i * t->n + j]);
            }
        }
    }
}

/* The registered fields, stacked, [n]; those of the parts are let go. */
static int stack_fields(const struct training *t, const struct srnf_stack *stack, double **q)
{
    size_t own = 3 * stats_points(stack->own);
    size_t size = 3 * stats_points(&stack->grid);

    *q = srnf_alloc(t->n, size * sizeof(double));
    for (size_t p = 0; p < stack->parts && *q; p++) {
        for (size_t i = 0; i < t->n; i++) {
            srnf_stack_put(stack, p, t->parts[p].registered + i * own, *q + i * size);
        }
        srnf_free(t->parts[p].registered);
        t->parts[p].registered = NULL;
    }
    for (size_t i = 0; stack->positions && *q && i < t->n; i++) {
        srnf_stack_put_positions(stack, t->sum.positions + 3 * stack->parts * i, *q + i * size);
    }
    return *q ? SRNF_OK : SRNF_ENOMEM;
}

/* q: the fields, [n]. */
static int fit_fields(const struct training *t, const struct srnf_grid *grid, const double *q,
                      const struct srnf_context *context)
{
    struct srnf_trained *out = t->out;
    size_t size = 3 * stats_points(grid);
    int status;

    out->mean_q = srnf_alloc(size, sizeof(double));
    out->distances = srnf_alloc(t->n, sizeof(double));
    out->residuals = srnf_alloc(t->n, sizeof(double));
    out->nearest = srnf_alloc(t->n, sizeof(double));
    if (!out->mean_q || !out->distances || !out->residuals || !out->nearest) {
        return SRNF_ENOMEM;
    }
    stats_average(grid, t->n, q, out->mean_q);
    for (size_t i = 0; i < t->n; i++) {
        out->distances[i] = sqrt(stats_distance2(grid, q + i * size, out->mean_q));
    }
    find_nearest(t, out->nearest);
    status = srnf_pca_fit_within(grid, t->n, out->mean_q, q, 0, context, &out->pca);
    if (status == SRNF_OK && out->pca.components == 0) {
        return SRNF_EDEGENERATE; /* they are all the same */
    }
    status =
        status ? status : srnf_pca_residuals(grid, &out->pca, out->mean_q, t->n, q, out->residuals);
    return status ? status
                  : srnf_calibrate(grid, &out->pca, out->mean_q, q, t->options->subjects, context,
                                   &out->calibration);
}

static int fit_components(const struct training *t, const struct srnf_grid *grid,
                          const struct srnf_context *context)
{
    struct srnf_stack stack;
    double *q = NULL;
    int status = srnf_stack_open(grid, t->options->n_parts, t->weights,
                                 t->sum.positions ? t->sum.position_weight : 0.0, &stack);

    status = status ? status : stack_fields(t, &stack, &q);
    status = status ? status : fit_fields(t, &stack.grid, q, context);
    srnf_free(q);
    srnf_stack_clear(&stack);
    return status;
}

static int fit_gauss(const struct training *t, struct srnf_classifier *classifier,
                     struct srnf_error *error)
{
    const struct srnf_pca *pca = &t->out->pca;
    size_t kept = t->components < pca->components ? t->components : pca->components;
    double *scores = srnf_alloc(t->n * kept, sizeof(double));
    struct frozen_members members = {.n = t->n,
                                     .components = kept,
                                     .classes = t->classes,
                                     .n_features = t->options->n_features,
                                     .scores = scores,
                                     .features = t->options->features,
                                     .labels = t->labels,
                                     .subjects = t->subjects.of};
    int status = scores ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK && t->classifier.components > kept) {
        status = srnf_fail(error, SRNF_EINVAL, -1, "components is %zu, and there are %zu",
                           t->classifier.components, kept);
    }
    for (size_t i = 0; i < t->n && status == SRNF_OK; i++) {
        memcpy(scores + i * kept, pca->scores + i * pca->components, kept * sizeof(double));
    }
    status = status ? status : frozen_fit_gauss(&members, &t->classifier, classifier, error);
    srnf_free(scores);
    return status;
}

/* What the classifier is made of beside its components, from the products of all. */
static int fit(const struct training *t, const double *products, struct srnf_error *error)
{
    struct srnf_classifier *classifier = &t->out->classifier;
    const struct frozen_numbers numbers = numbers_of(t);

    *classifier = (struct srnf_classifier){.classes = t->classes};
    if (t->options->gauss) {
        return fit_gauss(t, classifier, error);
    }
    if (numbers.count == 0) {
        return SRNF_OK;
    }
    classifier->features = numbers.count;
    classifier->factors = srnf_alloc(numbers.count, sizeof(double));
    return classifier->factors
               ? frozen_factors(&t->subjects, products, &numbers, classifier->factors)
               : SRNF_ENOMEM;
}

static int freeze(const struct training *t, const struct srnf_context *context,
                  struct srnf_error *error)
{
    struct srnf_classifier *classifier = &t->out->classifier;
    double *products = products_of(t, SIZE_MAX);
    int status = products ? fit(t, products, error) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        classifier->priors = srnf_alloc(t->classes, sizeof(double));
        status = classifier->priors ? SRNF_OK : SRNF_ENOMEM;
    }
    if (status == SRNF_OK) {
        memcpy(classifier->priors, t->priors, t->classes * sizeof(double));
        status = calibrate(t, products, NOBODY, context, &classifier->platt, error);
    }
    srnf_free(products);
    return status;
}

/* ---- All of it ------------------------------------------------------------------------------- */

/* Subjects of each class, and the priors that follow. SRNF_EINVAL: a class has too few. */
static int count_classes(const struct training *t, size_t *counts, double *priors,
                         struct srnf_error *error)
{
    for (size_t s = 0; s < t->subjects.count; s++) {
        counts[class_of(t, s)]++;
    }
    for (size_t c = 0; c < t->classes; c++) {
        if (counts[c] < SRNF_TRAIN_SUBJECTS_MIN) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)c,
                             "class %zu has %zu subjects; each needs %d at least", c, counts[c],
                             SRNF_TRAIN_SUBJECTS_MIN);
        }
        priors[c] = t->options->priors == SRNF_PRIORS_EQUAL
                        ? 1.0 / (double)t->classes
                        : (double)counts[c] / (double)t->subjects.count;
    }
    return SRNF_OK;
}

size_t srnf_train_determined(size_t classes, const size_t *counts, bool pooled, bool open)
{
    size_t least = SIZE_MAX;
    size_t all = 0;

    for (size_t c = 0; c < classes; c++) {
        /* One is left out, then a group of the rest, then, where a choice is open, one more; the
           mean takes another. */
        size_t used = 2 + (counts[c] + GROUPS - 2) / GROUPS + open;
        size_t left = counts[c] > used ? counts[c] - used : 0;

        all += left;
        least = left < least ? left : least;
    }
    return pooled ? all : least;
}

/* Whether the innermost training subjects determine the covariance. */
static int check_components(const struct training *t, const size_t *counts,
                            struct srnf_error *error)
{
    const struct srnf_train_options *o = t->options;
    bool open = o->components == 0 || o->covariance == SRNF_COVARIANCE_AUTO;
    size_t features = (o->components ? o->components : 1) + o->n_features;
    size_t most =
        srnf_train_determined(t->classes, counts, o->covariance != SRNF_COVARIANCE_CLASS, open);

    if (o->gauss && features > most) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "%zu features, %zu of them numbers beside shape, are more than the "
                         "subjects of an inner fold determine: %zu",
                         features, o->n_features, most);
    }
    return SRNF_OK;
}

static int check(size_t n, const size_t *labels, size_t n_classes,
                 const struct srnf_train_options *options, struct srnf_error *error)
{
    if (n_classes < 2 || n_classes > n) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu classes of %zu members are not 2 or more",
                         n_classes, n);
    }
    for (size_t i = 0; i < n; i++) {
        if (labels[i] >= n_classes) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "label %zu of member %zu is not below %zu", labels[i], i, n_classes);
        }
    }
    if (options->components > COMPONENTS_MAX ||
        (size_t)options->covariance > SRNF_COVARIANCE_CLASS ||
        (size_t)options->priors > SRNF_PRIORS_EQUAL) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "components %zu, covariance %d and priors %d are not all known",
                         options->components, (int)options->covariance, (int)options->priors);
    }
    if (options->n_features > SRNF_FEATURES_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu features are more than %zu",
                         options->n_features, SRNF_FEATURES_MAX);
    }
    for (size_t k = 0; k < n * options->n_features; k++) {
        if (!isfinite(options->features[k])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(k / options->n_features),
                             "a feature of member %zu is not finite", k / options->n_features);
        }
    }
    return SRNF_OK;
}

static int check_parts(const struct srnf_train_options *options, size_t n, double *weights,
                       struct folds_sum *sum, struct srnf_error *error)
{
    if (options->n_parts < 1 || options->n_parts > SRNF_PARTS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu parts are not 1 to %zu", options->n_parts,
                         SRNF_PARTS_MAX);
    }
    for (size_t p = 0; p < options->n_parts; p++) {
        weights[p] = options->weights ? options->weights[p] : 1.0;
        if (!(weights[p] > 0.0 && isfinite(weights[p]))) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)p,
                             "the weight of part %zu is not above 0", p);
        }
    }
    *sum = (struct folds_sum){.n_parts = options->n_parts,
                              .weights = weights,
                              .positions = options->positions,
                              .position_weight = options->position_weight};
    return folds_check_positions(n, sum, error);
}

/* A subject has one label. */
static int check_labels(const struct training *t, struct srnf_error *error)
{
    size_t *own = srnf_alloc(t->subjects.count, sizeof *own);
    int status = own ? SRNF_OK : SRNF_ENOMEM;

    if (own && !subjects_labels(&t->subjects, t->labels, own)) {
        status = srnf_fail(error, SRNF_EINVAL, -1, "labels differ within a subject");
    }
    srnf_free(own);
    return status;
}

/* Each part by folds of its own. */
static int compare_parts(const struct srnf_sht *sht, const struct training *t,
                         const double *const *surfaces, struct stats_part *progress,
                         struct srnf_error *error)
{
    struct srnf_folds_options options = srnf_folds_options_defaults();
    size_t n_parts = t->options->n_parts;
    int status = SRNF_OK;

    options.registration = t->options->registration;
    options.max_components = t->components;
    options.subjects = t->options->subjects;
    options.keep = true;
    for (size_t p = 0; p < n_parts && status == SRNF_OK; p++) {
        struct srnf_context own = stats_part_enter(progress, COST_COMPARISON / (double)n_parts);

        status = srnf_folds_compare(sht, SRNF_METRIC_SRNF, t->n, surfaces + p * t->n, &options,
                                    &own, &t->parts[p], error);
    }
    return status;
}

/* The comparison of all parts together; joint: room for it where they are several. */
static int join_parts(struct training *t, const struct srnf_context *context,
                      struct srnf_folds *joint, struct srnf_error *error)
{
    struct srnf_context quiet = srnf_quiet(context);
    int status = SRNF_OK;

    t->folds = t->parts;
    if (t->options->n_parts > 1 || t->weights[0] != 1.0) {
        status = srnf_folds_join(t->options->n_parts, t->parts, t->weights, t->sum.positions,
                                 t->sum.position_weight, t->components, &quiet, joint, error);
        t->folds = joint;
    }
    t->components = t->folds->components;
    return status;
}

/* The templates of the classifier of all. */
static int take_templates(const struct srnf_sht *sht, const struct training *t,
                          const double *const *surfaces)
{
    struct srnf_trained *out = t->out;
    size_t n_parts = t->options->n_parts;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    int status = SRNF_OK;

    out->medoids = srnf_alloc(n_parts, sizeof *out->medoids);
    out->target = srnf_alloc(n_parts, count * sizeof(double));
    if (!out->medoids || !out->target) {
        return SRNF_ENOMEM;
    }
    for (size_t p = 0; p < n_parts && status == SRNF_OK; p++) {
        out->medoids[p] = t->parts[p].medoid;
        status = srnf_normalize(sht, surfaces[p * t->n + t->parts[p].medoid],
                                out->target + p * count, NULL);
    }
    return status;
}

/* The distances between the members of each part, from the products of its comparison. */
static int take_pairs(const struct training *t)
{
    size_t n = t->n;

    t->out->pairs = srnf_alloc(t->options->n_parts * n, n * sizeof(double));
    for (size_t p = 0; t->out->pairs && p < t->options->n_parts; p++) {
        double *pairs = t->out->pairs + p * n * n;
        const double weight = 1.0;
        const struct folds_sum own = {1, t->parts + p, &weight, NULL, 0.0};

        folds_sum_products(&own, SIZE_MAX, pairs);
        /* In place: the squares of the norms stand on the diagonal until all others are done. */
        for (size_t k = 0; k < n * n; k++) {
            size_t i = k / n, j = k % n;

            if (i != j) {
                pairs[k] = sqrt(fmax(0.0, pairs[i * n + i] + pairs[j * n + j] - 2.0 * pairs[k]));
            }
        }
        for (size_t i = 0; i < n; i++) {
            pairs[i * n + i] = 0.0;
        }
    }
    return t->out->pairs ? SRNF_OK : SRNF_ENOMEM;
}

static int train(const struct srnf_sht *sht, struct training *t, const double *const *surfaces,
                 const struct srnf_context *context, struct srnf_error *error)
{
    struct stats_part progress = {.whole = context, .all = 1.0};
    struct srnf_folds joint = {0};
    struct srnf_context own;
    int status;

    t->parts = srnf_alloc(t->options->n_parts, sizeof *t->parts);
    t->sum.parts = t->parts;
    status = t->parts ? compare_parts(sht, t, surfaces, &progress, error) : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        own = stats_part_enter(&progress, 1.0 - COST_COMPARISON);
        status = join_parts(t, &own, &joint, error);
        status = status ? status : take_templates(sht, t, surfaces);
        status = status ? status : take_pairs(t);
        status = status ? status : validate(t, &own, error);
        own.progress = NULL;
        status = status ? status : fit_components(t, srnf_sht_grid(sht), &own);
        status = status ? status : freeze(t, &own, error);
    }
    srnf_folds_clear(&joint);
    for (size_t p = 0; t->parts && p < t->options->n_parts; p++) {
        srnf_folds_clear(&t->parts[p]);
    }
    srnf_free(t->parts);
    return status;
}

int srnf_train(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
               const size_t *labels, size_t n_classes, const struct srnf_train_options *options,
               const struct srnf_context *context, struct srnf_trained *trained,
               struct srnf_error *error)
{
    struct srnf_train_options defaults = srnf_train_options_defaults();
    struct srnf_trained out = {.n = n};
    struct srnf_error first = {0};
    struct training t = {.n = n, .classes = n_classes, .labels = labels, .out = &out};
    double *priors = NULL;
    size_t *counts = NULL;
    int status;

    t.options = options ? options : &defaults;
    out.n_parts = t.options->n_parts;
    t.classifier = srnf_classify_options_defaults();
    t.classifier.components = t.options->components;
    t.classifier.relabellings = t.options->relabellings;
    t.classifier.covariance = t.options->covariance;
    t.classifier.features = t.options->features;
    t.classifier.n_features = t.options->n_features;
    t.classifier.size_weight = t.options->feature_weight;
    t.components = t.options->components > COMPONENTS ? t.options->components : COMPONENTS;
    status = check(n, labels, n_classes, t.options, &first);
    status = status ? status : check_parts(t.options, n, t.weights, &t.sum, &first);
    status = status ? status : subjects_open(&t.subjects, n, t.options->subjects, &first);
    status = status ? status : check_labels(&t, &first);
    if (status == SRNF_OK) {
        counts = srnf_alloc(n_classes, sizeof *counts);
        t.priors = priors = srnf_alloc(n_classes, sizeof *priors);
        status = counts && priors ? count_classes(&t, counts, priors, &first) : SRNF_ENOMEM;
    }
    status = status ? status : check_components(&t, counts, &first);
    status = status ? status : train(sht, &t, surfaces, context, &first);
    subjects_clear(&t.subjects);
    srnf_free(counts);
    srnf_free(priors);
    if (status) {
        srnf_trained_clear(&out);
        return stats_fail(error, status, &first);
    }
    *trained = out;
    return SRNF_OK;
}

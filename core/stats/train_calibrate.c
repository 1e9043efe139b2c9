/*
 * train_calibrate.c - the calibration of a fold (train.h): evidence for its training members from
 * classifiers that have not seen them. For the Gaussians the fold's training subjects are dealt
 * into ten groups, class by class in the order of the cohort, and each group gets its evidence from
 * mean, components, their number and Gaussians of the other nine, all from the inner products of
 * the fields registered to the fold's template. Nearest neighbours are not fitted: there each
 * subject is left out by itself, also of what numbers beside shape are scaled by
 * (frozen_nearest.c).
 */
#include "train.h"

#include <string.h>

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
size_t train_class_of(const struct training *t, size_t subject)
{
    return t->labels[t->subjects.members[t->subjects.start[subject]]];
}

/* Deals the subjects but one, class by class in order, into groups: the one has no part in it. */
static void deal(const struct training *t, size_t left_out, size_t *group)
{
    size_t dealt = 0;

    for (size_t c = 0; c < t->classes; c++) {
        for (size_t s = 0; s < t->subjects.count; s++) {
            if (s != left_out && train_class_of(t, s) == c) {
                group[s] = dealt++ % TRAIN_GROUPS;
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
    size_t out = TRAIN_NOBODY;
    double spread;
    int status;

    for (size_t i = 0; i < t->n; i++) {
        size_t own = t->subjects.of[i];

        inner->given[i] = t->subjects.members[t->subjects.start[own]];
        if (is_out(inner, own, left_out, group)) {
            out = out == TRAIN_NOBODY ? inner->given[i] : out;
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
    for (size_t g = 0; g < TRAIN_GROUPS && status == SRNF_OK; g++) {
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

struct frozen_numbers train_numbers(const struct training *t)
{
    return (struct frozen_numbers){t->options->n_features, t->options->features,
                                   t->options->feature_weight};
}

/* The calibration of the fold that leaves a subject out, or of all. */
int train_calibrate(const struct training *t, const double *products, size_t left_out,
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
        const struct frozen_numbers numbers = train_numbers(t);

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

/*
 * relabel.c - how far members that are left out of each other depend on each other: what is found
 * where labels say nothing (srnf/classify.h, struct srnf_dispersions).
 */
#include "classify.h"

#include <math.h>
#include <string.h>

#define SEED UINT64_C(0x72656c6162656c) /* of these relabellings alone */

void dispersions_clear(struct srnf_dispersions *d)
{
    srnf_free(d->sensitivity);
    *d = (struct srnf_dispersions){0};
}

struct relabelling {
    const struct study *study;
    const size_t *labels; /* [subjects] */
    double *found;        /* [relabellings][1 + 3 classes]: accuracy, shares of each class that are
                             told, areas, and shares of the answers */
    bool *done;           /* [relabellings] */
};

static size_t count_of(const struct study *study)
{
    return 1 + 3 * study->n_classes;
}

/* lead: [n] of scratch. */
static void measure(const struct study *study, const size_t *labels, const struct outcome *outcome,
                    double *lead, double *found)
{
    size_t n = study->comparison->n, k = study->n_classes;

    for (size_t c = 0; c < k; c++) {
        double members = 0.0, told = 0.0, answers = 0.0;

        for (size_t i = 0; i < n; i++) {
            members += labels[i] == c;
            told += labels[i] == c && outcome->predicted[i] == c;
            answers += outcome->predicted[i] == c;
        }
        assess_leads(n, k, outcome->evidence, c, lead);
        found[0] += told / (double)n;
        found[1 + c] = told / members;
        found[1 + k + c] = assess_auc(n, labels, c, lead);
        found[1 + 2 * k + c] = answers / (double)n;
    }
}

static int open_outcome(const struct study *study, struct outcome *outcome)
{
    size_t n = study->comparison->n;

    outcome->predicted = srnf_alloc(3 * n, sizeof(size_t));
    outcome->evidence = srnf_alloc(n, (study->n_classes + 1) * sizeof(double));
    outcome->pooled = srnf_alloc(n, sizeof(bool));
    if (!outcome->predicted || !outcome->evidence || !outcome->pooled) {
        return SRNF_ENOMEM;
    }
    outcome->components = outcome->predicted + n;
    return SRNF_OK;
}

static int relabel_body(void *argument, size_t index, const struct srnf_context *context,
                        struct srnf_error *error)
{
    const struct relabelling *r = argument;
    const struct subjects *subjects = &r->study->subjects;
    size_t n = r->study->comparison->n;
    size_t *source = srnf_alloc(n, sizeof *source);
    struct outcome outcome = {0};
    int status = source ? open_outcome(r->study, &outcome) : SRNF_ENOMEM;

    (void)context;
    if (status == SRNF_OK) {
        size_t *labels = outcome.predicted + 2 * n;

        srnf_permutation(SEED, index, subjects->count, source);
        for (size_t i = 0; i < n; i++) {
            labels[i] = r->labels[source[subjects->of[i]]];
        }
        status = r->study->predict(r->study, labels, &outcome, error);
        if (status == SRNF_OK) {
            measure(r->study, labels, &outcome, outcome.evidence + n * r->study->n_classes,
                    r->found + index * count_of(r->study));
            r->done[index] = true;
        }
    }
    srnf_free(source);
    srnf_free(outcome.predicted);
    srnf_free(outcome.evidence);
    srnf_free(outcome.pooled);
    /* Labels for which a covariance is singular tell nothing of the others. */
    return status == SRNF_ENUMERIC ? SRNF_OK : status;
}

/* Of one result: `reference` what is expected of it, `variance` that of independent members. */
static struct srnf_dispersion disperse(const struct relabelling *r, size_t at, double reference,
                                       double variance)
{
    double squares[2] = {0.0, 0.0}; /* below, above */
    double half[2] = {0.0, 0.0};
    struct srnf_dispersion d;

    for (size_t b = 0; b < r->study->options->relabellings; b++) {
        double deviation = r->found[b * count_of(r->study) + at] - reference;

        if (r->done[b]) {
            squares[deviation > 0.0] += deviation * deviation;
            half[deviation > 0.0] += 1.0;
        }
    }
    /* By the mean over a half of all, or over those of that side where they are fewer. */
    for (size_t k = 0; k < 2; k++) {
        double count = fmin(half[k], 0.5 * (half[0] + half[1]));

        squares[k] = variance > 0.0 && count > 0.0 ? squares[k] / count / variance : 1.0;
    }
    d.below = fmax(1.0, squares[0]);
    d.above = fmax(1.0, squares[1]);
    return d;
}

/* The mean of a result over relabellings. */
static double mean_of(const struct relabelling *r, size_t at)
{
    double sum = 0.0, count = 0.0;

    for (size_t b = 0; b < r->study->options->relabellings; b++) {
        sum += r->done[b] ? r->found[b * count_of(r->study) + at] : 0.0;
        count += r->done[b] ? 1.0 : 0.0;
    }
    return sum / count;
}

/* The first sensitivity becomes the mean of all, as the balanced accuracy, once they are done. */
static void disperse_all(struct relabelling *r, struct srnf_dispersions *out)
{
    const struct subjects *s = &r->study->subjects;
    size_t k = r->study->n_classes, n = s->n, each = count_of(r->study);
    double expected = 0.0, variance = 0.0;

    for (size_t c = 0; c < k; c++) {
        double answers = mean_of(r, 1 + 2 * k + c);
        double members = 0.0, own = 0.0;

        for (size_t i = 0; i < n; i++) {
            members += r->labels[s->of[i]] == c;
        }
        for (size_t i = 0; i < s->count; i++) {
            own += r->labels[i] == c;
        }
        expected += members / (double)n * answers;
        variance += answers * (1.0 - answers) / members / (double)(k * k);
        out->sensitivity[c] = disperse(r, 1 + c, answers, answers * (1.0 - answers) / members);
        out->auc[c] =
            disperse(r, 1 + k + c, 0.5, assess_auc_variance(0.5, own, (double)s->count - own));
    }
    out->accuracy = disperse(r, 0, expected, expected * (1.0 - expected) / (double)n);
    for (size_t b = 0; b < r->study->options->relabellings; b++) {
        double *found = r->found + b * each;

        for (size_t c = 1; c < k; c++) {
            found[1] += found[1 + c];
        }
        found[1] /= (double)k;
    }
    out->balanced = disperse(r, 1, 1.0 / (double)k, variance);
}

double study_relabelling_part(const struct study *study)
{
    const struct srnf_classify_options *o = study->options;
    double all = (double)o->relabellings + (double)o->permutations;

    return o->relabellings > 0 ? (double)o->relabellings / all : 0.0;
}

static int relabel(struct relabelling *r, const struct srnf_context *context,
                   struct srnf_dispersions *out, struct srnf_error *error)
{
    const struct stats_progress progress = {0.0, study_relabelling_part(r->study), "relabelling"};
    int status;

    r->found = srnf_alloc(r->study->options->relabellings, count_of(r->study) * sizeof(double));
    r->done = srnf_alloc(r->study->options->relabellings, sizeof *r->done);
    status = r->found && r->done ? stats_run(context, r->study->options->relabellings, relabel_body,
                                             r, progress, error)
                                 : SRNF_ENOMEM;
    for (size_t b = 0; b < r->study->options->relabellings && status == SRNF_OK; b++) {
        out->relabellings += r->done[b];
    }
    if (out->relabellings > 0) {
        disperse_all(r, out);
    }
    srnf_free(r->found);
    srnf_free(r->done);
    return status;
}

int study_disperse(const struct study *study, const size_t *labels,
                   const struct srnf_context *context, struct srnf_dispersions *out,
                   struct srnf_error *error)
{
    const struct srnf_dispersion none = {1.0, 1.0};
    size_t *own = srnf_alloc(study->subjects.count, sizeof *own);
    struct relabelling r = {.study = study, .labels = own};
    int status = SRNF_OK;

    *out = (struct srnf_dispersions){.accuracy = none, .balanced = none};
    out->sensitivity = srnf_alloc(2 * study->n_classes, sizeof *out->sensitivity);
    if (!own || !out->sensitivity) {
        srnf_free(own);
        return SRNF_ENOMEM;
    }
    out->auc = out->sensitivity + study->n_classes;
    for (size_t c = 0; c < study->n_classes; c++) {
        out->sensitivity[c] = out->auc[c] = none;
    }
    if (study->options->relabellings > 0 && subjects_labels(&study->subjects, labels, own)) {
        status = relabel(&r, context, out, error);
    }
    srnf_free(own);
    return status;
}

/*
 * assess.c - what predictions are worth: accuracies, areas under curves, and how far probabilities
 * can be believed. Formulae and sources stand in srnf/train.h.
 */
#include "classify.h"

#include <math.h>
#include <string.h>

#define NORMAL_975 1.959963984540054
#define BISECTIONS 100

void srnf_assessment_clear(struct srnf_assessment *a)
{
    srnf_free(a->predicted);
    srnf_free(a->confusion);
    srnf_free(a->sensitivity);
    srnf_free(a->auc);
    srnf_free(a->reliability);
    *a = (struct srnf_assessment){0};
}

/* ---- Areas under curves ---------------------------------------------------------------------- */

double assess_auc_variance(double a, double positives, double negatives)
{
    double h = 0.5 * (positives + negatives) - 1.0;

    return fmax(0.0, a * (1.0 - a) * (1.0 + h * (1.0 - a) / (2.0 - a) + h * a / (1.0 + a)) /
                         (positives * negatives));
}

/* The end of the interval between auc, which is inside, and an end of [0, 1]; dispersion: by which
   the variance is larger. */
static double auc_bound(double auc, double end, const double sides[2], double dispersion)
{
    double inside = auc;

    for (int i = 0; i < BISECTIONS; i++) {
        double middle = 0.5 * (inside + end);

        double variance = dispersion * assess_auc_variance(middle, sides[0], sides[1]);

        if (fabs(auc - middle) <= NORMAL_975 * sqrt(variance)) {
            inside = middle;
        } else {
            end = middle;
        }
    }
    return inside;
}

void srnf_auc_interval(double auc, double positives, double negatives, double interval[2])
{
    const double sides[2] = {positives, negatives};

    interval[0] = auc_bound(auc, 0.0, sides, 1.0);
    interval[1] = auc_bound(auc, 1.0, sides, 1.0);
}

void assess_leads(size_t n, size_t classes, const double *evidence, size_t c, double *lead)
{
    for (size_t i = 0; i < n; i++) {
        const double *s = evidence + i * classes;
        double others = -INFINITY;

        for (size_t d = 0; d < classes; d++) {
            others = d == c ? others : fmax(others, s[d]);
        }
        lead[i] = s[c] - others;
    }
}

double assess_auc(size_t n, const size_t *labels, size_t c, const double *lead)
{
    double sum = 0.0;
    double pairs = 0.0;

    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; labels[i] == c && j < n; j++) {
            if (labels[j] != c) {
                sum += lead[i] > lead[j] ? 1.0 : lead[i] == lead[j] ? 0.5 : 0.0;
                pairs += 1.0;
            }
        }
    }
    return sum / pairs;
}

/* ---- One class ------------------------------------------------------------------------------- */

struct given {
    size_t n, classes;
    const size_t *labels;
    const struct subjects *subjects;
    const double *evidence, *probabilities, *priors; /* the last two: NULL without */
    const struct srnf_dispersions *dispersions;      /* or NULL */
};

static const struct srnf_dispersion independent = {1.0, 1.0};

/* Of a share of n members, worth `count` as independent ones; returns what they are worth with the
   dispersion, too. */
static double bound_rate(struct srnf_rate *rate, size_t n, double count,
                         const struct srnf_dispersion *dispersion)
{
    double above = fmin(count, (double)n / dispersion->above);
    double below = fmin(count, (double)n / dispersion->below);
    double ends[2];

    subjects_wilson(rate->value, above, ends);
    rate->interval[0] = ends[0];
    subjects_wilson(rate->value, below, ends);
    rate->interval[1] = ends[1];
    return fmin(above, below);
}

/* Subjects with members of the class, and with others; seen: [subjects] of scratch. */
static void count_sides(const struct given *g, size_t c, bool *seen, double sides[2])
{
    for (size_t side = 0; side < 2; side++) {
        memset(seen, 0, g->subjects->count * sizeof *seen);
        sides[side] = 0.0;
        for (size_t i = 0; i < g->n; i++) {
            size_t s = g->subjects->of[i];

            if ((g->labels[i] == c) == (side == 0) && !seen[s]) {
                seen[s] = true;
                sides[side] += 1.0;
            }
        }
    }
}

/* lead: [n], seen: [subjects] of scratch. */
static void measure_auc(const struct given *g, size_t c, double *lead, bool *seen,
                        struct srnf_rate *auc)
{
    const struct srnf_dispersion *d = g->dispersions ? &g->dispersions->auc[c] : &independent;
    double sides[2];

    assess_leads(g->n, g->classes, g->evidence, c, lead);
    auc->value = assess_auc(g->n, g->labels, c, lead);
    count_sides(g, c, seen, sides);
    auc->interval[0] = auc_bound(auc->value, 0.0, sides, d->above);
    auc->interval[1] = auc_bound(auc->value, 1.0, sides, d->below);
}

/* The share of a class that is told. memory: [n] of scratch; squares: those of the lengths to both
   sides, without a dispersion, are added. */
static int measure_sensitivity(const struct given *g, size_t c, const size_t *predicted,
                               size_t *memory, bool *right, struct srnf_rate *rate,
                               double squares[2])
{
    const struct srnf_dispersion *d =
        g->dispersions ? &g->dispersions->sensitivity[c] : &independent;
    size_t count = 0, told = 0;
    double effective;
    int status;

    for (size_t i = 0; i < g->n; i++) {
        if (g->labels[i] == c) {
            size_t first = i;

            for (size_t j = 0; j < i; j++) {
                if (g->labels[j] == c && g->subjects->of[j] == g->subjects->of[i]) {
                    first = j < first ? j : first;
                }
            }
            right[count] = predicted[i] == c;
            memory[count++] = first;
        }
    }
    /* Numbers of subjects must be below the count: those of their first members, in order. */
    for (size_t i = 0; i < count; i++) {
        size_t rank = 0;

        for (size_t j = 0; j < g->n && j < memory[i]; j++) {
            rank += g->labels[j] == c;
        }
        memory[g->n + i] = rank;
    }
    status = srnf_cluster_interval(count, memory + g->n, right, &effective, rate->interval, NULL);
    for (size_t i = 0; i < count; i++) {
        told += right[i];
    }
    rate->value = (double)told / (double)count; /* a sum of shares may exceed 1 */
    squares[0] += (rate->value - rate->interval[0]) * (rate->value - rate->interval[0]);
    squares[1] += (rate->interval[1] - rate->value) * (rate->interval[1] - rate->value);
    if (status == SRNF_OK && g->dispersions) {
        (void)bound_rate(rate, count, effective, d);
    }
    return status;
}

static void measure_reliability(const struct given *g, size_t c, struct srnf_reliability *bins)
{
    for (size_t i = 0; i < g->n; i++) {
        double p = g->probabilities[i * g->classes + c];
        size_t at = (size_t)(p * SRNF_RELIABILITY_BINS);
        struct srnf_reliability *bin =
            &bins[at < SRNF_RELIABILITY_BINS ? at : SRNF_RELIABILITY_BINS - 1];

        bin->members++;
        bin->of_class += g->labels[i] == c;
        bin->mean += p;
    }
    for (size_t b = 0; b < SRNF_RELIABILITY_BINS; b++) {
        struct srnf_reliability *bin = &bins[b];

        srnf_wilson_interval(bin->of_class, bin->members, bin->interval);
        if (bin->members > 0) {
            bin->mean /= (double)bin->members;
            bin->observed = (double)bin->of_class / (double)bin->members;
        }
    }
}

/* ---- Scores ---------------------------------------------------------------------------------- */

/* Half the squared distance of the probabilities of a member from its label, or from the priors. */
static double brier_of(const struct given *g, const double *p, size_t label)
{
    double sum = 0.0;

    for (size_t c = 0; c < g->classes; c++) {
        double own = c == label ? 1.0 : 0.0;

        sum += 0.5 * (p[c] - own) * (p[c] - own);
    }
    return sum;
}

/* Whether the members of some class are all of one subject. */
static bool has_lone_class(const struct given *g)
{
    for (size_t c = 0; c < g->classes; c++) {
        size_t first = g->n;
        bool lone = true;

        for (size_t i = 0; i < g->n && lone; i++) {
            if (g->labels[i] == c) {
                first = first < g->n ? first : i;
                lone = g->subjects->of[i] == g->subjects->of[first];
            }
        }
        if (lone) {
            return true;
        }
    }
    return false;
}

/* The interval of the sum over members of weight times score, from what subjects add about the mean
   of their class: one subject does not say how its class varies. weights: [classes], a member has
   its class's over `sizes`; scores: [n]; memory:
   [subjects + classes] of scratch. */
static void bound_score(const struct given *g, const double *weights, const size_t *sizes,
                        const double *scores, double value, double *memory, double interval[2])
{
    const struct srnf_dispersion *d = g->dispersions ? &g->dispersions->accuracy : &independent;
    size_t count = g->subjects->count;
    double *means = memory + count;
    double sum = 0.0, freedom;

    memset(memory, 0, (count + g->classes) * sizeof *memory);
    for (size_t i = 0; i < g->n; i++) {
        means[g->labels[i]] += scores[i] / (double)sizes[g->labels[i]];
    }
    for (size_t i = 0; i < g->n; i++) {
        size_t label = g->labels[i];

        memory[g->subjects->of[i]] +=
            weights[label] / (double)sizes[label] * (scores[i] - means[label]);
    }
    for (size_t s = 0; s < count; s++) {
        sum += memory[s] * memory[s];
    }
    freedom = count > g->classes ? (double)(count - g->classes) : 1.0;
    sum = sqrt(sum * (double)count / freedom * fmax(d->above, d->below));
    sum = value > 0.0 ? subjects_student(freedom) * sum / value : 0.0;
    sum = isfinite(value) && !has_lone_class(g) ? sum : (double)NAN;
    interval[0] = value * exp(-sum);
    interval[1] = value * exp(sum);
}

/* Brier score and log loss, and those of the priors. weights, sizes: [classes], what all members of
   a class weigh together, and their number; memory: [n + subjects + classes] of scratch. */
static void measure_scores(const struct given *g, const double *weights, const size_t *sizes,
                           double *memory, struct srnf_scores *of)
{
    double *scores = memory + g->subjects->count + g->classes;

    for (size_t i = 0; i < g->n; i++) {
        size_t label = g->labels[i];
        double weight = weights[label] / (double)sizes[label];

        scores[i] = brier_of(g, g->probabilities + i * g->classes, label);
        of->brier += weight * scores[i];
        of->brier_reference += weight * brier_of(g, g->priors, label);
        of->log_loss_reference -= weight * log(g->priors[label]);
    }
    bound_score(g, weights, sizes, scores, of->brier, memory, of->brier_interval);
    of->brier_interval[1] = of->brier_interval[1] > 1.0 ? 1.0 : of->brier_interval[1];
    for (size_t i = 0; i < g->n; i++) {
        size_t label = g->labels[i];

        scores[i] = -log(g->probabilities[i * g->classes + label]);
        of->log_loss += weights[label] / (double)sizes[label] * scores[i];
    }
    bound_score(g, weights, sizes, scores, of->log_loss, memory, of->log_loss_interval);
}

/* ---- All of them ----------------------------------------------------------------------------- */

static void count_answers(const struct given *g, const size_t *predicted, size_t *sizes,
                          bool *right, struct srnf_assessment *a)
{
    size_t k = g->classes;

    for (size_t i = 0; i < g->n; i++) {
        a->predicted[i] = predicted
                              ? predicted[i]
                              : srnf_platt_choose(k, g->probabilities + i * k, g->evidence + i * k);
        a->confusion[g->labels[i] * k + a->predicted[i]]++;
        sizes[g->labels[i]]++;
        right[i] = a->predicted[i] == g->labels[i];
        a->correct += right[i];
    }
    a->accuracy.value = (double)a->correct / (double)g->n;
    for (size_t c = 0; c < k; c++) {
        double share = (double)sizes[c] / (double)g->n;

        a->chance += share * share;
        a->majority = fmax(a->majority, share);
    }
}

/* From the squares of the lengths to both sides, summed over classes. */
static void bound_balanced(const struct given *g, const double squares[2],
                           struct srnf_rate *balanced)
{
    const struct srnf_dispersion *d = g->dispersions ? &g->dispersions->balanced : &independent;
    double k = (double)g->classes;

    balanced->interval[0] = balanced->value - sqrt(squares[0] * d->above) / k;
    balanced->interval[1] = balanced->value + sqrt(squares[1] * d->below) / k;
    if (g->dispersions) {
        balanced->interval[0] = fmax(balanced->interval[0], 0.0);
        balanced->interval[1] = fmin(balanced->interval[1], 1.0);
    }
}

static int measure(const struct given *g, const size_t *predicted, size_t *memory, bool *flags,
                   double *lead, struct srnf_assessment *a)
{
    double squares[2] = {0.0, 0.0};
    double *shares = lead + 2 * g->n + g->classes;
    size_t *sizes = memory + 2 * g->n;
    int status;

    count_answers(g, predicted, sizes, flags, a);
    for (size_t c = 0; c < g->classes; c++) {
        if (sizes[c] == 0) {
            return SRNF_EINVAL;
        }
    }
    status = srnf_cluster_interval(g->n, g->subjects->of, flags, &a->effective,
                                   a->accuracy.interval, NULL);
    if (status == SRNF_OK && g->dispersions) {
        a->effective = bound_rate(&a->accuracy, g->n, a->effective, &g->dispersions->accuracy);
    }
    for (size_t c = 0; c < g->classes && status == SRNF_OK; c++) {
        struct srnf_rate *rate = &a->sensitivity[c];

        status = measure_sensitivity(g, c, a->predicted, memory, flags, rate, squares);
        a->balanced.value += rate->value;
        measure_auc(g, c, lead, flags, &a->auc[c]);
        if (g->probabilities) {
            measure_reliability(g, c, a->reliability + c * SRNF_RELIABILITY_BINS);
        }
    }
    a->balanced.value /= (double)g->classes;
    bound_balanced(g, squares, &a->balanced);
    if (g->probabilities) {
        for (size_t c = 0; c < g->classes; c++) {
            shares[c] = (double)sizes[c] / (double)g->n;
        }
        measure_scores(g, g->priors, sizes, lead, &a->scores);
        measure_scores(g, shares, sizes, lead, &a->unweighted);
    }
    return status;
}

static int check(const struct given *g)
{
    if (g->n < 2 || g->classes < 2 || g->classes > g->n) {
        return SRNF_EINVAL;
    }
    for (size_t i = 0; i < g->n; i++) {
        if (g->labels[i] >= g->classes) {
            return SRNF_EINVAL;
        }
    }
    for (size_t c = 0; g->priors && c < g->classes; c++) {
        if (!(g->priors[c] > 0.0)) {
            return SRNF_EINVAL;
        }
    }
    for (size_t i = 0; i < g->n * g->classes; i++) {
        if (!isfinite(g->evidence[i]) ||
            (g->probabilities && !(g->probabilities[i] >= 0.0 && g->probabilities[i] <= 1.0))) {
            return SRNF_EINVAL;
        }
    }
    return SRNF_OK;
}

/* given: without subjects, which are [n] or NULL. */
static int assess(struct given *g, const size_t *subjects, const size_t *predicted,
                  struct srnf_assessment *assessment)
{
    size_t n = g->n, classes = g->classes;
    struct subjects of = {0};
    struct srnf_assessment a = {.n = n, .classes = classes};
    size_t *memory = NULL;
    bool *flags = NULL;
    double *lead = NULL;
    int status = check(g);

    g->subjects = &of;
    status = status ? status : subjects_open(&of, n, subjects, NULL);
    if (status == SRNF_OK) {
        a.subjects = of.count;
        a.predicted = srnf_alloc(n, sizeof *a.predicted);
        a.confusion = srnf_alloc(classes * classes, sizeof *a.confusion);
        a.sensitivity = srnf_alloc(classes, sizeof *a.sensitivity);
        a.auc = srnf_alloc(classes, sizeof *a.auc);
        a.reliability = srnf_alloc(classes * SRNF_RELIABILITY_BINS, sizeof *a.reliability);
        memory = srnf_alloc(2 * n + classes, sizeof *memory);
        flags = srnf_alloc(n, sizeof *flags);
        lead = srnf_alloc(2 * (n + classes), sizeof *lead);
        status = a.predicted && a.confusion && a.sensitivity && a.auc && a.reliability && memory &&
                         flags && lead
                     ? measure(g, predicted, memory, flags, lead, &a)
                     : SRNF_ENOMEM;
    }
    subjects_clear(&of);
    srnf_free(memory);
    srnf_free(flags);
    srnf_free(lead);
    if (status) {
        srnf_assessment_clear(&a);
        return status;
    }
    *assessment = a;
    return SRNF_OK;
}

int assess_answers(size_t n, size_t classes, const size_t *labels, const size_t *subjects,
                   const double *evidence, const size_t *predicted,
                   const struct srnf_dispersions *dispersions, struct srnf_assessment *assessment)
{
    struct given g = {.n = n,
                      .classes = classes,
                      .labels = labels,
                      .evidence = evidence,
                      .dispersions = dispersions};

    return assess(&g, subjects, predicted, assessment);
}

int srnf_assess(size_t n, size_t classes, const size_t *labels, const size_t *subjects,
                const double *evidence, const double *probabilities, const double *priors,
                const struct srnf_dispersions *dispersions, struct srnf_assessment *assessment)
{
    struct given g = {.n = n,
                      .classes = classes,
                      .labels = labels,
                      .evidence = evidence,
                      .probabilities = probabilities,
                      .priors = priors,
                      .dispersions = dispersions};

    return assess(&g, subjects, NULL, assessment);
}

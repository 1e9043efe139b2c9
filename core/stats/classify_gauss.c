/*
 * classify_gauss.c - a normal distribution for each class on the first principal components, and
 * how many of them and which covariance: chosen inside the fold.
 *
 * Features are the log scale, if asked for, and then the scores, so that k components are the first
 * D = k (+ 1) features. With S the scatter matrix and f its degrees of freedom, and L L' = S, the
 * log-likelihood of x under N(m, S / f) with D features is
 *
 *   -1/2 [D log(2 pi / f) + 2 sum of log L_ii + f |z|^2],  z = L^-1 (x - m),
 *
 * and since the leading block of L is the factor of the leading block of S, one factorisation and
 * one substitution give it for every D at once, as running sums.
 *
 * Inner leave-one-out: without x of class c, n_c of them and a = n_c / (n_c - 1), the mean of c
 * moves so that x - m' = a (x - m), and S' = S - a u u', u = x - m_c. By Sherman and Morrison and
 * the determinant lemma, with z_u = L^-1 u and z = L^-1 (x - m_d') for any class d,
 *
 *   (x - m_d')' S'^-1 (x - m_d') = |z|^2 + a <z, z_u>^2 / (1 - a |z_u|^2),
 *   log det S' = log det S + log(1 - a |z_u|^2),
 *
 * running sums again. What is maximised is the sum over training subjects of the log posterior
 * probability of their own class, equal priors: a proper scoring rule, where counts of right
 * answers are too coarse to choose by.
 *
 * Cost of a fold: O(n C D^2) for C classes. Nothing is regularised: where subjects are too few for
 * a covariance it is not a candidate.
 */
#include "classify.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define LOG_2PI 1.83787706640934548356
#define PIVOT_FLOOR 1e-12 /* of the diagonal entry: less is rounding */
#define DOWNDATE_FLOOR 1e-9
#define KINDS 2
enum { POOLED, OWN };

struct fold {
    size_t n, left_out, classes, d, offset; /* d features, offset of them not components */
    const size_t *labels;
    double *memory;
    double *x;       /* [n][d] */
    double *count;   /* [classes] of the training subjects */
    double *mean;    /* [classes][d] */
    double *factor;  /* [classes + 1][d][d] lower factors; the last: pooled */
    size_t *rank;    /* [classes + 1] leading features with a factor */
    double *z, *z_u; /* [d] */
    double *table;   /* [KINDS][d][classes] log-likelihoods */
    double *score;   /* [KINDS][d] sums of log posteriors */
};

static int fold_create(struct fold *fold, const struct study *study)
{
    size_t n = study->comparison->n;
    size_t k =
        study->options->components ? study->options->components : study->comparison->components;
    size_t c = study->n_classes;
    size_t d;

    *fold = (struct fold){.n = n, .classes = c, .offset = study->options->log_scale != NULL};
    fold->d = d = k + fold->offset;
    fold->memory = srnf_alloc(n * d + c + c * d + (c + 1) * d * d + 2 * d + KINDS * d * (c + 1),
                              sizeof(double));
    fold->rank = srnf_alloc(c + 1, sizeof *fold->rank);
    if (!fold->memory || !fold->rank) {
        return SRNF_ENOMEM;
    }
    fold->x = fold->memory;
    fold->count = fold->x + n * d;
    fold->mean = fold->count + c;
    fold->factor = fold->mean + c * d;
    fold->z = fold->factor + (c + 1) * d * d;
    fold->z_u = fold->z + d;
    fold->table = fold->z_u + d;
    fold->score = fold->table + KINDS * d * c;
    return SRNF_OK;
}

static void fold_clear(struct fold *fold)
{
    srnf_free(fold->memory);
    srnf_free(fold->rank);
}

/* ---- Fitting --------------------------------------------------------------------------------- */

/* In place; returns how many leading rows have a factor. */
static size_t factorise(size_t d, double *a)
{
    for (size_t i = 0; i < d; i++) {
        double diagonal = a[i * d + i];

        for (size_t j = 0; j <= i; j++) {
            double sum = a[i * d + j];

            for (size_t k = 0; k < j; k++) {
                sum -= a[i * d + k] * a[j * d + k];
            }
            if (j < i) {
                a[i * d + j] = sum / a[j * d + j];
            } else if (sum > PIVOT_FLOOR * diagonal) {
                a[i * d + i] = sqrt(sum);
            } else {
                return i;
            }
        }
    }
    return d;
}

static void find_means(struct fold *fold)
{
    size_t d = fold->d;

    memset(fold->count, 0, fold->classes * sizeof(double));
    memset(fold->mean, 0, fold->classes * d * sizeof(double));
    for (size_t i = 0; i < fold->n; i++) {
        size_t c = fold->labels[i];

        if (i != fold->left_out) {
            fold->count[c] += 1.0;
            for (size_t k = 0; k < d; k++) {
                fold->mean[c * d + k] += fold->x[i * d + k];
            }
        }
    }
    for (size_t k = 0; k < fold->classes * d; k++) {
        fold->mean[k] /= fold->count[k / d];
    }
}

static void find_factors(struct fold *fold)
{
    size_t d = fold->d;
    double *pooled = fold->factor + fold->classes * d * d;

    memset(fold->factor, 0, (fold->classes + 1) * d * d * sizeof(double));
    for (size_t i = 0; i < fold->n; i++) {
        size_t c = fold->labels[i];
        const double *x = fold->x + i * d;
        const double *m = fold->mean + c * d;

        for (size_t k = 0; k < d && i != fold->left_out; k++) {
            for (size_t l = 0; l <= k; l++) {
                fold->factor[(c * d + k) * d + l] += (x[k] - m[k]) * (x[l] - m[l]);
            }
        }
    }
    for (size_t c = 0; c < fold->classes; c++) {
        for (size_t k = 0; k < d * d; k++) {
            pooled[k] += fold->factor[c * d * d + k];
        }
    }
    for (size_t c = 0; c <= fold->classes; c++) {
        fold->rank[c] = factorise(d, fold->factor + c * d * d);
    }
}

static void fit(struct fold *fold, const struct study *study, size_t left_out, const size_t *labels)
{
    size_t components = fold->d - fold->offset;
    size_t stride = study->comparison->components;
    const double *scores = study->comparison->scores + left_out * fold->n * stride;

    fold->left_out = left_out;
    fold->labels = labels;
    for (size_t i = 0; i < fold->n; i++) {
        double *x = fold->x + i * fold->d;

        if (fold->offset) {
            x[0] = study->options->log_scale[i];
        }
        memcpy(x + fold->offset, scores + i * stride, components * sizeof(double));
    }
    find_means(fold);
    find_factors(fold);
}

/* ---- Likelihoods of one subject for every number of features --------------------------------- */

/* z = factor^-1 (x - mean) scaled, as far as the factor goes. */
static void substitute(const struct fold *fold, size_t which, const double *x, const double *mean,
                       double scale, double *z)
{
    size_t d = fold->d;
    const double *l = fold->factor + which * d * d;

    for (size_t i = 0; i < fold->rank[which]; i++) {
        double sum = scale * (x[i] - mean[i]);

        for (size_t k = 0; k < i; k++) {
            sum -= l[i * d + k] * z[k];
        }
        z[i] = sum / l[i * d + i];
    }
}

/* Log-likelihoods of z for 1, 2, .. features into column c of the table. alpha > 0: the scatter is
   taken down by alpha u u', z_u belonging to u. */
static void likelihoods(struct fold *fold, size_t kind, size_t which, size_t c, double freedom,
                        double alpha)
{
    size_t d = fold->d;
    const double *l = fold->factor + which * d * d;
    double square = 0.0;
    double across = 0.0;
    double down = 0.0;
    double determinant = 0.0;

    for (size_t i = 0; i < d; i++) {
        double *out = &fold->table[(kind * d + i) * fold->classes + c];
        double left;
        double mahalanobis;

        *out = -INFINITY;
        if (i >= fold->rank[which] || !(freedom > (double)i)) {
            continue;
        }
        square += fold->z[i] * fold->z[i];
        determinant += 2.0 * log(l[i * d + i]);
        if (alpha > 0.0) {
            across += fold->z[i] * fold->z_u[i];
            down += fold->z_u[i] * fold->z_u[i];
        }
        left = 1.0 - alpha * down;
        if (left > DOWNDATE_FLOOR) {
            mahalanobis = freedom * (square + alpha * across * across / left);
            *out = -0.5 * ((double)(i + 1) * (LOG_2PI - log(freedom)) + determinant + log(left) +
                           mahalanobis);
        }
    }
}

/* Of the subject that was left out. */
static void judge(struct fold *fold)
{
    const double *x = fold->x + fold->left_out * fold->d;
    double training = (double)(fold->n - 1);

    for (size_t c = 0; c < fold->classes; c++) {
        const double *mean = fold->mean + c * fold->d;

        substitute(fold, fold->classes, x, mean, 1.0, fold->z);
        likelihoods(fold, POOLED, fold->classes, c, training - (double)fold->classes, 0.0);
        substitute(fold, c, x, mean, 1.0, fold->z);
        likelihoods(fold, OWN, c, c, fold->count[c] - 1.0, 0.0);
    }
}

/* Of training subject i, had it been left out too. */
static void judge_inner(struct fold *fold, size_t i)
{
    const double *x = fold->x + i * fold->d;
    size_t own = fold->labels[i];
    double alpha = fold->count[own] / (fold->count[own] - 1.0);
    double training = (double)(fold->n - 2);

    for (size_t c = 0; c < fold->classes; c++) {
        const double *mean = fold->mean + c * fold->d;
        double scale = c == own ? alpha : 1.0;

        substitute(fold, fold->classes, x, fold->mean + own * fold->d, 1.0, fold->z_u);
        substitute(fold, fold->classes, x, mean, scale, fold->z);
        likelihoods(fold, POOLED, fold->classes, c, training - (double)fold->classes, alpha);
        substitute(fold, c, x, mean, scale, fold->z);
        if (c == own) {
            substitute(fold, c, x, mean, 1.0, fold->z_u);
        }
        likelihoods(fold, OWN, c, c, fold->count[c] - (c == own ? 2.0 : 1.0),
                    c == own ? alpha : 0.0);
    }
}

/* ---- Choosing -------------------------------------------------------------------------------- */

/* log of the posterior probability of class c, equal priors; -INFINITY where one is not defined. */
static double log_posterior(size_t classes, const double *likelihood, size_t c)
{
    double largest = -INFINITY;
    double sum = 0.0;

    for (size_t k = 0; k < classes; k++) {
        if (!(likelihood[k] > -INFINITY)) {
            return -INFINITY;
        }
        largest = fmax(largest, likelihood[k]);
    }
    for (size_t k = 0; k < classes; k++) {
        sum += exp(likelihood[k] - largest);
    }
    return likelihood[c] - largest - log(sum);
}

static void score_inner(struct fold *fold)
{
    memset(fold->score, 0, KINDS * fold->d * sizeof(double));
    for (size_t i = 0; i < fold->n; i++) {
        if (i == fold->left_out) {
            continue;
        }
        judge_inner(fold, i);
        for (size_t m = 0; m < KINDS * fold->d; m++) {
            fold->score[m] +=
                log_posterior(fold->classes, fold->table + m * fold->classes, fold->labels[i]);
        }
    }
}

struct choice {
    size_t kind, features;
};

/* Every candidate in order of features; the first of the best stays. */
static struct choice choose(struct fold *fold, const struct srnf_classify_options *options)
{
    size_t least = options->components ? fold->d : fold->offset + 1;
    struct choice best = {options->covariance == SRNF_COVARIANCE_CLASS ? OWN : POOLED, least};
    double highest = -INFINITY;

    if (options->components && options->covariance != SRNF_COVARIANCE_AUTO) {
        return best;
    }
    score_inner(fold);
    for (size_t features = least; features <= fold->d; features++) {
        for (size_t kind = 0; kind < KINDS; kind++) {
            bool wanted = options->covariance == SRNF_COVARIANCE_AUTO ||
                          (kind == OWN) == (options->covariance == SRNF_COVARIANCE_CLASS);
            double score = fold->score[kind * fold->d + features - 1];

            if (wanted && score > highest) {
                highest = score;
                best = (struct choice){kind, features};
            }
        }
    }
    return best;
}

/* ---- All folds ------------------------------------------------------------------------------- */

static int predict_one(struct fold *fold, const struct study *study, const struct outcome *outcome,
                       struct srnf_error *error)
{
    struct choice choice = choose(fold, study->options);
    size_t i = fold->left_out;
    const double *likelihood;
    size_t best = 0;

    judge(fold);
    likelihood = fold->table + (choice.kind * fold->d + choice.features - 1) * fold->classes;
    for (size_t c = 0; c < fold->classes; c++) {
        if (!isfinite(likelihood[c])) {
            return srnf_fail(
                error, SRNF_ENUMERIC, (int64_t)i,
                "the covariance of %zu features is singular in the fold of subject %zu",
                choice.features, i);
        }
        best = likelihood[c] > likelihood[best] ? c : best;
    }
    outcome->predicted[i] = best;
    if (outcome->evidence) {
        memcpy(outcome->evidence + i * fold->classes, likelihood, fold->classes * sizeof(double));
        outcome->components[i] = choice.features - fold->offset;
        outcome->pooled[i] = choice.kind == POOLED;
    }
    return SRNF_OK;
}

static int predict(const struct study *study, const size_t *labels, const struct outcome *outcome,
                   struct srnf_error *error)
{
    struct fold fold;
    int status = fold_create(&fold, study);

    for (size_t i = 0; i < study->comparison->n && status == SRNF_OK; i++) {
        fit(&fold, study, i, labels);
        status = predict_one(&fold, study, outcome, error);
    }
    fold_clear(&fold);
    return status;
}

/* Components that were asked for must be there, and determined by the training subjects. */
static int check_components(const struct study *study, size_t smallest, struct srnf_error *error)
{
    const struct srnf_folds *c = study->comparison;
    size_t features = study->options->components + (study->options->log_scale != NULL);
    bool own = study->options->covariance == SRNF_COVARIANCE_CLASS;
    /* degrees of freedom, where the one left out is of the class or not */
    size_t freedom = own                           ? smallest - 2
                     : c->n > study->n_classes + 1 ? c->n - 1 - study->n_classes
                                                   : 0;

    if (!c->scores) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "the comparison has no scores: its metric registers nothing");
    }
    if (study->options->components > c->components) {
        return srnf_fail(error, SRNF_EINVAL, -1, "components is %zu, and there are %zu",
                         study->options->components, c->components);
    }
    if ((study->options->components ? features : features + 1) > freedom) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "%zu features are more than the training subjects determine: %zu",
                         study->options->components ? features : features + 1, freedom);
    }
    return SRNF_OK;
}

int srnf_classify_gauss(const struct srnf_folds *comparison, const size_t *labels, size_t n_classes,
                        const struct srnf_classify_options *options,
                        const struct srnf_context *context, struct srnf_classification *result,
                        struct srnf_error *error)
{
    struct srnf_classify_options defaults = srnf_classify_options_defaults();
    struct study study = {.comparison = comparison,
                          .options = options ? options : &defaults,
                          .n_classes = n_classes,
                          .predict = predict};
    size_t smallest = 0;
    int status;

    *result = (struct srnf_classification){0};
    status = study_check(comparison, labels, n_classes, study.options, &smallest, error);
    status = status ? status : check_components(&study, smallest, error);
    return status ? status : study_assess(&study, labels, true, context, result, error);
}

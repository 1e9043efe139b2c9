/*
 * typicality.c - values of a surface against those of the members of a group; the rule stands at
 * srnf_typicality_of.
 *
 * Student's quantile t is that of D. Wallace, "Bounds on normal approximations to Student's and the
 * chi-square distributions", Ann. Math. Statist. 1959, solved for t: with z the normal quantile,
 *
 *     t = sqrt(nu (exp(((8 nu + 3) / (8 nu + 1) z)^2 / nu) - 1)).
 *
 * It is off by less than 1 % from 6 degrees of freedom on, and too wide below.
 *
 * Centre and scale are those of Huber's proposal 2 (P. Huber, "Robust estimation of a location
 * parameter", Ann. Math. Statist. 1964) as the Analytical Methods Committee computes them ("Robust
 * statistics - how not to reject outliers", Analyst 1989, algorithm A; ISO 13528): from median and
 * median deviation on, values further than 1.5 s from the centre are drawn in to there, and the
 * centre becomes their mean, s 1.134 times their standard deviation, until both rest. In normal
 * data s is worth .88 of a standard deviation's degrees of freedom; a median deviation is worth
 * .37. One value in five may be anywhere and the limit stays finite.
 *
 * What a comparison by folds knows of member i: with d_ij its distances, s its fold's rms distance
 * between two of the t training members and m their mean,
 *
 *     ||q_i - m||^2 = (1 / t) sum_j d_ij^2 - s^2 (t - 1) / (2 t),
 *
 * and its residual beyond the scores is what their squares leave of that.
 */
#include "stats.h"

#include "subjects.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MEMBERS_MIN 3 /* subjects of the references, if they have several members */
#define FOLD_MEMBERS_MIN 4
#define VARIANCE_SHARE 0.95
#define SUBJECTS_PER_COMPONENT 4
#define NORMAL_MAD 1.482602218505602 /* standard deviation over median deviation, normal data */
#define DRAWN_IN 1.5                 /* standard deviations, from where on values are drawn in */
#define NORMAL_DRAWN_IN 1.134 /* standard deviation over that of values drawn in, normal data */
#define ROUNDS 100
#define AT_REST 1e-10        /* change of the scale in a round, relative */
#define FREEDOM 0.88         /* degrees of it that the scale has for each subject but one */
#define CENTRE 1.05          /* variance of the centre, over that of a mean */
#define DEVIATION_LEAST 0.05 /* of a reference, relative */
#define ANGLE_LEAST (SRNF_PI / 180.0)
#define ROUNDING 1e-7 /* of a norm, that differences of its square leave */
#define BISECTIONS 60
#define WEIGHT_ROUNDING 1e-9 /* of a sum of weights */

/* ---- One value ------------------------------------------------------------------------------- */

static bool is_log(enum srnf_trait trait)
{
    return trait != SRNF_TRAIT_MAHALANOBIS && trait != SRNF_TRAIT_ANGLE;
}

static double transform(enum srnf_trait trait, double value)
{
    return is_log(trait) ? log(fmax(value, DBL_MIN)) : cbrt(value * value);
}

static double transform_back(enum srnf_trait trait, double value)
{
    return is_log(trait) ? exp(value) : value * sqrt(value);
}

/* z with the probability alpha above it. */
static double normal_quantile(double alpha)
{
    double low = 0.0;
    double high = 40.0;

    for (int i = 0; i < BISECTIONS; i++) {
        double z = 0.5 * (low + high);

        if (0.5 * erfc(z * sqrt(0.5)) > alpha) {
            low = z;
        } else {
            high = z;
        }
    }
    return 0.5 * (low + high);
}

static double student_quantile(double alpha, double freedom)
{
    double z = normal_quantile(alpha) * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);

    return sqrt(freedom * expm1(z * z / freedom));
}

struct weighted {
    double value, weight;
};

static int compare_weighted(const void *a, const void *b)
{
    const struct weighted *x = a;
    const struct weighted *y = b;

    return (x->value > y->value) - (x->value < y->value);
}

/* Where half of the weight, `all` in total, is below and half above; the middle where that is a
   whole interval. Orders the values. */
static double median(size_t n, double all, struct weighted *values)
{
    double low = 0.0;
    double sum = 0.0;
    bool half = false;

    qsort(values, n, sizeof *values, compare_weighted);
    for (size_t i = 0; i < n; i++) {
        sum += values[i].weight;
        if (!half && sum >= all * (0.5 - WEIGHT_ROUNDING)) {
            half = true;
            low = values[i].value;
        }
        if (sum > all * (0.5 + WEIGHT_ROUNDING)) {
            return 0.5 * (low + values[i].value);
        }
    }
    return low;
}

static double draw_in(double value, double most)
{
    return fmax(-most, fmin(most, value));
}

/* Centre and scale of the values, [2][n] with their weights, `count` in total; the second half is
   scratch. Orders them. */
static double find_centre(size_t n, double count, struct weighted *values, double *scale)
{
    struct weighted *deviations = values + n;
    double centre = median(n, count, values);
    double before = 0.0;

    for (size_t i = 0; i < n; i++) {
        deviations[i] = (struct weighted){fabs(values[i].value - centre), values[i].weight};
    }
    *scale = NORMAL_MAD * median(n, count, deviations);
    for (size_t round = 0; round < ROUNDS && fabs(*scale - before) > AT_REST * *scale; round++) {
        double most = DRAWN_IN * *scale;
        double mean = 0.0;
        double square = 0.0;

        for (size_t i = 0; i < n; i++) {
            mean += values[i].weight / count * draw_in(values[i].value - centre, most);
        }
        for (size_t i = 0; i < n; i++) {
            double d = draw_in(values[i].value - centre, most) - mean;

            square += values[i].weight * d * d;
        }
        before = *scale;
        centre += mean;
        *scale = NORMAL_DRAWN_IN * sqrt(square / (count - 1.0));
    }
    return centre;
}

/* The limit; count: of subjects; scratch: [2][n], the first with their
   weights */
static double find_limit(enum srnf_trait trait, size_t n, const double *values, double count,
                         double alpha, struct weighted *scratch)
{
    double t = student_quantile(alpha, fmax(1.0, FREEDOM * (count - 1.0)));
    double scale;
    double centre;
    double limit;

    for (size_t i = 0; i < n; i++) {
        scratch[i].value = transform(trait, values[i]);
    }
    centre = find_centre(n, count, scratch, &scale);
    scale = fmax(scale, DEVIATION_LEAST * (is_log(trait) ? 1.0 : centre));
    limit = transform_back(trait, centre + t * scale * sqrt(1.0 + CENTRE / count));
    return trait == SRNF_TRAIT_ANGLE ? fmax(limit, ANGLE_LEAST) : limit;
}

/* Sum of the weights, or NAN where one is none. */
static double sum_weights(size_t n, const double *weights)
{
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        double weight = weights ? weights[i] : 1.0;

        sum += weight > 0.0 && weight <= 1.0 ? weight : (double)NAN;
    }
    return sum;
}

int srnf_typicality_of(enum srnf_trait trait, size_t n, const double *values, const double *weights,
                       double value, double alpha, struct srnf_typicality *result)
{
    double count = sum_weights(n, weights);
    struct weighted *scratch;
    double below = 0.0;

    if (!(count >= MEMBERS_MIN * (1.0 - WEIGHT_ROUNDING)) || !(alpha > 0.0 && alpha < 0.5) ||
        !(value >= 0.0)) {
        return SRNF_EINVAL;
    }
    for (size_t i = 0; i < n; i++) {
        if (!(values[i] >= 0.0 && isfinite(values[i]))) {
            return SRNF_EINVAL;
        }
    }
    scratch = srnf_alloc(n, 2 * sizeof *scratch);
    if (!scratch) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < n; i++) {
        scratch[i].weight = weights ? weights[i] : 1.0;
        below += values[i] < value ? scratch[i].weight : 0.0;
    }
    result->value = value;
    result->limit = find_limit(trait, n, values, count, alpha, scratch);
    result->percentile = fmin(100.0 * below / count, 100.0);
    subjects_percentile(below, count, result->percentile_interval);
    result->far = value > result->limit;
    srnf_free(scratch);
    return SRNF_OK;
}

/* ---- Mahalanobis distances ------------------------------------------------------------------- */

size_t srnf_mahalanobis_components(size_t n, size_t components, const double *eigenvalues)
{
    size_t most = n > SUBJECTS_PER_COMPONENT ? (n - 1) / SUBJECTS_PER_COMPONENT : 1;
    size_t count = 0;
    double total = 0.0;
    double sum = 0.0;

    for (size_t k = 0; k < components; k++) {
        total += eigenvalues[k];
    }
    most = most < components ? most : components;
    while (count < most && sum < VARIANCE_SHARE * total) {
        sum += eigenvalues[count++];
    }
    return count;
}

double srnf_mahalanobis(size_t components, const double *eigenvalues, const double *scores)
{
    double sum = 0.0;

    for (size_t k = 0; k < components; k++) {
        sum += scores[k] * scores[k] / eigenvalues[k];
    }
    return sqrt(sum);
}

/* ---- Members of a comparison by folds -------------------------------------------------------- */

void srnf_folds_typicality_clear(struct srnf_folds_typicality *typicality)
{
    srnf_free(typicality->verdicts);
    *typicality = (struct srnf_folds_typicality){0};
}

/* Whether the fold of member i was fitted to member j. */
static bool is_training(const struct srnf_folds *c, size_t i, size_t j)
{
    return c->subjects ? c->subjects[i] != c->subjects[j] : i != j;
}

static double nearest_of(const struct srnf_folds *c, size_t i)
{
    double nearest = INFINITY;

    for (size_t j = 0; j < c->n; j++) {
        if (is_training(c, i, j)) {
            nearest = fmin(nearest, c->distances[i * c->n + j]);
        }
    }
    return nearest;
}

/* Variances of the training members' scores in the fold of member i; returns how many members. */
static size_t find_variances(const struct srnf_folds *c, size_t i, double *variances)
{
    const double *scores = c->scores + i * c->n * c->components;
    size_t training = 0;

    for (size_t k = 0; k < c->components; k++) {
        variances[k] = 0.0;
    }
    for (size_t j = 0; j < c->n; j++) {
        if (is_training(c, i, j)) {
            training++;
            for (size_t k = 0; k < c->components; k++) {
                double s = scores[j * c->components + k];

                variances[k] += s * s;
            }
        }
    }
    for (size_t k = 0; k < c->components; k++) {
        variances[k] /= (double)(training - 1);
    }
    return training;
}

/* values: [3][n], of which those of member i are set. variances: [components] scratch. */
static void describe(const struct srnf_folds *c, size_t i, double *variances, double *values)
{
    const double *scores = c->scores + (i * c->n + i) * c->components;
    size_t training = find_variances(c, i, variances);
    double count = (double)training;
    size_t used = srnf_mahalanobis_components(training, c->components, variances);
    double square = -c->spread[i] * c->spread[i] * (count - 1.0) / (2.0 * count);
    double rest;

    for (size_t j = 0; j < c->n; j++) {
        double d = c->distances[i * c->n + j];

        square += is_training(c, i, j) ? d * d / count : 0.0;
    }
    rest = square = fmax(square, 0.0);
    for (size_t k = 0; k < c->components; k++) {
        rest -= scores[k] * scores[k];
    }
    values[SRNF_TRAIT_RESIDUAL * c->n + i] = fmax(sqrt(fmax(rest, 0.0)), ROUNDING * c->spread[i]);
    values[SRNF_TRAIT_DISTANCE * c->n + i] = sqrt(square);
    values[SRNF_TRAIT_MAHALANOBIS * c->n + i] = srnf_mahalanobis(used, variances, scores);
}

/* 1 / m for each of the m members of a subject. */
static void set_weights(const struct srnf_folds *c, size_t *members, double *weights)
{
    for (size_t i = 0; i < c->n; i++) {
        members[c->subjects ? c->subjects[i] : i]++;
    }
    for (size_t i = 0; i < c->n; i++) {
        weights[i] = 1.0 / (double)members[c->subjects ? c->subjects[i] : i];
    }
}

/* A value of member i among those of the members of other subjects. others: [2][n] scratch. */
static int judge_one(const struct srnf_folds *c, enum srnf_trait trait, const double *row,
                     const double *weights, size_t i, double alpha, double *others,
                     struct srnf_typicality *verdict)
{
    size_t count = 0;
    double subjects = 0.0;

    for (size_t j = 0; j < c->n; j++) {
        if (is_training(c, i, j)) {
            others[count] = row[j];
            others[c->n + count++] = weights[j];
            subjects += weights[j];
        }
    }
    if (subjects < MEMBERS_MIN * (1.0 - WEIGHT_ROUNDING)) {
        *verdict = (struct srnf_typicality){
            .value = row[i], .limit = INFINITY, .percentile_interval = {0.0, 100.0}};
        return SRNF_OK;
    }
    return srnf_typicality_of(trait, count, others, others + c->n, row[i], alpha, verdict);
}

/* values: [traits][n]; scratch: [3][n] */
static int judge(const struct srnf_folds *c, const double *values, double alpha, double *scratch,
                 struct srnf_folds_typicality *out)
{
    size_t *members = srnf_alloc(c->n, sizeof *members);
    int status = members ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        set_weights(c, members, scratch);
    }
    for (size_t i = 0; i < c->n && status == SRNF_OK; i++) {
        for (size_t t = 0; t < out->traits && status == SRNF_OK; t++) {
            status = judge_one(c, out->trait[t], values + t * c->n, scratch, i, alpha,
                               scratch + c->n, &out->verdicts[i * out->traits + t]);
        }
    }
    srnf_free(members);
    return status;
}

int srnf_folds_typicality(const struct srnf_folds *c, double alpha,
                          struct srnf_folds_typicality *typicality)
{
    struct srnf_folds_typicality found = {.n = c->n, .traits = 1, .trait = {SRNF_TRAIT_NEAREST}};
    size_t n = c->n;
    double *values;
    int status = SRNF_ENOMEM;

    if (n < FOLD_MEMBERS_MIN) {
        return SRNF_EINVAL;
    }
    if (c->scores) {
        found.traits = 3;
        for (size_t t = 0; t < 3; t++) {
            found.trait[t] = (enum srnf_trait)t;
        }
    }
    found.verdicts = srnf_alloc(n, found.traits * sizeof *found.verdicts);
    values = srnf_alloc(6 * n + c->components, sizeof(double));
    if (found.verdicts && values) {
        for (size_t i = 0; i < n; i++) {
            if (c->scores) {
                describe(c, i, values + 6 * n, values);
            } else {
                values[i] = nearest_of(c, i);
            }
        }
        status = judge(c, values, alpha, values + 3 * n, &found);
    }
    srnf_free(values);
    if (status) {
        srnf_folds_typicality_clear(&found);
        return status;
    }
    *typicality = found;
    return SRNF_OK;
}

/*
 * platt.c - probabilities from evidence, by Platt scaling for any number of classes (srnf/train.h).
 *
 * What is minimized over a and b, with weights w_i and targets t_ic of sum 1, is
 *
 *     F = sum_i w_i [log sum_c exp(a s_ic + b_c) - sum_c t_ic (a s_ic + b_c)],
 *
 * convex; b_0 = 0. With x_ic the vector that has s_ic first and 1 at c, the gradient is
 * sum w (p_ic - t_ic) x_ic, and the Hessian sum w (sum_c p_ic x_ic x_ic' - m_i m_i'), m_i the mean
 * of x_ic under p_i. Evidence is divided by its rms first, so that both are of the order of 1. The
 * targets are short of 0 and 1, so F has a minimum even where classes are told apart without error.
 */
#include "stats.h"

#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

#define ITERATIONS 200
#define HALVINGS 60
#define GRADIENT 1e-11 /* of the sum of the weights */
#define RIDGE 1e-12    /* the same: added to the Hessian's diagonal */

struct platt {
    size_t n, classes;
    const double *evidence; /* [n][classes] scaled */
    const size_t *labels;
    const double *weights;     /* [n] */
    const double *own, *other; /* [classes] targets of the members of each */
    double total;              /* of the weights */
    double *p;                 /* [classes] scratch */
};

void srnf_platt_clear(struct srnf_platt *platt)
{
    srnf_free(platt->offsets);
    srnf_free(platt->targets);
    *platt = (struct srnf_platt){0};
}

/* p = softmax of log_p, in place; returns the log of the sum. */
static double softmax(size_t classes, double *p)
{
    double largest = -INFINITY;
    double sum = 0.0;

    for (size_t c = 0; c < classes; c++) {
        largest = fmax(largest, p[c]);
    }
    for (size_t c = 0; c < classes; c++) {
        p[c] = exp(p[c] - largest);
        sum += p[c];
    }
    for (size_t c = 0; c < classes; c++) {
        p[c] /= sum;
    }
    return largest + log(sum);
}

static double target(const struct platt *f, size_t i, size_t c)
{
    size_t label = f->labels[i];

    return c == label ? f->own[label] : f->other[label];
}

/* F; parameters: a, b_1, .. */
static double value(const struct platt *f, const double *parameters)
{
    double sum = 0.0;

    for (size_t i = 0; i < f->n; i++) {
        double along = 0.0;

        for (size_t c = 0; c < f->classes; c++) {
            f->p[c] =
                parameters[0] * f->evidence[i * f->classes + c] + (c > 0 ? parameters[c] : 0.0);
            along += target(f, i, c) * f->p[c];
        }
        sum += f->weights[i] * (softmax(f->classes, f->p) - along);
    }
    return sum;
}

/* Gradient, and the Hessian's lower triangle in column-major order. */
static void derivatives(const struct platt *f, const double *parameters, double *gradient,
                        double *hessian)
{
    size_t k = f->classes;

    memset(gradient, 0, k * sizeof(double));
    memset(hessian, 0, k * k * sizeof(double));
    for (size_t i = 0; i < f->n; i++) {
        const double *s = f->evidence + i * k;
        double mean = 0.0;
        double square = 0.0;
        double w = f->weights[i];

        for (size_t c = 0; c < k; c++) {
            f->p[c] = parameters[0] * s[c] + (c > 0 ? parameters[c] : 0.0);
        }
        (void)softmax(k, f->p);
        for (size_t c = 0; c < k; c++) {
            double off = w * (f->p[c] - target(f, i, c));

            mean += f->p[c] * s[c];
            square += f->p[c] * s[c] * s[c];
            gradient[0] += off * s[c];
            gradient[c] += c > 0 ? off : 0.0;
        }
        hessian[0] += w * (square - mean * mean);
        for (size_t c = 1; c < k; c++) {
            hessian[c] += w * f->p[c] * (s[c] - mean);
            for (size_t d = 1; d <= c; d++) {
                hessian[d * k + c] += w * f->p[c] * ((c == d ? 1.0 : 0.0) - f->p[d]);
            }
        }
    }
}

/* One step of Newton's with halving; false: no step makes F less. memory: [2 classes]. */
static bool take_step(const struct platt *f, double *parameters, const double *step, double *trial)
{
    double before = value(f, parameters);
    double length = 1.0;

    for (int i = 0; i < HALVINGS; i++, length *= 0.5) {
        for (size_t c = 0; c < f->classes; c++) {
            trial[c] = parameters[c] - length * step[c];
        }
        if (value(f, trial) < before) {
            memcpy(parameters, trial, f->classes * sizeof(double));
            return true;
        }
    }
    return false;
}

/* memory: [classes (classes + 2)] */
static int minimize(const struct platt *f, double *parameters, double *memory)
{
    size_t k = f->classes;
    double *gradient = memory;
    double *trial = memory + k;
    double *hessian = memory + 2 * k;

    for (int i = 0; i < ITERATIONS; i++) {
        double largest = 0.0;

        derivatives(f, parameters, gradient, hessian);
        for (size_t c = 0; c < k; c++) {
            largest = fmax(largest, fabs(gradient[c]));
            hessian[c * k + c] += RIDGE * f->total;
        }
        if (largest <= GRADIENT * f->total) {
            return SRNF_OK;
        }
        if (LAPACKE_dposv_work(LAPACK_COL_MAJOR, 'L', (lapack_int)k, 1, hessian, (lapack_int)k,
                               gradient, (lapack_int)k) != 0) {
            return SRNF_ENUMERIC;
        }
        if (!take_step(f, parameters, gradient, trial)) {
            return SRNF_OK; /* as near as rounding allows */
        }
    }
    return SRNF_ENUMERIC;
}

/* Weights of members, 1 / members of their subject, and of classes; scratch: [n] zeros. */
static int weigh(size_t n, const size_t *labels, const size_t *subjects, double *scratch,
                 double *weights, double *of_class)
{
    for (size_t i = 0; i < n && subjects; i++) {
        if (subjects[i] >= n) {
            return SRNF_EINVAL;
        }
        scratch[subjects[i]] += 1.0;
    }
    for (size_t i = 0; i < n; i++) {
        weights[i] = subjects ? 1.0 / scratch[subjects[i]] : 1.0;
        of_class[labels[i]] += weights[i];
    }
    return SRNF_OK;
}

/* Evidence about the mean of its member, over the rms of that; returns the rms. */
static double scale(size_t n, size_t classes, const double *evidence, double *scaled)
{
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        double mean = 0.0;

        for (size_t c = 0; c < classes; c++) {
            mean += evidence[i * classes + c] / (double)classes;
        }
        for (size_t c = 0; c < classes; c++) {
            scaled[i * classes + c] = evidence[i * classes + c] - mean;
            sum += scaled[i * classes + c] * scaled[i * classes + c];
        }
    }
    sum = sqrt(sum / (double)(n * classes));
    for (size_t i = 0; i < n * classes && sum > 0.0; i++) {
        scaled[i] /= sum;
    }
    return sum > 0.0 ? sum : 1.0;
}

static int check(size_t n, size_t classes, const double *evidence, const size_t *labels)
{
    if (n < 2 || classes < 2 || classes > n) {
        return SRNF_EINVAL;
    }
    for (size_t i = 0; i < n; i++) {
        if (labels[i] >= classes) {
            return SRNF_EINVAL;
        }
    }
    for (size_t i = 0; i < n * classes; i++) {
        if (!isfinite(evidence[i])) {
            return SRNF_EINVAL;
        }
    }
    return SRNF_OK;
}

/* Targets from the weights of the classes, and their mean. SRNF_EINVAL: a class is empty. */
static int set_targets(size_t classes, const double *of_class, double total, double *own,
                       double *other, double *mean)
{
    memset(mean, 0, classes * sizeof(double));
    for (size_t c = 0; c < classes; c++) {
        double all = of_class[c] + (double)classes;

        if (!(of_class[c] > 0.0)) {
            return SRNF_EINVAL;
        }
        own[c] = (of_class[c] + 1.0) / all;
        other[c] = 1.0 / all;
        for (size_t d = 0; d < classes; d++) {
            mean[d] += of_class[c] / total * (c == d ? own[c] : other[c]);
        }
    }
    return SRNF_OK;
}

int srnf_platt_fit(size_t n, size_t classes, const double *evidence, const size_t *labels,
                   const size_t *subjects, struct srnf_platt *platt)
{
    size_t k = classes;
    struct srnf_platt found = {.classes = classes};
    struct platt f = {.n = n, .classes = classes, .labels = labels};
    double *memory = NULL, *parameters, *of_class, *own, *other, *scaled, *weights;
    int status = check(n, classes, evidence, labels);

    if (status) {
        return status;
    }
    memory = srnf_alloc(n * k + 2 * n + 5 * k + k * (k + 2), sizeof(double));
    found.offsets = srnf_alloc(k, sizeof(double));
    found.targets = srnf_alloc(k, sizeof(double));
    if (!memory || !found.offsets || !found.targets) {
        status = SRNF_ENOMEM;
        goto out;
    }
    scaled = memory;
    weights = scaled + n * k;
    of_class = weights + 2 * n;
    own = of_class + k;
    other = own + k;
    parameters = other + k;
    f.p = parameters + k;
    f.evidence = scaled;
    f.weights = weights;
    f.own = own;
    f.other = other;
    status = weigh(n, labels, subjects, weights + n, weights, of_class);
    for (size_t c = 0; c < k; c++) {
        f.total += of_class[c];
    }
    status = status ? status : set_targets(k, of_class, f.total, own, other, found.targets);
    if (status == SRNF_OK) {
        double unit = scale(n, k, evidence, scaled);

        status = minimize(&f, parameters, f.p + k);
        found.slope = parameters[0] / unit;
    }
    for (size_t c = 0; c < k && status == SRNF_OK; c++) {
        found.offsets[c] = c > 0 ? parameters[c] : 0.0;
    }
    if (status == SRNF_OK && !(found.slope > 0.0)) {
        found.slope = 0.0;
        for (size_t c = 0; c < k; c++) {
            found.offsets[c] = log(found.targets[c] / found.targets[0]);
        }
    }
out:
    srnf_free(memory);
    if (status) {
        srnf_platt_clear(&found);
        return status;
    }
    *platt = found;
    return SRNF_OK;
}

void srnf_platt_apply(const struct srnf_platt *platt, const double *priors, const double *evidence,
                      double *probabilities)
{
    double largest = -INFINITY;

    for (size_t c = 0; c < platt->classes; c++) {
        largest = fmax(largest, evidence[c]);
    }
    for (size_t c = 0; c < platt->classes; c++) {
        double shortfall = platt->slope > 0.0 ? platt->slope * (evidence[c] - largest) : 0.0;

        probabilities[c] = shortfall + platt->offsets[c] + log(priors[c] / platt->targets[c]);
    }
    (void)softmax(platt->classes, probabilities);
}

size_t srnf_platt_choose(size_t classes, const double *probabilities, const double *evidence)
{
    size_t best = 0;

    for (size_t c = 1; c < classes; c++) {
        /* Equal but for rounding: the evidence decides. */
        double more = probabilities[c] - probabilities[best];

        if (more > 4.0 * DBL_EPSILON ||
            (more >= -4.0 * DBL_EPSILON && evidence[c] > evidence[best])) {
            best = c;
        }
    }
    return best;
}

/*
 * intervals.c - how far lengths and variances of a linear model are known.
 *
 * The norm of an estimated field b = sum of c_i y_i is too large: with C the covariance of b,
 * E |b|^2 = |beta|^2 + tr C, so that a field of noise alone has a norm, too. Samples of residuals
 * add tr C once more, and vary about a square that is too large: intervals of their quantiles hold
 * 55 to 80 % of the norms where noise has one direction or few. So the law of |b|^2 is inverted
 * instead. Its cumulants for |beta|^2 = d are, with s the variance of b along beta,
 *
 *     k1 = d + tr C,    k2 = 4 d s + 2 tr C^2 (1 + 1 / f),    k3 = 24 d s^2 + 8 tr C^3,
 *
 * 1 / f for the error of tr C, and (|b|^2 / k1)^h is about normal with the mean 1 + k2 h (h - 1) /
 * (2 k1^2) and the deviation h sqrt(k2) / k1, h = 1 - k1 k3 / (3 k2^2) (D. Jensen, H. Solomon, "A
 * Gaussian approximation to the distribution of a definite quadratic form", 1972). The ends are the
 * d at which |b|^2 is the .975 and the .025 quantile, with those of Student's distribution of f
 * degrees of freedom for the normal ones, and 0 where no d is as small. Where noise has one
 * direction, |b|^2 / tr C is F of 1 and f at d = 0, and its .975 quantile, Student's t at .9875
 * squared, is larger than that of the power: with f = 5 by 44 %, so that 4.6 % of noise was claimed
 * instead of 2.5. Upper quantiles are larger by what the two differ by, times (tr C / (d + tr
 * C))^2, with which ends hold d from 0 on, and times (3 tr C^2 / (tr C)^2 - 1) / 2, 1 in one
 * direction and 0 in three, where F of (tr C)^2 / tr C^2 degrees agrees with the power.
 *
 * C need not be the same for all subjects: with e the residuals and a_i = c_i^2 / (1 - h_i) it is
 * the sum of a_i e_i e_i' (J. MacKinnon, H. White 1985), whose degrees of freedom are f =
 * (tr A)^2 / tr A^2, A = R diag(a) R (R. Bell, D. McCaffrey, "Bias reduction in standard errors",
 * 2002): for two groups the f of Welch where variances are alike. tr C^2 is freed of what noise
 * adds, (1 + 1 / f) tr C^2 + (tr C)^2 / f. A column of numbers rests on few subjects, and with f =
 * 4, say, nothing may be left of it; so over (tr C)^2 it is at least what all residuals give alike,
 * which have n - p degrees of freedom and the same where subjects vary alike. That share, r, is
 * known badly, and one that is too small claims noise: it counts as r + 2 r (1 - r) / (n - p). tr
 * C^3 is (tr C^2)^2 / tr C, as of equal variances, and s |b|^2 = b'C b - tr C^2, as b and C are
 * independent.
 *
 * The ratio |beta|^2 / tr C is what is estimated from R = |b|^2 / tr C, whose tr C has the variance
 * v = 2 tr C^2 / f over its square. To the cumulants k of |b|^2 / tr C that adds v k_1^2 to the
 * second and 4 v^2 k_1^3 + 6 v k_1 k_2 to the third, to first order; it is inverted likewise.
 *
 * A residual variance is the sum of |e_i|^2 over n - p, whose variance over its square is v = 2 tr
 * S^2 / ((n - p) (tr S)^2) where noise is normal with the covariance S, and that of the terms
 * |e_i|^2 / (1 - h_i) where subjects differ more than that. The ends are the value over the
 * quantiles of a mean of squares with that variance, (1 - v / 9 -+ t sqrt(v) / 3)^3 (E. Wilson, M.
 * Hilferty 1931), with Student's t as v is estimated, together with the value: the same subjects
 * make both small. No noise leaves more doubt than that of one direction, whose v is known.
 */
#include "intervals.h"

#include "subjects.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define FREEDOM_MIN 3.0
#define ROUNDING 1e-9
#define SAME 1e-14     /* of squares: an estimate without noise, or noise without an estimate */
#define CERTAIN 1e-9   /* 1 - h of a subject whose value the model fixes */
#define POWER_MIN 0.25 /* of h: a law whose noise is far from its square has no better power */
#define RATIO_POWER_MIN (-0.75)
#define POWER_NONE 0.02 /* a power as near to 0 as makes no difference */
#define ALIKE_MIN 1e-3  /* tr C^2 over (tr C)^2: as of a thousand equal variances */
#define NORMAL 1.959963984540054
#define NORMAL_9875 2.241402727604947
#define ROOT_MIN 0.1 /* of the cube root of a quantile */
#define DOUBLINGS 1000
#define BISECTIONS 60

/* ---- Residuals ------------------------------------------------------------------------------- */

int intervals_open(struct intervals *of, size_t n, size_t count, const double *basis,
                   const double *gram)
{
    double *work;

    *of = (struct intervals){.n = n, .count = count, .basis = basis};
    of->rest = srnf_alloc(n, sizeof(double));
    of->gram = srnf_alloc(n, n * sizeof(double));
    of->scratch = srnf_alloc(2 * n + count, sizeof(double));
    work = srnf_alloc(count + 1, n * sizeof(double));
    if (!of->rest || !of->gram || !of->scratch || !work) {
        srnf_free(work);
        return SRNF_ENOMEM;
    }
    memcpy(of->gram, gram, n * n * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        of->rest[i] = 1.0;
        for (size_t k = 0; k < count; k++) {
            of->rest[i] -= basis[k * n + i] * basis[k * n + i];
        }
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)count, (int)n, (int)n, 1.0, basis,
                (int)n, of->gram, (int)n, 0.0, work, (int)n);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)n, (int)n, (int)count, -1.0, basis,
                (int)n, work, (int)n, 1.0, of->gram, (int)n);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)count, (int)n, (int)n, 1.0, basis,
                (int)n, of->gram, (int)n, 0.0, work, (int)n);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)n, (int)n, (int)count, -1.0, work,
                (int)n, basis, (int)n, 1.0, of->gram, (int)n);
    srnf_free(work);
    return SRNF_OK;
}

void intervals_close(struct intervals *of)
{
    srnf_free(of->rest);
    srnf_free(of->gram);
    srnf_free(of->scratch);
}

/* ---- Variances ------------------------------------------------------------------------------- */

/* tr of (A M)^2 for the products M of residuals, A diagonal, or 1 for NULL. */
static double squares_of_noise(const struct intervals *of, const double *a)
{
    double sum = 0.0;

    for (size_t i = 0; i < of->n; i++) {
        const double *products = of->gram + i * of->n;
        double row = 0.0;

        for (size_t j = 0; j < of->n; j++) {
            row += (a ? a[j] : 1.0) * products[j] * products[j];
        }
        sum += (a ? a[i] : 1.0) * row;
    }
    return sum;
}

/* tr S^2 over (tr S)^2 of a law whose sum of f squares has the traces: either is freed of what
   noise adds, (tr S)^2 of 2 tr S^2 / f. */
static double alike(double trace, double squares, double freedom)
{
    double free = squares / (trace * trace) - 1.0 / freedom;

    free *= freedom * freedom / ((freedom - 1.0) * (freedom + 2.0));
    free = fmin(fmax(free, ALIKE_MIN), 1.0);
    return fmin(free / (1.0 - 2.0 * free / freedom), 1.0);
}

/* Cube root of the quantile of a square of the mean 1 and of the variance, (+ or -) normal. */
static double cube_root(double variance, double normal)
{
    return 1.0 - variance / 9.0 + normal * sqrt(variance) / 3.0;
}

double intervals_square(double variance, double normal)
{
    return pow(fmax(cube_root(variance, normal), ROOT_MIN), 3.0);
}

void intervals_of_variance(double value, double freedom, double squares, double differ,
                           double interval[2])
{
    double student = subjects_student(freedom);
    double noise = fmax(2.0 / freedom * alike(1.0, squares, freedom), differ);
    double most = fmax(2.0 / freedom, differ);

    interval[0] = value / pow(fmin(cube_root(noise, student), cube_root(most, NORMAL)), 3.0);
    interval[0] = fmin(interval[0], value);
    interval[1] =
        value /
        pow(fmax(fmax(cube_root(noise, -student), cube_root(most, -NORMAL)), ROOT_MIN), 3.0);
}

void intervals_variance(const struct intervals *of, double value, double interval[2])
{
    double freedom = (double)of->n - (double)of->count;
    double differ = 0.0;

    interval[0] = interval[1] = NAN;
    if (!(freedom >= FREEDOM_MIN) || !(value > 0.0)) {
        return;
    }
    for (size_t i = 0; i < of->n; i++) {
        double off = of->rest[i] > CERTAIN ? of->gram[i * of->n + i] / of->rest[i] - value : 0.0;

        differ += off * off / (freedom * value * freedom * value);
    }
    intervals_of_variance(value, freedom,
                          squares_of_noise(of, NULL) / (freedom * value * freedom * value), differ,
                          interval);
}

/* ---- Norms ----------------------------------------------------------------------------------- */

/* What is known of C. */
struct noise {
    double trace, squares; /* tr C, tr C^2 */
    double along;          /* s */
    double freedom;        /* f */
    double taken;          /* 1 / f where tr C, as estimated, is taken from |b|^2 */
    double doubt;          /* variance of tr C, as estimated, where |b|^2 is over it */
};

static double power_quantile(const struct noise *noise, double d, double normal)
{
    double k1 = d + noise->trace;
    double v = noise->doubt;
    double k2 = 4.0 * d * noise->along + 2.0 * noise->squares * (1.0 + noise->taken);
    double k3 = 24.0 * d * noise->along * noise->along +
                8.0 * noise->squares * noise->squares / noise->trace +
                v * k1 * (4.0 * v * k1 * k1 + 6.0 * k2);
    double h, x;

    k2 += v * k1 * k1;
    h = 1.0 - k1 * k3 / (3.0 * k2 * k2);
    h = fmin(fmax(h, v > 0.0 ? RATIO_POWER_MIN : POWER_MIN), 1.0);
    h = fabs(h) < POWER_NONE ? POWER_NONE : h;
    x = 1.0 + k2 * h * (h - 1.0) / (2.0 * k1 * k1) + normal * h * sqrt(k2) / k1;
    return k1 * pow(fmax(x, 0.0), 1.0 / h);
}

/* The quantile of |b|^2 for |beta|^2 = d. */
static double quantile(const struct noise *noise, double d, double normal)
{
    double value = power_quantile(noise, d, normal);
    double one = 1.5 * noise->squares / (noise->trace * noise->trace) - 0.5;

    if (normal > 0.0 && noise->taken > 0.0 && one > 0.0) {
        const struct noise unit = {1.0, 1.0, 1.0, noise->freedom, noise->taken, 0.0};
        double root = subjects_student_at(noise->freedom, NORMAL_9875);
        double near = noise->trace / (d + noise->trace);

        value *= 1.0 + one * near * near *
                           fmax(root * root / power_quantile(&unit, 0.0, normal) - 1.0, 0.0);
    }
    return value;
}

/* The d whose quantile the square is, or 0. */
static double invert(const struct noise *noise, double square, double normal)
{
    double low = 0.0;
    double high = square + noise->trace;

    if (quantile(noise, 0.0, normal) >= square) {
        return 0.0;
    }
    for (int k = 0; k < DOUBLINGS && quantile(noise, high, normal) < square; k++) {
        high *= 2.0;
    }
    for (int k = 0; k < BISECTIONS; k++) {
        double middle = 0.5 * (low + high);

        if (quantile(noise, middle, normal) < square) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* tr of (A R)^2, A diagonal: the sum of a_i a_j R_ij^2. */
static double squares_of_projection(const struct intervals *of, const double *a)
{
    size_t n = of->n;
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        sum += a[i] * a[i] * (2.0 * of->rest[i] - 1.0);
    }
    for (size_t k = 0; k < of->count; k++) {
        for (size_t m = 0; m < of->count; m++) {
            double inside = 0.0;

            for (size_t i = 0; i < n; i++) {
                inside += of->basis[k * n + i] * a[i] * of->basis[m * n + i];
            }
            sum += inside * inside;
        }
    }
    return sum;
}

/* <e_i, b>, from <y_i, b>: e = R y. */
static void take_residuals(const struct intervals *of, const double *along, double *out)
{
    double *parts = of->scratch + 2 * of->n;

    memcpy(out, along, of->n * sizeof(double));
    for (size_t k = 0; k < of->count; k++) {
        parts[k] = cblas_ddot((int)of->n, of->basis + k * of->n, 1, along, 1);
    }
    for (size_t k = 0; k < of->count; k++) {
        cblas_daxpy((int)of->n, -parts[k], of->basis + k * of->n, 1, out, 1);
    }
}

/* false: the data do not tell. No one draws subjects that are equal, or means that are: they are
   one that is given twice. */
static bool measure(const struct intervals *of, const double *weights, const double *along,
                    double square, struct noise *noise)
{
    size_t n = of->n;
    double *a = of->scratch;
    double *products = of->scratch + n;
    double trace = 0.0;
    double inside = 0.0; /* b'C b */
    double all = 0.0;    /* squares of all residuals */
    double whole = 0.0, fixed = 0.0;
    double same, told;
    double excess;

    take_residuals(of, along, products);
    noise->trace = 0.0;
    for (size_t i = 0; i < n; i++) {
        a[i] = of->rest[i] > CERTAIN ? weights[i] * weights[i] / of->rest[i] : 0.0;
        whole += weights[i] * weights[i];
        fixed += of->rest[i] > CERTAIN ? 0.0 : weights[i] * weights[i];
        trace += a[i] * of->rest[i];
        noise->trace += a[i] * of->gram[i * n + i];
        inside += a[i] * products[i] * products[i];
        all += of->gram[i * n + i];
    }
    if (fixed > ROUNDING * whole) { /* its noise is in the estimate, and in no residual */
        return false;
    }
    noise->freedom = trace > 0.0 ? trace * trace / squares_of_projection(of, a) : 0.0;
    if (!(noise->freedom >= FREEDOM_MIN * (1.0 - ROUNDING)) || !isfinite(noise->trace)) {
        return false;
    }
    if (!(noise->trace > SAME * square && square > SAME * noise->trace)) {
        return false;
    }
    same = fmax(alike(noise->trace, squares_of_noise(of, a), noise->freedom),
                alike(all, squares_of_noise(of, NULL), (double)(n - of->count)));
    told = noise->trace * noise->trace * same;
    same += 2.0 * same * (1.0 - same) / (double)(n - of->count);
    noise->squares = noise->trace * noise->trace * fmin(same, 1.0);
    excess = square - noise->trace;
    noise->along = sqrt(noise->squares);
    if (excess > 0.0) {
        noise->along = fmin(fmax(inside - told, 0.0) / excess, noise->along);
    }
    return true;
}

void intervals_norm(const struct intervals *of, const double *weights, const double *along,
                    double square, double interval[2])
{
    struct noise noise;
    double normal;

    interval[0] = interval[1] = NAN;
    if (!isfinite(square) || !measure(of, weights, along, square, &noise)) {
        return;
    }
    noise.taken = 1.0 / noise.freedom;
    noise.doubt = 0.0;
    normal = subjects_student(noise.freedom);
    interval[0] = sqrt(fmin(invert(&noise, square, normal), square));
    interval[1] = sqrt(fmax(invert(&noise, square, -normal), square));
}

void intervals_ratio(const struct intervals *of, const double *weights, const double *along,
                     double square, double interval[2])
{
    struct noise noise;
    double normal;

    interval[0] = interval[1] = NAN;
    if (!isfinite(square) || !measure(of, weights, along, square, &noise)) {
        return;
    }
    noise.taken = 0.0;
    noise.doubt = 2.0 * noise.squares / (noise.trace * noise.trace * noise.freedom);
    normal = subjects_student(noise.freedom);
    interval[0] = invert(&noise, square, normal) / noise.trace;
    interval[1] = invert(&noise, square, -normal) / noise.trace;
}

/*
 * pca_intervals.c - how far the variances of principal components are known.
 *
 * With N = n - 1 and the eigenvalues l_j of the Gram matrix, the others' pull is taken from l_k:
 *
 *     1 / lambda = (1 / N) (1 / l_k + sum over j != k of 1 / (l_k - l_j)),
 *
 * which is D. Lawley's first order ("Tests of significance for the latent roots of covariance and
 * correlation matrices", 1956) and holds for any number of variables where a few components stand
 * out (Z. Bai, X. Ding, "Estimation of spiked eigenvalues in spiked models", 2012): in small groups
 * the first eigenvalues are too large. With r = d lambda / d l_k, the variance of lambda over its
 * square is 2 r / N of normal scores (Z. Bai, J. Yao, "Central limit theorems for eigenvalues in a
 * spiked population model", 2008), and r times that of the squared scores, where that is more. The
 * ends are those of intervals.c. The odds of a share are lambda over all others, of which one is as
 * good as independent.
 *
 * Eigenvalues nearer than 1.5 standard errors may have changed places. Then the low end is that of
 * the mean of l_k and those so near below it, and the high end that of the mean with those so near
 * above. More than three below, or r above 3, are noise: there is no interval. Components that are
 * not kept are equal ones, or as few as there can be: the interval holds that of both.
 */
#include "intervals.h"

#include "subjects.h"

#include <math.h>

#define MEMBERS_MIN 10
#define NEAR 1.5       /* standard errors */
#define TOGETHER_MAX 3 /* eigenvalues that may have changed places */
#define LOOSE 3.0      /* r, of what hardly stands out */
#define ROUNDING 1e-9  /* of the total variance */
#define ALIKE_MIN 1e-3 /* as in intervals.c */
#define FREEDOM_MIN 3.0
#define NORMAL 1.959963984540054

/* Components that are not kept: count equal ones. */
struct rest {
    double size, count;
};

struct together {
    double value;            /* mean of lambda */
    double loose;            /* r */
    double normal, observed; /* variance over the square, of normal scores and of these */
    double others;           /* freedom of the sum of the others */
};

static double left_variance(const struct srnf_pca *pca)
{
    double left = pca->total_variance;

    for (size_t k = 0; k < pca->components; k++) {
        left -= pca->eigenvalues[k];
    }
    return left > ROUNDING * pca->total_variance ? left : 0.0;
}

/* uneven: as few as there can be, none larger than the last that is kept. */
static struct rest rest_of(const struct srnf_pca *pca, bool uneven)
{
    double left = left_variance(pca);
    double count = (double)(pca->n - 1) - (double)pca->components;
    double last = pca->eigenvalues[pca->components - 1];

    if (!(left > 0.0) || !(count > 0.0)) {
        return (struct rest){0.0, 0.0};
    }
    count = uneven ? fmin(left / fmin(last, left), count) : count;
    return (struct rest){left / count, count};
}

/* Whether eigenvalue k and the next may have changed places; the last of all has noise below. */
static bool is_near(const struct srnf_pca *pca, size_t k)
{
    double own = pca->eigenvalues[k];
    double next;

    if (k + 2 >= pca->n) {
        return true;
    }
    next = k + 1 < pca->components ? pca->eigenvalues[k + 1] : fmin(own, left_variance(pca));
    return own - next < NEAR * sqrt(2.0 / (double)(pca->n - 1)) * own;
}

/* Variance of the squared scores over the square of their mean, over n - 1. */
static double observed_variance(const struct srnf_pca *pca, size_t k)
{
    double freedom = (double)(pca->n - 1);
    double sum = 0.0;

    for (size_t i = 0; i < pca->n; i++) {
        double score = pca->scores[i * pca->components + k];
        double off = score * score / pca->eigenvalues[k] - 1.0;

        sum += off * off;
    }
    return sum / (freedom * freedom);
}

/* lambda and r of eigenvalue k, those from first to last without a pull; false: noise. */
static bool take_pull(const struct srnf_pca *pca, size_t first, size_t last, size_t k,
                      const struct rest *rest, double *lambda, double *loose)
{
    double freedom = (double)(pca->n - 1);
    double own = pca->eigenvalues[k];
    double still = freedom - rest->count - (double)(pca->components - (last - first + 1));
    double sum = still / own + rest->count / (own - rest->size);
    double squares = still / (own * own) + rest->count / ((own - rest->size) * (own - rest->size));

    for (size_t j = 0; j < pca->components; j++) {
        double apart = own - pca->eigenvalues[j];

        if (j < first || j > last) {
            sum += 1.0 / apart;
            squares += 1.0 / (apart * apart);
        }
    }
    *lambda = freedom / sum;
    *loose = *lambda * *lambda * squares / freedom;
    return isfinite(*lambda) && *lambda > 0.0 && *loose <= LOOSE;
}

/* Freedom of the sum of the eigenvalues beside those from first to last. */
static double freedom_of_others(const struct srnf_pca *pca, size_t first, size_t last,
                                const struct rest *rest)
{
    double freedom = (double)(pca->n - 1);
    double sum = rest->count * rest->size;
    double squares = rest->count * rest->size * rest->size;

    for (size_t j = 0; j < pca->components; j++) {
        if (j < first || j > last) {
            sum += pca->eigenvalues[j];
            squares += pca->eigenvalues[j] * pca->eigenvalues[j];
        }
    }
    squares = fmax(squares - sum * sum / freedom, ALIKE_MIN * sum * sum);
    return squares > 0.0 ? fmax(freedom * sum * sum / squares, 1.0) : INFINITY;
}

static bool take_together(const struct srnf_pca *pca, size_t first, size_t last,
                          const struct rest *rest, struct together *found)
{
    double count = (double)(last - first + 1);

    *found = (struct together){.others = freedom_of_others(pca, first, last, rest)};
    for (size_t k = first; k <= last; k++) {
        double lambda, loose;

        if (!take_pull(pca, first, last, k, rest, &lambda, &loose)) {
            return false;
        }
        found->value += lambda / count;
        found->loose += loose / count;
        found->observed += loose * observed_variance(pca, k) / (count * count);
    }
    found->normal = 2.0 * found->loose / ((double)(pca->n - 1) * count);
    return true;
}

/* The end of both intervals that lies on a side: 0 low, 1 high. */
static void set_ends(const struct srnf_pca *pca, const struct together *of, int side,
                     double eigenvalue[2], double explained[2])
{
    double sign = side ? -1.0 : 1.0;
    double student = subjects_student(fmax((double)(pca->n - 1) / of->loose, FREEDOM_MIN));
    double variance = fmax(of->normal, of->observed);
    double end =
        of->value / intervals_square(variance, sign * (variance > of->normal ? student : NORMAL));
    double odds = of->value / fmax(pca->total_variance - of->value, 0.0);
    double share;

    odds *= exp(-sign * student * sqrt(variance + 2.0 / of->others));
    share = isfinite(odds) ? odds / (1.0 + odds) : 1.0;
    eigenvalue[side] = side ? fmax(eigenvalue[1], end) : fmin(eigenvalue[0], end);
    explained[side] = side ? fmax(explained[1], share) : fmin(explained[0], share);
}

static void forget(double eigenvalue[2], double explained[2])
{
    eigenvalue[0] = eigenvalue[1] = explained[0] = explained[1] = NAN;
}

void srnf_pca_interval(const struct srnf_pca *pca, size_t k, double eigenvalue[2],
                       double explained[2])
{
    size_t last = k;
    size_t first = k;

    forget(eigenvalue, explained);
    if (pca->n < MEMBERS_MIN || k >= pca->components || !(pca->total_variance > 0.0)) {
        return;
    }
    while (last < pca->components && last - k < TOGETHER_MAX && is_near(pca, last)) {
        last++;
    }
    if (last == pca->components || last - k >= TOGETHER_MAX) {
        return;
    }
    while (first > 0 && is_near(pca, first - 1)) {
        first--;
    }
    eigenvalue[0] = eigenvalue[1] = pca->eigenvalues[k];
    explained[0] = explained[1] = fmin(pca->eigenvalues[k] / pca->total_variance, 1.0);
    for (int uneven = 0; uneven < 2; uneven++) {
        struct rest rest = rest_of(pca, uneven);
        struct together below, above;

        if (!take_together(pca, k, last, &rest, &below) ||
            !take_together(pca, first, k, &rest, &above)) {
            forget(eigenvalue, explained);
            return;
        }
        set_ends(pca, &below, 0, eigenvalue, explained);
        set_ends(pca, &above, 1, eigenvalue, explained);
    }
}

void srnf_pca_total_interval(const struct srnf_pca *pca, const double *distances,
                             double interval[2])
{
    double freedom = (double)pca->n - 1.0;
    double total = pca->total_variance;
    double squares = 0.0;
    double differ = 0.0;

    interval[0] = interval[1] = NAN;
    if (!(freedom >= FREEDOM_MIN) || !(total > 0.0)) {
        return;
    }
    for (size_t k = 0; k < pca->components; k++) {
        squares += pca->eigenvalues[k] * pca->eigenvalues[k];
    }
    for (size_t i = 0; i < pca->n; i++) {
        double off = distances[i] * distances[i] * (freedom + 1.0) / (freedom * total) - 1.0;

        differ += off * off / (freedom * freedom);
    }
    if (pca->components > 0) {
        struct rest rest = rest_of(pca, true);

        squares += rest.count * rest.size * rest.size;
    }
    intervals_of_variance(total, freedom, squares / (total * total), differ, interval);
}

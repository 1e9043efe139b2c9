/*
 * paired_measured_squares.c - intervals of the mean squares of repeated measurements of sides.
 *
 * Each is the residual variance of a linear model (intervals.c): that of individuals of the means
 * of subjects times the root of how many measurements they have, the interaction of the d_s times
 * the root of w_s, each about what their mean is; and the error of all measurements about the means
 * of their sides. Measurements of a subject may be as wrong as each other, so that how the error
 * varies is told by what subjects have of it beyond their freedom.
 */
#include "intervals.h"
#include "paired_measured.h"

#include <cblas.h>
#include <math.h>

/* ---- Between subjects ------------------------------------------------------------------------ */

/* The products of what combinations parts, [count][n], make of z. scratch: [count][n] */
static void combine(const struct measured_run *run, const double *parts, double *scratch,
                    double *gram)
{
    int n = (int)run->n, count = (int)run->count;

    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, count, n, n, 1.0, parts, n, run->gram, n,
                0.0, scratch, n);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, count, count, n, 1.0, scratch, n, parts, n,
                0.0, gram, count);
}

/* sides: of their differences, not of the subjects' means. work: count (2 n + count + 1) zeros */
static int find_between(const struct measured_run *run, bool sides, double value, double *work,
                        double interval[2])
{
    size_t n = run->n, count = run->count;
    double *parts = work, *scratch = parts + count * n, *gram = scratch + count * n;
    double *basis = gram + count * count;
    struct intervals intervals;
    int status;

    for (size_t i = 0; i < n; i++) {
        size_t s = run->subjects.of[i];
        double size = (double)run->subjects.size[s];

        parts[s * n + i] = sides ? sqrt(run->weight[s]) * measured_part(run, s, run->given->side[i])
                                 : 1.0 / sqrt(size);
        basis[s] = sides ? sqrt(run->weight[s] / run->sum) : sqrt(size / (double)n);
    }
    combine(run, parts, scratch, gram);
    status = intervals_open(&intervals, count, 1, basis, gram);
    if (status == SRNF_OK) {
        intervals_variance(&intervals, value, interval);
    }
    intervals_close(&intervals);
    return status;
}

/* ---- Error ----------------------------------------------------------------------------------- */

/* residuals: [n][n] products. */
static void set_error(const struct measured_run *run, const double *residuals)
{
    struct srnf_asymmetry_test *out = run->out;
    double freedom = (double)out->freedom[1];
    double whole = freedom * out->error;
    double squares = 0.0;
    double differ = 0.0;

    for (size_t k = 0; k < run->n * run->n; k++) {
        squares += residuals[k] * residuals[k] / (whole * whole);
    }
    for (size_t s = 0; s < run->count; s++) {
        double off = -(double)(run->subjects.size[s] - 2) * out->error;

        for (size_t m = run->subjects.start[s]; m < run->subjects.start[s + 1]; m++) {
            size_t i = run->subjects.members[m];

            off += residuals[i * run->n + i];
        }
        differ += off * off / (whole * whole);
    }
    intervals_of_variance(out->error, freedom, squares, differ, out->error_interval);
}

/* work: [2 count][n] zeros */
static int find_error(const struct measured_run *run, double *work)
{
    size_t n = run->n;
    struct intervals intervals;
    int status;

    for (size_t i = 0; i < n; i++) {
        size_t side = 2 * run->subjects.of[i] + (size_t)run->given->side[i];

        work[side * n + i] = 1.0 / sqrt((double)run->of_side[side]);
    }
    status = intervals_open(&intervals, n, 2 * run->count, work, run->gram);
    if (status == SRNF_OK) {
        set_error(run, intervals.gram);
    }
    intervals_close(&intervals);
    return status;
}

int measured_squares(struct measured_run *run)
{
    struct srnf_asymmetry_test *out = run->out;
    size_t size = run->count * (2 * run->n + run->count + 1);
    double *work = srnf_alloc(3, size * sizeof(double));
    int status = work ? find_between(run, false, out->individual, work, out->individual_interval)
                      : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        status = find_between(run, true, out->interaction, work + size, out->interaction_interval);
    }
    out->error_interval[0] = out->error_interval[1] = NAN;
    if (status == SRNF_OK && out->repeated >= SRNF_PAIRS_MIN) {
        status = find_error(run, work + 2 * size);
    }
    srnf_free(work);
    return status;
}

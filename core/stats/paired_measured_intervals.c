/*
 * paired_measured_intervals.c - intervals of what repeated measurements of sides tell.
 *
 * They draw subjects with their measurements (paired_bootstrap.c), those with a side that is
 * measured repeatedly and the others apart, so that each sample has as many that tell of the error;
 * those of F and of mean squares are of log-normal kind. The share 1 / (1 + 2 E / V) follows from
 * F. With i and e the squared lengths from the mean squares I and E to the ends of their intervals,
 * V has
 *
 *     (I - E -+ sqrt(i + e)) / w,
 *
 * with the lower end of I and the upper of E below, the others above (F. Graybill, C.-M. Wang,
 * "Confidence intervals on nonnegative linear combinations of variances", 1980; N. Ting et al.,
 * "Confidence intervals on linear combinations of variance components that are unrestricted in
 * sign", 1990). How E varies between fewer than 5 subjects no drawing tells: there are no
 * intervals.
 */
#include "paired_measured.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

/* Of the first sample of subjects: beyond those of permutations (paired_measured.c). */
#define DRAWING (UINT64_C(1) << 43)

/* Products of the subjects' differences. scratch: [count][n] */
static void fill_differences(struct measured_run *run, double *parts, double *scratch)
{
    size_t n = run->n;

    for (size_t i = 0; i < n; i++) {
        size_t s = run->subjects.of[i];

        parts[s * n + i] = measured_part(run, s, run->given->side[i]);
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)run->count, (int)n, (int)n, 1.0,
                parts, (int)n, run->gram, (int)n, 0.0, scratch, (int)n);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)run->count, (int)run->count, (int)n,
                1.0, scratch, (int)n, parts, (int)n, 0.0, run->differences, (int)run->count);
}

/* Mean squares of interaction and error of subjects drawn so often. values: [2] */
static void draw(const struct measured_run *run, const double *counts, double *scratch,
                 double values[2])
{
    size_t count = run->count;
    double between = 0.0;
    double inside = 0.0;
    double sum = 0.0;
    double freedom = 0.0;
    double *weights = scratch + count;

    for (size_t k = 0; k < count; k++) {
        size_t measured = run->of_side[2 * k] + run->of_side[2 * k + 1];
        double own = run->weight[k] * run->differences[k * count + k];

        weights[k] = counts[k] * run->weight[k];
        sum += weights[k];
        between += counts[k] * own;
        inside += counts[k] * (run->within[k] - own);
        freedom += counts[k] * (double)(measured - 2);
    }
    cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)count, (int)count, 1.0, run->differences,
                (int)count, weights, 1, 0.0, scratch, 1);
    between -= cblas_ddot((int)count, weights, 1, scratch, 1) / sum;
    values[0] = fmax(between, 0.0) / (double)(count - 1);
    values[1] = fmax(inside, 0.0) / freedom;
}

/* V from a mean square of interaction; and the share of V from F. */
static double root_of_excess(double excess, double w)
{
    return isnan(excess) ? excess : sqrt(fmax(excess, 0.0) / w);
}

static void set_fluctuating(const struct measured_run *run, const struct srnf_estimate *interaction,
                            double w)
{
    struct srnf_asymmetry_test *out = run->out;
    double excess = interaction->value - out->error;
    double lower[2];
    double upper[2];

    for (size_t k = 0; k < 2; k++) {
        double end = out->measured.interval[k];

        lower[k] = k ? end * end - out->error : interaction->value - interaction->interval[0];
        upper[k] = k ? interaction->interval[1] - interaction->value : out->error - end * end;
    }
    out->fluctuating.value = root_of_excess(excess, w);
    out->fluctuating.interval[0] = root_of_excess(excess - hypot(lower[0], lower[1]), w);
    out->fluctuating.interval[1] = root_of_excess(excess + hypot(upper[0], upper[1]), w);
}

static double share_of(double f, double w)
{
    double ratio = fmax(f - 1.0, 0.0) / w;

    return isnan(f) ? f : ratio / (ratio + 2.0);
}

static void forget(struct srnf_estimate *estimate)
{
    estimate->interval[0] = estimate->interval[1] = NAN;
}

static void set_estimates(const struct measured_run *run, double *drawn)
{
    struct srnf_asymmetry_test *out = run->out;
    size_t samples = run->options->bootstraps;
    struct srnf_estimate interaction;
    double squares = 0.0;
    double w;

    for (size_t k = 0; k < run->count; k++) {
        squares += run->weight[k] * run->weight[k];
    }
    w = (run->sum - squares / run->sum) / (double)(run->count - 1);
    paired_estimate(&interaction, out->interaction, false, samples, drawn);
    paired_estimate(&out->measured, out->error, true, samples, drawn + samples);
    paired_estimate(&out->f, run->observed, false, samples, drawn + 2 * samples);
    set_fluctuating(run, &interaction, w);
    out->repeatability.value = share_of(out->f.value, w);
    for (size_t k = 0; k < 2; k++) {
        out->repeatability.interval[k] = share_of(out->f.interval[k], w);
    }
    if (out->repeated < SRNF_PAIRS_MIN) {
        forget(&out->f);
        forget(&out->fluctuating);
        forget(&out->measured);
        forget(&out->repeatability);
    }
}

/* Subjects with repeated measurements, then the others. */
static void order_subjects(struct measured_run *run)
{
    size_t at = 0;

    for (int again = 1; again >= 0; again--) {
        for (size_t k = 0; k < run->count; k++) {
            if ((run->of_side[2 * k] + run->of_side[2 * k + 1] > 2) == again) {
                run->order[at++] = k;
            }
        }
        run->out->repeated = again ? at : run->out->repeated;
    }
}

/* How often each subject is in a sample. */
static void draw_subjects(const struct measured_run *run, size_t sample, double *counts)
{
    size_t repeated = run->out->repeated;

    memset(counts, 0, run->count * sizeof(double));
    for (size_t i = 0; i < run->count; i++) {
        size_t first = i < repeated ? 0 : repeated;
        size_t of = i < repeated ? repeated : run->count - repeated;

        counts[run->order[first + stats_below(run->options->seed, DRAWING + sample, (uint32_t)i,
                                              (uint32_t)of)]] += 1.0;
    }
}

int measured_intervals(struct measured_run *run, struct srnf_error *error)
{
    size_t count = run->count;
    size_t samples = run->options->bootstraps;
    double *parts = srnf_alloc(2 * count, run->n * sizeof(double));
    double *counts = srnf_alloc(3, count * sizeof(double));
    double *drawn = srnf_alloc(3, samples * sizeof(double));
    int status = parts && counts && drawn ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        order_subjects(run);
        fill_differences(run, parts, parts + count * run->n);
    }
    for (size_t k = 0; k < samples && status == SRNF_OK; k++) {
        double values[2];
        double more = (double)count / (double)(count - 1); /* a sample varies less */

        draw_subjects(run, k, counts);
        draw(run, counts, counts + count, values);
        drawn[k] = more * values[0];
        drawn[samples + k] = values[1];
        drawn[2 * samples + k] = values[1] > 0.0 ? more * values[0] / values[1] : run->observed;
        if (k % 64 == 0 && srnf_is_canceled(run->context)) {
            status = srnf_fail(error, SRNF_ECANCELED, -1, "%s", srnf_strerror(SRNF_ECANCELED));
        }
    }
    if (status == SRNF_OK) {
        set_estimates(run, drawn);
    }
    srnf_free(parts);
    srnf_free(counts);
    srnf_free(drawn);
    return status;
}

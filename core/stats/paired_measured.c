/*
 * paired_measured.c - fluctuating asymmetry against the error of measurement, where sides were
 * measured repeatedly: an analysis of variance of individuals and sides (A. Palmer, C. Strobeck,
 * "Fluctuating asymmetry: measurement, analysis, patterns", 1986; C. Klingenberg, G. McIntyre,
 * "Geometric morphometrics of developmental instability", 1998), of SRNFs in the place of
 * coordinates, with the F of C. Goodall ("Procrustes methods in the statistical analysis of shape",
 * 1991).
 *
 * y are SRNFs times the sizes, r_0 and r_1 the measurements of the two sides of subject s, d_s the
 * difference of its sides' means and 1 / w_s = 1 / r_0 + 1 / r_1. With W the sum of the w_s and D
 * the mean of the d_s with these weights,
 *
 *     interaction: sum w_s |d_s - D|^2 / (n - 1),   error: sum of squares within sides / (N - 2 n),
 *
 * whose expectations are E + w V and E: E the variance of a measurement, V that of the true
 * differences about their mean, w = (W - sum w_s^2 / W) / (n - 1). F is the one over the other.
 *
 * Without fluctuating asymmetry the measurements of a subject, less D for the one side, differ by
 * error alone and can be exchanged between its sides. z = y -+ D / 2 are permuted within subjects,
 * which leaves their sums of squares T_s as they are, so that with a_s = w_s |d_s|^2 of the
 * permuted
 *
 *     F = ((sum a_s - W |D|^2) / (n - 1)) / ((sum T_s - sum a_s) / (N - 2 n)).
 *
 * D is estimated of the same data: the level holds in the limit of many subjects, and nearly so of
 * few (tests/core/stats/test_measured.c). All this needs the Gram matrix of z alone.
 */
#include "paired_measured.h"

#include <cblas.h>
#include <math.h>

#define BLOCK ((size_t)32)
#define ROUNDING 1e-14                /* of a mean square, beside the others */
#define PERMUTING (UINT64_C(1) << 42) /* of the first permutation: beyond those of other draws */

/* ---- What is given --------------------------------------------------------------------------- */

static int check_numbers(const struct measured_run *run, struct srnf_error *error)
{
    const struct srnf_measurements *given = run->given;
    const struct srnf_paired_options *options = run->options;
    int status = stats_check_draws(options->permutations, options->bootstraps, error);

    if (status) {
        return status;
    }
    for (size_t i = 0; i < given->n; i++) {
        if (!(given->sizes[i] > 0.0 && isfinite(given->sizes[i]))) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "the size of measurement %zu is not positive", i);
        }
        if (given->side[i] != 0 && given->side[i] != 1) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "the side of measurement %zu is neither 0 nor 1", i);
        }
    }
    return SRNF_OK;
}

/* Each subject has both sides, and some side is measured twice. */
static int check_sides(struct measured_run *run, struct srnf_error *error)
{
    const struct srnf_measurements *given = run->given;

    if (run->count < SRNF_PAIRS_MIN) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu subjects; %zu are needed", run->count,
                         SRNF_PAIRS_MIN);
    }
    for (size_t i = 0; i < run->n; i++) {
        run->of_side[2 * run->subjects.of[i] + (size_t)given->side[i]]++;
    }
    for (size_t k = 0; k < 2 * run->count; k++) {
        if (run->of_side[k] == 0) {
            size_t member = run->subjects.members[run->subjects.start[k / 2]];

            return srnf_fail(error, SRNF_EINVAL, (int64_t)member,
                             "the subject of measurement %zu has no side %zu", member, k % 2);
        }
    }
    if (run->n <= 2 * run->count) {
        return srnf_fail(error, SRNF_EINVAL, -1, "no side of any subject is measured twice");
    }
    for (size_t k = 0; k < run->count; k++) {
        double one = (double)run->of_side[2 * k];
        double other = (double)run->of_side[2 * k + 1];

        run->weight[k] = one * other / (one + other);
        run->sum += run->weight[k];
    }
    return SRNF_OK;
}

static int open_run(struct measured_run *run, struct srnf_error *error)
{
    int status = subjects_open(&run->subjects, run->n, run->given->subjects, error);
    size_t count = run->subjects.count;

    run->of_side = srnf_alloc(count, 3 * sizeof *run->of_side);
    run->gram = srnf_alloc(run->n, run->n * sizeof(double));
    run->differences = srnf_alloc(count, count * sizeof(double));
    run->weight = srnf_alloc(count, 3 * sizeof(double));
    if (status == SRNF_OK && !(run->of_side && run->gram && run->differences && run->weight)) {
        status = SRNF_ENOMEM;
    }
    if (status == SRNF_OK) {
        run->count = count;
        run->order = run->of_side + 2 * count;
        run->within = run->weight + count;
        run->about = run->within + count;
    }
    return status;
}

static void close_run(struct measured_run *run)
{
    srnf_free(run->of_side);
    srnf_free(run->gram);
    srnf_free(run->differences);
    srnf_free(run->weight);
    subjects_clear(&run->subjects);
}

/* ---- Sums ------------------------------------------------------------------------------------ */

/* The mean difference out of the Gram matrix of y. scratch: [2][n] */
static void take_mean_out(struct measured_run *run, double *scratch)
{
    const struct srnf_measurements *given = run->given;
    size_t n = run->n;
    double *parts = scratch;
    double *along = scratch + n;
    double square = 0.0;

    for (size_t i = 0; i < n; i++) {
        size_t s = run->subjects.of[i];

        parts[i] = run->weight[s] * measured_part(run, s, given->side[i]) / run->sum;
    }
    cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)n, (int)n, 1.0, run->gram, (int)n, parts, 1, 0.0,
                along, 1);
    square = cblas_ddot((int)n, parts, 1, along, 1);
    run->out->side = run->sum * fmax(square, 0.0);
    for (size_t i = 0; i < n; i++) {
        double half = given->side[i] ? 0.5 : -0.5;

        for (size_t j = 0; j < n; j++) {
            double other = given->side[j] ? 0.5 : -0.5;

            run->gram[i * n + j] += half * other * square - half * along[j] - other * along[i];
        }
    }
}

static int fill_gram(struct measured_run *run, struct srnf_error *error)
{
    const struct srnf_grid *grid = srnf_sht_grid(run->sht);
    size_t size = 3 * stats_points(grid);
    double *y = srnf_alloc(run->n, size * sizeof(double));
    double *scratch = srnf_alloc(run->n, 2 * sizeof(double));
    int status = y && scratch ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        stats_weight(grid, run->n, run->given->q, NULL, y);
        for (size_t i = 0; i < run->n; i++) {
            cblas_dscal((int)size, run->given->sizes[i], y + i * size, 1);
        }
        for (size_t k = 0; k < size; k++) { /* sums of what all have in common would lose digits */
            double mean = 0.0;

            for (size_t i = 0; i < run->n; i++) {
                mean += y[i * size + k] / (double)run->n;
            }
            for (size_t i = 0; i < run->n; i++) {
                y[i * size + k] -= mean;
            }
        }
        status = stats_gram(run->n, size, y, run->gram, error);
    }
    if (status == SRNF_OK) {
        take_mean_out(run, scratch);
    }
    srnf_free(y);
    srnf_free(scratch);
    return status;
}

/* a_s of the parts of the measurements in the differences, [n]. */
static double square_of(const struct measured_run *run, size_t subject, const double *parts)
{
    const struct subjects *s = &run->subjects;
    double sum = 0.0;

    for (size_t m = s->start[subject]; m < s->start[subject + 1]; m++) {
        for (size_t o = s->start[subject]; o < s->start[subject + 1]; o++) {
            size_t i = s->members[m];
            size_t j = s->members[o];

            sum += parts[i] * parts[j] * run->gram[i * run->n + j];
        }
    }
    return run->weight[subject] * fmax(sum, 0.0);
}

static double f_of(const struct measured_run *run, double interaction, double error)
{
    return fmax(interaction, 0.0) / (double)run->out->freedom[0] /
           (fmax(error, 0.0) / (double)run->out->freedom[1]);
}

/* Sum of squares of individuals, of z: of the means of their measurements. */
static double individuals_of(const struct measured_run *run)
{
    double sum = 0.0;
    double whole = 0.0;

    for (size_t k = 0; k < run->count; k++) {
        sum -= run->within[k];
    }
    for (size_t i = 0; i < run->n; i++) {
        sum += run->gram[i * run->n + i];
        for (size_t j = 0; j < run->n; j++) {
            whole += run->gram[i * run->n + j];
        }
    }
    return fmax(sum - whole / (double)run->n, 0.0);
}

static void fill_within(struct measured_run *run)
{
    const struct subjects *s = &run->subjects;

    for (size_t k = 0; k < s->count; k++) {
        double trace = 0.0;
        double whole = 0.0;

        for (size_t m = s->start[k]; m < s->start[k + 1]; m++) {
            const double *row = run->gram + s->members[m] * run->n;

            trace += row[s->members[m]];
            for (size_t o = s->start[k]; o < s->start[k + 1]; o++) {
                whole += row[s->members[o]];
            }
        }
        run->within[k] = fmax(trace - whole / (double)s->size[k], 0.0);
    }
}

static int observe(struct measured_run *run, struct srnf_error *error)
{
    const struct srnf_measurements *given = run->given;
    struct srnf_asymmetry_test *out = run->out;
    double *parts = srnf_alloc(run->n, sizeof(double));
    double inside = 0.0;
    double between = 0.0;

    if (!parts) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < run->n; i++) {
        parts[i] = measured_part(run, run->subjects.of[i], given->side[i]);
    }
    fill_within(run);
    for (size_t k = 0; k < run->count; k++) {
        run->about[k] = square_of(run, k, parts);
        between += run->about[k];
        inside += run->within[k];
    }
    srnf_free(parts);
    out->freedom[0] = run->count - 1;
    out->freedom[1] = run->n - 2 * run->count;
    out->individual = individuals_of(run) / (double)(run->count - 1);
    out->interaction = between / (double)out->freedom[0];
    out->error = fmax(inside - between, 0.0) / (double)out->freedom[1];
    if (!(out->error > ROUNDING * (out->individual + out->interaction) && isfinite(out->error))) {
        return srnf_fail(error, SRNF_EDEGENERATE, -1,
                         "repeated measurements are all equal: they have no error");
    }
    run->observed = f_of(run, between, inside - between);
    return SRNF_OK;
}

/* ---- Permutations ---------------------------------------------------------------------------- */

/* Sides of measurements exchanged within subjects, as parts of the differences, [n]. */
static void permute(const struct measured_run *run, size_t number, double *parts)
{
    const struct subjects *s = &run->subjects;

    for (size_t k = 0; k < s->count; k++) {
        const size_t *members = s->members + s->start[k];

        for (size_t m = 0; m < s->size[k]; m++) {
            parts[members[m]] = measured_part(run, k, run->given->side[members[m]]);
        }
        for (size_t m = s->size[k]; m-- > 1;) {
            size_t other = stats_below(run->options->seed, PERMUTING + number,
                                       (uint32_t)(s->start[k] + m), (uint32_t)(m + 1));
            double swap = parts[members[m]];

            parts[members[m]] = parts[members[other]];
            parts[members[other]] = swap;
        }
    }
}

static double permuted_f(const struct measured_run *run, double *parts, double *scratch)
{
    double between = 0.0;
    double inside = 0.0;
    double mean;

    for (size_t k = 0; k < run->count; k++) {
        between += square_of(run, k, parts);
        inside += run->within[k];
    }
    for (size_t i = 0; i < run->n; i++) {
        parts[i] *= run->weight[run->subjects.of[i]];
    }
    cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)run->n, (int)run->n, 1.0, run->gram, (int)run->n,
                parts, 1, 0.0, scratch, 1);
    mean = cblas_ddot((int)run->n, parts, 1, scratch, 1) / run->sum;
    return f_of(run, between - mean, inside - between);
}

static int run_block(void *argument, size_t index, const struct srnf_context *context,
                     struct srnf_error *error)
{
    struct measured_run *run = argument;
    size_t first = 1 + index * BLOCK;
    double *parts = srnf_alloc(run->n, 2 * sizeof(double));

    (void)context;
    (void)error;
    if (!parts) {
        return SRNF_ENOMEM;
    }
    for (size_t k = first; k < first + BLOCK && k <= run->options->permutations; k++) {
        permute(run, k, parts);
        if (stats_as_large(permuted_f(run, parts, parts + run->n), run->observed)) {
            atomic_fetch_add_explicit(&run->as_large, 1, memory_order_relaxed);
        }
    }
    srnf_free(parts);
    return SRNF_OK;
}

static void set_test(const struct measured_run *run)
{
    struct srnf_permutation_test *test = &run->out->test;
    double all = 1.0 + (double)run->options->permutations;
    double different = 1.0;
    bool exchangeable = true; /* all sides at once, which gives the same F */

    for (size_t k = 0; k < run->count; k++) {
        size_t one = run->of_side[2 * k];

        exchangeable = exchangeable && one == run->of_side[2 * k + 1];

        for (size_t m = 1; m <= one; m++) {
            different *= (double)(run->of_side[2 * k + 1] + m) / (double)m;
        }
    }
    test->permutations = run->options->permutations;
    test->relabellings = different;
    test->least = fmax(1.0 / all, fmin((exchangeable ? 2.0 : 1.0) / different, 1.0));
    run->out->p_value = (1.0 + (double)atomic_load(&run->as_large)) / all;
}

/* ---- The run --------------------------------------------------------------------------------- */

int srnf_test_asymmetry(const struct srnf_sht *sht, const struct srnf_measurements *measurements,
                        const struct srnf_paired_options *options,
                        const struct srnf_context *context, struct srnf_asymmetry_test *found,
                        struct srnf_error *error)
{
    const struct srnf_paired_options defaults = srnf_paired_options_defaults();
    struct srnf_asymmetry_test made = {.p_value = 1.0};
    struct srnf_error first = {0};
    struct measured_run run = {.sht = sht,
                               .given = measurements,
                               .options = options ? options : &defaults,
                               .context = context,
                               .n = measurements->n,
                               .out = &made};
    int status = check_numbers(&run, &first);

    atomic_init(&run.as_large, 0);
    status = status ? status : open_run(&run, &first);
    status = status ? status : check_sides(&run, &first);
    status = status ? status : fill_gram(&run, &first);
    status = status ? status : observe(&run, &first);
    if (status == SRNF_OK) {
        size_t blocks = (run.options->permutations + BLOCK - 1) / BLOCK;

        status = stats_run(context, blocks, run_block, &run,
                           (struct stats_progress){0.0, 1.0, "permuting measurements"}, &first);
    }
    status = status ? status : measured_intervals(&run, &first);
    status = status ? status : measured_squares(&run);
    if (status == SRNF_OK) {
        set_test(&run);
        *found = made;
    }
    close_run(&run);
    return status ? stats_fail(error, status, &first) : SRNF_OK;
}

/*
 * paired.c - differences within subjects.
 *
 * d_i are the differences of the two SRNFs of subject i, v_i those of its surfaces at the nodes of
 * the grid (paired_align.c). Where the surfaces of a subject can be exchanged, as if neither were
 * the second, d_i and -d_i are as likely, whatever the others are (R. Fisher, "The design of
 * experiments", 1935, ch. 3; T. Nichols, A. Holmes 2002). With signs s_i,
 *
 *   globally    |sum of s_i d_i|^2, from the Gram matrix of the d_i alone;
 *   locally     Hotelling's T^2 of one sample, of b = sum of s_i v_i at a node,
 *                   T^2 = (n - 1) / n b' E^(-1) b,    E = sum of v_i v_i' - b b' / n.
 *
 * p-values, corrections for all points and false discovery rates are those of compare.c. There are
 * 2^(n-1) different flips, since all signs turned give the same.
 *
 * The region of confidence of the mean displacement along the normal: with r_i what is left of the
 * displacements there less their mean, the largest |t| over the surface of s_i r_i has its 95 %
 * quantile, in standard errors (the wild bootstrap with the signs of H. Rademacher; R. Davidson, E.
 * Flachaire 2008).
 */
#include "paired.h"

#include <math.h>
#include <string.h>

#define PERMUTATIONS 10000
#define BOOTSTRAPS 1000
#define N_MAX ((size_t)10000)
#define PROGRESS_ALIGN 0.8

struct srnf_paired_options srnf_paired_options_defaults(void)
{
    return (struct srnf_paired_options){.permutations = PERMUTATIONS, .bootstraps = BOOTSTRAPS};
}

void srnf_paired_clear(struct srnf_paired *paired)
{
    srnf_free(paired->length);
    srnf_free(paired->normals);
    srnf_free(paired->statistic);
    *paired = (struct srnf_paired){0};
}

static int check(const struct srnf_pairs *pairs, const struct srnf_paired_options *options,
                 size_t size, struct srnf_error *error)
{
    int status;

    if (pairs->n < SRNF_PAIRS_MIN || pairs->n > N_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu pairs; %zu to %zu are needed", pairs->n,
                         SRNF_PAIRS_MIN, N_MAX);
    }
    status = stats_check_draws(options->permutations, options->bootstraps, error);
    if (status) {
        return status;
    }
    for (size_t k = 0; k < pairs->n * size; k++) {
        if (!isfinite(pairs->first_q[k]) || !isfinite(pairs->second_q[k])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(k / size),
                             "a surface of pair %zu is not finite", k / size);
        }
    }
    for (size_t i = 0; i < pairs->n; i++) {
        if (!(pairs->first_size[i] > 0.0 && isfinite(pairs->first_size[i])) ||
            !(pairs->second_size[i] > 0.0 && isfinite(pairs->second_size[i]))) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i, "a size of pair %zu is not positive",
                             i);
        }
    }
    return SRNF_OK;
}

/* ---- Memory ---------------------------------------------------------------------------------- */

static int open_out(struct srnf_paired *out, size_t points)
{
    double **const of_subjects[] = {&out->length, &out->deviation, &out->along, &out->distance};
    double **const maps[] = {&out->statistic, &out->p,      &out->significance,   &out->fdr,
                             &out->effect,    &out->normal, &out->standard_error, &out->confidence};

    out->length = srnf_alloc(4, out->n * sizeof(double));
    out->normals = srnf_alloc(out->n, points * sizeof(double));
    out->statistic = srnf_alloc(8, points * sizeof(double));
    if (!out->length || !out->normals || !out->statistic) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 1; k < sizeof of_subjects / sizeof of_subjects[0]; k++) {
        *of_subjects[k] = out->length + k * out->n;
    }
    for (size_t k = 1; k < sizeof maps / sizeof maps[0]; k++) {
        *maps[k] = out->statistic + k * points;
    }
    return SRNF_OK;
}

int paired_open(struct paired_run *run)
{
    size_t points = run->points;

    run->normal = srnf_alloc(3, points * sizeof(double));
    run->vectors = srnf_alloc(run->n, 3 * points * sizeof(double));
    run->along = srnf_alloc(run->n, points * sizeof(double));
    for (size_t k = 0; k < 3; k++) {
        run->gram[k] = srnf_alloc(run->n, run->n * sizeof(double));
    }
    return run->normal && run->vectors && run->along && run->gram[0] && run->gram[1] && run->gram[2]
               ? open_out(run->out, points)
               : SRNF_ENOMEM;
}

void paired_close(struct paired_run *run)
{
    stats_embedding_clear(&run->embedding);
    srnf_free(run->parts);
    srnf_free(run->normal);
    srnf_free(run->vectors);
    srnf_free(run->along);
    for (size_t k = 0; k < 3; k++) {
        srnf_free(run->gram[k]);
    }
}

/* ---- Data ------------------------------------------------------------------------------------ */

int paired_normal(struct paired_run *run)
{
    size_t points = run->points;
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(run->sht));

    if (!workspace) {
        return SRNF_ENOMEM;
    }
    srnf_field(run->sht, run->mean, run->normal, workspace);
    for (size_t p = 0; p < points; p++) {
        double *v = run->normal + p;
        double length = sqrt(v[0] * v[0] + v[points] * v[points] + v[2 * points] * v[2 * points]);

        for (size_t c = 0; c < 3; c++) {
            v[c * points] = length > 0.0 ? v[c * points] / length : 0.0;
        }
    }
    srnf_free(workspace);
    return SRNF_OK;
}

/* Gram matrices of the three parts. */
static int fill_grams(struct paired_run *run, struct srnf_error *error)
{
    size_t size = 3 * run->points;
    double *data = srnf_alloc(run->n, size * sizeof(double));
    int status = data ? SRNF_OK : SRNF_ENOMEM;

    for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
        for (size_t i = 0; i < run->n; i++) {
            memcpy(data + i * size, run->parts + (3 * i + k) * size, size * sizeof(double));
        }
        if (k == 0) {
            stats_weight(srnf_sht_grid(run->sht), run->n, data, NULL, data);
        } else if (k == 1) {
            memcpy(run->vectors, data, run->n * size * sizeof(double));
        }
        status = stats_gram(run->n, size, data, run->gram[k], error);
    }
    srnf_free(data);
    return status;
}

/* Displacements along the normal: of each subject, and what is left of them about their mean. */
static void fill_along(struct paired_run *run)
{
    size_t points = run->points;

    for (size_t p = 0; p < points; p++) {
        double root = run->embedding.root[p];
        double mean = 0.0;

        for (size_t i = 0; i < run->n; i++) {
            double sum = 0.0;

            for (size_t c = 0; c < 3; c++) {
                sum += run->normal[c * points + p] * run->vectors[(3 * i + c) * points + p];
            }
            run->along[i * points + p] = sum;
            run->out->normals[i * points + p] = root > 0.0 ? sum / root : 0.0;
            mean += sum / (double)run->n;
        }
        for (size_t i = 0; i < run->n; i++) {
            run->along[i * points + p] -= mean;
        }
    }
}

/* What the differences of each subject are beside those of the others. */
static void describe_subjects(struct paired_run *run)
{
    struct srnf_paired *out = run->out;
    const double *gram = run->gram[1];
    size_t n = run->n;
    double others = (double)(n - 1);
    double all = 0.0;

    for (size_t k = 0; k < n * n; k++) {
        all += gram[k];
    }
    for (size_t i = 0; i < n; i++) {
        double own = gram[i * n + i];
        double row = 0.0;
        double along;
        double mean2;

        for (size_t j = 0; j < n; j++) {
            row += gram[i * n + j];
        }
        along = (row - own) / others; /* <v_i, mean of the others> */
        mean2 = fmax(all - 2.0 * row + own, 0.0) / (others * others);
        out->length[i] = sqrt(own);
        out->deviation[i] = sqrt(fmax(own - 2.0 * along + mean2, 0.0));
        out->along[i] = mean2 > 0.0 ? along / sqrt(mean2) : 0.0;
        out->distance[i] = sqrt(run->gram[0][i * n + i]);
    }
}

/* ---- The run --------------------------------------------------------------------------------- */

static int compute(struct paired_run *run, struct srnf_error *error)
{
    size_t all;
    int status = stats_embedding_create(run->sht, run->mean, &run->embedding);

    status = status ? status : paired_open(run);
    if (status == SRNF_OK && !__builtin_mul_overflow(run->n, 9 * run->points, &all)) {
        run->parts = srnf_alloc(all, sizeof(double));
    }
    status = status || run->parts ? status : SRNF_ENOMEM;
    status = status ? status : paired_normal(run);
    status = status ? status
                    : paired_align(run,
                                   (struct stats_progress){0.0, PROGRESS_ALIGN,
                                                           "registering within subjects"},
                                   error);
    status = status ? status : fill_grams(run, error);
    if (status == SRNF_OK) {
        fill_along(run);
        describe_subjects(run);
        status =
            paired_flip(run, (struct stats_progress){PROGRESS_ALIGN, 1.0, "flipping signs"}, error);
    }
    return status ? status : paired_bootstrap(run, error);
}

int srnf_paired_differences(const struct srnf_sht *sht, const struct srnf_pairs *pairs,
                            const struct srnf_paired_options *options,
                            const struct srnf_context *context, struct srnf_paired *paired,
                            struct srnf_error *error)
{
    struct srnf_paired_options defaults = srnf_paired_options_defaults();
    struct srnf_paired found = {.n = pairs->n};
    struct srnf_error first = {0};
    struct paired_run run = {.sht = sht,
                             .pairs = pairs,
                             .mean = pairs->mean,
                             .options = options ? options : &defaults,
                             .context = context,
                             .n = pairs->n,
                             .points = stats_points(srnf_sht_grid(sht)),
                             .out = &found};
    int status = check(pairs, run.options, 3 * run.points, &first);

    status = status ? status : compute(&run, &first);
    paired_close(&run);
    if (status) {
        srnf_paired_clear(&found);
        return stats_fail(error, status, &first);
    }
    *paired = found;
    return SRNF_OK;
}

/*
 * compare.c - each subject of a cohort compared with all others, in a fold of its own that it was
 * left out of: options, normalisation, and the loop over folds.
 *
 * Metrics with a registration: all subjects are aligned to their mean (folds_align.c); a fold that
 * is refitted takes the mean of its n - 1 training subjects as its target and registers everybody
 * to it, the one left out by the same steps as the others. One Gauss-Newton step does, since the
 * mean of n - 1 differs from that of n by 1 / n of one subject's deviation, and what the step leaves
 * is of second order in that. Then the components and distances are those of folds_scores.c.
 *
 * Other metrics are one matrix of distances for all folds.
 *
 * Folds run in parallel, each with n fields of its own: 24 n P bytes.
 */
#include "folds.h"

#include <math.h>

#define ROUNDS 2
#define ROUNDS_MAX 20
#define COMPONENTS 20
#define COMPONENTS_MAX 64
#define FOLD_STEPS 1
#define N_MAX ((size_t)5000)

/* Parts of the progress. */
#define PART_ALIGNED 0.5

struct srnf_compare_options srnf_compare_options_defaults(void)
{
    return (struct srnf_compare_options){.registration = srnf_register_options_defaults(),
                                         .rounds = ROUNDS,
                                         .refit = SRNF_REFIT_FOLD,
                                         .max_components = COMPONENTS};
}

void srnf_comparison_clear(struct srnf_comparison *c)
{
    srnf_free(c->scores);
    srnf_free(c->distances);
    srnf_free(c->spread);
    *c = (struct srnf_comparison){0};
}

static int check(size_t n, const struct srnf_compare_options *options, struct srnf_error *error)
{
    if (n < 3 || n > N_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu surfaces are not 3 to %zu", n, N_MAX);
    }
    if (options->rounds == 0 || options->rounds > ROUNDS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "rounds is %zu, not 1 to %d", options->rounds,
                         ROUNDS_MAX);
    }
    if (options->max_components == 0 || options->max_components > COMPONENTS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "max_components is %zu, not 1 to %d",
                         options->max_components, COMPONENTS_MAX);
    }
    if (!options->registration.reparameterization || options->registration.exact) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "a comparison reparameterises, and not in exact mode");
    }
    return SRNF_OK;
}

/* ---- Normalised surfaces ---------------------------------------------------------------------- */

struct cohort {
    const struct srnf_sht *sht;
    const double *const *given;
    size_t count;
    double *memory;
    const double **surfaces; /* [n] into memory */
};

static int normalize_body(void *argument, size_t i, const struct srnf_context *context,
                          struct srnf_error *error)
{
    struct cohort *cohort = argument;
    double *f = cohort->memory + i * cohort->count;
    int status = srnf_normalize(cohort->sht, cohort->given[i], f, NULL);

    (void)context;
    cohort->surfaces[i] = f;
    return status
               ? srnf_fail(error, status, (int64_t)i, "surface %zu: %s", i, srnf_strerror(status))
               : SRNF_OK;
}

static int normalize_all(struct cohort *cohort, size_t n, const struct srnf_context *context,
                         struct srnf_error *error)
{
    cohort->memory = srnf_alloc(n, cohort->count * sizeof(double));
    cohort->surfaces = srnf_alloc(n, sizeof *cohort->surfaces);
    if (!cohort->memory || !cohort->surfaces) {
        return SRNF_ENOMEM;
    }
    return stats_run(context, n, normalize_body, cohort, (struct stats_progress){0}, error);
}

/* ---- Folds with a registration ---------------------------------------------------------------- */

struct folds {
    const struct alignment *a;
    const double *shared; /* [n][n] inner products of fields that all folds share, or NULL */
    struct srnf_comparison *out;
};

/* Registers all to the mean of the training subjects; products of the fields. */
static int refit(const struct alignment *a, size_t left_out, const struct srnf_context *context,
                 double *products)
{
    size_t size = 3 * a->points;
    double *mean = srnf_alloc(2 * size, sizeof(double));
    double *q = srnf_alloc(a->n, 2 * size * sizeof(double));
    int status = mean && q ? SRNF_OK : SRNF_ENOMEM;
    struct target target;

    for (size_t j = 0; j < a->n && status == SRNF_OK; j++) {
        for (size_t m = 0; m < size && j != left_out; m++) {
            mean[m] += a->q[j * size + m] / (double)(a->n - 1);
        }
    }
    if (status == SRNF_OK) {
        target = alignment_target(a, mean, mean + size);
    }
    for (size_t j = 0; j < a->n && status == SRNF_OK; j++) {
        status =
            alignment_refine(a, j, &target, FOLD_STEPS, context, q + j * size, NULL, NULL, NULL);
    }
    if (status == SRNF_OK) {
        fold_products(a->grid, a->n, q, q + a->n * size, products);
    }
    srnf_free(q);
    srnf_free(mean);
    return status;
}

static int fold_body(void *argument, size_t i, const struct srnf_context *context,
                     struct srnf_error *error)
{
    struct folds *folds = argument;
    struct srnf_comparison *out = folds->out;
    size_t n = out->n;
    double *products = folds->shared ? NULL : srnf_alloc(n, n * sizeof(double));
    int status = folds->shared || products ? SRNF_OK : SRNF_ENOMEM;

    (void)error;
    if (products) {
        status = refit(folds->a, i, context, products);
    }
    if (status == SRNF_OK) {
        status = fold_describe(n, i, products ? products : folds->shared, out->components,
                               out->scores + i * n * out->components, out->distances + i * n,
                               out->spread + i);
    }
    srnf_free(products);
    return status;
}

static int share(const struct alignment *a, double **products)
{
    double *scaled = srnf_alloc(a->n, 3 * a->points * sizeof(double));

    *products = srnf_alloc(a->n, a->n * sizeof(double));
    if (scaled && *products) {
        fold_products(a->grid, a->n, a->q, scaled, *products);
    }
    srnf_free(scaled);
    return scaled && *products ? SRNF_OK : SRNF_ENOMEM;
}

static int compare_registered(const struct srnf_sht *sht, enum srnf_representation representation,
                              const double *const *surfaces,
                              const struct srnf_compare_options *options,
                              const struct srnf_context *context, struct srnf_comparison *out,
                              struct srnf_error *error)
{
    struct stats_progress first = {0.0, PART_ALIGNED, "registering to the mean"};
    struct stats_progress rest = {PART_ALIGNED, 1.0, "refitting the folds"};
    struct alignment a;
    struct folds folds = {&a, NULL, out};
    double *shared = NULL;
    int status = alignment_create(&a, sht, out->n, surfaces, options, representation, context);

    out->components = options->max_components < out->n - 2 ? options->max_components : out->n - 2;
    out->scores = srnf_alloc(out->n * out->n, out->components * sizeof(double));
    status = status == SRNF_OK && !out->scores ? SRNF_ENOMEM : status;
    status = status ? status : alignment_run(&a, options->rounds, first, error);
    if (status == SRNF_OK && options->refit == SRNF_REFIT_SHARED) {
        status = share(&a, &shared);
        folds.shared = shared;
    }
    status = status ? status : stats_run(context, out->n, fold_body, &folds, rest, error);
    srnf_free(shared);
    alignment_clear(&a);
    return status;
}

/* ---- Folds that read a matrix ------------------------------------------------------------------ */

static void fill_spread(struct srnf_comparison *c)
{
    for (size_t i = 0; i < c->n; i++) {
        double sum = 0.0;

        for (size_t a = 0; a < c->n; a++) {
            for (size_t b = 0; b < a && a != i; b++) {
                sum += b == i ? 0.0 : c->distances[a * c->n + b] * c->distances[a * c->n + b];
            }
        }
        c->spread[i] = sqrt(2.0 * sum / (double)((c->n - 1) * (c->n - 2)));
    }
}

int srnf_compare(const struct srnf_sht *sht, enum srnf_metric metric, size_t n,
                 const double *const *surfaces, const struct srnf_compare_options *options,
                 const struct srnf_context *context, struct srnf_comparison *comparison,
                 struct srnf_error *error)
{
    struct srnf_compare_options defaults = srnf_compare_options_defaults();
    struct srnf_error first = {0};
    struct cohort cohort = {
        .sht = sht, .given = surfaces, .count = 3 * srnf_coefficient_count(srnf_sht_degree(sht))};
    int status;

    options = options ? options : &defaults;
    *comparison = (struct srnf_comparison){.n = n};
    status = check(n, options, &first);
    status = status ? status : stats_check_surfaces(sht, n, surfaces, &first);
    if (status) {
        goto out;
    }
    comparison->distances = srnf_alloc(n, n * sizeof(double));
    comparison->spread = srnf_alloc(n, sizeof(double));
    status = comparison->distances && comparison->spread ? SRNF_OK : SRNF_ENOMEM;
    status = status ? status : normalize_all(&cohort, n, context, &first);
    if (status) {
        goto out;
    }
    if (metric == SRNF_METRIC_SRNF || metric == SRNF_METRIC_SRM) {
        status = compare_registered(
            sht, metric == SRNF_METRIC_SRM ? SRNF_REPRESENTATION_SRM : SRNF_REPRESENTATION_SRNF,
            cohort.surfaces, options, context, comparison, &first);
    } else {
        status = srnf_metric_distances(sht, metric, n, cohort.surfaces, &options->registration,
                                       context, comparison->distances, &first);
        fill_spread(comparison);
    }
out:
    srnf_free(cohort.memory);
    srnf_free(cohort.surfaces);
    if (status) {
        bool told = first.status == status;

        (void)srnf_fail(error, status, told ? first.element : -1, "%s",
                        told ? first.message : srnf_strerror(status));
        srnf_comparison_clear(comparison);
    }
    return status;
}

/*
 * norms.c - see srnf/norms.h: a surface among the members of a model, each of which is left out.
 */
#include "norms.h"

#include <math.h>
#include <string.h>

#define SUBJECTS_MIN ((size_t)4) /* beside the columns */
/* Where the parts of a run end in its progress. */
#define PROGRESS_TRAITS 0.2
#define PROGRESS_CHECK 0.5

struct srnf_norm_options srnf_norm_options_defaults(void)
{
    return (struct srnf_norm_options){.member = SIZE_MAX, .map = true, .check = true};
}

void srnf_score_clear(struct srnf_score *score)
{
    srnf_free(score->check.percentiles);
    srnf_free(score->coefficients);
    srnf_free(score->deviation);
    srnf_free(score->spread);
    srnf_free(score->z);
    srnf_free(score->significance);
    *score = (struct srnf_score){0};
}

/* ---- What is given --------------------------------------------------------------------------- */

static bool all_finite(size_t n, const double *values)
{
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(values[i])) {
            return false;
        }
    }
    return true;
}

static int check(const struct norms *norms, const double *q,
                 const struct srnf_norm_options *options, struct srnf_error *error)
{
    const struct srnf_norm_model *model = norms->model;

    if (norms->subjects.count < SUBJECTS_MIN + model->columns) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "the model has %zu subjects, too few%s: %zu are needed",
                         norms->subjects.count, model->columns ? " for so many covariates" : "",
                         SUBJECTS_MIN + model->columns);
    }
    if (!model->complete && (model->columns > 0 || !model->calibration)) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "the model keeps a part of the components; all are needed here");
    }
    if (!all_finite(3 * norms->points, q) ||
        !all_finite(norms->n * model->columns, model->values) ||
        !all_finite(model->columns, options->at)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "a value is not finite");
    }
    return SRNF_OK;
}

static int open_norms(struct norms *norms, struct srnf_error *error)
{
    int status = subjects_open(&norms->subjects, norms->n, norms->model->subjects, error);

    norms->weights = srnf_alloc(norms->n ? norms->n : 1, sizeof(double));
    if (status == SRNF_OK && !norms->weights) {
        status = SRNF_ENOMEM;
    }
    for (size_t i = 0; i < norms->n && status == SRNF_OK; i++) {
        norms->weights[i] = 1.0 / (double)norms->subjects.size[norms->subjects.of[i]];
    }
    return status;
}

/* ---- Traits ---------------------------------------------------------------------------------- */

struct traits {
    const struct norms *norms;
    size_t counted;
    double *values; /* [SRNF_NORM_TRAITS][n] */
};

static int leave_out(void *argument, size_t subject, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct traits *traits = argument;

    (void)context;
    return norms_describe_subject(traits->norms, NORMS_NONE, subject, traits->counted,
                                  traits->values, error);
}

/* What the members have, each left out: as the model was calibrated, or about its predictions. */
static int find_values(struct traits *traits, struct srnf_error *error)
{
    const struct norms *norms = traits->norms;
    const struct srnf_norm_model *model = norms->model;

    if (model->columns == 0 && model->calibration) {
        memcpy(traits->values, model->calibration->values,
               SRNF_NORM_TRAITS * norms->n * sizeof(double));
        return SRNF_OK;
    }
    return stats_run(norms->context, norms->subjects.count, leave_out, traits,
                     (struct stats_progress){0.0, PROGRESS_TRAITS, "leaving members out"}, error);
}

/* What the surface has about all members: in a cut model what that says, else as the members. */
static int find_own(const struct traits *traits, const double *q, const double *at,
                    double own[SRNF_NORM_TRAITS], struct srnf_error *error)
{
    const struct norms *norms = traits->norms;
    const struct srnf_norm_model *model = norms->model;
    const struct srnf_grid *grid = norms->grid;
    double *scores = srnf_alloc(model->pca->components, sizeof(double));
    struct norms_fold fold = {0};
    double residual;
    int status = SRNF_OK;

    if (!scores) {
        return SRNF_ENOMEM;
    }
    srnf_pca_project(grid, model->pca, model->mean_q, q, scores, &residual);
    if (model->columns == 0 && model->calibration) {
        own[SRNF_TRAIT_RESIDUAL] = residual;
        own[SRNF_TRAIT_DISTANCE] = sqrt(stats_distance2(grid, q, model->mean_q));
        own[SRNF_TRAIT_MAHALANOBIS] =
            srnf_mahalanobis(traits->counted, model->pca->eigenvalues, scores);
    } else {
        const struct norms_target target = {scores, at, residual * residual};

        status = norms_fold_open(&fold, norms, NORMS_NONE, NORMS_NONE, error);
        status =
            status ? status : norms_describe(norms, &fold, traits->counted, 1, &target, 1, own);
        norms_fold_clear(&fold);
    }
    srnf_free(scores);
    return status;
}

/* Ranks of the surface, or of the member that it is among those of other subjects. */
static int rank_all(const struct traits *traits, size_t member, const double own[SRNF_NORM_TRAITS],
                    struct srnf_score *score)
{
    const struct norms *norms = traits->norms;
    size_t left_out = member < norms->n ? norms->subjects.of[member] : NORMS_NONE;
    double *others = srnf_alloc(3, norms->n * sizeof(double));
    const double both[2] = {own[SRNF_TRAIT_RESIDUAL], own[SRNF_TRAIT_MAHALANOBIS]};
    size_t count = 0;
    size_t at = 0;
    int status = others ? SRNF_OK : SRNF_ENOMEM;

    for (size_t t = 0; t < SRNF_NORM_TRAITS && status == SRNF_OK; t++) {
        status =
            norms_rank(norms, traits->values + t * norms->n, left_out, own[t], &score->trait[t]);
    }
    for (size_t i = 0; i < norms->n; i++) {
        count += norms->subjects.of[i] != left_out;
    }
    for (size_t i = 0; i < norms->n && status == SRNF_OK; i++) {
        if (norms->subjects.of[i] != left_out) {
            others[at] = traits->values[SRNF_TRAIT_RESIDUAL * norms->n + i];
            others[count + at] = traits->values[SRNF_TRAIT_MAHALANOBIS * norms->n + i];
            others[2 * count + at++] = norms->weights[i];
        }
    }
    if (status == SRNF_OK) {
        status =
            srnf_norm_rank_together(count, 2, others, others + 2 * count, both, &score->overall);
    }
    srnf_free(others);
    return status;
}

/* Whether the members are left out of a model that has the surface as well. */
static bool takes_surface_in(const struct norms *norms, size_t member)
{
    return norms->model->complete && member >= norms->n &&
           (norms->model->columns > 0 || norms->subjects.count <= SRNF_NORM_CHECK_MAX);
}

static int find_traits(struct traits *traits, const double *q,
                       const struct srnf_norm_options *options, struct srnf_score *score,
                       struct srnf_error *error)
{
    const struct norms *norms = traits->norms;
    double own[SRNF_NORM_TRAITS] = {0.0};
    struct norms_fold fold = {0};
    int status;

    traits->counted = srnf_mahalanobis_components(
        norms->subjects.count, norms->model->pca->components, norms->model->pca->eigenvalues);
    status = norms_fold_open(&fold, norms, NORMS_NONE, NORMS_NONE, error);
    if (status == SRNF_OK && norms->model->columns > 0) {
        status = norms_count(norms, &fold, &traits->counted);
    }
    norms_fold_clear(&fold);
    if (status == SRNF_OK && takes_surface_in(norms, options->member)) {
        status =
            norms_values_with(norms, q, options->at, traits->counted,
                              (struct stats_progress){0.0, PROGRESS_TRAITS, "leaving members out"},
                              traits->values, error);
    } else if (status == SRNF_OK) {
        status = find_values(traits, error);
    }
    if (status == SRNF_OK && options->member < norms->n) {
        for (size_t t = 0; t < SRNF_NORM_TRAITS; t++) {
            own[t] = traits->values[t * norms->n + options->member];
        }
    } else if (status == SRNF_OK) {
        status = find_own(traits, q, options->at, own, error);
    }
    score->counted = traits->counted;
    return status ? status : rank_all(traits, options->member, own, score);
}

/* ---- The run --------------------------------------------------------------------------------- */

static int open_map(struct srnf_score *score, size_t degree, size_t points)
{
    double **maps[] = {&score->deviation, &score->spread, &score->z, &score->significance};

    score->n_points = points;
    score->coefficients = srnf_alloc(srnf_coefficient_count(degree), 3 * sizeof(double));
    for (size_t k = 0; k < sizeof maps / sizeof maps[0]; k++) {
        *maps[k] = srnf_alloc(points, sizeof(double));
        if (!*maps[k]) {
            return SRNF_ENOMEM;
        }
    }
    return score->coefficients ? SRNF_OK : SRNF_ENOMEM;
}

static int make_map(const struct norms *norms, const double *q,
                    const struct srnf_norm_options *options, double from, struct srnf_score *score,
                    struct srnf_error *error)
{
    int status = open_map(score, srnf_sht_degree(norms->sht), norms->points);

    return status ? status
                  : norms_map(norms, q, options,
                              (struct stats_progress){from, 1.0, "inverting the members"}, score,
                              error);
}

static int compute(const struct norms *norms, const double *q,
                   const struct srnf_norm_options *options, struct srnf_score *score,
                   struct srnf_error *error)
{
    struct traits traits = {.norms = norms};
    size_t count = norms->subjects.count;
    int status = SRNF_ENOMEM;

    traits.values = srnf_alloc(SRNF_NORM_TRAITS, norms->n * sizeof(double));
    if (traits.values) {
        status = find_traits(&traits, q, options, score, error);
    }
    if (status == SRNF_OK && options->check && norms->model->complete &&
        count >= SRNF_NORM_CHECK_MIN + 2 * norms->model->columns && count <= SRNF_NORM_CHECK_MAX) {
        status = norms_check(
            norms, traits.counted,
            (struct stats_progress){PROGRESS_TRAITS, PROGRESS_CHECK, "calibrating percentiles"},
            &score->check, error);
    }
    if (status == SRNF_OK && options->map) {
        status = make_map(norms, q, options, PROGRESS_CHECK, score, error);
    }
    srnf_free(traits.values);
    return status;
}

/* What is given, ready to be used; norms_close in any case. */
static int open_run(const struct srnf_sht *sht, const struct srnf_norm_model *model,
                    const double *q, const struct srnf_norm_options *options,
                    const struct srnf_context *context, struct norms *norms,
                    struct srnf_error *error)
{
    int status;

    *norms = (struct norms){.sht = sht,
                            .grid = model->grid ? model->grid : srnf_sht_grid(sht),
                            .model = model,
                            .context = context,
                            .n = model->pca->n};
    norms->points = stats_points(norms->grid);
    status = open_norms(norms, error);
    return status ? status : check(norms, q, options, error);
}

/* Ends a run: what it found becomes the result unless it failed. */
static int close_run(struct norms *norms, const struct srnf_norm_options *options, int status,
                     struct srnf_score *found, struct srnf_score *score, struct srnf_error *first,
                     struct srnf_error *error)
{
    if (status == SRNF_OK && srnf_is_canceled(norms->context)) {
        status = SRNF_ECANCELED;
    }
    found->n = norms->n;
    found->subjects = norms->subjects.count;
    found->compared = norms->subjects.count - (options->member < norms->n);
    subjects_clear(&norms->subjects);
    srnf_free(norms->weights);
    if (status) {
        srnf_score_clear(found);
        return stats_fail(error, status, first);
    }
    *score = *found;
    return SRNF_OK;
}

/* The score of q, or, where asked, its map alone. */
static int run(const struct srnf_sht *sht, const struct srnf_norm_model *model, const double *q,
               const struct srnf_norm_options *options, const struct srnf_context *context,
               bool map_alone, struct srnf_score *score, struct srnf_error *error)
{
    struct srnf_norm_options defaults = srnf_norm_options_defaults();
    struct srnf_score found = {0};
    struct srnf_error first = {0};
    struct norms norms;
    int status;

    options = options ? options : &defaults;
    status = open_run(sht, model, q, options, context, &norms, &first);
    if (status == SRNF_OK && map_alone) {
        status = make_map(&norms, q, options, 0.0, &found, &first);
    } else if (status == SRNF_OK && options->map && model->grid &&
               model->grid != srnf_sht_grid(sht)) {
        status = srnf_fail(&first, SRNF_EINVAL, -1, "stacked fields have no map");
    } else if (status == SRNF_OK) {
        status = compute(&norms, q, options, &found, &first);
    }
    return close_run(&norms, options, status, &found, score, &first, error);
}

int srnf_score(const struct srnf_sht *sht, const struct srnf_norm_model *model, const double *q,
               const struct srnf_norm_options *options, const struct srnf_context *context,
               struct srnf_score *score, struct srnf_error *error)
{
    return run(sht, model, q, options, context, false, score, error);
}

int srnf_norm_map(const struct srnf_sht *sht, const struct srnf_norm_model *model, const double *q,
                  const struct srnf_norm_options *options, const struct srnf_context *context,
                  struct srnf_score *score, struct srnf_error *error)
{
    return run(sht, model, q, options, context, true, score, error);
}

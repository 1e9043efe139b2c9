/*
 * model.c - surfaces from scores, and scores from a surface.
 *
 * A point of the model, q = mean_q + sum_k c_k mode_k, need not be the SRNF of any surface: it is
 * inverted to the nearest one, and the relative energy says how far that is. Each inversion starts
 * from a surface nearby, that of another point or the mean. Points are done in rounds: a round
 * has all whose start is known, in parallel; every inversion sees the same start whatever the
 * number of workers.
 *
 * An SRNF does not know translations: surfaces are moved to their area centroids.
 */
#include "compute/model.h"
#include "compute/mirror.h"
#include "store/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SHARE_MESH 20.0 /* percent of a projection that encoding a mesh takes */

/* ---- The model ------------------------------------------------------------------------------- */

void compute_model_clear(struct compute_model *model)
{
    store_model_clear(&model->stored);
    compute_surface_clear(&model->mean);
}

static struct srnf_pca view_of(const struct store_model *stored)
{
    return (struct srnf_pca){.n = (size_t)stored->subjects,
                             .components = (size_t)stored->components,
                             .eigenvalues = stored->arrays[STORE_MODEL_EIGENVALUES],
                             .modes = stored->arrays[STORE_MODEL_MODES],
                             .scores = stored->arrays[STORE_MODEL_SCORES]};
}

int compute_model_load(struct jobs_run *run, const char *id, struct compute_model *model,
                       struct jobs_result *result)
{
    struct store_model *stored = &model->stored;
    int status;

    *model = (struct compute_model){0};
    status = store_model_get(jobs_run_store(run), id, (1u << STORE_MODEL_ARRAYS) - 1, stored);
    if (status) {
        return compute_fail_store(result, status, id);
    }
    model->pca = view_of(stored);
    status = compute_surface_load(run, stored->mean, 0.0, &model->mean, result);
    if (status) {
        compute_model_clear(model);
    }
    return status;
}

static int acquire(struct jobs_run *run, const struct compute_model *model,
                   const struct srnf_sht **sht, struct jobs_result *result)
{
    const struct store_model *stored = &model->stored;
    int status =
        jobs_transform_acquire(jobs_run_jobs(run), (size_t)stored->lmax, SRNF_GRID_GAUSS_LEGENDRE,
                               (size_t)stored->n_theta, (size_t)stored->n_phi, sht);

    return status ? compute_fail(result, status, NULL, "preparing the harmonic transform") : 0;
}

/* ---- Surfaces from scores -------------------------------------------------------------------- */

struct point {
    int status;
    bool done;
    struct srnf_error error;
};

struct work {
    const struct compute_model *model;
    const struct srnf_sht *sht;
    struct srnf_context context; /* the run's, without its progress */
    const double *scores;
    const size_t *before;
    struct point *points;
    size_t *round; /* indices of the points of this round */
    struct compute_reconstruction *out;
};

int compute_invert_point(const struct srnf_sht *sht, const struct store_model *stored,
                         const double *start, const double *scores,
                         const struct srnf_context *context, struct srnf_inversion *out,
                         struct srnf_error *error)
{
    const struct srnf_pca pca = view_of(stored);
    struct srnf_invert_options options = srnf_invert_options_defaults();
    double *q = srnf_alloc(store_model_count(stored, STORE_MODEL_MEAN_Q), sizeof(double));
    int status = SRNF_ENOMEM;

    if (q) {
        srnf_pca_reconstruct(srnf_sht_grid(sht), &pca, stored->arrays[STORE_MODEL_MEAN_Q], scores,
                             q);
        options.initial = SRNF_INITIAL_SURFACE;
        options.surface = start;
        options.certify = false;
        status = srnf_invert(sht, q, &options, context, out, error);
    }
    srnf_free(q);
    return status;
}

static void invert_one(void *argument, size_t index)
{
    struct work *work = argument;
    const struct compute_model *model = work->model;
    struct compute_reconstruction *out = work->out;
    size_t i = work->round[index], before = work->before[i];
    size_t count = 3 * srnf_coefficient_count((size_t)model->stored.lmax);
    const double *start =
        before < out->n ? out->coefficients + before * count : model->mean.coefficients;
    struct srnf_inversion inversion = {0};
    struct point *point = &work->points[i];

    point->done = true;
    if (work->context.canceled(work->context.user)) {
        point->status = SRNF_ECANCELED;
        return;
    }
    point->status = compute_invert_point(work->sht, &model->stored, start,
                                         work->scores + i * model->pca.components, &work->context,
                                         &inversion, &point->error);
    if (point->status >= 0) {
        memcpy(out->coefficients + i * count, inversion.coefficients, count * sizeof(double));
        out->relative_energy[i] = inversion.relative_energy;
        srnf_inversion_clear(&inversion);
    }
}

/* Fills the next round: the points whose start is there. Returns how many. */
static size_t next_round(struct work *work)
{
    size_t n = work->out->n, count = 0;

    for (size_t i = 0; i < n; i++) {
        size_t before = work->before[i];
        if (!work->points[i].done && (before >= n || work->points[before].done)) {
            work->round[count++] = i;
        }
    }
    return count;
}

/* Status of the first point that failed, with the problem set; 0 if none did. */
static int first_failure(const struct work *work, struct jobs_result *result)
{
    for (size_t i = 0; i < work->out->n; i++) {
        const struct point *point = &work->points[i];
        if (point->status < 0) {
            return compute_fail(result, point->status, &point->error,
                                "inverting a point of the model");
        }
    }
    return 0;
}

static int invert_all(struct jobs_run *run, struct work *work, struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    size_t done = 0, count;
    int status = 0;

    while (status == 0 && (count = next_round(work)) > 0) {
        context->parallel_for(context->user, count, invert_one, work);
        done += count;
        context->progress(context->user, (double)done / (double)work->out->n, "inverting");
        status = first_failure(work, result);
    }
    return status;
}

void compute_reconstruction_clear(struct compute_reconstruction *out)
{
    srnf_free(out->coefficients);
    srnf_free(out->relative_energy);
    srnf_free(out->measures);
    *out = (struct compute_reconstruction){0};
}

static int measure_all(struct jobs_run *run, size_t degree, struct compute_reconstruction *out,
                       struct jobs_result *result)
{
    const double origin[3] = {0.0, 0.0, 0.0};
    size_t count = 3 * srnf_coefficient_count(degree);
    int status = compute_measure(run, degree, out->n, out->coefficients, out->measures, result);

    for (size_t i = 0; status == 0 && i < out->n; i++) {
        srnf_surface_move(degree, out->coefficients + i * count, &out->measures[i], origin);
    }
    return status;
}

int compute_reconstruct(struct jobs_run *run, const struct compute_model *model, size_t n,
                        const double *scores, const size_t *before,
                        struct compute_reconstruction *out, struct jobs_result *result)
{
    size_t degree = (size_t)model->stored.lmax;
    struct work work = {.model = model,
                        .context = *jobs_run_context(run),
                        .scores = scores,
                        .before = before,
                        .out = out};
    int status = SRNF_ENOMEM;

    work.context.progress = NULL;
    *out = (struct compute_reconstruction){.n = n};
    out->coefficients = srnf_alloc(n, 3 * srnf_coefficient_count(degree) * sizeof(double));
    out->relative_energy = srnf_alloc(n, sizeof(double));
    out->measures = srnf_alloc(n, sizeof *out->measures);
    work.points = srnf_alloc(n, sizeof *work.points);
    work.round = srnf_alloc(n, sizeof *work.round);
    if (!out->coefficients || !out->relative_energy || !out->measures || !work.points ||
        !work.round) {
        (void)compute_fail(result, status, NULL, "inverting points of the model");
        goto out;
    }
    jobs_run_phase(run, 100.0);
    status = acquire(run, model, &work.sht, result);
    if (status == 0) {
        status = invert_all(run, &work, result);
        jobs_transform_release(jobs_run_jobs(run), work.sht);
    }
    if (status == 0) {
        status = measure_all(run, degree, out, result);
    }
out:
    srnf_free(work.points);
    srnf_free(work.round);
    if (status) {
        compute_reconstruction_clear(out);
    }
    return status;
}

/* ---- Scores from a surface ------------------------------------------------------------------- */

/* The SRNF of the surface: registered to the mean, or as it is. */
static int make_field(struct jobs_run *run, const struct compute_model *model,
                      const struct srnf_sht *sht, const double *coefficients,
                      const struct srnf_register_options *registration, double *q,
                      struct jobs_result *result)
{
    size_t count = store_model_count(&model->stored, STORE_MODEL_MEAN_Q);
    struct srnf_registration registered = {0};
    struct srnf_error error = {0};
    void *workspace;
    int status;

    if (!registration) {
        workspace = srnf_alloc(srnf_surface_workspace_size(sht), 1);
        if (!workspace) {
            return compute_fail(result, SRNF_ENOMEM, NULL, "sampling the SRNF");
        }
        srnf_field(sht, coefficients, q, workspace);
        srnf_free(workspace);
        return 0;
    }
    status = srnf_register(sht, NULL, model->stored.arrays[STORE_MODEL_MEAN_Q], coefficients,
                           registration, NULL, jobs_run_context(run), &registered, &error);
    if (status < 0) {
        return compute_fail(result, status, &error, "registering to the mean");
    }
    memcpy(q, registered.q, count * sizeof(double));
    srnf_registration_clear(&registered);
    return 0;
}

/* ||a - b||, a is overwritten. */
static double distance_of(const struct srnf_grid *grid, double *a, const double *b, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        a[i] -= b[i];
    }
    return sqrt(srnf_inner_product(grid, a, a));
}

/* The subject that the surface is, or n. */
static size_t find_subject(const struct compute_subjects *subjects,
                           const struct compute_surface *surface)
{
    size_t i = 0;

    while (i < subjects->n && strcmp(subjects->contents[i], surface->content) != 0 &&
           strcmp(subjects->contents[i], surface->surface) != 0 &&
           strcmp(subjects->contents[i], surface->older) != 0) {
        i++;
    }
    return i;
}

/* The surface at the degree of the model (owned by the caller), and which subject it is. */
static double *load_subject(struct jobs_run *run, const struct compute_model *model, const char *id,
                            const struct compute_subjects *subjects, size_t *subject,
                            struct jobs_result *result)
{
    size_t degree = (size_t)model->stored.lmax;
    struct compute_surface loaded = {0};
    double *coefficients = NULL;

    if (compute_surface_load(run, id, SHARE_MESH, &loaded, result) == 0) {
        coefficients = srnf_alloc(srnf_coefficient_count(degree), 3 * sizeof(double));
        if (coefficients) {
            srnf_surface_change_degree(loaded.degree, loaded.coefficients, degree, coefficients);
            *subject = find_subject(subjects, &loaded);
        } else {
            (void)compute_fail(result, SRNF_ENOMEM, NULL, "projecting");
        }
    }
    compute_surface_clear(&loaded);
    jobs_run_phase(run, 100.0);
    return coefficients;
}

/* How the surface is turned, and what that is to its scores; turned: scratch like q. */
static int compare_pose(const struct compute_model *model, const struct srnf_grid *grid,
                        const double *q, struct compute_projection *out)
{
    const double *mean_q = model->stored.arrays[STORE_MODEL_MEAN_Q];
    size_t points = grid->n_theta * grid->n_phi;
    double *turned = srnf_alloc(3 * points, sizeof(double));
    double *scores = srnf_alloc(model->pca.components, sizeof(double));
    double rotation[9];

    if (turned && scores) {
        out->angle = srnf_pose_angle(grid, mean_q, q, rotation);
        for (size_t r = 0; r < 3; r++) {
            for (size_t c = 0; c < 3; c++) {
                for (size_t k = 0; k < points; k++) {
                    turned[r * points + k] += rotation[3 * r + c] * q[c * points + k];
                }
            }
        }
        srnf_pca_project(grid, &model->pca, mean_q, turned, scores, NULL);
        for (size_t k = 0; k < out->counted; k++) {
            out->turn_back = fmax(out->turn_back, fabs(scores[k] - out->scores[k]) /
                                                      sqrt(model->pca.eigenvalues[k]));
        }
    }
    srnf_free(turned);
    srnf_free(scores);
    return turned && scores ? 0 : SRNF_ENOMEM;
}

/* Each value among those of the model's subjects; subject below n: it is that one. */
static int judge(const struct compute_model *model, const double *weights, size_t subject,
                 struct compute_projection *out, struct jobs_result *result)
{
    const double *values = model->stored.arrays[STORE_MODEL_CALIBRATION];
    const double own[SRNF_CALIBRATION_TRAITS] = {
        [SRNF_TRAIT_RESIDUAL] = out->residual,
        [SRNF_TRAIT_DISTANCE] = out->distance,
        [SRNF_TRAIT_MAHALANOBIS] = out->mahalanobis,
        [SRNF_TRAIT_ANGLE] = out->angle,
    };
    size_t n = model->pca.n;
    int status = 0;

    out->calibrated = values != NULL;
    if (out->calibrated && subject < n) {
        out->angle = values[SRNF_TRAIT_ANGLE * n + subject];
    }
    for (size_t t = 0; t < SRNF_CALIBRATION_TRAITS && out->calibrated && status == 0; t++) {
        status = srnf_typicality_of((enum srnf_trait)t, n, values + t * n, weights,
                                    subject < n ? values[t * n + subject] : own[t],
                                    SRNF_TYPICAL_ALPHA, &out->typicality[t]);
    }
    /* A value that is no number is refused: the surface is beyond double precision. */
    status = status == SRNF_EINVAL ? SRNF_ENUMERIC : status;
    return status ? compute_fail(result, status, NULL, "comparing with the model's subjects") : 0;
}

/* What the model tells of its subject. */
static void project_known(const struct compute_model *model, const struct srnf_grid *grid,
                          const struct compute_subjects *subjects, size_t subject,
                          struct compute_projection *out)
{
    size_t components = model->pca.components;

    srnf_pca_reconstruct(grid, &model->pca, model->stored.arrays[STORE_MODEL_MEAN_Q],
                         model->pca.scores + subject * components, out->q);
    memcpy(out->scores, model->pca.scores + subject * components, components * sizeof(double));
    out->residual = subjects->residuals[subject];
    out->distance = subjects->distances[subject];
}

static int project_anew(struct jobs_run *run, const struct compute_model *model,
                        const struct srnf_sht *sht, const double *coefficients,
                        const struct srnf_register_options *registration, double *q,
                        struct compute_projection *out, struct jobs_result *result)
{
    const double *mean_q = model->stored.arrays[STORE_MODEL_MEAN_Q];
    size_t count = store_model_count(&model->stored, STORE_MODEL_MEAN_Q);
    int status = make_field(run, model, sht, coefficients, registration, q, result);

    if (status == 0) {
        srnf_pca_project(srnf_sht_grid(sht), &model->pca, mean_q, q, out->scores, &out->residual);
        status = out->poses ? compare_pose(model, srnf_sht_grid(sht), q, out) : 0;
        memcpy(out->q, q, count * sizeof(double));
        out->distance = distance_of(srnf_sht_grid(sht), q, mean_q, count);
        if (status) {
            (void)compute_fail(result, status, NULL, "comparing poses");
        }
    }
    return status;
}

int compute_project(struct jobs_run *run, const struct compute_model *model, const char *surface,
                    const struct srnf_register_options *registration,
                    const struct compute_subjects *subjects, struct compute_projection *out,
                    struct jobs_result *result)
{
    const double *mean_q = model->stored.arrays[STORE_MODEL_MEAN_Q];
    size_t count = store_model_count(&model->stored, STORE_MODEL_MEAN_Q), subject = 0;
    const struct srnf_sht *sht = NULL;
    double *q = srnf_alloc(count, sizeof(double)), *coefficients = NULL;
    int status = SRNF_ENOMEM;

    *out = (struct compute_projection){
        .scores = srnf_alloc(model->pca.components, sizeof(double)),
        .q = srnf_alloc(count, sizeof(double)),
        .poses = !registration || registration->common_pose,
        .subjects = subjects->count,
        .counted = srnf_mahalanobis_components(subjects->count, model->pca.components,
                                               model->pca.eigenvalues)};
    if (!q || !out->scores || !out->q) {
        (void)compute_fail(result, status, NULL, "projecting");
        goto out;
    }
    coefficients = load_subject(run, model, surface, subjects, &subject, result);
    status = coefficients ? acquire(run, model, &sht, result) : SRNF_ENOMEM;
    if (status) {
        goto out;
    }
    out->training_subject = subject < subjects->n;
    out->member = out->training_subject ? subject : model->pca.n;
    status = make_field(run, model, sht, coefficients, NULL, q, result);
    if (status == 0) {
        out->distance_before = distance_of(srnf_sht_grid(sht), q, mean_q, count);
        if (registration && out->training_subject) {
            project_known(model, srnf_sht_grid(sht), subjects, subject, out);
        } else {
            status = project_anew(run, model, sht, coefficients, registration, q, out, result);
        }
    }
    if (status == 0) {
        out->mahalanobis = srnf_mahalanobis(out->counted, model->pca.eigenvalues, out->scores);
        status = judge(model, subjects->weights, out->training_subject ? subject : model->pca.n,
                       out, result);
    }
    jobs_transform_release(jobs_run_jobs(run), sht);
out:
    srnf_free(q);
    srnf_free(coefficients);
    if (status) {
        compute_projection_clear(out);
    }
    return status;
}

void compute_projection_clear(struct compute_projection *projection)
{
    srnf_free(projection->scores);
    srnf_free(projection->q);
    projection->scores = projection->q = NULL;
}

/* From the nearest member of the model, as its components tell. */
static double nearest_of(const struct compute_model *model, const double *scores, double residual)
{
    size_t components = model->pca.components;
    double nearest2 = INFINITY;

    for (size_t i = 0; i < model->pca.n; i++) {
        double sum = residual * residual;

        for (size_t k = 0; k < components; k++) {
            double d = scores[k] - model->pca.scores[i * components + k];

            sum += d * d;
        }
        nearest2 = fmin(nearest2, sum);
    }
    return sqrt(nearest2);
}

/* The same of the mirror image, registered as the surface was. Overwrites the coefficients. */
static int measure_image(struct jobs_run *run, const struct compute_model *model,
                         const struct srnf_sht *sht, double *coefficients,
                         const struct srnf_register_options *registration, double *distance,
                         struct jobs_result *result)
{
    size_t count = store_model_count(&model->stored, STORE_MODEL_MEAN_Q);
    double *q = srnf_alloc(count + model->pca.components, sizeof(double)), residual;
    int status;

    if (!q) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "trying the mirror image");
    }
    srnf_surface_mirror((size_t)model->stored.lmax, coefficients);
    status = make_field(run, model, sht, coefficients, registration, q, result);
    if (status == 0) {
        srnf_pca_project(srnf_sht_grid(sht), &model->pca, model->stored.arrays[STORE_MODEL_MEAN_Q],
                         q, q + count, &residual);
        *distance = nearest_of(model, q + count, residual);
    }
    srnf_free(q);
    return status;
}

int compute_project_mirrored(struct jobs_run *run, const struct compute_model *model,
                             const char *surface, const struct srnf_register_options *registration,
                             const struct compute_projection *projection,
                             struct compute_mirror_trial *trial, struct jobs_result *result)
{
    const struct compute_subjects nobody = {.n = 0};
    const struct srnf_sht *sht = NULL;
    size_t subject;
    double *coefficients = load_subject(run, model, surface, &nobody, &subject, result);
    int status = coefficients ? acquire(run, model, &sht, result) : SRNF_ENOMEM;

    *trial = (struct compute_mirror_trial){
        .distance = nearest_of(model, projection->scores, projection->residual)};
    if (status == 0) {
        status =
            measure_image(run, model, sht, coefficients, registration, &trial->mirrored, result);
        jobs_transform_release(jobs_run_jobs(run), sht);
    }
    srnf_free(coefficients);
    return status;
}

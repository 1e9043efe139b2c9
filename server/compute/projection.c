/*
 * projection.c - scores of a surface in a model that was made before, and how usual they are among
 * those of the model's members.
 */
#include "compute/model.h"
#include "compute/mirror.h"
#include "store/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SHARE_MESH 20.0 /* percent of a projection that encoding a mesh takes */

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
    status = coefficients ? compute_model_transform(run, model, &sht, result) : SRNF_ENOMEM;
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
    int status = coefficients ? compute_model_transform(run, model, &sht, result) : SRNF_ENOMEM;

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

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

/* What a projection works on. */
struct projecting {
    struct jobs_run *run;
    const struct compute_model *model;
    const struct srnf_register_options *registration;
    const struct srnf_sht *sht;
    struct srnf_stack stack;
    size_t own, size;     /* numbers of a field of one part, and of all */
    double *coefficients; /* [parts][3][(L+1)^2] of the surfaces, at the model's degree */
    double positions[3 * SRNF_PARTS_MAX];
    double *scratch; /* [2][own] */
    struct jobs_result *result;
};

static void close_projecting(struct projecting *p)
{
    srnf_stack_clear(&p->stack);
    srnf_free(p->coefficients);
    srnf_free(p->scratch);
    jobs_transform_release(jobs_run_jobs(p->run), p->sht);
}

/* Of a part: registered to its mean, or as it is. */
static int make_field(const struct projecting *p, size_t part,
                      const struct srnf_register_options *registration, const double *mean_q,
                      double *q)
{
    size_t degree = (size_t)p->model->stored.lmax;
    const double *coefficients = p->coefficients + part * 3 * srnf_coefficient_count(degree);
    struct srnf_registration registered = {0};
    struct srnf_error error = {0};
    void *workspace;
    int status;

    if (!registration) {
        workspace = srnf_alloc(srnf_surface_workspace_size(p->sht), 1);
        if (!workspace) {
            return compute_fail(p->result, SRNF_ENOMEM, NULL, "sampling the SRNF");
        }
        srnf_field(p->sht, coefficients, q, workspace);
        srnf_free(workspace);
        return 0;
    }
    status = srnf_register(p->sht, NULL, mean_q, coefficients, registration, NULL,
                           jobs_run_context(p->run), &registered, &error);
    if (status < 0) {
        return compute_fail(p->result, status, &error, "registering to the mean");
    }
    memcpy(q, registered.q, p->own * sizeof(double));
    srnf_registration_clear(&registered);
    return 0;
}

/* The SRNFs of all parts and their positions, stacked. */
static int make_fields(const struct projecting *p, const struct srnf_register_options *registration,
                       double *q)
{
    const double *mean_q = p->model->stored.arrays[STORE_MODEL_MEAN_Q];
    int status = 0;

    for (size_t part = 0; part < p->stack.parts && status == 0; part++) {
        srnf_stack_take(&p->stack, part, mean_q, p->scratch);
        status = make_field(p, part, registration, p->scratch, p->scratch + p->own);
        srnf_stack_put(&p->stack, part, p->scratch + p->own, q);
    }
    srnf_stack_put_positions(&p->stack, p->positions, q);
    return status;
}

/* ||a - b||, a is overwritten. */
static double distance_of(const struct srnf_grid *grid, double *a, const double *b, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        a[i] -= b[i];
    }
    return sqrt(srnf_inner_product(grid, a, a));
}

static bool is_content(const char *content, const struct compute_surface *surface)
{
    return strcmp(content, surface->content) == 0 || strcmp(content, surface->surface) == 0 ||
           strcmp(content, surface->older) == 0;
}

/* The subject whose surfaces all are these, or n. */
static size_t find_subject(const struct compute_subjects *subjects, size_t n_parts,
                           const struct compute_surface *loaded)
{
    size_t i = 0, part = 0;

    while (i < subjects->n && part < n_parts) {
        bool same = is_content(subjects->contents[part * subjects->n + i], &loaded[part]);

        i += !same;
        part = same ? part + 1 : 0;
    }
    return i;
}

static int load_surfaces(struct projecting *p, const struct compute_projected *projected,
                         const struct compute_subjects *subjects, struct compute_surface *loaded,
                         size_t *subject)
{
    size_t n_parts = p->model->joint.n_parts, degree = (size_t)p->model->stored.lmax;
    size_t count = 3 * srnf_coefficient_count(degree);
    const double *numbers[SRNF_PARTS_MAX];
    int status = 0;

    for (size_t part = 0; part < n_parts && status == 0; part++) {
        numbers[part] = p->coefficients + part * count;
        jobs_run_phase(p->run, compute_is_mesh(projected->surfaces[part])
                                   ? SHARE_MESH / (double)n_parts
                                   : 0.0);
        status =
            compute_surface_load_within(p->run, jobs_run_context(p->run), projected->surfaces[part],
                                        false, projected->mesh_degree, &loaded[part], p->result);
        if (status == 0) {
            srnf_surface_change_degree(loaded[part].degree, loaded[part].coefficients, degree,
                                       p->coefficients + part * count);
        }
    }
    if (status == 0) {
        *subject = find_subject(subjects, n_parts, loaded);
    }
    if (status == 0 && p->stack.positions) {
        status =
            projected->place(p->run, p->sht, n_parts, loaded, numbers, p->positions, p->result);
    }
    return status;
}

/* The surfaces at the degree of the model, and which subject they are; close_projecting in any
   case. */
static int open_projecting(struct projecting *p, const struct compute_projected *projected,
                           const struct compute_subjects *subjects, size_t *subject)
{
    size_t n_parts = p->model->joint.n_parts;
    size_t count = 3 * srnf_coefficient_count((size_t)p->model->stored.lmax);
    struct compute_surface *loaded;
    int status = compute_model_transform(p->run, p->model, &p->sht, p->result);

    status = status ? status : compute_model_stack(p->model, p->sht, &p->stack, p->result);
    if (status) {
        return status;
    }
    p->own = 3 * p->stack.own->n_theta * p->stack.own->n_phi;
    p->size = store_model_count(&p->model->stored, STORE_MODEL_MEAN_Q);
    p->coefficients = srnf_alloc(n_parts * count, sizeof(double));
    p->scratch = srnf_alloc(2 * p->own, sizeof(double));
    loaded = srnf_alloc(n_parts, sizeof *loaded);
    status = p->coefficients && p->scratch && loaded
                 ? load_surfaces(p, projected, subjects, loaded, subject)
                 : compute_fail(p->result, SRNF_ENOMEM, NULL, "projecting");
    for (size_t part = 0; loaded && part < n_parts; part++) {
        compute_surface_clear(&loaded[part]);
    }
    srnf_free(loaded);
    jobs_run_phase(p->run, 100.0);
    return status;
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

static int project_anew(const struct projecting *p, double *q, struct compute_projection *out)
{
    const struct srnf_grid *grid = &p->stack.grid;
    const double *mean_q = p->model->stored.arrays[STORE_MODEL_MEAN_Q];
    int status = make_fields(p, p->registration, q);

    if (status == 0) {
        srnf_pca_project(grid, &p->model->pca, mean_q, q, out->scores, &out->residual);
        status = out->poses ? compare_pose(p->model, grid, q, out) : 0;
        memcpy(out->q, q, p->size * sizeof(double));
        out->distance = distance_of(grid, q, mean_q, p->size);
        if (status) {
            (void)compute_fail(p->result, status, NULL, "comparing poses");
        }
    }
    return status;
}

/* Of each part and of the positions. before: the fields before registration less the mean; both are
   overwritten. */
static void contribute(const struct projecting *p, bool known, double *before, double *after,
                       struct compute_projection *out)
{
    const struct srnf_pca *pca = &p->model->pca;
    const double *mean_q = p->model->stored.arrays[STORE_MODEL_MEAN_Q];
    double square = out->mahalanobis * out->mahalanobis;

    for (size_t i = 0; i < p->size; i++) {
        after[i] = out->q[i] - mean_q[i];
    }
    for (size_t part = 0; part <= p->stack.parts; part++) {
        struct compute_contribution *own = &out->parts[part];

        own->distance = sqrt(srnf_stack_product(&p->stack, part, after, after));
        own->distance_before = sqrt(srnf_stack_product(&p->stack, part, before, before));
        for (size_t k = 0; k < out->counted && square > 0.0; k++) {
            own->share += srnf_stack_product(&p->stack, part, after, pca->modes + k * p->size) *
                          out->scores[k] / pca->eigenvalues[k] / square;
        }
    }
    for (size_t k = 0; k < pca->components; k++) {
        for (size_t i = 0; i < p->size; i++) {
            after[i] -= out->scores[k] * pca->modes[k * p->size + i];
        }
    }
    for (size_t part = 0; part <= p->stack.parts; part++) {
        out->parts[part].residual =
            known ? NAN : sqrt(srnf_stack_product(&p->stack, part, after, after));
    }
}

static int project(const struct projecting *p, const struct compute_subjects *subjects,
                   size_t subject, struct compute_projection *out)
{
    const double *mean_q = p->model->stored.arrays[STORE_MODEL_MEAN_Q];
    bool known = p->registration && out->training_subject;
    double *q = srnf_alloc(2 * p->size, sizeof(double));
    int status = q ? 0 : compute_fail(p->result, SRNF_ENOMEM, NULL, "projecting");

    status = status ? status : make_fields(p, NULL, q);
    if (status == 0) {
        out->distance_before = distance_of(&p->stack.grid, q, mean_q, p->size);
        if (known) {
            project_known(p->model, &p->stack.grid, subjects, subject, out);
        } else {
            status = project_anew(p, q + p->size, out);
        }
    }
    if (status == 0) {
        out->mahalanobis = srnf_mahalanobis(out->counted, p->model->pca.eigenvalues, out->scores);
        contribute(p, known, q, q + p->size, out);
        status = judge(p->model, subjects->weights, out->member, out, p->result);
    }
    srnf_free(q);
    return status;
}

int compute_project(struct jobs_run *run, const struct compute_model *model,
                    const struct compute_projected *projected,
                    const struct srnf_register_options *registration,
                    const struct compute_subjects *subjects, struct compute_projection *out,
                    struct jobs_result *result)
{
    size_t count = store_model_count(&model->stored, STORE_MODEL_MEAN_Q), subject = 0;
    struct projecting p = {
        .run = run, .model = model, .registration = registration, .result = result};
    int status;

    *out = (struct compute_projection){
        .scores = srnf_alloc(model->pca.components, sizeof(double)),
        .q = srnf_alloc(count, sizeof(double)),
        .parts = srnf_alloc(model->joint.n_parts + 1, sizeof *out->parts),
        .poses = !registration || registration->common_pose,
        .subjects = subjects->count,
        .counted = srnf_mahalanobis_components(subjects->count, model->pca.components,
                                               model->pca.eigenvalues)};
    if (out->scores && out->q && out->parts) {
        status = open_projecting(&p, projected, subjects, &subject);
    } else {
        status = compute_fail(result, SRNF_ENOMEM, NULL, "projecting");
    }
    if (status == 0) {
        out->training_subject = subject < subjects->n;
        out->member = out->training_subject ? subject : model->pca.n;
        status = project(&p, subjects, subject, out);
    }
    close_projecting(&p);
    if (status) {
        compute_projection_clear(out);
    }
    return status;
}

void compute_projection_clear(struct compute_projection *projection)
{
    srnf_free(projection->scores);
    srnf_free(projection->q);
    srnf_free(projection->parts);
    projection->scores = projection->q = NULL;
    projection->parts = NULL;
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
static int measure_image(struct projecting *p, double *distance)
{
    const struct compute_model *model = p->model;
    size_t degree = (size_t)model->stored.lmax;
    double *q = srnf_alloc(p->size + model->pca.components, sizeof(double)), residual;
    int status;

    if (!q) {
        return compute_fail(p->result, SRNF_ENOMEM, NULL, "trying the mirror image");
    }
    for (size_t part = 0; part < p->stack.parts; part++) {
        srnf_surface_mirror(degree, p->coefficients + part * 3 * srnf_coefficient_count(degree));
        p->positions[3 * part] = 0.0 - p->positions[3 * part];
    }
    status = make_fields(p, p->registration, q);
    if (status == 0) {
        srnf_pca_project(&p->stack.grid, &model->pca, model->stored.arrays[STORE_MODEL_MEAN_Q], q,
                         q + p->size, &residual);
        *distance = nearest_of(model, q + p->size, residual);
    }
    srnf_free(q);
    return status;
}

int compute_project_mirrored(struct jobs_run *run, const struct compute_model *model,
                             const struct compute_projected *projected,
                             const struct srnf_register_options *registration,
                             const struct compute_projection *projection,
                             struct compute_mirror_trial *trial, struct jobs_result *result)
{
    const struct compute_subjects nobody = {.n = 0};
    struct projecting p = {
        .run = run, .model = model, .registration = registration, .result = result};
    size_t subject;
    int status = open_projecting(&p, projected, &nobody, &subject);

    *trial = (struct compute_mirror_trial){
        .distance = nearest_of(model, projection->scores, projection->residual)};
    status = status ? status : measure_image(&p, &trial->mirrored);
    close_projecting(&p);
    return status;
}

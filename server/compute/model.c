/*
 * model.c - a model that was made before, and surfaces from scores in it.
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

/* ---- Parts ----------------------------------------------------------------------------------- */

struct compute_joint compute_joint_of_one(const struct store_model *stored)
{
    struct compute_joint joint = {.n_parts = 1, .weights = {1.0}};

    memcpy(joint.means[0], stored->mean, sizeof joint.means[0]);
    return joint;
}

size_t compute_joint_rows(const struct compute_joint *joint, const struct store_model *stored)
{
    size_t all = (size_t)stored->n_theta;
    size_t rows = joint->position_weight > 0.0 && all > 0 ? all - 1 : all;

    return rows % joint->n_parts == 0 ? rows / joint->n_parts : 0;
}

/* The rows of a part in place of those of all, in each of `count` fields. */
static int take_rows(double **fields, size_t count, size_t all, size_t from, size_t points)
{
    double *own = malloc(3 * count * points * sizeof(double));

    if (!own) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < 3 * count; i++) {
        memcpy(own + i * points, *fields + i * all + from, points * sizeof(double));
    }
    free(*fields);
    *fields = own;
    return 0;
}

int compute_joint_take(const struct compute_joint *joint, size_t part, struct store_model *stored)
{
    static const enum store_model_array fields[] = {STORE_MODEL_MEAN_Q, STORE_MODEL_MODES};
    size_t rows = compute_joint_rows(joint, stored), n_phi = (size_t)stored->n_phi;
    int status = 0;

    for (size_t i = 0; i < 2 && status == 0; i++) {
        double **array = &stored->arrays[fields[i]];
        size_t count = fields[i] == STORE_MODEL_MODES ? (size_t)stored->components : 1;

        if (*array) {
            status = take_rows(array, count, (size_t)stored->n_theta * n_phi, part * rows * n_phi,
                               rows * n_phi);
        }
    }
    stored->n_theta = (int64_t)rows;
    memcpy(stored->mean, joint->means[part], sizeof stored->mean);
    return status;
}

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

/* The surface that searches start at. An imported file may name one of another degree. */
static int load_mean(struct jobs_run *run, struct compute_model *model, struct jobs_result *result)
{
    int status = compute_surface_load(run, model->stored.mean, 0.0, &model->mean, result);

    if (status == 0 && model->mean.degree != (size_t)model->stored.lmax) {
        status = compute_fail_store(result, STORE_CORRUPT, model->stored.id);
    }
    return status;
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
    model->joint = compute_joint_of_one(stored);
    status = load_mean(run, model, result);
    if (status) {
        compute_model_clear(model);
    }
    return status;
}

int compute_model_part(struct jobs_run *run, const struct compute_model *model, size_t part,
                       struct compute_model *out, struct jobs_result *result)
{
    const char *id = model->stored.id;
    int status;

    *out = (struct compute_model){.pca = {.n = 0}};
    status = store_model_get(jobs_run_store(run), id, (1u << STORE_MODEL_ARRAYS) - 1, &out->stored);
    if (status) {
        return compute_fail_store(result, status, id);
    }
    if (compute_joint_take(&model->joint, part, &out->stored)) {
        status = compute_fail(result, SRNF_ENOMEM, NULL, "reading a part of the model");
    }
    out->pca = view_of(&out->stored);
    out->joint = compute_joint_of_one(&out->stored);
    status = status ? status : load_mean(run, out, result);
    if (status) {
        compute_model_clear(out);
    }
    return status;
}

int compute_model_stack(const struct compute_model *model, const struct srnf_sht *sht,
                        struct srnf_stack *stack, struct jobs_result *result)
{
    const struct compute_joint *joint = &model->joint;
    int status = srnf_stack_open(srnf_sht_grid(sht), joint->n_parts, joint->weights,
                                 joint->position_weight, stack);

    return status ? compute_fail(result, status, NULL, "reading the model") : 0;
}

int compute_model_transform(struct jobs_run *run, const struct compute_model *model,
                            const struct srnf_sht **sht, struct jobs_result *result)
{
    const struct store_model *stored = &model->stored;
    int status = jobs_transform_acquire(
        jobs_run_jobs(run), (size_t)stored->lmax, SRNF_GRID_GAUSS_LEGENDRE,
        compute_joint_rows(&model->joint, stored), (size_t)stored->n_phi, sht);

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

int compute_point_norm2(const struct srnf_sht *sht, const struct store_model *stored,
                        const double *scores, double *norm2)
{
    const struct srnf_pca pca = view_of(stored);
    size_t count = store_model_count(stored, STORE_MODEL_MEAN_Q);
    double *middle = srnf_alloc(count, sizeof(double)), *q = srnf_alloc(count, sizeof(double));
    int status = middle && q ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        srnf_pca_reconstruct(srnf_sht_grid(sht), &pca, middle, scores, q);
        *norm2 = srnf_inner_product(srnf_sht_grid(sht), q, q);
    }
    srnf_free(middle);
    srnf_free(q);
    return status;
}

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
    status = compute_model_transform(run, model, &work.sht, result);
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

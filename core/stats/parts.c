/*
 * parts.c - principal components of subjects that consist of several structures.
 *
 * A subject is the vector of the SRNFs of its parts, and of its positions, if they are asked for: a
 * stacked field (stack.c). So srnf_pca_fit does all of it, and of one part of weight 1 with the
 * same operations on the same numbers.
 *
 * A mode m of the stack is orthonormal in the weighted product: sum_p w_p ||m_p||^2 + w |x|^2 = 1.
 * These terms are the shares of the parts in it: what part of the component's variance is theirs.
 *
 * Memory beside the result: a copy of all fields, and what srnf_pca_fit takes.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

/* Fields of all subjects, stacked. */
struct fields {
    struct srnf_stack stack;
    size_t size;      /* numbers of one */
    double *mean, *q; /* [size], [n][size] */
};

static int check(size_t n, size_t n_parts, const double *positions, double position_weight)
{
    if (n < 2 || n_parts < 1 || n_parts > SRNF_PARTS_MAX ||
        (positions && !(position_weight > 0.0))) {
        return SRNF_EINVAL;
    }
    for (size_t i = 0; positions && i < 3 * n * n_parts; i++) {
        if (!isfinite(positions[i])) {
            return SRNF_EINVAL;
        }
    }
    return SRNF_OK;
}

/* The mean of the subjects' positions, in their order. */
static void average_positions(struct fields *f, size_t n, const double *positions)
{
    size_t count = 3 * f->stack.parts;
    double mean[3 * SRNF_PARTS_MAX] = {0.0};

    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < count; k++) {
            mean[k] += positions[count * i + k] / (double)n;
        }
    }
    srnf_stack_put_positions(&f->stack, mean, f->mean);
}

static void fields_clear(struct fields *f)
{
    srnf_stack_clear(&f->stack);
    srnf_free(f->mean);
    srnf_free(f->q);
}

static int fields_create(const struct srnf_grid *grid, size_t n, size_t n_parts,
                         const struct srnf_part *parts, const double *positions,
                         double position_weight, struct fields *f)
{
    size_t own = 3 * stats_points(grid);
    double weights[SRNF_PARTS_MAX];
    int status = check(n, n_parts, positions, position_weight);

    *f = (struct fields){.size = 0};
    for (size_t p = 0; p < n_parts && status == SRNF_OK; p++) {
        weights[p] = parts[p].weight;
    }
    status = status ? status
                    : srnf_stack_open(grid, n_parts, weights, positions ? position_weight : 0.0,
                                      &f->stack);
    if (status) {
        return status;
    }
    f->size = 3 * stats_points(&f->stack.grid);
    f->mean = srnf_alloc(f->size, sizeof(double));
    f->q = srnf_alloc(n, f->size * sizeof(double));
    if (!f->mean || !f->q) {
        return SRNF_ENOMEM;
    }
    for (size_t p = 0; p < n_parts; p++) {
        srnf_stack_put(&f->stack, p, parts[p].mean_q, f->mean);
        for (size_t i = 0; i < n; i++) {
            srnf_stack_put(&f->stack, p, parts[p].registered_q + i * own, f->q + i * f->size);
        }
    }
    if (positions) {
        average_positions(f, n, positions);
        for (size_t i = 0; i < n; i++) {
            srnf_stack_put_positions(&f->stack, positions + 3 * n_parts * i, f->q + i * f->size);
        }
    }
    return SRNF_OK;
}

/* Mean square of part p, or of the positions, about the mean, with n - 1. scratch: [size]. */
static double variance_of_part(const struct fields *f, size_t n, size_t p, double *scratch)
{
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < f->size; k++) {
            scratch[k] = f->q[i * f->size + k] - f->mean[k];
        }
        sum += srnf_stack_product(&f->stack, p, scratch, scratch) / (double)(n - 1);
    }
    return sum;
}

/* What pca found of the stack, part by part. Takes over its numbers. */
static int take_apart(const struct fields *f, size_t n, struct srnf_pca *pca,
                      struct srnf_joint_pca *joint)
{
    const struct srnf_stack *stack = &f->stack;
    size_t count = pca->components, parts = stack->parts, own = 3 * stats_points(stack->own);
    double *scratch = srnf_alloc(f->size, sizeof(double));

    *joint = (struct srnf_joint_pca){.n = n,
                                     .parts = parts,
                                     .components = count,
                                     .eigenvalues = pca->eigenvalues,
                                     .explained = pca->explained,
                                     .total_variance = pca->total_variance,
                                     .scores = pca->scores};
    pca->eigenvalues = pca->explained = pca->scores = NULL;
    joint->part_variances = srnf_alloc(parts, sizeof(double));
    joint->shares = srnf_alloc(count * (parts + 1), sizeof(double));
    joint->modes = srnf_alloc(count * parts, own * sizeof(double));
    joint->positions = stack->positions ? srnf_alloc(count * parts, 3 * sizeof(double)) : NULL;
    if (!scratch || !joint->part_variances || !joint->shares || !joint->modes ||
        (stack->positions && !joint->positions)) {
        srnf_free(scratch);
        return SRNF_ENOMEM;
    }
    for (size_t p = 0; p < parts; p++) {
        joint->part_variances[p] = variance_of_part(f, n, p, scratch);
    }
    joint->position_variance = stack->positions ? variance_of_part(f, n, parts, scratch) : 0.0;
    for (size_t k = 0; k < count; k++) {
        const double *mode = pca->modes + k * f->size;

        for (size_t p = 0; p <= parts; p++) {
            joint->shares[k * (parts + 1) + p] = srnf_stack_product(stack, p, mode, mode);
        }
        for (size_t p = 0; p < parts; p++) {
            srnf_stack_take(stack, p, mode, joint->modes + (k * parts + p) * own);
        }
        if (stack->positions) {
            srnf_stack_take_positions(stack, mode, joint->positions + k * parts * 3);
        }
    }
    srnf_free(scratch);
    return SRNF_OK;
}

void srnf_joint_pca_clear(struct srnf_joint_pca *joint)
{
    srnf_free(joint->eigenvalues);
    srnf_free(joint->explained);
    srnf_free(joint->part_variances);
    srnf_free(joint->scores);
    srnf_free(joint->shares);
    srnf_free(joint->modes);
    srnf_free(joint->positions);
    *joint = (struct srnf_joint_pca){0};
}

int srnf_joint_pca_fit(const struct srnf_grid *grid, size_t n, size_t n_parts,
                       const struct srnf_part *parts, const double *positions,
                       double position_weight, size_t max_components,
                       const struct srnf_context *context, struct srnf_joint_pca *joint)
{
    struct srnf_pca pca = {0};
    struct fields fields;
    int status = fields_create(grid, n, n_parts, parts, positions, position_weight, &fields);

    *joint = (struct srnf_joint_pca){0};
    if (status == SRNF_OK) {
        status = srnf_pca_fit_within(&fields.stack.grid, n, fields.mean, fields.q, max_components,
                                     context, &pca);
    }
    if (status == SRNF_OK) {
        status = take_apart(&fields, n, &pca, joint);
    }
    srnf_pca_clear(&pca);
    fields_clear(&fields);
    if (status) {
        srnf_joint_pca_clear(joint);
    }
    return status;
}

void srnf_joint_pca_reconstruct(const struct srnf_grid *grid, const struct srnf_joint_pca *joint,
                                const struct srnf_part *parts, const double *scores, size_t part,
                                double *q)
{
    size_t size = 3 * stats_points(grid);

    memcpy(q, parts[part].mean_q, size * sizeof(double));
    for (size_t k = 0; k < joint->components; k++) {
        const double *mode = joint->modes + (k * joint->parts + part) * size;

        for (size_t m = 0; m < size; m++) {
            q[m] += scores[k] * mode[m];
        }
    }
}

/* ---- To be kept ------------------------------------------------------------------------------ */

void srnf_joint_model_clear(struct srnf_joint_model *model)
{
    srnf_free(model->mean_q);
    srnf_free(model->modes);
    srnf_free(model->residuals);
    srnf_calibration_clear(&model->calibration);
    *model = (struct srnf_joint_model){0};
}

/* Residuals and distances of the subjects, and what each has when it is left out. */
static int judge_subjects(const struct fields *f, const struct srnf_pca *pca,
                          const struct srnf_context *context, struct srnf_joint_model *model)
{
    const struct srnf_grid *grid = &f->stack.grid;
    int status = srnf_pca_residuals(grid, pca, f->mean, pca->n, f->q, model->residuals);

    for (size_t i = 0; i < pca->n; i++) {
        model->distances[i] = sqrt(stats_distance2(grid, f->q + i * f->size, f->mean));
    }
    if (status == SRNF_OK && pca->n >= SRNF_JOINT_CALIBRATED_MIN) {
        status = srnf_calibrate(grid, pca, f->mean, f->q, NULL, context, &model->calibration);
    }
    return status;
}

int srnf_joint_model_make(const struct srnf_grid *grid, const struct srnf_joint_pca *joint,
                          const struct srnf_part *parts, const double *positions,
                          double position_weight, const struct srnf_context *context,
                          struct srnf_joint_model *model)
{
    struct srnf_pca pca = {.n = joint->n,
                           .components = joint->components,
                           .eigenvalues = joint->eigenvalues,
                           .explained = joint->explained,
                           .total_variance = joint->total_variance,
                           .scores = joint->scores};
    size_t own = 3 * stats_points(grid);
    struct fields f;
    int status = fields_create(grid, joint->n, joint->parts, parts, positions, position_weight, &f);

    *model = (struct srnf_joint_model){.n_theta = f.stack.grid.n_theta};
    if (status == SRNF_OK) {
        model->modes = srnf_alloc(joint->components, f.size * sizeof(double));
        model->residuals = srnf_alloc(2 * joint->n, sizeof(double));
        model->distances = model->residuals ? model->residuals + joint->n : NULL;
        status = model->modes && model->residuals ? SRNF_OK : SRNF_ENOMEM;
    }
    for (size_t k = 0; k < joint->components && status == SRNF_OK; k++) {
        double *mode = model->modes + k * f.size;

        for (size_t p = 0; p < joint->parts; p++) {
            srnf_stack_put(&f.stack, p, joint->modes + (k * joint->parts + p) * own, mode);
        }
        if (joint->positions) {
            srnf_stack_put_positions(&f.stack, joint->positions + 3 * k * joint->parts, mode);
        }
    }
    if (status == SRNF_OK) {
        pca.modes = model->modes;
        status = judge_subjects(&f, &pca, context, model);
    }
    if (status == SRNF_OK) {
        model->mean_q = f.mean;
        f.mean = NULL;
    } else {
        srnf_joint_model_clear(model);
    }
    fields_clear(&f);
    return status;
}

/*
 * parts.c - principal components of subjects that consist of several structures.
 *
 * A subject is the vector of the SRNFs of its parts, with the inner product sum_p w_p <a_p, b_p> of
 * L2. Such vectors are fields on a grid that has the rows of all parts one below another, with the
 * weights of the quadrature times w_p; and its positions, if they are asked for, are the first
 * nodes of one more row, of a weight of its own. So srnf_pca_fit does all of it, and of one part of
 * weight 1 with the same operations on the same numbers.
 *
 * A mode m of the stack is orthonormal in the weighted product: sum_p w_p ||m_p||^2 + w |x|^2 = 1.
 * These terms are the shares of the parts in it: what part of the component's variance is theirs.
 *
 * Memory beside the result: a copy of all fields, and what srnf_pca_fit takes.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

struct stack {
    const struct srnf_grid *own;
    struct srnf_grid grid;      /* of all rows */
    double *weight;             /* [n_theta] of it */
    size_t parts, points, size; /* points: of a part; size: numbers of a stacked field */
    double *mean, *q;           /* [size], [n][size] */
};

static int check(const struct srnf_grid *grid, size_t n, size_t n_parts,
                 const struct srnf_part *parts, const double *positions, double position_weight)
{
    if (n < 2 || n_parts < 1 || n_parts > SRNF_PARTS_MAX || (positions && n_parts > grid->n_phi)) {
        return SRNF_EINVAL;
    }
    for (size_t p = 0; p < n_parts; p++) {
        if (!(parts[p].weight > 0.0) || !isfinite(parts[p].weight)) {
            return SRNF_EINVAL;
        }
    }
    for (size_t i = 0; positions && i < 3 * n * n_parts; i++) {
        if (!isfinite(positions[i])) {
            return SRNF_EINVAL;
        }
    }
    return positions && (!(position_weight > 0.0) || !isfinite(position_weight)) ? SRNF_EINVAL
                                                                                 : SRNF_OK;
}

/* Where row `row` of part p and coordinate c begins. The row after all parts is that of the
   positions. */
static size_t row_at(const struct stack *s, size_t c, size_t p, size_t row)
{
    return (c * s->grid.n_theta + p * s->own->n_theta + row) * s->grid.n_phi;
}

static void put_field(const struct stack *s, size_t p, const double *field, double *out)
{
    for (size_t c = 0; c < 3; c++) {
        memcpy(out + row_at(s, c, p, 0), field + c * s->points, s->points * sizeof(double));
    }
}

static void take_field(const struct stack *s, size_t p, const double *stacked, double *out)
{
    for (size_t c = 0; c < 3; c++) {
        memcpy(out + c * s->points, stacked + row_at(s, c, p, 0), s->points * sizeof(double));
    }
}

static void put_positions(const struct stack *s, const double *positions, double *out)
{
    for (size_t i = 0; i < 3 * s->parts; i++) {
        out[row_at(s, i % 3, s->parts, 0) + i / 3] = positions[i];
    }
}

static void take_positions(const struct stack *s, const double *stacked, double *positions)
{
    for (size_t i = 0; i < 3 * s->parts; i++) {
        positions[i] = stacked[row_at(s, i % 3, s->parts, 0) + i / 3];
    }
}

/* The mean of the subjects' positions, in their order. */
static void average_positions(const struct stack *s, size_t n, const double *positions)
{
    double mean[3 * SRNF_PARTS_MAX] = {0.0};

    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < 3 * s->parts; k++) {
            mean[k] += positions[3 * s->parts * i + k] / (double)n;
        }
    }
    put_positions(s, mean, s->mean);
}

static void stack_clear(struct stack *s)
{
    srnf_free(s->weight);
    srnf_free(s->mean);
    srnf_free(s->q);
}

static int stack_create(const struct srnf_grid *grid, size_t n, size_t n_parts,
                        const struct srnf_part *parts, const double *positions,
                        double position_weight, struct stack *s)
{
    size_t rows = n_parts * grid->n_theta + (positions ? 1 : 0);

    *s = (struct stack){.own = grid, .grid = *grid, .parts = n_parts, .points = stats_points(grid)};
    s->grid.n_theta = rows;
    s->size = 3 * rows * grid->n_phi;
    s->weight = srnf_alloc(rows, sizeof(double));
    s->mean = srnf_alloc(s->size, sizeof(double));
    s->q = srnf_alloc(n, s->size * sizeof(double));
    if (!s->weight || !s->mean || !s->q) {
        return SRNF_ENOMEM;
    }
    s->grid.weight = s->weight;
    for (size_t p = 0; p < n_parts; p++) {
        for (size_t row = 0; row < grid->n_theta; row++) {
            s->weight[p * grid->n_theta + row] = parts[p].weight * grid->weight[row];
        }
        put_field(s, p, parts[p].mean_q, s->mean);
        for (size_t i = 0; i < n; i++) {
            put_field(s, p, parts[p].registered_q + i * 3 * s->points, s->q + i * s->size);
        }
    }
    if (positions) {
        s->weight[rows - 1] = position_weight;
        average_positions(s, n, positions);
        for (size_t i = 0; i < n; i++) {
            put_positions(s, positions + 3 * n_parts * i, s->q + i * s->size);
        }
    }
    return SRNF_OK;
}

/* The weighted squares of what a stacked field has in the rows of part p; mean, or NULL, is
   subtracted. p = parts: of the positions. */
static double square_of_part(const struct stack *s, size_t p, const double *stacked,
                             const double *mean)
{
    size_t rows = p < s->parts ? s->own->n_theta : 1;
    double sum = 0.0;

    for (size_t c = 0; c < 3; c++) {
        for (size_t row = 0; row < rows; row++) {
            size_t at = row_at(s, c, p, row);
            double weight = s->weight[p * s->own->n_theta + row];

            for (size_t k = at; k < at + s->grid.n_phi; k++) {
                double d = stacked[k] - (mean ? mean[k] : 0.0);

                sum += weight * d * d;
            }
        }
    }
    return sum;
}

static double variance_of_part(const struct stack *s, size_t n, size_t p)
{
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        sum += square_of_part(s, p, s->q + i * s->size, s->mean) / (double)(n - 1);
    }
    return sum;
}

/* What pca found of the stack, part by part. Takes over its numbers. */
static int take_apart(const struct stack *s, size_t n, bool positions, struct srnf_pca *pca,
                      struct srnf_joint_pca *joint)
{
    size_t count = pca->components;

    *joint = (struct srnf_joint_pca){.n = n,
                                     .parts = s->parts,
                                     .components = count,
                                     .eigenvalues = pca->eigenvalues,
                                     .explained = pca->explained,
                                     .total_variance = pca->total_variance,
                                     .scores = pca->scores};
    pca->eigenvalues = pca->explained = pca->scores = NULL;
    joint->part_variances = srnf_alloc(s->parts, sizeof(double));
    joint->shares = srnf_alloc(count * (s->parts + 1), sizeof(double));
    joint->modes = srnf_alloc(count * s->parts, 3 * s->points * sizeof(double));
    joint->positions = positions ? srnf_alloc(count * s->parts, 3 * sizeof(double)) : NULL;
    if (!joint->part_variances || !joint->shares || !joint->modes ||
        (positions && !joint->positions)) {
        return SRNF_ENOMEM;
    }
    for (size_t p = 0; p < s->parts; p++) {
        joint->part_variances[p] = variance_of_part(s, n, p);
    }
    joint->position_variance = positions ? variance_of_part(s, n, s->parts) : 0.0;
    for (size_t k = 0; k < count; k++) {
        const double *mode = pca->modes + k * s->size;

        for (size_t p = 0; p < s->parts + (positions ? 1 : 0); p++) {
            joint->shares[k * (s->parts + 1) + p] = square_of_part(s, p, mode, NULL);
        }
        for (size_t p = 0; p < s->parts; p++) {
            take_field(s, p, mode, joint->modes + (k * s->parts + p) * 3 * s->points);
        }
        if (positions) {
            take_positions(s, mode, joint->positions + k * s->parts * 3);
        }
    }
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
    struct stack stack = {.own = grid};
    int status = check(grid, n, n_parts, parts, positions, position_weight);

    *joint = (struct srnf_joint_pca){0};
    if (status) {
        return status;
    }
    status = stack_create(grid, n, n_parts, parts, positions, position_weight, &stack);
    if (status == SRNF_OK) {
        status =
            srnf_pca_fit_within(&stack.grid, n, stack.mean, stack.q, max_components, context, &pca);
    }
    if (status == SRNF_OK) {
        status = take_apart(&stack, n, positions != NULL, &pca, joint);
    }
    srnf_pca_clear(&pca);
    stack_clear(&stack);
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

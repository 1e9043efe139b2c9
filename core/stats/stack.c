/*
 * stack.c - several fields as one: the rows of all parts one below another, on a grid whose
 * weights are those of the quadrature times those of the parts.
 *
 * With positions there is one more row of a weight of its own, whose first nodes are the positions
 * of the parts. So the inner product of two stacked fields is
 *
 *     sum_p w_p <a_p, b_p> + w x_a . x_b,
 *
 * and all that works on fields by their products (components, residuals, what is left out) works on
 * subjects of several parts with the same operations. One part of weight 1 is a field as it is.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

int srnf_stack_open(const struct srnf_grid *own, size_t n_parts, const double *weights,
                    double position_weight, struct srnf_stack *stack)
{
    bool positions = position_weight != 0.0;
    size_t rows = n_parts * own->n_theta + (positions ? 1 : 0);
    bool good = n_parts >= 1 && n_parts <= SRNF_PARTS_MAX && position_weight >= 0.0 &&
                isfinite(position_weight) && !(positions && n_parts > own->n_phi);

    *stack =
        (struct srnf_stack){.own = own, .grid = *own, .parts = n_parts, .positions = positions};
    for (size_t p = 0; p < n_parts && good; p++) {
        good = weights[p] > 0.0 && isfinite(weights[p]);
    }
    if (!good) {
        return SRNF_EINVAL;
    }
    stack->weight = srnf_alloc(rows, sizeof(double));
    if (!stack->weight) {
        return SRNF_ENOMEM;
    }
    for (size_t row = 0; row < n_parts * own->n_theta; row++) {
        stack->weight[row] = weights[row / own->n_theta] * own->weight[row % own->n_theta];
    }
    if (positions) {
        stack->weight[rows - 1] = position_weight;
    }
    stack->grid.n_theta = rows;
    stack->grid.weight = stack->weight;
    return SRNF_OK;
}

void srnf_stack_clear(struct srnf_stack *stack)
{
    srnf_free(stack->weight);
    *stack = (struct srnf_stack){.own = NULL};
}

/* Where row `row` of part p and coordinate c begins. The row after all parts is that of the
   positions. */
static size_t row_at(const struct srnf_stack *s, size_t c, size_t p, size_t row)
{
    return (c * s->grid.n_theta + p * s->own->n_theta + row) * s->grid.n_phi;
}

void srnf_stack_put(const struct srnf_stack *stack, size_t part, const double *field,
                    double *stacked)
{
    size_t points = stats_points(stack->own);

    for (size_t c = 0; c < 3; c++) {
        memcpy(stacked + row_at(stack, c, part, 0), field + c * points, points * sizeof(double));
    }
}

void srnf_stack_take(const struct srnf_stack *stack, size_t part, const double *stacked,
                     double *field)
{
    size_t points = stats_points(stack->own);

    for (size_t c = 0; c < 3; c++) {
        memcpy(field + c * points, stacked + row_at(stack, c, part, 0), points * sizeof(double));
    }
}

void srnf_stack_put_positions(const struct srnf_stack *stack, const double *positions,
                              double *stacked)
{
    for (size_t i = 0; i < 3 * stack->parts && stack->positions; i++) {
        stacked[row_at(stack, i % 3, stack->parts, 0) + i / 3] = positions[i];
    }
}

void srnf_stack_take_positions(const struct srnf_stack *stack, const double *stacked,
                               double *positions)
{
    for (size_t i = 0; i < 3 * stack->parts && stack->positions; i++) {
        positions[i] = stacked[row_at(stack, i % 3, stack->parts, 0) + i / 3];
    }
}

double srnf_stack_product(const struct srnf_stack *stack, size_t part, const double *a,
                          const double *b)
{
    size_t rows = part < stack->parts ? stack->own->n_theta : stack->positions ? 1 : 0;
    double sum = 0.0;

    for (size_t c = 0; c < 3; c++) {
        for (size_t row = 0; row < rows; row++) {
            size_t at = row_at(stack, c, part, row);
            double weight = stack->weight[part * stack->own->n_theta + row];

            for (size_t k = at; k < at + stack->grid.n_phi; k++) {
                sum += weight * a[k] * b[k];
            }
        }
    }
    return sum;
}

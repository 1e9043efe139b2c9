/*
 * nodes.c - grids by their nodes: how fine they are, where the nodes lie, and what they weigh.
 */
#include "registration.h"

#include "harmonics/harmonics.h"

#include <math.h>

#define NODES_PER_DEGREE ((size_t)4) /* rows of the full grid to a degree of the fields */
#define FINE_ROWS_MIN ((size_t)36)
#define FINE_ROWS_MAX ((size_t)96)

void registration_nodes(const struct srnf_grid *grid, double *points, double *weight)
{
    for (size_t i = 0; i < grid->n_theta * grid->n_phi; i++) {
        size_t row = i / grid->n_phi;
        double phi = 2.0 * SRNF_PI * (double)(i % grid->n_phi) / (double)grid->n_phi;

        points[3 * i] = grid->sin_theta[row] * cos(phi);
        points[3 * i + 1] = grid->sin_theta[row] * sin(phi);
        points[3 * i + 2] = grid->cos_theta[row];
        weight[i] = grid->weight[row];
    }
}

double *registration_parallels(size_t rows, struct srnf_grid *grid)
{
    double *nodes = srnf_alloc(4 * rows, sizeof(double));

    if (nodes) {
        sphere_gauss_legendre(rows, nodes, nodes + rows, nodes + 2 * rows, nodes + 3 * rows);
        for (size_t i = 0; i < rows; i++) {
            nodes[3 * rows + i] *= SRNF_PI / (double)rows;
        }
        *grid = (struct srnf_grid){.kind = SRNF_GRID_GAUSS_LEGENDRE,
                                   .n_theta = rows,
                                   .n_phi = 2 * rows,
                                   .theta = nodes,
                                   .cos_theta = nodes + rows,
                                   .sin_theta = nodes + 2 * rows,
                                   .weight = nodes + 3 * rows};
    }
    return nodes;
}

size_t registration_rows(size_t degree)
{
    size_t rows = NODES_PER_DEGREE * degree;

    return rows < FINE_ROWS_MIN ? FINE_ROWS_MIN : rows > FINE_ROWS_MAX ? FINE_ROWS_MAX : rows;
}

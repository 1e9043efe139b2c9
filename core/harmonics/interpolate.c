/*
 * interpolate.c - a scalar on the grid, between its nodes: linear in longitude, then linear in
 * colatitude. North of the first row and south of the last, where a Gauss-Legendre grid has none,
 * the pole stands for a row: its value is the mean of the nearest row.
 *
 * For what must not overshoot, such as probabilities: every value lies between those of the nodes
 * about it. A field that is smooth is better served by a harmonic series. Cost O(log n_theta) a
 * point.
 */
#include "internal.h"

#include <math.h>

/* The last row at or north of theta; n_theta where there is none. */
static size_t row_before(const struct srnf_grid *grid, double theta)
{
    size_t low = 0;
    size_t high = grid->n_theta;

    while (low < high) {
        size_t middle = low + (high - low) / 2;

        if (grid->theta[middle] <= theta) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low == 0 ? grid->n_theta : low - 1;
}

static double on_row(const struct srnf_grid *grid, const double *row, double phi)
{
    double turn = phi / (2.0 * SRNF_PI);
    double at = (turn - floor(turn)) * (double)grid->n_phi;
    size_t j = (size_t)at % grid->n_phi;
    size_t next = j + 1 < grid->n_phi ? j + 1 : 0;
    double part = at - floor(at);

    return (1.0 - part) * row[j] + part * row[next];
}

static double at_pole(const struct srnf_grid *grid, const double *row)
{
    double sum = 0.0;

    for (size_t j = 0; j < grid->n_phi; j++) {
        sum += row[j];
    }
    return sum / (double)grid->n_phi;
}

static double interpolate(const struct srnf_grid *grid, const double *values, const double point[3])
{
    double theta = atan2(hypot(point[0], point[1]), point[2]);
    double phi = atan2(point[1], point[0]);
    size_t last = grid->n_theta - 1;
    size_t row = row_before(grid, theta);
    bool north = row == grid->n_theta;
    bool south = row == last;
    const double *above = values + (north ? 0 : row) * grid->n_phi;
    const double *below = values + (north ? 0 : south ? last : row + 1) * grid->n_phi;
    double from = north ? 0.0 : grid->theta[row];
    double to = north ? grid->theta[0] : south ? SRNF_PI : grid->theta[row + 1];
    double first = north ? at_pole(grid, above) : on_row(grid, above, phi);
    double second = south && !north ? at_pole(grid, below) : on_row(grid, below, phi);
    double part = to > from ? (theta - from) / (to - from) : 0.0;

    return (1.0 - part) * first + part * second;
}

void srnf_grid_interpolate(const struct srnf_grid *grid, const double *values, size_t n,
                           const double *points, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[i] = interpolate(grid, values, points + 3 * i);
    }
}

/*
 * surfaces_grid.h - transforms of the synchronous surface routes, and surfaces from and to values
 * on a grid.
 */
#ifndef SRNFD_API_SURFACES_GRID_H
#define SRNFD_API_SURFACES_GRID_H

#include "api/json_numbers.h"
#include "api/surfaces.h"

/* A grid that was asked for or sent, within the limits that the degree sets. */
struct surface_grid {
    enum srnf_grid_kind kind;
    size_t n_theta, n_phi;
};

/* "gauss-legendre" or "equiangular"; false for anything else. */
bool surface_grid_kind(const char *name, enum srnf_grid_kind *kind);
const char *surface_grid_kind_name(enum srnf_grid_kind kind);

/* Largest degree whose analysis the grid resolves. */
size_t surface_grid_degree(const struct surface_grid *grid);

/* A transform with a workspace large enough for srnf_field, srnf_surface_measure and three fields.
   */
struct surface_transform {
    struct jobs *jobs;
    const struct srnf_sht *sht;
    void *workspace;
};
/* False when a problem was answered. */
bool surface_transform_open(struct api_call *call, size_t degree, const struct surface_grid *grid,
                            struct surface_transform *transform);
void surface_transform_close(struct surface_transform *transform);

/*
 * Analyses values double[n_theta][n_phi][3] to the degree: coefficients double[3][(degree+1)^2];
 * fit is how far the series stays from the values at the nodes, weighted by the quadrature. False
 * when a problem was answered.
 */
bool surface_from_grid(struct api_call *call, const struct surface_grid *grid, size_t degree,
                       const double *xyz, double *coefficients, struct srnf_fit *fit);

#endif

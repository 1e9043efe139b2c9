/*
 * surfaces_grid.c - analysis of values on a grid, and how well the series fits them.
 *
 * The fit compares the values with the series at the same nodes: zero to rounding for a surface
 * of the degree or below, and otherwise the size of what the degree leaves out. Each node counts
 * by its quadrature weight.
 */
#include "api/surfaces_grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compute/compute.h"

static const char *const kinds[] = {
    [SRNF_GRID_GAUSS_LEGENDRE] = "gauss-legendre",
    [SRNF_GRID_EQUIANGULAR] = "equiangular",
};

bool surface_grid_kind(const char *name, enum srnf_grid_kind *kind)
{
    for (size_t i = 0; name && i < sizeof kinds / sizeof kinds[0]; i++) {
        if (strcmp(kinds[i], name) == 0) {
            *kind = (enum srnf_grid_kind)i;
            return true;
        }
    }
    return false;
}

const char *surface_grid_kind_name(enum srnf_grid_kind kind)
{
    return kinds[kind];
}

size_t surface_grid_degree(const struct surface_grid *grid)
{
    size_t rows = grid->kind == SRNF_GRID_EQUIANGULAR ? (grid->n_theta - 1) / 2 : grid->n_theta - 1;
    size_t columns = (grid->n_phi - 1) / 2;

    return rows < columns ? rows : columns;
}

bool surface_transform_open(struct api_call *call, size_t degree, const struct surface_grid *grid,
                            struct surface_transform *transform)
{
    size_t size, batch;
    int status;

    *transform = (struct surface_transform){.jobs = call->api->config.jobs};
    status = jobs_transform_acquire(transform->jobs, degree, grid->kind, grid->n_theta, grid->n_phi,
                                    &transform->sht);
    if (status) {
        (void)problem_respond(call, compute_problem_code(status), "The harmonic transform: %s.",
                              srnf_strerror(status));
        return false;
    }
    size = srnf_surface_workspace_size(transform->sht);
    batch = srnf_sht_workspace_size(transform->sht, 3);
    transform->workspace = srnf_alloc(size > batch ? size : batch, 1);
    if (!transform->workspace) {
        surface_transform_close(transform);
        (void)problem_respond(call, "out-of-memory", "The grid does not fit into memory now.");
        return false;
    }
    return true;
}

void surface_transform_close(struct surface_transform *transform)
{
    srnf_free(transform->workspace);
    if (transform->sht) {
        jobs_transform_release(transform->jobs, transform->sht);
    }
    *transform = (struct surface_transform){0};
}

/* Squared distance at one node, and its weight. */
struct node {
    double distance2, weight;
};

static int by_distance(const void *a, const void *b)
{
    double x = ((const struct node *)a)->distance2, y = ((const struct node *)b)->distance2;

    return (x > y) - (x < y);
}

/* Diagonal of the box around the nodes. */
static double diagonal_of(size_t nodes, const double *blocks)
{
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double low = blocks[k * nodes], high = low;
        for (size_t i = 1; i < nodes; i++) {
            low = fmin(low, blocks[k * nodes + i]);
            high = fmax(high, blocks[k * nodes + i]);
        }
        sum += (high - low) * (high - low);
    }
    return sqrt(sum);
}

static void measure_fit(const struct srnf_grid *grid, const double *given, const double *series,
                        struct node *nodes, struct srnf_fit *fit)
{
    size_t count = grid->n_theta * grid->n_phi;
    double total = 0.0, sum = 0.0, passed = 0.0;

    for (size_t i = 0; i < count; i++) {
        nodes[i] = (struct node){.weight = grid->weight[i / grid->n_phi]};
        for (size_t k = 0; k < 3; k++) {
            double d = given[k * count + i] - series[k * count + i];
            nodes[i].distance2 += d * d;
        }
        total += nodes[i].weight;
        sum += nodes[i].weight * nodes[i].distance2;
    }
    qsort(nodes, count, sizeof *nodes, by_distance);
    *fit = (struct srnf_fit){.rms = sqrt(sum / total),
                             .max = sqrt(nodes[count - 1].distance2),
                             .diagonal = diagonal_of(count, given)};
    for (size_t i = 0; i < count && passed < 0.95 * total; i++) {
        passed += nodes[i].weight;
        fit->p95 = sqrt(nodes[i].distance2);
    }
}

bool surface_from_grid(struct api_call *call, const struct surface_grid *grid, size_t degree,
                       const double *xyz, double *coefficients, struct srnf_fit *fit)
{
    size_t count = grid->n_theta * grid->n_phi;
    double *given = srnf_alloc(count, 3 * sizeof(double));
    double *series = srnf_alloc(count, 3 * sizeof(double));
    struct node *nodes = srnf_alloc(count, sizeof *nodes);
    struct surface_transform transform = {0};
    bool done = false;

    if (!given || !series || !nodes) {
        (void)problem_respond(call, "out-of-memory", "The grid does not fit into memory now.");
        goto out;
    }
    if (!surface_transform_open(call, degree, grid, &transform)) {
        goto out;
    }
    field_split(count, xyz, given);
    srnf_sht_analysis(transform.sht, 3, given, coefficients, transform.workspace);
    srnf_sht_synthesis(transform.sht, 3, coefficients, series, transform.workspace);
    measure_fit(srnf_sht_grid(transform.sht), given, series, nodes, fit);
    done = true;
out:
    surface_transform_close(&transform);
    srnf_free(nodes);
    srnf_free(series);
    srnf_free(given);
    return done;
}

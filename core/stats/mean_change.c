/*
 * mean_change.c - the group mean as it is parameterized from its centre, to tell how far it moves.
 *
 * While the mean is sought it drifts along its orbit, and the centre d with it (mean_center.c):
 * that is no change. What is compared from one iteration to the next is therefore
 *
 *   nu = (mu, d^-1) = sqrt(J) mu o d^-1,  J the Jacobian of d^-1,
 *
 * evaluated through the harmonics of mu up to degree 31 on a coarse grid of its own: enough for the
 * size of a difference. Cost: one analysis on the working grid, and 512 points.
 */
#include "mean.h"

#include <math.h>

#define ROWS ((size_t)16)
#define DEGREE_MAX ((size_t)31)
#define BLOCK ((size_t)64)

struct view {
    size_t degree, n;
    double *coefficients; /* [3][(degree + 1)^2] */
    double *points;       /* [n][3] */
    double *jacobian;     /* [n] */
    double *out;          /* [3][n] */
    struct srnf_warp inverse;
};

int mean_change_create(struct mean_run *run)
{
    size_t limit = run->grid->n_theta - 1;
    size_t degree = limit < DEGREE_MAX ? limit : DEGREE_MAX;
    int status = srnf_sht_create(&run->analysis, degree, run->grid->kind, run->grid->n_theta,
                                 run->grid->n_phi);

    if (status == SRNF_OK) {
        status = srnf_sht_create(&run->view, 1, SRNF_GRID_GAUSS_LEGENDRE, ROWS, 2 * ROWS);
    }
    if (status == SRNF_OK) {
        size_t n = stats_points(srnf_sht_grid(run->view));

        run->centred = srnf_alloc(3 * n, sizeof(double));
        run->old_centred = srnf_alloc(3 * n, sizeof(double));
        status = run->centred && run->old_centred ? SRNF_OK : SRNF_ENOMEM;
    }
    return status;
}

static int view_block(void *argument, size_t block, const struct srnf_context *context,
                      struct srnf_error *error)
{
    const struct view *view = argument;
    size_t first = block * BLOCK;
    size_t n = view->n - first < BLOCK ? view->n - first : BLOCK;
    double *points = view->points + 3 * first;
    double values[3 * BLOCK];
    int status = warp_follow(&view->inverse, context, n, points, view->jacobian + first);

    (void)error;
    if (status == SRNF_OK) {
        status = sphere_harmonics_at_points(context, view->degree, 3, view->coefficients, n, points,
                                            values, NULL);
    }
    for (size_t k = 0; k < n && status == SRNF_OK; k++) {
        for (size_t c = 0; c < 3; c++) {
            view->out[c * view->n + first + k] =
                sqrt(view->jacobian[first + k]) * values[c * n + k];
        }
    }
    return status;
}

int mean_view(struct mean_run *run, struct srnf_error *error)
{
    const struct srnf_grid *grid = srnf_sht_grid(run->view);
    struct view view = {
        .degree = srnf_sht_degree(run->analysis), .n = stats_points(grid), .out = run->centred};
    size_t count = 3 * srnf_coefficient_count(view.degree);
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(run->analysis, 3));
    int status = SRNF_ENOMEM;

    view.coefficients = srnf_alloc(count + 4 * view.n, sizeof(double));
    if (!workspace || !view.coefficients) {
        goto out;
    }
    view.points = view.coefficients + count;
    view.jacobian = view.points + 3 * view.n;
    stats_nodes(grid, view.points);
    for (size_t k = 0; k < view.n; k++) {
        view.jacobian[k] = 1.0;
    }
    srnf_sht_analysis(run->analysis, 3, run->mean_q, view.coefficients, workspace);
    status = warp_invert(&run->centring, &view.inverse);
    if (status == SRNF_OK) {
        status = stats_run(run->context, (view.n + BLOCK - 1) / BLOCK, view_block, &view,
                           (struct stats_progress){0}, error);
    }
out:
    srnf_warp_clear(&view.inverse);
    srnf_free(workspace);
    srnf_free(view.coefficients);
    return status;
}

double mean_change(const struct mean_run *run)
{
    const struct srnf_grid *grid = srnf_sht_grid(run->view);
    double square = srnf_inner_product(grid, run->centred, run->centred);

    /* what is no number stays that: it is no convergence */
    return square == 0.0 ? 0.0
                         : sqrt(stats_distance2(grid, run->centred, run->old_centred) / square);
}

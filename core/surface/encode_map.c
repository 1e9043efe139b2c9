/*
 * encode_map.c - a mesh with a map to the sphere, as a surface of degree L: what the routes area
 * and given do once they have the map.
 *
 *   1. the mesh about its area centroid, so that its place does not cost digits
 *   2. sampled through the map on a grid with twice the rows of the working grid
 *   3. harmonic analysis of the three coordinates to degree L, optionally damped by the heat kernel
 *      exp(-sigma l (l + 1))
 *
 * Step 3 is least squares over the sphere. Least squares over the surface, with the area density of
 * the map as weight (20 steps of conjugate gradients), changes the fit of real bodies by less than
 * 1 %: the map has little distortion, and what is left is detail above the degree.
 */
#include "encode.h"
#include "sphere_map/sphere_map.h"
#include "linear/linear.h"

/* A copy of the vertices about the centroid; the faces are shared. */
static int centre_mesh(const struct encode_task *task, struct srnf_mesh *centred)
{
    *centred = *task->mesh;
    centred->vertices = srnf_alloc(3 * centred->n_vertices, sizeof(double));
    if (!centred->vertices) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < centred->n_vertices; i++) {
        vector_subtract(task->mesh->vertices + 3 * i, task->report->centroid,
                        centred->vertices + 3 * i);
    }
    return SRNF_OK;
}

static void damp(double sigma, size_t degree, double *coefficients)
{
    size_t count = srnf_coefficient_count(degree);

    for (size_t l = 0; l <= degree; l++) {
        double damping = exp(-sigma * (double)l * (double)(l + 1));

        for (size_t c = 0; c < 3; c++) {
            linear_scale(2 * l + 1, damping, coefficients + c * count + l * l);
        }
    }
}

int encode_through_map(const struct encode_task *task, const double *points,
                       struct encode_result *result)
{
    size_t degree = task->options->degree;
    struct srnf_mesh centred = {0};
    struct srnf_sht *fine = NULL;
    const struct srnf_grid *grid;
    double *values = NULL;
    void *workspace = NULL;
    int status = srnf_sht_create(&fine, degree, SRNF_GRID_GAUSS_LEGENDRE,
                                 ENCODE_OVERSAMPLING * srnf_working_rows(degree), 0);

    if (status == SRNF_OK) {
        status = centre_mesh(task, &centred);
    }
    if (status) {
        goto out;
    }
    grid = srnf_sht_grid(fine);
    values = srnf_alloc(3 * grid->n_theta * grid->n_phi, sizeof(double));
    workspace = srnf_alloc(1, srnf_sht_workspace_size(fine, 3));
    status = SRNF_ENOMEM;
    if (!values || !workspace) {
        goto out;
    }
    status = spherical_sample(&centred, points, grid, task->context, values);
    if (status) {
        if (status == SRNF_ENUMERIC) {
            (void)srnf_fail(task->error, status, -1,
                            "the map to the sphere leaves a direction uncovered");
        }
        goto out;
    }
    srnf_sht_analysis(fine, 3, values, result->coefficients, workspace);
    damp(task->options->smoothing, degree, result->coefficients);
    for (size_t c = 0; c < 3; c++) {
        result->frame[c] = task->report->centroid[c];
    }
out:
    srnf_free(values);
    srnf_free(workspace);
    srnf_free(centred.vertices);
    srnf_sht_destroy(fine);
    return status;
}

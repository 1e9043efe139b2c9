/*
 * correspondence.c - interpolation between corresponding vertices along common rays.
 */
#include "support/correspondence.h"

#include <math.h>
#include <stdlib.h>

#include "support/meshes.h"
#include "support/shapes.h"

/* Weights of the corners of a face at a point of it: areas of the opposite triangles. */
static void corner_weights(const struct srnf_mesh *mesh, uint32_t face, const double x[3],
                           double weights[3])
{
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        const double *a = mesh->vertices + 3 * mesh->faces[3 * face + (k + 1) % 3];
        const double *b = mesh->vertices + 3 * mesh->faces[3 * face + (k + 2) % 3];
        double u[3];
        double v[3];
        double square = 0.0;

        for (size_t c = 0; c < 3; c++) {
            u[c] = a[c] - x[c];
            v[c] = b[c] - x[c];
        }
        for (size_t c = 0; c < 3; c++) {
            double n = u[(c + 1) % 3] * v[(c + 2) % 3] - u[(c + 2) % 3] * v[(c + 1) % 3];

            square += n * n;
        }
        weights[k] = sqrt(square);
        sum += weights[k];
    }
    for (size_t k = 0; k < 3; k++) {
        weights[k] /= sum;
    }
}

static struct srnf_mesh average_of(size_t n, const struct srnf_mesh *meshes)
{
    struct srnf_mesh average = meshes_copy(&meshes[0]);

    for (size_t v = 0; v < 3 * average.n_vertices; v++) {
        average.vertices[v] = 0.0;
        for (size_t i = 0; i < n; i++) {
            average.vertices[v] += meshes[i].vertices[v] / (double)n;
        }
    }
    return average;
}

/* The direction of node k of the grid. */
static void direction_of(const struct srnf_grid *grid, size_t k, double direction[3])
{
    double phi = 2.0 * acos(-1.0) * (double)(k % grid->n_phi) / (double)grid->n_phi;
    size_t row = k / grid->n_phi;

    direction[0] = grid->sin_theta[row] * cos(phi);
    direction[1] = grid->sin_theta[row] * sin(phi);
    direction[2] = grid->cos_theta[row];
}

/* values: [n][3][points] of the grid. */
static void interpolate(const struct srnf_grid *grid, size_t n, const struct srnf_mesh *meshes,
                        double unit, const struct srnf_mesh *average, const double center[3],
                        double *values)
{
    size_t points = grid->n_theta * grid->n_phi;
    struct srnf_index *index;

    if (srnf_index_create(&index, average)) {
        abort();
    }
    for (size_t k = 0; k < points; k++) {
        double direction[3];
        double x[3];
        double weights[3];
        double t;
        uint32_t face;

        direction_of(grid, k, direction);
        if (!srnf_index_ray(index, center, direction, &t, &face)) {
            abort();
        }
        for (size_t c = 0; c < 3; c++) {
            x[c] = center[c] + t * direction[c];
        }
        corner_weights(average, face, x, weights);
        for (size_t i = 0; i < 3 * n; i++) {
            for (size_t j = 0; j < 3; j++) {
                size_t vertex = 3 * (size_t)average->faces[3 * face + j] + i % 3;

                values[i * points + k] += weights[j] * meshes[i / 3].vertices[vertex] / unit;
            }
        }
    }
    srnf_index_destroy(index);
}

bool correspondence_surfaces(const struct srnf_sht *sht, size_t n, const struct srnf_mesh *meshes,
                             double unit, double *const *f)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t points = grid->n_theta * grid->n_phi;
    struct srnf_mesh average = average_of(n, meshes);
    struct srnf_star star;
    bool done = srnf_star_kernel(&average, &star) == SRNF_OK && star.value;

    if (done) {
        double *values = shapes_doubles(n * 3 * points);
        void *workspace = shapes_doubles(srnf_sht_workspace_size(sht, 3) / sizeof(double) + 1);

        interpolate(grid, n, meshes, unit, &average, star.center, values);
        for (size_t i = 0; i < n; i++) {
            srnf_sht_analysis(sht, 3, values + i * 3 * points, f[i], workspace);
        }
        srnf_free(workspace);
        srnf_free(values);
    }
    srnf_mesh_clear(&average);
    return done;
}

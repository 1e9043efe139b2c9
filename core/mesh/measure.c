/*
 * measure.c - area, volume, centroid and extent of a triangle mesh.
 *
 *   area      sum of |n_f| / 2, n_f = (b - a) x (c - a)
 *   volume    sum of <a, n_f> / 6, the divergence theorem; signed, positive for outward faces. Of a
 *             mesh with a boundary it is the volume of the cone over the centre of the bounding
 *             box.
 *   centroid  of area: mean of the faces' centroids, weighted by |n_f|
 *
 * All sums run over the faces in order, in coordinates relative to the centre of the bounding box
 * and divided by its diagonal.
 */
#include "mesh_geometry.h"

#include <float.h>
#include <string.h>

void srnf_mesh_clear(struct srnf_mesh *mesh)
{
    if (mesh) {
        srnf_free(mesh->vertices);
        srnf_free(mesh->faces);
        memset(mesh, 0, sizeof *mesh);
    }
}

/* Bounding box of the vertices; false when there are none or one is beyond
   SRNF_MESH_COORDINATE_MAX. */
static bool bounding_box(const struct srnf_mesh *mesh, double low[3], double high[3])
{
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        for (size_t k = 0; k < 3; k++) {
            double x = mesh->vertices[3 * i + k];

            if (!(fabs(x) <= SRNF_MESH_COORDINATE_MAX)) {
                return false;
            }
            low[k] = i == 0 || x < low[k] ? x : low[k];
            high[k] = i == 0 || x > high[k] ? x : high[k];
        }
    }
    return mesh->n_vertices > 0;
}

/* The least step of a double, or of a float where all coordinates are some, at the largest of them,
   over the mean length of an edge. What was shifted far from the origin and written in single
   precision has steps as long as its edges. */
static double coarseness_of(const struct srnf_mesh *mesh, double mean_edge)
{
    double largest = 0.0;
    bool single = true;
    int exponent;

    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        double x = fabs(mesh->vertices[i]);

        largest = fmax(largest, x);
        single = single && x <= (double)FLT_MAX && (double)(float)x == x;
    }
    (void)frexp(largest, &exponent);
    return mean_edge > 0.0
               ? ldexp(1.0, exponent - (single ? FLT_MANT_DIG : DBL_MANT_DIG)) / mean_edge
               : 0.0;
}

void srnf_mesh_measure(const struct srnf_mesh *mesh, const struct srnf_context *context,
                       struct srnf_mesh_measures *measures)
{
    double low[3] = {0}, high[3] = {0}, extent[3], sum[3] = {0}, diagonal;
    double area = 0.0, volume = 0.0, edges = 0.0;

    *measures = (struct srnf_mesh_measures){0};
    if (!bounding_box(mesh, low, high)) {
        measures->out_of_range = mesh->n_vertices > 0;
        return;
    }
    vector_subtract(high, low, extent);
    for (size_t k = 0; k < 3; k++) {
        measures->center[k] = low[k] + 0.5 * extent[k];
        measures->centroid[k] = measures->center[k];
    }
    diagonal = hypot(hypot(extent[0], extent[1]), extent[2]);
    measures->diagonal = diagonal;
    if (diagonal < 1.0 / SRNF_MESH_COORDINATE_MAX) {
        return;
    }
    for (size_t f = 0; f < mesh->n_faces && !srnf_asks(context, f); f++) {
        double corner[3][3], ab[3], ac[3], normal[3], length;

        for (size_t k = 0; k < 3; k++) {
            vector_subtract(mesh_corner(mesh, f, k), measures->center, corner[k]);
            for (size_t i = 0; i < 3; i++) {
                corner[k][i] /= diagonal;
            }
        }
        vector_subtract(corner[1], corner[0], ab);
        vector_subtract(corner[2], corner[0], ac);
        vector_cross(ab, ac, normal);
        length = vector_norm(normal);
        edges += vector_norm(ab) / (double)mesh->n_faces;
        area += 0.5 * length;
        volume += vector_dot(corner[0], normal) / 6.0;
        for (size_t i = 0; i < 3; i++) {
            sum[i] += 0.5 * length * (corner[0][i] + corner[1][i] + corner[2][i]) / 3.0;
        }
    }
    for (size_t i = 0; i < 3 && area > 0.0; i++) {
        measures->centroid[i] += diagonal * (sum[i] / area);
    }
    measures->coarseness = coarseness_of(mesh, edges * diagonal);
    measures->relative_area = area;
    measures->relative_volume = volume;
    measures->area = area * diagonal * diagonal;
    measures->volume = volume * diagonal * diagonal * diagonal;
}

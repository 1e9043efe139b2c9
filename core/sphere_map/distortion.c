/*
 * distortion.c - how far a map of a mesh to the sphere is from an isometry.
 *
 * With the mesh scaled to area 4 pi, w its triangles' areas by the robust metric
 * (metric.c), d / 2 those of the flat triangles between the image points and q half the
 * sum of cot_k |e_k|^2 over the image edges,
 *   symmetric Dirichlet energy / 4 pi = sum q (1 + 4 w^2 / d^2) / 4 pi, 4 for an isometry,
 *   log area deviation = standard deviation of log(d / 2 w), weighted by w.
 * Cost O(faces).
 */
#include "sphere_map.h"

#define FLOOR_EDGE 0.01 /* of the mean edge */
#define SLIVER 0.02     /* as in the first attempt of map.c */

int spherical_normalize(struct spherical *s)
{
    struct srnf_mesh_measures measures;
    double sum = 0.0;

    srnf_mesh_measure(s->mesh, NULL, &measures);
    if (measures.out_of_range || !(measures.diagonal > 0.0) || !(measures.area > 0.0)) {
        return SRNF_EDEGENERATE;
    }
    for (size_t i = 0; i < s->n; i++) {
        for (size_t k = 0; k < 3; k++) {
            s->positions[3 * i + k] =
                (s->mesh->vertices[3 * i + k] - measures.center[k]) / measures.diagonal;
        }
    }
    for (size_t i = 0; i < 3 * s->mesh->n_faces; i++) {
        size_t next = i % 3 == 2 ? i - 2 : i + 1;
        double d[3];

        vector_subtract(s->positions + 3 * (size_t)s->mesh->faces[i],
                        s->positions + 3 * (size_t)s->mesh->faces[next], d);
        sum += vector_norm(d);
    }
    s->floor_edge = FLOOR_EDGE * sum / (double)(3 * s->mesh->n_faces);
    return SRNF_OK;
}

static void face_metric(const struct spherical *s, size_t f, struct triangle_metric *metric)
{
    const uint32_t *face = s->mesh->faces + 3 * f;

    spherical_metric(s, s->positions + 3 * (size_t)face[0], s->positions + 3 * (size_t)face[1],
                     s->positions + 3 * (size_t)face[2], metric);
}

/* q of the flat image triangle, and twice its area. */
static double image(const struct spherical *s, const double *points, size_t f,
                    const struct triangle_metric *metric, double *doubled_area)
{
    const double *p[3];
    double first[3];
    double second[3];
    double cross[3];
    double q = 0.0;

    for (size_t k = 0; k < 3; k++) {
        p[k] = points + 3 * (size_t)s->mesh->faces[3 * f + k];
    }
    for (size_t k = 0; k < 3; k++) {
        double e[3];

        vector_subtract(p[(k + 1) % 3], p[(k + 2) % 3], e);
        q += 0.5 * metric->cot[k] * vector_dot(e, e);
    }
    vector_subtract(p[1], p[0], first);
    vector_subtract(p[2], p[0], second);
    vector_cross(first, second, cross);
    *doubled_area = vector_norm(cross);
    return q;
}

void spherical_measure(const struct spherical *s, const double *points,
                       struct srnf_distortion *distortion)
{
    double energy = 0.0;
    double mean = 0.0;
    double square = 0.0;
    double area = 0.0;
    double total = 0.0;
    struct triangle_metric metric;

    for (size_t f = 0; f < s->mesh->n_faces; f++) {
        face_metric(s, f, &metric);
        total += metric.area;
    }
    for (size_t f = 0; f < s->mesh->n_faces; f++) {
        double d;
        double q;
        double weight;
        double ratio;

        face_metric(s, f, &metric);
        q = image(s, points, f, &metric, &d);
        weight = metric.area * 4.0 * SRNF_PI / total;
        ratio = log(0.5 * d / weight);
        energy += q * (1.0 + 4.0 * weight * weight / (d * d));
        area += weight;
        mean += weight * ratio;
        square += weight * ratio * ratio;
    }
    mean /= area;
    distortion->symmetric_dirichlet = energy / (4.0 * SRNF_PI);
    distortion->log_area_deviation = sqrt(larger(0.0, square / area - mean * mean));
}

int spherical_distortion(const struct srnf_mesh *mesh, const double *points,
                         struct srnf_distortion *distortion)
{
    struct spherical s = {.mesh = mesh, .n = mesh->n_vertices, .sliver = SLIVER};
    int status = SRNF_ENOMEM;

    s.positions = srnf_alloc(3 * s.n, sizeof(double));
    if (s.positions) {
        status = spherical_normalize(&s);
    }
    if (status == SRNF_OK) {
        spherical_measure(&s, points, distortion);
        (void)spherical_verify(mesh, points, &distortion->flipped);
    }
    srnf_free(s.positions);
    return status;
}

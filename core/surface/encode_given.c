/*
 * encode_given.c - the route given: the map to the sphere is a second mesh with the same faces in
 * the same order, whose vertices lie on a sphere, as in FreeSurfer's sphere files (radius 100).
 *
 * The sphere |x|^2 - 2 <c, x> - b = 0 that fits the vertices best (linear least squares in c and
 * b, about the middle of their bounding box and in units of its diagonal) gives centre and radius
 * R^2 = |c|^2 + b; its vertices go to the unit sphere along its radii. The rotation is kept: it is
 * the caller's correspondence. What is then checked exactly is what makes the map a bijection:
 * every face positively oriented, and the sphere covered once.
 */
#include "encode.h"
#include "sphere_map/sphere_map.h"

#include <lapacke.h>

/* Farther than this part of the radius from the sphere, a vertex was not meant to be on it; files
   in single precision are off by 1e-6. */
#define RADIUS_TOLERANCE 0.01

static int same_faces(const struct encode_task *task)
{
    const struct srnf_mesh *mesh = task->mesh;
    const struct srnf_mesh *sphere = task->options->sphere;

    if (!sphere) {
        return srnf_fail(task->error, SRNF_EINVAL, -1, "the route given needs a sphere");
    }
    if (sphere->n_vertices != mesh->n_vertices || sphere->n_faces != mesh->n_faces) {
        return srnf_fail(task->error, SRNF_EINVAL, -1,
                         "the sphere has %zu vertices and %zu faces, the mesh %zu and %zu",
                         sphere->n_vertices, sphere->n_faces, mesh->n_vertices, mesh->n_faces);
    }
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        if (sphere->faces[i] != mesh->faces[i]) {
            return srnf_fail(task->error, SRNF_EINVAL, (int64_t)(i / 3),
                             "face %zu of the sphere joins other vertices than that of the mesh",
                             i / 3);
        }
    }
    return SRNF_OK;
}

/* Least squares over the vertices x, given about a centre and scaled: a[4][4] y = r with
   y = (2 c, b). */
static int fit_sphere(const struct srnf_mesh *sphere, double center[3], double *radius)
{
    struct srnf_mesh_measures measures;
    double a[16] = {0.0};
    double r[4] = {0.0};
    double square = 0.0;

    srnf_mesh_measure(sphere, NULL, &measures);
    if (measures.out_of_range || !(measures.diagonal > 0.0)) {
        return SRNF_EINVAL;
    }
    for (size_t i = 0; i < sphere->n_vertices; i++) {
        double row[4] = {0.0, 0.0, 0.0, 1.0};
        double norm2;

        vector_subtract(sphere->vertices + 3 * i, measures.center, row);
        for (size_t c = 0; c < 3; c++) {
            row[c] /= measures.diagonal;
        }
        norm2 = vector_dot(row, row);
        for (size_t j = 0; j < 4; j++) {
            for (size_t k = 0; k < 4; k++) {
                a[4 * j + k] += row[j] * row[k];
            }
            r[j] += row[j] * norm2;
        }
    }
    if (LAPACKE_dposv_work(LAPACK_COL_MAJOR, 'U', 4, 1, a, 4, r, 4) != 0) {
        return SRNF_EINVAL; /* all vertices in one plane */
    }
    for (size_t c = 0; c < 3; c++) {
        square += 0.25 * r[c] * r[c];
        center[c] = measures.center[c] + 0.5 * measures.diagonal * r[c];
    }
    *radius = measures.diagonal * sqrt(square + r[3]);
    return *radius > 0.0 ? SRNF_OK : SRNF_EINVAL; /* a NaN is refused, too */
}

static int project(const struct encode_task *task, double *points)
{
    const struct srnf_mesh *sphere = task->options->sphere;
    double center[3];
    double radius;

    if (fit_sphere(sphere, center, &radius)) {
        return srnf_fail(task->error, SRNF_EINVAL, -1, "the vertices of the sphere are on none");
    }
    for (size_t i = 0; i < sphere->n_vertices; i++) {
        double *p = points + 3 * i;
        double length;

        vector_subtract(sphere->vertices + 3 * i, center, p);
        length = vector_norm(p);
        if (!(fabs(length / radius - 1.0) <= RADIUS_TOLERANCE)) {
            return srnf_fail(task->error, SRNF_EINVAL, (int64_t)i,
                             "vertex %zu of the sphere is %g from its centre (%g, %g, %g), and the "
                             "radius is %g",
                             i, length, center[0], center[1], center[2], radius);
        }
        for (size_t c = 0; c < 3; c++) {
            p[c] /= length;
        }
    }
    return SRNF_OK;
}

static int check_bijection(const struct encode_task *task, const double *points)
{
    const struct srnf_mesh *mesh = task->mesh;
    size_t flipped;

    if (spherical_verify(mesh, points, &flipped)) {
        return SRNF_OK;
    }
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const uint32_t *v = mesh->faces + 3 * f;

        if (spherical_orientation(points + 3 * (size_t)v[0], points + 3 * (size_t)v[1],
                                  points + 3 * (size_t)v[2]) <= 0) {
            return srnf_fail(task->error, SRNF_EINVAL, (int64_t)f,
                             "face %zu of the sphere is turned over or flat, as are %zu of its %zu "
                             "faces in all",
                             f, flipped, mesh->n_faces);
        }
    }
    return srnf_fail(task->error, SRNF_EINVAL, -1,
                     "the faces of the sphere cover it more than once");
}

int encode_given_points(const struct encode_task *task, double *points)
{
    int status = same_faces(task);

    if (status == SRNF_OK) {
        status = project(task, points);
    }
    return status == SRNF_OK ? check_bijection(task, points) : status;
}

int encode_given(const struct encode_task *task, struct encode_result *result)
{
    double *points = srnf_alloc(3 * task->mesh->n_vertices, sizeof(double));
    int status = points ? encode_given_points(task, points) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        status = spherical_distortion(task->mesh, points, &result->distortion);
    }
    if (status == SRNF_OK) {
        status = encode_through_map(task, points, result);
    }
    srnf_free(points);
    return status;
}

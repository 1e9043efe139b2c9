/*
 * mirror.c - the mirror image of a mesh and of a surface in the plane x = 0.
 *
 * The reflection is M = diag(-1, 1, 1). A mesh is reflected vertex by vertex, and its faces are
 * turned so that they stay counter-clockwise seen from outside. A surface f is reflected in space
 * and on the sphere,
 *
 *     f*(e) = M f(M e),
 *
 * which keeps orientation: M f alone has its normals inwards, f o M alone too. With det M = -1
 * twice, n* = M n o M and hence Q(f*) = M Q(f) o M, so that areas, volumes and distances between
 * surfaces are those of the surfaces that were reflected. On the sphere M takes phi to pi - phi and
 * leaves theta, so that
 *
 *     Y_lm(M e) = (-1)^m Y_lm(e) for m >= 0,  -(-1)^m Y_lm(e) for m < 0:
 *
 * in coefficients only signs change, the image is exact and its image is the surface itself, bit by
 * bit but for the sign of zeros. Radial surfaces stay radial: the mirror image of r e is r(M e) e.
 *
 * Reflections in other planes differ from this one by a rotation and a translation: with
 * H = I - 2 n n' the image is H f o M = (H M) M f o M, where H M is a rotation.
 */
#include "internal.h"
#include "mesh/mesh_geometry.h"

#include <math.h>

void srnf_mesh_mirror(struct srnf_mesh *mesh)
{
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        /* 0 - x rather than -x: a coordinate 0 stays 0, and prints as such. */
        mesh->vertices[3 * i] = 0.0 - mesh->vertices[3 * i];
    }
    srnf_repair_flip_faces(mesh);
}

void srnf_surface_mirror(size_t degree, double *coefficients)
{
    size_t count = srnf_coefficient_count(degree);

    for (size_t k = 0; k < 3; k++) {
        double *block = coefficients + k * count;
        bool reflected = k == 0;

        for (size_t l = 0; l <= degree; l++) {
            for (size_t i = 0; i <= 2 * l; i++) {
                /* m = i - l: the parity of m is that of i + l. */
                bool odd = (i + l) % 2 != 0;

                if ((odd != (i < l)) != reflected) {
                    block[l * l + i] = 0.0 - block[l * l + i];
                }
            }
        }
    }
}

/* v less twice its part along the normal. */
static void reflect(const double normal[3], double v[3])
{
    double along = 2.0 * (normal[0] * v[0] + normal[1] * v[1] + normal[2] * v[2]);

    for (size_t k = 0; k < 3; k++) {
        v[k] -= along * normal[k];
    }
}

static bool is_sagittal(const double normal[3])
{
    return fabs(normal[0]) == 1.0 && normal[1] == 0.0 && normal[2] == 0.0;
}

void srnf_mesh_mirror_in(struct srnf_mesh *mesh, const double normal[3])
{
    if (is_sagittal(normal)) {
        srnf_mesh_mirror(mesh);
        return;
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        reflect(normal, mesh->vertices + 3 * i);
    }
    srnf_repair_flip_faces(mesh);
}

void srnf_surface_mirror_in(size_t degree, double *coefficients, const double normal[3])
{
    size_t count = srnf_coefficient_count(degree);

    srnf_surface_mirror(degree, coefficients);
    for (size_t i = 0; !is_sagittal(normal) && i < count; i++) {
        double v[3] = {0.0 - coefficients[i], coefficients[count + i], coefficients[2 * count + i]};

        reflect(normal, v);
        for (size_t k = 0; k < 3; k++) {
            coefficients[k * count + i] = v[k];
        }
    }
}

/*
 * spherical_checks.h - what the tests of the spherical parameterization share: is a map a
 * bijection, and how much does it distort? Both by other means than the library's own.
 *
 * Orientation: determinants in the extended precision of long double, whose rounding is at most
 * 1e-18 of the sum of the sizes of its terms; what lies below that counts as turned over. Degree:
 * the number of faces that hold a given direction, counted at a few directions; together, a closed
 * mesh all of whose faces are positive and that covers some point once covers every point once.
 * Distortion: singular values of the linear map of each triangle.
 */
#ifndef TESTS_MESH_SPHERICAL_CHECKS_H
#define TESTS_MESH_SPHERICAL_CHECKS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/compare.h"
#include "support/folders.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/timing.h"
#include "support/triangulations.h"

#define CHECK_FOUR_PI 12.566370614359172954
#define CHECK_UNDECIDED 1e-18L
#define CHECK_DIRECTIONS 5

/* Sanitizers cost a factor of ten: tests of size take less of it then. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(TESTS_COUNT_LINES)
#define CHECK_SLOW 1
#else
#define CHECK_SLOW 0
#endif

/* Sign of det(a, b, c); 0 where rounding could have made it. */
static inline int check_sign(const double *a, const double *b, const double *c)
{
    long double determinant = 0.0L;
    long double terms = 0.0L;

    for (size_t k = 0; k < 3; k++) {
        size_t i = (k + 1) % 3;
        size_t j = (k + 2) % 3;
        long double plus = (long double)a[k] * b[i] * c[j];
        long double minus = (long double)a[k] * b[j] * c[i];

        determinant += plus - minus;
        terms += fabsl(plus) + fabsl(minus);
    }
    if (fabsl(determinant) <= CHECK_UNDECIDED * terms) {
        return 0;
    }
    return determinant > 0.0L ? 1 : -1;
}

/* How often the image of the mesh covers a direction, with sign; false where it lies on an edge. */
static inline bool check_covering(const struct srnf_mesh *mesh, const double *points,
                                  const double direction[3], int *covering)
{
    *covering = 0;
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const double *p[3];
        int sign[3];

        for (size_t k = 0; k < 3; k++) {
            p[k] = points + 3 * (size_t)mesh->faces[3 * f + k];
        }
        for (size_t k = 0; k < 3; k++) {
            sign[k] = check_sign(direction, p[(k + 1) % 3], p[(k + 2) % 3]);
        }
        if (sign[0] == sign[1] && sign[1] == sign[2]) {
            if (sign[0] == 0) {
                return false;
            }
            /* All three have the sign of the face on one side of the sphere and the other sign on
               the far side. */
            if (sign[0] == check_sign(p[0], p[1], p[2])) {
                *covering += sign[0];
            }
        }
    }
    return true;
}

/* Number of faces that are not surely positive. */
static inline size_t check_flips(const struct srnf_mesh *mesh, const double *points)
{
    size_t flips = 0;

    for (size_t f = 0; f < mesh->n_faces; f++) {
        const uint32_t *face = mesh->faces + 3 * f;

        flips += check_sign(points + 3 * (size_t)face[0], points + 3 * (size_t)face[1],
                            points + 3 * (size_t)face[2]) <= 0;
    }
    return flips;
}

/* Everything that a map must be, whatever the mesh was. */
static inline void check_bijection(const struct srnf_mesh *mesh,
                                   const struct srnf_spherical_map *map)
{
    struct test_random random = test_random_seed(mesh->n_vertices);

    assert_non_null(map->points);
    for (size_t v = 0; v < mesh->n_vertices; v++) {
        const double *p = map->points + 3 * v;

        assert_true(fabs(sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1.0) < 1e-15);
    }
    assert_int_equal(check_flips(mesh, map->points), 0);
    assert_int_equal(map->flipped, 0);
    for (size_t i = 0; i < CHECK_DIRECTIONS; i++) {
        double direction[3];
        int covering;

        test_random_direction(&random, direction);
        assert_true(check_covering(mesh, map->points, direction, &covering));
        assert_int_equal(covering, 1);
    }
    assert_true(isfinite(map->symmetric_dirichlet) && map->symmetric_dirichlet > 0.0);
    assert_true(isfinite(map->log_area_deviation) && map->log_area_deviation >= 0.0);
    assert_true(map->attempts >= 1);
}

/* Edges ab, ac of a triangle in a plane of its own: (x, 0) and (y, z). Returns its area. */
static inline double check_lay_flat(const double *a, const double *b, const double *c,
                                    double flat[3])
{
    double ab[3];
    double ac[3];
    double along = 0.0;
    double bb = 0.0;
    double cc = 0.0;

    for (size_t k = 0; k < 3; k++) {
        ab[k] = b[k] - a[k];
        ac[k] = c[k] - a[k];
        along += ab[k] * ac[k];
        bb += ab[k] * ab[k];
        cc += ac[k] * ac[k];
    }
    flat[0] = sqrt(bb);
    flat[1] = along / flat[0];
    flat[2] = sqrt(cc - flat[1] * flat[1]);
    return 0.5 * flat[0] * flat[2];
}

/* Integral over the mesh, scaled to area 4 pi, of s1^2 + s2^2 + 1/s1^2 + 1/s2^2 of the piecewise
   linear map to the points, over 4 pi; and the deviation of the log of s1 s2. */
static inline double check_distortion(const struct srnf_mesh *mesh, const double *points,
                                      double *deviation)
{
    double total = 0.0;
    double energy = 0.0;
    double mean = 0.0;
    double square = 0.0;

    for (int pass = 0; pass < 2; pass++) {
        for (size_t f = 0; f < mesh->n_faces; f++) {
            const uint32_t *face = mesh->faces + 3 * f;
            double from[3];
            double to[3];
            double area = check_lay_flat(mesh->vertices + 3 * (size_t)face[0],
                                         mesh->vertices + 3 * (size_t)face[1],
                                         mesh->vertices + 3 * (size_t)face[2], from);
            double scale;
            double j[3]; /* the map, upper triangular: (j0, j1; 0, j2) */
            double norm;
            double determinant;

            if (pass == 0) {
                total += area;
                continue;
            }
            scale = sqrt(CHECK_FOUR_PI / total);
            (void)check_lay_flat(points + 3 * (size_t)face[0], points + 3 * (size_t)face[1],
                                 points + 3 * (size_t)face[2], to);
            j[0] = to[0] / (scale * from[0]);
            j[1] = (to[1] - j[0] * scale * from[1]) / (scale * from[2]);
            j[2] = to[2] / (scale * from[2]);
            norm = j[0] * j[0] + j[1] * j[1] + j[2] * j[2];
            determinant = j[0] * j[2];
            energy += area / total * (norm + norm / (determinant * determinant));
            mean += area / total * log(determinant);
            square += area / total * log(determinant) * log(determinant);
        }
    }
    *deviation = sqrt(compare_max(0.0, square - mean * mean));
    return energy;
}

/* Maps a mesh, checks what came out if it succeeded, prints a line, and returns the status. */
static inline int check_map(const char *name, const struct srnf_mesh *mesh,
                            struct srnf_spherical_map *map)
{
    struct srnf_error error = {0};
    double start = timing_cpu();
    int status = srnf_spherical_map(mesh, NULL, map, &error);
    double seconds = timing_cpu() - start;

    if (status == SRNF_OK) {
        printf("# %-28s %7zu faces  E %9.4f  sd %6.3f  attempts %zu  %8.1f ms\n", name,
               mesh->n_faces, map->symmetric_dirichlet, map->log_area_deviation, map->attempts,
               1e3 * seconds);
        check_bijection(mesh, map);
    } else {
        printf("# %-28s %7zu faces  status %d: %s  %8.1f ms\n", name, mesh->n_faces, status,
               error.message, 1e3 * seconds);
        assert_int_equal(error.status, status);
        assert_true(strlen(error.message) > 0);
        assert_null(map->points);
    }
    return status;
}

#endif

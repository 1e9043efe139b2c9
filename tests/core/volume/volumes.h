/*
 * volumes.h - label volumes that tests make: of formulas, and by hand.
 */
#ifndef TESTS_VOLUMES_H
#define TESTS_VOLUMES_H

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "srnf.h"

#define VOLUME_LABEL 7

/* No NaN is within anything. */
#define assert_within(value, expected, tolerance) \
    assert_true(fabs((value) - (expected)) <= (tolerance))

/* An empty volume of labels VOLUME_LABEL (the only one). */
static inline void volume_make(struct srnf_volume *volume, size_t nx, size_t ny, size_t nz,
                               const double affine[12])
{
    *volume = (struct srnf_volume){.format = SRNF_VOLUME_NIFTI, .shape = {nx, ny, nz}};
    memcpy(volume->affine, affine, sizeof volume->affine);
    for (size_t k = 0; k < 3; k++) {
        volume->spacing[k] = sqrt(affine[k] * affine[k] + affine[4 + k] * affine[4 + k] +
                                  affine[8 + k] * affine[8 + k]);
    }
    volume->voxels = srnf_alloc(nx * ny * nz, sizeof *volume->voxels);
    volume->labels = srnf_alloc(1, sizeof *volume->labels);
    assert(volume->voxels && volume->labels);
    volume->n_labels = 1;
    volume->labels[0].value = VOLUME_LABEL;
}

static inline void volume_set(struct srnf_volume *volume, size_t i, size_t j, size_t k, bool in)
{
    uint16_t *voxel = &volume->voxels[(k * volume->shape[1] + j) * volume->shape[0] + i];

    volume->labels[0].voxels += (size_t)in - *voxel;
    *voxel = in;
}

/* The world's point of a voxel's centre. */
static inline void volume_point(const struct srnf_volume *volume, size_t i, size_t j, size_t k,
                                double point[3])
{
    const double *a = volume->affine;

    for (size_t r = 0; r < 3; r++) {
        point[r] = a[4 * r] * (double)i + a[4 * r + 1] * (double)j + a[4 * r + 2] * (double)k +
                   a[4 * r + 3];
    }
}

/* Sets the voxels whose centres are inside. */
static inline void volume_fill(struct srnf_volume *volume,
                               bool (*inside)(const double point[3], const void *shape),
                               const void *shape)
{
    for (size_t k = 0; k < volume->shape[2]; k++) {
        for (size_t j = 0; j < volume->shape[1]; j++) {
            for (size_t i = 0; i < volume->shape[0]; i++) {
                double point[3];

                volume_point(volume, i, j, k, point);
                volume_set(volume, i, j, k, inside(point, shape));
            }
        }
    }
}

/* The unit ball, stretched and moved. */
struct ellipsoid {
    double radius[3], center[3];
};

static inline bool in_ellipsoid(const double point[3], const void *shape)
{
    const struct ellipsoid *e = shape;
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double x = (point[k] - e->center[k]) / e->radius[k];

        sum += x * x;
    }
    return sum <= 1.0;
}

/* A volume of cubes of side h that holds [-extent, extent]^3, its centre off a voxel's. */
static inline void volume_around(struct srnf_volume *volume, double extent, double h)
{
    size_t n = (size_t)ceil(2.0 * extent / h) + 2;
    double low = -0.5 * h * ((double)n - 1.0) + 0.17 * h;
    const double affine[12] = {h, 0, 0, low, 0, h, 0, low, 0, 0, h, low};

    volume_make(volume, n, n, n, affine);
}

#endif

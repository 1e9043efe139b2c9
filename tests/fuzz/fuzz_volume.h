/*
 * fuzz_volume.h - what the fuzz targets of volumes do with the bytes they are given: read them,
 * hold the result against the promises of srnf.h, and extract a small label of it.
 */
#ifndef TESTS_FUZZ_VOLUME_H
#define TESTS_FUZZ_VOLUME_H

#include <math.h>
#include <string.h>

#include "fuzz/fuzz_require.h"
#include "srnf.h"

#define FUZZ_VOXELS_MAX ((size_t)1 << 20)
#define FUZZ_EXTRACTED_MAX ((size_t)4096)

static inline void fuzz_check_volume(const struct srnf_volume *volume)
{
    size_t count = volume->shape[0] * volume->shape[1] * volume->shape[2], sum = volume->background;

    fuzz_require(count > 0 && count <= FUZZ_VOXELS_MAX);
    for (size_t i = 0; i < 12; i++) {
        fuzz_require(isfinite(volume->affine[i]));
    }
    for (size_t i = 0; i < volume->n_labels; i++) {
        fuzz_require(volume->labels[i].value != 0 && volume->labels[i].voxels > 0);
        fuzz_require(i == 0 || volume->labels[i].value > volume->labels[i - 1].value);
        fuzz_require(memchr(volume->labels[i].name, '\0', SRNF_LABEL_NAME_MAX) != NULL);
        sum += volume->labels[i].voxels;
    }
    fuzz_require(sum == count);
    for (size_t i = 0; i < count; i++) {
        fuzz_require(volume->voxels[i] <= volume->n_labels);
    }
}

static inline int fuzz_volume(const uint8_t *data, size_t size, enum srnf_volume_format format)
{
    struct srnf_volume_limits limits = srnf_volume_limits_defaults();
    struct srnf_error error = {.message = ""};
    struct srnf_extracted extracted;
    struct srnf_volume volume;
    int status;

    limits.max_voxels = FUZZ_VOXELS_MAX;
    status = srnf_volume_read(data, size, format, &limits, &volume, &error);
    if (status != SRNF_OK) {
        fuzz_require(status == SRNF_EPARSE || status == SRNF_EFORMAT || status == SRNF_ELIMIT);
        fuzz_require(error.status == status && error.message[0] != '\0');
        return 0;
    }
    fuzz_require(volume.format == format);
    fuzz_check_volume(&volume);
    if (volume.n_labels > 0 &&
        volume.shape[0] * volume.shape[1] * volume.shape[2] <= FUZZ_EXTRACTED_MAX) {
        status = srnf_extract(&volume, &volume.labels[0].value, 1, NULL, NULL, &extracted, &error);
        fuzz_require(status == SRNF_OK || status == SRNF_ENUMERIC || status == SRNF_EDEGENERATE ||
                     status == SRNF_EINVAL);
        srnf_extracted_clear(&extracted);
    }
    srnf_volume_clear(&volume);
    return 0;
}

#endif

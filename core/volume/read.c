/*
 * read.c - a label volume from memory: which format, and what all formats have in common.
 *
 * The readers are our own. Debian's libraries, libnifti (nifti2-io 3.0.1) and teem (1.12), read
 * from named files, allocate what a header promises before they look at the file, print to stderr,
 * and their memory is in no account. nibabel, which is neither, is the oracle of the tests' files.
 */
#include "volume.h"

#include <math.h>
#include <string.h>

#define DEFAULT_VOXELS ((size_t)1 << 28)
#define DEFAULT_MEMORY ((size_t)1 << 30)
#define FARTHEST 1e12 /* mm: no scanner's voxel is a million kilometres away */
#define HEAD_SIZE ((size_t)348)

static const struct {
    enum srnf_volume_format format;
    const char *name;
    bool (*is)(const unsigned char *head, size_t size);
    int (*read)(struct volume_reader *reader);
} formats[] = {
    {SRNF_VOLUME_NIFTI, "nifti", volume_is_nifti, volume_read_nifti},
    {SRNF_VOLUME_NRRD, "nrrd", volume_is_nrrd, volume_read_nrrd},
};
#define N_FORMATS (sizeof formats / sizeof formats[0])

struct srnf_volume_limits srnf_volume_limits_defaults(void)
{
    return (struct srnf_volume_limits){.max_voxels = DEFAULT_VOXELS, .max_memory = DEFAULT_MEMORY};
}

void srnf_volume_clear(struct srnf_volume *volume)
{
    srnf_free(volume->voxels);
    srnf_free(volume->labels);
    *volume = (struct srnf_volume){.format = SRNF_VOLUME_UNKNOWN};
}

const char *srnf_volume_format_name(enum srnf_volume_format format)
{
    for (size_t i = 0; i < N_FORMATS; i++) {
        if (formats[i].format == format) {
            return formats[i].name;
        }
    }
    return "unknown";
}

enum srnf_volume_format srnf_volume_format_from_name(const char *name)
{
    for (size_t i = 0; i < N_FORMATS; i++) {
        if (strcmp(formats[i].name, name) == 0) {
            return formats[i].format;
        }
    }
    return SRNF_VOLUME_UNKNOWN;
}

const char *srnf_volume_space_name(enum srnf_volume_space space)
{
    static const char *const names[] = {"none", "sform", "qform", "RAS", "LPS", "LAS", "other"};

    return (size_t)space < sizeof names / sizeof names[0] ? names[space] : "none";
}

int volume_place(struct volume_reader *reader, const double affine[12], double unit)
{
    struct srnf_volume *volume = &reader->volume;
    double *a = volume->affine;
    double det, product = 1.0;

    for (size_t i = 0; i < 12; i++) {
        a[i] = affine[i] * unit + 0.0; /* no -0 */
        if (!(fabs(a[i]) <= FARTHEST)) {
            return srnf_fail(reader->error, SRNF_EPARSE, -1,
                             "row %zu, column %zu of the matrix from voxels to space is %g mm; it "
                             "must be finite, and within %g mm",
                             i / 4, i % 4, a[i], FARTHEST);
        }
    }
    for (size_t k = 0; k < 3; k++) {
        volume->spacing[k] = sqrt(a[k] * a[k] + a[4 + k] * a[4 + k] + a[8 + k] * a[8 + k]);
        product *= volume->spacing[k];
    }
    det = a[0] * (a[5] * a[10] - a[6] * a[9]) - a[1] * (a[4] * a[10] - a[6] * a[8]) +
          a[2] * (a[4] * a[9] - a[5] * a[8]);
    if (!isfinite(det) || !isfinite(product) || !(fabs(det) > 1e-6 * product) ||
        !(product > 1e-30) || !(product < 1e30)) {
        return srnf_fail(
            reader->error, SRNF_EPARSE, -1,
            "the matrix from voxels to space is singular or not finite (voxels of %g x "
            "%g x %g mm, determinant %g)",
            volume->spacing[0], volume->spacing[1], volume->spacing[2], det);
    }
    return SRNF_OK;
}

/* The format that the first bytes, unpacked, speak for. */
static int sniff(struct volume_reader *reader, enum srnf_volume_format *format)
{
    unsigned char head[HEAD_SIZE];
    size_t got = 0;
    int status = volume_source_open(reader, reader->bytes, reader->size);

    *format = SRNF_VOLUME_UNKNOWN;
    if (status == SRNF_OK) {
        status = volume_source_read(reader, head, sizeof head, &got);
    }
    volume_source_close(&reader->source);
    for (size_t i = 0; status == SRNF_OK && i < N_FORMATS; i++) {
        if (formats[i].is(head, got)) {
            *format = formats[i].format;
            return SRNF_OK;
        }
    }
    return status != SRNF_OK
               ? status
               : srnf_fail(reader->error, SRNF_EFORMAT, -1,
                           "the bytes are no NIfTI (.nii, .nii.gz) and no NRRD file; a series of "
                           "DICOM or an MGZ file is to be converted to one of them first");
}

static int read_as(struct volume_reader *reader, enum srnf_volume_format format)
{
    int status = SRNF_EFORMAT;

    reader->volume.format = format;
    reader->volume.units = "unknown";
    for (size_t i = 0; i < N_FORMATS; i++) {
        if (formats[i].format == format) {
            status = volume_source_open(reader, reader->bytes, reader->size);
            status = status == SRNF_OK ? formats[i].read(reader) : status;
            status = status == SRNF_OK ? volume_source_finish(reader) : status;
            volume_source_close(&reader->source);
        }
    }
    return status == SRNF_OK ? volume_finish(reader) : status;
}

int srnf_volume_read(const void *bytes, size_t size, enum srnf_volume_format format,
                     const struct srnf_volume_limits *limits, struct srnf_volume *volume,
                     struct srnf_error *error)
{
    struct volume_reader *reader = srnf_alloc(1, sizeof *reader);
    int status = SRNF_OK;

    *volume = (struct srnf_volume){.format = SRNF_VOLUME_UNKNOWN};
    if (!reader) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "not enough memory to read");
    }
    reader->bytes = bytes;
    reader->size = size;
    reader->limits = limits ? *limits : srnf_volume_limits_defaults();
    reader->error = error;
    reader->locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (reader->locale == (locale_t)0) {
        status = srnf_fail(error, SRNF_ENOMEM, -1, "not enough memory to read");
    }
    if (status == SRNF_OK && format == SRNF_VOLUME_UNKNOWN) {
        status = sniff(reader, &format);
    }
    if (status == SRNF_OK) {
        status = read_as(reader, format);
    }
    if (status == SRNF_OK) {
        *volume = reader->volume;
    } else {
        srnf_volume_clear(&reader->volume);
    }
    if (status == SRNF_ECANCELED) {
        (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
    }
    if (reader->locale != (locale_t)0) {
        freelocale(reader->locale);
    }
    srnf_free(reader->values);
    srnf_free(reader->names);
    srnf_free(reader);
    return status;
}

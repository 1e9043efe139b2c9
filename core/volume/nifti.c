/*
 * nifti.c - NIfTI-1 and NIfTI-2, header and voxels in one file.
 *
 * R. W. Cox and others, "A (sort of) new image data format standard: NIfTI-1" (2004), and NIfTI-2
 * (2011), nifti1.h and nifti2.h. The sform places the voxels where it has a code, otherwise the
 * qform where that has one, otherwise the sizes of the voxels alone; all are RAS+. A scale of 0,
 * or one that is not finite, means none; so does a bitpix of 0. Extensions between header and
 * voxels are passed over.
 */
#include "volume.h"

#include <math.h>
#include <string.h>

#define NIFTI1_SIZE ((size_t)348)
#define NIFTI2_SIZE ((size_t)540)
#define EXTENDER_SIZE ((size_t)4) /* behind the header of a single file */
#define OFFSET_MAX (1 << 26)

/* Where the members of the header are, in both versions. */
struct layout {
    size_t size, magic, dim, datatype, bitpix, pixdim, vox_offset, slope, inter, qform, sform,
        quatern, qoffset, srow, units;
    enum scalar_type dim_type, code_type, real_type, offset_type, units_type;
};

static const struct layout nifti1 = {
    348,
    344,
    40,
    70,
    72,
    76,
    108,
    112,
    116,
    252,
    254,
    256,
    268,
    280,
    123,
    SCALAR_INT16,
    SCALAR_INT16,
    SCALAR_FLOAT32,
    SCALAR_FLOAT32,
    SCALAR_UINT8,
};
static const struct layout nifti2 = {
    540,          4,
    16,           12,
    14,           104,
    168,          176,
    184,          344,
    348,          352,
    376,          400,
    500,          SCALAR_INT64,
    SCALAR_INT32, SCALAR_FLOAT64,
    SCALAR_INT64, SCALAR_INT32,
};

struct header {
    const struct layout *layout;
    unsigned char bytes[NIFTI2_SIZE];
    bool big_endian;
};

static double number(const struct header *header, enum scalar_type type, size_t at)
{
    return scalar_value(type, header->bytes + at, header->big_endian);
}

/* Element i of an array of reals. */
static double real(const struct header *header, size_t at, size_t i)
{
    enum scalar_type type = header->layout->real_type;

    return number(header, type, at + i * scalar_size(type));
}

/* Whether the first four bytes are a size of either version, in either byte order. */
static const struct layout *layout_of(const unsigned char *head, bool *big_endian)
{
    for (int big = 0; big < 2; big++) {
        double size = scalar_value(SCALAR_INT32, head, big != 0);

        *big_endian = big != 0;
        if (size == (double)NIFTI1_SIZE || size == (double)NIFTI2_SIZE) {
            return size == (double)NIFTI1_SIZE ? &nifti1 : &nifti2;
        }
    }
    return NULL;
}

bool volume_is_nifti(const unsigned char *head, size_t size)
{
    bool big_endian;

    return size >= 8 && layout_of(head, &big_endian) != NULL;
}

static int truncated(struct volume_reader *reader)
{
    return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)reader->size,
                     "the file ends within the header");
}

static int read_header(struct volume_reader *reader, struct header *header)
{
    size_t got = 0;
    int status = volume_source_read(reader, header->bytes, 4, &got);

    if (status == SRNF_OK && got < 4) {
        return truncated(reader);
    }
    if (status != SRNF_OK) {
        return status;
    }
    header->layout = layout_of(header->bytes, &header->big_endian);
    if (!header->layout) {
        return srnf_fail(reader->error, SRNF_EPARSE, 0,
                         "the header's size is neither 348 (NIfTI-1) nor 540 (NIfTI-2)");
    }
    status = volume_source_read(reader, header->bytes + 4, header->layout->size - 4, &got);
    return status == SRNF_OK && got < header->layout->size - 4 ? truncated(reader) : status;
}

static int check_magic(struct volume_reader *reader, const struct header *header)
{
    const unsigned char *magic = header->bytes + header->layout->magic;

    if (memcmp(magic, "ni1", 4) == 0 || memcmp(magic, "ni2", 4) == 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "the header is that of a pair of files (.hdr and .img); save it as one "
                         ".nii or .nii.gz");
    }
    if (memcmp(magic, "n+1", 4) != 0 && memcmp(magic, "n+2", 4) != 0) {
        return srnf_fail(
            reader->error, SRNF_EPARSE, (int64_t)header->layout->magic,
            "the magic of NIfTI is missing: an Analyze 7.5 file does not say where left "
            "is; convert it to NIfTI");
    }
    return SRNF_OK;
}

/* Three sizes; further ones have to be 1. */
static int read_sizes(struct volume_reader *reader, const struct header *header, int64_t sizes[3])
{
    const struct layout *layout = header->layout;
    size_t step = scalar_size(layout->dim_type);
    double axes = number(header, layout->dim_type, layout->dim);

    if (!(axes >= 1.0 && axes <= 7.0)) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)layout->dim,
                         "dim[0] is %g; it must be from 1 to 7", axes);
    }
    for (size_t k = 0; k < 7; k++) {
        double size =
            (double)k < axes ? number(header, layout->dim_type, layout->dim + (k + 1) * step) : 1.0;

        if (size < 0.0) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)layout->dim,
                             "dim[%zu] is %g; there must be one voxel at least along each axis",
                             k + 1, size);
        }
        if (k >= 3 && size > 1.0) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)layout->dim,
                             "dim[%zu] is %g: the file has several volumes; send one of them",
                             k + 1, size);
        }
        if (k < 3) {
            sizes[k] = size >= 1e18 ? INT64_MAX : size <= 0.0 ? 0 : (int64_t)size;
        }
    }
    return SRNF_OK;
}

static int read_type(struct volume_reader *reader, const struct header *header)
{
    static const struct {
        int code;
        enum scalar_type type;
    } types[] = {
        {2, SCALAR_UINT8},    {4, SCALAR_INT16},     {8, SCALAR_INT32},    {16, SCALAR_FLOAT32},
        {64, SCALAR_FLOAT64}, {256, SCALAR_INT8},    {512, SCALAR_UINT16}, {768, SCALAR_UINT32},
        {1024, SCALAR_INT64}, {1280, SCALAR_UINT64},
    };
    const struct layout *layout = header->layout;
    double code = number(header, SCALAR_INT16, layout->datatype);
    double bits = number(header, SCALAR_INT16, layout->bitpix);

    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        if (types[i].code == (int)code) {
            reader->type = types[i].type;
        }
    }
    if (reader->type == SCALAR_NONE) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)layout->datatype,
                         "datatype %g is none of whole or real numbers; save labels as int16 or "
                         "int32",
                         code);
    }
    if (bits != 0.0 && bits != 8.0 * (double)scalar_size(reader->type)) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)layout->bitpix,
                         "bitpix is %g, and datatype %g has %zu bits: one of them is wrong", bits,
                         code, 8 * scalar_size(reader->type));
    }
    return SRNF_OK;
}

static void read_scale(struct volume_reader *reader, const struct header *header)
{
    const struct layout *layout = header->layout;
    double slope = real(header, layout->slope, 0), inter = real(header, layout->inter, 0);

    reader->big_endian = header->big_endian;
    reader->slope = slope;
    reader->intercept = isfinite(inter) ? inter : 0.0;
    reader->scaled = isfinite(slope) && slope != 0.0 && !(slope == 1.0 && reader->intercept == 0.0);
}

/* The rotation of the unit quaternion (a, b, c, d), a >= 0, times the sizes of the voxels. */
static void qform_affine(const struct header *header, double affine[12])
{
    const struct layout *layout = header->layout;
    double b = real(header, layout->quatern, 0), c = real(header, layout->quatern, 1);
    double d = real(header, layout->quatern, 2), a = 1.0 - (b * b + c * c + d * d);
    double size[3], flip = real(header, layout->pixdim, 0) < 0.0 ? -1.0 : 1.0;

    if (a < 1e-7) {
        double norm = 1.0 / sqrt(b * b + c * c + d * d);

        b *= norm;
        c *= norm;
        d *= norm;
        a = 0.0;
    } else {
        a = sqrt(a);
    }
    const double rotation[9] = {
        a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d),         2.0 * (b * d + a * c),
        2.0 * (b * c + a * d),         a * a + c * c - b * b - d * d, 2.0 * (c * d - a * b),
        2.0 * (b * d - a * c),         2.0 * (c * d + a * b),         a * a + d * d - b * b - c * c,
    };
    for (size_t k = 0; k < 3; k++) {
        size[k] = fabs(real(header, layout->pixdim, k + 1)) * (k == 2 ? flip : 1.0);
    }
    for (size_t row = 0; row < 3; row++) {
        for (size_t k = 0; k < 3; k++) {
            affine[4 * row + k] = rotation[3 * row + k] * size[k];
        }
        affine[4 * row + 3] = real(header, layout->qoffset, row);
    }
}

/* Where nothing but pixdim says how large the voxels are. An axis that the file does not have needs
   no size. */
static int place_by_sizes(struct volume_reader *reader, const struct header *header,
                          double affine[12])
{
    const struct layout *layout = header->layout;
    double axes = number(header, layout->dim_type, layout->dim);

    reader->volume.space = SRNF_SPACE_NONE;
    for (size_t k = 0; k < 3; k++) {
        double size = fabs(real(header, layout->pixdim, k + 1));

        if (!(size > 0.0) && (double)k < axes) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)layout->pixdim,
                             "pixdim[%zu] is %g, and neither sform nor qform gives the size of the "
                             "voxels: set it, or save the file with its transform",
                             k + 1, size);
        }
        affine[5 * k] = size > 0.0 ? size : 1.0;
    }
    return SRNF_OK;
}

static int read_place(struct volume_reader *reader, const struct header *header)
{
    static const struct {
        const char *name;
        double millimetres;
    } units[] = {
        {"unknown", 1.0}, {"metres", 1000.0}, {"millimetres", 1.0}, {"micrometres", 0.001}};
    const struct layout *layout = header->layout;
    size_t unit = (size_t)((int64_t)number(header, layout->units_type, layout->units) & 7);
    double affine[12] = {0};
    int status = SRNF_OK;

    unit = unit < sizeof units / sizeof units[0] ? unit : 0;
    reader->volume.units = units[unit].name;
    if (number(header, layout->code_type, layout->sform) > 0.0) {
        reader->volume.space = SRNF_SPACE_SFORM;
        for (size_t i = 0; i < 12; i++) {
            affine[i] = real(header, layout->srow, i);
        }
    } else if (number(header, layout->code_type, layout->qform) > 0.0) {
        reader->volume.space = SRNF_SPACE_QFORM;
        qform_affine(header, affine);
    } else {
        status = place_by_sizes(reader, header, affine);
    }
    return status == SRNF_OK ? volume_place(reader, affine, units[unit].millimetres) : status;
}

int volume_read_nifti(struct volume_reader *reader)
{
    struct header header = {.layout = NULL};
    int64_t sizes[3];
    double offset, least;
    int status = read_header(reader, &header);

    status = status == SRNF_OK ? check_magic(reader, &header) : status;
    status = status == SRNF_OK ? read_sizes(reader, &header, sizes) : status;
    status = status == SRNF_OK ? read_type(reader, &header) : status;
    status = status == SRNF_OK ? read_place(reader, &header) : status;
    if (status != SRNF_OK) {
        return status;
    }
    read_scale(reader, &header);
    offset = number(&header, header.layout->offset_type, header.layout->vox_offset);
    least = (double)(header.layout->size + EXTENDER_SIZE);
    if (!(offset >= least && offset <= OFFSET_MAX) || floor(offset) != offset) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)header.layout->vox_offset,
                         "vox_offset is %g; in a single file it must be a whole number from %g to "
                         "%d, or the voxels would be read from the wrong place",
                         offset, least, OFFSET_MAX);
    }
    status = volume_source_skip(reader, (uint64_t)offset - header.layout->size);
    status = status == SRNF_OK ? volume_expect(reader, sizes, scalar_size(reader->type)) : status;
    return status == SRNF_OK ? volume_read_voxels(reader) : status;
}

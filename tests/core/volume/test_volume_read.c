/*
 * test_volume_read.c - label volumes from NIfTI and NRRD: every type and byte order, the
 * transforms, units, names, and what is no label volume.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>

#include "core/volume/volume_files.h"
#include "core/volume/volumes.h"

static const int64_t shape[3] = {2, 2, 2};
static unsigned char file[1 << 16], packed[1 << 16];

static void read_well(const void *bytes, size_t size, struct srnf_volume *volume)
{
    struct srnf_error error = {.message = ""};

    if (srnf_volume_read(bytes, size, SRNF_VOLUME_UNKNOWN, NULL, volume, &error) != SRNF_OK) {
        fail_msg("%s", error.message);
    }
}

/* Refused with this status and these words. */
static void read_badly(const void *bytes, size_t size, int status, const char *words)
{
    struct srnf_error error = {.message = ""};
    struct srnf_volume volume;

    assert_int_equal(srnf_volume_read(bytes, size, SRNF_VOLUME_UNKNOWN, NULL, &volume, &error),
                     status);
    if (!strstr(error.message, words)) {
        fail_msg("\"%s\" has no \"%s\"", error.message, words);
    }
    assert_null(volume.voxels);
    assert_null(volume.labels);
}

/* The labels 0 1 1 0 3 3 3 0. */
static void check_labels(const struct srnf_volume *volume)
{
    static const uint16_t places[8] = {0, 1, 1, 0, 2, 2, 2, 0};

    assert_int_equal(volume->n_labels, 2);
    assert_int_equal(volume->labels[0].value, 1);
    assert_int_equal(volume->labels[0].voxels, 2);
    assert_int_equal(volume->labels[1].value, 3);
    assert_int_equal(volume->labels[1].voxels, 3);
    assert_int_equal(volume->background, 3);
    assert_memory_equal(volume->voxels, places, sizeof places);
    assert_int_equal(volume->shape[0] * volume->shape[1] * volume->shape[2], 8);
}

/* ---- NIfTI ----------------------------------------------------------------------------------- */

#define TYPED(T, code)                                                    \
    static size_t make_##code(unsigned char *voxels, bool big)            \
    {                                                                     \
        static const T values[8] = {0, 1, 1, 0, 3, 3, 3, 0};              \
                                                                          \
        for (size_t i = 0; i < 8; i++) {                                  \
            file_put(voxels + i * sizeof(T), &values[i], sizeof(T), big); \
        }                                                                 \
        return sizeof values;                                             \
    }
TYPED(uint8_t, NIFTI_UINT8)
TYPED(int16_t, NIFTI_INT16)
TYPED(int32_t, NIFTI_INT32)
TYPED(float, NIFTI_FLOAT)
TYPED(double, NIFTI_DOUBLE)
TYPED(int8_t, NIFTI_INT8)
TYPED(uint16_t, NIFTI_UINT16)
TYPED(uint32_t, NIFTI_UINT32)
TYPED(int64_t, NIFTI_INT64)
TYPED(uint64_t, NIFTI_UINT64)

static void every_type_version_and_byte_order(void **state)
{
    static const struct {
        int datatype;
        size_t (*make)(unsigned char *voxels, bool big);
    } types[] = {
        {NIFTI_UINT8, make_NIFTI_UINT8},   {NIFTI_INT16, make_NIFTI_INT16},
        {NIFTI_INT32, make_NIFTI_INT32},   {NIFTI_FLOAT, make_NIFTI_FLOAT},
        {NIFTI_DOUBLE, make_NIFTI_DOUBLE}, {NIFTI_INT8, make_NIFTI_INT8},
        {NIFTI_UINT16, make_NIFTI_UINT16}, {NIFTI_UINT32, make_NIFTI_UINT32},
        {NIFTI_INT64, make_NIFTI_INT64},   {NIFTI_UINT64, make_NIFTI_UINT64},
    };
    (void)state;

    for (size_t n = 0; n < 4 * sizeof types / sizeof types[0]; n++) {
        unsigned char voxels[64];
        bool big = n & 1;
        size_t size = types[n / 4].make(voxels, big);
        struct srnf_volume volume;

        size = nifti_make(file, n & 2 ? 2 : 1, big, types[n / 4].datatype, shape, voxels, size);
        read_well(file, size, &volume);
        check_labels(&volume);
        assert_int_equal(volume.format, SRNF_VOLUME_NIFTI);
        assert_int_equal(volume.space, SRNF_SPACE_NONE);
        srnf_volume_clear(&volume);
        size = file_pack(packed, sizeof packed, file, size);
        read_well(packed, size, &volume);
        check_labels(&volume);
        srnf_volume_clear(&volume);
        /* two gzip members are one file */
        memcpy(file, packed, size);
        size += file_pack(file + size, 1000, "", 0);
        read_well(file, size, &volume);
        srnf_volume_clear(&volume);
    }
}

static size_t make_simple(int version)
{
    unsigned char voxels[64];
    size_t size = make_NIFTI_INT16(voxels, false);

    return nifti_make(file, version, false, NIFTI_INT16, shape, voxels, size);
}

static void put_code(size_t at1, size_t at2, int version, int code)
{
    const int16_t narrow = (int16_t)code;
    const int32_t wide = code;

    if (version == 1) {
        file_put(file + at1, &narrow, 2, false);
    } else {
        file_put(file + at2, &wide, 4, false);
    }
}

/* Scale and intercept apply, and a scale of 0 is none. */
static void values_are_scaled(void **state)
{
    size_t size = make_simple(1);
    struct srnf_volume volume;
    (void)state;

    file_put_real(file, 112, 0, 2.0, false);
    file_put_real(file, 116, 0, 10.0, false);
    read_well(file, size, &volume);
    assert_int_equal(volume.n_labels, 3); /* 10, 12, 16 */
    assert_int_equal(volume.labels[2].value, 16);
    assert_int_equal(volume.background, 0);
    srnf_volume_clear(&volume);
    file_put_real(file, 112, 0, 0.0, false);
    read_well(file, size, &volume);
    check_labels(&volume);
    srnf_volume_clear(&volume);
    file_put_real(file, 112, 0, 0.5, false);
    file_put_real(file, 116, 0, 0.0, false);
    read_badly(file, size, SRNF_EPARSE, "voxel (1, 0, 0) is 0.5");
}

/* The sform goes before the qform, that before the voxels' sizes; units become millimetres. */
static void transforms_and_units(void **state)
{
    (void)state;

    for (int version = 1; version <= 2; version++) {
        static const double srow[12] = {0, -2, 0, 10, 3, 0, 0, 20, 0, 0, 4, 30};
        size_t size = make_simple(version), qform = version == 1 ? 256 : 352;
        struct srnf_volume volume;

        for (size_t k = 0; k < 3; k++) {
            file_put_real(file, version == 1 ? 76 : 104, k + 1, 2.0 + (double)k, false);
            file_put_real(file, version == 1 ? 268 : 376, k, 5.0 * (double)k, false);
        }
        read_well(file, size, &volume);
        assert_within(volume.affine[5], 3.0, 1e-12);
        assert_within(volume.affine[3], 0.0, 1e-12);
        srnf_volume_clear(&volume);

        /* A quarter turn about z, and the third axis reversed by pixdim[0] = -1. */
        put_code(252, 344, version, 1);
        file_put_real(file, qform, 2, sqrt(0.5), false);
        file_put_real(file, version == 1 ? 76 : 104, 0, -1.0, false);
        read_well(file, size, &volume);
        assert_int_equal(volume.space, SRNF_SPACE_QFORM);
        assert_within(volume.affine[1], -3.0, 1e-5);
        assert_within(volume.affine[4], 2.0, 1e-5);
        assert_within(volume.affine[10], -4.0, 1e-5);
        assert_within(volume.affine[7], 5.0, 1e-5);
        srnf_volume_clear(&volume);

        put_code(254, 348, version, 2);
        for (size_t i = 0; i < 12; i++) {
            file_put_real(file, version == 1 ? 280 : 400, i, srow[i], false);
        }
        file[version == 1 ? 123 : 500] = 1; /* metres */
        read_well(file, size, &volume);
        assert_int_equal(volume.space, SRNF_SPACE_SFORM);
        assert_string_equal(volume.units, "metres");
        for (size_t i = 0; i < 12; i++) {
            assert_within(volume.affine[i], 1000.0 * srow[i], 1e-3);
        }
        assert_within(volume.spacing[0], 3000.0, 1e-3);
        srnf_volume_clear(&volume);
        file_put_real(file, version == 1 ? 280 : 400, 10, 0.0, false);
        read_badly(file, size, SRNF_EPARSE, "singular");
    }
}

/* NIfTI-2 has the units as a number with a sign; only its lowest bits count. */
static void a_negative_code_of_units_is_read(void **state)
{
    const int32_t code = -1960900000 | 2;
    size_t size = make_simple(2);
    struct srnf_volume volume;
    (void)state;

    file_put(file + 500, &code, 4, false);
    read_well(file, size, &volume);
    assert_string_equal(volume.units, "millimetres");
    srnf_volume_clear(&volume);
}

static void put_dim(size_t axis, int value)
{
    const int16_t narrow = (int16_t)value;

    file_put(file + 40 + 2 * axis, &narrow, 2, false);
}

static void what_is_no_nifti_label_volume(void **state)
{
    static const int64_t huge[3] = {1 << 20, 1 << 20, 1 << 20};
    size_t size = make_simple(1);
    const int16_t rgb = 128;
    (void)state;

    read_badly(file, size - 1, SRNF_EPARSE, "too short");
    read_badly(file, 200, SRNF_EPARSE, "within the header");
    put_dim(0, 4);
    put_dim(4, 3);
    read_badly(file, size, SRNF_EPARSE, "several volumes");
    put_dim(0, 9);
    read_badly(file, size, SRNF_EPARSE, "dim[0] is 9");
    put_dim(0, 3);
    put_dim(1, 0);
    read_badly(file, size, SRNF_EPARSE, "0 voxels along axis 0");
    size = make_simple(1);
    file_put(file + 70, &rgb, 2, false);
    read_badly(file, size, SRNF_EPARSE, "datatype 128");
    size = make_simple(1);
    memcpy(file + 344, "ni1", 4);
    read_badly(file, size, SRNF_EPARSE, "pair of files");
    memset(file + 344, 0, 4);
    read_badly(file, size, SRNF_EPARSE, "Analyze");
    (void)make_simple(1);
    file_put_real(file, 108, 0, 12.0, false);
    read_badly(file, size, SRNF_EPARSE, "vox_offset is 12");
    /* 2^60 voxels: refused by the limit, before anything is allocated */
    size = nifti_make(file, 2, false, NIFTI_UINT8, huge, "12345678", 8);
    read_badly(file, size, SRNF_ELIMIT, "at most 268435456");
    size = file_pack(packed, sizeof packed, file, size);
    read_badly(packed, size, SRNF_ELIMIT, "at most 268435456");
    read_badly("\x1f\x8b\x08 nothing", 11, SRNF_EPARSE, "gzip");
    read_badly("PK\3\4....", 8, SRNF_EFORMAT, "no NIfTI");
    read_badly("", 0, SRNF_EFORMAT, "no NIfTI");
}

static void damaged_gzip_is_told(void **state)
{
    size_t size = make_simple(1), whole = file_pack(packed, sizeof packed, file, size);
    (void)state;

    for (size_t cut = 3; cut < whole; cut++) {
        struct srnf_error error = {.message = ""};
        struct srnf_volume volume;

        assert_int_equal(srnf_volume_read(packed, cut, SRNF_VOLUME_UNKNOWN, NULL, &volume, &error),
                         SRNF_EPARSE);
        assert_true(error.message[0] != '\0');
    }
    packed[whole - 6] ^= 1; /* of the checksum */
    read_badly(packed, whole, SRNF_EPARSE, "damaged");
}

/* 64 KiB that unpack to 64 MiB behind eight voxels. */
static void a_bomb_is_not_unpacked(void **state)
{
    static unsigned char zeros[1 << 20];
    z_stream stream = {.next_in = file};
    (void)state;

    stream.avail_in = (unsigned)make_simple(1);
    stream.next_out = packed;
    stream.avail_out = sizeof packed;
    assert_int_equal(deflateInit2(&stream, 9, Z_DEFLATED, 31, 8, Z_DEFAULT_STRATEGY), Z_OK);
    assert_int_equal(deflate(&stream, Z_NO_FLUSH), Z_OK);
    for (size_t n = 0; n < 48; n++) {
        stream.next_in = zeros;
        stream.avail_in = sizeof zeros;
        assert_int_equal(deflate(&stream, Z_NO_FLUSH), Z_OK);
    }
    assert_int_equal(deflate(&stream, Z_FINISH), Z_STREAM_END);
    read_badly(packed, sizeof packed - stream.avail_out, SRNF_EPARSE, "far more bytes");
    (void)deflateEnd(&stream);
}

static void images_are_no_segmentations(void **state)
{
    static const int64_t grey[3] = {100, 100, 1};
    static uint16_t values[10000];
    size_t size;
    (void)state;

    for (size_t i = 0; i < 10000; i++) {
        values[i] = (uint16_t)i;
    }
    size = nifti_make(file, 1, false, NIFTI_UINT16, grey, values, sizeof values);
    read_badly(file, size, SRNF_EPARSE, "more than 4096 different values");
}

/* ---- NRRD ------------------------------------------------------------------------------------ */

#define NRRD "NRRD0005\n# a comment\ntype: short\ndimension: 3\nsizes: 2 2 2\n"
#define TEXT "encoding: ascii\n\n0 1 1 0 3 3 3 0\n"

static size_t make_nrrd(const char *fields, const void *voxels, size_t size)
{
    size_t n = strlen(fields);

    memcpy(file, fields, n);
    memcpy(file + n, voxels, size);
    return n + size;
}

static void every_encoding(void **state)
{
    unsigned char voxels[64];
    struct srnf_volume volume;
    size_t size;
    (void)state;

    read_well(NRRD TEXT, sizeof NRRD TEXT - 1, &volume);
    check_labels(&volume);
    assert_int_equal(volume.format, SRNF_VOLUME_NRRD);
    srnf_volume_clear(&volume);
    for (int big = 0; big < 2; big++) {
        size = make_NIFTI_INT16(voxels, big);
        size = make_nrrd(big ? NRRD "encoding: raw\nendian: big\r\n\r\n"
                             : NRRD "encoding: RAW\nendian: little\n\n",
                         voxels, size);
        read_well(file, size, &volume);
        check_labels(&volume);
        srnf_volume_clear(&volume);
    }
    size = make_NIFTI_INT16(voxels, false);
    size = file_pack(packed, sizeof packed, voxels, size);
    size = make_nrrd(NRRD "encoding: gzip\nendian: little\n\n", packed, size);
    read_well(file, size, &volume);
    check_labels(&volume);
    srnf_volume_clear(&volume);
    read_badly(file, size - 9, SRNF_EPARSE, "gzip");
}

static void spaces_become_ras(void **state)
{
    static const char lps[] =
        NRRD "space: left-posterior-superior\nspace directions: (2,0,0) (0, 3, 0) (0,0,4)\n"
             "space origin: (10,20,30)\nspace units: \"mm\" \"mm\" \"mm\"\n"
             "Segment0_LabelValue:=3\nSegment0_Name:=left caudate\n" TEXT;
    static const char las[] =
        NRRD "space: LAS\nspace directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (1,2,3)\n" TEXT;
    static const char layered[] = "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 1 2 2 2\n"
                                  "space: RAS\nspace directions: none (2,0,0) (0,3,0) (0,0,4)\n"
                                  "space origin: (1,2,3)\n" TEXT;
    static const char spaced[] = NRRD "spacings: 2 3 4\n" TEXT;
    struct srnf_volume volume;
    (void)state;

    read_well(lps, sizeof lps - 1, &volume);
    assert_int_equal(volume.space, SRNF_SPACE_LPS);
    assert_string_equal(volume.units, "millimetres");
    assert_within(volume.affine[0], -2.0, 0.0);
    assert_within(volume.affine[3], -10.0, 0.0);
    assert_within(volume.affine[5], -3.0, 0.0);
    assert_within(volume.affine[7], -20.0, 0.0);
    assert_within(volume.affine[11], 30.0, 0.0);
    assert_string_equal(volume.labels[1].name, "left caudate");
    assert_string_equal(volume.labels[0].name, "");
    srnf_volume_clear(&volume);
    read_well(las, sizeof las - 1, &volume);
    assert_within(volume.affine[0], -2.0, 0.0);
    assert_within(volume.affine[5], 3.0, 0.0);
    srnf_volume_clear(&volume);
    read_well(layered, sizeof layered - 1, &volume);
    check_labels(&volume);
    assert_within(volume.affine[10], 4.0, 0.0);
    assert_within(volume.affine[3], 1.0, 0.0);
    srnf_volume_clear(&volume);
    read_well(spaced, sizeof spaced - 1, &volume);
    assert_int_equal(volume.space, SRNF_SPACE_NONE);
    assert_within(volume.spacing[2], 4.0, 0.0);
    srnf_volume_clear(&volume);
}

#define BAD(fields, words) read_badly(fields, sizeof fields - 1, SRNF_EPARSE, words)

static void what_is_no_nrrd_label_volume(void **state)
{
    (void)state;

    BAD(NRRD "encoding: bzip2\n\n", "bzip2");
    BAD(NRRD "data file: other.raw\nencoding: raw\n\n", "another file");
    BAD(NRRD "encoding: ascii\n\n0 1 1\n", "too short");
    BAD(NRRD "encoding: ascii\n\n000000000 1 1\n", "after voxel 3 of 8");
    BAD(NRRD "encoding: ascii\n\n0 1 one 0 1 2 3 4\n", "voxel 2");
    BAD(NRRD "encoding: raw\n\n1234567812345678", "no endian");
    BAD(NRRD "encoding: gzip\nendian: little\n\n1234567812345678", "no gzip data");
    BAD(NRRD "space: nowhere\n" TEXT, "space");
    BAD(NRRD "space: RAS\nspace directions: (1,0) (0,1,0) (0,0,1)\n" TEXT, "space directions");
    BAD(NRRD "space: RAS\nspace directions: (1,0,0) (0,1,0) (1,1,0)\n" TEXT, "singular");
    BAD(NRRD, "no empty line");
    BAD("NRRD0005\ntype: short\nencoding: raw\n\n", "no sizes");
    BAD("NRRD0005\nsizes: 2 2 2\nencoding: raw\n\n", "no type");
    BAD("NRRD0005\ntype: uchar\nsizes: 2 2 2\n\n12345678", "no encoding");
    BAD("NRRD0005\ntype: uchar\nsizes: 2 2 2 2\nencoding: raw\n\n1234567812345678", "axis 3 of 2");
    BAD("NRRD0005\ntype: block\nsizes: 2 2 2\nencoding: raw\n\n12345678", "type");
    read_badly("NRRD0005\ntype: uchar\nsizes: 1000000 1000000 1000000\nencoding: raw\n\n1", 67,
               SRNF_ELIMIT, "at most");
}

static void names_go_there_and_back(void **state)
{
    (void)state;

    for (int f = SRNF_VOLUME_NIFTI; f <= SRNF_VOLUME_NRRD; f++) {
        const char *name = srnf_volume_format_name((enum srnf_volume_format)f);

        assert_int_equal(srnf_volume_format_from_name(name), f);
    }
    assert_int_equal(srnf_volume_format_from_name("mgz"), SRNF_VOLUME_UNKNOWN);
    assert_string_equal(srnf_volume_space_name(SRNF_SPACE_LPS), "LPS");
    assert_string_equal(srnf_change_name(SRNF_CHANGE_FILLED), "tunnel-filled");
}

static bool always(void *user)
{
    (void)user;
    return true;
}

static void reading_can_be_canceled(void **state)
{
    const struct srnf_context context = {.canceled = always};
    struct srnf_volume_limits limits = srnf_volume_limits_defaults();
    struct srnf_volume volume;
    size_t size = make_simple(1);
    (void)state;

    limits.context = &context;
    assert_int_equal(srnf_volume_read(file, size, SRNF_VOLUME_UNKNOWN, &limits, &volume, NULL),
                     SRNF_ECANCELED);
    limits.context = NULL;
    limits.max_memory = 8;
    assert_int_equal(srnf_volume_read(file, size, SRNF_VOLUME_UNKNOWN, &limits, &volume, NULL),
                     SRNF_ELIMIT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_type_version_and_byte_order),
        cmocka_unit_test(values_are_scaled),
        cmocka_unit_test(transforms_and_units),
        cmocka_unit_test(a_negative_code_of_units_is_read),
        cmocka_unit_test(what_is_no_nifti_label_volume),
        cmocka_unit_test(damaged_gzip_is_told),
        cmocka_unit_test(a_bomb_is_not_unpacked),
        cmocka_unit_test(images_are_no_segmentations),
        cmocka_unit_test(every_encoding),
        cmocka_unit_test(spaces_become_ras),
        cmocka_unit_test(what_is_no_nrrd_label_volume),
        cmocka_unit_test(names_go_there_and_back),
        cmocka_unit_test(reading_can_be_canceled),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

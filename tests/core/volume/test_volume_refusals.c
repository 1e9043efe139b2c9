/*
 * test_volume_refusals.c - label volumes whose headers contradict themselves, or whose values are
 * no labels: each is refused with its reason, and its sound neighbour is read.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>

#include "core/volume/volume_files.h"
#include "core/volume/volumes.h"

static const int64_t shape[3] = {2, 2, 1};
static unsigned char file[1 << 12];

/* Read, and its number of labels. */
static size_t labels_of(const void *bytes, size_t size)
{
    struct srnf_error error = {.message = ""};
    struct srnf_volume volume;
    size_t n;

    if (srnf_volume_read(bytes, size, SRNF_VOLUME_UNKNOWN, NULL, &volume, &error) != SRNF_OK) {
        fail_msg("%s", error.message);
    }
    n = volume.n_labels;
    srnf_volume_clear(&volume);
    return n;
}

static void refused(const void *bytes, size_t size, const char *words)
{
    struct srnf_error error = {.message = ""};
    struct srnf_volume volume;

    assert_int_equal(srnf_volume_read(bytes, size, SRNF_VOLUME_UNKNOWN, NULL, &volume, &error),
                     SRNF_EPARSE);
    if (!strstr(error.message, words)) {
        fail_msg("\"%s\" has no \"%s\"", error.message, words);
    }
    assert_null(volume.voxels);
}

static void labels_that_no_double_tells_apart(void **state)
{
    const int64_t most = ((int64_t)1 << 53) - 1;
    const int64_t beyond[] = {most + 1, most + 2, -most - 1, INT64_MIN, INT64_MAX};
    (void)state;

    for (int big = 0; big < 2; big++) {
        unsigned char voxels[32] = {0};
        size_t size;

        file_put(voxels, &most, 8, big);
        file_put(voxels + 8, &(int64_t){-most}, 8, big);
        size = nifti_make(file, 1, big, NIFTI_INT64, shape, voxels, sizeof voxels);
        assert_int_equal(labels_of(file, size), 2);
        for (size_t i = 0; i < sizeof beyond / sizeof beyond[0]; i++) {
            file_put(voxels + 8, &beyond[i], 8, big);
            size = nifti_make(file, 1, big, NIFTI_INT64, shape, voxels, sizeof voxels);
            refused(file, size, "whole numbers up to 2^53 - 1");
        }
        size = nifti_make(file, 1, big, NIFTI_UINT64, shape, voxels, sizeof voxels);
        refused(file, size, "voxel (1, 0, 0) is 9.22337e+18");
    }
#define LONG "NRRD0005\ntype: int64\nsizes: 2 1 1\nencoding: ascii\n\n"
    refused(LONG "1 9007199254740993\n", sizeof LONG "1 9007199254740993\n" - 1, "2^53 - 1");
    refused(LONG "1 9007199254740992\n", sizeof LONG "1 9007199254740992\n" - 1, "2^53 - 1");
    assert_int_equal(labels_of(LONG "1 9007199254740991\n", sizeof LONG "1 9007199254740991\n" - 1),
                     2);
}

static size_t make_nifti(int version, int datatype)
{
    static const unsigned char voxels[32] = {1};

    return nifti_make(file, version, false, datatype, shape, voxels, sizeof voxels);
}

/* The four bytes behind the header are no voxels. */
static void voxels_that_begin_within_the_header(void **state)
{
    static const int offsets[2][4] = {{0, 12, 348, 351}, {0, 352, 540, 543}};
    (void)state;

    for (int version = 1; version <= 2; version++) {
        size_t size = make_nifti(version, NIFTI_UINT8);

        assert_int_equal(labels_of(file, size), 1);
        for (size_t i = 0; i < 4; i++) {
            const int64_t whole = offsets[version - 1][i];
            const float single = (float)whole;

            file_put(file + (version == 1 ? 108 : 168),
                     version == 1 ? (const void *)&single : &whole, version == 1 ? 4 : 8, false);
            refused(file, size, version == 1 ? "number from 352" : "number from 544");
        }
    }
}

static void put_int16(size_t at, int value)
{
    const int16_t narrow = (int16_t)value;

    file_put(file + at, &narrow, 2, false);
}

static void types_that_contradict_their_bits(void **state)
{
    (void)state;

    for (int version = 1; version <= 2; version++) {
        size_t size = make_nifti(version, NIFTI_INT16), bits = version == 1 ? 72 : 14;

        put_int16(bits, 8);
        refused(file, size, "bitpix is 8, and datatype 4 has 16 bits");
        put_int16(bits, 0);
        assert_int_equal(labels_of(file, size), 1);
    }
}

static void voxels_without_size(void **state)
{
    size_t size = make_nifti(1, NIFTI_UINT8);
    (void)state;

    file_put_real(file, 76, 3, 0.0, false);
    refused(file, size, "pixdim[3] is 0");
    file_put_real(file, 76, 3, (double)NAN, false);
    refused(file, size, "pixdim[3] is nan");
    put_int16(40, 2); /* a slice has no third axis */
    assert_int_equal(labels_of(file, size), 1);
    file_put_real(file, 76, 1, 0.0, false);
    refused(file, size, "pixdim[1] is 0");
    put_int16(254, 1); /* the sform gives it */
    for (size_t k = 0; k < 3; k++) {
        file_put_real(file, 280, 5 * k, 2.0, false);
    }
    assert_int_equal(labels_of(file, size), 1);
}

static void sizes_below_zero(void **state)
{
    size_t size = make_nifti(1, NIFTI_UINT8);
    (void)state;

    put_int16(42, -2);
    refused(file, size, "dim[1] is -2");
    put_int16(42, 2);
    put_int16(40, 4);
    put_int16(48, -1);
    refused(file, size, "dim[4] is -1");
    put_int16(48, 1);
    assert_int_equal(labels_of(file, size), 1);
}

/* Values that a scale takes to next to nothing are none of 0, and do not merge. */
static void scales_that_lose_labels(void **state)
{
    static const double slopes[] = {1e-6, -1e-6, 1e-30, 1e-4};
    const int32_t millions[4] = {0, 1000000, 2000000, 0}, near[4] = {0, 1000000, 1000001, 0};
    size_t size;
    (void)state;

    for (size_t i = 0; i < sizeof slopes / sizeof slopes[0]; i++) {
        for (int shift = 0; shift < 2; shift++) {
            size = make_nifti(1, NIFTI_UINT8);
            file_put_real(file, 112, 0, slopes[i], false);
            file_put_real(file, 116, 0, 5.0 * shift, false);
            refused(file, size, "whole numbers");
        }
    }
    size = nifti_make(file, 1, false, NIFTI_INT32, shape, millions, sizeof millions);
    file_put_real(file, 112, 0, 1e-6, false);
    assert_int_equal(labels_of(file, size), 2);
    size = nifti_make(file, 1, false, NIFTI_INT32, shape, near, sizeof near);
    file_put_real(file, 112, 0, 1e-6, false);
    refused(file, size, "voxel (0, 1, 0)");
}

static void places_that_are_none(void **state)
{
    static const double none[] = {(double)NAN, (double)INFINITY, 2e12, -2e12};
    size_t size = make_nifti(1, NIFTI_UINT8);
    (void)state;

    put_int16(254, 1);
    for (size_t k = 0; k < 3; k++) {
        file_put_real(file, 280, 5 * k, 2.0, false);
    }
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) {
        file_put_real(file, 280, 7, none[i], false);
        refused(file, size, "row 1, column 3");
    }
    file_put_real(file, 280, 7, 1e11, false);
    assert_int_equal(labels_of(file, size), 1);
    file_put_real(file, 280, 4, 2e12, false);
    refused(file, size, "row 1, column 0");
}

/* ---- NRRD ------------------------------------------------------------------------------------ */

#define HEAD "NRRD0005\ntype: short\nsizes: 2 2 1\nencoding: ascii\n"
#define TAIL "\n0 1 1 0\n"
#define BAD(fields, words) refused(HEAD fields TAIL, sizeof HEAD fields TAIL - 1, words)
#define GOOD(fields) assert_int_equal(labels_of(HEAD fields TAIL, sizeof HEAD fields TAIL - 1), 1)

static void fields_given_twice(void **state)
{
    (void)state;

    GOOD("content: a\ncontent: b\nspace units: \"mm\"\nunits: \"mm\"\n");
    BAD("sizes: 2 2 1\n", "\"sizes\" is given twice");
    BAD("type: short\n", "\"type\" is given twice");
    BAD("encoding: raw\n", "\"encoding\" is given twice");
    BAD("byte skip: 0\nbyteskip: 0\n", "\"byte skip\" is given twice");
    BAD("space: RAS\nspace: LPS\n", "\"space\" is given twice");
    BAD("dimension: 3\ndimension: 3\n", "\"dimension\" is given twice");
}

static void dimensions_that_contradict_the_sizes(void **state)
{
    (void)state;

    GOOD("dimension: 3\n");
    BAD("dimension: 2\n", "dimension is 2, and there are sizes of 3 axes");
    BAD("dimension: 4\n", "dimension is 4");
    BAD("dimension: 0\n", "\"dimension\" cannot be \"0\"");
    BAD("dimension: three\n", "\"dimension\" cannot be \"three\"");
}

static void places_of_nrrd(void **state)
{
    (void)state;

#define AXES "space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
    GOOD("axis mins: 0 0 nan\n");
    BAD("axis mins: 0 -90 0\n", "\"axis mins\" is not read");
    BAD("axismins: 0 0 5\n", "\"axis mins\" is not read");
    BAD("axis mins: 0 here 0\n", "\"axis mins\" cannot be");
    GOOD(AXES "space origin: (1,2,3)\naxis mins: 0 5 0\n");
    BAD(AXES "space origin: (1,nan,3)\n", "space origin");
    BAD(AXES "space origin: (1,inf,3)\n", "space origin");
    BAD(AXES "space origin: (1,2e12,3)\n", "row 1, column 3");
    BAD("spacings: 1 2e12 1\n", "row 1, column 1");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(labels_that_no_double_tells_apart),
        cmocka_unit_test(voxels_that_begin_within_the_header),
        cmocka_unit_test(types_that_contradict_their_bits),
        cmocka_unit_test(voxels_without_size),
        cmocka_unit_test(sizes_below_zero),
        cmocka_unit_test(scales_that_lose_labels),
        cmocka_unit_test(places_that_are_none),
        cmocka_unit_test(fields_given_twice),
        cmocka_unit_test(dimensions_that_contradict_the_sizes),
        cmocka_unit_test(places_of_nrrd),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

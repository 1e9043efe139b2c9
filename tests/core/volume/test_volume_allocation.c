/*
 * test_volume_allocation.c - readers of volumes and the extraction when memory runs out: each
 * allocation in turn is refused; the call fails cleanly and nothing leaks.
 */
#include "support/refusing.h"

#include <zlib.h>

#include "core/volume/volume_files.h"
#include "core/volume/volumes.h"

static unsigned char file[4096], packed[4096];
static size_t file_size, packed_size;
static struct srnf_volume torus;

static int run_read(const unsigned char *bytes, size_t size)
{
    struct srnf_volume volume;
    int status = srnf_volume_read(bytes, size, SRNF_VOLUME_UNKNOWN, NULL, &volume, NULL);

    if (status == SRNF_OK) {
        srnf_volume_clear(&volume);
    } else {
        assert_null(volume.voxels);
    }
    return status;
}

static int run_plain(void)
{
    return run_read(file, file_size);
}

static int run_packed(void)
{
    return run_read(packed, packed_size);
}

static int run_nrrd(void)
{
    static const char text[] = "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 2 2\n"
                               "encoding: ascii\n\n0 1 1 0 3 3 0 0\n";

    return run_read((const unsigned char *)text, sizeof text - 1);
}

static int run_extract(void)
{
    static const int64_t label = VOLUME_LABEL;
    struct srnf_extracted extracted;
    int status = srnf_extract(&torus, &label, 1, NULL, NULL, &extracted, NULL);

    if (status == SRNF_OK) {
        assert_true(extracted.changed > 0);
    } else {
        assert_null(extracted.mesh.vertices);
    }
    srnf_extracted_clear(&extracted);
    return status;
}

static void every_request_may_fail(void **state)
{
    static int (*const runs[])(void) = {run_plain, run_packed, run_nrrd, run_extract};
    (void)state;

    for (size_t r = 0; r < sizeof runs / sizeof runs[0]; r++) {
        size_t before = refusing.alive, index = 0;
        int status;

        do {
            refusing_at(index++);
            status = runs[r]();
            refusing_none();
            assert_int_equal(refusing.alive, before);
            assert_true(status == SRNF_OK || status == SRNF_ENOMEM);
            assert_true(index < 1000);
        } while (status != SRNF_OK);
        assert_true(index > 3);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_request_may_fail)};
    const double affine[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    static const uint8_t labels[8] = {0, 1, 1, 0, 3, 3, 0, 0};

    file_size = nifti_make(file, 1, false, NIFTI_UINT8, (const int64_t[3]){2, 2, 2}, labels, 8);
    packed_size = file_pack(packed, sizeof packed, file, file_size);
    volume_make(&torus, 7, 7, 3, affine);
    for (size_t n = 0; n < 49; n++) {
        volume_set(&torus, n % 7, n / 7, 1,
                   n % 7 > 0 && n % 7 < 6 && n / 7 > 0 && n / 7 < 6 && n != 24);
    }
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

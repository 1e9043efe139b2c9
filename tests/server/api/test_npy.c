/*
 * test_npy.c - .npy: what is written is read back bit for bit, headers as NumPy writes them are
 * understood, and everything else is refused with a sentence and without touching memory that is
 * not there.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/npy.h"

#define MAX_COUNT ((size_t)1000000)

/* A file made of a version, a header and data; the header length is written as the version asks. */
static size_t build(unsigned char *out, int major, const char *header, const void *data,
                    size_t size)
{
    size_t length = strlen(header), at = 0;

    memcpy(out, "\x93NUMPY", 6);
    out[6] = (unsigned char)major;
    out[7] = 0;
    out[8] = (unsigned char)(length & 0xff);
    out[9] = (unsigned char)(length >> 8);
    at = 10;
    if (major == 2) {
        out[10] = out[11] = 0;
        at = 12;
    }
    memcpy(out + at, header, length);
    if (size) {
        memcpy(out + at + length, data, size);
    }
    return at + length + size;
}

static void test_round_trip(void **state)
{
    const size_t shapes[][4] = {{7}, {3, 5}, {4, 6, 3}, {2, 3, 2, 2}};
    double values[72];

    (void)state;
    for (size_t i = 0; i < 72; i++) {
        values[i] = ldexp(sin((double)i + 0.5), (int)i * 20 - 700);
    }
    values[3] = -0.0;
    for (size_t d = 1; d <= 4; d++) {
        unsigned char *bytes;
        size_t size, count = 1;
        struct npy_array array;
        char message[200] = "";

        assert_int_equal(npy_write(values, d, shapes[d - 1], &bytes, &size), 0);
        assert_int_equal(npy_read(bytes, size, MAX_COUNT, &array, message, sizeof message), 0);
        assert_int_equal(array.n_dimensions, d);
        for (size_t i = 0; i < d; i++) {
            assert_int_equal(array.shape[i], shapes[d - 1][i]);
            count *= shapes[d - 1][i];
        }
        assert_int_equal(array.count, count);
        assert_memory_equal(array.values, values, count * sizeof(double));
        /* NumPy promises data on a multiple of 64 bytes; mmap users rely on it. */
        assert_int_equal((size - count * 8) % 64, 0);
        npy_clear(&array);
        free(bytes);
    }
}

static void test_numpy_headers(void **state)
{
    static const char *const headers[] = {
        "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 1), }          \n",
        "{\"shape\": (2,1), \"fortran_order\": False, \"descr\": \"<f8\"}",
        "{'descr': '<f8', 'fortran_order': True, 'shape': (2,), }\n",
    };
    const double data[2] = {1.5, -2.25};

    (void)state;
    for (size_t i = 0; i < sizeof headers / sizeof headers[0]; i++) {
        for (int major = 1; major <= 2; major++) {
            unsigned char file[256];
            struct npy_array array;
            char message[200] = "";
            size_t size = build(file, major, headers[i], data, sizeof data);

            assert_int_equal(npy_read(file, size, MAX_COUNT, &array, message, sizeof message), 0);
            assert_int_equal(array.count, 2);
            assert_true(array.values[0] == 1.5 && array.values[1] == -2.25);
            npy_clear(&array);
        }
    }
}

static void test_float32(void **state)
{
    const float data[3] = {1.5F, -0.25F, 3e20F};
    unsigned char file[256];
    struct npy_array array;
    char message[200] = "";
    size_t size = build(file, 1, "{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }\n",
                        data, sizeof data);

    (void)state;
    assert_int_equal(npy_read(file, size, MAX_COUNT, &array, message, sizeof message), 0);
    for (size_t i = 0; i < 3; i++) {
        assert_true(array.values[i] == (double)data[i]);
    }
    npy_clear(&array);
}

static void test_scalar_and_empty(void **state)
{
    const double one = 4.0;
    unsigned char file[256];
    struct npy_array array;
    char message[200] = "";
    size_t size =
        build(file, 1, "{'descr': '<f8', 'fortran_order': False, 'shape': (), }\n", &one, 8);

    (void)state;
    assert_int_equal(npy_read(file, size, MAX_COUNT, &array, message, sizeof message), 0);
    assert_int_equal(array.n_dimensions, 0);
    assert_int_equal(array.count, 1);
    npy_clear(&array);
    size = build(file, 1, "{'descr': '<f8', 'fortran_order': False, 'shape': (0, 3), }\n", NULL, 0);
    assert_int_equal(npy_read(file, size, MAX_COUNT, &array, message, sizeof message), 0);
    assert_int_equal(array.count, 0);
    assert_non_null(array.values);
    npy_clear(&array);
}

/* Each wrong header, and a word that the message must contain. */
static void test_refused(void **state)
{
    static const struct {
        const char *header, *word;
    } wrong[] = {
        {"{'descr': '>f8', 'fortran_order': False, 'shape': (2,), }", ">f8"},
        {"{'descr': '|O', 'fortran_order': False, 'shape': (2,), }", "|O"},
        {"{'descr': '<i4', 'fortran_order': False, 'shape': (2,), }", "<i4"},
        {"{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (2,), }", "structured"},
        {"{'descr': '<f8', 'fortran_order': True, 'shape': (2, 1), }", "Fortran"},
        {"{'descr': '<f8', 'fortran_order': Maybe, 'shape': (2,), }", "fortran_order"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (-2,), }", "shape"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (2 1), }", "shape"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': 2, }", "tuple"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (1,1,1,1,2), }", "dimensions"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }", "16 bytes"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }", "16 bytes"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (2000000,), }", "limit"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296), }",
         "overflow"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,), }", "shape"},
        {"{'descr': '<f8', 'fortran_order': False, }", "lacks"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (2,), 'more': 1}", "more"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (2,)} + x", "follows"},
        {"['descr']", "dictionary"},
        {"", "dictionary"},
        {"{", "dictionary"},
        {"{'descr", "dictionary"},
        {"{'descr': '<f8", "type"},
    };
    const double data[2] = {1.0, 2.0};

    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        unsigned char file[256];
        struct npy_array array;
        char message[200] = "";
        size_t size = build(file, 1, wrong[i].header, data, sizeof data);

        assert_int_equal(npy_read(file, size, MAX_COUNT, &array, message, sizeof message), -1);
        if (!strstr(message, wrong[i].word)) {
            fail_msg("case %zu: \"%s\" does not say \"%s\"", i, message, wrong[i].word);
        }
        assert_null(array.values);
    }
}

/* A file cut at every length, and every byte of the header replaced, on buffers of the exact
   size, so that a read beyond them is seen by the sanitizer. */
static void test_damaged(void **state)
{
    const size_t shape[2] = {2, 3};
    const double values[6] = {1, 2, 3, 4, 5, 6};
    unsigned char *bytes;
    size_t size;
    char message[200];

    (void)state;
    assert_int_equal(npy_write(values, 2, shape, &bytes, &size), 0);
    for (size_t cut = 0; cut < size; cut++) {
        struct npy_array array;
        unsigned char *copy = malloc(cut ? cut : 1);

        assert_non_null(copy);
        memcpy(copy, bytes, cut);
        assert_int_equal(npy_read(copy, cut, MAX_COUNT, &array, message, sizeof message), -1);
        free(copy);
    }
    for (size_t at = 0; at < size - sizeof values; at++) {
        for (int value = 0; value < 256; value += 5) {
            unsigned char *copy = malloc(size);
            struct npy_array array;

            assert_non_null(copy);
            memcpy(copy, bytes, size);
            copy[at] = (unsigned char)value;
            if (npy_read(copy, size, MAX_COUNT, &array, message, sizeof message) == 0) {
                assert_true(array.count <= 12);
                npy_clear(&array);
            }
            free(copy);
        }
    }
    free(bytes);
}

static void test_write_overflow(void **state)
{
    const size_t shape[2] = {SIZE_MAX / 2, 3};
    unsigned char *bytes;
    size_t size;

    (void)state;
    assert_int_equal(npy_write(NULL, 2, shape, &bytes, &size), -1);
    assert_null(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),     cmocka_unit_test(test_numpy_headers),
        cmocka_unit_test(test_float32),        cmocka_unit_test(test_scalar_and_empty),
        cmocka_unit_test(test_refused),        cmocka_unit_test(test_damaged),
        cmocka_unit_test(test_write_overflow),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

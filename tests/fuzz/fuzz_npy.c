/*
 * fuzz_npy.c - any bytes at all as a .npy array. What is refused has a sentence; what is read is
 * within its limits, and written and read again the same numbers.
 */
#include "api/npy.h"
#include "fuzz/fuzz_require.h"

#include <string.h>

#define NUMBERS_MAX ((size_t)1 << 16)

static void again(const struct npy_array *array)
{
    struct npy_array copy = {0};
    unsigned char *bytes = NULL;
    char message[240];
    size_t size = 0;

    if (array->n_dimensions == 0) {
        return;
    }
    fuzz_require(npy_write(array->values, array->n_dimensions, array->shape, &bytes, &size) == 0);
    fuzz_require(npy_read(bytes, size, NUMBERS_MAX, &copy, message, sizeof message) == 0);
    fuzz_require(copy.count == array->count && copy.n_dimensions == array->n_dimensions);
    fuzz_require(memcmp(copy.values, array->values, copy.count * sizeof(double)) == 0);
    npy_clear(&copy);
    free(bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct npy_array array = {0};
    char message[240] = "";
    size_t count = 1;

    if (npy_read(data, size, NUMBERS_MAX, &array, message, sizeof message)) {
        fuzz_require(message[0] && memchr(message, '\0', sizeof message));
        fuzz_require(array.values == NULL && array.count == 0);
        return 0;
    }
    fuzz_require(npy_sniff(data, size));
    for (size_t i = 0; i < array.n_dimensions; i++) {
        count *= array.shape[i];
    }
    fuzz_require(array.values && array.count == count && count <= NUMBERS_MAX);
    again(&array);
    npy_clear(&array);
    return 0;
}

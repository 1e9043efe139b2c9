/*
 * scalar.c - numbers in either byte order (see scalar.h).
 *
 * Every type is its bytes gathered into one 64-bit word, then turned into a value by its kind. The
 * shifts are compiled into loads and byte swaps where the processor has them, and no alignment is
 * assumed.
 */
#include "scalar.h"

#include <string.h>

enum kind { KIND_UNSIGNED, KIND_SIGNED, KIND_FLOAT };

static const struct {
    size_t size;
    enum kind kind;
} types[] = {
    [SCALAR_NONE] = {0, KIND_UNSIGNED},   [SCALAR_INT8] = {1, KIND_SIGNED},
    [SCALAR_UINT8] = {1, KIND_UNSIGNED},  [SCALAR_INT16] = {2, KIND_SIGNED},
    [SCALAR_UINT16] = {2, KIND_UNSIGNED}, [SCALAR_INT32] = {4, KIND_SIGNED},
    [SCALAR_UINT32] = {4, KIND_UNSIGNED}, [SCALAR_INT64] = {8, KIND_SIGNED},
    [SCALAR_UINT64] = {8, KIND_UNSIGNED}, [SCALAR_FLOAT32] = {4, KIND_FLOAT},
    [SCALAR_FLOAT64] = {8, KIND_FLOAT},
};

/* Doubles are exact integers up to here; beyond, a number in a float is no index. */
#define WHOLE_MAX 9007199254740992.0

size_t scalar_size(enum scalar_type type)
{
    return types[type].size;
}

static uint64_t gather(const unsigned char *bytes, size_t size, bool big_endian)
{
    uint64_t word = 0;

    for (size_t i = 0; i < size; i++) {
        word = (word << 8) | bytes[big_endian ? i : size - 1 - i];
    }
    return word;
}

static int64_t sign_extend(uint64_t word, size_t size)
{
    uint64_t sign = (uint64_t)1 << (8 * size - 1);

    return (int64_t)((word ^ sign) - sign);
}

static double float_value(uint64_t word, size_t size)
{
    double value;

    if (size == sizeof(float)) {
        uint32_t half = (uint32_t)word;
        float single;

        memcpy(&single, &half, sizeof single);
        return (double)single;
    }
    memcpy(&value, &word, sizeof value);
    return value;
}

double scalar_value(enum scalar_type type, const unsigned char *bytes, bool big_endian)
{
    size_t size = types[type].size;
    uint64_t word = gather(bytes, size, big_endian);

    if (types[type].kind == KIND_FLOAT) {
        return float_value(word, size);
    }
    if (types[type].kind == KIND_SIGNED) {
        return (double)sign_extend(word, size);
    }
    return (double)word;
}

bool scalar_whole(double value, int64_t *index)
{
    if (!(value >= -WHOLE_MAX && value <= WHOLE_MAX)) {
        return false;
    }
    *index = (int64_t)value;
    return (double)*index == value;
}

bool scalar_index(enum scalar_type type, const unsigned char *bytes, bool big_endian,
                  int64_t *index)
{
    size_t size = types[type].size;
    uint64_t word = gather(bytes, size, big_endian);

    if (types[type].kind == KIND_FLOAT) {
        return scalar_whole(float_value(word, size), index);
    }
    if (types[type].kind == KIND_SIGNED) {
        *index = sign_extend(word, size);
    } else {
        *index = word > INT64_MAX ? INT64_MAX : (int64_t)word;
    }
    return true;
}

static void scatter(unsigned char *bytes, uint64_t word, size_t size, bool big_endian)
{
    for (size_t i = 0; i < size; i++) {
        bytes[big_endian ? size - 1 - i : i] = (unsigned char)(word >> (8 * i));
    }
}

void scalar_put_u32_le(unsigned char *bytes, uint32_t value)
{
    scatter(bytes, value, sizeof value, false);
}

void scalar_put_u16_le(unsigned char *bytes, uint16_t value)
{
    scatter(bytes, value, sizeof value, false);
}

void scalar_put_f32_le(unsigned char *bytes, float value)
{
    uint32_t word;

    memcpy(&word, &value, sizeof word);
    scatter(bytes, word, sizeof word, false);
}

void scalar_put_f64_le(unsigned char *bytes, double value)
{
    uint64_t word;

    memcpy(&word, &value, sizeof word);
    scatter(bytes, word, sizeof word, false);
}

void scalar_put_u64_le(unsigned char *bytes, uint64_t value)
{
    scatter(bytes, value, sizeof value, false);
}

void scalar_put_u32_be(unsigned char *bytes, uint32_t value)
{
    scatter(bytes, value, sizeof value, true);
}

void scalar_put_f64_be(unsigned char *bytes, double value)
{
    uint64_t word;

    memcpy(&word, &value, sizeof word);
    scatter(bytes, word, sizeof word, true);
}

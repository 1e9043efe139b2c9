/*
 * json_numbers.c - arrays of numbers between JSON and the core.
 *
 * On the wire a vector field is [nTheta][nPhi][3]; the core keeps the three coordinates in blocks,
 * [3][nTheta][nPhi]. JSON has no word for an infinite or undefined number: those become null.
 */
#include "api/json_numbers.h"

#include <math.h>
#include <stdio.h>

json_t *json_finite(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

json_t *json_vector(const double *values, size_t count)
{
    json_t *array = json_array();

    for (size_t i = 0; array && i < count; i++) {
        if (json_array_append_new(array, json_finite(values[i]))) {
            json_decref(array);
            return NULL;
        }
    }
    return array;
}

json_t *json_estimate(const struct srnf_estimate *estimate, double scale)
{
    return json_pack("{s:o, s:[o, o]}", "value", json_finite(estimate->value * scale), "interval",
                     json_finite(estimate->interval[0] * scale),
                     json_finite(estimate->interval[1] * scale));
}

json_t *json_nested(const double *values, size_t n_dimensions, const size_t *shape)
{
    size_t stride = 1;
    json_t *array;

    if (n_dimensions == 1) {
        return json_vector(values, shape[0]);
    }
    for (size_t i = 1; i < n_dimensions; i++) {
        stride *= shape[i];
    }
    array = json_array();
    for (size_t i = 0; array && i < shape[0]; i++) {
        if (json_array_append_new(array,
                                  json_nested(values + i * stride, n_dimensions - 1, shape + 1))) {
            json_decref(array);
            return NULL;
        }
    }
    return array;
}

/* One level of nesting; index is the offset of its first number in the whole array. */
static bool read_level(const json_t *array, size_t n_dimensions, const size_t *shape, double *out,
                       size_t index, struct problem_list *list, const char *pointer)
{
    size_t stride = 1;

    for (size_t i = 1; i < n_dimensions; i++) {
        stride *= shape[i];
    }
    if (!json_is_array(array) || json_array_size(array) != shape[0]) {
        problem_add(list, pointer, "number %zu belongs into an array of %zu elements; found %zu",
                    index, shape[0], json_array_size(array));
        return false;
    }
    for (size_t i = 0; i < shape[0]; i++) {
        const json_t *value = json_array_get(array, i);
        size_t at = index + i * stride;
        if (n_dimensions > 1) {
            if (!read_level(value, n_dimensions - 1, shape + 1, out, at, list, pointer)) {
                return false;
            }
        } else if (!json_is_number(value) || !isfinite(json_number_value(value))) {
            problem_add(list, pointer, "element %zu is not a finite number", at);
            return false;
        } else {
            out[at] = json_number_value(value);
        }
    }
    return true;
}

bool json_read_numbers(const json_t *array, size_t n_dimensions, const size_t *shape, double *out,
                       struct problem_list *list, const char *pointer)
{
    size_t count = 1;

    for (size_t i = 0; i < n_dimensions; i++) {
        count *= shape[i];
    }
    if (!json_is_array(array)) {
        problem_add(list, pointer, "must be an array of %zu numbers", count);
        return false;
    }
    if (json_is_number(json_array_get(array, 0)) || n_dimensions == 1) {
        if (json_array_size(array) != count) {
            problem_add(list, pointer, "must have %zu numbers; it has %zu", count,
                        json_array_size(array));
            return false;
        }
        return read_level(array, 1, &count, out, 0, list, pointer);
    }
    return read_level(array, n_dimensions, shape, out, 0, list, pointer);
}

void field_split(size_t count, const double *interleaved, double *blocks)
{
    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k < 3; k++) {
            blocks[k * count + i] = interleaved[3 * i + k];
        }
    }
}

void field_interleave(size_t count, const double *blocks, double *interleaved)
{
    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k < 3; k++) {
            interleaved[3 * i + k] = blocks[k * count + i];
        }
    }
}

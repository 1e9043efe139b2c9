/*
 * field.c - vector fields on a Gauss-Legendre grid as inputs: {lmax, nTheta, nPhi, q}.
 *
 * q is checked number by number and kept flat in the canonical inputs, so that a job can be run
 * again from its row; result documents name it by its digest instead.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "toolkit/process.h"
#include "api/json_memory.h"
#include "store/digest.h"

static const char *const field_names[] = {"lmax", "nTheta", "nPhi", "q", NULL};

/* A whole number of the field, set in canonical. */
static long field_integer(struct process_inputs *inputs, const json_t *field, json_t *canonical,
                          const char *at, const char *name, long lowest, long highest)
{
    const json_t *value = json_object_get(field, name);
    double number = json_number_value(value);
    char pointer[96];

    (void)snprintf(pointer, sizeof pointer, "%s/%s", at, name);
    if (!json_is_number(value) || !(number >= (double)lowest && number <= (double)highest) ||
        number != (double)(long)number) {
        problem_add(inputs->list, pointer, "must be a whole number from %ld to %ld", lowest,
                    highest);
        return 0;
    }
    (void)json_object_set_new(canonical, name, json_integer((json_int_t)number));
    return (long)number;
}

static bool is_field_name(const char *name)
{
    for (size_t i = 0; field_names[i]; i++) {
        if (strcmp(field_names[i], name) == 0) {
            return true;
        }
    }
    return false;
}

json_t *inputs_field(struct process_inputs *inputs, const json_t *value, const char *pointer,
                     long *degree)
{
    json_t *canonical = json_object(), *object = (json_t *)(uintptr_t)value;
    size_t shape[3] = {0, 0, 3};
    double *q = NULL;
    char at[96];

    for (void *i = json_object_iter(object); i; i = json_object_iter_next(object, i)) {
        if (!is_field_name(json_object_iter_key(i))) {
            problem_add(inputs->list, pointer, "has lmax, nTheta, nPhi and q, and nothing else");
        }
    }
    *degree =
        field_integer(inputs, value, canonical, pointer, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX);
    shape[0] = (size_t)field_integer(inputs, value, canonical, pointer, "nTheta", *degree + 1,
                                     PROCESS_ROWS_MAX);
    shape[1] = (size_t)field_integer(inputs, value, canonical, pointer, "nPhi", 2 * *degree + 1,
                                     PROCESS_COLUMNS_MAX);
    if (*degree && shape[0] && shape[1]) {
        q = srnf_alloc(shape[0] * shape[1], 3 * sizeof(double));
    }
    (void)snprintf(at, sizeof at, "%s/q", pointer);
    if (q && json_read_numbers(json_object_get(value, "q"), 3, shape, q, inputs->list, at)) {
        (void)json_object_set_new(canonical, "q", json_vector(q, shape[0] * shape[1] * 3));
    }
    srnf_free(q);
    return canonical;
}

void field_by_digest(json_t *field)
{
    const json_t *q = json_object_get(field, "q");
    char *text = q ? json_memory_dumps(q, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    char digest[65];

    if (text) {
        store_sha256_hex(digest, text, strlen(text));
        (void)json_object_set_new(field, "qDigest", json_string(digest));
        (void)json_object_del(field, "q");
    }
    free(text);
}

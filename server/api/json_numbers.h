/*
 * json_numbers.h - arrays of numbers between JSON and the core.
 */
#ifndef SRNFD_API_JSON_NUMBERS_H
#define SRNFD_API_JSON_NUMBERS_H

#include "api/handler.h"

/* The number as a JSON real; null deliberately where it is not finite, which JSON cannot say. */
json_t *json_finite(double value);
json_t *json_vector(const double *values, size_t count);
/* {value, interval: [lower, upper]}, all times a scale. */
struct srnf_estimate; /* srnf.h */
json_t *json_estimate(const struct srnf_estimate *estimate, double scale);
/* Nested arrays of the shape (one to three extents), C order. */
json_t *json_nested(const double *values, size_t n_dimensions, const size_t *shape);
/* Reads an array of that shape, nested or flat. Problems name the element. */
bool json_read_numbers(const json_t *array, size_t n_dimensions, const size_t *shape, double *out,
                       struct problem_list *list, const char *pointer);
/* Vector fields: double[3][count] of the core from and to double[count][3] of the wire. */
void field_split(size_t count, const double *interleaved, double *blocks);
void field_interleave(size_t count, const double *blocks, double *interleaved);

#endif

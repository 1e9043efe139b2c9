/*
 * scalar.h - the number types that binary mesh files are made of: their sizes, and reading and
 * writing one value in either byte order at any alignment. Shared by the readers of PLY, VTK,
 * GIfTI and FreeSurfer and by the writers.
 */
#ifndef SRNF_FORMATS_SCALAR_H
#define SRNF_FORMATS_SCALAR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum scalar_type {
    SCALAR_NONE = 0,
    SCALAR_INT8,
    SCALAR_UINT8,
    SCALAR_INT16,
    SCALAR_UINT16,
    SCALAR_INT32,
    SCALAR_UINT32,
    SCALAR_INT64,
    SCALAR_UINT64,
    SCALAR_FLOAT32,
    SCALAR_FLOAT64,
};

/* One row of a format's own table of type names; a table ends with name NULL. */
struct scalar_name {
    const char *name;
    enum scalar_type type;
};

/* Bytes of one value; 0 for SCALAR_NONE. */
size_t scalar_size(enum scalar_type type);

/* The value as a double: exact for all types but 64-bit integers beyond 2^53. */
double scalar_value(enum scalar_type type, const unsigned char *bytes, bool big_endian);

/* The value as an index. Returns false where it is no whole number; one too large for int64_t is
   clamped, which leaves it out of every range. */
bool scalar_index(enum scalar_type type, const unsigned char *bytes, bool big_endian,
                  int64_t *index);

/* A double that should be a whole number (an index written in a text file). */
bool scalar_whole(double value, int64_t *index);

/* Writing, in the byte order that the name says. */
void scalar_put_u32_le(unsigned char *bytes, uint32_t value);
void scalar_put_u16_le(unsigned char *bytes, uint16_t value);
void scalar_put_f32_le(unsigned char *bytes, float value);
void scalar_put_f64_le(unsigned char *bytes, double value);
void scalar_put_u32_be(unsigned char *bytes, uint32_t value);
void scalar_put_u64_le(unsigned char *bytes, uint64_t value);
void scalar_put_f64_be(unsigned char *bytes, double value);

#endif

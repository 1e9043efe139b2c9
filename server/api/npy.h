/*
 * npy.h - arrays of real numbers as NumPy .npy files, in memory.
 *
 * Read: versions 1.0 and 2.0, little-endian float64 and float32 ('<f8', '<f4'), C order, up to four
 * dimensions. Everything else (other types, Fortran order, pickled objects, structured types) is
 * refused with a sentence that says what was found. Written: version 1.0, '<f8', C order.
 *
 * The header of a .npy file is a Python literal. It is read by a small parser of its own that knows
 * exactly the three members descr, fortran_order and shape; nothing is evaluated.
 */
#ifndef SRNFD_API_NPY_H
#define SRNFD_API_NPY_H

#include <stdbool.h>
#include <stddef.h>

#define NPY_DIMENSIONS_MAX 4
#define NPY_CONTENT_TYPE "application/x-npy"

struct npy_array {
    size_t n_dimensions; /* 0: a single number */
    size_t shape[NPY_DIMENSIONS_MAX];
    size_t count;   /* product of the shape */
    double *values; /* [count], malloc; never NULL after success */
};

/* Do the first bytes say .npy? */
bool npy_sniff(const void *bytes, size_t size);

/*
 * Reads an array. Any bytes at all are safe; nothing is allocated before the size promised by the
 * header agrees with the bytes that are there.
 *   max_count [in]  numbers beyond this are refused
 *   array     [out] to be cleared with npy_clear; cleared on failure
 *   message   [out] a sentence on failure
 * Returns 0, or -1 with message.
 */
int npy_read(const void *bytes, size_t size, size_t max_count, struct npy_array *array,
             char *message, size_t message_size);
void npy_clear(struct npy_array *array);

/* Writes values of the given shape (n_dimensions 1 .. NPY_DIMENSIONS_MAX). bytes is allocated with
   malloc. Returns 0, or -1 when memory is short or the size overflows. */
int npy_write(const double *values, size_t n_dimensions, const size_t *shape, unsigned char **bytes,
              size_t *size);

#endif

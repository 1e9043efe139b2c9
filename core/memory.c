/*
 * memory.c - the one place where libsrnf allocates.
 *
 * 64-byte alignment serves the widest vector loads and keeps rows of neighbouring threads off one
 * cache line. Memory comes zeroed, so that cleaning up a half-built object is always safe. A test
 * links its own version of this file in front of the library to make the n-th allocation fail.
 */
#include "srnf.h"

#include <stdlib.h>
#include <string.h>

#define ALIGNMENT ((size_t)64)

void *srnf_alloc(size_t count, size_t size)
{
    size_t bytes;
    void *pointer;

    if (__builtin_mul_overflow(count, size, &bytes) || bytes > SIZE_MAX - ALIGNMENT) {
        return NULL;
    }
    bytes = (bytes + ALIGNMENT) / ALIGNMENT * ALIGNMENT;
    pointer = aligned_alloc(ALIGNMENT, bytes);
    if (pointer) {
        memset(pointer, 0, bytes);
    }
    return pointer;
}

void srnf_free(void *pointer)
{
    free(pointer);
}

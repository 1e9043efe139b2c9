/*
 * sort.c - a stable merge sort of indices.
 *
 * Runs of doubling length are merged between two arrays, bottom-up: no recursion, no allocation, at
 * most n ceil(log2 n) comparisons whatever the input. Told to stop it leaves indices of those that
 * came in, in no order and some of them several times.
 */
#include "mesh_geometry.h"

#include <string.h>

void srnf_sort_order(uint32_t *order, uint32_t *scratch, size_t n,
                     bool (*less)(const void *subject, uint32_t a, uint32_t b), const void *subject,
                     const struct srnf_context *context)
{
    uint32_t *from = order, *to = scratch, *swap;

    for (size_t run = 1; run < n; run *= 2) {
        for (size_t start = 0; start < n; start += 2 * run) {
            size_t middle = n - start > run ? start + run : n;
            size_t end = n - start > 2 * run ? start + 2 * run : n;
            size_t i = start, j = middle;

            for (size_t k = start; k < end; k++) {
                if (k % SRNF_ITEMS_ASKED == SRNF_ITEMS_ASKED - 1 && srnf_is_canceled(context)) {
                    return;
                }
                if (i < middle && (j >= end || !less(subject, from[j], from[i]))) {
                    to[k] = from[i++];
                } else {
                    to[k] = from[j++];
                }
            }
        }
        swap = from;
        from = to;
        to = swap;
    }
    if (from != order && n > 0) {
        memcpy(order, from, n * sizeof *order);
    }
}

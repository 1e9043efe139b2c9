/*
 * kernel.c - the Legendre stage: small products of a table with six columns, in registers.
 *
 * A tile of 8 rows by 6 columns keeps its 12 accumulators, two table loads and one broadcast in the
 * 16 vector registers of AVX2; a general matrix product spends longer on its call than these sizes
 * take. The sum over k runs upwards in both directions, so results depend on nothing but the
 * operands.
 */
#include "harmonics.h"
#include "simd.h"

SIMD_INLINE void clear(size_t columns, simd *sums)
{
    for (size_t c = 0; c < columns; c++) {
        sums[c] = SIMD_SET(0.0);
    }
}

SIMD_INLINE void forward_tile(size_t rows, size_t columns, size_t first, size_t count,
                              const double *table, const double *x, double *out)
{
    for (size_t row = 0; row < rows; row += 2 * SRNF_LANES) {
        simd low[PASS_COLUMNS];
        simd high[PASS_COLUMNS];

        clear(columns, low);
        clear(columns, high);
        for (size_t k = first; k < count; k += 2) {
            simd a;
            simd b;

            SIMD_LOAD(a, table + k * rows + row);
            SIMD_LOAD(b, table + k * rows + row + SRNF_LANES);
            for (size_t c = 0; c < columns; c++) {
                simd value = SIMD_SET(x[k * columns + c]);

                low[c] += a * value;
                high[c] += b * value;
            }
        }
        for (size_t c = 0; c < columns; c++) {
            SIMD_STORE(out + c * rows + row, low[c]);
            SIMD_STORE(out + c * rows + row + SRNF_LANES, high[c]);
        }
    }
}

SIMD_INLINE void store_sums(size_t columns, const simd *sums, double *x)
{
    for (size_t c = 0; c < columns; c++) {
        x[c] = (sums[c][0] + sums[c][1]) + (sums[c][2] + sums[c][3]);
    }
}

SIMD_INLINE void adjoint_tile(size_t rows, size_t columns, size_t first, size_t count,
                              const double *table, const double *in, double *x)
{
    size_t k = first;

    for (; k + 2 < count; k += 4) {
        simd low[PASS_COLUMNS];
        simd high[PASS_COLUMNS];

        clear(columns, low);
        clear(columns, high);
        for (size_t row = 0; row < rows; row += SRNF_LANES) {
            simd a;
            simd b;

            SIMD_LOAD(a, table + k * rows + row);
            SIMD_LOAD(b, table + (k + 2) * rows + row);
            for (size_t c = 0; c < columns; c++) {
                simd value;

                SIMD_LOAD(value, in + c * rows + row);
                low[c] += a * value;
                high[c] += b * value;
            }
        }
        store_sums(columns, low, x + k * columns);
        store_sums(columns, high, x + (k + 2) * columns);
    }
    if (k < count) {
        simd sums[PASS_COLUMNS];

        clear(columns, sums);

        for (size_t row = 0; row < rows; row += SRNF_LANES) {
            simd a;

            SIMD_LOAD(a, table + k * rows + row);
            for (size_t c = 0; c < columns; c++) {
                simd value;

                SIMD_LOAD(value, in + c * rows + row);
                sums[c] += a * value;
            }
        }
        store_sums(columns, sums, x + k * columns);
    }
}

/* Constant column counts let the compiler keep the tiles in registers. */
SRNF_HOT void sphere_kernel_forward(size_t rows, size_t columns, size_t first, size_t count,
                                    const double *table, const double *x, double *out)
{
    if (columns == 6) {
        forward_tile(rows, 6, first, count, table, x, out);
    } else if (columns == 4) {
        forward_tile(rows, 4, first, count, table, x, out);
    } else {
        forward_tile(rows, 2, first, count, table, x, out);
    }
}

SRNF_HOT void sphere_kernel_adjoint(size_t rows, size_t columns, size_t first, size_t count,
                                    const double *table, const double *in, double *x)
{
    if (columns == 6) {
        adjoint_tile(rows, 6, first, count, table, in, x);
    } else if (columns == 4) {
        adjoint_tile(rows, 4, first, count, table, in, x);
    } else {
        adjoint_tile(rows, 2, first, count, table, in, x);
    }
}

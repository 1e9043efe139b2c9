/*
 * gradient.c - gradient of harmonic series on the grid, and its adjoint: the two operations that
 * all iterative solvers are made of.
 *
 * With z = f_theta + i f_phi / sin theta, the terms of order m of a series with coefficients a
 * (cos), b (sin) are
 *
 *   z = sum_m Z+_m exp(i m phi) + Z-_m exp(-i m phi),
 *   Z+ = sum_l T+_lm (a_lm - i b_lm),  Z- = sum_l T-_lm (a_lm + i b_lm),  T+- = (dP/dtheta -+ m
 *   P/sin) / 2,
 *
 * the harmonics of spin one. So one complex Fourier transform serves both derivatives. T+(pi -
 * theta) = -(-1)^(l-m) T-(theta): sums over even and odd l - m on the northern rows give both
 * hemispheres.
 *
 * Layout of the folded buffer: [m][parity of l - m][column][sign][half_rows], column = 2 field + (0
 * cos, 1 sin). Cost: 3 x 2 x n_theta (L + 1)^2 multiply-adds and 3 n_theta complex transforms of
 * n_phi for three fields.
 */
#include "harmonics.h"
#include "simd.h"

/* Rows [first, first + BLOCK_ROWS) of the northern hemisphere and their mirror images. */
struct block {
    const struct srnf_sht *sht;
    size_t field, columns, first;
};

typedef double pair __attribute__((vector_size(16)));

/* Writes one bin of BLOCK_ROWS consecutive rows from vectors of real and imaginary parts. */
SIMD_INLINE void scatter_bin(double *rows, size_t stride, size_t bin, const simd *re,
                             const simd *im)
{
    simd low = __builtin_shufflevector(*re, *im, 0, 4, 1, 5);
    simd high = __builtin_shufflevector(*re, *im, 2, 6, 3, 7);

    memcpy(rows + 2 * bin, &low, sizeof(pair));
    memcpy(rows + stride + 2 * bin, (const char *)&low + sizeof(pair), sizeof(pair));
    memcpy(rows + 2 * stride + 2 * bin, &high, sizeof(pair));
    memcpy(rows + 3 * stride + 2 * bin, (const char *)&high + sizeof(pair), sizeof(pair));
}

/* From the folded buffer of all orders to the spectra of 2 BLOCK_ROWS rows: northern ones, then
   southern. */
SRNF_HOT static void unfold_block(const struct block *block, const double *folded, double *rows)
{
    const struct srnf_sht *sht = block->sht;
    size_t half = sht->half_rows;
    size_t stride = 2 * sht->grid.n_phi;
    size_t parity = block->columns * 2 * half;
    double *south = rows + BLOCK_ROWS * stride;

    for (size_t m = 0; m <= sht->degree; m++) {
        const double *even = folded + m * 2 * parity + block->field * 4 * half + block->first;
        const double *odd = even + parity;
        simd e[4]; /* cos+, cos-, sin+, sin- */
        simd o[4];
        simd plus_re;
        simd plus_im;
        simd minus_re;
        simd minus_im;
        simd south_plus_re;
        simd south_plus_im;
        simd south_minus_re;
        simd south_minus_im;

        for (size_t k = 0; k < 4; k++) {
            SIMD_LOAD(e[k], even + k * half);
            SIMD_LOAD(o[k], odd + k * half);
        }
        plus_re = e[0] + o[0];
        plus_im = -(e[2] + o[2]);
        minus_re = e[1] + o[1];
        minus_im = e[3] + o[3];
        south_plus_re = o[1] - e[1];
        south_plus_im = e[3] - o[3];
        south_minus_re = o[0] - e[0];
        south_minus_im = o[2] - e[2];
        if (m == 0) {
            plus_re += minus_re;
            plus_im += minus_im;
            south_plus_re += south_minus_re;
            south_plus_im += south_minus_im;
        } else {
            scatter_bin(rows, stride, sht->grid.n_phi - m, &minus_re, &minus_im);
            scatter_bin(south, stride, sht->grid.n_phi - m, &south_minus_re, &south_minus_im);
        }
        scatter_bin(rows, stride, m, &plus_re, &plus_im);
        scatter_bin(south, stride, m, &south_plus_re, &south_plus_im);
    }
}

/* Grid row of line r of a block's buffer; false for padding and for the equator's second copy. */
static bool block_row(const struct block *block, size_t line, size_t *row)
{
    size_t north = block->first + line % BLOCK_ROWS;

    if (north >= block->sht->north) {
        return false;
    }
    if (line < BLOCK_ROWS) {
        *row = north;
        return true;
    }
    *row = block->sht->grid.n_theta - 1 - north;
    return *row != north;
}

SRNF_HOT static void split_row(size_t n, const double *complex_row, double *re, double *im)
{
    for (size_t j = 0; j < n; j++) {
        re[j] = complex_row[2 * j];
        im[j] = complex_row[2 * j + 1];
    }
}

SRNF_HOT static void join_row(size_t n, const double *re, const double *im, double *complex_row)
{
    for (size_t j = 0; j < n; j++) {
        complex_row[2 * j] = re[j];
        complex_row[2 * j + 1] = im[j];
    }
}

static void gradient_pass(const struct srnf_sht *sht, size_t fields, const double *coefficients,
                          double *d_theta, double *d_phi, const struct sphere_workspace *work)
{
    size_t n_phi = sht->grid.n_phi;
    size_t points = sht->grid.n_theta * n_phi;
    size_t table_rows = 2 * sht->half_rows;
    size_t parity = 2 * fields * table_rows;

    for (size_t m = 0; m <= sht->degree; m++) {
        const double *table = sht->spin + sphere_order_offset(sht->degree, m) * table_rows;

        sphere_pack(sht->degree, m, fields, coefficients, work->x);
        for (size_t p = 0; p < 2; p++) {
            sphere_kernel_forward(table_rows, 2 * fields, p, sht->degree + 1 - m, table, work->x,
                                  work->folded + (2 * m + p) * parity);
        }
    }
    memset(work->rows, 0, 2 * BLOCK_ROWS * 2 * n_phi * sizeof(double));
    for (size_t f = 0; f < fields; f++) {
        for (size_t first = 0; first < sht->north; first += BLOCK_ROWS) {
            struct block block = {sht, f, 2 * fields, first};

            unfold_block(&block, work->folded, work->rows);
            fftw_execute_dft(sht->plans.backward, (fftw_complex *)(void *)work->rows,
                             (fftw_complex *)(void *)work->rows2);
            for (size_t line = 0; line < 2 * BLOCK_ROWS; line++) {
                size_t row;

                if (block_row(&block, line, &row)) {
                    split_row(n_phi, work->rows2 + line * 2 * n_phi,
                              d_theta + f * points + row * n_phi, d_phi + f * points + row * n_phi);
                }
            }
        }
    }
}

void srnf_sht_gradient(const struct srnf_sht *sht, size_t batch, const double *coefficients,
                       double *d_theta, double *d_phi, void *workspace)
{
    struct sphere_workspace work = sphere_workspace_split(sht, workspace);
    size_t count = srnf_coefficient_count(sht->degree);
    size_t points = sht->grid.n_theta * sht->grid.n_phi;

    for (size_t done = 0; done < batch; done += PASS_FIELDS) {
        size_t fields = batch - done < PASS_FIELDS ? batch - done : PASS_FIELDS;

        gradient_pass(sht, fields, coefficients + done * count, d_theta + done * points,
                      d_phi + done * points, &work);
    }
}

/* The complex entries of one bin in BLOCK_ROWS consecutive rows, as a vector of real and one of
   imaginary parts. */
SIMD_INLINE void gather_bin(const double *rows, size_t stride, size_t bin, simd *re, simd *im)
{
    pair a;
    pair b;
    pair c;
    pair d;

    memcpy(&a, rows + 2 * bin, sizeof a);
    memcpy(&b, rows + stride + 2 * bin, sizeof b);
    memcpy(&c, rows + 2 * stride + 2 * bin, sizeof c);
    memcpy(&d, rows + 3 * stride + 2 * bin, sizeof d);
    *re = __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 2),
                                  __builtin_shufflevector(c, d, 0, 2), 0, 1, 2, 3);
    *im = __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 3),
                                  __builtin_shufflevector(c, d, 1, 3), 0, 1, 2, 3);
}

/* Transpose of unfold_block: spectra of the rows of one block into the folded buffer. */
SRNF_HOT static void fold_block(const struct block *block, const double *rows, double *folded)
{
    const struct srnf_sht *sht = block->sht;
    size_t half = sht->half_rows;
    size_t stride = 2 * sht->grid.n_phi;
    size_t parity = block->columns * 2 * half;
    const double *south = rows + BLOCK_ROWS * stride;

    for (size_t m = 0; m <= sht->degree; m++) {
        size_t minus = m > 0 ? sht->grid.n_phi - m : 0;
        double *even = folded + m * 2 * parity + block->field * 4 * half + block->first;
        double *odd = even + parity;
        simd n[4]; /* north: re+, re-, im+, im- */
        simd s[4];
        simd value;

        gather_bin(rows, stride, m, &n[0], &n[2]);
        gather_bin(rows, stride, minus, &n[1], &n[3]);
        gather_bin(south, stride, m, &s[0], &s[2]);
        gather_bin(south, stride, minus, &s[1], &s[3]);
        value = n[0] - s[1];
        SIMD_STORE(even, value);
        value = n[1] - s[0];
        SIMD_STORE(even + half, value);
        value = -n[2] - s[3];
        SIMD_STORE(even + 2 * half, value);
        value = n[3] + s[2];
        SIMD_STORE(even + 3 * half, value);
        value = n[0] + s[1];
        SIMD_STORE(odd, value);
        value = n[1] + s[0];
        SIMD_STORE(odd + half, value);
        value = s[3] - n[2];
        SIMD_STORE(odd + 2 * half, value);
        value = n[3] - s[2];
        SIMD_STORE(odd + 3 * half, value);
    }
}

static void adjoint_pass(const struct srnf_sht *sht, size_t fields, const double *d_theta,
                         const double *d_phi, double *coefficients,
                         const struct sphere_workspace *work)
{
    size_t n_phi = sht->grid.n_phi;
    size_t points = sht->grid.n_theta * n_phi;
    size_t table_rows = 2 * sht->half_rows;
    size_t parity = 2 * fields * table_rows;

    for (size_t f = 0; f < fields; f++) {
        for (size_t first = 0; first < sht->north; first += BLOCK_ROWS) {
            struct block block = {sht, f, 2 * fields, first};

            for (size_t line = 0; line < 2 * BLOCK_ROWS; line++) {
                double *target = work->rows + line * 2 * n_phi;
                size_t row;

                if (block_row(&block, line, &row)) {
                    join_row(n_phi, d_theta + f * points + row * n_phi,
                             d_phi + f * points + row * n_phi, target);
                } else {
                    memset(target, 0, 2 * n_phi * sizeof(double));
                }
            }
            fftw_execute_dft(sht->plans.forward, (fftw_complex *)(void *)work->rows,
                             (fftw_complex *)(void *)work->rows2);
            fold_block(&block, work->rows2, work->folded);
        }
    }
    for (size_t m = 0; m <= sht->degree; m++) {
        const double *table = sht->spin + sphere_order_offset(sht->degree, m) * table_rows;

        for (size_t p = 0; p < 2; p++) {
            sphere_kernel_adjoint(table_rows, 2 * fields, p, sht->degree + 1 - m, table,
                                  work->folded + (2 * m + p) * parity, work->x);
        }
        sphere_unpack(sht->degree, m, fields, work->x, coefficients);
    }
}

void srnf_sht_gradient_adjoint(const struct srnf_sht *sht, size_t batch, const double *d_theta,
                               const double *d_phi, double *coefficients, void *workspace)
{
    struct sphere_workspace work = sphere_workspace_split(sht, workspace);
    size_t count = srnf_coefficient_count(sht->degree);
    size_t points = sht->grid.n_theta * sht->grid.n_phi;

    for (size_t done = 0; done < batch; done += PASS_FIELDS) {
        size_t fields = batch - done < PASS_FIELDS ? batch - done : PASS_FIELDS;

        adjoint_pass(sht, fields, d_theta + done * points, d_phi + done * points,
                     coefficients + done * count, &work);
    }
}

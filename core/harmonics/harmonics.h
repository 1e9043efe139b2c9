/*
 * harmonics.h - what the files of core/harmonics share: the transform object, its tables and its
 * kernels.
 */
#ifndef SRNF_HARMONICS_INTERNAL_H
#define SRNF_HARMONICS_INTERNAL_H

#include <fftw3.h>

#include "internal.h"

/* Fields that one pass of a Legendre kernel carries: three coordinates, cosine and sine parts. */
#define PASS_FIELDS ((size_t)3)
#define PASS_COLUMNS (2 * PASS_FIELDS)

/* Northern rows that one pass of the Fourier stage carries, with as many southern ones. */
#define BLOCK_ROWS ((size_t)4)

/*
 * Tables are held per order m, for l = m .. L, with the northern rows (the equator last, if there
 * is one) contiguous and padded with zeros:
 *
 *   scalar[m][l - m][row]         P_lm(theta), real orthonormal, row < scalar_rows (a multiple of
 *   8) spin[m][l - m][sign][row]     T+ and T-, each half_rows long: (dP_lm/dtheta -+ m P_lm / sin
 *   theta) / 2
 *
 * m P_lm / sin theta comes from a recurrence without division, so that rows at a pole are exact.
 */
/* Fourier transforms along the rows of one grid. */
struct sphere_plans {
    fftw_plan backward, forward;  /* 2 BLOCK_ROWS complex rows */
    fftw_plan to_real, from_real; /* one real row */
};

struct srnf_sht {
    struct srnf_grid grid;
    size_t degree;
    size_t north;       /* rows on the northern hemisphere, equator included */
    bool equator;       /* n_theta is odd: row north - 1 is its own mirror image */
    size_t half_rows;   /* north padded to BLOCK_ROWS */
    size_t scalar_rows; /* north padded to 8 */
    double *nodes;      /* theta, cos, sin, weight: 4 x n_theta */
    double *scalar, *spin;
    struct sphere_plans plans;
    size_t least_phi;          /* meridians of the least grid */
    struct sphere_plans least; /* where that has fewer meridians, else NULL */
    bool borrowed;             /* the plans are another transform's, which destroys them */
};

/* sht.c: the transform of the same degree on a grid of Gauss-Legendre nodes that is about the least
   for it: degree + 1 rows, and no more meridians than the other has. It makes no plan: FFTW makes
   one at a time, and callers of solvers hold no lock. Its plans were made with the other transform,
   which must outlive it, and whose workspace is large enough for it. */
SRNF_CHECKED int sphere_sht_least(struct srnf_sht **out, const struct srnf_sht *of);

/* Offset, in rows of the table, of order m. */
static inline size_t sphere_order_offset(size_t degree, size_t m)
{
    return m * (degree + 1) - m * (m - 1) / 2 * (m > 0);
}

/* gauss.c: nodes and weights for x = cos theta, north to south. weight sums to 2. */
void sphere_gauss_legendre(size_t n, double *theta, double *cosine, double *sine, double *weight);
/* scratch: 2 n. */
void sphere_clenshaw_curtis(size_t n, long double *scratch, double *theta, double *cosine,
                            double *sine, double *weight);

/*
 * legendre.c: normalized associated Legendre functions of one colatitude, p[l (l + 1) / 2 + m] with
 * the normalization of the complex harmonics (no factor sqrt 2), for 0 <= m <= l <= degree. What
 * does not depend on the colatitude are LEGENDRE_FACTORS roots for each p, which a table of many
 * rows computes once.
 */
enum {
    LEGENDRE_RECUR,
    LEGENDRE_BEFORE,
    LEGENDRE_THETA_DOWN,
    LEGENDRE_THETA_UP,
    LEGENDRE_PHI_SCALE,
    LEGENDRE_PHI_DOWN,
    LEGENDRE_PHI_UP,
    LEGENDRE_FACTORS
};
void sphere_legendre_factors(size_t degree, double *factors);
void sphere_legendre(size_t degree, const double *factors, double cosine, double sine, double *p);
/* From p, at the same colatitude: dP_lm/dtheta and m P_lm / sin theta of the real harmonics (sqrt 2
   included). */
void sphere_legendre_gradient(const double *factors, const double *p, size_t l, size_t m,
                              double *d_theta, double *m_over_sin);

/*
 * kernel.c: out[column][row] = sum_k table[k][row] x[k][column] over k = first, first + 2, ... <
 * count.
 *   rows     multiple of 8; both tables and out are dense in rows
 *   columns  2, 4 or 6
 */
void sphere_kernel_forward(size_t rows, size_t columns, size_t first, size_t count,
                           const double *table, const double *x, double *out);
/* Its transpose: x[k][column] = sum_row table[k][row] in[column][row], same k. */
void sphere_kernel_adjoint(size_t rows, size_t columns, size_t first, size_t count,
                           const double *table, const double *in, double *x);

/* sht.c: coefficients of order m of `fields` fields, (cos, sin) per field: x[l - m][2 fields], and
   back. */
void sphere_pack(size_t degree, size_t m, size_t fields, const double *coefficients, double *x);
void sphere_unpack(size_t degree, size_t m, size_t fields, const double *x, double *coefficients);

struct sphere_workspace {
    double *x;      /* (degree + 1) x PASS_COLUMNS */
    double *folded; /* [degree + 1][2 parities][PASS_COLUMNS][2 half_rows or scalar_rows] */
    double *rows;   /* 2 BLOCK_ROWS rows of n_phi complex numbers */
    double *rows2;
};
struct sphere_workspace sphere_workspace_split(const struct srnf_sht *sht, void *workspace);

#endif

/*
 * tabulated_matrix.c - the Gauss-Newton matrix of the data term (matrix.c), by products of
 * harmonics.
 *
 * On a Gauss-Legendre grid of the moving surface's own, with a few rows more than the degree of the
 * fields, q from the table. With b = (q_theta, q_phi, q), T = dP_lm/dtheta, F = m P_lm / sin theta
 * and Y = -l (l + 1) P_lm / 2, all divided by sqrt(l (l + 1)), the columns of one (l, m) are the
 * real and the imaginary parts of
 *
 *   G = exp(i m phi) (T b_0 + i F b_1 + Y b_2),   H = exp(i m phi) (T b_1 - i F b_0).
 *
 * So <D_k, D_j> is a sum over rows of Legendre functions times the Fourier coefficients of
 * <b_a, D_j> at m, and those are Legendre functions times the coefficients of <b_a, b_c> at m + m'
 * and m - m': six functions in place of a column of 3 n values for each unknown. The sums over phi
 * are those of the nodes, and the matrix is that of the nodes to rounding.
 *
 * Cost: 4 to 14 multiply-adds for each row, unknown and (l, m); of degree 12 a thirtieth of what a
 * product of columns takes.
 */
#include "tabulated.h"

#include "harmonics/harmonics.h"

#include <math.h>
#include <string.h>

#define ROWS_OVER ((size_t)6)      /* the degree of the fields */
#define ROWS_OVER_FINE ((size_t)8) /* of surfaces above degree 15 */

#define PRODUCTS ((size_t)6) /* of b with b */
#define TORQUES ((size_t)6)  /* of b_0 and b_1 with e_j x q */
#define WAVES ((size_t)4) /* half the sums and differences of the coefficients at m + m', m - m' */

enum { SUM_COS, DIFFERENCE_COS, SUM_SIN, DIFFERENCE_SIN };

/* Which product is <b_a, b_c>. */
static const size_t product_of[3][3] = {{0, 1, 3}, {1, 2, 4}, {3, 4, 5}};

struct assembly {
    size_t degree, each, unknowns; /* each: of one kind of field */
    size_t n_theta, n_phi, stride; /* rows, padded to whole vectors with zeros */
    double *legendre;              /* [order of (l, m)][T, F, Y][stride] */
    double *waves;                 /* [2 degree + 1][cos, sin][n_phi] */
    double *nodes;                 /* [PRODUCTS + TORQUES][n_phi][stride], weighted */
    double *spectra;               /* [PRODUCTS + TORQUES][2 degree + 1][cos, sin][stride] */
    double *mixed;                 /* [PRODUCTS][WAVES][stride] */
    double *fourier;               /* [3][cos, sin][stride]: of <b_a, D_j> */
    double *matrix;
};

static size_t order_of(size_t l, size_t m)
{
    return l * (l + 1) / 2 + m;
}

static double *spectrum_at(const struct assembly *a, size_t function, size_t wave)
{
    return a->spectra + (function * (2 * a->degree + 1) + wave) * 2 * a->stride;
}

/* ---- Tables ---------------------------------------------------------------------------------- */

/* scratch: (1 + LEGENDRE_FACTORS) for each (l, m). */
static void fill_functions(struct assembly *a, const struct srnf_grid *grid, double *scratch)
{
    double *p = scratch;
    double *factors = p + order_of(a->degree, a->degree) + 1;

    sphere_legendre_factors(a->degree, factors);
    for (size_t row = 0; row < a->n_theta; row++) {
        sphere_legendre(a->degree, factors, grid->cos_theta[row], grid->sin_theta[row], p);
        for (size_t l = 1; l <= a->degree; l++) {
            double eigen = (double)(l * (l + 1));
            double scale = 1.0 / sqrt(eigen);

            for (size_t m = 0; m <= l; m++) {
                double *at = a->legendre + 3 * order_of(l, m) * a->stride + row;
                double d_theta, m_over_sin;

                sphere_legendre_gradient(factors, p, l, m, &d_theta, &m_over_sin);
                at[0] = scale * d_theta;
                at[a->stride] = scale * m_over_sin;
                at[2 * a->stride] =
                    -0.5 * scale * eigen * (m > 0 ? sqrt(2.0) : 1.0) * p[order_of(l, m)];
            }
        }
    }
    for (size_t m = 0; m <= 2 * a->degree; m++) {
        for (size_t k = 0; k < a->n_phi; k++) {
            double angle = 2.0 * SRNF_PI * (double)(m * k % a->n_phi) / (double)a->n_phi;

            a->waves[2 * m * a->n_phi + k] = cos(angle);
            a->waves[(2 * m + 1) * a->n_phi + k] = sin(angle);
        }
    }
}

/* Products at the nodes, and the block of the rotations, which has no harmonics. */
static void fill_products(struct assembly *a, const struct tabulated_target *grid,
                          const struct cloud *cloud)
{
    double space[9] = {0.0};

    for (size_t i = 0; i < a->n_theta * a->n_phi; i++) {
        double *at = a->nodes + i % a->n_phi * a->stride + i / a->n_phi;
        size_t next = a->n_phi * a->stride;
        double weight = grid->weight[i];
        double b[3][3];

        for (size_t k = 0; k < 3; k++) {
            b[0][k] = cloud->q_1[k][i];
            b[1][k] = cloud->q_2[k][i];
            b[2][k] = cloud->q[k][i];
        }
        for (size_t u = 0; u < 3; u++) {
            for (size_t v = 0; v <= u; v++) {
                at[product_of[u][v] * next] = weight * vector_dot(b[u], b[v]);
            }
        }
        for (size_t u = 0; u < 2; u++) {
            double turned[3]; /* <b, e_j x q> = <e_j, q x b> */

            vector_cross(b[2], b[u], turned);
            for (size_t j = 0; j < 3; j++) {
                at[(PRODUCTS + 3 * u + j) * next] = weight * turned[j];
            }
        }
        for (size_t j = 0; j < 9; j++) {
            double square = j % 4 == 0 ? vector_dot(b[2], b[2]) : 0.0;

            space[j] += weight * (square - b[2][j / 3] * b[2][j % 3]);
        }
    }
    for (size_t j = 0; j < 3; j++) {
        for (size_t k = j; k < 3; k++) {
            a->matrix[(2 * a->each + j) * a->unknowns + 2 * a->each + k] = space[3 * j + k];
        }
    }
}

/* sum over phi of a function times one wave, all rows */
SRNF_HOT static void sum_wave(const struct assembly *a, const double *function, const double *wave,
                              double *out)
{
    for (size_t row = 0; row < a->stride; row += SRNF_LANES) {
        simd sum = SIMD_SET(0.0);

        for (size_t k = 0; k < a->n_phi; k++) {
            simd v;

            SIMD_LOAD(v, function + k * a->stride + row);
            sum += SIMD_SET(wave[k]) * v;
        }
        SIMD_STORE(out + row, sum);
    }
}

static void fill_spectra(struct assembly *a)
{
    for (size_t f = 0; f < PRODUCTS + TORQUES; f++) {
        const double *function = a->nodes + f * a->n_phi * a->stride;
        size_t most = f < PRODUCTS ? 2 * a->degree : a->degree;

        for (size_t m = 0; m <= most; m++) {
            for (size_t part = 0; part < 2; part++) {
                sum_wave(a, function, a->waves + (2 * m + part) * a->n_phi,
                         spectrum_at(a, f, m) + part * a->stride);
            }
        }
    }
}

/* ---- Entries --------------------------------------------------------------------------------- */

/* What <b_a, b_c> has at m + m' and at m - m', for columns of order m' by those of order m. */
static void mix(struct assembly *a, size_t m, size_t other)
{
    size_t apart = m > other ? m - other : other - m;
    double sign = m < other ? -1.0 : 1.0; /* of the sines */

    for (size_t f = 0; f < PRODUCTS; f++) {
        const double *sum = spectrum_at(a, f, m + other);
        const double *difference = spectrum_at(a, f, apart);
        double *out = a->mixed + f * WAVES * a->stride;

        for (size_t row = 0; row < a->stride; row++) {
            double s = sum[a->stride + row];
            double d = sign * difference[a->stride + row];

            out[SUM_COS * a->stride + row] = 0.5 * (sum[row] + difference[row]);
            out[DIFFERENCE_COS * a->stride + row] = 0.5 * (sum[row] - difference[row]);
            out[SUM_SIN * a->stride + row] = 0.5 * (s + d);
            out[DIFFERENCE_SIN * a->stride + row] = 0.5 * (s - d);
        }
    }
}

/* One column: its Legendre functions, and which of the two parts and kinds it is. */
struct column {
    const double *legendre;
    bool sine, turned;
};

/* out <- signs[0] (T t + Y y) + signs[1] F f over all rows; y may be NULL. */
SIMD_INLINE void combine(const struct assembly *a, const double *legendre, const double *t,
                         const double *f, const double *y, const double signs[2], double *out)
{
    for (size_t row = 0; row < a->stride; row += SRNF_LANES) {
        simd sum, l, v;

        SIMD_LOAD(l, legendre + row);
        SIMD_LOAD(v, t + row);
        sum = SIMD_SET(signs[0]) * l * v;
        if (y) {
            SIMD_LOAD(l, legendre + 2 * a->stride + row);
            SIMD_LOAD(v, y + row);
            sum += SIMD_SET(signs[0]) * l * v;
        }
        SIMD_LOAD(l, legendre + a->stride + row);
        SIMD_LOAD(v, f + row);
        sum += SIMD_SET(signs[1]) * l * v;
        SIMD_STORE(out + row, sum);
    }
}

/* a->fourier <- the coefficients of <b_a, D_j> at m, from what was mixed. With s and d for half of
   sums and differences, of the cosine:
     T s cos - F d sin + Y s cos  and  T s sin + F d cos + Y s sin;
   of the sine:
     T d sin + F s cos + Y d sin  and  -T d cos + F s sin - Y d cos.
   A turned field has b_1 in place of b_0, b_0 in place of b_1, -F in place of F, and no Y. */
SRNF_HOT static void fill_fourier(struct assembly *a, const struct column *j)
{
    static const size_t waves[2][2][2] = {{{SUM_COS, DIFFERENCE_SIN}, {SUM_SIN, DIFFERENCE_COS}},
                                          {{DIFFERENCE_SIN, SUM_COS}, {DIFFERENCE_COS, SUM_SIN}}};
    static const double signs[2][2][2] = {{{1.0, -1.0}, {1.0, 1.0}}, {{1.0, 1.0}, {-1.0, 1.0}}};

    for (size_t k = 0; k < (j->turned ? 2 : 3); k++) {
        const double *t = a->mixed + product_of[k][j->turned ? 1 : 0] * WAVES * a->stride;
        const double *f = a->mixed + product_of[k][j->turned ? 0 : 1] * WAVES * a->stride;
        const double *y = a->mixed + product_of[k][2] * WAVES * a->stride;

        for (size_t part = 0; part < 2; part++) {
            const size_t *wave = waves[j->sine][part];
            double sign[2] = {signs[j->sine][part][0], signs[j->sine][part][1]};

            sign[1] = j->turned ? -sign[1] : sign[1];
            combine(a, j->legendre, t + wave[0] * a->stride, f + wave[1] * a->stride,
                    j->turned ? NULL : y + wave[0] * a->stride, sign,
                    a->fourier + (2 * k + part) * a->stride);
        }
    }
}

/* The two parts of G with a column, real and imaginary. */
SIMD_INLINE void sum_gradient(const struct assembly *a, const double *legendre, double out[2])
{
    const double *fourier = a->fourier;
    size_t stride = a->stride;
    simd re = SIMD_SET(0.0), im = SIMD_SET(0.0);

    for (size_t row = 0; row < stride; row += SRNF_LANES) {
        simd t, f, y, v;

        SIMD_LOAD(t, legendre + row);
        SIMD_LOAD(f, legendre + stride + row);
        SIMD_LOAD(y, legendre + 2 * stride + row);
        SIMD_LOAD(v, fourier + row);
        re += t * v;
        SIMD_LOAD(v, fourier + stride + row);
        im += t * v;
        SIMD_LOAD(v, fourier + 2 * stride + row);
        im += f * v;
        SIMD_LOAD(v, fourier + 3 * stride + row);
        re -= f * v;
        SIMD_LOAD(v, fourier + 4 * stride + row);
        re += y * v;
        SIMD_LOAD(v, fourier + 5 * stride + row);
        im += y * v;
    }
    out[0] = SIMD_SUM(re);
    out[1] = SIMD_SUM(im);
}

/* The same of H. */
SIMD_INLINE void sum_turned(const struct assembly *a, const double *legendre, double out[2])
{
    const double *fourier = a->fourier;
    size_t stride = a->stride;
    simd re = SIMD_SET(0.0), im = SIMD_SET(0.0);

    for (size_t row = 0; row < stride; row += SRNF_LANES) {
        simd t, f, v;

        SIMD_LOAD(t, legendre + row);
        SIMD_LOAD(f, legendre + stride + row);
        SIMD_LOAD(v, fourier + row);
        im -= f * v;
        SIMD_LOAD(v, fourier + stride + row);
        re += f * v;
        SIMD_LOAD(v, fourier + 2 * stride + row);
        re += t * v;
        SIMD_LOAD(v, fourier + 3 * stride + row);
        im += t * v;
    }
    out[0] = SIMD_SUM(re);
    out[1] = SIMD_SUM(im);
}

/* Both columns of an (l, m), whose first is `first`, with column j: entries step apart. */
SIMD_INLINE void put(const double parts[2], size_t l, size_t m, size_t first, size_t step,
                     double *column)
{
    size_t middle = first + l * l + l - 1;

    column[(middle + m) * step] = parts[0];
    if (m > 0) {
        column[(middle - m) * step] = parts[1];
    }
}

/* All G and H of order m, from some l on, with the column that a->fourier is of. Entries of the
   column are step apart. */
SRNF_HOT static void sum_orders(const struct assembly *a, size_t m, size_t gradients, size_t turned,
                                size_t step, double *column)
{
    double parts[2];

    for (size_t l = gradients > m ? gradients : m; l <= a->degree; l++) {
        sum_gradient(a, a->legendre + 3 * order_of(l, m) * a->stride, parts);
        put(parts, l, m, 0, step, column);
    }
    for (size_t l = turned > m ? turned : m; l <= a->degree; l++) {
        sum_turned(a, a->legendre + 3 * order_of(l, m) * a->stride, parts);
        put(parts, l, m, a->each, step, column);
    }
}

/* The columns of the fields of order `other` and degree l by all of order m. What lies above the
   diagonal is left out, but for entries of the same l, which nobody reads. */
static void fill_columns(struct assembly *a, size_t m, size_t other, size_t l)
{
    for (size_t kind = 0; kind < 4; kind++) {
        const struct column j = {a->legendre + 3 * order_of(l, other) * a->stride, kind & 1,
                                 kind & 2};
        size_t at = l * l + (j.sine ? l - other : l + other) - 1 + (j.turned ? a->each : 0);

        if (j.sine && other == 0) {
            continue;
        }
        fill_fourier(a, &j);
        sum_orders(a, m, j.turned ? a->degree + 1 : l, j.turned ? l : 1, 1,
                   a->matrix + at * a->unknowns);
    }
}

/* The rows of the rotation in space by all fields of order m. */
static void fill_torques(struct assembly *a, size_t m)
{
    for (size_t j = 0; j < 3; j++) {
        for (size_t k = 0; k < 2; k++) {
            memcpy(a->fourier + 2 * k * a->stride, spectrum_at(a, PRODUCTS + 3 * k + j, m),
                   2 * a->stride * sizeof(double));
        }
        memset(a->fourier + 4 * a->stride, 0, 2 * a->stride * sizeof(double));
        sum_orders(a, m, 1, 1, a->unknowns, a->matrix + 2 * a->each + j);
    }
}

static int fill_matrix(struct assembly *a, const struct srnf_context *context)
{
    for (size_t other = 0; other <= a->degree; other++) {
        if (srnf_is_canceled(context)) {
            return SRNF_ECANCELED;
        }
        for (size_t m = 0; m <= a->degree; m++) {
            mix(a, m, other);
            for (size_t l = other > 0 ? other : 1; l <= a->degree; l++) {
                fill_columns(a, m, other, l);
            }
        }
        fill_torques(a, other);
    }
    return SRNF_OK;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

/* q at the nodes, by the table, and all products. */
static int sample(struct assembly *a, const struct srnf_grid *grid,
                  const struct tabulated_moving *moving)
{
    size_t n = a->n_theta * a->n_phi;
    struct cloud cloud;
    double *nodes = srnf_alloc(4 * n, sizeof(double));
    struct target target = {.n = n, .points = nodes, .norm2 = 1.0};
    struct tabulated_target from = {0};
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    int status = nodes ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        target.weight = nodes + 3 * n;
        registration_nodes(grid, nodes, nodes + 3 * n);
        status = tabulated_target_create(&from, &target);
    }
    if (status == SRNF_OK && (status = cloud_create(&cloud, from.n)) == SRNF_OK) {
        cloud_rotate(&cloud, &from, identity);
        cloud_evaluate(moving, &cloud);
        fill_products(a, &from, &cloud);
        cloud_clear(&cloud);
    }
    tabulated_target_clear(&from);
    srnf_free(nodes);
    return status;
}

int tabulated_matrix(const struct tabulated_moving *moving, size_t degree,
                     const struct srnf_context *context, double *matrix)
{
    size_t rows = degree + (moving->degree > 15 ? ROWS_OVER_FINE : ROWS_OVER);
    size_t orders = order_of(degree, degree) + 1;
    size_t stride = (rows + SRNF_LANES - 1) / SRNF_LANES * SRNF_LANES;
    size_t functions = PRODUCTS + TORQUES, waves = 2 * degree + 1;
    struct assembly a = {.degree = degree,
                         .each = srnf_coefficient_count(degree) - 1,
                         .unknowns = registration_unknowns(degree),
                         .n_theta = rows,
                         .n_phi = 2 * rows,
                         .stride = stride,
                         .matrix = matrix};
    struct srnf_grid grid;
    double *nodes = registration_parallels(rows, &grid);
    double *memory = srnf_alloc(
        stride * (3 * orders + functions * (a.n_phi + 2 * waves) + PRODUCTS * WAVES + 6) +
            2 * waves * a.n_phi + (1 + LEGENDRE_FACTORS) * orders,
        sizeof(double));
    int status = nodes && memory ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        a.legendre = memory;
        a.nodes = a.legendre + 3 * orders * stride;
        a.spectra = a.nodes + functions * a.n_phi * stride;
        a.mixed = a.spectra + functions * 2 * waves * stride;
        a.fourier = a.mixed + PRODUCTS * WAVES * stride;
        a.waves = a.fourier + 6 * stride;
        fill_functions(&a, &grid, a.waves + 2 * waves * a.n_phi);
        status = sample(&a, &grid, moving);
    }
    if (status == SRNF_OK) {
        fill_spectra(&a);
        status = fill_matrix(&a, context);
    }
    srnf_free(memory);
    srnf_free(nodes);
    return status;
}

/*
 * normal_matrix.c - the matrix of T in the harmonics.
 *
 * With unit normals u and w_ab = u_a u_b, the entry of two harmonics Y and Y' in the coordinates a
 * and b is
 *
 *   integral w_ab (Y_theta Y'_theta + Y_phi Y'_phi / sin^2 theta).
 *
 * On a parallel Y_theta is D(theta) times cos(m phi) or sin(m phi), and Y_phi / sin theta is
 * S(theta) times -sin(m phi) or cos(m phi). So the sum over a parallel needs of w_ab no more than
 * its Fourier sums of orders m - m' and m + m', by
 *
 *   2 cos a cos b = cos(a - b) + cos(a + b),   2 sin a sin b = cos(a - b) - cos(a + b),
 *   2 sin a cos b = sin(a + b) + sin(a - b),
 *
 * and what is left is, for each pair of orders, a product of two small matrices over the parallels.
 * The sums over nodes are those of the transforms, rearranged: T is the same form to rounding. At
 * degree 31 that takes a tenth of the time of a product with T for each unknown.
 */
#include "spectral.h"

#include "harmonics/harmonics.h"

#include <cblas.h>
#include <math.h>

#define CHUNKS ((size_t)16)
#define PAIRS 6 /* of coordinates a >= b */

struct assembly {
    const struct srnf_context *context;
    size_t degree, rows, n;
    double *table; /* for each m, for each l: D then S on the parallels, over sqrt(l (l + 1)) */
    double *cosine, *sine; /* [PAIRS][2 L + 1][rows] half the Fourier sums of w_ab, with weights */
    double *scratch;       /* [CHUNKS] right factors */
    double *matrix;
};

static size_t least_degree(size_t m)
{
    return m > 0 ? m : 1;
}

/* Degrees of an order. */
static size_t degrees(size_t degree, size_t m)
{
    return degree + 1 - least_degree(m);
}

/* Unknowns of the orders below m, in one coordinate; also the columns of the table before m's where
   each order counts once. */
static size_t unknowns_below(size_t degree, size_t m)
{
    size_t count = 0;

    for (size_t k = 0; k < m; k++) {
        count += degrees(degree, k) * (k > 0 ? 2 : 1);
    }
    return count;
}

static size_t columns_below(size_t degree, size_t m)
{
    size_t count = 0;

    for (size_t k = 0; k < m; k++) {
        count += degrees(degree, k);
    }
    return count;
}

static size_t pair_of(size_t a, size_t b)
{
    return a * (a + 1) / 2 + b;
}

size_t normal_matrix_size(size_t degree)
{
    return 3 * (srnf_coefficient_count(degree) - 1);
}

void normal_matrix_order(size_t degree, size_t each, size_t *order)
{
    for (size_t c = 0; c < 3; c++) {
        size_t start = c * each;

        for (size_t m = 0; m <= degree; m++) {
            for (size_t l = least_degree(m); l <= degree; l++) {
                *order++ = start + l * l + l + m;
            }
            for (size_t l = least_degree(m); m > 0 && l <= degree; l++) {
                *order++ = start + l * l + l - m;
            }
        }
    }
}

/* ---- Factors --------------------------------------------------------------------------------- */

static int fill_table(struct assembly *a, const struct srnf_grid *grid)
{
    size_t orders = (a->degree + 1) * (a->degree + 2) / 2;
    double *p = srnf_alloc((1 + LEGENDRE_FACTORS) * orders, sizeof(double));
    double *factors;

    if (!p) {
        return SRNF_ENOMEM;
    }
    factors = p + orders;
    sphere_legendre_factors(a->degree, factors);
    for (size_t i = 0; i < a->rows; i++) {
        double *column = a->table + i;

        sphere_legendre(a->degree, factors, grid->cos_theta[i], grid->sin_theta[i], p);
        for (size_t m = 0; m <= a->degree; m++) {
            for (size_t l = least_degree(m); l <= a->degree; l++, column += 2 * a->rows) {
                double scale = 1.0 / sqrt((double)(l * (l + 1)));

                sphere_legendre_gradient(factors, p, l, m, &column[0], &column[a->rows]);
                column[0] *= scale;
                column[a->rows] *= scale;
            }
        }
    }
    srnf_free(p);
    return SRNF_OK;
}

/* Half the sums of weight w_ab cos(k phi) and sin(k phi) over each parallel. */
static int fill_sums(struct assembly *a, const struct srnf_grid *grid, const double *u,
                     const double *weight)
{
    size_t columns = grid->n_phi, points = a->rows * columns, orders = 2 * a->degree + 1;
    double *wave = srnf_alloc(2 * orders * columns + points, sizeof(double));
    double *values;

    if (!wave) {
        return SRNF_ENOMEM;
    }
    values = wave + 2 * orders * columns;
    for (size_t k = 0; k < orders; k++) {
        for (size_t j = 0; j < columns; j++) {
            double angle = 2.0 * SRNF_PI * (double)(k * j % columns) / (double)columns;

            wave[k * columns + j] = cos(angle);
            wave[(orders + k) * columns + j] = sin(angle);
        }
    }
    for (size_t first = 0; first < 3; first++) {
        for (size_t second = 0; second <= first; second++) {
            size_t at = pair_of(first, second) * orders * a->rows;

            for (size_t i = 0; i < points; i++) {
                values[i] = weight[i] * u[first * points + i] * u[second * points + i];
            }
            cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, (int)a->rows, (int)orders,
                        (int)columns, 0.5, values, (int)columns, wave, (int)columns, 0.0,
                        a->cosine + at, (int)a->rows);
            cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, (int)a->rows, (int)orders,
                        (int)columns, 0.5, values, (int)columns, wave + orders * columns,
                        (int)columns, 0.0, a->sine + at, (int)a->rows);
        }
    }
    srnf_free(wave);
    return SRNF_OK;
}

/* ---- Blocks ---------------------------------------------------------------------------------- */

/* Two orders in two coordinates: half the Fourier sums of m - m' and m + m' on each parallel. */
struct waves {
    const double *cosine_less, *cosine_more, *sine_less, *sine_more;
    double sign; /* of m - m' */
};

static struct waves waves_of(const struct assembly *a, size_t pair, size_t m, size_t other)
{
    const double *cosine = a->cosine + pair * (2 * a->degree + 1) * a->rows;
    const double *sine = a->sine + pair * (2 * a->degree + 1) * a->rows;
    size_t less = (m > other ? m - other : other - m) * a->rows, more = (m + other) * a->rows;

    return (struct waves){cosine + less, cosine + more, sine + less, sine + more,
                          m > other ? 1.0 : -1.0};
}

/* What D' and S' are multiplied by on a parallel: to the left is the cosine or the sine of m, to
   the right that of m'. */
static void factors(const struct waves *w, size_t i, bool left_sine, bool right_sine,
                    double *d_theta, double *over_sin)
{
    double c = w->cosine_less[i], cc = w->cosine_more[i];
    double s = w->sign * w->sine_less[i], ss = w->sine_more[i];

    if (left_sine == right_sine) {
        *d_theta = left_sine ? c - cc : c + cc;
        *over_sin = left_sine ? c + cc : c - cc;
    } else {
        *d_theta = left_sine ? ss + s : ss - s;
        *over_sin = left_sine ? s - ss : -(ss + s);
    }
}

/* Rows (a, m, cosine or sine) and all columns (b, m') of the matrix. */
static void multiply(const struct assembly *a, size_t pair, size_t m, bool left_sine, size_t other,
                     double *right, double *block)
{
    const struct waves w = waves_of(a, pair, m, other);
    const double *left = a->table + columns_below(a->degree, m) * 2 * a->rows;
    const double *from = a->table + columns_below(a->degree, other) * 2 * a->rows;
    size_t depth = 2 * a->rows, width = degrees(a->degree, other), sides = other > 0 ? 2 : 1;

    for (size_t i = 0; i < a->rows; i++) {
        for (size_t side = 0; side < sides; side++) {
            double d_theta, over_sin;

            factors(&w, i, left_sine, side == 1, &d_theta, &over_sin);
            for (size_t k = 0; k < width; k++) {
                const double *source = from + k * depth + i;
                double *out = right + (side * width + k) * depth + i;

                out[0] = d_theta * source[0];
                out[a->rows] = over_sin * source[a->rows];
            }
        }
    }
    cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, (int)degrees(a->degree, m),
                (int)(sides * width), (int)depth, 1.0, left, (int)depth, right, (int)depth, 0.0,
                block, (int)a->n);
}

/* The columns of order `other` in coordinate b, from the diagonal down. */
static void fill_columns(const struct assembly *a, size_t b, size_t other, double *right)
{
    size_t each = a->n / 3;
    double *columns = a->matrix + (b * each + unknowns_below(a->degree, other)) * a->n;

    for (size_t c = b; c < 3; c++) {
        for (size_t m = c == b ? other : 0; m <= a->degree; m++) {
            double *block = columns + c * each + unknowns_below(a->degree, m);

            multiply(a, pair_of(c, b), m, false, other, right, block);
            if (m > 0) {
                multiply(a, pair_of(c, b), m, true, other, right, block + degrees(a->degree, m));
            }
        }
    }
}

static void fill_chunk(void *argument, size_t chunk)
{
    const struct assembly *a = argument;
    double *right = a->scratch + chunk * 4 * a->rows * a->degree;

    for (size_t i = chunk; i < 3 * (a->degree + 1) && !srnf_is_canceled(a->context); i += CHUNKS) {
        fill_columns(a, i % 3, i / 3, right);
    }
}

int normal_matrix_assemble(const struct srnf_sht *sht, size_t degree, const double *u,
                           const double *weight, const struct srnf_context *context, double *matrix)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t rows = grid->n_theta;
    size_t sums = PAIRS * (2 * degree + 1) * rows;
    struct assembly a = {.context = context,
                         .degree = degree,
                         .rows = rows,
                         .n = normal_matrix_size(degree),
                         .matrix = matrix};
    int status = SRNF_ENOMEM;

    a.table = srnf_alloc(columns_below(degree, degree + 1) * 2 * rows, sizeof(double));
    a.cosine = srnf_alloc(2 * sums, sizeof(double));
    a.scratch = srnf_alloc(CHUNKS * 4 * rows * degree, sizeof(double));
    if (a.table && a.cosine && a.scratch) {
        a.sine = a.cosine + sums;
        status = fill_table(&a, grid);
        status = status ? status : fill_sums(&a, grid, u, weight);
        status = status ? status : srnf_parallel_for(context, CHUNKS, fill_chunk, &a);
    }
    srnf_free(a.table);
    srnf_free(a.cosine);
    srnf_free(a.scratch);
    return status;
}

/*
 * spline.c - tables of splines on the sphere: made, filtered, and the transpose.
 *
 * A row of the table is a circle of `columns` nodes, and so is the great circle through the columns
 * k and k + rows. The filter runs along all rows, then along all great circles, four of them side
 * by side. In one direction it is a product over the poles z of the spline's sampled kernel:
 *
 *   c+[i] = x[i] + z c+[i - 1],  c[i] = z (c[i + 1] - c+[i]),
 *
 * on a circle, so that each recursion starts from the sum over all that lies before it, cut off
 * where z^k is below rounding.
 */
#include "spline.h"

#include <math.h>

#define SIDE ((size_t)8) /* circles that are filtered together, so that none waits for itself */
#define HORIZON 1e-15    /* z^k that counts no more */

/* Poles of the kernels of 4, 6, 8, 10 and 12 nodes inside the unit circle, largest first. */
static const double kernel_poles[][5] = {
    {-0.26794919243112270647},
    {-0.43057534709997430378, -0.043096288203264653823},
    {-0.53528043079643816554, -0.12255461519232669052, -0.0091486948096082769286},
    {-0.60799738916862577901, -0.2017505201931532388, -0.043222608540481752133,
     -0.0021213069031808184203},
    {-0.66126606890073470691, -0.27218034929478588569, -0.089759599793713309944,
     -0.016669627366234656097, -0.00051055753444650205714},
};

/* The polynomials of the B-spline of `order` nodes: that of node j at t in [0, 1) beyond node
   order / 2 - 1, by the recursion over orders. */
static void make_pieces(struct sphere_spline *s)
{
    double b[SPLINE_ORDER_MAX + 1][SPLINE_ORDER_MAX + 1][SPLINE_ORDER_MAX + 1] = {{{0.0}}};
    size_t order = s->order;

    b[1][0][0] = 1.0;
    for (size_t o = 2; o <= order; o++) {
        for (size_t i = 0; i < o; i++) {
            for (size_t k = 0; k < o; k++) {
                double sum = 0.0;

                if (i + 1 < o) {
                    sum += (double)i * b[o - 1][i][k] + (k > 0 ? b[o - 1][i][k - 1] : 0.0);
                }
                if (i > 0) {
                    sum += (double)(o - i) * b[o - 1][i - 1][k] -
                           (k > 0 ? b[o - 1][i - 1][k - 1] : 0.0);
                }
                b[o][i][k] = sum / (double)(o - 1);
            }
        }
    }
    for (size_t j = 0; j < order; j++) {
        for (size_t k = 0; k < order; k++) {
            s->pieces[j][k] = b[order][order - 1 - j][k];
        }
    }
}

static size_t table_nodes(const struct sphere_spline *s)
{
    return (s->rows + 1 + 2 * s->halo) * s->stride;
}

int sphere_spline_create(struct sphere_spline *s, size_t order, size_t rows)
{
    *s = (struct sphere_spline){.order = order,
                                .rows = rows,
                                .columns = 2 * rows,
                                .halo = order / 2,
                                .stride = 2 * rows + order,
                                .per_radian = (double)rows / SRNF_PI};
    s->memory = srnf_alloc(table_nodes(s) * SPLINE_WIDTH, sizeof(double));
    s->lines = srnf_alloc(s->columns * SIDE * SPLINE_WIDTH, sizeof(double));
    if (!s->memory || !s->lines) {
        sphere_spline_clear(s);
        return SRNF_ENOMEM;
    }
    s->origin = s->memory + (s->halo * s->stride + s->halo) * SPLINE_WIDTH;
    make_pieces(s);
    return SRNF_OK;
}

void sphere_spline_clear(struct sphere_spline *s)
{
    srnf_free(s->memory);
    srnf_free(s->lines);
    *s = (struct sphere_spline){0};
}

void sphere_spline_zero(struct sphere_spline *s)
{
    memset(s->memory, 0, table_nodes(s) * SPLINE_WIDTH * sizeof(double));
}

/* One pole over `side` circles that lie side by side in s->lines: x[i][side]. gain: a factor. */
SIMD_INLINE void filter_pole(double *x, size_t length, size_t side, double z, double gain)
{
    size_t width = side * SPLINE_WIDTH;
    size_t horizon = (size_t)(log(HORIZON) / log(-z)) + 1;
    double whole = 1.0 / (1.0 - pow(z, (double)length));
    simd c[SIDE];
    simd v;

    horizon = horizon < length ? horizon : length;
    for (size_t j = 0; j < side; j++) {
        c[j] = SIMD_SET(0.0);
    }
    for (size_t k = horizon; k-- > 0;) { /* sum of z^k x[-k] */
        for (size_t j = 0; j < side; j++) {
            SIMD_LOAD(v, x + (length - k) % length * width + j * SPLINE_WIDTH);
            c[j] = v + SIMD_SET(z) * c[j];
        }
    }
    for (size_t j = 0; j < side; j++) {
        c[j] *= SIMD_SET(whole * gain);
        SIMD_STORE(x + j * SPLINE_WIDTH, c[j]);
    }
    for (size_t i = 1; i < length; i++) {
        for (size_t j = 0; j < side; j++) {
            SIMD_LOAD(v, x + i * width + j * SPLINE_WIDTH);
            c[j] = SIMD_SET(gain) * v + SIMD_SET(z) * c[j];
            SIMD_STORE(x + i * width + j * SPLINE_WIDTH, c[j]);
        }
    }
    for (size_t j = 0; j < side; j++) {
        c[j] = SIMD_SET(0.0);
    }
    for (size_t k = horizon; k-- > 0;) { /* sum of z^k c+[length - 1 + k] */
        for (size_t j = 0; j < side; j++) {
            SIMD_LOAD(v, x + (length - 1 + k) % length * width + j * SPLINE_WIDTH);
            c[j] = v + SIMD_SET(z) * c[j];
        }
    }
    for (size_t j = 0; j < side; j++) {
        c[j] *= SIMD_SET(-z * whole);
        SIMD_STORE(x + (length - 1) * width + j * SPLINE_WIDTH, c[j]);
    }
    for (size_t i = length - 1; i-- > 0;) {
        for (size_t j = 0; j < side; j++) {
            SIMD_LOAD(v, x + i * width + j * SPLINE_WIDTH);
            c[j] = SIMD_SET(z) * (c[j] - v);
            SIMD_STORE(x + i * width + j * SPLINE_WIDTH, c[j]);
        }
    }
}

SRNF_HOT static void filter_lines(double *x, size_t length, size_t side, size_t order)
{
    const double *poles = kernel_poles[order / 2 - 2];

    for (size_t k = 0; k + 1 < order / 2; k++) {
        double z = poles[k];
        double gain = (1.0 - z) * (1.0 - 1.0 / z);

        if (side == SIDE) {
            filter_pole(x, length, SIDE, z, gain);
        } else if (side == SIDE / 2) {
            filter_pole(x, length, SIDE / 2, z, gain);
        } else {
            filter_pole(x, length, side, z, gain);
        }
    }
}

static size_t nodes_bytes(size_t nodes)
{
    return nodes * SPLINE_WIDTH * sizeof(double);
}

static void filter_rows(struct sphere_spline *s)
{
    for (size_t row = 0; row <= s->rows; row += SIDE) {
        size_t side = s->rows + 1 - row < SIDE ? s->rows + 1 - row : SIDE;

        for (size_t k = 0; k < s->columns; k++) {
            for (size_t j = 0; j < side; j++) {
                memcpy(s->lines + (k * side + j) * SPLINE_WIDTH, sphere_spline_node(s, row + j, k),
                       nodes_bytes(1));
            }
        }
        filter_lines(s->lines, s->columns, side, s->order);
        for (size_t k = 0; k < s->columns; k++) {
            for (size_t j = 0; j < side; j++) {
                memcpy(sphere_spline_node(s, row + j, k), s->lines + (k * side + j) * SPLINE_WIDTH,
                       nodes_bytes(1));
            }
        }
    }
}

/* Node i of the great circles through columns k, k + 1, ..: the far side comes back from the
   south. */
static double *circle_node(const struct sphere_spline *s, size_t i, size_t k)
{
    return i <= s->rows ? sphere_spline_node(s, i, k)
                        : sphere_spline_node(s, 2 * s->rows - i, k + s->rows);
}

static void add_nodes(size_t nodes, const double *from, double *to)
{
    for (size_t i = 0; i < nodes * SPLINE_WIDTH; i++) {
        to[i] += from[i];
    }
}

/* transposed: the poles of the far side, which the filter does not read but fills, come first. */
static void filter_circles(struct sphere_spline *s, bool transposed)
{
    for (size_t k = 0; k < s->rows; k += SIDE) {
        size_t side = s->rows - k < SIDE ? s->rows - k : SIDE;
        size_t width = side * SPLINE_WIDTH;
        double *north = sphere_spline_node(s, 0, k + s->rows);
        double *south = sphere_spline_node(s, s->rows, k + s->rows);

        for (size_t i = 0; i < s->columns; i++) {
            memcpy(s->lines + i * width, circle_node(s, i, k), nodes_bytes(side));
        }
        if (transposed) {
            add_nodes(side, north, s->lines);
            add_nodes(side, south, s->lines + s->rows * width);
        }
        filter_lines(s->lines, s->columns, side, s->order);
        for (size_t i = 0; i < s->columns; i++) {
            memcpy(circle_node(s, i, k), s->lines + i * width, nodes_bytes(side));
        }
        if (transposed) {
            memset(north, 0, nodes_bytes(side));
            memset(south, 0, nodes_bytes(side));
        } else {
            memcpy(north, s->lines, nodes_bytes(side));
            memcpy(south, s->lines + s->rows * width, nodes_bytes(side));
        }
    }
}

/* What a row or a column of the halo is a copy of. */
struct mirror {
    double *outside, *inside;
    size_t nodes;
};

/* Row i beyond a pole is row i before it, half a turn on: two pieces. */
static struct mirror halo_row(const struct sphere_spline *s, bool south, size_t i, bool second)
{
    size_t row = south ? s->rows - i : i;
    double *edge = sphere_spline_node(s, south ? s->rows : 0, 0);
    double *outside =
        south ? edge + i * s->stride * SPLINE_WIDTH : edge - i * s->stride * SPLINE_WIDTH;

    return (struct mirror){outside + (second ? s->rows : 0) * SPLINE_WIDTH,
                           sphere_spline_node(s, row, second ? 0 : s->rows), s->rows};
}

/* Row by row, the halo's rows included: what lies before the first column and after the last. */
static struct mirror halo_column(const struct sphere_spline *s, size_t line, bool after)
{
    double *row = s->memory + (line * s->stride + s->halo) * SPLINE_WIDTH;

    return after ? (struct mirror){row + s->columns * SPLINE_WIDTH, row, s->halo}
                 : (struct mirror){row - s->halo * SPLINE_WIDTH,
                                   row + (s->columns - s->halo) * SPLINE_WIDTH, s->halo};
}

void sphere_spline_filter(struct sphere_spline *s)
{
    filter_rows(s);
    filter_circles(s, false);
    for (size_t i = 1; i <= s->halo; i++) {
        for (int part = 0; part < 4; part++) {
            struct mirror m = halo_row(s, part & 1, i, part & 2);

            memcpy(m.outside, m.inside, nodes_bytes(m.nodes));
        }
    }
    for (size_t line = 0; line < s->rows + 1 + 2 * s->halo; line++) {
        for (int part = 0; part < 2; part++) {
            struct mirror m = halo_column(s, line, part);

            memcpy(m.outside, m.inside, nodes_bytes(m.nodes));
        }
    }
}

void sphere_spline_fold(struct sphere_spline *s)
{
    for (size_t line = 0; line < s->rows + 1 + 2 * s->halo; line++) {
        for (int part = 0; part < 2; part++) {
            struct mirror m = halo_column(s, line, part);

            add_nodes(m.nodes, m.outside, m.inside);
        }
    }
    for (size_t i = 1; i <= s->halo; i++) {
        for (int part = 0; part < 4; part++) {
            struct mirror m = halo_row(s, part & 1, i, part & 2);

            add_nodes(m.nodes, m.outside, m.inside);
        }
    }
    filter_circles(s, true);
    filter_rows(s);
}

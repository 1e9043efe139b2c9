/*
 * tabulated_matrix.c - the Gauss-Newton matrix of the data term (matrix.c) in single precision.
 *
 * Columns D_k on a Gauss-Legendre grid of the moving surface's own, with a few rows more than the
 * degree of the fields, q from the table, and harmonics as products of a Legendre function and a
 * circular one. The matrix decides which way a step goes and never what is accepted: with rounding
 * of 1e-7 the steps are the same for all purposes.
 */
#include "tabulated.h"

#include "harmonics/harmonics.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define ROWS_OVER ((size_t)6)      /* the degree of the fields */
#define ROWS_OVER_FINE ((size_t)8) /* of surfaces above degree 15 */
/* Of a product that is done between two looks at cancellation; rows come in whole units. */
#define ROWS_UNIT ((size_t)768)
#define PRODUCT_OPERATIONS ((size_t)2000000000)

struct columns {
    size_t degree, count, n_theta, n_phi, n;
    const struct srnf_grid *grid;
    double *legendre; /* [3][order of (l, m)][n_theta]: P, dP/dtheta, m P / sin theta */
    double *circular; /* [2][degree + 1][n_phi]: cos m phi, sin m phi */
    float *q;         /* [3][3][n]: q, q_theta, q_phi, times the root of the weight */
    float *columns;   /* [unknowns][3][n] */
};

static size_t order_of(size_t l, size_t m)
{
    return l * (l + 1) / 2 + m;
}

static void fill_functions(struct columns *c, double *p)
{
    size_t orders = order_of(c->degree, c->degree) + 1;
    double *factors = p + orders;

    sphere_legendre_factors(c->degree, factors);
    for (size_t row = 0; row < c->n_theta; row++) {
        sphere_legendre(c->degree, factors, c->grid->cos_theta[row], c->grid->sin_theta[row], p);
        for (size_t l = 1; l <= c->degree; l++) {
            for (size_t m = 0; m <= l; m++) {
                double *at = c->legendre + order_of(l, m) * c->n_theta + row;

                at[0] = (m > 0 ? sqrt(2.0) : 1.0) * p[order_of(l, m)];
                sphere_legendre_gradient(factors, p, l, m, at + orders * c->n_theta,
                                         at + 2 * orders * c->n_theta);
            }
        }
    }
    for (size_t m = 0; m <= c->degree; m++) {
        for (size_t k = 0; k < c->n_phi; k++) {
            double angle = 2.0 * SRNF_PI * (double)(m * k % c->n_phi) / (double)c->n_phi;

            c->circular[m * c->n_phi + k] = cos(angle);
            c->circular[(c->degree + 1 + m) * c->n_phi + k] = sin(angle);
        }
    }
}

/* One row of nodes of the columns of P_lm times `value`, whose derivative by phi is m times `turn`.
   gradient, turned: [3][n], at the row. */
SIMD_INLINE void fill_row(const struct columns *c, size_t row, const double legendre[3],
                          const double *value, const double *turn, double sign, double eigen,
                          float *gradient, float *turned)
{
    double scale = 1.0 / sqrt(eigen);
    size_t first = row * c->n_phi;
    float y = (float)(-0.5 * scale * eigen * legendre[0]);
    float t = (float)(scale * legendre[1]);
    float f = (float)(scale * sign * legendre[2]);

    for (size_t k = 0; k < 3; k++) {
        const float *q = c->q + k * c->n + first;
        const float *q_theta = c->q + (3 + k) * c->n + first;
        const float *q_phi = c->q + (6 + k) * c->n + first;
        float *g = gradient + k * c->n + first;
        float *h = turned + k * c->n + first;

        for (size_t i = 0; i < c->n_phi; i++) {
            float a = t * (float)value[i];
            float b = f * (float)turn[i];

            g[i] = a * q_theta[i] + b * q_phi[i] + y * (float)value[i] * q[i];
            h[i] = a * q_phi[i] - b * q_theta[i];
        }
    }
}

SRNF_HOT static void fill_columns(struct columns *c)
{
    size_t orders = order_of(c->degree, c->degree) + 1;
    size_t each = c->count - 1;
    const double *cosine = c->circular;
    const double *sine = c->circular + (c->degree + 1) * c->n_phi;

    for (size_t l = 1; l <= c->degree; l++) {
        for (size_t at = l * l; at < (l + 1) * (l + 1); at++) {
            bool even = at >= l * l + l; /* cos m phi, as against sin m phi */
            size_t m = even ? at - l * l - l : l * l + l - at;
            float *gradient = c->columns + (at - 1) * 3 * c->n;

            for (size_t row = 0; row < c->n_theta; row++) {
                const double *p = c->legendre + order_of(l, m) * c->n_theta + row;
                const double functions[3] = {p[0], p[orders * c->n_theta],
                                             p[2 * orders * c->n_theta]};

                fill_row(c, row, functions, (even ? cosine : sine) + m * c->n_phi,
                         (even ? sine : cosine) + m * c->n_phi, even ? -1.0 : 1.0,
                         (double)(l * (l + 1)), gradient, gradient + each * 3 * c->n);
            }
        }
    }
    for (size_t j = 0; j < 3; j++) { /* e_j x q */
        float *column = c->columns + (2 * each + j) * 3 * c->n;
        size_t u = (j + 1) % 3;
        size_t v = (j + 2) % 3;

        for (size_t i = 0; i < c->n; i++) {
            column[j * c->n + i] = 0.0F;
            column[u * c->n + i] = -c->q[v * c->n + i];
            column[v * c->n + i] = c->q[u * c->n + i];
        }
    }
}

/* q at the nodes, by the table. */
static int fill_q(struct columns *c, const struct tabulated_moving *moving)
{
    struct cloud cloud;
    double *nodes = srnf_alloc(4 * c->n, sizeof(double));
    struct target target = {.n = c->n, .points = nodes, .norm2 = 1.0};
    struct tabulated_target from = {0};
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    int status = nodes ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        target.weight = nodes + 3 * c->n;
        registration_nodes(c->grid, nodes, nodes + 3 * c->n);
        status = tabulated_target_create(&from, &target);
    }
    if (status == SRNF_OK && (status = cloud_create(&cloud, from.n)) == SRNF_OK) {
        cloud_rotate(&cloud, &from, identity);
        cloud_evaluate(moving, &cloud);
        for (size_t i = 0; i < c->n; i++) {
            double root = sqrt(from.weight[i]);

            for (size_t k = 0; k < 3; k++) {
                c->q[k * c->n + i] = (float)(root * cloud.q[k][i]);
                c->q[(3 + k) * c->n + i] = (float)(root * cloud.q_1[k][i]);
                c->q[(6 + k) * c->n + i] = (float)(root * cloud.q_2[k][i]);
            }
        }
        cloud_clear(&cloud);
    }
    tabulated_target_clear(&from);
    srnf_free(nodes);
    return status;
}

static int multiply(const struct columns *c, const struct srnf_context *context, float *product)
{
    size_t unknowns = registration_unknowns(c->degree);
    size_t rows = 3 * c->n;
    size_t step = ROWS_UNIT * (1 + PRODUCT_OPERATIONS / (ROWS_UNIT * unknowns * unknowns));
    size_t count;

    for (size_t first = 0; first < rows; first += count) {
        count = rows - first;
        count = count < step + ROWS_UNIT ? count : step;
        if (srnf_is_canceled(context)) {
            return SRNF_ECANCELED;
        }
        cblas_ssyrk(CblasColMajor, CblasLower, CblasTrans, (int)unknowns, (int)count, 1.0F,
                    c->columns + first, (int)rows, first > 0 ? 1.0F : 0.0F, product, (int)unknowns);
    }
    return SRNF_OK;
}

int tabulated_matrix(const struct tabulated_moving *moving, size_t degree,
                     const struct srnf_context *context, double *matrix)
{
    size_t rows = degree + (moving->degree > 15 ? ROWS_OVER_FINE : ROWS_OVER);
    size_t orders = order_of(degree, degree) + 1;
    size_t unknowns = registration_unknowns(degree);
    struct columns c = {.degree = degree, .count = srnf_coefficient_count(degree)};
    struct srnf_grid grid;
    double *nodes = registration_parallels(rows, &grid);
    double *memory = NULL;
    float *product = NULL;
    int status;

    if (!nodes) {
        return SRNF_ENOMEM;
    }
    c.grid = &grid;
    c.n_theta = rows;
    c.n_phi = 2 * rows;
    c.n = 2 * rows * rows;
    memory = srnf_alloc(orders * (1 + LEGENDRE_FACTORS + 3 * rows) + 4 * (degree + 1) * rows,
                        sizeof(double));
    c.q = srnf_alloc((9 + 3 * unknowns) * c.n, sizeof(float));
    product = srnf_alloc(unknowns * unknowns, sizeof(float));
    status = memory && c.q && product ? fill_q(&c, moving) : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        c.columns = c.q + 9 * c.n;
        c.legendre = memory + (1 + LEGENDRE_FACTORS) * orders;
        c.circular = c.legendre + 3 * orders * rows;
        fill_functions(&c, memory);
        fill_columns(&c);
        status = multiply(&c, context, product);
    }
    if (status == SRNF_OK) {
        for (size_t j = 0; j < unknowns; j++) {
            for (size_t i = j; i < unknowns; i++) {
                matrix[j * unknowns + i] = (double)product[j * unknowns + i];
            }
        }
    }
    srnf_free(product);
    srnf_free(c.q);
    srnf_free(memory);
    srnf_free(nodes);
    return status;
}

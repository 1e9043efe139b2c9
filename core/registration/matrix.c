/*
 * matrix.c - the Gauss-Newton matrix of left steps.
 *
 * Columns, on a grid of the moving surface's own: for a field X_k = grad Y_lm / sqrt(l (l+1)) or
 * its quarter turn,
 *   D_k = X_k . grad q2 + div X_k q2 / 2,  div grad Y_lm = -l (l + 1) Y_lm,  div of the turned
 *   field = 0,
 * and for the value rotation about axis j the column e_j x q2. H = D' W D. The displacement penalty
 * ||e - O' (e, gamma)||^2 is of the same form with the identity in place of q2; at gamma = id its
 * matrix is diagonal:
 *   <X_k, X_k> + <div X_k, div X_k> / 4 = 1 + l (l + 1) / 4 for gradients, 1 for turned fields.
 */
#include "tabulated.h"

#include <cblas.h>
#include <math.h>

#define ROWS_MIN ((size_t)24)

/* Of a product that is done between two looks at cancellation. Rows come in whole units, which BLAS
   blocks them by anyway, and a rest shorter than a unit is not left for the end, where it would be
   halved: so the sums are those of a single call. */
#define ROWS_UNIT ((size_t)768)
#define PRODUCT_OPERATIONS ((size_t)1000000000)

struct assembly {
    size_t n, degree, count, unknowns;
    const struct srnf_grid *grid;
    struct samples samples;
    double *points, *weight, *columns;   /* columns: [unknowns][3 n] */
    double *harmonics, *d_theta, *d_phi; /* PASS harmonics at a time */
    double *coefficients;
    void *workspace;
};

/* q along e_theta and e_phi at node i, from the samples' own frame. */
static void derivative_along(const struct samples *s, size_t i, const double direction[3],
                             double out[3])
{
    double a = 0.0;
    double b = 0.0;

    for (size_t k = 0; k < 3; k++) {
        a += direction[k] * s->t1[3 * i + k];
        b += direction[k] * s->t2[3 * i + k];
    }
    for (size_t k = 0; k < 3; k++) {
        out[k] = a * s->q_1[3 * i + k] + b * s->q_2[3 * i + k];
    }
}

/* The two columns of one harmonic, rows weighted by sqrt(weight). q_theta, q_phi: [n][3]. */
static void field_columns(const struct assembly *a, size_t l, const double *q_theta,
                          const double *q_phi, double *gradient, double *turned)
{
    double eigen = (double)(l * (l + 1));
    double scale = 1.0 / sqrt(eigen);

    for (size_t i = 0; i < a->n; i++) {
        double w = scale * sqrt(a->weight[i]);

        for (size_t k = 0; k < 3; k++) {
            double qt = q_theta[3 * i + k];
            double qp = q_phi[3 * i + k];

            gradient[3 * i + k] = w * (a->d_theta[i] * qt + a->d_phi[i] * qp -
                                       0.5 * eigen * a->harmonics[i] * a->samples.q[3 * i + k]);
            turned[3 * i + k] = w * (a->d_theta[i] * qp - a->d_phi[i] * qt);
        }
    }
}

static void rotation_columns(const struct assembly *a, double *columns)
{
    for (size_t i = 0; i < a->n; i++) {
        const double *q = a->samples.q + 3 * i;
        double w = sqrt(a->weight[i]);
        /* e_x x q, e_y x q, e_z x q */
        double rows[3][3] = {{0.0, -q[2], q[1]}, {q[2], 0.0, -q[0]}, {-q[1], q[0], 0.0}};

        for (size_t j = 0; j < 3; j++) {
            for (size_t k = 0; k < 3; k++) {
                columns[j * 3 * a->n + 3 * i + k] = w * rows[j][k];
            }
        }
    }
}

/* Breaks off when it is canceled. */
static void fill_columns(struct assembly *a, const struct srnf_context *context,
                         const struct srnf_sht *sht, double *q_theta, double *q_phi)
{
    size_t fields = a->count - 1;

    for (size_t i = 0; i < a->n; i++) {
        size_t row = i / a->grid->n_phi;
        double phi = 2.0 * SRNF_PI * (double)(i % a->grid->n_phi) / (double)a->grid->n_phi;
        double along[3] = {a->grid->cos_theta[row] * cos(phi), a->grid->cos_theta[row] * sin(phi),
                           -a->grid->sin_theta[row]};
        double across[3] = {-sin(phi), cos(phi), 0.0};

        derivative_along(&a->samples, i, along, q_theta + 3 * i);
        derivative_along(&a->samples, i, across, q_phi + 3 * i);
    }
    for (size_t l = 1; l <= a->degree && !srnf_is_canceled(context); l++) {
        for (size_t at = l * l; at < (l + 1) * (l + 1); at++) {
            a->coefficients[at] = 1.0;
            srnf_sht_synthesis(sht, 1, a->coefficients, a->harmonics, a->workspace);
            srnf_sht_gradient(sht, 1, a->coefficients, a->d_theta, a->d_phi, a->workspace);
            a->coefficients[at] = 0.0;
            field_columns(a, l, q_theta, q_phi, a->columns + (at - 1) * 3 * a->n,
                          a->columns + (fields + at - 1) * 3 * a->n);
        }
    }
    rotation_columns(a, a->columns + 2 * fields * 3 * a->n);
}

/* matrix <- D' W D, its lower triangle, by as many rows of D at a time as take a few hundredths of
   a second. */
static int multiply_columns(const struct assembly *a, const struct srnf_context *context,
                            double *matrix)
{
    size_t rows = 3 * a->n, unknowns = a->unknowns;
    size_t step = ROWS_UNIT * (1 + PRODUCT_OPERATIONS / (ROWS_UNIT * unknowns * unknowns));
    size_t count;

    for (size_t first = 0; first < rows; first += count) {
        count = rows - first;
        count = count < step + ROWS_UNIT ? count : step;
        if (srnf_is_canceled(context)) {
            return SRNF_ECANCELED;
        }
        cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, (int)unknowns, (int)count, 1.0,
                    a->columns + first, (int)rows, first > 0 ? 1.0 : 0.0, matrix, (int)unknowns);
    }
    return SRNF_OK;
}

static void add_displacement(const struct assembly *a, double displacement, double *matrix)
{
    size_t fields = a->count - 1;

    for (size_t l = 1; l <= a->degree; l++) {
        for (size_t at = l * l; at < (l + 1) * (l + 1); at++) {
            size_t i = at - 1;

            matrix[i * a->unknowns + i] += displacement * (1.0 + 0.25 * (double)(l * (l + 1)));
            i += fields;
            matrix[i * a->unknowns + i] += displacement;
        }
    }
}

int registration_matrix(const struct moving *moving, size_t degree, double displacement,
                        double *matrix)
{
    struct assembly a = {.degree = degree,
                         .count = srnf_coefficient_count(degree),
                         .unknowns = registration_unknowns(degree)};
    struct srnf_sht *sht = NULL;
    double *memory = NULL;
    size_t rows = (3 * (moving->degree + 1) / 2 + degree) / 2 + 4;
    int status;

    if (moving->table) {
        status = tabulated_matrix(moving->table, degree, moving_context(moving), matrix);
        add_displacement(&a, displacement, matrix);
        return status;
    }
    rows = rows < ROWS_MIN ? ROWS_MIN : rows;
    status = srnf_sht_create(&sht, degree, SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows);
    if (status) {
        return status;
    }
    a.grid = srnf_sht_grid(sht);
    a.n = a.grid->n_theta * a.grid->n_phi;
    memory = srnf_alloc((13 + 3 * a.unknowns) * a.n + a.count, sizeof(double));
    a.workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 1));
    status = samples_create(&a.samples, a.n);
    if (status || !memory || !a.workspace) {
        status = SRNF_ENOMEM;
        goto out;
    }
    a.points = memory;
    a.weight = memory + 3 * a.n;
    a.harmonics = memory + 4 * a.n;
    a.d_theta = memory + 5 * a.n;
    a.d_phi = memory + 6 * a.n;
    a.columns = memory + 13 * a.n;
    a.coefficients = memory + (13 + 3 * a.unknowns) * a.n;
    registration_nodes(a.grid, a.points, a.weight);
    moving_evaluate(moving, a.points, &a.samples);
    fill_columns(&a, moving_context(moving), sht, memory + 7 * a.n, memory + 10 * a.n);
    status = multiply_columns(&a, moving_context(moving), matrix);
    add_displacement(&a, displacement, matrix);
out:
    srnf_free(memory);
    srnf_free(a.workspace);
    samples_clear(&a.samples);
    srnf_sht_destroy(sht);
    return status;
}

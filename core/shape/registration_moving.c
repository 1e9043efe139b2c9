/*
 * registration_moving.c - the SRNF of the moving surface and its derivative at arbitrary points.
 *
 * The three Cartesian components of grad f^c are themselves harmonic series, of degree L + 1. Their
 * values give the tangents f_1 = <grad f, t1>, f_2 = <grad f, t2>, and the tangential parts of
 * their gradients the covariant Hessian, both regular at the poles. Then n = f_1 x f_2, d_j n =
 * (d_j f_1) x f_2 + f_1 x (d_j f_2), and d_j q = (d_j n - <n~, d_j n> n~ / 2) / |n|^(1/2). Cost:
 * nine fields evaluated at each point.
 */
#include "registration.h"

#include <math.h>

int gradient_operator_create(struct gradient_operator *op, size_t degree)
{
    size_t points;
    int status;

    *op = (struct gradient_operator){.degree = degree};
    status =
        srnf_sht_create(&op->sht, degree + 1, SRNF_GRID_GAUSS_LEGENDRE, degree + 3, 2 * degree + 4);
    if (status) {
        return status;
    }
    points = srnf_sht_grid(op->sht)->n_theta * srnf_sht_grid(op->sht)->n_phi;
    op->scratch = srnf_alloc(5 * points + srnf_coefficient_count(degree + 1), sizeof(double));
    op->workspace = srnf_alloc(1, srnf_sht_workspace_size(op->sht, 3));
    if (!op->scratch || !op->workspace) {
        gradient_operator_clear(op);
        return SRNF_ENOMEM;
    }
    return SRNF_OK;
}

void gradient_operator_clear(struct gradient_operator *op)
{
    srnf_sht_destroy(op->sht);
    srnf_free(op->scratch);
    srnf_free(op->workspace);
    *op = (struct gradient_operator){0};
}

void gradient_operator_apply(const struct gradient_operator *op, size_t fields,
                             const double *coefficients, double *out)
{
    const struct srnf_grid *grid = srnf_sht_grid(op->sht);
    size_t points = grid->n_theta * grid->n_phi;
    size_t count = srnf_coefficient_count(op->degree);
    size_t count_out = srnf_coefficient_count(op->degree + 1);
    double *d_theta = op->scratch;
    double *d_phi = op->scratch + points;
    double *components = op->scratch + 2 * points;
    double *padded = op->scratch + 5 * points;

    for (size_t f = 0; f < fields; f++) {
        for (size_t i = 0; i < count_out; i++) {
            padded[i] = i < count ? coefficients[f * count + i] : 0.0;
        }
        srnf_sht_gradient(op->sht, 1, padded, d_theta, d_phi, op->workspace);
        for (size_t i = 0; i < points; i++) {
            size_t row = i / grid->n_phi;
            double phi = 2.0 * SRNF_PI * (double)(i % grid->n_phi) / (double)grid->n_phi;

            components[i] = grid->cos_theta[row] * cos(phi) * d_theta[i] - sin(phi) * d_phi[i];
            components[points + i] =
                grid->cos_theta[row] * sin(phi) * d_theta[i] + cos(phi) * d_phi[i];
            components[2 * points + i] = -grid->sin_theta[row] * d_theta[i];
        }
        srnf_sht_analysis(op->sht, 3, components, out + 3 * f * count_out, op->workspace);
    }
}

int moving_create(struct moving *moving, size_t from_degree, const double *coefficients,
                  size_t degree)
{
    struct gradient_operator op = {0};
    size_t from = srnf_coefficient_count(from_degree);
    size_t count;
    double *cut = NULL;
    int status;

    degree = degree < from_degree ? degree : from_degree;
    count = srnf_coefficient_count(degree);
    *moving = (struct moving){.degree = degree};
    status = gradient_operator_create(&op, degree);
    if (status) {
        return status;
    }
    moving->gradients = srnf_alloc(9 * srnf_coefficient_count(degree + 1), sizeof(double));
    cut = srnf_alloc(3 * count, sizeof(double));
    status = sphere_points_create(&moving->plan, degree + 1);
    if (status || !moving->gradients || !cut) {
        status = SRNF_ENOMEM;
        moving_clear(moving);
    } else {
        for (size_t c = 0; c < 3; c++) {
            shape_copy(count, coefficients + c * from, cut + c * count);
        }
        gradient_operator_apply(&op, 3, cut, moving->gradients);
    }
    srnf_free(cut);
    gradient_operator_clear(&op);
    return status;
}

void moving_clear(struct moving *moving)
{
    srnf_free(moving->gradients);
    sphere_points_clear(&moving->plan);
    moving->gradients = NULL;
}

int samples_create(struct samples *samples, size_t n)
{
    *samples = (struct samples){.n = n, .memory = srnf_alloc(51 * n, sizeof(double))};
    if (!samples->memory) {
        return SRNF_ENOMEM;
    }
    samples->q = samples->memory;
    samples->q_1 = samples->memory + 3 * n;
    samples->q_2 = samples->memory + 6 * n;
    samples->t1 = samples->memory + 9 * n;
    samples->t2 = samples->memory + 12 * n;
    samples->values = samples->memory + 15 * n;
    samples->gradients = samples->memory + 24 * n;
    return SRNF_OK;
}

void samples_clear(struct samples *samples)
{
    srnf_free(samples->memory);
    *samples = (struct samples){0};
}

/* An orthonormal pair with t1 x t2 = p: J. Frisvad's frame in the form of T. Duff et al. 2017. */
static void frame(const double *p, double *t1, double *t2)
{
    double sign = p[2] >= 0.0 ? 1.0 : -1.0;
    double a = -1.0 / (sign + p[2]);
    double b = p[0] * p[1] * a;

    t1[0] = 1.0 + sign * p[0] * p[0] * a;
    t1[1] = sign * b;
    t1[2] = -sign * p[0];
    t2[0] = b;
    t2[1] = sign + p[1] * p[1] * a;
    t2[2] = -p[1];
}

/* q and its derivatives from the gradient g[c][k] and its derivative m[c][k][j]. */
static void srnf_jet(double g[3][3], double m[3][3][3], struct samples *out, size_t i)
{
    const double *t[2] = {out->t1 + 3 * i, out->t2 + 3 * i};
    double *derivative[2] = {out->q_1 + 3 * i, out->q_2 + 3 * i};
    double f[2][3];    /* f_1, f_2 */
    double h[2][2][3]; /* covariant second derivatives */
    double n[3];
    double length;
    double root;

    for (size_t c = 0; c < 3; c++) {
        for (size_t a = 0; a < 2; a++) {
            f[a][c] = vector_dot(g[c], t[a]);
            for (size_t b = 0; b < 2; b++) {
                h[a][b][c] = t[a][0] * vector_dot(m[c][0], t[b]) +
                             t[a][1] * vector_dot(m[c][1], t[b]) +
                             t[a][2] * vector_dot(m[c][2], t[b]);
            }
        }
    }
    vector_cross(f[0], f[1], n);
    length = sqrt(vector_dot(n, n));
    root = sqrt(length);
    for (size_t k = 0; k < 3; k++) {
        out->q[3 * i + k] = length > 0.0 ? n[k] / root : 0.0;
    }
    for (size_t b = 0; b < 2; b++) {
        double first[3];
        double second[3];
        double along;

        vector_cross(h[0][b], f[1], first);
        vector_cross(f[0], h[1][b], second);
        for (size_t k = 0; k < 3; k++) {
            first[k] += second[k];
        }
        along = length > 0.0 ? 0.5 * vector_dot(first, n) / (length * length) : 0.0;
        for (size_t k = 0; k < 3; k++) {
            derivative[b][k] = length > 0.0 ? (first[k] - along * n[k]) / root : 0.0;
        }
    }
}

void moving_evaluate(const struct moving *moving, const double *points, struct samples *out)
{
    size_t n = out->n;

    sphere_points_evaluate(&moving->plan, 9, moving->gradients, n, points, out->values,
                           out->gradients);
    for (size_t i = 0; i < n; i++) {
        double g[3][3];
        double m[3][3][3];

        for (size_t c = 0; c < 3; c++) {
            for (size_t k = 0; k < 3; k++) {
                size_t at = (3 * c + k) * n + i;

                g[c][k] = out->values[at];
                for (size_t j = 0; j < 3; j++) {
                    m[c][k][j] = out->gradients[3 * at + j];
                }
            }
        }
        frame(points + 3 * i, out->t1 + 3 * i, out->t2 + 3 * i);
        srnf_jet(g, m, out, i);
    }
}

/*
 * exact.c - the last digits: surfaces that differ by a warp and a rotation alone.
 *
 * A left step gamma <- exp(w) o gamma resolves 1 / D on the moving surface, so where gamma
 * contracts
 * it is blind to what the template shows; right steps gamma <- gamma o exp(v) see it. Both
 * alternate
 * by rising degree. For a right step, with q = O sqrt(J) q2 o gamma on the template's grid,
 *   (q, exp v) = q + D_v q + ...,  D_v q = v . grad q + div v q / 2,  D_v q ~ D_v q1 near the end,
 * and since the action is isometric <q1 - q, D_v q1> = <q1 - q, D_v q>: the gradient is exact, the
 * matrix fixed. The points are then the chain replayed at exp(v)(s_i), the new link its first.
 *
 * Neither matrix is assembled: on a regular grid D and its transpose are two gradients and a
 * synthesis (as fast as three harmonic transforms), and Levenberg-Marquardt is solved by conjugate
 * gradients with the diagonal preconditioner
 *   m0 l (l + 1) / 4 + m1 / 2 for gradients, m1 / 2 for turned fields, 2 m0 / 3 for the values,
 * m0 and m1 the means of |q|^2 and |grad q|^2 over the sphere.
 */
#include "exact.h"

#include <math.h>
#include <string.h>

/* ---- D and its transpose --------------------------------------------------------------------- */

int tangent_create(struct tangent *t, size_t degree, size_t n_theta, size_t n_phi)
{
    const struct srnf_grid *grid;
    size_t count = srnf_coefficient_count(degree);
    int status = srnf_sht_create(&t->sht, degree, SRNF_GRID_GAUSS_LEGENDRE, n_theta, n_phi);

    if (status) {
        return status;
    }
    grid = srnf_sht_grid(t->sht);
    t->count = count;
    t->n = grid->n_theta * grid->n_phi;
    t->unknowns = 2 * count + 3;
    t->memory = srnf_alloc(21 * t->n + 5 * count + 2 * t->unknowns, sizeof(double));
    t->workspace = srnf_alloc(1, srnf_sht_workspace_size(t->sht, 2));
    if (!t->memory || !t->workspace) {
        tangent_clear(t);
        return SRNF_ENOMEM;
    }
    t->q = t->memory;
    t->q_theta = t->q + 3 * t->n;
    t->q_phi = t->q + 6 * t->n;
    t->weight = t->q + 9 * t->n;
    t->points = t->q + 10 * t->n;
    t->along = t->q + 13 * t->n;
    t->across = t->q + 15 * t->n;
    t->divergence = t->q + 17 * t->n;
    t->image = t->q + 18 * t->n;
    t->potentials = t->q + 21 * t->n;
    t->moments = t->potentials + 2 * count;
    t->preconditioner = t->moments + 3 * count;
    t->damping = t->preconditioner + t->unknowns;
    registration_nodes(grid, t->points, t->weight);
    return SRNF_OK;
}

void tangent_clear(struct tangent *t)
{
    srnf_sht_destroy(t->sht);
    srnf_free(t->memory);
    srnf_free(t->workspace);
    *t = (struct tangent){0};
}

void tangent_prepare(struct tangent *t, double norm2)
{
    size_t degree = srnf_sht_degree(t->sht);
    double m0 = 0.0;
    double m1 = 0.0;

    for (size_t i = 0; i < t->n; i++) {
        const double *q[3] = {t->q + 3 * i, t->q_theta + 3 * i, t->q_phi + 3 * i};

        m0 += t->weight[i] * vector_dot(q[0], q[0]);
        m1 += t->weight[i] * (vector_dot(q[1], q[1]) + vector_dot(q[2], q[2]));
    }
    m0 /= 4.0 * SRNF_PI * norm2;
    m1 /= 4.0 * SRNF_PI * norm2;
    t->norm2 = norm2;
    for (size_t l = 0; l <= degree; l++) {
        double eigen = (double)(l * (l + 1));

        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            t->preconditioner[i] = l > 0 ? 0.25 * eigen * m0 + 0.5 * m1 : 1.0;
            t->preconditioner[t->count + i] = l > 0 ? 0.5 * m1 : 1.0;
            t->damping[i] = t->damping[t->count + i] = 0.25 * eigen * m0;
        }
    }
    for (size_t k = 2 * t->count; k < t->unknowns; k++) {
        t->preconditioner[k] = 4.0 * SRNF_PI * m0 * 2.0 / 3.0;
        t->damping[k] = m0;
    }
}

/* x <- potentials of x, by 1 / sqrt(l (l + 1)); and the coefficients of the divergence. */
static void unpack(struct tangent *t, const double *x)
{
    for (size_t l = 0; l <= srnf_sht_degree(t->sht); l++) {
        double eigen = (double)(l * (l + 1));
        double scale = l > 0 ? 1.0 / sqrt(eigen) : 0.0;

        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            t->potentials[i] = scale * x[i];
            t->potentials[t->count + i] = scale * x[t->count + i];
            t->moments[i] = -eigen * t->potentials[i];
        }
    }
}

void tangent_apply(struct tangent *t, const double *x)
{
    const double *omega = x + 2 * t->count;

    unpack(t, x);
    srnf_sht_gradient(t->sht, 2, t->potentials, t->along, t->across, t->workspace);
    srnf_sht_synthesis(t->sht, 1, t->moments, t->divergence, t->workspace);
    for (size_t i = 0; i < t->n; i++) {
        const double *q = t->q + 3 * i;
        double along = t->along[i] - t->across[t->n + i];
        double across = t->across[i] + t->along[t->n + i];
        double turned[3];

        vector_cross(omega, q, turned);
        for (size_t k = 0; k < 3; k++) {
            t->image[3 * i + k] = along * t->q_theta[3 * i + k] + across * t->q_phi[3 * i + k] +
                                  0.5 * t->divergence[i] * q[k] + turned[k];
        }
    }
}

void tangent_transpose(struct tangent *t, double *out)
{
    double *torque = out + 2 * t->count;

    memset(torque, 0, 3 * sizeof *torque);
    for (size_t i = 0; i < t->n; i++) {
        const double *y = t->image + 3 * i;
        double weight = t->weight[i] / t->norm2;
        double along = weight * vector_dot(y, t->q_theta + 3 * i);
        double across = weight * vector_dot(y, t->q_phi + 3 * i);
        double turned[3];

        t->along[i] = along;
        t->across[i] = across;
        t->along[t->n + i] = across;
        t->across[t->n + i] = -along;
        t->divergence[i] = 0.5 * weight * vector_dot(y, t->q + 3 * i);
        vector_cross(t->q + 3 * i, y, turned);
        for (size_t k = 0; k < 3; k++) {
            torque[k] += weight * turned[k];
        }
    }
    srnf_sht_gradient_adjoint(t->sht, 2, t->along, t->across, t->moments, t->workspace);
    srnf_sht_synthesis_adjoint(t->sht, 1, t->divergence, t->moments + 2 * t->count, t->workspace);
    for (size_t l = 0; l <= srnf_sht_degree(t->sht); l++) {
        double eigen = (double)(l * (l + 1));
        double scale = l > 0 ? 1.0 / sqrt(eigen) : 0.0;

        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            out[i] = scale * (t->moments[i] - eigen * t->moments[2 * t->count + i]);
            out[t->count + i] = scale * t->moments[t->count + i];
        }
    }
}

/* ---- Conjugate gradients --------------------------------------------------------------------- */

double tangent_solve(struct tangent *t, const double *rhs, double lambda, double tolerance,
                     size_t cap, double *x, double *scratch)
{
    size_t n = t->unknowns;
    double *r = scratch;
    double *z = scratch + n;
    double *p = scratch + 2 * n;
    double *product = scratch + 3 * n;
    double rho = 0.0;
    double start;

    for (size_t i = 0; i < n; i++) {
        x[i] = 0.0;
        r[i] = rhs[i];
        z[i] = p[i] = r[i] / (t->preconditioner[i] + lambda * t->damping[i]);
        rho += r[i] * z[i];
    }
    start = rho;
    for (size_t step = 0;
         step < cap && rho > tolerance * tolerance * start && !srnf_is_canceled(t->context);
         step++) {
        double before = rho;
        double length;

        tangent_apply(t, p);
        tangent_transpose(t, product);
        for (size_t i = 0; i < n; i++) {
            product[i] += lambda * t->damping[i] * p[i];
        }
        length = rho / linear_dot(n, p, product);
        linear_axpy(n, length, p, x);
        linear_axpy(n, -length, product, r);
        rho = 0.0;
        for (size_t i = 0; i < n; i++) {
            z[i] = r[i] / (t->preconditioner[i] + lambda * t->damping[i]);
            rho += r[i] * z[i];
        }
        for (size_t i = 0; i < n; i++) {
            p[i] = z[i] + rho / before * p[i];
        }
    }
    return linear_dot(n, rhs, x);
}

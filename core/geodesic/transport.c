/*
 * transport.c - a velocity of SRNFs as the motion of a surface: parallel transport (the paper,
 * Algorithm 4).
 *
 * Carried along a straight line in the flat space of SRNFs, v is constant. What moves f by it is
 * the w that minimizes ||Q_*f(w) - v||, from the normal equations J' W J w = J' W v. Two surfaces
 * have different images of Q_*, which leaves a residual; it is what the transport between curved
 * subspaces of a flat space loses, not an error of the solver.
 *
 * Some 500 products of two transforms each at degree 15, 1,500 at degree 31.
 */
#include "geodesic.h"

#include <math.h>

#define TOLERANCE 1e-13 /* of the gradient, in the norm of the preconditioner */
#define CAP 4000

bool srnf_check_finite(size_t n, const double *values, const char *what, struct srnf_error *error)
{
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(values[i])) {
            (void)srnf_fail(error, SRNF_EINVAL, (int64_t)i, "a %s is not finite", what);
            return false;
        }
    }
    return true;
}

int srnf_velocity_toward(const struct srnf_sht *sht, const double *surface, const double *toward,
                         double *velocity)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t values = 3 * grid->n_theta * grid->n_phi;
    double *q = srnf_alloc(values, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    int status = SRNF_ENOMEM;

    if (q && workspace) {
        srnf_field(sht, surface, q, workspace);
        srnf_field(sht, toward, velocity, workspace);
        linear_axpy(values, -1.0, q, velocity);
        status = SRNF_OK;
    }
    srnf_free(workspace);
    srnf_free(q);
    return status;
}

int transport_pull_velocity(struct gauss_newton *system, const double *velocity, double tolerance,
                            const struct srnf_context *context, struct srnf_tangent *tangent)
{
    struct normal_equations conjugate = {.memory = NULL};
    double *b = srnf_alloc(system->count, sizeof(double));
    double *w = srnf_alloc(system->count, sizeof(double));
    double norm2 = pointwise_norm2(system->points, system->weight, velocity);
    int status = normal_equations_create(&conjugate, system);

    if (!b || !w || status) {
        status = SRNF_ENOMEM;
        goto out;
    }
    conjugate.context = context;
    gauss_newton_pull_back(system, velocity, b);
    status = normal_equations_solve(&conjugate, system, b, 0.0, tolerance, CAP, w);
    if (status) {
        goto out;
    }
    gauss_newton_differential(system, &system->state, w, system->field);
    linear_axpy(3 * system->points, -1.0, velocity, system->field);
    *tangent = (struct srnf_tangent){
        .coefficients = w,
        .norm = sqrt(norm2),
        .residual = sqrt(pointwise_norm2(system->points, system->weight, system->field)),
        .iterations = conjugate.iterations,
        .converged = conjugate.residual <= tolerance,
        .transforms = system->transforms};
    w = NULL;
out:
    normal_equations_destroy(&conjugate);
    srnf_free(w);
    srnf_free(b);
    return status;
}

int srnf_transport(const struct srnf_sht *sht, const double *surface, const double *velocity,
                   const struct srnf_context *context, struct srnf_tangent *tangent,
                   struct srnf_error *error)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct gauss_newton *system = NULL;
    int status;

    *tangent = (struct srnf_tangent){0};
    if (!srnf_check_finite(3 * srnf_coefficient_count(srnf_sht_degree(sht)), surface,
                           "coefficient of the surface", error) ||
        !srnf_check_finite(3 * grid->n_theta * grid->n_phi, velocity, "value of the velocity",
                           error)) {
        return SRNF_EINVAL;
    }
    status = gauss_newton_create(&system, sht, velocity);
    if (status == SRNF_OK) {
        (void)gauss_newton_try(system, surface);
        gauss_newton_accept(system);
        status = transport_pull_velocity(system, velocity, TOLERANCE, context, tangent);
    }
    if (status) {
        (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
    } else if (!tangent->converged) {
        status = SRNF_WNOT_CONVERGED;
    }
    gauss_newton_destroy(system);
    return status;
}

void srnf_tangent_clear(struct srnf_tangent *tangent)
{
    srnf_free(tangent->coefficients);
    *tangent = (struct srnf_tangent){0};
}

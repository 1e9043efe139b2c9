/*
 * spectral.c - inversion as a linear eigenproblem.
 *
 * With u = q / |q|, the tangents of any surface g whose normal is everywhere +-u satisfy <g_theta,
 * u> = <g_phi, u> = 0. So
 *
 *   T(g) = integral <g_theta, u>^2 + <g_phi / sin theta, u>^2  >= 0
 *
 * is a quadratic form that vanishes exactly on the surfaces of the given degree with those normals;
 * the wanted f and the translations are among them. Against M(g) = integral |grad g|^2 = sum l (l +
 * 1) |g_lm|^2 its eigenvalues lie in [0, 1]. If the null space is one-dimensional (translations
 * apart), Q(g) = q forces g = c f, and |Q| forces c = +-1: f is then the only surface of its degree
 * with this SRNF, up to sign and translation. The derivation, and why convex surfaces cannot be
 * certified, is in core/README.md.
 *
 * Here it is solved by LOBPCG without a matrix, two transforms a step; spectral_dense.c has the
 * matrix itself and the certificate.
 */
#include "spectral.h"

#include <math.h>

#define SPECTRAL_TARGET 1e-11 /* Levenberg-Marquardt takes over from there */
#define SPECTRAL_CAP 1600
#define SPECTRAL_CHANGE 1e-3

void normal_form_field(const struct gauss_newton *system, double *u)
{
    size_t n = system->points;

    for (size_t i = 0; i < n; i++) {
        const double *q = system->q + i;
        double length = sqrt(q[0] * q[0] + q[n] * q[n] + q[2 * n] * q[2 * n]);

        for (size_t c = 0; c < 3; c++) {
            u[c * n + i] = length > 0.0 ? q[c * n] / length : 0.0;
        }
    }
}

void normal_form_product(void *argument, const double *x, double *out)
{
    struct normal_form *form = argument;
    struct gauss_newton *s = form->system;

    srnf_sht_gradient(s->sht, 3, x, s->w_theta, s->w_phi, s->workspace);
    pointwise_normal_part(s->points, form->u, s->weight, s->w_theta, s->w_phi);
    srnf_sht_gradient_adjoint(s->sht, 3, s->w_theta, s->w_phi, out, s->workspace);
    s->transforms += 2.0;
}

double normal_form_quotient(struct normal_form *form, const double *x, const double *mass)
{
    struct gauss_newton *s = form->system;
    size_t n = s->points;
    double sum = 0.0;

    srnf_sht_gradient(s->sht, 3, x, s->w_theta, s->w_phi, s->workspace);
    s->transforms += 1.0;
    for (size_t i = 0; i < n; i++) {
        const double *u = form->u + i;
        const double *a = s->w_theta + i;
        const double *b = s->w_phi + i;
        double t = a[0] * u[0] + a[n] * u[n] + a[2 * n] * u[2 * n];
        double p = b[0] * u[0] + b[n] * u[n] + b[2 * n] * u[2 * n];

        sum += s->weight[i] * (t * t + p * p);
    }
    return sum / linear_dot_weighted(s->count, mass, x, x);
}

/* Q(c x) = c Q(x), so c = <|Q(x)|, |q|> / ||Q(x)||^2. */
void spectral_fit_scale(struct gauss_newton *system, double *x)
{
    struct gauss_newton_state *t = &system->trial;
    size_t n = system->points;
    double cross = 0.0;
    double square = 0.0;

    (void)gauss_newton_try(system, x);
    for (size_t i = 0; i < n; i++) {
        const double *q = system->q + i;
        double magnitude = sqrt(q[0] * q[0] + q[n] * q[n] + q[2 * n] * q[2 * n]);

        cross += system->weight[i] * t->root[i] * magnitude;
        square += system->weight[i] * t->root[i] * t->root[i];
    }
    linear_scale(system->count, square > 0.0 ? cross / square : 0.0, x);
}

int spectral_start(struct inversion_run *run, const double *start, double *f, double *mu)
{
    struct gauss_newton *system = run->system;
    size_t n = system->count;
    struct normal_form form = {system, srnf_alloc(3 * system->points, sizeof(double))};
    double *mass = srnf_alloc(2 * n, sizeof(double));
    struct linear_eigen problem = {0};
    double residual;
    int status = SRNF_ENOMEM;

    if (!form.u || !mass) {
        goto out;
    }
    normal_form_field(system, form.u);
    linear_diagonal(system->degree, 0.0, 1.0, mass);
    for (size_t i = 0; i < n; i++) {
        mass[n + i] = mass[i] > 0.0 ? 1.0 / mass[i] : 0.0;
    }
    problem = (struct linear_eigen){.n = n,
                                    .product = normal_form_product,
                                    .argument = &form,
                                    .mass = mass,
                                    .precondition = mass + n,
                                    .target = SPECTRAL_TARGET,
                                    .change = SPECTRAL_CHANGE,
                                    .cap = SPECTRAL_CAP,
                                    .context = run->context};
    linear_copy(n, start, f);
    status = linear_lobpcg(&problem, f, mu, &residual);
    if (status == SRNF_OK) {
        spectral_fit_scale(system, f);
    }
out:
    srnf_free(form.u);
    srnf_free(mass);
    return status;
}

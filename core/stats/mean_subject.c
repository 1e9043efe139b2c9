/*
 * mean_subject.c - one subject of a group mean: where its registration puts it.
 *
 * The state of a subject is its rotation O and the chain of its warp, which follows the centring
 * that all subjects have in common: gamma_i = warp_i o c. All else is replayed from them: the
 * points gamma(s) of the grid, their Jacobians J, and
 *
 *   q(s) = O sqrt(J(s)) Q(f)(gamma(s)),  Q(f) = n / |n|^(1/2),
 *
 * with n from the exact gradients of the harmonics of f at the points: with the tangential
 * gradients g_x, g_y, g_z of the coordinates at p, n = (<p, g_y x g_z>, <p, g_z x g_x>,
 * <p, g_x x g_y>). Nothing is resampled, so nothing is lost from one iteration to the next, and a
 * run that is resumed from its chains goes on with the same bits.
 *
 * The first registration is srnf_register's. Later ones only refine it, since the mean changes
 * little: a few steps at the highest degree, from the points at hand (search_refine), each of which
 * adds a link to the chain. Where the domain is not warped but only rotated, each is a new one.
 *
 * A replay costs one evaluation of f at P points and one of a field for each link of the chain, and
 * 72 P bytes while it lasts.
 */
#include "stats.h"
#include "shape/registration.h"

#include <math.h>
#include <string.h>

#define REFINE_STEPS 3

/* <p, a x b> */
static double triple(const double *p, const double *a, const double *b)
{
    return p[0] * (a[1] * b[2] - a[2] * b[1]) + p[1] * (a[2] * b[0] - a[0] * b[2]) +
           p[2] * (a[0] * b[1] - a[1] * b[0]);
}

/* out[c] = row c of O times x. */
static void rotate(const double rotation[9], const double x[3], double out[3])
{
    for (size_t c = 0; c < 3; c++) {
        out[c] = rotation[3 * c] * x[0] + rotation[3 * c + 1] * x[1] + rotation[3 * c + 2] * x[2];
    }
}

/* q at the points; gradients: [3][P][3]. */
static void field_at(const struct mean_run *run, size_t i, const double *gradients)
{
    size_t n = run->points;
    const double *gamma = run->gamma + 3 * i * n;
    const double *jacobian = run->jacobian + i * n;
    double *q = run->q + 3 * i * n;

    for (size_t k = 0; k < n; k++) {
        const double *p = gamma + 3 * k;
        const double *g[3] = {gradients + 3 * k, gradients + 3 * (n + k),
                              gradients + 3 * (2 * n + k)};
        double normal[3] = {triple(p, g[1], g[2]), triple(p, g[2], g[0]), triple(p, g[0], g[1])};
        double turned[3];
        double length2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        /* |n|^(1/2) = length2^(1/4) */
        double factor = length2 > 0.0 ? sqrt(jacobian[k] / sqrt(length2)) : 0.0;

        rotate(run->subjects[i].rotation, normal, turned);
        for (size_t c = 0; c < 3; c++) {
            q[c * n + k] = factor * turned[c];
        }
    }
}

int mean_replay(const struct mean_run *run, size_t i)
{
    size_t n = run->points;
    double *gamma = run->gamma + 3 * i * n;
    double *jacobian = run->jacobian + i * n;
    double *gradients = srnf_alloc(9 * n, sizeof(double));
    int status = SRNF_ENOMEM;

    if (!gradients) {
        goto out;
    }
    status = srnf_warp_apply(&run->subjects[i].warp, n, run->base, gamma, jacobian);
    if (status) {
        goto out;
    }
    for (size_t k = 0; k < n; k++) {
        jacobian[k] *= run->base_jacobian[k];
    }
    status = srnf_harmonics_at_points(srnf_sht_degree(run->sht), 3, run->surfaces[i], n, gamma,
                                      NULL, gradients);
    if (status) {
        goto out;
    }
    field_at(run, i, gradients);
out:
    srnf_free(gradients);
    return status;
}

/* From nothing. c is the identity, or nothing is warped and c stays it. */
static int register_anew(const struct mean_run *run, size_t i, const struct srnf_context *context,
                         struct srnf_error *error)
{
    struct mean_subject *subject = &run->subjects[i];
    struct srnf_registration found = {0};
    int status = srnf_register(run->sht, NULL, run->mean_q, run->surfaces[i], &run->registration,
                               NULL, context, &found, error);

    if (status < 0) {
        return status;
    }
    srnf_warp_clear(&subject->warp);
    subject->warp = found.warp;
    found.warp = (struct srnf_warp){0};
    memcpy(subject->rotation, found.rotation, sizeof subject->rotation);
    memcpy(run->gamma + 3 * i * run->points, found.points, 3 * run->points * sizeof(double));
    srnf_registration_clear(&found);
    return SRNF_OK;
}

/* From gamma, J and O as they are. */
static int refine(const struct mean_run *run, size_t i, const struct srnf_context *context)
{
    struct mean_subject *subject = &run->subjects[i];
    double *gamma = run->gamma + 3 * i * run->points;
    struct search search;
    struct warp warp;
    int status = search_create(&search, run->sht, run->mean_q, NULL, run->surfaces[i],
                               &run->registration, true, context);

    if (status) {
        return status;
    }
    status = warp_create(&warp, &search.full.target);
    if (status) {
        goto out;
    }
    memcpy(warp.points, gamma, 3 * run->points * sizeof(double));
    memcpy(warp.jacobian, run->jacobian + i * run->points, run->points * sizeof(double));
    memcpy(warp.rotation, subject->rotation, sizeof warp.rotation);
    srnf_warp_clear(&warp.chain);
    warp.chain = subject->warp;
    subject->warp = (struct srnf_warp){0};
    status = search_refine(&search, REFINE_STEPS, &warp);
    subject->warp = warp.chain;
    warp.chain = (struct srnf_warp){0};
    if (status == SRNF_OK) {
        memcpy(gamma, warp.points, 3 * run->points * sizeof(double));
        memcpy(subject->rotation, warp.rotation, sizeof subject->rotation);
    }
    warp_clear(&warp);
out:
    search_clear(&search);
    return status;
}

int mean_register(const struct mean_run *run, size_t i, const struct srnf_context *context,
                  struct srnf_error *error)
{
    bool anew = !run->started || !run->registration.reparameterization;

    return anew ? register_anew(run, i, context, error) : refine(run, i, context);
}

int mean_values(const struct mean_run *run, size_t i, double *values)
{
    size_t n = run->points;
    int status = srnf_harmonics_at_points(srnf_sht_degree(run->sht), 3, run->surfaces[i], n,
                                          run->registered ? run->gamma + 3 * i * n : run->nodes,
                                          values, NULL);

    for (size_t k = 0; k < n && status == SRNF_OK && run->registered; k++) {
        double x[3] = {values[k], values[n + k], values[2 * n + k]};
        double turned[3];

        rotate(run->subjects[i].rotation, x, turned);
        for (size_t c = 0; c < 3; c++) {
            values[c * n + k] = turned[c];
        }
    }
    return status;
}

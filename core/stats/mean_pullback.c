/*
 * mean_pullback.c - from the mean of SRNFs to the mean in the pulled-back metric.
 *
 * That mean warps nothing: its geodesics join surfaces as they are parameterized. So the surfaces
 * are registered to the surface of the mean SRNF first. What the new surface loses of the mean
 * SRNF, ||Q(f) - q||^2 / ||q||^2, takes the place of what the inversion of that lost.
 */
#include "stats.h"

#include <string.h>

/* Each in its own place. */
static int register_all(const struct srnf_sht *sht, size_t n, const double *target,
                        double *coefficients, const struct srnf_register_options *options,
                        const struct srnf_context *context, struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));

    for (size_t i = 0; i < n; i++) {
        struct srnf_registration registration;
        int status = srnf_register(sht, target, NULL, coefficients + i * count, options, NULL,
                                   context, &registration, error);

        if (status < 0) {
            return status;
        }
        memcpy(coefficients + i * count, registration.coefficients, count * sizeof(double));
        srnf_registration_clear(&registration);
    }
    return SRNF_OK;
}

/* The loss of the mean SRNF by being that of the surface. */
static int measure_loss(const struct srnf_sht *sht, struct srnf_mean *mean)
{
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));

    if (!workspace) {
        return SRNF_ENOMEM;
    }
    mean->relative_energy = srnf_energy(sht, mean->coefficients, mean->mean_q, NULL, workspace) /
                            srnf_inner_product(srnf_sht_grid(sht), mean->mean_q, mean->mean_q);
    srnf_free(workspace);
    return SRNF_OK;
}

int srnf_mean_pull_back(const struct srnf_sht *sht, size_t n, double *coefficients,
                        const struct srnf_register_options *registration,
                        const struct srnf_pullback_mean_options *options,
                        const struct srnf_context *context, struct srnf_mean *mean,
                        struct srnf_pullback_mean *pullback, struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    struct srnf_context quiet = srnf_quiet(context);
    const double **surfaces;
    int status = SRNF_OK, lost;

    *pullback = (struct srnf_pullback_mean){0};
    if (n == 0 || n != mean->n) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu surfaces, of a mean of %zu", n, mean->n);
    }
    surfaces = srnf_alloc(n, sizeof *surfaces);
    if (!surfaces) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "no memory for %zu surfaces", n);
    }
    for (size_t i = 0; i < n; i++) {
        surfaces[i] = coefficients + i * count;
    }
    if (registration) {
        status =
            register_all(sht, n, mean->coefficients, coefficients, registration, &quiet, error);
    }
    if (status == SRNF_OK) {
        status = srnf_pullback_mean(sht, n, surfaces, options, context, pullback, error);
    }
    if (status >= 0) {
        memcpy(mean->coefficients, pullback->coefficients, count * sizeof(double));
        memcpy(mean->distances, pullback->distances, n * sizeof(double));
        mean->converged = mean->converged && pullback->converged;
        lost = measure_loss(sht, mean);
        status = lost ? lost : status;
    }
    srnf_free(surfaces);
    return status;
}

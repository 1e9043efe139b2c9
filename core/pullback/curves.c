/*
 * curves.c - a geodesic of the pulled-back metric beside the curves of energy that geodesics of the
 * SRNF metric have, those of the closed form and of the linear blend.
 */
#include "pullback.h"

#include <string.h>

/* Squared distances of the surfaces of the path from the straight line in Q. */
static int measure_energies(const struct srnf_sht *sht, const struct srnf_context *context,
                            struct srnf_geodesic *geodesic)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t field = 3 * grid->n_theta * grid->n_phi;
    size_t count = 3 * srnf_coefficient_count(geodesic->degree);
    size_t last = geodesic->steps - 1;
    double *q = srnf_alloc(3 * field, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    int status = q && workspace ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        srnf_field(sht, geodesic->coefficients, q, workspace);
        srnf_field(sht, geodesic->coefficients + last * count, q + field, workspace);
    }
    for (size_t i = 0; i <= last && status == SRNF_OK; i++) {
        double t = geodesic->times[i];

        for (size_t k = 0; k < field; k++) {
            q[2 * field + k] = (1.0 - t) * q[k] + t * q[field + k];
        }
        geodesic->energy_geodesic[i] =
            srnf_energy(sht, geodesic->coefficients + i * count, q + 2 * field, NULL, workspace);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    }
    srnf_free(q);
    srnf_free(workspace);
    return status;
}

int srnf_pullback_curves(const struct srnf_sht *sht, const double *from, const double *to,
                         const struct srnf_pullback_options *options,
                         const struct srnf_context *context, struct srnf_geodesic *curves,
                         struct srnf_pullback_geodesic *result, struct srnf_error *error)
{
    struct srnf_pullback_options defaults = srnf_pullback_options_defaults();
    struct srnf_geodesic_options line = {.method = SRNF_GEODESIC_LINEAR};
    struct srnf_context quiet = {0};
    int status, measured;

    options = options ? options : &defaults;
    line.steps = options->segments + 1;
    if (context) {
        quiet = *context;
        quiet.progress = NULL;
    }
    *result = (struct srnf_pullback_geodesic){0};
    status = srnf_geodesic(sht, from, to, &line, &quiet, curves, error);
    if (status >= 0) {
        status = srnf_pullback_geodesic(sht, from, to, options, context, result, error);
    }
    if (status >= 0) {
        memcpy(curves->coefficients, result->coefficients,
               curves->steps * 3 * srnf_coefficient_count(curves->degree) * sizeof(double));
        curves->length = result->path.length;
        curves->transforms += result->transforms;
        measured = measure_energies(sht, &quiet, curves);
        status = measured ? srnf_fail(error, measured, -1, "%s", srnf_strerror(measured)) : status;
    }
    if (status < 0) {
        srnf_geodesic_clear(curves);
        srnf_pullback_geodesic_clear(result);
    }
    return status;
}

/*
 * place.c - surfaces of other degrees, places and measures: what is done to the coefficients of a
 * surface around every computation.
 */
#include "internal.h"

#include <math.h>
#include <string.h>

void srnf_surface_change_degree(size_t from, const double *coefficients, size_t to, double *out)
{
    size_t source = srnf_coefficient_count(from);
    size_t target = srnf_coefficient_count(to);
    size_t common = source < target ? source : target;

    memset(out, 0, 3 * target * sizeof(double));
    for (size_t k = 0; k < 3; k++) {
        memcpy(out + k * target, coefficients + k * source, common * sizeof(double));
    }
}

void srnf_surface_move(size_t degree, double *coefficients, struct srnf_surface_measures *measures,
                       const double target[3])
{
    size_t n = srnf_coefficient_count(degree);

    for (size_t k = 0; k < 3; k++) {
        coefficients[k * n] += SRNF_SQRT_4_PI * (target[k] - measures->centroid[k]);
        measures->centroid[k] = target[k];
    }
}

int srnf_surfaces_measure(const struct srnf_sht *sht, size_t n, const double *coefficients,
                          const struct srnf_context *context,
                          struct srnf_surface_measures *measures)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    void *workspace = srnf_alloc(srnf_surface_workspace_size(sht), 1);
    int status = workspace ? SRNF_OK : SRNF_ENOMEM;

    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        if (srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
        } else {
            srnf_surface_measure(sht, coefficients + i * count, &measures[i], workspace);
        }
    }
    srnf_free(workspace);
    return status;
}

double srnf_surface_error(size_t degree, const double *truth,
                          const struct srnf_surface_measures *measures, const double *coefficients)
{
    size_t n = srnf_coefficient_count(degree);
    double sign = measures->volume < 0.0 ? -1.0 : 1.0;
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        for (size_t i = 1; i < n; i++) {
            double d = coefficients[k * n + i] - sign * truth[k * n + i];

            sum += d * d;
        }
    }
    return sqrt(sum / measures->area);
}

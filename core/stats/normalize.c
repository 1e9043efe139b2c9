/*
 * normalize.c - a surface with its area centroid at the origin and unit area.
 */
#include "internal.h"

#include <math.h>

int srnf_normalize(const struct srnf_sht *sht, const double *coefficients, double *normalized,
                   double *log_scale)
{
    size_t each = srnf_coefficient_count(srnf_sht_degree(sht));
    struct srnf_surface_measures measures;
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    double length;

    if (!workspace) {
        return SRNF_ENOMEM;
    }
    srnf_surface_measure(sht, coefficients, &measures, workspace);
    srnf_free(workspace);
    length = sqrt(measures.area);
    if (!(length > 0.0) || !isfinite(length)) {
        return SRNF_EDEGENERATE;
    }
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < each; i++) {
            /* A constant x is the coefficient x sqrt(4 pi) of Y_00. */
            double origin = i == 0 ? measures.centroid[c] * sqrt(4.0 * SRNF_PI) : 0.0;

            normalized[c * each + i] = (coefficients[c * each + i] - origin) / length;
        }
    }
    if (log_scale) {
        *log_scale = log(length);
    }
    return SRNF_OK;
}

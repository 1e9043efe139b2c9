/*
 * path.c - where the surfaces of a geodesic lie in space, and the norms on its straight line.
 */
#include "internal.h"

void srnf_geodesic_place(struct srnf_geodesic *geodesic, struct srnf_surface_measures *measures)
{
    size_t count = 3 * srnf_coefficient_count(geodesic->degree);
    size_t last = geodesic->steps - 1;

    for (size_t i = 1; i < last; i++) {
        double t = geodesic->times[i];
        double target[3];

        for (size_t k = 0; k < 3; k++) {
            target[k] = (1.0 - t) * measures[0].centroid[k] + t * measures[last].centroid[k];
        }
        srnf_surface_move(geodesic->degree, geodesic->coefficients + i * count, &measures[i],
                          target);
    }
}

void srnf_geodesic_squared_norms(const struct srnf_geodesic *geodesic, double area_from,
                                 double area_to, double *squared_norms)
{
    double inner = 0.5 * (area_from + area_to - geodesic->distance * geodesic->distance);

    for (size_t i = 0; i < geodesic->steps; i++) {
        double t = geodesic->times[i];
        double s = 1.0 - t;

        squared_norms[i] = s * s * area_from + t * t * area_to + 2.0 * s * t * inner;
    }
}

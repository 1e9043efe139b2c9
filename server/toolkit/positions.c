/*
 * positions.c - see positions.h.
 */
#include "toolkit/positions.h"

#include <math.h>
#include <stdio.h>

#define UNTURNED 1e-9 /* of the entries of a rotation from those of the identity */
#define CENTRED 1e-9  /* centroid over length: what was centred has none but for rounding */

static bool is_turned(const double rotation[9])
{
    for (size_t k = 0; k < 9; k++) {
        if (!(fabs(rotation[k] - (k % 4 == 0 ? 1.0 : 0.0)) < UNTURNED)) {
            return true;
        }
    }
    return false;
}

/* Origin, and as far from it as the surface's centroid is, which was posted as it is. length: the
   root of its area as stored. */
static void find_centroid(const struct surface_place *place, double length, double x[3])
{
    const double *c = place->centroid;
    bool centred = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) <= CENTRED * length;

    for (size_t k = 0; k < 3; k++) {
        x[k] = centred ? place->origin[k] : place->origin[k] + place->scale * c[k];
    }
}

/* Where a part is, and its area in the units of its coordinates. */
static int place(struct jobs_run *run, const struct srnf_sht *sht,
                 const struct compute_surface *surface, const double *numbers, double *normalized,
                 double x[3], double *area, struct jobs_result *result)
{
    const struct surface_place place = process_place(run, surface);
    struct srnf_error error = {.element = -1};
    double log_length;
    int status;

    if (!place.known || is_turned(place.rotation)) {
        (void)snprintf(error.message, sizeof error.message, "%s %s", surface->id,
                       place.known ? "was turned: relative positions take surfaces as they came"
                                   : "has no place: relative positions take meshes, surfaces "
                                     "that encode made of them, or posted ones");
        return compute_fail(result, SRNF_EINVAL, &error, "placing the parts");
    }
    status = srnf_normalize(sht, numbers, normalized, &log_length);
    if (status) {
        return compute_fail(result, status, NULL, "measuring the parts");
    }
    find_centroid(&place, exp(log_length), x);
    if (surface->mirrored != process_reflected(run, surface->id, &place)) {
        x[0] = 0.0 - x[0];
    }
    *area = place.scale * place.scale * exp(2.0 * log_length);
    return 0;
}

int positions_find(struct jobs_run *run, const struct srnf_sht *sht, size_t n,
                   const struct compute_surface *surfaces, const double *const *numbers,
                   double *positions, struct jobs_result *result)
{
    double *normalized =
        srnf_alloc(srnf_coefficient_count(srnf_sht_degree(sht)), 3 * sizeof(double));
    double middle[3] = {0.0, 0.0, 0.0}, total = 0.0;
    int status = normalized ? 0 : compute_fail(result, SRNF_ENOMEM, NULL, "placing the parts");

    for (size_t p = 0; p < n && status == 0; p++) {
        double *x = positions + 3 * p, area = 0.0;

        status = place(run, sht, &surfaces[p], numbers[p], normalized, x, &area, result);
        total += area;
        for (size_t c = 0; c < 3; c++) {
            middle[c] += x[c] / (double)n;
        }
    }
    for (size_t k = 0; k < 3 * n && status == 0; k++) {
        positions[k] = (positions[k] - middle[k % 3]) / sqrt(total);
    }
    srnf_free(normalized);
    return status;
}

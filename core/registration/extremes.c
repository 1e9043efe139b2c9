/*
 * extremes.c - the least and the largest Jacobian of a warp, between the nodes too.
 *
 * The nodes of the search's grid with the lowest and the highest J are known. About each of a few
 * of them that are apart, the chain is followed from the eight points around it at half the
 * distance of two rows; the rest of the sphere lies further from the extremes than J varies between
 * nodes that resolve the fields (search_create.c).
 */
#include "registration.h"

#include <math.h>
#include <string.h>

#define PLACES ((size_t)4) /* of each kind */
#define AROUND ((size_t)8)

/* Up to PLACES nodes with the least sign * J, at least `apart` (cosine) from each other. */
static size_t pick(const struct target *t, const double *jacobian, double sign, double apart,
                   size_t places[PLACES])
{
    size_t count = 0;

    while (count < PLACES) {
        size_t best = t->n;

        for (size_t i = 0; i < t->n; i++) {
            bool taken = best < t->n && !(sign * jacobian[i] < sign * jacobian[best]);

            for (size_t k = 0; k < count && !taken; k++) {
                taken = vector_dot(t->points + 3 * i, t->points + 3 * places[k]) > apart;
            }
            best = taken ? best : i;
        }
        if (best == t->n) {
            break;
        }
        places[count++] = best;
    }
    return count;
}

/* Eight points at an angle around p. */
static void surround(const double *p, double angle, double *out)
{
    size_t least = fabs(p[0]) < fabs(p[1]) ? (fabs(p[0]) < fabs(p[2]) ? 0 : 2)
                                           : (fabs(p[1]) < fabs(p[2]) ? 1 : 2);
    double axis[3] = {least == 0, least == 1, least == 2};
    double u[3], v[3];
    double norm;

    vector_cross(p, axis, u);
    norm = sqrt(vector_dot(u, u));
    for (size_t k = 0; k < 3; k++) {
        u[k] /= norm;
    }
    vector_cross(p, u, v);
    for (size_t i = 0; i < AROUND; i++) {
        double turn = 2.0 * SRNF_PI * (double)i / (double)AROUND;

        for (size_t k = 0; k < 3; k++) {
            out[3 * i + k] = cos(angle) * p[k] + sin(angle) * (cos(turn) * u[k] + sin(turn) * v[k]);
        }
    }
}

/* A J that is no number stays: nothing may tell of such a warp that it does not fold. */
static void widen(double j, struct search_result *result)
{
    bool above = isnan(result->min_jacobian) || result->min_jacobian <= j;
    bool below = isnan(result->max_jacobian) || result->max_jacobian >= j;

    result->min_jacobian = above ? result->min_jacobian : j;
    result->max_jacobian = below ? result->max_jacobian : j;
}

int search_extremes(const struct search *s, struct search_result *result)
{
    const struct target *t = &s->full.target;
    const double *jacobian = result->warp.jacobian;
    double spacing = SRNF_PI / sqrt(0.5 * (double)t->n);
    double points[4 * 2 * PLACES * AROUND];
    size_t n = 0;
    int status;

    result->min_jacobian = INFINITY;
    result->max_jacobian = 0.0;
    for (size_t i = 0; i < t->n; i++) {
        widen(jacobian[i], result);
    }
    for (int side = 0; side < 2; side++) {
        size_t places[PLACES];
        size_t count = pick(t, jacobian, side ? -1.0 : 1.0, cos(1.5 * spacing), places);

        for (size_t k = 0; k < count; k++, n += AROUND) {
            surround(t->points + 3 * places[k], 0.5 * spacing, points + 3 * n);
        }
    }
    status = warp_apply(&result->warp.chain, s->context, n, points, points,
                        points + 3 * 2 * PLACES * AROUND);
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        widen(points[3 * 2 * PLACES * AROUND + i], result);
    }
    return status;
}

/*
 * insert.c - the last collapse undone: v returns to its ring and gets its place on the
 * sphere.
 *
 * The triangles of u that come back to v form a polygon around v's place with u on its rim. Any
 * point close enough to u inside the wedge of that polygon at u sees the whole rim, so a place
 * always exists. Tried are the points u + t (centroid of the ring - u), t = 1, 0.4, 0.16, ..., and
 * points along the bisector of the wedge, from 0.7 of the shortest spoke on and halved until one is
 * inside; the one with the least energy is taken. Then Newton steps: four of v, one of each
 * neighbour, one more of v.
 */
#include "sphere_map.h"

#include <string.h>

#define SHRINK 0.4
#define CENTROID_TRIES 8
#define SPOKE_SHARE 0.7
#define WEDGE_TRIES 60 /* halvings: down to rounding */
#define STEPS_SELF 4
#define VALENCE_SETTLE ((uint32_t)64) /* neighbours above this wait for the next sweep */

static const double *point(const struct spherical *s, uint32_t v)
{
    return s->points + 3 * (size_t)v;
}

/* The triangle metric's area, unscaled. */
static double area_of(const struct spherical *s, uint32_t a, uint32_t b, uint32_t c)
{
    struct triangle_metric metric;

    spherical_metric(s, s->positions + 3 * (size_t)a, s->positions + 3 * (size_t)b,
                     s->positions + 3 * (size_t)c, &metric);
    return metric.area;
}

/* Undoes the topology of a collapse: rings of v and its neighbours. ring: from u on. */
static int restore(struct spherical *s, uint32_t v, const uint32_t *ring, uint32_t count)
{
    uint32_t u = ring[0];

    if (count > 3) {
        /* u gives its neighbours between the two common ones back. */
        spherical_ring_replace(s, &s->rings[u], ring[2], v);
        for (uint32_t i = 3; i + 1 < count; i++) {
            spherical_ring_remove(s, &s->rings[u], ring[i]);
        }
    } else if (spherical_ring_insert(s, &s->rings[u], ring[1], true, v)) {
        return SRNF_ENOMEM;
    }
    for (uint32_t i = 2; i + 1 < count; i++) {
        spherical_ring_replace(s, &s->rings[ring[i]], u, v);
    }
    /* Seen from the common neighbours, v comes just before u on one side and just after it on the
       other. */
    if (spherical_ring_insert(s, &s->rings[ring[1]], u, false, v) ||
        spherical_ring_insert(s, &s->rings[ring[count - 1]], u, true, v)) {
        return SRNF_ENOMEM;
    }
    return SRNF_OK;
}

static void restore_vertex(struct spherical *s, uint32_t v, const uint32_t *ring, uint32_t count)
{
    struct ring *own = &s->rings[v];

    /* v's ring still has its place and its content: nothing wrote to it while v was away. */
    memcpy(own->at, ring, count * sizeof *ring);
    own->count = count;
    s->present[v] = true;
    s->n_present++;
    for (uint32_t i = 0; i < count; i++) {
        s->total_area += area_of(s, v, ring[i], ring[i + 1 < count ? i + 1 : 0]);
    }
    for (uint32_t i = 1; i + 1 < count; i++) {
        s->total_area -= area_of(s, ring[0], ring[i], ring[i + 1]);
    }
}

static bool normalize(double p[3])
{
    double length = vector_norm(p);

    if (!(length > 0.0)) {
        return false;
    }
    for (size_t k = 0; k < 3; k++) {
        p[k] /= length;
    }
    return true;
}

static void try_point(const struct spherical *s, uint32_t v, const double *candidate, double *best,
                      double *place)
{
    double p[3] = {candidate[0], candidate[1], candidate[2]};
    double energy;

    if (!normalize(p)) {
        return;
    }
    energy = spherical_star_energy(s, v, p);
    if (energy < *best) {
        *best = energy;
        memcpy(place, p, sizeof p);
    }
}

/* Bisector of the wedge at u between ring[1] and ring[count - 1], inside the polygon; and its
   shortest spoke. */
static double wedge(const struct spherical *s, const uint32_t *ring, uint32_t count,
                    double bisector[3])
{
    const double *u = point(s, ring[0]);
    double sides[2][3];
    double along;
    double across[3];
    double spoke = INFINITY;
    double angle;
    double tangent[3];

    for (size_t k = 0; k < 2; k++) {
        double lean;

        vector_subtract(point(s, k == 0 ? ring[1] : ring[count - 1]), u, sides[k]);
        spoke = smaller(spoke, vector_norm(sides[k]));
        lean = vector_dot(sides[k], u);
        for (size_t j = 0; j < 3; j++) {
            sides[k][j] -= lean * u[j];
        }
        (void)normalize(sides[k]);
    }
    /* The polygon lies counter-clockwise from the first side to the second. */
    vector_cross(u, sides[0], across);
    along = vector_dot(sides[0], sides[1]);
    angle = atan2(vector_dot(across, sides[1]), along);
    angle = angle <= 0.0 ? angle + 2.0 * SRNF_PI : angle;
    for (size_t j = 0; j < 3; j++) {
        tangent[j] = cos(0.5 * angle) * sides[0][j] + sin(0.5 * angle) * across[j];
    }
    memcpy(bisector, tangent, sizeof tangent);
    return spoke;
}

static int place_vertex(struct spherical *s, uint32_t v, const uint32_t *ring, uint32_t count)
{
    const double *u = point(s, ring[0]);
    double *place = s->points + 3 * (size_t)v;
    double best = INFINITY;
    double centroid[3] = {0.0, 0.0, 0.0};
    double bisector[3];
    double candidate[3];
    double step = 1.0;

    for (uint32_t i = 0; i < count; i++) {
        for (size_t k = 0; k < 3; k++) {
            centroid[k] += point(s, ring[i])[k] / (double)count;
        }
    }
    for (int t = 0; t < CENTROID_TRIES; t++, step *= SHRINK) {
        for (size_t k = 0; k < 3; k++) {
            candidate[k] = u[k] + step * (centroid[k] - u[k]);
        }
        try_point(s, v, candidate, &best, place);
    }
    step = SPOKE_SHARE * wedge(s, ring, count, bisector);
    for (int t = 0; t < WEDGE_TRIES; t++, step *= 0.5) {
        double before = best;

        for (size_t k = 0; k < 3; k++) {
            candidate[k] = u[k] + step * bisector[k];
        }
        try_point(s, v, candidate, &best, place);
        if (isfinite(best) && !(best < before)) {
            break;
        }
    }
    return isfinite(best) ? SRNF_OK : SRNF_ENUMERIC;
}

static int settle(struct spherical *s, uint32_t v)
{
    const struct ring *ring = &s->rings[v];

    for (int k = 0; k < STEPS_SELF; k++) {
        if (!(spherical_star_step(s, v) > 0.0)) {
            break;
        }
    }
    for (uint32_t i = 0; i < ring->count; i++) {
        /* A hub is in the ring of every vertex around it: stepping it each time would cost the
           square of its valence. */
        if (s->rings[ring->at[i]].count > VALENCE_SETTLE) {
            continue;
        }
        if (spherical_star_load(s, ring->at[i])) {
            return SRNF_ENOMEM;
        }
        (void)spherical_star_step(s, ring->at[i]);
    }
    if (spherical_star_load(s, v)) {
        return SRNF_ENOMEM;
    }
    (void)spherical_star_step(s, v);
    return SRNF_OK;
}

int spherical_insert(struct spherical *s)
{
    uint32_t v = s->record[s->record_size - 1];
    uint32_t count = s->record[s->record_size - 2];
    const uint32_t *ring = s->record + s->record_size - 2 - count;
    int status = restore(s, v, ring, count);

    if (status) {
        return status;
    }
    restore_vertex(s, v, ring, count);
    s->record_size -= (size_t)count + 2;
    status = spherical_star_load(s, v);
    if (status == SRNF_OK) {
        status = place_vertex(s, v, ring, count);
    }
    return status == SRNF_OK ? settle(s, v) : status;
}

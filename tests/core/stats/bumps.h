/*
 * bumps.h - ellipsoids of three different axes with bumps: the same way round but for these. For
 * the tests of means of nearly symmetric surfaces.
 */
#ifndef TESTS_STATS_BUMPS_H
#define TESTS_STATS_BUMPS_H

#include "group.h"

#define BUMPS_MAX ((size_t)6)

struct bumps {
    double centre[BUMPS_MAX][3], height[BUMPS_MAX]; /* of the radius; 0: none */
};

/* The one that is made, and its turn, which formulas of surfaces see. */
static struct {
    struct bumps bumps;
    double turn[9];
} bumps_made;

static inline void bumps_formula(const double e[3], double parameter, double x[3])
{
    static const double axes[3] = {14.0, 9.0, 7.0};
    double u[3], square = 0.0, factor = 1.0;

    (void)parameter;
    for (size_t c = 0; c < 3; c++) {
        u[c] = figure_dot(3, bumps_made.turn + 3 * c, e);
        square += u[c] * u[c] / (axes[c] * axes[c]);
    }
    for (size_t k = 0; k < BUMPS_MAX; k++) {
        const double *centre = bumps_made.bumps.centre[k];

        factor += bumps_made.bumps.height[k] * exp(7.0 * (figure_dot(3, u, centre) - 1.0));
    }
    for (size_t c = 0; c < 3; c++) {
        x[c] = factor / sqrt(square) * u[c];
    }
}

/* Bump k anywhere, of a normal height. */
static inline void bumps_draw(struct bumps *bumps, size_t k, double height,
                              struct test_random *random)
{
    test_random_direction(random, bumps->centre[k]);
    bumps->height[k] = height * test_random_normal(random);
}

/* Makes surface i of the group, turned on the sphere and in space. */
static inline void bumps_make(struct group *g, size_t i, const struct bumps *bumps,
                              struct test_random *random)
{
    struct shapes_surface own;
    double rotation[9];

    shapes_open(&own, g->degree);
    bumps_made.bumps = *bumps;
    shapes_random_rotation(random, bumps_made.turn);
    shapes_fill(&own, bumps_formula, 0.0);
    memcpy(g->f[i], own.f, g->count * sizeof(double));
    shapes_random_rotation(random, rotation);
    shapes_rotate(rotation, g->each, g->f[i]);
    shapes_close(&own);
}

#endif

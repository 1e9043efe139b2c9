/*
 * picture.h - a surface as a picture: orthographic, lit from the viewer, coloured by a scalar.
 */
#ifndef TESTS_PAPER_PICTURE_H
#define TESTS_PAPER_PICTURE_H

#include "srnf.h"

struct picture_view {
    double rotation[9]; /* rows: right, up, towards the viewer */
    double reach;       /* half the side of the picture, in the surface's unit */
};

/* A view that is the same for surfaces near this one: along its principal axes of inertia, seen
   from the side of the smallest, with a margin. */
struct picture_view picture_view_of(size_t degree, const double *coefficients);

/* The reach that a view needs for all of a surface, with the same margin. */
double picture_reach(size_t degree, const double *coefficients);

struct picture {
    unsigned char *png;
    size_t size;
};

/*
 * Draws a surface of a degree, moved to its centroid.
 *   reference  colours are the distance to the point of this surface with the same parameter, from
 *              0 (dark) to `highest` (bright); NULL: one colour
 */
struct picture picture_draw(size_t degree, const double *coefficients,
                            const struct picture_view *view, const double *reference,
                            double highest);
/* The same, coloured by a field on a grid, from 0 (dark) to `highest` (bright).
 *   values  double[n_theta][n_phi] */
struct picture picture_draw_field(size_t degree, const double *coefficients,
                                  const struct picture_view *view, const struct srnf_grid *grid,
                                  const double *values, double highest);
void picture_clear(struct picture *picture);

/* Largest distance to the reference: what `highest` may be. */
double picture_largest(size_t degree, const double *coefficients, const double *reference);

#endif

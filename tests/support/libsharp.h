/*
 * libsharp.h - libsharp on our grids and our coefficients: the independent oracle of the tests and
 * the yardstick of the benchmark.
 *
 * The two bases. Ours is real and orthonormal: with N P_lm the normalized function without
 * Condon-Shortley sign,
 *
 *   f = sum_l c_l0 N P_l0 + sum_m>0 sqrt(2) N P_lm (c_lm cos(m phi) + c_l,-m sin(m phi)).
 *
 * libsharp's is complex, with the sign: Y_lm = (-1)^m N P_lm exp(i m phi), and a real field has
 *
 *   f = sum_l a_l0 Y_l0 + 2 Re sum_m>0 a_lm Y_lm.
 *
 * Since Re((c - i s)(cos + i sin)) = c cos + s sin,
 *
 *   a_l0 = c_l0,   a_lm = (-1)^m (c_lm - i c_l,-m) / sqrt(2).
 *
 * For the adjoints the factor is inverse: where libsharp returns sum_nodes conj(Y_lm) values, ours
 * is c_lm = sqrt(2) (-1)^m Re, c_l,-m = -sqrt(2) (-1)^m Im. The derivatives are d/dtheta and
 * (1 / sin) d/dphi in both.
 */
#ifndef TESTS_LIBSHARP_H
#define TESTS_LIBSHARP_H

#include <libsharp/sharp.h>

#include "srnf.h"

/* libsharp's description of one grid and one degree, and room for its coefficients. */
struct libsharp {
    sharp_geom_info *geometry;
    sharp_alm_info *layout;
    size_t degree;
    double *a; /* (re, im) of a_lm, order by order */
};

/* weighted: jobs from fields to coefficients use the weights of the grid. Ends the program when out
   of memory. */
void libsharp_open(struct libsharp *sharp, size_t degree, const struct srnf_grid *grid,
                   bool weighted);
void libsharp_close(struct libsharp *sharp);

/* Our coefficients into sharp->a, and back from the sums of a job from fields to coefficients. */
void libsharp_from_coefficients(struct libsharp *sharp, const double *c);
void libsharp_to_coefficients(const struct libsharp *sharp, double *c);

/* One job in double precision on one thread. second is used by SHARP_ALM2MAP_DERIV1 only. */
void libsharp_run(const struct libsharp *sharp, sharp_jobtype job, double *first, double *second);

#endif

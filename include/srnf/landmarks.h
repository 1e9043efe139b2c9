/*
 * landmarks.h - registration that is guided by points which correspond (core/registration), and the
 * points of a surface that are nearest to given ones (core/surface).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_LANDMARKS_H
#define SRNF_PUBLIC_LANDMARKS_H

#include "srnf/register.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

#define SRNF_LANDMARKS_MAX ((size_t)64)
/* Landmarks of one surface must be so far apart, in radians on the sphere. */
#define SRNF_LANDMARKS_APART 1e-3

/* Points that correspond, as points of the spheres under the two surfaces. */
struct srnf_landmarks {
    size_t n;             /* 1 .. SRNF_LANDMARKS_MAX */
    const double *fixed;  /* [n][3] unit vectors, on the sphere of the template */
    const double *moving; /* [n][3] on that of the moving surface: gamma takes fixed to moving */
    double weight; /* above 0: of the mean squared angle, in radians, between gamma(fixed) and
                             moving, in the objective; INFINITY: gamma meets them exactly */
};

/* Points that correspond in all surfaces of a group, for srnf_mean_options. */
struct srnf_group_landmarks {
    size_t n;       /* 1 .. SRNF_LANDMARKS_MAX */
    size_t guiding; /* 0 .. n: the first ones guide the warps, the others are held out: measured,
                       and nothing more */
    const double *points; /* [surfaces][n][3] unit vectors, on the sphere of each surface */
    double weight;        /* as of srnf_landmarks; of no meaning where none guide */
};

/*
 * srnf_register, guided by landmarks: the objective gets the term weight (1/n) sum_j angle(gamma
 * (fixed_j), moving_j)^2, or its warps meet all landmarks (core/registration/landmarks.h). The
 * search starts from the rotation that brings the landmarks nearest as well as from where
 * srnf_register starts, unless that is the identity; the lower objective counts.
 *   landmarks  [in] NULL: srnf_register. Each at least SRNF_LANDMARKS_APART from the others of its
 *              surface, and no more than half of (degree + 1)^2 - 1
 * All other arguments are those of srnf_register. exact of the options and landmarks exclude each
 * other, and reparameterization must be set.
 * Errors: as srnf_register; SRNF_EINVAL with the landmark as element; SRNF_EUNMATCHED: landmarks
 * that are to be met exactly were not met by any warp that keeps orientation and stretches or
 * shrinks no area by more than a thousand; element is the one that was farthest off.
 */
SRNF_CHECKED int srnf_register_landmarks(const struct srnf_sht *sht, const double *template_surface,
                                         const double *template_q, const double *moving,
                                         const struct srnf_register_options *options,
                                         const struct srnf_landmarks *landmarks,
                                         const struct srnf_registration *warm,
                                         const struct srnf_context *context,
                                         struct srnf_registration *registration,
                                         struct srnf_error *error);

/*
 * srnf_register_to_field, guided by landmarks, whose fixed points are those of the field. NULL:
 * without. Errors: those of both, and of srnf_landmarks_check.
 */
SRNF_CHECKED int srnf_register_to_field_landmarks(const struct srnf_sht *sht, const double *field,
                                                  double norm2, const double *moving,
                                                  const struct srnf_register_options *options,
                                                  const struct srnf_landmarks *landmarks,
                                                  const struct srnf_context *context,
                                                  double rotation[9], struct srnf_warp *warp,
                                                  struct srnf_error *error);

/*
 * What srnf_register_landmarks asks of landmarks before it begins, with fields of a degree.
 * Errors: SRNF_EINVAL, with the landmark as element (-1: none).
 */
SRNF_CHECKED int srnf_landmarks_check(const struct srnf_landmarks *landmarks, size_t degree,
                                      struct srnf_error *error);

/*
 * How far a warp leaves landmarks apart.
 *   angles     [out] double[n], radians between gamma(fixed_j) and moving_j
 * Errors: as srnf_warp_apply.
 */
SRNF_CHECKED int srnf_landmarks_measure(const struct srnf_warp *warp,
                                        const struct srnf_landmarks *landmarks, double *angles);

/*
 * The point of the sphere whose image on a surface is nearest to a given point: the best of a grid
 * of 4 (degree + 1) rows and of the places around it, refined by Newton's method
 * (core/surface/nearest.c).
 *   coefficients  [in]  double[3][(degree+1)^2], degree 1 .. SRNF_DEGREE_MAX
 *   positions     [in]  double[n][3], in the units of the surface
 *   points        [out] double[n][3], unit vectors
 *   distances     [out] double[n] from the positions to the surface
 * Errors: SRNF_EINVAL (numbers that are not finite, degree), SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_surface_nearest(size_t degree, const double *coefficients, size_t n,
                                      const double *positions, const struct srnf_context *context,
                                      double *points, double *distances);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

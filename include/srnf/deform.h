/*
 * deform.h - shooting, parallel transport and deformation transfer between surfaces as they lie in
 * space: registered to each other, in either metric, and placed (core/pullback).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * srnf/transport.h and srnf/pullback.h take surfaces as they are parameterized and know no
 * translations. Here they are registered first, if that is asked for: the surface that a velocity
 * is toward, or the deformed one, is laid on the surface that it starts from; then these, with the
 * vector or the deformation, on the surface where the answer lies, which stays as it is. And what
 * is reached is placed so that its area centroid goes as those of the surfaces go that a velocity
 * points between, or as the l = 0 coefficients of a motion say.
 *
 * In the pulled-back metric energies keep the meaning that they have in the space of SRNFs, squared
 * distances from the straight line there: here they tell how far the two metrics are apart.
 *
 * All return SRNF_OK or an error of the step that failed, with the result empty but for `step`, a
 * static string that names it. Each step tells its progress from 0 to 1.
 */
#ifndef SRNF_PUBLIC_DEFORM_H
#define SRNF_PUBLIC_DEFORM_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/register.h"
#include "srnf/surface.h"
#include "srnf/transport.h"
#include "srnf/pullback.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* A velocity at a surface: the first of the three that is not NULL. */
struct srnf_velocity {
    const double *motion; /* [3][(L+1)^2] of the points, l = 0 terms included */
    const double *toward; /* [3][(L+1)^2] the surface that is reached in one unit of time */
    const double *field;  /* [3][n_theta][n_phi] in the space of SRNFs */
};

struct srnf_deform_options {
    const struct srnf_register_options *registration; /* NULL: surfaces as they are parameterized */
    bool pullback; /* in the pulled-back metric, not that of L2 in the space of SRNFs */
};

/* Segments of paths in the pulled-back metric: of that which a vector is carried along, whose error
   is of second order in them, and of all others, for each unit of time begun. */
#define SRNF_DEFORM_TRANSPORT_SEGMENTS ((size_t)16)
#define SRNF_DEFORM_SEGMENTS ((size_t)8)

/* A path in the pulled-back metric: a geodesic between surfaces, or an exponential. */
struct srnf_deform_path {
    struct srnf_path_figures figures;
    size_t segments; /* 0: there is none */
    size_t iterations;
    double residual; /* relative: the gradient of a geodesic, what the equations of an exponential
                        were left with */
    bool converged;
};

/* The paths of an answer; all zero in L2. */
struct srnf_deform_paths {
    struct srnf_deform_path toward; /* to the surface that a velocity is toward */
    struct srnf_deform_path along;  /* that a vector was carried along */
    struct srnf_deform_path *shots; /* [n] to the surfaces reached, none at time 0 */
    size_t n;
    double norm_from, norm;       /* of the vector before and after transport */
    double deformation, distance; /* of a transfer: lengths of its geodesics */
    bool converged;               /* all of them */
};

struct srnf_deform_shoot {
    const char *step;
    struct srnf_registration toward; /* of the surface toward; empty where nothing was registered */
    struct srnf_shot shot;           /* l = 0 terms: see above */
    struct srnf_surface_measures *measures; /* [n] of the surfaces */
    struct srnf_deform_paths paths;
};

/*
 * The surfaces at n times along the geodesic from a surface with a velocity, by srnf_shoot, or by
 * one exponential for each time, so that no surface depends on the other times asked for. In the
 * pulled-back metric a velocity is a motion: given as one, the logarithm of the surface that it is
 * toward, or the motion whose Q_* is nearest to a field.
 *   surface, times  [in] as of srnf_shoot
 *   result          [out] freed with srnf_deform_shoot_clear
 * Errors: as srnf_shoot, srnf_register, srnf_pullback_log and srnf_pullback_exp.
 */
SRNF_CHECKED int srnf_deform_shoot(const struct srnf_sht *sht, const double *surface,
                                   const struct srnf_velocity *velocity, size_t n,
                                   const double *times, const struct srnf_deform_options *options,
                                   const struct srnf_context *context,
                                   struct srnf_deform_shoot *result, struct srnf_error *error);
void srnf_deform_shoot_clear(struct srnf_deform_shoot *result);

struct srnf_deform_transport {
    const char *step;
    struct srnf_registration toward, from; /* of the surface toward to `from`; of that to `to` */
    double *velocity;                      /* [3][n_theta][n_phi] the vector at `to` as a field */
    struct srnf_tangent tangent;           /* and as a motion, with the l = 0 terms of the one
                                              given; residual, in the pulled-back metric, is what of
                                              a field was no motion of `from` */
    struct srnf_shot shot;                 /* the surface that it leads to from `to` at t = 1 */
    struct srnf_surface_measures measures; /* of that */
    struct srnf_deform_paths paths;
};

/*
 * A vector at `from` carried to `to`, by srnf_transport or along the geodesic between them, and the
 * surface that it leads to.
 *   vector  [in] a field belongs to surfaces as they are parameterized: register nothing then
 *   result  [out] freed with srnf_deform_transport_clear
 * Errors: as srnf_deform_shoot, srnf_transport and srnf_pullback_transport. SRNF_WNOT_CONVERGED of
 * srnf_transport is one here: the result is empty.
 */
SRNF_CHECKED int srnf_deform_transport(const struct srnf_sht *sht, const double *from,
                                       const double *to, const struct srnf_velocity *vector,
                                       const struct srnf_deform_options *options,
                                       const struct srnf_context *context,
                                       struct srnf_deform_transport *result,
                                       struct srnf_error *error);
void srnf_deform_transport_clear(struct srnf_deform_transport *result);

struct srnf_deform_transfer {
    const char *step;
    struct srnf_registration deformed, source; /* deformed to source; source to target */
    struct srnf_transferred transferred;
    double scale; /* what multiplies that back to the units that the target came from */
    struct srnf_surface_measures measures;
    struct srnf_deform_paths paths;
};

/*
 * A target deformed as source is to deformed, by srnf_transfer or srnf_pullback_transfer, its size
 * included: with SRNF_TRANSFER_RATIO a change of size goes to where the target has its size, into
 * the scale or, where that is 1 and the area is not, into the coefficients; with
 * SRNF_TRANSFER_ABSOLUTE all three are taken in the units that their scales lead back to, and the
 * scale stays.
 *   surfaces  [in] source, deformed, target: double[3][(L+1)^2] each
 *   scales    [in] what multiplies each back to its own units, above 0
 *   result    [out] freed with srnf_deform_transfer_clear
 * Errors: as srnf_transfer, srnf_register and srnf_pullback_transfer; SRNF_EINVAL for a scale.
 */
SRNF_CHECKED int srnf_deform_transfer(const struct srnf_sht *sht, const double *const surfaces[3],
                                      const double scales[3], enum srnf_transfer_size size,
                                      const struct srnf_deform_options *options,
                                      const struct srnf_context *context,
                                      struct srnf_deform_transfer *result,
                                      struct srnf_error *error);
void srnf_deform_transfer_clear(struct srnf_deform_transfer *result);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

/*
 * transport.h - shooting, parallel transport and deformation transfer in the space of SRNFs
 * (core/geodesic).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * The space of SRNFs is flat: a geodesic is a straight line there, and a vector that is carried
 * along it stays the same vector field (the paper, section 4.2). A velocity is therefore a field
 * v = double[3][n_theta][n_phi] on the grid, whatever it was made from:
 *   toward a surface g   v = Q(g) - Q(f), so that the line is at Q(g) for t = 1
 *                        (srnf_velocity_toward)
 *   of a surface moving  v = Q_*f(w) for a vector w = double[3][(L+1)^2], the motion of its points
 *                        (srnf_field_differential)
 * All surfaces are taken as they are parameterized; srnf_registration_apply lays others along.
 */
#ifndef SRNF_PUBLIC_TRANSPORT_H
#define SRNF_PUBLIC_TRANSPORT_H

#include "srnf/base.h"
#include "srnf/sphere.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* v = Q(toward) - Q(surface), double[3][n_theta][n_phi]. workspace as for srnf_field. Errors:
   SRNF_ENOMEM. */
SRNF_CHECKED int srnf_velocity_toward(const struct srnf_sht *sht, const double *surface,
                                      const double *toward, double *velocity);

#define SRNF_SHOOT_TIMES_MAX ((size_t)101)
#define SRNF_SHOOT_TIME_MAX 10.0

struct srnf_shot {
    size_t degree, n;
    double *coefficients; /* [n][3][(L+1)^2]; l = 0 terms those of the surface shot from. Owned */
    double *energy;       /* [n] ||Q(f_t) - q_t||^2: how far the line is from any surface. Owned */
    double *relative_energy; /* [n] the same divided by ||q_t||^2; part of energy */
    double transforms;       /* cost in gradient transforms of three coordinates */
};

/*
 * Shooting (the paper, section 4.2): the surfaces f_t with Q(f_t) = Q(f) + t v. The line is walked
 * outwards from t = 0 on either side in steps that are short against ||Q(f)||, each inverted from
 * the extrapolation of those before; f_t is the surface nearest to the line where the line has left
 * the image of Q.
 *   surface   [in] f, double[3][(L+1)^2]
 *   velocity  [in] v, double[3][n_theta][n_phi]
 *   n, times  [in] 1 .. SRNF_SHOOT_TIMES_MAX times of at most SRNF_SHOOT_TIME_MAX in size, in any
 *                  order
 *   shot      [out] surfaces in the order of times; freed with srnf_shot_clear
 * Errors: SRNF_EINVAL, SRNF_ENOMEM, SRNF_ECANCELED, and SRNF_ENUMERIC where q_t vanishes on the
 * way.
 */
SRNF_CHECKED int srnf_shoot(const struct srnf_sht *sht, const double *surface,
                            const double *velocity, size_t n, const double *times,
                            const struct srnf_context *context, struct srnf_shot *shot,
                            struct srnf_error *error);
void srnf_shot_clear(struct srnf_shot *shot);

/* The vector w at a surface whose Q_*f(w) is nearest to a given v. */
struct srnf_tangent {
    double *coefficients; /* [3][(L+1)^2], l = 0 terms 0; owned, srnf_tangent_clear */
    double norm;          /* ||v|| */
    double residual;      /* ||Q_*f(w) - v||, the part of v that no motion of the surface gives */
    size_t iterations;    /* of conjugate gradients */
    bool converged;
    double transforms;
};

/*
 * Parallel transport (the paper, Algorithm 4): v stays constant, and is expressed as the motion of
 * another surface. The paper inverts Q(f) + eps v for a small eps; here the limit of that is
 * computed, the least-squares solution of Q_*f(w) = v, which is exact to rounding, linear in v and
 * free of a choice of eps. v = Q_*f(w) gives back w. The images of Q_* at two surfaces differ, so
 * a transported vector has a residual in general: |Q_*f(w)|^2 = |v|^2 - residual^2.
 *   surface   [in] f, where the vector arrives, double[3][(L+1)^2]
 *   velocity  [in] v, double[3][n_theta][n_phi]
 * Errors: SRNF_EINVAL, SRNF_ENOMEM, SRNF_ECANCELED; SRNF_WNOT_CONVERGED is a result.
 */
SRNF_CHECKED int srnf_transport(const struct srnf_sht *sht, const double *surface,
                                const double *velocity, const struct srnf_context *context,
                                struct srnf_tangent *tangent, struct srnf_error *error);
void srnf_tangent_clear(struct srnf_tangent *tangent);

/* What becomes of size in a transfer. */
enum srnf_transfer_size {
    SRNF_TRANSFER_RATIO = 0, /* shape and size apart: the shapes at unit area, the size by ratio */
    SRNF_TRANSFER_ABSOLUTE = 1, /* all three surfaces as they are, in one unit */
};

struct srnf_transferred {
    double *coefficients; /* [3][(L+1)^2]; owned, srnf_transferred_clear */
    double size_ratio;    /* sqrt(area(deformed) / area(source)) */
    double energy;        /* ||Q(g) - q||^2, of the shapes at unit area for SRNF_TRANSFER_RATIO */
    double relative_energy;
    double transforms;
};

/*
 * Deformation transfer (the paper, Algorithm 6): the surface g with
 *   Q(g) = Q(target) + Q(deformed) - Q(source).
 * SRNF_TRANSFER_RATIO takes the three at unit area, and gives g the area of the target times
 * area(deformed) / area(source): what shrinks to two thirds shrinks another to two thirds, and each
 * subject may be in a unit of its own. target = source gives the deformed surface in either way.
 *   source, deformed, target  [in] double[3][(L+1)^2], deformed in the units of source
 *   transferred               [out] in the units of target; its l = 0 terms are those of target,
 *                                   plus the change from source to deformed in proportion to size
 * Errors: as srnf_shoot; SRNF_EDEGENERATE where one of them has no area.
 */
SRNF_CHECKED int srnf_transfer(const struct srnf_sht *sht, const double *source,
                               const double *deformed, const double *target,
                               enum srnf_transfer_size size, const struct srnf_context *context,
                               struct srnf_transferred *transferred, struct srnf_error *error);
void srnf_transferred_clear(struct srnf_transferred *transferred);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif

/*
 * pullback.h - shoot, transport and transfer in the pulled-back metric, for surfaces that
 * transport.c has loaded and laid on each other.
 */
#ifndef SRNFD_COMPUTE_PULLBACK_H
#define SRNFD_COMPUTE_PULLBACK_H

#include "srnf.h"

/* Segments of paths: of transport, whose error is of second order in them, and of all others. */
#define COMPUTE_PULLBACK_TRANSPORT_SEGMENTS ((size_t)16)
#define COMPUTE_PULLBACK_SEGMENTS ((size_t)8)

/* A path of the answer: a geodesic between surfaces, or an exponential. */
struct compute_pullback_leg {
    struct srnf_path_figures path;
    size_t segments, iterations;
    double residual; /* relative: the gradient of a geodesic, what the equations of an exponential
                        were left with */
    bool converged;
};

struct compute_pullback {
    bool asked;                         /* false: all else is empty */
    struct compute_pullback_leg toward; /* to the surface that a velocity is toward; segments 0:
                                           none */
    struct compute_pullback_leg along;  /* that a vector was carried along */
    double norm_from, norm;             /* of the vector before and after transport */
    double deformation, distance;       /* of a transfer: lengths of its geodesics */
    bool converged;
    size_t n;
    struct compute_pullback_leg *shots; /* [n], owned: compute_pullback_clear */
};
void compute_pullback_clear(struct compute_pullback *pullback);

/* A velocity at a surface: the first of the three that is not NULL. */
struct compute_pullback_velocity {
    const double *motion; /* [3][(L+1)^2] */
    const double *toward; /* [3][(L+1)^2] */
    const double *field;  /* [3][n_theta][n_phi]: the motion nearest to it is taken */
};

/*
 * Exponentials of t times the velocity, each with COMPUTE_PULLBACK_SEGMENTS segments for each unit
 * of time begun.
 *   line  [in] [3][n_theta][n_phi] the velocity as a field: energies are squared distances from
 *              Q(surface) + t line, as those of srnf_shoot
 *   shot  [out] as of srnf_shoot
 * This and what follows return 0, or a negative status with error filled and results empty.
 */
int compute_pullback_shoot(const struct srnf_sht *sht, const double *surface,
                           const struct compute_pullback_velocity *velocity, const double *line,
                           size_t n, const double *times, const struct srnf_context *context,
                           struct srnf_shot *shot, struct compute_pullback *pullback,
                           struct srnf_error *error);

/*
 * The vector carried along the geodesic from `from` to `to`, and the surface that it leads to.
 *   line     [out] [3][n_theta][n_phi] the vector at `to` as a field
 *   tangent  [out] the vector at `to`; residual is what of a field was no motion of `from`
 */
int compute_pullback_transport(const struct srnf_sht *sht, const double *from, const double *to,
                               const struct compute_pullback_velocity *vector,
                               const struct srnf_context *context, double *line,
                               struct srnf_tangent *tangent, struct srnf_shot *shot,
                               struct compute_pullback *pullback, struct srnf_error *error);

/* As srnf_transfer; energy is the squared distance from Q(target) + Q(deformed) - Q(source). */
int compute_pullback_transfer(const struct srnf_sht *sht, const double *source,
                              const double *deformed, const double *target,
                              enum srnf_transfer_size size, const struct srnf_context *context,
                              struct srnf_transferred *transferred,
                              struct compute_pullback *pullback, struct srnf_error *error);

#endif

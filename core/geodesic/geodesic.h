/*
 * geodesic.h - what geodesics, shooting and transport share.
 */
#ifndef SRNF_GEODESIC_INTERNAL_H
#define SRNF_GEODESIC_INTERNAL_H

#include "inversion/inversion.h"

/* transport.c: the vector at the state whose Q_* is nearest to a field, as srnf_transport has it,
   down to `tolerance` on the gradient. tangent is untouched on failure. */
SRNF_CHECKED int transport_pull_velocity(struct gauss_newton *system, const double *velocity,
                                         double tolerance, const struct srnf_context *context,
                                         struct srnf_tangent *tangent);

/* shoot.c: SRNF_EINVAL where srnf_shoot does not take these times. */
SRNF_CHECKED int geodesic_check_times(size_t n, const double *times, struct srnf_error *error);

/* shoot.c: as srnf_shoot, with a start for the surface at the only time, or NULL. */
SRNF_CHECKED int geodesic_shoot(const struct srnf_sht *sht, const double *surface,
                                const double *velocity, size_t n, const double *times,
                                const double *hint, const struct srnf_context *context,
                                struct srnf_shot *shot, struct srnf_error *error);

#endif

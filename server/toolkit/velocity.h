/*
 * velocity.h - what shoot, transport and transfer share: velocities and vectors as inputs,
 * whether and how surfaces are registered, and the keeping of surfaces that were reached.
 */
#ifndef SRNFD_TOOLKIT_VELOCITY_H
#define SRNFD_TOOLKIT_VELOCITY_H

#include "toolkit/process.h"
#include "compute/transport.h"

/*
 * Reads a required member that is exactly one of {"toward": id}, {"coefficients": {lmax, x, y, z}}
 * and {"srnf": {lmax, nTheta, nPhi, q}}, and sets it. degree: the largest of the surfaces that it
 * is used with, which coefficients may not exceed and whose working grid q must be on; toward may
 * be of any.
 */
void inputs_velocity(struct process_inputs *inputs, const char *name, long degree);
/* register, commonPose and method. */
void inputs_alignment(struct process_inputs *inputs);

/* From the canonical member; *numbers is owned by the caller (srnf_free). False with the problem
   set. */
bool velocity_read(const json_t *value, struct compute_velocity *velocity, double **numbers,
                   struct jobs_result *result);
/* Whether the method is pullback. */
bool alignment_pullback(const json_t *inputs);
/* options, or NULL where nothing is to be registered. */
const struct srnf_register_options *alignment_read(const json_t *inputs,
                                                   struct srnf_register_options *options);
/* Figures and options of a registration; null where there was none. */
json_t *alignment_json(const struct srnf_registration *registration,
                       const struct srnf_register_options *options);

/* segments, energy, length, speedVariation, iterations, residual, converged of a path in the
   pulled-back metric; null where there was none. */
json_t *pullback_leg_json(const struct compute_pullback_leg *leg);
/* The same of each shot, in an array. */
json_t *pullback_shots_json(const struct compute_pullback *pullback);

/* Stores a surface that a process has reached; its record, or NULL with the problem set. reference
   is the surface that deformation is measured from, where that is a stored one. */
json_t *keep_reached(struct jobs_run *run, const char *process, const char *name, size_t degree,
                     const double *coefficients, double scale,
                     const struct srnf_surface_measures *measures, const char *reference,
                     struct jobs_result *result);
/* The inputs of the results document: q of a velocity by its digest. */
json_t *velocity_inputs_for_results(const json_t *inputs, const char *name);

#endif

/*
 * velocity.h - what shoot, transport and transfer share: velocities and vectors as inputs, whether
 * and how surfaces are registered, loading the surfaces, and the keeping of those that were
 * reached.
 */
#ifndef SRNFD_TOOLKIT_VELOCITY_H
#define SRNFD_TOOLKIT_VELOCITY_H

#include "compute/group.h"
#include "toolkit/registration_options.h"
#include "toolkit/registration_report.h"
#include "toolkit/table.h"

/* ---- Inputs ---------------------------------------------------------------------------------- */

/* A velocity as it is typed: one of the three. */
struct velocity {
    char toward[STORE_ID_MAX]; /* a surface or mesh; "" where it is given by numbers */
    size_t degree;             /* of motion */
    double *motion;            /* [3][(degree+1)^2], or NULL */
    double *field;             /* [3][n_theta][n_phi], or NULL */
};

/*
 * A required input that is exactly one of {"toward": id}, {"coefficients": {lmax, x, y, z}} and
 * {"srnf": {lmax, nTheta, nPhi, q}}. It comes after the surfaces that it is used with in its table:
 * coefficients may not exceed the largest of their degrees, and q is on the working grid of that;
 * toward may be of any.
 */
extern const struct input_own velocity_own;
#define VELOCITY_TEXT                                                                             \
    " toward: the difference of the SRNFs to that surface; coefficients: the motion of the "      \
    "points, harmonic, of at most the degree of the surface; srnf: a field in the space of "      \
    "SRNFs on the working grid of its degree (nTheta = ceil(3 (lmax + 1) / 2), nPhi = 2 nTheta; " \
    "with register false), as transport gives it. In the units of the stored coefficients."

/* register, commonPose and method, of typed inputs with these members and an int method; their
   table's check is registration_one_spelling. */
#define DEFORMATION_INPUTS(typed, what, they_are)                                                \
    REGISTER_INPUT(typed, what                                                                   \
                   ", with the default options of register but both ways; false: as " they_are   \
                   " parameterized."),                                                           \
        COMMON_POSE_INPUT(                                                                       \
            typed, "Where surfaces are registered: they share a pose, and nothing is rotated."), \
    {                                                                                            \
        "method", INPUT_CHOICE, offsetof(struct typed, method),                                  \
            "srnf: straight lines in the space of SRNFs, inverted numerically. pullback: "       \
            "geodesics within the space of surfaces, in the metric that the SRNF pulls back to " \
            "it, at many times the cost.",                                                       \
            .choices = deformation_methods                                                       \
    }
enum deformation_method { DEFORMATION_SRNF, DEFORMATION_PULLBACK };
extern const char *const deformation_methods[];

/* ---- Running --------------------------------------------------------------------------------- */

/* What a deformation is computed from, of one degree. */
struct deformation {
    struct jobs *jobs;
    struct compute_group group;
    const double *const *surfaces; /* those of the group */
    const struct srnf_sht *sht;
    struct srnf_velocity velocity;
    double *motion;
    struct srnf_register_options registration;
    struct srnf_deform_options options;
};

/*
 * Loads n surfaces, the one that a velocity is toward as the last of them, and begins the phase of
 * the job after that.
 *   velocity  [in] NULL: there is none
 * Returns 0, or a negative status with the problem in result. deformation_close in any case.
 */
int deformation_open(struct jobs_run *run, size_t n, const char *const *ids,
                     const struct velocity *velocity, bool registered, bool common_pose,
                     enum deformation_method method, struct deformation *deformation,
                     struct jobs_result *result);
void deformation_close(struct deformation *deformation);
/* Adds pose-differs to the document where nothing is registered and surfaces first and second do
   not share a pose (toolkit/pair.h). document: may be NULL, and stays it. Returns it, or NULL with
   the problem in result. */
json_t *deformation_warn_pose(struct jobs_run *run, const struct deformation *deformation,
                              size_t first, size_t second, const char *what, json_t *document,
                              struct jobs_result *result);

/* Stores a surface that a process has reached; its record, or NULL with the problem set. reference
   is the surface that deformation is measured from, where that is a stored one. */
json_t *keep_reached(struct jobs_run *run, const char *process, const char *name, size_t degree,
                     const double *coefficients, double scale,
                     const struct srnf_surface_measures *measures, const char *reference,
                     struct jobs_result *result);

/* ---- Results --------------------------------------------------------------------------------- */

/* A path in the pulled-back metric, for the text of an output: what path_json gives. */
#define PATH_TEXT                                                                                \
    "segments, energy, length, speedVariation, iterations, residual (relative: the gradient of " \
    "a geodesic, what the equations of an exponential were left with), converged"

/* Figures and options of a registration; null where there was none. */
json_t *alignment_json(const struct srnf_registration *registration,
                       const struct srnf_register_options *options);
/* segments, energy, length, speedVariation, iterations, residual, converged; null where there was
   none. */
json_t *path_json(const struct srnf_deform_path *path);
/* The same of each shot, in an array. */
json_t *path_shots_json(const struct srnf_deform_paths *paths);

#endif
